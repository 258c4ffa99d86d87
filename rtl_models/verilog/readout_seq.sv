// Row sequencer: line and frame counters, the phases of a row's conversion, and the electronic shutter's pointer.
//
// A line of hts clocks is: settle_reset, ramp_reset (left out when its length is 0), settle_signal, ramp_signal, blank. In ramp_* the
// ramp makes one step a clock: ramp_start comes two clocks earlier, so both settling times are at least 2. latch comes two clocks after the
// last step, when the columns' codes are final: with no blank that is the second clock of the following line, where clear also comes.
// Lines 0 .. rows-1 of vts read rows first_row, first_row + row_step, ...
//
// Rolling: shutter_reset clears the photodiode of shutter_row in the clock of the phase in which transfer comes, exposure_lines earlier,
// so exposure is exactly exposure_lines lines. Global: shutter_reset (of all rows) and global_transfer (of all rows to their storage) come in
// the first clock of their lines, exposure_lines apart; transfer then moves the read row's storage. After enable the frame
// begins exposure_lines before line 0, so every row that is read was reset. A low enable stops after the frame.
// The configuration holds still while running: 2 <= both settling times, 1 <= exposure_lines < vts, rows <= vts. Reset is synchronous.
module readout_seq #(
    parameter CLOCK_WIDTH = 20,
    parameter LINE_WIDTH  = 16
) (
    input  logic                   clk,
    input  logic                   rst,
    input  logic                   stall,
    input  logic                   enable,
    input  logic                   global_shutter,
    input  logic [CLOCK_WIDTH-1:0] hts,
    input  logic [CLOCK_WIDTH-1:0] n_settle_reset,
    input  logic [CLOCK_WIDTH-1:0] n_ramp_reset,
    input  logic [CLOCK_WIDTH-1:0] n_settle_signal,
    input  logic [CLOCK_WIDTH-1:0] n_ramp_signal,
    input  logic [ LINE_WIDTH-1:0] vts,
    input  logic [ LINE_WIDTH-1:0] rows,
    input  logic [ LINE_WIDTH-1:0] first_row,
    input  logic [ LINE_WIDTH-1:0] row_step,
    input  logic [ LINE_WIDTH-1:0] exposure_lines,
    output logic                   running,
    output logic [            2:0] state,
    output logic [ LINE_WIDTH-1:0] line,
    output logic [ LINE_WIDTH-1:0] row,
    output logic                   frame_valid,
    output logic                   line_valid,
    output logic                   clear,
    output logic                   fd_reset,
    output logic                   sample_reset,
    output logic                   transfer,
    output logic                   sample_signal,
    output logic                   ramp_start,
    output logic                   ramp_down,
    output logic                   latch,
    output logic                   shutter_reset,
    output logic [ LINE_WIDTH-1:0] shutter_row,
    output logic                   global_transfer
);
  localparam [2:0] IDLE = 3'd0;
  localparam [2:0] SETTLE_RESET = 3'd1;
  localparam [2:0] RAMP_RESET = 3'd2;
  localparam [2:0] SETTLE_SIGNAL = 3'd3;
  localparam [2:0] RAMP_SIGNAL = 3'd4;
  localparam [2:0] BLANK = 3'd5;
  localparam [CLOCK_WIDTH-1:0] ONE_CLOCK = {{(CLOCK_WIDTH - 1) {1'b0}}, 1'b1};
  localparam [LINE_WIDTH-1:0] ONE_LINE = {{(LINE_WIDTH - 1) {1'b0}}, 1'b1};

  logic [CLOCK_WIDTH-1:0] clock;         // clock within the line
  logic [CLOCK_WIDTH-1:0] left;          // clocks left in the phase after this one
  logic [ LINE_WIDTH-1:0] shutter_line;  // line in which the row under the shutter pointer will be read
  logic first;                           // first clock of a phase
  logic primed;                          // line 0 was reached: rows were exposed
  logic ended;                           // the signal ramp made its last step in the clock before

  logic line_end, frame_end;
  assign line_end  = clock == hts - ONE_CLOCK;
  assign frame_end = line == vts - ONE_LINE;

  // The phase that follows: the first of the order whose length is not 0.
  logic [2:0] from, next_state;
  logic [CLOCK_WIDTH-1:0] next_length;
  always_comb begin
    from = (!running || line_end) ? IDLE : state;
    next_state = BLANK;
    next_length = ONE_CLOCK;
    if (from < SETTLE_RESET && n_settle_reset != '0) begin
      next_state  = SETTLE_RESET;
      next_length = n_settle_reset;
    end else if (from < RAMP_RESET && n_ramp_reset != '0) begin
      next_state  = RAMP_RESET;
      next_length = n_ramp_reset;
    end else if (from < SETTLE_SIGNAL && n_settle_signal != '0) begin
      next_state  = SETTLE_SIGNAL;
      next_length = n_settle_signal;
    end else if (from < RAMP_SIGNAL && n_ramp_signal != '0) begin
      next_state  = RAMP_SIGNAL;
      next_length = n_ramp_signal;
    end
  end

  always_ff @(posedge clk) begin
    if (rst) begin
      running      <= 1'b0;
      state        <= IDLE;
      clock        <= '0;
      left         <= '0;
      line         <= '0;
      row          <= '0;
      shutter_line <= '0;
      shutter_row  <= '0;
      first        <= 1'b0;
      primed       <= 1'b0;
      ended        <= 1'b0;
      latch        <= 1'b0;
      ramp_down    <= 1'b0;
    end else if (!stall) begin
      ended <= line_valid && state == RAMP_SIGNAL && left == '0;
      latch <= ended;
      if (state == SETTLE_RESET) ramp_down <= 1'b1;
      if (state == SETTLE_SIGNAL) ramp_down <= 1'b0;
      first <= 1'b0;
      if (!running) begin
        if (enable) begin
          running      <= 1'b1;
          state        <= next_state;
          left         <= next_length - ONE_CLOCK;
          first        <= 1'b1;
          clock        <= '0;
          line         <= vts - exposure_lines;
          row          <= first_row;
          shutter_line <= '0;
          shutter_row  <= first_row;
          primed       <= 1'b0;
        end
      end else begin
        clock <= line_end ? '0 : clock + ONE_CLOCK;
        if (line_end || (left == '0 && state != BLANK)) begin
          state <= next_state;
          left  <= next_length - ONE_CLOCK;
          first <= 1'b1;
        end else if (state != BLANK) begin
          left <= left - ONE_CLOCK;
        end
        if (line_end) begin
          line <= frame_end ? '0 : line + ONE_LINE;
          row  <= frame_end ? first_row : row + row_step;
          if (frame_end) primed <= 1'b1;
          if (shutter_line == vts - ONE_LINE) begin
            shutter_line <= '0;
            shutter_row  <= first_row;
          end else begin
            shutter_line <= shutter_line + ONE_LINE;
            shutter_row  <= shutter_row + row_step;
          end
          if (frame_end && !enable) begin
            running <= 1'b0;
            state   <= IDLE;
            left    <= '0;
            first   <= 1'b0;
          end
        end
      end
    end
  end

  assign frame_valid     = running && primed && line < rows;
  assign line_valid      = frame_valid && state != BLANK;
  assign clear           = line_valid && clock == ONE_CLOCK;
  assign fd_reset        = line_valid && state == SETTLE_RESET && first;
  assign sample_reset    = line_valid && state == SETTLE_RESET && left == '0;
  assign transfer        = line_valid && state == SETTLE_SIGNAL && first;
  assign sample_signal   = line_valid && state == SETTLE_SIGNAL && left == '0;
  assign ramp_start      = line_valid && left == ONE_CLOCK && ((state == SETTLE_RESET && n_ramp_reset != '0) ||
                                                               (state == SETTLE_SIGNAL && n_ramp_signal != '0));
  assign shutter_reset   = global_shutter ? running && clock == '0 && shutter_line == '0
                                          : running && state == SETTLE_SIGNAL && first && shutter_line < rows;
  assign global_transfer = global_shutter && running && primed && clock == '0 && line == '0;
endmodule
