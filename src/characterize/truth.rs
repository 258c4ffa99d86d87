//! The expected result of each figure: a value with a tolerance, or the reason why the standard cannot measure it.
//!
//! A value is the figure of `analysis` taken from the model's expected points: what endlessly many frames would give, with quantisation,
//! clipping and the position of the points. The plain value of the configuration, by its formula, is listed beside it. A tolerance is 4.5
//! standard errors of `uncertainty` (one false alarm in 150,000); where a die's pattern moves a figure, its standard error is added.

use serde::Serialize;

use super::analysis::{DARK_VARIANCE_MIN_DN2, Figures, Summary, figures};
use super::measure::PhotonTransfer;
use super::model::{EmvaModel, Expectation};
use super::set::Set;
use super::uncertainty::{deviation_errors, standard_errors};
use super::unmodelled::unmodelled;
use crate::num::{greater, lesser, u64_half_even};
use crate::report::Ordered;
use crate::run::SensorSetup;

/// Standard errors that a figure may be off.
pub const SIGMAS: f64 = 4.5;

/// Dark noise before the converter, in DN, below which quantisation hides it; rounding alone has 0.29 DN.
pub const DARK_SIGMA_MIN_DN: f64 = 0.3;

/// Share of dark codes that may clip before the black level cannot be told (release 4.0, section 6: black level).
pub const DARK_CLIPPED_MAX: f64 = 0.005;

/// Share of saturation that dark charge may fill before light is not measurable.
const DARK_FILL_MAX: f64 = 0.3;

/// Charge below which counts are too few for means and variances that a normal describes.
const SATURATION_MIN_E: f64 = 30.0;

/// What a figure has to be.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Want {
    /// Expected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Allowed distance from `value`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub abs_tol: Option<f64>,
    /// At least.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// At most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// What the configuration says, before quantisation and clipping.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub configured: Option<f64>,
    /// How `configured` follows from the configuration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formula: Option<&'static str>,
}

/// The truth about one channel.
#[derive(Clone, Debug, Default)]
pub struct ChannelTruth {
    /// By figure.
    pub wants: Ordered<Want>,
    /// Why a figure is not measurable on this sensor with this set.
    pub not_measurable: Ordered<String>,
    /// Why a measurable figure has no expected value.
    pub not_expected: Ordered<String>,
}

/// The truth about a sensor measured by a set.
pub fn truth(sensor: &SensorSetup, set: &Set) -> ChannelTruth {
    let model = EmvaModel::new(sensor, set);
    let expectation = model.expect(set);
    let summary = &expectation.summary;
    let expected = figures(summary);
    let errors = standard_errors(summary, &expected, &expectation.variance_squares, expectation.die);
    let mut truth = ChannelTruth::default();
    if let Some(reason) = nothing_measurable(sensor, set, &model, &expectation) {
        expected.iter().for_each(|(name, _)| truth.not_measurable.insert(name, reason.clone()));
        return truth;
    }
    let saturation = SaturationRange::of(&expectation);
    let hidden = hidden_pattern(&model, summary);
    let configured = configured(&model, set);
    let unmodelled = unmodelled(&sensor.parameters);
    for (name, &value) in expected.iter() {
        if let Some(reason) = unmodelled.iter().find(|one| one.affected.has(name)) {
            truth.not_expected.insert(name, format!("{}: {}", reason.name, reason.reason));
            continue;
        }
        let own = *errors.get(name).expect("every figure has its error");
        let error = own + if name.starts_with("PRNU") { value * hidden } else { 0.0 };
        let (plain, formula) = configured.get(name).map_or((None, None), |plain| (Some(plain.0), Some(plain.1)));
        match want(name, value, error, &model, set, &saturation, &expected) {
            Ok(want) => truth.wants.insert(name, Want { configured: plain, formula, ..want }),
            Err(reason) => truth.not_measurable.insert(name, reason),
        }
    }
    truth
}

/// Reasons that leave no figure at all.
fn nothing_measurable(sensor: &SensorSetup, set: &Set, model: &EmvaModel, expectation: &Expectation) -> Option<String> {
    let (_, dark_e) = model.charge_e(&set.half, false);
    if dark_e > DARK_FILL_MAX * set.saturation_e {
        return Some(format!(
            "dark charge of {dark_e:.3e} e- fills {:.0} % of saturation before any light; use a cooler die",
            100.0 * dark_e / set.saturation_e
        ));
    }
    if set.saturation_e < SATURATION_MIN_E {
        return Some(format!(
            "saturation at {:.1} e- leaves no photon transfer to fit; use {SATURATION_MIN_E} e- or more",
            set.saturation_e
        ));
    }
    let bright_dn = model.gain_dn_per_e * (model.efficiency * set.half.photons).sqrt();
    if libm::hypot(bright_dn, model.dark_sigma_dn()) < DARK_SIGMA_MIN_DN {
        return Some(format!(
            "noise of {bright_dn:.3} DN at half saturation is below {DARK_SIGMA_MIN_DN} DN: quantisation hides even shot noise; \
             use more bits"
        ));
    }
    if expectation.dark_clipped > DARK_CLIPPED_MAX {
        let (black, dark) = (sensor.parameters.adc.black_level_dn, &expectation.summary.dark);
        let spread_dn = libm::hypot(dark.stack_variance_dn2.sqrt(), greater(0.0, dark.total_dn2).sqrt());
        // 0.5 % of a normal lies 2.58 sigma below its mean; code 0 is what may not be met.
        let enough_dn = libm::ceil(1.0 + 2.7 * greater(spread_dn, DARK_SIGMA_MIN_DN)) + 1.0;
        return Some(format!(
            "{:.1} % of the dark codes clip at 0, the standard allows 0.5 %: black level {black} DN is too low for the noise; \
             use sensor.adc.black_level_dn = {}",
            100.0 * expectation.dark_clipped,
            greater(enough_dn, f64::from(black) + 1.0)
        ));
    }
    None
}

/// Relative error of PRNU where dark noise does not dither the quantiser: the dark pattern's variance may then be off by as much as 1/4
/// DN^2, that of a code that flips. Counted as 4.5 standard errors, so that it is added once.
fn hidden_pattern(model: &EmvaModel, summary: &Summary) -> f64 {
    if model.dark_sigma_dn() >= DARK_SIGMA_MIN_DN {
        return 0.0;
    }
    0.25 / (2.0 * SIGMAS * greater(0.0, summary.bright.total_dn2 - summary.dark.total_dn2))
}

/// Figures in which dark noise, dark pattern or both have to be seen through the quantiser.
const NEEDS_DARK_NOISE: [&str; 12] = [
    "sigma_d",
    "sigma_y_dark",
    "u_I_mean",
    "u_I_var",
    "u_e_min",
    "u_p_min",
    "DR_dB",
    "DSNU1288",
    "DSNU1288_row",
    "DSNU1288_col",
    "DSNU1288_pixel",
    "x_k3_ratio",
];

fn want(
    name: &str,
    value: f64,
    error: f64,
    model: &EmvaModel,
    set: &Set,
    saturation: &SaturationRange,
    expected: &Figures,
) -> Result<Want, String> {
    let sigma_dn = model.dark_sigma_dn();
    if sigma_dn < DARK_SIGMA_MIN_DN && NEEDS_DARK_NOISE.contains(&name) {
        return Err(format!(
            "dark noise of {sigma_dn:.3} DN is below {DARK_SIGMA_MIN_DN} DN: quantisation hides it; use more gain or more bits"
        ));
    }
    // The position of the peak is the model's; noise may put it at any point of the range.
    let between = |low: f64, high: f64, more: f64| {
        let farthest = greater(value - low, high - value) + more;
        let (min, max) = (Some(low - more), Some(high + more));
        Ok(Want { value: Some(value), abs_tol: Some(farthest), min, max, ..Want::default() })
    };
    let tolerance = SIGMAS * error;
    let [low, high] = saturation.photons;
    let of = |name: &str| *expected.get(name).expect("all figures are there");
    let share = |photons: f64| photons / of("u_p_sat");
    let decibels = |photons: f64| 20.0 * libm::log10(share(photons));
    match name {
        "u_p_sat" => between(low, high, 1e-9 * high),
        "u_e_sat" => between(value * share(low), value * share(high), tolerance),
        "SNR_max" => between(value * share(low).sqrt(), value * share(high).sqrt(), tolerance),
        "SNR_max_dB" => between(value + 0.5 * decibels(low), value + 0.5 * decibels(high), tolerance),
        "DR_dB" => between(value + decibels(low), value + decibels(high), tolerance),
        // Deviations from a fit have both signs, so zero lies between the extremes.
        "LE_min" => Ok(Want { min: Some(saturation.deviation[0]), max: Some(0.0), ..Want::default() }),
        "LE_max" => Ok(Want { min: Some(0.0), max: Some(saturation.deviation[1]), ..Want::default() }),
        "x_rho_frame" | "x_rho_row" | "x_rho_col" | "u_I_mean" => plain(value, tolerance),
        "x_k3_ratio" if tolerance >= THIRD_TOLERANCE_MAX => {
            let more = tolerance / THIRD_TOLERANCE_MAX;
            let frames = u64_half_even(libm::ceil(1.05 * f64::from(set.stack) * more * more));
            Err(format!("4.5 standard errors are {tolerance:.2}; use a stack of {frames} frames, or more pixels"))
        }
        "x_k3_ratio" => plain(value, tolerance),
        _ => measured(name, value, error, model, set),
    }
}

/// A Gaussian gives 0 where Poisson gives 1: with more than this tolerance the two would not be told apart for certain.
const THIRD_TOLERANCE_MAX: f64 = 0.6;

fn plain(value: f64, tolerance: f64) -> Result<Want, String> {
    Ok(Want { value: Some(value), abs_tol: Some(tolerance), ..Want::default() })
}

/// A positive figure: measurable where 4.5 standard errors of its square (2 x SE(x)) keep it above zero.
fn measured(name: &str, value: f64, error: f64, model: &EmvaModel, set: &Set) -> Result<Want, String> {
    let relative = SIGMAS * error / value;
    let rooted = name.starts_with("DSNU") || name.starts_with("PRNU") || name.starts_with("sigma");
    if !(relative < 0.5) {
        let least = (2.0 * SIGMAS * value * error).sqrt();
        return Err(match (rooted, value > 1e-4 * least) {
            (true, true) => format!("{value:.2e} is too faint: this set shows no less than {least:.2e}"),
            (false, true) => format!("{value:.3e} is too faint: 4.5 standard errors are {:.3e}", SIGMAS * error),
            (_, false) => "the sensor has none".to_owned(),
        });
    }
    // The error of a root is the greater below: sqrt(s^2 - 4.5 SE(s^2)), where SE(s^2) = 2 s SE(s).
    let tolerance = value * if rooted { 1.0 - (1.0 - 2.0 * relative).sqrt() } else { relative };
    let die = value * SIGMAS * pattern_error(name, model, set);
    plain(value, tolerance + die)
}

/// Relative standard error of the die's mean gain over the measured columns and pixels, where a figure carries it.
fn pattern_error(name: &str, model: &EmvaModel, set: &Set) -> f64 {
    let columns = model.column_gain / f64::from(set.size.width_px).sqrt();
    let pixels = model.prnu / crate::num::f64_from_usize(set.size.pixel_count()).sqrt();
    match name {
        "K" | "sigma_y_dark" => columns,
        "R" => libm::hypot(columns, pixels),
        _ => pixels,
    }
}

/// Which points a judge may take for saturation, and what follows.
struct SaturationRange {
    /// Least and greatest photons.
    photons: [f64; 2],
    /// Least and greatest deviation from linearity with 4.5 standard errors, in %.
    deviation: [f64; 2],
}

impl SaturationRange {
    /// Every point whose variance is within 4.5 standard errors of the greatest may turn out greatest.
    fn of(expectation: &Expectation) -> Self {
        let transfer: &PhotonTransfer = &expectation.summary.transfer;
        let error =
            |index: usize| expectation.die.variance_error(expectation.variance_squares[index][0], transfer.pixels);
        let variance = |index: usize| transfer.points[index].variance_dn2;
        let peak = transfer.saturation();
        let reaches =
            |index: &usize| variance(*index) + SIGMAS * libm::hypot(error(*index), error(peak)) >= variance(peak);
        let mut range = Self { photons: [f64::INFINITY, 0.0], deviation: [0.0, 0.0] };
        for index in (0..transfer.points.len()).filter(reaches) {
            let photons = transfer.points[index].photons;
            range.photons = [lesser(range.photons[0], photons), greater(range.photons[1], photons)];
            let fitted = transfer.linear(index);
            let deviations = PhotonTransfer::deviations(fitted, fitted);
            for (deviation, error) in deviations.into_iter().zip(deviation_errors(transfer, index, expectation.die)) {
                range.deviation[0] = lesser(range.deviation[0], deviation - SIGMAS * error);
                range.deviation[1] = greater(range.deviation[1], deviation + SIGMAS * error);
            }
        }
        range
    }
}

/// Plain values of the configuration with their formulas.
fn configured(model: &EmvaModel, set: &Set) -> Ordered<(f64, &'static str)> {
    let k = model.gain_dn_per_e * (1.0 + model.column_gain * model.column_gain);
    let noise_e = libm::hypot(model.noise_e(), (model.storage_dark_e_per_s * model.storage_s).sqrt());
    let sigma_y = greater(k * k * noise_e * noise_e + model.conversions() / 12.0, DARK_VARIANCE_MIN_DN2).sqrt();
    let (light_e, dark_e) = model.charge_e(&set.half, true);
    let column_e = libm::hypot(model.column_offset_e, model.column_gain * dark_e);
    let row_e = libm::hypot(model.row_e(&set.half, false), model.row_offset_e);
    let pixel_e = libm::hypot(model.dsnu_e, model.dcnu * dark_e);
    let column_gain = model.column_gain * (1.0 + 2.0 * dark_e / light_e).sqrt();
    let all: [(&str, f64, &'static str); 21] = [
        ("K", k, "conversion gain / LSB * (1 + column_gain_sigma^2)"),
        ("R", model.gain_dn_per_e * model.efficiency, "conversion gain / LSB * QE * fill factor, QE behind the filter"),
        ("QE", 100.0 * model.efficiency, "QE of the filter in its best band * fill factor"),
        (
            "sigma_d",
            noise_e,
            "root of the noises' variances and dark charge while rows wait; the standard takes off one quantisation, not two",
        ),
        (
            "sigma_y_dark",
            sigma_y,
            "sqrt(max(0.24, K^2 sigma_d^2 + 1/12 a conversion)), two conversions a code where the reset level has its own",
        ),
        ("u_I_mean", model.dark_e_per_s, "dark current at the die's temperature"),
        ("u_I_var", model.dark_e_per_s, "dark current at the die's temperature"),
        ("u_e_sat", set.saturation_e, "least of full well and converter range; variance peaks a little below"),
        ("u_p_sat", set.saturation_e / model.efficiency, "u_e_sat / QE"),
        ("u_e_min", sigma_y / k + 0.5, "sigma_y_dark / K + 1/2"),
        ("u_p_min", (sigma_y / k + 0.5) / model.efficiency, "u_e_min / QE"),
        ("SNR_max", set.saturation_e.sqrt(), "sqrt(u_e_sat)"),
        ("DSNU1288", libm::hypot(libm::hypot(pixel_e, column_e), row_e), "root of the sum of its parts' squares"),
        ("DSNU1288_row", row_e, "row offset, dark current * spread of the rows' wait"),
        ("DSNU1288_col", column_e, "column offset left by double sampling, column gain * dark charge"),
        ("DSNU1288_pixel", pixel_e, "dsnu_e, spread of the dark current"),
        ("PRNU1288", 100.0 * libm::hypot(model.prnu, column_gain), "root of the sum of its parts' squares"),
        ("PRNU1288_row", 0.0, "no response differs from row to row"),
        ("PRNU1288_col", 100.0 * column_gain, "column_gain_sigma, dark charge counted in"),
        ("PRNU1288_pixel", 100.0 * model.prnu, "prnu"),
        ("x_k3_ratio", 1.0, "photoelectrons are Poisson"),
    ];
    all.into_iter().map(|(name, value, formula)| (name, (value, formula))).collect()
}
