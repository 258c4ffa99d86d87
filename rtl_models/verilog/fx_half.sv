// Half-scale pixels, (a + b + c + d + 2) >> 2 over 2x2, and the row buffer from which the next octave takes its row.
//
// One buffer serves all octaves: octave k + 1 writes over what octave k's row has already read. A slot reads one enabled clock before its pixel is
// needed; a half-scale pixel is written one enabled clock after the window holds its 2x2.
module fx_half #(
    parameter PIX_BITS = 8,
    parameter WORDS    = 320,
    parameter ADDRESS  = 9
) (
    input  logic                  clk,
    input  logic                  en,
    input  logic                  read,
    input  logic [   ADDRESS-1:0] read_address,
    output logic [  PIX_BITS-1:0] pixel,
    input  logic                  write,
    input  logic [   ADDRESS-1:0] write_address,
    input  logic [4*PIX_BITS-1:0] newest
);
  localparam P = PIX_BITS;

  // The two lowest bits are the quarter that rounding cuts off.
  /* verilator lint_off UNUSEDSIGNAL */
  logic [P+1:0] sum;
  /* verilator lint_on UNUSEDSIGNAL */
  assign sum = {2'd0, newest[0*P+:P]} + {2'd0, newest[1*P+:P]} + {2'd0, newest[2*P+:P]} + {2'd0, newest[3*P+:P]} + {{P{1'b0}}, 2'd2};

  fx_memory #(
      .WORDS  (WORDS),
      .WIDTH  (P),
      .ADDRESS(ADDRESS)
  ) row (
      .clk(clk),
      .read(en && read),
      .read_address(read_address),
      .q(pixel),
      .write(en && write),
      .write_address(write_address),
      .data(sum[P+1:2])
  );
endmodule
