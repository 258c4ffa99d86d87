//! Draws a figure by the levels of a factor as a stand-alone SVG whose letters are text.

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::interaction::Interaction;
use crate::num::{f64_from_usize, greater, index, lesser, u32_truncated};
use crate::statistics::MeanEstimate;

const SIZE_PX: (u32, u32) = (760, 430);

/// Colours that also differ in lightness.
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 100, 160),
    RGBColor(196, 84, 0),
    RGBColor(0, 116, 90),
    RGBColor(125, 63, 134),
    RGBColor(90, 90, 90),
    RGBColor(190, 0, 60),
];

/// The picture; none without a mean.
pub fn svg(interaction: &Interaction) -> Option<String> {
    let estimates = || interaction.series.iter().flat_map(|series| series.means.iter().flatten());
    let ends = |estimate: &MeanEstimate| estimate.interval.unwrap_or([estimate.mean; 2]);
    // A logarithmic axis cannot show what is not above zero.
    let low = estimates().map(|one| if interaction.y_log { lowest(one) } else { ends(one)[0] }).reduce(lesser)?;
    let high = estimates().map(|one| ends(one)[1]).reduce(greater)?;
    let is_log = interaction.y_log && low > 0.0;
    let mut text = String::new();
    let drawn = if is_log {
        draw(&mut text, interaction, (0.8 * low..1.25 * high).log_scale())
    } else {
        let margin = greater(0.06 * (high - low), 1e-12 * greater(high.abs(), 1.0));
        let start = if low >= 0.0 { greater(low - margin, 0.0) } else { low - margin };
        draw(&mut text, interaction, start..high + margin)
    };
    drawn.expect("drawing into a string cannot fail");
    Some(text)
}

/// The lower end of an interval if it is above zero, else the mean.
fn lowest(estimate: &MeanEstimate) -> f64 {
    estimate.interval.map(|[low, _]| low).filter(|low| *low > 0.0).unwrap_or(estimate.mean)
}

/// The right corner that is further from the last means.
fn legend_position(interaction: &Interaction) -> SeriesLabelPosition {
    let means =
        |series: &super::interaction::LevelMeans| series.means.iter().flatten().map(|one| one.mean).collect::<Vec<_>>();
    let all: Vec<f64> = interaction.series.iter().flat_map(means).collect();
    let last: Vec<f64> = interaction.series.iter().filter_map(|series| means(series).last().copied()).collect();
    if crate::statistics::mean(&last) > crate::statistics::mean(&all) {
        SeriesLabelPosition::LowerRight
    } else {
        SeriesLabelPosition::UpperRight
    }
}

fn draw<Y>(text: &mut String, interaction: &Interaction, y: Y) -> Result<(), DrawingAreaErrorKind<std::io::Error>>
where
    Y: AsRangedCoord<Value = f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let area = SVGBackend::with_string(text, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let count = interaction.levels.len();
    let mut chart = ChartBuilder::on(&area)
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(84)
        .build_cartesian_2d(-0.5..f64_from_usize(count) - 0.5, y)?;
    let level = |at: &f64| {
        let number = index(u32_truncated(*at + 0.5));
        let is_level = (*at - f64_from_usize(number)).abs() < 1e-9 && *at > -0.25;
        interaction.levels.get(number).filter(|_| is_level).cloned().unwrap_or_default()
    };
    let value = |value: &f64| super::digits::digits(*value);
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_labels(2 * count + 1)
        .x_label_formatter(&level)
        .y_label_formatter(&value)
        .x_desc(interaction.by.as_str())
        .y_desc(interaction.label())
        .light_line_style(BLACK.mix(0.06))
        .label_style(("sans-serif", 14))
        .draw()?;
    let middle = f64_from_usize(interaction.series.len() - 1) / 2.0;
    for (number, series) in interaction.series.iter().enumerate() {
        let colour = COLOURS[number % COLOURS.len()];
        // Series stand a little apart, so that their bars do not hide each other.
        let aside = 0.08 * (f64_from_usize(number) - middle);
        let at = |(level, one): (usize, &Option<MeanEstimate>)| Some((f64_from_usize(level) + aside, (*one)?));
        let found: Vec<(f64, MeanEstimate)> = series.means.iter().enumerate().filter_map(at).collect();
        for (x, one) in &found {
            let low = if interaction.y_log { lowest(one) } else { one.interval.map_or(one.mean, |ends| ends[0]) };
            let high = one.interval.map_or(one.mean, |ends| ends[1]);
            chart.draw_series([PathElement::new([(*x, low), (*x, high)], colour.stroke_width(2))])?;
        }
        let points: Vec<(f64, f64)> = found.iter().map(|(x, one)| (*x, one.mean)).collect();
        chart.draw_series(LineSeries::new(points.clone(), colour.mix(0.35).stroke_width(1)))?;
        let dots = chart.draw_series(points.into_iter().map(|at| Circle::new(at, 4, colour.filled())))?;
        if !series.name.is_empty() {
            dots.label(&series.name).legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
        }
    }
    if interaction.series.iter().any(|series| !series.name.is_empty()) {
        chart
            .configure_series_labels()
            .position(legend_position(interaction))
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 14))
            .draw()?;
    }
    area.present()
}
