// The extractor's front: pixels in, corners and smoothed pixels of all octaves out.
//
// Inputs: pixels of octave 0 in raster order, frame after frame; a row of any octave starts when row_ok answers req. Outputs: the smoothed pixel and the corner that
// a raster slot (x, y) completes, at (x-3, y-3) and (x-4, y-4), and row_end with a row's last slot: FRONT_LATENCY = 6 enabled clocks after the slot was
// taken, for one clock. The whole pipeline has one enable. corner_resp holds the nine differences by rows, the upper left one lowest; corner_rank is the score,
// or the Harris rank. width is 7 .. MAX_WIDTH, height at least 7; threshold holds still within a frame. Reset is synchronous.
module fx_front #(
    parameter MAX_WIDTH = 640,
    parameter PIX_BITS  = 8,
    parameter OCTAVES   = 1,
    parameter HARRIS    = 0
) (
    input  logic                  clk,
    input  logic                  rst,
    input  logic [          15:0] width,
    input  logic [          15:0] height,
    input  logic [  PIX_BITS-1:0] threshold,
    input  logic                  in_valid,
    output logic                  in_ready,
    input  logic [  PIX_BITS-1:0] in_pixel,
    output logic                  req,
    output logic [           1:0] req_octave,
    output logic [          15:0] req_row,
    output logic                  req_virtual,
    input  logic                  row_ok,
    output logic [           1:0] out_octave,
    output logic [          15:0] out_row,
    output logic                  sm_valid,
    output logic [          15:0] sm_x,
    output logic [          15:0] sm_y,
    output logic [  PIX_BITS-1:0] sm_pixel,
    output logic                  corner_valid,
    output logic [          15:0] corner_x,
    output logic [          15:0] corner_y,
    output logic [  PIX_BITS-1:0] corner_score,
    output logic [9*PIX_BITS-1:0] corner_resp,
    output logic [          15:0] corner_rank,
    output logic                  row_end,
    output logic                  row_end_virtual,
    output logic                  frame_end
);
  localparam HALF = MAX_WIDTH / 2, QUARTER = MAX_WIDTH / 4, EIGHTH = MAX_WIDTH / 8;
  localparam WORDS = MAX_WIDTH + (OCTAVES > 1 ? HALF : 0) + (OCTAVES > 2 ? QUARTER : 0) + (OCTAVES > 3 ? EIGHTH : 0);
  localparam ADDRESS = $clog2(WORDS), COLUMN = $clog2(MAX_WIDTH + 1), HALF_ADDRESS = $clog2(HALF);

  logic en, first, last, draining, real_pixel, real_column, whole, peak, half_scale;
  logic [ADDRESS-1:0] address;
  // What only half-scale rows look at.
  /* verilator lint_off UNUSEDSIGNAL */
  logic half;
  logic [COLUMN-1:0] column;
  /* verilator lint_on UNUSEDSIGNAL */
  fx_rows #(
      .MAX_WIDTH(MAX_WIDTH),
      .OCTAVES  (OCTAVES),
      .COLUMN   (COLUMN),
      .ADDRESS  (ADDRESS)
  ) rows (
      .clk(clk),
      .rst(rst),
      .width(width),
      .height(height),
      .in_valid(in_valid),
      .in_ready(in_ready),
      .req(req),
      .req_octave(req_octave),
      .req_row(req_row),
      .req_virtual(req_virtual),
      .row_ok(row_ok),
      .enable(en),
      .first(first),
      .last(last),
      .draining(draining),
      .real_pixel(real_pixel),
      .real_column(real_column),
      .whole(whole),
      .peak(peak),
      .half(half),
      .half_scale(half_scale),
      .column(column),
      .address(address)
  );

  // What a slot carries along: bit or element s belongs to the slot taken s + 1 enabled clocks ago.
  logic [5:0] first_at, last_at, whole_at, peak_at;
  logic pixel_at_0, half_scale_at_0;
  // The last ones belong to ranks, which are written later than anything leaves.
  localparam ADDRESSES = HARRIS != 0 ? 8 : 5;
  logic [ADDRESSES-1:0] column_at;
  logic [ADDRESSES*ADDRESS-1:0] address_at;
  always_ff @(posedge clk) begin
    if (rst) begin
      first_at   <= '0;
      last_at    <= '0;
      column_at  <= '0;
      whole_at  <= '0;
      peak_at    <= '0;
      pixel_at_0 <= 1'b0;
    end else if (en) begin
      first_at   <= {first_at[4:0], first};
      last_at    <= {last_at[4:0], last};
      column_at  <= {column_at[ADDRESSES-2:0], real_column};
      whole_at  <= {whole_at[4:0], whole};
      peak_at    <= {peak_at[4:0], peak};
      pixel_at_0 <= real_pixel;
    end
  end
  always_ff @(posedge clk) begin
    if (en) begin
      half_scale_at_0 <= half_scale;
      address_at      <= {address_at[(ADDRESSES-1)*ADDRESS-1:0], address};
    end
  end

  logic [PIX_BITS-1:0] full_pixel, half_pixel, pixel;
  always_ff @(posedge clk) if (en && real_pixel && !half_scale) full_pixel <= in_pixel;
  assign pixel = half_scale_at_0 ? half_pixel : full_pixel;

  logic [16*PIX_BITS-1:0] circle;
  logic [PIX_BITS-1:0] centre, difference;
  logic [7*PIX_BITS-1:0] middle;
  // What only half-scale rows and Harris ranks look at.
  /* verilator lint_off UNUSEDSIGNAL */
  logic [4*PIX_BITS-1:0] newest;
  logic [3*7*8-1:0] right;
  logic found;
  /* verilator lint_on UNUSEDSIGNAL */
  fx_window #(
      .PIX_BITS(PIX_BITS),
      .WORDS   (WORDS),
      .ADDRESS (ADDRESS)
  ) window (
      .clk(clk),
      .en(en),
      .read(real_pixel),
      .read_address(address),
      .write(pixel_at_0),
      .write_address(address_at[0+:ADDRESS]),
      .pixel(pixel),
      .circle(circle),
      .centre(centre),
      .middle(middle),
      .newest(newest),
      .right(right)
  );

  fx_fast #(
      .PIX_BITS(PIX_BITS)
  ) fast (
      .clk(clk),
      .en(en),
      .circle(circle),
      .centre(centre),
      .whole(whole_at[3]),
      .difference(difference)
  );

  fx_nms #(
      .PIX_BITS(PIX_BITS),
      .WORDS   (WORDS),
      .ADDRESS (ADDRESS)
  ) nms (
      .clk(clk),
      .rst(rst),
      .en(en),
      .threshold(threshold),
      .read(column_at[3]),
      .read_address(address_at[3*ADDRESS+:ADDRESS]),
      .column(column_at[4]),
      .write_address(address_at[4*ADDRESS+:ADDRESS]),
      .difference(difference),
      .peak(peak_at[5]),
      .found(found),
      .corner_valid(corner_valid),
      .corner_score(corner_score),
      .corner_resp(corner_resp)
  );

  fx_smooth #(
      .PIX_BITS(PIX_BITS)
  ) smooth (
      .clk(clk),
      .rst(rst),
      .en(en),
      .middle(middle),
      .whole(whole_at[5]),
      .sm_valid(sm_valid),
      .sm_pixel(sm_pixel)
  );

  generate
    if (OCTAVES > 1) begin : halves
      logic half_at_0, half_at_1;
      logic [HALF_ADDRESS-1:0] place_0, place_1;
      always_ff @(posedge clk) begin
        if (rst) begin
          half_at_0 <= 1'b0;
          half_at_1 <= 1'b0;
        end else if (en) begin
          half_at_0 <= half;
          half_at_1 <= half_at_0;
        end
      end
      always_ff @(posedge clk) begin
        if (en) begin
          place_0 <= column[HALF_ADDRESS:1];
          place_1 <= place_0;
        end
      end
      fx_half #(
          .PIX_BITS(PIX_BITS),
          .WORDS   (HALF),
          .ADDRESS (HALF_ADDRESS)
      ) half_rows (
          .clk(clk),
          .en(en),
          .read(real_pixel && half_scale),
          .read_address(column[HALF_ADDRESS-1:0]),
          .pixel(half_pixel),
          .write(half_at_1),
          .write_address(place_1),
          .newest(newest)
      );
    end else begin : no_halves
      assign half_pixel = '0;
    end

    if (HARRIS != 0) begin : ranked
      logic [15:0] rank;
      fx_harris #(
          .WORDS  (WORDS),
          .ADDRESS(ADDRESS)
      ) harris (
          .clk(clk),
          .en(en),
          .right(right),
          .write(column_at[7]),
          .write_address(address_at[7*ADDRESS+:ADDRESS]),
          .read(column_at[5]),
          .read_address(address_at[5*ADDRESS+:ADDRESS]),
          .rank(rank)
      );
      always_ff @(posedge clk) begin
        if (rst) corner_rank <= '0;
        else if (found) corner_rank <= rank;
      end
    end else begin : unranked
      assign corner_rank = 16'(corner_score);
    end
  endgenerate

  // A row is longer than the pipeline, so the arbiter still stands in the row whose first slot comes out, or drains with the last one.
  logic [COLUMN-1:0] out_x;
  always_ff @(posedge clk) begin
    if (rst) begin
      out_octave      <= '0;
      out_row         <= '0;
      out_x           <= '0;
      row_end_virtual <= 1'b0;
    end else if (en) begin
      out_x <= first_at[5] ? '0 : out_x + 1'b1;
      if (first_at[5]) begin
        out_octave      <= req_octave;
        out_row         <= req_row;
        row_end_virtual <= req_virtual;
      end
    end
  end
  always_ff @(posedge clk) begin
    if (rst) begin
      row_end   <= 1'b0;
      frame_end <= 1'b0;
    end else begin
      row_end   <= en && last_at[5];
      frame_end <= en && last_at[5] && draining;
    end
  end
  assign sm_x     = 16'(out_x) - 16'd3;
  assign sm_y     = out_row - 16'd3;
  assign corner_x = 16'(out_x) - 16'd4;
  assign corner_y = out_row - 16'd4;
endmodule
