//! Features found and tracked over time, and the picture's brightness beside them.

use maud::{Markup, html};

use super::parts::section;
use crate::report::chart::{Axes, Ink, Series, chart};
use crate::report::html::text::digits;
use crate::report::record::{FrameRecord, Report};

pub(super) fn features(report: &Report) -> Markup {
    let line = |name, ink, width_px, value: fn(&FrameRecord) -> f64| {
        let points = report.frames.iter().map(|frame| (frame.t_s, value(frame))).collect();
        Series::line(name, ink, width_px, vec![points])
    };
    let counts = [
        line("found by the sensors", Ink::Three, 2, |frame| f64::from(frame.found)),
        line("used by the tracker", Ink::One, 3, |frame| f64::from(frame.tracked)),
    ];
    let codes = [line("mean code", Ink::One, 2, |frame| frame.mean_code_dn)];
    let content = html! {
        (chart(&Axes { from_zero: true, ..Axes::over_time("Features over time", "features") }, &counts))
        h3 { "Brightness" }
        (chart(&Axes::over_time("Mean code over time", "mean code in DN"), &codes))
    };
    let number = |value: Option<f64>| value.map_or("no".to_owned(), digits);
    let lead = format!(
        "{} features found per camera and frame, {} tracked per frame (medians).",
        number(report.features.median_found),
        number(report.features.median_tracked)
    );
    let figures = &report.features;
    let lead = match figures.threshold {
        Some(threshold) => format!(
            "{lead} Means per frame and camera: {} corners found, and {} too near to an edge for a patch; of the former {} were not \
             selected in their cell, {} were dropped by a full queue and {} came too late. Rows waited {} clocks per frame. The last \
             threshold was {threshold}. The link dropped {} features in the whole run.",
            digits(figures.corners),
            digits(figures.without_patch),
            digits(figures.unselected),
            digits(figures.dropped),
            digits(figures.late),
            digits(figures.stalled_clk),
            report.link.features_dropped
        ),
        None => lead,
    };
    section("Features", &lead, content)
}
