//! What a run adds up over its frames.

use super::sensor::SensorSetup;
use super::warnings::Warnings;
use super::waterfall::SentFrame;
use crate::link::{Flow, LinkCounts, Traffic};
use crate::num::greater;
use crate::pose::{Pose, TimedPose};
use crate::readout::Schedule;
use crate::tracker::{FrameInput, Status, Tracker};
use crate::units::FrameIndex;

/// What the cameras alone gave, frame by frame.
pub(super) struct Alone {
    pub(super) tracker: Tracker,
    pub(super) poses: Vec<(Option<Pose>, f64)>,
    pub(super) seconds: f64,
}

impl Alone {
    pub(super) fn track(&mut self, input: &FrameInput) {
        let tracked = self.tracker.track(input);
        self.poses.push((tracked.world_from_body, f64::from(tracked.tracked_features)));
    }
}

/// Figures of one frame that the report needs at the end.
#[derive(Clone, Debug)]
pub(super) struct FrameNotes {
    pub truth: TimedPose,
    pub estimate: Option<Pose>,
    pub predicted: Option<TimedPose>,
    pub mean_code_dn: f64,
    pub exposure_us: f64,
    pub gain: f64,
    pub found: Vec<u32>,
    pub tracked: u32,
    pub innovation_px: Option<f64>,
    pub single_picture_sigma_m: Option<f64>,
    pub status: Status,
    pub events: Vec<(&'static str, Option<&'static str>)>,
    pub thresholds: Vec<u16>,
    pub link_bits: f64,
    pub energy_pj: f64,
    pub latency_us: f64,
}

/// Latencies that are less apart differ by rounding alone.
const SAME_LATENCY_S: f64 = 1e-9;

#[derive(Default)]
pub(super) struct LinkTotals {
    /// What the host's decoder saw.
    pub counts: LinkCounts,
    pub traffic: Traffic,
    pub bits_flipped: u64,
    pub frames_with_rows: u64,
    /// Rows for which a readout stood still.
    pub rows_stalled: u64,
    /// For how long.
    pub stalled_s: f64,
    pub fifo_rows_most: u32,
    /// Longest time from a last row to the last feature byte behind it; none where features are not sent.
    pub feature_latency_s: Option<f64>,
    /// Longest time from the middle of a frame's exposure to the last bit of its last packet.
    pub latency_s: f64,
    /// The frame that took it; of several the one with most features.
    pub slowest: Option<SentFrame>,
    /// The same of the last frame alone.
    pub frame_latency_s: f64,
    /// Features that left the extractor and that the link had no time for before the next frame.
    pub features_dropped: u64,
    /// Frames of a camera that lost some so.
    pub frames_dropping: u64,
}

impl LinkTotals {
    pub(super) fn add_flow(
        &mut self,
        sensor: &SensorSetup,
        flow: &Flow,
        (schedule, frame): (&Schedule, FrameIndex),
        out_clk: &[u64],
    ) {
        self.rows_stalled += u64::from(flow.rows_stalled);
        self.stalled_s += sensor.link.seconds(flow.stalled);
        self.fifo_rows_most = self.fifo_rows_most.max(flow.fifo_rows_most);
        if let Some(latency) = flow.feature_latency() {
            let latency_s = sensor.link.seconds(latency);
            let longest_s = self.feature_latency_s.unwrap_or(0.0);
            self.feature_latency_s = Some(greater(longest_s, latency_s));
        }
        let latency_s = sensor.latency_s(flow, schedule, frame);
        // Where features are out before the last row's packet, frames take equally long on the link; the tracker then decides.
        let is_slowest = self.slowest.as_ref().is_none_or(|slowest| {
            let apart_s = latency_s - self.latency_s;
            apart_s > SAME_LATENCY_S || (apart_s > -SAME_LATENCY_S && out_clk.len() > slowest.out_clk.len())
        });
        self.latency_s = greater(self.latency_s, latency_s);
        if is_slowest {
            let (flow, schedule, out_clk) = (flow.clone(), schedule.clone(), out_clk.to_vec());
            self.slowest = Some(SentFrame { flow, schedule, frame, out_clk });
        }
        self.frame_latency_s = greater(self.frame_latency_s, latency_s);
    }

    /// Warns of features that the link had no time for.
    pub fn warn(&self, warnings: &mut Warnings) {
        let (features, frames) = (self.features_dropped, self.frames_dropping);
        if features > 0 {
            warnings.add(format!(
                "{features} features in {frames} camera frames were dropped, because the link had no time for them before the next \
                 frame; a lower compute.target_features (0 sets no limit), a faster link or a longer frame avoids that"
            ));
        }
    }
}
