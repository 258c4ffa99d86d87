//! Bootstrap intervals of a run's figures in metres, and the amplitude spectrum of its position error in metres per
//! root hertz.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::measurable::NotMeasurable;
use crate::draw::DrawKey;
use crate::num::{f64_from_usize, index, low_u32, u32_truncated, u64_from};
use crate::report::figures::PoseError;

/// The published number of the bootstrap's draws.
const DRAWS: u64 = 0x626f_6f74_7374_7270;
/// Resamples of an interval. The 2.5 % quantile of 1,000 has a standard error of half a per cent of rank.
const RESAMPLES: u64 = 1_000;
/// Blocks that an interval needs.
const BLOCKS_MIN: usize = 5;
/// Frames of a segment of the spectrum, at most and at least.
const SEGMENT: [usize; 2] = [32, 256];

/// Amplitude density of the position error at a frequency, mean over the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpectrumPoint {
    /// Hertz.
    pub frequency_hz: f64,
    /// Metres a root hertz, one-sided.
    pub m_per_rthz: f64,
}

/// 95 % interval of a root mean square by the moving-block bootstrap (Kuensch 1989): errors of neighbouring frames hang together, so whole
/// blocks of a second are drawn. Fails on fewer than five blocks.
pub fn interval_of_rms(squares: &[f64], block: usize, seed: u64) -> Result<[f64; 2], NotMeasurable> {
    let blocks = squares.len() / block.max(1);
    if blocks < BLOCKS_MIN || block == 0 {
        let reason = format!("an interval is drawn from blocks of {block} frames; {blocks} are too few, use 5 or more");
        return Err(NotMeasurable::Absent(reason));
    }
    let starts = u64_from(squares.len() - block + 1);
    let mut sums = vec![0.0; squares.len() + 1];
    for (k, square) in squares.iter().enumerate() {
        sums[k + 1] = sums[k] + square;
    }
    let key = DrawKey::root(seed).with(DRAWS);
    let resample = |number: u64| {
        let mut sum = 0.0;
        for at in 0..u64_from(blocks) {
            // Multiply-shift; its bias of starts / 2^32 does not matter.
            let draw = u64::from(low_u32(key.with(number).with(at).0 >> 32));
            let start = index(low_u32((draw * starts) >> 32));
            sum += sums[start + block] - sums[start];
        }
        (crate::num::greater(sum, 0.0) / f64_from_usize(blocks * block)).sqrt()
    };
    let mut drawn: Vec<f64> = (0..RESAMPLES).map(resample).collect();
    drawn.sort_by(f64::total_cmp);
    let quantile = |share: f64| drawn[index(u32_truncated(share * f64_from_usize(drawn.len() - 1)))];
    Ok([quantile(0.025), quantile(0.975)])
}

/// Squares of the second differences behind `jitter_d2_m`, per axis for white noise: over triples of evenly spaced frames.
pub fn second_difference_squares(errors: &[PoseError], step_s: f64) -> Vec<f64> {
    let even = |two: &[PoseError]| (two[1].t_s - two[0].t_s - step_s).abs() < 0.5 * step_s;
    let vector = |error: &PoseError| error.estimate_m - error.truth_m;
    let triples = errors.windows(3).filter(|three| even(&three[..2]) && even(&three[1..]));
    triples.map(|e| (vector(&e[2]) - 2.0 * vector(&e[1]) + vector(&e[0])).length_squared() / 18.0).collect()
}

/// Amplitude spectrum of the position error by Welch's method: segments with Hann's window, half overlapping, each without its mean.
/// Empty for fewer than 64 frames, or where frames are missing.
pub fn spectrum(errors: &[PoseError], rate_hz: f64) -> Vec<SpectrumPoint> {
    let mut length = SEGMENT[1];
    while length * 2 > errors.len() {
        length /= 2;
    }
    let gap = errors.windows(2).any(|two| two[1].t_s - two[0].t_s > 1.5 / rate_hz);
    if length < SEGMENT[0] || gap {
        return Vec::new();
    }
    let turn = |k: usize| std::f64::consts::TAU * f64_from_usize(k % length) / f64_from_usize(length);
    let cosines: Vec<f64> = (0..length).map(|k| libm::cos(turn(k))).collect();
    let sines: Vec<f64> = (0..length).map(|k| libm::sin(turn(k))).collect();
    let window: Vec<f64> = cosines.iter().map(|cosine| 0.5 - 0.5 * cosine).collect();
    let window_power: f64 = window.iter().map(|w| w * w).sum();
    let vectors: Vec<DVec3> = errors.iter().map(|error| error.estimate_m - error.truth_m).collect();
    let starts: Vec<usize> = (0..=errors.len() - length).step_by(length / 2).collect();
    let mut powers_m2 = vec![0.0; length / 2];
    for &start in &starts {
        let segment = &vectors[start..start + length];
        let mean_m = segment.iter().fold(DVec3::ZERO, |sum, v| sum + *v) / f64_from_usize(length);
        for (bin, power_m2) in powers_m2.iter_mut().enumerate().skip(1) {
            let (mut real_m, mut imaginary_m) = (DVec3::ZERO, DVec3::ZERO);
            for (k, v) in segment.iter().enumerate() {
                let (v, phase) = ((*v - mean_m) * window[k], (bin * k) % length);
                real_m += v * cosines[phase];
                imaginary_m += v * sines[phase];
            }
            *power_m2 += (real_m.length_squared() + imaginary_m.length_squared()) / 3.0;
        }
    }
    let point = |(bin, power_m2): (usize, &f64)| SpectrumPoint {
        frequency_hz: f64_from_usize(bin) * rate_hz / f64_from_usize(length),
        m_per_rthz: (2.0 * power_m2 / (f64_from_usize(starts.len()) * rate_hz * window_power)).sqrt(),
    };
    powers_m2.iter().enumerate().skip(1).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::u32_from;

    /// A number in -1..1 of an index.
    fn number(at: u64) -> f64 {
        2.0 * DrawKey::root(5).with(at).uniform() - 1.0
    }

    fn errors(vector_m: impl Fn(usize) -> DVec3) -> Vec<PoseError> {
        let error = |k: usize| {
            let estimate_m = vector_m(k);
            PoseError { t_s: f64_from_usize(k) / 32.0, truth_m: DVec3::ZERO, estimate_m, error_m: estimate_m.length() }
        };
        (0..1_024).map(error).collect()
    }

    #[test]
    fn the_interval_of_independent_errors_holds_the_truth_and_narrows_as_a_root() {
        let squares = |count: u64| (0..count).map(|k| number(k) * number(k)).collect::<Vec<f64>>();
        let width = |count| {
            let [low, high] = interval_of_rms(&squares(count), 30, 1).unwrap();
            // The root mean square of a uniform number in -1..1 is 3^-1/2 = 0.577; seed fixed.
            assert!(low < 0.577 && high > 0.577 && low > 0.4, "{count}: {low} to {high}");
            high - low
        };
        let ratio = width(300) / width(4_800);
        // Sixteen times the frames, a quarter of the width; a width from 10 blocks is itself off by a third.
        assert!((2.2..7.0).contains(&ratio), "{ratio}");
        assert!(interval_of_rms(&squares(149), 30, 1).is_err());
        assert!(interval_of_rms(&[], 0, 1).is_err());
    }

    #[test]
    fn white_noise_has_a_flat_spectrum_of_its_variance_and_a_sine_stands_at_its_frequency() {
        let noise = errors(|k| {
            let first = 10_000 + 3 * u64::from(u32_from(k));
            DVec3::new(number(first), number(first + 1), number(first + 2))
        });
        let points = spectrum(&noise, 32.0);
        let sum: f64 = points.iter().map(|p| p.m_per_rthz * p.m_per_rthz * 32.0 / 256.0).sum();
        // A third of a square metre an axis, from 3 * 1,024 numbers: 2 % sigma.
        assert!((sum - 1.0 / 3.0).abs() < 0.03, "{sum}");
        let sine = errors(|k| DVec3::X * libm::sin(std::f64::consts::TAU * 4.0 * f64_from_usize(k) / 32.0));
        let points = spectrum(&sine, 32.0);
        let peak = points.iter().max_by(|a, b| a.m_per_rthz.total_cmp(&b.m_per_rthz)).unwrap();
        assert_eq!(peak.frequency_hz, 4.0);
        assert!(spectrum(&noise[..63], 32.0).is_empty());
    }

    #[test]
    fn second_differences_of_white_noise_have_its_variance() {
        let noise = errors(|k| DVec3::X * number(u64::from(u32_from(k))));
        let squares = second_difference_squares(&noise, 1.0 / 32.0);
        let mean = squares.iter().sum::<f64>() / f64_from_usize(squares.len());
        // One axis of variance 1/3 of three: 1/9, from 1,022 triples with 5 % sigma.
        assert!((mean - 1.0 / 9.0).abs() < 0.02 && squares.len() == 1_022, "{mean}");
    }
}
