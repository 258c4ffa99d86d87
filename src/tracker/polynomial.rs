//! Real roots of polynomials, in ascending order. Coefficients start with the constant term.
//!
//! Roots are isolated between the roots of the derivative, so that no complex arithmetic, cube root or cosine is needed, and
//! the bits are those of + - * / sqrt.

use crate::num::{greater, lesser};

/// Bisections and Newton steps within one bracket; each at least halves it, Newton squares its error.
const STEPS: u32 = 80;

/// All positive roots; a double root that only touches zero may be missing, or be found twice.
pub fn positive_roots(quartic: [f64; 5]) -> Vec<f64> {
    scaled(&quartic).map_or(Vec::new(), |c| roots(&c))
}

/// Coefficients of which the greatest is 1 or -1; `None` where all are 0, or one is not finite.
fn scaled(coefficients: &[f64]) -> Option<Vec<f64>> {
    let greatest = coefficients.iter().fold(0.0, |most, c| greater(most, c.abs()));
    (greatest > 0.0 && greatest.is_finite()).then(|| coefficients.iter().map(|c| c / greatest).collect())
}

/// Roots within (0, bound], by the derivative's roots, recursively.
fn roots(coefficients: &[f64]) -> Vec<f64> {
    let mut degree = coefficients.len() - 1;
    // A leading coefficient this small belongs to a root beyond 1e14, which no camera has.
    while degree > 0 && coefficients[degree].abs() < 1e-14 {
        degree -= 1;
    }
    let c = &coefficients[..=degree];
    match degree {
        0 => return Vec::new(),
        1 => return [-c[0] / c[1]].into_iter().filter(|root| *root > 0.0).collect(),
        _ => {}
    }
    // Cauchy: no root exceeds 1 + max |c_k / c_n|.
    let bound = 1.0 + c[..degree].iter().fold(0.0, |most, ck| greater(most, (ck / c[degree]).abs()));
    separated(c, bound, roots, bracketed)
}

/// Roots within (0, `bound`]: between the derivative's roots, which `roots` finds, one at most that `bracketed` finds.
fn separated(
    c: &[f64],
    bound: f64,
    roots: fn(&[f64]) -> Vec<f64>,
    bracketed: fn(&[f64], &[f64], f64, f64) -> f64,
) -> Vec<f64> {
    let derivative: Vec<f64> = (1..c.len()).map(|k| f64::from(crate::num::u32_from(k)) * c[k]).collect();
    let mut found = Vec::new();
    let mut low = 0.0;
    for high in roots(&derivative).into_iter().filter(|&root| root < bound).chain([bound]) {
        let (at_low, at_high) = (value(c, low), value(c, high));
        if at_high == 0.0 && high > 0.0 {
            found.push(high);
        } else if at_low != 0.0 && (at_low < 0.0) != (at_high < 0.0) {
            found.push(bracketed(c, &derivative, low, high));
        }
        low = high;
    }
    found
}

/// All real roots of any degree, in rising order; a double root that only touches zero may be missing, or be found
/// twice. Roots beyond 1 are sought as reciprocals of the reversed polynomial's, so that every bracket lies within 0..1
/// and none is far from its root.
pub fn real_roots(coefficients: &[f64]) -> Vec<f64> {
    let Some(scaled) = scaled(coefficients) else { return Vec::new() };
    let mirrored: Vec<f64> = scaled.iter().enumerate().map(|(k, c)| if k % 2 == 0 { *c } else { -c }).collect();
    let mut found = Vec::new();
    if scaled[0] == 0.0 {
        found.push(0.0);
    }
    for (c, sign) in [(&scaled, 1.0), (&mirrored, -1.0)] {
        found.extend(unit_roots(c).into_iter().map(|root| sign * root));
        let reversed: Vec<f64> = c.iter().rev().copied().collect();
        // Roots at 1, and within rounding of it, are the first search's.
        found.extend(unit_roots(&reversed).into_iter().filter(|&root| root < 1.0 / REACH).map(|root| sign / root));
    }
    found.sort_by(f64::total_cmp);
    found
}

/// A little beyond 1, so that rounding cannot hide a root there from both searches.
const REACH: f64 = 1.0 + 1.0 / 1_048_576.0;

/// Roots within (0, `REACH`].
fn unit_roots(c: &[f64]) -> Vec<f64> {
    if c.len() < 2 { Vec::new() } else { separated(c, REACH, unit_roots, halved) }
}

/// The one root between two arguments of different sign: Newton where it at least halves the last step, else bisection.
fn halved(c: &[f64], derivative: &[f64], mut low: f64, mut high: f64) -> f64 {
    let low_is_negative = value(c, low) < 0.0;
    let (mut x, mut last) = (0.5 * (low + high), high - low);
    for _ in 0..2 * STEPS {
        let at = value(c, x);
        if at == 0.0 {
            return x;
        }
        if (at < 0.0) == low_is_negative {
            low = x;
        } else {
            high = x;
        }
        let newton = x - at / value(derivative, x);
        let good = newton > low && newton < high && (newton - x).abs() <= 0.5 * last;
        let next = if good { newton } else { 0.5 * (low + high) };
        last = (next - x).abs();
        if last <= 1e-16 * x {
            return next;
        }
        x = next;
    }
    x
}

/// The polynomial's value at `x`.
pub fn value(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The one root between two arguments of different sign: Newton, with bisection where it leaves the bracket.
fn bracketed(c: &[f64], derivative: &[f64], mut low: f64, mut high: f64) -> f64 {
    let low_is_negative = value(c, low) < 0.0;
    let mut x = 0.5 * (low + high);
    for _ in 0..STEPS {
        let at = value(c, x);
        if at == 0.0 {
            return x;
        }
        if (at < 0.0) == low_is_negative {
            low = x
        } else {
            high = x
        }
        let newton = x - at / value(derivative, x);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() <= 1e-15 * x.abs() {
            return lesser(greater(next, low), high);
        }
        x = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from_roots(roots: [f64; 4]) -> [f64; 5] {
        let mut c = [1.0, 0.0, 0.0, 0.0, 0.0];
        for (degree, root) in roots.into_iter().enumerate() {
            for k in (0..=degree + 1).rev() {
                c[k] = if k > 0 { c[k - 1] } else { 0.0 } - root * c[k];
            }
        }
        c
    }

    #[test]
    fn separate_roots_are_found_in_order_and_negative_ones_left_out() {
        for roots in
            [[0.5, 1.0, 2.0, 3.0], [-1.0, 0.25, 0.75, 40.0], [-3.0, -2.0, -1.0, 1e-3], [0.999, 1.0, 1.001, 7.0]]
        {
            let mut expected: Vec<f64> = roots.into_iter().filter(|&root| root > 0.0).collect();
            expected.sort_by(f64::total_cmp);
            let found = positive_roots(from_roots(roots));
            assert_eq!(found.len(), expected.len(), "{roots:?} gave {found:?}");
            for (found, expected) in found.iter().zip(&expected) {
                // Rounded coefficients (2^-53 of up to 1e3) over the least slope, gap^2 * 6 = 6e-6 for the third case.
                assert!((found - expected).abs() < 1e-7 * expected, "{roots:?}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn roots_of_any_sign_size_and_degree_are_found() {
        let roots = [-700.0, -3.0, -1.0, -0.25, 0.0, 1e-3, 0.5, 1.0, 40.0, 2_000.0];
        let mut c = vec![1.0];
        for root in roots {
            let mut next = vec![0.0; c.len() + 1];
            for (k, x) in c.iter().enumerate() {
                next[k + 1] += x;
                next[k] -= root * x;
            }
            c = next;
        }
        let found = real_roots(&c);
        assert_eq!(found.len(), roots.len(), "{found:?}");
        for (found, root) in found.iter().zip(roots) {
            // Separate by a factor of 2 and more: the condition of a root is below 1e4 roundings.
            assert!((found - root).abs() <= 1e-11 * root.abs(), "{found} for {root}");
        }
        assert_eq!(real_roots(&[1.0, 0.0, 1.0]), [0.0; 0]);
        assert_eq!(real_roots(&[]), [0.0; 0]);
        assert_eq!(real_roots(&[3.0]), [0.0; 0]);
    }

    #[test]
    fn lower_degrees_and_no_roots_are_served() {
        assert_eq!(positive_roots([0.0; 5]), [0.0; 0]);
        assert_eq!(positive_roots([f64::NAN; 5]), [0.0; 0]);
        assert_eq!(positive_roots([1.0, 0.0, 2.0, 0.0, 1.0]), [0.0; 0]);
        assert_eq!(positive_roots([-6.0, 2.0, 0.0, 0.0, 0.0]), [3.0]);
        let two = positive_roots([2.0, -3.0, 1.0, 0.0, 0.0]);
        assert!(two.len() == 2 && (two[0] - 1.0).abs() < 1e-12 && (two[1] - 2.0).abs() < 1e-12, "{two:?}");
    }
}
