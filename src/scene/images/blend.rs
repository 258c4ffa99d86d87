//! Interpolation in time between pictures of a sequence. Computes how many seconds each picture counts for a span.
//!
//! Merging pictures by these seconds is the paper's way to blur ("rendering and merging sub-frames"), with each row's own span.

use crate::units::Span;

/// What counts between two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// The nearer one: right for pictures far apart, where a mixture would show everything twice.
    Nearest,
    /// Both, by their distance in time: right for pictures so dense that little moves from one to the next.
    Linear,
}

impl Blend {
    /// All that are known, by the one name in configs.
    pub const ALL: [(&'static str, Self); 2] = [("nearest", Self::Nearest), ("linear", Self::Linear)];

    /// Times that the pictures cover: from the first to the last, and where the nearer one counts half an interval more on either
    /// side. A single picture covers all times.
    pub fn covered(self, times_s: &[f64]) -> Span {
        let last = times_s.len() - 1;
        if last == 0 {
            return Span { start_s: f64::NEG_INFINITY, end_s: f64::INFINITY };
        }
        let beyond = match self {
            Self::Nearest => 0.5,
            Self::Linear => 0.0,
        };
        Span {
            start_s: times_s[0] - beyond * (times_s[1] - times_s[0]),
            end_s: times_s[last] + beyond * (times_s[last] - times_s[last - 1]),
        }
    }

    /// Numbers of the pictures that count for a span, rising by one, and the seconds of each; they sum to the span's length. Linear
    /// blending is integrated exactly: a trapezoid for each interval that the span touches. Beyond the ends the end's picture counts.
    pub fn weights(self, times_s: &[f64], span: Span) -> Vec<(usize, f64)> {
        let last = times_s.len() - 1;
        let mut weights: Vec<(usize, f64)> = Vec::new();
        let mut add = |number: usize, seconds: f64| match weights.last_mut() {
            Some((known, sum)) if *known == number => *sum += seconds,
            _ if seconds > 0.0 => weights.push((number, seconds)),
            _ => {}
        };
        let before_s = times_s[0].min(span.end_s) - span.start_s;
        if before_s > 0.0 {
            add(0, before_s);
        }
        let first = times_s.partition_point(|&t_s| t_s <= span.start_s).saturating_sub(1);
        for number in first..last {
            let [from_s, to_s] = [times_s[number], times_s[number + 1]];
            if from_s >= span.end_s {
                break;
            }
            let (start_s, end_s) = (from_s.max(span.start_s), to_s.min(span.end_s));
            if end_s <= start_s {
                continue;
            }
            let (earlier_s, later_s) = match self {
                Self::Nearest => {
                    let middle_s = from_s + 0.5 * (to_s - from_s);
                    let seam_s = middle_s.clamp(start_s, end_s);
                    (seam_s - start_s, end_s - seam_s)
                }
                Self::Linear => {
                    let share = (0.5 * (start_s - from_s) + 0.5 * (end_s - from_s)) / (to_s - from_s);
                    ((end_s - start_s) * (1.0 - share), (end_s - start_s) * share)
                }
            };
            add(number, earlier_s);
            add(number + 1, later_s);
        }
        let after_s = span.end_s - times_s[last].max(span.start_s);
        if after_s > 0.0 {
            add(last, after_s);
        }
        weights
    }
}

/// The number of the time nearest to `t_s`, the earlier one of two as near.
pub fn nearest(times_s: &[f64], t_s: f64) -> usize {
    let after = times_s.partition_point(|&time_s| time_s < t_s).min(times_s.len() - 1);
    if after > 0 && t_s - times_s[after - 1] <= times_s[after] - t_s { after - 1 } else { after }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES_S: [f64; 4] = [0.0, 0.1, 0.3, 0.4];

    fn value(blend: Blend, start_s: f64, end_s: f64) -> f64 {
        let brightness = [1.0, 3.0, 3.0, 10.0];
        let weights = blend.weights(&TIMES_S, Span { start_s, end_s });
        let length_s: f64 = weights.iter().map(|(_, seconds)| seconds).sum();
        assert!((length_s - (end_s - start_s)).abs() < 1e-15, "{start_s} to {end_s}: {weights:?}");
        assert!(weights.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1), "{weights:?}");
        weights.iter().map(|&(number, seconds)| seconds * brightness[number]).sum()
    }

    #[test]
    fn brightness_is_integrated_exactly_over_any_span() {
        // Antiderivatives by hand: linear from 1 to 3 over 0.1 s, flat over 0.2 s, linear from 3 to 10 over 0.1 s; and steps at the
        // middles.
        let linear = |t_s: f64| match t_s {
            t if t <= 0.1 => t + 10.0 * t * t,
            t if t <= 0.3 => 0.2 + 3.0 * (t - 0.1),
            t => 0.8 + 3.0 * (t - 0.3) + 35.0 * (t - 0.3) * (t - 0.3),
        };
        let nearest = |t_s: f64| match t_s {
            t if t <= 0.05 => t,
            t if t <= 0.35 => 0.05 + 3.0 * (t - 0.05),
            t => 0.95 + 10.0 * (t - 0.35),
        };
        let mut tried = 0;
        for start in 0..40_u32 {
            for end in start + 1..=40 {
                let (start_s, end_s) = (0.01 * f64::from(start), 0.01 * f64::from(end));
                // Some ten roundings of numbers up to 2.
                assert!((value(Blend::Linear, start_s, end_s) - (linear(end_s) - linear(start_s))).abs() < 1e-14);
                assert!((value(Blend::Nearest, start_s, end_s) - (nearest(end_s) - nearest(start_s))).abs() < 1e-14);
                tried += 1;
            }
        }
        assert_eq!(tried, 820);
    }

    #[test]
    fn ends_and_single_pictures_hold() {
        assert!((value(Blend::Nearest, -0.05, 0.45) - (0.05 + 1.45 + 0.5)).abs() < 1e-15);
        assert_eq!(Blend::Linear.covered(&TIMES_S), Span { start_s: 0.0, end_s: 0.4 });
        let covered = Blend::Nearest.covered(&TIMES_S);
        assert!((covered.start_s + 0.05).abs() < 1e-15 && (covered.end_s - 0.45).abs() < 1e-15);
        let alone = Blend::Linear.weights(&[0.2], Span { start_s: 0.0, end_s: 1.0 });
        assert_eq!(alone, [(0, 1.0)]);
        for (t_s, number) in [(-1.0, 0), (0.05, 0), (0.051, 1), (0.19, 1), (0.21, 2), (9.0, 3)] {
            assert_eq!(nearest(&TIMES_S, t_s), number, "{t_s}");
        }
    }
}
