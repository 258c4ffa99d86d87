//! Parameters of the tracker with their ranges. A bad value gives an error that names its key.

use crate::error::Error;

/// Knobs of the tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerParams {
    /// Keyframes that an adjustment moves, 2..=50. Time grows with it, drift falls.
    pub window: u32,
    /// Seed of the searches after loss.
    pub seed: u64,
    /// Standard deviation of a full-size corner's position, per axis, in pixels; > 0.
    pub position_sigma_px: f64,
    /// Radius around a predicted position within which a landmark is searched first, in pixels; > 0.
    pub search_radius_px: f64,
    /// The same where the first search fails; at least the first.
    pub search_radius_wide_px: f64,
    /// Greatest descriptor distance of a match in bits, 1..=127. Unrelated descriptors differ in 128.
    pub distance_bits_max: u32,
    /// Matched landmarks that a pose must have, at least 6.
    pub inliers_min: u32,
    /// Landmarks that the first frame must give, at least 6.
    pub start_landmarks_min: u32,
    /// Nearest distance of a landmark when it is made, in metres; > 0.
    pub range_m_min: f64,
    /// Frames from keyframe to keyframe at most; at least 1.
    pub keyframe_frames_max: u32,
    /// Distance that makes a new keyframe, in metres; > 0.
    pub keyframe_distance_m: f64,
    /// Rotation that makes a new keyframe, in radians; > 0.
    pub keyframe_angle_rad: f64,
    /// Share of the last keyframe's landmarks below which a new keyframe is made, 0..1.
    pub keyframe_share_min: f64,
    /// Steps of an adjustment; at least 1.
    pub adjust_iterations: u32,
    /// Samples of a search after loss; at least 1.
    pub samples_max: u32,
    /// Frames after which a landmark that was not seen takes no part in the first fall-back search.
    pub recent_frames: u32,
    /// Bound of the map's memory in keyframes; at least `window`.
    pub keyframes_max: u32,
    /// Bound of the map's memory in landmarks; at least 100.
    pub landmarks_max: u32,
    /// Whether a loop closure corrects the map.
    pub loop_closing: bool,
    /// Whether rows are taken at their own times; else a frame's rows count as simultaneous.
    pub rolling_shutter: bool,
}

impl TrackerParams {
    /// Values for a hand-held VGA rig at 30 frames a second in a room.
    pub fn room(seed: u64) -> Self {
        Self {
            window: 10,
            seed,
            position_sigma_px: 0.6,
            search_radius_px: 14.0,
            search_radius_wide_px: 40.0,
            distance_bits_max: 64,
            inliers_min: 12,
            start_landmarks_min: 25,
            range_m_min: 0.3,
            keyframe_frames_max: 12,
            keyframe_distance_m: 0.15,
            keyframe_angle_rad: 0.2,
            keyframe_share_min: 0.8,
            adjust_iterations: 4,
            samples_max: 400,
            recent_frames: 60,
            keyframes_max: 150,
            landmarks_max: 8_000,
            loop_closing: true,
            rolling_shutter: true,
        }
    }

    /// Weight of a position whose standard deviation is `scale` times that of a full-size corner, in 1/px.
    pub(crate) fn inverse_sigma(&self, scale: f64) -> f64 {
        1.0 / (self.position_sigma_px * scale)
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let within = |key: &str, value: u32, least: u32, most: u32| {
            let reason = format!("must be {least} to {most}");
            if (least..=most).contains(&value) { Ok(()) } else { Err(Error::key(key, value, reason)) }
        };
        let positive = |key: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(Error::key(key, value, "must be a finite number above 0"))
            }
        };
        within("tracker.window", self.window, 2, 50)?;
        within("tracker.distance_bits_max", self.distance_bits_max, 1, 127)?;
        within("tracker.inliers_min", self.inliers_min, 6, 10_000)?;
        within("tracker.start_landmarks_min", self.start_landmarks_min, 6, 10_000)?;
        within("tracker.keyframe_frames_max", self.keyframe_frames_max, 1, 10_000)?;
        within("tracker.adjust_iterations", self.adjust_iterations, 1, 100)?;
        within("tracker.samples_max", self.samples_max, 1, 100_000)?;
        within("tracker.keyframes_max", self.keyframes_max, self.window, 10_000)?;
        within("tracker.landmarks_max", self.landmarks_max, 100, 1_000_000)?;
        positive("tracker.position_sigma_px", self.position_sigma_px)?;
        positive("tracker.search_radius_px", self.search_radius_px)?;
        positive("tracker.range_m_min", self.range_m_min)?;
        positive("tracker.keyframe_distance_m", self.keyframe_distance_m)?;
        positive("tracker.keyframe_angle_rad", self.keyframe_angle_rad)?;
        if !(self.search_radius_wide_px >= self.search_radius_px && self.search_radius_wide_px.is_finite()) {
            let reason = format!("must be at least tracker.search_radius_px = {}", self.search_radius_px);
            return Err(Error::key("tracker.search_radius_wide_px", self.search_radius_wide_px, reason));
        }
        if !(0.0..1.0).contains(&self.keyframe_share_min) {
            return Err(Error::key("tracker.keyframe_share_min", self.keyframe_share_min, "must be 0 to below 1"));
        }
        Ok(())
    }
}

/// The noise of positions is never taken for more than this many times the given one; where the start was proved by several views, for as
/// many times what these have shown: the noise of its landmark and of the pose adds as much as its own.
pub const UNPROVEN_NOISE: f64 = 4.0;
