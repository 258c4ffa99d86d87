//! How a render knows its own error. Enters: what every pixel claims. Leaves: the mean of variance over photons, from pixels that
//! were sampled a second time.
//!
//! Whatever a pixel's own samples say of their error also decided how many of them there are, so it is too good. So a few pixels
//! are taken a second time with samples of their own and by the same rules: half the square of what the two differ by is the
//! variance, whoever chose. Those that claim much are taken more often, in proportion to the claim, and count so much less (Hansen and
//! Hurwitz 1943): the claims decide how sure the answer is, and not where it lies.

use super::spend::{Estimate, Kind, ratio};
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, f64_from_u64, f64_from_usize};

/// A pixel that is taken a second time, and one over its chance to be.
#[derive(Clone, Copy, Debug)]
pub struct Twin {
    /// Place in the picture, row by row.
    pub at: usize,
    /// How many pixels it stands for.
    pub weight: f64,
}

/// Pixels of each kind that are taken a second time in the mean, at most.
const TWINS_MAX: f64 = 1_000.0;
/// And of all pixels at most so many.
const PIXELS_SHARE: f64 = 1.0 / 8.0;
/// And of all samples.
const SAMPLES_SHARE: f64 = 0.02;
/// But so many at least, where a picture is small.
const TWINS_MIN: f64 = 32.0;
/// A claim counts as at least this share of the mean claim.
const CLAIM_LEAST: f64 = 0.2;

/// Chooses pixels.
pub fn choose(estimates: &[Estimate], width: usize, saturation_photons: f32, key: DrawKey) -> Vec<Twin> {
    let samples: u64 = estimates.iter().map(|estimate| u64::from(estimate.samples)).sum();
    let mut twins = Vec::new();
    for kind in [Kind::Even, Kind::Net] {
        let is_in = |estimate: &Estimate| estimate.kind == kind && estimate.counts(saturation_photons);
        let of = || estimates.iter().enumerate().filter(|(_, estimate)| is_in(estimate));
        let count = f64_from_usize(of().count());
        let own = |at: usize| claim(estimates, width, at, saturation_photons);
        let mean = of().map(|(at, _)| own(at)).sum::<f64>() / count;
        let claim = |at: usize| own(at) + CLAIM_LEAST * mean;
        let (mut claims, mut cost) = (0.0, 0.0);
        for (at, estimate) in of() {
            claims += claim(at);
            cost += claim(at) * f64::from(estimate.samples);
        }
        let affordable = SAMPLES_SHARE * f64_from_u64(samples) * claims / cost;
        let most = crate::num::lesser(TWINS_MAX, f64_from_usize(estimates.len()) * PIXELS_SHARE);
        let wanted = crate::num::greater(crate::num::lesser(most, affordable), TWINS_MIN);
        for (at, _) in of() {
            // Where nothing claims an error, all claim the same.
            let chance = if claims > 0.0 { wanted * claim(at) / claims } else { wanted / count };
            let draw = key.with(crate::num::u64_from(at)).uniform();
            if draw < chance {
                twins.push(Twin { at, weight: if chance < 1.0 { 1.0 / chance } else { 1.0 } });
            }
        }
    }
    twins
}

/// Variance over photons that a pixel claims. Beside a lamp few samples may have met it or none, and then say nothing of it: an n-th of
/// the square of what is missing to saturation.
fn claim(estimates: &[Estimate], width: usize, at: usize, saturation_photons: f32) -> f64 {
    let own = &estimates[at];
    let (x, y, height) = (at % width, at / width, estimates.len() / width);
    let is_beside_lamp = (y.saturating_sub(1)..(y + 2).min(height)).any(|row| {
        (x.saturating_sub(1)..(x + 2).min(width))
            .any(|column| !(estimates[row * width + column].photons < saturation_photons))
    });
    let missing = saturation_photons - own.photons;
    let variance = missing * missing / f32_from_u32(own.samples);
    f64::from(if is_beside_lamp && variance > own.variance { ratio(own.photons, variance) } else { own.ratio() })
}

/// The mean of variance over photons of all pixels that count, from what the twins saw.
pub fn variance_ratio(estimates: &[Estimate], twins: &[Twin], seen: &[f32], saturation_photons: f32) -> f64 {
    let pixels = estimates.iter().filter(|estimate| estimate.counts(saturation_photons)).count();
    let of = |(twin, &other): (&Twin, &f32)| {
        let own = f64::from(estimates[twin.at].photons);
        // Nothing beyond saturation shows.
        let other = f64::from(if other < saturation_photons { other } else { saturation_photons });
        // Half the square over the mean of the two.
        let sum = own + other;
        if sum > 0.0 { twin.weight * (own - other) * (own - other) / sum } else { 0.0 }
    };
    let sum: f64 = twins.iter().zip(seen).map(of).sum();
    if pixels == 0 { 0.0 } else { sum / f64_from_usize(pixels) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::normal_quantile;
    use crate::num::{f32_nearest, low_u32, u64_from};

    #[test]
    fn twins_tell_the_error_whatever_is_claimed() {
        const PIXELS: u64 = 40_000;
        let normal = |key: DrawKey| normal_quantile(low_u32(key.0));
        let mut told = Vec::new();
        // Claims that are right, the same for all, and false by a factor of 10 either way.
        for kind in 0..3_u64 {
            let key = DrawKey::root(31).with(kind);
            let true_variance = |at: u64| -> f64 { if at.is_multiple_of(50) { 400.0 } else { 4.0 } };
            let claim = |at: u64| match kind {
                0 => true_variance(at),
                1 => 10.0,
                _ => true_variance(at) * if at.is_multiple_of(3) { 10.0 } else { 0.1 },
            };
            let photons =
                |at: u64, side: u64| f32_nearest(1_000.0 + true_variance(at).sqrt() * normal(key.with(side).with(at)));
            let estimate = |at: u64| Estimate {
                photons: photons(at, 1),
                variance: f32_nearest(claim(at)),
                samples: 16,
                kind: if at.is_multiple_of(2) { Kind::Net } else { Kind::Even },
                worth: 16.0,
            };
            let estimates: Vec<Estimate> = (0..PIXELS).map(estimate).collect();
            let twins = choose(&estimates, 200, f32::INFINITY, key.with(3));
            let seen: Vec<_> = twins.iter().map(|twin| photons(u64_from(twin.at), 2)).collect();
            assert!(twins.len() > 200 && twins.len() < 2_400, "{}", twins.len());
            told.push(variance_ratio(&estimates, &twins, &seen, f32::INFINITY));
        }
        // (400 + 49 * 4) / 50 over 1,000 photons. Some 400 twins of each half; where claims are right each adds a chi squared of
        // one degree: sqrt(2 / 400) = 7 %, and some three times that where they are false.
        let expected = (400.0 + 49.0 * 4.0) / 50.0 / 1_000.0;
        for (told, sigma) in told.iter().zip([0.07, 0.2, 0.2]) {
            assert!((told / expected - 1.0).abs() < 4.0 * sigma, "{told} for {expected}");
        }
    }
}
