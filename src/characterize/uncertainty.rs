//! Standard errors of the figures, in their units, from the size of the set and the means and variances of points and stacks, measured or
//! expected.
//!
//! With n pixels and L frames a stack, for noise that is independent between pixels and frames and nearly normal:
//! - a point's variance from one pair of frames: sqrt(2 E[sigma^4] / n); a point's mean: sigma / sqrt(2 n);
//! - a slope through the origin: sqrt(sum x^2 SE(y)^2) / sum x^2; a line: the textbook's, with the largest point error for all;
//! - a spatial variance of m independent lines or pixels, of which each mean still carries noise of variance v:
//!   sqrt(2 / (m - 1)) (s^2 + v);
//! - a third cumulant: sigma^3 sqrt(6 L / ((L - 1) (L - 2) n)) (k-statistics; Kendall, "The Advanced Theory of Statistics");
//! - a mean correlation over L - 1 pairs: 1 / sqrt(n (L - 1)); the share common to lines of length m: sqrt(2 / (lines L)) / m.

use super::analysis::{Figures, PARTS, Summary};
use super::measure::{PhotonTransfer, TransferPoint};
use super::spatial::{SharedVariance, SpatialVariances};
use crate::num::{f64_from_usize, greater};

/// Noise beyond that of independent pixels: the die's columns, whose offsets meet quantisers at different phases (one standard
/// deviation of the mean over all columns, in the dark; points share it, so it does not average out over them), and noise that
/// lines share, of which there are only as many draws as lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DieErrors {
    pub mean_dn: f64,
    pub variance_dn2: f64,
    pub shared: SharedVariance,
    pub rows: f64,
    pub columns: f64,
}

impl Default for DieErrors {
    fn default() -> Self {
        Self { mean_dn: 0.0, variance_dn2: 0.0, shared: SharedVariance::default(), rows: 1.0, columns: 1.0 }
    }
}

impl DieErrors {
    /// Standard error of a point's variance from one pair of frames.
    pub fn variance_error(&self, square: f64, pixels: f64) -> f64 {
        let lines = libm::hypot(
            self.shared.row_dn2 * (2.0 / self.rows).sqrt(),
            self.shared.column_dn2 * (2.0 / self.columns).sqrt(),
        );
        libm::hypot((2.0 * square / pixels).sqrt(), lines)
    }

    /// Square of the standard error of a point's mean from two frames.
    fn mean_error_dn2(&self, variance_dn2: f64, pixels: f64) -> f64 {
        0.5 * (variance_dn2 / pixels + self.shared.row_dn2 / self.rows + self.shared.column_dn2 / self.columns)
    }

    /// Standard error of a point's signal, bright less dark.
    fn signal_error(&self, point: &TransferPoint, pixels: f64) -> f64 {
        (self.mean_error_dn2(point.variance_dn2, pixels) + self.mean_error_dn2(point.dark_variance_dn2, pixels)).sqrt()
    }
}

/// Mean square of the pixels' variances at each point, bright and dark. Measured points take the square of the mean.
fn variance_squares(transfer: &PhotonTransfer) -> Vec<[f64; 2]> {
    let squares =
        |point: &TransferPoint| [point.variance_dn2, point.dark_variance_dn2].map(|variance| variance * variance);
    transfer.points.iter().map(squares).collect()
}

/// Standard errors of the figures of frames that were taken.
pub fn measured_errors(summary: &Summary, figures: &Figures) -> Figures {
    standard_errors(summary, figures, &variance_squares(&summary.transfer), DieErrors::default())
}

/// Standard errors of all figures of `figures`, which were made from `summary`; with those that the die adds, where they are known.
pub fn standard_errors(summary: &Summary, figures: &Figures, squares: &[[f64; 2]], die: DieErrors) -> Figures {
    let mut errors = Figures::default();
    sensitivity(summary, figures, squares, die, &mut errors);
    nonuniformity(summary, figures, die.shared, &mut errors);
    shape(summary, figures, die.shared, &mut errors);
    errors
}

fn sensitivity(summary: &Summary, figures: &Figures, squares: &[[f64; 2]], die: DieErrors, errors: &mut Figures) {
    let (transfer, pixels) = (&summary.transfer, summary.transfer.pixels);
    let of = |name: &str| *figures.get(name).expect("errors belong to figures that exist");
    let points = transfer.sensitivity();
    // An error that all points share moves the slope by itself times sum x / sum x^2.
    let through_origin = |shared: f64, pairs: &mut dyn Iterator<Item = (f64, f64)>| {
        let (x1, xe, xx) =
            pairs.fold((0.0, 0.0, 0.0), |(x1, xe, xx), (x, error)| (x1 + x, xe + x * x * error * error, xx + x * x));
        libm::hypot(xe.sqrt(), shared * x1) / xx
    };
    let k_error = through_origin(
        die.variance_dn2,
        &mut points.iter().zip(squares).map(|(point, [bright, dark])| {
            (point.signal_dn(), libm::hypot(die.variance_error(*bright, pixels), die.variance_error(*dark, pixels)))
        }),
    );
    let r_error =
        through_origin(die.mean_dn, &mut points.iter().map(|point| (point.photons, die.signal_error(point, pixels))));
    let (k, r) = (of("K"), of("R"));
    let (k_relative, r_relative) = (k_error / k, r_error / r);
    let efficiency_relative = libm::hypot(k_relative, r_relative);

    let most = |of: &dyn Fn(usize) -> f64| (0..transfer.points.len()).map(of).fold(0.0, greater);
    // What all points share counts as if it were each point's alone times the root of their number, which it cannot exceed.
    let shared = f64_from_usize(transfer.points.len()).sqrt();
    let own = most(&|index| die.variance_error(squares[index][1], pixels));
    let dark_variance_error = libm::hypot(own, shared * die.variance_dn2);
    let own = most(&|index| die.mean_error_dn2(transfer.points[index].dark_variance_dn2, pixels).sqrt());
    let dark_mean_error = libm::hypot(own, shared * die.mean_dn);
    let (slope, offset) = transfer.dark_line_errors();
    let sigma_y = of("sigma_y_dark");
    let sigma_y_error = offset * dark_variance_error / (2.0 * sigma_y);
    // sigma_d^2 K^2 = sigma_y^2 - 1/12.
    let sigma_d_relative = sigma_y * sigma_y_error / (sigma_y * sigma_y - 1.0 / 12.0);
    // u_p_min = (sigma_y + K / 2) / R.
    let threshold = libm::hypot(libm::hypot(sigma_y_error, 0.5 * k_error) / r, of("u_p_min") * r_relative);
    let saturation_relative = efficiency_relative;
    let decibels = |relative: f64| 20.0 / std::f64::consts::LN_10 * relative;
    let all = [
        ("K", k_error),
        ("R", r_error),
        ("QE", of("QE") * efficiency_relative),
        ("sigma_d", of("sigma_d") * libm::hypot(sigma_d_relative, k_relative)),
        ("sigma_y_dark", sigma_y_error),
        ("u_I_mean", libm::hypot(slope * dark_mean_error / k, of("u_I_mean") * k_relative)),
        ("u_I_var", libm::hypot(slope * dark_variance_error / (k * k), 2.0 * of("u_I_var") * k_relative)),
        ("u_e_sat", of("u_e_sat") * saturation_relative),
        ("u_p_sat", 0.0),
        ("u_e_min", libm::hypot(sigma_y_error, sigma_y * k_relative) / k),
        ("u_p_min", threshold),
        ("SNR_max", 0.5 * of("SNR_max") * saturation_relative),
        ("SNR_max_dB", decibels(0.5 * saturation_relative)),
        ("DR_dB", decibels(threshold / of("u_p_min"))),
    ];
    all.into_iter().for_each(|(name, error)| errors.insert(name, error));
    let error = deviation_errors(transfer, transfer.saturation(), die).into_iter().fold(0.0, greater);
    errors.insert("LE_min", error);
    errors.insert("LE_max", error);
}

/// Standard error in % of each fitted point's relative deviation: its own, and the fitted line's, which is at most that of two
/// parameters found from all of them.
pub fn deviation_errors(transfer: &PhotonTransfer, saturation: usize, die: DieErrors) -> Vec<f64> {
    let fitted = transfer.linear(saturation);
    let own = |point: &TransferPoint| {
        100.0 * libm::hypot(die.signal_error(point, transfer.pixels), die.mean_dn) / point.signal_dn()
    };
    let most = fitted.iter().map(own).fold(0.0, greater);
    let line = most * (2.0 / f64_from_usize(fitted.len().max(1))).sqrt();
    fitted.iter().map(|point| libm::hypot(own(point), line)).collect()
}

/// Lines or pixels that a part is averaged over, and the noise that is left in the mean of one.
fn averaging(suffix: &str, parts: &SpatialVariances, shared: SharedVariance) -> (f64, f64) {
    let noise = parts.stack_variance_dn2 / parts.frames;
    let pixel = crate::num::greater(0.0, parts.pixel_dn2) + noise;
    match suffix {
        "_row" => (parts.rows, pixel / parts.columns + shared.row_dn2 / parts.frames),
        "_col" => (parts.columns, pixel / parts.rows + shared.column_dn2 / parts.frames),
        _ => (parts.rows * parts.columns, noise),
    }
}

/// Standard error of a part of the dark stack's spatial variance, in DN^2.
pub fn dark_part_error(
    suffix: &str,
    parts: &SpatialVariances,
    shared: SharedVariance,
    part: impl Fn(&SpatialVariances) -> f64,
) -> f64 {
    let (count, noise) = averaging(suffix, parts, shared);
    (2.0 / (count - 1.0)).sqrt() * (greater(0.0, part(parts)) + noise)
}

/// Standard error of bright less dark of a part, in DN^2. The pattern of the dark is in both, so what it adds to the difference is its
/// chance correlation with the response's pattern, 2 sqrt(d s_dark^2 / m).
pub fn bright_part_error(
    suffix: &str,
    bright: &SpatialVariances,
    dark: &SpatialVariances,
    shared: SharedVariance,
    part: impl Fn(&SpatialVariances) -> f64,
) -> f64 {
    let ((count, bright_noise), (_, dark_noise)) = (averaging(suffix, bright, shared), averaging(suffix, dark, shared));
    let pattern = greater(0.0, part(dark));
    let response = greater(0.0, part(bright) - pattern);
    let noise = bright_noise + dark_noise;
    let square = (response + noise) * (response + noise) + 2.0 * pattern * (response + noise);
    (2.0 * square / (count - 1.0)).sqrt()
}

/// The whole variance is the sum of its parts, and so is its error's square.
fn whole(
    error: impl Fn(&str, fn(&SpatialVariances) -> f64) -> f64,
    suffix: &str,
    part: fn(&SpatialVariances) -> f64,
) -> f64 {
    if !suffix.is_empty() {
        return error(suffix, part);
    }
    PARTS[1..].iter().map(|&(suffix, part)| error(suffix, part)).fold(0.0, libm::hypot)
}

fn nonuniformity(summary: &Summary, figures: &Figures, shared: SharedVariance, errors: &mut Figures) {
    let (bright, dark) = (&summary.bright, &summary.dark);
    let of = |name: &str| *figures.get(name).expect("errors belong to figures that exist");
    let k_relative = *errors.get("K").expect("sensitivity comes first") / of("K");
    for (suffix, part) in PARTS {
        let error = whole(|suffix, part| dark_part_error(suffix, dark, shared, part), suffix, part);
        let name = format!("DSNU1288{suffix}");
        let figure = of(&name);
        errors.insert(name, figure * libm::hypot(error / (2.0 * part(dark)), k_relative));
    }
    for (suffix, part) in PARTS {
        let error = whole(|suffix, part| bright_part_error(suffix, bright, dark, shared, part), suffix, part);
        let name = format!("PRNU1288{suffix}");
        let figure = of(&name);
        errors.insert(name, figure * error / (2.0 * (part(bright) - part(dark))));
    }
}

fn shape(summary: &Summary, figures: &Figures, shared: SharedVariance, errors: &mut Figures) {
    let (bright, dark) = (&summary.bright, &summary.dark);
    let (frames, pixels) = (bright.frames, summary.transfer.pixels);
    let cumulant = (6.0 * frames / ((frames - 1.0) * (frames - 2.0) * pixels)).sqrt();
    let third = |parts: &SpatialVariances| {
        let variance = parts.stack_variance_dn2;
        cumulant * variance * variance.sqrt()
    };
    let k = *figures.get("K").expect("errors belong to figures that exist");
    let shot_dn2 = bright.stack_variance_dn2 - dark.stack_variance_dn2;
    errors.insert("x_k3_ratio", libm::hypot(third(bright), third(dark)) / (k * shot_dn2));
    // Of noise that lines share there are as many draws as lines; the rest is each pixel's.
    let total_dn2 = bright.stack_variance_dn2;
    let (row, column) = (shared.row_dn2 / total_dn2, shared.column_dn2 / total_dn2);
    let pairs = 1.0 / pixels + row * row / bright.rows + column * column / bright.columns;
    errors.insert("x_rho_frame", (pairs / (frames - 1.0)).sqrt());
    errors.insert("x_rho_row", (2.0 / (bright.rows * frames)).sqrt() * (row + 1.0 / bright.columns));
    errors.insert("x_rho_col", (2.0 / (bright.columns * frames)).sqrt() * (column + 1.0 / bright.rows));
}
