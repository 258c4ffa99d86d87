//! Line charts in the page's colours. Enters: points with units in their labels. Leaves: inline SVG whose text is text.
//!
//! Plotters draws in marker colours, which are then replaced by the page's variables, so a chart follows light and
//! dark.

use plotters::prelude::*;

use crate::num::{greater, i32_truncated, lesser};
use crate::report::html::text::escaped;

/// A colour of the page.
#[derive(Clone, Copy)]
pub(super) enum Ink {
    /// First series.
    One,
    /// Second series.
    Two,
    /// Third series.
    Three,
}

impl Ink {
    fn marker(self) -> RGBColor {
        match self {
            Self::One => RGBColor(1, 2, 1),
            Self::Two => RGBColor(1, 2, 2),
            Self::Three => RGBColor(1, 2, 3),
        }
    }

    /// The page's variable of this colour.
    pub(super) fn variable(self) -> &'static str {
        match self {
            Self::One => "var(--s1)",
            Self::Two => "var(--s2)",
            Self::Three => "var(--s3)",
        }
    }
}

const TEXT_MARKER: RGBColor = RGBColor(1, 3, 1);
const GRID_MARKER: RGBColor = RGBColor(1, 3, 2);
const AXIS_MARKER: RGBColor = RGBColor(1, 3, 3);

/// Each marker as plotters writes it, and what the page puts in its place.
const MARKERS: [(&str, &str); 6] = [
    ("\"#010201\"", "\"var(--s1)\""),
    ("\"#010202\"", "\"var(--s2)\""),
    ("\"#010203\"", "\"var(--s3)\""),
    ("\"#010301\"", "\"var(--soft)\""),
    ("\"#010302\"", "\"var(--grid)\""),
    ("\"#010303\"", "\"var(--rule)\""),
];

/// A line with gaps between its runs.
pub(super) struct Series {
    /// For the legend.
    pub name: &'static str,
    /// Colour.
    pub ink: Ink,
    /// Width of the stroke in px.
    pub width_px: u32,
    /// Points of each unbroken stretch.
    pub runs: Vec<Vec<(f64, f64)>>,
}

/// What surrounds the lines.
pub(super) struct Frame<'a> {
    /// Said to a reader who cannot see the chart.
    pub title: &'a str,
    /// With unit.
    pub x_label: &'a str,
    /// With unit.
    pub y_label: &'a str,
    /// One unit is as long on both axes.
    pub equal_axes: bool,
    /// The vertical axis starts at zero.
    pub from_zero: bool,
}

const SIZE_PX: (u32, u32) = (520, 320);
const LEFT_PX: u32 = 56;
const BOTTOM_PX: u32 = 42;
const MARGIN_PX: u32 = 12;

/// Points whose second value is missing break the line.
pub(super) fn runs_of(points: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<Vec<(f64, f64)>> {
    let mut runs = vec![Vec::new()];
    for (x, y) in points {
        match (y, runs.last_mut()) {
            (Some(y), Some(run)) => run.push((x, y)),
            _ => runs.push(Vec::new()),
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// The chart as a figure with its legend; without any point, a sentence that says so.
pub(super) fn chart(frame: &Frame<'_>, series: &[Series]) -> String {
    let Some((x, y)) = ranges(frame, series) else {
        return format!("<p class=\"note\">{}: nothing was measured.</p>", escaped(frame.title));
    };
    let mut svg = String::new();
    draw(&mut svg, frame, series, x, y).expect("drawing into a string cannot fail");
    let title = escaped(frame.title);
    format!("<figure class=\"chart\">{}{}</figure>", legend(series), themed(&svg, &title))
}

fn legend(series: &[Series]) -> String {
    if series.len() < 2 {
        return String::new();
    }
    let entry = |series: &Series| {
        let (ink, width) = (series.ink.variable(), f64::from(series.width_px) * 1.6);
        format!(
            "<li><svg viewBox=\"0 0 32 16\" aria-hidden=\"true\">\
             <path d=\"M1 8H31\" stroke=\"{ink}\" stroke-width=\"{width}\"/></svg>{}</li>",
            escaped(series.name)
        )
    };
    format!("<ul class=\"legend\">{}</ul>", series.iter().map(entry).collect::<String>())
}

/// Puts the page's colours and fonts in, and a title for those who cannot see.
fn themed(svg: &str, title: &str) -> String {
    let body = svg.split_once('>').map_or("", |(_, body)| body);
    let (width, height) = SIZE_PX;
    let mut page = format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\"><title>{title}</title>{body}");
    for (marker, ink) in MARKERS {
        page = page.replace(marker, ink);
    }
    page.replace(" font-family=\"sans-serif\"", "").replace(" opacity=\"1\"", "")
}

type Span = (f64, f64);

fn ranges(frame: &Frame<'_>, series: &[Series]) -> Option<(Span, Span)> {
    let points = || series.iter().flat_map(|series| series.runs.iter().flatten().copied());
    let (first_x, first_y) = points().next()?;
    let hull = |start: f64, values: &mut dyn Iterator<Item = f64>| {
        values.fold((start, start), |(low, high), value| (lesser(low, value), greater(high, value)))
    };
    let x = hull(first_x, &mut points().map(|(x, _)| x));
    let y = hull(first_y, &mut points().map(|(_, y)| y));
    Some(match (frame.equal_axes, frame.from_zero) {
        (true, _) => equal(x, y),
        (false, true) => (widened(x, 0.0), (0.0, greater(y.1 * 1.08, 1e-12))),
        (false, false) => (widened(x, 0.0), widened(y, 0.06)),
    })
}

/// A range with room at both ends, and never empty.
fn widened((low, high): Span, share: f64) -> Span {
    let length = high - low;
    let room = if length > 0.0 { length * share } else { greater(0.5 * low.abs(), 0.5) };
    (low - room, high + room)
}

/// Lengthens the shorter axis about its middle until a metre is as long on both.
fn equal(x: Span, y: Span) -> (Span, Span) {
    let (x, y) = (widened(x, 0.05), widened(y, 0.05));
    let plot_px = (f64::from(SIZE_PX.0 - LEFT_PX - 2 * MARGIN_PX), f64::from(SIZE_PX.1 - BOTTOM_PX - 2 * MARGIN_PX));
    let unit = greater((x.1 - x.0) / plot_px.0, (y.1 - y.0) / plot_px.1);
    let around = |span: Span, px: f64| {
        let middle = 0.5 * (span.0 + span.1);
        (middle - 0.5 * unit * px, middle + 0.5 * unit * px)
    };
    (around(x, plot_px.0), around(y, plot_px.1))
}

/// Decimals with which some six ticks of a range differ.
fn decimals(span: Span) -> usize {
    let step = (span.1 - span.0) / 6.0;
    usize::try_from(i32_truncated(libm::ceil(-libm::log10(step))).clamp(0, 9)).unwrap_or(0)
}

type Drawn<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

fn draw<'a>(svg: &'a mut String, frame: &Frame<'_>, series: &[Series], x: Span, y: Span) -> Drawn<'a> {
    let area = SVGBackend::with_string(svg, SIZE_PX).into_drawing_area();
    let mut chart = ChartBuilder::on(&area)
        .margin(MARGIN_PX)
        .set_label_area_size(LabelAreaPosition::Left, LEFT_PX)
        .set_label_area_size(LabelAreaPosition::Bottom, BOTTOM_PX)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    let (x_decimals, y_decimals) = (decimals(x), decimals(y));
    chart
        .configure_mesh()
        .max_light_lines(0)
        .x_labels(6)
        .y_labels(6)
        .bold_line_style(GRID_MARKER)
        .axis_style(AXIS_MARKER)
        .label_style(("sans-serif", 13).into_font().color(&TEXT_MARKER))
        .axis_desc_style(("sans-serif", 13).into_font().color(&TEXT_MARKER))
        .x_desc(frame.x_label)
        .y_desc(frame.y_label)
        .x_label_formatter(&|value| format!("{:.x_decimals$}", clean(*value)))
        .y_label_formatter(&|value| format!("{:.y_decimals$}", clean(*value)))
        .draw()?;
    for series in series {
        let style = series.ink.marker().stroke_width(series.width_px);
        for run in &series.runs {
            if let [point] = run[..] {
                chart.draw_series([Circle::new(point, 2, series.ink.marker().filled())])?;
            }
            chart.draw_series(LineSeries::new(run.iter().copied(), style))?;
        }
    }
    area.present()
}

/// Without the minus sign of a rounded zero.
fn clean(value: f64) -> f64 {
    if value.abs() < 1e-12 { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[(f64, f64)]) -> Series {
        Series { name: "a", ink: Ink::One, width_px: 2, runs: vec![points.to_vec()] }
    }

    fn frame(equal_axes: bool) -> Frame<'static> {
        Frame { title: "t <1>", x_label: "x in m", y_label: "y in m", equal_axes, from_zero: false }
    }

    #[test]
    fn a_chart_holds_no_colour_of_its_own_and_its_text_is_text() {
        let svg = chart(&frame(false), &[line(&[(0.0, 1.0), (1.0, 3.0)])]);
        assert!(!svg.contains("\"#"), "{svg}");
        assert!(svg.contains("var(--s1)") && svg.contains("x in m") && svg.contains("<title>t &lt;1&gt;</title>"));
    }

    #[test]
    fn a_metre_is_as_long_on_both_axes() {
        let (x, y) = equal((0.0, 1.0), (5.0, 25.0));
        let (plot_x_px, plot_y_px) = (440.0, 254.0);
        assert!(((x.1 - x.0) / plot_x_px - (y.1 - y.0) / plot_y_px).abs() < 1e-12);
        assert!(x.0 <= 0.0 && x.1 >= 1.0 && y.0 <= 5.0 && y.1 >= 25.0);
    }

    #[test]
    fn one_point_no_point_and_a_flat_line_are_charts_too() {
        for points in [&[][..], &[(1.0, 1.0)], &[(0.0, 0.0), (1.0, 0.0)]] {
            for equal_axes in [false, true] {
                let svg = chart(&frame(equal_axes), &[line(points)]);
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            }
        }
    }

    #[test]
    fn a_missing_value_breaks_the_line() {
        let points = [(0.0, Some(1.0)), (1.0, None), (2.0, Some(2.0)), (3.0, Some(3.0))];
        assert_eq!(runs_of(points.into_iter()), [vec![(0.0, 1.0)], vec![(2.0, 2.0), (3.0, 3.0)]]);
    }
}
