//! Essential matrices from five pairs of unit bearings (Nistér 2004, "An efficient solution to the five-point relative pose problem"; the
//! tenth-degree polynomial by elimination as there, its roots by bracketing). Up to ten matrices E with `second . E first = 0`.

use glam::{DMat3, DVec3};

use super::linear::{matrix, null_space};
use crate::tracker::polynomial::{real_roots, value};

/// A polynomial in x, y, z by exponents, each 0..=3.
type Cubic = [[[f64; 4]; 4]; 4];

/// Exponents of x, y, z in Nistér's order: the first ten are eliminated.
const ORDER: [(usize, usize, usize); 20] = [
    (3, 0, 0),
    (0, 3, 0),
    (2, 1, 0),
    (1, 2, 0),
    (2, 0, 1),
    (2, 0, 0),
    (0, 2, 1),
    (0, 2, 0),
    (1, 1, 1),
    (1, 1, 0),
    (1, 0, 2),
    (1, 0, 1),
    (1, 0, 0),
    (0, 1, 2),
    (0, 1, 1),
    (0, 1, 0),
    (0, 0, 3),
    (0, 0, 2),
    (0, 0, 1),
    (0, 0, 0),
];

/// All essential matrices, of Frobenius norm sqrt 2, that five pairs allow. Empty for pairs that depend on each other.
pub fn solve(first: &[DVec3; 5], second: &[DVec3; 5]) -> Vec<DMat3> {
    let row = |k: usize| {
        let (a, b) = (first[k].to_array(), second[k].to_array());
        std::array::from_fn(|n| b[n / 3] * a[n % 3])
    };
    let Some(basis) = null_space::<5>(std::array::from_fn(row)) else { return Vec::new() };
    let laws = constraints(&basis);
    let Some(rows) = eliminated(laws) else { return Vec::new() };
    let lines = [(4, 5), (6, 7), (8, 9)].map(|(a, b)| in_z(&rows[a], &rows[b]));
    let tenth = determinant(&lines);
    let essential = |z: f64| {
        // x and y make the three rows vanish: their cross product, where it is longest.
        let at = lines.each_ref().map(|[x, y, one]| DVec3::new(value(x, z), value(y, z), value(one, z)));
        let crosses = [at[0].cross(at[1]), at[1].cross(at[2]), at[2].cross(at[0])];
        let longest = crosses.into_iter().reduce(|a, b| if b.length_squared() > a.length_squared() { b } else { a })?;
        let [x, y, z] = polished(&laws, [longest.x / longest.z, longest.y / longest.z, z])?;
        let numbers: [f64; 9] =
            std::array::from_fn(|k| x * basis[0][k] + y * basis[1][k] + z * basis[2][k] + basis[3][k]);
        let norm = numbers.iter().map(|n| n * n).sum::<f64>().sqrt();
        let e = matrix(&numbers) * (std::f64::consts::SQRT_2 / norm);
        e.is_finite().then_some(e)
    };
    real_roots(&tenth).into_iter().filter_map(essential).collect()
}

/// Gauss-Newton on the ten laws: near double roots the polynomial loses half of its digits. `None` where they do not
/// come to hold.
fn polished(laws: &[[f64; 20]; 10], start: [f64; 3]) -> Option<[f64; 3]> {
    let mut at = start;
    for step in 0..=POLISHING_STEPS {
        let powers = at.map(|x| [1.0, x, x * x, x * x * x]);
        let monomial = |(i, j, k): (usize, usize, usize)| powers[0][i] * powers[1][j] * powers[2][k];
        let slope = |axis: usize, (i, j, k): (usize, usize, usize)| {
            let mut exponents = [i, j, k];
            let factor = f64::from(crate::num::u32_from(exponents[axis]));
            exponents[axis] = exponents[axis].saturating_sub(1);
            factor * monomial((exponents[0], exponents[1], exponents[2]))
        };
        let (mut hessian, mut gradient, mut miss2) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for law in laws {
            let total =
                |f: &dyn Fn((usize, usize, usize)) -> f64| law.iter().zip(ORDER).map(|(c, n)| c * f(n)).sum::<f64>();
            let miss = total(&monomial);
            let row = DVec3::new(total(&|n| slope(0, n)), total(&|n| slope(1, n)), total(&|n| slope(2, n)));
            hessian += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
            gradient -= row * miss;
            miss2 += miss * miss;
        }
        if step == POLISHING_STEPS {
            // The laws are cubic in a matrix of norm sqrt(1 + |at|^2).
            let size2 = 1.0 + at.iter().map(|x| x * x).sum::<f64>();
            return (miss2 <= LAW_TOLERANCE * LAW_TOLERANCE * size2 * size2 * size2).then_some(at);
        }
        let by = hessian.inverse() * gradient;
        if !by.is_finite() {
            break;
        }
        at = [at[0] + by.x, at[1] + by.y, at[2] + by.z];
    }
    None
}

/// Each squares the error of a single root; at double roots it halves.
const POLISHING_STEPS: u32 = 4;
/// The laws of a solution hold to this, for a matrix of norm 1.
const LAW_TOLERANCE: f64 = 1e-7;

/// The ten cubic laws of an essential matrix: its determinant, and `(E E^T - trace(E E^T) / 2) E`.
fn constraints(basis: &[[f64; 9]]) -> [[f64; 20]; 10] {
    let entry = |k: usize| {
        let mut linear = [[[0.0; 4]; 4]; 4];
        (linear[1][0][0], linear[0][1][0]) = (basis[0][k], basis[1][k]);
        (linear[0][0][1], linear[0][0][0]) = (basis[2][k], basis[3][k]);
        linear
    };
    let e: [Cubic; 9] = std::array::from_fn(entry);
    let minor = |a: usize, b: usize, c: usize, d: usize| sum(&product(&e[a], &e[b]), &product(&e[c], &e[d]), -1.0);
    let zero = [[[0.0; 4]; 4]; 4];
    let mut laws = [[0.0; 20]; 10];
    let determinant = [(0, minor(4, 8, 5, 7)), (1, minor(5, 6, 3, 8)), (2, minor(3, 7, 4, 6))]
        .iter()
        .fold(zero, |total, (k, minor)| sum(&total, &product(&e[*k], minor), 1.0));
    laws[0] = listed(&determinant);
    let mut square: [Cubic; 9] = std::array::from_fn(|n| {
        (0..3).fold(zero, |total, k| sum(&total, &product(&e[n / 3 * 3 + k], &e[n % 3 * 3 + k]), 1.0))
    });
    let trace = sum(&sum(&square[0], &square[4], 1.0), &square[8], 1.0);
    for k in [0, 4, 8] {
        square[k] = sum(&square[k], &trace, -0.5);
    }
    for n in 0..9 {
        let law = (0..3).fold(zero, |total, k| sum(&total, &product(&square[n / 3 * 3 + k], &e[3 * k + n % 3]), 1.0));
        laws[n + 1] = listed(&law);
    }
    laws
}

fn product(a: &Cubic, b: &Cubic) -> Cubic {
    let mut c = [[[0.0; 4]; 4]; 4];
    for &(i, j, k) in &ORDER {
        if a[i][j][k] == 0.0 {
            continue;
        }
        for &(l, m, n) in ORDER.iter().filter(|(l, m, n)| i + j + k + l + m + n <= 3) {
            c[i + l][j + m][k + n] += a[i][j][k] * b[l][m][n];
        }
    }
    c
}

fn sum(a: &Cubic, b: &Cubic, factor: f64) -> Cubic {
    std::array::from_fn(|i| std::array::from_fn(|j| std::array::from_fn(|k| a[i][j][k] + factor * b[i][j][k])))
}

fn listed(a: &Cubic) -> [f64; 20] {
    ORDER.map(|(i, j, k)| a[i][j][k])
}

/// Gauss-Jordan: the first ten monomials in terms of the last ten. `None` where the laws do not determine them.
fn eliminated(mut rows: [[f64; 20]; 10]) -> Option<[[f64; 20]; 10]> {
    for k in 0..10 {
        let best = (k..10).fold(k, |best, i| if rows[i][k].abs() > rows[best][k].abs() { i } else { best });
        rows.swap(k, best);
        let pivot = rows[k][k];
        if !(pivot.abs() > 1e-13) {
            return None;
        }
        let row = rows[k].map(|x| x / pivot);
        rows[k] = row;
        for i in (0..10).filter(|&i| i != k) {
            let factor = rows[i][k];
            rows[i].iter_mut().zip(row).for_each(|(x, r)| *x -= factor * r);
        }
    }
    Some(rows)
}

/// Row `a` less z times row `b`, in which the eliminated monomials cancel: polynomials in z before x, y and 1.
fn in_z(a: &[f64; 20], b: &[f64; 20]) -> [Vec<f64>; 3] {
    let part = |from: usize, terms: usize| {
        // Powers fall from left to right in the order of the monomials.
        let mut c = vec![0.0; terms + 1];
        for k in 0..terms {
            c[terms - 1 - k] += a[from + k];
            c[terms - k] -= b[from + k];
        }
        c
    };
    [part(10, 3), part(13, 3), part(16, 4)]
}

fn determinant(m: &[[Vec<f64>; 3]; 3]) -> Vec<f64> {
    let mut total = vec![0.0; 11];
    for (k, sign, l, n) in
        [(0, 1.0, 1, 2), (0, -1.0, 2, 1), (1, 1.0, 2, 0), (1, -1.0, 0, 2), (2, 1.0, 0, 1), (2, -1.0, 1, 0)]
    {
        let term = times(&times(&m[0][k], &m[1][l]), &m[2][n]);
        total.iter_mut().zip(&term).for_each(|(sum, x)| *sum += sign * x);
    }
    total
}

fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut c = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            c[i + j] += x * y;
        }
    }
    c
}
