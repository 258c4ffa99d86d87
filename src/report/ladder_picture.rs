//! Writes the Pareto picture of a ladder as a stand-alone SVG whose letters are text.

use plotters::prelude::*;

use crate::num::{greater, lesser};
use crate::report::ladder_record::{LadderRecord, LadderRow};

const SIZE_PX: (u32, u32) = (900, 540);

/// Name of the knob in the record, for a person, and its colour.
const KNOBS: [(&str, &str, RGBColor); 5] = [
    ("samples_per_pixel", "rays in every pixel", RGBColor(184, 74, 0)),
    ("render_tolerance", "render tolerance", RGBColor(0, 116, 90)),
    ("reflections", "reflections", RGBColor(125, 63, 134)),
    ("effects", "effects left out", RGBColor(90, 90, 90)),
    ("subframes", "sub-frames merged", RGBColor(190, 0, 60)),
];

/// Error over time; none without two points to span the axes.
pub fn svg(record: &LadderRecord) -> Option<String> {
    let points = |wanted: &dyn Fn(&LadderRow) -> bool| -> Vec<(f64, f64)> {
        let rows = record.rows.iter().filter(|row| wanted(row));
        rows.filter_map(|row| Some((row.ms_per_frame, row.photon_noise_ratio?)))
            .filter(|at| at.0 > 0.0 && at.1 > 0.0)
            .collect()
    };
    let all = points(&|_| true);
    let span = |of: &dyn Fn(&(f64, f64)) -> f64| {
        all.iter().map(of).fold((f64::INFINITY, 0.0), |(low, high), value| (lesser(low, value), greater(high, value)))
    };
    let (times, errors) = (span(&|at| at.0), span(&|at| at.1));
    if !(times.1 > times.0 && errors.1 > errors.0) {
        return None;
    }
    let mut text = String::new();
    draw(&mut text, record, (times, errors), &points).expect("drawing into a string cannot fail");
    Some(text)
}

type Ends = (f64, f64);
type Points<'a> = dyn Fn(&dyn Fn(&LadderRow) -> bool) -> Vec<(f64, f64)> + 'a;

fn draw(
    text: &mut String,
    record: &LadderRecord,
    (times, errors): (Ends, Ends),
    points: &Points<'_>,
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let area = SVGBackend::with_string(text, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let caption = format!("{}: what accuracy costs in time", record.scenario);
    let mut chart = ChartBuilder::on(&area)
        .caption(caption, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(64)
        .build_cartesian_2d(
            (0.8 * times.0..1.25 * times.1).log_scale(),
            (0.8 * errors.0..1.25 * errors.1).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc("processor time in ms per frame of the rig")
        .y_desc("error of the picture in photon noise")
        .light_line_style(BLACK.mix(0.06))
        .label_style(("sans-serif", 14))
        .draw()?;
    let blue = RGBColor(0, 100, 160);
    chart
        .draw_series(LineSeries::new(points(&|row| row.on_front), blue.stroke_width(2)))?
        .label("front of all combinations")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], blue.stroke_width(2)));
    for (knob, name, colour) in KNOBS {
        let of_knob = points(&|row| row.knob == knob);
        chart
            .draw_series(of_knob.into_iter().map(|at| Circle::new(at, 5, colour.filled())))?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 9, y), 5, colour.filled()));
    }
    let reference = points(&|row| row.knob == "reference");
    chart
        .draw_series(reference.into_iter().map(|at| Cross::new(at, 6, BLACK.stroke_width(2))))?
        .label("reference, at its standard error")
        .legend(|(x, y)| Cross::new((x + 9, y), 5, BLACK.stroke_width(2)));
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 14))
        .draw()?;
    area.present()
}
