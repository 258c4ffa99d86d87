//! Solves symmetric positive definite systems of bandwidth three, the normal equations of a cubic B-spline, in time proportional to the
//! size.

use glam::DVec3;

/// Entries beside the diagonal.
const REACH: usize = 3;

/// The lower triangle by rows: `[j]` of row i is the entry at column `i - j`.
#[derive(Clone, Debug)]
pub struct NormalEquations {
    rows: Vec<[f64; REACH + 1]>,
}

/// The Cholesky factor L of the equations, `A = L L^T`.
#[derive(Clone, Debug)]
pub struct CholeskyFactor {
    rows: Vec<[f64; REACH + 1]>,
}

impl NormalEquations {
    /// No equations yet, in this many unknowns.
    pub fn new(unknowns: usize) -> Self {
        Self { rows: vec![[0.0; REACH + 1]; unknowns] }
    }

    /// Adds `weight * w w^T` for a row w of four weights that starts at unknown `first`.
    pub fn add(&mut self, first: usize, weights: &[f64; REACH + 1], weight: f64) {
        for (i, wi) in weights.iter().enumerate() {
            for (j, wj) in weights.iter().enumerate().take(i + 1) {
                if first + i < self.rows.len() {
                    self.rows[first + i][i - j] += weight * wi * wj;
                }
            }
        }
    }

    /// The factor, or None where the equations leave an unknown undetermined.
    pub fn factor(mut self) -> Option<CholeskyFactor> {
        for i in 0..self.rows.len() {
            for back in (0..=REACH.min(i)).rev() {
                let column = i - back;
                let mut sum = self.rows[i][back];
                for k in column.saturating_sub(REACH).max(i.saturating_sub(REACH))..column {
                    sum -= self.rows[i][i - k] * self.rows[column][column - k];
                }
                self.rows[i][back] = if back > 0 {
                    sum / self.rows[column][0]
                } else if sum > 0.0 {
                    sum.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(CholeskyFactor { rows: self.rows })
    }
}

impl CholeskyFactor {
    /// Solves `A x = right` for three right sides at once, in place.
    pub fn solve(&self, right: &mut [DVec3]) {
        assert!(right.len() == self.rows.len(), "one right side an unknown");
        let count = right.len();
        for i in 0..count {
            let mut sum = right[i];
            for back in 1..=REACH.min(i) {
                sum -= right[i - back] * self.rows[i][back];
            }
            right[i] = sum / self.rows[i][0];
        }
        for i in (0..count).rev() {
            let mut sum = right[i];
            for ahead in 1..=REACH.min(count - 1 - i) {
                sum -= right[i + ahead] * self.rows[i + ahead][ahead];
            }
            right[i] = sum / self.rows[i][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solved_system_gives_its_right_side_back() {
        let count = 12;
        let mut equations = NormalEquations::new(count);
        let mut dense = vec![vec![0.0; count]; count];
        for first in 0..count - REACH {
            let weights = [0.2 + 0.01 * f64::from(u32::try_from(first).unwrap()), 0.6, 0.3, -0.1];
            for weight in [1.0, 0.5] {
                equations.add(first, &weights, weight);
                for i in 0..=REACH {
                    for j in 0..=REACH {
                        dense[first + i][first + j] += weight * weights[i] * weights[j];
                    }
                }
            }
        }
        for (i, row) in dense.iter_mut().enumerate() {
            equations.add(i, &[0.3, 0.0, 0.0, 0.0], 1.0);
            row[i] += 0.09;
        }
        let right: Vec<DVec3> =
            (0..12_u32).map(|i| DVec3::new(f64::from(i), 1.0, -0.5 * f64::from(i * i % 7))).collect();
        let mut solution = right.clone();
        equations.factor().unwrap().solve(&mut solution);
        for (i, row) in dense.iter().enumerate() {
            let product: DVec3 = row.iter().zip(&solution).map(|(a, x)| *x * *a).fold(DVec3::ZERO, |a, b| a + b);
            // A dozen sums of values below 100: 1e-13 each way.
            assert!((product - right[i]).length() < 1e-11, "row {i}: {product} {}", right[i]);
        }
    }

    #[test]
    fn undetermined_unknowns_are_noticed() {
        let mut equations = NormalEquations::new(5);
        equations.add(0, &[0.2, 0.6, 0.2, 0.0], 1.0);
        assert!(equations.factor().is_none());
    }
}
