//! Read noise. Adds the read chain's noise, in microvolts.
//!
//! Model: one normal draw of sigma `read_noise_uv` per pixel and frame, after double sampling and at the ADC's input (EMVA 1288
//! release 4.0, temporal dark noise without quantisation); where both samples are converted, half its variance in each.

use super::params::PixelParams;
use super::sample_noise::{SampleNoise, SampleSigmas, SampledLevels};
use crate::effect::Effect;

/// Noise of source follower, column and comparator together; `None` where the chain is silent.
pub fn read_noise(params: &PixelParams, samples: SampledLevels) -> Option<Box<dyn Effect>> {
    SampleNoise::boxed("read_noise", 107, SampleSigmas::of_difference(params.read_noise_uv, samples))
}
