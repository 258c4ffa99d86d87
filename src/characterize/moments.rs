//! Moments of clipped and quantised normals: mean, variance and third cumulant.

use crate::num::{f64_from_i64, greater, i64_truncated, lesser};

/// Mean, variance and third cumulant of a random value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cumulants {
    pub mean: f64,
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

/// A normal level on a ramp, in codes above its bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RampLevel {
    pub mean: f64,
    pub sigma: f64,
}

/// Moments of floor(x) clipped to whole `low ..= high`, for x normal.
pub fn quantised(level: RampLevel, low: f64, high: f64) -> Cumulants {
    let RampLevel { mean, sigma } = level;
    if sigma > SMOOTH_SIGMA_DN {
        // floor(x) is x - 1/2 plus an error that is uniform while x is inside.
        let (clipped_mean, clipped_variance) = clipped(mean - 0.5, sigma, low, high);
        let inside = normal_cdf((high + 0.5 - mean) / sigma) - normal_cdf((low + 0.5 - mean) / sigma);
        return Cumulants { mean: clipped_mean, variance: clipped_variance + greater(0.0, inside) / 12.0, third: 0.0 };
    }
    let first = first_code(level, low, high);
    // Sums of P(code >= k) from the lowest possible code: sums of small numbers keep their digits.
    let (mut sum, mut squares, mut cubes) = (0.0, 0.0, 0.0);
    for (step, reached) in (1_u32..).zip(reached(level, low, high)) {
        let step = f64::from(step);
        sum += reached;
        squares += (2.0 * step - 1.0) * reached;
        cubes += (3.0 * step * step - 3.0 * step + 1.0) * reached;
    }
    Cumulants {
        mean: first + sum,
        variance: greater(0.0, squares - sum * sum),
        third: cubes - 3.0 * sum * squares + 2.0 * sum * sum * sum,
    }
}

/// The lowest code that a level meets with any likelihood worth counting.
fn first_code(level: RampLevel, low: f64, high: f64) -> f64 {
    libm::floor(greater(low, lesser(high, level.mean - 9.0 * level.sigma - 1.0)))
}

/// Chance of each code above the first, or a greater one.
fn reached(level: RampLevel, low: f64, high: f64) -> impl Iterator<Item = f64> {
    let RampLevel { mean, sigma } = level;
    let first = i64_truncated(first_code(level, low, high));
    let last = i64_truncated(libm::floor(greater(low, lesser(high, mean + 9.0 * sigma + 1.0))));
    (first + 1..=last).map(f64_from_i64).map(move |edge| {
        if sigma > 0.0 { normal_cdf((mean - edge) / sigma) } else { f64::from(u8::from(mean >= edge)) }
    })
}

/// Two conversions of one pixel: the reset level counts down from the black level, the signal up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConversionPair {
    /// Where the counter starts.
    pub black_dn: f64,
    /// Greatest count of the reset ramp.
    pub reset_counts: f64,
    pub code_max: f64,
}

impl ConversionPair {
    /// Moments of black - floor(reset) + floor(signal), each count and the result clipped: a mixture over the reset's counts.
    pub fn moments(&self, signal: RampLevel, reset: RampLevel) -> Cumulants {
        let first = first_code(reset, 0.0, self.reset_counts);
        let at_least: Vec<f64> = std::iter::once(1.0).chain(reached(reset, 0.0, self.reset_counts)).collect();
        let (mut sum, mut squares, mut cubes) = (0.0, 0.0, 0.0);
        for (index, reached) in at_least.iter().enumerate() {
            let chance = reached - at_least.get(index + 1).copied().unwrap_or(0.0);
            let shift = self.black_dn - first - crate::num::f64_from_usize(index);
            let (low, high) = (greater(0.0, shift), lesser(self.code_max, self.code_max + shift));
            if !(chance > 0.0) {
                continue;
            }
            let found = quantised(RampLevel { mean: signal.mean + shift, ..signal }, low, greater(low, high));
            // About the signal's unclipped mean, so that no digits cancel.
            let step = found.mean - signal.mean;
            sum += chance * step;
            squares += chance * (found.variance + step * step);
            cubes += chance * (found.third + 3.0 * step * found.variance + step * step * step);
        }
        Cumulants {
            mean: signal.mean + sum,
            variance: greater(0.0, squares - sum * sum),
            third: cubes - 3.0 * sum * squares + 2.0 * sum * sum * sum,
        }
    }
}

/// Nodes and weights that average over a standard normal: the trapezoid rule from -5 to 5 sigma, whose error for smooth
/// functions falls faster than any power of the step. The weights sum to 1.
pub fn normal_nodes(count: u32) -> Vec<(f64, f64)> {
    assert!(count % 2 == 1, "a node is at the mean");
    let half = f64::from(count / 2);
    let node = |index: u32| 5.0 * (f64::from(index) - half) / greater(1.0, half);
    let total: f64 = (0..count).map(|index| normal_pdf(node(index))).sum();
    (0..count).map(|index| (node(index), normal_pdf(node(index)) / total)).collect()
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
            let at = |sigma| quantised(RampLevel { mean, sigma }, 0.0, 64.0);
            let (below, above) = (at(0.999_999_999), at(1.000_000_001));
            // First harmonic of the quantiser at sigma 1: exp(-2 pi^2) (4 sigma^2 + 1/pi^2) = 1.1e-8; at a clip the
            // code next to it makes up to half a code's worth of difference in what counts as inside.
            let tolerance = if mean > 10.0 && mean < 60.0 { 2e-8 } else { 0.05 };
            assert!((below.mean - above.mean).abs() < tolerance, "{mean}: {below:?} {above:?}");
            assert!((below.variance - above.variance).abs() < tolerance, "{mean}: {below:?} {above:?}");
        }
    }

    #[test]
    fn a_noiseless_value_has_one_code() {
        let at = |mean| quantised(RampLevel { mean, sigma: 0.0 }, 0.0, 15.0);
        assert_eq!(at(7.9), Cumulants { mean: 7.0, variance: 0.0, third: 0.0 });
        assert_eq!((at(99.0).mean, at(-3.0).mean), (15.0, 0.0));
    }

    #[test]
    fn two_conversions_subtract_and_their_moments_add_until_a_clip_is_near() {
        let both = ConversionPair { black_dn: 64.0, reset_counts: 128.0, code_max: 1023.0 };
        for (signal, reset) in [((164.3, 0.3), (64.9, 0.25)), ((500.0, 9.0), (63.5, 0.9)), ((70.0, 0.0), (64.5, 0.0))] {
            let (signal, reset) =
                (RampLevel { mean: signal.0, sigma: signal.1 }, RampLevel { mean: reset.0, sigma: reset.1 });
            let (up, down) = (quantised(signal, 0.0, 1023.0), quantised(reset, 0.0, 128.0));
            let found = both.moments(signal, reset);
            // Sums of some 20 terms of order 1e3, squared: 1e-10.
            assert!((found.mean - (64.0 - down.mean + up.mean)).abs() < 1e-9, "{found:?} {up:?} {down:?}");
            assert!((found.variance - up.variance - down.variance).abs() < 1e-8, "{found:?} {up:?} {down:?}");
            assert!((found.third - up.third + down.third).abs() < 1e-6, "{found:?} {up:?} {down:?}");
        }
        // Beyond the ramp the signal counts 1023 always; the reset's count is left where it stands above the black level.
        let full = both.moments(RampLevel { mean: 2000.0, sigma: 0.0 }, RampLevel { mean: 70.5, sigma: 0.0 });
        assert_eq!((full.mean, full.variance), (1017.0, 0.0));
        assert_eq!(
            both.moments(RampLevel { mean: 2000.0, sigma: 0.0 }, RampLevel { mean: 60.5, sigma: 0.0 }).mean,
            1023.0
        );
        assert_eq!(both.moments(RampLevel { mean: 0.5, sigma: 0.0 }, RampLevel { mean: 500.0, sigma: 0.0 }).mean, 0.0);
    }

    #[test]
    fn nodes_average_a_normal() {
        let nodes = normal_nodes(31);
        let moment = |power: i32| -> f64 { nodes.iter().map(|(x, w)| (0..power).fold(*w, |p, _| p * x)).sum() };
        // Beyond 5 sigma lies 1.5e-5 of the second moment.
        assert!((moment(0) - 1.0).abs() < 1e-12 && moment(1).abs() < 1e-12 && (moment(2) - 1.0).abs() < 3e-5);
    }
}
