//! Errors of the pose and the course of the tracker, as `report.json` has them.

use serde::{Deserialize, Serialize};

use crate::report::spread::SpectrumPoint;

/// Errors of the pose. Definitions are those of evo (docs/tracker.md).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tracking {
    /// RMS position error after rigid alignment.
    pub ate_m: Option<f64>,
    /// 95 % interval of `ate_m`, from blocks of a second of this run.
    pub ate_interval_m: Option<[f64; 2]>,
    /// RMS relative error over one second.
    pub rpe_m: Option<f64>,
    /// RMS relative error over one frame.
    pub jitter_frame_m: Option<f64>,
    /// Second-difference sigma of the aligned error.
    pub jitter_d2_m: Option<f64>,
    /// RMS angle between true and estimated orientation, after the mean rotation between the two worlds is removed.
    #[serde(default)]
    pub orientation_deg: Option<f64>,
    /// 95 % interval of `jitter_d2_m`, from blocks of a second of this run.
    pub jitter_d2_interval_m: Option<[f64; 2]>,
    /// Single-picture position sigma given the map, per axis, RMS over the frames. Landmarks count as exact, priors (motion, inertial
    /// unit, window) are left out, and the noise is that of the accepted residuals. It is no bound: `jitter_d2_m` may lie below it.
    pub single_picture_sigma_m: Option<f64>,
    /// RMS position error after alignment with scale.
    pub ate_sim3_m: Option<f64>,
    /// Scale that this alignment found.
    pub scale_sim3: Option<f64>,
    /// Second-difference sigma without rotation, for a rig that stands still.
    pub jitter_still_m: Option<f64>,
    /// Share of steps of at most 1 um: 1 is a frozen answer.
    pub still_steps_under_1um: Option<f64>,
    /// RMS distance between the position predicted one frame ahead and the truth.
    pub prediction_error_m: Option<f64>,
    /// Median distance between predicted and found image positions.
    pub innovation_px: Option<f64>,
    /// Median time from the first frame without a pose to the next one with a pose.
    pub relocalise_s: Option<f64>,
    /// What happened to the tracker: start, loss, return, closed loops, in the order of time.
    pub events: Vec<TrackingEvent>,
    /// Of the position error after rigid alignment; empty for short runs.
    pub jitter_spectrum: Vec<SpectrumPoint>,
    /// Share of frames with a pose.
    pub tracked_fraction: f64,
    /// Poses of truth and estimate that agree in time.
    pub associated_poses: u32,
    /// Time of the tracker.
    pub ms_per_frame: f64,
}

/// Something that happened to the tracker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackingEvent {
    /// Number of the frame, from 0; none in reports of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<u32>,
    /// Time of the frame.
    pub t_s: f64,
    /// "initialised", "lost", "relocalised", "found" (near the prediction again), "loop closed".
    pub event: String,
    /// Why it is lost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl TrackingEvent {
    /// Of a frame.
    pub fn of(frame: u32, t_s: f64, (event, reason): (&str, Option<&str>)) -> Self {
        Self { frame: Some(frame), t_s, event: event.to_owned(), reason: reason.map(str::to_owned) }
    }
}
