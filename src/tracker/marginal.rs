//! Marginalisation: turns poses and landmarks that leave a window into a prior on the remaining poses, in sigmas by metres and radians.
//!
//! Observations of leaving landmarks are linearised once; landmarks, then poses, are eliminated by the Schur
//! complement, and its square root is kept. Directions that nothing measured (the gauge above all) are found by
//! pivoting and left free. Derivatives of a pose in a prior are taken at its first estimate for good (first-estimates
//! Jacobians, Huang, Mourikis and Roumeliotis 2010): were they taken anew, the sum of factors would measure the gauge,
//! and the filter would be too sure of itself.

use std::collections::BTreeMap;

use glam::DMat3;
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3, Vector6};

pub use super::problem::Prior;
use super::problem::Problem;
use crate::num::index;
use crate::pose::Pose;
use crate::tracker::covariance::{RANK_TOLERANCE, Rows, generalised_inverse};
use crate::tracker::lie::se3_log;
use crate::tracker::refine::{huber, linearise};

/// Information over the poses of a problem, dense.
struct Dense {
    n: usize,
    matrix: Vec<f64>,
    side: Vec<f64>,
    /// Information on each unknown if all others were known, the landmarks too: what rounding is relative to.
    scale: Vec<f64>,
}

/// The prior that free poses and points leave behind. All observations of leaving points are used up: the caller drops
/// those points from the problem, and the leaving poses with all their other observations (which are lost, never
/// counted twice). An earlier prior is used up too. `None` where nothing is left to say.
pub fn marginalise(
    problem: &Problem<'_>,
    (pose_leaves, point_leaves): (&[bool], &[bool]),
    earlier: Option<&Prior>,
) -> Option<Prior> {
    assert!(pose_leaves.len() == problem.free, "each free pose leaves or stays");
    assert!(point_leaves.len() == problem.points_m.len(), "each point leaves or stays");
    let mut dense = Dense::new(6 * problem.free);
    let mut at = problem.poses.clone();
    if let Some(prior) = earlier {
        prior.poses.iter().for_each(|&(pose, first)| at[index(pose)] = first);
        dense.add_prior(prior);
    }
    dense.add_points(problem, &at, point_leaves);
    let leaving: Vec<bool> = (0..dense.n).map(|k| pose_leaves[k / 6]).collect();
    while let Some(pivot) = dense.pivot(&leaving) {
        dense.take_out(pivot);
    }
    let staying: Vec<bool> = leaving.iter().map(|leaves| !leaves).collect();
    let (root, side) = dense.root(&staying);
    // Poses that no row touches stay out.
    let touched = |pose: usize| root.iter().any(|row| row[6 * pose..6 * pose + 6].iter().any(|&x| x != 0.0));
    let kept: Vec<usize> = (0..problem.free).filter(|&pose| !pose_leaves[pose] && touched(pose)).collect();
    let narrow = |row: Vec<f64>| kept.iter().flat_map(|&pose| row[6 * pose..6 * pose + 6].to_vec()).collect();
    let root: Vec<Vec<f64>> = root.into_iter().map(narrow).collect();
    let poses: Vec<(u32, Pose)> = kept.iter().map(|&pose| (crate::num::u32_from(pose), at[pose])).collect();
    (!poses.is_empty()).then_some(Prior { poses, root, side })
}

impl Prior {
    /// From information over six unknowns a pose and others behind them, which are taken out (row-major, with its right side).
    pub fn of_information(poses: Vec<(u32, Pose)>, kept: usize, (matrix, side): (Vec<f64>, Vec<f64>)) -> Option<Self> {
        let n = side.len();
        let scale = (0..n).map(|k| matrix[k * (n + 1)]).collect();
        let mut dense = Dense { n, matrix, side, scale };
        let others: Vec<bool> = (0..n).map(|k| k >= kept).collect();
        while let Some(pivot) = dense.pivot(&others) {
            dense.take_out(pivot);
        }
        let (root, side) = dense.root(&others.iter().map(|other| !other).collect::<Vec<bool>>());
        let narrow = |row: Vec<f64>| {
            poses.iter().flat_map(|(pose, _)| row[6 * index(*pose)..6 * index(*pose) + 6].to_vec()).collect()
        };
        let root: Vec<Vec<f64>> = root.into_iter().map(narrow).collect();
        (!root.is_empty()).then_some(Self { poses, root, side })
    }

    /// Number of directions that the prior measures.
    pub fn rank(&self) -> usize {
        self.root.len()
    }

    /// The pose at which derivatives are taken, where the prior has the pose.
    pub fn first_estimate(&self, pose: u32) -> Option<Pose> {
        self.poses.iter().find(|(own, _)| *own == pose).map(|(_, first)| *first)
    }

    /// The same prior where the problem's poses have other numbers. The order may not change, and no pose may be missing.
    #[must_use]
    pub fn renumbered(mut self, number: impl Fn(u32) -> u32) -> Self {
        self.poses.iter_mut().for_each(|(pose, _)| *pose = number(*pose));
        assert!(self.poses.is_sorted_by_key(|(pose, _)| *pose), "a prior's poses keep their order");
        self
    }

    /// Errors of all rows in sigmas at the poses as they are.
    fn errors(&self, poses: &[Pose]) -> Vec<f64> {
        let moved: Vec<f64> = self
            .poses
            .iter()
            .flat_map(|(pose, first)| se3_log(&poses[index(*pose)].then(&first.inverse())).to_array())
            .collect();
        let error = |(row, side): (&Vec<f64>, &f64)| side - row.iter().zip(&moved).map(|(a, b)| a * b).sum::<f64>();
        self.root.iter().zip(&self.side).map(error).collect()
    }

    /// Sum of squared errors, in sigmas, to be added to a problem's cost.
    pub fn cost(&self, poses: &[Pose]) -> f64 {
        self.errors(poses).iter().map(|error| error * error).sum()
    }

    /// Adds information and right side to the normal equations of the first `side.len() / 6` poses (row-major, lower
    /// half at least).
    pub fn add_to(&self, poses: &[Pose], matrix: &mut [f64], side: &mut [f64]) {
        let n = side.len();
        let places: Vec<usize> =
            self.poses.iter().flat_map(|(pose, _)| (0..6).map(move |k| 6 * index(*pose) + k)).collect();
        assert!(places.iter().all(|&place| place < n), "a prior speaks of free poses only");
        for (row, error) in self.root.iter().zip(self.errors(poses)) {
            for (&a, &x) in places.iter().zip(row) {
                side[a] += x * error;
                for (&b, &y) in places.iter().zip(row) {
                    matrix[a * n + b] += x * y;
                }
            }
        }
    }
}

impl Dense {
    fn new(n: usize) -> Self {
        Self { n, matrix: vec![0.0; n * n], side: vec![0.0; n], scale: vec![0.0; n] }
    }

    fn add_prior(&mut self, prior: &Prior) {
        // In terms of the twist from the first estimates, an earlier prior is its rows as they are.
        let places: Vec<usize> =
            prior.poses.iter().flat_map(|(pose, _)| (0..6).map(move |k| 6 * index(*pose) + k)).collect();
        for (row, side) in prior.root.iter().zip(&prior.side) {
            for (&a, &x) in places.iter().zip(row) {
                self.side[a] += x * side;
                self.scale[a] += x * x;
                for (&b, &y) in places.iter().zip(row) {
                    self.matrix[a * self.n + b] += x * y;
                }
            }
        }
    }

    /// Adds the leaving points' observations, the points themselves eliminated.
    fn add_points(&mut self, problem: &Problem<'_>, at: &[Pose], leaves: &[bool]) {
        let mut of_point: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (number, o) in problem.observations.iter().enumerate().filter(|(_, o)| leaves[index(o.point)]) {
            of_point.entry(o.point).or_default().push(number);
        }
        for numbers in of_point.values() {
            let (mut own, mut own_side) = (Matrix3::zeros(), Vector3::zeros());
            let mut couplings: BTreeMap<usize, SMatrix<f64, 6, 3>> = BTreeMap::new();
            for &number in numbers {
                let Some((pose, rows, error)) = linearised(problem, at, number) else { continue };
                own += rows.by_point.tr_mul(&rows.by_point);
                own_side += rows.by_point.tr_mul(&error);
                if pose < problem.free {
                    let block = rows.by_pose.tr_mul(&rows.by_pose);
                    self.add(pose, pose, &block);
                    (0..6).for_each(|k| self.scale[6 * pose + k] += block[(k, k)]);
                    self.add_side(pose, &rows.by_pose.tr_mul(&error));
                    *couplings.entry(pose).or_insert_with(SMatrix::zeros) += rows.by_pose.tr_mul(&rows.by_point);
                }
            }
            let (inverse, _) = generalised_inverse(&own);
            for (&a, w_a) in &couplings {
                self.add_side(a, &-(w_a * (inverse * own_side)));
                for (&b, w_b) in &couplings {
                    self.add(a, b, &-(w_a * inverse * w_b.transpose()));
                }
            }
        }
    }

    fn add(&mut self, a: usize, b: usize, block: &SMatrix<f64, 6, 6>) {
        for i in 0..6 {
            for j in 0..6 {
                self.matrix[(6 * a + i) * self.n + 6 * b + j] += block[(i, j)];
            }
        }
    }

    fn add_side(&mut self, pose: usize, side: &Vector6<f64>) {
        (0..6).for_each(|i| self.side[6 * pose + i] += side[i]);
    }

    /// Rows over some unknowns whose squares sum to what is left of the information, with what each should give.
    fn root(&mut self, among: &[bool]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let (mut root, mut side) = (Vec::new(), Vec::new());
        while let Some(pivot) = self.pivot(among) {
            let (row, right) = self.take_out(pivot);
            root.push(row);
            side.push(right);
        }
        (root, side)
    }

    /// The unknown with the greatest share of its information left; `None` where all are below the tolerance.
    fn pivot(&self, among: &[bool]) -> Option<usize> {
        let share = |k: usize| if self.scale[k] > 0.0 { self.matrix[k * (self.n + 1)] / self.scale[k] } else { 0.0 };
        let candidates = (0..self.n).filter(|&k| among[k] && share(k) > RANK_TOLERANCE);
        candidates.reduce(|best, next| if share(next) > share(best) { next } else { best })
    }

    /// Eliminates an unknown; gives its row of the square root, and what the row should give.
    fn take_out(&mut self, pivot: usize) -> (Vec<f64>, f64) {
        let n = self.n;
        let root = self.matrix[pivot * (n + 1)].sqrt();
        let row: Vec<f64> = self.matrix[pivot * n..(pivot + 1) * n].iter().map(|x| x / root).collect();
        let right = self.side[pivot] / root;
        for i in 0..n {
            self.side[i] -= row[i] * right;
            for j in 0..n {
                self.matrix[i * n + j] -= row[i] * row[j];
            }
        }
        // What is left of it is rounding, which must not be taken for information.
        for k in 0..n {
            (self.matrix[pivot * n + k], self.matrix[k * n + pivot]) = (0.0, 0.0);
        }
        self.side[pivot] = 0.0;
        (row, right)
    }
}

/// Derivatives of an observation at the first estimates, and its error as seen from there, both by the square root of
/// Huber's weight.
fn linearised(problem: &Problem<'_>, at: &[Pose], number: usize) -> Option<(usize, Rows, Vector2<f64>)> {
    let o = &problem.observations[number];
    let (pose, point_m) = (index(o.pose), problem.points_m[index(o.point)]);
    let (camera, now) = (&problem.cameras[index(o.camera.0)], &problem.poses[pose]);
    let error = linearise(camera, now.point(point_m), &o.row_from_frame, (o.place_px, o.inverse_sigma))?.error;
    let mut rows = Rows::of(camera, &at[pose], (at[pose].point(point_m), &o.row_from_frame), o.inverse_sigma)?;
    let root = huber(error.length_squared()).1.sqrt();
    rows.by_pose *= root;
    rows.by_point *= root;
    // The unknown is the twist from the first estimate, of which a part is already gone.
    let gone = Vector6::from(se3_log(&now.then(&at[pose].inverse())).to_array());
    let error = Vector2::new(error.x, error.y) * root + rows.by_pose * gone;
    Some((pose, rows, error))
}

/// The gauge at a set of poses: six directions (three shifts and three turns of the world), each over six unknowns a
/// pose, along which no picture changes.
pub fn gauge(poses: &[Pose]) -> Vec<Vec<f64>> {
    let direction = |k: usize| {
        let by_pose = poses.iter().flat_map(move |pose| {
            // The world moves by exp(g): body_from_world exp(-g) = exp(-Ad g) body_from_world.
            let rotation = DMat3::from_quat(pose.rotation);
            let column = rotation.col(k % 3);
            let (linear, angular) =
                if k < 3 { (column, glam::DVec3::ZERO) } else { (pose.translation_m.cross(column), column) };
            [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z].map(|x| -x)
        });
        by_pose.collect()
    };
    (0..6).map(direction).collect()
}
