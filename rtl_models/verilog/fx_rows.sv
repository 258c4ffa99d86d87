// Row arbiter: which raster slot of which octave the front takes in this clock.
//
// A row of octave k has w_k + 1 slots, a picture h_k + 1 rows (w_k = width >> k, h_k = height >> k): the virtual column and row after the last
// ones let border corners out. After a row of octave k follow, if there are any, its virtual row, and after odd rows the row of octave k + 1 that became
// whole; then the next row of octave 0. An octave under 33 pixels a side is not built. A frame ends with DRAIN empty slots.
// enable = this clock takes a slot: a row starts only with row_ok, and real slots of octave 0 wait for in_valid. Reset is synchronous.
module fx_rows #(
    parameter MAX_WIDTH = 640,
    parameter OCTAVES   = 1,
    parameter COLUMN    = 10,
    parameter ADDRESS   = 10
) (
    input  logic               clk,
    input  logic               rst,
    input  logic [       15:0] width,
    input  logic [       15:0] height,
    input  logic               in_valid,
    output logic               in_ready,
    output logic               req,
    output logic [        1:0] req_octave,
    output logic [       15:0] req_row,
    output logic               req_virtual,
    input  logic               row_ok,
    output logic               enable,
    output logic               first,         // column 0
    output logic               last,          // the virtual column
    output logic               draining,
    output logic               real_pixel,    // neither virtual column nor virtual row
    output logic               real_column,
    output logic               whole,        // FAST and smoothing have their 7x7 pixels
    output logic               peak,          // non-maximum suppression has its 3x3 differences
    output logic               half,          // completes a pixel of the next octave
    output logic               half_scale,    // the pixel comes from the row buffer
    output logic [ COLUMN-1:0] column,
    output logic [ADDRESS-1:0] address        // of the column in memories of all octaves
);
  localparam [2:0] DRAIN = 3'd7;
  localparam [15:0] SIDE_MIN = 16'd33;

  logic [1:0] octave;
  logic [COLUMN-1:0] x;
  logic [15:0] row_0;  // row of octave 0; row y of octave k starts after row 2^k y + 2^k - 1
  logic virtual_row;
  logic [2:0] drain;

  logic [15:0] w, h, row;
  assign w   = width >> octave;
  assign h   = height >> octave;
  assign row = row_0 >> octave;

  logic column_0, end_column, last_row, next_built, goes_deeper, start, started;
  assign draining    = drain != 3'd0;
  assign column_0    = x == '0;
  assign end_column  = 16'(x) == w;
  assign last_row    = row == h - 16'd1;
  assign next_built  = {30'd0, octave} + 32'd1 < OCTAVES && w >> 1 >= SIDE_MIN && h >> 1 >= SIDE_MIN;
  assign goes_deeper = row[0] && next_built;
  assign start       = column_0 && !draining;
  assign started     = !column_0 || row_ok;

  assign req         = start;
  assign req_octave  = octave;
  assign req_row     = virtual_row ? h : row;
  assign req_virtual = virtual_row;
  assign first       = start;
  assign last        = end_column && !draining;
  assign real_column = !end_column && !draining;
  assign real_pixel  = real_column && !virtual_row;
  assign half_scale  = octave != 2'd0;
  assign in_ready    = real_pixel && !half_scale && started;
  assign enable      = draining || (started && (in_valid || !real_pixel || half_scale));
  assign whole      = real_pixel && x >= 6 && row >= 16'd6;
  assign peak        = x >= 7 && (virtual_row || row >= 16'd7) && !draining;
  assign half        = real_pixel && x[0] && goes_deeper;
  assign column      = x;

  generate
    if (OCTAVES == 1) begin : one
      assign address = x[ADDRESS-1:0];
    end else begin : several
      localparam [31:0] BASE_1 = MAX_WIDTH, BASE_2 = MAX_WIDTH + (MAX_WIDTH >> 1), BASE_3 = BASE_2 + (MAX_WIDTH >> 2);
      logic [ADDRESS-1:0] base;
      assign base    = octave == 2'd0 ? '0 : octave == 2'd1 ? BASE_1[ADDRESS-1:0] : octave == 2'd2 ? BASE_2[ADDRESS-1:0] : BASE_3[ADDRESS-1:0];
      assign address = base + ADDRESS'(x);
    end
  endgenerate

  always_ff @(posedge clk) begin
    if (rst) begin
      octave      <= '0;
      x           <= '0;
      row_0       <= '0;
      virtual_row <= 1'b0;
      drain       <= '0;
    end else if (draining) begin
      drain <= drain - 3'd1;
    end else if (enable) begin
      x <= end_column ? '0 : x + 1'b1;
      if (end_column) begin
        virtual_row <= last_row && !virtual_row;
        if (!last_row || virtual_row) begin
          if (goes_deeper) octave <= octave + 2'd1;
          else begin
            octave <= '0;
            row_0  <= row_0 == height - 16'd1 ? '0 : row_0 + 16'd1;
            if (row_0 == height - 16'd1) drain <= DRAIN;
          end
        end
      end
    end
  end
endmodule
