//! The frame that both sides play: its config, the crossings of its rows, the twin that runs it into prepared buffers, and the hash of all
//! pins of all clocks from the twin's trace.

use rtl_models::NEVER;
use rtl_models::cds::CdsConfig;
use rtl_models::event_core::{CHANGES_PER_LINE, Change, EventCore, FrameCrossings, LatchedRow, Trace};
use rtl_models::lane_planes::{LanePlanes, plane_bit};
use rtl_models::ramp_counter::{RampCounter, RampCounterIn};
use rtl_models::readout_seq::SeqConfig;
use rtl_models::sensor_core::CoreConfig;
use sensel::draw::mix;

const COLUMNS: usize = 640;

/// Configuration pins, in the order of `Workload::stimulus`.
pub const CONFIG_PINS: &[&str] = &[
    "global_shutter",
    "hts",
    "n_settle_reset",
    "n_ramp_reset",
    "n_settle_signal",
    "n_ramp_signal",
    "vts",
    "rows",
    "first_row",
    "row_step",
    "exposure_lines",
    "latch_mode",
    "gray",
    "black",
    "bits",
    "lanes",
    "columns",
];

/// Pins that are hashed, in this order.
pub const OUTPUT_PINS: &[&str] = &[
    "running",
    "state",
    "line",
    "row",
    "frame_valid",
    "line_valid",
    "clear",
    "fd_reset",
    "sample_reset",
    "transfer",
    "sample_signal",
    "ramp_start",
    "ramp_down",
    "latch",
    "shutter_reset",
    "shutter_row",
    "global_transfer",
    "ramp_code",
    "count",
    "ramp_running",
    "ramp_step",
    "ramp_done",
    "lane",
    "valid",
    "busy",
    "word_start",
    "row_start",
    "overrun",
];

/// Levels of the columns.
#[derive(Clone, Copy, Debug)]
pub enum LevelPattern {
    /// Rising from column to column and row to row.
    Ramp,
    /// Any step, one column in 64 never.
    Random,
    /// No comparator ever rises.
    Never,
}

/// One frame.
pub struct Workload {
    /// Parameters of the core.
    pub config: CoreConfig,
    /// Clocks from reset until the last row is out.
    pub clocks: u32,
    reset: Vec<u32>,
    signal: Vec<u32>,
}

impl Workload {
    pub fn new(kind: LevelPattern, latch_mode: bool, rows: u32) -> Self {
        let seq = SeqConfig {
            global_shutter: false,
            hts: 6402,
            vts: rows + 2,
            rows,
            first_row: 0,
            row_step: 1,
            n_settle_reset: 2,
            n_ramp_reset: 16,
            n_settle_signal: 2,
            n_ramp_signal: 1024,
            exposure_lines: 1,
        };
        let cds = CdsConfig { bits: 10, black: 8, latch_mode, gray: latch_mode };
        let config = CoreConfig { seq, cds, lanes: 1, columns: 640 };
        let draw = |cell: u64, steps: u32| {
            let word = mix(cell);
            let any = 1 + u32::try_from(word >> 40).unwrap() % steps;
            match kind {
                LevelPattern::Ramp => 1 + (u32::try_from(cell % 640 + cell / 640).unwrap() + any % 8) % steps,
                LevelPattern::Random if word.is_multiple_of(64) => NEVER,
                LevelPattern::Random => any,
                LevelPattern::Never => NEVER,
            }
        };
        let cells = u64::from(rows) * u64::try_from(COLUMNS).unwrap();
        let reset = (0..cells).map(|cell| draw(cell, 16)).collect();
        let signal = (0..cells).map(|cell| draw(cell + cells, 1024)).collect();
        // Reset, the line of exposure before the frame, the rows, and two lines for the last row's way out.
        Self { config, clocks: (1 + rows + 2) * seq.hts, reset, signal }
    }

    /// What the C++ harness reads: configuration, clocks, columns, ramps, then each ramp's steps and crossings.
    pub fn stimulus(&self) -> Vec<u32> {
        let CoreConfig { seq, cds, lanes, columns } = self.config;
        let mut words = vec![
            seq.global_shutter.into(),
            seq.hts,
            seq.n_settle_reset,
            seq.n_ramp_reset,
            seq.n_settle_signal,
            seq.n_ramp_signal,
            seq.vts,
            seq.rows,
            seq.first_row,
            seq.row_step,
            seq.exposure_lines,
            cds.latch_mode.into(),
            cds.gray.into(),
            cds.black.into(),
            cds.bits,
            lanes,
            columns,
        ];
        words.extend([self.clocks, columns, 2 * seq.rows]);
        for (reset, signal) in self.reset.chunks(COLUMNS).zip(self.signal.chunks(COLUMNS)) {
            words.push(seq.n_ramp_reset);
            words.extend(reset);
            words.push(seq.n_ramp_signal);
            words.extend(signal);
        }
        words
    }
}

/// The twin's buffers for a frame.
pub struct Twin<'a> {
    workload: &'a Workload,
    columns: (Vec<i32>, Vec<u32>, Vec<u16>),
    changes: Vec<Change>,
    rows: Vec<LatchedRow>,
    codes: Vec<u16>,
    planes: [Vec<u64>; 5],
    used: usize,
    latched: usize,
}

impl<'a> Twin<'a> {
    pub fn new(workload: &'a Workload) -> Self {
        let lines = usize::try_from(workload.config.seq.rows).unwrap() + 4;
        let words = usize::try_from(workload.clocks.div_ceil(64)).unwrap();
        Self {
            workload,
            columns: (vec![0; COLUMNS], vec![0; COLUMNS], vec![0; COLUMNS]),
            changes: vec![Change::default(); lines * CHANGES_PER_LINE],
            rows: vec![LatchedRow::default(); lines],
            codes: vec![0; lines * COLUMNS],
            planes: [(); 5].map(|()| vec![0; words]),
            used: 0,
            latched: 0,
        }
    }

    /// The whole frame, as the hardware plays it from reset.
    pub fn run(&mut self) {
        let (values, latched, scratch) = &mut self.columns;
        let mut core = EventCore::new(self.workload.config, values, latched, scratch);
        self.planes.iter_mut().for_each(|plane| plane.fill(0));
        let [lanes, busy, valid, word_start, row_start] = &mut self.planes;
        let planes = LanePlanes { lanes, busy, valid, word_start, row_start };
        let mut trace = Trace { changes: &mut self.changes, rows: &mut self.rows, codes: &mut self.codes, planes };
        let crossings = FrameCrossings { first_line: 0, reset: &self.workload.reset, signal: &self.workload.signal };
        // The edge with reset leaves everything as it is.
        core.run(1, false, &crossings, &mut trace);
        core.run(u64::from(self.workload.clocks) - 1, true, &crossings, &mut trace);
        self.used = core.counts().changes;
        self.latched = core.counts().rows;
        assert_eq!(u32::try_from(self.latched), Ok(self.workload.config.seq.rows), "every row is latched");
        std::hint::black_box(core.counts());
    }

    /// FNV-1a over every pin of every clock, as the harness takes it.
    pub fn hash(&self) -> u64 {
        let seq = &self.workload.config.seq;
        let mut changes = self.changes[..self.used].iter().peekable();
        let (mut pins, mut ramp) = (rtl_models::readout_seq::SeqOut::default(), RampCounter::new());
        let mut hash = 0xCBF2_9CE4_8422_2325_u64;
        for clock in 0..u64::from(self.workload.clocks) {
            let steps = if pins.ramp_down { seq.n_ramp_reset } else { seq.n_ramp_signal };
            let gray = self.workload.config.cds.gray;
            ramp.tick(RampCounterIn { rst: false, stall: false, start: pins.ramp_start, gray, steps });
            if let Some(change) = changes.next_if(|change| change.clock == clock) {
                pins = change.pins;
            }
            let shown = ramp.out();
            let flags = |pins: &[bool]| pins.iter().map(|&pin| u64::from(pin)).collect::<Vec<_>>();
            let mut words = vec![pins.running.into(), pins.state as u64, pins.line.into(), pins.row.into()];
            words.extend(flags(&[pins.frame_valid, pins.line_valid, pins.clear, pins.fd_reset, pins.sample_reset]));
            words.extend(flags(&[pins.transfer, pins.sample_signal, pins.ramp_start, pins.ramp_down, pins.latch]));
            words.extend([u64::from(pins.shutter_reset), pins.shutter_row.into(), pins.global_transfer.into()]);
            words.extend([u64::from(shown.ramp_code), shown.count.into()]);
            words.extend(flags(&[shown.running, shown.step, shown.done]));
            let [lane, busy, valid, word_start, row_start] =
                self.planes.each_ref().map(|plane| plane_bit(plane, clock));
            let overrun = self.rows[..self.latched].iter().any(|row| row.lost);
            words.extend(flags(&[lane, valid, busy, word_start, row_start, overrun]));
            for word in words {
                hash = (hash ^ word).wrapping_mul(0x100_0000_01B3);
            }
        }
        hash
    }
}
