//! What a run needs of a world.

use crate::optics::Camera;
use crate::units::Span;
use glam::DVec3;

/// What a world must serve.
pub struct Demand<'a> {
    /// Where the body is at first: where the scenario's illuminance holds.
    pub start_m: DVec3,
    /// The cameras, with the pixels of the array that are read.
    pub cameras: &'a [Camera],
    /// Frames of the run.
    pub frames: u32,
    /// From the start of the first exposure of a run of so many frames to the end of its last.
    pub span_of: &'a dyn Fn(u32) -> Span,
}
