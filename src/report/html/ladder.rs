//! Section of the page that shows what accuracy costs in time: the reader picks an error and sees the time. It has no
//! scripts; the style sheet alone shows the answer of the chosen button.

use maud::{Markup, html};

use super::parts::Head::Text;
use super::parts::{section, style, table};
use crate::report::html::ladder_charts;
use crate::report::html::text::{digits, percent, si};
use crate::report::ladder_record::{LadderRecord, LadderRow};

/// Errors that a person may pick, in photon noise.
const CHOICES: [f64; 9] = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0];

pub(super) fn ladder(record: &LadderRecord) -> Markup {
    let reference = &record.reference;
    let lead = format!(
        "Errors against a reference of {} rays per pixel, converted clock by clock with all effects, whose own standard error is {} of \
         photon noise; it can judge errors from {} on. Times are processor time a frame of the rig, on {} threads.",
        digits(reference.rays_per_pixel),
        digits(reference.standard_error),
        digits(reference.finest),
        record.threads
    );
    let content = html! {
        (ladder_charts::rungs(record))
        (ladder_charts::charts(record))
        (picker(record))
        details { summary { "Every rung, knob and combination" } (settings(record)) }
    };
    section("What accuracy costs in time", &lead, content)
}

/// The fastest setting on the front whose error is at most this; one without a figure is finer than the reference can judge.
fn fastest(record: &LadderRecord, error: f64) -> Option<&LadderRow> {
    let good = |row: &&LadderRow| row.on_front && row.photon_noise_ratio.is_none_or(|ratio| ratio <= error);
    record.rows.iter().filter(good).min_by(|a, b| a.ms_per_frame.total_cmp(&b.ms_per_frame))
}

fn picker(record: &LadderRecord) -> Markup {
    let choices: Vec<(f64, &LadderRow)> = CHOICES
        .iter()
        .filter(|&&error| error >= record.reference.finest)
        .filter_map(|&error| Some((error, fastest(record, error)?)))
        .collect();
    if choices.is_empty() {
        return Markup::default();
    }
    let rule = |at: usize| format!("#ladder{at}:checked~.picked .answer{at}{{display:block}}");
    let rules: String = (0..choices.len()).map(rule).collect();
    html! {
        (style(&format!(".picked>div{{display:none}}{rules}")))
        fieldset {
            legend { "Error at most, in units of photon noise" }
            @for (at, (error, _)) in choices.iter().enumerate() {
                input type="radio" name="ladder" id={ "ladder" (at) } checked[at == 0];
                label for={ "ladder" (at) } { (digits(*error)) } " "
            }
            div.picked aria-live="polite" { @for (at, (_, row)) in choices.iter().enumerate() { (answer(at, row)) } }
        }
    }
}

fn answer(at: usize, row: &LadderRow) -> Markup {
    let reached = row.photon_noise_ratio.map_or("finer than can be judged".to_owned(), digits);
    html! {
        div class={ "answer" (at) } {
            p.number { (si(row.ms_per_frame * 1e-3, "s")) " " small { "a frame" } }
            p { (row.value) ": error " (reached) ", " (percent(row.time_ratio)) " of the reference\u{2019}s time." }
            pre tabindex="0" { (row.settings.join("\n")) }
        }
    }
}

fn settings(record: &LadderRecord) -> Markup {
    let heads = [
        "rung",
        "knob",
        "value",
        "ms",
        "of reference",
        "error",
        "rms DN",
        "max DN",
        "F1",
        "ATE",
        "jitter d2",
        "energy",
    ];
    table(&heads.map(Text), html! { @for row in &record.rows { (setting(row)) } })
}

fn setting(row: &LadderRow) -> Markup {
    let timed = (row.ms_per_frame > 0.0).then_some(row.ms_per_frame);
    let metres = |metres: f64| si(metres, "m");
    let figures = [
        timed.map(digits),
        timed.map(|_| percent(row.time_ratio)),
        row.photon_noise_ratio.map(digits),
        row.rms_dn.map(digits),
        row.max_dn.map(digits),
        row.feature_f1.map(digits),
        row.ate_m.map(metres),
        row.jitter_d2_m.map(metres),
        row.energy_error.map(|share| format!("{:+.3}\u{a0}%", 100.0 * share)),
    ];
    html! {
        tr {
            th scope="row" { (row.rung) }
            td { (row.knob.replace('_', " ")) }
            td.note { (row.value) }
            @for figure in figures { td.num { (figure.as_deref().unwrap_or("\u{2013}")) } }
        }
    }
}
