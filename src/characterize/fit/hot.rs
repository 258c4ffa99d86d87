//! Hot, dead and stuck pixels per million, and the dark current of hot ones.
//!
//! The dark current of hot pixels is exponentially distributed (`pixel::hot_pixels`), and an exponential has no memory: beyond the least
//! excess T that is seen, excesses less T have the same mean as all excesses have. So that mean is found from the pixels seen (those that
//! are full count as censored there), and exp(T / mean) times as many exist. The mean excess over exposure gives the rate: its slope is
//! free of what a global shutter's pixel gathers while it waits, and of offsets.

use super::defective::{DefectivePixels, chi_squared_over_freedom};
use super::parameters::{Fitted, SIGMAS, Undetermined};
use crate::characterize::fits;
use crate::num::{f64_from_usize, lesser, u64_from};
use crate::statistics::binomial_interval;

/// Fewest hot pixels whose mean excess says something of the others'.
const HOT_MIN: usize = 4;
/// The most that a sensor file takes.
const PPM_MAX: f64 = 1e5;
/// Greatest ratio of the least excess that is seen to the mean: beyond it twelve unseen ones would follow from each that is seen.
const LEAST_MAX: f64 = 2.5;

/// What turns an excess into a rate.
#[derive(Clone, Copy, Debug)]
pub struct HotScale {
    /// Overall gain and its standard error, in DN/e-.
    pub k: [f64; 2],
    /// Exposure of the stacks in s.
    pub stack_s: f64,
    /// Rate at 300 K over the rate of the frames.
    pub at_300_k: f64,
}

/// Appends what the defects tell.
pub fn append(
    defects: &DefectivePixels,
    scale: HotScale,
    fitted: &mut Vec<Fitted>,
    undetermined: &mut Vec<Undetermined>,
) {
    let seen = hot(defects, scale);
    match &seen {
        Ok(Some(hot)) => fitted.extend(hot.iter().cloned()),
        Ok(None) => fitted.push(of_count("pixel.hot_ppm", defects.hot.len(), defects.pixels, HOT)),
        Err(reason) => undetermined.push(Undetermined::new("pixel.hot_ppm", reason)),
    }
    if !matches!(seen, Ok(Some(_))) {
        let few =
            format!("{} hot pixels are too few, or too weak, for the spread of their dark current", defects.hot.len());
        undetermined.push(Undetermined::new("pixel.hot_dark_e_per_s", seen.err().unwrap_or(few)));
    }
    fitted.push(of_count(
        "pixel.dead_ppm",
        defects.dead.len(),
        defects.pixels,
        "pixels with a fifth of the response or less",
    ));
    fitted.push(of_count(
        "pixel.stuck_ppm",
        defects.stuck.len(),
        defects.pixels,
        "pixels at one end of the range in all frames",
    ));
}

const HOT: &str = "pixels beyond 6 sigma in the dark stack";

fn of_count(key: &'static str, count: usize, pixels: usize, rests_on: &'static str) -> Fitted {
    let ppm = |share: f64| 1e6 * share;
    let interval = binomial_interval(u64_from(count), u64_from(pixels), 0.95).map(ppm);
    Fitted { key, value: ppm(f64_from_usize(count) / f64_from_usize(pixels)), interval, rests_on }
}

/// Hot pixels that are not clipped, and the mean excess of all hot pixels; none where there are too few,
/// or where they are hardly beyond the least that is seen.
fn mean_excess(defects: &DefectivePixels) -> Option<(usize, f64)> {
    let whole = defects.hot.iter().filter(|hot| !hot.is_clipped).count();
    let beyond_dn = defects.hot.iter().map(|hot| hot.excess_dn - defects.hot_from_dn).sum::<f64>();
    let mean_dn = beyond_dn / f64_from_usize(whole.max(1));
    (whole >= HOT_MIN && defects.hot_from_dn < LEAST_MAX * mean_dn).then_some((whole, mean_dn))
}

/// What hot pixels that are too weak to be seen add to the variance of the dark pattern, in DN^2.
pub fn hidden_dn2(defects: &DefectivePixels) -> f64 {
    let Some((_, mean_dn)) = mean_excess(defects) else { return 0.0 };
    let least = defects.hot_from_dn / mean_dn;
    let all = f64_from_usize(defects.hot.len()) / f64_from_usize(defects.pixels) * libm::exp(least);
    // Second moment of an exponential below the least that is seen.
    all * mean_dn * mean_dn * (2.0 - libm::exp(-least) * (least * least + 2.0 * least + 2.0))
}

/// Count and dark current of hot pixels; none where there are too few, or why not.
fn hot(defects: &DefectivePixels, scale: HotScale) -> Result<Option<[Fitted; 2]>, String> {
    let (seen, least_dn) = (defects.hot.len(), defects.hot_from_dn);
    let Some((whole, mean_dn)) = mean_excess(defects) else { return Ok(None) };
    let [gathering_s, gathering_error_s] = gathering_s(defects, scale.stack_s)?;
    let rate = |mean_dn: f64| scale.at_300_k * mean_dn / (scale.k[0] * gathering_s);
    // Of n excesses, 2 n times their mean over the true one is chi-squared with 2 n degrees of freedom.
    let of_mean = chi_squared_over_freedom(2.0 * f64_from_usize(whole), [0.975, 0.025]).map(|ratio| mean_dn / ratio);
    let of_scale = SIGMAS * libm::hypot(scale.k[1] / scale.k[0], gathering_error_s / gathering_s);
    let widened =
        |value: f64, end: f64, sign: f64| value * libm::exp(sign * libm::hypot(libm::log(end / value), of_scale));
    let value = rate(mean_dn);
    let current = Fitted {
        key: "pixel.hot_dark_e_per_s",
        value,
        interval: [widened(value, rate(of_mean[0]), -1.0), widened(value, rate(of_mean[1]), 1.0)],
        rests_on: "excesses of hot pixels, and their slope over exposure",
    };
    let unseen = libm::exp(least_dn / mean_dn);
    let counted = of_count("pixel.hot_ppm", seen, defects.pixels, HOT);
    let of_unseen = SIGMAS * least_dn / mean_dn / f64_from_usize(whole).sqrt();
    let end = |end: f64, sign: f64| {
        counted.value * unseen * libm::exp(sign * libm::hypot(libm::log(end / counted.value), of_unseen))
    };
    let interval = [end(counted.interval[0], -1.0), end(counted.interval[1], 1.0)];
    let value = lesser(counted.value * unseen, PPM_MAX);
    Ok(Some([Fitted { value, interval: interval.map(|end| lesser(end, PPM_MAX)), ..counted }, current]))
}

/// Time in which hot pixels gather what they have at the exposure of the stacks, with its standard error.
fn gathering_s(defects: &DefectivePixels, stack_s: f64) -> Result<[f64; 2], String> {
    let whole: Vec<f64> = defects.hot.iter().filter(|hot| !hot.is_clipped).map(|hot| hot.excess_dn).collect();
    let mean_dn = whole.iter().sum::<f64>() / f64_from_usize(whole.len());
    // Longer exposures clip more of them.
    let rise: Vec<(f64, f64)> =
        defects.rise.iter().map(|&[ns, dn]| (1e-9 * ns, dn)).filter(|(s, _)| *s <= 1.001 * stack_s).collect();
    if rise.len() < 3 {
        return Ok([stack_s, 0.0]);
    }
    let (slope, offset) = fits::line(&rise);
    let squares: f64 = rise.iter().map(|(s, dn)| (dn - offset - slope * s) * (dn - offset - slope * s)).sum();
    let sigma_dn = (squares / (f64_from_usize(rise.len()) - 2.0)).sqrt();
    let (unit_error, _) = fits::line_errors(rise.iter().map(|point| point.0));
    let error = sigma_dn * unit_error;
    if slope < SIGMAS * error {
        return Err(format!(
            "{} pixels are bright in the dark by {mean_dn:.1} DN, and not more so with exposure: offsets, no dark current",
            defects.hot.len()
        ));
    }
    let time_s = mean_dn / slope;
    Ok([time_s, time_s * error / slope])
}
