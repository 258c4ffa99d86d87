//! Poisson quantiles of bright columns: counts, and a mask of those in doubt.
//!
//! The normal quantile's asymptotic series (`exact::series_excess`) in f32, as distance from the rounded mean so that no digits
//! are lost. A count is in doubt where the value before rounding down lies within its error bound of an integer.

use super::ranges::ROUNDER;
use crate::draw::exact::THREE_HALVES;
use crate::draw::normal::{BLOCK, CENTRE, one_less_square};
use crate::num::{f32_from_i32, f32_nearest};

/// Bound of the normal quantile's error and of the roundings that grow with it, in standard deviations, up to the tail's seam at
/// |z| = 3.23.
const NORMAL_ERROR: f32 = 3e-6;
/// t = -ln(1 - x^2) from which a column lies in the tail, which the polynomial does not serve.
const TAIL: f32 = 6.0;

/// Counts of a block and their doubts; gives back whether there is any. `BRIGHT` where no mean is below 256 e-. Columns below 5 e-
/// are left with any value and doubt. `room` holds values between passes.
#[inline(always)]
pub(super) fn by_series<const BRIGHT: bool>(
    uniforms: &[u32; BLOCK],
    means_e: &[f32; BLOCK],
    room: [&mut [f32; BLOCK]; 3],
    values_e: &mut [f32; BLOCK],
    doubts: &mut [u32; BLOCK],
) -> u32 {
    // `inverses` later holds the limits.
    let [values, roots_e, inverses] = room;
    for column in 0..BLOCK {
        values[column] = one_less_square(uniforms[column]);
        roots_e[column] = means_e[column].sqrt();
    }
    for column in 0..BLOCK {
        values[column] = minus_ln(values[column]);
        inverses[column] = 1.0 / roots_e[column];
    }
    for value in values.iter_mut() {
        *value = smooth(*value);
    }
    for column in 0..BLOCK {
        // Away from the tails the rounding of x near 1 is well inside `NORMAL_ERROR`.
        let x = f32_from_i32((uniforms[column] ^ CENTRE).cast_signed()) + 0.5;
        let z = x * values[column];
        let terms = if BRIGHT { bright_terms } else { all_terms };
        (values[column], inverses[column]) = terms(z, roots_e[column], inverses[column]);
    }
    let mut any = 0;
    for column in 0..BLOCK {
        let mean_e = means_e[column];
        let whole_e = (mean_e + ROUNDER) - ROUNDER;
        let excess_e = (mean_e - whole_e) + values[column];
        let floor_e = (excess_e + ROUNDER) - ROUNDER;
        values_e[column] = whole_e + floor_e;
        // In the tails and for a mean that is no number the comparison fails, which is a doubt too.
        let doubt = if (excess_e - floor_e).abs() < inverses[column] { 0 } else { u32::MAX };
        doubts[column] = doubt;
        any |= doubt;
    }
    any
}

/// Excess over the mean less 1/2, so that rounding to the nearest rounds the excess down; and how far that may lie from an integer.
///
/// Truncation is that of `exact::series_error` with a margin for means from 5 to 64; 4e-6 bounds the rounding of the terms near 1.
#[inline(always)]
fn all_terms(z: f32, root_e: f32, r: f32) -> (f32, f32) {
    const C1: f32 = f32_nearest(THREE_HALVES[0]);
    const C3: f32 = f32_nearest(THREE_HALVES[1]);
    const C5: f32 = f32_nearest(THREE_HALVES[2]);
    let r2 = r * r;
    let y = z * z;
    let order_2 = -1.0 / 36.0 - y * (1.0 / 72.0);
    let order_4 = (C1 + y * C3) + (y * y) * C5;
    let odd = z * (root_e + r * (order_2 + r2 * order_4));
    let truncation = (0.035 + 0.0014 * (y * y * y)) * (r2 * r2);
    ((order_1_less_half(y) + r2 * order_3(y)) + odd, (0.5 - 4e-6 - truncation) - NORMAL_ERROR * root_e)
}

/// The same for means from 256 e-: there the term of order mean^-3/2 is below 1.3e-4 e- at the tail's seam, and the truncation after
/// it below 2.2e-5 e-.
#[inline(always)]
fn bright_terms(z: f32, root_e: f32, r: f32) -> (f32, f32) {
    let y = z * z;
    let order_2 = -1.0 / 36.0 - y * (1.0 / 72.0);
    let odd = z * (root_e + r * order_2);
    ((order_1_less_half(y) + (r * r) * order_3(y)) + odd, (0.5 - 4e-6 - 1.3e-4 - 2.2e-5) - NORMAL_ERROR * root_e)
}

#[inline(always)]
fn order_1_less_half(y: f32) -> f32 {
    -1.0 / 6.0 + y * (1.0 / 6.0)
}

#[inline(always)]
fn order_3(y: f32) -> f32 {
    -8.0 / 405.0 + y * (7.0 / 810.0 + y * (1.0 / 270.0))
}

/// -ln(w) for 0 < w <= 1, absolute error below 2e-6 up to the tail's seam: minimax polynomial of degree 6 over half an octave on
/// either side of 1.
#[inline(always)]
fn minus_ln(w: f32) -> f32 {
    const ROOT_HALF_BITS: i32 = 0x3f35_04f3;
    let bits = w.to_bits().cast_signed();
    let exponent = (bits - ROOT_HALF_BITS) >> 23;
    let r = f32::from_bits((bits - (exponent << 23)).cast_unsigned()) - 1.0;
    let r2 = r * r;
    let low = (-1.000_012_8 + 0.499_850_5 * r) + r2 * (-0.332_258_73 + 0.254_724_64 * r);
    let high = -0.223_300_7 + 0.143_198_5 * r;
    r * (low + (r2 * r2) * high) - f32_from_i32(exponent) * std::f32::consts::LN_2
}

/// The normal quantile over x, over 2^31, as function of t; NaN in the tails. Minimax polynomial of degree 7, absolute error of the
/// quantile 7.3e-7.
#[inline(always)]
fn smooth(t: f32) -> f32 {
    const UNIT: f32 = 1.0 / 2_147_483_648.0;
    let t2 = t * t;
    let low =
        (1.253_317_4 * UNIT + (0.328_110_22 * UNIT) * t) + t2 * (0.016_300_482 * UNIT - (0.003_203_239 * UNIT) * t);
    let high = (-0.000_285_873_13 * UNIT + (0.000_121_304_9 * UNIT) * t)
        + t2 * (-0.000_012_584_37 * UNIT + (0.000_000_467_812_16 * UNIT) * t);
    let value = low + (t2 * t2) * high;
    if t < TAIL { value } else { f32::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::normal_quantile;

    /// Root, the sum beside it, their product with z and two more sums round: 4 * 2^-24 * 3.3 = 7.9e-7 standard deviations beside the
    /// quantile's own error.
    #[test]
    fn the_quick_quantile_stays_within_its_bound_up_to_the_seam() {
        let (mut worst, mut tried, mut tails) = (0.0_f64, 0, 0);
        for uniform in (0..=u32::MAX).step_by(997) {
            let x = f32_from_i32((uniform ^ CENTRE).cast_signed()) + 0.5;
            let z = x * smooth(minus_ln(one_less_square(uniform)));
            if z.is_nan() {
                tails += 1;
            } else {
                worst = worst.max((f64::from(z) - normal_quantile(uniform)).abs());
                tried += 1;
            }
        }
        println!("{tried} uniforms, {tails} in the tails, worst error {worst:.2e} standard deviations");
        assert!(tails > 5000 && tails < tried / 500);
        assert!(worst + 7.9e-7 < f64::from(NORMAL_ERROR), "{worst:e}");
    }
}
