//! A smooth path of a rigid body: a uniform cubic cumulative B-spline. Enters: a time in seconds. Leaves: pose, velocity,
//! acceleration and angular velocity, all analytic and continuous (pose in C2).
//!
//! Rotation and translation are separate splines, on SO(3) and R^3. A joint spline on SE(3) would bend straight paths of
//! a turning body into screws; split, the position stays a plain B-spline: linear in its control points, so that its fit
//! is one linear solve and its extent is exact, and world accelerations need no term of the rotation.

use glam::{DQuat, DVec3};

use super::MotionError;
use super::so3;
use crate::num;
use crate::pose::Pose;
use crate::units::Span;

/// Where a body is and how it moves, at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// Where the body is.
    pub world_from_body: Pose,
    /// In the world's frame.
    pub velocity_m_per_s: DVec3,
    /// In the world's frame, without gravity.
    pub acceleration_m_per_s2: DVec3,
    /// In the body's frame.
    pub angular_velocity_rad_per_s: DVec3,
}

/// A uniform cubic cumulative B-spline on R^3 x SO(3). Control point i belongs to the time `start_s + (i - 1) knot_s`.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    pub(super) start_s: f64,
    pub(super) knot_s: f64,
    pub(super) positions_m: Vec<DVec3>,
    pub(super) rotations: Vec<DQuat>,
}

/// Weights of the four control points of an interval, with their first and second derivatives by `u` in 0..=1.
pub(super) struct Basis {
    pub(super) value: [f64; 4],
    pub(super) slope: [f64; 4],
    pub(super) bend: [f64; 4],
}

impl Basis {
    pub(super) fn at(u: f64) -> Self {
        let (u2, v) = (u * u, 1.0 - u);
        let u3 = u2 * u;
        Self {
            value: [v * v * v / 6.0, (4.0 - 6.0 * u2 + 3.0 * u3) / 6.0, (1.0 + 3.0 * (u + u2 - u3)) / 6.0, u3 / 6.0],
            slope: [-0.5 * v * v, 1.5 * u2 - 2.0 * u, 0.5 + u - 1.5 * u2, 0.5 * u2],
            bend: [v, 3.0 * u - 2.0, 1.0 - 3.0 * u, u],
        }
    }

    /// Weights of the three differences between neighbours (the cumulative form): sums of the weights from j on.
    fn cumulative(weights: &[f64; 4]) -> [f64; 3] {
        [weights[1] + weights[2] + weights[3], weights[2] + weights[3], weights[3]]
    }
}

impl Spline {
    /// The times at which the spline is defined, in seconds of its samples' clock.
    pub fn span(&self) -> Span {
        let intervals = num::f64_from_usize(self.interval_count());
        Span { start_s: self.start_s, end_s: self.start_s + intervals * self.knot_s }
    }

    /// Distance between knots in seconds.
    pub fn knot_s(&self) -> f64 {
        self.knot_s
    }

    /// Where the body is. See [`Spline::state`] for errors.
    pub fn world_from_body(&self, t_s: f64) -> Result<Pose, MotionError> {
        self.state(t_s).map(|state| state.world_from_body)
    }

    /// Velocity in the world's frame. See [`Spline::state`] for errors.
    pub fn velocity_m_per_s(&self, t_s: f64) -> Result<DVec3, MotionError> {
        self.state(t_s).map(|state| state.velocity_m_per_s)
    }

    /// Acceleration in the world's frame, without gravity. See [`Spline::state`] for errors.
    pub fn acceleration_m_per_s2(&self, t_s: f64) -> Result<DVec3, MotionError> {
        self.state(t_s).map(|state| state.acceleration_m_per_s2)
    }

    /// Angular velocity in the body's frame. See [`Spline::state`] for errors.
    pub fn angular_velocity_rad_per_s(&self, t_s: f64) -> Result<DVec3, MotionError> {
        self.state(t_s).map(|state| state.angular_velocity_rad_per_s)
    }

    /// Pose and derivatives at an instant.
    ///
    /// # Errors
    /// [`MotionError::OutsideSpan`] before the first or after the last instant: the spline is not extrapolated.
    pub fn state(&self, t_s: f64) -> Result<BodyState, MotionError> {
        let (first, u) = self.place(t_s)?;
        let basis = Basis::at(u);
        let rate = 1.0 / self.knot_s;
        let points: &[DVec3; 4] = self.positions_m[first..first + 4].try_into().expect("four control points");
        let (rotation, angular_per_u) = self.rotation_at(first, &basis);
        Ok(BodyState {
            world_from_body: Pose::new(rotation, weighted(points, &basis.value)),
            velocity_m_per_s: weighted(points, &basis.slope) * rate,
            acceleration_m_per_s2: weighted(points, &basis.bend) * (rate * rate),
            angular_velocity_rad_per_s: angular_per_u * rate,
        })
    }

    /// The lowest and highest coordinates of the path within a span, along the axes of a frame turned by `rotation`.
    /// Exact up to rounding: the turning points of each interval's cubic are solved for.
    ///
    /// # Errors
    /// [`MotionError::OutsideSpan`] where the span leaves the spline's.
    pub fn extent_m(&self, span: Span, rotation: DQuat) -> Result<(DVec3, DVec3), MotionError> {
        let (first, u_first) = self.place(span.start_s)?;
        let (last, u_last) = self.place(span.end_s)?;
        let mut low_m = DVec3::INFINITY;
        let mut high_m = DVec3::NEG_INFINITY;
        for interval in first..=last {
            let from_u = if interval == first { u_first } else { 0.0 };
            let to_u = if interval == last { u_last } else { 1.0 };
            let points: [DVec3; 4] = core::array::from_fn(|k| rotation * self.positions_m[interval + k]);
            for axis in 0..3 {
                let points_m = points.map(|point| point[axis]);
                for u in turning_points(&points_m).into_iter().chain([from_u, to_u]) {
                    if u >= from_u && u <= to_u {
                        let weights = Basis::at(u).value;
                        let value_m = (0..4).map(|k| weights[k] * points_m[k]).fold(0.0, |sum, term| sum + term);
                        low_m[axis] = num::lesser(low_m[axis], value_m);
                        high_m[axis] = num::greater(high_m[axis], value_m);
                    }
                }
            }
        }
        Ok((low_m, high_m))
    }

    pub(super) fn interval_count(&self) -> usize {
        self.positions_m.len() - 3
    }

    /// The interval of an instant and the place within it, 0..=1.
    pub(super) fn place(&self, t_s: f64) -> Result<(usize, f64), MotionError> {
        let span = self.span();
        if !(t_s >= span.start_s && t_s <= span.end_s) {
            return Err(MotionError::OutsideSpan { t_s, start_s: span.start_s, end_s: span.end_s });
        }
        let knots = (t_s - self.start_s) / self.knot_s;
        let interval = num::index(num::u32_truncated(knots)).min(self.interval_count() - 1);
        Ok((interval, knots - num::f64_from_usize(interval)))
    }

    /// Rotation, and angular velocity in the body's frame by u (the recursion of Sommer et al. 2020, "Efficient Derivative
    /// Computation for Cumulative B-Splines on Lie Groups": each factor turns what came before into its own frame).
    pub(super) fn rotation_at(&self, first: usize, basis: &Basis) -> (DQuat, DVec3) {
        let (parts, speeds) = (Basis::cumulative(&basis.value), Basis::cumulative(&basis.slope));
        let mut rotation = self.rotations[first];
        let mut angular_per_u = DVec3::ZERO;
        for j in 0..3 {
            let difference_rad = so3::log(self.rotations[first + j].conjugate() * self.rotations[first + j + 1]);
            let step = so3::exp(difference_rad * parts[j]);
            rotation *= step;
            angular_per_u = step.conjugate() * angular_per_u + difference_rad * speeds[j];
        }
        (rotation.normalize(), angular_per_u)
    }
}

fn weighted(points: &[DVec3; 4], weights: &[f64; 4]) -> DVec3 {
    points[0] * weights[0] + points[1] * weights[1] + points[2] * weights[2] + points[3] * weights[3]
}

/// Where the slope of an interval's cubic is zero (at most two places, NaN where there is none).
fn turning_points(points: &[f64; 4]) -> [f64; 2] {
    // Slope as a u^2 + b u + c, from the basis' slopes.
    let [p0, p1, p2, p3] = *points;
    let a = 0.5 * (p3 - p0) + 1.5 * (p1 - p2);
    let b = p0 - 2.0 * p1 + p2;
    let c = 0.5 * (p2 - p0);
    // The form without cancellation; a zero divisor gives an infinity, which no interval holds.
    let root = (b * b - 4.0 * a * c).sqrt();
    let sum = -0.5 * (b + if b < 0.0 { -root } else { root });
    [sum / a, c / sum]
}
