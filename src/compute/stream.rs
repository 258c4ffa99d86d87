//! The extractor in time. Determines which candidates become features, in which order and at which clock, and how long each part waited.
//!
//! Which corners a cell keeps does not depend on time; which of them are lost does, and when everything happens. So pictures are
//! worked on as a whole, and this is a simulation of rows and candidates alone. It equals the clocked form.

use super::back::{Back, Records, Served};
use super::cells::CellLists;
use super::feature::ExtractorCounts;
use super::params::ExtractorParams;
use super::rows::{DRAIN_CLK, FRONT_LATENCY_CLK, Pixels, SlotRow, order};
use crate::units::Size;

/// The latency as a number of pixels: a row of the smallest picture has one more.
const LATENCY_PX: u32 = 6;
const _: () = assert!(LATENCY_PX as u64 == FRONT_LATENCY_CLK && LATENCY_PX < super::params::SIDE_PX_MIN);

/// Frames of one size that follow each other through one extractor.
#[derive(Debug)]
pub struct Stream {
    rows: Vec<SlotRow>,
    sizes: Vec<Size>,
    back: Back,
    frame: u64,
    clk: u64,
    counts: ExtractorCounts,
}

impl Stream {
    /// At reset, before clock 0.
    pub fn new(params: &ExtractorParams, size: Size) -> Self {
        let sizes = params.octave_sizes(size);
        let back = Back::new(params, &sizes);
        Self { rows: order(&sizes), sizes, back, frame: 0, clk: 0, counts: ExtractorCounts::default() }
    }

    /// Lets a frame through, whose lists are given by octave; gives back the first clock in which the next frame may start.
    pub(crate) fn frame(&mut self, lists: Vec<CellLists>, pixels: &mut dyn Pixels, records: &mut dyn Records) -> u64 {
        let mut lists: Vec<Option<CellLists>> = lists.into_iter().map(Some).collect();
        let (begin_clk, mut ready_clk) = (self.clk, 0);
        let mut before: Option<SlotRow> = None;
        for row in &self.rows {
            let asked_clk = self.clk;
            let ok_clk = self.back.wait_for_row(row, asked_clk, records);
            self.counts.stalled_clk += ok_clk - asked_clk;
            if row.y == 0 {
                let lists = lists[row.octave].take().expect("an octave has one first row");
                self.back.begin(row.octave, self.frame, lists);
            }
            let width_px = self.sizes[row.octave].width_px;
            let enters = row.octave == 0 && !row.is_virtual;
            // The end of the row before leaves when as many slots of this row as the latency have been taken.
            let (pushed_clk, last_clk) = if enters {
                let pushed_clk = pixels.offered_run(0, LATENCY_PX, row.y, ok_clk);
                (pushed_clk, pixels.offered_run(LATENCY_PX, width_px, row.y, pushed_clk + 1) + 1)
            } else {
                (ok_clk + FRONT_LATENCY_CLK - 1, ok_clk + u64::from(width_px))
            };
            if enters {
                ready_clk += last_clk - ok_clk;
            }
            if let Some(before) = before {
                self.back.row_end(&before, pushed_clk + 1, records);
            }
            before = Some(*row);
            self.clk = last_clk + 1;
        }
        let last = before.expect("a frame has rows");
        // The last slot was taken in the clock before `self.clk`.
        self.back.row_end(&last, self.clk + FRONT_LATENCY_CLK, records);
        self.clk += DRAIN_CLK;
        self.frame += 1;
        self.counts.not_ready_clk += self.clk - begin_clk - ready_clk;
        self.clk
    }

    /// Candidates that were served up to now, each once.
    pub fn take_served(&mut self) -> Vec<Served> {
        std::mem::take(&mut self.back.served)
    }

    /// Candidates that waited for an engine at once, at most.
    pub fn queue_most(&self) -> u32 {
        self.back.queue_most
    }

    /// Serves everything that waits.
    pub fn finish(&mut self, records: &mut dyn Records) {
        self.back.finish(records);
    }

    /// What happened in time up to now.
    pub fn counts(&self) -> ExtractorCounts {
        ExtractorCounts { dropped: self.back.dropped, late: self.back.late, ..self.counts }
    }
}
