//! Marginalisation: takes unknowns out of a linear problem and keeps what they leave as a prior on its poses, in sigmas by metres and
//! radians.
//!
//! Unknowns are eliminated by the Schur complement, and its square root is kept. Directions that nothing measured are found by pivoting and
//! left free. Derivatives of a pose in a prior are taken at its first estimate for good (first-estimates Jacobians, Huang, Mourikis and
//! Roumeliotis 2010): were they taken anew, the sum of factors would measure the gauge, and the filter would be too sure of itself.

use std::ops::Range;

pub use super::problem::Prior;
use crate::num::index;
use crate::pose::Pose;
use crate::tracker::lie::se3_log;

/// A direction that keeps less than this share of its information after the others are known counts as not measured: a
/// depth sigma of 1e5 times the lateral one is a point at infinity.
const RANK_TOLERANCE: f64 = 1e-10;

/// Information over the poses of a problem, dense.
struct Dense {
    n: usize,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
    /// Information on each unknown if all others were known: what rounding is relative to.
    scale: Vec<f64>,
}

impl Prior {
    /// From information over six unknowns a pose and others behind them, which are taken out (row-major, with its right-hand side).
    pub fn of_information(poses: Vec<(u32, Pose)>, kept: usize, (matrix, rhs): (Vec<f64>, Vec<f64>)) -> Option<Self> {
        let n = rhs.len();
        let scale = (0..n).map(|k| matrix[k * (n + 1)]).collect();
        let mut dense = Dense { n, matrix, rhs, scale };
        while let Some(pivot) = dense.pivot(kept..n) {
            dense.take_out(pivot);
        }
        // Rows whose squares sum to what is left of the information, with what each should give.
        let (mut root, mut rhs) = (Vec::new(), Vec::new());
        while let Some(pivot) = dense.pivot(0..kept) {
            let (row, row_rhs) = dense.take_out(pivot);
            root.push(poses.iter().flat_map(|(pose, _)| row[6 * index(*pose)..][..6].to_vec()).collect());
            rhs.push(row_rhs);
        }
        (!root.is_empty()).then_some(Self { poses, root, rhs })
    }

    /// The pose at which derivatives are taken, where the prior has the pose.
    pub fn first_estimate(&self, pose: u32) -> Option<Pose> {
        self.poses.iter().find(|(own, _)| *own == pose).map(|(_, first)| *first)
    }

    /// Errors of all rows in sigmas at the poses as they are.
    fn errors(&self, poses: &[Pose]) -> Vec<f64> {
        let moved: Vec<f64> = self
            .poses
            .iter()
            .flat_map(|(pose, first)| se3_log(&poses[index(*pose)].then(&first.inverse())).to_array())
            .collect();
        let error = |(row, rhs): (&Vec<f64>, &f64)| rhs - row.iter().zip(&moved).map(|(a, b)| a * b).sum::<f64>();
        self.root.iter().zip(&self.rhs).map(error).collect()
    }

    /// Sum of squared errors, in sigmas, to be added to a problem's cost.
    pub fn cost(&self, poses: &[Pose]) -> f64 {
        self.errors(poses).iter().map(|error| error * error).sum()
    }

    /// Adds information and right-hand side to the normal equations of the first `rhs.len() / 6` poses (row-major, lower
    /// half at least).
    pub fn add_to(&self, poses: &[Pose], matrix: &mut [f64], rhs: &mut [f64]) {
        let n = rhs.len();
        let indices: Vec<usize> =
            self.poses.iter().flat_map(|(pose, _)| (0..6).map(move |k| 6 * index(*pose) + k)).collect();
        assert!(indices.iter().all(|&at| at < n), "a prior speaks of free poses only");
        for (row, error) in self.root.iter().zip(self.errors(poses)) {
            for (&a, &x) in indices.iter().zip(row) {
                rhs[a] += x * error;
                for (&b, &y) in indices.iter().zip(row) {
                    matrix[a * n + b] += x * y;
                }
            }
        }
    }
}

impl Dense {
    /// Of some unknowns the one with the greatest share of its information left; `None` where all are below the tolerance.
    fn pivot(&self, among: Range<usize>) -> Option<usize> {
        let share = |k: usize| if self.scale[k] > 0.0 { self.matrix[k * (self.n + 1)] / self.scale[k] } else { 0.0 };
        let candidates = among.filter(|&k| share(k) > RANK_TOLERANCE);
        candidates.reduce(|best, next| if share(next) > share(best) { next } else { best })
    }

    /// Eliminates an unknown; gives its row of the square root, and what the row should give.
    fn take_out(&mut self, pivot: usize) -> (Vec<f64>, f64) {
        let n = self.n;
        let root = self.matrix[pivot * (n + 1)].sqrt();
        let row: Vec<f64> = self.matrix[pivot * n..(pivot + 1) * n].iter().map(|x| x / root).collect();
        let row_rhs = self.rhs[pivot] / root;
        for i in 0..n {
            self.rhs[i] -= row[i] * row_rhs;
            for j in 0..n {
                self.matrix[i * n + j] -= row[i] * row[j];
            }
        }
        // What is left of it is rounding, which must not be taken for information.
        for k in 0..n {
            (self.matrix[pivot * n + k], self.matrix[k * n + pivot]) = (0.0, 0.0);
        }
        self.rhs[pivot] = 0.0;
        (row, row_rhs)
    }
}
