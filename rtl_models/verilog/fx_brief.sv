// Places of the descriptor's point pairs: pattern and rotator.
//
// index enters with index_valid; place_valid stands two clocks later, with the columns and rows
// (0 .. 26) of both points and with the index. The points of the pattern are turned by sine and cosine (14 bits of fraction) and rounded half up. With SYMMETRIC the
// pattern holds 8 pairs under 32 turns, and turning is a start index (fx_engine): there is no rotator.
module fx_brief #(
    parameter SYMMETRIC = 0
) (
    input  logic               clk,
    input  logic               rst,
    input  logic               index_valid,
    input  logic        [ 7:0] index,
    input  logic        [ 7:0] pair,
    input  logic signed [15:0] sine,
    input  logic signed [15:0] cosine,
    output logic               place_valid,
    output logic        [ 7:0] place_index,
    output logic        [ 4:0] x1,
    output logic        [ 4:0] y1,
    output logic        [ 4:0] x2,
    output logic        [ 4:0] y2
);
  logic [19:0] points, picked;
  logic picked_valid;
  logic [7:0] picked_index;
  fx_pattern #(.SYMMETRIC(SYMMETRIC)) pattern (.pair, .points);

  logic [4:0] x1_next, y1_next, x2_next, y2_next;
  generate
    if (SYMMETRIC != 0) begin : unturned
      assign {x1_next, y1_next, x2_next, y2_next} = {picked[19:15] + 5'd13, picked[14:10] + 5'd13, picked[9:5] + 5'd13, picked[4:0] + 5'd13};
      logic unused_turn;
      assign unused_turn = ^{sine, cosine};
    end else begin : turned
      // Up to 13 x 16384 x sqrt(2): 20 bits signed.
      function automatic [4:0] rounded(input signed [19:0] value);
        rounded = 5'((value + 20'sd8192) >>> 14) + 5'd13;
      endfunction
      function automatic signed [19:0] times(input signed [4:0] coordinate, input signed [15:0] factor);
        times = $signed({{15{coordinate[4]}}, coordinate}) * $signed({{4{factor[15]}}, factor});
      endfunction
      assign x1_next = rounded(times(picked[19:15], cosine) - times(picked[14:10], sine));
      assign y1_next = rounded(times(picked[19:15], sine) + times(picked[14:10], cosine));
      assign x2_next = rounded(times(picked[9:5], cosine) - times(picked[4:0], sine));
      assign y2_next = rounded(times(picked[9:5], sine) + times(picked[4:0], cosine));
    end
  endgenerate

  always_ff @(posedge clk) begin
    if (rst) begin
      picked_valid <= 1'b0;
      place_valid  <= 1'b0;
    end else begin
      picked_valid <= index_valid;
      place_valid  <= picked_valid;
    end
    if (index_valid) begin
      picked       <= points;
      picked_index <= index;
    end
    if (picked_valid) begin
      place_index <= picked_index;
      {x1, y1, x2, y2} <= {x1_next, y1_next, x2_next, y2_next};
    end
  end
endmodule
