//! Quantiles in f64. Computes the normal or Poisson quantile of U = (u + 1/2) / 2^32 for a 32-bit uniform u. The row kernels hand their
//! tails and undecided values to these functions, which use `libm` only, so that they give the same bits on every target.

use crate::num::{f64_from_i64, u32_truncated};

const TWO_TO_32: f64 = 4_294_967_296.0;

/// U and 1 - U of a uniform, both exact.
fn both_tails(uniform: u32) -> (f64, f64) {
    let below = (f64::from(uniform) + 0.5) / TWO_TO_32;
    (below, 1.0 - below)
}

/// Polynomial of ascending coefficients by Horner's rule.
fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, &coefficient| sum * x + coefficient)
}

/// The standard normal quantile of a uniform, relative error below 1e-14.
///
/// Wichura, "Algorithm AS 241: the percentage points of the normal distribution", Applied Statistics 37 (1988), 477-484.
pub fn normal_quantile(uniform: u32) -> f64 {
    let (below, above) = both_tails(uniform);
    let q = below - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180_625 - q * q;
        return q * horner(&CENTRE.0, r) / horner(&CENTRE.1, r);
    }
    let tail = if q < 0.0 { below } else { above };
    let r = (-libm::log(tail)).sqrt();
    // The least tail is 2^-33, where r is 4.78; the published method's third range begins at 5.
    let magnitude = horner(&MIDDLE.0, r - 1.6) / horner(&MIDDLE.1, r - 1.6);
    if q < 0.0 { -magnitude } else { magnitude }
}

/// Numerator and denominator for |U - 1/2| <= 0.425.
const CENTRE: ([f64; 8], [f64; 8]) = (
    [
        3.387_132_872_796_366_5,
        133.141_667_891_784_38,
        1_971.590_950_306_551_3,
        13_731.693_765_509_46,
        45_921.953_931_549_87,
        67_265.770_927_008_7,
        33_430.575_583_588_13,
        2_509.080_928_730_122_7,
    ],
    [
        1.0,
        42.313_330_701_600_91,
        687.187_007_492_057_9,
        5_394.196_021_424_751,
        21_213.794_301_586_597,
        39_307.895_800_092_71,
        28_729.085_735_721_943,
        5_226.495_278_852_854,
    ],
);

/// Numerator and denominator for tails from exp(-25) to 0.075.
const MIDDLE: ([f64; 8], [f64; 8]) = (
    [
        1.423_437_110_749_683_5,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        0.241_780_725_177_450_6,
        0.022_723_844_989_269_184,
        0.000_774_545_014_278_341_4,
    ],
    [
        1.0,
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        0.689_767_334_985_1,
        0.148_103_976_427_480_08,
        0.015_198_666_563_616_457,
        0.000_547_593_808_499_534_5,
        1.050_750_071_644_416_9e-9,
    ],
);

/// Below this mean the distribution function is summed from zero; from here on the asymptotic series decides first.
const SERIES_MEAN_MIN: f64 = 64.0;
/// From this mean on an f32 is an integer and no longer holds every count, and the series' error is under 1e-9.
const SUM_MEAN_MAX: f64 = 16_777_216.0;

/// The Poisson quantile of a uniform: the least k with P(N <= k) >= U. The mean is in electrons; 0, negative means and NaN
/// give 0, infinity gives itself.
pub fn poisson_quantile(uniform: u32, mean_e: f32) -> f64 {
    let mean_e = f64::from(mean_e);
    if mean_e.is_nan() || mean_e <= 0.0 {
        return 0.0;
    }
    if mean_e == f64::INFINITY {
        return mean_e;
    }
    if mean_e < SERIES_MEAN_MIN {
        return by_summation(uniform, mean_e);
    }
    let whole_e = mean_e.round_ties_even();
    let z = normal_quantile(uniform);
    let excess_e = (mean_e - whole_e) + series_excess(mean_e, z);
    let nearest_e = excess_e.round_ties_even();
    let undecided = (excess_e - nearest_e).abs() < series_error(mean_e, z) && mean_e < SUM_MEAN_MAX;
    if !undecided {
        return whole_e + excess_e.floor();
    }
    let candidate_e = whole_e + nearest_e - 1.0;
    if reaches(candidate_e, uniform, mean_e) { candidate_e } else { candidate_e + 1.0 }
}

fn by_summation(uniform: u32, mean_e: f64) -> f64 {
    let (below, _) = both_tails(uniform);
    let mut probability = libm::exp(-mean_e);
    let mut sum = probability;
    let mut count = 0.0;
    // Mean 64 reaches 1 - 2^-33 before 130; the bound only guards the loop.
    while sum < below && count < 300.0 {
        count += 1.0;
        probability *= mean_e / count;
        sum += probability;
    }
    count
}

/// Hands over, count by count, the least uniform whose Poisson quantile is above that count, as long as there is one. For means
/// below `SERIES_MEAN_MIN`, with the sums of `by_summation`, so that both decide alike.
pub(super) fn for_each_step(mean_e: f32, mut step: impl FnMut(u32)) {
    let mean_e = f64::from(mean_e);
    if mean_e.is_nan() || mean_e <= 0.0 {
        return;
    }
    let mut probability = libm::exp(-mean_e);
    let mut sum = probability;
    let mut count = 0.0;
    // u + 1/2 > 2^32 sum, in whole u; scaling by a power of two is exact.
    while sum * TWO_TO_32 < TWO_TO_32 - 0.5 && count < 300.0 {
        // Truncation takes -1/2 to 0 too, where rounding down would give -1: hence the comparison.
        let scaled = sum * TWO_TO_32 - 0.5;
        step(u32_truncated(scaled) + u32::from(scaled >= 0.0));
        count += 1.0;
        probability *= mean_e / count;
        sum += probability;
    }
}

/// Coefficients of z, z^3, z^5 in the term of order mean^-3/2, found numerically to 4 digits.
pub(super) const THREE_HALVES: [f64; 3] = [671.0 / 38_880.0, -137.0 / 38_880.0, -207.0 / 155_520.0];

/// The quantile less the mean, before rounding down: the normal quantile's asymptotic series in 1/sqrt(mean).
///
/// Giles, "Algorithm 955: approximation of the inverse Poisson cumulative distribution function", ACM TOMS 42 (2016), 7,
/// gives the terms up to 1/mean.
fn series_excess(mean_e: f64, z: f64) -> f64 {
    let root = mean_e.sqrt();
    let r = 1.0 / root;
    let y = z * z;
    let order_1 = 1.0 / 3.0 + y / 6.0;
    let order_2 = z * (-1.0 / 36.0 - y / 72.0);
    let order_3 = -8.0 / 405.0 + y * (7.0 / 810.0 + y / 270.0);
    let order_4 = z * horner(&THREE_HALVES, y);
    root * z + (order_1 + r * (order_2 + r * (order_3 + r * order_4)))
}

/// Bound of the series' error: the truncation, measured against the incomplete gamma function over |z| <= 6.4, and the
/// rounding of z.
fn series_error(mean_e: f64, z: f64) -> f64 {
    let y = z * z;
    (0.03 + 0.0012 * y * y * y) / (mean_e * mean_e) + 2e-14 * mean_e.sqrt() * (1.0 + z.abs())
}

/// Whether P(N <= count) >= U, decided on the tail that is smaller, so that nothing cancels.
fn reaches(count_e: f64, uniform: u32, mean_e: f64) -> bool {
    let (below, above) = both_tails(uniform);
    if below < 0.5 { tail_down(count_e, mean_e) >= below } else { tail_up(count_e + 1.0, mean_e) <= above }
}

/// P(N <= count), terms added until they no longer matter.
fn tail_down(count_e: f64, mean_e: f64) -> f64 {
    let mut term = probability(count_e, mean_e);
    let mut sum = term;
    let mut k = count_e;
    while k > 0.0 && term > 1e-18 * sum {
        term *= k / mean_e;
        sum += term;
        k -= 1.0;
    }
    sum
}

/// P(N >= count), terms added until they no longer matter.
fn tail_up(count_e: f64, mean_e: f64) -> f64 {
    let mut term = probability(count_e, mean_e);
    let mut sum = term;
    let mut k = count_e;
    while term > 1e-18 * sum {
        k += 1.0;
        term *= mean_e / k;
        sum += term;
    }
    sum
}

/// P(N = count) without cancellation, by Loader's saddle-point expansion ("Fast and accurate computation of binomial
/// probabilities", 2000). Counts are 10 and above here.
fn probability(count_e: f64, mean_e: f64) -> f64 {
    let inverse = 1.0 / count_e;
    let square = inverse * inverse;
    let stirling = inverse * horner(&[1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0, 1.0 / 1188.0], square);
    let exponent = -stirling - deviance(count_e, mean_e);
    libm::exp(exponent) / (2.0 * std::f64::consts::PI * count_e).sqrt()
}

/// count ln(count / mean) + mean - count.
fn deviance(count_e: f64, mean_e: f64) -> f64 {
    let difference = count_e - mean_e;
    let v = difference / (count_e + mean_e);
    if v.abs() > 0.1 {
        return count_e * libm::log(count_e / mean_e) - difference;
    }
    // 2 atanh(v) = ln(count / mean); at |v| = 0.1 the dropped term is 0.1^19 / 19, below rounding.
    let mut power = 2.0 * count_e * v;
    let mut sum = difference * v;
    for term in 1..9 {
        power *= v * v;
        sum += power / f64_from_i64(2 * term + 1);
    }
    sum
}
