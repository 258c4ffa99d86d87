//! The page of `sensel compare`: verdicts first, then every figure with its interval, pictures under a wiper, curves over each other.

use maud::{Markup, Render, html};

use super::parts::Head::{Number, Text};
use super::parts::{Table, script, section, table};
use crate::num::{f64_from_usize, greater, lesser};
use crate::plane::Plane;
use crate::report::chart::{Axes, Ink, Series, chart, runs_of};
use crate::report::compare::{Against, Comparison, FigureDifference, FinishedRun, Verdict};
use crate::report::html::frames::png_uri;
use crate::report::html::page;
use crate::report::html::text::{digits, si};
use crate::report::pose_series::pose_series;
use crate::report::record::FrameRecord;

/// Runs whose curves a chart tells apart.
const INKS: [Ink; 4] = [Ink::One, Ink::Two, Ink::Three, Ink::Four];

/// One frame as each run saw it.
#[derive(Clone, Debug)]
pub struct ComparedFrame {
    /// For a person: frame and time.
    pub caption: String,
    /// One picture a run, base first.
    pub pictures: Vec<Plane<u8>>,
}

/// The whole page; `runs` are those of the comparison, in its order.
pub fn compare_html(comparison: &Comparison, runs: &[FinishedRun], frames: &[ComparedFrame]) -> String {
    let names: Vec<String> = (0..runs.len()).map(letter).collect();
    let body = html! {
        (header(comparison, &names))
        main {
            @for (other, name) in comparison.others.iter().zip(&names[1..]) {
                (verdicts(other, name))
                (config(other, name))
                (figures(other, name))
            }
            (wiper(frames, &names))
            (curves(runs, &names))
        }
        footer { "sensel " (comparison.version) " \u{b7} every number on this page stands in compare.json" }
    };
    page(&format!("{} \u{b7} sensel compare", comparison.base.scenario), body)
}

/// A, B, C, ...
pub fn letter(at: usize) -> String {
    let letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
    letters.chars().nth(at).map_or_else(|| format!("run {}", at + 1), String::from)
}

fn header(comparison: &Comparison, names: &[String]) -> Markup {
    let runs = std::iter::once(&comparison.base).chain(comparison.others.iter().map(|other| &other.run));
    let heads = [Text("run"), Text("folder"), Text("scenario"), Number("seed"), Number("frames"), Text("config")];
    let rows = html! {
        @for (run, name) in runs.zip(names) {
            tr {
                th scope="row" { (name) }
                td { (run.folder) }
                td { (run.scenario) }
                td.num { (run.seed) }
                td.num { (run.frames) }
                td { code { (run.config_hash.chars().take(12).collect::<String>()) } }
            }
        }
    };
    html! {
        header.top {
            p.kicker { "sensel \u{b7} compare" }
            h1 { (comparison.base.scenario) ": " (names[1..].join(", ")) " against A" }
            (table(&heads, rows))
        }
    }
}

fn verdicts(other: &Against, name: &str) -> Markup {
    let list = |verdict: Verdict| {
        let of = other.figures.iter().filter(|figure| figure.verdict == verdict);
        of.map(|figure| figure.name.as_str()).collect::<Vec<_>>().join(", ")
    };
    let lines = [
        (Verdict::Better, "good", format!("{name} is better in")),
        (Verdict::Worse, "bad", format!("{name} is worse in")),
        (Verdict::Higher, "open", "Higher".to_owned()),
        (Verdict::Lower, "open", "Lower".to_owned()),
        (Verdict::NoDifference, "open", "No difference in".to_owned()),
        (Verdict::TooFewFrames, "open", "Too few frames for".to_owned()),
        (Verdict::TooFewRuns, "open", "Too few runs for".to_owned()),
    ];
    let content = html! {
        ul.verdicts {
            @for (verdict, class, words) in lines {
                @let list = list(verdict);
                @if !list.is_empty() { li class=(class) { strong { (words) } " " span { (list) } } }
            }
        }
    };
    let lead = format!("{}. A verdict stands only where the 95 % interval excludes zero.", other.pairing);
    section(&format!("{name} against A"), &lead, content)
}

fn config(other: &Against, name: &str) -> Markup {
    if other.config.is_empty() {
        return section("Configuration", &format!("{name} and A have equal configurations."), Markup::default());
    }
    let cell = |value: &Option<String>| {
        html! { @if let Some(value) = value { td { code { (value) } } } @else { td.note { "not set" } } }
    };
    let rows = html! {
        @for key in &other.config { tr { th scope="row" { code { (key.key) } } (cell(&key.a)) (cell(&key.b)) } }
    };
    let heads = [Text("key"), Text("A"), Text(name)];
    let table = Table { label: Some("configuration"), class: None, heads: &heads, rows };
    let lead = match other.config.len() {
        1 => "One key of the effective configuration differs.".to_owned(),
        count => format!("{count} keys of the effective configuration differ."),
    };
    section("Configuration", &lead, table.render())
}

/// A value with its unit; SI units get a prefix.
pub fn quantity(value: f64, unit: &str) -> String {
    match unit {
        "m" | "s" | "W" | "J" | "bit/s" => si(value, unit),
        "" => signed_digits(value),
        other => format!("{}\u{a0}{other}", signed_digits(value)),
    }
}

/// Digits with a true minus sign; a share needs all its digits.
fn signed_digits(value: f64) -> String {
    digits(value).replace('-', "\u{2212}")
}

/// The same with its sign, for differences.
pub fn change(value: f64, unit: &str) -> String {
    let text = quantity(value.abs(), unit);
    match value {
        0.0 => text,
        up if up > 0.0 => format!("+{text}"),
        _ => format!("\u{2212}{text}"),
    }
}

/// An interval in one unit.
pub fn range([low, high]: [f64; 2], unit: &str) -> String {
    format!("{} to {}", change(low, unit), change(high, unit))
}

fn figures(other: &Against, name: &str) -> Markup {
    let heads = [
        Text("figure"),
        Number("A"),
        Number(name),
        Number("difference"),
        Number("95 % interval"),
        Text("\u{2212}100 % \u{2026} 0 \u{2026} +100 % of A"),
        Text("verdict"),
    ];
    let rows = html! { @for figure in &other.figures { (figure_row(figure)) } };
    let label = format!("figures of {name} against A");
    let table = Table { label: Some(&label), class: Some("figures"), heads: &heads, rows };
    let lead = if other.paired_runs > 1 {
        "Means over pairs of runs; intervals by Student's t over the pairs. Pictures and curves are those of the first pair."
    } else {
        "Figures over the frames that both runs have; intervals by the moving-block bootstrap over frames. One run of each design cannot \
         show what varies between runs: for figures of pose, compare several (--against)."
    };
    section("Figures", lead, table.render())
}

fn figure_row(figure: &FigureDifference) -> Markup {
    let unit = &figure.unit;
    let class = match figure.verdict {
        Verdict::Better => "kept",
        Verdict::Worse => "left",
        _ => "soft",
    };
    let numbers = [
        figure.a.map(|a| quantity(a, unit)),
        figure.b.map(|b| quantity(b, unit)),
        figure.difference.map(|difference| change(difference, unit)),
        figure.interval.map(|interval| range(interval, unit)),
    ];
    html! {
        tr {
            th scope="row" { (figure.name) }
            @for number in numbers { td.num { (number.as_deref().unwrap_or("\u{2013}")) } }
            td { (forest(figure)) }
            td class=(class) { (figure.verdict.words()) }
        }
    }
}

/// The interval as a bar about zero, in shares of A, cut at 100 %.
fn forest(figure: &FigureDifference) -> Markup {
    let (Some(a), Some(difference), Some([low, high])) = (figure.a, figure.difference, figure.interval) else {
        return Markup::default();
    };
    if a == 0.0 {
        return Markup::default();
    }
    let x_of = |value: f64| 80.0 + 76.0 * greater(-1.0, lesser(1.0, value / a.abs()));
    let (from, to) = (x_of(low), x_of(high));
    let class = match figure.verdict {
        Verdict::Better => "good",
        Verdict::Worse => "bad",
        _ => "open",
    };
    let interval = format!("M{from:.1} 8H{:.1}", greater(to, from + 0.5));
    html! {
        svg.forest.(class) viewBox="0 0 160 16" aria-hidden="true" {
            path.zero d="M80 0V16" {}
            path.span d=(interval) {}
            circle cx=(format!("{:.1}", x_of(difference))) cy="8" r="3.5" {}
        }
    }
}

/// Two pictures of one frame under a handle that moves the seam between them.
fn wiper(frames: &[ComparedFrame], names: &[String]) -> Markup {
    let Some(first) = frames.first() else { return Markup::default() };
    let (left, right) = (&first.pictures[0], &first.pictures[1.min(first.pictures.len() - 1)]);
    let options = |chosen: usize| {
        html! { @for (at, name) in names.iter().enumerate() { option value=(at) selected[at == chosen] { (name) } } }
    };
    let content = html! {
        div.wiper-controls {
            label {
                "frame "
                select #wiper-frame { @for (at, frame) in frames.iter().enumerate() { option value=(at) { (frame.caption) } } }
            }
            label { "left " select #wiper-left { (options(0)) } }
            label { "right " select #wiper-right { (options(1)) } }
        }
        div.wiper #wiper style={ "aspect-ratio:" (left.width_px()) "/" (left.height_px()) } {
            img #wiper-a alt="the left run's picture" src=(png_uri(left));
            img #wiper-b alt="the right run's picture" src=(png_uri(right));
            i {}
            input type="range" min="0" max="100" value="50" step="0.5" #wiper-at
                aria-label="seam between the pictures, in per cent from the left";
        }
        (script(&include_str!("wiper.js").replace("SOURCES", &sources(frames))))
    };
    let lead = "Camera 0, codes as they left the converters. Drag the seam, or move it with the arrow keys.";
    section("Pictures", lead, content)
}

/// Pictures of each frame as the script reads them.
fn sources(frames: &[ComparedFrame]) -> String {
    let source = |frame: &ComparedFrame| {
        let list: Vec<String> = frame.pictures.iter().map(|picture| format!("\"{}\"", png_uri(picture))).collect();
        format!("[{}],", list.join(","))
    };
    format!("[{}]", frames.iter().map(source).collect::<String>())
}

fn curves(runs: &[FinishedRun], names: &[String]) -> Markup {
    let shown = runs.len().min(INKS.len());
    let poses: Vec<_> = runs[..shown]
        .iter()
        .map(|run| pose_series(&run.truth, &run.estimate, run.report.scenario.cameras, run.report.timing.fps))
        .collect();
    let series = |values: &dyn Fn(usize, usize, &FrameRecord) -> Option<f64>| -> Vec<Series<'_>> {
        (0..shown)
            .map(|at| {
                let frames = runs[at].report.frames.iter().enumerate();
                let points = frames.map(|(k, frame)| (frame.t_s, values(at, k, frame)));
                let width_px = if at == 0 { 3 } else { 2 };
                Series::line(&names[at], INKS[at], width_px, runs_of(points))
            })
            .collect()
    };
    let one = |title: &str, y_label: &str, values: &dyn Fn(usize, usize, &FrameRecord) -> Option<f64>| {
        let axes = Axes { from_zero: true, ..Axes::over_time(title, y_label) };
        html! { div { h3 { (title) } (chart(&axes, &series(values))) } }
    };
    let charts = [
        one("Position error", "position error in mm", &|run, frame, _| {
            poses[run].error_m[frame].map(|error_m| 1e3 * error_m.length())
        }),
        one("Orientation error", "orientation error in degrees", &|run, frame, _| {
            poses[run].orientation_deg2[frame].map(f64::sqrt)
        }),
        one("Second differences", "d2 of the position error in mm", &|run, frame, _| {
            poses[run].d2_m2[frame].map(|square_m2| 1e3 * square_m2.sqrt())
        }),
        one("Features tracked", "features", &|_, _, frame| Some(f64::from(frame.tracked))),
        one("Bits on the links", "kbit a frame", &|_, _, frame| frame.link_bits.map(|bits| 1e-3 * bits)),
        one("Energy", "\u{b5}J a frame", &|_, _, frame| frame.energy_pj.map(|energy_pj| 1e-6 * energy_pj)),
    ];
    let more = runs.len() - shown;
    let lead = if more > 0 {
        format!("Frame by frame; the first {} runs are drawn, {more} more are in compare.json.", f64_from_usize(shown))
    } else {
        "Frame by frame, each run after its own alignment.".to_owned()
    };
    section("Curves", &lead, html! { div.pair { @for chart in charts { (chart) } } })
}
