//! What even samples tell of their own error. Enters: a pixel's samples in their order. Leaves: their mean, how far its halves are
//! apart, and the error of a whole picture of the same number of samples for each pixel.
//!
//! Two blocks of n samples, A and B, are alike and together are the 2n samples of a finer net, so exactly var(n) - var(2n) = E(A -
//! B)^2 / 4: what halves differ by is the variance that doubling took away. Doubling multiplies the variance by some r (1/2 for
//! random samples, 0.35 to 0.4 at edges, less for what is smooth), so what is left after it is r / (1 - r) of that. The render
//! takes r from its own pixels: what halves differ by over what quarters do.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use crate::num::{f32_from_u32, f64_from_usize, index};
use crate::scene::lanes::Floats;

/// The factor r where a render has too few samples to see it: that of edges in two dimensions and time.
const FALL_TYPICAL: f64 = 0.4;
/// Bounds of what a render may find: no set of samples is worse than random ones, and a hundredth says all.
const FALL_BOUNDS: [f64; 2] = [0.05, 0.5];
/// What is left of the variance over what the last doubling took away, where r is typical.
pub const LEFT_TYPICAL: f32 = 0.4 / 0.6;

/// What a pixel's even samples say.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Mean photons.
    pub photons: f32,
    /// Variance that the last doubling took away, photons^2.
    pub taken: f32,
    /// That of the doubling before, in the mean of the halves; 0 where it is not known.
    pub taken_before: f32,
    /// Variance of its samples about their mean, as far as the parts of their means tell.
    pub spread: f32,
    /// Distance of the nearest surface in metres, `f32::MAX` where none was met.
    pub nearest_m: f32,
}

impl Seen {
    /// Before any sample.
    pub const NONE: Self = Self { photons: 0.0, taken: 0.0, taken_before: 0.0, spread: 0.0, nearest_m: f32::MAX };
}

/// Means of a pass's quarters, by lane.
pub struct Parts {
    means: [Floats; 4],
    counts: [u32; 4],
    count: u32,
}

impl Parts {
    /// Of a pass of so many samples.
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

    /// What two quarters differ by, as the variance that joining them takes away.
    #[inline(always)]
    fn apart(&self, a: usize, b: usize, lane: usize) -> f32 {
        let apart = self.means[a].0[lane] - self.means[b].0[lane];
        0.25 * apart * apart
    }

    /// What a lane's samples say.
    #[inline(always)]
    pub fn seen(&self, lane: usize, nearest_m: f32) -> Seen {
        let ((a, of_a), (b, of_b)) = (self.mean([0, 1], lane), self.mean([2, 3], lane));
        let all = of_a + of_b;
        let apart = a - b;
        let taken = apart * apart * (of_a * of_b / (all * all));
        let taken_before = 0.5 * (self.apart(0, 1, lane) + self.apart(2, 3, lane));
        // Quarters of two samples are empty.
        let spread = if self.count < 4 { taken } else { taken + taken_before };
        Seen { photons: a + apart * -(of_b / all), taken, taken_before, spread, nearest_m }
    }
}

/// Mean over pixels that are lit and below saturation of their variance over their photons, after as many samples for each.
pub fn variance_ratio(seen: &[Seen], samples: u32, saturation_photons: f32) -> f64 {
    let (mut taken, mut before, mut pixels) = (0.0, 0.0, 0);
    for pixel in seen.iter().filter(|pixel| pixel.photons > 0.0 && pixel.photons < saturation_photons) {
        taken += f64::from(pixel.taken / pixel.photons);
        before += f64::from(pixel.taken_before / pixel.photons);
        pixels += 1;
    }
    let has_before = samples >= 4 && samples.is_multiple_of(4) && before > 0.0;
    let fall = if has_before { (taken / before).clamp(FALL_BOUNDS[0], FALL_BOUNDS[1]) } else { FALL_TYPICAL };
    if pixels == 0 { 0.0 } else { taken * fall / (1.0 - fall) / f64_from_usize(pixels) }
}
