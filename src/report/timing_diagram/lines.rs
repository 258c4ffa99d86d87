//! Draws spans in us on a lane, and the axis below it, as SVG.

use super::super::escape::svg_text as text;
use crate::num::{f64_from_usize, greater, index, u32_truncated, u64_truncated};
use crate::report::record::Phase;

/// Height of a lane, and what stands between two.
const LANE_PX: f64 = 30.0;
const GAP_PX: f64 = 8.0;
/// Width of a letter of 12 px, a little on the wide side; and room for a line of words below a lane.
const LETTER_PX: f64 = 6.4;
const CALLOUT_PX: f64 = 20.0;

/// From time to position.
pub(super) struct TimeScale {
    pub left_px: f64,
    pub right_px: f64,
    pub start_us: f64,
    pub end_us: f64,
}

impl TimeScale {
    pub(super) fn x_px(&self, time_us: f64) -> f64 {
        self.left_px + (self.right_px - self.left_px) * (time_us - self.start_us) / (self.end_us - self.start_us)
    }

    /// Milliseconds where the axis has ticks of half of one or more, else microseconds.
    fn unit(&self) -> (f64, &'static str) {
        if step_us(self.end_us - self.start_us) >= 500.0 { (1000.0, "ms") } else { (1.0, "\u{b5}s") }
    }
}

/// What kind of work a span is, by colour.
fn class(name: &str) -> &'static str {
    match name {
        "ramp reset" | "ramp signal" | "rows" | "payload" => "c",
        "reset" | "transfer" | "latch" | "header" | "footer" => "b",
        "LP to HS" | "HS to LP" | "features" => "d",
        "blanking" => "free",
        _ => "a",
    }
}

/// Draws a lane, with what is left of it up to `full_us` as free; gives the height where the next thing may begin.
pub(super) fn lane(body: &mut String, scale: &TimeScale, spans: &[&Phase], full_us: f64, y_px: f64) -> f64 {
    let (left, width) = (scale.left_px, scale.right_px - scale.left_px);
    let bed = |body: &mut String, class: &str, x_px: f64, width_px: f64| {
        let rectangle = format!("x=\"{x_px:.1}\" y=\"{y_px:.1}\" width=\"{width_px:.1}\" height=\"{LANE_PX}\"");
        *body += &format!("<rect {rectangle} rx=\"3\" class=\"{class}\"/>\n");
    };
    bed(body, "bed", left, width);
    let busy_us = spans.iter().fold(0.0, |end_us, span| greater(end_us, span.end_us));
    let free_px = scale.x_px(full_us) - scale.x_px(busy_us);
    if free_px >= 1.0 {
        bed(body, "free", scale.x_px(busy_us), free_px);
        label(body, scale.x_px(busy_us), free_px, y_px, "l m", &format!("free {}", duration(scale, full_us - busy_us)));
    }
    let mut narrow = Vec::new();
    for span in spans {
        let (x_px, width_px) = (scale.x_px(span.start_us), scale.x_px(span.end_us) - scale.x_px(span.start_us));
        // Neighbours stay apart by a hair, and the shortest pulse is seen.
        bed(body, class(&span.name), x_px, greater(width_px - 0.8, 0.8));
        let time = format!("{} {}", span.name, duration(scale, span.end_us - span.start_us));
        let ink = if class(&span.name) == "free" { "l m" } else { "on" };
        if ![time.as_str(), &span.name].into_iter().any(|words| label(body, x_px, width_px, y_px, ink, words)) {
            narrow.push((x_px + 0.5 * width_px, time));
        }
    }
    let callouts_px = if narrow.is_empty() { 0.0 } else { CALLOUT_PX };
    callouts(body, scale, &narrow, y_px + LANE_PX);
    y_px + LANE_PX + callouts_px + GAP_PX
}

fn duration(scale: &TimeScale, length_us: f64) -> String {
    let (unit_us, unit) = scale.unit();
    format!("{:.3} {unit}", length_us / unit_us)
}

/// Words in the middle of a span, if they fit into it.
fn label(body: &mut String, x_px: f64, width_px: f64, y_px: f64, class: &str, words: &str) -> bool {
    let fits = LETTER_PX * f64_from_usize(words.chars().count()) + 6.0 <= width_px;
    if fits {
        text(body, x_px + 0.5 * width_px, y_px + 0.5 * LANE_PX + 4.2, class, words);
    }
    fits
}

/// Words below spans that are too narrow for them, from left to right, each beside the last, with a line to its span.
fn callouts(body: &mut String, scale: &TimeScale, narrow: &[(f64, String)], y_px: f64) {
    let width_px = |words: &str| LETTER_PX * f64_from_usize(words.chars().count()) + 12.0;
    let total_px: f64 = narrow.iter().fold(0.0, |sum, (_, words)| sum + width_px(words));
    let mut rest_px = total_px;
    let mut from_px = scale.left_px;
    for (x_px, words) in narrow {
        // Centred where there is room, but never over the last, and never so far right that the others find none.
        let latest_px = scale.right_px - rest_px;
        let wanted_px = x_px - 0.5 * width_px(words);
        let start_px = greater(if wanted_px > latest_px { latest_px } else { wanted_px }, from_px);
        let middle_px = start_px + 0.5 * width_px(words);
        let (low_px, text_px) = (y_px + 7.0, y_px + 17.0);
        *body += &format!("<path d=\"M{x_px:.1} {y_px:.1}L{middle_px:.1} {low_px:.1}\" class=\"k\"/>\n");
        text(body, middle_px, text_px, "l s m", words);
        from_px = start_px + width_px(words);
        rest_px -= width_px(words);
    }
}

/// Steps that read well: 1, 2 or 5 times a power of ten, four to ten of them.
fn step_us(length_us: f64) -> f64 {
    let rough = length_us / 8.0;
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= rough).unwrap_or(10.0);
    factor * power
}

pub(super) fn axis(body: &mut String, scale: &TimeScale, y_px: f64) -> f64 {
    let step = step_us(scale.end_us - scale.start_us);
    let (unit_us, unit) = scale.unit();
    let path = format!("M{:.1} {y_px:.1}H{:.1}", scale.left_px, scale.right_px);
    *body += &format!("<path d=\"{path}\" class=\"g\"/>\n");
    let digits = libm::ceil(-libm::log10(step / unit_us) - 1e-9);
    let decimals = index(u32_truncated(greater(digits, 0.0)));
    // A thousandth of a step more, so that rounding does not drop a tick at the end.
    let ticks = u64_truncated((scale.end_us - scale.start_us) / step + 1e-3);
    for tick in 0..=ticks {
        let time_us = step * crate::num::f64_from_u64(tick);
        let x_px = scale.x_px(time_us);
        *body += &format!("<path d=\"M{x_px:.1} {y_px:.1}V{:.1}\" class=\"g\"/>\n", y_px + 5.0);
        let number = format!("{:.decimals$}", time_us / unit_us);
        let words = if tick == 0 { format!("0 {unit}") } else { number };
        text(body, x_px, y_px + 19.0, "l s m", &words);
    }
    y_px + 24.0
}
