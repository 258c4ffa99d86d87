//! What the extractors did over a run. Enters: each camera's frame. Leaves: sums, and the greatest delays.

use crate::compute::{Counts, Extracted};
use crate::num::f64_from_u64;
use crate::report::record::FeatureFigures;

/// Sums over cameras and frames.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ExtractorTotals {
    /// Frames of a camera that went through.
    pub frames: u64,
    pub counts: Counts,
    /// Clocks from the first row's first pixel to a frame's first feature, at most. Rows follow the readout's.
    pub first_clk: Option<u64>,
    /// The same to a frame's last feature.
    pub last_clk: Option<u64>,
    /// Of the last frame.
    pub threshold: u16,
}

impl ExtractorTotals {
    /// Adds a frame of a camera.
    pub fn add(&mut self, frame: &Extracted) {
        let (sum, more) = (&mut self.counts, &frame.counts);
        sum.corners += more.corners;
        sum.without_patch += more.without_patch;
        sum.unselected += more.unselected;
        sum.dropped += more.dropped;
        sum.late += more.late;
        sum.stalled_clk += more.stalled_clk;
        sum.not_ready_clk += more.not_ready_clk;
        self.frames += 1;
        self.threshold = frame.threshold;
        self.first_clk = self.first_clk.max(frame.out_clk.first().copied());
        self.last_clk = self.last_clk.max(frame.out_clk.last().copied());
    }

    /// Means a frame and camera, for the report.
    pub fn figures(&self) -> FeatureFigures {
        let mean = |sum: u64| if self.frames > 0 { f64_from_u64(sum) / f64_from_u64(self.frames) } else { 0.0 };
        let counts = &self.counts;
        FeatureFigures {
            corners: mean(counts.corners),
            unselected: mean(counts.unselected),
            lost: mean(counts.dropped + counts.late),
            stalled_clk: mean(counts.stalled_clk),
            threshold: (self.frames > 0).then_some(self.threshold),
            ..FeatureFigures::default()
        }
    }
}
