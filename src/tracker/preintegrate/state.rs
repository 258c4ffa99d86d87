//! ImuState of the IMU filter, and the order of its unknowns.

use super::{ImuMeasurement, ImuState, Noise, Preintegrated};
use crate::pose::Pose;
use glam::DVec3;
use nalgebra::SMatrix;
use std::collections::VecDeque;

/// Mounting and noise of an IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuCalibration {
    /// Pose on the body; readings are along the IMU's axes.
    pub body_from_imu: Pose,
    /// Of its readings.
    pub noise: Noise,
}

/// States: position in the IMU's axes, rotation on the right, velocity, two biases, gravity, scale.
pub(super) const N: usize = 19;
pub(super) const VELOCITY: usize = 6;
pub(super) const GYROSCOPE: usize = 9;
pub(super) const ACCELEROMETER: usize = 12;
pub(super) const GRAVITY: usize = 15;
pub(super) const UNIT: usize = 18;
pub(super) type Covariance = SMatrix<f64, N, N>;

/// The filter.
#[derive(Clone, Debug)]
pub struct ImuFilter {
    pub(super) calibration: ImuCalibration,
    /// Whether lengths are metres.
    pub(super) is_metric: bool,
    pub(super) readings: VecDeque<ImuMeasurement>,
    pub(super) now: Option<Knowledge>,
    /// Steps between the last keyframes.
    pub(super) links: VecDeque<KeyframeStep>,
}

/// ImuState estimate at a time.
#[derive(Clone, Debug)]
pub(super) struct Knowledge {
    pub(super) t_s: f64,
    /// Time of the last picture that gave a pose.
    pub(super) seen_s: f64,
    pub state: ImuState,
    pub gravity: DVec3,
    /// Scale: map units per metre.
    pub unit: f64,
    pub covariance: Covariance,
    /// Angular rate, corrected for bias.
    pub(super) rate_rad_per_s: DVec3,
}

/// A step between two keyframes.
#[derive(Clone, Debug)]
pub struct KeyframeStep {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) step: Preintegrated,
    /// Velocity at its later end as the filter had it, in metres, and its variance per axis.
    pub(super) later: (DVec3, f64),
}
