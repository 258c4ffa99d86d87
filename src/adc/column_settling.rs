//! A column that has not settled when its signal is sampled. Subtracts the missing part from the microvolts.
//!
//! Model: a source follower of bias I drives the column's capacitance C from the reset level to the signal. While more than half the
//! overdrive V_ov is missing, the bias alone moves the line: it slews at I / C. Below that it settles exponentially with
//! tau = C / gm = C V_ov / (2 I), gm = 2 I / V_ov of a square-law transistor (Razavi, Design of Analog CMOS Integrated
//! Circuits). The two rates meet where V_ov / 2 is missing. What is missing after `settle_signal_us` is a pure function of the pixel's own
//! signal.

use super::params::AdcParams;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, lesser};
use crate::pixel::PixelParams;

/// A smaller share taken off an f32 rounds back to it (2^-26: half of half the least spacing).
const UNSEEN_SHARE: f64 = 1.490_116_119_384_765_6e-8;

/// Incomplete settling of the column lines.
pub struct ColumnSettling {
    /// What slewing alone can move in the time, in uV.
    slewed_uv: f64,
    /// Half the overdrive, where settling takes over, in uV.
    half_overdrive_uv: f64,
    /// Time over time constant.
    time_constants: f64,
    /// What is missing of a small signal, as a share of it.
    missing_share: f64,
    /// Response differs from pixel to pixel: the brightest pixel has more than the brightest mean.
    prnu: f64,
}

impl ColumnSettling {
    /// `None` where the bias is not given: the column settles in any time.
    pub fn from_params(params: &AdcParams, pixel: &PixelParams) -> Option<Box<dyn Effect>> {
        (params.column_bias_ua > 0.0).then(|| Box::new(Self::new(params, pixel.prnu)) as Box<dyn Effect>)
    }

    fn new(params: &AdcParams, prnu: f64) -> Self {
        // A microampere on a picofarad moves it by 1 V a microsecond.
        let slewed_uv = 1e6 * params.column_bias_ua * params.settle_signal_us / params.column_capacitance_pf;
        let half_overdrive_uv = 0.5e6 * params.column_overdrive_v;
        let time_constants = slewed_uv / half_overdrive_uv;
        Self { slewed_uv, half_overdrive_uv, time_constants, missing_share: libm::exp(-time_constants), prnu }
    }

    /// What is missing of a step of that height, in uV. Where slewing ends within the time, exp(-(t - t_slew) / tau) with
    /// t_slew = (step - V_ov / 2) C / I; both forms meet at both seams.
    fn missing_uv(&self, step_uv: f64) -> f64 {
        if step_uv <= self.half_overdrive_uv {
            return step_uv * self.missing_share;
        }
        let settles_from = step_uv / self.half_overdrive_uv - 1.0;
        if settles_from >= self.time_constants {
            return step_uv - self.slewed_uv;
        }
        self.half_overdrive_uv * libm::exp(settles_from - self.time_constants)
    }

    /// Greatest second derivative of what is missing up to a step: 0 where it settles from the start, missing / (V_ov / 2)^2 behind
    /// slewing, and no more where slewing does not end.
    fn bend_per_uv(&self, step_uv: f64) -> f64 {
        if step_uv <= self.half_overdrive_uv {
            return 0.0;
        }
        lesser(self.missing_uv(step_uv) / self.half_overdrive_uv, 1.0) / self.half_overdrive_uv
    }
}

impl Effect for ColumnSettling {
    fn identity(&self) -> Identity {
        Identity { name: "column_settling", number: EffectNumber(210), domain: Domain::Microvolts }
    }

    /// What is missing grows with the step, ever faster, and never by more than a microvolt a microvolt: so no pixel within six sigma of
    /// the brightest mean misses more than that pixel, and the spread of what is missing is the signal's times the slope there.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let gain = facts.conversion_gain_uv_per_e;
        let spread_e = self.prnu * facts.signal_e_max;
        let variance_e2 = facts.signal_e_max + facts.dark_rms_e * facts.dark_rms_e + spread_e * spread_e;
        let step_uv = gain * (facts.signal_e_max + facts.dark_rms_e + 6.0 * variance_e2.sqrt());
        let missing_uv = self.missing_uv(step_uv);
        if missing_uv < step_uv * UNSEEN_SHARE {
            return Some(Omission::NONE);
        }
        // By Taylor's theorem the mean of a curve is that at the mean and half its greatest second derivative times the variance.
        let mean_gain = gain * facts.gain_slope_max;
        let at_mean_e = self.missing_uv(mean_gain * (facts.signal_e_max + facts.dark_mean_e)) / mean_gain;
        let bent_e = 0.5 * self.bend_per_uv(step_uv) * gain * variance_e2;
        let slope = if step_uv <= self.half_overdrive_uv {
            self.missing_share
        } else {
            lesser(missing_uv / self.half_overdrive_uv, 1.0)
        };
        Some(Omission {
            bias_e: lesser(at_mean_e + bent_e, missing_uv / gain),
            variance_e2: slope * slope * variance_e2,
        })
    }

    fn reason(&self, facts: &Facts) -> String {
        let missing_uv = self.missing_uv(facts.signal_e_max * facts.conversion_gain_uv_per_e);
        format!(
            "after {:.1} time constants {:.3} e- of {:.0} e- are missing",
            self.time_constants,
            missing_uv / facts.conversion_gain_uv_per_e,
            facts.signal_e_max
        )
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let settled_share = 1.0 - self.missing_share;
        for value_uv in row.values.iter_mut() {
            let step_uv = f64::from(*value_uv);
            let settled_uv = if step_uv.abs() <= self.half_overdrive_uv {
                step_uv * settled_share
            } else {
                step_uv - self.missing_uv(step_uv.abs()).copysign(step_uv)
            };
            *value_uv = f32_nearest(settled_uv);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::params::tests::paper_adc;

    fn settling(bias_ua: f64, settle_us: f64) -> ColumnSettling {
        let params = AdcParams {
            column_bias_ua: bias_ua,
            settle_signal_us: settle_us,
            column_capacitance_pf: 2.0,
            column_overdrive_v: 0.2,
            ..paper_adc()
        };
        ColumnSettling::new(&params, 0.0)
    }

    /// The differential equation, stepped: v' = min(I / C, missing / tau).
    fn stepped_uv(bias_ua: f64, settle_us: f64, step_uv: f64) -> f64 {
        let (slew_uv_per_us, tau_us) = (1e6 * bias_ua / 2.0, 2.0 * 0.2 / (2.0 * bias_ua));
        let steps = 200_000;
        let step_us = settle_us / f64::from(steps);
        let mut missing_uv = step_uv;
        for _ in 0..steps {
            // The midpoint rule.
            let rate = |missing_uv: f64| lesser(slew_uv_per_us, missing_uv / tau_us);
            let middle_uv = missing_uv - 0.5 * step_us * rate(missing_uv);
            missing_uv -= step_us * rate(middle_uv);
        }
        missing_uv
    }

    /// The midpoint rule errs by (h / tau)^2 / 24 of a time constant's change, below 1e-9 of the step here; once at the seam the rate's
    /// derivative jumps, where it errs by at most a step of slewing, (t / 2e5) I / C.
    #[test]
    fn what_is_missing_is_the_solution_of_the_follower_on_its_line() {
        let mut regimes = [0; 3];
        for (bias_ua, settle_us) in [(0.5, 0.3), (0.5, 2.0), (2.0, 0.5), (5.0, 0.2)] {
            let settling = settling(bias_ua, settle_us);
            for step_uv in [0.0, 1.0, 50_000.0, 99_999.0, 100_001.0, 180_000.0, 400_000.0, 900_000.0] {
                let (found, exact) = (settling.missing_uv(step_uv), stepped_uv(bias_ua, settle_us, step_uv));
                let allowed = 1e-9 * step_uv + 1e6 * bias_ua / 2.0 * settle_us / 200_000.0;
                assert!((found - exact).abs() <= allowed, "{step_uv} uV: {found} for {exact}");
                let slews_on = step_uv / 1e5 - 1.0 >= settling.time_constants;
                regimes[if step_uv <= 1e5 { 0 } else { 1 + usize::from(slews_on) }] += 1;
            }
        }
        assert!(regimes.iter().all(|&tried| tried >= 3), "{regimes:?}");
    }

    #[test]
    fn a_negative_step_settles_as_its_mirror_image() {
        let effect = settling(0.5, 0.3);
        let settled = |uv: f32| {
            let step_uv = f64::from(uv);
            step_uv - effect.missing_uv(step_uv.abs()).copysign(step_uv)
        };
        assert_eq!(settled(5e5), -settled(-5e5));
    }
}
