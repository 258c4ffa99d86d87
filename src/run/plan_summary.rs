//! What the planner chose for a run, for the report.

use super::sensor::SensorSetup;
use crate::effects::costs;
use crate::effects::plan::{KeptEffect, Omitted, Plan};
use crate::num::f64_from_usize;

/// What the planner decided, without the effects themselves.
#[derive(Clone, Debug)]
pub struct PlanSummary {
    /// Run, in physical order.
    pub kept: Vec<KeptEffect>,
    /// Left out, in physical order.
    pub omitted: Vec<Omitted>,
    /// Sum of the systematic bounds in electrons, in the region where the whole bound is greatest.
    pub bias_e: f64,
    /// Root of the sum of the variances in electrons, in the same region.
    pub sigma_e: f64,
    /// What all omissions together were allowed to reach in the tightest region, in electrons.
    pub budget_e: f64,
    /// Share of it that they take as mean square errors, where that is most.
    pub budget_used: f64,
    /// Predicted cost of the kept effects.
    pub cost_ns_per_px: f64,
    /// Predicted cost of all effects that the sensor has.
    pub cost_of_all_ns_per_px: f64,
    /// Predicted cost of the sensor without any effect.
    pub cost_of_none_ns_per_px: f64,
    /// Predicted time of the sensors of one frame of the rig on one core, in milliseconds.
    pub sensor_ms_per_frame: f64,
    /// Bounds of a pixel's mean signal that the plan was made for, in electrons.
    pub signal_e: [f64; 2],
}

impl PlanSummary {
    pub(super) fn new(plan: Plan, signal_e: [f64; 2], sensor: &SensorSetup, cameras: usize) -> Self {
        let samples = sensor.parameters.adc.cds.samples();
        let cost_of_none_ns_per_px = costs::without_effects_ns_per_px(samples);
        let readings = sensor.schedule.slots().len() * if sensor.second.is_some() { 2 } else { 1 };
        let window = sensor.schedule.geometry().window();
        let pixels = f64::from(window.width_px) * f64::from(window.height_px) * f64_from_usize(readings * cameras);
        Self {
            sensor_ms_per_frame: 1e-6 * pixels * (plan.cost_ns_per_px + cost_of_none_ns_per_px),
            kept: plan.kept,
            omitted: plan.omitted,
            bias_e: plan.bound.bias_e,
            sigma_e: plan.bound.variance_e2.sqrt(),
            budget_e: plan.budget_e,
            budget_used: plan.budget_used,
            cost_ns_per_px: plan.cost_ns_per_px,
            cost_of_all_ns_per_px: plan.cost_of_all_ns_per_px,
            cost_of_none_ns_per_px,
            signal_e,
        }
    }
}
