//! What the extractors did over a run. Enters: each camera's frame. Leaves: sums, and the greatest delays.

use super::on_link::EXTRACTOR_REMEDY;
use super::sensor::SensorSetup;
use super::warnings::Warnings;
use crate::compute::{Counts, Extracted};
use crate::link::Flow;
use crate::num::{f64_from_u64, u64_truncated};
use crate::report::record::{ExtractorClocks, FeatureFigures};

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
    /// Clocks that a frame took, at most, and has.
    clocks: ExtractorClocks,
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

    /// Adds the clocks of a frame whose packets are on the link so; a readout that stood still made it longer.
    pub fn add_clocks(&mut self, sensor: &SensorSetup, frame: &Extracted, flow: &Flow) {
        let stalled_s = sensor.link.seconds(flow.stalled);
        let stalled_clk = u64_truncated((stalled_s * f64_from_u64(sensor.schedule.pixel_rate_hz())).ceil());
        let (required_clk, available_clk) = (frame.required_clk() + stalled_clk, sensor.extractor_clk_available());
        self.clocks.required = self.clocks.required.max(required_clk);
        self.clocks.available = available_clk;
        self.clocks.frames_over += u64::from(required_clk > available_clk);
    }

    /// Clocks of the run's longest frame; none where the sensor extracts nothing.
    pub fn clocks(&self) -> Option<ExtractorClocks> {
        (self.frames > 0).then_some(self.clocks)
    }

    /// Warns of frames that took longer than a frame has.
    pub fn warn(&self, warnings: &mut Warnings) {
        let ExtractorClocks { required, available, frames_over } = self.clocks;
        if frames_over > 0 {
            let frames = self.frames;
            warnings.add(format!(
                "the extractor needed up to {required} clocks of the {available} that a frame has, too many in {frames_over} of {frames} \
                 frames of a camera: a sensor would lose or delay features that this run has; {EXTRACTOR_REMEDY} would keep it in time"
            ));
        }
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
