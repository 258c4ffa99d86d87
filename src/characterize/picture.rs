//! Charts and maps of the report in the page's colours. Enters: points with units in their labels; deviations of pixels. Leaves: inline
//! SVG whose text is text. Plotters draws in marker colours, which are then replaced by the page's variables.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;

use crate::num::{greater, i32_truncated, lesser, low_u8, u32_truncated};
use crate::units::Size;

/// How a series is drawn.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// Dots.
    Dots,
    /// A line.
    Line,
}

/// A colour of the page: the first to the fourth.
pub(super) type Ink = usize;

/// Points that belong together.
pub(super) struct Series {
    /// For the legend.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// Dots or line.
    pub shape: Shape,
    /// In the axes' units; points that a logarithmic axis has no place for are left out.
    pub points: Vec<(f64, f64)>,
}

/// What surrounds the series.
#[derive(Default)]
pub(super) struct Axes<'a> {
    /// Said to a reader who cannot see the chart.
    pub title: &'a str,
    /// With unit.
    pub x_label: &'a str,
    /// With unit.
    pub y_label: &'a str,
    /// Logarithmic horizontal axis.
    pub x_log: bool,
    /// Logarithmic vertical axis.
    pub y_log: bool,
}

const INKS: [RGBColor; 4] = [RGBColor(1, 2, 1), RGBColor(1, 2, 2), RGBColor(1, 2, 3), RGBColor(1, 2, 4)];
const TEXT: RGBColor = RGBColor(1, 3, 1);
const GRID: RGBColor = RGBColor(1, 3, 2);
const AXIS: RGBColor = RGBColor(1, 3, 3);
const MARKERS: [(&str, &str); 7] = [
    ("\"#010201\"", "\"var(--s1)\""),
    ("\"#010202\"", "\"var(--s2)\""),
    ("\"#010203\"", "\"var(--s3)\""),
    ("\"#010204\"", "\"var(--s4)\""),
    ("\"#010301\"", "\"var(--soft)\""),
    ("\"#010302\"", "\"var(--grid)\""),
    ("\"#010303\"", "\"var(--rule)\""),
];
const SIZE_PX: (u32, u32) = (520, 320);

type Span = (f64, f64);

/// The chart as a figure with its legend; without any point, a sentence that says so.
pub(super) fn chart(axes: &Axes<'_>, series: &[Series]) -> String {
    let placed: Vec<Series> = series.iter().map(|series| placed(axes, series)).collect();
    let points = || placed.iter().flat_map(|series| series.points.iter().copied());
    let (Some(x), Some(y)) = (hull(points().map(|point| point.0), 0.02), hull(points().map(|point| point.1), 0.06))
    else {
        return format!("<p class=\"note\">{}: nothing to show.</p>", axes.title);
    };
    let mut svg = String::new();
    draw(&mut svg, axes, &placed, x, y).expect("drawing into a string cannot fail");
    format!("<figure class=\"chart\">{}{}</figure>", legend(series), themed(&svg, axes.title))
}

fn placed(axes: &Axes<'_>, series: &Series) -> Series {
    let place = |is_log: bool, value: f64| if is_log { libm::log10(value) } else { value };
    let points = series.points.iter().map(|&(x, y)| (place(axes.x_log, x), place(axes.y_log, y)));
    Series {
        name: series.name.clone(),
        points: points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect(),
        ..*series
    }
}

fn hull(values: impl Iterator<Item = f64>, share: f64) -> Option<Span> {
    let (low, high) = values.map(|value| (value, value)).reduce(|a, b| (lesser(a.0, b.0), greater(a.1, b.1)))?;
    let room = if high > low { (high - low) * share } else { greater(0.5 * low.abs(), 0.5) };
    Some((low - room, high + room))
}

fn legend(series: &[Series]) -> String {
    if series.len() < 2 {
        return String::new();
    }
    let entry = |series: &Series| {
        let ink = format!("var(--s{})", series.ink + 1);
        let sample = match series.shape {
            Shape::Line => format!("<path d=\"M1 8H31\" stroke=\"{ink}\" stroke-width=\"3\"/>"),
            Shape::Dots => format!("<circle cx=\"16\" cy=\"8\" r=\"5\" fill=\"{ink}\"/>"),
        };
        format!("<li><svg viewBox=\"0 0 32 16\" aria-hidden=\"true\">{sample}</svg>{}</li>", series.name)
    };
    format!("<ul class=\"legend\">{}</ul>", series.iter().map(entry).collect::<String>())
}

fn themed(svg: &str, title: &str) -> String {
    let body = svg.split_once('>').map_or("", |(_, body)| body);
    let (width, height) = SIZE_PX;
    let mut page = format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\"><title>{title}</title>{body}");
    for (marker, ink) in MARKERS {
        page = page.replace(marker, ink);
    }
    page.replace(" font-family=\"sans-serif\"", "").replace(" opacity=\"1\"", "")
}

type Drawn<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

fn draw<'a>(svg: &'a mut String, axes: &Axes<'_>, series: &[Series], x: Span, y: Span) -> Drawn<'a> {
    let area = SVGBackend::with_string(svg, SIZE_PX).into_drawing_area();
    let mut chart = ChartBuilder::on(&area)
        .margin(12)
        .set_label_area_size(LabelAreaPosition::Left, 60)
        .set_label_area_size(LabelAreaPosition::Bottom, 42)
        .build_cartesian_2d(Axis { span: x, is_log: axes.x_log }, Axis { span: y, is_log: axes.y_log })?;
    chart
        .configure_mesh()
        .max_light_lines(0)
        .x_labels(6)
        .y_labels(6)
        .bold_line_style(GRID)
        .light_line_style(GRID)
        .axis_style(AXIS)
        .label_style(("sans-serif", 13).into_font().color(&TEXT))
        .axis_desc_style(("sans-serif", 13).into_font().color(&TEXT))
        .x_desc(axes.x_label)
        .y_desc(axes.y_label)
        .draw()?;
    for series in series {
        let ink = INKS[series.ink];
        match series.shape {
            Shape::Line => {
                chart.draw_series(LineSeries::new(series.points.iter().copied(), ink.stroke_width(2)))?;
            }
            Shape::Dots => {
                chart.draw_series(series.points.iter().map(|&point| Circle::new(point, 3, ink.filled())))?;
            }
        }
    }
    area.present()
}

/// An axis with ticks of its own: plotters has no logarithmic axis that names powers of ten.
struct Axis {
    span: Span,
    is_log: bool,
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value - self.span.0) / (self.span.1 - self.span.0);
        limit.0 + i32_truncated((share * f64::from(limit.1 - limit.0)).round_ties_even())
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        ticks(self.span, self.is_log)
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.span.0..self.span.1
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        label(*value, self.is_log, self.span)
    }
}

/// Places of ticks: some five round numbers, or on a logarithmic axis powers of ten, with 2 and 5 between them where few fit.
fn ticks(span: Span, is_log: bool) -> Vec<f64> {
    if is_log {
        let factors: &[f64] = if span.1 - span.0 > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = i32_truncated(libm::floor(span.0))..=i32_truncated(libm::ceil(span.1));
        let places =
            decades.flat_map(|power| factors.iter().map(move |factor| f64::from(power) + libm::log10(*factor)));
        return places.filter(|place| (span.0..=span.1).contains(place)).collect();
    }
    let rough = (span.1 - span.0) / 5.0;
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= rough);
    let step = step.expect("ten times a power of ten exceeds what lies above that power");
    let first = libm::ceil(span.0 / step);
    (0..=10).map(|index| (first + f64::from(index)) * step).filter(|place| *place <= span.1).collect()
}

/// A tick's number, with as many decimals as its axis' steps need.
fn label(place: f64, is_log: bool, span: Span) -> String {
    if !is_log {
        let step = (span.1 - span.0) / 5.0;
        let places = usize::try_from(i32_truncated(libm::ceil(-libm::log10(step))).clamp(0, 9)).unwrap_or(0);
        let place = if place.abs() < 1e-3 * step { 0.0 } else { place };
        return format!("{place:.places$}");
    }
    let number = libm::pow(10.0, place);
    match number {
        small if small < 0.0095 => format!("{small:.0e}"),
        low if low < 9.5 => format!("{}", (low * 100.0).round_ties_even() / 100.0),
        large if large < 99_999.0 => format!("{large:.0}"),
        huge => format!("{huge:.0e}"),
    }
}

/// Deviations of pixels as grey values, `-limit` black and `limit` white.
pub(super) fn map(values: &[f64], size: Size, limit: f64, caption: &str) -> String {
    let grey = |value: &f64| {
        let share = 0.5 + 0.5 * value / limit;
        low_u8(u32_truncated(255.0 * lesser(1.0, greater(0.0, share)) + 0.5))
    };
    let bytes: Vec<u8> = values.iter().map(grey).collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&bytes, size.width_px, size.height_px, ExtendedColorType::L8)
        .expect("a map has as many values as pixels");
    let (width, height) = (size.width_px, size.height_px);
    format!(
        "<figure><svg viewBox=\"0 0 {width} {height}\" role=\"img\" style=\"display:block;width:100%;height:auto;border-radius:6px\">\
         <title>{caption}</title><image width=\"{width}\" height=\"{height}\" style=\"image-rendering:pixelated\" \
         href=\"data:image/png;base64,{}\"/></svg><figcaption>{caption}</figcaption></figure>",
        STANDARD.encode(png)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks((-0.3, 9.7), false), [0.0, 2.0, 4.0, 6.0, 8.0]);
        let labels =
            |span| -> Vec<String> { ticks(span, true).iter().map(|&place| label(place, true, span)).collect() };
        assert_eq!(labels((0.9, 2.1)), ["10", "20", "50", "100"]);
        assert_eq!(labels((-3.2, 1.0)), ["1e-3", "0.01", "0.1", "1", "10"]);
    }

    #[test]
    fn a_chart_holds_no_colour_of_its_own_and_skips_what_a_logarithm_has_no_place_for() {
        let axes = Axes { title: "t", x_label: "x", y_label: "y", x_log: true, y_log: true };
        let points = vec![(0.0, 1.0), (1.0, 3.0), (10.0, 5.0)];
        let svg = chart(&axes, &[Series { name: "a".to_owned(), ink: 3, shape: Shape::Dots, points }]);
        assert!(!svg.contains("\"#") && svg.contains("var(--s4)"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(chart(&axes, &[]).contains("nothing to show"));
    }
}
