//! Charge that is divided electron by electron: a binomial draw from the electrons of a row, a probability and uniforms.
//!
//! Each whole electron goes with the same probability, apart from the others: a binomial draw, the quantile of the column's
//! uniform. Thinning a Poisson count so leaves a Poisson count, so a transfer or a leak adds no noise beyond shot noise, and
//! takes none away. Fractions of an electron (a dark offset, charge that spilled over) are divided in proportion.

use crate::draw::normals;
use crate::num::{f32_nearest, greater, lesser};

/// Below this mean of the rarer outcome the distribution function is summed, exactly to rounding; from here on the Cornish-Fisher
/// expansion to the fourth cumulant decides, with Sheppard's correction for the rounding.
const SUM_MEAN_MAX: f64 = 16.0;

/// Writes how many of each value's electrons go. Panics if the slices differ in length.
pub(super) fn binomial(values_e: &[f32], share: f64, uniforms: &[u32], gone_e: &mut [f32]) {
    assert!(values_e.len() == uniforms.len(), "a draw needs one uniform");
    normals(uniforms, gone_e);
    let (go, stay) = (BinomialOutcome::new(share, 1.0 - share), BinomialOutcome::new(1.0 - share, share));
    for ((gone_e, &value_e), &uniform) in gone_e.iter_mut().zip(values_e).zip(uniforms) {
        let value_e = f64::from(value_e);
        if !value_e.is_finite() {
            *gone_e = f32_nearest(share * value_e);
            continue;
        }
        let whole_e = greater(value_e.round_ties_even(), 0.0);
        let part_e = (value_e - whole_e) * share;
        let counted_e = if share <= 0.5 && whole_e * share < SUM_MEAN_MAX {
            go.by_summation(whole_e, uniform)
        } else if share > 0.5 && whole_e * (1.0 - share) < SUM_MEAN_MAX {
            whole_e - stay.by_summation(whole_e, !uniform)
        } else {
            by_expansion(whole_e, share, f64::from(*gone_e))
        };
        *gone_e = f32_nearest(counted_e + part_e);
    }
}

/// The binomial quantile of n whole electrons and probability p at the standard normal quantile z.
///
/// Cornish and Fisher, Revue de l'Institut International de Statistique 5 (1938), with the cumulants of the binomial law; the terms
/// left out move the distribution function by less than 1 / (60 n p q).
#[inline(always)]
fn by_expansion(n: f64, p: f64, z: f64) -> f64 {
    let q = 1.0 - p;
    let variance = n * p * q;
    let (k3, k4) = ((q - p) / variance.sqrt(), (1.0 - 6.0 * p * q) / variance);
    let w =
        z + k3 * (z * z - 1.0) / 6.0 + k4 * (z * z * z - 3.0 * z) / 24.0 - k3 * k3 * (2.0 * z * z * z - 5.0 * z) / 36.0;
    let gone = (n * p + (variance - 1.0 / 12.0).sqrt() * w).round_ties_even();
    lesser(greater(gone, 0.0), n)
}

/// An outcome of probability p <= 1/2, with what its sums need.
struct BinomialOutcome {
    odds: f64,
    log_other: f64,
}

impl BinomialOutcome {
    fn new(probability: f64, other: f64) -> Self {
        Self { odds: probability / other, log_other: libm::log1p(-probability) }
    }

    /// The least k with P(K <= k) >= U, for n p below `SUM_MEAN_MAX`.
    fn by_summation(&self, n: f64, uniform: u32) -> f64 {
        let below = (f64::from(uniform) + 0.5) / 4_294_967_296.0;
        let mut probability = libm::exp(n * self.log_other);
        let mut sum = probability;
        let mut k = 0.0;
        // n p of 16 reaches 1 - 2^-33 before 60; the bound only guards the loop.
        while sum < below && k < n && k < 200.0 {
            probability *= (n - k) / (k + 1.0) * self.odds;
            k += 1.0;
            sum += probability;
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{DrawKey, fill_uniforms};
    use crate::num::f64_from_usize;

    /// Over 2^20 uniforms per case mean, variance and third central moment within 4.5 standard errors (moments of a normal law for
    /// the third: sqrt(6/n) of sigma^3, times 2 for skewed cases), on both sides of the seam at 16 and of p = 1/2.
    #[test]
    fn counts_have_the_moments_of_the_binomial_law_on_both_sides_of_the_seam() {
        let count = 1 << 20;
        let mut uniforms = vec![0; count];
        let mut tried = 0;
        for (n, p) in [
            (1.0_f32, 0.3),
            (20.0, 0.02),
            (31.0, 0.5),
            (33.0, 0.5),
            (40.0, 0.39),
            (40.0, 0.41),
            (200.0, 0.9),
            (159.0, 0.1),
            (161.0, 0.1),
            (1e4, 0.001),
            (1e4, 0.002),
            (1e6, 0.3),
            (1e4, 0.9995),
        ] {
            fill_uniforms(DrawKey::root(tried), &mut uniforms);
            let mut gone = vec![0.0; count];
            binomial(&vec![n; count], p, &uniforms, &mut gone);
            assert!(gone.iter().all(|&gone| gone >= 0.0 && gone <= n && gone.fract() == 0.0));
            let total = f64_from_usize(count);
            let mean = gone.iter().map(|&gone| f64::from(gone)).sum::<f64>() / total;
            let moment = |power: u32| {
                let term = |gone: &f32| (0..power).fold(1.0, |term, _| term * (f64::from(*gone) - mean));
                gone.iter().map(term).sum::<f64>() / total
            };
            let (n, variance) = (f64::from(n), f64::from(n) * p * (1.0 - p));
            let third = variance * (1.0 - 2.0 * p);
            let sigma = variance.sqrt();
            let fourth = variance * (1.0 + (3.0 * n - 6.0) * p * (1.0 - p));
            println!(
                "n {n}, p {p}: mean {mean}, variance {} for {variance}, third {} for {third}",
                moment(2),
                moment(3)
            );
            assert!((mean - n * p).abs() < 4.5 * sigma / total.sqrt(), "n {n}, p {p}: mean {mean}");
            let variance_se = ((fourth - variance * variance) / total).sqrt();
            assert!((moment(2) - variance).abs() < 4.5 * variance_se + 1e-9, "n {n}, p {p}: variance {}", moment(2));
            let third_se = 2.0 * (6.0 / total).sqrt() * (sigma * sigma * sigma) + (variance / total).sqrt();
            assert!((moment(3) - third).abs() < 4.5 * third_se, "n {n}, p {p}: third {} for {third}", moment(3));
            tried += 1;
        }
        assert_eq!(tried, 13);
    }

    #[test]
    fn nothing_and_everything_go_at_the_ends() {
        let uniforms = [0, 1 << 31, u32::MAX];
        let mut gone = [9.0; 3];
        for (value_e, share, expected) in [
            (0.0, 0.5, 0.0),
            (1000.0, 0.0, 0.0),
            (1000.0, 1.0, 1000.0),
            (1e9, 1.0, 1e9),
            (-3.0, 0.5, -1.5),
            (f32::INFINITY, 0.5, f32::INFINITY),
        ] {
            binomial(&[value_e; 3], share, &uniforms, &mut gone);
            assert_eq!(gone, [expected; 3], "{value_e} e-, {share}");
        }
    }
}
