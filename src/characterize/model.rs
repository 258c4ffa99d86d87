//! Predicts means and variances from a sensor's parameters, without a draw: the points and spatial variances of infinitely many frames,
//! including saturation and quantisation.
//!
//! Charge is taken as normal about its mean with a Poisson's variance, which is enough for two moments; patterns are averaged over by
//! quadrature. Where reset and signal are converted separately, each has its own noise and its own quantiser on the ramp, and an offset of
//! the column that both carry moves both. Effects that are not modelled here are listed in `unmodelled` with the figures that they change.

use super::analysis::{NoiseShape, Summary};
use super::dither::{Dither, pattern_variance, variance_amplitude_dn2};
use super::measure::{PhotonTransfer, TransferPoint};
use super::moments::{ConversionPair, Cumulants, RampLevel, clipped, normal_cdf, normal_nodes, quantised};
use super::set::{SeriesExposure, Set};
use super::shoot::ReadoutTiming;
use super::spatial::{SharedVariance, SpatialVariances};
use super::uncertainty::DieErrors;
use crate::effects::{Parameters, sample_timing};
use crate::num::{f64_from_u64, f64_from_usize, greater, lesser, u32_truncated};
use crate::pixel::{SampleSigmas, SampledLevels, flicker_variance_uv2, ktc_sigmas};
use crate::run::SensorSetup;

/// A sensor in the words of EMVA 1288, as its configuration implies them.
#[derive(Clone, Debug)]
pub struct EmvaModel {
    /// Overall gain K: conversion gain over the size of an LSB.
    pub gain_dn_per_e: f64,
    /// QE as the standard means it: electrons per photon on the pixel, fill factor and filter included.
    pub efficiency: f64,
    /// Read noise and what is left of kTC noise in the signal sample (or the difference), in e-^2, quantisation excluded.
    pub signal_noise_e2: f64,
    /// The same of the reset sample; 0 where it is not converted separately.
    pub reset_noise_e2: f64,
    /// Dark current of the photodiode at the die's temperature.
    pub dark_e_per_s: f64,
    /// Dark current of the node on which charge waits.
    pub storage_dark_e_per_s: f64,
    /// Dark current's spread between pixels, relative.
    pub dcnu: f64,
    /// Response of the storage node to light, relative to the photodiode's.
    pub parasitic: f64,
    /// Share of the stored charge that leaks away a second.
    pub leakage_per_s: f64,
    /// Share of it that is still there when a row is read, in the mean over rows.
    kept: f64,
    /// Share of the gain that is lost at full well.
    pub compression: f64,
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
    /// Of the offset, between columns, as far as sampling leaves it.
    pub column_offset_e: f64,
    /// Of the offset, between rows.
    pub row_offset_e: f64,
    pub shared: SharedVariance,
    /// Of the offset, between columns, that reset and signal both carry when they are converted.
    column_common_dn: f64,
    full_well_e: f64,
    /// Counts below a column without signal.
    pedestal_dn: f64,
    /// The two conversions; none where one is made.
    difference: Option<ConversionPair>,
    code_max: f64,
}

/// What the frames would give in the mean.
#[derive(Clone, Debug)]
pub struct Expectation {
    pub summary: Summary,
    /// Mean square of the pixels' variances at each point, bright and dark: what the variance of a measured variance needs.
    pub variance_squares: Vec<[f64; 2]>,
    /// Share of codes 0 in the dark.
    pub dark_clipped: f64,
    /// What the chance of the die's columns adds to dark means and variances.
    pub die: DieErrors,
}

#[derive(Clone, Copy, Default)]
struct Spot {
    moments: Cumulants,
    variance_square: f64,
}

impl Spot {
    fn add(&mut self, weight: f64, found: &Cumulants) {
        self.moments.mean += weight * found.mean;
        self.moments.variance += weight * found.variance;
        self.moments.third += weight * found.third;
        self.variance_square += weight * found.variance * found.variance;
    }

    /// Of a signal's count less a reset's, which do not know of each other.
    fn less(&self, reset: &Self) -> Self {
        let (up, down) = (&self.moments, &reset.moments);
        Self {
            moments: Cumulants {
                mean: up.mean - down.mean,
                variance: up.variance + down.variance,
                third: up.third - down.third,
            },
            variance_square: self.variance_square + reset.variance_square + 2.0 * up.variance * down.variance,
        }
    }
}

/// Distance in standard deviations within which a clip has an effect: 3e-6 of a normal lie beyond, of a noise of a few DN.
const CLIP_SIGMAS: f64 = 4.5;

impl EmvaModel {
    /// Of a sensor and the waits of the measured rows.
    pub fn new(sensor: &SensorSetup, set: &Set) -> Self {
        let (pixel, adc) = (&sensor.parameters.pixel, &sensor.parameters.adc);
        let times = ReadoutTiming::new(sensor, set);
        let (storage_s, storage_sigma_s) = times.mean_and_sigma_s();
        let per_e = pixel.conversion_gain_uv_per_e;
        let samples = adc.cds.samples();
        let noise_uv2 = noise_uv2(&sensor.parameters);
        let lsb_uv2 = adc.lsb_uv() * adc.lsb_uv();
        let ramp_uv2 = adc.sigmas_of_conversions(adc.ramp_noise_uv).variance_uv2();
        let offset_uv = if samples.is_double() { adc.column_offset_residual_uv } else { adc.column_offset_uv };
        let is_digital = samples == SampledLevels::Both;
        let code_max = f64::from(adc.code_max());
        Self {
            gain_dn_per_e: per_e / adc.lsb_uv(),
            efficiency: set.efficiency,
            signal_noise_e2: noise_uv2[0] / (per_e * per_e),
            reset_noise_e2: noise_uv2[1] / (per_e * per_e),
            dark_e_per_s: pixel.dark_current_now_e_per_s(),
            storage_dark_e_per_s: pixel
                .at_temperature(pixel.storage_dark_e_per_s.unwrap_or(pixel.dark_current_e_per_s)),
            dcnu: pixel.dcnu,
            parasitic: pixel.parasitic_light,
            leakage_per_s: pixel.storage_leakage_per_s,
            kept: times.mean_of(|wait_s| libm::exp(-pixel.storage_leakage_per_s * wait_s)),
            compression: pixel.gain_compression,
            row_offset_e: adc.row_offset_uv / per_e,
            shared: SharedVariance {
                row_dn2: (adc.row_noise_uv * adc.row_noise_uv + ramp_uv2) / lsb_uv2,
                column_dn2: adc.column_noise_uv * adc.column_noise_uv / lsb_uv2,
            },
            storage_s,
            storage_sigma_s,
            prnu: pixel.prnu,
            column_gain: adc.column_gain_sigma,
            dsnu_e: pixel.dsnu_e,
            column_offset_e: offset_uv / per_e,
            column_common_dn: if is_digital { adc.column_offset_uv / adc.lsb_uv() } else { 0.0 },
            full_well_e: pixel.full_well_e,
            pedestal_dn: adc.pedestal_lsb().into(),
            difference: is_digital.then(|| ConversionPair {
                black_dn: adc.black_level_dn.into(),
                reset_counts: adc.reset_counts_used().into(),
                code_max,
            }),
            code_max,
        }
    }

    /// Noise of samples and conversions, in e-, quantisation excluded.
    pub fn noise_e(&self) -> f64 {
        (self.signal_noise_e2 + self.reset_noise_e2).sqrt()
    }

    /// Conversions whose quantisation a code carries.
    pub fn conversions(&self) -> f64 {
        if self.difference.is_some() { 2.0 } else { 1.0 }
    }

    /// Temporal noise in the dark at no exposure, before the converter, in DN: read noise, kTC, and the shot noise of the dark charge
    /// that gathers while rows wait.
    pub fn dark_sigma_dn(&self) -> f64 {
        let storage_e = self.storage_dark_e_per_s * self.storage_s;
        self.gain_dn_per_e * (self.signal_noise_e2 + self.reset_noise_e2 + storage_e).sqrt()
    }

    /// Everything the set would measure.
    pub fn expect(&self, set: &Set) -> Expectation {
        let reset = self.reset_spot();
        let spot = |exposure: &SeriesExposure, is_lit| self.spot(exposure, is_lit, &reset);
        let spots: Vec<[Spot; 2]> =
            set.points.iter().map(|exposure| [spot(exposure, true), spot(exposure, false)]).collect();
        let point = |(exposure, [bright, dark]): (&SeriesExposure, &[Spot; 2])| TransferPoint {
            exposure_ns: f64_from_u64(exposure.exposure_ns),
            photons: exposure.photons,
            mean_dn: bright.moments.mean,
            variance_dn2: bright.moments.variance,
            dark_mean_dn: dark.moments.mean,
            dark_variance_dn2: dark.moments.variance,
        };
        let half = [spot(&set.half, true), spot(&set.half, false)];
        let transfer = PhotonTransfer {
            points: set.points.iter().zip(&spots).map(point).collect(),
            pixels: f64_from_usize(set.size.pixel_count()),
        };
        let (bright, dark) = (self.parts(set, true, &half[0].moments), self.parts(set, false, &half[1].moments));
        // A line's mean holds all of what it shares, and its share of the rest, which the figure takes off.
        let common =
            |shared_dn2: f64, length: u32| shared_dn2 / bright.stack_variance_dn2 * (1.0 - 1.0 / f64::from(length));
        let shape = NoiseShape {
            third_dn3: [self.third_dn3(set, &half[0].moments, true), self.third_dn3(set, &half[1].moments, false)],
            rho_frame: 0.0,
            rho_row: common(self.shared.row_dn2, set.size.width_px),
            rho_column: common(self.shared.column_dn2, set.size.height_px),
        };
        Expectation {
            summary: Summary { transfer, bright, dark, shape },
            variance_squares: spots.iter().map(|pair| pair.each_ref().map(|spot| spot.variance_square)).collect(),
            dark_clipped: self.dark_clipped(set),
            die: self.die_errors(set),
        }
    }

    /// Mean photoelectrons and dark charge of a pixel, before the well clips and the storage node leaks.
    pub fn charge_e(&self, exposure: &SeriesExposure, is_lit: bool) -> (f64, f64) {
        let light_e = if is_lit { self.efficiency * exposure.photons } else { 0.0 };
        let parasitic_e = light_e * self.parasitic * self.storage_s / exposure.exposure_s();
        (light_e + parasitic_e, self.dark_e_per_s * exposure.exposure_s() + self.storage_dark_e_per_s * self.storage_s)
    }

    /// Spread over rows of the charge that waits: dark charge and light gather, stored charge leaks.
    pub fn row_e(&self, exposure: &SeriesExposure, is_lit: bool) -> f64 {
        let (light_e, dark_e) = self.charge_e(exposure, is_lit);
        let light_e_per_s = if is_lit { self.efficiency * exposure.photons / exposure.exposure_s() } else { 0.0 };
        let gathered = self.storage_dark_e_per_s + self.parasitic * light_e_per_s;
        (gathered - self.leakage_per_s * (light_e + dark_e)).abs() * self.storage_sigma_s * self.kept
    }

    /// Mean and variance of charge in the well to those of what the floating diffusion gives, in e- of its gain at no charge: each
    /// electron stays with the share that is kept; then g N (1 - c N / full well).
    fn sensed(&self, mean_e: f64, variance_e2: f64) -> (f64, f64) {
        let kept = self.kept;
        let (mean_e, variance_e2) =
            (kept * mean_e, kept * kept * variance_e2 + kept * (1.0 - kept) * greater(0.0, mean_e));
        let lost = self.compression / self.full_well_e;
        let slope = self.slope(mean_e);
        (mean_e - lost * (mean_e * mean_e + variance_e2), slope * slope * variance_e2)
    }

    /// Gain of small changes at a charge that is sensed, relative to that at no charge.
    fn slope(&self, charge_e: f64) -> f64 {
        1.0 - 2.0 * self.compression * charge_e / self.full_well_e
    }

    /// Both samples pass the columns' gains, whose mean square is a little above 1.
    fn gain_square(&self) -> f64 {
        self.gain_dn_per_e * self.gain_dn_per_e * (1.0 + self.column_gain * self.column_gain)
    }

    fn reset_sigma_dn(&self) -> f64 {
        (self.gain_square() * self.reset_noise_e2).sqrt()
    }

    /// Counts of the reset ramp over the columns.
    fn reset_spot(&self) -> Spot {
        let Some(difference) = &self.difference else { return Spot::default() };
        let sigma = self.reset_sigma_dn();
        let mut sum = Spot::default();
        for (x, weight) in normal_nodes(nodes_for(self.column_common_dn, sigma)) {
            let mean = self.pedestal_dn + x * self.column_common_dn;
            sum.add(weight, &quantised(RampLevel { mean, sigma }, 0.0, difference.reset_counts));
        }
        sum
    }

    /// Moments of one frame's codes, averaged over the patterns.
    fn spot(&self, exposure: &SeriesExposure, is_lit: bool, reset: &Spot) -> Spot {
        let (light_e, dark_e) = self.charge_e(exposure, is_lit);
        let response_e = self.prnu * light_e;
        let (row_e, thermal_e) = (self.row_e(exposure, is_lit), self.dcnu * dark_e);
        let spread_e = [response_e, self.dsnu_e, row_e, thermal_e].into_iter().fold(0.0, libm::hypot);
        // Of a pixel that deviates by x spreads, light is responsible for this share in the mean.
        let response_share = if spread_e > 0.0 { response_e * response_e / spread_e } else { 0.0 };
        let mut sum = Spot::default();
        for (x, weight) in normal_nodes(41) {
            let mean_e = light_e + dark_e + x * spread_e;
            let shot_e2 = greater(0.0, light_e + dark_e + x * response_share);
            let (charge_e, charge_e2) = clipped(mean_e, shot_e2.sqrt(), f64::NEG_INFINITY, self.full_well_e);
            let (charge_e, charge_e2) = self.sensed(charge_e, charge_e2);
            let found = self.pixel_spot(charge_e, charge_e2, reset);
            sum.moments.mean += weight * found.moments.mean;
            sum.moments.variance += weight * found.moments.variance;
            sum.moments.third += weight * found.moments.third;
            sum.variance_square += weight * found.variance_square;
        }
        sum
    }

    /// The same of pixels of one mean charge, averaged over the columns.
    fn pixel_spot(&self, charge_e: f64, charge_e2: f64, reset: &Spot) -> Spot {
        let sigma = (self.gain_square() * (charge_e2 + self.signal_noise_e2)).sqrt();
        let mean = self.pedestal_dn + self.gain_dn_per_e * charge_e;
        let lines_e = libm::hypot(self.column_offset_e, self.row_offset_e);
        let own_dn = self.gain_dn_per_e * libm::hypot(charge_e * self.column_gain, lines_e);
        let Some(difference) = &self.difference else {
            let mut sum = Spot::default();
            for (x, weight) in normal_nodes(nodes_for(own_dn, sigma)) {
                sum.add(weight, &quantised(RampLevel { mean: mean + x * own_dn, sigma }, 0.0, self.code_max));
            }
            return sum;
        };
        if self.meets_clip(difference, mean, sigma, own_dn) {
            return self.clipped_spot(difference, RampLevel { mean, sigma }, own_dn);
        }
        let spread_dn = libm::hypot(own_dn, self.column_common_dn);
        let mut sum = Spot::default();
        for (x, weight) in normal_nodes(nodes_for(spread_dn, sigma)) {
            sum.add(weight, &quantised(RampLevel { mean: mean + x * spread_dn, sigma }, 0.0, self.code_max));
        }
        let mut found = sum.less(reset);
        found.moments.mean += difference.black_dn;
        found
    }

    /// Whether a count or the code may clip, so that the two conversions cannot be taken apart.
    fn meets_clip(&self, difference: &ConversionPair, mean: f64, sigma: f64, own_dn: f64) -> bool {
        let common = self.column_common_dn;
        let reset = self.reset_sigma_dn();
        let outside = |mean: f64, sigmas: [f64; 4], high: f64| {
            let reach = CLIP_SIGMAS * sigmas.into_iter().fold(0.0, libm::hypot);
            mean - reach < 0.0 || mean + reach > high
        };
        let code = mean + difference.black_dn - self.pedestal_dn;
        outside(mean, [sigma, own_dn, common, 0.0], self.code_max)
            || outside(self.pedestal_dn, [reset, common, 0.0, 0.0], difference.reset_counts)
            || outside(code, [sigma, own_dn, reset, 0.0], self.code_max)
    }

    /// Near a clip: the mixture over the reset's counts in each column.
    fn clipped_spot(&self, difference: &ConversionPair, signal: RampLevel, own_dn: f64) -> Spot {
        let sigma = self.reset_sigma_dn();
        let (own, common) = (normal_nodes(9), normal_nodes(15));
        let mut sum = Spot::default();
        for &(x, own_weight) in &own {
            for &(y, common_weight) in &common {
                let offset = y * self.column_common_dn;
                let level = RampLevel { mean: signal.mean + x * own_dn + offset, ..signal };
                let found = difference.moments(level, RampLevel { mean: self.pedestal_dn + offset, sigma });
                sum.add(own_weight * common_weight, &found);
            }
        }
        sum
    }

    /// Third cumulant of the temporal noise: K^3 times that of f(N), and the quantiser's. For N Poisson of mean m (what leaks leaves it
    /// Poisson) the cumulant is f'^3 m + 3 f'^2 f'' m^2 and higher powers of f'' (delta method).
    fn third_dn3(&self, set: &Set, moments: &Cumulants, is_lit: bool) -> f64 {
        let (light_e, dark_e) = self.charge_e(&set.half, is_lit);
        let mean_e = self.kept * (light_e + dark_e);
        let (slope, bend) = (self.slope(mean_e), -2.0 * self.compression / self.full_well_e);
        let charge_e3 = slope * slope * (slope * mean_e + 3.0 * bend * mean_e * mean_e);
        let k = self.gain_dn_per_e;
        k * k * k * (1.0 + 3.0 * self.column_gain * self.column_gain) * charge_e3 + moments.third
    }

    /// The conversions at a charge, dithered by their own noise.
    fn dithers(&self, charge_e: f64, charge_e2: f64) -> (Dither, Dither) {
        let k = self.gain_dn_per_e;
        let signal =
            Dither::new(self.pedestal_dn + k * charge_e, self.gain_square() * (self.signal_noise_e2 + charge_e2));
        let reset = match self.difference {
            Some(_) => Dither::new(self.pedestal_dn, self.gain_square() * self.reset_noise_e2),
            None => Dither::none(),
        };
        (signal, reset)
    }

    /// Spatial variances of the mean frame, split as the standard splits them.
    fn parts(&self, set: &Set, is_lit: bool, moments: &Cumulants) -> SpatialVariances {
        let (light_e, dark_e) = self.charge_e(&set.half, is_lit);
        let k2 = self.gain_dn_per_e * self.gain_dn_per_e;
        let column_gain2 = self.column_gain * self.column_gain;
        let (sensed_e, sensed_e2) = self.sensed(light_e + dark_e, light_e + dark_e);
        let slope = self.slope(self.kept * (light_e + dark_e));
        let own_e = [self.prnu * light_e, self.dcnu * dark_e, self.dsnu_e].into_iter().fold(0.0, libm::hypot);
        let pixel_e = self.kept * slope * own_e;
        let pixel_e2 = pixel_e * pixel_e * (1.0 + column_gain2);
        let column_e2 = column_gain2 * sensed_e * sensed_e + self.column_offset_e * self.column_offset_e;
        let row_e = libm::hypot(slope * self.row_e(&set.half, is_lit), self.row_offset_e);
        let (pixel, column, row) = (k2 * pixel_e2, k2 * column_e2, k2 * row_e * row_e);
        let (signal, reset) = self.dithers(sensed_e, sensed_e2);
        let common = self.column_common_dn * self.column_common_dn;
        let total = pattern_variance(&signal, &reset, pixel + column + row, common);
        let column_seen = pattern_variance(&signal.averaged(pixel + row), &reset, column, common);
        let row_seen = pattern_variance(&signal.averaged(pixel + column + common), &Dither::none(), row, 0.0);
        // The standard takes off a line's mean what independent noise leaves in it; of noise that the line shares all is left.
        let frames = f64::from(set.stack);
        let column_seen = column_seen + self.shared.column_dn2 / frames;
        let row_seen = row_seen + self.shared.row_dn2 / frames;
        SpatialVariances {
            mean_dn: moments.mean,
            stack_variance_dn2: moments.variance,
            total_dn2: total,
            row_dn2: row_seen,
            column_dn2: column_seen,
            // The standard divides the whole by MN - 1 and the lines by their number: 1 / MN of the lines' variance stays with the pixels.
            pixel_dn2: total - (column_seen + row_seen) * (1.0 - 1.0 / f64_from_usize(set.size.pixel_count())),
            frames,
            rows: set.size.height_px.into(),
            columns: set.size.width_px.into(),
        }
    }

    /// What a frame's finite number of columns leaves to chance: each column's offset meets the quantisers at another phase, and moves
    /// the dark mean and variance of its pixels. A phase cos(2 pi c) over c normal of variance w varies by (1 - exp(-4 pi^2 w)) / 2
    /// in the mean over all starting phases.
    fn die_errors(&self, set: &Set) -> DieErrors {
        let dark_e = self.storage_dark_e_per_s * self.storage_s;
        let offset_dn = libm::hypot(self.gain_dn_per_e * self.column_offset_e, self.column_common_dn);
        let phases =
            0.5 * (1.0 - libm::exp(-4.0 * std::f64::consts::PI * std::f64::consts::PI * offset_dn * offset_dn));
        let chance = (phases / f64::from(set.size.width_px)).sqrt();
        let pixel_dn2 = self.gain_square() * self.dsnu_e * self.dsnu_e;
        let (signal, _) = self.dithers(dark_e, dark_e);
        let signal_noise = self.gain_square() * (self.signal_noise_e2 + dark_e);
        let mut variance_dn2 = variance_amplitude_dn2(signal_noise, pixel_dn2);
        if self.difference.is_some() {
            // One offset moves both conversions, so their swings may add.
            variance_dn2 += variance_amplitude_dn2(self.gain_square() * self.reset_noise_e2, 0.0);
        }
        // The reset's mean does not change with light or time, and so leaves every difference.
        DieErrors {
            mean_dn: chance * signal.averaged(pixel_dn2).mean_amplitude_dn(),
            variance_dn2: chance * variance_dn2,
            shared: self.shared,
            rows: set.size.height_px.into(),
            columns: set.size.width_px.into(),
        }
    }

    fn dark_clipped(&self, set: &Set) -> f64 {
        let (_, dark_e) = self.charge_e(&set.half, false);
        let spread_e2 = self.signal_noise_e2
            + self.reset_noise_e2
            + dark_e
            + self.dsnu_e * self.dsnu_e
            + self.column_offset_e * self.column_offset_e
            + self.row_offset_e * self.row_offset_e;
        // The mean of one conversion lies half a code below its level, that of a difference at its level.
        let (black_dn, least_dn) =
            self.difference.as_ref().map_or((self.pedestal_dn, 1.0), |difference| (difference.black_dn, 0.5));
        let level_dn = black_dn + self.gain_dn_per_e * dark_e;
        let sigma_dn = self.gain_dn_per_e * spread_e2.sqrt();
        if sigma_dn > 0.0 {
            normal_cdf((least_dn - level_dn) / sigma_dn)
        } else {
            f64::from(u8::from(level_dn < least_dn))
        }
    }
}

/// Nodes that average over levels of that spread: a seventh of a code apart where a quantiser shows through the noise.
fn nodes_for(spread_dn: f64, sigma_dn: f64) -> u32 {
    if sigma_dn > 1.0 {
        return 15;
    }
    2 * u32_truncated(lesser(150.0, greater(7.0, 35.0 * spread_dn))) + 1
}

/// Variances of the noise in the signal sample (or the difference) and in the reset sample in uV^2, what lines share included. On a
/// ramp of equal steps, jitter of the clock is one level's noise.
fn noise_uv2(parameters: &Parameters) -> [f64; 2] {
    let (pixel, adc) = (&parameters.pixel, &parameters.adc);
    let samples = adc.cds.samples();
    let flicker_uv = flicker_variance_uv2(pixel, sample_timing(parameters)).sqrt();
    let jitter_uv = 1e-12 * adc.lsb_uv() * f64_from_u64(adc.clock_hz) * adc.ramp_jitter_ps;
    let of_row = SampleSigmas { signal_uv: adc.row_noise_uv, reset_uv: 0.0 };
    let of_column = SampleSigmas { signal_uv: adc.column_noise_uv, reset_uv: 0.0 };
    let parts = [
        SampleSigmas::of_difference(pixel.read_noise_uv, samples),
        SampleSigmas::of_difference(flicker_uv, samples),
        ktc_sigmas(pixel, samples),
        adc.sigmas_of_conversions(adc.comparator_noise_uv),
        adc.sigmas_of_conversions(adc.ramp_noise_uv),
        adc.sigmas_of_conversions(jitter_uv),
        of_row,
        of_column,
    ];
    let sum = |of: fn(&SampleSigmas) -> f64| parts.iter().map(|part| of(part) * of(part)).sum::<f64>();
    [sum(|part| part.signal_uv), sum(|part| part.reset_uv)]
}
