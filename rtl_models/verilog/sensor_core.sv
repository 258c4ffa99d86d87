// The digital half of the sensor: sequencer, shared ramp counter, one counter a column, and the lanes' shifter.
//
// Inputs: each column's comparator bit, looked at while ramp_step is high. Outputs: the array's control pins, the ramp's code, and the rows'
// codes on serial lanes; row n converts while row n-1 shifts out. All blocks' outputs are registers or decoded from registers, so between blocks
// a signal is seen one clock later. overrun rises when a row is latched while the row before still shifts. Reset is synchronous; stall holds everything.
module sensor_core #(
    parameter COLUMNS   = 16,
    parameter MAX_LANES = 16
) (
    input  logic                  clk,
    input  logic                  rst,
    input  logic                  stall,
    input  logic                  enable,
    input  logic                  global_shutter,
    input  logic [          19:0] hts,
    input  logic [          19:0] n_settle_reset,
    input  logic [          19:0] n_ramp_reset,
    input  logic [          19:0] n_settle_signal,
    input  logic [          19:0] n_ramp_signal,
    input  logic [          15:0] vts,
    input  logic [          15:0] rows,
    input  logic [          15:0] first_row,
    input  logic [          15:0] row_step,
    input  logic [          15:0] exposure_lines,
    input  logic                  latch_mode,
    input  logic                  gray,
    input  logic [          15:0] black,
    input  logic [           4:0] bits,
    input  logic [           4:0] lanes,
    input  logic [          15:0] columns,
    input  logic [   COLUMNS-1:0] comparators,
    output logic                  running,
    output logic [           2:0] state,
    output logic [          15:0] line,
    output logic [          15:0] row,
    output logic                  frame_valid,
    output logic                  line_valid,
    output logic                  clear,
    output logic                  fd_reset,
    output logic                  sample_reset,
    output logic                  transfer,
    output logic                  sample_signal,
    output logic                  ramp_start,
    output logic                  ramp_down,
    output logic                  latch,
    output logic                  shutter_reset,
    output logic [          15:0] shutter_row,
    output logic                  global_transfer,
    output logic [          16:0] ramp_code,
    output logic [          16:0] count,
    output logic                  ramp_running,
    output logic                  ramp_step,
    output logic                  ramp_done,
    output logic [   COLUMNS-1:0] crossed,
    output logic [16*COLUMNS-1:0] codes,
    output logic [ MAX_LANES-1:0] lane,
    output logic                  valid,
    output logic                  busy,
    output logic                  word_start,
    output logic                  row_start,
    output logic                  overrun
);
  readout_seq seq (
      .clk(clk),
      .rst(rst),
      .stall(stall),
      .enable(enable),
      .global_shutter(global_shutter),
      .hts(hts),
      .n_settle_reset(n_settle_reset),
      .n_ramp_reset(n_ramp_reset),
      .n_settle_signal(n_settle_signal),
      .n_ramp_signal(n_ramp_signal),
      .vts(vts),
      .rows(rows),
      .first_row(first_row),
      .row_step(row_step),
      .exposure_lines(exposure_lines),
      .running(running),
      .state(state),
      .line(line),
      .row(row),
      .frame_valid(frame_valid),
      .line_valid(line_valid),
      .clear(clear),
      .fd_reset(fd_reset),
      .sample_reset(sample_reset),
      .transfer(transfer),
      .sample_signal(sample_signal),
      .ramp_start(ramp_start),
      .ramp_down(ramp_down),
      .latch(latch),
      .shutter_reset(shutter_reset),
      .shutter_row(shutter_row),
      .global_transfer(global_transfer)
  );

  // ramp_down is settled one clock after ramp_start at the latest, before the first step is compared.
  ramp_counter ramp (
      .clk(clk),
      .rst(rst),
      .stall(stall),
      .start(ramp_start),
      .gray(gray),
      .steps(ramp_down ? n_ramp_reset[16:0] : n_ramp_signal[16:0]),
      .ramp_code(ramp_code),
      .count(count),
      .running(ramp_running),
      .step(ramp_step),
      .done(ramp_done)
  );

  logic [15:0] code_max;
  assign code_max = ~(16'hFFFF << bits);

  genvar c;
  generate
    for (c = 0; c < COLUMNS; c = c + 1) begin : column
      // Seen by a waveform viewer only.
      /* verilator lint_off UNUSEDSIGNAL */
      logic signed [17:0] value;
      logic [16:0] latched;
      /* verilator lint_on UNUSEDSIGNAL */
      cds counter (
          .clk(clk),
          .rst(rst),
          .stall(stall),
          .latch_mode(latch_mode),
          .gray(gray),
          .black(black),
          .code_max(code_max),
          .clear(clear),
          .arm(ramp_start),
          .step(ramp_step),
          .done(ramp_done),
          .down(ramp_down),
          .comparator(comparators[c]),
          .count(count),
          .value(value),
          .latched(latched),
          .crossed(crossed[c]),
          .code(codes[16*c+:16])
      );
    end
  endgenerate

  lane_shift #(
      .COLUMNS  (COLUMNS),
      .MAX_LANES(MAX_LANES)
  ) shifter (
      .clk(clk),
      .rst(rst),
      .stall(stall),
      .bits(bits),
      .lanes(lanes),
      .columns(columns),
      .latch(latch),
      .codes(codes),
      .lane(lane),
      .valid(valid),
      .busy(busy),
      .word_start(word_start),
      .row_start(row_start),
      .overrun(overrun)
  );
endmodule
