//! Event-driven form of `sensor_core`: skips idle clocks and has the same outputs. For given row crossings it reports each clock at which
//! a control pin changes, the rows' codes with their latch clock, bit planes of the lane pins, and flipped bits.
//!
//! Clock t is the state of the pins after the t-th rising edge from reset, counted from 0; stalled edges are not counted.
//! The ramp's pins follow from the changes: with `ramp_start` in clock t, step k of that ramp stands in clock t + 1 + k and `done` in the
//! clock after the last. A column's `crossed` pin rises in the clock after the step of its crossing.

use crate::cds::{ColumnRow, RowCrossings};
use crate::lane_planes::{LanePlanes, write_row};
use crate::ramp_counter::{RampCounter, RampCounterIn};
use crate::readout_seq::{ReadoutSeq, SeqIn, SeqOut, SeqState};
use crate::sensor_core::CoreConfig;

/// Control pins from `clock` until the next change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Change {
    /// First clock with these pins.
    pub clock: u64,
    /// Pins of the sequencer.
    pub pins: SeqOut,
}

/// Most changes of a line: 17 pin edges at different clocks, and room.
pub const CHANGES_PER_LINE: usize = 20;

/// A row that went to the lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LatchedRow {
    /// Clock in which `latch` is high.
    pub clock: u64,
    /// Row of the array.
    pub row: u32,
    /// The shifter was busy: the row is lost, and `overrun` is high from the next clock on.
    pub lost: bool,
}

/// Borrowed buffers that a run fills. Panics follow where `changes`, `rows` or `codes` are too short for the run.
#[derive(Debug)]
pub struct Trace<'a> {
    /// Changes of control pins; `CHANGES_PER_LINE` a line are enough.
    pub changes: &'a mut [Change],
    /// One entry a latched row.
    pub rows: &'a mut [LatchedRow],
    /// Codes of the latched rows, one after the other.
    pub codes: &'a mut [u16],
    /// The lanes' pins.
    pub planes: LanePlanes<'a>,
}

/// What a run has given so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Entries used of `Trace::changes`.
    pub changes: usize,
    /// Entries used of `Trace::rows`.
    pub rows: usize,
    /// Bits flipped in the columns' counters and latches, counted when a row's signal ramp begins.
    pub column_toggles: u64,
    /// Bits flipped in the ramp's code, counted when a ramp begins.
    pub ramp_toggles: u64,
    /// Bits flipped on the shared count, counted when a ramp begins.
    pub count_toggles: u64,
    /// Bits flipped on the lanes, counted when a row is latched.
    pub lane_toggles: u64,
}

/// Crossings of rows, `columns` a row, from the row of line `first_line` of the frame on.
#[derive(Clone, Copy, Debug)]
pub struct FrameCrossings<'a> {
    /// Line of the first row given.
    pub first_line: u32,
    /// Crossings of the reset ramp; not looked at where there is none.
    pub reset: &'a [u32],
    /// Crossings of the signal ramp.
    pub signal: &'a [u32],
}

/// The core between two events.
#[derive(Debug)]
pub struct EventCore<'a> {
    config: CoreConfig,
    seq: ReadoutSeq,
    ramp: RampCounter,
    columns: ColumnRow<'a>,
    codes: &'a mut [u16],
    pins: SeqOut,
    clock: u64,
    free_at: u64,
    row: u32,
    counts: Counts,
}

impl<'a> EventCore<'a> {
    /// A core in reset; `values`, `latched` and `codes` hold one entry a column. Panics where `CoreConfig::check` refuses.
    pub fn new(config: CoreConfig, values: &'a mut [i32], latched: &'a mut [u32], codes: &'a mut [u16]) -> Self {
        config.check().expect("the config was checked");
        assert!(u32::try_from(codes.len()) == Ok(config.columns), "a column has one code");
        Self {
            config,
            seq: ReadoutSeq::new(config.seq),
            ramp: RampCounter::new(),
            columns: ColumnRow::new(config.cds, values, latched),
            codes,
            pins: SeqOut::default(),
            clock: 0,
            free_at: 0,
            row: 0,
            counts: Counts::default(),
        }
    }

    /// Clocks run so far.
    pub fn clock(&self) -> u64 {
        self.clock
    }

    /// What the runs so far have given.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The same as `clocks` ticks with constant `enable`. Rows that begin their signal ramp within them take their crossings from `rows`.
    pub fn run(&mut self, clocks: u64, enable: bool, rows: &FrameCrossings<'_>, trace: &mut Trace<'_>) {
        let end = self.clock + clocks;
        loop {
            let quiet = self.seq.quiet_clocks(enable).min(end - self.clock);
            self.seq.skip(quiet);
            self.clock += quiet;
            if self.clock == end {
                return;
            }
            let pins = self.seq.tick(SeqIn { enable, ..SeqIn::default() });
            if pins != self.pins {
                self.pins = pins;
                trace.changes[self.counts.changes] = Change { clock: self.clock, pins };
                self.counts.changes += 1;
            }
            if pins.ramp_start {
                self.start_ramp(rows);
            }
            if pins.latch {
                self.latch(trace);
            }
            self.clock += 1;
        }
    }

    fn start_ramp(&mut self, rows: &FrameCrossings<'_>) {
        let seq = self.config.seq;
        let signal = self.pins.state == SeqState::SettleSignal;
        let steps = if signal { seq.n_ramp_signal } else { seq.n_ramp_reset };
        let gray = self.config.cds.gray;
        self.ramp.tick(RampCounterIn { start: true, gray, steps, ..RampCounterIn::default() });
        self.ramp.advance(u64::from(steps) + 2, gray, steps);
        (self.counts.ramp_toggles, self.counts.count_toggles) = (self.ramp.ramp_toggles(), self.ramp.count_toggles());
        if !signal {
            return;
        }
        let columns = self.columns.columns();
        let line = usize::try_from(self.pins.line - rows.first_line).expect("a line of the frame");
        let part = line * columns..(line + 1) * columns;
        let row = RowCrossings {
            reset_steps: seq.n_ramp_reset,
            reset: if seq.n_ramp_reset == 0 { &[] } else { &rows.reset[part.clone()] },
            signal_steps: seq.n_ramp_signal,
            signal: &rows.signal[part],
        };
        self.counts.column_toggles += self.columns.convert(&row, self.codes);
        self.row = self.pins.row;
    }

    fn latch(&mut self, trace: &mut Trace<'_>) {
        let (columns, index, lane) = (self.codes.len(), self.counts.rows, self.config.lane());
        let lost = self.clock < self.free_at;
        trace.rows[index] = LatchedRow { clock: self.clock, row: self.row, lost };
        trace.codes[index * columns..(index + 1) * columns].copy_from_slice(self.codes);
        self.counts.rows += 1;
        if !lost {
            self.free_at = self.clock + u64::from(lane.hts_min());
            self.counts.lane_toggles += write_row(&lane, self.codes, self.clock + 2, &mut trace.planes);
        }
    }
}
