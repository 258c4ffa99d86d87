//! Errors of the pose on their own axes: a few millimetres do not show on axes of metres.

use maud::{Markup, html};

use super::parts::Head::{Number, Text};
use super::parts::{pair, section, table};
use crate::report::chart::{Axes, Ink, Series, chart, runs_of};
use crate::report::html::text::{digits, percent, si};
use crate::report::record::{FrameRecord, Report};

pub(super) fn pose_axes(report: &Report) -> Markup {
    let axis = |name, ink, axis: usize| {
        let error_mm = move |frame: &FrameRecord| frame.estimate_m.map(|at_m| 1e3 * (at_m[axis] - frame.truth_m[axis]));
        Series::line(name, ink, 2, over_time(report, error_mm))
    };
    let position = [axis("x", Ink::One, 0), axis("y (up)", Ink::Two, 1), axis("z", Ink::Three, 2)];
    let angles = over_time(report, |frame| frame.orientation_deg);
    let angle = [Series::line("orientation error", Ink::Four, 2, angles)];
    let position_axes = Axes::over_time("Position error by axis", "estimate minus truth in mm");
    let angle_axes = Axes { from_zero: true, ..Axes::over_time("Orientation error", "orientation error in degrees") };
    let content = pair(
        html! { div { h3 { "Position, by axis of the world" } (chart(&position_axes, &position)) } },
        html! { div { h3 { "Orientation" } (chart(&angle_axes, &angle)) } },
    );
    let lead = match report.tracking.orientation_deg {
        Some(angle_deg) => format!("After alignment; the orientation is {} degrees off (RMS).", digits(angle_deg)),
        None => "After alignment.".to_owned(),
    };
    section("Errors on their own axes", &lead, content)
}

fn over_time(report: &Report, value: impl Fn(&FrameRecord) -> Option<f64>) -> Vec<Vec<(f64, f64)>> {
    runs_of(report.frames.iter().map(|frame| (frame.t_s, value(frame))))
}

/// Fused and cameras alone side by side; empty where the rig has no IMU.
pub(super) fn fused_and_alone(report: &Report) -> Markup {
    let Some(alone) = &report.cameras_alone else { return Markup::default() };
    let fused = &report.tracking;
    let metres = |value: Option<f64>| value.map(|value| si(value, "m"));
    let count = |value: Option<f64>| value.map(digits);
    let rows = [
        ("ate_m", "Position error (ATE)", metres(fused.ate_m), metres(alone.ate_m)),
        ("rpe_m", "Drift over one second (RPE)", metres(fused.rpe_m), metres(alone.rpe_m)),
        (
            "jitter_frame_m",
            "Frame jitter (RPE over one frame)",
            metres(fused.jitter_frame_m),
            metres(alone.jitter_frame_m),
        ),
        ("jitter_d2_m", "Second-difference jitter (d2)", metres(fused.jitter_d2_m), metres(alone.jitter_d2_m)),
        (
            "jitter_still_m",
            "The same without alignment (still rig)",
            metres(fused.jitter_still_m),
            metres(alone.jitter_still_m),
        ),
        ("", "Frames with a pose", Some(percent(fused.tracked_fraction)), Some(percent(alone.tracked_fraction))),
        ("", "Landmarks of a pose, median", count(report.features.median_tracked), count(alone.median_tracked)),
    ];
    let cell = |value: &Option<String>, section: &str, key: &str| {
        let why = report.not_measurable.get(&format!("{section}.{key}")).map_or("not measured", String::as_str);
        html! { @if let Some(value) = value { td.num { (value) } } @else { td.note { (why) } } }
    };
    let rows = html! {
        @for (key, name, of_fused, of_alone) in &rows {
            tr {
                th scope="row" { (name) }
                (cell(of_alone, "cameras_alone", key))
                (cell(of_fused, "tracking", key))
            }
        }
    };
    let heads = [Text("figure"), Number("cameras alone"), Number("fused with the IMU")];
    let lead =
        "The same packets, tracked twice. The IMU smooths the pose, so the cameras alone show what the sensor does.";
    section("Cameras alone and fused", lead, table(&heads, rows))
}
