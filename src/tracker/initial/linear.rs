//! Null spaces and eigenvectors of small matrices. Plain loops in a fixed order: bits do not depend on the target.

use glam::{DMat3, DVec3};

/// An orthonormal basis of what `ROWS` rows of nine numbers leave free, by elimination with full pivoting; `None` where
/// the rows depend on each other to within 1e-10.
pub fn null_space<const ROWS: usize>(mut rows: [[f64; 9]; ROWS]) -> Option<Vec<[f64; 9]>> {
    let mut columns: [usize; 9] = std::array::from_fn(|k| k);
    let mut greatest = 0.0;
    for done in 0..ROWS {
        let (mut at, mut most) = ((done, done), -1.0);
        for (i, row) in rows.iter().enumerate().skip(done) {
            for (j, &column) in columns.iter().enumerate().skip(done) {
                if row[column].abs() > most {
                    (at, most) = ((i, j), row[column].abs());
                }
            }
        }
        greatest = crate::num::greater(greatest, most);
        if !(most > 1e-10 * greatest) {
            return None;
        }
        rows.swap(done, at.0);
        columns.swap(done, at.1);
        let pivot_row = rows[done].map(|x| x / rows[done][columns[done]]);
        rows[done] = pivot_row;
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != done) {
            let factor = row[columns[done]];
            row.iter_mut().zip(pivot_row).for_each(|(x, p)| *x -= factor * p);
        }
    }
    let mut basis: Vec<[f64; 9]> = Vec::new();
    for &free in &columns[ROWS..] {
        let mut vector = [0.0; 9];
        vector[free] = 1.0;
        (0..ROWS).for_each(|i| vector[columns[i]] = -rows[i][free]);
        // Twice is enough (Parlett).
        for _ in 0..2 {
            for other in &basis {
                let share = dot(&vector, other);
                vector.iter_mut().zip(other).for_each(|(x, o)| *x -= share * o);
            }
        }
        let length = dot(&vector, &vector).sqrt();
        basis.push(vector.map(|x| x / length));
    }
    Some(basis)
}

fn dot(a: &[f64; 9], b: &[f64; 9]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Eigenvalues in rising order and their eigenvectors of a symmetric matrix, by Jacobi's cyclic rotations.
pub fn symmetric_eigen<const N: usize>(mut a: [[f64; N]; N]) -> [(f64, [f64; N]); N] {
    let mut v: [[f64; N]; N] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    // Convergence is quadratic; 9 x 9 matrices take some eight sweeps.
    for _ in 0..30 {
        let mut turned = false;
        for p in 0..N {
            for q in p + 1..N {
                if a[p][q].abs() <= 1e-18 * (a[p][p].abs() + a[q][q].abs()) {
                    continue;
                }
                turned = true;
                let slope = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let sign = if slope < 0.0 { -1.0 } else { 1.0 };
                let tangent = sign / (slope.abs() + (slope * slope + 1.0).sqrt());
                let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
                let sine = tangent * cosine;
                for k in 0..N {
                    let (x, y) = (a[k][p], a[k][q]);
                    (a[k][p], a[k][q]) = (cosine * x - sine * y, sine * x + cosine * y);
                }
                for k in 0..N {
                    let (x, y) = (a[p][k], a[q][k]);
                    (a[p][k], a[q][k]) = (cosine * x - sine * y, sine * x + cosine * y);
                    let (x, y) = (v[k][p], v[k][q]);
                    (v[k][p], v[k][q]) = (cosine * x - sine * y, sine * x + cosine * y);
                }
            }
        }
        if !turned {
            break;
        }
    }
    let mut pairs: [(f64, [f64; N]); N] = std::array::from_fn(|k| (a[k][k], std::array::from_fn(|i| v[i][k])));
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
    pairs
}

/// Nine numbers, row-major, as a matrix.
pub fn matrix(numbers: &[f64; 9]) -> DMat3 {
    DMat3::from_cols_array(numbers).transpose()
}

/// The matrix of cofactors: `determinant * inverse transposed`, defined for singular matrices too.
pub fn cofactors(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// Two unit vectors that complete a unit vector to a right-handed frame.
pub fn tangents(unit: DVec3) -> (DVec3, DVec3) {
    let aside = if unit.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    let first = unit.cross(aside).normalize();
    (first, unit.cross(first))
}
