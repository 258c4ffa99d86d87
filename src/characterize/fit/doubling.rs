//! The step over which dark current doubles, from dark frames at several temperatures (EMVA 1288 release 4.0, section 7).

use super::parameters::{Fitted, SIGMAS};
use crate::characterize::fits;
use crate::num::{f64_from_u64, greater};

/// Dark frames of one exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DarkPoint {
    /// In seconds.
    pub exposure_s: f64,
    /// Mean code of all of them, without defective pixels.
    pub mean_dn: f64,
    /// How many.
    pub frames: u64,
}

/// Dark frames of several exposures at one temperature.
#[derive(Clone, Debug, PartialEq)]
pub struct DarkSeries {
    /// Of the die, in K.
    pub temperature_k: f64,
    /// Of each exposure.
    pub points: Vec<DarkPoint>,
}

/// Noise of a frame's mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameNoise {
    /// Overall gain in DN/e-.
    pub k: f64,
    /// Pixels of a frame.
    pub pixels: f64,
    /// Temporal variance of a pixel without exposure.
    pub dark_dn2: f64,
    /// What noise that lines share adds to the variance of a frame's mean.
    pub line_dn2: f64,
}

impl DarkSeries {
    /// Its dark current: the slope of the mean over exposure.
    pub fn rate(&self, noise: &FrameNoise) -> DarkRate {
        let points: Vec<(f64, f64)> = self.points.iter().map(|point| (point.exposure_s, point.mean_dn)).collect();
        let (slope, offset) = fits::line(&points);
        let k = noise.k;
        let error_dn = |point: &DarkPoint| {
            let shot_dn2 = k * greater(point.mean_dn - offset, 0.0);
            (((noise.dark_dn2 + shot_dn2) / noise.pixels + noise.line_dn2) / f64_from_u64(point.frames)).sqrt()
        };
        let most_dn = self.points.iter().map(error_dn).fold(0.0, greater);
        let (of_slope, _) = fits::line_errors(points.iter().map(|point| point.0));
        DarkRate { temperature_k: self.temperature_k, rate_e_per_s: [slope / k, of_slope * most_dn / k] }
    }
}

/// Dark current at one temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DarkRate {
    /// Of the die, in K.
    pub temperature_k: f64,
    /// Mean and standard error in e-/s, without the error of the overall gain, which all temperatures share.
    pub rate_e_per_s: [f64; 2],
}

/// Dark current at 300 K and the step over which it doubles: a straight line through the logarithms of the rates, each weighted by its
/// error. `k_relative` is the relative standard error of the overall gain. Fails where fewer than two temperatures show a dark current, and
/// where it does not rise.
pub fn doubling(rates: &[DarkRate], k_relative: f64) -> Result<[Fitted; 2], String> {
    let seen: Vec<(f64, f64, f64)> = rates
        .iter()
        .filter(|rate| rate.rate_e_per_s[0] > SIGMAS * rate.rate_e_per_s[1])
        .map(|DarkRate { temperature_k, rate_e_per_s: [rate, error] }| {
            let relative = error / rate;
            (
                temperature_k - 300.0,
                libm::log2(*rate),
                (std::f64::consts::LN_2 / relative) * (std::f64::consts::LN_2 / relative),
            )
        })
        .collect();
    let sum = |of: &dyn Fn(f64, f64) -> f64| seen.iter().map(|&(x, y, weight)| weight * of(x, y)).sum::<f64>();
    let (count, mean_x) = (sum(&|_, _| 1.0), sum(&|x, _| x) / sum(&|_, _| 1.0));
    let spread = sum(&|x, _| (x - mean_x) * (x - mean_x));
    if seen.len() < 2 || !(spread > 0.0) {
        return Err(format!("{} of {} temperatures show a dark current; two are needed", seen.len(), rates.len()));
    }
    let slope = sum(&|x, y| (x - mean_x) * y) / spread;
    let slope_error = 1.0 / spread.sqrt();
    if slope < SIGMAS * slope_error {
        return Err(format!("dark current does not rise with temperature: {:.4} doublings a kelvin", slope));
    }
    let at_300_k = sum(&|_, y| y) / count - slope * mean_x;
    let at_error = libm::hypot((1.0 / count + mean_x * mean_x / spread).sqrt(), k_relative / std::f64::consts::LN_2);
    let current = Fitted {
        key: "pixel.dark_current_e_per_s",
        value: libm::exp2(at_300_k),
        interval: [-SIGMAS, SIGMAS].map(|errors| libm::exp2(at_300_k + errors * at_error)),
        rests_on: "u_I_mean at several temperatures",
    };
    let step = Fitted {
        key: "pixel.dark_doubling_k",
        value: 1.0 / slope,
        interval: [SIGMAS, -SIGMAS].map(|errors| 1.0 / (slope + errors * slope_error)),
        rests_on: "u_I_mean over temperature",
    };
    Ok([current, step])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_that_doubles_in_seven_kelvin_is_found_and_one_that_falls_is_refused() {
        let rate = |temperature_k: f64, step_k: f64| {
            let rate = 40.0 * libm::exp2((temperature_k - 300.0) / step_k);
            DarkRate { temperature_k, rate_e_per_s: [rate, 0.02 * rate] }
        };
        let [current, step] = doubling(&[290.0, 310.0, 330.0].map(|k| rate(k, 7.0)), 0.0).unwrap();
        assert!((current.value - 40.0).abs() < 1e-9 && (step.value - 7.0).abs() < 1e-12, "{current:?} {step:?}");
        // Errors of 2 % at both ends of 40 K: the step is known to 0.029 / 28 doublings a kelvin.
        let half = 1.96 * 0.02 / std::f64::consts::LN_2 / 800.0_f64.sqrt() * 49.0;
        assert!((0.5 * (step.interval[1] - step.interval[0]) / half - 1.0).abs() < 0.01, "{step:?} {half}");
        assert!(doubling(&[290.0, 310.0].map(|k| rate(k, -7.0)), 0.0).unwrap_err().contains("does not rise"));
        assert!(doubling(&[rate(290.0, 7.0)], 0.0).unwrap_err().contains("two are needed"));
    }
}
