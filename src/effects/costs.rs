//! What effects cost, measured. Enters: an effect. Leaves: nanoseconds a pixel on one core.
//!
//! One table for the planner's prediction and for the documents, made by `cargo bench --bench effects -- costs`: each figure is the CPU
//! time of a frame with the effect less that without it (the effect on top of shot noise and the conversion), median of interleaved
//! rounds, on one thread of a machine with AVX2 or AVX-512. Another machine scales all rows alike; the plan's shares hold.

use crate::effect::Effect;
use crate::pixel::Samples;

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// The effect's one name.
    pub effect: &'static str,
    /// As `Effect::cost_case` says.
    pub case: &'static str,
    /// CPU time.
    pub ns_per_px: f64,
}

const fn cost(effect: &'static str, case: &'static str, ns_per_px: f64) -> Cost {
    Cost { effect, case, ns_per_px }
}

/// All effects in physical order, with every case that they know.
pub const COSTS: &[Cost] = &[
    cost("prnu", "", 0.3),
    cost("parasitic_light", "", 0.05),
    cost("dead_pixels", "", 0.05),
    cost("shot_noise", "", 1.9),
    cost("dark_current", "", 0.6),
    cost("dark_current", "dcnu", 1.8),
    cost("hot_pixels", "", 0.1),
    cost("dsnu", "", 0.3),
    cost("blooming", "", 0.5),
    cost("image_lag", "", 14.0),
    cost("full_well", "", 0.05),
    cost("storage_leakage", "", 9.0),
    cost("gain_compression", "", 0.05),
    cost("die_gain", "", 0.1),
    cost("rts_noise", "", 0.2),
    cost("rts_noise", "double", 0.4),
    cost("flicker_noise", "", 1.3),
    cost("flicker_noise", "both", 2.6),
    cost("ktc_noise", "", 1.3),
    cost("ktc_noise", "both", 2.6),
    cost("read_noise", "", 1.3),
    cost("read_noise", "both", 2.6),
    cost("column_settling", "", 1.5),
    cost("stuck_pixels", "", 0.05),
    cost("column_gain", "", 0.2),
    cost("die_offset", "", 0.1),
    cost("column_offset", "", 0.2),
    cost("column_offset", "both", 0.6),
    cost("column_noise", "", 1.3),
    cost("row_noise", "", 0.4),
    cost("row_offset", "", 0.4),
    cost("comparator_noise", "", 1.3),
    cost("comparator_noise", "both", 2.6),
    cost("ramp_noise", "", 0.4),
    cost("ramp_noise", "both", 0.8),
    cost("ramp_jitter", "", 1.3),
    cost("ramp_jitter", "both", 2.6),
    cost("ramp_jitter", "bent", 12.0),
    cost("ramp_jitter", "bent, both", 24.0),
    cost("supply_ripple", "", 6.0),
    cost("supply_ripple", "both", 12.0),
];

/// What remains without any effect: charge of the light, its voltage, and the plain conversion of one sample a pixel, or of two.
pub const WITHOUT_EFFECTS: [f64; 2] = [1.0, 2.0];

/// Predicted cost of an effect in nanoseconds a pixel; 0 of one that is in no list, as tests make them.
pub fn ns_per_px(effect: &dyn Effect) -> f64 {
    let row = COSTS.iter().find(|row| row.effect == effect.name() && row.case == effect.cost_case());
    row.map_or(0.0, |row| row.ns_per_px)
}

/// Predicted cost of a sensor without any effect.
pub fn without_effects_ns_per_px(samples: Samples) -> f64 {
    WITHOUT_EFFECTS[usize::from(samples == Samples::Both)]
}
