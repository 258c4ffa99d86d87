//! Least-squares alignment of two point sets (Umeyama 1991). Finds the similarity that maps the second set of positions
//! in metres onto the first, or the reason why none is determined. Symbols are those of the paper.

use glam::DVec3;

use super::measurable::NotMeasurable;
use crate::num::{f64_from_usize, greater};

/// A 3 x 3 matrix, by rows.
type Rows = [[f64; 3]; 3];

/// `p_truth = scale * rotation * p_estimate + translation_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Proper rotation matrix, by rows.
    pub rotation: [[f64; 3]; 3],
    /// Metres.
    pub translation_m: DVec3,
    /// 1 where scale was not estimated.
    pub scale: f64,
}

impl Similarity {
    /// Maps every point to itself.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation_m: DVec3::ZERO, scale: 1.0 };

    /// The image of a point, in metres.
    pub fn point(&self, point_m: DVec3) -> DVec3 {
        self.direction(point_m * self.scale) + self.translation_m
    }

    /// The image of a direction; its length is kept.
    pub fn direction(&self, v: DVec3) -> DVec3 {
        let [a, b, c] = self.rotation.map(|row| row[0] * v.x + row[1] * v.y + row[2] * v.z);
        DVec3::new(a, b, c)
    }
}

/// Whether the alignment may change size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlignmentScale {
    /// Rotation and translation only: stereo, or anything else that knows its metres.
    Kept,
    /// One factor for all: a single camera without an IMU.
    Estimated,
}

/// The similarity that brings `estimate_m` nearest to `truth_m` in the least-squares sense. Fails on fewer than three pairs, or a
/// covariance of rank below two (all positions equal or on one line), where the rotation is not determined. The test is that of evo, a
/// singular value above the absolute `f64::EPSILON` (square metres), and above what the covariance's own roundings leave of a line: n + 4
/// half-ulps of each of nine entries, of which none exceeds the product of the spreads.
pub fn umeyama(truth_m: &[DVec3], estimate_m: &[DVec3], scale: AlignmentScale) -> Result<Similarity, NotMeasurable> {
    assert!(truth_m.len() == estimate_m.len(), "positions come in pairs");
    if truth_m.len() < 3 {
        return Err(NotMeasurable::TooFewPoses { associated: truth_m.len(), needed: 3 });
    }
    let (mean_y, mean_x) = (mean(truth_m), mean(estimate_m));
    let svd = Svd::of(covariance(truth_m, mean_y, estimate_m, mean_x));
    let spreads2_m4 = mean_square_distance(truth_m, mean_y) * mean_square_distance(estimate_m, mean_x);
    let rounding_m2 = 1.5 * f64::EPSILON * (f64_from_usize(truth_m.len()) + 4.0) * spreads2_m4.sqrt();
    if svd.values.iter().filter(|value| **value > greater(f64::EPSILON, rounding_m2)).count() < 2 {
        return Err(NotMeasurable::Degenerate);
    }
    let sign = if determinant(&svd.u) * determinant(&svd.v) < 0.0 { -1.0 } else { 1.0 };
    let rotation = times_transposed(&svd.u, [1.0, 1.0, sign], &svd.v);
    let factor = match scale {
        AlignmentScale::Kept => 1.0,
        AlignmentScale::Estimated => {
            (svd.values[0] + svd.values[1] + sign * svd.values[2]) / mean_square_distance(estimate_m, mean_x)
        }
    };
    let turned = Similarity { rotation, translation_m: DVec3::ZERO, scale: factor };
    Ok(Similarity { translation_m: mean_y - turned.point(mean_x), ..turned })
}

/// Mean position. The slice must not be empty.
pub(super) fn mean(points_m: &[DVec3]) -> DVec3 {
    points_m.iter().fold(DVec3::ZERO, |sum, &point| sum + point) / f64_from_usize(points_m.len())
}

fn mean_square_distance(points_m: &[DVec3], mean_m: DVec3) -> f64 {
    let sum = points_m.iter().fold(0.0, |sum, &point| sum + (point - mean_m).length_squared());
    sum / f64_from_usize(points_m.len())
}

/// Equation 38: the mean of (y - mean y)(x - mean x)^T.
fn covariance(y: &[DVec3], mean_y: DVec3, x: &[DVec3], mean_x: DVec3) -> Rows {
    let mut sum: Rows = [[0.0; 3]; 3];
    for (&y, &x) in y.iter().zip(x) {
        let (dy, dx) = ((y - mean_y).to_array(), (x - mean_x).to_array());
        for (row, dy) in sum.iter_mut().zip(dy) {
            for (cell, dx) in row.iter_mut().zip(dx) {
                *cell += dy * dx;
            }
        }
    }
    sum.map(|row| row.map(|cell| cell / f64_from_usize(y.len())))
}

/// `A = U diag(values) V^T`, values falling. The columns of U and V are stored as rows here, one vector each.
struct Svd {
    u: [DVec3; 3],
    values: [f64; 3],
    v: [DVec3; 3],
}

/// Sweeps of Jacobi rotations at most; 3 x 3 matrices need four or five.
const SWEEPS_MAX: usize = 40;

impl Svd {
    /// One-sided Jacobi (Hestenes): rotates pairs of columns until all are orthogonal. It keeps small singular values
    /// to full relative accuracy, which nalgebra's closed form for 3 x 3 (eigenvalues of A^T A) does not, and planar
    /// motion needs it.
    fn of(a: Rows) -> Self {
        let mut columns = [0, 1, 2].map(|k| DVec3::new(a[0][k], a[1][k], a[2][k]));
        let mut v = [DVec3::X, DVec3::Y, DVec3::Z];
        for _ in 0..SWEEPS_MAX {
            let mut turned = false;
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                turned |= orthogonalise(&mut columns, &mut v, p, q);
            }
            if !turned {
                break;
            }
        }
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| columns[b].length_squared().total_cmp(&columns[a].length_squared()));
        let columns = order.map(|k| columns[k]);
        Self { u: orthonormal(columns), values: columns.map(DVec3::length), v: order.map(|k| v[k]) }
    }
}

/// Rotates columns p and q of A and V in their plane so that those of A become orthogonal. False where they already
/// are.
fn orthogonalise(columns: &mut [DVec3; 3], v: &mut [DVec3; 3], p: usize, q: usize) -> bool {
    let (alpha, beta) = (columns[p].length_squared(), columns[q].length_squared());
    let gamma = columns[p].dot(columns[q]);
    if gamma.abs() <= f64::EPSILON * (alpha * beta).sqrt() {
        return false;
    }
    let zeta = (beta - alpha) / (2.0 * gamma);
    let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = cosine * tangent;
    for basis in [columns, v] {
        let (x, y) = (basis[p], basis[q]);
        basis[p] = x * cosine - y * sine;
        basis[q] = x * sine + y * cosine;
    }
    true
}

/// Unit vectors along orthogonal columns of falling length. Where a column vanishes, the right-handed completion stands
/// for it.
fn orthonormal(columns: [DVec3; 3]) -> [DVec3; 3] {
    // A column that vanishes beside the first holds rounding only, so its direction says nothing.
    let least = columns[0].length() * f64::EPSILON;
    let first = if least > 0.0 { columns[0].normalize() } else { DVec3::X };
    let second =
        if columns[1].length() > least { columns[1].normalize() } else { first.any_orthonormal_vector().normalize() };
    let third = if columns[2].length() > least { columns[2].normalize() } else { first.cross(second) };
    [first, second, third]
}

fn determinant(vectors: &[DVec3; 3]) -> f64 {
    vectors[0].dot(vectors[1].cross(vectors[2]))
}

/// `U diag(s) V^T` by rows, from the columns of U and V.
fn times_transposed(u: &[DVec3; 3], s: [f64; 3], v: &[DVec3; 3]) -> Rows {
    let outer = |u: f64, v: DVec3| v * u;
    let row = |axis: usize| {
        let cells = outer(u[0][axis] * s[0], v[0]) + outer(u[1][axis] * s[1], v[1]) + outer(u[2][axis] * s[2], v[2]);
        cells.to_array()
    };
    [row(0), row(1), row(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn cloud() -> Vec<DVec3> {
        (0..20_i32)
            .map(f64::from)
            .map(|i| DVec3::new(libm::sin(i), libm::cos(1.7 * i), 0.3 * libm::sin(0.4 * i)))
            .collect()
    }

    fn distance_max_m(a: &[DVec3], b: &[DVec3], map: &Similarity) -> f64 {
        a.iter().zip(b).fold(0.0, |worst, (&a, &b)| f64::max(worst, (a - map.point(b)).length()))
    }

    #[test]
    fn a_moved_turned_and_scaled_cloud_is_brought_back() {
        let truth = cloud();
        let turn = DQuat::from_xyzw(0.3, -0.5, 0.1, 0.8).normalize();
        let estimate: Vec<_> = truth.iter().map(|&p| turn * (p * 0.5) + DVec3::new(3.0, -7.0, 2.0)).collect();
        let map = umeyama(&truth, &estimate, AlignmentScale::Estimated).unwrap();
        // Numbers of size ten through some thirty operations: 30 * 10 * 2^-53 is 3.3e-14.
        assert!(distance_max_m(&truth, &estimate, &map) < 1e-13);
        assert!((map.scale - 2.0).abs() < 1e-14, "{}", map.scale);
    }

    #[test]
    fn a_mirrored_cloud_is_turned_but_never_mirrored() {
        let truth = cloud();
        let estimate: Vec<_> = truth.iter().map(|&p| DVec3::new(-p.x, p.y, p.z)).collect();
        let map = umeyama(&truth, &estimate, AlignmentScale::Kept).unwrap();
        let [a, b, c] = map.rotation.map(DVec3::from_array);
        assert!((a.dot(b.cross(c)) - 1.0).abs() < 1e-14);
        assert!(distance_max_m(&truth, &estimate, &map) > 0.1, "no rotation undoes a mirror");
    }

    #[test]
    fn motion_in_a_plane_is_aligned_exactly() {
        let truth: Vec<_> = cloud().iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect();
        let turn = DQuat::from_xyzw(0.9, 0.2, -0.4, 0.3).normalize();
        let estimate: Vec<_> = truth.iter().map(|&p| turn * p).collect();
        let map = umeyama(&truth, &estimate, AlignmentScale::Kept).unwrap();
        assert!(distance_max_m(&truth, &estimate, &map) < 1e-14);
    }

    #[test]
    fn a_point_and_a_line_are_refused_by_name() {
        let still = [DVec3::new(0.25, 0.5, 1.0); 9];
        let line: Vec<_> = (0..9_i32).map(|i| DVec3::X * f64::from(i)).collect();
        for (truth, estimate) in [(&still[..], &still[..]), (&line[..], &line[..]), (&still[..], &line[..])] {
            assert_eq!(umeyama(truth, estimate, AlignmentScale::Kept), Err(NotMeasurable::Degenerate));
        }
        let few = umeyama(&still[..2], &still[..2], AlignmentScale::Kept);
        assert_eq!(few, Err(NotMeasurable::TooFewPoses { associated: 2, needed: 3 }));
    }
}
