// Sequencer and ramp counter as in sensor_core, for the styles that write columns and lanes in another way.
  readout_seq seq (.*);
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

  function automatic [16:0] decoded(input logic [16:0] picked);
    logic [16:0] by8;
    by8 = picked ^ (picked >> 1);
    by8 = by8 ^ (by8 >> 2);
    by8 = by8 ^ (by8 >> 4);
    by8 = by8 ^ (by8 >> 8);
    return gray ? by8 ^ (by8 >> 16) : picked;
  endfunction

  function automatic [15:0] clipped(input logic signed [17:0] difference);
    return difference[17] ? 16'd0 : (difference[16:0] > {1'b0, code_max}) ? code_max : difference[15:0];
  endfunction
