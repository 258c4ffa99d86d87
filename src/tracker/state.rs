//! The states of the tracker, and what each one knows of the past.

use super::row_motion::VelocityModel;
use crate::pose::Pose;

/// Where the tracker stands between two frames.
#[derive(Clone, Copy, Debug)]
pub enum TrackerState {
    /// There is no map. The next frame may start one.
    Waiting,
    /// The last frame has a pose. The next one is looked for where the motion leads.
    Tracking { history: MapHistory, motion: VelocityModel },
    /// The last frame has no pose. The next one is looked for in the whole map.
    Lost { history: MapHistory },
}

/// What happened to the map since its first frame.
#[derive(Clone, Copy, Debug)]
pub struct MapHistory {
    pub started_frame: u64,
    /// Whether one frame of overlapping cameras started it, whose rows were taken as simultaneous; else two frames of motion did.
    pub started_by_depth: bool,
    /// The last frame with a pose.
    pub located_frame: u64,
    pub keyframe: LastKeyframe,
}

/// The last keyframe, as far as the next one depends on it.
#[derive(Clone, Copy, Debug)]
pub struct LastKeyframe {
    pub frame: u64,
    pub world_from_body: Pose,
    /// Landmarks that a frame at this pose can match.
    pub landmarks: u32,
}
