//! Section of the page that shows what accuracy costs in time: the reader picks an error and sees the time. It has no
//! scripts; the style sheet alone shows the answer of the chosen button.

use super::parts::{self, section};
use crate::report::html::ladder_charts;
use crate::report::html::text::{digits, escaped, percent, si};
use crate::report::ladder_record::{LadderRecord, LadderRow};

/// Errors that a person may pick, in photon noise.
const CHOICES: [f64; 9] = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0];

pub(super) fn ladder(record: &LadderRecord) -> String {
    let reference = &record.reference;
    let lead = format!(
        "Errors against a reference of {} rays a pixel, converted clock by clock with all effects, whose own standard error is {} of \
         photon noise; it can judge errors from {} on. Times are processor time a frame of the rig, on {} threads.",
        digits(reference.rays_per_pixel),
        digits(reference.standard_error),
        digits(reference.finest),
        record.threads
    );
    let (rungs, charts) = (ladder_charts::rungs(record), ladder_charts::charts(record));
    let content = format!("{rungs}{charts}{}{}", picker(record), table(record));
    section("What accuracy costs in time", &lead, &content)
}

/// The fastest setting on the front whose error is at most this; one without a figure is finer than the reference can judge.
fn fastest(record: &LadderRecord, error: f64) -> Option<&LadderRow> {
    let good = |row: &&LadderRow| row.on_front && row.photon_noise_ratio.is_none_or(|ratio| ratio <= error);
    record.rows.iter().filter(good).min_by(|a, b| a.ms_per_frame.total_cmp(&b.ms_per_frame))
}

fn picker(record: &LadderRecord) -> String {
    let choices: Vec<(f64, &LadderRow)> = CHOICES
        .iter()
        .filter(|&&error| error >= record.reference.finest)
        .filter_map(|&error| Some((error, fastest(record, error)?)))
        .collect();
    if choices.is_empty() {
        return String::new();
    }
    let (mut buttons, mut answers, mut rules) = (String::new(), String::new(), String::new());
    for (at, (error, row)) in choices.iter().enumerate() {
        let checked = if at == 0 { " checked" } else { "" };
        buttons.push_str(&format!(
            "<input type=\"radio\" name=\"ladder\" id=\"ladder{at}\"{checked}><label for=\"ladder{at}\">{}</label> ",
            digits(*error)
        ));
        answers.push_str(&answer(at, row));
        rules.push_str(&format!("#ladder{at}:checked~.picked .answer{at}{{display:block}}"));
    }
    format!(
        "<style>.picked>div{{display:none}}{rules}</style><fieldset><legend>Error at most, in units of photon noise</legend>{buttons}\
         <div class=\"picked\" aria-live=\"polite\">{answers}</div></fieldset>"
    )
}

fn answer(at: usize, row: &LadderRow) -> String {
    let reached = row.photon_noise_ratio.map_or("finer than can be judged".to_owned(), digits);
    format!(
        "<div class=\"answer{at}\"><p class=\"number\">{} <small>a frame</small></p><p>{}: error {reached}, {} of the \
         reference\u{2019}s time.</p><pre tabindex=\"0\">{}</pre></div>",
        si(row.ms_per_frame * 1e-3, "s"),
        escaped(&row.value),
        percent(row.time_ratio),
        escaped(&row.settings.join("\n"))
    )
}

fn table(record: &LadderRecord) -> String {
    let number = |value: Option<f64>, words: &dyn Fn(f64) -> String| {
        format!("<td class=\"num\">{}</td>", value.map_or("\u{2013}".to_owned(), words))
    };
    let row = |row: &LadderRow| {
        let timed = (row.ms_per_frame > 0.0).then_some(row.ms_per_frame);
        format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"note\">{}</td>{}{}{}{}{}{}{}{}{}</tr>",
            escaped(&row.rung),
            escaped(&row.knob.replace('_', " ")),
            escaped(&row.value),
            number(timed, &digits),
            number(timed.map(|_| row.time_ratio), &percent),
            number(row.photon_noise_ratio, &digits),
            number(row.rms_dn, &digits),
            number(row.max_dn, &digits),
            number(row.feature_f1, &digits),
            number(row.ate_m, &|metres| si(metres, "m")),
            number(row.jitter_d2_m, &|metres| si(metres, "m")),
            number(row.energy_error, &|share| format!("{:+.3}\u{a0}%", 100.0 * share))
        )
    };
    let rows: String = record.rows.iter().map(row).collect();
    let heads = "rung|knob|value|ms|of reference|error|rms DN|max DN|F1|ATE|jitter d2|energy";
    format!(
        "<details><summary>Every rung, knob and combination</summary>{}</details>",
        parts::table("", "", heads, &rows)
    )
}
