// Six line buffers and the 7x7 window that slides over them.
//
// A slot reads its column's six older pixels, and one enabled clock later shifts them into the window with the seventh, `pixel`, which is also
// written back. Column 6 of the window is the newest, row 6 the lowest. The corners that no block looks at have no registers.
module fx_window #(
    parameter PIX_BITS = 8,
    parameter WORDS    = 640,
    parameter ADDRESS  = 10
) (
    input  logic                    clk,
    input  logic                    en,
    input  logic                    read,
    input  logic [     ADDRESS-1:0] read_address,
    input  logic                    write,          // the slot before
    input  logic [     ADDRESS-1:0] write_address,
    input  logic [    PIX_BITS-1:0] pixel,
    output logic [ 16*PIX_BITS-1:0] circle,         // clockwise from straight below, element 0 lowest
    output logic [    PIX_BITS-1:0] centre,
    output logic [  7*PIX_BITS-1:0] middle,         // column 3, from above
    output logic [  4*PIX_BITS-1:0] newest,         // 2x2 at the lower right
    output logic [       3*7*8-1:0] right           // upper 8 bits of columns 4, 5, 6, each from above
);
  localparam P = PIX_BITS;

  logic [6*P-1:0] older;  // element 0 is the oldest row
  fx_memory #(
      .WORDS  (WORDS),
      .WIDTH  (6 * P),
      .ADDRESS(ADDRESS)
  ) lines (
      .clk(clk),
      .read(en && read),
      .read_address(read_address),
      .q(older),
      .write(en && write),
      .write_address(write_address),
      .data({pixel, older[6*P-1:P]})
  );

  // Each row from its newest column (highest) back to the oldest one in use.
  logic [5*P-1:0] row_0, row_6;
  logic [6*P-1:0] row_1, row_5;
  logic [7*P-1:0] row_2, row_3, row_4;
  always_ff @(posedge clk) begin
    if (en) begin
      row_0 <= {older[0*P+:P], row_0[5*P-1:P]};
      row_1 <= {older[1*P+:P], row_1[6*P-1:P]};
      row_2 <= {older[2*P+:P], row_2[7*P-1:P]};
      row_3 <= {older[3*P+:P], row_3[7*P-1:P]};
      row_4 <= {older[4*P+:P], row_4[7*P-1:P]};
      row_5 <= {older[5*P+:P], row_5[6*P-1:P]};
      row_6 <= {pixel, row_6[5*P-1:P]};
    end
  end

  assign circle = {
    row_6[0*P+:P], row_5[0*P+:P], row_4[0*P+:P], row_3[0*P+:P], row_2[0*P+:P], row_1[0*P+:P], row_0[0*P+:P], row_0[1*P+:P],
    row_0[2*P+:P], row_1[4*P+:P], row_2[6*P+:P], row_3[6*P+:P], row_4[6*P+:P], row_5[4*P+:P], row_6[2*P+:P], row_6[1*P+:P]
  };
  assign centre = row_3[3*P+:P];
  assign middle = {row_6[1*P+:P], row_5[2*P+:P], row_4[3*P+:P], row_3[3*P+:P], row_2[3*P+:P], row_1[2*P+:P], row_0[1*P+:P]};
  assign newest = {row_6[4*P+:P], row_6[3*P+:P], row_5[5*P+:P], row_5[4*P+:P]};

  genvar c;
  generate
    for (c = 0; c < 3; c = c + 1) begin : right_column
      assign right[7*8*c+:7*8] = {
        row_6[(3+c)*P-1-:8], row_5[(4+c)*P-1-:8], row_4[(5+c)*P-1-:8], row_3[(5+c)*P-1-:8],
        row_2[(5+c)*P-1-:8], row_1[(4+c)*P-1-:8], row_0[(3+c)*P-1-:8]
      };
    end
  endgenerate
endmodule
