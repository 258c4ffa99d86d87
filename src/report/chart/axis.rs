//! Chooses round tick positions and their labels for the span of an axis.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use crate::num::i32_truncated;

/// Lower and upper end.
pub(super) type AxisSpan = (f64, f64);

/// An axis with ticks of its own: plotters has no logarithmic axis that names powers of ten.
pub(super) struct Axis {
    /// From its lower to its upper end, in logarithms where it is logarithmic.
    pub span: AxisSpan,
    /// Ticks are powers of ten.
    pub is_log: bool,
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

/// Positions of ticks: some five round numbers, or on a logarithmic axis powers of ten, with 2 and 5 between them where few fit.
fn ticks(span: AxisSpan, is_log: bool) -> Vec<f64> {
    if is_log {
        let factors: &[f64] = if span.1 - span.0 > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = i32_truncated(libm::floor(span.0))..=i32_truncated(libm::ceil(span.1));
        let positions =
            decades.flat_map(|power| factors.iter().map(move |factor| f64::from(power) + libm::log10(*factor)));
        return positions.filter(|position| (span.0..=span.1).contains(position)).collect();
    }
    let rough = (span.1 - span.0) / 5.0;
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= rough);
    let step = step.expect("ten times a power of ten exceeds what lies above that power");
    let first = libm::ceil(span.0 / step);
    (0..=10).map(|index| (first + f64::from(index)) * step).filter(|position| *position <= span.1).collect()
}

/// A tick's number, with as many decimals as its axis' steps need.
fn label(position: f64, is_log: bool, span: AxisSpan) -> String {
    if !is_log {
        let step = (span.1 - span.0) / 5.0;
        let decimals = usize::try_from(i32_truncated(libm::ceil(-libm::log10(step))).clamp(0, 9)).unwrap_or(0);
        let position = if position.abs() < 1e-3 * step { 0.0 } else { position };
        return format!("{position:.decimals$}");
    }
    let number = libm::pow(10.0, position);
    match number {
        small if small < 0.0095 => format!("{small:.0e}"),
        low if low < 9.5 => format!("{}", (low * 100.0).round_ties_even() / 100.0),
        large if large < 99_999.0 => format!("{large:.0}"),
        huge => format!("{huge:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks((-0.3, 9.7), false), [0.0, 2.0, 4.0, 6.0, 8.0]);
        let labels =
            |span| -> Vec<String> { ticks(span, true).iter().map(|&position| label(position, true, span)).collect() };
        assert_eq!(labels((0.9, 2.1)), ["10", "20", "50", "100"]);
        assert_eq!(labels((-3.2, 1.0)), ["1e-3", "0.01", "0.1", "1", "10"]);
    }
}
