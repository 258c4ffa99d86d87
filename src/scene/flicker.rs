//! Lamps that flicker with the mains or with their dimmer. Computes the exact mean of a waveform over any span of run time, relative to its
//! mean over all time.
//!
//! Phosphors and thermal inertia are not modelled: they lower the modulation, which is the user's number.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::num::{f32_nearest, greater, lesser};
use crate::units::Span;

/// Shape of one period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Waveform {
    /// A sine around the mean.
    Sine,
    /// The absolute value of a sine, as a tube or LED without smoothing draws from the mains: dark once a period. A mains of 50 Hz
    /// gives 100 Hz.
    RectifiedSine,
    /// On for this share of the period, above 0 to 1, then off.
    Pwm {
        /// Share of the period.
        duty: f64,
    },
}

/// How lamps flicker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flicker {
    /// Shape.
    pub waveform: Waveform,
    /// Periods of the light in a second.
    pub frequency_hz: f64,
    /// Share of the light that follows the waveform, 0 to 1; the rest is steady.
    pub modulation: f64,
    /// Phase at time 0 of the run.
    pub phase_deg: f64,
}

/// Spans shorter than this share of a period have the level of their start: the difference of two phases would be mostly
/// rounding, and the level changes by less than 1e-7 meanwhile (a PWM edge within the span apart).
const INSTANT_PERIODS: f64 = 1e-9;

/// Phases at which bounds over a length are looked for.
const BOUND_STEPS: u32 = 1024;

impl Flicker {
    /// Mean level over a span of run time; 1 is the mean over all time. Whole periods are counted as integers, so what
    /// is left of a late time is as exact as the time itself.
    pub fn level(&self, span: Span) -> f32 {
        let (whole, from) = self.phase(span.start_s);
        let (whole_end, to) = self.phase(span.end_s);
        let periods = (whole_end - whole) + (to - from);
        if periods < INSTANT_PERIODS {
            return f32_nearest(self.mixed(self.at(from)));
        }
        // Each whole period adds 1.
        let sum = (whole_end - whole) + (self.since_start(to) - self.since_start(from));
        f32_nearest(self.mixed(sum / periods))
    }

    /// Least and greatest level of any span.
    pub fn bounds(&self) -> [f32; 2] {
        let pure = match self.waveform {
            Waveform::Sine => [0.0, 2.0],
            Waveform::RectifiedSine => [0.0, FRAC_PI_2],
            Waveform::Pwm { duty } => [if duty < 1.0 { 0.0 } else { 1.0 }, 1.0 / duty],
        };
        pure.map(|level| f32_nearest(self.mixed(level)))
    }

    /// Least and greatest level of spans of one length. The mean over a span changes by at most (greatest - least) / length when it is
    /// moved, so steps of a part of a period find both ends but for half a step of that, which is added.
    pub fn bounds_over(&self, length_s: f64) -> [f64; 2] {
        let all = self.bounds().map(f64::from);
        let periods = length_s * self.frequency_hz;
        if periods < 1.0 / f64::from(BOUND_STEPS) {
            return all;
        }
        let (mut least, mut most) = (f64::INFINITY, 0.0);
        for step in 0..BOUND_STEPS {
            let start_s = f64::from(step) / (f64::from(BOUND_STEPS) * self.frequency_hz);
            let level = f64::from(self.level(Span { start_s, end_s: start_s + length_s }));
            (least, most) = (lesser(least, level), greater(most, level));
        }
        // Rounding of the level to f32, 2^-24 of it, besides.
        let slack = (all[1] - all[0]) / (2.0 * f64::from(BOUND_STEPS) * periods) + 1e-7 * all[1];
        [greater(least - slack, all[0]), lesser(most + slack, all[1])]
    }

    fn mixed(&self, level: f64) -> f64 {
        1.0 - self.modulation + self.modulation * level
    }

    /// Whole periods before a time, and the phase in the present one, 0 to 1. Whole seconds are taken apart, because their
    /// product with a frequency of few digits is exact.
    fn phase(&self, t_s: f64) -> (f64, f64) {
        let seconds = t_s.floor();
        let coarse = self.frequency_hz * seconds;
        let rest = (coarse - coarse.floor()) + self.frequency_hz * (t_s - seconds) + self.phase_deg / 360.0;
        (coarse.floor() + rest.floor(), rest - rest.floor())
    }

    /// Level at a phase.
    fn at(&self, phase: f64) -> f64 {
        match self.waveform {
            Waveform::Sine => 1.0 + libm::sin(2.0 * PI * phase),
            Waveform::RectifiedSine => FRAC_PI_2 * libm::sin(PI * phase),
            Waveform::Pwm { duty } if phase < duty => 1.0 / duty,
            Waveform::Pwm { .. } => 0.0,
        }
    }

    /// Integral of the level from the start of the period, 1 at its end.
    fn since_start(&self, phase: f64) -> f64 {
        match self.waveform {
            Waveform::Sine => {
                let half_turns = libm::sin(PI * phase);
                phase + half_turns * half_turns / PI
            }
            Waveform::RectifiedSine => 0.5 * (1.0 - libm::cos(PI * phase)),
            Waveform::Pwm { duty } => lesser(greater(phase, 0.0), duty) / duty,
        }
    }

    /// In words, for the report.
    pub fn describe(&self) -> String {
        let shape = match self.waveform {
            Waveform::Sine => "a sine".to_owned(),
            Waveform::RectifiedSine => "a rectified sine".to_owned(),
            Waveform::Pwm { duty } => format!("PWM of duty {duty}"),
        };
        format!("{shape} of {} Hz, modulation {}", self.frequency_hz, self.modulation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [Waveform; 4] =
        [Waveform::Sine, Waveform::RectifiedSine, Waveform::Pwm { duty: 0.3 }, Waveform::Pwm { duty: 1.0 }];

    fn flicker(waveform: Waveform) -> Flicker {
        Flicker { waveform, frequency_hz: 100.0, modulation: 0.8, phase_deg: 50.0 }
    }

    #[test]
    fn the_mean_over_any_span_is_that_of_fine_steps() {
        let mut tried = 0;
        for waveform in SHAPES {
            let flicker = flicker(waveform);
            for (start_s, length_s) in [(0.0, 33e-6), (0.0042, 2e-3), (0.013, 0.0999), (3.2, 1e-4), (-0.004, 7e-3)] {
                let steps = 20_000;
                let mut sum = 0.0;
                for step in 0..steps {
                    let t_s = start_s + length_s * (f64::from(step) + 0.5) / f64::from(steps);
                    sum += flicker.mixed(flicker.at(flicker.phase(t_s).1));
                }
                let level = flicker.level(Span { start_s, end_s: start_s + length_s });
                // Midpoints: a step at a PWM edge (up to 20 edges, of height 3.3) errs by half a step each; smooth parts by 1e-9.
                let error = (f64::from(level) - sum / f64::from(steps)).abs();
                assert!(error < 20.0 * 3.4 / 40_000.0, "{waveform:?} {start_s} {level}");
                let [least, greatest] = flicker.bounds();
                assert!(level <= greatest + 1e-6);
                assert!(flicker.level(Span { start_s, end_s: start_s }) >= least - 1e-6);
                tried += 1;
            }
        }
        assert_eq!(tried, 20);
    }

    #[test]
    fn whole_periods_are_exactly_one_also_after_a_million_seconds() {
        let mut tried = 0;
        for waveform in SHAPES {
            for frequency_hz in [100.0, 120.0, 2_000.0, 0.1] {
                let flicker = Flicker { frequency_hz, ..flicker(waveform) };
                for start_s in [0.0, 1.0, 1e6] {
                    let end_s = start_s + 10.0 * (1.0 / frequency_hz).max(1.0);
                    // The span is whole periods, and so a sum of ones; f32 keeps 1 exactly, its neighbours are 6e-8 away.
                    let level = flicker.level(Span { start_s, end_s });
                    assert!((level - 1.0).abs() < 1.2e-7, "{waveform:?} {frequency_hz} {start_s}: {level}");
                    tried += 1;
                }
            }
            // A span of 2 ms at 1e6 s against the same span at 0: times there are known to 1.2e-10 s, which moves an edge
            // of height 3.3 by 6e-8 of the span, twice.
            let flicker = flicker(waveform);
            let level = |start_s: f64| flicker.level(Span { start_s, end_s: start_s + 0.002 });
            assert!((level(0.004) - level(1e6 + 0.004)).abs() < 1e-6, "{waveform:?}");
            tried += 1;
        }
        assert_eq!(tried, 4 * 13);
    }
}
