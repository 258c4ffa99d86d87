// One descriptor engine: patch memory of 27 columns of 27 smoothed pixels, one comparison a clock, and the record until it is taken.
//
// column_valid: a column of this engine's corner is stored. go: angle and the record's other words (fx_back) enter, the patch is whole; DESC_BITS + 4 clocks later
// done stands, with bit i = first point of pair i darker than the second. taken ends it. The patch memory is read at two columns a clock.
module fx_engine #(
    parameter PIX_BITS  = 8,
    parameter DESC_BITS = 256,
    parameter SYMMETRIC = 0
) (
    input  logic                   clk,
    input  logic                   rst,
    input  logic                   column_valid,
    input  logic [            4:0] column_index,
    input  logic [27*PIX_BITS-1:0] column,
    input  logic                   go,
    input  logic [            7:0] go_angle,
    input  logic [           15:0] go_x_q4,
    input  logic [           15:0] go_y_q4,
    input  logic [   PIX_BITS-1:0] go_score,
    input  logic [            1:0] go_octave,
    input  logic                   go_frame,
    input  logic                   taken,
    output logic                   done,
    output logic [           15:0] x_q4,
    output logic [           15:0] y_q4,
    output logic [   PIX_BITS-1:0] score,
    output logic [            7:0] angle,
    output logic [            1:0] octave,
    output logic                   frame,
    output logic [  DESC_BITS-1:0] descriptor
);
  localparam [7:0] LAST = 8'(DESC_BITS - 1);

  // round(2^14 sin(2 pi k / 256)), k = 0 .. 64.
  localparam [65*15-1:0] SINES = {
    15'd16384, 15'd16379, 15'd16364, 15'd16340, 15'd16305, 15'd16261, 15'd16207, 15'd16143, 15'd16069, 15'd15986, 15'd15893,
    15'd15791, 15'd15679, 15'd15557, 15'd15426, 15'd15286, 15'd15137, 15'd14978, 15'd14811, 15'd14635, 15'd14449, 15'd14256,
    15'd14053, 15'd13842, 15'd13623, 15'd13395, 15'd13160, 15'd12916, 15'd12665, 15'd12406, 15'd12140, 15'd11866, 15'd11585,
    15'd11297, 15'd11003, 15'd10702, 15'd10394, 15'd10080, 15'd9760, 15'd9434, 15'd9102, 15'd8765, 15'd8423, 15'd8076,
    15'd7723, 15'd7366, 15'd7005, 15'd6639, 15'd6270, 15'd5897, 15'd5520, 15'd5139, 15'd4756, 15'd4370, 15'd3981,
    15'd3590, 15'd3196, 15'd2801, 15'd2404, 15'd2006, 15'd1606, 15'd1205, 15'd804, 15'd402, 15'd0
  };
  function automatic signed [15:0] sine_of(input [7:0] k);
    logic [6:0] place;
    logic signed [15:0] size;
    place = k[6:0] <= 7'd64 ? k[6:0] : 7'd0 - k[6:0];
    size = $signed({1'b0, SINES[place*15+:15]});
    sine_of = k[7] ? -size : size;
  endfunction

  logic running;
  logic [7:0] index, pair;
  logic signed [15:0] sine, cosine;
  assign pair = SYMMETRIC != 0 ? index + {angle[7:3], 3'd0} : index;

  logic place_valid, read_valid;
  logic [7:0] place_index, read_index;
  logic [4:0] x1, y1, x2, y2, row1, row2;
  fx_brief #(.SYMMETRIC(SYMMETRIC)) brief (.clk, .rst, .index_valid(running), .index, .pair, .sine, .cosine, .place_valid, .place_index, .x1, .y1, .x2, .y2);

  logic [27*PIX_BITS-1:0] patch[0:26];
  logic [27*PIX_BITS-1:0] column1, column2;
  always_ff @(posedge clk) begin
    if (column_valid) patch[column_index] <= column;
    if (place_valid) begin
      column1 <= patch[x1];
      column2 <= patch[x2];
      row1    <= y1;
      row2    <= y2;
    end
  end

  logic darker;
  assign darker = column1[row1*PIX_BITS+:PIX_BITS] < column2[row2*PIX_BITS+:PIX_BITS];

  always_ff @(posedge clk) begin
    if (rst) begin
      running    <= 1'b0;
      read_valid <= 1'b0;
      done       <= 1'b0;
      index      <= '0;
      x_q4       <= '0;
      y_q4       <= '0;
      score      <= '0;
      angle      <= '0;
      octave     <= '0;
      frame      <= 1'b0;
      descriptor <= '0;
    end else begin
      if (go) begin
        running <= 1'b1;
        x_q4    <= go_x_q4;
        y_q4    <= go_y_q4;
        score   <= go_score;
        angle   <= go_angle;
        octave  <= go_octave;
        frame   <= go_frame;
      end else if (index == LAST) begin
        running <= 1'b0;
      end
      index      <= running && index != LAST ? index + 8'd1 : 8'd0;
      read_valid <= place_valid;
      if (read_valid) descriptor[read_index[$clog2(DESC_BITS)-1:0]] <= darker;
      done <= (done && !taken) || (read_valid && read_index == LAST);
    end
    if (go) begin
      sine   <= sine_of(go_angle);
      cosine <= sine_of(go_angle + 8'd64);
    end
    if (place_valid) read_index <= place_index;
  end
endmodule
