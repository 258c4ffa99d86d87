//! Digital half of the sensor, clock by clock, twin of `verilog/sensor_core.sv`. Converts one comparator bit per column to rows of codes on
//! serial lanes, and drives the control pins and the ramp code. Row n converts while row n-1 shifts out.

use crate::cds::{Cds, CdsConfig, CdsIn};
use crate::lane_shift::{LaneConfig, LaneIn, LaneOut, LaneShift};
use crate::ramp_counter::{RampCounter, RampCounterIn, RampCounterOut};
use crate::readout_seq::{ReadoutSeq, SeqConfig, SeqIn, SeqOut};

/// Run-time parameters of the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoreConfig {
    /// Line, frame and shutter.
    pub seq: SeqConfig,
    /// Every column.
    pub cds: CdsConfig,
    /// Lanes; `bits` are the columns' bits.
    pub lanes: u32,
    /// Columns, padded to a multiple of `lanes`.
    pub columns: u32,
}

impl CoreConfig {
    /// Parameters of the shifter.
    pub fn lane(&self) -> LaneConfig {
        LaneConfig { bits: self.cds.bits, lanes: self.lanes, columns: self.columns }
    }

    /// Checks of sequencer and shifter. An hts below `lane().hts_min()` is legal hardware: it raises `overrun`.
    pub fn check(&self) -> Result<(), &'static str> {
        self.seq.check()?;
        self.lane().check()
    }
}

/// Pins that enter, as they stand at the rising edge; the comparators stand beside them.
pub type CoreIn = SeqIn;

/// Pins that leave, after the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CoreOut {
    /// Sequencer.
    pub seq: SeqOut,
    /// Ramp counter.
    pub ramp: RampCounterOut,
    /// Lanes.
    pub lane: LaneOut,
}

/// All registers of the core. Those of the columns are borrowed from the caller.
#[derive(Debug)]
pub struct SensorCore<'a> {
    config: CoreConfig,
    seq: ReadoutSeq,
    ramp: RampCounter,
    columns: &'a mut [Cds],
    codes: &'a mut [u16],
    shifter: LaneShift<'a>,
}

impl<'a> SensorCore<'a> {
    /// A core in reset. Panics on lane parameters out of range or buffers of other lengths than `columns`.
    pub fn new(config: CoreConfig, columns: &'a mut [Cds], codes: &'a mut [u16], held: &'a mut [u16]) -> Self {
        assert!(columns.len() == held.len() && codes.len() == held.len(), "a column has one counter, code and latch");
        columns.fill(Cds::new());
        codes.fill(0);
        let shifter = LaneShift::new(config.lane(), held);
        Self { config, seq: ReadoutSeq::new(config.seq), ramp: RampCounter::new(), columns, codes, shifter }
    }

    /// Pins as they stand.
    pub fn out(&self) -> CoreOut {
        CoreOut { seq: self.seq.out(), ramp: self.ramp.out(), lane: self.shifter.out() }
    }

    /// Codes on the columns' pins.
    pub fn codes(&self) -> &[u16] {
        self.codes
    }

    /// The columns' registers.
    pub fn columns(&self) -> &[Cds] {
        self.columns
    }

    /// The ramp counter, for its toggles.
    pub fn ramp(&self) -> &RampCounter {
        &self.ramp
    }

    /// Bits flipped so far in counters and latches of all columns.
    pub fn column_toggles(&self) -> u64 {
        self.columns.iter().map(Cds::toggles).sum()
    }

    /// One rising edge. Column c's comparator is bit c % 64 of word c / 64. Panics if a column has no bit.
    pub fn tick(&mut self, pins: CoreIn, comparators: &[u64]) -> CoreOut {
        let CoreIn { rst, stall, .. } = pins;
        let before = self.out();
        let down = before.seq.ramp_down;
        self.shifter.tick(LaneIn { rst, stall, latch: before.seq.latch }, self.codes);
        let shared = CdsIn {
            rst,
            stall,
            clear: before.seq.clear,
            arm: before.seq.ramp_start,
            step: before.ramp.step,
            done: before.ramp.done,
            down,
            comparator: false,
            count: before.ramp.count,
        };
        for (index, (column, code)) in self.columns.iter_mut().zip(self.codes.iter_mut()).enumerate() {
            let comparator = comparators[index / 64] >> (index % 64) & 1 == 1;
            *code = column.tick(&self.config.cds, CdsIn { comparator, ..shared }).code;
        }
        let steps = if down { self.config.seq.n_ramp_reset } else { self.config.seq.n_ramp_signal };
        let start = before.seq.ramp_start;
        self.ramp.tick(RampCounterIn { rst, stall, start, gray: self.config.cds.gray, steps });
        self.seq.tick(pins);
        self.out()
    }
}
