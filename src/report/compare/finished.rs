//! A finished run as its report tells it.

use super::super::record::Report;
use crate::pose::TimedPose;

/// A run as its folder holds it.
#[derive(Clone, Debug)]
pub struct FinishedRun {
    /// Folder, as the user named it.
    pub folder: String,
    /// `report.json`.
    pub report: Report,
    /// `trajectory_gt.tum`: one pose a frame.
    pub truth: Vec<TimedPose>,
    /// `trajectory_est.tum`: one pose a tracked frame, in the tracker's own world.
    pub estimate: Vec<TimedPose>,
    /// `trajectory_cameras_alone.tum`: the same without the IMU, where the rig has one.
    pub cameras_alone: Option<Vec<TimedPose>>,
}
