//! Sums the extractors' counts and greatest delays over a run.

use super::sensor::SensorSetup;
use super::warnings::Warnings;
use crate::compute::{AlwaysReady, Extracted, Extractor, ExtractorCounts, RowByRow};
use crate::error::Error;
use crate::events::Events;
use crate::link::Flow;
use crate::num::{f64_from_u64, u64_from, u64_truncated};
use crate::parallel::chunks_collected;
use crate::plane::Plane;
use crate::report::record::{ExtractorClocks, FeatureFigures};

/// Sums over cameras and frames.
#[derive(Clone, Debug, Default)]
pub(super) struct ExtractorTotals {
    /// Frames of a camera that went through.
    pub frames: u64,
    pub counts: ExtractorCounts,
    /// Clocks from the first row's first pixel to a frame's first feature, at most. Rows follow the readout's.
    pub first_clk: Option<u64>,
    /// The same to a frame's last feature.
    pub last_clk: Option<u64>,
    /// Of the last frame.
    pub threshold: u16,
    /// Clocks that a frame took, at most, and has.
    clocks: ExtractorClocks,
    /// Their sum over frames of a camera, and how many frames that was.
    required_clk: u64,
    clocked_frames: u64,
    /// Features of the frame that took most.
    features: u64,
}

impl ExtractorTotals {
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
        let stalled_clk = u64_truncated((stalled_s * f64_from_u64(sensor.compute_hz)).ceil());
        let (required_clk, available_clk) = (frame.required_clk() + stalled_clk, sensor.extractor_clk_available());
        if required_clk > self.clocks.required {
            (self.clocks.required, self.features) = (required_clk, u64_from(frame.features.len()));
        }
        self.required_clk += required_clk;
        self.clocked_frames += 1;
        self.clocks.available = available_clk;
        self.clocks.frames_over += u64::from(required_clk > available_clk);
    }

    /// Clocks of the run's frames and whether they suffice; none where the sensor extracts nothing.
    pub fn clocks(&self, sensor: &SensorSetup) -> Option<ExtractorClocks> {
        (self.clocked_frames > 0).then(|| {
            let required_mean = f64_from_u64(self.required_clk) / f64_from_u64(self.clocked_frames);
            sensor.judged(ExtractorClocks { required_mean, ..self.clocks.clone() }, self.features)
        })
    }

    /// Warns of frames that took longer than a frame has.
    pub fn warn(&self, sensor: &SensorSetup, warnings: &mut Warnings) {
        let Some(clocks) = self.clocks(sensor).filter(|clocks| !clocks.keeps_up) else { return };
        let ExtractorClocks { required, available, frames_over, remedy, .. } = clocks;
        let frames = self.frames;
        warnings.add(format!(
            "the extractor needed up to {required} clocks of the {available} that a frame has, too many in {frames_over} of {frames} \
             frames of a camera: a sensor would lose or delay features that this run has; use {remedy}"
        ));
    }

    /// Means a frame and camera, for the report.
    pub fn figures(&self) -> FeatureFigures {
        let mean = |sum: u64| if self.frames > 0 { f64_from_u64(sum) / f64_from_u64(self.frames) } else { 0.0 };
        let counts = &self.counts;
        FeatureFigures {
            corners: mean(counts.corners),
            without_patch: mean(counts.without_patch),
            unselected: mean(counts.unselected),
            lost: mean(counts.dropped + counts.late),
            dropped: mean(counts.dropped),
            late: mean(counts.late),
            stalled_clk: mean(counts.stalled_clk),
            not_ready_clk: mean(counts.not_ready_clk),
            threshold: (self.frames > 0).then_some(self.threshold),
            ..FeatureFigures::default()
        }
    }
}

/// What each camera's extractor makes of its picture, and the events of that.
pub(super) fn extract_all(
    sensor: &SensorSetup,
    extractors: &mut [Extractor],
    codes: &[Plane<u16>],
) -> Vec<Result<(Extracted, Events), Error>> {
    chunks_collected(extractors, 1, |camera, extractor| extract_one(sensor, &mut extractor[0], &codes[camera]))
}

/// What an extractor makes of a picture whose rows come as the readout's do, and the events of that.
pub(super) fn extract_one(
    sensor: &SensorSetup,
    extractor: &mut Extractor,
    codes: &Plane<u16>,
) -> Result<(Extracted, Events), Error> {
    let mut events = Events::default();
    let mut rows = RowByRow { first_clk: 0, spacing: sensor.row_spacing() };
    let pattern_px = sensor.pattern_px();
    let extracted = extractor.frame(codes, sensor.bits(), pattern_px, (&mut rows, &mut AlwaysReady), &mut events)?;
    Ok((extracted, events))
}
