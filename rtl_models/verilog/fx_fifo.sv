// Queue of chosen corners before the engines, in registers, with a policy for a push that finds it full.
//
// Within a clock pop comes before push. policy 0 (stall): room is 0 and nothing may be pushed. 1 (drop newest): the pushed one is lost. 2 (drop weakest): of
// the entries and the newcomer, the one of lowest rank (lowest RANK_BITS of a word) goes, the newest among equals. dropped stands in the clock of the push.
module fx_fifo #(
    parameter DEPTH     = 16,
    parameter WIDTH     = 111,
    parameter RANK_BITS = 8
) (
    input  logic             clk,
    input  logic             rst,
    input  logic [      1:0] policy,
    input  logic             push,
    input  logic [WIDTH-1:0] push_word,
    output logic             room,
    output logic             dropped,
    input  logic             pop,
    output logic             valid,
    output logic [WIDTH-1:0] head
);
  logic [DEPTH*WIDTH-1:0] words;
  logic [DEPTH-1:0] held;  // entries below the count
  logic [DEPTH:0] used;    // the same, and 0 above
  logic full, weaker;
  assign used    = {1'b0, held};
  assign valid   = used[0];
  assign head    = words[WIDTH-1:0];
  assign full    = used[DEPTH-1] && !pop;
  assign room    = policy != 2'd0 || !full;
  assign dropped = push && full;

  // goes[i]: entry i is the newest among those of lowest rank.
  logic [DEPTH-1:0] goes;
  logic [RANK_BITS-1:0] lowest;
  always_comb begin
    goes   = {DEPTH{1'b0}};
    goes[0] = 1'b1;
    lowest = words[RANK_BITS-1:0];
    for (int i = 1; i < DEPTH; i = i + 1) begin
      if (words[i*WIDTH+:RANK_BITS] <= lowest) begin
        goes    = {DEPTH{1'b0}};
        goes[i] = 1'b1;
        lowest  = words[i*WIDTH+:RANK_BITS];
      end
    end
  end
  assign weaker = push_word[RANK_BITS-1:0] <= lowest;

  logic replaces;
  assign replaces = push && full && policy == 2'd2 && !weaker;

  genvar i;
  generate
    for (i = 0; i < DEPTH; i = i + 1) begin : each_place
      // After a pop, or behind the one that goes, the next entry moves here.
      logic moves, takes;
      logic [WIDTH-1:0] next_word;
      if (i == DEPTH - 1) begin : end_place
        assign next_word = push_word;
      end else begin : inner_place
        assign next_word = words[(i+1)*WIDTH+:WIDTH];
      end
      assign moves = pop || (replaces && (|goes[i:0]));
      if (i == 0) begin : front_place
        assign takes = push && (pop ? !used[1] : !used[0]);
      end else begin : later_place
        assign takes = push && (pop ? used[i] && !used[i+1] : used[i-1] && !used[i]);
      end
      always_ff @(posedge clk) begin
        if (rst) held[i] <= 1'b0;
        else if (pop) held[i] <= used[i+1] || takes;
        else if (takes) held[i] <= 1'b1;
        if (takes || (moves && used[i])) words[i*WIDTH+:WIDTH] <= takes ? push_word : next_word;
      end
    end
  endgenerate
endmodule
