//! Depth of a map without a metre.

use glam::DVec3;

/// Median depth of the first points of a map without a metre, in its unit. The tracker's lengths are those of a room, so this is one's.
pub const MONO_DEPTH_M: f64 = 2.0;

/// The distance in the middle.
pub fn median_depth(points: impl Iterator<Item = DVec3>) -> Option<f64> {
    let mut depths: Vec<f64> = points.map(|point| point.length()).collect();
    depths.sort_by(f64::total_cmp);
    depths.get(depths.len() / 2).copied().filter(|depth| depth.is_finite() && *depth > 0.0)
}
