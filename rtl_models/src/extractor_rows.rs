//! Feature extractor, one row at a time: same outputs as `ExtractorCore`, without the clocks in which only descriptors change. The caller
//! says in which clocks pixels are offered and records are taken.
//!
//! The front's rows are [`FrontRows`]'; the back is [`FxBack`] itself, whose clocks run one by one while a list is walked, a corner
//! loaded or a record taken, and are skipped otherwise. A row's pixels and corners enter when it starts: until it ends, the rule
//! behind `row_ok` keeps whatever they overwrite from being read.

use crate::extractor_core::front_config;
use crate::fx_back::{
    FxBack, FxBackConfig, FxBackIn, FxBackMemory, FxBackToggles, FxCounts, FxSettings, ListedCorner, Record, Row,
};
use crate::fx_config::FRONT_LATENCY;
use crate::fx_front::DRAIN;
use crate::fx_front_rows::{FrontRows, FrontRowsMemory, FrontSink, PixelWord, RowCorner, RowDone};

/// The extractor's environment: when pixels are offered and records are taken. Clock 0 is the first after reset.
pub trait ExtractorHost {
    /// Pixels `first` to `end` of a row are taken one by one, each when it is offered, the first not before `clk`: the last one's
    /// clock.
    fn offered_run(&mut self, first: u32, end: u32, y: u32, clk: u64) -> u64;
    /// The first clock from this one on in which a valid record is taken. Asked once a record.
    fn taken(&mut self, clk: u64) -> u64;
    /// A record is taken in this clock.
    fn leaves(&mut self, record: &Record, clk: u64);
}

/// A row whose end has not yet reached the back half.
#[derive(Clone, Copy, Debug)]
struct Ending {
    row: Row,
    frame_end: bool,
}

/// The back half's state in a clock, with pending inputs.
#[derive(Debug)]
struct InTime<'a> {
    back: FxBack<'a>,
    settings: FxSettings,
    /// The clock whose values stand.
    clk: u64,
    /// Clocks in which a pixel could be taken.
    ready_clk: u64,
    ending: Option<Ending>,
    /// When the valid record is taken.
    taken_clk: Option<u64>,
}

/// Both halves.
#[derive(Debug)]
pub struct ExtractorRows<'a, T> {
    config: FxBackConfig,
    front: FrontRows<'a, T>,
    time: InTime<'a>,
    corners: &'a mut [RowCorner],
}

/// Most corners of a row of so many pixels: of two neighbours at most one is a corner.
pub const fn row_corners(max_width: u32) -> usize {
    max_width as usize / 2 + 1
}

impl<'a, T: PixelWord> ExtractorRows<'a, T> {
    /// After a reset that left this threshold where there is a target. `corners` holds `row_corners`. Panics on parameters out of
    /// range or memories of another size.
    pub fn new(
        config: FxBackConfig,
        settings: FxSettings,
        threshold: u16,
        memory: (FrontRowsMemory<'a, T>, FxBackMemory<'a>, &'a mut [RowCorner]),
    ) -> Self {
        let (front, back, corners) = memory;
        assert!(corners.len() >= row_corners(config.max_width), "a row's corners have room");
        let mut back = FxBack::new(config, back);
        back.reset(threshold);
        let time = InTime { back, settings, clk: 0, ready_clk: 0, ending: None, taken_clk: None };
        Self { config, front: FrontRows::new(front_config(&config), front), time, corners }
    }

    /// Lets a frame through; gives back the first clock in which the next one's first pixel could enter. Panics on another size.
    #[inline(always)]
    pub fn frame<S: ExtractorHost>(&mut self, pixels: &[T], around: &mut S) -> u64 {
        let width = usize::try_from(self.config.width).expect("a row's length");
        let rows = pixels.chunks_exact(width);
        assert!(rows.remainder().is_empty() && rows.len() * width == pixels.len(), "whole rows");
        assert!(u32::try_from(rows.len()) == Ok(self.config.height), "as many as the picture has");
        let threshold = self.time.back.threshold(&self.time.settings);
        let threshold = T::try_from(threshold).ok().expect("a threshold is a word of the pipeline");
        for row in rows {
            let (time, corners, config) = (&mut self.time, &mut *self.corners, &self.config);
            self.front.row(row, threshold, &mut Sink { time, config, around: &mut *around, corners, used: 0 });
        }
        self.time.clk
    }

    /// Works until nothing is left to do but what the next row brings.
    pub fn finish<S: ExtractorHost>(&mut self, around: &mut S) {
        while !self.time.back.is_idle() {
            self.time.once(u64::MAX, None, around);
        }
    }

    /// Counts as they stand.
    pub fn counts(&self) -> &FxCounts {
        self.time.back.counts()
    }

    /// Clocks so far in which no pixel could be taken.
    pub fn not_ready(&self) -> u64 {
        self.time.clk - self.time.ready_clk
    }

    /// The threshold in force.
    pub fn threshold(&self) -> u16 {
        self.time.back.threshold(&self.time.settings)
    }

    /// Bits that flipped in the back.
    pub fn toggles(&self) -> FxBackToggles {
        self.time.back.toggles()
    }
}

/// Takes what the front gives for a row, and lets its time pass.
struct Sink<'s, 'a, S> {
    time: &'s mut InTime<'a>,
    config: &'s FxBackConfig,
    around: &'s mut S,
    corners: &'s mut [RowCorner],
    used: usize,
}

impl<T: PixelWord, S: ExtractorHost> FrontSink<T> for Sink<'_, '_, S> {
    fn corner(&mut self, corner: &RowCorner) {
        self.corners[self.used] = *corner;
        self.used += 1;
    }

    fn row(&mut self, done: &RowDone<'_, T>) {
        let octave = usize::try_from(done.octave).expect("below four");
        let row = Row { octave, row: done.row, is_virtual: done.is_virtual };
        self.time.wait(row, self.around);
        if !done.smoothed.is_empty() {
            self.time.back.write_row(octave, done.row - 3, done.smoothed);
        }
        for found in &self.corners[..self.used] {
            let short = |position: u32| u16::try_from(position).expect("positions have 12 bits");
            let RowCorner { x, y, score, resp, rank } = *found;
            self.time.back.put(octave, ListedCorner { x_px: short(x), y_px: short(y), score, rank, resp });
        }
        self.used = 0;
        let ending = Ending { row, frame_end: done.frame_end };
        self.time.pass(ending, self.config.width >> done.octave, self.around);
    }
}

impl InTime<'_> {
    /// Until the row may start.
    fn wait<S: ExtractorHost>(&mut self, row: Row, around: &mut S) {
        while !self.back.row_ok(row, self.settings.policy) {
            self.once(u64::MAX, Some(row), around);
        }
    }

    /// The row's slots, from the present clock; the end of the row before leaves on the way, and a frame's last one behind it.
    fn pass<S: ExtractorHost>(&mut self, next: Ending, width: u32, around: &mut S) {
        let first_clk = self.clk;
        let (pushed_clk, last_clk) = if next.row.octave == 0 && !next.row.is_virtual {
            let pushed_clk = around.offered_run(0, FRONT_LATENCY, next.row.row, first_clk);
            let last_clk = around.offered_run(FRONT_LATENCY, width, next.row.row, pushed_clk + 1) + 1;
            self.ready_clk += last_clk - first_clk;
            (pushed_clk, last_clk)
        } else {
            (first_clk + u64::from(FRONT_LATENCY) - 1, first_clk + u64::from(width))
        };
        if let Some(before) = self.ending.replace(next) {
            self.end_row(before, pushed_clk + 1, around);
        }
        self.until(last_clk + 1, around);
        if next.frame_end {
            self.end_row(next, last_clk + 1 + u64::from(FRONT_LATENCY), around);
            self.ending = None;
            self.until(last_clk + 1 + u64::from(DRAIN), around);
        }
    }

    fn end_row<S: ExtractorHost>(&mut self, ending: Ending, clk: u64, around: &mut S) {
        self.until(clk, around);
        let Ending { row: Row { octave, row, is_virtual }, frame_end } = ending;
        let pins = FxBackIn { octave, row, row_end: true, row_end_virtual: is_virtual, frame_end, ..self.pins(None) };
        self.step(pins, around);
    }

    fn until<S: ExtractorHost>(&mut self, clk: u64, around: &mut S) {
        while self.clk < clk {
            self.once(clk, None, around);
        }
    }

    /// Clocks up to the next one in which something happens, or that one clock. A row may wait meanwhile.
    fn once<S: ExtractorHost>(&mut self, until: u64, waits: Option<Row>, around: &mut S) {
        let quiet = self.back.quiet_clocks(self.settings.policy);
        let taken = self.taken_clk(around).map_or(u64::MAX, |clk| clk - self.clk);
        let clocks = quiet.min(taken).min(until - self.clk);
        if clocks > 0 {
            assert!(clocks < u64::MAX - self.clk, "a row waits for work that is under way");
            self.back.advance(clocks, waits.is_some());
            self.clk += clocks;
        } else {
            self.step(self.pins(waits), around);
        }
    }

    /// When the valid record is taken.
    fn taken_clk<S: ExtractorHost>(&mut self, around: &mut S) -> Option<u64> {
        if self.taken_clk.is_none() && self.back.record().is_some() {
            self.taken_clk = Some(around.taken(self.clk));
        }
        self.taken_clk
    }

    fn pins(&self, waits: Option<Row>) -> FxBackIn {
        let settings = self.settings;
        FxBackIn { settings, req: waits.is_some(), request: waits.unwrap_or_default(), ..FxBackIn::default() }
    }

    /// One rising edge.
    fn step<S: ExtractorHost>(&mut self, pins: FxBackIn, around: &mut S) {
        let out_ready = self.taken_clk(around) == Some(self.clk);
        if let Some(record) = self.back.record().filter(|_| out_ready) {
            around.leaves(record, self.clk);
            self.taken_clk = None;
        }
        self.back.step(&FxBackIn { out_ready, ..pins });
        self.clk += 1;
    }
}
