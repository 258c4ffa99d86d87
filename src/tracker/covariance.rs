//! Pose covariance from an adjusted window or one frame's observations: 6 x 6 in the body's frame (m^2, m rad, rad^2; linear part first).
//!
//! The covariance is of the left twist d of `exp(d) body_from_world`, so its linear part is the body's place in its own
//! axes. Landmarks are unknowns: their uncertainty is carried into the poses through the Schur complement. Observations
//! count as normal with the stated sigma: the inverse information is the covariance to first order (Kay 1993, section 3.9), as far
//! as that sigma is true.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, Matrix6, SMatrix};

use super::problem::Problem;
use crate::num::index;
use crate::pose::Pose;
use crate::tracker::dense::solve_cholesky;
use crate::tracker::refine::{Measurement, linearise};
use crate::tracker::rig::RigCamera;

/// A direction that keeps less than this share of its information after the others are known counts as not measured: a
/// depth sigma of 1e5 times the lateral one is a point at infinity.
pub const RANK_TOLERANCE: f64 = 1e-10;

/// What an adjusted window knows.
#[derive(Clone, Debug)]
pub struct WindowUncertainty {
    /// Covariance of each free pose.
    pub poses: Vec<Matrix6<f64>>,
    /// Covariance of each point in m^2 in the world's axes; `None` where a direction of it was not measured.
    pub points: Vec<Option<Matrix3<f64>>>,
}

/// Coupling of a pose and a point.
type Coupling = SMatrix<f64, 6, 3>;

/// The information of a window, by blocks.
struct Information {
    poses: Vec<Matrix6<f64>>,
    points: Vec<Matrix3<f64>>,
    couplings: Vec<BTreeMap<usize, Coupling>>,
}

/// Covariances of an adjusted window, relative to its held poses. `None` where something is not measured: no held pose,
/// or a pose with too few points.
pub fn window_uncertainty(problem: &Problem<'_>) -> Option<WindowUncertainty> {
    let information = Information::of(problem);
    let n = 6 * problem.free;
    let reduced = information.reduced();
    let mut columns = vec![0.0; n * n];
    for k in 0..n {
        let (mut matrix, mut column) = (reduced.clone(), vec![0.0; n]);
        column[k] = 1.0;
        if !solve_cholesky(&mut matrix, &mut column) {
            return None;
        }
        columns[k * n..(k + 1) * n].copy_from_slice(&column);
    }
    let block = |a: usize, b: usize| Matrix6::from_fn(|i, j| columns[(6 * b + j) * n + 6 * a + i]);
    let point = |(own, couplings): (&Matrix3<f64>, &BTreeMap<usize, Coupling>)| {
        let (inverse, rank) = generalised_inverse(own);
        let mut spread = inverse;
        for (a, w_a) in couplings {
            for (b, w_b) in couplings {
                spread += inverse * w_a.transpose() * block(*a, *b) * w_b * inverse;
            }
        }
        (rank == 3).then_some(spread)
    };
    let points = information.points.iter().zip(&information.couplings).map(point).collect();
    Some(WindowUncertainty { poses: (0..problem.free).map(|pose| block(pose, pose)).collect(), points })
}

impl Information {
    fn of(problem: &Problem<'_>) -> Self {
        let points = problem.points_m.len();
        let mut information = Self {
            poses: vec![Matrix6::zeros(); problem.free],
            points: vec![Matrix3::zeros(); points],
            couplings: vec![BTreeMap::new(); points],
        };
        for o in &problem.observations {
            let (pose, point) = (index(o.pose), index(o.point));
            let body_from_world = &problem.poses[pose];
            let camera = &problem.cameras[index(o.camera.0)];
            let in_body_m = body_from_world.point(problem.points_m[point]);
            let Some(rows) = Rows::of(camera, body_from_world, (in_body_m, &o.row_from_frame), o.inverse_sigma) else {
                continue;
            };
            information.points[point] += rows.by_point.tr_mul(&rows.by_point);
            if pose < problem.free {
                information.poses[pose] += rows.by_pose.tr_mul(&rows.by_pose);
                *information.couplings[point].entry(pose).or_insert_with(Coupling::zeros) +=
                    rows.by_pose.tr_mul(&rows.by_point);
            }
        }
        information
    }

    /// The poses' information once the points are unknown, row-major.
    fn reduced(&self) -> Vec<f64> {
        let n = 6 * self.poses.len();
        let mut matrix = vec![0.0; n * n];
        let mut add = |a: usize, b: usize, block: &Matrix6<f64>| {
            for i in 0..6 {
                for j in 0..6 {
                    matrix[(6 * a + i) * n + 6 * b + j] += block[(i, j)];
                }
            }
        };
        for (pose, block) in self.poses.iter().enumerate() {
            add(pose, pose, block);
        }
        for (own, couplings) in self.points.iter().zip(&self.couplings) {
            let (inverse, _) = generalised_inverse(own);
            for (a, w_a) in couplings {
                for (b, w_b) in couplings {
                    add(*a, *b, &-(w_a * inverse * w_b.transpose()));
                }
            }
        }
        matrix
    }
}

/// Derivatives of one place in sigmas.
pub(crate) struct Rows {
    pub(crate) by_pose: SMatrix<f64, 2, 6>,
    pub(crate) by_point: SMatrix<f64, 2, 3>,
}

impl Rows {
    pub(crate) fn of(
        camera: &RigCamera,
        body_from_world: &Pose,
        (in_body_m, row_from_frame): (DVec3, &Pose),
        inverse_sigma: f64,
    ) -> Option<Self> {
        let linear = linearise(camera, in_body_m, row_from_frame, (glam::DVec2::ZERO, inverse_sigma))?;
        let (by_pose, by_body) = (linear.by_pose, linear.by_body);
        let world_from_body = DMat3::from_quat(body_from_world.rotation).transpose();
        let by_point = by_body.map(|row| world_from_body * row);
        Some(Self {
            by_pose: SMatrix::from_fn(|axis, k| by_pose[axis][k]),
            by_point: SMatrix::from_fn(|axis, k| by_point[axis][k]),
        })
    }
}

/// A generalised inverse of a symmetric positive semi-definite matrix, and its rank: the inverse over the directions
/// that are measured (chosen by greatest pivot), zero elsewhere. The Schur complement is the same for every generalised
/// inverse.
pub(crate) fn generalised_inverse(matrix: &Matrix3<f64>) -> (Matrix3<f64>, usize) {
    let mut swept = *matrix;
    let mut taken = [false; 3];
    for rank in 0..3 {
        let share = |k: usize| if taken[k] || matrix[(k, k)] <= 0.0 { 0.0 } else { swept[(k, k)] / matrix[(k, k)] };
        let pivot = (0..3).fold(0, |best, k| if share(k) > share(best) { k } else { best });
        if !(share(pivot) > RANK_TOLERANCE) {
            let kept = |i: usize, j: usize| if taken[i] && taken[j] { -swept[(i, j)] } else { 0.0 };
            return (Matrix3::from_fn(kept), rank);
        }
        taken[pivot] = true;
        // The symmetric sweep: after all three, minus the inverse stands in the matrix.
        let (row, scale) = (swept.row(pivot).clone_owned(), swept[(pivot, pivot)]);
        for i in 0..3 {
            for j in 0..3 {
                swept[(i, j)] = match (i == pivot, j == pivot) {
                    (true, true) => -1.0 / scale,
                    (true, false) => row[j] / scale,
                    (false, true) => row[i] / scale,
                    (false, false) => swept[(i, j)] - row[i] * row[j] / scale,
                };
            }
        }
    }
    (-swept, 3)
}

/// The information of one frame's pose from its observations at the stated sigmas. Each measurement names its landmark,
/// so that two cameras' keypoints of one landmark share its error; `landmark_covariance` gives that error in m^2 in the
/// world's axes (`None`: known exactly). Landmarks count as independent of each other.
pub fn frame_information(
    cameras: &[RigCamera],
    body_from_world: &Pose,
    measurements: &[(u32, Measurement)],
    landmark_covariance: impl Fn(u32) -> Option<Matrix3<f64>>,
) -> Matrix6<f64> {
    let mut by_landmark: BTreeMap<u32, Vec<Rows>> = BTreeMap::new();
    for (landmark, m) in measurements {
        let in_body_m = body_from_world.point(m.point_in_world_m);
        let camera = &cameras[index(m.camera.0)];
        let rows = Rows::of(camera, body_from_world, (in_body_m, &Pose::IDENTITY), m.inverse_sigma);
        by_landmark.entry(*landmark).or_default().extend(rows);
    }
    let mut information = Matrix6::zeros();
    for (landmark, rows) in &by_landmark {
        let (mut own, mut coupling) = (Matrix3::zeros(), Coupling::zeros());
        for rows in rows {
            information += rows.by_pose.tr_mul(&rows.by_pose);
            own += rows.by_point.tr_mul(&rows.by_point);
            coupling += rows.by_pose.tr_mul(&rows.by_point);
        }
        if let Some(covariance) = landmark_covariance(*landmark) {
            // (own + C^-1)^-1 without inverting C, which may be singular: C (own C + 1)^-1.
            let regular = (own * covariance + Matrix3::identity()).try_inverse();
            let left = regular.map_or(covariance, |inverse| covariance * inverse);
            information -= coupling * left * coupling.transpose();
        }
    }
    (information + information.transpose()) * 0.5
}

/// Covariance of one frame's pose by its own observations, without priors: the inverse of [`frame_information`]. `None`
/// where the pose is not determined.
pub fn frame_covariance(
    cameras: &[RigCamera],
    body_from_world: &Pose,
    measurements: &[(u32, Measurement)],
    landmark_covariance: impl Fn(u32) -> Option<Matrix3<f64>>,
) -> Option<Matrix6<f64>> {
    inverse(&frame_information(cameras, body_from_world, measurements, landmark_covariance))
}

/// The inverse of an information; `None` where a direction carries none.
pub fn inverse(information: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let mut covariance = Matrix6::zeros();
    for k in 0..6 {
        let mut matrix: [f64; 36] = std::array::from_fn(|n| information[(n / 6, n % 6)]);
        let mut column: [f64; 6] = std::array::from_fn(|n| f64::from(u8::from(n == k)));
        if !solve_cholesky(&mut matrix, &mut column) {
            return None;
        }
        covariance.set_column(k, &column.into());
    }
    Some(covariance)
}

/// The position's standard deviation per axis in metres: the mean over the three axes, which is what white position
/// noise of this covariance leaves in `jitter_d2_m`.
pub fn position_sigma_m(covariance: &Matrix6<f64>) -> f64 {
    ((covariance[(0, 0)] + covariance[(1, 1)] + covariance[(2, 2)]) / 3.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_generalised_inverse_of_any_rank_satisfies_a_g_a_equals_a() {
        let rows = [DVec3::new(300.0, -20.0, 5.0), DVec3::new(10.0, 310.0, -40.0), DVec3::new(1.0, 2.0, 3.0)];
        for rank in 0..=3 {
            let mut a = Matrix3::zeros();
            for row in &rows[..rank] {
                let row = nalgebra::Vector3::new(row.x, row.y, row.z);
                a += row * row.transpose();
            }
            let (g, found) = generalised_inverse(&a);
            assert_eq!(found, rank);
            // 2^-53 times a condition of 1e5 times numbers of 1e5.
            assert!((a * g * a - a).amax() < 1e-5, "rank {rank}: {}", a * g * a - a);
        }
        // A point at infinity: lateral 1e4 times what depth has by 1e-12.
        let far = Matrix3::from_diagonal(&nalgebra::Vector3::new(1e4, 1e4, 0.0));
        assert_eq!(generalised_inverse(&far).1, 2);
    }
}
