//! A sensor's parameters from its frames: the inverse of a measurement. Each parameter has a 95 % interval and the figure that it rests on.
//!
//! Frames determine products, not factors. The overall gain K holds the conversion gain and the size of an LSB, so the conversion gain is
//! assumed and the ramp's span follows. The quantum efficiency holds the fill factor, which is taken as 1. A fitted sensor converts once
//! a code, after analog double sampling, so read noise holds all of the pixels' noise in the dark.
//!
//! Intervals are 1.96 standard errors of `uncertainty` either way. For sigmas they are those of the variances, rooted; below a variance of
//! zero they begin at 0.

mod bow;
pub mod defective;
pub mod doubling;
mod hot;
mod parameters;
pub mod roll_off;
pub mod sound;
mod telegraph;

use super::analysis::{Figures, Summary, figures};
use super::fits;
use super::measure::ChannelMeasurement;
use super::set::SeriesExposure;
use super::spatial::{SharedVariance, SpatialVariances};
use super::truth::DARK_CLIPPED_MAX;
use super::uncertainty::{bright_part_error, dark_part_error, measured_errors};
use crate::num::{f64_from_u64, greater, lesser};
use bow::Bow;
use defective::DefectivePixels;
use doubling::{DarkRate, DarkSeries, FrameNoise, doubling};
use hot::HotScale;
use parameters::SIGMAS;
pub use parameters::{Fitted, Undetermined};
use telegraph::telegraph;

/// Share of the greatest code from which on a stack is saturated.
const STACK_SHARE_MAX: f64 = 0.95;

/// What frames do not determine and a fit takes from elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assumed {
    /// At the column, in uV.
    pub conversion_gain_uv_per_e: f64,
    /// Of the die while the frames were taken.
    pub temperature_k: f64,
    /// Step over which dark current doubles.
    pub dark_doubling_k: f64,
}

/// What a fit is made from.
#[derive(Clone, Copy, Debug)]
pub struct SensorFrames<'a> {
    /// Sums of the frames, without defective pixels.
    pub measurement: &'a ChannelMeasurement,
    /// The pixels that were left out.
    pub defects: &'a DefectivePixels,
    /// Depth of the codes.
    pub bits: u32,
    /// Exposure of the stacks.
    pub half: SeriesExposure,
    /// Dark frames at other temperatures.
    pub temperatures: &'a [DarkSeries],
}

/// What a stack of frames says of its sensor.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SensorFit {
    /// In the order of a sensor file.
    pub fitted: Vec<Fitted>,
    /// What the preset decides.
    pub undetermined: Vec<Undetermined>,
    /// What a user should know of the frames.
    pub warnings: Vec<String>,
}

impl SensorFit {
    /// A parameter by key.
    pub fn get(&self, key: &str) -> Option<&Fitted> {
        self.fitted.iter().find(|fitted| fitted.key == key)
    }

    /// Exposures and photons under which a sensor of this fit and efficiency sees what the frames saw: those that the frames state,
    /// else light of one strength that gives their signal. The last one is that of the stacks.
    pub fn light(
        &self,
        measurement: &ChannelMeasurement,
        half: SeriesExposure,
        efficiency: f64,
    ) -> Vec<SeriesExposure> {
        let points = &measurement.transfer.points;
        let stated = points.iter().map(|point| SeriesExposure {
            exposure_ns: crate::num::u64_half_even(point.exposure_ns),
            photons: point.photons,
        });
        let all: Vec<SeriesExposure> = stated.chain([half]).collect();
        if self.get("pixel.quantum_efficiency").is_some() {
            return all;
        }
        let found = figures(&Summary::of(measurement));
        let k = found.get("K").copied().unwrap_or(f64::NAN);
        let rise_dn_per_ns = fits::through_origin(
            measurement.transfer.sensitivity().iter().map(|point| (point.exposure_ns, point.signal_dn())),
        );
        let photons_per_ns = greater(0.0, rise_dn_per_ns / (k * efficiency));
        all.into_iter()
            .map(|one| SeriesExposure { photons: photons_per_ns * f64_from_u64(one.exposure_ns), ..one })
            .collect()
    }
}

/// Parameters of the sensor behind frames. Says why where the frames do not determine any.
/// Fails on a saturated stack, frames without a response to light, codes that are all alike.
pub fn fit(frames: &SensorFrames<'_>, assumed: &Assumed) -> Result<SensorFit, String> {
    let SensorFrames { measurement, bits, .. } = *frames;
    let read = Summary::of(measurement);
    let code_max = f64_from_u64((1 << bits) - 1);
    check(&read, code_max)?;
    check_defects(frames.defects)?;
    let shared = shared(measurement, &read);
    let bow = Bow::find(&read.transfer, bits, line_dn2(shared, &read));
    let summary = bow.filter(Bow::is_seen).map_or_else(|| read.clone(), |bow| bow.straightened(&read));
    let found = figures(&summary);
    if !found.get("K").is_some_and(|&k| k.is_finite() && k > 0.0) {
        let reason = "no pair lies between the dark and 70 % of the brightest one, so the gain is not determined";
        return Err(format!("{reason}; add pairs of shorter exposures"));
    }
    let errors = measured_errors(&summary, &found);
    let sources =
        Sources { frames, read: &read, summary: &summary, found: &found, errors: &errors, assumed, code_max, shared };
    let mut fit = SensorFit { fitted: Vec::new(), undetermined: Vec::new(), warnings: Vec::new() };
    sources.gain(&mut fit);
    sources.bow(bow, &mut fit);
    sources.light(&mut fit);
    sources.dark(&mut fit);
    sources.noise(&mut fit);
    sources.patterns(&mut fit);
    sources.defects(&mut fit);
    Ok(fit)
}

/// Temporal variance in the dark that rows and columns share.
fn shared(measurement: &ChannelMeasurement, summary: &Summary) -> SharedVariance {
    let dark = &summary.dark;
    let (row, column) = measurement.dark.shared_noise();
    let variance = |share: f64, length: f64| greater(0.0, share * dark.stack_variance_dn2 / (1.0 - 1.0 / length));
    SharedVariance { row_dn2: variance(row, dark.columns), column_dn2: variance(column, dark.rows) }
}

/// Variance that it adds to a frame's mean.
fn line_dn2(shared: SharedVariance, summary: &Summary) -> f64 {
    shared.row_dn2 / summary.dark.rows + shared.column_dn2 / summary.dark.columns
}

fn check(summary: &Summary, code_max: f64) -> Result<(), String> {
    let signal_dn = summary.bright.mean_dn - summary.dark.mean_dn;
    if summary.bright.mean_dn > STACK_SHARE_MAX * code_max {
        return Err(format!(
            "the bright stack is saturated (mean {:.1} of {code_max} DN); take it at about half of saturation",
            summary.bright.mean_dn
        ));
    }
    let noise_dn = (summary.bright.stack_variance_dn2 + summary.dark.stack_variance_dn2).sqrt();
    if !(signal_dn > noise_dn) {
        return Err(format!("the bright stack is only {signal_dn:.2} DN above the dark one; use more light"));
    }
    if !(summary.bright.stack_variance_dn2 > summary.dark.stack_variance_dn2) {
        return Err("the bright stack has no more noise than the dark one, so no photons can be counted".to_owned());
    }
    Ok(())
}

/// Refuses frames in which more pixels are defective than a sensor file can say.
fn check_defects(defects: &DefectivePixels) -> Result<(), String> {
    let kinds = [(defects.hot.len(), "hot"), (defects.dead.len(), "dead"), (defects.stuck.len(), "stuck")];
    for (count, kind) in kinds {
        if 10 * count > defects.pixels {
            let reason = format!("{count} of {} pixels look {kind}", defects.pixels);
            return Err(format!("{reason}; use even light and stacks of one exposure, below saturation"));
        }
    }
    Ok(())
}

/// What parameters are made from.
struct Sources<'a> {
    frames: &'a SensorFrames<'a>,
    /// As the codes are.
    read: &'a Summary,
    /// As a straight ramp would have shown them, from which all but the black level is found.
    summary: &'a Summary,
    found: &'a Figures,
    errors: &'a Figures,
    assumed: &'a Assumed,
    code_max: f64,
    shared: SharedVariance,
}

impl Sources<'_> {
    fn of(&self, name: &str) -> [f64; 2] {
        [self.found, self.errors].map(|figures| figures.get(name).copied().unwrap_or(f64::NAN))
    }

    fn k(&self) -> f64 {
        self.of("K")[0]
    }

    fn lsb_uv(&self) -> f64 {
        self.assumed.conversion_gain_uv_per_e / self.k()
    }

    fn gain(&self, fit: &mut SensorFit) {
        let bits = self.frames.bits;
        let [k, error] = self.of("K");
        let span_uv = |k: f64| self.assumed.conversion_gain_uv_per_e * f64_from_u64(1 << bits) / k;
        let interval = [span_uv(k + SIGMAS * error), span_uv(k - SIGMAS * error)];
        fit.fitted.push(Fitted { key: "adc.full_scale_uv", value: span_uv(k), interval, rests_on: "K" });
        let reason = format!(
            "frames determine K = {k:.5} DN/e- alone; {} uV/e- is assumed, and adc.full_scale_uv follows",
            self.assumed.conversion_gain_uv_per_e
        );
        fit.undetermined.push(Undetermined { key: "pixel.conversion_gain_uv_per_e", reason });
    }

    fn light(&self, fit: &mut SensorFit) {
        let [percent, error] = self.of("QE");
        let [low, value, high] = [percent - SIGMAS * error, percent, percent + SIGMAS * error].map(|one| 0.01 * one);
        let key = "pixel.quantum_efficiency";
        if low > 1.0 {
            let reason =
                format!("{value:.3} electrons a photon are more than one; correct the photons of the descriptor");
            fit.warnings.push(format!("{key}: {reason}"));
            fit.undetermined.push(Undetermined { key, reason });
        } else if value > 0.0 {
            let interval = [low, lesser(high, 1.0)];
            fit.fitted.push(Fitted { key, value: lesser(value, 1.0), interval, rests_on: "QE" });
            let reason = "is part of the quantum efficiency that is measured, and taken as 1".to_owned();
            fit.undetermined.push(Undetermined { key: "pixel.fill_factor", reason });
        } else {
            let reason = "the descriptor states no photons".to_owned();
            fit.undetermined.push(Undetermined { key, reason });
        }
        self.well(fit);
    }

    /// The full well, where the series reaches it before the converter's greatest code.
    fn well(&self, fit: &mut SensorFit) {
        let transfer = &self.summary.transfer;
        let key = "pixel.full_well_e";
        let Some(last) = transfer.points.last() else { return };
        let undetermined = |reason: String| Undetermined { key, reason };
        let range_e = (self.code_max - self.black(self.read)[0]) / self.k();
        // Where pixels clip, their noise goes. Half of the greatest variance is far from what noise does to it.
        if last.variance_dn2 > 0.5 * transfer.points[transfer.saturation()].variance_dn2 {
            fit.undetermined.push(undetermined("the series ends before saturation".to_owned()));
        } else if last.mean_dn > self.code_max - 1.0 {
            fit.undetermined.push(undetermined(format!("the converter saturates first, at {range_e:.0} e-")));
        } else {
            let [black_dn, _] = self.black(self.summary);
            let value = (last.mean_dn - black_dn) / self.k();
            let [k, error] = self.of("K");
            let half = SIGMAS * value * error / k;
            let interval = [value - half, value + half];
            fit.fitted.push(Fitted { key, value, interval, rests_on: "mean of the saturated points over K" });
        }
    }

    /// Mean dark code without exposure and its standard error: of the line over the exposures, and of the mean of the die's pattern.
    fn black(&self, summary: &Summary) -> [f64; 2] {
        let transfer = &summary.transfer;
        let (_, offset) = transfer.dark_line(|point| point.dark_mean_dn);
        let (_, error) = transfer.dark_line_errors();
        let dark = &summary.dark;
        let noise_dn2 = 0.5 * (dark.stack_variance_dn2 / transfer.pixels + line_dn2(self.shared, summary));
        let pattern_dn2 = greater(0.0, dark.pixel_dn2) / transfer.pixels
            + greater(0.0, dark.row_dn2) / dark.rows
            + greater(0.0, dark.column_dn2) / dark.columns;
        [offset, (error * error * noise_dn2 + pattern_dn2).sqrt()]
    }

    fn dark(&self, fit: &mut SensorFit) {
        let key = "adc.black_level_dn";
        if self.frames.measurement.dark_clipped > DARK_CLIPPED_MAX {
            let percent = 100.0 * self.frames.measurement.dark_clipped;
            fit.warnings.push(format!("{percent:.1} % of the dark codes are 0; raise the camera's black level"));
            fit.undetermined.push(Undetermined { key, reason: "dark codes clip at 0".to_owned() });
        } else {
            let [mean, error] = self.black(self.read);
            // A code counts the whole steps of the ramp below a level, so codes lie half a step low in the mean.
            let value = mean + 0.5;
            let interval = [value - SIGMAS * error, value + SIGMAS * error];
            fit.fitted.push(Fitted { key, value, interval, rests_on: "mu_y.dark without exposure, plus half a code" });
        }
        self.dark_current(fit);
    }

    fn dark_current(&self, fit: &mut SensorFit) {
        let [rate, error] = self.of("u_I_mean");
        let Assumed { temperature_k, .. } = *self.assumed;
        if !self.frames.temperatures.is_empty() {
            let [k, k_error] = self.of("K");
            let dark_dn2 = self.summary.dark.stack_variance_dn2;
            let line_dn2 = line_dn2(self.shared, self.summary);
            let noise = FrameNoise { k, pixels: self.summary.transfer.pixels, dark_dn2, line_dn2 };
            let others = self.frames.temperatures.iter().map(|series| series.rate(&noise));
            // All rates share the error of the gain.
            let shared = rate * k_error / k;
            let own = greater(error * error - shared * shared, 0.0).sqrt();
            let rates: Vec<DarkRate> =
                [DarkRate { temperature_k, rate_e_per_s: [rate, own] }].into_iter().chain(others).collect();
            match doubling(&rates, k_error / k) {
                Ok(pair) => return fit.fitted.extend(pair),
                Err(reason) => fit.undetermined.push(Undetermined::new("pixel.dark_doubling_k", reason)),
            }
        } else {
            let reason =
                "frames at one temperature do not determine it; add dark frames of another with --dark KELVIN=FOLDER";
            fit.undetermined.push(Undetermined::new("pixel.dark_doubling_k", reason));
        }
        let interval =
            [rate - SIGMAS * error, rate + SIGMAS * error].map(|rate| self.at_300_k(fit) * greater(rate, 0.0));
        let key = "pixel.dark_current_e_per_s";
        fit.fitted.push(Fitted { key, value: self.at_300_k(fit) * greater(rate, 0.0), interval, rests_on: "u_I_mean" });
    }

    /// Rate of dark charge at 300 K, at which a sensor file states it, over that of the frames.
    fn at_300_k(&self, fit: &SensorFit) -> f64 {
        let Assumed { temperature_k, dark_doubling_k, .. } = *self.assumed;
        let step_k = fit.get("pixel.dark_doubling_k").map_or(dark_doubling_k, |fitted| fitted.value);
        libm::exp2((300.0 - temperature_k) / step_k)
    }

    fn noise(&self, fit: &mut SensorFit) {
        let dark = &self.summary.dark;
        let (shared, lsb_uv) = (self.shared, self.lsb_uv());
        let shared_error = |own_dn2: f64, lines: f64, length: f64| {
            (2.0 / (lines * dark.frames)).sqrt() * (own_dn2 + dark.stack_variance_dn2 / length)
        };
        let row_error = shared_error(shared.row_dn2, dark.rows, dark.columns);
        let column_error = shared_error(shared.column_dn2, dark.columns, dark.rows);
        let [sigma, sigma_error] = self.of("sigma_y_dark");
        let traps = telegraph(self.frames.defects);
        let hidden_dn2 = traps.as_ref().map_or(0.0, |traps| traps.hidden_dn2);
        let own_dn2 = sigma * sigma - 1.0 / 12.0 - shared.row_dn2 - shared.column_dn2 - hidden_dn2;
        let own_error = libm::hypot(2.0 * sigma * sigma_error, libm::hypot(row_error, column_error));
        let k_relative = self.of("K")[1] / self.k();
        for (key, variance_dn2, error, rests_on) in [
            ("pixel.read_noise_uv", own_dn2, own_error, "sigma_y.dark less what rows and columns share"),
            ("adc.row_noise_uv", shared.row_dn2, row_error, "variance that the pixels of a row share"),
            ("adc.column_noise_uv", shared.column_dn2, column_error, "variance that the pixels of a column share"),
        ] {
            fit.fitted.push(rooted(key, [variance_dn2, error], lsb_uv, k_relative, rests_on));
        }
        match traps {
            Some(traps) => {
                let of_dn = |amplitude_dn: f64| amplitude_dn * lsb_uv;
                let Fitted { value, interval, .. } = traps.amplitude;
                fit.fitted.push(traps.ppm);
                fit.fitted.push(Fitted { value: of_dn(value), interval: interval.map(of_dn), ..traps.amplitude });
                let reason = "frames do not determine it: amplitudes are what double sampling leaves, and samples count as independent";
                fit.undetermined.push(Undetermined::new("pixel.rts_rate_hz", reason));
            }
            None => {
                let seen = self.frames.defects.noisy.len();
                let reason = format!(
                    "{seen} pixels are noisier than chance in the dark: that does not determine the amplitudes of traps"
                );
                fit.undetermined.push(Undetermined::new("pixel.rts_ppm", reason));
            }
        }
        if sigma * sigma <= super::analysis::DARK_VARIANCE_MIN_DN2 * 1.001 {
            let reason =
                "dark noise is below 0.5 DN, where quantisation hides it: pixel.read_noise_uv is an upper bound";
            fit.warnings.push(reason.to_owned());
        }
    }

    fn patterns(&self, fit: &mut SensorFit) {
        let (bright, dark) = (&self.summary.bright, &self.summary.dark);
        let shared = self.shared;
        let k_relative = self.of("K")[1] / self.k();
        let signal_dn = bright.mean_dn - dark.mean_dn;
        let parts: [(&str, fn(&SpatialVariances) -> f64); 3] =
            [("_pixel", |parts| parts.pixel_dn2), ("_col", |parts| parts.column_dn2), ("_row", |parts| parts.row_dn2)];
        let dark_keys = [
            ("pixel.dsnu_e", 1.0 / self.k(), "DSNU1288_pixel"),
            ("adc.column_offset_residual_uv", self.lsb_uv(), "DSNU1288_col"),
            ("adc.row_offset_uv", self.lsb_uv(), "DSNU1288_row"),
        ];
        for ((suffix, part), (key, scale, rests_on)) in parts.into_iter().zip(dark_keys) {
            let error = dark_part_error(suffix, dark, shared, part);
            // The standard takes off what independent noise leaves in the means of lines. Noise that lines share leaves more there, which
            // it takes off the pixels' part instead. Bright less dark holds neither, nor hot pixels that are too weak to be seen.
            let left_dn2 = match suffix {
                "_row" => -shared.row_dn2,
                "_col" => -shared.column_dn2,
                _ => shared.row_dn2 + shared.column_dn2 - dark.frames * hot::hidden_dn2(self.frames.defects),
            };
            let variance_dn2 = part(dark) + left_dn2 / dark.frames;
            fit.fitted.push(rooted(key, [variance_dn2, error], scale, k_relative, rests_on));
        }
        let bright_keys = [("pixel.prnu", "PRNU1288_pixel"), ("adc.column_gain_sigma", "PRNU1288_col")];
        for ((suffix, part), (key, rests_on)) in parts.into_iter().zip(bright_keys) {
            let error = bright_part_error(suffix, bright, dark, shared, part);
            fit.fitted.push(rooted(key, [part(bright) - part(dark), error], 1.0 / signal_dn, 0.0, rests_on));
        }
    }

    fn bow(&self, bow: Option<Bow>, fit: &mut SensorFit) {
        let reason = match bow {
            Some(bow) => {
                fit.fitted.push(bow.fitted());
                "bends the response as the converter's bow does; the bend is put down to adc.ramp_inl_lsb"
            }
            None => "the series has too few points below saturation for a bend",
        };
        let key = if bow.is_some() { "pixel.gain_compression" } else { "adc.ramp_inl_lsb" };
        fit.undetermined.push(Undetermined::new(key, reason));
    }

    fn defects(&self, fit: &mut SensorFit) {
        let defects = self.frames.defects;
        let scale = HotScale { k: self.of("K"), stack_s: self.frames.half.exposure_s(), at_300_k: self.at_300_k(fit) };
        hot::append(defects, scale, &mut fit.fitted, &mut fit.undetermined);
        if defects.others > 0 {
            fit.warnings.push(format!(
                "{} pixels of unusual offset or response are neither hot, dead nor stuck; they count in the patterns",
                defects.others
            ));
        }
    }
}

/// A sigma from a variance in DN^2 with its standard error, `scale` units a DN; `scale_relative` is the scale's relative standard error.
fn rooted(
    key: &'static str,
    [variance_dn2, error_dn2]: [f64; 2],
    scale: f64,
    scale_relative: f64,
    rests_on: &'static str,
) -> Fitted {
    let root = |variance: f64| scale * greater(variance, 0.0).sqrt();
    let of_scale = SIGMAS * scale_relative;
    let low = root(variance_dn2 - SIGMAS * error_dn2);
    let high = root(greater(variance_dn2, 0.0) + SIGMAS * error_dn2);
    let value = root(variance_dn2);
    // Both errors are small and independent, so their distances add in squares.
    let interval = [
        greater(0.0, value - libm::hypot(value - low, value * of_scale)),
        value + libm::hypot(high - value, value * of_scale),
    ];
    Fitted { key, value, interval, rests_on }
}
