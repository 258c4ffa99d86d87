//! Which effects the scene called for, and what leaving the others out can change at most.

use super::parts::{section, table};
use crate::report::html::text::{digits, escaped};
use crate::report::record::{FactRecord, OmittedEffect, PlanRecord, Report, TileRecord};

pub(super) fn plan(report: &Report) -> String {
    let plan = &report.plan;
    let lead = format!(
        "{} effects simulated, {} left out. Together the absent ones change a pixel by at most {} e\u{2212} \
         systematically and {} e\u{2212} (sigma) at random.",
        plan.kept.len(),
        plan.omitted.len(),
        bound(plan.bias_e),
        bound(plan.sigma_e)
    );
    let kept: String = plan.kept.iter().map(|name| kept_row(name, plan.kept_reasons.get(name))).collect();
    let omitted: String = plan.omitted.iter().map(omitted_row).collect();
    let heads = "effect|decision|#bias, e\u{2212}|#sigma, e\u{2212}|reason";
    let table = table("", "", heads, &(kept + &omitted));
    let costs = format!(
        "<p class=\"note\">Budget {} e\u{2212}, {} of a pixel\u{2019}s own noise where that is least; {} % of it is taken. \
         Predicted: {} ns a pixel for the effects kept, {} for all, {} without any; {} ms a frame for the sensors on one core.</p>",
        digits(plan.budget_e),
        digits(plan.accuracy),
        bound(plan.budget_used.map(|share| 100.0 * share)),
        digits(plan.cost_ns_per_px),
        digits(plan.cost_of_all_ns_per_px),
        digits(plan.cost_of_none_ns_per_px),
        digits(plan.sensor_ms_per_frame)
    );
    section("Effects: only what the scene calls for", &lead, &format!("{table}{costs}{}", facts(plan)))
}

/// A bound in digits, or that there is none.
fn bound(value: Option<f64>) -> String {
    value.map_or_else(|| "unbounded".to_owned(), digits)
}

/// What was known before the run, as intervals.
fn facts(plan: &PlanRecord) -> String {
    if plan.facts.is_empty() {
        return String::new();
    }
    let row = |fact: &FactRecord| {
        let greatest = bound(fact.greatest);
        format!(
            "<tr><th scope=\"row\">{}</th><td class=\"num\">{}</td><td class=\"num\">{greatest}</td><td class=\"note\">{}</td></tr>",
            escaped(&fact.name.replace('_', " ")),
            digits(fact.least),
            escaped(&fact.how)
        )
    };
    let rows: String = plan.facts.iter().map(row).collect();
    let tiles: String = plan.tiles.iter().map(tile_row).collect();
    table("", "", "known before the run|#least|#greatest|from", &(rows + &tiles))
}

fn tile_row(tile: &TileRecord) -> String {
    format!(
        "<tr><th scope=\"row\">signal e</th><td class=\"num\">{}</td><td class=\"num\">{}</td><td class=\"note\">columns {} to {}, \
         rows {} to {}</td></tr>",
        digits(tile.signal_e[0]),
        digits(tile.signal_e[1]),
        tile.columns[0],
        tile.columns[1] - 1,
        tile.rows[0],
        tile.rows[1] - 1
    )
}

fn kept_row(name: &str, reason: Option<&String>) -> String {
    let reason = reason.map_or("simulated in every pixel", String::as_str);
    format!(
        "<tr><th scope=\"row\">{}</th><td class=\"kept\">kept</td><td class=\"num\">\u{2013}</td>\
         <td class=\"num\">\u{2013}</td><td class=\"note\">{}</td></tr>",
        escaped(&name.replace('_', " ")),
        escaped(reason)
    )
}

fn omitted_row(effect: &OmittedEffect) -> String {
    format!(
        "<tr><th scope=\"row\">{}</th><td class=\"left\">left out</td><td class=\"num\">{}</td><td class=\"num\">{}\
         </td><td class=\"note\">{}</td></tr>",
        escaped(&effect.name.replace('_', " ")),
        bound(effect.bias_e),
        bound(effect.sigma_e),
        escaped(&effect.reason)
    )
}
