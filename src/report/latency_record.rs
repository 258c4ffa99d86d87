//! Latency as `report.json` has it: steps from the middle of the exposure to the pose, one after another, each with its slack; and the
//! extractor's clocks.

use serde::{Deserialize, Serialize};

use crate::num::f64_from_u64;

/// Latency of a frame and of its first feature.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waterfall {
    /// From the middle of the frame's exposure to its pose; without a host, to the last bit on the lanes. The longest of the run.
    pub frame: Vec<LatencyStep>,
    /// From the middle of the exposure of the row that completes the frame's first feature to that feature at the host; empty where no
    /// feature is sent.
    pub first_feature: Vec<LatencyStep>,
    /// From the middle of the exposure to the pose; none without a host.
    pub pose_us: Option<f64>,
    /// Features of a camera's frame that the host's times are computed with.
    pub features: u64,
    /// Cameras whose frames the host decodes, and extracts where they come without features, one after the other.
    pub cameras: u32,
    /// Host whose times these are: `host.model`.
    pub host: String,
    /// Mean time that decoding and tracking of a frame took on the machine that simulated, in us; none where nothing ran.
    pub measured_host_us: Option<f64>,
}

/// One step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LatencyStep {
    /// "exposure", "wait for the row", "conversion", "column memory", "extractor", "link", "host decoding", "host extraction", "tracker".
    pub step: String,
    /// From the middle of the exposure.
    pub start_us: f64,
    /// From the middle of the exposure; the next step starts here.
    pub end_us: f64,
    /// Time that is left until the step holds up the next row or frame; negative where it does. None for steps without such a limit.
    pub slack_us: Option<f64>,
}

impl Waterfall {
    /// The steps as lines of text.
    pub fn text(&self) -> String {
        let mut lines = String::new();
        for (name, steps) in [("frame", &self.frame), ("first feature", &self.first_feature)] {
            if steps.is_empty() {
                continue;
            }
            lines += &format!("latency of the {name:<18} {:>12} {:>12} {:>14}\n", "us", "until", "slack");
            for step in steps {
                let slack = step.slack_us.map_or_else(String::new, |slack_us| format!("{slack_us:.1}"));
                let length_us = step.end_us - step.start_us;
                lines += &format!("  {:<29} {length_us:>12.1} {:>12.1} {slack:>14}\n", step.step, step.end_us);
            }
        }
        if let Some(pose_us) = self.pose_us {
            let (features, cameras) = (self.features, self.cameras);
            let rig = if cameras == 1 { "one camera".to_owned() } else { format!("{cameras} cameras") };
            lines += &format!(
                "pose        {pose_us:.1} us after the middle of the exposure ({}, {rig}, {features} features)\n",
                self.host
            );
        }
        lines
    }
}

/// Clocks of the extractor over a run, and whether they suffice.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExtractorClocks {
    /// From a frame's first pixel until its rows have run and its last feature has left, the longest of the run.
    pub required: u64,
    /// The same, mean over frames and cameras.
    #[serde(default)]
    pub required_mean: f64,
    /// From frame to frame.
    pub available: u64,
    /// Frequency of these clocks: `compute.clock_hz`.
    #[serde(default)]
    pub clock_hz: u64,
    /// Frames of a camera that needed more.
    pub frames_over: u64,
    /// Whether no frame needed more.
    #[serde(default)]
    pub keeps_up: bool,
    /// Candidates that waited for an engine at once, at most; none where the hardware's twin ran, which does not count them.
    #[serde(default)]
    pub queue_most: Option<u32>,
    /// Entries of that queue: `compute.fifo_depth`.
    #[serde(default)]
    pub queue_depth: u32,
    /// Settings with which the extractor keeps up; empty where it does.
    #[serde(default)]
    pub remedy: String,
}

impl ExtractorClocks {
    /// Pass or fail, in a sentence.
    pub fn verdict(&self) -> String {
        let Self { required, available, remedy, .. } = self;
        if self.keeps_up {
            let share = 100.0 * (1.0 - f64_from_u64(*required) / f64_from_u64(*available));
            format!("keeps up: {required} clocks of a frame's {available}, {share:.1} % are spare")
        } else {
            format!("does not keep up: {required} clocks of a frame's {available}; use {remedy}")
        }
    }
}
