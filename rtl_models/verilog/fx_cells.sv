// Lists of the best corners of each cell, two banks of cell rows for each octave.
//
// put: a corner of (octave, bank, column) enters; its list is read in that clock and written back, sorted, in the next, so corners come at least two clocks
// apart, as strict non-maximum suppression spaces them. A newcomer stands after all entries of equal or higher rank (the lowest RANK_BITS of the body); of a
// full list the last falls out (lost, in the clock after put). load (walker idle): the lists of one bank leave by columns from the next clock on, each from its
// first entry, one entry a clock in which take is 1; an empty list takes a clock. last stands in the walk's last clock; a walk of no columns takes one clock.
// A bank is not put to while it is walked. One memory for each octave and bank, a list a word; a list that was never written is known by its flag.
module fx_cells #(
    parameter MAX_WIDTH = 640,
    parameter OCTAVES   = 1,
    parameter CELL_LOG2 = 4,
    parameter PER_CELL  = 1,
    parameter RANK_BITS = 8,
    parameter BODY_BITS = 80
) (
    input  logic                 clk,
    input  logic                 rst,
    input  logic                 put,
    input  logic [          1:0] put_octave,
    input  logic                 put_bank,
    input  logic [          7:0] put_column,
    input  logic [BODY_BITS-1:0] put_body,
    output logic                 lost,
    input  logic                 load,
    input  logic [          1:0] load_octave,
    input  logic                 load_bank,
    input  logic [          8:0] load_columns,
    input  logic                 take,
    output logic                 active,
    output logic                 entry_valid,
    output logic [          7:0] entry_column,
    output logic [BODY_BITS-1:0] entry_body,
    output logic                 last
);
  localparam SLOT  = BODY_BITS + 1;     // an entry and its valid bit, the highest
  localparam WORD  = PER_CELL * SLOT;
  localparam BANKS = 2 * OCTAVES;

  // The newcomer between its read and its write.
  logic                 held;
  logic [1:0]           held_octave;
  logic                 held_bank;
  logic [7:0]           held_column;
  logic [BODY_BITS-1:0] held_body;
  always_ff @(posedge clk) begin
    if (rst) held <= 1'b0;
    else held <= put;
    if (put) begin
      held_octave <= put_octave;
      held_bank   <= put_bank;
      held_column <= put_column;
      held_body   <= put_body;
    end
  end

  logic [BANKS*WORD-1:0] words;
  logic [7:0] held_used, walk_used;  // of 2 OCTAVES banks
  logic [WORD-1:0] list, sorted;
  logic [PER_CELL-1:0] ahead;
  // A bank's list, or zeros where none was written. Picked bank by bank: a part-select at a product maps to a shifter over all banks.
  function automatic [WORD-1:0] list_of(input [BANKS*WORD-1:0] all, input [7:0] used, input [2:0] wanted);
    list_of = '0;
    for (int n = 0; n < BANKS; n = n + 1) begin
      if (wanted == n[2:0] && used[n]) list_of = list_of | all[n*WORD+:WORD];
    end
  endfunction
  assign list = list_of(words, held_used, {held_octave, held_bank});
  genvar e;
  generate
    for (e = 0; e < PER_CELL; e = e + 1) begin : each_entry
      assign ahead[e] = list[e*SLOT+SLOT-1] && list[e*SLOT+:RANK_BITS] >= held_body[RANK_BITS-1:0];
      if (e == 0) begin : first
        assign sorted[0+:SLOT] = ahead[0] ? list[0+:SLOT] : {1'b1, held_body};
      end else begin : other
        assign sorted[e*SLOT+:SLOT] = ahead[e] ? list[e*SLOT+:SLOT] : ahead[e-1] ? {1'b1, held_body} : list[(e-1)*SLOT+:SLOT];
      end
    end
  endgenerate
  assign lost = held && list[WORD-1];

  // The walker.
  logic [1:0] octave;
  logic bank;
  logic [7:0] column;
  logic [8:0] columns_left;
  logic [1:0] index;
  logic [WORD-1:0] cell_list;
  logic more, step;
  logic [SLOT-1:0] entry;
  assign cell_list = list_of(words, walk_used, {octave, bank});
  always_comb begin
    entry = '0;
    for (int n = 0; n < PER_CELL; n = n + 1) begin
      if (index == n[1:0]) entry = entry | cell_list[n*SLOT+:SLOT];
    end
  end
  assign entry_valid  = active && columns_left != 9'd0 && entry[SLOT-1];
  assign entry_column = column;
  assign entry_body   = entry[BODY_BITS-1:0];
  generate
    if (PER_CELL == 1) begin : single
      assign more = 1'b0;
    end else begin : several
      localparam [1:0] FULL = 2'(PER_CELL - 1);
      always_comb begin
        more = 1'b0;
        for (int n = 1; n < PER_CELL; n = n + 1) begin
          if (index + 2'd1 == n[1:0]) more = more | cell_list[n*SLOT+SLOT-1];
        end
        if (index == FULL) more = 1'b0;
      end
    end
  endgenerate
  assign step = active && columns_left != 9'd0 && (!entry_valid || (take && !more));
  assign last = active && (columns_left == 9'd0 || (step && columns_left == 9'd1));
  always_ff @(posedge clk) begin
    if (rst) begin
      active       <= 1'b0;
      octave       <= '0;
      bank         <= 1'b0;
      column       <= '0;
      columns_left <= '0;
      index        <= '0;
    end else if (load) begin
      active       <= 1'b1;
      octave       <= load_octave;
      bank         <= load_bank;
      column       <= '0;
      columns_left <= load_columns;
      index        <= '0;
    end else begin
      if (last) active <= 1'b0;
      if (step) begin
        column       <= column + 8'd1;
        columns_left <= columns_left - 9'd1;
        index        <= '0;
      end else if (entry_valid && take) begin
        index <= index + 2'd1;
      end
    end
  end

  genvar b;
  generate
    for (b = 0; b < BANKS; b = b + 1) begin : each_bank
      localparam [2:0] BANK = b;
      localparam COLUMNS = ((MAX_WIDTH >> (b / 2)) + (1 << CELL_LOG2) - 1) >> CELL_LOG2;
      localparam BITS = COLUMNS > 1 ? $clog2(COLUMNS) : 1;
      logic [WORD-1:0] lists[0:COLUMNS-1];
      logic [COLUMNS-1:0] used;
      logic [WORD-1:0] word;
      logic putting, storing, walking;
      logic [BITS-1:0] read_at;
      assign putting = put && {put_octave, put_bank} == BANK;
      assign storing = held && {held_octave, held_bank} == BANK;
      assign walking = load ? {load_octave, load_bank} == BANK : step && {octave, bank} == BANK;
      assign read_at = !walking ? put_column[BITS-1:0] : load ? {BITS{1'b0}} : column[BITS-1:0] + 1'b1;
      always_ff @(posedge clk) begin
        if (putting || walking) word <= lists[read_at];
        if (storing) lists[held_column[BITS-1:0]] <= sorted;
      end
      always_ff @(posedge clk) begin
        if (rst) used <= '0;
        else begin
          if (storing) used[held_column[BITS-1:0]] <= 1'b1;
          if (step && {octave, bank} == BANK) used[column[BITS-1:0]] <= 1'b0;
        end
      end
      assign words[b*WORD+:WORD] = word;
      assign held_used[b] = used[held_column[BITS-1:0]];
      assign walk_used[b] = used[column[BITS-1:0]];
    end
    for (b = BANKS; b < 8; b = b + 1) begin : no_bank
      assign held_used[b] = 1'b0;
      assign walk_used[b] = 1'b0;
    end
  endgenerate
  logic unused_bits;
  assign unused_bits = ^{held_column, column};
endmodule
