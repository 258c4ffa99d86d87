//! The figures of EMVA 1288 release 4.0, by name, from photon transfer, spatial variances and the shape of the temporal noise. A figure is
//! NaN where the data cannot give it.
//!
//! With mu the means, sigma^2 the temporal variances, mu_p the photons (names as in `tests/judges/emva1288_check.py`):
//!
//! | figure | formula | section |
//! |---|---|---|
//! | K | slope of sigma_y^2 - sigma_y.dark^2 over mu_y - mu_y.dark through 0, up to 70 % of saturation | 6, photon transfer |
//! | R | slope of mu_y - mu_y.dark over mu_p through 0, same points | 6 |
//! | QE | 100 R / K | 6 |
//! | sigma_y_dark | offset of sigma_y.dark^2 over exposure time, at least 0.24 DN^2, rooted | 6 |
//! | sigma_d | sqrt(sigma_y_dark^2 - 1/12) / K | 6 |
//! | u_p_min, u_e_min | (sigma_y_dark / K + 1/2) / QE: absolute sensitivity threshold, SNR = 1 | 6 |
//! | u_p_sat, u_e_sat | photons of the point of greatest sigma_y^2; times QE | 6 |
//! | SNR_max, DR | sqrt(u_e_sat); u_p_sat / u_p_min | 6 |
//! | LE_min, LE_max | extreme relative deviation from the line of least relative deviation, 5 to 95 % of saturation | 6, linearity |
//! | u_I_mean, u_I_var | slopes of mu_y.dark / K and sigma_y.dark^2 / K^2 over exposure time | 7 |
//! | DSNU1288 | s_y.dark / K, and of its row, column and pixel parts | 8 |
//! | PRNU1288 | sqrt(s_y^2 - s_y.dark^2) / (mu_y - mu_y.dark) at 50 %, and parts | 8 |
//! | x_k3_ratio | third cumulant of bright less dark noise over K (sigma_y^2 - sigma_y.dark^2): 1 for Poisson | beyond the standard |
//! | x_rho_frame, x_rho_row, x_rho_col | correlation of noise with the next frame's; share that a row or column has in common | beyond |

use super::fits;
use super::measure::{ChannelMeasurement, PhotonTransfer, TransferPoint};
use super::spatial::{self, SpatialVariances};
use crate::report::Ordered;

/// Figures by name, in the order in which a report shows them. NaN: the data hold none.
pub type Figures = Ordered<f64>;

/// Least temporal dark variance in DN^2 that the standard reports: below it quantisation decides.
pub const DARK_VARIANCE_MIN_DN2: f64 = 0.24;

/// Shape and independence of the temporal noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseShape {
    /// Third cumulants under light and in the dark, in DN^3.
    pub third_dn3: [f64; 2],
    /// Correlation with the next frame.
    pub rho_frame: f64,
    /// Share of variance common to a row.
    pub rho_row: f64,
    /// Share of variance common to a column.
    pub rho_column: f64,
}

/// Everything that figures are made from.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Photon transfer.
    pub transfer: PhotonTransfer,
    /// Stack under light.
    pub bright: SpatialVariances,
    /// Stack in the dark.
    pub dark: SpatialVariances,
    /// The noise's shape.
    pub shape: NoiseShape,
}

impl Summary {
    /// Of a measurement.
    pub fn of(measurement: &ChannelMeasurement) -> Self {
        let (rho_row, rho_column) = measurement.bright.shared_noise();
        Self {
            transfer: measurement.transfer.clone(),
            bright: spatial::parts(&measurement.bright),
            dark: spatial::parts(&measurement.dark),
            shape: NoiseShape {
                third_dn3: [measurement.bright.third_dn3(), measurement.dark.third_dn3()],
                rho_frame: measurement.bright.frame_correlation(),
                rho_row,
                rho_column,
            },
        }
    }
}

impl TransferPoint {
    /// mu_y - mu_y.dark.
    pub fn signal_dn(&self) -> f64 {
        self.mean_dn - self.dark_mean_dn
    }
}

impl PhotonTransfer {
    /// The point of greatest temporal variance: where the standard puts saturation.
    pub fn saturation(&self) -> usize {
        let greater = |best: usize, index: usize| {
            if self.points[index].variance_dn2 > self.points[best].variance_dn2 { index } else { best }
        };
        (1..self.points.len()).fold(0, greater)
    }

    /// Points up to 70 % of saturation, which fits of K and R use.
    pub fn sensitivity(&self) -> &[TransferPoint] {
        let most = 0.7 * self.points[self.saturation()].signal_dn();
        let last = self.points.iter().rposition(|point| point.signal_dn() <= most);
        &self.points[..last.map_or(0, |last| last + 1)]
    }

    /// Points between 5 and 95 % of the signal at point `saturation`, which the linearity fit uses.
    pub fn linear(&self, saturation: usize) -> &[TransferPoint] {
        let full = self.points[saturation].signal_dn();
        let first = self.points.iter().position(|point| point.signal_dn() >= 0.05 * full);
        let last = self.points.iter().rposition(|point| point.signal_dn() <= 0.95 * full);
        match (first, last) {
            (Some(first), Some(last)) if first <= last => &self.points[first..=last],
            _ => &[],
        }
    }

    /// Relative deviation in % of each point from the line of least relative deviation through `fitted`.
    pub fn deviations(points: &[TransferPoint], fitted: &[TransferPoint]) -> Vec<f64> {
        let pairs: Vec<(f64, f64)> = fitted.iter().map(|point| (point.photons, point.signal_dn())).collect();
        let (slope, offset) = fits::relative_line(&pairs);
        let deviation = |point: &TransferPoint| {
            let line = slope * point.photons + offset;
            100.0 * (point.signal_dn() - line) / line
        };
        points.iter().map(deviation).collect()
    }

    /// Slope per second and offset of a dark quantity over exposure time.
    pub(super) fn dark_line(&self, of: impl Fn(&TransferPoint) -> f64) -> (f64, f64) {
        let points: Vec<(f64, f64)> = self.points.iter().map(|point| (point.exposure_ns * 1e-9, of(point))).collect();
        fits::line(&points)
    }

    /// Standard errors of both for a quantity of standard error 1 at every point.
    pub(super) fn dark_line_errors(&self) -> (f64, f64) {
        fits::line_errors(self.points.iter().map(|point| point.exposure_ns * 1e-9))
    }
}

/// All figures of a summary.
pub fn figures(summary: &Summary) -> Figures {
    let mut found = Figures::default();
    sensitivity(summary, &mut found);
    linearity(&summary.transfer, &mut found);
    nonuniformity(summary, &mut found);
    shape(summary, &mut found);
    found
}

fn sensitivity(summary: &Summary, found: &mut Figures) {
    let transfer = &summary.transfer;
    let points = transfer.sensitivity();
    let k = fits::through_origin(
        points.iter().map(|point| (point.signal_dn(), point.variance_dn2 - point.dark_variance_dn2)),
    );
    let r = fits::through_origin(points.iter().map(|point| (point.photons, point.signal_dn())));
    let (variance_slope, variance) = transfer.dark_line(|point| point.dark_variance_dn2);
    let (mean_slope, _) = transfer.dark_line(|point| point.dark_mean_dn);
    let variance = if variance < DARK_VARIANCE_MIN_DN2 { DARK_VARIANCE_MIN_DN2 } else { variance };
    let sigma_y_dark = variance.sqrt();
    let efficiency = r / k;
    let electrons_min = sigma_y_dark / k + 0.5;
    let photons_sat = transfer.points[transfer.saturation()].photons;
    let electrons_sat = efficiency * photons_sat;
    let photons_min = electrons_min / efficiency;
    let decibels = |ratio: f64| 20.0 * libm::log10(ratio);
    let rooted = |value: f64| if value < 0.0 { f64::NAN } else { value };
    let all = [
        ("K", k),
        ("R", r),
        ("QE", 100.0 * efficiency),
        ("sigma_d", (variance - 1.0 / 12.0).sqrt() / k),
        ("sigma_y_dark", sigma_y_dark),
        ("u_I_mean", mean_slope / k),
        ("u_I_var", rooted(variance_slope) / (k * k)),
        ("u_e_sat", electrons_sat),
        ("u_p_sat", photons_sat),
        ("u_e_min", electrons_min),
        ("u_p_min", photons_min),
        ("SNR_max", electrons_sat.sqrt()),
        ("SNR_max_dB", decibels(electrons_sat.sqrt())),
        ("DR_dB", decibels(photons_sat / photons_min)),
    ];
    all.into_iter().for_each(|(name, value)| found.insert(name, value));
}

fn linearity(transfer: &PhotonTransfer, found: &mut Figures) {
    let fitted = transfer.linear(transfer.saturation());
    let deviations = PhotonTransfer::deviations(fitted, fitted);
    let extreme = |better: fn(f64, f64) -> f64| deviations.iter().copied().reduce(better).unwrap_or(f64::NAN);
    found.insert("LE_min", extreme(crate::num::lesser));
    found.insert("LE_max", extreme(crate::num::greater));
}

/// Suffixes of the parts of DSNU and PRNU, and how a part is read.
pub(super) const PARTS: [(&str, fn(&SpatialVariances) -> f64); 4] = [
    ("", |parts| parts.total_dn2),
    ("_row", |parts| parts.row_dn2),
    ("_col", |parts| parts.column_dn2),
    ("_pixel", |parts| parts.pixel_dn2),
];

fn nonuniformity(summary: &Summary, found: &mut Figures) {
    let (bright, dark) = (&summary.bright, &summary.dark);
    let k = *found.get("K").expect("sensitivity comes first");
    for (suffix, part) in PARTS {
        found.insert(format!("DSNU1288{suffix}"), part(dark).sqrt() / k);
    }
    for (suffix, part) in PARTS {
        let relative = (part(bright) - part(dark)).sqrt() / (bright.mean_dn - dark.mean_dn);
        found.insert(format!("PRNU1288{suffix}"), 100.0 * relative);
    }
}

fn shape(summary: &Summary, found: &mut Figures) {
    let shape = &summary.shape;
    let k = *found.get("K").expect("sensitivity comes first");
    let shot_dn2 = summary.bright.stack_variance_dn2 - summary.dark.stack_variance_dn2;
    found.insert("x_k3_ratio", (shape.third_dn3[0] - shape.third_dn3[1]) / (k * shot_dn2));
    found.insert("x_rho_frame", shape.rho_frame);
    found.insert("x_rho_row", shape.rho_row);
    found.insert("x_rho_col", shape.rho_column);
}
