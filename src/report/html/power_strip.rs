//! Power over a line as a strip: blocks stacked, the mean of a frame as a line across.

use crate::num::f64_from_usize;
use crate::report::energy_record::LinePower;
use crate::report::html::text::{digits, escaped, si};

/// Width and height of the drawing, in units of the picture.
const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 120.0;
/// Colours of the blocks, told apart in light and dark and without red against green.
const COLOURS: [&str; 6] = ["#4477aa", "#ee6677", "#ccbb44", "#228833", "#66ccee", "#aa3377"];

pub(super) fn strip(line: &LinePower) -> String {
    if line.line_us <= 0.0 || line.peak_mw <= 0.0 {
        return String::new();
    }
    let (x, y) = (|time_us: f64| WIDTH * time_us / line.line_us, |mw: f64| HEIGHT * (1.0 - mw / line.peak_mw));
    let mut drawn = String::new();
    for span in &line.spans {
        let mut below_mw = 0.0;
        for ((name, &mw), colour) in span.blocks_mw.iter().zip(COLOURS) {
            let (left, width) = (x(span.start_us), x(span.end_us) - x(span.start_us));
            let (top, height) = (y(below_mw + mw), HEIGHT * mw / line.peak_mw);
            let length = si(1e-6 * (span.end_us - span.start_us), "s");
            drawn += &format!(
                "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" fill=\"{colour}\"><title>{}, {} mW \
                 for {length}</title></rect>",
                escaped(name),
                digits(mw)
            );
            below_mw += mw;
        }
    }
    let mean_y = y(line.frame_mean_mw);
    let names = line.spans.first().map_or_else(Vec::new, |span| span.blocks_mw.iter().map(|(name, _)| name).collect());
    let mut legend = String::new();
    for (at, (name, colour)) in names.into_iter().zip(COLOURS).enumerate() {
        let left = 130.0 * f64_from_usize(at);
        legend += &format!(
            "<rect x=\"{left}\" y=\"{}\" width=\"12\" height=\"12\" fill=\"{colour}\"/><text x=\"{}\" y=\"{}\" font-size=\"14\" \
             fill=\"currentColor\">{}</text>",
            HEIGHT + 10.0,
            left + 17.0,
            HEIGHT + 21.0,
            escaped(name)
        );
    }
    format!(
        "<figure class=\"power-strip\"><svg viewBox=\"0 0 {WIDTH} {}\" role=\"img\"><title>Power over one line, by block</title>{drawn}\
         <line x1=\"0\" x2=\"{WIDTH}\" y1=\"{mean_y:.2}\" y2=\"{mean_y:.2}\" stroke=\"currentColor\" stroke-dasharray=\"6 4\"/>\
         {legend}</svg>\
         <figcaption>Power of one sensor over the line, by block: peak {} mW, {} times the mean of a frame ({} mW, dashed).\
         </figcaption></figure>",
        HEIGHT + 30.0,
        digits(line.peak_mw),
        digits(line.peak_over_mean),
        digits(line.frame_mean_mw)
    )
}
