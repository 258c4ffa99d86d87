//! A frame that is to be located: its views, the map and the prediction.

use super::map::Map;
use super::params::TrackerParams;
use super::prior::PosePrior;
use super::rig::{CameraKeypoints, RigCamera};
use super::row_motion::{Moving, RatePrior, VelocityModel};
use crate::units::CameraIndex;
use nalgebra::Matrix6;

/// A landmark found on a picture.
#[derive(Clone, Copy, Debug)]
pub struct LandmarkMatch {
    pub camera: CameraIndex,
    /// Number of the keypoint in the camera's view.
    pub keypoint: usize,
    /// Number of the landmark in the map's list.
    pub landmark: usize,
}

/// A localised pose with its supporting matches.
#[derive(Clone, Debug)]
pub struct LocalisedPose {
    pub state: Moving,
    /// Landmarks found where the pose predicts them.
    pub inliers: Vec<LandmarkMatch>,
    /// Landmarks that the pose puts on a picture.
    pub in_view: Vec<usize>,
    /// Information of the left twist from this picture alone, given the map.
    pub information: Matrix6<f64>,
    /// Single-picture position sigma given the map, at the noise that the picture's residuals show, in metres.
    pub single_picture_sigma_m: Option<f64>,
}

/// One frame, the map, and the rules.
pub struct Localiser<'a> {
    pub cameras: &'a [RigCamera],
    pub views: &'a [CameraKeypoints],
    pub map: &'a Map,
    pub params: &'a TrackerParams,
    pub t_s: f64,
    /// The frames before, unless lost.
    pub motion: Option<VelocityModel>,
    /// What they say of the pose.
    pub prior: Option<PosePrior>,
    /// What an IMU says of the rate.
    pub imu_rate: Option<RatePrior>,
    /// Lower bound on the keypoint noise in pixels.
    pub least_px: f64,
    /// Whether the prediction is certain to a few pixels.
    pub sure: bool,
    pub number: u64,
    /// Keypoints that supported the pose of the frame before.
    pub inliers_before: u32,
}
