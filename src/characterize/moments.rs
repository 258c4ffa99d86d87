//! Moments of clipped and quantised normals. Enters: mean and sigma of a normal, limits. Leaves: mean, variance, third cumulant.

use crate::num::{f64_from_i64, greater, i64_truncated, lesser};

/// Mean, variance and third cumulant of a random value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// First moment.
    pub mean: f64,
    /// Second central moment.
    pub variance: f64,
    /// Third central moment, as far as it comes from quantisation.
    pub third: f64,
}

/// Sigma in codes above which the quantiser's error is uniform to exp(-2 pi^2) = 3e-9 of its size, so its variance is 1/12 and its
/// third cumulant 0. Both sides of the seam are compared in a test.
const SMOOTH_SIGMA_DN: f64 = 1.0;

/// Distribution function of the standard normal.
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// Density of the standard normal.
fn normal_pdf(z: f64) -> f64 {
    0.398_942_280_401_432_7 * libm::exp(-0.5 * z * z)
}

/// Mean and variance of a normal whose values beyond `low` and `high` are set to them.
pub fn clipped(mean: f64, sigma: f64, low: f64, high: f64) -> (f64, f64) {
    if sigma <= 0.0 {
        return (lesser(greater(mean, low), high), 0.0);
    }
    // About the mean, so that no digits cancel; z stays finite so that limits at infinity add nothing.
    let side = |limit: f64| {
        let z = greater(-40.0, lesser(40.0, (limit - mean) / sigma));
        (z, normal_cdf(z), normal_cdf(-z), normal_pdf(z))
    };
    let ((a, below, _, pdf_a), (b, under, above, pdf_b)) = (side(low), side(high));
    let inside = greater(0.0, under - below);
    let first = a * below + b * above + pdf_a - pdf_b;
    let second = a * a * below + b * b * above + inside + a * pdf_a - b * pdf_b;
    (mean + sigma * first, sigma * sigma * greater(0.0, second - first * first))
}

/// Moments of floor(x) clipped to 0 ..= `code_max`, for x normal.
pub fn quantised(mean: f64, sigma: f64, code_max: u32) -> Moments {
    let top = f64::from(code_max);
    if sigma > SMOOTH_SIGMA_DN {
        // floor(x) is x - 1/2 plus an error that is uniform while x is inside.
        let (clipped_mean, clipped_variance) = clipped(mean - 0.5, sigma, 0.0, top);
        let inside = normal_cdf((top + 0.5 - mean) / sigma) - normal_cdf(-(mean - 0.5) / sigma);
        return Moments { mean: clipped_mean, variance: clipped_variance + greater(0.0, inside) / 12.0, third: 0.0 };
    }
    let reach = 9.0 * sigma + 1.0;
    let code = |value: f64| i64_truncated(libm::floor(greater(0.0, lesser(top, value))));
    let (first, last) = (code(mean - reach), code(mean + reach));
    // Sums of P(code >= k) from the lowest possible code: sums of small numbers keep their digits.
    let (mut sum, mut squares, mut cubes) = (0.0, 0.0, 0.0);
    for k in first + 1..=last {
        let edge = f64_from_i64(k);
        let reached = if sigma > 0.0 { normal_cdf((mean - edge) / sigma) } else { f64::from(u8::from(mean >= edge)) };
        let step = f64_from_i64(k - first);
        sum += reached;
        squares += (2.0 * step - 1.0) * reached;
        cubes += (3.0 * step * step - 3.0 * step + 1.0) * reached;
    }
    let variance = squares - sum * sum;
    Moments {
        mean: f64_from_i64(first) + sum,
        variance: greater(0.0, variance),
        third: cubes - 3.0 * sum * squares + 2.0 * sum * sum * sum,
    }
}

/// Nodes and weights that average over a standard normal: the trapezoid rule from -5 to 5 sigma, whose error for smooth
/// functions falls faster than any power of the step. The weights sum to 1.
pub fn normal_nodes(count: u32) -> Vec<(f64, f64)> {
    assert!(count % 2 == 1, "a node stands at the mean");
    let half = f64::from(count / 2);
    let place = |index: u32| 5.0 * (f64::from(index) - half) / greater(1.0, half);
    let total: f64 = (0..count).map(|index| normal_pdf(place(index))).sum();
    (0..count).map(|index| (place(index), normal_pdf(place(index)) / total)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_far_away_changes_nothing_and_one_at_the_mean_halves() {
        let (mean, variance) = clipped(100.0, 3.0, f64::NEG_INFINITY, 1e9);
        assert!((mean - 100.0).abs() < 1e-9 && (variance - 9.0).abs() < 1e-9);
        // min(X, mu): mean mu - sigma / sqrt(2 pi), variance sigma^2 (1/2 - 1/(2 pi)).
        let (mean, variance) = clipped(100.0, 3.0, f64::NEG_INFINITY, 100.0);
        assert!((mean - (100.0 - 3.0 * 0.398_942_280_401)).abs() < 1e-9, "{mean}");
        assert!((variance - 9.0 * (0.5 - 0.159_154_943_09)).abs() < 1e-8, "{variance}");
    }

    #[test]
    fn both_sides_of_the_seam_of_smoothness_agree() {
        for mean in [40.0, 40.25, 40.5, 63.2, 0.3] {
            let (below, above) = (quantised(mean, 0.999_999_999, 64), quantised(mean, 1.000_000_001, 64));
            // First harmonic of the quantiser at sigma 1: exp(-2 pi^2) (4 sigma^2 + 1/pi^2) = 1.1e-8; at a clip the
            // code next to it makes up to half a code's worth of difference in what counts as inside.
            let tolerance = if mean > 10.0 && mean < 60.0 { 2e-8 } else { 0.05 };
            assert!((below.mean - above.mean).abs() < tolerance, "{mean}: {below:?} {above:?}");
            assert!((below.variance - above.variance).abs() < tolerance, "{mean}: {below:?} {above:?}");
        }
    }

    #[test]
    fn a_noiseless_value_has_one_code() {
        assert_eq!(quantised(7.9, 0.0, 15), Moments { mean: 7.0, variance: 0.0, third: 0.0 });
        assert_eq!(quantised(99.0, 0.0, 15).mean, 15.0);
        assert_eq!(quantised(-3.0, 0.0, 15).mean, 0.0);
    }

    #[test]
    fn nodes_average_a_normal() {
        let nodes = normal_nodes(31);
        let moment = |power: i32| -> f64 { nodes.iter().map(|(x, w)| (0..power).fold(*w, |p, _| p * x)).sum() };
        // Beyond 5 sigma lies 1.5e-5 of the second moment.
        assert!((moment(0) - 1.0).abs() < 1e-12 && moment(1).abs() < 1e-12 && (moment(2) - 1.0).abs() < 3e-5);
    }
}
