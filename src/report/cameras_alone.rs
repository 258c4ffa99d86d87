//! The pose without the IMU, beside the fused one: fusion hides much of what a sensor does to the pose.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::measurable::NotMeasurable;
use crate::pose::TimedPose;
use crate::report::figures::{bring_to_metres, median, trajectory_figures};

/// Errors of the same packets tracked without the IMU. Definitions are those of `tracking`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CamerasAlone {
    /// RMS position error after rigid alignment.
    pub ate_m: Option<f64>,
    /// RMS relative error over one second.
    pub rpe_m: Option<f64>,
    /// RMS relative error over one frame.
    pub jitter_frame_m: Option<f64>,
    /// Second-difference sigma of the aligned error.
    pub jitter_d2_m: Option<f64>,
    /// Second-difference sigma without rotation, for a rig that stands still.
    pub jitter_still_m: Option<f64>,
    /// Share of frames with a pose.
    pub tracked_fraction: f64,
    /// Landmarks of a frame's pose, median.
    pub median_tracked: Option<f64>,
}

impl CamerasAlone {
    /// Figures of an estimate; where one cannot be measured, the reason is noted under its path.
    pub fn of(
        truth: &[TimedPose],
        estimate: &[TimedPose],
        tracked: &[f64],
        cameras: usize,
        reasons: &mut BTreeMap<String, String>,
    ) -> Self {
        let mut estimate = estimate.to_vec();
        bring_to_metres(truth, &mut estimate, cameras);
        let figures = trajectory_figures(truth, &estimate);
        let figures = figures.as_ref().map_err(Clone::clone);
        let se3 = figures.clone().and_then(|figures| figures.se3.as_ref().map_err(Clone::clone));
        let mut note = |key: &str, figure: Result<f64, NotMeasurable>| {
            figure.map_err(|reason| reasons.insert(format!("cameras_alone.{key}"), reason.to_string())).ok()
        };
        let count = |length: usize| crate::num::f64_from_usize(length);
        Self {
            ate_m: note("ate_m", se3.clone().map(|se3| se3.ate_m)),
            rpe_m: note("rpe_m", figures.clone().and_then(|figures| figures.unaligned.rpe_m.clone())),
            jitter_frame_m: note("jitter_frame_m", figures.clone().map(|figures| figures.unaligned.jitter_frame_m)),
            jitter_d2_m: note("jitter_d2_m", se3.and_then(|se3| se3.jitter_d2_m.clone())),
            jitter_still_m: note("jitter_still_m", figures.and_then(|figures| figures.still.jitter_d2_m.clone())),
            tracked_fraction: count(estimate.len()) / count(truth.len().max(1)),
            median_tracked: median(tracked),
        }
    }
}
