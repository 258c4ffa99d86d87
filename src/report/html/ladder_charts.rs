//! What accuracy costs in time, at a glance: rungs as bars, each knob as a curve, and what the same settings do to the pose.

use maud::{Markup, html};

use crate::num::{greater, lesser};
use crate::report::chart::{Axes, Ink, Note, Series, SeriesShape, chart};
use crate::report::html::text::{digits, si};
use crate::report::ladder_record::{LadderRecord, LadderRow};

/// Knob of the record, its name for a person and its colour.
const KNOBS: [(&str, &str, Ink); 5] = [
    ("samples_per_pixel", "rays in every pixel", Ink::Two),
    ("render_tolerance", "render tolerance", Ink::Three),
    ("reflections", "reflections", Ink::Four),
    ("effects", "effects to a tolerance", Ink::Five),
    ("subframes", "sub-frames merged", Ink::Six),
];

/// Each rung: what it simulates and what holds it.
const RUNGS: [(&str, &str); 4] = [
    ("expected", "mean and variance of each pixel; equal to sampled by statistics"),
    ("sampled", "every pixel drawn; codes and features equal to clocked"),
    ("clocked", "every conversion clock by clock; equal to rtl on every clock"),
    ("rtl", "the SystemVerilog under Verilator"),
];

/// The row of the setting that the scenario itself has.
pub(super) fn in_use(record: &LadderRecord) -> Option<&LadderRow> {
    record.rows.iter().find(|row| row.knob == "rung" && row.rung == "sampled")
}

pub(super) fn rungs(record: &LadderRecord) -> Markup {
    let of = |name: &str| record.rows.iter().find(|row| row.knob == "rung" && row.rung == name);
    let times = || RUNGS.iter().filter_map(|(name, _)| of(name)).map(|row| row.ms_per_frame).filter(|ms| *ms > 0.0);
    let (least, most) = (times().fold(f64::INFINITY, lesser), times().fold(0.0, greater));
    if !(most > 0.0) {
        return Markup::default();
    }
    let base_ms = in_use(record).map_or(least, |row| row.ms_per_frame);
    // One decade below the quickest is the left end.
    let left = libm::log10(least) - 0.5;
    let share = |ms: f64| 100.0 * (libm::log10(ms) - left) / (libm::log10(most) - left);
    html! {
        h3 { "Rungs" }
        table.bars.rungs {
            caption { "Time of a frame on each rung, logarithmic; in brackets against sampled" }
            tbody {
                @for (name, words) in RUNGS {
                    @let found = of(name);
                    @let timed = found.filter(|row| row.ms_per_frame > 0.0);
                    tr {
                        th scope="row" { (name) br; small.soft { (words) } }
                        @if let Some(LadderRow { ms_per_frame: ms, .. }) = timed {
                            td { div.bar { i style=(format!("width:{:.1}%", share(*ms))) {} } }
                            td.num { (si(ms * 1e-3, "s")) " (" (digits(ms / base_ms)) " \u{d7})" }
                        } @else {
                            td { span.note { (found.and_then(|row| row.note.as_deref()).unwrap_or("not measured")) } }
                            td.num {}
                        }
                    }
                }
            }
        }
    }
}

/// Rows of a knob with a figure, by time.
fn curve(record: &LadderRecord, knob: &str, figure: &dyn Fn(&LadderRow) -> Option<f64>) -> Vec<(f64, f64, String)> {
    let rows = record.rows.iter().filter(|row| row.knob == knob && row.ms_per_frame > 0.0);
    let mut points: Vec<(f64, f64, String)> =
        rows.filter_map(|row| Some((row.ms_per_frame, figure(row)?, row.value.clone()))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// `level` is a height across the chart and its name.
fn plot(
    record: &LadderRecord,
    title: &str,
    (y_label, y_log): (&str, bool),
    figure: &dyn Fn(&LadderRow) -> Option<f64>,
    level: Option<(f64, &str)>,
) -> Markup {
    let curves: Vec<_> = KNOBS.map(|(knob, name, ink)| (name, ink, curve(record, knob, figure))).into();
    let all = || curves.iter().flat_map(|(_, _, points)| points);
    if all().next().is_none() {
        return html! { p.note { (title) ": nothing was measured." } };
    }
    let times = || all().map(|point| point.0);
    let (from, to) = (times().fold(f64::INFINITY, lesser), times().fold(0.0, greater));
    let mut series: Vec<Series<'_>> = Vec::new();
    let mut notes: Vec<Note> = Vec::new();
    for (name, ink, points) in &curves {
        if points.is_empty() {
            continue;
        }
        let runs = vec![points.iter().map(|(x, y, _)| (*x, *y)).collect()];
        series.push(Series { name, ink: *ink, shape: SeriesShape::Marked(2), runs });
        // Tolerances of effects differ little in time: one word for all of them.
        let shown = if *ink == Ink::Five { &points[points.len() - 1..] } else { &points[..] };
        notes.extend(shown.iter().map(|(x, y, value)| Note { at: (*x, *y), text: short(value), ink: *ink }));
    }
    if let Some(row) = in_use(record)
        && let Some(y) = figure(row)
    {
        let runs = vec![vec![(row.ms_per_frame, y)]];
        series.push(Series { name: "in use", ink: Ink::One, shape: SeriesShape::Ring, runs });
    }
    if let Some((level, name)) = level {
        series.push(Series::line(name, Ink::One, 1, vec![vec![(from, level), (to, level)]]));
    }
    let axes = Axes {
        title,
        x_label: "processor time in ms per frame",
        y_label,
        x_log: true,
        y_log,
        notes,
        ..Axes::default()
    };
    html! { div { h3 { (title) } (chart(&axes, &series)) } }
}

/// A value as it fits beside its point.
fn short(value: &str) -> String {
    value.split(',').next().unwrap_or_default().chars().take(8).collect()
}

/// Error, jitter and features of every knob over time.
pub(super) fn charts(record: &LadderRecord) -> Markup {
    // The finest render that was tracked: what is left there is the sensor's.
    let fineness = |row: &&LadderRow| row.photon_noise_ratio.unwrap_or(0.0);
    let tracked = record.rows.iter().filter(|row| row.jitter_d2_m.is_some());
    let finest = tracked.min_by(|a, b| fineness(a).total_cmp(&fineness(b)));
    let own_mm = finest.and_then(|row| row.jitter_d2_m).map(|jitter_m| 1e3 * jitter_m);
    let own = own_mm.map(|own_mm| (own_mm, "the sensor\u{2019}s own jitter: the finest render that was tracked"));
    let millimetres = |metres: Option<f64>| metres.map(|metres| 1e3 * metres);
    let error = plot(
        record,
        "Error of the picture",
        ("error in units of photon noise", true),
        &|row| row.photon_noise_ratio,
        Some((1.0, "photon noise")),
    );
    let jitter_label = ("second-difference jitter in mm", true);
    let jitter = plot(record, "Jitter of the pose", jitter_label, &|row| millimetres(row.jitter_d2_m), own);
    let position = plot(record, "Position error", ("ATE in mm", true), &|row| millimetres(row.ate_m), None);
    let f1_label = ("F1 against the reference", false);
    let features = plot(record, "Features found again", f1_label, &|row| row.feature_f1, None);
    html! { (error) div.pair { (jitter) (position) (features) } }
}
