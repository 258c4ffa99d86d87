//! Delays of the columns' comparators, in whole clocks of `adc_clk`, drawn once for each column of a die.
//!
//! Model: a comparator answers its slew and regeneration time after the crossing. The ramp that overdrives it is the same for all
//! columns, so the delay does not depend on the signal, and mismatch makes it differ from column to column of the die. A normal of
//! mean and sigma, rounded half-even to whole clocks, not below 0.

use super::params::AdcParams;
use crate::draw::{DrawKey, fill_uniforms, normals};
use crate::num::u32_truncated;

/// Published number of the delays' pattern: not an effect that a plan can leave out, but its draws have a name too.
pub const NUMBER: crate::draw::EffectNumber = crate::draw::EffectNumber(211);

/// Delay of each column; empty where all are 0.
pub fn delays_clk(params: &AdcParams, die: DrawKey, width: usize) -> Vec<u32> {
    let (mean_clk, sigma_clk) = (params.comparator_delay_clk, params.comparator_delay_sigma_clk);
    if sigma_clk == 0.0 {
        return if mean_clk == 0 { Vec::new() } else { vec![mean_clk; width] };
    }
    let (mut uniforms, mut draws) = (vec![0; width], vec![0.0; width]);
    fill_uniforms(die, &mut uniforms);
    normals(&uniforms, &mut draws);
    let delay_clk = |&draw: &f32| (f64::from(mean_clk) + sigma_clk * f64::from(draw)).round_ties_even();
    // A negative delay is none: the conversion saturates at 0.
    draws.iter().map(|draw| u32_truncated(delay_clk(draw))).collect()
}
