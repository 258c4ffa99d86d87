// Column latches to serial lanes, bit by bit, most significant bit first.
//
// latch takes the row's codes when the shifter is free (or sends its last bit), else the row is lost and overrun stays high until reset.
// Word w of lane l is column w * lanes + l: the horizontal scanner puts `lanes` neighbouring columns onto `lanes` buses. The first bits stand on the
// pins two clocks after latch; a row takes columns / lanes * bits clocks. Lanes beyond `lanes` stay 0.
// columns <= COLUMNS is a multiple of lanes (1 .. MAX_LANES); bits 1 .. 16. Reset is synchronous; stall holds everything.
module lane_shift #(
    parameter COLUMNS   = 16,
    parameter MAX_LANES = 16
) (
    input  logic                  clk,
    input  logic                  rst,
    input  logic                  stall,
    input  logic [           4:0] bits,
    input  logic [           4:0] lanes,
    input  logic [          15:0] columns,
    input  logic                  latch,
    input  logic [16*COLUMNS-1:0] codes,
    output logic [ MAX_LANES-1:0] lane,
    output logic                  valid,
    output logic                  busy,
    output logic                  word_start,
    output logic                  row_start,
    output logic                  overrun
);
  logic [16*COLUMNS-1:0] held;
  logic [15:0] base;      // first column of the group that goes out next
  logic [4:0] bits_left;  // bits of the word after the one on the pins

  logic last_bit, row_end, load, accept;
  assign last_bit = valid && bits_left == 5'd0;
  assign row_end  = last_bit && base >= columns;
  assign load     = busy && !row_end && (!valid || last_bit);
  assign accept   = latch && (!busy || row_end);

  always_ff @(posedge clk) begin
    if (rst) begin
      held       <= '0;
      base       <= '0;
      bits_left  <= '0;
      valid      <= 1'b0;
      busy       <= 1'b0;
      word_start <= 1'b0;
      row_start  <= 1'b0;
      overrun    <= 1'b0;
    end else if (!stall) begin
      word_start <= load;
      row_start  <= load && base == 16'd0;
      if (load) begin
        valid     <= 1'b1;
        bits_left <= bits - 5'd1;
        base      <= base + {11'd0, lanes};
      end else if (valid) begin
        bits_left <= bits_left - 5'd1;
      end
      if (row_end) begin
        valid     <= 1'b0;
        busy      <= 1'b0;
        bits_left <= '0;
      end
      if (accept) begin
        held <= codes;
        busy <= 1'b1;
        base <= '0;
      end
      if (latch && !accept) overrun <= 1'b1;
    end
  end

  genvar l;
  generate
    for (l = 0; l < MAX_LANES; l = l + 1) begin : each_lane
      localparam [15:0] OFFSET = l;
      logic [15:0] column, picked, word;
      assign column = base + OFFSET;
      assign picked = held[column*16+:16];
      always_ff @(posedge clk) begin
        if (rst) word <= '0;
        else if (!stall) begin
          if (load) word <= OFFSET < {11'd0, lanes} ? picked << (5'd16 - bits) : 16'd0;
          else word <= row_end ? 16'd0 : word << 1;
        end
      end
      assign lane[l] = word[15];
    end
  endgenerate
endmodule
