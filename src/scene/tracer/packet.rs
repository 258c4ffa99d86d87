//! A packet of rays, its hits, and holes in triangles.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::super::lanes::{Floats, LANES, Vectors};

/// Rays that are traced together. A lane whose `t_max` is below its `t_min` is idle.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// Origins in metres.
    pub origin_m: Vectors,
    /// Directions; distances along them are in units of their length.
    pub direction: Vectors,
    /// Least distance that counts.
    pub t_min: Floats,
    /// Greatest distance that counts.
    pub t_max: Floats,
}

/// Where cut-out triangles let rays through. It is called only for triangles that the tree has as cut out, and only for points
/// that would otherwise be hits; its answer must depend on its arguments alone.
pub trait Holes {
    /// Whether rays pass the backs of triangles that the tree has as culled.
    const CULLS: bool = false;

    /// Whether a ray passes the triangle at these weights of its second and third corner; `cos` is that of its angle to the plane's normal.
    fn is_open(&self, triangle: u32, weights: [f32; 2], cos: impl FnOnce() -> f32) -> bool;
}

/// Every triangle is whole.
#[derive(Clone, Copy, Debug)]
pub struct NoHoles;

impl Holes for NoHoles {
    #[inline(always)]
    fn is_open(&self, _: u32, _: [f32; 2], _: impl FnOnce() -> f32) -> bool {
        false
    }
}

/// No triangle.
pub const MISS: u32 = u32::MAX;

/// The nearest hit of each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hits {
    /// Distance in units of the direction's length; the packet's `t_max` where nothing was hit.
    pub t: Floats,
    /// Triangle of the scene, or `MISS`.
    pub triangle: [u32; LANES],
    /// Weight of the second corner.
    pub u: Floats,
    /// Weight of the third corner.
    pub v: Floats,
}
