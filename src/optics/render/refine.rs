//! One pixel at a time, in packets of sixteen of its samples. Enters: a pixel's samples so far and when to stop. Leaves: more of
//! them, and about the variance of their mean.
//!
//! A pixel's samples are those of one scrambled net over the points of the surface that it passes (`shear`), doubled until they are
//! enough: each doubling keeps what is there. The variance at an edge in two dimensions falls as 1 / n^1.5, and as 1 / n^2 where
//! the edge is upright or level, as most of the strong ones are. Cells that are cut where neighbours differ resolve a slanting edge
//! better, and were tried: they break the net, so that upright edges and thin lines came out worse, and what no sample met was
//! never cut.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::filter::Shares;
use super::halves::LEFT_TYPICAL;
use super::outlines::Outlines;
use super::pattern::{scrambled, sobol_reversed, unit};
use super::rows::{COLUMNS, ROWS};
use super::shear::sheared;
use super::shot::{Aim, Pixels, View, bilinear};
use super::spend::{may_count, ratio};
use super::whole::Whole;
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, f32_nearest, greater, index, low_u32, u32_from, u32_truncated_f32};
use crate::optics::motion::{Parabolas, Timeline};
use crate::scene::lanes::{Floats, LANES, Vectors, sub3};
use crate::scene::light::Bands;
use crate::scene::tracer::Stack;
use crate::simd::{Kernel, dispatch};

/// Strata of time that the level of flickering lamps is known for.
pub const STRATA: usize = 16;

/// Samples that a pixel of its own begins with: one in each of 4 by 4 cells.
pub const FIRST: u32 = 16;

/// When a pixel has enough.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// Samples at most.
    pub samples: u32,
    /// It stops when its variance over its photons and samples is below this; none: it never does.
    pub least_gain: Option<f32>,
    /// Brighter pixels show no noise.
    pub saturation_photons: f32,
    /// Share of the pixel's width that each sample stands for, where it is known beforehand; else that of the samples so far.
    pub share: Option<f32>,
    /// Variance over photons from which on outlines are looked for; none: never.
    pub outlines_from: Option<f32>,
}

impl Rule {
    fn is_enough(&self, net: &Net) -> bool {
        let Some(least) = self.least_gain else { return false };
        let variance = net.variance();
        let counts = may_count(net.photons, variance, self.saturation_photons);
        !counts || ratio(net.photons, variance) < least * f32_from_u32(net.samples)
    }
}

/// What a pixel's own samples say.
#[derive(Clone, Copy, Debug)]
pub struct Net {
    /// Mean photons.
    pub photons: f32,
    /// Samples.
    pub samples: u32,
    /// Of its samples, for what follows.
    powers: Powers,
    /// Variance of its samples about their mean.
    pub spread: f32,
    /// Root of the fourth power's mean about it: the spread of an edge that halves the pixel, and more the smaller a part differs.
    pub tail: f32,
    /// About the variance that the last doubling took away, from this one and those before.
    pub taken: f32,
    /// What one sample may miss of the pixel, as a variance: it falls as the cube of the samples.
    pub hidden: f32,
    /// Rays beside the samples.
    pub extra: u32,
    /// Square of what the sample that is farthest from their mean differs from it by, where outlines may be looked for.
    pub contrast2: f32,
    /// Whether what they leave was worth asking for outlines.
    pub is_asked: bool,
}

/// An edge of contrast c leaves c^2 / 600 (slanting) to c^2 / 1,600 (upright) after sixteen samples, of samples whose spread is c^2 /
/// 6 in the mean over where it lies: 0.64 to 0.24 of the spread over n^1.5.
///
/// A part p of the pixel that differs by c has a rim of some 4 sqrt(p n) of the n cells, each of which leaves some c^2 / n^2, so that
/// c^2 sqrt(p) / n^1.5 is left where samples resolve it, and c^2 p / n where few or none meet it, which is the same at one. A spread of
/// c^2 p says too little of it by sqrt(p): a lamp in a chrome tap that one sample of a thousand met left thirty times what was claimed.
/// The fourth power's mean is c^4 p, and its root over n^1.5 is that law.
const LEFT_OF_TAIL: f32 = 0.5;
/// What may lie beside the samples that met a part (Jeffreys' prior of a rate).
const OF_ONE: f32 = 0.5;

/// What the doublings before the last one count for, as far as they reach: half, falling as 1 / n^1.5.
const OF_BEFORE: f32 = 0.5 * 0.353_553_4;

impl Net {
    /// Before any sample, with what one may miss.
    pub const fn new(hidden: f32) -> Self {
        let (contrast2, is_asked) = (0.0, false);
        Self {
            photons: 0.0,
            samples: 0,
            powers: Powers::NONE,
            spread: 0.0,
            tail: 0.0,
            taken: 0.0,
            hidden,
            extra: 0,
            contrast2,
            is_asked,
        }
    }

    /// Takes what its samples sum to.
    fn hear(&mut self, powers: Powers) {
        let [spread, tail] = powers.spread_and_tail();
        (self.powers, self.spread, self.tail) = (powers, f32_nearest(spread), f32_nearest(tail));
    }

    /// Square of what the part that differs most differs by: the mean fourth power over the mean square.
    pub fn tail_contrast2(&self) -> f32 {
        let contrast = if self.spread > 0.0 { self.tail / self.spread.sqrt() } else { 0.0 };
        contrast * contrast
    }

    /// About the variance of the mean. Halves of a net agree in the number of samples on either side of an edge more often than not,
    /// and then say nothing: so they are half of the judgement, with the halves before them, and what the tail of the samples
    /// leaves of an edge is the other half. What k samples met may as well be worth k + 1/2, another c^2 / 2 n^2 (the variance of a
    /// rate of which k were counted). What none of the samples met comes on top: slits of the sky are tens of times as bright as what is
    /// beside them, and a thirtieth of a pixel of it is more than all photon noise.
    pub fn variance(&self) -> f32 {
        let n = f32_from_u32(self.samples.max(1));
        let resolved = LEFT_OF_TAIL * self.tail / (n * n.sqrt());
        0.5 * (resolved + LEFT_TYPICAL * self.taken)
            + OF_ONE * self.tail_contrast2() / (n * n)
            + self.hidden / (n * n * n)
    }
}

/// Sums of the first four powers of samples about the first of them.
#[derive(Clone, Copy, Debug)]
struct Powers {
    count: f64,
    about: f64,
    sums: [f64; 4],
}

impl Powers {
    const NONE: Self = Self { count: 0.0, about: 0.0, sums: [0.0; 4] };

    fn add(&mut self, photons: f32) {
        let photons = f64::from(photons);
        self.about = if self.count > 0.0 { self.about } else { photons };
        self.count += 1.0;
        let mut power = 1.0;
        for sum in &mut self.sums {
            power *= photons - self.about;
            *sum += power;
        }
    }

    /// The mean square and the root of the mean fourth power of what the samples differ from their mean by.
    fn spread_and_tail(&self) -> [f64; 2] {
        let [mean, second, third, fourth] = self.sums.map(|sum| sum / self.count);
        let mean2 = mean * mean;
        let about_mean = fourth - 4.0 * mean * third + 6.0 * mean2 * second - 3.0 * mean2 * mean2;
        [greater(second - mean2, 0.0), greater(about_mean, 0.0).sqrt()]
    }
}

/// What samples of one pixel share.
pub struct Pixel<'a> {
    /// What is seen, by what.
    pub view: View<'a>,
    /// How the camera moves over the exposure of the row and its neighbours.
    pub timeline: &'a Timeline,
    /// Level of the flickering lamps in each stratum of the row's exposure.
    pub lamp_levels: &'a [f32; STRATA],
    /// Photons of each band per lux-equivalent behind the filter.
    pub photons_per_lux: Bands,
    /// Column and row.
    pub at: [usize; 2],
    /// Names its samples.
    pub key: DrawKey,
}

/// Room for working on pixels, one after the other.
pub struct Desk {
    pub stack: Stack,
    pub outlines: Outlines,
}

impl Desk {
    /// Empty.
    pub fn new() -> Self {
        Self { stack: Stack::new(), outlines: Outlines::default() }
    }
}

impl Pixel<'_> {
    /// Doubles a pixel's samples until a rule has enough. `nearest_m` is the distance of the surface that its edges belong to.
    pub fn grow(&self, net: &mut Net, nearest_m: f32, rule: &Rule, desk: &mut Desk) {
        let pixels = self.pixels();
        let velocity_px = self.velocity_px(&pixels, nearest_m);
        if let (Some(share), Some(least)) = (rule.share, rule.outlines_from) {
            return self.whole(net, &pixels, &Whole { velocity_px, samples: rule.samples, share, least }, desk);
        }
        if net.samples == 0 {
            let share = rule.share.unwrap_or(share(FIRST));
            self.begin(net, &pixels, velocity_px, share, desk);
        }
        while net.samples < rule.samples && !rule.is_enough(net) {
            let more = net.samples.min(rule.samples - net.samples);
            let block = Block {
                velocity_px,
                first: net.samples,
                count: more,
                share: rule.share.unwrap_or(share(net.samples + more)),
                is_sheared: true,
            };
            let mut powers = net.powers;
            let mean = f32_nearest(self.trace(&pixels, &block, desk, &mut |_, photons| powers.add(photons)));
            let apart = mean - net.photons;
            let weight = f32_from_u32(more) / f32_from_u32(net.samples + more);
            net.samples += more;
            net.taken = 0.5 * weight * (1.0 - weight) * apart * apart + OF_BEFORE * net.taken;
            net.photons += apart * weight;
            net.hear(powers);
        }
    }

    fn begin(&self, net: &mut Net, pixels: &Pixels, velocity_px: [f32; 2], share: f32, desk: &mut Desk) {
        let mut halves = [0.0_f32; 2];
        let mut powers = Powers::NONE;
        let block = Block { velocity_px, first: 0, count: FIRST, share, is_sheared: true };
        let mean = self.trace(pixels, &block, desk, &mut |number, photons| {
            halves[index(2 * number / FIRST)] += photons * (2.0 / f32_from_u32(FIRST));
            powers.add(photons);
        });
        let apart = halves[1] - halves[0];
        (net.photons, net.samples, net.taken) = (f32_nearest(mean), FIRST, 0.25 * apart * apart);
        net.hear(powers);
    }

    /// Mean photons of even samples, as those of a tile but with a pattern of their own.
    pub fn even_mean(&self, count: u32, desk: &mut Desk) -> f32 {
        let block = Block { velocity_px: [0.0; 2], first: 0, count, share: share(count), is_sheared: false };
        f32_nearest(self.trace(&self.pixels(), &block, desk, &mut |_, _| ()))
    }

    /// Three even numbers of a sample.
    fn even(&self, number: u32) -> [f32; 3] {
        let seeds = self.seeds();
        [0, 1, 2].map(|axis| unit(scrambled(sobol_reversed(axis, number), seeds[axis])))
    }

    fn seeds(&self) -> [u32; 3] {
        [self.key.0, self.key.0 >> 32, mix(self.key.0)].map(low_u32)
    }

    fn pixels(&self) -> Pixels {
        let mut pixels = Pixels::NONE;
        for lane in 0..LANES {
            pixels.set(lane, self.view.camera, self.at, &self.photons_per_lux);
        }
        pixels.facet_seeds = [low_u32(mix(self.key.0) >> 32); LANES];
        pixels
    }

    /// How far the pixel goes over a surface at a distance, in its own widths and heights over the exposure, about its middle.
    fn velocity_px(&self, pixels: &Pixels, distance_m: f32) -> [f32; 2] {
        if self.timeline.is_still || pixels.seen.1 == 0 {
            return [0.0; 2];
        }
        // Beyond any scene; what is infinitely far goes with the turn alone.
        let distance_m = if distance_m < 1e6 { distance_m } else { 1e6 };
        let (zero, half) = (Floats::splat(0.0), Floats::splat(0.5));
        let pieces = self.timeline.pieces.len();
        let motion = &self.timeline.pieces[pieces / 2];
        let (pose, change) = (motion.at(zero), motion.change_at(zero, f32_from_u32(u32_from(pieces))));
        let bearing = bilinear(&pixels.corners, half, half);
        let lane = self.at[1] % ROWS * COLUMNS;
        let of = |vectors: Vectors| vectors.map(|axis| axis.0[lane]);
        let direction = of(pose.turned(bearing));
        let right = across(of(pose.turned(sub3(pixels.corners[1], pixels.corners[0]))), direction);
        let down = across(of(pose.turned(sub3(pixels.corners[2], pixels.corners[0]))), direction);
        let (turn, place) = (of(change.turned(bearing)), of(change.place_m()));
        let travel = across([0, 1, 2].map(|axis| turn[axis] + place[axis] / distance_m), direction);
        let (rr, rd, dd) = (dot(right, right), dot(right, down), dot(down, down));
        let (tr, td) = (dot(travel, right), dot(travel, down));
        let determinant = rr * dd - rd * rd;
        if !(determinant > 0.0) {
            return [0.0; 2];
        }
        [(tr * dd - td * rd) / determinant, (td * rr - tr * rd) / determinant]
    }

    /// Mean photons of a block of samples, each of which is told.
    fn trace(&self, pixels: &Pixels, block: &Block, desk: &mut Desk, tell: &mut dyn FnMut(u32, f32)) -> f64 {
        let shares =
            if block.is_sheared { Shares::over_motion(block.share) } else { Shares::even(block.share, block.share) };
        let mut sum = 0.0;
        for from in (0..block.count).step_by(LANES) {
            let lanes = LANES.min(index(block.count - from));
            let numbers = std::array::from_fn(|lane| block.first + from + u32_from(lane));
            let places = self.places(block.velocity_px, &numbers, lanes);
            let [photons, _] = self.shoot(pixels, places, lanes, &shares, desk);
            for lane in 0..lanes {
                sum += f64::from(photons.0[lane]);
                tell(numbers[lane], photons.0[lane]);
            }
        }
        sum / f64::from(block.count)
    }

    /// Photons of a packet's samples, and how far each went.
    pub fn shoot(
        &self,
        pixels: &Pixels,
        places: Places,
        lanes: usize,
        shares: &Shares,
        desk: &mut Desk,
    ) -> [Floats; 2] {
        let has_gloss = self.view.reflections > 0 && self.view.scene.has_gloss(self.view.follows_gloss);
        let mut shots = Shots { pixel: self, pixels: *pixels, places, shares, has_gloss, stack: &mut desk.stack };
        shots.pixels.seen.1 = pixels.seen.1.min(lanes);
        for lane in lanes..LANES {
            shots.pixels.t_max.0[lane] = -1.0;
        }
        dispatch(shots)
    }

    /// Where and when samples of some numbers lie.
    pub fn places(&self, velocity_px: [f32; 2], numbers: &[u32; LANES], lanes: usize) -> Places {
        let mut places = [[0.0; 3]; LANES];
        for lane in 0..lanes {
            places[lane] = sheared(self.even(numbers[lane]), velocity_px);
        }
        self.placed(&places, numbers, lanes)
    }

    /// Samples at places and instants.
    pub fn placed(&self, at: &[[f32; 3]; LANES], numbers: &[u32; LANES], lanes: usize) -> Places {
        let pieces = f32_from_u32(u32_from(self.timeline.pieces.len()));
        let mut places = Places {
            place: [Floats::splat(0.0); 3],
            motion: None,
            share: Floats::splat(0.0),
            lamp_levels: [1.0; LANES],
            numbers: *numbers,
        };
        let mut piece_of = [0; LANES];
        for lane in 0..lanes {
            let place = at[lane];
            for axis in 0..3 {
                places.place[axis].0[lane] = place[axis];
            }
            let piece = u32_truncated_f32(place[2] * pieces);
            piece_of[lane] = index(piece);
            places.share.0[lane] = place[2] * pieces - f32_from_u32(piece);
            places.lamp_levels[lane] = self.lamp_levels[index(u32_truncated_f32(place[2] * 16.0))];
        }
        if !self.timeline.is_still {
            let lane = self.at[1] % ROWS * COLUMNS;
            places.motion = Some(self.timeline.gathered(lane, &piece_of));
        }
        places
    }
}

/// Samples that follow one another.
struct Block {
    velocity_px: [f32; 2],
    first: u32,
    count: u32,
    /// Of the pixel's width, and of the motion, that each stands for.
    share: f32,
    /// Whether they lie evenly over the surface that the pixel passes.
    is_sheared: bool,
}

/// The share of the width that each of so many samples stands for.
pub fn share(samples: u32) -> f32 {
    1.0 / f32_from_u32(samples).sqrt()
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The part of a vector across a direction of about unit length.
fn across(vector: [f32; 3], direction: [f32; 3]) -> [f32; 3] {
    let along = dot(vector, direction) / dot(direction, direction);
    [0, 1, 2].map(|axis| vector[axis] - along * direction[axis])
}

/// Where and when the samples of a packet lie.
pub struct Places {
    pub place: [Floats; 3],
    /// None where nothing moves.
    motion: Option<Parabolas>,
    pub share: Floats,
    lamp_levels: [f32; LANES],
    numbers: [u32; LANES],
}

impl Places {
    #[inline(always)]
    pub fn motion<'a>(&'a self, timeline: &'a Timeline) -> &'a Parabolas {
        match &self.motion {
            Some(motion) => motion,
            None => &timeline.pieces[0],
        }
    }

    /// The samples, each of which stands for some shares.
    #[inline(always)]
    pub fn aim<'a>(&'a self, timeline: &'a Timeline, shares: &'a Shares) -> Aim<'a> {
        let pieces = f32_from_u32(u32_from(timeline.pieces.len()));
        Aim {
            place: self.place,
            motion: self.motion(timeline),
            share: self.share,
            pieces: if timeline.is_still { 0.0 } else { pieces },
            lamp_levels: &self.lamp_levels,
            shares,
            numbers: &self.numbers,
        }
    }
}

/// A packet of samples of one pixel.
struct Shots<'a> {
    pixel: &'a Pixel<'a>,
    pixels: Pixels,
    places: Places,
    shares: &'a Shares,
    has_gloss: bool,
    stack: &'a mut Stack,
}

impl Kernel for Shots<'_> {
    type Output = [Floats; 2];

    #[inline(always)]
    fn run(self) -> [Floats; 2] {
        let aim = self.places.aim(self.pixel.timeline, self.shares);
        self.pixel.view.sample(&self.pixels, &aim, self.has_gloss, self.stack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_that_agree_do_not_make_a_pixel_with_an_edge_exact() {
        let net = Net { photons: 20.0, samples: 64, tail: 400.0, ..Net::new(0.0) };
        // A quarter of the tail / n^1.5, and no spread to tell one sample's worth; exact in these numbers.
        assert_eq!(net.variance(), 0.25 * 400.0 / 512.0);
        let even = Net { tail: 0.0, ..net };
        assert_eq!(even.variance(), 0.0);
        assert!(Net { hidden: 64.0, ..even }.variance() > 0.0);
    }

    #[test]
    fn a_lamp_that_one_sample_met_leaves_its_square_over_theirs() {
        let mut tried = 0;
        for lit in [1, 2, 32, 512] {
            for from in [0, 500] {
                let mut net = Net { samples: 1_024, ..Net::new(0.0) };
                let mut powers = Powers::NONE;
                for number in 0..1_024 {
                    powers.add(if (from..from + lit).contains(&number) { 1_024_100.0 } else { 100.0 });
                }
                net.hear(powers);
                // A part p = k / n: fourth powers c^4 r (1 - 3 r) of a spread of c^2 r, r = p (1 - p). For one sample 0.75 c^2 / n^2.
                let p = f64::from(lit) / 1_024.0;
                let r = p * (1.0 - p);
                let (c2, fourth) = (1_024_000.0 * 1_024_000.0, 1.0 - 3.0 * r);
                let law = c2 * (0.25 * (r * fourth).sqrt() / 32_768.0 + 0.5 * fourth / 1_048_576.0);
                // Sums of 1,024 powers in 53 bits, of which at most 1,024 times themselves cancel: 1e-10; floats 1e-7.
                assert!((f64::from(net.variance()) / law - 1.0).abs() < 1e-6, "{lit}: {} for {law}", net.variance());
                tried += 1;
            }
        }
        assert_eq!(tried, 8);
    }
}
