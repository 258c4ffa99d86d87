//! Power over a line as a strip: blocks stacked, the mean of a frame as a line across.

use maud::{Markup, html};

use crate::num::f64_from_usize;
use crate::report::energy_record::{LinePower, PowerSpan};
use crate::report::html::text::{digits, si};

/// Width and height of the drawing, in units of the picture.
const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 120.0;
/// Colours of the blocks, told apart in light and dark and without red against green.
const COLOURS: [&str; 6] = ["#4477aa", "#ee6677", "#ccbb44", "#228833", "#66ccee", "#aa3377"];

pub(super) fn strip(line: &LinePower) -> Markup {
    if line.line_us <= 0.0 || line.peak_mw <= 0.0 {
        return Markup::default();
    }
    let mean_y = y(line, line.frame_mean_mw);
    html! {
        figure.power-strip {
            svg viewBox={ "0 0 " (WIDTH) " " (HEIGHT + 30.0) } role="img" {
                title { "Power over one line, by block" }
                @for span in &line.spans { (stack(line, span)) }
                line x1="0" x2=(WIDTH) y1=(two(mean_y)) y2=(two(mean_y)) stroke="currentColor" stroke-dasharray="6 4" {}
                @if let Some(span) = line.spans.first() { (legend(span)) }
            }
            figcaption {
                "Power of one sensor over the line, by block: peak " (digits(line.peak_mw)) " mW, " (digits(line.peak_over_mean))
                " times the mean of a frame (" (digits(line.frame_mean_mw)) " mW, dashed)."
            }
        }
    }
}

/// Height of a power in the drawing.
fn y(line: &LinePower, mw: f64) -> f64 {
    HEIGHT * (1.0 - mw / line.peak_mw)
}

/// The blocks of a span on each other.
fn stack(line: &LinePower, span: &PowerSpan) -> Markup {
    let x = |time_us: f64| WIDTH * time_us / line.line_us;
    let (left, width) = (x(span.start_us), x(span.end_us) - x(span.start_us));
    let duration = si(1e-6 * (span.end_us - span.start_us), "s");
    let mut top_mw = 0.0;
    let tops = span.blocks_mw.iter().map(|(name, &mw)| {
        top_mw += mw;
        (name, mw, top_mw)
    });
    html! {
        @for ((name, mw, top_mw), colour) in tops.zip(COLOURS) {
            @let (top, height) = (y(line, top_mw), HEIGHT * mw / line.peak_mw);
            rect x=(two(left)) y=(two(top)) width=(two(width)) height=(two(height)) fill=(colour) {
                title { (name) ", " (digits(mw)) " mW for " (duration) }
            }
        }
    }
}

/// Two decimals.
fn two(value: f64) -> String {
    format!("{value:.2}")
}

fn legend(span: &PowerSpan) -> Markup {
    html! {
        @for (at, ((name, _), colour)) in span.blocks_mw.iter().zip(COLOURS).enumerate() {
            @let left = 130.0 * f64_from_usize(at);
            rect x=(left) y=(HEIGHT + 10.0) width="12" height="12" fill=(colour) {}
            text x=(left + 17.0) y=(HEIGHT + 21.0) font-size="14" fill="currentColor" { (name) }
        }
    }
}
