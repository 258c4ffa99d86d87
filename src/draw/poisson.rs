//! Poisson counts of a row: the exact Poisson quantile of each uniform, for means in electrons.
//!
//! One uniform a draw, no rejection, so a count never falls when its mean grows. Bright columns go by the normal quantile's
//! asymptotic series, dim ones by summing the distribution function. Each reports where its error might change the count;
//! those columns, a few in a thousand, go to `poisson_quantile` in f64, the slow twin. So the bits of the result do not
//! depend on how either is computed, as long as their error bounds hold.

mod one_mean;
mod series;
mod summation;

pub use one_mean::poisson_of_one_mean;

use self::series::by_series;
use self::summation::by_summation;
use super::exact::poisson_quantile;
use super::normal::{BLOCK, CENTRE, GROUP};
use crate::num::f32_nearest;
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

/// What a block is worked out in, kept from block to block so that it is cleared once a row.
struct Room {
    means_e: [f32; BLOCK],
    doubts: [u32; BLOCK],
    values: [[f32; BLOCK]; 6],
}

impl Kernel for Poisson<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (uniforms, rest_uniforms) = self.uniforms.as_chunks::<BLOCK>();
        let (values_e, rest_e) = self.values_e.as_chunks_mut::<BLOCK>();
        let mut room = Room { means_e: [0.0; BLOCK], doubts: [0; BLOCK], values: [[0.0; BLOCK]; 6] };
        for (uniforms, values_e) in uniforms.iter().zip(values_e) {
            block(uniforms, values_e, &mut room);
        }
        if rest_e.is_empty() {
            return;
        }
        let mut uniforms = [CENTRE; BLOCK];
        // The last mean is repeated, so that the padding adds no other branch.
        let mut padded_e = [rest_e[rest_e.len() - 1]; BLOCK];
        uniforms[..rest_uniforms.len()].copy_from_slice(rest_uniforms);
        padded_e[..rest_e.len()].copy_from_slice(rest_e);
        block(&uniforms, &mut padded_e, &mut room);
        rest_e.copy_from_slice(&padded_e[..rest_e.len()]);
    }
}

/// The bits of a float as an integer: among positive floats the same order; negative ones stay below zero, and a positive NaN lies
/// above infinity.
#[inline(always)]
const fn ordered(value: f32) -> i32 {
    value.to_bits().cast_signed()
}

/// Means from here on are served by the series, lower ones by summation.
const SERIES_MEAN_MIN: f32 = 5.0;
/// Blocks whose means all lie from here on do with fewer terms.
const BRIGHT_MEAN_MIN: f32 = 256.0;
/// Means from here on leave the range in which adding 1.5 * 2^23 rounds to an integer, and go to f64 one by one.
const SERIES_MEAN_MAX: f32 = 4_194_304.0;

#[inline(always)]
fn block(uniforms: &[u32; BLOCK], values_e: &mut [f32; BLOCK], room: &mut Room) {
    let (mut least, mut most) = (i32::MAX, i32::MIN);
    for &mean_e in values_e.iter() {
        least = least.min(ordered(mean_e));
        most = most.max(ordered(mean_e));
    }
    if most <= 0 {
        *values_e = [0.0; BLOCK];
        return;
    }
    let Room { means_e, doubts, values } = room;
    *means_e = *values_e;
    let mut any = 0;
    if least >= ordered(BRIGHT_MEAN_MIN) {
        let [a, b, c, ..] = values;
        any |= by_series::<true>(uniforms, means_e, [a, b, c], values_e, doubts);
    } else if most < ordered(SERIES_MEAN_MIN) {
        any |= by_summation::<false>(uniforms, means_e, values.each_mut(), values_e, doubts);
    } else {
        let [a, b, c, ..] = values;
        any |= by_series::<false>(uniforms, means_e, [a, b, c], values_e, doubts);
        if least < ordered(SERIES_MEAN_MIN) {
            any |= by_summation::<true>(uniforms, means_e, values.each_mut(), values_e, doubts);
        }
    }
    if most >= ordered(SERIES_MEAN_MAX) {
        for column in 0..BLOCK {
            doubts[column] |= if ordered(means_e[column]) >= ordered(SERIES_MEAN_MAX) { u32::MAX } else { 0 };
        }
        any = u32::MAX;
    }
    if any != 0 {
        decide(uniforms, means_e, doubts, values_e);
    }
}

/// Decides in f64 what the fast paths left open.
#[cold]
#[inline(never)]
fn decide(uniforms: &[u32; BLOCK], means_e: &[f32; BLOCK], doubts: &[u32; BLOCK], values_e: &mut [f32; BLOCK]) {
    for (group, open) in doubts.as_chunks::<GROUP>().0.iter().enumerate() {
        if open.iter().fold(0, |any, doubt| any | doubt) == 0 {
            continue;
        }
        for column in group * GROUP..(group + 1) * GROUP {
            if doubts[column] != 0 {
                values_e[column] = f32_nearest(poisson_quantile(uniforms[column], means_e[column]));
            }
        }
    }
}

/// Adding and subtracting 1.5 * 2^23 rounds |x| <= 2^22 to the nearest integer without a cast.
const ROUNDER: f32 = 12_582_912.0;

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
