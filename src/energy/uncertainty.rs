//! How far a sum of uncertain constants may be off. Enters: terms, each known within a factor. Leaves: a range and each
//! term's share of the variance. Terms are log-normal and independent; their sum is taken as log-normal of equal mean
//! and variance (Fenton and Wilkinson), which is exact for a single term.

use crate::num::lesser;

/// A term of a sum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    /// Median, any unit, at least 0.
    pub value: f64,
    /// 95 % of the distribution lie within this factor both ways.
    pub factor: f64,
}

/// A range that holds the true value with 95 % confidence, in the unit of the terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Standard deviations on either side of the median that a stated factor stands for.
const SIGMAS: f64 = 2.0;

impl Term {
    /// Variance of the logarithm.
    fn log_variance(self) -> f64 {
        let sigma = libm::log(self.factor) / SIGMAS;
        sigma * sigma
    }

    fn mean(self) -> f64 {
        self.value * libm::exp(0.5 * self.log_variance())
    }

    /// Variance in the square of the unit.
    pub(super) fn variance(self) -> f64 {
        self.mean() * self.mean() * libm::expm1(self.log_variance())
    }
}

/// The likely range of a sum.
pub(super) fn range_of(terms: &[Term]) -> Range {
    let (mean, variance) = moments(terms);
    if mean <= 0.0 {
        return Range::default();
    }
    let log_variance = libm::log1p(variance / (mean * mean));
    let median = mean * libm::exp(-0.5 * log_variance);
    let factor = libm::exp(SIGMAS * log_variance.sqrt());
    Range { low: median / factor, high: median * factor }
}

/// Share of the sum's variance that each term brings; all zero where nothing is uncertain.
pub(super) fn variance_shares(terms: &[Term]) -> Vec<f64> {
    let (_, variance) = moments(terms);
    let share = |term: &Term| if variance > 0.0 { lesser(term.variance() / variance, 1.0) } else { 0.0 };
    terms.iter().map(share).collect()
}

fn moments(terms: &[Term]) -> (f64, f64) {
    terms.iter().fold((0.0, 0.0), |(mean, variance), term| (mean + term.mean(), variance + term.variance()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_term_keeps_its_own_factor() {
        let range = range_of(&[Term { value: 12.0, factor: 3.0 }]);
        // A handful of exp and log calls, each within an ulp or two of numbers below 40.
        assert!((range.low - 4.0).abs() < 1e-13 && (range.high - 36.0).abs() < 1e-12, "{range:?}");
    }

    #[test]
    fn certain_terms_have_no_width_and_no_share() {
        let terms = [Term { value: 1.0, factor: 1.0 }, Term { value: 2.0, factor: 1.0 }];
        assert_eq!(range_of(&terms), Range { low: 3.0, high: 3.0 });
        assert_eq!(variance_shares(&terms), [0.0, 0.0]);
        assert_eq!(range_of(&[]), Range::default());
    }

    #[test]
    fn many_small_doubts_weigh_less_than_one_great_one() {
        let one = range_of(&[Term { value: 16.0, factor: 3.0 }]);
        let many = range_of(&[Term { value: 1.0, factor: 3.0 }; 16]);
        assert!(many.high - many.low < 0.5 * (one.high - one.low));
        let shares = variance_shares(&[Term { value: 10.0, factor: 3.0 }, Term { value: 1.0, factor: 3.0 }]);
        assert!((shares[0] - 100.0 / 101.0).abs() < 1e-12, "{shares:?}");
    }
}
