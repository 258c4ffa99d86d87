//! Where the time of a line and of a frame goes, as lanes, with the same spans as a table.

use super::parts::{self, section};
use crate::num::{f64_from_u64, f64_from_usize};
use crate::report::html::power_strip;
use crate::report::html::text::{digits, escaped, grouped, si};
use crate::report::record::{Phase, Report};

/// Width of a lane on a common screen, and of a letter in it: a span too narrow for its name goes without; the table
/// has it.
const LANE_PX: f64 = 400.0;
const LETTER_PX: f64 = 7.5;

/// `waves` is the path of the picture of a row's conversions beside the page.
pub(super) fn timing(report: &Report, waves: Option<&str>) -> String {
    let timing = &report.timing;
    let lead = format!(
        "{} lines a second, {} frames a second, {} clocks a frame; {} from mid-exposure to the last bit on the lanes.",
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
    let link = waves.map_or_else(String::new, |path| {
        let path = escaped(path);
        format!("<p><a href=\"{path}\">How a row is converted</a>: ramp, comparators, counters and codes of three columns.</p>")
    });
    let content = format!(
        "<h3>One line</h3>{}{link}{}<h3>One frame</h3>{}{}",
        lanes(&timing.line, timing.line_time_us),
        report.energy.line.as_ref().map_or_else(String::new, power_strip::strip),
        lanes(&timing.frame, timing.frame_time_us),
        table(report)
    );
    section("Timing", &lead, &content)
}

fn lanes(phases: &[Phase], length_us: f64) -> String {
    if phases.is_empty() || length_us <= 0.0 {
        return "<p class=\"note\">No spans were recorded.</p>".to_owned();
    }
    let mut html = String::from("<div class=\"lanes\">");
    for (name, phases) in Phase::by_lane(phases) {
        let spans: String = phases.iter().map(|phase| span(phase, length_us)).collect();
        html += &format!("<div>{}</div><div class=\"lane\">{spans}</div>", escaped(name));
    }
    let axis =
        format!("<div></div><div class=\"axis\"><span>0</span><span>{}</span></div></div>", si(length_us * 1e-6, "s"));
    html + &axis
}

fn span(phase: &Phase, length_us: f64) -> String {
    let share = |time_us: f64| 100.0 * (time_us / length_us).clamp(0.0, 1.0);
    let (left, width) = (share(phase.start_us), share(phase.end_us) - share(phase.start_us));
    let name = escaped(&phase.name);
    let name_px = LETTER_PX * f64_from_usize(phase.name.chars().count() + 2);
    let (class, label) = if width / 100.0 * LANE_PX >= name_px { ("", name.as_str()) } else { (" class=\"thin\"", "") };
    let duration = si((phase.end_us - phase.start_us) * 1e-6, "s");
    format!("<span{class} style=\"left:{left:.3}%;width:{width:.3}%\" title=\"{name}, {duration}\">{label}</span>")
}

fn table(report: &Report) -> String {
    let row = |phase: &Phase| {
        let time = |time_us: f64| format!("<td class=\"num\">{}</td>", si(time_us * 1e-6, "s"));
        let cells = [phase.start_us, phase.end_us, phase.end_us - phase.start_us].map(time).concat();
        format!("<tr><th scope=\"row\">{}</th><td>{}</td>{cells}</tr>", escaped(&phase.name), escaped(&phase.lane))
    };
    let rows: String = report.timing.line.iter().chain(&report.timing.frame).map(row).collect();
    let table = parts::table("", "", "span|of|#from|#to|#length", &rows);
    format!("<details><summary>The same as numbers</summary>{table}</details>")
}
