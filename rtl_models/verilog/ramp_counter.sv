// Shared ramp step counter: drives the ramp DAC and distributes the count to the columns.
//
// Inputs: start (one clock), steps (1 .. 2^16; 0 acts as 1), gray. Outputs, all from registers: ramp_code, the step at which the ramp
// stands; step, high in each clock in which ramp_code is fresh and the comparators are to be looked at; count, the code one step
// behind the ramp (so that a column that sees its comparator rise latches the number of edges at or below its level), binary or Gray;
// done, one clock after the last step, when count holds all steps. A start during running or step is not heard. Reset is synchronous.
module ramp_counter #(
    parameter COUNT_WIDTH = 17
) (
    input  logic                   clk,
    input  logic                   rst,
    input  logic                   stall,
    input  logic                   start,
    input  logic                   gray,
    input  logic [COUNT_WIDTH-1:0] steps,
    output logic [COUNT_WIDTH-1:0] ramp_code,
    output logic [COUNT_WIDTH-1:0] count,
    output logic                   running,
    output logic                   step,
    output logic                   done
);
  logic [COUNT_WIDTH-1:0] next_code;
  assign next_code = ramp_code + {{(COUNT_WIDTH - 1) {1'b0}}, 1'b1};

  always_ff @(posedge clk) begin
    if (rst) begin
      ramp_code <= '0;
      count     <= '0;
      running   <= 1'b0;
      step      <= 1'b0;
      done      <= 1'b0;
    end else if (!stall) begin
      step <= running;
      done <= step && !running;
      if (running) begin
        ramp_code <= next_code;
        running   <= next_code < steps;
      end
      if (running || step) count <= gray ? ramp_code ^ (ramp_code >> 1) : ramp_code;
      if (start && !running && !step) begin
        running   <= 1'b1;
        ramp_code <= '0;
        count     <= '0;
      end
    end
  end
endmodule
