//! `sensel plan`: facts, effects kept and left out, bounds and reasons; simulates nothing.

use sensel::error::Error;
use sensel::run::Setup;
use serde_json::json;

use super::args::{ScenarioArguments, Shared};
use super::{listing, place, run};

/// `sensel plan`.
pub fn main(arguments: &ScenarioArguments, shared: &Shared) -> Result<(), Error> {
    let located = place::locate(arguments.scenario.as_deref(), shared, &[])?;
    let setup = run::prepare(located, shared)?;
    let plan = &setup.plan;
    if shared.json {
        let omitted: Vec<_> = plan
            .omitted
            .iter()
            .map(|e| json!({"name": e.name, "bias_e": e.bias_e, "sigma_e": e.sigma_e, "reason": e.reason}))
            .collect();
        let kept: Vec<_> = plan.kept.iter().map(|e| json!({"name": e.name, "reason": e.reason})).collect();
        listing::print_json(&json!({
            "kept": plan.kept.iter().map(|e| e.name).collect::<Vec<_>>(),
            "kept_reasons": kept,
            "omitted": omitted,
            "bias_e": plan.bias_e,
            "sigma_e": plan.sigma_e,
            "budget_e": plan.budget_e,
            "signal_e": plan.signal_e,
            "cost_ns_per_px": plan.cost_ns_per_px,
        }));
        return Ok(());
    }
    print_plan(&setup);
    Ok(())
}

fn print_plan(setup: &Setup) {
    let plan = &setup.plan;
    outln!(
        "signal      {:.3} to {:.0} e- a pixel, from the scene's light and the lens",
        plan.signal_e[0],
        plan.signal_e[1]
    );
    outln!(
        "budget      {:.3} e-: {} of a pixel's own noise where that is least",
        plan.budget_e,
        setup.fidelity.accuracy
    );
    outln!("kept");
    for effect in &plan.kept {
        outln!("  {:<14} {}", effect.name, effect.reason);
    }
    outln!("left out");
    for effect in &plan.omitted {
        outln!(
            "  {:<14} bias {:.2e} e-, sigma {:.2e} e-: {}",
            effect.name,
            effect.bias_e,
            effect.sigma_e,
            effect.reason
        );
    }
    if plan.omitted.is_empty() {
        outln!("  nothing");
    }
    outln!("bound       bias {:.2e} e-, sigma {:.2e} e- before quantisation", plan.bias_e, plan.sigma_e);
    outln!("cost        {:.1} ns a pixel predicted for the kept effects", plan.cost_ns_per_px);
}
