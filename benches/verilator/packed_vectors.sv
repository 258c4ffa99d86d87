// Style 1: all columns in one process over packed vectors, codes clipped when they are latched, and the committed lane_shift behind a
// packed bus.
module packed_vectors #(
    parameter COLUMNS   = 640,
    parameter MAX_LANES = 1
) (
`include "ports.svh"
);
`include "front.svh"
  logic [COLUMNS-1:0][17:0] value;
  logic [COLUMNS-1:0][16:0] latched;
  logic [COLUMNS-1:0] crossed;

  always_ff @(posedge clk) begin
    if (rst) begin
      crossed <= '0;
      for (int c = 0; c < COLUMNS; c++) begin
        value[c]   <= '0;
        latched[c] <= '0;
      end
    end else if (!stall) begin
      if (ramp_start) crossed <= '0;
      else if (ramp_step) crossed <= crossed | comparators;
      if (clear) begin
        for (int c = 0; c < COLUMNS; c++) value[c] <= {2'b00, black};
      end else if (latch_mode) begin
        if (ramp_done) begin
          for (int c = 0; c < COLUMNS; c++) begin
            value[c] <= ramp_down ? value[c] - {1'b0, decoded(crossed[c] ? latched[c] : count)}
                                  : value[c] + {1'b0, decoded(crossed[c] ? latched[c] : count)};
          end
        end
      end else if (ramp_step) begin
        for (int c = 0; c < COLUMNS; c++) begin
          if (!crossed[c] && !comparators[c]) value[c] <= ramp_down ? value[c] - 18'd1 : value[c] + 18'd1;
        end
      end
      if (latch_mode && (ramp_step || ramp_done)) begin
        for (int c = 0; c < COLUMNS; c++) begin
          if (!crossed[c] && (ramp_done || comparators[c])) latched[c] <= count;
        end
      end
    end
  end


  logic [16*COLUMNS-1:0] codes;
  always_comb begin
    codes = '0;
    if (latch) for (int c = 0; c < COLUMNS; c++) codes[16*c+:16] = clipped($signed(value[c]));
  end
  lane_shift #(.COLUMNS(COLUMNS), .MAX_LANES(MAX_LANES)) shifter (.*);
endmodule
