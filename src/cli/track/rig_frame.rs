//! What a source of frames gives the tracker.

use sensel::compute::Feature;
use sensel::tracker::RowClock;

/// One frame of the rig, as a recording brings it.
pub struct RigFrame {
    /// From 0: the run's for packets, the first camera's file for pictures.
    pub(super) number: u32,
    pub(super) timestamp_ns: u64,
    /// One list a camera.
    pub(super) features: Vec<Vec<Feature>>,
    /// When each camera's rows were exposed; none where nobody says so.
    pub(super) clocks: Vec<RowClock>,
}
