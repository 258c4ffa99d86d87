//! Radial-tangential distortion (Brown 1966 and Conrady 1919, as OpenCV and Kalibr define it): a polynomial over the pinhole's
//! plane z = 1. Only points in front of the camera have an image there.

use glam::{DVec2, DVec3};

use super::projection::Projected;
use crate::num::{greater, lesser};

/// Radial-tangential distortion; all zero is a pinhole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Radtan {
    /// Radial, r^2.
    pub k1: f64,
    /// Radial, r^4.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial, r^6.
    pub k3: f64,
}

impl Radtan {
    /// Where a point lands in the plane, with its derivative.
    pub(super) fn project(&self, point: DVec3, [sx, sy]: [f64; 2]) -> Option<Projected> {
        let ideal = self.in_domain(point)?;
        let (distorted, [xx, xy, yy]) = self.distort(ideal);
        let per_m = 1.0 / point.z;
        let (fx, fy) = (sx * per_m, sy * per_m);
        let jacobian = [
            [fx * xx, fx * xy, -fx * (xx * ideal.x + xy * ideal.y)],
            [fy * xy, fy * yy, -fy * (xy * ideal.x + yy * ideal.y)],
        ];
        Some((distorted, jacobian))
    }

    /// Where a point lands in the plane.
    pub(super) fn project_point(&self, point: DVec3) -> Option<DVec2> {
        Some(self.distort(self.in_domain(point)?).0)
    }

    /// The unit bearing that lands on a point of the plane.
    pub(super) fn unproject(&self, distorted: DVec2) -> Option<DVec3> {
        Some(self.undistort(distorted)?.extend(1.0).normalize())
    }

    /// Largest tangent of the angle off the axis at which the mapping is proven one to one; infinite if it never folds.
    ///
    /// Without tangential terms this is exactly where the radial polynomial stops growing: the first zero of
    /// `1 + 3 k1 r^2 + 5 k2 r^4 + 7 k3 r^6`. With them it lies a little inside the true limit (see `Radtan::stretch_bounds`).
    pub fn radius_max(&self) -> f64 {
        let [along, across] = self.stretch_bounds();
        lesser(first_zero(along), first_zero(across)).sqrt()
    }

    /// The point divided by its depth, if it is in front of the camera and where the mapping is one to one.
    fn in_domain(&self, point: DVec3) -> Option<DVec2> {
        if point.z.is_nan() || point.z <= 0.0 {
            return None;
        }
        let ideal = DVec2::new(point.x / point.z, point.y / point.z);
        self.is_one_to_one_within(ideal.length_squared()).then_some(ideal)
    }

    /// Upper bound of the tangential terms' pull on the smallest stretch of the mapping, divided by six times the radius.
    fn tangential(&self) -> f64 {
        self.p1.abs() + self.p2.abs()
    }

    /// Lower bounds of the mapping's stretch along the radius and across it, as `a + b s + c s^2 + d s^3` of `s = r^2`.
    ///
    /// The mapping is the gradient of `r^2/2 + k1 r^4/4 + k2 r^6/6 + k3 r^8/8 + (p2 x + p1 y) r^2`, so its Jacobian is symmetric. Its
    /// radial part has the eigenvalues `1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3` along the radius and `1 + k1 s + k2 s^2 + k3 s^3` across it; the
    /// tangential part has `4 q.x ± 2 |q| r` with q = (p2, p1), which is never below `-6 |q| r >= -3 |q| (1 + s)`.
    fn stretch_bounds(&self) -> [[f64; 4]; 2] {
        let Self { k1, k2, k3, .. } = *self;
        let slack = 3.0 * self.tangential();
        [[1.0 - slack, 3.0 * k1 - slack, 5.0 * k2, 7.0 * k3], [1.0 - slack, k1 - slack, k2, k3]]
    }

    /// Whether the mapping is proven one to one on the disc of this squared radius: a gradient whose Jacobian is positive
    /// definite on a convex set belongs to a strictly convex function, and such a gradient takes no value twice.
    fn is_one_to_one_within(&self, radius2: f64) -> bool {
        self.stretch_bounds().into_iter().all(|bound| stays_positive(bound, radius2))
    }

    /// Where an undistorted point of the plane z = 1 lands, with the Jacobian's entries xx, xy (= yx) and yy.
    #[inline(always)]
    pub(super) fn distort(&self, at: DVec2) -> (DVec2, [f64; 3]) {
        let Self { k1, k2, p1, p2, k3 } = *self;
        let (x, y) = (at.x, at.y);
        let s = x * x + y * y;
        let radial = 1.0 + s * (k1 + s * (k2 + s * k3));
        let growth = 2.0 * (k1 + 2.0 * s * k2 + 3.0 * s * s * k3); // d(radial)/dx divided by x
        let cross = 2.0 * x * y;
        let distorted = DVec2::new(
            x * radial + p1 * cross + p2 * (s + 2.0 * x * x),
            y * radial + p1 * (s + 2.0 * y * y) + p2 * cross,
        );
        let jacobian = [
            radial + growth * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
            growth * x * y + 2.0 * p1 * x + 2.0 * p2 * y,
            radial + growth * y * y + 6.0 * p1 * y + 2.0 * p2 * x,
        ];
        (distorted, jacobian)
    }

    /// The undistorted point that lands on `target`: damped Newton inside the proven domain, where the Jacobian is positive
    /// definite and the step is a descent direction of the residual. None if it does not come within 1e-12.
    fn undistort(&self, target: DVec2) -> Option<DVec2> {
        let mut at = DVec2::ZERO;
        let (mut distorted, mut jacobian) = self.distort(at);
        for _ in 0..NEWTON_STEPS_MAX {
            let residual = target - distorted;
            let [xx, xy, yy] = jacobian;
            let determinant = xx * yy - xy * xy;
            let step = DVec2::new(yy * residual.x - xy * residual.y, xx * residual.y - xy * residual.x) / determinant;
            if residual.length() <= RESIDUAL_MAX {
                // One more step costs nothing here and squares what error is left.
                return Some(at + step).filter(|at| self.is_one_to_one_within(at.length_squared()));
            }
            (at, distorted, jacobian) = self.damped(at, step, target, residual.length_squared())?;
        }
        None
    }

    /// Halves a Newton step until it stays in the domain and brings the distorted point closer to its target.
    fn damped(&self, at: DVec2, step: DVec2, target: DVec2, error2: f64) -> Option<(DVec2, DVec2, [f64; 3])> {
        let mut fraction = 1.0;
        for _ in 0..HALVINGS_MAX {
            let next = at + step * fraction;
            if self.is_one_to_one_within(next.length_squared()) {
                let (distorted, jacobian) = self.distort(next);
                if (target - distorted).length_squared() < error2 {
                    return Some((next, distorted, jacobian));
                }
            }
            fraction *= 0.5;
        }
        None
    }
}

/// Residual in the plane z = 1 at which Newton's iteration has converged.
const RESIDUAL_MAX: f64 = 1e-12;
/// Full steps converge in 4 to 6; only targets at the domain's edge need more.
const NEWTON_STEPS_MAX: u32 = 60;
/// 2^-30 of a step is below any useful progress.
const HALVINGS_MAX: u32 = 30;

/// Whether `a + b s + c s^2 + d s^3 > 0` for all s in 0..=`s`. False for NaN.
fn stays_positive([a, b, c, d]: [f64; 4], s: f64) -> bool {
    if d != 0.0 {
        let value = |s: f64| a + s * (b + s * (c + s * d));
        let [first, second] = turning_points([b, c, d]);
        return [0.0, s, first, second].iter().all(|&at| !(at <= s) || value(at) > 0.0) && s.is_finite();
    }
    let positive_at_end = a > 0.0 && a + s * (b + s * c) > 0.0;
    // Only a valley (c > 0) between 0 and s can dip below zero while both ends are above it.
    let valley_is_inside = c > 0.0 && b < 0.0 && 2.0 * c * s > -b;
    positive_at_end && !(valley_is_inside && b * b >= 4.0 * a * c)
}

/// Where `b + 2 c s + 3 d s^2` is zero for s > 0, the first before the second; infinite where it is not. For d other than 0.
fn turning_points([b, c, d]: [f64; 3]) -> [f64; 2] {
    let discriminant = c * c - 3.0 * b * d;
    if discriminant < 0.0 {
        return [f64::INFINITY; 2];
    }
    // The form without cancellation: one root from the greater sum, the other from the product of both.
    let sum = -(c + if c < 0.0 { -discriminant.sqrt() } else { discriminant.sqrt() });
    let of = |root: f64| if root > 0.0 { root } else { f64::INFINITY };
    let (one, other) = (of(sum / (3.0 * d)), of(b / sum));
    [lesser(one, other), greater(one, other)]
}

/// First s > 0 at which `a + b s + c s^2 + d s^3` is zero; infinite if there is none, 0 if a is not positive.
fn first_zero(bound: [f64; 4]) -> f64 {
    let [a, b, c, d] = bound;
    if a.is_nan() || a <= 0.0 {
        return 0.0;
    }
    if d != 0.0 {
        return first_zero_of_cubic(bound);
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 || (b >= 0.0 && c >= 0.0) {
        return f64::INFINITY;
    }
    // The form without cancellation for b <= 0; for b > 0 (then c < 0) the other root's.
    let root = discriminant.sqrt();
    if b <= 0.0 { 2.0 * a / (root - b) } else { (-b - root) / (2.0 * c) }
}

/// The same for d other than 0, by bisection of the first stretch between turning points over which the sign changes.
fn first_zero_of_cubic([a, b, c, d]: [f64; 4]) -> f64 {
    let value = |s: f64| a + s * (b + s * (c + s * d));
    let [first, second] = turning_points([b, c, d]);
    let mut low = 0.0;
    // Beyond all turning points the cubic runs towards the sign of d; 1e6 is a bearing 0.06 degrees off the camera's plane.
    for end in [first, second, 1e6] {
        let mut high = lesser(end, 1e6);
        if value(high) > 0.0 {
            low = high;
            continue;
        }
        while 0.5 * (low + high) > low && 0.5 * (low + high) < high {
            let middle = 0.5 * (low + high);
            (low, high) = if value(middle) > 0.0 { (middle, high) } else { (low, middle) };
        }
        return low;
    }
    f64::INFINITY
}
