//! Noise of the comparator. Adds a normal draw in microvolts for each conversion and column.
//!
//! Model: the comparator's decision noise referred to its input, one draw per conversion. It adds to the read
//! noise, which has its own draw. A difference on a capacitor is converted once and so has one draw.

use super::params::AdcParams;
use crate::effect::Effect;
use crate::pixel::SampleNoise;

/// Decision noise of the comparators; `None` where they are silent.
pub fn comparator_noise(params: &AdcParams) -> Option<Box<dyn Effect>> {
    SampleNoise::boxed("comparator_noise", 206, params.sigmas_of_conversions(params.comparator_noise_uv))
}
