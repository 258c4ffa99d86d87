//! Back half of the extractor, twin of `verilog/fx_back.sv`. Converts corners and smoothed pixels to feature records, in the order in
//! which their engines started. It also drives row permission, the threshold and the counters.
//!
//! Positions are pixels of an octave, codes DN of the pipeline. The clock rules (docs/rtl.md) follow from the constants here.

pub use crate::fx_cells::{CellList, ListedCorner};
pub use crate::fx_dumps::Row;
pub use crate::fx_engine::{Engine, Record};
pub use crate::fx_fifo::{Policy, QueuedCorner};
pub use crate::fx_pattern::points;

use crate::fx_cells::FxCells;
use crate::fx_config::small;
use crate::fx_dumps::{DumpsIn, FxDumps};
use crate::fx_engine::EngineConfig;
use crate::fx_fifo::FxFifo;
use crate::fx_fit::FxFit;
use crate::fx_orient::FxOrient;
use crate::fx_ring::{FxRing, RingRead, RingWrite};
use crate::words::{PositionPx, ShiftPx};

pub use crate::fx_back_ports::{
    DUMP_CLK, FxBackIn, FxBackMemory, FxBackOut, FxBackToggles, FxCounts, FxSettings, LOADED_CLK, START_GAP_CLK,
    engine_clocks,
};
pub use crate::fx_config::{FxBackConfig, PATCH_MARGIN_PX};

#[path = "fx_back_events.rs"]
mod events;

/// From a pixel's edge to its centre.
const HALF_PX: PositionPx = PositionPx::lit("0.5");

/// A corner that is loaded: its engine, and clocks since the one after its start.
#[derive(Clone, Copy, Debug)]
struct Load {
    candidate: QueuedCorner,
    engine: usize,
    clock: u32,
    columns: usize,
}

/// The registers, and the blocks of the back.
#[derive(Debug)]
pub struct FxBack<'a> {
    config: FxBackConfig,
    cells: FxCells<'a>,
    dumps: FxDumps,
    fifo: FxFifo<'a>,
    ring: FxRing<'a>,
    orient: FxOrient,
    fit: FxFit,
    engines: &'a mut [Engine],
    idle: [bool; 4],
    load: Option<Load>,
    next_engine: usize,
    turn: usize,
    adapted: u16,
    taken_before: u32,
    counts: FxCounts,
}

/// What registers and pins decide before the edge.
struct Decisions {
    take: bool,
    push: Option<QueuedCorner>,
    pop: bool,
    start: bool,
    late: bool,
    walk_last: bool,
    read: Option<RingRead>,
    loaded: bool,
    column: bool,
    angle: bool,
    out_take: bool,
}

impl<'a> FxBack<'a> {
    /// A back in reset, its adapted threshold 0 until a reset by pin. Panics on parameters out of range or memories of another size.
    pub fn new(config: FxBackConfig, memory: FxBackMemory<'a>) -> Self {
        config.check().expect("the config was checked");
        assert_eq!(memory.queue.len(), small(config.fifo_depth), "a queue of the config's depth");
        assert_eq!(memory.engines.len(), small(config.engines), "as many engines as the config's");
        let mut back = Self {
            config,
            cells: FxCells::new(&config, memory.lists),
            dumps: FxDumps::new(&config),
            fifo: FxFifo::new(memory.queue),
            ring: FxRing::new(&config, memory.ring),
            orient: FxOrient::new(),
            fit: FxFit::new(),
            engines: memory.engines,
            idle: [true; 4],
            load: None,
            next_engine: 0,
            turn: 0,
            adapted: 0,
            taken_before: 0,
            counts: FxCounts::default(),
        };
        back.reset(0);
        back
    }

    pub(crate) fn reset(&mut self, threshold: u16) {
        self.cells.reset();
        self.dumps.reset();
        self.fifo.reset();
        self.ring.reset();
        self.orient.reset();
        self.fit.reset();
        self.engines.iter_mut().for_each(Engine::reset);
        (self.idle, self.load, self.next_engine, self.turn) = ([true; 4], None, 0, 0);
        (self.adapted, self.taken_before, self.counts) = (threshold, 0, FxCounts::default());
    }

    /// Whether a row may start: decoded from registers and the request.
    pub fn row_ok(&self, row: Row, policy: Policy) -> bool {
        self.dumps.row_ok(row, policy == Policy::Stall)
    }

    /// The threshold in force.
    pub fn threshold(&self, settings: &FxSettings) -> u16 {
        if settings.target == 0 { settings.threshold } else { self.adapted }
    }

    /// The valid record.
    pub fn record(&self) -> Option<&Record> {
        let engine = &self.engines[self.turn];
        engine.done().then(|| engine.record())
    }

    /// Counts as they stand.
    pub fn counts(&self) -> &FxCounts {
        &self.counts
    }

    /// Bits that flipped.
    pub fn toggles(&self) -> FxBackToggles {
        FxBackToggles {
            column: self.ring.toggles(),
            moments: self.orient.toggles(),
            descriptors: self.engines.iter().map(Engine::toggles).sum(),
        }
    }

    /// Pins as they stand, with those of this clock.
    pub fn out(&self, pins: &FxBackIn) -> FxBackOut {
        let engine = &self.engines[self.turn];
        FxBackOut {
            row_ok: self.row_ok(pins.request, pins.settings.policy),
            threshold: self.threshold(&pins.settings),
            valid: engine.done(),
            record: *engine.record(),
            counts: self.counts,
        }
    }

    /// One rising edge.
    pub fn tick(&mut self, pins: &FxBackIn) -> FxBackOut {
        if pins.rst {
            self.reset(pins.settings.threshold);
        } else {
            self.step(pins);
        }
        self.out(pins)
    }

    /// Whether the queue's head starts in this clock, or is late.
    fn head_leaves(&self, policy: Policy) -> (bool, bool) {
        let head = self.fifo.head();
        let age_max = (1 << self.config.ring_log2) - 14;
        let age = head.and_then(|head| self.dumps.age(head.octave.into(), head.row_number));
        let late = policy != Policy::Stall && age.is_some_and(|age| age >= age_max);
        (head.is_some() && !late && self.load.is_none() && self.idle[self.next_engine], late)
    }

    fn decide(&self, pins: &FxBackIn) -> Decisions {
        let policy = pins.settings.policy;
        let (start, late) = self.head_leaves(policy);
        let take = self.fifo.room(policy, start || late);
        let push = self.cells.entry().filter(|_| take).map(|corner| {
            let walked = self.dumps.walked();
            QueuedCorner {
                corner: *corner,
                octave: u8::try_from(walked.octave).expect("below four"),
                frame: walked.frame,
                row_number: walked.base.wrapping_add(corner.y_px) & 0xFFF,
            }
        });
        let load = self.load.filter(|load| load.clock < LOADED_CLK);
        let read = load.map(|Load { candidate, clock, .. }| RingRead {
            octave: candidate.octave.into(),
            x_px: candidate.corner.x_px - 13 + u16::try_from(clock).expect("below 27"),
            row_number: candidate.row_number.wrapping_sub(13) & 0xFFF,
        });
        Decisions {
            take,
            push,
            pop: start || late,
            start,
            late,
            walk_last: self.cells.last(take),
            read,
            loaded: load.is_some_and(|load| load.clock + 1 == LOADED_CLK),
            column: self.ring.column().is_some(),
            angle: self.orient.angle().is_some(),
            out_take: self.engines[self.turn].done() && pins.out_ready,
        }
    }

    pub(crate) fn step(&mut self, pins: &FxBackIn) {
        let decided = self.decide(pins);
        let put = pins.corner.filter(|corner| self.has_patch(pins.octave, corner));
        self.count(pins, &decided, put.is_some());
        self.step_engines(pins, &decided);
        let go = self.load.filter(|load| load.clock == 0 && self.config.subpixel);
        self.fit.tick(go.map(|load| load.candidate.corner.resp));
        self.step_rows(pins, &decided, put);
        self.step_load(&decided);
        self.fifo.tick(pins.settings.policy, decided.push, decided.pop);
    }

    /// Lists, ring and row numbers.
    fn step_rows(&mut self, pins: &FxBackIn, decided: &Decisions, put: Option<ListedCorner>) {
        let walk = self.dumps.load(self.cells.active());
        let stall = pins.settings.policy == Policy::Stall;
        let write = pins.smoothed.map(|(x_px, y_px, pixel)| {
            let row_number = self.dumps.row_number(pins.octave, y_px);
            RingWrite { octave: pins.octave, x_px, row_number, pixel }
        });
        self.ring.tick(write, decided.read);
        let row_end = Row { octave: pins.octave, row: pins.row, is_virtual: pins.row_end_virtual };
        let loaded = decided.loaded && stall;
        let ended = DumpsIn {
            row_end: pins.row_end.then_some(row_end),
            walk_last: decided.walk_last,
            pushed: decided.push.is_some() && stall,
            loaded: self.load.filter(|_| loaded).map(|load| {
                let bank = load.candidate.corner.y_px >> self.config.cell_log2 & 1;
                (load.candidate.octave.into(), bank.into())
            }),
        };
        self.dumps.tick(self.cells.active(), ended);
        self.cells.tick(put.map(|corner| (pins.octave, corner)), walk, decided.take);
    }

    fn engine_config(&self) -> EngineConfig {
        EngineConfig { desc_bits: self.config.desc_bits, symmetric: self.config.symmetric }
    }

    fn has_patch(&self, octave: usize, corner: &ListedCorner) -> bool {
        let inside = |position: u16, side: u32| {
            u32::from(position) >= PATCH_MARGIN_PX && u32::from(position) + PATCH_MARGIN_PX < side >> octave
        };
        inside(corner.x_px, self.config.width) && inside(corner.y_px, self.config.height)
    }

    fn count(&mut self, pins: &FxBackIn, decided: &Decisions, put: bool) {
        let stalled = pins.req && !self.row_ok(pins.request, pins.settings.policy);
        let dropped = self.fifo.dropped(decided.push.is_some(), decided.pop);
        let taken = self.counts.corners.wrapping_sub(self.counts.without_patch);
        let lost = self.cells.lost();
        let counts = &mut self.counts;
        let add = |count: &mut u32, yes: bool| *count = count.wrapping_add(yes.into());
        add(&mut counts.corners, pins.corner.is_some());
        add(&mut counts.without_patch, pins.corner.is_some() && !put);
        add(&mut counts.unselected, lost);
        add(&mut counts.dropped, dropped);
        add(&mut counts.late, decided.late);
        add(&mut counts.features, decided.out_take);
        add(&mut counts.stalled, stalled);
        if pins.frame_end {
            let in_frame = taken.wrapping_sub(self.taken_before);
            self.taken_before = taken;
            self.adapted = adapt(self.adapted, in_frame, &pins.settings, self.config.pix_bits);
        }
    }

    /// Engines, with the columns, the angle and the position of the corner that is loaded.
    fn step_engines(&mut self, pins: &FxBackIn, decided: &Decisions) {
        let record = self.orient.angle().zip(self.load).map(|(angle, load)| {
            let QueuedCorner { corner, octave, frame, .. } = load.candidate;
            let (dx, dy) = if self.config.subpixel { self.fit.offset() } else { (ShiftPx::ZERO, ShiftPx::ZERO) };
            let position = |px: u16, shift: ShiftPx| {
                let from_edge = PositionPx::wrapping_from_num(px).wrapping_add(HALF_PX).wrapping_add_signed(shift);
                from_edge.wrapping_shl(octave.into()).wrapping_sub(HALF_PX)
            };
            let (x_q4, y_q4) = (position(corner.x_px, dx), position(corner.y_px, dy));
            Record { x_q4, y_q4, score: corner.score, angle, octave, frame, descriptor: [0; 32] }
        });
        let column = self.ring.column().zip(self.load).map(|(column, load)| (load.columns, column));
        let build = self.engine_config();
        for (index, engine) in self.engines.iter_mut().enumerate() {
            let mine = self.load.is_some_and(|load| load.engine == index);
            let taken = decided.out_take && self.turn == index;
            let starts = decided.start && self.next_engine == index;
            engine.tick(build, column.filter(|_| mine), record.as_ref().filter(|_| mine), taken);
            self.idle[index] = (self.idle[index] && !starts) || taken;
        }
        if decided.out_take {
            self.turn = (self.turn + 1) % self.engines.len();
        }
        self.orient.tick(pins.settings.angle_bits, column);
    }

    /// The corner that is loaded moves on, ends with its angle, or the queue's head takes its place.
    fn step_load(&mut self, decided: &Decisions) {
        if let Some(load) = &mut self.load {
            load.clock += 1;
            load.columns += usize::from(decided.column);
        }
        if decided.angle {
            self.load = None;
        }
        if let Some(&candidate) = self.fifo.head().filter(|_| decided.start) {
            self.load = Some(Load { candidate, engine: self.next_engine, clock: 0, columns: 0 });
            self.next_engine = (self.next_engine + 1) % self.engines.len();
        }
    }
}

/// The threshold after a frame of `found` corners with a patch.
fn adapt(threshold: u16, found: u32, settings: &FxSettings, bits: u32) -> u16 {
    let (least, target) = (settings.threshold, u32::from(settings.target));
    if found > target + (target >> 3) {
        let top = u16::try_from((1_u32 << bits) - 2).expect("at most 16 bits");
        threshold.saturating_add((threshold >> 3).max(1)).min(top)
    } else if found < target - (target >> 3) && threshold > least {
        (threshold - (threshold >> 4).max(1)).max(least)
    } else {
        threshold
    }
}
