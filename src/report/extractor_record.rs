//! The extractor's part of `report.json`.

use serde::{Deserialize, Serialize};

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
    /// Places of that queue: `compute.fifo_depth`.
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
            let share = 100.0 * (1.0 - crate::num::f64_from_u64(*required) / crate::num::f64_from_u64(*available));
            format!("keeps up: {required} clocks of a frame's {available}, {share:.1} % are spare")
        } else {
            format!("does not keep up: {required} clocks of a frame's {available}; use {remedy}")
        }
    }
}
