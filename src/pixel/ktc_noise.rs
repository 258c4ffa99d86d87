//! Reset noise. Adds the thermal noise of the resets that sampling does not remove, in microvolts.
//!
//! Model: sampling a capacitor leaves kT/C; at the ADC's input sqrt(A k T g / q) a reset. Double sampling
//! removes it where both samples share a reset (4T, 6T), doubles its variance where they do not (3T, 5T). The part that both
//! samples of one reset share is left out of both: it moves a conversion along the ramp and cancels in the difference.

use super::params::PixelParams;
use super::sample_noise::{SampleNoise, SampleSigmas, SampledLevels};
use crate::effect::Effect;

/// Thermal noise of the reset, as far as sampling leaves it; `None` where double sampling removes it.
pub fn ktc_noise(params: &PixelParams, samples: SampledLevels) -> Option<Box<dyn Effect>> {
    SampleNoise::boxed("ktc_noise", 106, ktc_sigmas(params, samples))
}

/// Sigmas of reset noise in the samples as they are converted.
pub fn ktc_sigmas(params: &PixelParams, samples: SampledLevels) -> SampleSigmas {
    if samples.is_double() && params.pixel_type.is_correlated() {
        return SampleSigmas { signal_uv: 0.0, reset_uv: 0.0 };
    }
    SampleSigmas::of_each(params.ktc_of_one_reset_uv(), samples)
}
