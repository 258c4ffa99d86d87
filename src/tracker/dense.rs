//! Cholesky for the small dense systems of the tracker: 6 unknowns for a pose, up to some hundred for a window.
//!
//! Plain loops in one fixed order, so that the bits do not depend on the target.

/// Solves `matrix * x = rhs` for a symmetric positive definite row-major matrix, of which the lower half is read. The
/// solution replaces `rhs`, the factor replaces the lower half. False, with both spoilt, where the matrix is not positive.
#[must_use]
pub fn solve_cholesky(matrix: &mut [f64], rhs: &mut [f64]) -> bool {
    let n = rhs.len();
    assert!(matrix.len() == n * n, "the matrix must be square and as large as its right side");
    for i in 0..n {
        let (above, row) = matrix.split_at_mut(i * n);
        for j in 0..i {
            let other = &above[j * n..j * n + j + 1];
            let sum = dot(&row[..j], &other[..j]);
            row[j] = (row[j] - sum) / other[j];
        }
        let pivot = row[i] - dot(&row[..i], &row[..i]);
        // What is left must stand clear of the rounding of what was there; NaN fails too.
        if !(pivot > 1e-14 * row[i].abs() && pivot.is_finite()) {
            return false;
        }
        row[i] = pivot.sqrt();
        rhs[i] = (rhs[i] - dot(&row[..i], &rhs[..i])) / row[i];
    }
    for i in (0..n).rev() {
        let mut sum = rhs[i];
        for k in i + 1..n {
            sum -= matrix[k * n + i] * rhs[k];
        }
        rhs[i] = sum / matrix[i * n + i];
    }
    true
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four running sums, so that the order is fixed and the additions need not wait for each other.
    let mut sums = [0.0; 4];
    let (a_fours, b_fours) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a_fours.remainder().iter().zip(b_fours.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_fours.zip(b_fours) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_solution_comes_back() {
        for n in [1, 3, 6, 17, 60] {
            // Lehmer's matrix, min(i, j) / max(i, j), is positive definite with condition below 4 n^2.
            let at = |i: usize, j: usize| {
                crate::num::f64_from_usize(i.min(j) + 1) / crate::num::f64_from_usize(i.max(j) + 1)
            };
            let truth: Vec<f64> = (0..n).map(|i| crate::num::f64_from_usize(i) - 2.5).collect();
            let mut matrix: Vec<f64> = (0..n * n).map(|k| at(k / n, k % n)).collect();
            let mut rhs: Vec<f64> = (0..n).map(|i| (0..n).map(|j| at(i, j) * truth[j]).sum()).collect();
            assert!(solve_cholesky(&mut matrix, &mut rhs));
            for (found, truth) in rhs.iter().zip(&truth) {
                // 2^-53 times condition 14,400 times n times |x| = 60: 6e-9.
                assert!((found - truth).abs() < 6e-9, "n {n}: {found} for {truth}");
            }
        }
    }

    #[test]
    fn singular_indefinite_and_undefined_matrices_are_refused() {
        for matrix in [[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 2.0, 1.0], [f64::NAN, 0.0, 0.0, 1.0]] {
            assert!(!solve_cholesky(&mut matrix.clone(), &mut [1.0, 1.0]), "{matrix:?}");
        }
    }
}
