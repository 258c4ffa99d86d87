// The 7x7 triangle (1 2 3 4 3 2 1) in both directions over 256, rounded half up.
//
// Column sums first, then the row as a transposed filter: one adder between registers. Two enabled clocks from a column on `middle` to the pixel of
// which it is the newest column. `whole` says that all its 49 pixels are there: it leaves for one clock, and its pins hold until the next.
module fx_smooth #(
    parameter PIX_BITS = 8
) (
    input  logic                  clk,
    input  logic                  rst,
    input  logic                  en,
    input  logic [7*PIX_BITS-1:0] middle,
    input  logic                  whole,
    output logic                  sm_valid,
    output logic [  PIX_BITS-1:0] sm_pixel
);
  localparam P = PIX_BITS;

  // Pixels of equal weight are added first: weights 1, 2, 3, and 4 for the middle.
  logic [P:0] pair_1, pair_2, pair_3;
  assign pair_1 = {1'b0, middle[0*P+:P]} + {1'b0, middle[6*P+:P]};
  assign pair_2 = {1'b0, middle[1*P+:P]} + {1'b0, middle[5*P+:P]};
  assign pair_3 = {1'b0, middle[2*P+:P]} + {1'b0, middle[4*P+:P]};

  // A column's sum is at most 16 (2^P - 1), the whole sum 256 (2^P - 1) + 128.
  logic [P+3:0] sum;
  logic [P+7:0] once, thrice, tap_1, tap_2, tap_3, tap_4, tap_5, tap_6;
  /* verilator lint_off UNUSEDSIGNAL */
  logic [P+7:0] rounded;  // Its lowest 8 bits are cut off.
  /* verilator lint_on UNUSEDSIGNAL */
  assign once    = {4'd0, sum};
  assign thrice  = once + (once << 1);
  assign rounded = tap_6 + once + {{P{1'b0}}, 8'd128};
  always_ff @(posedge clk) begin
    if (en) begin
      sum   <= {3'd0, pair_1} + {2'd0, pair_2, 1'b0} + {3'd0, pair_3} + {2'd0, pair_3, 1'b0} + {2'd0, middle[3*P+:P], 2'b00};
      tap_1 <= once;
      tap_2 <= tap_1 + (once << 1);
      tap_3 <= tap_2 + thrice;
      tap_4 <= tap_3 + (once << 2);
      tap_5 <= tap_4 + thrice;
      tap_6 <= tap_5 + (once << 1);
    end
  end

  always_ff @(posedge clk) begin
    if (rst) begin
      sm_valid <= 1'b0;
      sm_pixel <= '0;
    end else begin
      sm_valid <= en && whole;
      if (en && whole) sm_pixel <= rounded[P+7:8];
    end
  end
endmodule
