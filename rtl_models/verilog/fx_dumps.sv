// Row numbers, the queue of lists to dump, and which rows of the picture may come.
//
// Rows are numbered on over frames, modulo 4096: base of the octave (rises by its height when its frame is dumped) plus the row. row_end of row y triggers the
// dump of cell row r if y = (r + 1) C + 15; a virtual row triggers the last dump of the octave's frame, which may walk nothing. Triggers queue in their order;
// fx_cells walks one at a time. row_ok is decoded from the request and registers: row 0 waits for all dumps of the octave; the first row with corners of a cell
// row waits until its bank is dumped; under policy stall a row that would overwrite smoothed rows of a corner that is still to be loaded waits.
module fx_dumps #(
    parameter OCTAVES   = 1,
    parameter CELL_LOG2 = 4,
    parameter RING_LOG2 = 6
) (
    input  logic                 clk,
    input  logic                 rst,
    input  logic [         15:0] width,
    input  logic [         15:0] height,
    input  logic                 stall_policy,
    // Rows that ended, and the row that wants to start.
    input  logic                 row_end,
    input  logic [          1:0] row_octave,
    input  logic [         15:0] row,
    input  logic                 row_virtual,
    input  logic [          1:0] req_octave,
    input  logic [         15:0] req_row,
    input  logic                 req_virtual,
    output logic                 row_ok,
    // The walker of the lists.
    output logic                 load,
    output logic [          1:0] load_octave,
    output logic                 load_bank,
    output logic [          8:0] load_columns,
    input  logic                 walking,
    input  logic                 walk_last,
    output logic [          1:0] walk_octave,
    output logic [         11:0] walk_row,     // first picture row of the cell row
    output logic [         11:0] walk_base,
    output logic                 walk_frame,
    // Corners that enter the queue of the engines, and that have been loaded from it.
    input  logic                 pushed,
    input  logic                 loaded,
    input  logic [          1:0] loaded_octave,
    input  logic                 loaded_bank,
    // Numbers of rows.
    input  logic [          1:0] sm_octave,
    output logic [         11:0] sm_base,
    input  logic [          1:0] head_octave,
    output logic [         11:0] head_next
);
  localparam DEPTH = 2 * OCTAVES;
  localparam ROW_BITS = 12 - CELL_LOG2;
  localparam JOB = ROW_BITS + 4;  // end of frame, walks, octave, cell row
  localparam [15:0] CELL = 16'(1 << CELL_LOG2);
  localparam [11:0] KEPT = (1 << RING_LOG2) - 10;
  localparam [1:0] MASK = OCTAVES == 1 ? 0 : OCTAVES == 2 ? 1 : 3;

  // The trigger.
  logic [1:0] ended;
  logic [15:0] ended_height, from_cell, left;
  logic trigger, ended_walks;
  logic [ROW_BITS-1:0] ended_row;
  assign ended        = row_octave & MASK;
  assign ended_height = height >> ended;
  assign from_cell    = row - 16'd15;
  assign left         = ended_height - 16'd17;
  assign ended_walks  = row_virtual ? ended_height >= 16'd33 && !(&left[CELL_LOG2-1:0]) : row >= CELL + 16'd15 && from_cell[CELL_LOG2-1:0] == '0;
  assign trigger      = row_end && (row_virtual || ended_walks);
  assign ended_row    = row_virtual ? left[11:CELL_LOG2] : from_cell[11:CELL_LOG2] - 1'b1;
  logic [15:0] ended_next;
  assign ended_next = row_virtual ? ended_height : row >= 16'd2 ? row - 16'd2 : 16'd0;

  // The queue; the head is job 0.
  logic [DEPTH*JOB-1:0] jobs;
  logic [DEPTH-1:0] held;
  logic [DEPTH:0] queued;  // held, and 0 above
  logic [JOB-1:0] job, walked;
  assign queued = {1'b0, held};
  assign job = jobs[JOB-1:0];
  assign load = queued[0] && !walking;
  genvar i;
  generate
    for (i = 0; i < DEPTH; i = i + 1) begin : each_job
      logic takes;
      if (i == 0) begin : front_job
        assign takes = trigger && (load ? !queued[1] : !queued[0]);
      end else begin : later_job
        assign takes = trigger && (load ? queued[i] && !queued[i+1] : queued[i-1] && !queued[i]);
      end
      always_ff @(posedge clk) begin
        if (rst) held[i] <= 1'b0;
        else if (load) held[i] <= queued[i+1] || takes;
        else if (takes) held[i] <= 1'b1;
        if (takes) jobs[i*JOB+:JOB] <= {row_virtual, ended_walks, ended, ended_row};
        else if (load && queued[i] && i + 1 < DEPTH) jobs[i*JOB+:JOB] <= jobs[((i+1)%DEPTH)*JOB+:JOB];
      end
    end
  endgenerate
  logic [15:0] load_width;
  assign load_octave  = job[ROW_BITS+:2];
  assign load_bank    = job[0];
  assign load_width   = (width >> load_octave) + CELL - 16'd1;
  assign load_columns = job[ROW_BITS+2] ? load_width[8+CELL_LOG2:CELL_LOG2] : 9'd0;
  always_ff @(posedge clk) begin
    if (rst) walked <= '0;
    else if (load) walked <= job;
  end
  logic walk_end, walk_walks, walk_bank;
  assign {walk_end, walk_walks, walk_octave} = walked[JOB-1:ROW_BITS];
  assign walk_bank = walked[0];
  assign walk_row  = {walked[ROW_BITS-1:0], {CELL_LOG2{1'b0}}};

  // Registers of each octave.
  logic [4*12-1:0] bases, nexts;
  logic [3:0] frames, ending;
  logic [7:0] dumping, busy;
  logic [8*12-1:0] busy_rows;
  genvar k;
  generate
    for (k = 0; k < OCTAVES; k = k + 1) begin : each_octave
      localparam [1:0] OCTAVE = k;
      logic ends, ended_here;
      logic [11:0] octave_height;
      assign octave_height = height[k+:12];
      assign ends = walk_last && walk_octave == OCTAVE && walk_end;
      assign ended_here = row_end && ended == OCTAVE;
      logic [11:0] base, next;
      logic frame, end_waits;
      assign bases[k*12+:12] = base;
      assign nexts[k*12+:12] = next;
      assign frames[k] = frame;
      assign ending[k] = end_waits;
      always_ff @(posedge clk) begin
        if (rst) begin
          base      <= '0;
          next      <= '0;
          frame     <= 1'b0;
          end_waits <= 1'b0;
        end else begin
          if (ends) begin
            base  <= base + octave_height;
            frame <= !frame;
          end
          if (ended_here) next <= base + ended_next[11:0];
          end_waits <= (end_waits && !ends) || (ended_here && row_virtual);
        end
      end
    end
    for (k = 0; k < 2 * OCTAVES; k = k + 1) begin : each_bank
      localparam [2:0] BANK = k;
      logic begins, stops, enters, leaves;
      logic [6:0] waiting;  // corners dumped and not yet loaded, under policy stall
      assign begins = row_end && ended_walks && {ended, ended_row[0]} == BANK;
      assign stops  = walk_last && walk_walks && {walk_octave, walk_bank} == BANK;
      assign enters = pushed && {walk_octave, walk_bank} == BANK;
      assign leaves = loaded && {loaded_octave & MASK, loaded_bank} == BANK;
      logic to_dump;
      logic [11:0] first_row;
      assign dumping[k] = to_dump;
      assign busy[k] = to_dump || waiting != 7'd0;
      assign busy_rows[k*12+:12] = first_row;
      always_ff @(posedge clk) begin
        if (rst) begin
          to_dump <= 1'b0;
          waiting <= '0;
        end else begin
          to_dump <= (to_dump && !stops) || begins;
          if (enters != leaves) waiting <= enters ? waiting + 7'd1 : waiting - 7'd1;
        end
        if (begins && !busy[k]) first_row <= bases[(k/2)*12+:12] + {ended_row, {CELL_LOG2{1'b0}}};
      end
    end
  endgenerate

  generate
    for (k = OCTAVES; k < 4; k = k + 1) begin : no_octave
      assign bases[k*12+:12] = '0;
      assign nexts[k*12+:12] = '0;
      assign {frames[k], ending[k]} = '0;
      assign {dumping[2*k+:2], busy[2*k+:2]} = '0;
      assign busy_rows[2*k*12+:24] = '0;
    end
  endgenerate

  assign walk_base  = bases[walk_octave*12+:12];
  assign walk_frame = frames[walk_octave];
  assign sm_base    = bases[sm_octave*12+:12];
  assign head_next  = nexts[head_octave*12+:12];

  // The request.
  logic [1:0] wanted;
  logic [15:0] from_first;
  logic [11:0] asked, age0, age1;
  logic first_waits, bank_waits, ring_waits;
  assign wanted      = req_octave & MASK;
  assign from_first  = req_row - 16'd4;
  assign first_waits = req_row == 16'd0 && (ending[wanted] || dumping[{wanted, 1'b0}] || dumping[{wanted, 1'b1}]);
  assign bank_waits  = req_row >= 16'd4 && from_first[CELL_LOG2-1:0] == '0 && dumping[{wanted, from_first[CELL_LOG2]}];
  assign asked       = bases[wanted*12+:12] + req_row[11:0];
  assign age0        = asked - busy_rows[{wanted, 1'b0}*12+:12];
  assign age1        = asked - busy_rows[{wanted, 1'b1}*12+:12];
  assign ring_waits  = stall_policy && !req_virtual
                    && ((busy[{wanted, 1'b0}] && !age0[11] && age0 >= KEPT) || (busy[{wanted, 1'b1}] && !age1[11] && age1 >= KEPT));
  assign row_ok      = !(first_waits || bank_waits || ring_waits);
  logic unused_bits;
  assign unused_bits = ^{from_cell, left, ended_next, load_width, bases, from_first, loaded_octave};
endmodule
