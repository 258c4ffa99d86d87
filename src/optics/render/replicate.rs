//! How a render states its error: some pixels are sampled again with other samples.
//!
//! Estimates that decided how many samples a pixel has are too optimistic about it. Replicates had no say in that, so what they differ by
//! states the error. Pixels are drawn in proportion to their estimated error and weighted by the inverse of that probability (Hansen
//! and Hurwitz 1943): the estimates decide how precise the statement is, not what it states.

use super::allocation::{Estimate, INITIAL_SAMPLES, Stage, around, missed_variance_n3};
use super::first_batch::FirstBatch;
use super::frame::FrameRender;
use super::pixel::{OF_REFINED, StoppingRule};
use super::pixel_samples::PixelSamples;
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, f64_from_u64, f64_from_usize, greater, lesser, u64_from};
use crate::parallel::{collected, over_chunks};
use crate::scene::tracer::Stack;

/// Marks keys of replicates.
const OF_REPLICATE: u64 = 1 << 42;
/// Marks keys of second replicates.
const OF_SECOND_REPLICATE: u64 = 1 << 46;
/// Replicates of a unit of parallel work.
const CHUNK: usize = 4;

/// A pixel that is sampled again, and one over its probability to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct Replicate {
    /// Index of the pixel in the picture, row by row.
    pub pixel: usize,
    /// How many pixels it stands for.
    pub weight: f64,
}

/// Upper bound on the pixels of each stage that are drawn, on average.
const REPLICATES_MAX: f64 = 1_000.0;
/// Upper bound as a share of all pixels.
const PIXELS_SHARE: f64 = 1.0 / 8.0;
/// Upper bound on their samples as a share of all samples.
const SAMPLES_SHARE: f64 = 0.02;
/// Lower bound for small pictures.
const REPLICATES_MIN: f64 = 32.0;
/// A claim counts as at least this share of the mean claim.
const CLAIM_LEAST: f64 = 0.2;

/// Draws the pixels that are sampled again.
pub fn choose(estimates: &[Estimate], width: usize, saturation_photons: f32, key: DrawKey) -> Vec<Replicate> {
    let samples: u64 = estimates.iter().map(|estimate| u64::from(estimate.samples)).sum();
    let mut replicates = Vec::new();
    for stage in [Stage::First, Stage::Refined] {
        let is_in = |estimate: &Estimate| estimate.stage == stage && estimate.counts(saturation_photons);
        let pixels: Vec<usize> = (0..estimates.len()).filter(|&pixel| is_in(&estimates[pixel])).collect();
        let count = f64_from_usize(pixels.len());
        let own = collected(pixels.len(), |number| claim(estimates, width, pixels[number], saturation_photons));
        let mean = own.iter().sum::<f64>() / count;
        let claims_of = || pixels.iter().zip(own.iter().map(|own| own + CLAIM_LEAST * mean));
        let (mut claims, mut cost) = (0.0, 0.0);
        for (&pixel, claim) in claims_of() {
            claims += claim;
            cost += claim * f64::from(estimates[pixel].samples);
        }
        let affordable = SAMPLES_SHARE * f64_from_u64(samples) * claims / cost;
        let most = lesser(REPLICATES_MAX, f64_from_usize(estimates.len()) * PIXELS_SHARE);
        let wanted = greater(lesser(most, affordable), REPLICATES_MIN);
        for (&pixel, claim) in claims_of() {
            // Where nothing claims an error, all claim the same.
            let chance = if claims > 0.0 { wanted * claim / claims } else { wanted / count };
            let draw = key.with(u64_from(pixel)).uniform();
            if draw < chance {
                replicates.push(Replicate { pixel, weight: if chance < 1.0 { 1.0 / chance } else { 1.0 } });
            }
        }
    }
    replicates
}

/// Variance over photons that a pixel claims. Beside a lamp few samples may have met it or none, and then say nothing of it: an n-th of
/// the square of what is missing to saturation.
fn claim(estimates: &[Estimate], width: usize, pixel: usize, saturation_photons: f32) -> f64 {
    let own = &estimates[pixel];
    let is_beside_lamp =
        around(pixel, width, estimates.len()).any(|other| !(estimates[other].photons < saturation_photons));
    let missing = saturation_photons - own.photons;
    let variance = missing * missing / f32_from_u32(own.samples);
    f64::from(if is_beside_lamp && variance > own.variance {
        Estimate { variance, ..*own }.ratio()
    } else {
        own.ratio()
    })
}

/// The mean of squared error over photons of all pixels that count, from what replicates of some, `others`, give. Those of refined
/// pixels have as many samples as these: half the squared difference is the variance. Those of the other pixels are finer pairs A and B:
/// (S - A)(S - B) has the bias of S too.
pub fn variance_ratio(
    estimates: &[Estimate],
    replicates: &[Replicate],
    others: &[[f32; 2]],
    saturation_photons: f32,
) -> f64 {
    let pixels = estimates.iter().filter(|estimate| estimate.counts(saturation_photons)).count();
    let of = |(replicate, others): (&Replicate, &[f32; 2])| {
        let own = f64::from(estimates[replicate.pixel].photons);
        // Nothing beyond saturation shows.
        let [a, b] = others.map(|other| f64::from(if other < saturation_photons { other } else { saturation_photons }));
        let share = if estimates[replicate.pixel].stage == Stage::Refined { 0.5 } else { 1.0 };
        let mean = 0.5 * own + 0.25 * (a + b);
        if mean > 0.0 { replicate.weight * share * (own - a) * (own - b) / mean } else { 0.0 }
    };
    let sum: f64 = replicates.iter().zip(others).map(of).sum();
    if pixels == 0 { 0.0 } else { greater(sum / f64_from_usize(pixels), 0.0) }
}

impl FrameRender<'_> {
    /// Photons of replicates, and the rays that they took: one replicate of as many samples for a refined pixel, two finer ones for a
    /// pixel of the first batch.
    pub fn replicates(
        &self,
        replicates: &[Replicate],
        estimates: &[Estimate],
        first_batches: &[FirstBatch],
        first_batch_samples: u32,
        rule: &StoppingRule,
    ) -> (Vec<[f32; 2]>, u64) {
        let mut all = vec![([0.0; 2], 0); replicates.len()];
        over_chunks(&mut all, CHUNK, |chunk, some| {
            let mut stack = Stack::new();
            for (found, &Replicate { pixel, .. }) in some.iter_mut().zip(&replicates[chunk * CHUNK..]) {
                let mut replicate_of = |key_mark: u64, samples: u32| {
                    let rule = StoppingRule { samples, least_gain: None, saturation_photons: f32::INFINITY, ..*rule };
                    let missed_variance_n3 = missed_variance_n3(first_batches, self.width(), pixel);
                    let mut pixel_samples = PixelSamples { pixel, missed_variance_n3, ..PixelSamples::default() };
                    self.refine_pixel(OF_REFINED | key_mark, &mut pixel_samples, first_batches, &rule, &mut stack);
                    (pixel_samples.photons, u64::from(pixel_samples.samples))
                };
                *found = match estimates[pixel].stage {
                    Stage::Refined => {
                        // A given number has rays beside it, which a replicate chooses for itself.
                        let grown = estimates[pixel].samples - first_batch_samples;
                        let samples = if rule.share.is_some() { rule.samples } else { grown };
                        let (photons, rays) = replicate_of(OF_REPLICATE, samples);
                        ([photons; 2], rays)
                    }
                    Stage::First => {
                        let (a, rays) = replicate_of(OF_REPLICATE, INITIAL_SAMPLES);
                        let (b, more) = replicate_of(OF_SECOND_REPLICATE, INITIAL_SAMPLES);
                        ([a, b], rays + more)
                    }
                };
            }
        });
        let rays = all.iter().map(|(_, rays)| rays).sum();
        (all.into_iter().map(|(photons, _)| photons).collect(), rays)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::normal_quantile;
    use crate::num::{f32_nearest, low_u32};

    #[test]
    fn replicates_state_the_error_whatever_is_claimed() {
        const PIXELS: u64 = 40_000;
        let normal = |key: DrawKey| normal_quantile(low_u32(key.0));
        let mut stated = Vec::new();
        // Claims that are right, the same for all, and false by a factor of 10 either way.
        for claims in 0..3_u64 {
            let key = DrawKey::root(31).with(claims);
            let true_variance = |pixel: u64| -> f64 { if pixel.is_multiple_of(50) { 400.0 } else { 4.0 } };
            let claim = |pixel: u64| match claims {
                0 => true_variance(pixel),
                1 => 10.0,
                _ => true_variance(pixel) * if pixel.is_multiple_of(3) { 10.0 } else { 0.1 },
            };
            let photons = |pixel: u64, side: u64| {
                f32_nearest(1_000.0 + true_variance(pixel).sqrt() * normal(key.with(side).with(pixel)))
            };
            let estimate = |pixel: u64| Estimate {
                photons: photons(pixel, 1),
                variance: f32_nearest(claim(pixel)),
                samples: 16,
                stage: if pixel.is_multiple_of(2) { Stage::Refined } else { Stage::First },
            };
            let estimates: Vec<Estimate> = (0..PIXELS).map(estimate).collect();
            let replicates = choose(&estimates, 200, f32::INFINITY, key.with(3));
            let others = |replicate: &Replicate| match estimates[replicate.pixel].stage {
                Stage::Refined => [photons(u64_from(replicate.pixel), 2); 2],
                Stage::First => [2, 4].map(|side| photons(u64_from(replicate.pixel), side)),
            };
            let seen: Vec<_> = replicates.iter().map(others).collect();
            assert!(replicates.len() > 200 && replicates.len() < 2_400, "{}", replicates.len());
            stated.push(variance_ratio(&estimates, &replicates, &seen, f32::INFINITY));
        }
        // (400 + 49 * 4) / 50 over 1,000 photons. Some 400 replicates of each half; where claims are right each adds a chi squared of
        // one degree: sqrt(2 / 400) = 7 %, and some three times that where they are false.
        let expected = (400.0 + 49.0 * 4.0) / 50.0 / 1_000.0;
        for (stated, sigma) in stated.iter().zip([0.07, 0.2, 0.2]) {
            assert!((stated / expected - 1.0).abs() < 4.0 * sigma, "{stated} for {expected}");
        }
    }
}
