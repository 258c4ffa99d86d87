//! How sure a tile is of its pixels. Enters: means of a pass's quarters. Leaves: means of all samples, how far halves of them are apart,
//! which tiles need more samples, and the render's own estimate of its error.
//!
//! Two blocks of n samples, A and B, are alike and together are the 2n samples of a finer net, so exactly var(n) - var(2n) = E(A - B)^2 /
//! 4: what halves differ by is the variance that doubling took away. Doubling multiplies the variance by some r (1/2 for random samples,
//! 0.35 to 0.4 at edges, less for what is smooth), so what is left after it is r / (1 - r) of that. The render takes r from its own
//! pixels: what halves differ by over what quarters do.
//!
//! A tile that stops because its halves happen to agree would also say that it has no error. So the pixels of a chequerboard's black fields
//! choose, and those of its white fields tell the error: they are as many, as noisy, and had no say.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::rows::COLUMNS;
use crate::num::{f32_from_u32, f32_nearest, f64_from_usize, index};
use crate::plane::Plane;
use crate::scene::lanes::{Floats, LANES};

/// The factor r where a render has too few samples to see it: that of edges in two dimensions and time.
const FALL_TYPICAL: f64 = 0.4;
/// Bounds of what a render may find: no set of samples is worse than random ones, and a hundredth says all.
const FALL_BOUNDS: [f64; 2] = [0.05, 0.5];

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
    pub fn add(&mut self, step: u32, photons: Floats) {
        let quarter = index(4 * step / self.count);
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
}

/// The pixels of a tile that choose whether it goes on: a chequerboard's black fields, four to a row.
const IS_BLACK: [bool; LANES] = [
    true, false, true, false, //
    false, true, false, true, //
    true, false, true, false, //
    false, true, false, true,
];

/// A square of pixels that is sampled together.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// Whether the next pass samples it.
    pub is_active: bool,
    /// Samples of each of its pixels.
    pub samples: u32,
    /// White pixels that count: lit and below saturation.
    pub pixels: u32,
    /// Sum over them of the variance that the last doubling took away, over the photons.
    pub taken: f32,
    /// The same over the black pixels that count, in the mean.
    pub chooses: f32,
    /// The same of the doubling before.
    pub taken_before: f32,
    /// Whether the doubling before is known.
    pub has_before: bool,
}

impl Tile {
    /// Before its first sample.
    pub const NEW: Self =
        Self { is_active: true, samples: 0, pixels: 0, taken: 0.0, chooses: 0.0, taken_before: 0.0, has_before: false };

    /// Takes a pass in: means of all samples, lane by lane.
    #[inline(always)]
    pub fn take(
        &mut self,
        parts: &Parts,
        before: &[f32; LANES],
        inside: &[bool; LANES],
        saturation_photons: f32,
    ) -> [f32; LANES] {
        let is_first = self.samples == 0;
        let mut means = [0.0; LANES];
        (self.pixels, self.taken, self.taken_before) = (0, 0.0, 0.0);
        let (mut black, mut chooses) = (0.0, 0.0);
        for lane in 0..LANES {
            let ((a, of_a), (b, of_b)) = (parts.mean([0, 1], lane), parts.mean([2, 3], lane));
            let all = of_a + of_b;
            let own = if all > 0.0 { a + (b - a) * (of_b / all) } else { 0.0 };
            let (mean, taken, earlier) = if is_first {
                let apart = a - b;
                let taken = apart * apart * (of_a * of_b / (all * all));
                (own, taken, 0.5 * (parts.apart(0, 1, lane) + parts.apart(2, 3, lane)))
            } else {
                // Of the doubling before, only the pass's own halves tell: the earlier samples' were seen when the pass was chosen.
                let apart = own - before[lane];
                (before[lane] + 0.5 * apart, 0.25 * apart * apart, 0.25 * (a - b) * (a - b))
            };
            means[lane] = mean;
            let counts = inside[lane] && mean > 0.0 && mean < saturation_photons;
            if counts && IS_BLACK[lane] {
                black += 1.0;
                chooses += taken / mean;
            } else if counts {
                self.pixels += 1;
                self.taken += taken / mean;
                self.taken_before += earlier / mean;
            }
        }
        self.chooses = if black > 0.0 { chooses / black } else { 0.0 };
        self.has_before = !is_first || (parts.count >= 4 && parts.count.is_multiple_of(4));
        self.samples += parts.count;
        means
    }
}

/// Variance over photons that a tile's samples may have missed, in the mean over its pixels below saturation. Between two pixels that
/// differ by d lies an edge, anywhere over the two of them. It lies in the part of one that its n samples missed, a 1 / n of it, with
/// probability 1 / 2n, and that part has then half of 1 / n, or (d / n)^2 / 3 in the mean square: d^2 / 6 n^3 in all. Where halves of
/// the samples agree because none of them met a lamp, this is what tells.
pub fn hidden(photons: &Plane<f32>, first: [usize; 2], samples: u32, saturation_photons: f32) -> f32 {
    let (width, height) = (photons.width_px(), photons.height_px());
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    for y in first[1]..(first[1] + LANES / COLUMNS).min(height) {
        for x in first[0]..(first[0] + COLUMNS).min(width) {
            let mean = photons.at(x, y);
            if !(mean > 0.0 && mean < saturation_photons) {
                continue;
            }
            let beside = [
                (x.saturating_sub(1), y),
                ((x + 1).min(width - 1), y),
                (x, y.saturating_sub(1)),
                (x, (y + 1).min(height - 1)),
            ];
            let mut most = 0.0_f32;
            for (x, y) in beside {
                let apart = photons.at(x, y) - mean;
                most = if apart * apart > most { apart * apart } else { most };
            }
            sum += most / mean;
            count += 1.0;
        }
    }
    let n = f32_from_u32(samples);
    if count > 0.0 { sum / (6.0 * n * n * n * count) } else { 0.0 }
}

/// Half of a tile's judgement is its own, the rest its eight neighbours': what luck hides from one shows in the others.
const OWN_SHARE: f32 = 0.5;

/// Says which of the tiles that were active need more samples: those whose variance, judged with their neighbours and with
/// what may be `hidden`, is above `tolerance` times photon variance. Returns how many.
pub fn choose(tiles: &mut [Tile], across: usize, tolerance: f32, hidden: &[f32]) -> usize {
    let left = f32_nearest(FALL_TYPICAL / (1.0 - FALL_TYPICAL));
    let noise: Vec<f32> = tiles.iter().map(|tile| left * tile.chooses).collect();
    let down = tiles.len() / across;
    let mut active = 0;
    for y in 0..down {
        for x in 0..across {
            let tile = &mut tiles[y * across + x];
            if !tile.is_active {
                continue;
            }
            let own = noise[y * across + x];
            let (mut around, mut count) = (0.0, 0.0);
            for row in y.saturating_sub(1)..(y + 2).min(down) {
                for column in x.saturating_sub(1)..(x + 2).min(across) {
                    around += noise[row * across + column];
                    count += 1.0;
                }
            }
            let others = if count > 1.0 { (around - own) / (count - 1.0) } else { own };
            let noise = OWN_SHARE * own + (1.0 - OWN_SHARE) * others;
            tile.is_active = noise + hidden[y * across + x] > tolerance;
            active += usize::from(tile.is_active);
        }
    }
    active
}

/// What a doubling from so many samples took away, summed over all tiles that had it.
#[derive(Clone, Copy, Debug, Default)]
struct Doubling {
    taken: f64,
    before: f64,
}

/// Watches a render's passes, to say at the end how far its pixels are off.
#[derive(Clone, Debug)]
pub struct Watch {
    /// By the logarithm of the samples after the doubling.
    doublings: [Doubling; 33],
}

impl Default for Watch {
    fn default() -> Self {
        Self { doublings: [Doubling::default(); 33] }
    }
}

fn level(samples: u32) -> usize {
    index(samples.ilog2())
}

impl Watch {
    /// Notes the tiles that a pass sampled, before it is chosen which go on: no luck is selected yet.
    pub fn note(&mut self, tiles: &[Tile]) {
        for tile in tiles.iter().filter(|tile| tile.is_active && tile.has_before) {
            let doubling = &mut self.doublings[level(tile.samples)];
            doubling.taken += f64::from(tile.taken);
            doubling.before += f64::from(tile.taken_before);
        }
    }

    /// The factor that a doubling to these samples multiplies the variance by.
    fn fall(&self, samples: u32) -> f64 {
        // The first pass may be too short to know; then the next one's factor is the nearest.
        let known = self.doublings[level(samples)..].iter().find(|doubling| doubling.before > 0.0);
        known.map_or(FALL_TYPICAL, |known| (known.taken / known.before).clamp(FALL_BOUNDS[0], FALL_BOUNDS[1]))
    }

    /// Mean over pixels that are lit and below saturation of their variance over their photons.
    pub fn variance_ratio(&self, tiles: &[Tile]) -> f64 {
        let (mut sum, mut pixels) = (0.0, 0);
        for tile in tiles.iter().filter(|tile| tile.samples > 0) {
            let fall = self.fall(tile.samples);
            sum += f64::from(tile.taken) * fall / (1.0 - fall);
            pixels += index(tile.pixels);
        }
        if pixels == 0 { 0.0 } else { sum / f64_from_usize(pixels) }
    }
}
