//! Even samples that ride with what they see. Enters: a block of pixels, and how the picture moves there. Leaves: samples as evenly
//! over the moving surfaces as over the pixels and the exposure, each with the way that its point goes.
//!
//! A point goes through many pixels while the shutter is open, and looks the same in all of them (but in a mirror). So a sample is worth
//! as much to each pixel on its point's way as to the one that it was taken in, if the samples of all of them together are even:
//! those of a pixel alone are, but one pixel's among another's lie as chance has it. So places are not drawn in pixels, but in blocks of
//! the picture as it stands amid the exposure: one (0, m, 2)-net a block, scrambled (`pattern`), with an instant each; and each
//! goes along with the picture to where it is at that instant. The rays of a packet, whenever they are taken, meet neighbouring
//! points. How the picture moves is known at the blocks' corners from one ray each, and even between; a wrong answer costs evenness and
//! biases nothing, because a sample stands for the area that the map gives it.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::filter::Shares;
use super::paths::Sample;
use super::pattern::{scrambled, unit};
use super::refine::share;
use super::rows::ROWS;
use super::shot::{Aim, Pixels, View};
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, index, low_u32, u32_from, u32_truncated_f32};
use crate::optics::motion::{Parabolas, Timeline};
use crate::scene::lanes::{Floats, LANES};
use crate::scene::light::BANDS;
use crate::scene::tracer::Stack;
use crate::simd::Kernel;

/// Pixels along a side of a block.
pub const SIDE: usize = 16;
/// Pixels of a block: any so many points of its net that follow one another have one in each.
pub const CELLS: usize = SIDE * SIDE;
/// Pixels and cells along a side of a packet's tile.
const TILE: usize = 4;

/// Pixels an exposure beyond which samples no longer keep up.
const SPEED_MAX_PX: f32 = 128.0;

/// What a sample at a mirror may be wrong about the way that its image goes, in pixels, squared, and be shared.
const ASTRAY_MAX_PX2: f32 = 0.01;

/// What all blocks of a picture share.
#[derive(Clone, Copy)]
pub struct Riding<'a> {
    /// What is seen, by what.
    pub view: View<'a>,
    /// How the camera moves over the exposures of each group of rows.
    pub timelines: &'a [Timeline],
    /// Level of the flickering lamps, all the time.
    pub lamp_level: f32,
    /// Samples of each pixel.
    pub count: u32,
    /// Of `count` times `CELLS` points, by axis, with their bits in reverse.
    pub sobol: &'a [[u32; 3]],
    /// Faster points, to the right and down, are not shared, so that it is known how far a sample may matter.
    pub speed_max_px: [f32; 2],
}

/// Samples of one block.
pub struct Block<'a> {
    pub riding: &'a Riding<'a>,
    /// Its upper left corner in pixels.
    pub origin_px: [f32; 2],
    /// How the picture moves at its corners, in pixels an exposure.
    pub corners: [[f32; 2]; 4],
    /// How the velocities of points change on their ways.
    pub change: Change,
    /// Names its samples.
    pub key: DrawKey,
}

/// Rays of a packet that each look through a pixel of their own.
struct Lanes {
    pixels: Pixels,
    place: [Floats; 3],
    at_px: [[f32; 2]; LANES],
    rows: [usize; LANES],
    numbers: [u32; LANES],
    areas: [f32; LANES],
}

impl Lanes {
    const NONE: Self = Self {
        pixels: Pixels::NONE,
        place: [Floats([0.5; LANES]); 3],
        at_px: [[0.0; 2]; LANES],
        rows: [0; LANES],
        numbers: [0; LANES],
        areas: [1.0; LANES],
    };

    /// Lets a lane look through a place of the picture; beyond it there is nothing.
    #[inline(always)]
    fn set(&mut self, lane: usize, view: &View, at_px: [f32; 2], t: f32) {
        let size = view.camera.size;
        let is_within = |place: f32, most: u32| place >= 0.0 && place < f32_from_u32(most);
        if !is_within(at_px[0], size.width_px) || !is_within(at_px[1], size.height_px) {
            return;
        }
        let [column, row] = at_px.map(u32_truncated_f32);
        self.pixels.set(lane, view.camera, [index(column), index(row)], &[0.0; BANDS]);
        self.at_px[lane] = at_px;
        self.place[0].0[lane] = at_px[0] - f32_from_u32(column);
        self.place[1].0[lane] = at_px[1] - f32_from_u32(row);
        self.place[2].0[lane] = t;
        self.rows[lane] = index(row);
    }
}

impl Riding<'_> {
    /// The motion over each lane's piece of time, the shares of those that are over, and how many pieces an exposure has.
    #[inline(always)]
    fn motion(&self, lanes: &Lanes) -> (Parabolas, Floats, f32) {
        let mut share = Floats::splat(0.0);
        let mut from = [(0, 0); LANES];
        let mut most = 1;
        for lane in 0..LANES {
            let t = lanes.place[2].0[lane];
            let count = self.timelines[lanes.rows[lane] / ROWS].pieces.len();
            let pieces = f32_from_u32(u32_from(count));
            let piece = u32_truncated_f32(t * pieces);
            share.0[lane] = t * pieces - f32_from_u32(piece);
            from[lane] = (lanes.rows[lane], index(piece));
            // Those that stand still have one piece, whose change is none however often.
            most = if count > most { count } else { most };
        }
        let piece_of = |lane: usize| {
            let (row, piece) = from[lane];
            (&self.timelines[row / ROWS].pieces[piece], row % ROWS * (LANES / ROWS))
        };
        (Parabolas::gathered(piece_of), share, f32_from_u32(u32_from(most)))
    }
}

impl Kernel for Block<'_> {
    type Output = Vec<Sample>;

    #[inline(always)]
    fn run(self) -> Vec<Sample> {
        let Riding { view, count, .. } = *self.riding;
        let (points, order) = points(self.riding.sobol, self.key);
        let has_gloss = view.reflections > 0 && view.scene.has_gloss(view.follows_gloss);
        let shares = Shares::riding(share(count));
        let facet_seeds = [low_u32(mix(self.key.0) >> 32); LANES];
        let mut stack = Stack::new();
        let mut samples = Vec::with_capacity(CELLS * index(count));
        for tile in 0..CELLS / LANES {
            for turn in 0..index(count) {
                let mut lanes = Lanes::NONE;
                lanes.pixels.facet_seeds = facet_seeds;
                for lane in 0..LANES {
                    let row = tile / (SIDE / TILE) * TILE + lane / TILE;
                    let cell = row * SIDE + tile % (SIDE / TILE) * TILE + lane % TILE;
                    let number = order[turn * CELLS + cell];
                    self.place(&mut lanes, lane, points[index(number)]);
                    lanes.numbers[lane] = number;
                }
                if lanes.pixels.seen.1 > 0 {
                    let is_second = 2 * u32_from(turn) >= count;
                    self.sample(&lanes, &shares, has_gloss, is_second, &mut stack, &mut samples);
                }
            }
        }
        samples
    }
}

impl Block<'_> {
    /// Lets a lane take a point of the net where it is at its instant.
    #[inline(always)]
    fn place(&self, lanes: &mut Lanes, lane: usize, point: [f32; 3]) {
        let (at_px, area) = carried(self.origin_px, &self.corners, point);
        lanes.areas[lane] = area;
        lanes.set(lane, &self.riding.view, at_px, point[2]);
    }

    /// Takes a packet's samples.
    #[inline(always)]
    fn sample(
        &self,
        lanes: &Lanes,
        shares: &Shares,
        has_gloss: bool,
        is_second: bool,
        stack: &mut Stack,
        samples: &mut Vec<Sample>,
    ) {
        let riding = self.riding;
        let (motion, share, pieces) = riding.motion(lanes);
        let aim = Aim {
            place: lanes.place,
            motion: &motion,
            share,
            pieces,
            lamp_levels: &[riding.lamp_level; LANES],
            shares,
            moves: None,
            numbers: &lanes.numbers,
        };
        let (light, astray) = riding.view.light(&lanes.pixels, &aim, has_gloss, stack);
        let velocity_px = aim.velocities_px(&lanes.pixels, light.distance_m);
        let far_px = if astray { aim.velocities_px(&lanes.pixels, Floats::splat(f32::MAX)) } else { velocity_px };
        for lane in 0..LANES {
            if !(lanes.pixels.t_max.0[lane] > 0.0) {
                continue;
            }
            let velocity = velocity_px.map(|axis| axis.0[lane]);
            let [x, y] = [0, 1].map(|axis| velocity[axis] - far_px[axis].0[lane]);
            let is_shared = velocity.iter().zip(riding.speed_max_px).all(|(speed, most)| speed.abs() <= most)
                && (x * x + y * y <= ASTRAY_MAX_PX2 || !riding.view.keeps_image(&light, lane));
            let mut lux = [0.0; BANDS];
            for band in 0..BANDS {
                lux[band] = light.lux[band].0[lane];
            }
            samples.push(Sample {
                at_px: lanes.at_px[lane],
                t: lanes.place[2].0[lane],
                velocity_px: if is_shared { velocity } else { [0.0; 2] },
                bend_px: if is_shared { self.change.bend_px(velocity) } else { [0.0; 2] },
                swell: if is_shared { self.change.swell() } else { 0.0 },
                area: lanes.areas[lane],
                distance_m: light.distance_m.0[lane],
                is_second,
                lux,
            });
        }
    }
}

/// Points of a block's net, each of the unit cube, and the number of each cell's point, `CELLS` by `CELLS`.
#[inline(always)]
fn points(sobol: &[[u32; 3]], key: DrawKey) -> (Vec<[f32; 3]>, Vec<u32>) {
    let seeds = [key.0, key.0 >> 32, mix(key.0)].map(low_u32);
    let side = f32_from_u32(u32_from(SIDE));
    let mut points = Vec::with_capacity(sobol.len());
    let mut order = vec![0; sobol.len()];
    for (number, sobol) in sobol.iter().enumerate() {
        let mut point = [0.0; 3];
        for axis in 0..3 {
            point[axis] = unit(scrambled(sobol[axis], seeds[axis]));
        }
        let [column, row] = [point[0] * side, point[1] * side].map(u32_truncated_f32);
        order[number / CELLS * CELLS + index(row) * SIDE + index(column)] = u32_from(number);
        points.push(point);
    }
    (points, order)
}

/// Where a point of a block is at its instant, in pixels, and how much its surroundings have grown by then.
#[inline(always)]
fn carried(origin_px: [f32; 2], corners: &[[f32; 2]; 4], [x, y, t]: [f32; 3]) -> ([f32; 2], f32) {
    let side = f32_from_u32(u32_from(SIDE));
    let [from, right, down, both] = corners;
    let (mut at_px, mut grown) = ([0.0; 2], [[0.0; 2]; 2]);
    let over = t - 0.5;
    for axis in 0..2 {
        let above = from[axis] + (right[axis] - from[axis]) * x;
        let below = down[axis] + (both[axis] - down[axis]) * x;
        let across = right[axis] - from[axis] + (both[axis] - down[axis] - right[axis] + from[axis]) * y;
        at_px[axis] = origin_px[axis] + [x, y][axis] * side + (above + (below - above) * y) * over;
        grown[axis] = [across, below - above].map(|change| change * over / side);
    }
    let area = (1.0 + grown[0][0]) * (1.0 + grown[1][1]) - grown[0][1] * grown[1][0];
    (at_px, area.abs())
}

/// How velocities of points change on their ways, as far as the camera's turn goes, in pixels an exposure.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Growth to the right and down, by axis, for a pixel.
    pub growth: [[f32; 2]; 2],
    /// Change at a place over the exposure.
    pub drift_px: [f32; 2],
}

impl Change {
    /// By how much a point's velocity changes over an exposure: what is farther from the axis of a turn goes faster, and turns are uneven.
    pub fn bend_px(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [0, 1].map(|axis| self.growth[axis][0] * x + self.growth[axis][1] * y + self.drift_px[axis])
    }

    /// By what share the area of a patch grows over an exposure.
    fn swell(&self) -> f32 {
        self.growth[0][0] + self.growth[1][1]
    }
}

/// How the picture moves at some places and an instant, in pixels an exposure.
pub struct Corners<'a> {
    pub riding: &'a Riding<'a>,
    pub at_px: [[f32; 2]; LANES],
    /// Share of the exposure.
    pub t: f32,
}

/// As the surface at a place does, and what is infinitely far.
#[derive(Clone, Copy, Debug)]
pub struct Velocities {
    pub near_px: [f32; 2],
    pub far_px: [f32; 2],
}

impl Kernel for Corners<'_> {
    type Output = [Option<Velocities>; LANES];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut lanes = Lanes::NONE;
        for lane in 0..LANES {
            lanes.set(lane, &self.riding.view, self.at_px[lane], self.t);
        }
        if lanes.pixels.seen.1 == 0 {
            return [None; LANES];
        }
        let (motion, share, pieces) = self.riding.motion(&lanes);
        let aim = Aim {
            place: lanes.place,
            motion: &motion,
            share,
            pieces,
            lamp_levels: &[self.riding.lamp_level; LANES],
            shares: &Shares::even(1.0, 1.0),
            moves: None,
            numbers: &lanes.numbers,
        };
        let (light, _) = self.riding.view.light(&lanes.pixels, &aim, false, &mut Stack::new());
        let near_px = aim.velocities_px(&lanes.pixels, light.distance_m);
        let far_px = aim.velocities_px(&lanes.pixels, Floats::splat(f32::MAX));
        std::array::from_fn(|lane| {
            let [near_px, far_px] = [near_px, far_px].map(|velocity| kept(velocity.map(|axis| axis.0[lane])));
            (lanes.pixels.t_max.0[lane] > 0.0).then_some(Velocities { near_px, far_px })
        })
    }
}

/// A velocity that samples can keep up with.
fn kept([x, y]: [f32; 2]) -> [f32; 2] {
    let speed_px = (x * x + y * y).sqrt();
    if !(speed_px < f32::MAX) {
        return [0.0; 2];
    }
    let kept = if speed_px > SPEED_MAX_PX { SPEED_MAX_PX / speed_px } else { 1.0 };
    [x * kept, y * kept]
}

#[cfg(test)]
mod tests {
    use super::super::pattern::sobol_reversed;
    use super::*;

    fn sobol(count: u32) -> Vec<[u32; 3]> {
        (0..count * u32_from(CELLS)).map(|number| [0, 1, 2].map(|axis| sobol_reversed(axis, number))).collect()
    }

    #[test]
    fn each_pixel_of_a_block_has_a_point_of_each_turn() {
        let side = f32_from_u32(u32_from(SIDE));
        for (seed, count) in [(1, 1), (2, 3), (3, 8)] {
            let (points, order) = points(&sobol(count), DrawKey::root(seed));
            assert_eq!(order.len(), index(count) * CELLS);
            for (place, &number) in order.iter().enumerate() {
                let [x, y, t] = points[index(number)];
                let cell = [x * side, y * side].map(|place| index(u32_truncated_f32(place)));
                assert_eq!(cell, [place % CELLS % SIDE, place % CELLS / SIDE], "turn {}", place / CELLS);
                assert_eq!(index(number) / CELLS, place / CELLS);
                assert!((0.0..1.0).contains(&t));
            }
        }
    }

    #[test]
    fn points_fill_the_picture_evenly_however_it_moves() {
        // Two by two blocks whose inner corner goes otherwise than the outer ones: a zoom of 12 px an exposure, and a turn.
        let corner = |x: usize, y: usize| {
            let of = |place: usize, other: usize| [-6.0, 1.0, 7.0][place] + [2.0, 0.0, -2.5][other];
            [of(x, y), of(y, 2 - x)]
        };
        let count = 16;
        let sobol = sobol(count);
        let mut areas = [[0.0_f64; 4]; 4];
        for block in 0..4 {
            let (x, y) = (block % 2, block / 2);
            let corners = [corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)];
            let origin_px = [x, y].map(|place| f32_from_u32(u32_from(place * SIDE)));
            for point in points(&sobol, DrawKey::root(8).with(crate::num::u64_from(block))).0 {
                let (at_px, area) = carried(origin_px, &corners, point);
                // The middle, which is full of points at all times.
                let [column, row] = at_px.map(|place| (place - 8.0) / 4.0);
                if column >= 0.0 && row >= 0.0 && column < 4.0 && row < 4.0 {
                    areas[index(u32_truncated_f32(row))][index(u32_truncated_f32(column))] += f64::from(area);
                }
            }
        }
        for area in areas.iter().flatten() {
            let per_pixel = area / 16.0 / f64::from(count);
            // 256 points of some 3 % of the picture; those that the 16 px of its rim cut count or not: sqrt(40) / 256 at most.
            assert!((per_pixel - 1.0).abs() < 4.0 * 0.025, "{per_pixel} of {areas:?}");
        }
    }
}
