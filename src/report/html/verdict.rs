//! The answers first: does the design hold, in one line each.

use maud::{Markup, html};

use crate::num::{f64_from_u64, f64_from_usize, greater};
use crate::report::html::text::{digits, grouped, percent, si};
use crate::report::record::Report;

/// Frames with a pose, at least, for a run that counts as tracked.
const TRACKED_MIN: f64 = 0.95;
/// Mean code above black, as a share of the range, of a picture that is neither dark nor bright.
const EXPOSED: [f64; 2] = [0.05, 0.8];
/// Render variance over photon variance up to which the figures are the sensor's.
pub(super) const RENDER_MAX: f64 = 0.4;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Yes,
    No,
    /// The question does not arise, or was not measured.
    Open,
}

type Verdict = (Answer, String);

pub(super) fn verdict(report: &Report) -> Markup {
    let lines = [
        ("Does the extractor keep up?", keeps_up(report)),
        ("Is the budget of a line met?", line_budget(report)),
        ("Is the pose tracked?", tracked(report)),
        ("Is the exposure sane?", exposed(report)),
        ("Is the error the sensor\u{2019}s own?", render(report)),
    ];
    html! {
        section.answers {
            h2 { "Does this design hold?" }
            table { tbody { @for (question, (answer, words)) in lines { (line(question, answer, &words)) } } }
        }
    }
}

fn line(question: &str, answer: Answer, words: &str) -> Markup {
    let (class, word) = match answer {
        Answer::Yes => ("good", "yes"),
        Answer::No => ("bad", "no"),
        Answer::Open => ("open", "\u{2013}"),
    };
    html! { tr class=(class) { th scope="row" { (question) } td.answer { (word) } td { (words) } } }
}

fn keeps_up(report: &Report) -> Verdict {
    let Some(clocks) = &report.timing.extractor else {
        return (Answer::Open, "The sensor extracts nothing.".to_owned());
    };
    let [required, available] = [clocks.required, clocks.available].map(|clk| grouped(f64_from_u64(clk)));
    if clocks.keeps_up {
        let spare = percent(1.0 - f64_from_u64(clocks.required) / greater(f64_from_u64(clocks.available), 1.0));
        let words = format!("{required} clocks of a frame\u{2019}s {available}; {spare} are spare.");
        return (Answer::Yes, words);
    }
    let over = grouped(f64_from_u64(clocks.frames_over));
    let words = format!(
        "{required} clocks are needed of a frame\u{2019}s {available}; {over} camera frames needed more clocks than a frame has. Use {}.",
        clocks.remedy
    );
    (Answer::No, words)
}

fn line_budget(report: &Report) -> Verdict {
    let timing = &report.timing;
    let used_us = timing.line.iter().map(|phase| phase.end_us).fold(0.0, greater);
    let stalled = report.link.rows_stalled;
    let spare = format!(
        "{} of a line\u{2019}s {} are used; the link is busy {} of a line that is sent.",
        si(used_us * 1e-6, "s"),
        si(timing.line_time_us * 1e-6, "s"),
        percent(report.bandwidth.link_utilisation_burst)
    );
    if timing.line.is_empty() {
        return (Answer::Open, "No spans of a line were recorded.".to_owned());
    }
    if stalled == 0 {
        return (Answer::Yes, spare);
    }
    let rows = grouped(f64_from_u64(stalled));
    (Answer::No, format!("{spare} The readout stood still for {rows} rows; a faster link or a longer line helps."))
}

fn tracked(report: &Report) -> Verdict {
    let tracking = &report.tracking;
    let share = tracking.tracked_fraction;
    let error = match (tracking.ate_m, tracking.jitter_still_m) {
        (Some(ate_m), _) => format!(", {} off (ATE)", si(ate_m, "m")),
        (None, Some(still_m)) => format!(", {} of jitter at rest", si(still_m, "m")),
        (None, None) => String::new(),
    };
    let answer = if share >= TRACKED_MIN { Answer::Yes } else { Answer::No };
    let lost = tracking.events.iter().filter(|event| event.event == "lost").count();
    let losses = if lost > 0 { format!("; lost {} times", grouped(f64_from_usize(lost))) } else { String::new() };
    (answer, format!("{} of the frames{error}{losses}.", percent(share)))
}

fn exposed(report: &Report) -> Verdict {
    let adc = report.config.get("sensor").and_then(|sensor| sensor.get("adc"));
    let black_dn = adc.and_then(|adc| adc.get("black_level_dn")).and_then(toml::Value::as_integer).unwrap_or(0);
    let black_dn = f64::from(u32::try_from(black_dn).unwrap_or(0));
    let full_dn = f64::from((1_u32 << report.scenario.bits.min(16)) - 1);
    let codes: Vec<f64> = report.frames.iter().map(|frame| frame.mean_code_dn).collect();
    let (Some(mean_dn), true) = (crate::report::median(&codes), full_dn > black_dn) else {
        return (Answer::Open, "No frame was sensed.".to_owned());
    };
    let share = (mean_dn - black_dn) / (full_dn - black_dn);
    let words = format!(
        "The median frame\u{2019}s mean code is {}, {} of the range above black, at {} of exposure",
        digits(mean_dn),
        percent(greater(share, 0.0)),
        si(report.scenario.exposure_us * 1e-6, "s")
    );
    let (answer, rest) = match share {
        low if low < EXPOSED[0] => (Answer::No, ": dark. Use a longer exposure, more light or more gain."),
        high if high > EXPOSED[1] => (Answer::No, ": bright. Use a shorter exposure or less gain."),
        _ => (Answer::Yes, "."),
    };
    (answer, format!("{words}{rest}"))
}

fn render(report: &Report) -> Verdict {
    let Some(ratio) = report.scenario.render_variance_ratio else {
        return (Answer::Open, "The render\u{2019}s own noise was not measured.".to_owned());
    };
    let words = format!("The render\u{2019}s variance is {} times that of the photons", digits(ratio));
    if ratio <= RENDER_MAX {
        return (Answer::Yes, format!("{words}."));
    }
    let words = format!(
        "{words}: much of jitter and error is the renderer\u{2019}s. Use --accuracy 0.5 or a lower run.render_tolerance."
    );
    (Answer::No, words)
}
