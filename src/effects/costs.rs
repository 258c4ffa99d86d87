//! What effects cost, measured. Enters: an effect. Leaves: nanoseconds a pixel on one core.
//!
//! One table for the planner's prediction and for the documents, made by `cargo bench --profile dev --bench effects -- costs`: each
//! figure is the CPU time of a frame with the effect less that without it (the effect on top of shot noise and the conversion), median
//! of interleaved rounds, one thread, on a loaded machine in the profile of tests. A release build is faster.

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
    cost("prnu", "", 0.86),
    cost("parasitic_light", "", 0.26),
    cost("dead_pixels", "", 0.35),
    cost("shot_noise", "", 4.40),
    cost("dark_current", "", 1.02),
    cost("dark_current", "dcnu", 3.46),
    cost("hot_pixels", "", 0.43),
    cost("dsnu", "", 0.64),
    cost("blooming", "", 0.87),
    cost("image_lag", "", 27.0),
    cost("full_well", "", 0.76),
    cost("storage_leakage", "", 50.2),
    cost("gain_compression", "", 0.38),
    cost("die_gain", "", 0.40),
    cost("rts_noise", "", 0.58),
    cost("rts_noise", "double", 0.66),
    cost("flicker_noise", "", 4.68),
    cost("flicker_noise", "both", 4.20),
    cost("ktc_noise", "", 4.58),
    cost("ktc_noise", "both", 4.13),
    cost("read_noise", "", 4.51),
    cost("read_noise", "both", 3.93),
    cost("column_settling", "", 0.90),
    cost("stuck_pixels", "", 0.40),
    cost("column_gain", "", 0.50),
    cost("die_offset", "", 0.31),
    cost("column_offset", "", 0.21),
    cost("column_offset", "both", 0.01),
    cost("column_noise", "", 4.49),
    cost("row_noise", "", 1.1),
    cost("row_offset", "", 1.1),
    cost("comparator_noise", "", 4.58),
    cost("comparator_noise", "both", 4.24),
    cost("ramp_noise", "", 1.1),
    cost("ramp_noise", "both", 2.17),
    cost("ramp_jitter", "", 4.78),
    cost("ramp_jitter", "both", 4.46),
    cost("ramp_jitter", "bent", 24.0),
    cost("ramp_jitter", "bent, both", 45.8),
    cost("supply_ripple", "", 9.38),
    cost("supply_ripple", "both", 13.5),
];

/// What remains without any effect: charge of the light, its voltage, and the plain conversion of one sample a pixel, or of two.
pub const WITHOUT_EFFECTS: [f64; 2] = [4.6, 10.0];

/// Predicted cost of an effect in nanoseconds a pixel; 0 of one that is in no list, as tests make them.
pub fn ns_per_px(effect: &dyn Effect) -> f64 {
    let row = COSTS.iter().find(|row| row.effect == effect.name() && row.case == effect.cost_case());
    row.map_or(0.0, |row| row.ns_per_px)
}

/// Predicted cost of a sensor without any effect.
pub fn without_effects_ns_per_px(samples: Samples) -> f64 {
    WITHOUT_EFFECTS[usize::from(samples == Samples::Both)]
}
