// Ring of smoothed rows: one memory for each of 2^RING_LOG2 rows, octaves one behind the other in each.
//
// A write puts one pixel into the bank of its slot. read in clock t gives, from clock t+2 on, the pixels of one picture column in 27 rows from slot read_slot on
// (pixel j of `column` is row j); column_valid stands then. Only those 27 banks are read.
module fx_ring #(
    parameter MAX_WIDTH = 640,
    parameter PIX_BITS  = 8,
    parameter OCTAVES   = 1,
    parameter RING_LOG2 = 6
) (
    input  logic                   clk,
    input  logic                   rst,
    input  logic                   write,
    input  logic [            1:0] write_octave,
    input  logic [           11:0] write_x,
    input  logic [  RING_LOG2-1:0] write_slot,
    input  logic [   PIX_BITS-1:0] write_pixel,
    input  logic                   read,
    input  logic [            1:0] read_octave,
    input  logic [           11:0] read_x,
    input  logic [  RING_LOG2-1:0] read_slot,
    output logic                   column_valid,
    output logic [27*PIX_BITS-1:0] column
);
  localparam ROWS  = 1 << RING_LOG2;
  localparam SIDE1 = OCTAVES > 1 ? MAX_WIDTH / 2 : 0;
  localparam SIDE2 = OCTAVES > 2 ? MAX_WIDTH / 4 : 0;
  localparam SIDE3 = OCTAVES > 3 ? MAX_WIDTH / 8 : 0;
  localparam WORDS = MAX_WIDTH + SIDE1 + SIDE2 + SIDE3;
  localparam BITS  = $clog2(WORDS);
  localparam [12:0] START1 = 13'(MAX_WIDTH);
  localparam [12:0] START2 = 13'(MAX_WIDTH + SIDE1);
  localparam [12:0] START3 = 13'(MAX_WIDTH + SIDE1 + SIDE2);

  function automatic [12:0] place(input [1:0] octave, input [11:0] x);
    place = {1'b0, x} + (octave == 2'd0 ? 13'd0 : octave == 2'd1 ? START1 : octave == 2'd2 ? START2 : START3);
  endfunction

  logic [12:0] write_place, read_place;
  assign write_place = place(write_octave, write_x);
  assign read_place  = place(read_octave, read_x);

  logic [ROWS*PIX_BITS-1:0] row_pixels;
  genvar b;
  generate
    for (b = 0; b < ROWS; b = b + 1) begin : each_row
      localparam [RING_LOG2-1:0] BANK = b;
      logic [PIX_BITS-1:0] pixels[0:WORDS-1];
      logic [PIX_BITS-1:0] pixel;
      logic [RING_LOG2-1:0] from_top;
      assign from_top = BANK - read_slot;
      always_ff @(posedge clk) begin
        if (write && write_slot == BANK) pixels[write_place[BITS-1:0]] <= write_pixel;
        if (read && from_top < 27) pixel <= pixels[read_place[BITS-1:0]];
      end
      assign row_pixels[b*PIX_BITS+:PIX_BITS] = pixel;
    end
  endgenerate

  logic unused_bits;
  assign unused_bits = ^{write_place, read_place};

  // The bank of the top row goes to place 0, by one rotation for each bit of the slot.
  logic reading;
  logic [RING_LOG2-1:0] slot;
  logic [ROWS*PIX_BITS-1:0] turned;
  always_comb begin
    turned = row_pixels;
    for (int s = 0; s < RING_LOG2; s = s + 1) begin
      if (slot[s]) turned = (turned >> (PIX_BITS << s)) | (turned << ((ROWS - (1 << s)) * PIX_BITS));
    end
  end
  always_ff @(posedge clk) begin
    if (rst) begin
      reading      <= 1'b0;
      column_valid <= 1'b0;
    end else begin
      reading      <= read;
      column_valid <= reading;
    end
    if (read) slot <= read_slot;
    if (reading) column <= turned[27*PIX_BITS-1:0];
  end
endmodule
