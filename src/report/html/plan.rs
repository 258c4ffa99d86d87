//! Which effects the scene called for, and what leaving the others out can change at most.

use maud::{Markup, html};

use super::parts::Head::{Number, Text};
use super::parts::{section, table};
use crate::report::html::text::digits;
use crate::report::record::{PlanRecord, Report};

pub(super) fn plan(report: &Report) -> Markup {
    let plan = &report.plan;
    let lead = format!(
        "{} effects simulated, {} left out. Together the absent ones change a pixel by at most {} e\u{2212} \
         systematically and {} e\u{2212} (sigma) at random.",
        plan.kept.len(),
        plan.omitted.len(),
        bound(plan.bias_e),
        bound(plan.sigma_e)
    );
    let content = html! {
        (effects(plan))
        p.note {
            "Budget " (digits(plan.budget_e)) " e\u{2212}, " (digits(plan.accuracy)) " of a pixel\u{2019}s own noise where that is least; "
            (bound(plan.budget_used.map(|share| 100.0 * share))) " % of it is taken. "
            "Predicted: " (digits(plan.cost_ns_per_px)) " ns per pixel for the effects kept, "
            (digits(plan.cost_of_all_ns_per_px)) " for all, " (digits(plan.cost_of_none_ns_per_px)) " without any; "
            (digits(plan.sensor_ms_per_frame)) " ms per frame for the sensors on one core."
        }
        @if !plan.facts.is_empty() { (facts(plan)) }
    };
    section("Effects: only what the scene calls for", &lead, content)
}

fn effects(plan: &PlanRecord) -> Markup {
    let heads =
        [Text("effect"), Text("decision"), Number("bias, e\u{2212}"), Number("sigma, e\u{2212}"), Text("reason")];
    let rows = html! {
        @for name in &plan.kept {
            tr {
                th scope="row" { (name.replace('_', " ")) }
                td.kept { "kept" }
                td.num { "\u{2013}" }
                td.num { "\u{2013}" }
                td.note { (plan.kept_reasons.get(name).map_or("simulated in every pixel", String::as_str)) }
            }
        }
        @for effect in &plan.omitted {
            tr {
                th scope="row" { (effect.name.replace('_', " ")) }
                td.left { "left out" }
                td.num { (bound(effect.bias_e)) }
                td.num { (bound(effect.sigma_e)) }
                td.note { (effect.reason) }
            }
        }
    };
    table(&heads, rows)
}

/// A bound in digits, or that there is none.
fn bound(value: Option<f64>) -> String {
    value.map_or_else(|| "unbounded".to_owned(), digits)
}

/// What was known before the run, as intervals.
fn facts(plan: &PlanRecord) -> Markup {
    let heads = [Text("known before the run"), Number("least"), Number("greatest"), Text("from")];
    let rows = html! {
        @for fact in &plan.facts {
            tr {
                th scope="row" { (fact.name.replace('_', " ")) }
                td.num { (digits(fact.least)) }
                td.num { (bound(fact.greatest)) }
                td.note { (fact.how) }
            }
        }
        @for tile in &plan.tiles {
            @let ([left, right], [top, bottom]) = (tile.columns, tile.rows);
            tr {
                th scope="row" { "signal e" }
                td.num { (digits(tile.signal_e[0])) }
                td.num { (digits(tile.signal_e[1])) }
                td.note { "columns " (left) " to " (right - 1) ", rows " (top) " to " (bottom - 1) }
            }
        }
    };
    table(&heads, rows)
}
