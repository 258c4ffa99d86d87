//! What all mappings share: the type of a projection with its Jacobians, and guards of their denominators.

use glam::{DVec2, DVec3};

/// What roundings add to a rim: a point there and the bearing it returns to must not fall to different sides of it.
pub(super) const RIM: f64 = 8.0 * f64::EPSILON;

/// Rows of the derivative of a position in the picture by the point in space.
pub type ProjectionJacobian = [[f64; 3]; 2];

/// Rows of the derivative of a bearing by the position in the picture.
pub type BearingJacobian = [[f64; 2]; 3];

/// A point of the mapping's plane, and rows of its derivative by the point in space, each times one of two scales: with the focal lengths
/// in pixels, rows of the derivative of the position in the picture.
pub(super) type Projected = (DVec2, ProjectionJacobian);

/// Depth over the distance `d` of [`denominator`] at which the pinhole's rays touch the sphere or ellipsoid (alpha above 1/2) or run along
/// the plane, negated; the double sphere's w1.
pub(super) fn rim_depth_ratio(alpha: f64) -> f64 {
    if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha }
}

/// `alpha d + (1 - alpha) z`, where `d^2 = aside2 + z^2`. Behind the sphere's middle the two parts nearly cancel, so there it is
/// the difference of their squares over that of the parts.
pub(super) fn denominator(alpha: f64, distance: f64, z: f64, aside2: f64) -> f64 {
    if z >= 0.0 {
        return alpha * distance + (1.0 - alpha) * z;
    }
    (alpha * alpha * aside2 + (2.0 * alpha - 1.0) * z * z) / (alpha * distance - (1.0 - alpha) * z)
}

/// The inverse of both: depth of the bearing through a point at the squared distance r2 (times beta), of which `root2` is
/// `1 - (2 alpha - 1) r2`, 0 on the rim. On the unit sphere depth and denominator have no difference that vanishes on a rim; the published
/// quotient has one, but keeps its digits where points run to infinity, which they do for alpha up to 1/2.
pub(super) fn depth_of(alpha: f64, r2: f64, root2: f64) -> f64 {
    let (beta, root) = (1.0 - alpha, crate::num::greater(root2, 0.0).sqrt());
    if alpha <= 0.5 {
        return (1.0 - alpha * alpha * r2) / (alpha * root + beta);
    }
    let depth = (root - alpha * beta * r2) / (1.0 + beta * beta * r2);
    depth / (alpha + beta * depth)
}

/// A point of the plane that is x and y over a denominator, with its derivative: `gradient` is the denominator's.
pub(super) fn over(point: DVec3, denominator: f64, gradient: DVec3, scale: [f64; 2]) -> Option<Projected> {
    let projected = DVec2::new(point.x / denominator, point.y / denominator);
    let row =
        |axis: DVec3, coordinate: f64, scale: f64| ((axis - gradient * coordinate) * (scale / denominator)).to_array();
    projected
        .is_finite()
        .then_some((projected, [row(DVec3::X, projected.x, scale[0]), row(DVec3::Y, projected.y, scale[1])]))
}
