// One column's counter with digital correlated double sampling.
//
// Inputs: the comparator's bit, looked at while step is high; clear (preload the black level), arm (a ramp begins), done (the ramp is
// over), down (the ramp is the reset ramp), count (shared, one step behind the ramp). Outputs: code = clip(black - n_reset + n_signal),
// n being the number of steps before the comparator rose. Two ways, chosen by latch_mode, give the same code after done:
//   0  the counter itself counts down in the reset ramp and up in the signal ramp until the comparator rises;
//   1  the shared count (Gray or binary) is latched when the comparator rises, or at done, and at done decoded and added or taken away.
// The difference is held in 18 bits, signed: black <= 2^16 - 1 and n <= 2^16 cannot leave them. Reset is synchronous.
module cds (
    input  logic               clk,
    input  logic               rst,
    input  logic               stall,
    input  logic               latch_mode,
    input  logic               gray,
    input  logic        [15:0] black,
    input  logic        [15:0] code_max,
    input  logic               clear,
    input  logic               arm,
    input  logic               step,
    input  logic               done,
    input  logic               down,
    input  logic               comparator,
    input  logic        [16:0] count,
    output logic signed [17:0] value,
    output logic        [16:0] latched,
    output logic               crossed,
    output logic        [15:0] code
);
  // Gray to binary is the XOR of all higher bits.
  logic [16:0] picked, by1, by2, by4, by8, decoded;
  assign picked  = crossed ? latched : count;
  assign by1     = picked ^ (picked >> 1);
  assign by2     = by1 ^ (by1 >> 2);
  assign by4     = by2 ^ (by2 >> 4);
  assign by8     = by4 ^ (by4 >> 8);
  assign decoded = gray ? by8 ^ (by8 >> 16) : picked;

  logic signed [17:0] amount;
  logic               move;
  assign amount = latch_mode ? $signed({1'b0, decoded}) : 18'sd1;
  assign move   = latch_mode ? done : step && !crossed && !comparator;

  always_ff @(posedge clk) begin
    if (rst) begin
      value   <= '0;
      latched <= '0;
      crossed <= 1'b0;
    end else if (!stall) begin
      if (clear) value <= $signed({2'b00, black});
      else if (move) value <= down ? value - amount : value + amount;
      if (latch_mode && !crossed && (done || (step && comparator))) latched <= count;
      if (arm) crossed <= 1'b0;
      else if (step && comparator) crossed <= 1'b1;
    end
  end

  assign code = value[17] ? 16'd0 : (value[16:0] > {1'b0, code_max}) ? code_max : value[15:0];
endmodule
