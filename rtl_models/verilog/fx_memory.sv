// A memory with one port that reads and one that writes, as SRAM compilers and FPGAs have them: the word of read_address stands on q after the edge.
//
// q holds while read is low. A word that is written in the clock in which it is read is read as it was before; no block relies on that.
// Contents and q wake up with anything and no reset touches them.
module fx_memory #(
    parameter WORDS   = 640,
    parameter WIDTH   = 8,
    parameter ADDRESS = 10
) (
    input  logic               clk,
    input  logic               read,
    input  logic [ADDRESS-1:0] read_address,
    output logic [  WIDTH-1:0] q,
    input  logic               write,
    input  logic [ADDRESS-1:0] write_address,
    input  logic [  WIDTH-1:0] data
);
  logic [WIDTH-1:0] words[0:WORDS-1];

  always_ff @(posedge clk) begin
    if (read) q <= words[read_address];
    if (write) words[write_address] <= data;
  end
endmodule
