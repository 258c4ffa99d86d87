// Sub-pixel position of a corner: 2.5 times the centroid of the nine arc differences under the weights (1 2 1) both ways, in sixteenths of a pixel.
//
// go: the nine values (row j, column i at bits (3j + i) PIX_BITS) enter, the middle one not 0. 13 clocks later dx and dy stand, -16 .. 15, rounded half up
// and clipped, and hold until the next go. No multiplier: one five-bit restoring divider serves both.
module fx_fit #(
    parameter PIX_BITS = 8
) (
    input  logic                         clk,
    input  logic                         rst,
    input  logic                         go,
    input  logic        [9*PIX_BITS-1:0] resp,
    output logic signed [           4:0] dx,
    output logic signed [           4:0] dy
);
  // With M = 2^PIX_BITS - 1: slopes within 4 M, the sum within 16 M, the dividend 80 slope + 33 sum within 33 * 16 M + 80 * 4 M = 848 M < 2^(PIX_BITS+10),
  // and what the divider takes off, 32 sum <= 512 M from at least -320 M, above -2^(PIX_BITS+10): a sign more holds them all.
  localparam S = PIX_BITS + 4;   // the sum, unsigned; sums of three, below it
  localparam V = PIX_BITS + 11;  // dividend and rest, signed

  function automatic [S-1:0] at(input [9*PIX_BITS-1:0] values, input [3:0] place);
    at = {4'd0, values[place*PIX_BITS+:PIX_BITS]};
  endfunction

  logic [S-1:0] left, middle, right, top, bottom;
  assign left   = at(resp, 4'd0) + (at(resp, 4'd3) << 1) + at(resp, 4'd6);
  assign middle = at(resp, 4'd1) + (at(resp, 4'd4) << 1) + at(resp, 4'd7);
  assign right  = at(resp, 4'd2) + (at(resp, 4'd5) << 1) + at(resp, 4'd8);
  assign top    = at(resp, 4'd0) + (at(resp, 4'd1) << 1) + at(resp, 4'd2);
  assign bottom = at(resp, 4'd6) + (at(resp, 4'd7) << 1) + at(resp, 4'd8);

  logic signed [S-1:0] gx, gy, slope;  // within 4 M, so a sign is free
  logic [S-1:0] sum;
  logic [3:0] state;  // 1: x's dividend; 2 .. 6: its quotient; 7 .. 12: the same of y
  logic [2:0] shift;  // 5 .. 1
  logic signed [V-1:0] wide, total, rest, rest_less;
  assign slope     = state == 4'd1 ? gx : gy;
  assign wide      = $signed({{(V - S) {slope[S-1]}}, slope});
  assign total     = $signed({{(V - S) {1'b0}}, sum});
  assign shift     = 3'((state > 4'd6 ? 4'd13 : 4'd7) - state);
  assign rest_less = rest - (total <<< shift);

  logic [3:0] quotient;
  always_ff @(posedge clk) begin
    if (rst) state <= '0;
    else if (go) state <= 4'd1;
    else if (state != 4'd0) state <= state == 4'd12 ? 4'd0 : state + 4'd1;
    if (go) begin
      gx  <= $signed(right - left);
      gy  <= $signed(bottom - top);
      sum <= left + (middle << 1) + right;
    end
    if (state == 4'd1 || state == 4'd7) rest <= (wide <<< 6) + (wide <<< 4) + (total <<< 5) + total;
    else if (state != 4'd0 && !rest_less[V-1]) rest <= rest_less;
    if (state != 4'd0) quotient <= {quotient[2:0], !rest_less[V-1]};
    if (state == 4'd6) dx <= {~quotient[3], quotient[2:0], !rest_less[V-1]};
    if (state == 4'd12) dy <= {~quotient[3], quotient[2:0], !rest_less[V-1]};
  end
endmodule
