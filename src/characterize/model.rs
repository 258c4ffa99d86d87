//! What a sensor's parameters say of its means and variances, without a draw. Enters: parameters and a set. Leaves: the points and
//! the spatial variances that an endless number of frames would give, saturation and quantisation included.
//!
//! Charge is taken as normal about its mean with a Poisson's variance, which is enough for two moments; patterns are averaged over by
//! quadrature. Every effect of `effects::ALL` has its part here (a test holds the two lists together).

use super::measure::{Point, Transfer};
use super::moments::{Moments, clipped, normal_cdf, normal_nodes, quantised};
use super::set::{Exposure, Set};
use super::shoot::Times;
use super::spatial::Parts;
use crate::num::{f64_from_u64, f64_from_usize};
use crate::pixel::ktc_sigmas;
use crate::run::SensorSetup;

/// A sensor in the words of EMVA 1288, as its configuration implies them.
#[derive(Clone, Debug)]
pub struct Model {
    /// Overall gain K: conversion gain over the size of an LSB.
    pub gain_dn_per_e: f64,
    /// QE as the standard means it: electrons per photon on the pixel, fill factor included.
    pub efficiency: f64,
    /// Read noise and what is left of kTC noise, in e-, quantisation excluded.
    pub noise_e: f64,
    /// At the die's temperature.
    pub dark_e_per_s: f64,
    /// Mean wait between exposure and readout.
    pub storage_s: f64,
    /// Its spread over rows: dark charge of the wait is a row pattern.
    pub storage_sigma_s: f64,
    /// Of the response, between pixels, relative.
    pub prnu: f64,
    /// Of the gain, between columns, relative.
    pub column_gain: f64,
    /// Of the dark signal, between pixels.
    pub dsnu_e: f64,
    /// Of the offset, between columns.
    pub column_offset_e: f64,
    full_well_e: f64,
    black_level_dn: f64,
    code_max: u32,
}

/// What the frames would give in the mean.
#[derive(Clone, Debug)]
pub struct Expectation {
    /// Photon transfer.
    pub transfer: Transfer,
    /// Mean square of the pixels' variances at each point, bright and dark: what the variance of a measured variance needs.
    pub variance_squares: Vec<[f64; 2]>,
    /// Bright stack.
    pub bright: Parts,
    /// Dark stack.
    pub dark: Parts,
    /// Third cumulants of the bright and the dark stack, in DN^3.
    pub third_dn3: [f64; 2],
    /// Share of codes 0 in the dark.
    pub dark_clipped: f64,
}

struct Spot {
    moments: Moments,
    variance_square: f64,
}

impl Model {
    /// Of a sensor and the waits of the measured rows.
    pub fn new(sensor: &SensorSetup, times: &Times) -> Self {
        let (pixel, adc) = (&sensor.parameters.pixel, &sensor.parameters.adc);
        let (storage_s, storage_sigma_s) = times.mean_and_sigma_s();
        let per_e = pixel.conversion_gain_uv_per_e;
        let (read_e, ktc_e2) =
            (pixel.read_noise_uv / per_e, ktc_sigmas(pixel, adc.cds.samples()).variance_uv2() / (per_e * per_e));
        let offset_uv = if adc.cds.is_double() { adc.column_offset_residual_uv } else { adc.column_offset_uv };
        Self {
            gain_dn_per_e: per_e / adc.lsb_uv(),
            efficiency: pixel.quantum_efficiency * pixel.fill_factor,
            noise_e: (read_e * read_e + ktc_e2).sqrt(),
            dark_e_per_s: pixel.dark_current_now_e_per_s(),
            storage_s,
            storage_sigma_s,
            prnu: pixel.prnu,
            column_gain: adc.column_gain_sigma,
            dsnu_e: pixel.dsnu_e,
            column_offset_e: offset_uv / per_e,
            full_well_e: pixel.full_well_e,
            black_level_dn: adc.black_level_dn.into(),
            code_max: adc.code_max(),
        }
    }

    /// Temporal noise in the dark at no exposure, before the converter, in DN: read noise, kTC, and the shot noise of the dark charge
    /// that gathers while rows wait.
    pub fn dark_sigma_dn(&self) -> f64 {
        self.gain_dn_per_e * (self.noise_e * self.noise_e + self.dark_e_per_s * self.storage_s).sqrt()
    }

    /// Everything the set would measure.
    pub fn expect(&self, set: &Set) -> Expectation {
        let spots: Vec<[Spot; 2]> =
            set.points.iter().map(|exposure| [self.spot(exposure, true), self.spot(exposure, false)]).collect();
        let point = |(exposure, [bright, dark]): (&Exposure, &[Spot; 2])| Point {
            exposure_ns: f64_from_u64(exposure.exposure_ns),
            photons: exposure.photons,
            mean_dn: bright.moments.mean,
            variance_dn2: bright.moments.variance,
            dark_mean_dn: dark.moments.mean,
            dark_variance_dn2: dark.moments.variance,
        };
        let half = [self.spot(&set.half, true), self.spot(&set.half, false)];
        Expectation {
            transfer: Transfer {
                points: set.points.iter().zip(&spots).map(point).collect(),
                pixels: f64_from_usize(set.size.pixel_count()),
            },
            variance_squares: spots.iter().map(|pair| pair.each_ref().map(|spot| spot.variance_square)).collect(),
            bright: self.parts(set, true, &half[0].moments),
            dark: self.parts(set, false, &half[1].moments),
            third_dn3: [self.third_dn3(set, &half[0].moments, true), self.third_dn3(set, &half[1].moments, false)],
            dark_clipped: self.dark_clipped(set),
        }
    }

    fn charge_e(&self, exposure: &Exposure, is_lit: bool) -> (f64, f64) {
        let light_e = if is_lit { self.efficiency * exposure.photons } else { 0.0 };
        (light_e, self.dark_e_per_s * (exposure.exposure_s() + self.storage_s))
    }

    /// Moments of one frame's codes, averaged over the patterns.
    fn spot(&self, exposure: &Exposure, is_lit: bool) -> Spot {
        let (light_e, dark_e) = self.charge_e(exposure, is_lit);
        let response_e = self.prnu * light_e;
        let row_e = self.dark_e_per_s * self.storage_sigma_s;
        let spread_e = (response_e * response_e + self.dsnu_e * self.dsnu_e + row_e * row_e).sqrt();
        // Of a pixel that deviates by x spreads, light is responsible for this share in the mean.
        let response_share = if spread_e > 0.0 { response_e * response_e / spread_e } else { 0.0 };
        let (pixels, columns) = (normal_nodes(41), normal_nodes(15));
        let gain_square = self.gain_dn_per_e * self.gain_dn_per_e * (1.0 + self.column_gain * self.column_gain);
        let mut sum = Spot { moments: Moments::default(), variance_square: 0.0 };
        for &(x, pixel_weight) in &pixels {
            let mean_e = light_e + dark_e + x * spread_e;
            let shot_e2 = crate::num::greater(0.0, light_e + dark_e + x * response_share);
            let (charge_e, charge_e2) = clipped(mean_e, shot_e2.sqrt(), f64::NEG_INFINITY, self.full_well_e);
            let sigma_dn = (gain_square * (charge_e2 + self.noise_e * self.noise_e)).sqrt();
            let column_e = libm::hypot(charge_e * self.column_gain, self.column_offset_e);
            for &(y, column_weight) in &columns {
                let mean_dn = self.black_level_dn + self.gain_dn_per_e * (charge_e + y * column_e);
                let found = quantised(mean_dn, sigma_dn, self.code_max);
                let weight = pixel_weight * column_weight;
                sum.moments.mean += weight * found.mean;
                sum.moments.variance += weight * found.variance;
                sum.moments.third += weight * found.third;
                sum.variance_square += weight * found.variance * found.variance;
            }
        }
        sum
    }

    /// Third cumulant of the temporal noise: K^3 times the charge's, which is Poisson's (its mean), and the quantiser's.
    fn third_dn3(&self, set: &Set, moments: &Moments, is_lit: bool) -> f64 {
        let (light_e, dark_e) = self.charge_e(&set.half, is_lit);
        let k = self.gain_dn_per_e;
        k * k * k * (1.0 + 3.0 * self.column_gain * self.column_gain) * (light_e + dark_e) + moments.third
    }

    /// Spatial variances of the mean frame, split as the standard splits them.
    fn parts(&self, set: &Set, is_lit: bool, moments: &Moments) -> Parts {
        let (light_e, dark_e) = self.charge_e(&set.half, is_lit);
        let k = self.gain_dn_per_e;
        let column_gain2 = self.column_gain * self.column_gain;
        let response_e = self.prnu * light_e;
        let pixel_e2 = (response_e * response_e + self.dsnu_e * self.dsnu_e) * (1.0 + column_gain2);
        let charge_e = light_e + dark_e;
        let column_e2 = column_gain2 * charge_e * charge_e + self.column_offset_e * self.column_offset_e;
        let row_e = self.dark_e_per_s * self.storage_sigma_s;
        let (pixel, column, row) = (k * k * pixel_e2, k * k * column_e2, k * k * row_e * row_e);
        let phase = self.black_level_dn + k * charge_e;
        let noise = k * k * (self.noise_e * self.noise_e + charge_e);
        let seen = |part: f64, other: f64| through_quantiser(part, noise + other, phase);
        let total = seen(pixel + column + row, 0.0);
        let (column_seen, row_seen) = (seen(column, pixel + row), seen(row, pixel + column));
        Parts {
            mean_dn: moments.mean,
            stack_variance_dn2: moments.variance,
            total_dn2: total,
            row_dn2: row_seen,
            column_dn2: column_seen,
            // The standard divides the whole by MN - 1 and the lines by their number: 1 / MN of the lines' variance stays with the pixels.
            pixel_dn2: total - (column_seen + row_seen) * (1.0 - 1.0 / f64_from_usize(set.size.pixel_count())),
            frames: f64::from(set.stack),
            rows: set.size.height_px.into(),
            columns: set.size.width_px.into(),
        }
    }

    fn dark_clipped(&self, set: &Set) -> f64 {
        let (_, dark_e) = self.charge_e(&set.half, false);
        let spread_e2 = self.noise_e * self.noise_e
            + dark_e
            + self.dsnu_e * self.dsnu_e
            + self.column_offset_e * self.column_offset_e;
        let level_dn = self.black_level_dn + self.gain_dn_per_e * dark_e;
        let sigma_dn = self.gain_dn_per_e * spread_e2.sqrt();
        if sigma_dn > 0.0 { normal_cdf((1.0 - level_dn) / sigma_dn) } else { f64::from(u8::from(level_dn < 1.0)) }
    }
}

/// Variance of a pattern of variance `part` about `mean_dn` once noise of variance `noise` has dithered the quantiser.
///
/// The mean of floor(x + noise) is x - 1/2 + sin(2 pi x) exp(-2 pi^2 noise) / pi and higher harmonics, below exp(-8 pi^2 noise) / (2
/// pi), left out: 1e-4 DN at the least noise that is measurable (Widrow and Kollar, "Quantization Noise", 2008, chapter 4).
fn through_quantiser(part: f64, noise: f64, mean_dn: f64) -> f64 {
    use std::f64::consts::PI;
    let dither = libm::exp(-2.0 * PI * PI * noise) / PI;
    let blur = libm::exp(-2.0 * PI * PI * part);
    let phase = 2.0 * PI * mean_dn;
    let covariance = 2.0 * PI * part * libm::cos(phase) * blur;
    let sine = libm::sin(phase) * blur;
    let square = 0.5 * (1.0 - blur * blur * blur * blur * libm::cos(2.0 * phase));
    part + 2.0 * dither * covariance + dither * dither * (square - sine * sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Effects whose part in the figures is modelled here.
    const KNOWN_EFFECTS: [&str; 9] = [
        "prnu",
        "shot_noise",
        "dark_current",
        "dsnu",
        "full_well",
        "ktc_noise",
        "read_noise",
        "column_gain",
        "column_offset",
    ];

    #[test]
    fn every_effect_has_its_part_in_the_model() {
        assert_eq!(crate::effects::names(), KNOWN_EFFECTS, "the truth of `characterize` knows all effects or none");
    }

    #[test]
    fn a_coarse_quantiser_steepens_or_flattens_a_faint_pattern_by_its_phase() {
        // d/dx of the mean code is 1 + 2 cos(2 pi x) exp(-2 pi^2 s^2): at a code's lower edge (x integer) steeper, in its middle flatter.
        let (part, noise) = (1e-6, 0.16);
        let slope = 2.0 * libm::exp(-2.0 * std::f64::consts::PI * std::f64::consts::PI * noise);
        for (mean_dn, expected) in [(64.0, 1.0 + slope), (64.5, 1.0 - slope)] {
            let found = (through_quantiser(part, noise, mean_dn) / part).sqrt();
            // The pattern's own width of 1e-3 DN bends the slope by 2 pi^2 1e-6.
            assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
        }
    }
}
