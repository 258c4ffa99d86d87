//! The rung `expected`: mean and variance of each pixel's code in closed form.
//!
//! Patterns of the die and all else that is not drawn in each frame act on the mean as they do on a sample. Where they are not linear,
//! mean and variance are propagated with two sigma points (exact to the third order of a normal; Julier and Uhlmann 2004). Draws add
//! their mean and variance: a Poisson draw a variance equal to its mean, a binomial loss s the variance s (1 - s) N; a full well clips
//! a normal. The converters' part is in `adc/expected`. Effects that are in neither `NOT_DRAWN` nor `DRAWN` have no closed form
//! here and are refused by name: defects with random draws, traps, clock jitter, and what spreads charge between pixels or frames.

use super::row::{RowBuffers, TimedRow};
use super::state::{Capture, Chain, ROWS_PER_CHUNK, RowTimes};
use crate::adc::{CodeMoments, NoisyLevel, clipped};
use crate::effect::Effect;
use crate::effects::sample_timing;
use crate::error::Error;
use crate::num::f32_nearest;
use crate::parallel::over_chunks;
use crate::pixel::{self, SampledLevels, flicker_variance_uv2, ktc_sigmas};
use crate::plane::Plane;

/// Effects of which mean and variance are known: those that are not drawn anew in each frame, and those that are.
const NOT_DRAWN: [&str; 13] = [
    "prnu",
    "parasitic_light",
    "dead_pixels",
    "dsnu",
    "gain_compression",
    "die_gain",
    "column_settling",
    "stuck_pixels",
    "column_gain",
    "die_offset",
    "column_offset",
    "row_offset",
    "supply_ripple",
];
const DRAWN: [&str; 11] = [
    "shot_noise",
    "dark_current",
    "full_well",
    "storage_leakage",
    "flicker_noise",
    "ktc_noise",
    "read_noise",
    "column_noise",
    "row_noise",
    "comparator_noise",
    "ramp_noise",
];

/// Mean and variance of a picture's codes.
pub struct Expected {
    /// Mean code of each pixel.
    pub mean_dn: Plane<f32>,
    /// Variance over frames of each pixel's code.
    pub variance_dn2: Plane<f32>,
}

/// A row on its way: mean and variance of both samples.
struct ExpectedRow {
    mean: Vec<f64>,
    variance: Vec<f64>,
    reset_uv: Vec<f32>,
    reset_variance_uv2: f64,
}

impl Chain {
    /// Whether mean and variance are known in closed form. The error names what is not, and a rung that is accepted.
    pub fn check_expected(&self) -> Result<(), Error> {
        let refuse = |what: &str, accepted: &str| {
            let reason = format!("{what} has no mean and variance in closed form; use sampled, or {accepted}");
            Err(Error::key("run.rung", "expected", reason))
        };
        let reading = &self.readings[0];
        let all = self.charge_effects.iter().map(AsRef::as_ref).chain(reading.effects());
        for effect in all {
            let name = effect.name();
            if !NOT_DRAWN.contains(&name) && !DRAWN.contains(&name) {
                return refuse(name, &format!("run.effects = \"-{name}\""));
            }
        }
        if self.parameters.pixel.dcnu > 0.0 || self.parameters.pixel.die_dark_sigma > 0.0 {
            return refuse(
                "dark current that differs over pixels or dies",
                "sensor.pixel.dcnu = 0 and sensor.die_dark_sigma = 0",
            );
        }
        if !reading.converter.has_moments() {
            return refuse("a ramp of unequal steps, of kickback or of delays", "an ideal ramp");
        }
        if self.merge.is_some() || self.layout.is_some() || self.black.clamp {
            return refuse("a merged, binned, windowed or clamped reading", "a plain one of the whole array");
        }
        Ok(())
    }

    /// Mean and variance of an exposure's codes. Panics where `check_expected` refuses.
    pub fn expected(&self, photons: &Plane<f32>, capture: Capture<'_>, times: &[RowTimes]) -> Expected {
        assert!(self.check_expected().is_ok(), "the rung was checked");
        assert!(times.len() == photons.height_px(), "every row has its times");
        let width = photons.width_px();
        let mut moments = Plane::filled(photons.size(), [0.0_f32; 2]);
        let chunk = |index: usize, rows: &mut [[f32; 2]]| {
            let mut buffers = self.buffers(width);
            for (offset, moments) in rows.chunks_exact_mut(width).enumerate() {
                let row = index * ROWS_PER_CHUNK + offset;
                let found = self.expected_row(photons.row(row), self.timed_row(capture, row, times[row]), &mut buffers);
                let converter = &self.readings[0].converter;
                for (column, pixel) in moments.iter_mut().enumerate() {
                    let signal = NoisyLevel { mean_uv: found.mean[column], variance_uv2: found.variance[column] };
                    let mean_uv = found.reset_uv.get(column).map_or(0.0, |&reset| f64::from(reset));
                    let reset = NoisyLevel { mean_uv, variance_uv2: found.reset_variance_uv2 };
                    let code = converter.code_moments(signal, reset);
                    *pixel = [f32_nearest(code.mean), f32_nearest(code.variance)];
                }
            }
        };
        over_chunks(moments.values_mut(), width * ROWS_PER_CHUNK, chunk);
        Expected { mean_dn: moments.map(|pixel| pixel[0]), variance_dn2: moments.map(|pixel| pixel[1]) }
    }

    fn expected_row(&self, photons: &[f32], timed_row: TimedRow, buffers: &mut RowBuffers) -> ExpectedRow {
        let pixel = &self.parameters.pixel;
        buffers.values.copy_from_slice(photons);
        pixel::photons_to_mean_electrons(pixel, &mut buffers.values);
        let mut row = ExpectedRow {
            mean: buffers.values.iter().map(|&mean_e| f64::from(mean_e)).collect(),
            variance: vec![0.0; photons.len()],
            reset_uv: vec![0.0; buffers.reset.len()],
            reset_variance_uv2: 0.0,
        };
        for effect in &self.charge_effects {
            self.expect(effect.as_ref(), timed_row, buffers, &mut row);
        }
        let sensed = |effect: &&dyn Effect| effect.domain() == crate::effect::Domain::SensedElectrons;
        for effect in self.readings[0].effects().filter(sensed) {
            self.expect(effect, timed_row, buffers, &mut row);
        }
        let gain = pixel.conversion_gain_uv_per_e;
        row.mean.iter_mut().for_each(|mean| *mean *= gain);
        row.variance.iter_mut().for_each(|variance| *variance *= gain * gain);
        for effect in self.readings[0].effects().filter(|effect| !sensed(effect)) {
            self.expect(effect, timed_row, buffers, &mut row);
        }
        row
    }

    fn expect(&self, effect: &dyn Effect, timed_row: TimedRow, buffers: &mut RowBuffers, row: &mut ExpectedRow) {
        let pixel = &self.parameters.pixel;
        match effect.name() {
            "shot_noise" => row.variance.iter_mut().zip(&row.mean).for_each(|(variance, mean_e)| *variance += mean_e),
            "dark_current" => {
                let RowTimes { exposure_s, storage_s, .. } = timed_row.times;
                let (mean_e, _) = pixel::dark_charge_e(pixel, exposure_s, storage_s, pixel::ANY_DIE);
                row.mean.iter_mut().for_each(|mean| *mean += mean_e);
                row.variance.iter_mut().for_each(|variance| *variance += mean_e);
            }
            "full_well" => {
                for (mean, variance) in row.mean.iter_mut().zip(&mut row.variance) {
                    let held = clipped(CodeMoments { mean: *mean, variance: *variance }, -1e12, pixel.full_well_e);
                    (*mean, *variance) = (held.mean, held.variance);
                }
            }
            "storage_leakage" => {
                let kept = libm::exp(-pixel.storage_leakage_per_s * timed_row.times.storage_s);
                for (mean, variance) in row.mean.iter_mut().zip(&mut row.variance) {
                    *variance = kept * kept * *variance + kept * (1.0 - kept) * *mean;
                    *mean *= kept;
                }
            }
            name if NOT_DRAWN.contains(&name) => self.through(effect, timed_row, buffers, row),
            name => {
                let [signal_uv2, reset_uv2] = self.noise_uv2(name);
                row.variance.iter_mut().for_each(|variance| *variance += signal_uv2);
                row.reset_variance_uv2 += reset_uv2;
            }
        }
    }

    /// Variances that a noise of `DRAWN` adds to signal and reset.
    fn noise_uv2(&self, name: &str) -> [f64; 2] {
        let (pixel, adc) = (&self.parameters.pixel, &self.parameters.adc);
        let timing = sample_timing(&self.parameters);
        let shared = |variance_uv2: f64| match timing.samples {
            SampledLevels::Both => [0.5 * variance_uv2, 0.5 * variance_uv2],
            SampledLevels::Signal | SampledLevels::Difference => [variance_uv2, 0.0],
        };
        let of_each = |sigma_uv: f64| {
            let sigmas = adc.sigmas_of_conversions(sigma_uv);
            [sigmas.signal_uv * sigmas.signal_uv, sigmas.reset_uv * sigmas.reset_uv]
        };
        match name {
            "read_noise" => shared(pixel.read_noise_uv * pixel.read_noise_uv),
            "flicker_noise" => shared(flicker_variance_uv2(pixel, timing)),
            "ktc_noise" => {
                let sigmas = ktc_sigmas(pixel, timing.samples);
                [sigmas.signal_uv * sigmas.signal_uv, sigmas.reset_uv * sigmas.reset_uv]
            }
            "column_noise" => [adc.column_noise_uv * adc.column_noise_uv, 0.0],
            "row_noise" => [adc.row_noise_uv * adc.row_noise_uv, 0.0],
            "comparator_noise" => of_each(adc.comparator_noise_uv),
            "ramp_noise" => of_each(adc.ramp_noise_uv),
            _ => unreachable!("{name} is in DRAWN and has no moments"),
        }
    }

    /// Effects without draws act on two points, a sigma above and below the mean.
    fn through(&self, effect: &dyn Effect, timed_row: TimedRow, buffers: &mut RowBuffers, row: &mut ExpectedRow) {
        let reset_uv = row.reset_uv.clone();
        let mut ends: [Vec<f32>; 2] = Default::default();
        for (end, side) in ends.iter_mut().zip([-1.0, 1.0]) {
            for ((value, mean), variance) in buffers.values.iter_mut().zip(&row.mean).zip(&row.variance) {
                *value = f32_nearest(mean + side * variance.sqrt());
            }
            buffers.reset.copy_from_slice(&reset_uv);
            effect.apply(&mut buffers.pass(timed_row, self.die_seed));
            end.clone_from(&buffers.values);
        }
        row.reset_uv.copy_from_slice(&buffers.reset);
        for (column, (mean, variance)) in row.mean.iter_mut().zip(&mut row.variance).enumerate() {
            let (low, high) = (f64::from(ends[0][column]), f64::from(ends[1][column]));
            let half = 0.5 * (high - low);
            (*mean, *variance) = (0.5 * (low + high), half * half);
        }
    }
}
