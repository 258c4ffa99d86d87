//! A problem of bundle adjustment: poses, landmarks and their observations.

use super::rig::RigCamera;
use crate::pose::Pose;
use crate::units::CameraIndex;
use glam::{DVec2, DVec3};

/// A point found on a picture of one of the poses.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Number of the pose.
    pub pose: u32,
    /// Number of the point.
    pub point: u32,
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// Position in its picture.
    pub position_px: DVec2,
    /// One over the standard deviation of the position, per axis, in 1/px.
    pub inverse_sigma: f64,
    /// The body's motion from the time of its pose to that of the position's row.
    pub row_from_frame: Pose,
}

/// What is adjusted.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// The rig.
    pub cameras: &'a [RigCamera],
    /// `body_from_world`; the first `free` move, the others are the gauge and stay.
    pub poses: Vec<Pose>,
    /// Number of poses that move.
    pub free: usize,
    /// Points of the world in metres.
    pub points_m: Vec<DVec3>,
    /// In rising order of points.
    pub observations: Vec<Observation>,
}

/// What an adjustment did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AdjustmentOutcome {
    /// Cost before: under the errors' own law, twice the negative logarithm of the density, up to a constant.
    pub cost_before: f64,
    /// The same after; never above the one before.
    pub cost_after: f64,
    /// Systems solved.
    pub iterations: u32,
}

/// Poses under a prior.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// Number in the problem and `body_from_world` at which derivatives are taken, in rising order of numbers.
    pub poses: Vec<(u32, Pose)>,
    /// Rows over six unknowns a pose; as many as directions were measured.
    pub(super) root: Vec<Vec<f64>>,
    /// What each row should give.
    pub(super) rhs: Vec<f64>,
}
