//! Poisson counts of a row. Enters: uniforms and means in electrons. Leaves: the exact Poisson quantile of each uniform.
//!
//! One uniform a draw, no rejection, so a count never falls when its mean grows. From mean 8 the normal quantile's
//! asymptotic series decides wherever it lies further from an integer than its error bound; below 8 the distribution
//! function is summed over a whole chunk. What either leaves undecided goes to `poisson_quantile` in f64, the slow twin.

use super::exact::{THREE_HALVES, for_each_step, poisson_quantile};
use super::normal::{CENTRE, CHUNK, central};
use crate::num::{f32_from_i32, f32_nearest};
use crate::simd::{Kernel, dispatch};

/// Replaces each mean (e-, any f32; 0, negative means and NaN give 0) by the Poisson quantile of its uniform. Exact to
/// 2^24 e-, where f32 holds each integer; beyond that the quantile is rounded to the nearest f32.
///
/// Panics if the slices differ in length.
pub fn poisson(uniforms: &[u32], values_e: &mut [f32]) {
    assert!(uniforms.len() == values_e.len(), "a draw needs one uniform");
    dispatch(Poisson { uniforms, values_e });
}

struct Poisson<'a> {
    uniforms: &'a [u32],
    values_e: &'a mut [f32],
}

impl Kernel for Poisson<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (uniforms, rest_uniforms) = self.uniforms.as_chunks::<CHUNK>();
        let (values_e, rest_e) = self.values_e.as_chunks_mut::<CHUNK>();
        for (uniforms, values_e) in uniforms.iter().zip(values_e) {
            chunk(uniforms, values_e);
        }
        if rest_e.is_empty() {
            return;
        }
        let mut uniforms = [CENTRE; CHUNK];
        // The last mean is repeated, so that the padding adds no other branch.
        let mut padded_e = [rest_e[rest_e.len() - 1]; CHUNK];
        uniforms[..rest_uniforms.len()].copy_from_slice(rest_uniforms);
        padded_e[..rest_e.len()].copy_from_slice(rest_e);
        chunk(&uniforms, &mut padded_e);
        rest_e.copy_from_slice(&padded_e[..rest_e.len()]);
    }
}

/// Means from here on are served by the series, lower ones by summation.
const SERIES_MEAN_MIN: f32 = 8.0;
/// Means from here on leave the range in which adding 1.5 * 2^23 rounds to an integer, and go to f64 one by one.
const SERIES_MEAN_MAX: f32 = 4_194_304.0;

#[inline(always)]
fn chunk(uniforms: &[u32; CHUNK], values_e: &mut [f32; CHUNK]) {
    let (mut bright, mut dim, mut lit) = (0_u32, 0_u32, 0_u32);
    for &mean_e in values_e.iter() {
        bright |= u32::from(mean_e >= SERIES_MEAN_MIN);
        dim |= u32::from(mean_e < SERIES_MEAN_MIN) | u32::from(mean_e.is_nan());
        lit |= u32::from(mean_e > 0.0);
    }
    if lit == 0 {
        *values_e = [0.0; CHUNK];
        return;
    }
    let means_e = *values_e;
    let mut doubts = [0_u32; CHUNK];
    if bright != 0 {
        by_series(uniforms, &means_e, values_e, &mut doubts);
    }
    if dim != 0 {
        by_summation(uniforms, &means_e, values_e, &mut doubts);
    }
    let mut any = 0;
    for doubt in &doubts {
        any |= doubt;
    }
    if any != 0 {
        decide(uniforms, &means_e, &doubts, values_e);
    }
}

/// The Poisson quantile of each uniform under one mean for the whole row: the same values as `poisson`, faster where the mean
/// is below 8 e-, because the steps of the distribution function become integers once a row.
///
/// Panics if the slices differ in length.
pub fn poisson_of_one_mean(uniforms: &[u32], mean_e: f32, out_e: &mut [f32]) {
    assert!(uniforms.len() == out_e.len(), "a draw needs one uniform");
    if mean_e >= SERIES_MEAN_MIN {
        out_e.fill(mean_e);
        return poisson(uniforms, out_e);
    }
    out_e.fill(0.0);
    for_each_step(mean_e, |least| dispatch(CountReached { uniforms, least, out_e }));
}

/// Adds one where a uniform is at least `least`.
struct CountReached<'a> {
    uniforms: &'a [u32],
    least: u32,
    out_e: &'a mut [f32],
}

impl Kernel for CountReached<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (value_e, &uniform) in self.out_e.iter_mut().zip(self.uniforms) {
            *value_e += if uniform >= self.least { 1.0 } else { 0.0 };
        }
    }
}

/// Decides in f64 what the fast paths left open.
#[cold]
#[inline(never)]
fn decide(uniforms: &[u32; CHUNK], means_e: &[f32; CHUNK], doubts: &[u32; CHUNK], values_e: &mut [f32; CHUNK]) {
    for column in 0..CHUNK {
        if doubts[column] != 0 {
            values_e[column] = f32_nearest(poisson_quantile(uniforms[column], means_e[column]));
        }
    }
}

/// Adding and subtracting 1.5 * 2^23 rounds |x| <= 2^22 to the nearest integer without a cast.
const ROUNDER: f32 = 12_582_912.0;

/// The terms of `exact::series_excess` in f32, as distance from the rounded mean so that no digits are lost.
#[inline(always)]
fn by_series(uniforms: &[u32; CHUNK], means_e: &[f32; CHUNK], values_e: &mut [f32; CHUNK], doubts: &mut [u32; CHUNK]) {
    const C1: f32 = f32_nearest(THREE_HALVES[0]);
    const C3: f32 = f32_nearest(THREE_HALVES[1]);
    const C5: f32 = f32_nearest(THREE_HALVES[2]);
    let mut normals = [0.0_f32; CHUNK];
    for column in 0..CHUNK {
        (normals[column], doubts[column]) = central(uniforms[column]);
    }
    for column in 0..CHUNK {
        let (mean_e, z) = (means_e[column], normals[column]);
        let whole_e = (mean_e + ROUNDER) - ROUNDER;
        let root = mean_e.sqrt();
        let r = 1.0 / root;
        let r2 = r * r;
        let y = z * z;
        let order_1 = 1.0 / 3.0 + y * (1.0 / 6.0);
        let order_2 = -1.0 / 36.0 - y * (1.0 / 72.0);
        let order_3 = -8.0 / 405.0 + y * (7.0 / 810.0 + y * (1.0 / 270.0));
        let order_4 = (C1 + y * C3) + (y * y) * C5;
        let odd = z * (root + r * (order_2 + r2 * order_4));
        let excess_e = (mean_e - whole_e) + ((order_1 + r2 * order_3) + odd);
        let nearest_e = (excess_e + ROUNDER) - ROUNDER;
        let floor_e = if nearest_e > excess_e { nearest_e - 1.0 } else { nearest_e };
        // Truncation as in `exact::series_error`; 1e-6 bounds z's relative error, 4e-6 the rounding of the terms near 1.
        let truncation = (0.03 + 0.0012 * (y * y * y)) * (r2 * r2);
        let error = truncation + (1e-6 * (root * z).abs() + 4e-6);
        let near = if (excess_e - nearest_e).abs() < error { u32::MAX } else { 0 };
        let beyond = if mean_e >= SERIES_MEAN_MAX { u32::MAX } else { 0 };
        values_e[column] = whole_e + floor_e;
        doubts[column] |= near | beyond;
    }
}

/// Steps of the distribution function that are tried; mean 8 comes within the doubt of 1 before 32.
const STEPS: usize = 48;
/// Steps between two looks at whether a chunk is done; in between everything stays in registers.
const STEPS_A_ROUND: usize = 4;

/// Half the width of the doubt around each step of the distribution function. Uniform and sum are off by 1e-6 at most.
const DOUBT: f32 = 2e-6;

/// Logic is bitwise here: a short-circuit is a branch, and a branch keeps a loop from being vectorised.
#[inline(always)]
fn by_summation(
    uniforms: &[u32; CHUNK],
    means_e: &[f32; CHUNK],
    values_e: &mut [f32; CHUNK],
    doubts: &mut [u32; CHUNK],
) {
    let mut below = [0.0_f32; CHUNK];
    let mut dim_e = [0.0_f32; CHUNK];
    let mut terms = [0.0_f32; CHUNK];
    for column in 0..CHUNK {
        let signed = (uniforms[column] ^ CENTRE).cast_signed();
        below[column] = f32_from_i32(signed) * (1.0 / 4_294_967_296.0) + 0.5;
        let mean_e = means_e[column];
        // Brighter and dark columns ride along at mean 0 and are done after one step.
        dim_e[column] = if (mean_e > 0.0) & (mean_e < SERIES_MEAN_MIN) { mean_e } else { 0.0 };
        terms[column] = exp_minus(dim_e[column]);
    }
    let (mut sums, mut counts, mut nearest) = ([0.0_f32; CHUNK], [0.0_f32; CHUNK], [1.0_f32; CHUNK]);
    for inverses in INVERSES.as_chunks::<STEPS_A_ROUND>().0 {
        let mut open = 0;
        for column in 0..CHUNK {
            let (mut sum, mut term, mut count) = (sums[column], terms[column], counts[column]);
            let mut near = nearest[column];
            for inverse in inverses {
                sum += term;
                term *= dim_e[column] * inverse;
                let gap = below[column] - sum;
                count += if gap > 0.0 { 1.0 } else { 0.0 };
                near = if gap.abs() < near { gap.abs() } else { near };
            }
            open |= u32::from((below[column] > sum) & (near >= DOUBT));
            (sums[column], terms[column], counts[column], nearest[column]) = (sum, term, count, near);
        }
        if open == 0 {
            break;
        }
    }
    for column in 0..CHUNK {
        let dim = means_e[column].is_nan() | (means_e[column] < SERIES_MEAN_MIN);
        values_e[column] = if dim { counts[column] } else { values_e[column] };
        let doubt = if nearest[column] < DOUBT { u32::MAX } else { 0 };
        doubts[column] = if dim { doubt } else { doubts[column] };
    }
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

/// exp(-x) for 0 <= x <= 8, relative error below 3e-7.
#[inline(always)]
fn exp_minus(x: f32) -> f32 {
    const LOG2_E: f32 = std::f32::consts::LOG2_E;
    // ln 2 in two parts, of which the first times any exponent here is exact.
    const LN_2_HIGH: f32 = 0.693_359_4;
    const LN_2_LOW: f32 = -0.000_212_194_44;
    let shifted = ROUNDER - x * LOG2_E;
    let exponent = shifted - ROUNDER;
    let r = (-x - exponent * LN_2_HIGH) - exponent * LN_2_LOW;
    let r2 = r * r;
    let low = (1.0 + r) + r2 * (0.5 + r * (1.0 / 6.0));
    let high = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0));
    let power = low + (r2 * r2) * high;
    // The low bits of `shifted` hold the integer exponent; moved up they add to the exponent of `power`.
    f32::from_bits(power.to_bits().wrapping_add(shifted.to_bits() << 23))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{DrawKey, fill_uniforms};

    fn check_scan(means_e: impl Iterator<Item = f32>, uniforms_a_mean: usize) -> (u64, f32) {
        let (mut tried, mut last_e) = (0, 0.0);
        for (case, mean_e) in means_e.enumerate() {
            let mut uniforms = vec![0; uniforms_a_mean];
            fill_uniforms(DrawKey::root(case as u64), &mut uniforms);
            uniforms[..6].copy_from_slice(&[0, 1, u32::MAX, u32::MAX - 1, CENTRE, CENTRE - 1]);
            let mut values_e = vec![mean_e; uniforms.len()];
            poisson(&uniforms, &mut values_e);
            for (&uniform, &value_e) in uniforms.iter().zip(&values_e) {
                let exact_e = poisson_quantile(uniform, mean_e);
                assert_eq!(f64::from(value_e), f64::from(f32_nearest(exact_e)), "mean {mean_e}, uniform {uniform}");
                tried += 1;
            }
            last_e = mean_e;
        }
        (tried, last_e)
    }

    #[test]
    fn the_row_kernel_equals_its_slow_twin_over_all_means() {
        let (tried, last_e) = check_scan((0..600_u16).map(|step| 0.01 * libm::powf(1.036, step.into())), 5000);
        println!("{tried} draws up to mean {last_e}");
        assert!(tried == 3_000_000 && last_e > 1e7);
    }

    #[test]
    fn a_row_of_one_mean_equals_a_row_of_means() {
        for (case, mean_e) in [0.0, -1.0, f32::NAN, 1e-9, 0.02, 0.7, 3.0, 7.999, 8.0, 500.0].into_iter().enumerate() {
            let mut uniforms = vec![0; 20_000];
            fill_uniforms(DrawKey::root(case as u64), &mut uniforms);
            uniforms[..4].copy_from_slice(&[0, 1, u32::MAX, u32::MAX - 1]);
            let (mut values_e, mut out_e) = (vec![mean_e; 20_000], vec![1.0; 20_000]);
            poisson(&uniforms, &mut values_e);
            poisson_of_one_mean(&uniforms, mean_e, &mut out_e);
            assert_eq!(values_e, out_e, "mean {mean_e}");
        }
    }

    #[test]
    fn zero_negative_and_nan_means_give_zero_and_infinity_itself() {
        let mut values_e = [0.0, -0.0, -1.0, f32::NAN, f32::INFINITY, 9.0, 1e-30];
        poisson(&[u32::MAX, 0, 5, u32::MAX, 7, CENTRE, u32::MAX], &mut values_e);
        assert_eq!(values_e, [0.0, 0.0, 0.0, 0.0, f32::INFINITY, 9.0, 0.0]);
    }
}
