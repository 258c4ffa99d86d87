//! What was known and decided before the first frame, as plain data. Units stand in the names.

use serde::{Deserialize, Serialize};

use crate::report::ordered::Ordered;

/// Effects kept and left out, and what leaving out can change at most.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanRecord {
    /// Names in physical order.
    pub kept: Vec<String>,
    /// Why each of them stays, with numbers, for a person.
    pub kept_reasons: Ordered<String>,
    /// In physical order.
    pub omitted: Vec<OmittedEffect>,
    /// Sum of all systematic bounds; none where something without a bound is left out.
    pub bias_e: Option<f64>,
    /// Root of the sum of all variance bounds; none as above.
    pub sigma_e: Option<f64>,
    /// Share of a pixel's noise that the sum was allowed to reach.
    pub accuracy: f64,
    /// The same in electrons, where a pixel's own noise is least.
    pub budget_e: f64,
    /// Share of the budget that the sum takes as a mean square error, where it is most; none as above.
    pub budget_used: Option<f64>,
    /// Predicted cost of the kept effects.
    pub cost_ns_per_px: f64,
    /// Predicted cost of all effects that the sensor has.
    pub cost_of_all_ns_per_px: f64,
    /// Predicted cost of the sensor without any effect.
    pub cost_of_none_ns_per_px: f64,
    /// Predicted time of the sensors of a frame of the rig on one core.
    pub sensor_ms_per_frame: f64,
    /// What was known before anything was simulated.
    pub facts: Vec<FactRecord>,
    /// Bounds of the signal by part of the picture.
    pub tiles: Vec<TileRecord>,
}

/// A quantity that was known before anything was simulated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FactRecord {
    /// With its unit.
    pub name: String,
    /// Least value of any frame.
    pub least: f64,
    /// Greatest value; none where nothing bounds it.
    pub greatest: Option<f64>,
    /// How it was found.
    pub how: String,
}

/// Mean electrons of any pixel of a part of the picture: its peak and its mean lie between both.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TileRecord {
    /// First column and the one after the last.
    pub columns: [u32; 2],
    /// First row and the one after the last.
    pub rows: [u32; 2],
    /// Least and greatest.
    pub signal_e: [f64; 2],
}

/// An effect that the facts do not call for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OmittedEffect {
    /// The effect's one name.
    pub name: String,
    /// Bound of its systematic part; none where nothing bounds it.
    pub bias_e: Option<f64>,
    /// Bound of its random part; none as above.
    pub sigma_e: Option<f64>,
    /// Its part of the budget, where all together take most of it; none as above.
    pub budget_share: Option<f64>,
    /// What leaving it out saves, predicted.
    pub cost_ns_per_px: f64,
    /// With numbers, for a person.
    pub reason: String,
}
