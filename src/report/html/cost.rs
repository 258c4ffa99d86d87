//! What the simulation itself cost in time, by stage.

use maud::Markup;

use super::parts::section;
use crate::report::html::bars::{Bar, bars};
use crate::report::html::text::si;
use crate::report::record::Report;

pub(super) fn cost(report: &Report) -> Markup {
    let seconds = |ms: f64| si(ms * 1e-3, "s");
    let total_ms: f64 = report.cost.iter().fold(0.0, |sum, (_, stage)| sum + stage.ms_per_frame);
    let stages = report.cost.iter().map(|(name, stage)| (name, stage.ms_per_frame));
    let shown: Vec<_> = stages.map(|(name, ms)| Bar::new(name, ms, seconds(ms))).collect();
    let fps = (total_ms > 0.0).then(|| super::text::digits(1e3 / total_ms));
    let rate = fps.map_or_else(String::new, |fps| format!(", {fps} frames a second"));
    let lead = format!("{} a frame of the rig{rate}, measured in this run.", seconds(total_ms));
    section("Cost in time", &lead, bars("By stage, per frame of the rig", &shown))
}
