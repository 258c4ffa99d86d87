//! Mean of one pixel's samples, and an estimate of the variance of that mean.

use super::allocation::{Estimate, Stage};
use super::first_batch::LEFT_TYPICAL;
use crate::num::{f32_from_u32, f32_nearest, greater, u32_from};
use crate::scene::lanes::{Floats, LANES};

/// The samples of a refined pixel, summed up.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelSamples {
    /// Index of the pixel in the picture, row by row.
    pub pixel: usize,
    /// Mean photons.
    pub photons: f32,
    pub samples: u32,
    pub moments: Moments,
    /// Variance of the samples about their mean.
    pub spread: f32,
    /// Root of their fourth central moment. Equal to `spread` for an edge that halves the pixel; greater the smaller the part that differs.
    pub root_fourth_moment: f32,
    /// Estimate of the variance that the last doubling removed, from the last doubling and those before it.
    pub removed_variance: f32,
    /// Bound on the variance of a feature that no sample met, times the cube of the number of samples.
    pub missed_variance_n3: f32,
}

/// An edge of contrast c leaves c^2 / 600 (slanting) to c^2 / 1,600 (upright) after sixteen samples, of samples whose spread is c^2 /
/// 6 in the mean over where it lies: 0.64 to 0.24 of the spread over n^1.5.
///
/// A part p of the pixel that differs by c has a rim of some 4 sqrt(p n) of the n cells, each of which leaves some c^2 / n^2, so that
/// c^2 sqrt(p) / n^1.5 is left where samples resolve it, and c^2 p / n where few or none meet it, which is the same at one. A spread of
/// c^2 p says too little of it by sqrt(p): one bright sample of a thousand would claim a thirtieth of its variance.
/// The fourth power's mean is c^4 p, and its root over n^1.5 is that law.
const LEFT_OF_FOURTH_MOMENT: f32 = 0.5;
/// Samples that are added to those that met a part (Jeffreys' prior of a rate).
const OF_ONE: f32 = 0.5;

/// Weight of the doublings before the last one: half, falling as 1 / n^1.5.
pub const OF_BEFORE: f32 = 0.5 * 0.353_553_4;

impl PixelSamples {
    /// What they say of the pixel, which has more samples of a first batch.
    pub fn estimate(&self, first_batch_samples: u32) -> Estimate {
        let samples = first_batch_samples + self.samples;
        Estimate { photons: self.photons, variance: self.variance(), samples, stage: Stage::Refined }
    }

    /// Replaces the moments and what follows from them.
    pub fn set_moments(&mut self, moments: Moments) {
        let [mean, second, third, fourth] = moments.sums.map(|sum| sum / moments.count);
        let mean2 = mean * mean;
        let about_mean = fourth - 4.0 * mean * third + 6.0 * mean2 * second - 3.0 * mean2 * mean2;
        self.moments = moments;
        self.spread = f32_nearest(greater(second - mean2, 0.0));
        self.root_fourth_moment = f32_nearest(greater(about_mean, 0.0).sqrt());
    }

    /// Estimate of the variance of the mean. Halves of a stratified set often have equally many samples on either side of an edge and then
    /// agree by chance, so their difference has half the weight; the other half is what stratified samples of this fourth moment leave of
    /// an edge. Two terms are added: a part that k samples met may as well have been met by k + 1/2, and a part may have been missed by
    /// all.
    pub fn variance(&self) -> f32 {
        let n = f32_from_u32(self.samples.max(1));
        let resolved = LEFT_OF_FOURTH_MOMENT * self.root_fourth_moment / (n * n.sqrt());
        // Of the part of the pixel that differs most: its squared contrast is the fourth central moment over the variance.
        let contrast = if self.spread > 0.0 { self.root_fourth_moment / self.spread.sqrt() } else { 0.0 };
        0.5 * (resolved + LEFT_TYPICAL * self.removed_variance)
            + OF_ONE * (contrast * contrast) / (n * n)
            + self.missed_variance_n3 / (n * n * n)
    }
}

/// Sums of the first four powers of samples, taken about the first of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    count: f64,
    about: f64,
    sums: [f64; 4],
}

impl Moments {
    /// Adds the samples of the first lanes of a packet.
    #[inline(always)]
    pub fn add(&mut self, photons: &Floats, lanes: usize) {
        self.about = if self.count > 0.0 { self.about } else { f64::from(photons.0[0]) };
        self.count += f64::from(u32_from(lanes));
        let mut difference = [0.0; LANES];
        for lane in 0..LANES {
            difference[lane] = if lane < lanes { f64::from(photons.0[lane]) - self.about } else { 0.0 };
        }
        let mut power = [1.0; LANES];
        for sum in &mut self.sums {
            for lane in 0..LANES {
                power[lane] *= difference[lane];
            }
            *sum += pairwise_sum(power);
        }
    }
}

/// Sum of all lanes, halves first.
#[inline(always)]
fn pairwise_sum(mut values: [f64; LANES]) -> f64 {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            values[lane] += values[lane + half];
        }
        half /= 2;
    }
    values[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_that_agree_do_not_make_a_pixel_with_an_edge_exact() {
        let samples_of_pixel =
            PixelSamples { photons: 20.0, samples: 64, root_fourth_moment: 400.0, ..PixelSamples::default() };
        // A quarter of the root fourth moment over n^1.5. Without a spread the term of single samples is 0. Exact in these numbers.
        assert_eq!(samples_of_pixel.variance(), 0.25 * 400.0 / 512.0);
        let without_edge = PixelSamples { root_fourth_moment: 0.0, ..samples_of_pixel };
        assert_eq!(without_edge.variance(), 0.0);
        assert!(PixelSamples { missed_variance_n3: 64.0, ..without_edge }.variance() > 0.0);
    }

    #[test]
    fn a_lamp_that_one_sample_met_leaves_its_square_over_theirs() {
        let mut tried = 0;
        for lit in [1, 2, 32, 512] {
            for from in [0, 500] {
                let mut samples_of_pixel = PixelSamples { samples: 1_024, ..PixelSamples::default() };
                let mut moments = Moments::default();
                for start in (0..1_024).step_by(LANES) {
                    let of =
                        |lane: usize| if (from..from + lit).contains(&(start + lane)) { 1_024_100.0 } else { 100.0 };
                    moments.add(&Floats(std::array::from_fn(of)), LANES);
                }
                samples_of_pixel.set_moments(moments);
                // A part p = k / n: fourth moments c^4 r (1 - 3 r) of a spread of c^2 r, r = p (1 - p). For one sample 0.75 c^2 / n^2.
                let p = crate::num::f64_from_usize(lit) / 1_024.0;
                let r = p * (1.0 - p);
                let (c2, fourth) = (1_024_000.0 * 1_024_000.0, 1.0 - 3.0 * r);
                let law = c2 * (0.25 * (r * fourth).sqrt() / 32_768.0 + 0.5 * fourth / 1_048_576.0);
                // Sums of 1,024 moments in 53 bits, of which at most 1,024 times themselves cancel: 1e-10; floats 1e-7.
                let variance = f64::from(samples_of_pixel.variance());
                assert!((variance / law - 1.0).abs() < 1e-6, "{lit}: {variance} for {law}");
                tried += 1;
            }
        }
        assert_eq!(tried, 8);
    }
}
