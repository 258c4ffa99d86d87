//! Statistics of the first batch: mean, variance from halves and quarters, nearest surface.
//!
//! Two blocks A and B of n samples are together the 2n samples of a finer stratification, so var(n) - var(2n) = E(A - B)^2 / 4 exactly:
//! the difference of halves is the variance that doubling removed. Doubling multiplies the variance by a factor r (1/2 for random
//! samples, 0.35 to 0.4 at edges, less for what is smooth), so r / (1 - r) of that remains. A render of a fixed number of samples takes r
//! from its pixels: the difference of halves over that of quarters.

use crate::num::{f32_from_u32, f64_from_usize, index};
use crate::scene::lanes::Floats;

/// The factor r where there are too few samples to measure it: that of edges in two dimensions and time.
const FALL_TYPICAL: f64 = 0.4;
/// Clamps the measured factor r: no stratification is worse than random samples.
const FALL_BOUNDS: [f64; 2] = [0.05, 0.5];
/// Remaining variance over the variance that the last doubling removed, for a typical r.
pub const LEFT_TYPICAL: f32 = 0.4 / 0.6;

/// What the first batch of a pixel found.
#[derive(Clone, Copy, Debug)]
pub struct FirstBatch {
    pub photons: f32,
    /// Variance that the last doubling removed, photons^2.
    pub removed_variance: f32,
    /// The same for the doubling before, mean of both halves; 0 where there are no quarters.
    pub removed_variance_before: f32,
    /// Variance of the samples about their mean, as far as quarters show it.
    pub spread: f32,
    pub nearest: Nearest,
}

/// The nearest surface that samples met.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// `f32::MAX` where none was met.
    pub distance_m: f32,
    /// Number of the moving object from 1; 0 for the static scene.
    pub object: u32,
}

impl Nearest {
    /// None.
    pub const NONE: Self = Self { distance_m: f32::MAX, object: 0 };

    /// The nearer of two; the first where they are as near.
    #[inline(always)]
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        if other.distance_m < self.distance_m { other } else { self }
    }
}

impl FirstBatch {
    /// Before any sample.
    pub const NONE: Self =
        Self { photons: 0.0, removed_variance: 0.0, removed_variance_before: 0.0, spread: 0.0, nearest: Nearest::NONE };
}

/// Means of the quarters of a batch, by lane.
pub struct Quarters {
    means: [Floats; 4],
    counts: [u32; 4],
    count: u32,
}

impl Quarters {
    /// For a batch of `count` samples.
    #[inline(always)]
    pub fn new(count: u32) -> Self {
        Self { means: [Floats::splat(0.0); 4], counts: [0; 4], count }
    }

    /// Adds a sample.
    #[inline(always)]
    pub fn add(&mut self, number: u32, photons: Floats) {
        let quarter = index(4 * number / self.count);
        self.counts[quarter] += 1;
        let share = Floats::splat(1.0 / f32_from_u32(self.counts[quarter]));
        self.means[quarter] = self.means[quarter] + (photons - self.means[quarter]) * share;
    }

    /// Mean and count of neighbouring quarters of a lane.
    #[inline(always)]
    fn mean(&self, quarters: [usize; 2], lane: usize) -> (f32, f32) {
        let counts = quarters.map(|quarter| f32_from_u32(self.counts[quarter]));
        let all = counts[0] + counts[1];
        let [a, b] = quarters.map(|quarter| self.means[quarter].0[lane]);
        if all > 0.0 { (a + (b - a) * (counts[1] / all), all) } else { (0.0, 0.0) }
    }

    /// Variance that joining two quarters removes.
    #[inline(always)]
    fn join_gain(&self, a: usize, b: usize, lane: usize) -> f32 {
        let difference = self.means[a].0[lane] - self.means[b].0[lane];
        0.25 * difference * difference
    }

    /// Statistics of one lane.
    #[inline(always)]
    pub fn of_lane(&self, lane: usize, nearest: Nearest) -> FirstBatch {
        let ((a, of_a), (b, of_b)) = (self.mean([0, 1], lane), self.mean([2, 3], lane));
        let all = of_a + of_b;
        let difference = a - b;
        let removed_variance = difference * difference * (of_a * of_b / (all * all));
        let removed_variance_before = 0.5 * (self.join_gain(0, 1, lane) + self.join_gain(2, 3, lane));
        // Quarters of two samples are empty.
        let spread = if self.count < 4 { removed_variance } else { removed_variance + removed_variance_before };
        let photons = a + difference * -(of_b / all);
        FirstBatch { photons, removed_variance, removed_variance_before, spread, nearest }
    }
}

/// Mean over pixels that are lit and below saturation of their variance over their photons, after as many samples for each.
pub fn variance_ratio(first_batches: &[FirstBatch], samples: u32, saturation_photons: f32) -> f64 {
    let (mut removed_sum, mut before_sum, mut pixels) = (0.0, 0.0, 0);
    for pixel in first_batches.iter().filter(|pixel| pixel.photons > 0.0 && pixel.photons < saturation_photons) {
        removed_sum += f64::from(pixel.removed_variance / pixel.photons);
        before_sum += f64::from(pixel.removed_variance_before / pixel.photons);
        pixels += 1;
    }
    let has_before = samples >= 4 && samples.is_multiple_of(4) && before_sum > 0.0;
    let fall = if has_before { (removed_sum / before_sum).clamp(FALL_BOUNDS[0], FALL_BOUNDS[1]) } else { FALL_TYPICAL };
    if pixels == 0 { 0.0 } else { removed_sum * fall / (1.0 - fall) / f64_from_usize(pixels) }
}
