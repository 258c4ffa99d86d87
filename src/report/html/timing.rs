//! Where the time of a line and of a frame goes, as lanes, with the same spans as a table.

use maud::{Markup, html};

use super::parts::Head::{Number, Text};
use super::parts::{self, section};
use crate::num::{f64_from_u64, f64_from_usize};
use crate::report::html::power_strip;
use crate::report::html::text::{digits, grouped, si};
use crate::report::record::{Phase, Report};

/// Width of a lane on a common screen, and of a letter in it: a span too narrow for its name goes without; the table
/// has it.
const LANE_PX: f64 = 400.0;
const LETTER_PX: f64 = 7.5;

/// `waves` is the path of the picture of a row's conversions beside the page.
pub(super) fn timing(report: &Report, waves: Option<&str>) -> Markup {
    let timing = &report.timing;
    let lead = format!(
        "{} lines a second, {} frames a second, {} clocks per frame; {} from mid-exposure to the last bit on the lanes.",
        grouped(if timing.line_time_us > 0.0 { 1e6 / timing.line_time_us } else { 0.0 }),
        digits(timing.fps),
        grouped(f64_from_u64(timing.clocks_per_frame)),
        si(timing.latency_us * 1e-6, "s")
    );
    let lead = match timing.last_feature_us {
        Some(last_us) => {
            format!("{lead} The last feature leaves the extractor {} after the last row.", si(last_us * 1e-6, "s"))
        }
        None => lead,
    };
    let lead = match &timing.extractor {
        Some(clocks) => format!(
            "{lead} The extractor needed {} clocks at most of the {} that a frame has; {} frames of a camera needed more than that.",
            grouped(f64_from_u64(clocks.required)),
            grouped(f64_from_u64(clocks.available)),
            grouped(f64_from_u64(clocks.frames_over))
        ),
        None => lead,
    };
    let content = html! {
        h3 { "One line" }
        (lanes(&timing.line, timing.line_time_us))
        @if let Some(path) = waves {
            p { a href=(path) { "How a row is converted" } ": ramp, comparators, counters and codes of three columns." }
        }
        @if let Some(line) = &report.energy.line { (power_strip::strip(line)) }
        h3 { "One frame" }
        (lanes(&timing.frame, timing.frame_time_us))
        details { summary { "The same as numbers" } (table(report)) }
    };
    section("Timing", &lead, content)
}

fn lanes(phases: &[Phase], length_us: f64) -> Markup {
    if phases.is_empty() || length_us <= 0.0 {
        return html! { p.note { "No spans were recorded." } };
    }
    html! {
        div.lanes {
            @for (name, phases) in Phase::by_lane(phases) {
                div { (name) }
                div.lane { @for phase in phases { (span(phase, length_us)) } }
            }
            div {}
            div.axis { span { "0" } span { (si(length_us * 1e-6, "s")) } }
        }
    }
}

fn span(phase: &Phase, length_us: f64) -> Markup {
    let share = |time_us: f64| 100.0 * (time_us / length_us).clamp(0.0, 1.0);
    let (left, width) = (share(phase.start_us), share(phase.end_us) - share(phase.start_us));
    let name_px = LETTER_PX * f64_from_usize(phase.name.chars().count() + 2);
    let is_thin = width / 100.0 * LANE_PX < name_px;
    let place = format!("left:{left:.3}%;width:{width:.3}%");
    let title = format!("{}, {}", phase.name, si((phase.end_us - phase.start_us) * 1e-6, "s"));
    html! { span class=[is_thin.then_some("thin")] style=(place) title=(title) { @if !is_thin { (phase.name) } } }
}

fn table(report: &Report) -> Markup {
    let heads = [Text("span"), Text("of"), Number("from"), Number("to"), Number("length")];
    let rows = html! {
        @for phase in report.timing.line.iter().chain(&report.timing.frame) {
            tr {
                th scope="row" { (phase.name) }
                td { (phase.lane) }
                @for time_us in [phase.start_us, phase.end_us, phase.end_us - phase.start_us] {
                    td.num { (si(time_us * 1e-6, "s")) }
                }
            }
        }
    };
    parts::table(&heads, rows)
}
