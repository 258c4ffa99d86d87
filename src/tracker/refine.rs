//! Refines the body's pose from known points and their pixels in all cameras, by Levenberg-Marquardt under Student's t. Gives each
//! measurement's squared error in sigmas too.
//!
//! Where rows have their own times, the rate of motion is refined with the pose, held by what earlier frames say of it.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::Matrix6;

use super::params::TrackerParams;
pub use super::prior::PosePrior;
use crate::num::{greater, index, lesser};
use crate::pose::Pose;
use crate::tracker::dense::solve_cholesky;
use crate::tracker::lie::{Twist, se3_exp};
use crate::tracker::pose_graph::RobustKernel;
use crate::tracker::rig::{Keypoint, RigCamera};
use crate::tracker::row_motion::{Moving, RatePrior};
use crate::units::CameraIndex;

/// A point of the map found on a picture.
#[derive(Clone, Copy, Debug)]
pub struct PointMeasurement {
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// The point in metres.
    pub point_in_world_m: DVec3,
    /// Where it was found.
    pub position_px: DVec2,
    /// One over the standard deviation of the position, per axis, in 1/px.
    pub inverse_sigma: f64,
    /// From the time of the frame to that of the position's row, in seconds.
    pub offset_s: f64,
}

impl PointMeasurement {
    /// Of a point that a camera saw as a keypoint.
    pub fn of(camera: CameraIndex, keypoint: &Keypoint, point_in_world_m: DVec3, params: &TrackerParams) -> Self {
        let inverse_sigma = params.inverse_sigma(keypoint.scale);
        Self { camera, point_in_world_m, position_px: keypoint.position_px, inverse_sigma, offset_s: keypoint.offset_s }
    }
}

/// Squared error in sigmas of what cannot be projected: beyond every gate, yet finite, so costs stay comparable.
pub const UNSEEN_SIGMAS2: f64 = 1e6;

/// Rows of d(error)/d(twist): the twist acts from the left on `body_from_world`, linear part first.
pub type PoseJacobian = [[f64; 6]; 2];

/// A measurement at a guess.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    /// Measured minus predicted, in sigmas.
    pub error: DVec2,
    /// Derivative of the prediction by the pose at the frame's time.
    pub by_pose: PoseJacobian,
    /// By the pose at the row's time. Times the row's offset it is that by the rate, up to half of the angle between.
    pub by_row_pose: PoseJacobian,
    /// By the point in the body's frame at the frame's time.
    pub by_body: [DVec3; 2],
}

/// Error and derivatives of a point in the body's frame at the frame's time. `row_from_frame` moves it to the row's.
#[inline(always)]
pub fn linearise(
    camera: &RigCamera,
    point_in_body_m: DVec3,
    row_from_frame: &Pose,
    (position_px, inverse_sigma): (DVec2, f64),
) -> Option<Linear> {
    let at_row_m = row_from_frame.point(point_in_body_m);
    let (predicted_px, by_row) = camera.project_with_jacobian(at_row_m)?;
    let by_row = by_row.map(|row| DVec3::from_array(row) * inverse_sigma);
    let back = row_from_frame.rotation.conjugate();
    let by_body = by_row.map(|row| back * row);
    let by_pose = |point_m: DVec3, rows: [DVec3; 2]| {
        rows.map(|row| {
            // d(point)/d(rotation) is -skew(point), and row * -skew(point) = point x row.
            let turn = point_m.cross(row);
            [row.x, row.y, row.z, turn.x, turn.y, turn.z]
        })
    };
    Some(Linear {
        error: (position_px - predicted_px) * inverse_sigma,
        by_pose: by_pose(point_in_body_m, by_body),
        by_row_pose: by_pose(at_row_m, by_row),
        by_body,
    })
}

/// Degrees of freedom of Student's t that positions of corners follow: their errors have a narrow middle and long tails. Measured in a
/// furnished room: 0.33 px by the median, 0.47 px by the mean square.
const TAIL_FREEDOM: f64 = 4.0;
/// Median of the squared length of a bivariate t with 4 degrees of freedom and scale 1: (1 + x / 4)^-2 = 1/2.
const MEDIAN_TAILED2: f64 = 1.656_854;
/// Its Fisher information per axis, (n + 2) / (n + 4), against that of a normal law of the same scale (Lange, Little, Taylor 1989).
const TAILED_INFORMATION: f64 = (TAIL_FREEDOM + 2.0) / (TAIL_FREEDOM + 4.0);
/// The scale of an error's square is kept within this, in sigmas squared: errors of a wrong start must not switch all weights off, and
/// exact positions none on.
const SCALE2_RANGE: [f64; 2] = [0.04, 16.0];
/// How far a position is off, by where in its pixel the corner is: 0.16 px over photographs (docs/extractor.md), more over the faint
/// corners of a dim room, of which 17 % in place of 6 % lie on whole pixels.
pub const WITHIN_PIXEL_PX: f64 = 0.19;

/// Bivariate Student's t with the scale of the errors themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StudentT {
    /// Squared scale in sigmas squared.
    pub scale2: f64,
}

impl StudentT {
    /// The law of these squared errors, by their median.
    pub fn of(errors2: &[f64]) -> Self {
        let median = upper_median(errors2).unwrap_or(MEDIAN_TAILED2);
        Self { scale2: (median / MEDIAN_TAILED2).clamp(SCALE2_RANGE[0], SCALE2_RANGE[1]) }
    }

    /// The same, no narrower than some pixels. What a corner's position within its pixel adds, pictures at rest repeat and do not show;
    /// under a narrower law corners that stay where they are outvote those that follow a small motion.
    #[must_use]
    pub fn no_narrower(self, least_px: f64, inverse_sigmas: impl Iterator<Item = f64>) -> Self {
        // Not beyond the assumed sigma, which whoever tracks exact positions has set small.
        let least = least_px * inverse_sigmas.fold(0.0, greater);
        Self { scale2: greater(self.scale2, lesser(least * least, 1.0)) }
    }

    /// Twice the negative logarithm of the density, up to a constant.
    #[inline]
    pub fn cost(self, error2: f64) -> f64 {
        (TAIL_FREEDOM + 2.0) * libm::log1p(error2 / (TAIL_FREEDOM * self.scale2))
    }

    /// Weight of a squared error's linearisation: half of the cost's slope.
    #[inline]
    pub fn weight(self, error2: f64) -> f64 {
        (TAIL_FREEDOM + 2.0) / (TAIL_FREEDOM * self.scale2 + error2)
    }
}

/// The value in the middle of all, the greater of two. It is the one that sorting would find, without sorting.
pub fn upper_median(values: &[f64]) -> Option<f64> {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Huber's threshold in sigmas: the 95 % quantile of a two-dimensional normal error, sqrt(5.991).
pub const HUBER_SIGMAS: f64 = 2.448;

/// Error distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorModel {
    /// Normal up to a threshold at the assumed sigma.
    Huber,
    /// Student's t.
    StudentT(StudentT),
}

impl ErrorModel {
    /// Cost of a squared error.
    #[inline]
    pub fn cost(self, error2: f64) -> f64 {
        match self {
            Self::Huber => RobustKernel::Huber(HUBER_SIGMAS).at(error2).0,
            Self::StudentT(law) => law.cost(error2),
        }
    }

    /// Weight of its linearisation.
    #[inline]
    pub fn weight(self, error2: f64) -> f64 {
        match self {
            Self::Huber => RobustKernel::Huber(HUBER_SIGMAS).at(error2).1,
            Self::StudentT(law) => law.weight(error2),
        }
    }
}

/// Squared error of a position, in sigmas, for a point of the body's frame at the row's time.
#[inline]
pub fn error2(camera: &RigCamera, at_row_m: DVec3, (position_px, inverse_sigma): (DVec2, f64)) -> f64 {
    camera.project_unclipped(at_row_m).map_or(UNSEEN_SIGMAS2, |predicted_px| {
        ((position_px - predicted_px) * inverse_sigma).length_squared().clamp(0.0, UNSEEN_SIGMAS2)
    })
}

/// Squared errors of all measurements, in sigmas.
pub fn errors2(cameras: &[RigCamera], measurements: &[PointMeasurement], state: &Moving) -> Vec<f64> {
    let rotation = DMat3::from_quat(state.body_from_world.rotation);
    let of = |m: &PointMeasurement| {
        let in_body_m = rotation * m.point_in_world_m + state.body_from_world.translation_m;
        let at_row_m = if m.offset_s == 0.0 { in_body_m } else { state.row_from_frame(m.offset_s).point(in_body_m) };
        error2(&cameras[index(m.camera.0)], at_row_m, (m.position_px, m.inverse_sigma))
    };
    measurements.iter().map(of).collect()
}

/// Priors of rate and pose.
#[derive(Clone, Copy, Debug, Default)]
pub struct FramePriors<'a> {
    /// Prior of the rate; without one, the rate stays fixed.
    pub rate: Option<&'a RatePrior>,
    /// Nothing where it is missing.
    pub pose: Option<&'a PosePrior>,
    /// Positions are off by no less than this.
    pub least_px: f64,
}

/// Unknowns of a pose, and of a pose with its rate.
const POSE: usize = 6;
const BOTH: usize = 12;

/// Normal equations; the first `n` rows and columns of a 12 x 12 matrix are in use, packed to n x n.
struct FrameEquations {
    n: usize,
    matrix: [f64; BOTH * BOTH],
    rhs: [f64; BOTH],
}

/// The problem of one frame.
struct FrameProblem<'a> {
    cameras: &'a [RigCamera],
    measurements: &'a [PointMeasurement],
    known: FramePriors<'a>,
    law: StudentT,
}

/// Refines a state; gives it and the number of iterations. Without a prior the rate stays as it is. A system without a unique
/// solution leaves the pose where damping holds it.
pub fn refine(
    cameras: &[RigCamera],
    measurements: &[PointMeasurement],
    start: &Moving,
    prior: Option<&RatePrior>,
    iterations_max: u32,
) -> (Moving, u32) {
    refine_with(cameras, measurements, start, FramePriors { rate: prior, ..FramePriors::default() }, iterations_max)
}

/// The same with what is known of the pose. The deviation's own Jacobian is taken as one: a prior that matters is narrow.
pub fn refine_with(
    cameras: &[RigCamera],
    measurements: &[PointMeasurement],
    start: &Moving,
    known: FramePriors<'_>,
    iterations_max: u32,
) -> (Moving, u32) {
    let law = StudentT::of(&errors2(cameras, measurements, start))
        .no_narrower(known.least_px, measurements.iter().map(|m| m.inverse_sigma));
    let fit = FrameProblem { cameras, measurements, known, law };
    let mut state = *start;
    let mut cost_now = fit.cost(&state);
    let mut damping = 1e-4;
    for iteration in 0..iterations_max {
        let normal = fit.normal_equations(&state, |error2| fit.law.weight(error2));
        let Some((next, cost_next, step2)) = fit.damped_step(&state, &normal, damping) else {
            return (state, iteration);
        };
        if cost_next < cost_now {
            let gain = cost_now - cost_next;
            (state, damping) = (next, damping * 0.1);
            let done = gain <= 1e-6 * cost_now || step2 < 1e-14;
            cost_now = cost_next;
            if done {
                return (state, iteration + 1);
            }
        } else {
            if step2 < 1e-14 || damping > 1e6 {
                return (state, iteration + 1);
            }
            damping *= 10.0;
        }
    }
    (state, iterations_max)
}

/// What measurements alone know of a pose whose errors follow a law: information of the left twist, with the rate, where it is unknown,
/// taken out.
pub fn information(
    cameras: &[RigCamera],
    measurements: &[PointMeasurement],
    state: &Moving,
    prior: Option<&RatePrior>,
    law: StudentT,
) -> Matrix6<f64> {
    if measurements.is_empty() {
        return Matrix6::zeros();
    }
    let fit = FrameProblem { cameras, measurements, known: FramePriors { rate: prior, ..FramePriors::default() }, law };
    let normal = fit.normal_equations(state, |_| TAILED_INFORMATION / law.scale2);
    let n = normal.n;
    let at = |i: usize, j: usize| normal.matrix[i.max(j) * n + i.min(j)];
    let own = Matrix6::from_fn(at);
    if n == POSE {
        return own;
    }
    let coupling = Matrix6::from_fn(|i, j| at(i, POSE + j));
    let rate = Matrix6::from_fn(|i, j| at(POSE + i, POSE + j));
    rate.cholesky().map_or(own, |rate| own - coupling * rate.solve(&coupling.transpose()))
}

/// Single-picture position sigma given the map: root of the mean variance over the axes that measurements of this information leave, in
/// metres. Landmarks count as exact, and no prior is used. `None` where the measurements leave a direction open.
pub fn single_picture_sigma_m(information: &Matrix6<f64>) -> Option<f64> {
    // A step of the twist's linear part moves the position by as much, in a turned frame.
    let covariance = information.cholesky()?.inverse();
    let variance_m2 = covariance.fixed_view::<3, 3>(0, 0).trace() / 3.0;
    variance_m2.is_finite().then(|| variance_m2.sqrt())
}

impl FrameProblem<'_> {
    fn cost(&self, state: &Moving) -> f64 {
        let rate: f64 =
            self.known.rate.map_or(0.0, |prior| prior.error(&state.rate).iter().map(|error| error * error).sum());
        let pose = self.known.pose.map_or(0.0, |prior| prior.deviation2(&state.body_from_world));
        rate + pose
            + errors2(self.cameras, self.measurements, state).iter().map(|&error2| self.law.cost(error2)).sum::<f64>()
    }

    /// The state after a damped step, its cost, and the step's squared length.
    fn damped_step(&self, state: &Moving, normal: &FrameEquations, damping: f64) -> Option<(Moving, f64, f64)> {
        let n = normal.n;
        let (mut matrix, mut step) = (normal.matrix, normal.rhs);
        for k in 0..n {
            // The floor keeps a direction that nothing measures (no features, all on a line of sight) solvable and at rest.
            matrix[k * (n + 1)] += damping * matrix[k * (n + 1)] + 1e-6;
        }
        if !solve_cholesky(&mut matrix[..n * n], &mut step[..n]) {
            return None;
        }
        let [a, b, c, d, e, f, rate @ ..] = step;
        let body_from_world = se3_exp(Twist::from_array([a, b, c, d, e, f])).then(&state.body_from_world);
        let rate = if n == BOTH { Twist::from_array(rate).plus(&state.rate) } else { state.rate };
        let next = Moving { body_from_world, rate };
        let step2 = step[..n].iter().map(|s| s * s).sum();
        Some((next, self.cost(&next), step2))
    }

    fn normal_equations(&self, state: &Moving, weight_of: impl Fn(f64) -> f64) -> FrameEquations {
        let n = if self.known.rate.is_some() { BOTH } else { POSE };
        let mut normal = FrameEquations { n, matrix: [0.0; BOTH * BOTH], rhs: [0.0; BOTH] };
        let rotation = DMat3::from_quat(state.body_from_world.rotation);
        for m in self.measurements {
            let in_body_m = rotation * m.point_in_world_m + state.body_from_world.translation_m;
            let row_from_frame = state.row_from_frame(m.offset_s);
            let camera = &self.cameras[index(m.camera.0)];
            let linear = linearise(camera, in_body_m, &row_from_frame, (m.position_px, m.inverse_sigma));
            let Some(linear) = linear else { continue };
            let weight = weight_of(linear.error.length_squared());
            for axis in 0..2 {
                let mut row = [0.0; BOTH];
                row[..POSE].copy_from_slice(&linear.by_pose[axis]);
                for (value, by_row_pose) in row[POSE..].iter_mut().zip(linear.by_row_pose[axis]) {
                    *value = by_row_pose * m.offset_s;
                }
                if n == BOTH {
                    normal.add::<BOTH>(&row, weight, linear.error[axis]);
                } else {
                    normal.add::<POSE>(&row, weight, linear.error[axis]);
                }
            }
        }
        if let Some(prior) = self.known.pose {
            let pull = prior.information * prior.deviation(&state.body_from_world);
            for i in 0..POSE {
                normal.rhs[i] -= pull[i];
                (0..=i).for_each(|j| normal.matrix[i * n + j] += prior.information[(i, j)]);
            }
        }
        if let Some(prior) = self.known.rate {
            for (k, (error, scale)) in prior.error(&state.rate).into_iter().zip(prior.inverse_sigmas()).enumerate() {
                normal.rhs[POSE + k] += scale * error;
                normal.matrix[(POSE + k) * (n + 1)] += scale * scale;
            }
        }
        normal
    }
}

impl FrameEquations {
    /// Adds one scalar error over the first `N = n` unknowns; a number that is known in advance unrolls the loops.
    fn add<const N: usize>(&mut self, row: &[f64; BOTH], weight: f64, error: f64) {
        for i in 0..N {
            let weighted = weight * row[i];
            self.rhs[i] += weighted * error;
            for j in 0..=i {
                self.matrix[i * N + j] += weighted * row[j];
            }
        }
    }
}
