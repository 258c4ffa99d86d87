// Sub-pixel place of a corner: the peak of the least-squares quadratic through the nine arc differences, in sixteenths of a pixel.
//
// go: the nine values (row j, column i at bits (3j + i) PIX_BITS) enter. 15 clocks later dx and dy stand, -8 .. 7, rounded half up and clipped, and hold until
// the next go; both are 0 without a peak (a curvature not negative, or no positive determinant). One multiplier and one four-bit restoring divider serve all.
module fx_fit #(
    parameter PIX_BITS = 8
) (
    input  logic                         clk,
    input  logic                         rst,
    input  logic                         go,
    input  logic        [9*PIX_BITS-1:0] resp,
    output logic signed [           3:0] dx,
    output logic signed [           3:0] dy
);
  localparam S = PIX_BITS + 4;       // slopes and curvatures, signed
  localparam V = 2 * PIX_BITS + 16;  // products and what is divided, signed

  function automatic signed [S-1:0] at(input [9*PIX_BITS-1:0] values, input [3:0] place);
    at = $signed({4'd0, values[place*PIX_BITS+:PIX_BITS]});
  endfunction

  logic signed [S-1:0] left, middle, right, top, centre, bottom;
  assign left   = at(resp, 4'd0) + at(resp, 4'd3) + at(resp, 4'd6);
  assign middle = at(resp, 4'd1) + at(resp, 4'd4) + at(resp, 4'd7);
  assign right  = at(resp, 4'd2) + at(resp, 4'd5) + at(resp, 4'd8);
  assign top    = at(resp, 4'd0) + at(resp, 4'd1) + at(resp, 4'd2);
  assign centre = at(resp, 4'd3) + at(resp, 4'd4) + at(resp, 4'd5);
  assign bottom = at(resp, 4'd6) + at(resp, 4'd7) + at(resp, 4'd8);

  // Six times the slopes, three times the curvatures, four times the mixed curvature.
  logic signed [S-1:0] gx, gy, hxx, hyy, hxy;
  logic [3:0] state;  // 1, 2: determinant; 3, 4: x's dividend; 5 .. 8: its quotient; 9 .. 14: the same of y
  logic signed [S-1:0] a, b;
  logic signed [V-1:0] product, determinant, rest, rest_less;
  logic no_peak;
  always_comb begin
    case (state)
      4'd1: {a, b} = {hxx, hyy};
      4'd2: {a, b} = {hxy, hxy};
      4'd3: {a, b} = {hxy, gy};
      4'd4: {a, b} = {hyy, gx};
      4'd9: {a, b} = {hxy, gx};
      default: {a, b} = {hxx, gy};
    endcase
  end
  assign product = $signed({{(V - S) {a[S-1]}}, a}) * $signed({{(V - S) {b[S-1]}}, b});

  logic [2:0] quotient;
  logic [1:0] place;
  assign place     = state[1:0] - 2'd1;  // 0 .. 3 in 5 .. 8; y's run two later
  assign rest_less = rest - (determinant <<< (3'd4 - {1'b0, state > 4'd8 ? place - 2'd2 : place}));
  assign no_peak   = hxx >= 0 || hyy >= 0 || determinant <= 0;

  always_ff @(posedge clk) begin
    if (rst) state <= '0;
    else if (go) state <= 4'd1;
    else if (state != 4'd0) state <= state == 4'd14 ? 4'd0 : state + 4'd1;
    if (go) begin
      gx  <= right - left;
      gy  <= bottom - top;
      hxx <= left - (middle <<< 1) + right;
      hyy <= top - (centre <<< 1) + bottom;
      hxy <= at(resp, 4'd0) - at(resp, 4'd2) - at(resp, 4'd6) + at(resp, 4'd8);
    end
    case (state)
      4'd1: determinant <= product <<< 4;
      4'd2: determinant <= determinant - product * 9;
      4'd3, 4'd9: rest <= determinant * 17 + product * 192;
      4'd4, 4'd10: rest <= rest - (product <<< 8);
      default: if (state >= 4'd5 && !rest_less[V-1]) rest <= rest_less;
    endcase
    if (state >= 4'd5) quotient <= {quotient[1:0], !rest_less[V-1]};
    if (state == 4'd8) dx <= no_peak ? 4'sd0 : {~quotient[2], quotient[1:0], !rest_less[V-1]};
    if (state == 4'd14) dy <= no_peak ? 4'sd0 : {~quotient[2], quotient[1:0], !rest_less[V-1]};
  end
endmodule
