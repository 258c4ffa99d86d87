//! Checks the prediction and the pose of a located frame, and decides whether it becomes a keyframe. Changes no pose.

use super::localiser::{LandmarkMatch, LocalisedPose};
use super::locate::{MEDIAN_SIGMAS2, NARROW_PX};
use super::preintegrate::filter::ImuPrediction;
use super::refine::{WITHIN_PIXEL_PX, upper_median};
use super::rig::{CameraKeypoints, Keypoint};
use super::row_motion::Moving;
use super::state::LastKeyframe;
use super::{Inlier, Tracker};
use crate::num::{greater, index};
use crate::pose::Pose;
use glam::DVec2;

/// Limits on the position sigma of a pose that may create landmarks: a share of the median depth, and a multiple of the running
/// mean.
const SOUND_SHARE_MAX: f64 = 0.001;
const SOUND_FACTOR: f64 = 2.5;
/// Frames in the running mean of the position sigma.
const USUAL_FRAMES: f64 = 300.0;

/// Frames in the running mean of the keypoint noise.
const NOISE_FRAMES: f64 = 15.0;

impl Tracker {
    /// Whether three sigma of the IMU prediction, of rotation and of position at a depth of 1 m, lie within the narrow search radius.
    pub(super) fn is_sure(&self, imu_prediction: &ImuPrediction) -> bool {
        let (sigma_m, sigma_rad) = imu_prediction.sigmas();
        let focal_px = self.cameras[0].focal_px;
        3.0 * focal_px * (sigma_rad + sigma_m) < NARROW_PX
    }

    /// Whether depth and scale come from motion alone: no two cameras overlap, and there is no IMU.
    pub(super) fn depends_on_motion(&self) -> bool {
        self.pending.waits_for_motion() && self.imu_filter.is_none()
    }

    /// Lower bound on the keypoint noise. 0 where it is estimated from residuals.
    pub(super) fn least_px(&self) -> f64 {
        if self.depends_on_motion() { 0.0 } else { WITHIN_PIXEL_PX }
    }

    /// Whether landmarks may be made from a pose. A certain IMU prediction makes it sound.
    pub(super) fn judge(&mut self, located: &LocalisedPose, imu_is_sure: bool) -> bool {
        let is_sound = imu_is_sure || self.is_sound(located);
        self.weak_frames = if is_sound { 0 } else { self.weak_frames + 1 };
        let sigma_m = located.single_picture_sigma_m.unwrap_or(self.usual_sigma_m);
        let usual_m = if self.usual_sigma_m > 0.0 { self.usual_sigma_m } else { sigma_m };
        self.usual_sigma_m = usual_m + (sigma_m - usual_m) / USUAL_FRAMES;
        is_sound
    }

    /// Whether a pose is certain enough to create landmarks, which inherit its error.
    fn is_sound(&self, located: &LocalisedPose) -> bool {
        let body_from_world = &located.state.body_from_world;
        let depth_m =
            |found: &LandmarkMatch| body_from_world.point(self.map.landmarks[found.landmark].position_m).length();
        let depths_m: Vec<f64> = located.inliers.iter().map(depth_m).collect();
        let median_m = upper_median(&depths_m).unwrap_or(0.0);
        let known = |sigma_m: f64| sigma_m <= greater(SOUND_SHARE_MAX * median_m, SOUND_FACTOR * self.usual_sigma_m);
        self.cameras.len() == 1 || located.single_picture_sigma_m.is_some_and(known)
    }

    /// Estimates the keypoint noise from the median residual of a frame. Corners of few-bit pictures jump by a pixel; with the
    /// configured noise their landmarks look too certain, and later matches are rejected. The residuals of a false map grow
    /// without limit, so the noise that the initialisation showed is the upper bound.
    fn learn_noise(&mut self, views: &[CameraKeypoints], located: &LocalisedPose) {
        if !self.depends_on_motion() {
            return;
        }
        let params = &self.params;
        let error2 =
            |(miss_px, keypoint): (DVec2, &Keypoint)| (miss_px * params.inverse_sigma(keypoint.scale)).length_squared();
        let errors2: Vec<f64> = self.misses_px(views, located, &located.state).map(error2).collect();
        let Some(median) = upper_median(&errors2) else { return };
        let (now_px, least_px) = (params.position_sigma_px, self.position_sigma_px_min);
        let shown_px2 = now_px * now_px * median / MEDIAN_SIGMAS2;
        let smoothed_px2 = now_px * now_px + (shown_px2 - now_px * now_px) / NOISE_FRAMES;
        self.params.position_sigma_px = smoothed_px2.sqrt().clamp(least_px, self.position_sigma_px_max);
    }

    /// Counts predicted and matched landmarks for culling, and updates the noise. Gives the inliers and the number of distinct
    /// landmarks.
    pub(super) fn account(&mut self, views: &[CameraKeypoints], located: &LocalisedPose) -> (Vec<Inlier>, u32) {
        self.learn_noise(views, located);
        for &number in &located.in_view {
            self.map.landmarks[number].predicted += 1;
        }
        let mut different = 0;
        for found in &located.inliers {
            let landmark = &mut self.map.landmarks[found.landmark];
            if landmark.last_frame != self.frame {
                landmark.last_frame = self.frame;
                landmark.found += 1;
                different += 1;
            }
        }
        let inlier = |found: &LandmarkMatch| Inlier {
            camera: found.camera,
            feature: views[index(found.camera.0)].keypoints[found.keypoint].feature,
            landmark: self.map.landmarks[found.landmark].id,
        };
        (located.inliers.iter().map(inlier).collect(), different)
    }

    pub(super) fn innovation_px(
        &self,
        views: &[CameraKeypoints],
        located: &LocalisedPose,
        predicted: &Moving,
    ) -> Option<f64> {
        let misses_px = self.misses_px(views, located, predicted);
        let distances_px: Vec<f64> = misses_px.map(|(miss_px, _)| miss_px.length()).collect();
        upper_median(&distances_px)
    }

    /// From where a state of the body predicts each inlier to where its keypoint is.
    fn misses_px<'a>(
        &'a self,
        views: &'a [CameraKeypoints],
        located: &'a LocalisedPose,
        state: &'a Moving,
    ) -> impl Iterator<Item = (DVec2, &'a Keypoint)> {
        located.inliers.iter().filter_map(|found| {
            let keypoint = &views[index(found.camera.0)].keypoints[found.keypoint];
            let landmark_m = state.at(keypoint.offset_s).point(self.map.landmarks[found.landmark].position_m);
            let position_px = self.cameras[index(found.camera.0)].project_unclipped(landmark_m)?;
            Some((keypoint.position_px - position_px, keypoint))
        })
    }

    /// Whether a located frame has moved far from the last keyframe, or has lost too many of its landmarks.
    ///
    /// Two cameras triangulate at once, and nearly all their landmarks are found again. Landmarks that wait for motion are
    /// fewer, and many come from unstable corners; counting these as found would make nearly every frame a keyframe. So in that
    /// case only landmarks found since the last keyframe count.
    pub(super) fn keyframe_is_due(&self, last: &mut LastKeyframe, world_from_body: &Pose, tracked: u32) -> bool {
        if self.depends_on_motion() {
            last.landmarks = last.landmarks.max(tracked);
        }
        let moved = last.world_from_body.inverse().then(world_from_body);
        self.frame - last.frame >= u64::from(self.params.keyframe_frames_max)
            || moved.translation_m.length() > self.params.keyframe_distance_m
            || moved.angle_rad() > self.params.keyframe_angle_rad
            || f64::from(tracked) < self.params.keyframe_share_min * f64::from(last.landmarks)
    }
}
