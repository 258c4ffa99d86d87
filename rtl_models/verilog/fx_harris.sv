// Harris rank of a corner, from the upper 8 bits of the pixels: 3x3 Sobel gradients at the 5x5 inner pixels of the window, r = det - trace^2 / 16.
//
// Column sums of the gradients' products are made once and added over five columns. The rank is r as a short float, 6 bits of exponent and 10 of
// mantissa, 0 for r <= 0. Seven enabled clocks after the window, it is written into a line buffer, from which the row after reads it.
module fx_harris #(
    parameter WORDS   = 640,
    parameter ADDRESS = 10
) (
    input  logic               clk,
    input  logic               en,
    input  logic [  3*7*8-1:0] right,
    input  logic               write,
    input  logic [ADDRESS-1:0] write_address,
    input  logic               read,
    input  logic [ADDRESS-1:0] read_address,
    output logic [       15:0] rank
);
  // Gradients at the five inner pixels of the newest column but one. 4 * 255 = 1020 at most.
  logic [54:0] across, along;
  genvar g;
  generate
    for (g = 0; g < 5; g = g + 1) begin : place
      logic [9:0] left_sum, right_sum, upper_sum, lower_sum;
      assign left_sum = {2'd0, right[8*g+:8]} + {1'b0, right[8*(g+1)+:8], 1'b0} + {2'd0, right[8*(g+2)+:8]};
      assign right_sum = {2'd0, right[8*(g+14)+:8]} + {1'b0, right[8*(g+15)+:8], 1'b0} + {2'd0, right[8*(g+16)+:8]};
      assign upper_sum = {2'd0, right[8*g+:8]} + {1'b0, right[8*(g+7)+:8], 1'b0} + {2'd0, right[8*(g+14)+:8]};
      assign lower_sum = {2'd0, right[8*(g+2)+:8]} + {1'b0, right[8*(g+9)+:8], 1'b0} + {2'd0, right[8*(g+16)+:8]};
      always_ff @(posedge clk) begin
        if (en) begin
          across[11*g+:11] <= {1'b0, right_sum} - {1'b0, left_sum};
          along[11*g+:11]  <= {1'b0, lower_sum} - {1'b0, upper_sum};
        end
      end
    end
  endgenerate

  function automatic [22:0] square(input logic signed [10:0] a);
    square = 23'(a) * 23'(a);
  endfunction
  function automatic signed [23:0] product(input logic signed [10:0] a, input logic signed [10:0] b);
    product = 24'(a) * 24'(b);
  endfunction

  // 5 products of at most 1020 * 1020 are below 2^23, 25 of them below 2^25.
  logic [22:0] xx_0, yy_0, xx, yy, xx_1, yy_1;
  logic [23:0] xx_2, yy_2, xx_3, yy_3;
  logic [24:0] xx_4, yy_4, xx_5, yy_5;
  logic signed [23:0] xy_0, xy, xy_1;
  logic signed [25:0] xy_2, xy_3, xy_4, xy_5;
  assign xx_0 = square(across[0+:11]) + square(across[11+:11]) + square(across[22+:11]) + square(across[33+:11]) + square(across[44+:11]);
  assign yy_0 = square(along[0+:11]) + square(along[11+:11]) + square(along[22+:11]) + square(along[33+:11]) + square(along[44+:11]);
  assign xy_0 = product(across[0+:11], along[0+:11]) + product(across[11+:11], along[11+:11])
      + product(across[22+:11], along[22+:11]) + product(across[33+:11], along[33+:11]) + product(across[44+:11], along[44+:11]);
  always_ff @(posedge clk) begin
    if (en) begin
      xx   <= xx_0;
      yy   <= yy_0;
      xy   <= xy_0;
      xx_1 <= xx;
      yy_1 <= yy;
      xy_1 <= xy;
      xx_2 <= 24'(xx_1) + 24'(xx);
      yy_2 <= 24'(yy_1) + 24'(yy);
      xy_2 <= 26'(xy_1) + 26'(xy);
      xx_3 <= xx_2 + 24'(xx);
      yy_3 <= yy_2 + 24'(yy);
      xy_3 <= xy_2 + 26'(xy);
      xx_4 <= 25'(xx_3) + 25'(xx);
      yy_4 <= 25'(yy_3) + 25'(yy);
      xy_4 <= xy_3 + 26'(xy);
      xx_5 <= xx_4 + 25'(xx);
      yy_5 <= yy_4 + 25'(yy);
      xy_5 <= xy_4 + 26'(xy);
    end
  end

  // r < 2^50; what is taken away is below 2^50 + 2^48.
  logic [49:0] products, mixed, positive, above;
  logic [51:0] squared;
  logic [25:0] trace;
  logic [51:0] taken;
  assign trace = 26'(xx_5) + 26'(yy_5);
  assign taken = 52'(mixed) + 52'(squared >> 4);
  assign above = products - taken[49:0];
  always_ff @(posedge clk) begin
    if (en) begin
      products <= 50'(xx_5) * 50'(yy_5);
      mixed    <= 50'(52'(xy_5) * 52'(xy_5));
      squared  <= 52'(trace) * 52'(trace);
      positive <= taken < 52'(products) ? above : 50'd0;
    end
  end

  // The leading one moves to bit 49 in steps of 32, 16, 8, 4, 2 and 1.
  logic [49:0] by_32, by_16, by_8, by_4, by_2;
  /* verilator lint_off UNUSEDSIGNAL */
  logic [49:0] by_1;  // What stands below the mantissa is cut off.
  /* verilator lint_on UNUSEDSIGNAL */
  logic none_32, none_16, none_8, none_4, none_2, none_1;
  assign none_32 = positive[49:18] == '0;
  assign by_32   = none_32 ? positive << 32 : positive;
  assign none_16 = by_32[49:34] == '0;
  assign by_16   = none_16 ? by_32 << 16 : by_32;
  assign none_8  = by_16[49:42] == '0;
  assign by_8    = none_8 ? by_16 << 8 : by_16;
  assign none_4  = by_8[49:46] == '0;
  assign by_4    = none_4 ? by_8 << 4 : by_8;
  assign none_2  = by_4[49:48] == '0;
  assign by_2    = none_2 ? by_4 << 2 : by_4;
  assign none_1  = !by_2[49];
  assign by_1    = none_1 ? by_2 << 1 : by_2;
  logic [15:0] code;
  always_ff @(posedge clk) begin
    if (en) code <= by_1[49] ? {6'd49 - {none_32, none_16, none_8, none_4, none_2, none_1}, by_1[48:39]} : 16'd0;
  end

  fx_memory #(
      .WORDS  (WORDS),
      .WIDTH  (16),
      .ADDRESS(ADDRESS)
  ) ranks (
      .clk(clk),
      .read(en && read),
      .read_address(read_address),
      .q(rank),
      .write(en && write),
      .write_address(write_address),
      .data(code)
  );
endmodule
