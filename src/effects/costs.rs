//! Measured cost of each effect, in nanoseconds per pixel on one core.
//!
//! One table for the planner's prediction and for the documents, made by `cargo bench --bench effects -- costs`: each figure is the CPU
//! time of a frame with the effect less that without it (the effect on top of shot noise and the conversion; where both samples are
//! converted, on top of another noise of theirs too), median of 61 interleaved rounds, then of three runs; one thread, AVX2.

use crate::effect::Effect;
use crate::pixel::SampledLevels;

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectCost {
    /// The effect's one name.
    pub effect: &'static str,
    /// As `Effect::cost_case` says.
    pub case: &'static str,
    /// CPU time.
    pub ns_per_px: f64,
}

const fn cost(effect: &'static str, case: &'static str, ns_per_px: f64) -> EffectCost {
    EffectCost { effect, case, ns_per_px }
}

/// All effects in physical order, with every case that they know.
pub const COSTS: &[EffectCost] = &[
    cost("prnu", "", 0.56),
    cost("parasitic_light", "", 0.03),
    cost("dead_pixels", "", 0.19),
    cost("shot_noise", "", 2.20),
    cost("dark_current", "", 0.86),
    cost("dark_current", "dcnu", 2.97),
    cost("hot_pixels", "", 0.22),
    cost("dsnu", "", 0.51),
    cost("blooming", "", 0.70),
    cost("image_lag", "", 23.9),
    cost("full_well", "", 0.49),
    cost("storage_leakage", "", 47.5),
    cost("gain_compression", "", 0.13),
    cost("die_gain", "", 0.21),
    cost("rts_noise", "", 0.47),
    cost("rts_noise", "double", 0.63),
    cost("flicker_noise", "", 1.27),
    cost("flicker_noise", "both", 2.50),
    cost("ktc_noise", "", 1.26),
    cost("ktc_noise", "both", 2.54),
    cost("read_noise", "", 1.24),
    cost("read_noise", "both", 2.46),
    cost("column_settling", "", 0.69),
    cost("stuck_pixels", "", 0.18),
    cost("column_gain", "", 0.14),
    cost("die_offset", "", 0.13),
    cost("column_offset", "", 0.07),
    cost("column_offset", "both", 0.30),
    cost("column_noise", "", 1.29),
    cost("row_noise", "", 0.45),
    cost("row_offset", "", 0.41),
    cost("comparator_noise", "", 1.30),
    cost("comparator_noise", "both", 2.54),
    cost("ramp_noise", "", 0.44),
    cost("ramp_noise", "both", 0.91),
    cost("ramp_jitter", "", 1.29),
    cost("ramp_jitter", "both", 2.57),
    cost("ramp_jitter", "bent", 15.78),
    cost("ramp_jitter", "bent, both", 31.2),
    cost("supply_ripple", "", 6.36),
    cost("supply_ripple", "both", 12.50),
];

/// Predicted cost of an effect in nanoseconds per pixel; 0 of one that is in no list, as tests make them.
pub fn ns_per_px(effect: &dyn Effect) -> f64 {
    let row = COSTS.iter().find(|row| row.effect == effect.name() && row.case == effect.cost_case());
    row.map_or(0.0, |row| row.ns_per_px)
}

/// Predicted cost of a sensor without any effect: charge of the light, its voltage, and the plain conversion of one sample per pixel, or of
/// two.
pub fn without_effects_ns_per_px(samples: SampledLevels) -> f64 {
    if samples == SampledLevels::Both { 3.5 } else { 1.9 }
}
