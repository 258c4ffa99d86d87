// Strict non-maximum suppression over 3x3 differences: two line buffers of differences and the window over them.
//
// A slot reads the two differences above its own one enabled clock before; with its own they enter the window, and are written back. A corner is a
// difference above the threshold and above all eight neighbours. It leaves one enabled clock later, for one clock; its pins hold until the next.
module fx_nms #(
    parameter PIX_BITS = 8,
    parameter WORDS    = 640,
    parameter ADDRESS  = 10
) (
    input  logic                  clk,
    input  logic                  rst,
    input  logic                  en,
    input  logic [  PIX_BITS-1:0] threshold,
    input  logic                  read,
    input  logic [   ADDRESS-1:0] read_address,
    input  logic                  column,         // the next slot is a real column: it reads and writes
    input  logic [   ADDRESS-1:0] write_address,
    input  logic [  PIX_BITS-1:0] difference,
    input  logic                  peak,           // the window is whole
    output logic                  found,          // the window's middle is a corner: corner_valid follows
    output logic                  corner_valid,
    output logic [  PIX_BITS-1:0] corner_score,
    output logic [9*PIX_BITS-1:0] corner_resp
);
  localparam P = PIX_BITS;

  logic [2*P-1:0] above;  // element 0 is the older row
  fx_memory #(
      .WORDS  (WORDS),
      .WIDTH  (2 * P),
      .ADDRESS(ADDRESS)
  ) rows (
      .clk(clk),
      .read(en && read),
      .read_address(read_address),
      .q(above),
      .write(en && column),
      .write_address(write_address),
      .data({difference, above[P+:P]})
  );

  logic [3*P-1:0] row_0, row_1, row_2;
  always_ff @(posedge clk) begin
    if (en) begin
      row_0 <= {column ? above[0+:P] : {P{1'b0}}, row_0[3*P-1:P]};
      row_1 <= {column ? above[P+:P] : {P{1'b0}}, row_1[3*P-1:P]};
      row_2 <= {difference, row_2[3*P-1:P]};
    end
  end

  logic [P-1:0] middle;
  logic [7:0] higher;
  assign middle = row_1[P+:P];
  assign higher = {
    middle > row_0[0+:P], middle > row_0[P+:P], middle > row_0[2*P+:P], middle > row_1[0+:P],
    middle > row_1[2*P+:P], middle > row_2[0+:P], middle > row_2[P+:P], middle > row_2[2*P+:P]
  };
  assign found = en && peak && &higher && middle > threshold;

  always_ff @(posedge clk) begin
    if (rst) begin
      corner_valid <= 1'b0;
      corner_score <= '0;
      corner_resp  <= '0;
    end else begin
      corner_valid <= found;
      if (found) begin
        corner_score <= middle - 1'b1;
        corner_resp  <= {row_2, row_1, row_0};
      end
    end
  end
endmodule
