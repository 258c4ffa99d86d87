// The feature extractor on the sensor: fx_front and fx_back. Pixels of one picture after the other in, records of features out.
//
// Settings hold still while pictures run. in_ready is 0 while rows of other octaves run, between frames, and while the back cannot take a row;
// n_not_ready counts those clocks. The other counts are those of fx_back. Reset is synchronous.
module extractor_core #(
    parameter MAX_WIDTH  = 640,
    parameter PIX_BITS   = 8,
    parameter OCTAVES    = 1,
    parameter HARRIS     = 0,
    parameter CELL_LOG2  = 4,
    parameter PER_CELL   = 1,
    parameter RING_LOG2  = 6,
    parameter ENGINES    = 2,
    parameter FIFO_DEPTH = 16,
    parameter DESC_BITS  = 256,
    parameter SYMMETRIC  = 0,
    parameter SUBPIXEL   = 1
) (
    input  logic                 clk,
    input  logic                 rst,
    input  logic [         15:0] width,
    input  logic [         15:0] height,
    input  logic [ PIX_BITS-1:0] threshold,
    input  logic [          1:0] policy,
    input  logic [         15:0] target,
    input  logic [          3:0] angle_bits,
    input  logic                 in_valid,
    output logic                 in_ready,
    input  logic [ PIX_BITS-1:0] in_pixel,
    output logic [ PIX_BITS-1:0] threshold_now,
    output logic                 out_valid,
    input  logic                 out_ready,
    output logic [         15:0] out_x_q4,
    output logic [         15:0] out_y_q4,
    output logic [ PIX_BITS-1:0] out_score,
    output logic [          7:0] out_angle,
    output logic [          1:0] out_octave,
    output logic                 out_frame,
    output logic [DESC_BITS-1:0] out_descriptor,
    output logic [         31:0] n_corners,
    output logic [         31:0] n_without_patch,
    output logic [         31:0] n_unselected,
    output logic [         31:0] n_dropped,
    output logic [         31:0] n_late,
    output logic [         31:0] n_features,
    output logic [         31:0] n_stalled,
    output logic [         31:0] n_not_ready
);
  logic req, req_virtual, row_ok, sm_valid, corner_valid, row_end, row_end_virtual, frame_end;
  logic [1:0] req_octave, octave;
  logic [15:0] req_row, row, sm_x, sm_y, corner_x, corner_y, corner_rank;
  logic [PIX_BITS-1:0] sm_pixel, corner_score;
  logic [9*PIX_BITS-1:0] corner_resp;

  fx_front #(.MAX_WIDTH(MAX_WIDTH), .PIX_BITS(PIX_BITS), .OCTAVES(OCTAVES), .HARRIS(HARRIS)) front (
      .clk, .rst, .width, .height, .threshold(threshold_now), .in_valid, .in_ready, .in_pixel, .req, .req_octave, .req_row, .req_virtual, .row_ok,
      .out_octave(octave), .out_row(row), .sm_valid, .sm_x, .sm_y, .sm_pixel,
      .corner_valid, .corner_x, .corner_y, .corner_score, .corner_resp, .corner_rank, .row_end, .row_end_virtual, .frame_end);

  fx_back #(
      .MAX_WIDTH(MAX_WIDTH), .PIX_BITS(PIX_BITS), .OCTAVES(OCTAVES), .HARRIS(HARRIS), .CELL_LOG2(CELL_LOG2), .PER_CELL(PER_CELL), .RING_LOG2(RING_LOG2),
      .ENGINES(ENGINES), .FIFO_DEPTH(FIFO_DEPTH), .DESC_BITS(DESC_BITS), .SYMMETRIC(SYMMETRIC), .SUBPIXEL(SUBPIXEL)
  ) back (
      .clk, .rst, .width, .height, .threshold, .policy, .target, .angle_bits, .req, .req_octave, .req_row, .req_virtual, .row_ok,
      .in_octave(octave), .in_row(row), .sm_valid, .sm_x, .sm_y, .sm_pixel,
      .corner_valid, .corner_x, .corner_y, .corner_score, .corner_resp, .corner_rank, .row_end, .row_end_virtual, .frame_end, .threshold_now,
      .out_valid, .out_ready, .out_x_q4, .out_y_q4, .out_score, .out_angle, .out_octave, .out_frame, .out_descriptor,
      .n_corners, .n_without_patch, .n_unselected, .n_dropped, .n_late, .n_features, .n_stalled);

  always_ff @(posedge clk) begin
    if (rst) n_not_ready <= '0;
    else if (!in_ready) n_not_ready <= n_not_ready + 32'd1;
  end
endmodule
