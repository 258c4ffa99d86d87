// Direction of a corner: the intensity centroid of a disc of radius 13, by a fixed-point arctangent of 256 steps.
//
// 27 columns of 27 pixels enter, left to right, first with the first; pixel j of a column is row j - 13. Ten clocks after the last column (it stands in clock t,
// the angle first in t+10) angle_valid stands for one clock and angle holds until the next. The moments are those of the smoothed picture, up to
// 1464 x (2^PIX_BITS - 1) in size. The octant's slope short / long is compared with the 32 slopes half-way between neighbouring angles, six of them, by halving.
// angle_bits 1 .. 8: the angle is rounded to so many bits (half up, whole turns fall off).
module fx_orient #(
    parameter PIX_BITS = 8
) (
    input  logic                   clk,
    input  logic                   rst,
    input  logic [            3:0] angle_bits,
    input  logic                   column_valid,
    input  logic [            4:0] column_index,
    input  logic [27*PIX_BITS-1:0] column,
    output logic                   angle_valid,
    output logic [            7:0] angle
);
  localparam SUM = PIX_BITS + 5;   // 27 pixels
  localparam ARM = PIX_BITS + 8;   // 91 pixels either way, signed
  localparam MOM = PIX_BITS + 12;  // signed

  // Rows of the disc either side of its middle, at columns 13 .. 0 away from it: the floor of sqrt(169 - d^2).
  localparam [14*4-1:0] REACH = {4'd0, 4'd5, 4'd6, 4'd8, 4'd9, 4'd10, 4'd10, 4'd11, 4'd12, 4'd12, 4'd12, 4'd12, 4'd12, 4'd13};

  // round(2^16 tan((2k + 1) pi / 256)), k = 0 .. 31.
  localparam [32*16-1:0] SLOPES = {
    16'd63947, 16'd60880, 16'd57950, 16'd55144, 16'd52451, 16'd49863, 16'd47369, 16'd44963,
    16'd42636, 16'd40382, 16'd38196, 16'd36071, 16'd34002, 16'd31986, 16'd30018, 16'd28093,
    16'd26208, 16'd24360, 16'd22546, 16'd20762, 16'd19005, 16'd17273, 16'd15564, 16'd13874,
    16'd12202, 16'd10545, 16'd8901, 16'd7268, 16'd5644, 16'd4026, 16'd2414, 16'd804
  };

  // One column's sum and first moment.
  logic [3:0] far, rows;
  logic [SUM-1:0] sum;
  logic signed [ARM-1:0] arm;
  logic signed [4:0] offset;
  assign offset = $signed(column_index) - 5'sd13;
  assign far    = offset[4] ? 4'd13 - column_index[3:0] : offset[3:0];
  assign rows   = REACH[far*4+:4];
  always_comb begin
    sum = {5'd0, column[13*PIX_BITS+:PIX_BITS]};
    arm = '0;
    for (int j = 1; j <= 13; j = j + 1) begin
      if (j <= {28'd0, rows}) begin
        sum = sum + {5'd0, column[(13+j)*PIX_BITS+:PIX_BITS]} + {5'd0, column[(13-j)*PIX_BITS+:PIX_BITS]};
        arm = arm + $signed(j[4:0]) * ($signed({8'd0, column[(13+j)*PIX_BITS+:PIX_BITS]}) - $signed({8'd0, column[(13-j)*PIX_BITS+:PIX_BITS]}));
      end
    end
  end

  logic summed, summed_first, summed_last;
  logic signed [4:0] summed_offset;
  logic [SUM-1:0] column_sum;
  logic signed [ARM-1:0] column_arm;
  logic signed [MOM-1:0] x_moment, y_moment, across, along;
  assign across = $signed({{(MOM - SUM) {1'b0}}, column_sum}) * $signed({{(MOM - 5) {summed_offset[4]}}, summed_offset});
  assign along  = {{(MOM - ARM) {column_arm[ARM-1]}}, column_arm};

  logic whole;       // both moments stand
  logic searching;
  logic [2:0] round;
  logic [MOM-2:0] long_side, short_side, x_size, y_size;
  logic x_below, y_below, steep, flat;
  logic [5:0] steps;
  assign x_size = x_moment[MOM-1] ? ~x_moment[MOM-2:0] + 1'b1 : x_moment[MOM-2:0];
  assign y_size = y_moment[MOM-1] ? ~y_moment[MOM-2:0] + 1'b1 : y_moment[MOM-2:0];

  logic [5:0] trial;
  logic [4:0] slope_at;
  logic above;
  assign trial    = steps + (6'd32 >> round);
  assign slope_at = trial[4:0] - 5'd1;
  assign above    = {short_side, 16'd0} >= long_side * {{(MOM - 1) {1'b0}}, SLOPES[slope_at*16+:16]};

  logic [7:0] quarter, turn, half;
  assign quarter = steep ? 8'd64 - {2'd0, steps} : {2'd0, steps};
  assign turn    = flat ? 8'd0 : ({x_below, y_below} == 2'b00) ? quarter : ({x_below, y_below} == 2'b10) ? 8'd128 - quarter
                 : ({x_below, y_below} == 2'b11) ? 8'd128 + quarter : 8'd0 - quarter;
  assign half    = angle_bits[3] ? 8'd0 : 8'd128 >> angle_bits[2:0];

  always_ff @(posedge clk) begin
    if (rst) begin
      summed      <= 1'b0;
      whole       <= 1'b0;
      searching   <= 1'b0;
      angle_valid <= 1'b0;
      angle       <= '0;
      round       <= '0;
    end else begin
      summed    <= column_valid;
      whole     <= summed && summed_last;
      searching <= whole || (searching && round != 3'd6);
      round     <= whole ? 3'd0 : round + 3'd1;
      angle_valid <= searching && round == 3'd6;
      if (searching && round == 3'd6) angle <= (turn + half) & ~(half == 8'd0 ? 8'd0 : (half << 1) - 8'd1);
    end
    if (column_valid) begin
      summed_first  <= column_index == 5'd0;
      summed_last   <= column_index == 5'd26;
      summed_offset <= offset;
      column_sum    <= sum;
      column_arm    <= arm;
    end
    if (summed) begin
      x_moment <= summed_first ? across : x_moment + across;
      y_moment <= summed_first ? along : y_moment + along;
    end
    if (whole) begin
      steep      <= y_size > x_size;
      long_side  <= y_size > x_size ? y_size : x_size;
      short_side <= y_size > x_size ? x_size : y_size;
      flat       <= x_size == '0 && y_size == '0;
      x_below    <= x_moment[MOM-1];
      y_below    <= y_moment[MOM-1];
      steps      <= '0;
    end else if (searching && round != 3'd6 && trial <= 6'd32 && above) begin
      steps <= trial;
    end
  end
endmodule
