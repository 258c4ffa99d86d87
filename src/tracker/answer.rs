//! Input and output of the tracker for one frame. Seconds, metres, pixels.

use glam::DVec3;

use crate::compute::Feature;
use crate::pose::Pose;
use crate::text::named;
use crate::tracker::row_motion::RowClock;
use crate::units::CameraIndex;

/// What one frame brings.
#[derive(Clone, Debug)]
pub struct FrameInput {
    /// Time of the frame in seconds, rising.
    pub t_s: f64,
    /// Features of each camera, in the order of the calibrations.
    pub features: Vec<Vec<Feature>>,
    /// When the rows of each camera were exposed, in the same order. Empty: all at the time of the frame.
    pub clocks: Vec<RowClock>,
}

named! {
    /// What became of a frame.
    pub enum Status {
        /// No frame so far could start a map.
        Waiting = "waiting",
        /// The map starts here; the pose is the identity by definition.
        Initialised = "initialised",
        /// The pose follows from landmarks near their predicted positions.
        Tracked = "tracked",
        /// The pose was found by descriptors alone.
        Relocalised = "relocalised",
        /// No pose is supported by enough landmarks, or its position is too uncertain.
        Lost = "lost",
    }
}

named! {
    /// Why a frame has no pose although there is a map.
    pub enum LossReason {
        /// Neither the search around the prediction nor the one by descriptors found a pose that enough landmarks support and, near a
        /// prediction, that lies within five sigma of it.
        NoPose = "no credible pose, neither near the prediction nor by descriptors",
        /// A pose was found, and its position is too uncertain: by descriptors alone, or for several frames in a row.
        Uncertain = "the position is too uncertain",
    }
}

/// A landmark that supports the frame's pose, and the feature it was found as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inlier {
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// Index in the camera's list of the frame.
    pub feature: u32,
    /// Number of the landmark (`Landmark::id`).
    pub landmark: u32,
}

/// What a frame cost, in counted operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrackerWork {
    /// Landmarks projected into a camera.
    pub projections: u64,
    /// Descriptor distances.
    pub descriptors_compared: u64,
    /// P3P samples.
    pub ransac_samples: u32,
    /// Steps of pose refinements.
    pub pose_iterations: u32,
    /// Steps of bundle adjustments.
    pub adjust_iterations: u32,
    /// Observations in the adjusted window.
    pub adjusted_observations: u64,
}

/// The tracker's answer to one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedFrame {
    /// Time of the frame in seconds.
    pub t_s: f64,
    /// What became of it.
    pub status: Status,
    /// Why it is lost, where it is.
    pub loss: Option<LossReason>,
    /// Pose of the body; the world is the body's frame when the map started. `None` while waiting or lost.
    pub world_from_body: Option<Pose>,
    /// Different landmarks that support the pose.
    pub tracked_features: u32,
    /// All supporting sightings, camera by camera.
    pub inliers: Vec<Inlier>,
    /// The body's position at this frame, predicted from the frames before by constant velocity. `None` where fewer than two
    /// frames in a row were located before.
    pub predicted_position_m: Option<DVec3>,
    /// Median over the inliers of the distance in pixels between a landmark's position predicted for this frame and the position
    /// where it was found. `None` without prediction or inliers.
    pub innovation_px: Option<f64>,
    /// Single-picture position sigma given the map: standard deviation per axis in metres that the inliers of this picture leave, at the
    /// noise that their own residuals show. Landmarks count as exact and priors are left out, so it is no bound of the estimator's
    /// error. `None` without a located pose.
    pub single_picture_sigma_m: Option<f64>,
    /// Whether the frame became a keyframe.
    pub keyframe: bool,
    /// Whether the frame closed a loop: earlier keyframes were recognised and the map was bent to agree.
    pub loop_closed: bool,
    /// What it cost.
    pub work: TrackerWork,
}

impl TrackedFrame {
    /// What a report lists of the frame, given the status of the frame before: "initialised", "lost" with its reason, "relocalised",
    /// "found" (near the prediction again), "loop closed".
    pub fn events(&self, before: Option<Status>) -> impl Iterator<Item = (&'static str, Option<&'static str>)> {
        let event = match (before, self.status) {
            (_, Status::Initialised | Status::Relocalised) => Some((self.status.name(), None)),
            (Some(Status::Lost), Status::Tracked) => Some(("found", None)),
            (before, Status::Lost) if before != Some(Status::Lost) => Some(("lost", self.loss.map(LossReason::name))),
            _ => None,
        };
        event.into_iter().chain(self.loop_closed.then_some(("loop closed", None)))
    }
}

/// An answer without a pose.
pub fn unlocated(t_s: f64, status: Status, work: TrackerWork) -> TrackedFrame {
    TrackedFrame {
        t_s,
        status,
        loss: None,
        world_from_body: None,
        tracked_features: 0,
        inliers: Vec::new(),
        predicted_position_m: None,
        innovation_px: None,
        single_picture_sigma_m: None,
        keyframe: false,
        loop_closed: false,
        work,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_is_one_event_and_so_is_its_end() {
        use Status::{Initialised, Lost, Relocalised, Tracked, Waiting};
        let course =
            [Waiting, Initialised, Tracked, Lost, Lost, Tracked, Tracked, Lost, Relocalised, Relocalised, Tracked];
        let mut before = None;
        let mut events = Vec::new();
        for (frame, status) in course.into_iter().enumerate() {
            let loss = (status == Lost).then_some(LossReason::Uncertain);
            let answer =
                TrackedFrame { loss, loop_closed: frame == 6, ..unlocated(0.0, status, TrackerWork::default()) };
            for (event, reason) in answer.events(before) {
                assert_eq!(reason, (event == "lost").then_some(LossReason::Uncertain.name()));
                events.push((frame, event));
            }
            before = Some(status);
        }
        let found = [
            (1, "initialised"),
            (3, "lost"),
            (5, "found"),
            (6, "loop closed"),
            (7, "lost"),
            (8, "relocalised"),
            (9, "relocalised"),
        ];
        assert_eq!(events, found);
    }
}
