//! Poisson quantiles of dim columns: counts, and a mask of those in doubt.
//!
//! The distribution function is summed over a whole block at once, a few steps a round, until every column has its count.

use super::ranges::{ROUNDER, SERIES_MEAN_MIN, ordered};
use crate::draw::normal::{BLOCK, CENTRE};
use crate::num::{f32_from_i32, f32_nearest};

/// Steps of the distribution function that are tried; mean 5 comes within the doubt of 1 before 24.
const STEPS: usize = 33;
/// Steps between two looks at whether a block is done; in between everything stays in registers.
const STEPS_A_ROUND: usize = 3;

/// Half the width of the doubt around each step of the distribution function. Uniform and sum are off by 1e-6 at most.
const DOUBT: f32 = 2e-6;

/// Counts of the columns below 5 e- and their doubts; gives back whether any column of the block is in doubt. Where the block is `MIXED`
/// the others keep theirs. `room` holds values between rounds.
///
/// Logic is bitwise here: a short-circuit is a branch, and a branch keeps a loop from being vectorised.
#[inline(always)]
pub(super) fn by_summation<const MIXED: bool>(
    uniforms: &[u32; BLOCK],
    means_e: &[f32; BLOCK],
    room: [&mut [f32; BLOCK]; 6],
    values_e: &mut [f32; BLOCK],
    doubts: &mut [u32; BLOCK],
) -> u32 {
    let [below, dim_e, terms, sums, counts_e, nearest] = room;
    for column in 0..BLOCK {
        let mean_e = means_e[column];
        // Brighter and dark columns are computed with mean 0 and are done after one step.
        let mean_e = if (mean_e > 0.0) & (mean_e < SERIES_MEAN_MIN) { mean_e } else { 0.0 };
        dim_e[column] = mean_e;
        (terms[column], sums[column]) = exponent_and_rest(mean_e);
    }
    for column in 0..BLOCK {
        terms[column] = exp_minus(terms[column], sums[column]);
        let signed = (uniforms[column] ^ CENTRE).cast_signed();
        below[column] = f32_from_i32(signed) * (1.0 / 4_294_967_296.0) + 0.5;
    }
    (*sums, *counts_e, *nearest) = ([0.0; BLOCK], [0.0; BLOCK], [1.0; BLOCK]);
    for inverses in INVERSES.as_chunks::<STEPS_A_ROUND>().0 {
        let mut open = 0;
        for column in 0..BLOCK {
            let (mut sum, mut term, mut count_e) = (sums[column], terms[column], counts_e[column]);
            let mut near = nearest[column];
            for inverse in inverses {
                sum += term;
                term *= dim_e[column] * inverse;
                let gap = below[column] - sum;
                count_e += if gap > 0.0 { 1.0 } else { 0.0 };
                near = if gap.abs() < near { gap.abs() } else { near };
            }
            open |= u32::from((below[column] > sum) & (near >= DOUBT));
            (sums[column], terms[column], counts_e[column], nearest[column]) = (sum, term, count_e, near);
        }
        if open == 0 {
            break;
        }
    }
    // Copies, because a conditional store to where the value came from becomes a masked one, which is slow.
    let (others_e, others) = if MIXED { (*values_e, *doubts) } else { ([0.0; BLOCK], [0; BLOCK]) };
    let mut any = 0;
    for column in 0..BLOCK {
        let doubt = if nearest[column] < DOUBT { u32::MAX } else { 0 };
        let dim = !MIXED | (ordered(means_e[column]) < ordered(SERIES_MEAN_MIN));
        values_e[column] = if dim { counts_e[column] } else { others_e[column] };
        doubts[column] = if dim { doubt } else { others[column] };
        any |= doubts[column];
    }
    any
}

/// 1 / (k + 1).
const INVERSES: [f32; STEPS] = {
    let mut inverses = [0.0; STEPS];
    let mut k = 0;
    while k < STEPS {
        inverses[k] = f32_nearest(1.0 / (k + 1) as f64);
        k += 1;
    }
    inverses
};

/// For 0 <= x <= 8: a float whose low bits are the integer exponent of exp(-x), and the part of -x that it leaves.
#[inline(always)]
fn exponent_and_rest(x: f32) -> (f32, f32) {
    const LOG2_E: f32 = std::f32::consts::LOG2_E;
    // ln 2 in two parts, of which the first times any exponent here is exact.
    const LN_2_HIGH: f32 = 0.693_359_4;
    const LN_2_LOW: f32 = -0.000_212_194_44;
    let shifted = ROUNDER - x * LOG2_E;
    let exponent = shifted - ROUNDER;
    (shifted, (-x - exponent * LN_2_HIGH) - exponent * LN_2_LOW)
}

/// exp(-x) from its two parts, relative error below 3e-7.
#[inline(always)]
fn exp_minus(shifted: f32, r: f32) -> f32 {
    let r2 = r * r;
    let low = (1.0 + r) + r2 * (0.5 + r * (1.0 / 6.0));
    let high = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0));
    let power = low + (r2 * r2) * high;
    // The exponent's bits, moved up, add to the exponent of `power`.
    f32::from_bits(power.to_bits().wrapping_add(shifted.to_bits() << 23))
}
