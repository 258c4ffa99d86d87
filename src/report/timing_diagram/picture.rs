//! Assembles the timing picture as SVG of fixed width: heading, one line, two frames. Letters are text.

use super::lines::{TimeScale, axis, lane};
use super::spans::{BandKind, RowBand, TimingDiagram};
use crate::num::{greater, lesser};
use crate::report::escape::{escaped, svg_text as text};
use crate::report::record::Phase;

const WIDTH_PX: f64 = 960.0;
const MARGIN_PX: f64 = 28.0;
/// Where spans begin, right of their lanes' names.
const LEFT_PX: f64 = 168.0;
const RIGHT_PX: f64 = WIDTH_PX - MARGIN_PX;
/// Height of the picture of rows.
const ROWS_PX: f64 = 190.0;

/// Colours follow the reader's light or dark; as in the report's page.
const STYLE: &str = "svg{--card:#fff;--ink:#16191d;--soft:#555d68;--rule:#c3cad3;--grid:#e9ecf0;--a:#0064a0;--b:#b84a00;--c:#00745a;\
--d:#7d3f86;--on:#fff;font:13px system-ui,-apple-system,'Segoe UI',Roboto,'Noto Sans','Helvetica Neue',Arial,sans-serif}\
@media(prefers-color-scheme:dark){svg{--card:#191d23;--ink:#e9ecf0;--soft:#a9b2be;--rule:#485260;--grid:#282e37;--a:#64b9ee;\
--b:#f0a040;--c:#46c8a2;--d:#d99ae0;--on:#101317}}\
text{fill:var(--ink)}.s{fill:var(--soft)}.h{font-weight:650;font-size:15px}.t{font-weight:650;font-size:20px}.e{text-anchor:end}\
.m{text-anchor:middle}.l{font-size:12px}.on{fill:var(--on);font-size:12px;text-anchor:middle}\
.g{stroke:var(--rule);stroke-width:1;fill:none}\
.k{stroke:var(--soft);stroke-width:.8;fill:none}\
.z{stroke:var(--rule);stroke-dasharray:3 4;fill:none}.a{fill:var(--a)}.b{fill:var(--b)}.c{fill:var(--c)}.d{fill:var(--d)}\
.free{fill:url(#free)}.bed{fill:var(--grid)}";

pub(super) fn svg(diagram: &TimingDiagram) -> String {
    let mut body = heading(diagram);
    let line_end_px = one_line(&mut body, diagram, 96.0);
    let end_px = two_frames(&mut body, diagram, line_end_px + 34.0);
    let height_px = end_px + 16.0;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH_PX} {height_px:.0}\" width=\"{WIDTH_PX}\" role=\"img\">\n\
         <title>Time of a line and of a frame: {}</title>\n<style>{STYLE}</style>\n\
         <defs><pattern id=\"free\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\">\
         <rect width=\"6\" height=\"6\" class=\"bed\"/><path d=\"M0 0V6\" class=\"g\"/></pattern>\
         <clipPath id=\"rows\"><rect x=\"{LEFT_PX}\" y=\"0\" width=\"{}\" height=\"{height_px:.0}\"/></clipPath></defs>\n\
         <rect width=\"{WIDTH_PX}\" height=\"{height_px:.0}\" rx=\"12\" style=\"fill:var(--card)\"/>\n{body}</svg>\n",
        escaped(&diagram.name),
        RIGHT_PX - LEFT_PX
    )
}

fn heading(diagram: &TimingDiagram) -> String {
    let mut body = String::new();
    let timing = &diagram.timing;
    text(&mut body, MARGIN_PX, 42.0, "t", &diagram.name);
    text(&mut body, MARGIN_PX, 64.0, "s", &diagram.mode);
    let rates =
        format!("{:.3} frames/s, {:.3} ms from mid-exposure to the last bit", timing.fps, 1e-3 * timing.latency_us);
    text(&mut body, RIGHT_PX, 42.0, "e", &rates);
    let lengths = format!(
        "HTS {} at {} MHz, VTS {}",
        diagram.hts,
        1e-6 * crate::num::f64_from_u64(diagram.pixel_rate_hz),
        diagram.vts
    );
    text(&mut body, RIGHT_PX, 64.0, "s e", &lengths);
    body
}

/// Draws the spans of a line from a height on; gives the height where they end.
fn one_line(body: &mut String, diagram: &TimingDiagram, top_px: f64) -> f64 {
    let timing = &diagram.timing;
    text(body, MARGIN_PX, top_px, "h", &format!("One line: {:.3} \u{b5}s", timing.line_time_us));
    text(body, RIGHT_PX, top_px, "s e", &diagram.limit());
    let end_us = timing.line.iter().fold(timing.line_time_us, |end_us, phase| greater(end_us, phase.end_us));
    let scale = TimeScale { left_px: LEFT_PX, right_px: RIGHT_PX, start_us: 0.0, end_us };
    let mut y_px = top_px + 16.0;
    for (name, spans) in Phase::by_lane(&timing.line) {
        text(body, MARGIN_PX, y_px + 20.0, "l", name);
        y_px = lane(body, &scale, &spans, timing.line_time_us, y_px);
    }
    axis(body, &scale, y_px)
}

/// Draws two frames from a height on; gives the height where they end.
fn two_frames(body: &mut String, diagram: &TimingDiagram, top_px: f64) -> f64 {
    let frame_us = diagram.timing.frame_time_us;
    let line = format!(
        "{} rows in {} of {} lines; exposure {} of at most {} lines",
        diagram.rows, diagram.rows_lines, diagram.vts, diagram.exposure_lines, diagram.exposure_lines_max
    );
    text(body, MARGIN_PX, top_px, "h", &format!("Two frames of {:.3} ms", 1e-3 * frame_us));
    text(body, RIGHT_PX, top_px, "s e", &line);
    let scale = TimeScale { left_px: LEFT_PX, right_px: RIGHT_PX, start_us: 0.0, end_us: 2.0 * frame_us };
    let rows_px = legend(body, diagram, top_px + 24.0) + 14.0;
    *body += &format!(
        "<rect x=\"{LEFT_PX}\" y=\"{rows_px:.1}\" width=\"{}\" height=\"{ROWS_PX}\" class=\"bed\" opacity=\".5\"/>\n",
        RIGHT_PX - LEFT_PX
    );
    text(body, LEFT_PX - 10.0, rows_px + 11.0, "l e", "row 0");
    text(body, LEFT_PX - 10.0, rows_px + ROWS_PX, "l e", &format!("row {}", diagram.rows - 1));
    body.push_str("<g clip-path=\"url(#rows)\">\n");
    diagram.bands.iter().for_each(|band| push_band(body, band, &scale, rows_px));
    body.push_str("</g>\n");
    for frame in [0.0, 1.0, 2.0] {
        let x_px = scale.x_px(frame * frame_us);
        *body += &format!("<path d=\"M{x_px:.1} {rows_px:.1}V{:.1}\" class=\"z\"/>\n", rows_px + ROWS_PX);
    }
    let mut y_px = rows_px + ROWS_PX + 8.0;
    for (name, spans) in Phase::by_lane(&diagram.lanes) {
        text(body, MARGIN_PX, y_px + 20.0, "l", name);
        let shown: Vec<Phase> = spans.into_iter().filter_map(|span| within(span, 2.0 * frame_us)).collect();
        y_px = lane(body, &scale, &shown.iter().collect::<Vec<_>>(), 0.0, y_px);
    }
    axis(body, &scale, y_px)
}

fn within(span: &Phase, end_us: f64) -> Option<Phase> {
    let (start_us, end_us) = (greater(span.start_us, 0.0), lesser(span.end_us, end_us));
    // What begins with the end, but for rounding, is not in it.
    (start_us < end_us * (1.0 - 1e-9)).then(|| Phase { start_us, end_us, ..span.clone() })
}

fn legend(body: &mut String, diagram: &TimingDiagram, y_px: f64) -> f64 {
    let slots = diagram.bands.iter().filter(|band| band.frame == 0 && band.kind != BandKind::Readout).count();
    let mut names: Vec<(String, String)> = (0..slots)
        .map(|slot| {
            let number = if slots > 1 { format!(" {}", slot + 1) } else { String::new() };
            (format!("exposure{number}"), exposure_class(slot).to_owned())
        })
        .collect();
    names.push(("readout".to_owned(), "c".to_owned()));
    let mut x_px = LEFT_PX;
    for (name, class) in names {
        let opacity = if class == "c" { 1.0 } else { 0.55 };
        *body += &format!(
            "<rect x=\"{x_px:.1}\" y=\"{:.1}\" width=\"12\" height=\"12\" rx=\"2\" class=\"{class}\" opacity=\"{opacity}\"/>\n",
            y_px - 10.5
        );
        text(body, x_px + 18.0, y_px, "l", &name);
        x_px += 96.0;
    }
    y_px
}

fn exposure_class(slot: usize) -> &'static str {
    ["a", "b", "d", "s"][slot % 4]
}

/// A band as a parallelogram from the first row's span to the last row's. A readout is a line thick, which may be less than a
/// dot: its edge is drawn as well.
fn push_band(body: &mut String, band: &RowBand, scale: &TimeScale, top_px: f64) {
    let bottom_px = top_px + ROWS_PX;
    let [[first_start, first_end], [last_start, last_end]] =
        [band.first_us, band.last_us].map(|span| span.map(|us| scale.x_px(us)));
    let (class, opacity, edge) = match band.kind {
        BandKind::Exposure { slot } => (exposure_class(slot), if band.frame % 2 == 1 { 0.62 } else { 0.4 }, ""),
        BandKind::Readout => ("c", 1.0, " style=\"stroke:var(--c);stroke-width:1.5\""),
    };
    *body += &format!(
        "<path d=\"M{first_start:.1} {top_px:.1}L{first_end:.1} {top_px:.1}L{last_end:.1} {bottom_px:.1}L{last_start:.1} \
         {bottom_px:.1}Z\" class=\"{class}\" opacity=\"{opacity}\"{edge}/>\n"
    );
}

impl Phase {
    /// Spans by lane, in the order in which lanes first occur.
    pub(crate) fn by_lane(phases: &[Self]) -> Vec<(&str, Vec<&Self>)> {
        let mut lanes: Vec<(&str, Vec<&Self>)> = Vec::new();
        for phase in phases {
            match lanes.iter_mut().find(|(name, _)| *name == phase.lane) {
                Some((_, spans)) => spans.push(phase),
                None => lanes.push((&phase.lane, vec![phase])),
            }
        }
        lanes
    }
}
