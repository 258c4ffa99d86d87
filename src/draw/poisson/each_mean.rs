//! Poisson quantiles of a row whose pixels have each their own mean.

use super::super::exact::poisson_quantile;
use super::super::normal::{BLOCK, CENTRE, GROUP};
use super::ranges::{BRIGHT_MEAN_MIN, SERIES_MEAN_MAX, SERIES_MEAN_MIN, ordered};
use super::series::by_series;
use super::summation::by_summation;
use crate::num::f32_nearest;
use crate::simd::kernel;

kernel! {
    /// Replaces each mean (e-, any f32; 0, negative means and NaN give 0) by the Poisson quantile of its uniform. Exact to
    /// 2^24 e-, where f32 holds each integer; beyond that the quantile is rounded to the nearest f32.
    ///
    /// Panics if the slices differ in length.
    pub fn poisson<'a>(uniforms: &'a [u32], values_e: &'a mut [f32]) {
        assert!(uniforms.len() == values_e.len(), "a draw needs one uniform");
        let (uniforms, rest_uniforms) = uniforms.as_chunks::<BLOCK>();
        let (values_e, rest_e) = values_e.as_chunks_mut::<BLOCK>();
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

/// What a block is worked out in, kept from block to block so that it is cleared once a row.
pub(super) struct Room {
    means_e: [f32; BLOCK],
    doubts: [u32; BLOCK],
    values: [[f32; BLOCK]; 6],
}

#[inline(always)]
pub(super) fn block(uniforms: &[u32; BLOCK], values_e: &mut [f32; BLOCK], room: &mut Room) {
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
pub(super) fn decide(
    uniforms: &[u32; BLOCK],
    means_e: &[f32; BLOCK],
    doubts: &[u32; BLOCK],
    values_e: &mut [f32; BLOCK],
) {
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
