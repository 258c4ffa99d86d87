//! Bundle adjustment of a window: poses and points together, by Levenberg-Marquardt with Huber's kernel or under Student's t. The points
//! are eliminated first (block Schur complement), the poses follow from one dense Cholesky.
//!
//! Observations are summed in their order, so equal input gives equal bytes. Lengths are metres.

use std::ops::Range;

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};

use super::problem::Prior;
pub use super::problem::{AdjustmentOutcome, Observation, Problem};
use crate::num::index;
use crate::pose::Pose;
use crate::tracker::dense::solve_cholesky;
use crate::tracker::lie::{Twist, se3_exp};
use crate::tracker::refine::{ErrorModel, Linear, StudentT, error2, linearise};

/// Coupling of a free pose and a point: d(error)/d(pose) transposed times d(error)/d(point).
type Coupling = SMatrix<f64, 6, 3>;

/// Steps of the free poses and of the points.
pub(crate) type Steps = (Vec<Vector6<f64>>, Vec<Vector3<f64>>);

/// The undamped normal equations, by blocks.
pub(crate) struct BlockEquations {
    pose_blocks: Vec<Matrix6<f64>>,
    pose_rhs: Vec<Vector6<f64>>,
    point_blocks: Vec<Matrix3<f64>>,
    point_rhs: Vec<Vector3<f64>>,
    /// Couplings of each point, in the order in which its poses were first met.
    couplings: Vec<(usize, Coupling)>,
    coupled: Vec<Range<usize>>,
    /// Information and right-hand side over the free poses that left the window before.
    prior: Option<(Vec<f64>, Vec<f64>)>,
}

/// A point that nothing measures in some direction is held by this much, in 1/m^2; a stereo point at 10 m has some 0.1.
const POINT_FLOOR_PER_M2: f64 = 1e-4;
/// The same for poses, in 1/m^2 and 1/rad^2; a single point gives 1e4.
const POSE_FLOOR: f64 = 1e-6;

impl Problem<'_> {
    /// Adjusts in place under Huber's kernel.
    pub fn solve(&mut self, iterations_max: u32) -> AdjustmentOutcome {
        self.solve_with(ErrorModel::Huber, None, iterations_max)
    }

    /// Adjusts in place, with the errors' own law, no narrower than some pixels, under what is known beside. Derivatives of the prior's
    /// poses are taken at their first estimates.
    pub fn solve_tailed(&mut self, prior: Option<&Prior>, least_px: f64, iterations_max: u32) -> AdjustmentOutcome {
        let law =
            StudentT::of(&self.errors2()).no_narrower(least_px, self.observations.iter().map(|o| o.inverse_sigma));
        self.solve_with(ErrorModel::StudentT(law), prior, iterations_max)
    }

    fn solve_with(&mut self, law: ErrorModel, prior: Option<&Prior>, iterations_max: u32) -> AdjustmentOutcome {
        assert!(self.free <= self.poses.len(), "only poses that exist can move");
        assert!(self.observations.is_sorted_by_key(|o| o.point), "observations must be in the order of their points");
        let cost_of = |problem: &Self, poses: &[Pose], points_m: &[DVec3]| {
            problem.cost(poses, points_m, law) + prior.map_or(0.0, |prior| prior.cost(poses))
        };
        let mut cost = cost_of(self, &self.poses, &self.points_m);
        let mut outcome = AdjustmentOutcome { cost_before: cost, cost_after: cost, iterations: 0 };
        let mut damping = 1e-4;
        let mut normal = self.linearise_under(prior, law);
        while outcome.iterations < iterations_max {
            outcome.iterations += 1;
            let moved = normal.step(damping).map(|(by_pose, by_point)| self.moved(&by_pose, &by_point));
            let accepted = moved.and_then(|(poses, points_m)| {
                let cost_next = cost_of(self, &poses, &points_m);
                (cost_next < cost).then_some((poses, points_m, cost_next))
            });
            let Some((poses, points_m, cost_next)) = accepted else {
                damping *= 10.0;
                if damping > 1e4 {
                    break;
                }
                continue;
            };
            let gain = cost - cost_next;
            (self.poses, self.points_m, cost) = (poses, points_m, cost_next);
            damping *= 0.1;
            if gain <= 1e-5 * cost {
                break;
            }
            if outcome.iterations < iterations_max {
                normal = self.linearise_under(prior, law);
            }
        }
        outcome.cost_after = cost;
        outcome
    }

    /// Squared error of each observation in sigmas.
    pub fn errors2(&self) -> Vec<f64> {
        let mut errors2 = Vec::with_capacity(self.observations.len());
        self.each_error2(&self.poses, &self.points_m, |error2| errors2.push(error2));
        errors2
    }

    fn cost(&self, poses: &[Pose], points_m: &[DVec3], law: ErrorModel) -> f64 {
        let mut cost = 0.0;
        self.each_error2(poses, points_m, |error2| cost += law.cost(error2));
        cost
    }

    fn each_error2(&self, poses: &[Pose], points_m: &[DVec3], mut take: impl FnMut(f64)) {
        let rotations: Vec<DMat3> = poses.iter().map(|pose| DMat3::from_quat(pose.rotation)).collect();
        for o in &self.observations {
            let in_body_m = rotations[index(o.pose)] * points_m[index(o.point)] + poses[index(o.pose)].translation_m;
            let at_row_m = o.row_from_frame.point(in_body_m);
            take(error2(&self.cameras[index(o.camera.0)], at_row_m, (o.position_px, o.inverse_sigma)));
        }
    }

    fn moved(&self, by_pose: &[Vector6<f64>], by_point: &[Vector3<f64>]) -> (Vec<Pose>, Vec<DVec3>) {
        let mut poses = self.poses.clone();
        for (pose, step) in poses.iter_mut().zip(by_pose) {
            *pose = se3_exp(Twist::from_array((*step).into())).then(pose);
        }
        let move_point = |(point_m, step): (&DVec3, &Vector3<f64>)| *point_m + DVec3::new(step.x, step.y, step.z);
        (poses, self.points_m.iter().zip(by_point).map(move_point).collect())
    }

    /// The normal equations without a prior, for tests.
    #[cfg(test)]
    pub(crate) fn linearise(&self) -> BlockEquations {
        self.linearise_under(None, ErrorModel::Huber)
    }

    fn linearise_under(&self, prior: Option<&Prior>, law: ErrorModel) -> BlockEquations {
        let mut normal = BlockEquations {
            pose_blocks: vec![Matrix6::zeros(); self.free],
            pose_rhs: vec![Vector6::zeros(); self.free],
            point_blocks: vec![Matrix3::zeros(); self.points_m.len()],
            point_rhs: vec![Vector3::zeros(); self.points_m.len()],
            couplings: Vec::with_capacity(self.observations.len()),
            coupled: vec![0..0; self.points_m.len()],
            prior: prior.map(|prior| {
                let n = 6 * self.free;
                let (mut matrix, mut rhs) = (vec![0.0; n * n], vec![0.0; n]);
                prior.add_to(&self.poses, &mut matrix, &mut rhs);
                (matrix, rhs)
            }),
        };
        let rotations: Vec<DMat3> = self.poses.iter().map(|pose| DMat3::from_quat(pose.rotation)).collect();
        for o in &self.observations {
            let (pose, point) = (index(o.pose), index(o.point));
            let in_body_m = rotations[pose] * self.points_m[point] + self.poses[pose].translation_m;
            let camera = &self.cameras[index(o.camera.0)];
            let measured = (o.position_px, o.inverse_sigma);
            let linear = linearise(camera, in_body_m, &o.row_from_frame, measured);
            let Some(Linear { error, mut by_pose, mut by_body, .. }) = linear else { continue };
            let weight = law.weight(error.length_squared());
            let mut transposed = rotations[pose].transpose();
            if let Some(first) = prior.and_then(|prior| prior.first_estimate(o.pose)) {
                let in_body_m = first.point(self.points_m[point]);
                if let Some(first_linear) = linearise(camera, in_body_m, &o.row_from_frame, measured) {
                    (by_pose, by_body) = (first_linear.by_pose, first_linear.by_body);
                    transposed = DMat3::from_quat(first.rotation).transpose();
                }
            }
            let by_point = by_body.map(|row| transposed * row);
            for axis in 0..2 {
                let row = by_point[axis];
                let to_point = Vector3::new(row.x, row.y, row.z);
                let to_pose = (pose < self.free).then(|| Vector6::from(by_pose[axis]));
                normal.add(point, (pose, to_pose), to_point, (weight, error[axis]));
            }
        }
        normal
    }
}

impl BlockEquations {
    /// Adds one scalar error with its derivatives.
    fn add(
        &mut self,
        point: usize,
        (pose, to_pose): (usize, Option<Vector6<f64>>),
        to_point: Vector3<f64>,
        (weight, error): (f64, f64),
    ) {
        let weighted_point = to_point * weight;
        self.point_blocks[point] += weighted_point * to_point.transpose();
        self.point_rhs[point] += weighted_point * error;
        let Some(to_pose) = to_pose else { return };
        let weighted_pose = to_pose * weight;
        self.pose_blocks[pose] += weighted_pose * to_pose.transpose();
        self.pose_rhs[pose] += weighted_pose * error;
        let range = &mut self.coupled[point];
        if range.start == range.end {
            *range = self.couplings.len()..self.couplings.len();
        }
        let coupling = weighted_pose * to_point.transpose();
        match self.couplings[range.clone()].iter_mut().find(|(held, _)| *held == pose) {
            Some((_, held)) => *held += coupling,
            None => {
                assert!(range.end == self.couplings.len(), "observations of a point stand together");
                self.couplings.push((pose, coupling));
                range.end += 1;
            }
        }
    }

    /// Steps of the poses and points under a damping; `None` where the reduced system is not positive definite.
    pub(crate) fn step(&self, damping: f64) -> Option<Steps> {
        let n = 6 * self.pose_blocks.len();
        let mut matrix = vec![0.0; n * n];
        let mut rhs = vec![0.0; n];
        for (pose, (block, block_rhs)) in self.pose_blocks.iter().zip(&self.pose_rhs).enumerate() {
            for i in 0..6 {
                rhs[6 * pose + i] = block_rhs[i];
                for j in 0..=i {
                    matrix[(6 * pose + i) * n + 6 * pose + j] = block[(i, j)];
                }
                matrix[(6 * pose + i) * (n + 1)] += damping * block[(i, i)] + POSE_FLOOR;
            }
        }
        if let Some((information, prior_rhs)) = &self.prior {
            matrix.iter_mut().zip(information).for_each(|(sum, x)| *sum += x);
            rhs.iter_mut().zip(prior_rhs).for_each(|(sum, x)| *sum += x);
        }
        let inverses = self.damped_inverses(damping)?;
        for (point, inverse) in inverses.iter().enumerate() {
            self.eliminate(point, inverse, &mut matrix, &mut rhs);
        }
        if n > 0 && !solve_cholesky(&mut matrix, &mut rhs) {
            return None;
        }
        let by_pose: Vec<Vector6<f64>> = rhs.chunks_exact(6).map(Vector6::from_column_slice).collect();
        let step = |(point, inverse): (usize, &Matrix3<f64>)| {
            let mut rhs = self.point_rhs[point];
            for (pose, coupling) in &self.couplings[self.coupled[point].clone()] {
                rhs -= coupling.tr_mul(&by_pose[*pose]);
            }
            inverse * rhs
        };
        let by_point = inverses.iter().enumerate().map(step).collect();
        Some((by_pose, by_point))
    }

    fn damped_inverses(&self, damping: f64) -> Option<Vec<Matrix3<f64>>> {
        let inverse = |block: &Matrix3<f64>| {
            let mut block = *block;
            for k in 0..3 {
                block[(k, k)] += damping * block[(k, k)] + POINT_FLOOR_PER_M2;
            }
            block.try_inverse()
        };
        self.point_blocks.iter().map(inverse).collect()
    }

    /// Takes one point's part out of the lower half of the reduced system.
    fn eliminate(&self, point: usize, inverse: &Matrix3<f64>, matrix: &mut [f64], rhs: &mut [f64]) {
        let n = rhs.len();
        let couplings = &self.couplings[self.coupled[point].clone()];
        for (a, w_a) in couplings {
            let carried = w_a * inverse;
            let carried_rhs = carried * self.point_rhs[point];
            for i in 0..6 {
                rhs[6 * a + i] -= carried_rhs[i];
            }
            for (b, w_b) in couplings.iter().filter(|(b, _)| b <= a) {
                let block = carried * w_b.transpose();
                for i in 0..6 {
                    let row = &mut matrix[(6 * a + i) * n + 6 * b..][..6];
                    for (j, value) in row.iter_mut().enumerate() {
                        *value -= block[(i, j)];
                    }
                }
            }
        }
    }

    /// The whole damped system, poses first, for the test that elimination changes nothing.
    #[cfg(test)]
    pub(crate) fn dense(&self, damping: f64) -> (Vec<f64>, Vec<f64>) {
        let poses = 6 * self.pose_blocks.len();
        let n = poses + 3 * self.point_blocks.len();
        let (mut matrix, mut rhs) = (vec![0.0; n * n], vec![0.0; n]);
        for (pose, block) in self.pose_blocks.iter().enumerate() {
            for i in 0..6 {
                rhs[6 * pose + i] = self.pose_rhs[pose][i];
                for j in 0..6 {
                    matrix[(6 * pose + i) * n + 6 * pose + j] = block[(i, j)];
                }
                matrix[(6 * pose + i) * (n + 1)] += damping * block[(i, i)] + POSE_FLOOR;
            }
        }
        for (point, block) in self.point_blocks.iter().enumerate() {
            for i in 0..3 {
                let row = poses + 3 * point + i;
                rhs[row] = self.point_rhs[point][i];
                for j in 0..3 {
                    matrix[row * n + poses + 3 * point + j] = block[(i, j)];
                }
                matrix[row * (n + 1)] += damping * block[(i, i)] + POINT_FLOOR_PER_M2;
            }
            for (pose, coupling) in &self.couplings[self.coupled[point].clone()] {
                for i in 0..6 {
                    for j in 0..3 {
                        let (row, column) = (poses + 3 * point + j, 6 * pose + i);
                        matrix[row * n + column] = coupling[(i, j)];
                        matrix[column * n + row] = coupling[(i, j)];
                    }
                }
            }
        }
        (matrix, rhs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::lens::{Intrinsics, Lens, Mapping, Radtan};
    use crate::tracker::rig::CameraCalibration;
    use crate::tracker::rig::RigCamera;
    use crate::units::CameraIndex;
    use crate::units::Size;
    use glam::DVec2;

    fn rig() -> Vec<RigCamera> {
        let lens = Lens {
            intrinsics: Intrinsics { fx_px: 320.0, fy_px: 321.0, cx_px: 320.0, cy_px: 240.0 },
            mapping: Mapping::Radtan(Radtan { k1: -0.03, k2: 0.004, p1: 0.001, p2: -0.001, k3: 0.0 }),
        };
        let size = Size { width_px: 640, height_px: 480 };
        let camera = |x_m: f64| {
            let twist = Twist { linear_m: DVec3::new(x_m, 0.01, 0.0), angular_rad: DVec3::new(0.01, x_m, -0.02) };
            RigCamera::new(CameraCalibration { lens, size, body_from_camera: se3_exp(twist) })
        };
        vec![camera(-0.03), camera(0.04)]
    }

    /// Two free poses, one held, 30 points, and exact positions.
    fn problem(cameras: &[RigCamera]) -> Problem<'_> {
        let number = |n: u32, k: u32| f64::from((n * 7_919 + k * 104_729) % 1_000) / 500.0 - 1.0;
        let points_m: Vec<DVec3> =
            (0..30).map(|n| DVec3::new(number(n, 1), number(n, 2) * 0.7, 2.5 + number(n, 3))).collect();
        let pose = |x_m: f64| {
            let twist = Twist { linear_m: DVec3::new(x_m, 0.0, -x_m), angular_rad: DVec3::new(0.0, x_m, 0.1 * x_m) };
            se3_exp(twist)
        };
        let poses = vec![pose(0.2), pose(-0.25), pose(0.0)];
        let mut observations = Vec::new();
        for (point, point_m) in points_m.iter().enumerate() {
            for (pose, body_from_world) in poses.iter().enumerate() {
                for (camera, rig) in cameras.iter().enumerate() {
                    let Some((position_px, _)) = rig.project_with_jacobian(body_from_world.point(*point_m)) else {
                        continue;
                    };
                    let [pose, point, camera] = [pose, point, camera].map(crate::num::u32_from);
                    let camera = CameraIndex(camera);
                    let (inverse_sigma, row_from_frame) = (2.0, Pose::IDENTITY);
                    observations.push(Observation { pose, point, camera, position_px, inverse_sigma, row_from_frame });
                }
            }
        }
        assert!(observations.len() > 120, "most points must be seen: {}", observations.len());
        Problem { cameras, poses, free: 2, points_m, observations }
    }

    fn disturb(problem: &mut Problem<'_>) {
        for (n, point_m) in problem.points_m.iter_mut().enumerate() {
            *point_m += DVec3::new(0.01, -0.02, 0.03) * f64::from(crate::num::u32_from(n % 3));
        }
        for pose in &mut problem.poses[..2] {
            *pose = se3_exp(Twist::from_array([0.01, -0.02, 0.01, 0.01, -0.01, 0.02])).then(pose);
        }
    }

    #[test]
    fn exact_positions_bring_disturbed_poses_and_points_back_and_the_gauge_stays() {
        let cameras = rig();
        let truth = problem(&cameras);
        let mut disturbed = truth.clone();
        disturb(&mut disturbed);
        let outcome = disturbed.solve(30);
        assert!(outcome.cost_after < 1e-8 && outcome.cost_before > 100.0, "{outcome:?}");
        assert_eq!(disturbed.poses[2], truth.poses[2]);
        for (found, truth) in disturbed.points_m.iter().zip(&truth.points_m) {
            // A cost of 1e-8 is 5e-5 px; depth at 3.5 m costs 3.5^2 / (320 * 0.07) = 0.5 m a pixel.
            assert!((*found - *truth).length() < 1e-4, "{found} for {truth}");
        }
    }

    #[test]
    fn the_schur_complement_gives_the_step_of_the_whole_dense_system() {
        let cameras = rig();
        let mut problem = problem(&cameras);
        disturb(&mut problem);
        let normal = problem.linearise();
        for damping in [0.0, 1e-4, 1.0] {
            let (by_pose, by_point) = normal.step(damping).unwrap();
            let (mut matrix, mut rhs) = normal.dense(damping);
            assert!(solve_cholesky(&mut matrix, &mut rhs));
            let steps = by_pose.iter().flat_map(|s| s.iter()).chain(by_point.iter().flat_map(|s| s.iter()));
            let mut compared = 0;
            for (step, dense) in steps.zip(&rhs) {
                // 2^-53 times a condition of 1e7 (depth against lateral, held by a 7 cm baseline) times steps below 1.
                assert!((step - dense).abs() < 1e-8, "damping {damping}: {step} against {dense}");
                compared += 1;
            }
            assert_eq!(compared, 12 + 90);
        }
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let cameras = rig();
        let point_m = DVec3::new(0.4, -0.3, 1.7);
        let h = 1e-5;
        for camera in &cameras {
            let row_from_frame = se3_exp(Twist::from_array([0.01, 0.02, -0.01, 0.05, -0.02, 0.03]));
            let linear = linearise(camera, point_m, &row_from_frame, (DVec2::ZERO, 1.0)).unwrap();
            let (by_pose, by_point) = (linear.by_pose, linear.by_body);
            let project = |point_m: DVec3| camera.project_with_jacobian(row_from_frame.point(point_m)).unwrap().0;
            for k in 0..6 {
                let mut twist = [0.0; 6];
                twist[k] = h;
                let ahead = se3_exp(Twist::from_array(twist)).point(point_m);
                twist[k] = -h;
                let behind = se3_exp(Twist::from_array(twist)).point(point_m);
                let slope = (project(ahead) - project(behind)) / (2.0 * h);
                for axis in 0..2 {
                    // Third derivatives below 1e3 px/m^3 times h^2 / 6, and rounding of 600 px * 2^-53 / h: 1e-8.
                    assert!((slope[axis] - by_pose[axis][k]).abs() < 1e-6, "axis {axis}, twist {k}");
                    if k < 3 {
                        assert!((slope[axis] - by_point[axis][k]).abs() < 1e-6, "axis {axis}, point {k}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_window_without_observations_stays_as_it_is() {
        let cameras = rig();
        let mut problem = Problem { observations: Vec::new(), ..problem(&cameras) };
        let poses = problem.poses.clone();
        let outcome = problem.solve(5);
        assert_eq!((outcome.cost_before, outcome.cost_after), (0.0, 0.0));
        assert_eq!(problem.poses, poses);
    }
}
