// Style 2: all columns in one process over arrays, visited in every step; row latches are an array, which the one lane reads by its index.
module column_loops #(
    parameter COLUMNS   = 640,
    parameter MAX_LANES = 1
) (
`include "ports.svh"
);
`include "front.svh"
  logic signed [17:0] value[COLUMNS];
  logic [16:0] latched[COLUMNS];
  logic [15:0] held[COLUMNS];
  logic [COLUMNS-1:0] crossed, rising;
  logic [15:0] base, word;
  logic [4:0] bits_left;
  logic last_bit, row_end, load, accept;
  assign rising   = comparators & ~crossed;
  assign last_bit = valid && bits_left == 5'd0;
  assign row_end  = last_bit && base >= columns;
  assign load     = busy && !row_end && (!valid || last_bit);
  assign accept   = latch && (!busy || row_end);
  assign lane     = word[15];

  // Arrays take blocking assignments (Verilator 5.006 takes no others in loops), each after its last reader.
  /* verilator lint_off BLKSEQ */
  always_ff @(posedge clk) begin
    if (rst) begin
      base       <= '0;
      word       <= '0;
      bits_left  <= '0;
      valid      <= 1'b0;
      busy       <= 1'b0;
      word_start <= 1'b0;
      row_start  <= 1'b0;
      overrun    <= 1'b0;
      crossed    <= '0;
      for (int c = 0; c < COLUMNS; c++) begin
        held[c]    = '0;
        value[c]   = '0;
        latched[c] = '0;
      end
    end else if (!stall) begin
      word_start <= load;
      row_start  <= load && base == 16'd0;
      if (load) begin
        word      <= held[base[9:0]] << (5'd16 - bits);
        valid     <= 1'b1;
        bits_left <= bits - 5'd1;
        base      <= base + {11'd0, lanes};
      end else begin
        word <= row_end ? 16'd0 : word << 1;
        if (valid) bits_left <= bits_left - 5'd1;
      end
      if (row_end) begin
        valid     <= 1'b0;
        busy      <= 1'b0;
        bits_left <= '0;
      end
      if (accept) begin
        busy <= 1'b1;
        base <= '0;
        for (int c = 0; c < COLUMNS; c++) held[c] = clipped(value[c]);
      end
      if (latch && !accept) overrun <= 1'b1;

      if (ramp_step) begin
        crossed <= crossed | rising;
        if (latch_mode) for (int c = 0; c < COLUMNS; c++) if (!crossed[c]) latched[c] = count;
        if (!latch_mode) begin
          for (int c = 0; c < COLUMNS; c++) begin
            value[c] = value[c] + (crossed[c] | comparators[c] ? 18'sd0 : ramp_down ? -18'sd1 : 18'sd1);
          end
        end
      end
      if (ramp_done && latch_mode) begin
        for (int c = 0; c < COLUMNS; c++) begin
          if (!crossed[c]) latched[c] = count;
          value[c] = ramp_down ? value[c] - $signed({1'b0, decoded(latched[c])}) : value[c] + $signed({1'b0, decoded(latched[c])});
        end
      end
      if (clear) for (int c = 0; c < COLUMNS; c++) value[c] = $signed({2'b00, black});
      if (ramp_start) crossed <= '0;
    end
  end
  /* verilator lint_on BLKSEQ */
endmodule
