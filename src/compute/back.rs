//! From cells to records in time: dumps of cell rows, the queue of candidates, the engines. Computes every feature's clock, the waits and
//! the losses.
//!
//! It applies the clock rules of `rtl_models/verilog/fx_back.sv` to events: clocks in which nothing can change are skipped. A value
//! of clock t was registered at the edge that ends t - 1.

use std::collections::VecDeque;

use super::cells::{CellLists, CornerCandidate};
use super::params::{ExtractorParams, OCTAVE_SIDE_PX_MIN, Overflow, PATCH_MARGIN_PX};
use super::rows::SlotRow;
use crate::num::{index, u32_from};
use crate::units::Size;

/// From a candidate's start to its record, without the comparisons, which take a clock each.
pub const ENGINE_FIXED_CLK: u64 = 43;
/// From one start to the next at least: they share the ring's read port.
pub const START_GAP_CLK: u64 = 40;
/// From a start to where the patch's rows may be overwritten.
const LOADED_CLK: u64 = 28;
/// Rows that a patch reaches below the corner's row: 13 and one that may begin while it is loaded.
const LATE_ROWS: i64 = 14;
/// Rows that a patch reaches above its cell row, less the three that smoothing is behind.
const GUARD_ROWS: i64 = 10;

/// When the link takes a record.
pub trait Records {
    /// The first clock from this one on in which a valid record is taken; it is taken then.
    fn taken(&mut self, clk: u64) -> u64;
}

/// Every record is taken as soon as it is valid.
pub struct AlwaysReady;

impl Records for AlwaysReady {
    fn taken(&mut self, clk: u64) -> u64 {
        clk
    }
}

/// A candidate that an engine took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Served {
    pub candidate: CornerCandidate,
    /// Its frame, from 0.
    pub frame: u64,
    /// Clock of the start of its engine.
    pub start_clk: u64,
    /// Clock in which its record was taken.
    pub out_clk: u64,
}

/// A candidate on its way.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    candidate: CornerCandidate,
    frame: u64,
    cell_row: u32,
    /// Its row, counted on over frames.
    row: i64,
}

/// A row of cells that leaves its lists.
#[derive(Clone, Copy, Debug)]
struct Dump {
    octave: usize,
    /// None where an octave ends without one.
    cell_row: Option<u32>,
    /// The octave's rows until the next frame, where this is its last dump.
    rows_of_frame: Option<u32>,
}

/// Where the walk over a row of cells is.
#[derive(Clone, Copy, Debug)]
struct Walker {
    dump: Dump,
    column: usize,
    entry: usize,
}

/// What an octave's rows must wait for.
#[derive(Clone, Copy, Debug, Default)]
struct OctaveState {
    /// Frame whose lists these are.
    frame: u64,
    /// First row of this frame, counted on over frames.
    base: i64,
    /// Row that is smoothed now or next.
    next_row: i64,
    /// Dumps that are queued or walk, by cell row mod 2; and the frame's last.
    dumping: [bool; 2],
    ending: bool,
    /// Candidates that are queued or load, by cell row mod 2; only counted where rows may wait.
    pending: [u32; 2],
    /// First row of the cell row that they belong to.
    busy_row: [i64; 2],
}

impl OctaveState {
    fn is_busy(&self, bank: usize) -> bool {
        self.dumping[bank] || self.pending[bank] > 0
    }
}

/// Queue, engines and what they hold, in clock `clk`.
#[derive(Debug)]
pub(crate) struct Back {
    params: ExtractorParams,
    sizes: Vec<Size>,
    clk: u64,
    octaves: Vec<OctaveState>,
    lists: Vec<CellLists>,
    dumps: VecDeque<Dump>,
    walker: Option<Walker>,
    queue: VecDeque<Waiting>,
    /// First clock in which the loader may start.
    loader_clk: u64,
    /// Patch that is being loaded: its octave, bank, and the clock in which it is no longer pending.
    loading: Option<(usize, usize, u64)>,
    /// First clock in which each engine may start; they take turns.
    engine_clk: Vec<u64>,
    starts: usize,
    last_out_clk: Option<u64>,
    pub served: Vec<Served>,
    pub dropped: u64,
    pub late: u64,
    /// Candidates in the queue at once, at most.
    pub queue_most: u32,
}

impl Back {
    pub fn new(params: &ExtractorParams, sizes: &[Size]) -> Self {
        Self {
            params: *params,
            sizes: sizes.to_vec(),
            clk: 0,
            octaves: vec![OctaveState::default(); sizes.len()],
            lists: vec![CellLists::default(); sizes.len()],
            dumps: VecDeque::new(),
            walker: None,
            queue: VecDeque::new(),
            loader_clk: 0,
            loading: None,
            engine_clk: vec![0; index(params.engines)],
            starts: 0,
            last_out_clk: None,
            served: Vec::new(),
            dropped: 0,
            late: 0,
            queue_most: 0,
        }
    }

    /// Whether rows may wait for candidates.
    fn may_stall(&self) -> bool {
        self.params.overflow == Overflow::Stall
    }

    /// Whether this row may start in the present clock.
    pub fn row_ok(&self, row: &SlotRow) -> bool {
        let octave = &self.octaves[row.octave];
        let cell_px = self.params.cell_px;
        if row.y == 0 && (octave.dumping != [false; 2] || octave.ending) {
            return false;
        }
        if row.y >= 4 && (row.y - 4).is_multiple_of(cell_px) && octave.dumping[bank((row.y - 4) / cell_px)] {
            return false;
        }
        let rows = i64::from(self.params.ring_rows()) - GUARD_ROWS;
        let overwrites =
            |bank: usize| octave.is_busy(bank) && octave.base + i64::from(row.y) - octave.busy_row[bank] >= rows;
        row.is_virtual || !self.may_stall() || !(overwrites(0) || overwrites(1))
    }

    /// The first row of an octave starts: from here on these are its lists.
    pub fn begin(&mut self, octave: usize, frame: u64, lists: CellLists) {
        self.octaves[octave].frame = frame;
        self.lists[octave] = lists;
    }

    /// The first clock from this one on in which the row may start; time goes on until then.
    pub fn wait_for_row(&mut self, row: &SlotRow, clk: u64, records: &mut dyn Records) -> u64 {
        self.advance(clk, records);
        while !self.row_ok(row) {
            let next = self.next_event().expect("a row waits for work that is under way");
            // Flags fall at the edge that ends an event's clock; a load's at its own.
            self.advance(next + 1, records);
        }
        self.clk
    }

    /// The end of a row is signalled in this clock.
    pub fn row_end(&mut self, row: &SlotRow, clk: u64, records: &mut dyn Records) {
        self.advance(clk, records);
        // What the clock does by itself comes before what its edge registers.
        let before: Vec<[bool; 2]> = self.octaves.iter().map(|octave| [octave.is_busy(0), octave.is_busy(1)]).collect();
        self.advance(clk + 1, records);
        let (cell_px, height_px) = (self.params.cell_px, self.sizes[row.octave].height_px);
        let octave = &mut self.octaves[row.octave];
        let trigger = |octave: &mut OctaveState, cell_row: u32| {
            let bank = bank(cell_row);
            octave.dumping[bank] = true;
            if !before[row.octave][bank] {
                octave.busy_row[bank] = octave.base + i64::from(cell_row * cell_px);
            }
        };
        if row.is_virtual {
            octave.next_row = octave.base + i64::from(height_px);
            let last = height_px.saturating_sub(PATCH_MARGIN_PX + 1) / cell_px;
            let is_left = height_px >= OCTAVE_SIDE_PX_MIN && (last + 1) * cell_px + 15 >= height_px;
            let cell_row = is_left.then_some(last);
            octave.ending = true;
            if let Some(cell_row) = cell_row {
                trigger(octave, cell_row);
            }
            self.dumps.push_back(Dump { octave: row.octave, cell_row, rows_of_frame: Some(height_px) });
        } else {
            octave.next_row = octave.base + i64::from(row.y.saturating_sub(2));
            if row.y >= cell_px + 15 && (row.y - 15).is_multiple_of(cell_px) {
                let cell_row = (row.y - 15) / cell_px - 1;
                trigger(octave, cell_row);
                self.dumps.push_back(Dump { octave: row.octave, cell_row: Some(cell_row), rows_of_frame: None });
            }
        }
    }

    /// Runs until all work before the next row is done; returns the first clock after it.
    pub fn finish(&mut self, records: &mut dyn Records) -> u64 {
        while let Some(next) = self.next_event() {
            self.advance(next + 1, records);
        }
        self.clk
    }

    /// The first clock from now on in which something changes, if no row ends.
    fn next_event(&self) -> Option<u64> {
        let mut next: Option<u64> = None;
        let mut sooner = |clk: u64| next = Some(next.map_or(clk, |next: u64| next.min(clk)));
        if let Some((_, _, clk)) = self.loading {
            sooner(clk.saturating_sub(1).max(self.clk));
        }
        if !self.queue.is_empty() {
            sooner(if self.head_is_late() { self.clk } else { self.start_clk() });
        }
        let is_full = self.queue.len() >= index(self.params.fifo_depth);
        let waits =
            is_full && self.may_stall() && self.walker.as_ref().is_some_and(|walker| self.entry(walker).is_some());
        if (self.walker.is_some() && !waits) || (self.walker.is_none() && !self.dumps.is_empty()) {
            sooner(self.clk);
        }
        next
    }

    /// The candidate that a walk has reached; none on an empty list.
    fn entry(&self, walker: &Walker) -> Option<&CornerCandidate> {
        let list = self.lists[walker.dump.octave].list(index(walker.dump.cell_row?), walker.column);
        list.get(walker.entry)
    }

    /// When the candidate at the queue's head starts.
    fn start_clk(&self) -> u64 {
        self.loader_clk.max(self.engine_clk[self.starts % self.engine_clk.len()]).max(self.clk)
    }

    fn head_is_late(&self) -> bool {
        let rows = i64::from(self.params.ring_rows()) - LATE_ROWS;
        let late = |head: &Waiting| self.octaves[usize::from(head.candidate.octave)].next_row - head.row >= rows;
        !self.may_stall() && self.queue.front().is_some_and(late)
    }

    /// Works until the values of clock `until` are there.
    pub fn advance(&mut self, until: u64, records: &mut dyn Records) {
        while self.clk < until {
            match self.next_event() {
                Some(clk) if clk < until => {
                    self.clk = clk;
                    self.clock(records);
                    self.clk += 1;
                }
                _ => self.clk = until,
            }
        }
    }

    /// One clock: the queue's head leaves before the walk's next entry comes.
    fn clock(&mut self, records: &mut dyn Records) {
        if let Some((octave, bank, clk)) = self.loading
            && clk <= self.clk + 1
        {
            self.octaves[octave].pending[bank] -= 1;
            self.loading = None;
        }
        // A walk that begins in this clock reads its first list in the next one.
        if self.walker.is_none() {
            self.pop(records);
            self.walker = self.dumps.pop_front().map(|dump| Walker { dump, column: 0, entry: 0 });
        } else {
            // The walk's push of this clock is not yet to be popped.
            self.pop(records);
            self.walk();
        }
    }

    fn pop(&mut self, records: &mut dyn Records) {
        if self.queue.is_empty() {
            return;
        }
        if self.head_is_late() {
            self.queue.pop_front();
            self.late += 1;
        } else if self.start_clk() == self.clk {
            let waiting = self.queue.pop_front().expect("it was looked at");
            self.start(&waiting, records);
        }
    }

    fn start(&mut self, waiting: &Waiting, records: &mut dyn Records) {
        let start_clk = self.clk;
        let ready_clk = start_clk + ENGINE_FIXED_CLK + u64::from(self.params.descriptor_bits);
        let out_clk = records.taken(self.last_out_clk.map_or(ready_clk, |last| ready_clk.max(last + 1)));
        let engine = self.starts % self.engine_clk.len();
        self.engine_clk[engine] = out_clk + 1;
        self.loader_clk = start_clk + START_GAP_CLK;
        if self.may_stall() {
            self.loading =
                Some((usize::from(waiting.candidate.octave), bank(waiting.cell_row), start_clk + LOADED_CLK));
        }
        self.starts += 1;
        self.last_out_clk = Some(out_clk);
        self.served.push(Served { candidate: waiting.candidate, frame: waiting.frame, start_clk, out_clk });
    }

    /// One clock of the walk over a row of cells.
    fn walk(&mut self) {
        let Some(mut walker) = self.walker else { return };
        let dump = walker.dump;
        let Some(cell_row) = dump.cell_row else { return self.end_of_walk(&dump) };
        let lists = &self.lists[dump.octave];
        let (list, columns) = (lists.list(index(cell_row), walker.column), lists.columns);
        let (entries, entry) = (list.len(), list.get(walker.entry).copied());
        if let Some(candidate) = entry {
            if !self.push(&candidate, cell_row) {
                return;
            }
            walker.entry += 1;
        }
        if walker.entry >= entries {
            (walker.column, walker.entry) = (walker.column + 1, 0);
        }
        if walker.column == columns {
            self.end_of_walk(&dump);
        } else {
            self.walker = Some(walker);
        }
    }

    fn end_of_walk(&mut self, dump: &Dump) {
        self.walker = None;
        let octave = &mut self.octaves[dump.octave];
        if let Some(cell_row) = dump.cell_row {
            octave.dumping[bank(cell_row)] = false;
        }
        if let Some(rows) = dump.rows_of_frame {
            octave.base += i64::from(rows);
            octave.ending = false;
        }
    }

    /// Puts a candidate into the queue, or loses one; false where it must wait.
    fn push(&mut self, candidate: &CornerCandidate, cell_row: u32) -> bool {
        let octave = &mut self.octaves[usize::from(candidate.octave)];
        let row = octave.base + i64::from(candidate.corner.y_px);
        let waiting = Waiting { candidate: *candidate, frame: octave.frame, cell_row, row };
        let is_full = u32_from(self.queue.len()) >= self.params.fifo_depth;
        match self.params.overflow {
            Overflow::Stall if is_full => return false,
            Overflow::Stall => {
                octave.pending[bank(cell_row)] += 1;
                self.queue.push_back(waiting);
            }
            Overflow::DropNewest if is_full => self.dropped += 1,
            Overflow::DropWeakest if is_full => {
                self.queue.push_back(waiting);
                let weakest = (0..self.queue.len()).rev().min_by_key(|&at| self.queue[at].candidate.rank);
                self.queue.remove(weakest.expect("the queue has at least the newcomer"));
                self.dropped += 1;
            }
            Overflow::DropNewest | Overflow::DropWeakest => self.queue.push_back(waiting),
        }
        self.queue_most = self.queue_most.max(u32_from(self.queue.len()));
        true
    }
}

fn bank(cell_row: u32) -> usize {
    index(cell_row % 2)
}
