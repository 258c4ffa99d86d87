//! Homography `second ~ H first` between unit bearings of two cameras, and its decomposition into motions.

use glam::{DMat3, DQuat, DVec3};

use super::linear::{matrix, null_space, symmetric_eigen, tangents};
use crate::num::greater;

/// The homography through four pairs; `None` where three of them stand on one line.
pub fn through(first: &[DVec3; 4], second: &[DVec3; 4]) -> Option<DMat3> {
    let row = |k: usize| rows(first[k / 2], second[k / 2])[k % 2];
    let basis = null_space::<8>(std::array::from_fn(row))?;
    normalised(matrix(&basis[0]))
}

/// The homography that fits weighted pairs best in the algebraic sense.
pub fn fitted(pairs: impl Iterator<Item = (DVec3, DVec3, f64)>) -> Option<DMat3> {
    let mut sums = [[0.0; 9]; 9];
    for (first, second, weight) in pairs {
        for row in rows(first, second) {
            for i in 0..9 {
                for j in 0..9 {
                    sums[i][j] += weight * row[i] * row[j];
                }
            }
        }
    }
    normalised(matrix(&symmetric_eigen(sums)[0].1))
}

/// Two equations of `H first` being parallel to `second`, along its tangents.
fn rows(first: DVec3, second: DVec3) -> [[f64; 9]; 2] {
    let (u, v) = tangents(second);
    [u, v].map(|t| {
        let (t, f) = (t.to_array(), first.to_array());
        std::array::from_fn(|k| t[k / 3] * f[k % 3])
    })
}

/// Scaled so that the middle singular value is 1 and the determinant positive, as `R + t n^T / d` has them for a plane
/// before both cameras.
fn normalised(h: DMat3) -> Option<DMat3> {
    let [_, (middle, _), _] = spread(&h);
    if !(middle > 1e-12) {
        return None;
    }
    let sign = if h.determinant() < 0.0 { -1.0 } else { 1.0 };
    Some(h * (sign / middle.sqrt()))
}

/// Squared singular values in rising order, with right singular vectors.
fn spread(h: &DMat3) -> [(f64, DVec3); 3] {
    let square = h.transpose() * *h;
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| square.col(j)[i]));
    symmetric_eigen::<3>(rows).map(|(value, vector)| (value, DVec3::from_array(vector)))
}

/// Motions `(R, t / d, n)` with `H = R + t n^T / d`, n the plane's normal in the first camera (Ma, Soatto et al. 2004,
/// "An invitation to 3-D vision", section 5.3.3). Empty for a pure rotation, which has no plane.
pub fn motions(h: &DMat3) -> Vec<(DQuat, DVec3, DVec3)> {
    let [(low, v3), (_, v2), (high, v1)] = spread(h);
    let gap = high - low;
    if !(gap > 1e-12) {
        return Vec::new();
    }
    // The middle value is 1; rounding may put it outside the others.
    let (a, b) = (greater(1.0 - low, 0.0).sqrt(), greater(high - 1.0, 0.0).sqrt());
    let mut found = Vec::new();
    for sign in [1.0, -1.0] {
        let u = (v1 * a + v3 * (sign * b)) / gap.sqrt();
        let frame = DMat3::from_cols(v2, u, v2.cross(u));
        let (h2, hu) = (*h * v2, *h * u);
        let image = DMat3::from_cols(h2, hu, h2.cross(hu));
        let rotation = image * frame.transpose();
        let normal = v2.cross(u);
        let t = (*h - rotation) * normal;
        let rotation = DQuat::from_mat3(&rotation).normalize();
        found.extend([(rotation, t, normal), (rotation, -t, -normal)]);
    }
    found
}
