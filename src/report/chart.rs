//! Draws charts in the page's colours as inline SVG whose text is text. Labels hold the units.
//!
//! Plotters draws in marker colours, which are then replaced by the page's variables, so a chart follows light and
//! dark.

mod axis;

use maud::{Markup, PreEscaped, html};
use plotters::prelude::*;

use crate::num::{greater, lesser};
use axis::{Axis, AxisSpan};

/// A colour of the page: that of the series of this number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ink {
    One = 1,
    Two,
    Three,
    Four,
    Five,
    Six,
}

impl Ink {
    const ALL: [Self; 6] = [Self::One, Self::Two, Self::Three, Self::Four, Self::Five, Self::Six];

    fn marker(self) -> RGBColor {
        RGBColor(1, 2, self as u8)
    }

    /// The page's variable of this colour.
    fn variable(self) -> String {
        format!("--s{}", self as u8)
    }
}

/// Markers of text, grid and axes, and what the page puts in their place.
const MARKERS: [(RGBColor, &str); 3] =
    [(RGBColor(1, 3, 1), "--soft"), (RGBColor(1, 3, 2), "--grid"), (RGBColor(1, 3, 3), "--rule")];

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SeriesShape {
    Dots,
    /// A line of this many pixels' width.
    Line(u32),
    /// The same with a dot at each point.
    Marked(u32),
    Ring,
}

pub(crate) struct Series<'a> {
    /// For the legend.
    pub name: &'a str,
    pub ink: Ink,
    pub shape: SeriesShape,
    /// Points of each unbroken stretch, in the axes' units; points that a logarithmic axis cannot show are left out.
    pub runs: Vec<Vec<(f64, f64)>>,
}

impl<'a> Series<'a> {
    /// A line of this many pixels' width.
    pub fn line(name: &'a str, ink: Ink, width_px: u32, runs: Vec<Vec<(f64, f64)>>) -> Self {
        Self { name, ink, shape: SeriesShape::Line(width_px), runs }
    }
}

/// Words beside a point.
pub(crate) struct Note {
    /// In the axes' units.
    pub at: (f64, f64),
    pub text: String,
    /// That of the point's series.
    pub ink: Ink,
}

/// What surrounds the series.
#[derive(Default)]
pub(crate) struct Axes<'a> {
    /// Said to a reader who cannot see the chart.
    pub title: &'a str,
    /// With unit.
    pub x_label: &'a str,
    /// With unit.
    pub y_label: &'a str,
    pub x_log: bool,
    pub y_log: bool,
    /// One unit is as long on both axes.
    pub equal: bool,
    pub from_zero: bool,
    pub notes: Vec<Note>,
}

impl<'a> Axes<'a> {
    /// A figure over the run's time.
    pub fn over_time(title: &'a str, y_label: &'a str) -> Self {
        Self { title, x_label: "time in s", y_label, ..Self::default() }
    }

    /// A point in the axes' own coordinates, logarithms where an axis is logarithmic; none where such an axis cannot show it.
    fn placed(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let coordinate = |is_log: bool, value: f64| if is_log { libm::log10(value) } else { value };
        let at = (coordinate(self.x_log, x), coordinate(self.y_log, y));
        (at.0.is_finite() && at.1.is_finite()).then_some(at)
    }
}

const SIZE_PX: (u32, u32) = (520, 320);
const LEFT_PX: u32 = 60;
const BOTTOM_PX: u32 = 42;
const MARGIN_PX: u32 = 12;
const DOT_RADIUS_PX: i32 = 3;
const RING_RADIUS_PX: i32 = 9;

/// Points whose second value is missing break the line.
pub(crate) fn runs_of(points: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<Vec<(f64, f64)>> {
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
pub(crate) fn chart(axes: &Axes<'_>, series: &[Series<'_>]) -> Markup {
    let placed: Vec<Series<'_>> = series.iter().map(|series| placed(axes, series)).collect();
    let Some((x, y)) = ranges(axes, &placed) else {
        return html! { p.note { (axes.title) ": nothing was measured." } };
    };
    let mut svg = String::new();
    draw(&mut svg, axes, &placed, x, y).expect("drawing into a string cannot fail");
    let zooms = zooms(axes, series);
    html! {
        figure.chart data-zooms[zooms] {
            @if series.len() > 1 { (legend(series)) }
            (themed(&svg, axes.title))
            @if zooms { (values(axes, series)) }
        }
    }
}

/// Whether a reader may zoom into a chart: lines over a common linear axis.
fn zooms(axes: &Axes<'_>, series: &[Series<'_>]) -> bool {
    let is_line = |series: &Series<'_>| {
        let rises = |run: &Vec<(f64, f64)>| run.windows(2).all(|pair| pair[0].0 < pair[1].0);
        matches!(series.shape, SeriesShape::Line(_)) && series.runs.iter().all(rises)
    };
    !axes.x_log && !axes.y_log && !axes.equal && axes.notes.is_empty() && series.iter().all(is_line)
}

/// The series as `zoom.js` reads them, to five digits.
fn values(axes: &Axes<'_>, series: &[Series<'_>]) -> Markup {
    // Numbers of JSON have neither infinities nor NaN.
    let number = |value: f64| if value.is_finite() { format!("{}", rounded(value)) } else { "null".to_owned() };
    let run = |run: &Vec<(f64, f64)>| {
        let points: Vec<String> = run.iter().map(|&(x, y)| format!("[{},{}]", number(x), number(y))).collect();
        format!("[{}]", points.join(","))
    };
    let one = |series: &Series<'_>| {
        let runs: Vec<String> = series.runs.iter().map(run).collect();
        let ink = series.ink.variable();
        format!("{{\"name\":{},\"ink\":\"{ink}\",\"runs\":[{}]}}", quoted(series.name), runs.join(","))
    };
    let all: Vec<String> = series.iter().map(one).collect();
    let [x, y] = [axes.x_label, axes.y_label].map(quoted);
    let json = format!("{{\"x\":{x},\"y\":{y},\"series\":[{}]}}", all.join(","));
    // Browsers do not decode character references in a script; `quoted` leaves no tag in it.
    html! { script type="application/json" { (PreEscaped(json)) } }
}

fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// A string of JSON in which no tag can end the script.
fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default().replace('<', "\\u003c")
}

/// The series in the axes' own coordinates.
fn placed<'a>(axes: &Axes<'_>, series: &Series<'a>) -> Series<'a> {
    let run = |run: &Vec<(f64, f64)>| run.iter().filter_map(|&at| axes.placed(at)).collect();
    Series { runs: series.runs.iter().map(run).collect(), ..*series }
}

fn legend(series: &[Series<'_>]) -> Markup {
    html! {
        ul.legend {
            @for series in series { li { svg viewBox="0 0 32 16" aria-hidden="true" { (sample(series)) } (series.name) } }
        }
    }
}

/// How a series looks.
fn sample(series: &Series<'_>) -> Markup {
    let ink = format!("var({})", series.ink.variable());
    match series.shape {
        SeriesShape::Line(width_px) => {
            html! { path d="M1 8H31" stroke=(ink) stroke-width=(f64::from(width_px) * 1.6) {} }
        }
        SeriesShape::Marked(width_px) => html! {
            path d="M1 8H31" stroke=(ink) stroke-width=(width_px) {}
            circle cx="16" cy="8" r="4" fill=(ink) {}
        },
        SeriesShape::Ring => html! { circle cx="16" cy="8" r="6" fill="none" stroke=(ink) stroke-width="2.5" {} },
        SeriesShape::Dots => html! { circle cx="16" cy="8" r="5" fill=(ink) {} },
    }
}

/// Puts the page's colours and fonts in, and a title for those who cannot see.
fn themed(svg: &str, title: &str) -> Markup {
    let inside = svg.split_once('>').and_then(|(_, rest)| rest.trim_end().strip_suffix("</svg>"));
    let mut inside = inside.unwrap_or_default().to_owned();
    let inks = Ink::ALL.iter().map(|ink| (ink.marker(), ink.variable()));
    for (RGBColor(r, g, b), variable) in inks.chain(MARKERS.map(|(marker, name)| (marker, name.to_owned()))) {
        inside = inside.replace(&format!("\"#{r:02X}{g:02X}{b:02X}\""), &format!("\"var({variable})\""));
    }
    inside = inside.replace(" font-family=\"sans-serif\"", "").replace(" opacity=\"1\"", "");
    let (width, height) = SIZE_PX;
    // Plotters escapes the text that it draws.
    html! { svg viewBox={ "0 0 " (width) " " (height) } role="img" { title { (title) } (PreEscaped(inside)) } }
}

/// Spans of both axes; none without a point.
fn ranges(axes: &Axes<'_>, series: &[Series<'_>]) -> Option<(AxisSpan, AxisSpan)> {
    let points = || series.iter().flat_map(|series| series.runs.iter().flatten().copied());
    let hull = |values: &mut dyn Iterator<Item = f64>| {
        values.map(|value| (value, value)).reduce(|a, b| (lesser(a.0, b.0), greater(a.1, b.1)))
    };
    let (x, y) = (hull(&mut points().map(|(x, _)| x))?, hull(&mut points().map(|(_, y)| y))?);
    Some(match (axes.equal, axes.from_zero) {
        (true, _) => equal(x, y),
        (false, true) => (widened(x, 0.0), (0.0, greater(y.1 * 1.08, 1e-12))),
        (false, false) => (widened(x, 0.02), widened(y, 0.06)),
    })
}

/// A range with room at both ends, and never empty.
fn widened((low, high): AxisSpan, share: f64) -> AxisSpan {
    let length = high - low;
    let room = if length > 0.0 { length * share } else { greater(0.5 * low.abs(), 0.5) };
    (low - room, high + room)
}

/// Lengthens the shorter axis about its middle until a metre is as long on both.
fn equal(x: AxisSpan, y: AxisSpan) -> (AxisSpan, AxisSpan) {
    let (x, y) = (widened(x, 0.05), widened(y, 0.05));
    let plot_px = (f64::from(SIZE_PX.0 - LEFT_PX - 2 * MARGIN_PX), f64::from(SIZE_PX.1 - BOTTOM_PX - 2 * MARGIN_PX));
    let unit = greater((x.1 - x.0) / plot_px.0, (y.1 - y.0) / plot_px.1);
    let around = |span: AxisSpan, px: f64| {
        let middle = 0.5 * (span.0 + span.1);
        (middle - 0.5 * unit * px, middle + 0.5 * unit * px)
    };
    (around(x, plot_px.0), around(y, plot_px.1))
}

type Drawn<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

fn draw<'a>(svg: &'a mut String, axes: &Axes<'_>, series: &[Series<'_>], x: AxisSpan, y: AxisSpan) -> Drawn<'a> {
    let area = SVGBackend::with_string(svg, SIZE_PX).into_drawing_area();
    let mut chart = ChartBuilder::on(&area)
        .margin(MARGIN_PX)
        .set_label_area_size(LabelAreaPosition::Left, LEFT_PX)
        .set_label_area_size(LabelAreaPosition::Bottom, BOTTOM_PX)
        .build_cartesian_2d(Axis { span: x, is_log: axes.x_log }, Axis { span: y, is_log: axes.y_log })?;
    let [(text, _), (grid, _), (axis, _)] = MARKERS;
    let font = ("sans-serif", 13).into_font().color(&text);
    chart
        .configure_mesh()
        .max_light_lines(0)
        .x_labels(6)
        .y_labels(6)
        .bold_line_style(grid)
        .light_line_style(grid)
        .axis_style(axis)
        .label_style(font.clone())
        .axis_desc_style(font)
        .x_desc(axes.x_label)
        .y_desc(axes.y_label)
        .draw()?;
    for series in series {
        let ink = series.ink.marker();
        for run in &series.runs {
            let dot = |&point: &(f64, f64)| Circle::new(point, DOT_RADIUS_PX, ink.filled());
            let ring = |&point: &(f64, f64)| Circle::new(point, RING_RADIUS_PX, ink.stroke_width(3));
            if let (SeriesShape::Line(width_px) | SeriesShape::Marked(width_px), true) = (series.shape, run.len() > 1) {
                chart.draw_series(LineSeries::new(run.iter().copied(), ink.stroke_width(width_px)))?;
            }
            match series.shape {
                SeriesShape::Line(_) if run.len() > 1 => {}
                SeriesShape::Ring => {
                    chart.draw_series(run.iter().map(ring))?;
                }
                SeriesShape::Line(_) | SeriesShape::Marked(_) | SeriesShape::Dots => {
                    chart.draw_series(run.iter().map(dot))?;
                }
            }
        }
    }
    for note in &axes.notes {
        let Some(at) = axes.placed(note.at) else { continue };
        let font = ("sans-serif", 12).into_font().color(&note.ink.marker());
        let text = EmptyElement::at(at) + Text::new(note.text.clone(), (5, -14), font);
        chart.draw_series(std::iter::once(text))?;
    }
    area.present()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[(f64, f64)]) -> Series<'static> {
        Series::line("a", Ink::One, 2, vec![points.to_vec()])
    }

    fn axes(equal: bool) -> Axes<'static> {
        Axes { title: "t <1>", x_label: "x in m", y_label: "y in m", equal, ..Axes::default() }
    }

    #[test]
    fn a_chart_holds_no_colour_of_its_own_and_its_text_is_text() {
        let svg = chart(&axes(false), &[line(&[(0.0, 1.0), (1.0, 3.0)])]).into_string();
        assert!(!svg.contains("\"#"), "{svg}");
        assert!(svg.contains("var(--s1)") && svg.contains("x in m") && svg.contains("<title>t &lt;1&gt;</title>"));
    }

    #[test]
    fn a_logarithmic_chart_skips_what_has_no_logarithm() {
        let axes = Axes { title: "t", x_log: true, y_log: true, ..Axes::default() };
        let points = vec![(0.0, 1.0), (1.0, 3.0), (10.0, 5.0)];
        let dots = Series { name: "a", ink: Ink::Four, shape: SeriesShape::Dots, runs: vec![points] };
        let svg = chart(&axes, &[dots]).into_string();
        assert!(!svg.contains("\"#") && svg.contains("var(--s4)"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(chart(&axes, &[]).into_string().contains("nothing was measured"));
    }

    #[test]
    fn a_metre_is_as_long_on_both_axes() {
        let (x, y) = equal((0.0, 1.0), (5.0, 25.0));
        let (plot_x_px, plot_y_px) = (436.0, 254.0);
        assert!(((x.1 - x.0) / plot_x_px - (y.1 - y.0) / plot_y_px).abs() < 1e-12);
        assert!(x.0 <= 0.0 && x.1 >= 1.0 && y.0 <= 5.0 && y.1 >= 25.0);
    }

    #[test]
    fn one_point_no_point_and_a_flat_line_are_charts_too() {
        for points in [&[][..], &[(1.0, 1.0)], &[(0.0, 0.0), (1.0, 0.0)]] {
            for equal in [false, true] {
                let svg = chart(&axes(equal), &[line(points)]).into_string();
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
