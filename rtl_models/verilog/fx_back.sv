// Corners and smoothed pixels in, features out: the back half of the extractor.
//
// Inputs: the front's pins (out_octave and out_row serve all three valids), width, height and settings, which hold still while pictures run. Outputs: records in
// the order in which their engines started, each until out_valid && out_ready; row_ok; the threshold; 32-bit counts since reset, which wrap.
// policy: 0 stall, 1 drop newest, 2 drop weakest. target 0: threshold_now is the port threshold; else threshold_now begins there in reset and moves at frame_end,
// by an eighth up or a sixteenth down, when the frame's corners with a patch leave target by more than an eighth; never below threshold.
module fx_back #(
    parameter MAX_WIDTH  = 640,
    parameter PIX_BITS   = 8,
    parameter OCTAVES    = 1,
    parameter HARRIS     = 0,
    parameter CELL_LOG2  = 4,
    parameter PER_CELL   = 1,
    parameter RING_LOG2  = 6,
    parameter ENGINES    = 2,
    parameter FIFO_DEPTH = 16,
    parameter DESC_BITS  = 256,
    parameter SYMMETRIC  = 0,
    parameter SUBPIXEL   = 1
) (
    input  logic                  clk,
    input  logic                  rst,
    input  logic [          15:0] width,
    input  logic [          15:0] height,
    input  logic [  PIX_BITS-1:0] threshold,
    input  logic [           1:0] policy,
    input  logic [          15:0] target,
    input  logic [           3:0] angle_bits,
    input  logic                  req,
    input  logic [           1:0] req_octave,
    input  logic [          15:0] req_row,
    input  logic                  req_virtual,
    output logic                  row_ok,
    input  logic [           1:0] in_octave,
    input  logic [          15:0] in_row,
    input  logic                  sm_valid,
    input  logic [          15:0] sm_x,
    input  logic [          15:0] sm_y,
    input  logic [  PIX_BITS-1:0] sm_pixel,
    input  logic                  corner_valid,
    input  logic [          15:0] corner_x,
    input  logic [          15:0] corner_y,
    input  logic [  PIX_BITS-1:0] corner_score,
    input  logic [9*PIX_BITS-1:0] corner_resp,
    input  logic [          15:0] corner_rank,
    input  logic                  row_end,
    input  logic                  row_end_virtual,
    input  logic                  frame_end,
    output logic [  PIX_BITS-1:0] threshold_now,
    output logic                  out_valid,
    input  logic                  out_ready,
    output logic [          15:0] out_x_q4,
    output logic [          15:0] out_y_q4,
    output logic [  PIX_BITS-1:0] out_score,
    output logic [           7:0] out_angle,
    output logic [           1:0] out_octave,
    output logic                  out_frame,
    output logic [ DESC_BITS-1:0] out_descriptor,
    output logic [          31:0] n_corners,
    output logic [          31:0] n_without_patch,
    output logic [          31:0] n_unselected,
    output logic [          31:0] n_dropped,
    output logic [          31:0] n_late,
    output logic [          31:0] n_features,
    output logic [          31:0] n_stalled
);
  localparam RANK = HARRIS != 0 ? 16 : PIX_BITS;
  localparam RESP = SUBPIXEL != 0 ? 8 * PIX_BITS : 0;
  localparam BODY = RESP + (HARRIS != 0 ? PIX_BITS : 0) + RANK + 2 * CELL_LOG2;  // resp but its middle, score if not the rank, position, rank
  localparam WORD = BODY - 2 * CELL_LOG2 + 12 * 3 + 3;                          // x, y, row number, octave, frame in place of the position in the cell
  localparam [11:0] AGE_MAX = (1 << RING_LOG2) - 14;
  localparam [1:0] LAST_ENGINE = 2'(ENGINES - 1);

  // Corners with a full patch go to their lists.
  logic [15:0] octave_width, octave_height;
  logic with_patch, put;
  logic [BODY-1:0] body;
  assign octave_width  = width >> in_octave;
  assign octave_height = height >> in_octave;
  assign with_patch = corner_x >= 16'd16 && corner_y >= 16'd16 && corner_x + 16'd16 < octave_width && corner_y + 16'd16 < octave_height;
  assign put = corner_valid && with_patch;
  assign body[RANK-1:0] = corner_rank[RANK-1:0];
  assign body[RANK+:CELL_LOG2] = corner_x[CELL_LOG2-1:0];
  assign body[RANK+CELL_LOG2+:CELL_LOG2] = corner_y[CELL_LOG2-1:0];
  generate
    if (HARRIS != 0) begin : with_rank
      assign body[RANK+2*CELL_LOG2+:PIX_BITS] = corner_score;
    end
    if (SUBPIXEL != 0) begin : with_resp
      assign body[BODY-1-:RESP] = {corner_resp[5*PIX_BITS+:4*PIX_BITS], corner_resp[0+:4*PIX_BITS]};
    end
  endgenerate
  logic unused_pins;
  assign unused_pins = ^{corner_score, corner_resp, corner_rank, corner_x[15:12], corner_y[15:12], sm_x[15:12], sm_y[15:12]};

  logic lost, load, load_bank, walking, walk_last, walk_frame, take, entry_valid;
  logic [1:0] load_octave, walk_octave;
  logic [8:0] load_columns;
  logic [11:0] walk_row, walk_base, sm_base, head_next;
  logic [7:0] entry_column, put_column;
  logic [BODY-1:0] entry;
  assign put_column = 8'(corner_x >> CELL_LOG2);
  fx_cells #(.MAX_WIDTH(MAX_WIDTH), .OCTAVES(OCTAVES), .CELL_LOG2(CELL_LOG2), .PER_CELL(PER_CELL), .RANK_BITS(RANK), .BODY_BITS(BODY)) cells (
      .clk, .rst, .put, .put_octave(in_octave), .put_bank(corner_y[CELL_LOG2]), .put_column, .put_body(body), .lost,
      .load, .load_octave, .load_bank, .load_columns, .take, .active(walking), .entry_valid, .entry_column, .entry_body(entry), .last(walk_last));

  // The dumped lists become candidates.
  logic [WORD-1:0] candidate, head;
  logic [11:0] entry_x, entry_y, entry_g;
  logic push, pop, start, room, dropped, head_valid, late, loaded;
  assign entry_x = ({4'd0, entry_column} << CELL_LOG2) | {{(12 - CELL_LOG2) {1'b0}}, entry[RANK+:CELL_LOG2]};
  assign entry_y = walk_row | {{(12 - CELL_LOG2) {1'b0}}, entry[RANK+CELL_LOG2+:CELL_LOG2]};
  assign entry_g = walk_base + entry_y;
  assign candidate[RANK-1:0] = entry[RANK-1:0];
  assign candidate[RANK+:39] = {walk_frame, walk_octave, entry_g, entry_y, entry_x};
  generate
    if (BODY > RANK + 2 * CELL_LOG2) begin : with_rest
      assign candidate[WORD-1:RANK+39] = entry[BODY-1:RANK+2*CELL_LOG2];
    end
  endgenerate
  assign take = room;
  assign push = entry_valid && take;
  fx_fifo #(.DEPTH(FIFO_DEPTH), .WIDTH(WORD), .RANK_BITS(RANK)) fifo (
      .clk, .rst, .policy, .push, .push_word(candidate), .room, .dropped, .pop, .valid(head_valid), .head);

  logic [11:0] head_age, sm_row;
  logic [1:0] head_octave;
  assign head_octave = head[RANK+36+:2];
  assign head_age = head_next - head[RANK+24+:12];
  assign late = policy != 2'd0 && head_valid && !head_age[11] && head_age >= AGE_MAX;

  // The corner that is loaded.
  logic [WORD-1:0] corner;
  logic busy;               // a corner is loaded, its orientation found
  logic [4:0] read_column;  // 0 .. 26 while the ring is read, then 27
  logic reading, go_fit;
  logic [1:0] engine, next_engine, turn;
  logic [3:0] idle, done;  // of ENGINES engines
  logic angle_valid;
  logic [7:0] angle;
  assign start   = head_valid && !late && !busy && idle[next_engine];
  assign pop     = start || late;
  assign reading = busy && read_column != 5'd27;
  assign loaded  = busy && read_column == 5'd26;
  always_ff @(posedge clk) begin
    if (rst) begin
      busy        <= 1'b0;
      go_fit      <= 1'b0;
      read_column <= '0;
      next_engine <= '0;
      engine      <= '0;
    end else begin
      busy   <= start || (busy && !angle_valid);
      go_fit <= start;
      if (start) begin
        read_column <= '0;
        engine      <= next_engine;
        next_engine <= next_engine == LAST_ENGINE ? 2'd0 : next_engine + 2'd1;
      end else if (reading) begin
        read_column <= read_column + 5'd1;
      end
    end
    if (start) corner <= head;
  end
  logic [11:0] x, y, g, first_row, read_x;
  logic [1:0] octave;
  logic frame, bank;
  logic [PIX_BITS-1:0] score;
  assign {frame, octave, g, y, x} = corner[RANK+:39];
  assign bank = y[CELL_LOG2];
  assign first_row = g - 12'd13;
  assign read_x = x - 12'd13 + {7'd0, read_column};
  assign sm_row = sm_base + sm_y[11:0];
  logic unused_rows;
  assign unused_rows = ^{first_row, sm_row, corner};
  generate
    if (HARRIS != 0) begin : score_beside_rank
      assign score = corner[RANK+39+:PIX_BITS];
    end else begin : score_is_rank
      assign score = corner[PIX_BITS-1:0];
    end
  endgenerate

  fx_dumps #(.OCTAVES(OCTAVES), .CELL_LOG2(CELL_LOG2), .RING_LOG2(RING_LOG2)) dumps (
      .clk, .rst, .width, .height, .stall_policy(policy == 2'd0),
      .row_end, .row_octave(in_octave), .row(in_row), .row_virtual(row_end_virtual), .req_octave, .req_row, .req_virtual, .row_ok,
      .load, .load_octave, .load_bank, .load_columns, .walking, .walk_last, .walk_octave, .walk_row, .walk_base, .walk_frame,
      .pushed(push && policy == 2'd0), .loaded(loaded && policy == 2'd0), .loaded_octave(octave), .loaded_bank(bank),
      .sm_octave(in_octave), .sm_base, .head_octave, .head_next);

  logic column_valid;
  logic [27*PIX_BITS-1:0] column;
  fx_ring #(.MAX_WIDTH(MAX_WIDTH), .PIX_BITS(PIX_BITS), .OCTAVES(OCTAVES), .RING_LOG2(RING_LOG2)) ring (
      .clk, .rst, .write(sm_valid), .write_octave(in_octave), .write_x(sm_x[11:0]), .write_slot(sm_row[RING_LOG2-1:0]), .write_pixel(sm_pixel),
      .read(reading), .read_octave(octave), .read_x, .read_slot(first_row[RING_LOG2-1:0]), .column_valid, .column);

  // Columns come two clocks after they are read.
  logic [4:0] column_index;
  always_ff @(posedge clk) begin
    if (rst || start) column_index <= '0;
    else if (column_valid) column_index <= column_index + 5'd1;
  end
  fx_orient #(.PIX_BITS(PIX_BITS)) orient (.clk, .rst, .angle_bits, .column_valid, .column_index, .column, .angle_valid, .angle);

  logic signed [4:0] dx, dy;
  generate
    if (SUBPIXEL != 0) begin : fitted
      logic [PIX_BITS-1:0] middle;
      assign middle = score + 1'b1;
      fx_fit #(.PIX_BITS(PIX_BITS)) fit (.clk, .rst, .go(go_fit), .resp({corner[WORD-1-:4*PIX_BITS], middle, corner[WORD-1-4*PIX_BITS-:4*PIX_BITS]}), .dx, .dy);
    end else begin : whole
      assign {dx, dy} = 10'd0;
      logic unused_go;
      assign unused_go = go_fit;
    end
  endgenerate

  // Sixteenths in octave 0, pixel centres whole: a half-scale pixel's centre lies between four.
  logic [15:0] x_q4, y_q4;
  assign x_q4 = (({x, 4'd8} + {{11{dx[4]}}, dx}) << octave) - 16'd8;
  assign y_q4 = (({y, 4'd8} + {{11{dy[4]}}, dy}) << octave) - 16'd8;

  localparam RECORD = 32 + PIX_BITS + 8 + 3 + DESC_BITS;
  logic [ENGINES*RECORD-1:0] records;
  logic out_take;
  assign out_valid = done[turn];
  assign out_take  = out_valid && out_ready;
  assign {out_x_q4, out_y_q4, out_score, out_angle, out_octave, out_frame, out_descriptor} = records[turn*RECORD+:RECORD];
  genvar e;
  generate
    for (e = 0; e < ENGINES; e = e + 1) begin : each_engine
      localparam [1:0] ENGINE = e;
      logic taken, starts, mine, free;
      assign idle[e] = free;
      assign taken  = out_take && turn == ENGINE;
      assign starts = start && next_engine == ENGINE;
      assign mine   = engine == ENGINE;
      always_ff @(posedge clk) begin
        if (rst) free <= 1'b1;
        else free <= (free && !starts) || taken;
      end
      fx_engine #(.PIX_BITS(PIX_BITS), .DESC_BITS(DESC_BITS), .SYMMETRIC(SYMMETRIC)) unit (
          .clk, .rst, .column_valid(column_valid && mine), .column_index, .column,
          .go(angle_valid && mine), .go_angle(angle), .go_x_q4(x_q4), .go_y_q4(y_q4), .go_score(score), .go_octave(octave), .go_frame(frame), .taken, .done(done[e]),
          .x_q4(records[e*RECORD+19+PIX_BITS+DESC_BITS+8+:16]), .y_q4(records[e*RECORD+3+PIX_BITS+DESC_BITS+8+:16]),
          .score(records[e*RECORD+11+DESC_BITS+:PIX_BITS]), .angle(records[e*RECORD+3+DESC_BITS+:8]), .octave(records[e*RECORD+1+DESC_BITS+:2]),
          .frame(records[e*RECORD+DESC_BITS]), .descriptor(records[e*RECORD+:DESC_BITS]));
    end
    for (e = ENGINES; e < 4; e = e + 1) begin : no_engine
      assign {idle[e], done[e]} = '0;
    end
  endgenerate

  // Counts, and the threshold that follows them.
  logic [31:0] taken_before;  // corners with a patch up to the frame before
  logic [31:0] taken_now, in_frame;
  logic [PIX_BITS-1:0] adapted, up, down, lowered;
  logic [PIX_BITS:0] raised;
  localparam [PIX_BITS:0] TOP = (1 << PIX_BITS) - 2;
  assign taken_now = n_corners - n_without_patch;
  assign in_frame  = taken_now - taken_before;
  assign up        = adapted >> 3;
  assign down      = adapted >> 4;
  assign lowered   = adapted - (down == '0 ? {{(PIX_BITS - 1) {1'b0}}, 1'b1} : down);
  assign raised    = {1'b0, adapted} + (up == '0 ? {{PIX_BITS{1'b0}}, 1'b1} : {1'b0, up});
  assign threshold_now = target == 16'd0 ? threshold : adapted;
  always_ff @(posedge clk) begin
    if (rst) begin
      turn            <= '0;
      taken_before    <= '0;
      adapted         <= threshold;
      n_corners       <= '0;
      n_without_patch <= '0;
      n_unselected    <= '0;
      n_dropped       <= '0;
      n_late          <= '0;
      n_features      <= '0;
      n_stalled       <= '0;
    end else begin
      if (out_take) begin
        turn       <= turn == LAST_ENGINE ? 2'd0 : turn + 2'd1;
        n_features <= n_features + 32'd1;
      end
      if (corner_valid) n_corners <= n_corners + 32'd1;
      if (corner_valid && !with_patch) n_without_patch <= n_without_patch + 32'd1;
      if (lost) n_unselected <= n_unselected + 32'd1;
      if (dropped) n_dropped <= n_dropped + 32'd1;
      if (late) n_late <= n_late + 32'd1;
      if (req && !row_ok) n_stalled <= n_stalled + 32'd1;
      if (frame_end) begin
        taken_before <= taken_now;
        if (in_frame > {16'd0, target} + {19'd0, target[15:3]}) adapted <= raised > TOP ? TOP[PIX_BITS-1:0] : raised[PIX_BITS-1:0];
        else if (in_frame < {16'd0, target} - {19'd0, target[15:3]} && adapted > threshold) adapted <= lowered < threshold ? threshold : lowered;
      end
    end
  end
endmodule
