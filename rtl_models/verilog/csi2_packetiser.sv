// CSI-2 packetiser: a request and the payload's pixels or bytes become header, payload and checksum, one word of lane bytes a clock.
//
// Inputs: a request (channel, data type, word count; of a short packet its data field) while req_ready; for long packets (data types from
// 0x10) beats of in_data while in_ready: four pixels of 16 bits each for RAW6 to RAW16 (0x28 to 0x2E), four bytes in the lower half for
// all other types. What a last beat holds beyond the word count is dropped. Outputs: words of a byte a lane (lanes_log2 0, 1, 2: 1, 2, 4
// lanes; byte i of the packet on lane i mod lanes), of which word_keep says which lanes carry one; word_first and word_last are the
// burst's ends. A word stands until word_ready. All outputs are registers or decoded from registers. Reset is synchronous; lanes_log2
// holds still.
module csi2_packetiser (
    input  logic        clk,
    input  logic        rst,
    input  logic [ 1:0] lanes_log2,
    input  logic        req_valid,
    input  logic [ 1:0] channel,
    input  logic [ 5:0] data_type,
    input  logic [15:0] word_count,
    output logic        req_ready,
    input  logic        in_valid,
    input  logic [63:0] in_data,
    output logic        in_ready,
    input  logic        word_ready,
    output logic        word_valid,
    output logic [31:0] word,
    output logic [ 3:0] word_keep,
    output logic        word_first,
    output logic        word_last
);
  localparam [1:0] IDLE = 2'd0, HEAD = 2'd1, BODY = 2'd2, FOOT = 2'd3;

  logic [1:0] state;
  logic [5:0] kind;
  logic [31:0] header;    // bytes that are left of it, the next one lowest
  logic [2:0] head_left;  // how many
  logic [15:0] left;      // payload bytes that are not on the lanes yet
  logic [127:0] held;     // payload that waits, the next byte lowest, zero above
  logic [4:0] nibbles;    // of held in use: RAW7 beats end in the middle of a byte
  logic [15:0] crc;

  // Error correction code of data identifier and word count.
  function automatic [7:0] ecc_of(input [23:0] d);
    ecc_of = {
      2'b00,
      ^(d & 24'hEFFC00),
      ^(d & 24'hDF03F0),
      ^(d & 24'hB8E38E),
      ^(d & 24'h749A6D),
      ^(d & 24'hF2555B),
      ^(d & 24'hF12CB7)
    };
  endfunction

  // x^16 + x^12 + x^5 + 1, the least significant bit first.
  function automatic [15:0] crc_of(input [15:0] seed, input [7:0] data);
    integer i;
    crc_of = seed;
    for (i = 0; i < 8; i = i + 1) crc_of = {1'b0, crc_of[15:1]} ^ ((crc_of[0] ^ data[i]) ? 16'h8408 : 16'h0000);
  endfunction

  function automatic [3:0] keep_of(input [2:0] bytes);
    case (bytes)
      3'd0: keep_of = 4'b0000;
      3'd1: keep_of = 4'b0001;
      3'd2: keep_of = 4'b0011;
      3'd3: keep_of = 4'b0111;
      default: keep_of = 4'b1111;
    endcase
  endfunction

  function automatic [31:0] mask_of(input [3:0] keep);
    mask_of = {{8{keep[3]}}, {8{keep[2]}}, {8{keep[1]}}, {8{keep[0]}}};
  endfunction

  // Bytes of a full word.
  logic [2:0] across;
  assign across = lanes_log2[1] ? 3'd4 : lanes_log2[0] ? 3'd2 : 3'd1;

  // A beat as the payload's bits, and how many nibbles they are.
  logic [15:0] p0, p1, p2, p3;
  assign {p3, p2, p1, p0} = in_data;
  logic [63:0] beat;
  logic [4:0] beat_nibbles;
  always_comb begin
    case (kind)
      6'h28: {beat_nibbles, beat} = {5'd6, 40'd0, p3[5:0], p2[5:0], p1[5:0], p0[5:0]};
      6'h29: {beat_nibbles, beat} = {5'd7, 36'd0, p3[6:0], p2[6:0], p1[6:0], p0[6:0]};
      6'h2A: {beat_nibbles, beat} = {5'd8, 32'd0, p3[7:0], p2[7:0], p1[7:0], p0[7:0]};
      6'h2B:
      {beat_nibbles, beat} = {
        5'd10, 24'd0, p3[1:0], p2[1:0], p1[1:0], p0[1:0], p3[9:2], p2[9:2], p1[9:2], p0[9:2]
      };
      6'h2C:
      {beat_nibbles, beat} = {
        5'd12, 16'd0, p3[3:0], p2[3:0], p3[11:4], p2[11:4], p1[3:0], p0[3:0], p1[11:4], p0[11:4]
      };
      6'h2D:
      {beat_nibbles, beat} = {
        5'd14, 8'd0, p3[5:0], p2[5:0], p1[5:0], p0[5:0], p3[13:6], p2[13:6], p1[13:6], p0[13:6]
      };
      6'h2E:
      {beat_nibbles, beat} = {
        5'd16, p3[7:0], p3[15:8], p2[7:0], p2[15:8], p1[7:0], p1[15:8], p0[7:0], p0[15:8]
      };
      default: {beat_nibbles, beat} = {5'd8, 32'd0, in_data[31:0]};
    endcase
  end

  // What the next word of the body would be.
  logic closes, enough;
  logic [2:0] take, filled;
  assign closes = left < {13'd0, across};
  assign take   = closes ? left[2:0] : across;
  assign enough = nibbles >= {1'b0, take, 1'b0};
  assign filled = closes && take + 3'd2 < across ? take + 3'd2 : across;
  logic [15:0] crc1, crc2, crc3, crc4, crc_after;
  assign crc1 = crc_of(crc, held[7:0]);
  assign crc2 = crc_of(crc1, held[15:8]);
  assign crc3 = crc_of(crc2, held[23:16]);
  assign crc4 = crc_of(crc3, held[31:24]);
  always_comb begin
    case (take)
      3'd0: crc_after = crc;
      3'd1: crc_after = crc1;
      3'd2: crc_after = crc2;
      3'd3: crc_after = crc3;
      default: crc_after = crc4;
    endcase
  end
  logic [31:0] checksum, body;
  assign checksum = closes ? {16'd0, crc_after} << {take, 3'd0} : 32'd0;
  assign body = (held[31:0] & mask_of(keep_of(take)) | checksum) & mask_of(keep_of(across));

  // The output register takes a word where it is empty or about to be.
  logic advance, emit, accept;
  assign advance = !word_valid || word_ready;
  assign emit    = advance && (state == HEAD || (state == BODY && enough) || state == FOOT);
  assign accept  = in_valid && in_ready;
  assign req_ready = state == IDLE;
  assign in_ready  = state == BODY && nibbles < 5'd16 && {left, 1'b0} > {12'd0, nibbles};

  logic [4:0] nibbles_after;
  logic [127:0] held_after;
  assign nibbles_after = state == BODY && emit ? nibbles - {1'b0, take, 1'b0} : nibbles;
  assign held_after    = state == BODY && emit ? held >> {take, 3'd0} : held;

  always_ff @(posedge clk) begin
    if (rst) begin
      state      <= IDLE;
      kind       <= '0;
      header     <= '0;
      head_left  <= '0;
      left       <= '0;
      held       <= '0;
      nibbles    <= '0;
      crc        <= '0;
      word_valid <= 1'b0;
      word       <= '0;
      word_keep  <= '0;
      word_first <= 1'b0;
      word_last  <= 1'b0;
    end else begin
      if (advance) word_valid <= emit;
      nibbles <= nibbles_after + (accept ? beat_nibbles : 5'd0);
      held    <= held_after | (accept ? {64'd0, beat} << {nibbles_after, 2'd0} : 128'd0);
      case (state)
        IDLE: begin
          if (req_valid) begin
            state     <= HEAD;
            kind      <= data_type;
            header    <= {ecc_of({word_count, channel, data_type}), word_count, channel, data_type};
            head_left <= 3'd4;
            left      <= word_count;
            crc       <= 16'hFFFF;
          end
        end
        HEAD: begin
          if (emit) begin
            word       <= header & mask_of(keep_of(across));
            word_keep  <= keep_of(across);
            word_first <= head_left == 3'd4;
            word_last  <= head_left == across && kind[5:4] == 2'd0;
            header     <= header >> {across, 3'd0};
            head_left  <= head_left - across;
            if (head_left == across) state <= kind[5:4] == 2'd0 ? IDLE : BODY;
          end
        end
        BODY: begin
          if (emit) begin
            word       <= body;
            word_keep  <= keep_of(filled);
            word_first <= 1'b0;
            word_last  <= closes && take + 3'd2 <= across;
            left       <= left - {13'd0, take};
            crc        <= crc_after;
            if (closes) begin
              state   <= take + 3'd2 <= across ? IDLE : FOOT;
              held    <= '0;
              nibbles <= '0;
            end
          end
        end
        FOOT: begin
          if (emit) begin
            word       <= {24'd0, crc[15:8]};
            word_keep  <= 4'b0001;
            word_first <= 1'b0;
            word_last  <= 1'b1;
            state      <= IDLE;
          end
        end
      endcase
    end
  end
endmodule
