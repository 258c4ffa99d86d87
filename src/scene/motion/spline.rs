//! A smooth path of a rigid body: a uniform cubic cumulative B-spline. Computes pose, velocity, acceleration, angular velocity and angular
//! acceleration at a time in seconds, all analytic and continuous (pose in C2).
//!
//! Rotation and translation are separate splines, on SO(3) and R^3. A joint spline on SE(3) would bend straight paths of
//! a turning body into screws; split, the position stays a plain B-spline: linear in its control points, so that its fit
//! is one linear solve and its extent is exact, and world accelerations need no term of the rotation.

use glam::{DQuat, DVec3};

use super::limits::{MotionError, TURN_DEG_MAX};
use crate::num;
use crate::pose::Pose;
use crate::so3;
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
    /// In the body's frame: the derivative of the components above, which is also the body's angular acceleration.
    pub angular_acceleration_rad_per_s2: DVec3,
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
    pub(super) curvature: [f64; 4],
}

/// A rotation with its derivatives by u, in the body's frame.
pub(super) struct RotationDerivatives {
    pub(super) rotation: DQuat,
    velocity_per_u: DVec3,
    acceleration_per_u2: DVec3,
}

impl Basis {
    pub(super) fn at(u: f64) -> Self {
        let (u2, v) = (u * u, 1.0 - u);
        let u3 = u2 * u;
        Self {
            value: [v * v * v / 6.0, (4.0 - 6.0 * u2 + 3.0 * u3) / 6.0, (1.0 + 3.0 * (u + u2 - u3)) / 6.0, u3 / 6.0],
            slope: [-0.5 * v * v, 1.5 * u2 - 2.0 * u, 0.5 + u - 1.5 * u2, 0.5 * u2],
            curvature: [v, 3.0 * u - 2.0, 1.0 - 3.0 * u, u],
        }
    }

    /// Weights of the three differences between neighbours (the cumulative form): sums of the weights from j on.
    fn cumulative(weights: &[f64; 4]) -> [f64; 3] {
        [weights[1] + weights[2] + weights[3], weights[2] + weights[3], weights[3]]
    }
}

impl Spline {
    /// The spline on control poses every `knot_s` seconds, the first at `start_s`. It starts at the first pose and ends at
    /// the last (each end has a control pose more, the mirror of its neighbour), stays within the others' hull, and
    /// passes none of them by design. Fails on fewer than four poses, values that are not finite, a spacing that is not above 0,
    /// neighbours almost half a turn apart.
    pub fn on_control_poses(start_s: f64, knot_s: f64, poses: &[Pose]) -> Result<Self, MotionError> {
        if !(knot_s > 0.0 && knot_s.is_finite()) {
            return Err(MotionError::KnotSpacing { knot_s });
        }
        let [first, second, .., before_last, last] = poses else {
            return Err(MotionError::TooFewSamples { count: poses.len() });
        };
        for (index, pose) in poses.iter().enumerate() {
            if !(pose.translation_m.is_finite() && pose.rotation.is_finite()) {
                return Err(MotionError::NotFinite { t_s: start_s + num::f64_from_usize(index) * knot_s });
            }
        }
        for (index, pair) in poses.windows(2).enumerate() {
            let degrees = pair[0].inverse().then(&pair[1]).angle_rad().to_degrees();
            if degrees > TURN_DEG_MAX {
                let t_s = start_s + num::f64_from_usize(index + 1) * knot_s;
                return Err(MotionError::HalfTurn { t_s, degrees });
            }
        }
        let ends = [mirrored(first, second), mirrored(last, before_last)];
        let controls = ends[..1].iter().chain(poses).chain(&ends[1..]);
        let (positions_m, rotations) = controls.map(|pose| (pose.translation_m, pose.rotation)).unzip();
        Ok(Self { start_s, knot_s, positions_m, rotations })
    }

    /// The spline that follows a function of time from `start_s` on for `intervals` knots. Control poses are the function's
    /// values less a sixth of their second differences, which reproduces cubics (de Boor and Fix's quasi-interpolant): the
    /// spline depends on the function near an instant only, so it is the same however long a run is. It misses a sine of
    /// angular frequency w by its (w knot_s)^4 / 30 or less.
    pub fn following(pose: impl Fn(f64) -> Pose, start_s: f64, knot_s: f64, intervals: usize) -> Self {
        let at = |index: usize| pose(start_s + (num::f64_from_usize(index) - 2.0) * knot_s);
        let samples: Vec<Pose> = (0..intervals + 5).map(at).collect();
        let (mut positions_m, mut rotations) = (Vec::new(), Vec::new());
        for trio in samples.windows(3) {
            let [before, here, after] = [&trio[0], &trio[1], &trio[2]];
            let bend_m = before.translation_m - 2.0 * here.translation_m + after.translation_m;
            positions_m.push(here.translation_m - bend_m / 6.0);
            let back = here.rotation.conjugate();
            let bend_rad = so3::log(back * before.rotation) + so3::log(back * after.rotation);
            rotations.push((here.rotation * so3::exp(bend_rad / -6.0)).normalize());
        }
        Self { start_s, knot_s, positions_m, rotations }
    }

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

    /// Acceleration in the world's frame, without gravity. See [`Spline::state`] for errors.
    pub fn acceleration_m_per_s2(&self, t_s: f64) -> Result<DVec3, MotionError> {
        self.state(t_s).map(|state| state.acceleration_m_per_s2)
    }

    /// Angular velocity in the body's frame. See [`Spline::state`] for errors.
    pub fn angular_velocity_rad_per_s(&self, t_s: f64) -> Result<DVec3, MotionError> {
        self.state(t_s).map(|state| state.angular_velocity_rad_per_s)
    }

    /// Pose and derivatives at an instant. Gives [`MotionError::OutsideSpan`] before the first or after the last instant: the spline is
    /// not extrapolated.
    pub fn state(&self, t_s: f64) -> Result<BodyState, MotionError> {
        let (first, u) = self.interval_at(t_s)?;
        let basis = Basis::at(u);
        let rate = 1.0 / self.knot_s;
        let points: &[DVec3; 4] = self.positions_m[first..first + 4].try_into().expect("four control points");
        let turn = self.rotation_at(first, &basis);
        Ok(BodyState {
            world_from_body: Pose::new(turn.rotation, weighted(points, &basis.value)),
            velocity_m_per_s: weighted(points, &basis.slope) * rate,
            acceleration_m_per_s2: weighted(points, &basis.curvature) * (rate * rate),
            angular_velocity_rad_per_s: turn.velocity_per_u * rate,
            angular_acceleration_rad_per_s2: turn.acceleration_per_u2 * (rate * rate),
        })
    }

    /// The lowest and highest coordinates of the path within a span, along the axes of a frame turned by `rotation`.
    /// Exact up to rounding: the turning points of each interval's cubic are solved for. Gives [`MotionError::OutsideSpan`] where the
    /// span leaves the spline's.
    pub fn extent_m(&self, span: Span, rotation: DQuat) -> Result<(DVec3, DVec3), MotionError> {
        let (first, u_first) = self.interval_at(span.start_s)?;
        let (last, u_last) = self.interval_at(span.end_s)?;
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

    /// No greater speed in m/s and rate of turn in rad/s is met within a span. Both derivatives are means of the differences of
    /// neighbouring control poses over the knots' distance, with weights that add up to 1 (quadratic B-splines), so none exceeds the
    /// greatest difference.
    pub fn speeds_max(&self, span: Span) -> Result<[f64; 2], MotionError> {
        let ((first, _), (last, _)) = (self.interval_at(span.start_s)?, self.interval_at(span.end_s)?);
        let [mut speed, mut turn] = [0.0, 0.0];
        for control in first..last + 3 {
            let step_m = (self.positions_m[control + 1] - self.positions_m[control]).length();
            let between = self.rotations[control].conjugate() * self.rotations[control + 1];
            speed = num::greater(speed, step_m / self.knot_s);
            turn = num::greater(turn, so3::log(between).length() / self.knot_s);
        }
        Ok([speed, turn])
    }

    fn interval_count(&self) -> usize {
        self.positions_m.len() - 3
    }

    /// The interval of an instant and the parameter u within it, 0..=1.
    fn interval_at(&self, t_s: f64) -> Result<(usize, f64), MotionError> {
        let span = self.span();
        if !(t_s >= span.start_s && t_s <= span.end_s) {
            return Err(MotionError::OutsideSpan { t_s, start_s: span.start_s, end_s: span.end_s });
        }
        let knots = (t_s - self.start_s) / self.knot_s;
        let interval = num::index(num::u32_truncated(knots)).min(self.interval_count() - 1);
        Ok((interval, knots - num::f64_from_usize(interval)))
    }

    /// Rotation with its derivatives by u, in the body's frame (the recursions of Sommer et al. 2020, "Efficient Derivative
    /// Computation for Cumulative B-Splines on Lie Groups": each factor turns what came before into its own frame).
    pub(super) fn rotation_at(&self, first: usize, basis: &Basis) -> RotationDerivatives {
        let [parts, speeds, bends] = [&basis.value, &basis.slope, &basis.curvature].map(Basis::cumulative);
        let mut rotation = self.rotations[first];
        let (mut velocity_per_u, mut acceleration_per_u2) = (DVec3::ZERO, DVec3::ZERO);
        for j in 0..3 {
            let difference_rad = so3::log(self.rotations[first + j].conjugate() * self.rotations[first + j + 1]);
            let step = so3::exp(difference_rad * parts[j]);
            rotation *= step;
            let back = step.conjugate();
            velocity_per_u = back * velocity_per_u + difference_rad * speeds[j];
            acceleration_per_u2 = back * acceleration_per_u2
                + velocity_per_u.cross(difference_rad) * speeds[j]
                + difference_rad * bends[j];
        }
        RotationDerivatives { rotation: rotation.normalize(), velocity_per_u, acceleration_per_u2 }
    }
}

/// What lies as far beyond `end` as `inner` lies before it.
fn mirrored(end: &Pose, inner: &Pose) -> Pose {
    let onward_rad = so3::log(inner.rotation.conjugate() * end.rotation);
    Pose::new((end.rotation * so3::exp(onward_rad)).normalize(), 2.0 * end.translation_m - inner.translation_m)
}

fn weighted(points: &[DVec3; 4], weights: &[f64; 4]) -> DVec3 {
    points[0] * weights[0] + points[1] * weights[1] + points[2] * weights[2] + points[3] * weights[3]
}

/// Where the slope of an interval's cubic is zero (at most two values of u, NaN where there is none).
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
