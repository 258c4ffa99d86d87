//! The bow of the converter's ramp from the signal over exposure, and figures freed from it.
//!
//! Model (`adc::ramp`): ramp level k of 2^b lies 4 h (k / 2^b) (1 - k / 2^b) LSB above a straight ramp, with h the height in the middle. So
//! the level behind a mean code c is exactly c + 4 h u (1 - u) with u = (c + 1/2) / 2^b, and bright less dark levels are in proportion to
//! the photons: h and the slope follow by least squares. A pixel whose gain falls with its charge bends the response the same way; frames
//! do not tell the two apart, and the bend is put down to the ramp.

use super::parameters::{Fitted, SIGMAS};
use crate::characterize::analysis::Summary;
use crate::characterize::measure::{PhotonTransfer, TransferPoint};
use crate::characterize::spatial::SpatialVariances;
use crate::num::f64_from_u64;

/// Share of saturation up to which points are used: near it the pixel or the converter clips.
const SHARE_MAX: f64 = 0.9;
/// Fewest points for a slope and a height.
const POINTS_MIN: usize = 4;

/// A ramp's bow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bow {
    /// In LSB, in the middle of the range.
    pub height_lsb: f64,
    /// Its standard error.
    pub error_lsb: f64,
    codes: f64,
}

impl Bow {
    /// From the points of photon transfer of `bits`-bit codes; `line_dn2` is what noise shared by lines adds to the variance of a frame's
    /// mean. None of too few points.
    pub fn find(transfer: &PhotonTransfer, bits: u32, line_dn2: f64) -> Option<Self> {
        let codes = f64_from_u64(1 << bits);
        let most_dn = SHARE_MAX * transfer.points[transfer.saturation()].signal_dn();
        let points: Vec<&TransferPoint> =
            transfer.points.iter().filter(|point| point.signal_dn() > 0.0 && point.signal_dn() < most_dn).collect();
        if points.len() < POINTS_MIN {
            return None;
        }
        let are_stated = points.iter().all(|point| point.photons > 0.0);
        // y = slope x + h q, weighted by the variances of y.
        let [mut xx, mut xq, mut qq, mut xy, mut qy] = [0.0; 5];
        for point in points {
            let variance_dn2 = 0.5 * (point.variance_dn2 + point.dark_variance_dn2) / transfer.pixels + line_dn2;
            let weight = 1.0 / variance_dn2;
            let (x, y) = (if are_stated { point.photons } else { point.exposure_ns }, point.signal_dn());
            let q = bend(point.dark_mean_dn, codes) - bend(point.mean_dn, codes);
            xx += weight * x * x;
            xq += weight * x * q;
            qq += weight * q * q;
            xy += weight * x * y;
            qy += weight * q * y;
        }
        let determinant = xx * qq - xq * xq;
        let bow = Self { height_lsb: (xx * qy - xq * xy) / determinant, error_lsb: (xx / determinant).sqrt(), codes };
        (bow.height_lsb.is_finite() && bow.error_lsb.is_finite()).then_some(bow)
    }

    /// As a parameter.
    pub fn fitted(&self) -> Fitted {
        let half = SIGMAS * self.error_lsb;
        let interval = [self.height_lsb - half, self.height_lsb + half];
        Fitted {
            key: "adc.ramp_inl_lsb",
            value: self.height_lsb,
            interval,
            rests_on: "bend of mu_y - mu_y.dark over exposure",
        }
    }

    /// Whether the interval leaves out 0.
    pub fn is_seen(&self) -> bool {
        self.height_lsb.abs() > SIGMAS * self.error_lsb
    }

    /// The level behind a mean code, in LSB, and the levels that a code is wide there.
    fn level(&self, code_dn: f64) -> (f64, f64) {
        let share = (code_dn + 0.5) / self.codes;
        (
            code_dn + self.height_lsb * bend(code_dn, self.codes),
            1.0 + 4.0 * self.height_lsb * (1.0 - 2.0 * share) / self.codes,
        )
    }

    /// Means and variances as a straight ramp would have shown them.
    pub fn straightened(&self, summary: &Summary) -> Summary {
        let point = |point: &TransferPoint| {
            let ((mean_dn, width), (dark_mean_dn, dark_width)) =
                (self.level(point.mean_dn), self.level(point.dark_mean_dn));
            TransferPoint {
                mean_dn,
                variance_dn2: point.variance_dn2 * width * width,
                dark_mean_dn,
                dark_variance_dn2: point.dark_variance_dn2 * dark_width * dark_width,
                ..*point
            }
        };
        let stack = |parts: &SpatialVariances| {
            let (mean_dn, width) = self.level(parts.mean_dn);
            let square = width * width;
            SpatialVariances {
                mean_dn,
                stack_variance_dn2: parts.stack_variance_dn2 * square,
                total_dn2: parts.total_dn2 * square,
                row_dn2: parts.row_dn2 * square,
                column_dn2: parts.column_dn2 * square,
                pixel_dn2: parts.pixel_dn2 * square,
                ..*parts
            }
        };
        let transfer =
            PhotonTransfer { points: summary.transfer.points.iter().map(point).collect(), ..summary.transfer };
        Summary { transfer, bright: stack(&summary.bright), dark: stack(&summary.dark), shape: summary.shape }
    }
}

/// 4 u (1 - u) of a mean code.
fn bend(code_dn: f64, codes: f64) -> f64 {
    let share = (code_dn + 0.5) / codes;
    4.0 * share * (1.0 - share)
}
