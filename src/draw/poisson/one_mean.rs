//! Poisson quantiles of a row of one mean in electrons.

use super::each_mean::poisson;
use crate::draw::exact::for_each_step;
use crate::draw::normal::BLOCK;
use crate::simd::kernel;

/// Below this mean the steps of the distribution function are few enough to compare each uniform with.
const STEPS_MEAN_MAX: f32 = 8.0;
/// Room for the steps of the brightest such mean.
const STEPS: usize = 48;

/// The Poisson quantile of each uniform under one mean for the whole row: the same values as `poisson`, faster where the mean
/// is below 8 e-, because the steps of the distribution function become integers once a row.
///
/// Panics if the slices differ in length.
pub fn poisson_of_one_mean(uniforms: &[u32], mean_e: f32, out_e: &mut [f32]) {
    assert!(uniforms.len() == out_e.len(), "a draw needs one uniform");
    if mean_e >= STEPS_MEAN_MAX {
        out_e.fill(mean_e);
        return poisson(uniforms, out_e);
    }
    let mut steps = Vec::with_capacity(STEPS);
    for_each_step(mean_e, |least| steps.push(least));
    count_reached(uniforms, &steps, out_e);
}

kernel! {
    /// The number of steps at or below each uniform. Steps ascend, so a block ends with the first that none of its uniforms reaches.
    fn count_reached<'a>(uniforms: &'a [u32], steps: &'a [u32], out_e: &'a mut [f32]) {
        let (uniforms, rest_uniforms) = uniforms.as_chunks::<BLOCK>();
        let (out_e, rest_e) = out_e.as_chunks_mut::<BLOCK>();
        for (uniforms, out_e) in uniforms.iter().zip(out_e) {
            count(uniforms, steps, out_e);
        }
        if rest_e.is_empty() {
            return;
        }
        let mut uniforms = [0; BLOCK];
        uniforms[..rest_uniforms.len()].copy_from_slice(rest_uniforms);
        let mut padded_e = [0.0; BLOCK];
        count(&uniforms, steps, &mut padded_e);
        rest_e.copy_from_slice(&padded_e[..rest_e.len()]);
    }
}

#[inline(always)]
fn count(uniforms: &[u32; BLOCK], steps: &[u32], counts_e: &mut [f32; BLOCK]) {
    let most = uniforms.iter().fold(0, |most, &uniform| uniform.max(most));
    *counts_e = [0.0; BLOCK];
    for &least in steps.iter().take_while(|&&least| least <= most) {
        for (count_e, &uniform) in counts_e.iter_mut().zip(uniforms) {
            *count_e += if uniform >= least { 1.0 } else { 0.0 };
        }
    }
}
