//! Allocation of rays: which pixels are refined, and how far.
//!
//! Let V be the variance of a pixel, P its photons and n its samples, and let V fall as n^-k. Then one more ray removes a variance of
//! about k V / n. For a given number of rays the sum of V / P over the pixels is least where V / (P n), the marginal gain, is equal
//! everywhere (Neyman 1934). So all pixels above a level are sampled until they reach it. The level is the one at which the picture
//! meets its target.

use super::first_batch::{FirstBatch, LEFT_TYPICAL};
use crate::num::{f32_from_u32, f32_nearest, f64_from_usize, index, u32_from};
use crate::parallel::collected;

/// Estimate of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Mean photons.
    pub photons: f32,
    /// Estimated variance of that mean.
    pub variance: f32,
    pub samples: u32,
    pub stage: Stage,
}

/// How a pixel was sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Only the first batch.
    First,
    /// Refined by samples for this pixel alone.
    Refined,
}

impl Estimate {
    /// Whether the pixel is lit and below saturation, so that its noise shows.
    pub fn counts(&self, saturation_photons: f32) -> bool {
        self.photons > 0.0 && self.photons < saturation_photons
    }

    /// Whether it may be below saturation: pixels of few samples at the rim of a lamp look brighter than they are.
    pub fn may_count(&self, saturation_photons: f32) -> bool {
        (self.photons > 0.0 || self.variance > 0.0)
            && self.photons - SURE_SIGMAS * self.variance.sqrt() < saturation_photons
    }

    /// Variance over photons. The photons count as one sigma at least: a pixel that seems dark may have missed that many.
    pub fn ratio(&self) -> f32 {
        let sigma = self.variance.sqrt();
        self.variance / if self.photons > sigma { self.photons } else { sigma }
    }

    /// Whether it rests on fewer samples than a refinement begins with.
    fn is_of_few(&self) -> bool {
        self.stage != Stage::Refined && f32_from_u32(self.samples) < FIRST_BATCH_WEIGHT
    }

    /// Variance over photons that one more sample removes. The first sixteen samples of a refinement replace the first batch and leave an
    /// eighth or less; a doubling costs as many samples as there are and leaves a third. Per sample the former gains as much as a doubling
    /// of twelve.
    pub fn marginal_gain(&self) -> f32 {
        self.ratio() / if self.is_of_few() { FIRST_BATCH_WEIGHT } else { f32_from_u32(self.samples) }
    }
}

/// Indices of a pixel and of the eight around it, row by row, in a picture of `count` pixels.
pub fn around(pixel: usize, width: usize, count: usize) -> impl Iterator<Item = usize> {
    let (x, y, height) = (pixel % width, pixel / width, count / width);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
}

/// Squared contrast of a pixel to the eight around it: their variance, plus half the squared difference between their mean and the pixel.
/// The second value is the mean variance that the last doubling removed from those eight.
fn contrast2(first_batches: &[FirstBatch], width: usize, pixel: usize) -> (f32, f32) {
    let (mut sum, mut squares, mut removed_variance, mut count) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
    for other in around(pixel, width, first_batches.len()).filter(|other| *other != pixel) {
        let difference = first_batches[other].photons - first_batches[pixel].photons;
        sum += difference;
        squares += difference * difference;
        removed_variance += first_batches[other].removed_variance;
        count += 1.0;
    }
    let per = if count > 0.0 { 1.0 / count } else { 0.0 };
    let mean = sum * per;
    let variance = squares * per - mean * mean;
    let variance = if variance > 0.0 { variance } else { 0.0 };
    (variance + MEAN_DIFFERENCE_WEIGHT * mean * mean, removed_variance * per)
}

/// Sigmas above saturation at which a pixel surely is.
const SURE_SIGMAS: f32 = 3.0;

/// Bound on the variance of a feature that n samples of a pixel missed, times n^3. The edge of a feature of contrast c lies anywhere over
/// two pixels. With probability 1 / (2 n) it lies in the share 1 / n of a pixel that the samples missed. The error is then uniform up to
/// c / n, with the mean square (c / n)^2 / 3. Together that is c^2 / (6 n^3). The contrast is that of samples, not of pixels: slits of sky
/// are thinner than a pixel.
pub fn missed_variance_n3(first_batches: &[FirstBatch], width: usize, pixel: usize) -> f32 {
    let mut most = 0.0_f32;
    for other in around(pixel, width, first_batches.len()) {
        let difference = first_batches[other].photons - first_batches[pixel].photons;
        let within = PER_SPREAD * first_batches[other].spread;
        let contrast2 = if difference * difference > within { difference * difference } else { within };
        most = if contrast2 > most { contrast2 } else { most };
    }
    most * OF_MISSED
}

/// Share of a squared contrast that one sample may have missed.
const OF_MISSED: f32 = 1.0 / 6.0;

/// Square of a contrast over the spread of four samples, one or two of which have it: 16 / 3 and 4.
const PER_SPREAD: f32 = 5.0;

/// Least number of samples that a pixel of the first batch counts as in its marginal gain.
const FIRST_BATCH_WEIGHT: f32 = 12.0;

/// Weight of a pixel's difference to the mean of its neighbours, relative to the variance among them.
const MEAN_DIFFERENCE_WEIGHT: f32 = 0.5;

/// Estimates variances after the first batch. Halves of two or four samples say little about one pixel and much about all of them: they
/// calibrate how much variance a contrast to the neighbours leaves. A pixel whose halves agree by chance would claim to be exact, so only
/// the halves of its neighbours count, its contrast, and the bound on what it missed. Pixels that were not sampled are dark.
pub fn first_estimates(
    first_batches: &[FirstBatch],
    width: usize,
    samples: u32,
    saturation_photons: f32,
    is_sampled: impl Fn(usize) -> bool,
) -> Vec<Estimate> {
    let one = |pixel: usize| {
        let (contrast2, removed_variance) = contrast2(first_batches, width, pixel);
        (contrast2, removed_variance, missed_variance_n3(first_batches, width, pixel))
    };
    let rows: Vec<Vec<_>> =
        collected(first_batches.len() / width, |row| (row * width..(row + 1) * width).map(one).collect());
    // Ratio of the remaining variance, estimated from halves, to the squared contrasts.
    let (mut remaining_sum, mut contrast2_sum) = (0.0_f64, 0.0_f64);
    for (pixel, (batch, (contrast2, ..))) in first_batches.iter().zip(rows.iter().flatten()).enumerate() {
        if batch.photons > 0.0 && batch.photons < saturation_photons && is_sampled(pixel) {
            remaining_sum += f64::from(LEFT_TYPICAL * batch.removed_variance / batch.photons);
            contrast2_sum += f64::from(*contrast2 / batch.photons);
        }
    }
    let per_contrast2 = if contrast2_sum > 0.0 { f32_nearest(remaining_sum / contrast2_sum) } else { 0.0 };
    let n = f32_from_u32(samples);
    let of = |(pixel, (batch, &(contrast2, removed_variance, missed))): (usize, (&FirstBatch, &(f32, f32, f32)))| {
        if !is_sampled(pixel) {
            return Estimate { photons: 0.0, variance: 0.0, samples: 0, stage: Stage::First };
        }
        let resolved = LEFT_TYPICAL * removed_variance + per_contrast2 * contrast2;
        let mut variance = 0.5 * resolved + missed / (n * n * n);
        // Few samples of a pixel at the rim of a lamp are as likely to be all of the lamp as not, and so are most of them.
        if !(batch.photons < saturation_photons) {
            for least in [0.25 * contrast2, batch.spread / n] {
                variance = if least > variance { least } else { variance };
            }
        }
        Estimate { photons: batch.photons, variance, samples, stage: Stage::First }
    };
    first_batches.iter().zip(rows.iter().flatten()).enumerate().map(of).collect()
}

/// Steps of the table of gains: quarters of an octave.
const STEPS: usize = 1 << 10;
/// Low bits of a gain that are not part of its step's number.
const BELOW: u32 = 21;
/// The variance of a pixel falls as n^-VARIANCE_EXPONENT, as in `fallen`.
const VARIANCE_EXPONENT: f64 = 1.5;

/// Sums over the pixels of a step of gains.
#[derive(Clone, Copy, Default)]
struct Step {
    /// Of the ratios of those of few samples.
    few: f64,
    /// The same ratios for a single sample.
    few_at_one: f64,
    /// Of the ratios of the others.
    many: f64,
}

/// Share of the variance that remains after this many times the samples.
fn fallen(times: f64) -> f64 {
    1.0 / (times * times.sqrt())
}

/// Marginal gain below which no pixel needs more samples for a mean of variance over photons of `target`; none where that is met. Pixels
/// that are not among these leave `spare` to them.
pub fn least_gain(estimates: &[Estimate], target: f64, spare: f64, saturation_photons: f32) -> Option<f32> {
    let mut steps = vec![Step::default(); STEPS];
    let (mut count, mut all) = (0, 0.0);
    for estimate in estimates.iter().filter(|estimate| estimate.may_count(saturation_photons)) {
        count += 1;
        if estimate.variance > 0.0 {
            let step = &mut steps[index(estimate.marginal_gain().to_bits() >> BELOW)];
            let ratio = f64::from(estimate.ratio());
            all += ratio;
            if estimate.is_of_few() {
                step.few += ratio;
                step.few_at_one += ratio * fallen(1.0 / f64::from(estimate.samples));
            } else {
                step.many += ratio;
            }
        }
    }
    let allowed = target * f64_from_usize(count) + spare;
    if all <= allowed {
        return None;
    }
    // Variance that remains if all pixels above a step are brought down to it.
    // Variance falls as n^-VARIANCE_EXPONENT, gain as n^-(VARIANCE_EXPONENT + 1).
    let remaining_after = |least: usize| {
        let gain = |step: usize| f64::from(f32::from_bits(u32_from(step) << BELOW));
        let mut remaining = 0.0;
        for (number, step) in steps.iter().enumerate().filter(|(_, step)| step.few + step.many > 0.0) {
            if number < least {
                remaining += step.few + step.many;
                continue;
            }
            let times = libm::pow(gain(number) / gain(least), 1.0 / (1.0 + VARIANCE_EXPONENT));
            let of_few = crate::num::greater(f64::from(INITIAL_SAMPLES), f64::from(FIRST_BATCH_WEIGHT) * times);
            remaining += step.few_at_one * fallen(of_few) + step.many * fallen(times);
        }
        remaining
    };
    // The first step is zero, which no gain is below.
    let (mut met, mut not_met) = (1, STEPS - 1);
    while not_met - met > 1 {
        let middle = usize::midpoint(met, not_met);
        if remaining_after(middle) <= allowed {
            met = middle;
        } else {
            not_met = middle;
        }
    }
    Some(f32::from_bits(u32_from(met) << BELOW))
}

/// Samples that a refinement begins with: one in each of 4 by 4 cells.
pub const INITIAL_SAMPLES: u32 = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;

    fn refined(photons: f32, variance: f32) -> Estimate {
        Estimate { photons, variance, samples: 16, stage: Stage::Refined }
    }

    #[test]
    fn bringing_all_gains_to_the_level_meets_the_target() {
        let mut tried = 0;
        for target in [10.0, 1.0, 0.1, 0.001] {
            // Variances over six decades; few pixels hold most of the sum.
            let of = |number: u64| {
                let share = crate::num::f64_from_u64(DrawKey::root(9).with(number).0 >> 32) / 4_294_967_296.0;
                refined(100.0, f32_nearest(libm::pow(10.0, 6.0 * share)))
            };
            let estimates: Vec<Estimate> = (0..5_000).map(of).collect();
            let level = f64::from(least_gain(&estimates, target, 0.0, f32::INFINITY).unwrap());
            let after = |estimate: &Estimate| {
                let (ratio, gain) = (f64::from(estimate.ratio()), f64::from(estimate.marginal_gain()));
                let times = if gain > level { libm::pow(gain / level, 1.0 / (1.0 + VARIANCE_EXPONENT)) } else { 1.0 };
                ratio / (times * times.sqrt())
            };
            let mean = estimates.iter().map(after).sum::<f64>() / 5_000.0;
            // Gains are known to a quarter of an octave, 2^(1/4 * 3/5) = 11 %, as is the level.
            assert!(mean < 1.13 * target && mean > 0.75 * target, "{mean} for {target}");
            tried += 1;
        }
        assert_eq!(tried, 4);
        let known = [Estimate { photons: 10.0, variance: 1.0, samples: 4, stage: Stage::First }];
        assert_eq!(least_gain(&known, 0.2, 0.0, f32::INFINITY), None);
        // A tenth is too much for this pixel, and not with what others leave to it.
        assert!(least_gain(&known, 0.05, 0.0, f32::INFINITY).is_some());
        assert_eq!(least_gain(&known, 0.05, 0.06, f32::INFINITY), None);
    }

    #[test]
    fn lamps_take_no_rays_and_their_rims_do() {
        let may_count = |photons: f32, variance: f32| refined(photons, variance).may_count(500.0);
        assert!(!may_count(1_000.0, 100.0) && may_count(1_000.0, 40_000.0) && !may_count(0.0, 0.0));
    }

    /// Three by three pixels of four samples each that saw as much, the middle one's within its own spread.
    fn with_spread(photons: f32, spread: f32) -> Vec<FirstBatch> {
        let uniform = FirstBatch { photons, ..FirstBatch::NONE };
        let mut first_batches = vec![uniform; 9];
        first_batches[4] =
            FirstBatch { removed_variance: 0.25 * spread, removed_variance_before: 0.75 * spread, spread, ..uniform };
        first_batches
    }

    #[test]
    fn a_pixel_of_which_most_samples_met_a_lamp_may_be_below_saturation() {
        // Three of four samples of 40,000: the mean's own sigma is 40,000 sqrt(3 / 64) = 8,660, three of which reach below 10,000.
        let mut first_batches = with_spread(40_000.0, 40_000.0 * 40_000.0 * 3.0 / 16.0);
        first_batches[4].photons = 30_000.0;
        let estimates = first_estimates(&first_batches, 3, 4, 10_000.0, |_| true);
        assert!(estimates[4].may_count(10_000.0), "{:?}", estimates[4]);
        assert!(!estimates[0].counts(10_000.0));
    }

    #[test]
    fn what_a_neighbour_s_samples_differ_by_may_be_hidden_here() {
        let spread = 48.0;
        let estimates = first_estimates(&with_spread(100.0, spread), 3, 4, f32::INFINITY, |_| true);
        // A contrast of c^2 = 5 spreads over 6 times 4^3; on a neighbour lies what the halves left besides.
        let least = PER_SPREAD * spread / 6.0 / 64.0;
        assert!(estimates.iter().all(|estimate| estimate.variance >= least * 0.999), "{estimates:?}");
        let without_spread = first_estimates(&with_spread(100.0, 0.0), 3, 4, f32::INFINITY, |_| true);
        assert!(without_spread.iter().all(|estimate| estimate.variance == 0.0), "{without_spread:?}");
    }
}
