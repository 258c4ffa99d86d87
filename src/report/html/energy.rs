//! Energy by block with its uncertainty, the constants that decided it, and every constant with its source.

use super::parts::{section, table};
use crate::report::energy_record::Interval;
use crate::report::html::bars::{Bar, bars};
use crate::report::html::text::{digits, digits_within, escaped, grouped, percent, si_within};
use crate::report::record::Report;

/// Constants that are named as deciding; those below this share of the variance are not.
const DECIDING_SHARE: f64 = 0.01;

pub(super) fn energy(report: &Report) -> String {
    let energy = &report.energy;
    let lead = format!(
        "{} a frame in technology {}, of which {} mW flow whether or not anything happens. Whiskers: 95 % ranges from \
         the uncertainty of constants and model.",
        si_within(energy.total_pj_per_frame * 1e-12, "J", factor_of(energy.total_interval)),
        energy.technology,
        digits_within(energy.static_power_mw, factor_of(energy.total_interval))
    );
    let halves = format!("<div class=\"pair\"><div>{}</div><div>{}</div></div>", blocks(report), deciders(report));
    section("Energy", &lead, &format!("{halves}{}", entries(report)))
}

fn blocks(report: &Report) -> String {
    let energy = &report.energy;
    let bar = |(name, &pj): (&str, &f64)| {
        let interval = energy.blocks_interval.get(name).copied().unwrap_or_default();
        let text = si_within(pj * 1e-12, "J", factor_of(interval));
        Bar { label: name.to_owned(), value: pj, whisker: Some((interval.low_pj, interval.high_pj)), text }
    };
    bars("By block, per frame of the rig", &energy.blocks.iter().map(bar).collect::<Vec<_>>())
}

/// By how much a value may be off either way: half of the range's span on a logarithmic axis.
pub(super) fn factor_of(interval: Interval) -> f64 {
    if interval.low_pj > 0.0 { (interval.high_pj / interval.low_pj).sqrt() } else { f64::INFINITY }
}

fn deciders(report: &Report) -> String {
    let deciding = report.energy.deciders.iter().filter(|decider| decider.variance_share >= DECIDING_SHARE);
    let shown: Vec<_> = deciding
        .map(|decider| Bar::new(&spoken(&decider.name), decider.variance_share, percent(decider.variance_share)))
        .collect();
    if shown.is_empty() {
        return "<p class=\"note\">No constant is uncertain.</p>".to_owned();
    }
    bars("Constants that decided the answer: share of the total\u{2019}s variance", &shown)
}

fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

fn entries(report: &Report) -> String {
    let mut rows = String::new();
    for entry in &report.energy.entries {
        let unit = if entry.unit == "mW" { ("ms", "mW") } else { ("", "pJ") };
        rows += &format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td class=\"num\">{}\u{a0}{}</td><td class=\"num\">{}\u{a0}{}\
             </td><td class=\"num\">\u{d7}/\u{f7}\u{a0}{}</td><td class=\"num\">{}</td><td class=\"note\">{}</td></tr>",
            escaped(&spoken(&entry.name)),
            escaped(&entry.block),
            escaped(&entry.rail),
            if unit.0.is_empty() { grouped(entry.times_per_frame) } else { digits(entry.times_per_frame) },
            unit.0,
            digits_within(entry.constant, entry.uncertainty_factor),
            unit.1,
            digits(entry.uncertainty_factor),
            si_within(entry.pj_per_frame * 1e-12, "J", entry.uncertainty_factor),
            escaped(&entry.source)
        );
    }
    let heads = "event|block|rail|#per frame|#constant|#within|#energy|source";
    format!("<details><summary>Every event and constant</summary>{}</details>", table("", "", heads, &rows))
}
