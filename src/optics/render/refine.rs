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
use super::glints::Glint;
use super::net::{Net, OF_BEFORE, Powers};
use super::pattern::{points, scrambled, sobol_reversed, unit};
use super::rows::{COLUMNS, ROWS};
use super::shear::{moved_lanes, sheared_lanes};
use super::shot::{Aim, Pixels, View};
use super::spend::{may_count, ratio};
use super::strata::Parting;
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, f32_nearest, index, low_u32, u32_from, u32_truncated_f32};
use crate::optics::motion::{Parabolas, Timeline};
use crate::scene::lanes::{Floats, LANES};
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
}

impl Rule {
    fn is_enough(&self, net: &Net) -> bool {
        let Some(least) = self.least_gain else { return false };
        let variance = net.variance();
        let counts = may_count(net.photons, variance, self.saturation_photons);
        !counts || ratio(net.photons, variance) < least * f32_from_u32(net.samples)
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
    /// Parts of its exposure that have samples of their own.
    pub glints: &'a [Glint],
    /// Names its samples.
    pub key: DrawKey,
}

impl Pixel<'_> {
    /// Doubles a pixel's samples until a rule has enough. `nearest_m` is the distance of the surface that its edges belong to.
    pub fn grow(&self, net: &mut Net, nearest_m: f32, rule: &Rule, stack: &mut Stack) {
        let pixels = self.pixels();
        let velocity_px = self.velocity_px(&pixels, nearest_m);
        if net.samples == 0 {
            let share = rule.share.unwrap_or(share(FIRST));
            self.begin(net, &pixels, velocity_px, share, stack);
        }
        while net.samples < rule.samples && !rule.is_enough(net) {
            let more = net.samples.min(rule.samples - net.samples);
            let block = Block {
                velocity_px,
                first: net.samples,
                count: more,
                share: rule.share.unwrap_or(share(more)),
                is_sheared: true,
            };
            let mut powers = net.powers;
            let mean = f32_nearest(self.trace(&pixels, &block, stack, &mut |_, photons| powers.add(photons)));
            let apart = mean - net.photons;
            let weight = f32_from_u32(more) / f32_from_u32(net.samples + more);
            net.samples += more;
            net.extra += self.beside(more);
            net.taken = 0.5 * weight * (1.0 - weight) * apart * apart + OF_BEFORE * net.taken;
            net.photons += apart * weight;
            net.set_powers(powers);
        }
    }

    fn begin(&self, net: &mut Net, pixels: &Pixels, velocity_px: [f32; 2], share: f32, stack: &mut Stack) {
        let mut halves = [0.0_f32; 2];
        let mut powers = Powers::NONE;
        let block = Block { velocity_px, first: 0, count: FIRST, share, is_sheared: true };
        let mean = self.trace(pixels, &block, stack, &mut |number, photons| {
            halves[index(2 * number / FIRST)] += photons * (2.0 / f32_from_u32(FIRST));
            powers.add(photons);
        });
        let apart = halves[1] - halves[0];
        (net.photons, net.samples, net.taken) = (f32_nearest(mean), FIRST, 0.25 * apart * apart);
        net.extra += self.beside(FIRST);
        net.set_powers(powers);
    }

    /// Mean photons of even samples, as those of a tile but with a pattern of their own.
    pub fn even_mean(&self, count: u32, stack: &mut Stack) -> f32 {
        let block = Block { velocity_px: [0.0; 2], first: 0, count, share: share(count), is_sheared: false };
        f32_nearest(self.trace(&self.pixels(), &block, stack, &mut |_, _| ()))
    }

    /// Rays beside so many samples.
    pub fn beside(&self, samples: u32) -> u32 {
        samples * u32_from(self.glints.len())
    }

    pub fn pixels(&self) -> Pixels {
        let mut pixels = Pixels::of_one(self.view.camera, self.at, &self.photons_per_lux, LANES);
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
        let lane = self.at[1] % ROWS * COLUMNS;
        let (pose, change) = (self.timeline.turn_at(lane, 0.5), self.timeline.change_at(lane, 0.5));
        let corner = |number: usize| pixels.corners[number].each_ref().map(|axis| axis.0[0]);
        let [first, right, down, last] = [corner(0), corner(1), corner(2), corner(3)];
        let bearing = [0, 1, 2].map(|axis| 0.25 * (first[axis] + right[axis] + down[axis] + last[axis]));
        let to = |corner: [f32; 3]| pose.turned([0, 1, 2].map(|axis| corner[axis] - first[axis]));
        let direction = pose.turned(bearing);
        let (right, down) = (across(to(right), direction), across(to(down), direction));
        let (turn, place) = (change.turned(bearing), change.place_m());
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
    fn trace(&self, pixels: &Pixels, block: &Block, stack: &mut Stack, tell: &mut dyn FnMut(u32, f32)) -> f64 {
        let shares =
            if block.is_sheared { Shares::over_motion(block.share) } else { Shares::even(block.share, block.share) };
        let is_moved = block.is_sheared && self.view.scene.has_textures();
        let mut sum = 0.0;
        for from in (0..block.count).step_by(LANES) {
            let lanes = LANES.min(index(block.count - from));
            let numbers = std::array::from_fn(|lane| block.first + from + u32_from(lane));
            let short = (lanes < LANES).then(|| pixels.shortened(lanes));
            let pixels = short.as_ref().unwrap_or(pixels);
            let (mut photons, at) = dispatch(Samples {
                pixel: self,
                pixels,
                numbers: &numbers,
                velocity_px: block.velocity_px,
                moved_among: is_moved.then_some(block.count),
                shares: &shares,
                has_gloss: self.has_gloss(),
                stack,
            });
            if !self.glints.is_empty() {
                let parting = Parting { pixels, shares: &shares, numbers: &numbers, lanes };
                self.part(&parting, &lanes_of(&at), &mut photons, stack);
            }
            for lane in 0..lanes {
                sum += f64::from(photons.0[lane]);
                tell(numbers[lane], photons.0[lane]);
            }
        }
        sum / f64::from(block.count)
    }

    fn has_gloss(&self) -> bool {
        self.view.reflections > 0 && self.view.scene.has_gloss(self.view.follows_gloss)
    }

    /// Photons of a packet's samples, and how far each went.
    pub fn shoot(
        &self,
        pixels: &Pixels,
        places: Places,
        lanes: usize,
        shares: &Shares,
        stack: &mut Stack,
    ) -> [Floats; 2] {
        let has_gloss = self.has_gloss();
        let mut shots = Shots { pixel: self, pixels: *pixels, places, shares, has_gloss, stack };
        shots.pixels.seen.1 = pixels.seen.1.min(lanes);
        for lane in lanes..LANES {
            shots.pixels.t_max.0[lane] = -1.0;
        }
        dispatch(shots)
    }

    /// Samples at places and instants.
    pub fn placed(&self, at: &[[f32; 3]; LANES], numbers: &[u32; LANES], lanes: usize) -> Places {
        let place =
            [0, 1, 2].map(|axis| Floats(std::array::from_fn(|lane| if lane < lanes { at[lane][axis] } else { 0.0 })));
        self.placed_lanes(place, numbers)
    }

    /// The same, side by side.
    #[inline(always)]
    fn placed_lanes(&self, place: [Floats; 3], numbers: &[u32; LANES]) -> Places {
        let mut places =
            Places { place, motion: None, share: place[2], moves: None, lamp_levels: [1.0; LANES], numbers: *numbers };
        if !self.view.scene.is_steady() {
            for lane in 0..LANES {
                places.lamp_levels[lane] = self.lamp_levels[index(u32_truncated_f32(place[2].0[lane] * 16.0))];
            }
        }
        let mut piece_of = [0; LANES];
        if self.timeline.pieces.len() > 1 {
            let pieces = f32_from_u32(u32_from(self.timeline.pieces.len()));
            for lane in 0..LANES {
                let time = place[2].0[lane] * pieces;
                let piece = u32_truncated_f32(time);
                piece_of[lane] = index(piece);
                places.share.0[lane] = time - f32_from_u32(piece);
            }
        }
        if !self.timeline.is_still {
            places.motion = Some(self.timeline.gathered(self.at[1] % ROWS * COLUMNS, &piece_of));
        }
        places
    }
}

/// Places by lane.
fn lanes_of(places: &[Floats; 3]) -> [[f32; 3]; LANES] {
    std::array::from_fn(|lane| places.each_ref().map(|axis| axis.0[lane]))
}

/// Seeds of x, y and t.
fn seeds(key: DrawKey) -> [u32; 3] {
    [key.0, key.0 >> 32, mix(key.0)].map(low_u32)
}

/// Draws and takes a packet of samples of one pixel.
struct Samples<'a> {
    pixel: &'a Pixel<'a>,
    pixels: &'a Pixels,
    numbers: &'a [u32; LANES],
    velocity_px: [f32; 2],
    /// Look-ups are moved within their cells among so many; none: as shares say.
    moved_among: Option<u32>,
    shares: &'a Shares,
    has_gloss: bool,
    stack: &'a mut Stack,
}

impl Kernel for Samples<'_> {
    type Output = (Floats, [Floats; 3]);

    #[inline(always)]
    fn run(self) -> (Floats, [Floats; 3]) {
        let even = points(self.numbers, seeds(self.pixel.key));
        let at = sheared_lanes(even, self.velocity_px);
        let mut places = self.pixel.placed_lanes(at, self.numbers);
        if let Some(count) = self.moved_among {
            places.moves = Some(moved_lanes(even, self.velocity_px, count));
        }
        let aim = places.aim(self.pixel.timeline, self.shares);
        let [photons, _] = self.pixel.view.sample(self.pixels, &aim, self.has_gloss, self.stack);
        (photons, at)
    }
}

/// Samples that follow one another.
struct Block {
    velocity_px: [f32; 2],
    first: u32,
    count: u32,
    /// Of the pixel's width, and of the motion, that each stands for: a block covers all of the pixel by itself.
    share: f32,
    /// Whether they lie evenly over the surface that the pixel passes.
    is_sheared: bool,
}

/// Three even numbers of a sample of a key.
pub fn even(key: DrawKey, number: u32) -> [f32; 3] {
    let seeds = seeds(key);
    [0, 1, 2].map(|axis| unit(scrambled(sobol_reversed(axis, number), seeds[axis])))
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
    /// How far look-ups of textures are moved, where that is not for shares to say.
    moves: Option<[Floats; 2]>,
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
            moves: self.moves.as_ref(),
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
