//! The page of `sensel compare`: verdicts first, then every figure with its interval, pictures under a wiper, curves over each other.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::parts::{section, table};
use crate::num::{f64_from_usize, greater, lesser};
use crate::plane::Plane;
use crate::report::chart::{Axes, Ink, Series, chart, runs_of};
use crate::report::compare::{Against, Comparison, FigureDifference, FinishedRun, KeyDifference, RunHead, Verdict};
use crate::report::html::frames::png;
use crate::report::html::page;
use crate::report::html::text::{digits, escaped, si};
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
    let head = header(comparison, &names);
    let mut body = String::new();
    for (other, name) in comparison.others.iter().zip(&names[1..]) {
        body += &verdicts(other, name);
        body += &config(other, name);
        body += &figures(other, name);
    }
    body += &wiper(frames, &names);
    body += &curves(runs, &names);
    let foot = format!(
        "<footer>sensel {} \u{b7} every number on this page stands in compare.json</footer>",
        escaped(&comparison.version)
    );
    let title = format!("{} \u{b7} sensel compare", escaped(&comparison.base.scenario));
    page(&title, &format!("{head}<main>{body}</main>{foot}"))
}

/// A, B, C, ...
pub fn letter(at: usize) -> String {
    let letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
    letters.chars().nth(at).map_or_else(|| format!("run {}", at + 1), String::from)
}

fn header(comparison: &Comparison, names: &[String]) -> String {
    let row = |(head, name): (&RunHead, &String)| {
        format!(
            "<tr><th scope=\"row\">{name}</th><td>{}</td><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{}</td>\
             <td><code>{}</code></td></tr>",
            escaped(&head.folder),
            escaped(&head.scenario),
            head.seed,
            head.frames,
            escaped(&head.config_hash.chars().take(12).collect::<String>())
        )
    };
    let heads = std::iter::once(&comparison.base).chain(comparison.others.iter().map(|other| &other.run));
    let rows: String = heads.zip(names).map(row).collect();
    let table = table("", "", "run|folder|scenario|#seed|#frames|config", &rows);
    format!(
        "<header class=\"top\"><p class=\"kicker\">sensel \u{b7} compare</p><h1>{}: {} against A</h1>{table}</header>",
        escaped(&comparison.base.scenario),
        names[1..].join(", ")
    )
}

fn verdicts(other: &Against, name: &str) -> String {
    let list = |verdict: Verdict| {
        let of = other.figures.iter().filter(|figure| figure.verdict == verdict);
        of.map(|figure| figure.name.as_str()).collect::<Vec<_>>().join(", ")
    };
    let lines: String = [
        (Verdict::Better, "good", format!("{name} is better in")),
        (Verdict::Worse, "bad", format!("{name} is worse in")),
        (Verdict::Higher, "open", "Higher".to_owned()),
        (Verdict::Lower, "open", "Lower".to_owned()),
        (Verdict::NoDifference, "open", "No difference in".to_owned()),
        (Verdict::TooFewFrames, "open", "Too few frames for".to_owned()),
        (Verdict::TooFewRuns, "open", "Too few runs for".to_owned()),
    ]
    .into_iter()
    .filter_map(|(verdict, class, words)| {
        let list = list(verdict);
        (!list.is_empty()).then(|| {
            format!("<li class=\"{class}\"><strong>{}</strong> <span>{}</span></li>", escaped(&words), escaped(&list))
        })
    })
    .collect();
    section(
        &format!("{name} against A"),
        &format!("{}. A verdict stands only where the 95 % interval excludes zero.", other.pairing),
        &format!("<ul class=\"verdicts\">{lines}</ul>"),
    )
}

fn config(other: &Against, name: &str) -> String {
    if other.config.is_empty() {
        return section("Configuration", &format!("{name} and A have equal configurations."), "");
    }
    let cell = |value: &Option<String>| match value {
        Some(value) => format!("<td><code>{}</code></td>", escaped(value)),
        None => "<td class=\"note\">not set</td>".to_owned(),
    };
    let row = |key: &KeyDifference| {
        let name = escaped(&key.key);
        format!("<tr><th scope=\"row\"><code>{name}</code></th>{}{}</tr>", cell(&key.a), cell(&key.b))
    };
    let rows: String = other.config.iter().map(row).collect();
    let table = table("configuration", "", &format!("key|A|{name}"), &rows);
    let lead = match other.config.len() {
        1 => "One key of the effective configuration differs.".to_owned(),
        count => format!("{count} keys of the effective configuration differ."),
    };
    section("Configuration", &lead, &table)
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

fn figures(other: &Against, name: &str) -> String {
    let rows: String = other.figures.iter().map(figure_row).collect();
    let scale = "\u{2212}100 % \u{2026} 0 \u{2026} +100 % of A";
    let heads = format!("figure|#A|#{name}|#difference|#95 % interval|{scale}|verdict");
    let table = table(&format!("figures of {name} against A"), "figures", &heads, &rows);
    let lead = if other.paired_runs > 1 {
        "Means over pairs of runs; intervals by Student's t over the pairs. Pictures and curves are those of the first pair."
    } else {
        "Figures over the frames that both runs have; intervals by the moving-block bootstrap over frames. One run of each design cannot \
         show what varies between runs: for figures of pose, compare several (--against)."
    };
    section("Figures", lead, &table)
}

fn figure_row(figure: &FigureDifference) -> String {
    let cell =
        |text: Option<String>| format!("<td class=\"num\">{}</td>", text.unwrap_or_else(|| "\u{2013}".to_owned()));
    let unit = &figure.unit;
    let class = match figure.verdict {
        Verdict::Better => "kept",
        Verdict::Worse => "left",
        _ => "soft",
    };
    format!(
        "<tr><th scope=\"row\">{}</th>{}{}{}{}<td>{}</td><td class=\"{class}\">{}</td></tr>",
        escaped(&figure.name),
        cell(figure.a.map(|a| quantity(a, unit))),
        cell(figure.b.map(|b| quantity(b, unit))),
        cell(figure.difference.map(|difference| change(difference, unit))),
        cell(figure.interval.map(|interval| range(interval, unit))),
        forest(figure),
        figure.verdict.words()
    )
}

/// The interval as a bar about zero, in shares of A, cut at 100 %.
fn forest(figure: &FigureDifference) -> String {
    let (Some(a), Some(difference), Some([low, high])) = (figure.a, figure.difference, figure.interval) else {
        return String::new();
    };
    if a == 0.0 {
        return String::new();
    }
    let x_of = |value: f64| 80.0 + 76.0 * greater(-1.0, lesser(1.0, value / a.abs()));
    let (from, to) = (x_of(low), x_of(high));
    let class = match figure.verdict {
        Verdict::Better => "good",
        Verdict::Worse => "bad",
        _ => "open",
    };
    format!(
        "<svg class=\"forest {class}\" viewBox=\"0 0 160 16\" aria-hidden=\"true\"><path class=\"zero\" d=\"M80 0V16\"/>\
         <path class=\"span\" d=\"M{from:.1} 8H{:.1}\"/><circle cx=\"{:.1}\" cy=\"8\" r=\"3.5\"/></svg>",
        greater(to, from + 0.5),
        x_of(difference)
    )
}

/// Two pictures of one frame under a handle that moves the seam between them.
fn wiper(frames: &[ComparedFrame], names: &[String]) -> String {
    let Some(first) = frames.first() else { return String::new() };
    let uri = |picture: &Plane<u8>| format!("data:image/png;base64,{}", STANDARD.encode(png(picture)));
    let source = |frame: &ComparedFrame| {
        let list: Vec<String> = frame.pictures.iter().map(|picture| format!("\"{}\"", uri(picture))).collect();
        format!("[{}],", list.join(","))
    };
    let sources = format!("[{}]", frames.iter().map(source).collect::<String>());
    let options = |chosen: usize| {
        let option = |(at, name): (usize, &String)| {
            let selected = if at == chosen { " selected" } else { "" };
            format!("<option value=\"{at}\"{selected}>{name}</option>")
        };
        names.iter().enumerate().map(option).collect::<String>()
    };
    let caption =
        |(at, frame): (usize, &ComparedFrame)| format!("<option value=\"{at}\">{}</option>", escaped(&frame.caption));
    let captions: String = frames.iter().enumerate().map(caption).collect();
    let (width, height) = (first.pictures[0].width_px(), first.pictures[0].height_px());
    let content = format!(
        "<div class=\"wiper-controls\"><label>frame <select id=\"wiper-frame\">{captions}</select></label>\
         <label>left <select id=\"wiper-left\">{}</select></label><label>right <select id=\"wiper-right\">{}</select></label></div>\
         <div class=\"wiper\" id=\"wiper\" style=\"aspect-ratio:{width}/{height}\">\
         <img id=\"wiper-a\" alt=\"the left run's picture\" src=\"{}\">\
         <img id=\"wiper-b\" alt=\"the right run's picture\" src=\"{}\"><i></i>\
         <input type=\"range\" min=\"0\" max=\"100\" value=\"50\" step=\"0.5\" id=\"wiper-at\" \
         aria-label=\"seam between the pictures, in per cent \
         from the left\"></div><script>\n{}\n</script>",
        options(0),
        options(1),
        uri(&first.pictures[0]),
        uri(&first.pictures[1.min(first.pictures.len() - 1)]),
        include_str!("wiper.js").replace("SOURCES", &sources)
    );
    let lead = "Camera 0, codes as they left the converters. Drag the seam, or move it with the arrow keys.";
    section("Pictures", lead, &content)
}

fn curves(runs: &[FinishedRun], names: &[String]) -> String {
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
        format!("<div><h3>{title}</h3>{}</div>", chart(&axes, &series(values)))
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
    section("Curves", &lead, &format!("<div class=\"pair\">{}</div>", charts.concat()))
}
