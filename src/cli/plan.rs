//! `sensel plan`: facts, effects kept and left out, bounds, costs and reasons; simulates nothing.

use sensel::error::Error;
use sensel::facts::{Fact, Tile, readable};
use sensel::run::setup::PlanSummary;
use sensel::run::{Setup, Warnings};
use serde_json::{Value, json};

use super::args::{CommonOptions, PlanArguments};
use super::{listing, paths, setup, words};

pub fn main(arguments: &PlanArguments, shared: &CommonOptions) -> Result<(), Error> {
    let effects = arguments.effects.as_ref().map(|effects| format!("run.effects='{effects}'"));
    let more: Vec<String> = effects.into_iter().collect();
    let located = paths::locate(arguments.scenario.as_deref(), shared, &more)?;
    let setup = setup::prepare(located, shared)?;
    let mut warnings = setup.warnings.clone();
    setup.sensor.extractor_warning().into_iter().for_each(|text| warnings.add(text));
    words::warn(warnings.texts());
    if shared.json {
        listing::print_json(&as_json(&setup, &warnings));
    } else {
        print_facts(&setup);
        print_plan(&setup.plan, setup.fidelity.accuracy);
    }
    Ok(())
}

fn as_json(setup: &Setup, warnings: &Warnings) -> Value {
    let plan = &setup.plan;
    let omitted = plan.omitted.iter().map(|e| {
        json!({
            "name": e.name, "bias_e": e.bias_e, "sigma_e": e.sigma_e, "budget_share": e.budget_share,
            "is_bounded": e.bias_e.is_finite(),
            "cost_ns_per_px": e.cost_ns_per_px, "reason": e.reason, "words": e.words(plan.budget_e),
        })
    });
    let kept = plan.kept.iter().map(|e| {
        json!({
            "name": e.name, "error_e": e.error_e, "cost_ns_per_px": e.cost_ns_per_px, "reason": e.reason,
            "words": e.words(plan.budget_e),
        })
    });
    // What nothing bounds has no number in JSON.
    let fact =
        |fact: &Fact| json!({"name": fact.name, "least": fact.least, "greatest": fact.greatest, "how": fact.how});
    let tile = |tile: &Tile| json!({"columns": tile.columns, "rows": tile.rows, "signal_e": tile.signal_e});
    json!({
        "facts": setup.facts.facts.iter().map(fact).collect::<Vec<_>>(),
        "tiles": setup.facts.tiles.iter().map(tile).collect::<Vec<_>>(),
        "kept": plan.kept.iter().map(|e| e.name).collect::<Vec<_>>(),
        "kept_reasons": kept.collect::<Vec<_>>(),
        "omitted": omitted.collect::<Vec<_>>(),
        "is_bounded": plan.bias_e.is_finite(), "bias_e": plan.bias_e, "sigma_e": plan.sigma_e,
        "budget_e": plan.budget_e, "budget_used": plan.budget_used, "signal_e": plan.signal_e,
        "cost_ns_per_px": plan.cost_ns_per_px, "cost_of_all_ns_per_px": plan.cost_of_all_ns_per_px,
        "cost_of_none_ns_per_px": plan.cost_of_none_ns_per_px, "sensor_ms_per_frame": plan.sensor_ms_per_frame,
        "warnings": warnings.texts(),
    })
}

fn print_facts(setup: &Setup) {
    outln!("facts       the truth of every frame lies between both ends");
    for fact in &setup.facts.facts {
        let ends = format!("{} to {}", readable(fact.least), readable(fact.greatest));
        outln!("  {:<24} {ends:<20} {}", fact.name, fact.how);
    }
    outln!("signal by part of the picture, e-");
    for row in setup.facts.tiles.chunk_by(|a, b| a.rows == b.rows) {
        let ends = row.iter().map(|tile| format!("{} to {}", readable(tile.signal_e[0]), readable(tile.signal_e[1])));
        outln!("  {}", ends.map(|ends| format!("{ends:<24}")).collect::<String>().trim_end());
    }
}

fn print_plan(plan: &PlanSummary, accuracy: f64) {
    outln!(
        "budget      {} e-: {accuracy} of a pixel's own noise where that is least; {:.1} % taken as a mean square",
        readable(plan.budget_e),
        100.0 * plan.budget_used
    );
    outln!("kept");
    for effect in &plan.kept {
        outln!("  {:<17} {:>5.2} ns/px  {}", effect.name, effect.cost_ns_per_px, effect.words(plan.budget_e));
    }
    outln!("left out");
    for effect in &plan.omitted {
        let (words, percent) = (effect.words(plan.budget_e), 100.0 * effect.budget_share);
        let [bias, sigma] = [effect.bias_e, effect.sigma_e].map(readable);
        outln!(
            "  {:<17} {:>5.2} ns/px  {words}; at most {bias} e- and sigma {sigma} e-, {percent:.1} % of the budget",
            effect.name,
            effect.cost_ns_per_px
        );
    }
    if plan.omitted.is_empty() {
        outln!("  nothing");
    }
    outln!("bound       bias {} e-, sigma {} e- before quantisation", readable(plan.bias_e), readable(plan.sigma_e));
    outln!(
        "cost        {:.1} ns per pixel predicted for the kept effects, {:.1} for all, {:.1} without any; sensors {} ms per frame",
        plan.cost_ns_per_px,
        plan.cost_of_all_ns_per_px,
        plan.cost_of_none_ns_per_px,
        readable(plan.sensor_ms_per_frame)
    );
}
