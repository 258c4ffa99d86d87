//! Radially symmetric mappings: a radius for each angle. Maps points to the image plane with their derivative, and back to unit bearings.

use glam::{DVec2, DVec3};

use super::projection::{Projected, RIM};
use crate::num::lesser;

/// A radius that rises with the angle off the axis, from 0 at 0.
pub(super) trait Radial {
    /// Angle before which the radius rises and is defined, at most pi.
    fn angle_max_rad(&self) -> f64;

    /// Radius in the plane at an angle from 0 to [`Radial::angle_max_rad`], and its slope.
    fn radius(&self, angle_rad: f64) -> (f64, f64);
}

/// Where a point lands. With `d = r'(a)` the derivative is `d z / n^2` along the radius, `r / rho` across it, and `-d rho / n^2` by
/// depth, where rho is the distance from the axis and n from the camera.
pub(super) fn project(mapping: &impl Radial, point: DVec3, [sx, sy]: [f64; 2]) -> Option<Projected> {
    let rho = libm::hypot(point.x, point.y);
    let angle_rad = libm::atan2(rho, point.z);
    let n2 = rho * rho + point.z * point.z;
    // A point so near or so far that its square has no digits has no direction either. False for NaN.
    if !(angle_rad < mapping.angle_max_rad() && n2.is_normal()) {
        return None;
    }
    let (radius, slope) = mapping.radius(angle_rad);
    if rho == 0.0 {
        let along = slope / point.z;
        return Some((DVec2::ZERO, [[sx * along, 0.0, 0.0], [0.0, sy * along, 0.0]]));
    }
    let (x, y) = (point.x / rho, point.y / rho);
    let (along, across, inward) = (slope * point.z / n2, radius / rho, -slope * rho / n2);
    let jacobian = [
        [sx * (along * x * x + across * y * y), sx * (along - across) * x * y, sx * inward * x],
        [sy * (along - across) * x * y, sy * (along * y * y + across * x * x), sy * inward * y],
    ];
    Some((DVec2::new(radius * x, radius * y), jacobian))
}

/// The unit bearing that lands on a point of the mapping's plane.
pub(super) fn unproject(mapping: &impl Radial, point: DVec2) -> Option<DVec3> {
    let radius = libm::hypot(point.x, point.y);
    if radius == 0.0 {
        return (mapping.angle_max_rad() > 0.0).then_some(DVec3::Z);
    }
    let angle_rad = angle_of(mapping, radius)?;
    let (sine, cosine) = libm::sincos(angle_rad);
    Some(DVec3::new(sine * (point.x / radius), sine * (point.y / radius), cosine))
}

/// Newton needs 4 to 8 steps; where bisection takes over it halves the bracket, 52 times for all digits, every other step at least.
const STEPS_MAX: u32 = 120;

/// The angle of a radius: Newton's iteration, bisecting where it leaves the bracket or does not halve its step.
fn angle_of(mapping: &impl Radial, radius: f64) -> Option<f64> {
    let angle_max_rad = mapping.angle_max_rad();
    let (mut low, mut high) = (0.0, angle_max_rad);
    // False for NaN, and for a mapping without a domain.
    if !(radius <= mapping.radius(angle_max_rad).0 * (1.0 + RIM) && angle_max_rad > 0.0) {
        return None;
    }
    let mut angle_rad = lesser(radius, 0.9 * high);
    let mut last_step = high;
    for _ in 0..STEPS_MAX {
        let (reached, slope) = mapping.radius(angle_rad);
        let miss = reached - radius;
        if miss > 0.0 {
            high = angle_rad;
        } else {
            low = angle_rad;
        }
        let newton = angle_rad - miss / slope;
        let step = (newton - angle_rad).abs();
        if step <= 2.0 * f64::EPSILON * angle_rad {
            angle_rad = newton;
            break;
        }
        let is_good = newton > low && newton < high && 2.0 * step <= last_step;
        let next = if is_good { newton } else { 0.5 * (low + high) };
        last_step = (next - angle_rad).abs();
        angle_rad = next;
        if high - low <= f64::EPSILON * high {
            break;
        }
    }
    Some(lesser(angle_rad, angle_max_rad * (1.0 - RIM)))
}
