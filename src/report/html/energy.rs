//! Energy by block with its uncertainty, the constants that decided it, and every constant with its source.

use maud::{Markup, html};

use super::parts::Head::{Number, Text};
use super::parts::{pair, section, table};
use crate::report::energy_record::{EnergyEntry, Interval};
use crate::report::html::bars::{Bar, bars};
use crate::report::html::text::{digits, digits_within, grouped, percent, si_within};
use crate::report::record::Report;

/// Constants that are named as deciding; those below this share of the variance are not.
const DECIDING_SHARE: f64 = 0.01;

pub(super) fn energy(report: &Report) -> Markup {
    let energy = &report.energy;
    let lead = format!(
        "{} a frame in technology {}, of which {} mW flow whether or not anything happens. Whiskers: 95 % ranges from \
         the uncertainty of constants and model.",
        si_within(energy.total_pj_per_frame * 1e-12, "J", factor_of(energy.total_interval)),
        energy.technology,
        digits_within(energy.static_power_mw, factor_of(energy.total_interval))
    );
    let halves = pair(html! { div { (blocks(report)) } }, html! { div { (deciders(report)) } });
    section("Energy", &lead, html! { (halves) (entries(report)) })
}

fn blocks(report: &Report) -> Markup {
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

fn deciders(report: &Report) -> Markup {
    let deciding = report.energy.deciders.iter().filter(|decider| decider.variance_share >= DECIDING_SHARE);
    let shown: Vec<_> = deciding
        .map(|decider| Bar::new(&spoken(&decider.name), decider.variance_share, percent(decider.variance_share)))
        .collect();
    if shown.is_empty() {
        return html! { p.note { "No constant is uncertain." } };
    }
    bars("Constants that decided the answer: share of the total\u{2019}s variance", &shown)
}

fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

fn entries(report: &Report) -> Markup {
    let heads = [
        Text("event"),
        Text("block"),
        Text("rail"),
        Number("per frame"),
        Number("constant"),
        Number("within"),
        Number("energy"),
        Text("source"),
    ];
    let rows = html! { @for entry in &report.energy.entries { (row(entry)) } };
    html! { details { summary { "Every event and constant" } (table(&heads, rows)) } }
}

fn row(entry: &EnergyEntry) -> Markup {
    let is_power = entry.unit == "mW";
    let count = if is_power { digits(entry.times_per_frame) } else { grouped(entry.times_per_frame) };
    let (count_unit, unit) = if is_power { ("ms", "mW") } else { ("", "pJ") };
    html! {
        tr {
            th scope="row" { (spoken(&entry.name)) }
            td { (entry.block) }
            td { (entry.rail) }
            td.num { (count) "\u{a0}" (count_unit) }
            td.num { (digits_within(entry.constant, entry.uncertainty_factor)) "\u{a0}" (unit) }
            td.num { "\u{d7}/\u{f7}\u{a0}" (digits(entry.uncertainty_factor)) }
            td.num { (si_within(entry.pj_per_frame * 1e-12, "J", entry.uncertainty_factor)) }
            td.note { (entry.source) }
        }
    }
}
