//! The path from above and from the side, estimate against truth, a metre as long on both axes.

use maud::{Markup, html};

use super::parts::{pair, reason, section};
use crate::report::chart::{Axes, Ink, Series, chart, runs_of};
use crate::report::html::text::si;
use crate::report::record::{FrameRecord, Report};

pub(super) fn trajectory(report: &Report) -> Markup {
    // The world's y axis points up, as in glTF.
    let top = view(report, "Path from above", 0, 2, ("x in m", "z in m"));
    let side = view(report, "Path from the side", 0, 1, ("x in m", "y (up) in m"));
    let charts = pair(html! { div { h3 { "From above" } (top) } }, html! { div { h3 { "From the side" } (side) } });
    let lead = match report.tracking.ate_m {
        Some(ate_m) => {
            format!("Estimate against truth after rigid alignment; they are {} apart (RMS).", si(ate_m, "m"))
        }
        None => "The true path; the estimate could not be aligned to it.".to_owned(),
    };
    section("Trajectory", &lead, html! { (charts) (reason(report, "tracking.ate_m")) })
}

fn view(report: &Report, title: &str, across: usize, up: usize, labels: (&str, &str)) -> Markup {
    let frames = &report.frames;
    let truth = frames.iter().map(|frame| (frame.truth_m[across], frame.truth_m[up])).collect();
    // Broken where the tracker had no pose.
    let point = |frame: &FrameRecord| match frame.estimate_m {
        Some(estimate_m) => (estimate_m[across], Some(estimate_m[up])),
        None => (0.0, None),
    };
    let estimate = runs_of(frames.iter().map(point));
    let series = [Series::line("truth", Ink::One, 6, vec![truth]), Series::line("estimate", Ink::Two, 2, estimate)];
    let frame = Axes { title, x_label: labels.0, y_label: labels.1, equal: true, ..Axes::default() };
    chart(&frame, &series)
}
