//! The position error over time, and all pose figures in a table.

use maud::{Markup, html};

use super::parts::section;
use crate::report::chart::{Axes, Ink, Series, chart, runs_of};
use crate::report::html::text::{digits, percent, si};
use crate::report::record::Report;

/// Events that the page lists.
const EVENTS_MAX: usize = 20;

pub(super) fn pose_error(report: &Report) -> Markup {
    let points = report.frames.iter().map(|frame| (frame.t_s, frame.error_m.map(|error_m| 1e3 * error_m)));
    let series = [Series::line("position error", Ink::Two, 2, runs_of(points))];
    let frame = Axes { from_zero: true, ..Axes::over_time("Position error over time", "position error in mm") };
    let content = html! { (chart(&frame, &series)) (gaps(report)) (spectrum(report)) (table(report)) (events(report)) };
    section("Pose error", "Distance between estimate and truth at each frame, after rigid alignment.", content)
}

/// How the error is spread over frequency: drift on the left, jitter on the right.
fn spectrum(report: &Report) -> Markup {
    let points: Vec<(f64, f64)> =
        report.tracking.jitter_spectrum.iter().map(|point| (point.frequency_hz, 1e3 * point.m_per_rthz)).collect();
    if points.is_empty() {
        return Markup::default();
    }
    let series = [Series::line("position error", Ink::Two, 2, vec![points])];
    let frame = Axes {
        title: "Spectrum of the position error",
        x_label: "frequency in Hz",
        y_label: "error in mm a root Hz",
        x_log: true,
        y_log: true,
        ..Axes::default()
    };
    html! { h3 { "Spectrum of the position error" } (chart(&frame, &series)) }
}

/// Start, loss and return with their times.
fn events(report: &Report) -> Markup {
    let events = &report.tracking.events;
    if events.is_empty() {
        return Markup::default();
    }
    // A run that is lost often would make a page of its own; report.json holds them all.
    let more = events.len().saturating_sub(EVENTS_MAX);
    html! {
        table {
            caption { "What happened to the tracker" }
            tbody {
                @for event in events.iter().take(EVENTS_MAX) {
                    tr {
                        th scope="row" { (event.event) @if let Some(reason) = &event.reason { ": " (reason) } }
                        td.num { @if let Some(frame) = event.frame { "frame " (frame) } }
                        td.num { (format!("{:.3}", event.t_s)) "\u{a0}s" }
                    }
                }
            }
        }
        @if more > 0 { p.note { "And " (more) " more." } }
    }
}

/// Says what a break in the line means, where there is one.
fn gaps(report: &Report) -> Markup {
    let missing = report.frames.iter().filter(|frame| frame.error_m.is_none()).count();
    let why = report.not_measurable.get("frames.error_m").filter(|_| missing > 0);
    html! { @if let Some(why) = why { p.note { (missing) " frames without a value: " (why) "." } } }
}

fn table(report: &Report) -> Markup {
    let tracking = &report.tracking;
    let metres = |value: Option<f64>| value.map(|value| si(value, "m"));
    let interval = |ends: Option<[f64; 2]>| ends.map(|[low, high]| format!("{} to {}", si(low, "m"), si(high, "m")));
    let rows = [
        ("ate_sim3_m", "Position error, scale free", metres(tracking.ate_sim3_m)),
        ("scale_sim3", "Scale that this alignment found", tracking.scale_sim3.map(|scale| format!("{scale:.5}"))),
        ("jitter_frame_m", "Frame jitter (RPE over one frame)", metres(tracking.jitter_frame_m)),
        ("jitter_d2_m", "Second-difference jitter (d2), per axis", metres(tracking.jitter_d2_m)),
        (
            "single_picture_sigma_m",
            "Single-picture position sigma given the map (per axis)",
            metres(tracking.single_picture_sigma_m),
        ),
        (
            "ate_interval_m",
            "Position error, 95\u{a0}% interval over this run\u{2019}s seconds",
            interval(tracking.ate_interval_m),
        ),
        (
            "jitter_d2_interval_m",
            "Second-difference jitter (d2), 95\u{a0}% interval over this run\u{2019}s seconds",
            interval(tracking.jitter_d2_interval_m),
        ),
        ("jitter_still_m", "Second-difference jitter without alignment (still rig)", metres(tracking.jitter_still_m)),
        ("still_steps_under_1um", "Steps under 1 \u{b5}m", tracking.still_steps_under_1um.map(percent)),
        ("prediction_error_m", "Position predicted one frame ahead", metres(tracking.prediction_error_m)),
        (
            "innovation_px",
            "Innovation, median",
            tracking.innovation_px.map(|value| format!("{}\u{a0}px", digits(value))),
        ),
        ("relocalise_s", "Time to come back from a loss, median", tracking.relocalise_s.map(|value| si(value, "s"))),
    ];
    html! {
        table {
            caption { "Further figures of the pose" }
            tbody {
                @for (key, name, value) in rows {
                    tr {
                        th scope="row" { (name) }
                        @if let Some(value) = value {
                            td.num { (value) }
                        } @else if let Some(why) = report.not_measurable.get(&format!("tracking.{key}")) {
                            td.note { "not measured: " (why) }
                        } @else {
                            td.note { "not measured" }
                        }
                    }
                }
            }
        }
    }
}
