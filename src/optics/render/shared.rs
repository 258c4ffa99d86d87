//! A first batch of a picture that moves. Enters: how many samples of each pixel. Leaves: what every pixel sees of those of all pixels that
//! the same points go through, or, where some of them may be hidden on their way, of its own.
//!
//! Blocks are taken row by row and kept as long as a pixel may be on the way of their points, so a picture takes the room of some rows of
//! blocks and of twice the rows that its points go through.

use std::collections::VecDeque;

use super::TIGHT;
use super::grid::Grid;
use super::halves::Seen;
use super::passes::{Picture, collected, over_chunks};
use super::paths::{Rows, Sample, Ways};
use super::pattern::sobol_reversed;
use super::refine::{Desk, STRATA};
use super::ride::{Block, CELLS, Riding, SIDE};
use super::sums::{Sum, greater, lesser};
use crate::num::{f32_from_u32, index, u32_from, u32_truncated_f32, u64_from};
use crate::scene::light::{BANDS, Bands};
use crate::simd::dispatch;

/// Says that a key is a block's.
const OF_BLOCK: u64 = 1 << 46;

/// Samples of a pixel times rows of blocks whose pixels are summed at a time.
const BAND: usize = 32;

/// Pixels that the picture goes over the exposure, in the mean, from which on samples are shared: by less they gain nothing from each
/// other that the even samples of each pixel do not have. To a loose target, which most pixels meet by their first samples, shared ones
/// have to save twice the time that they take.
const SPEED_LEAST_PX: [f64; 2] = [1.0, 4.0];

/// What the way of a point may be off where a turn bends it, in pixels.
const ASTRAY_MAX_PX: f32 = 1.0 / 16.0;

/// One over the share of the third change of a way that its second-order form misses.
const OF_THIRD_ORDER: f32 = 6.0;

/// Rows that a point may go while a row opens, and be shared.
const FOLLOWS_MAX: f32 = 0.5;

/// How far apart points of a pixel may go that it shares, in pixels over the exposure, and of their speed: what ways are off by.
const SLIP_MAX_PX: f32 = 0.25;
const OF_SPEED: f32 = 0.04;

/// What a pixel sees of shared samples, what the velocities of their points lie amid, and how far they are apart.
#[derive(Clone, Copy)]
struct Summed {
    seen: Option<Seen>,
    velocity_px: [f32; 2],
    slip_px: [f32; 2],
}

impl Picture<'_> {
    /// How the picture moves if points go through pixels while the shutter is open, keep their light, and go about evenly.
    pub fn rides(&self) -> Option<&Grid> {
        self.grid.get_or_init(|| self.ridden()).as_ref()
    }

    fn ridden(&self) -> Option<Grid> {
        let ([first, ..], length_s) = (self.lamp_levels[0], self.shutter[0].length_s());
        let is_as_long = |other_s: f64| (other_s - length_s).abs() <= 1e-9 * length_s;
        let may = length_s > 0.0
            && self.timelines.iter().any(|timeline| !timeline.is_still)
            && self.lamp_levels.iter().flatten().all(|level| level.to_bits() == first.to_bits())
            && self.shutter.iter().all(|span| is_as_long(span.length_s()));
        let size_px = [self.width(), self.shutter.len()];
        let grid = may.then(|| Grid::of(&self.riding(1, &[]), size_px)).flatten()?;
        let speed_least_px = SPEED_LEAST_PX[usize::from(self.sampling.tolerance >= TIGHT)];
        (grid.bends_px[1] < OF_THIRD_ORDER * ASTRAY_MAX_PX && grid.speed_px() >= speed_least_px).then_some(grid)
    }

    fn riding<'a>(&'a self, count: u32, sobol: &'a [[u32; 3]]) -> Riding<'a> {
        let lamp_level = self.lamp_levels[0][STRATA / 2];
        Riding { view: self.view, timelines: &self.timelines, lamp_level, count, sobol, speed_max_px: [0.0; 2] }
    }

    /// What all pixels see of so many samples of each, and how many were taken.
    pub fn shared(&self, count: u32, grid: &Grid) -> (Vec<Seen>, u64) {
        let number_of = |number: u32| [0, 1, 2].map(|axis| sobol_reversed(axis, number));
        let sobol: Vec<[u32; 3]> = (0..count * u32_from(CELLS)).map(number_of).collect();
        // A chord is off by an eighth of its bend, and that falls as the square of their number.
        let legs = u32_truncated_f32((0.125 * grid.bends_px[0] / ASTRAY_MAX_PX).sqrt()) + 1;
        let ways = Ways::new(self.shutter, legs);
        // What is nearer than what the corners met is faster. What goes as fast as the rows open would be seen for ever.
        let [right_px, down_px] = grid.most_px.map(|most| 2.0 * most + 2.0);
        let follows = lesser(down_px * ways.later.abs(), FOLLOWS_MAX);
        let speed_max_px = [right_px, if follows < FOLLOWS_MAX { down_px } else { FOLLOWS_MAX / ways.later.abs() }];
        let riding = Riding { speed_max_px, ..self.riding(count, &sobol) };
        let (width, height) = (self.width(), self.shutter.len());
        let none = Summed { seen: None, velocity_px: [0.0; 2], slip_px: [0.0; 2] };
        let mut summed = vec![none; width * height];
        // Rows of blocks, the first of them by number.
        let (mut kept, mut first): (VecDeque<Vec<Vec<Sample>>>, usize) = (VecDeque::new(), 0);
        let mut rays = u64_from(grid.rays);
        // How far from its block a sample's point may be seen: it was taken half of the corners' motion away.
        let longest_px = (speed_max_px[1] + 0.5 * grid.bends_px[0]) / (1.0 - follows);
        let reach_px = index(u32_truncated_f32(0.5 * grid.most_px[1] + longest_px)) + 2;
        let blocks_of = |rows: [usize; 2]| {
            let [from, to] = rows.map(|row| row + grid.margins[1] * SIDE);
            (from.saturating_sub(reach_px + SIDE) / SIDE, ((to + reach_px) / SIDE + 1).min(grid.blocks[1]))
        };
        let band = (BAND / index(count)).max(1) * SIDE;
        for from in (0..height).step_by(band) {
            let to = (from + band).min(height);
            let (least, most) = blocks_of([from, to]);
            let past = kept.len().min(least - first);
            kept.drain(..past);
            first = least;
            let next = first + kept.len();
            let mut taken = collected((most - next) * grid.blocks[0], |number| {
                self.block(&riding, grid, [number % grid.blocks[0], next + number / grid.blocks[0]])
            });
            rays += taken.iter().map(|samples| u64_from(samples.len())).sum::<u64>();
            while !taken.is_empty() {
                let rest = taken.split_off(grid.blocks[0]);
                kept.push_back(std::mem::replace(&mut taken, rest));
            }
            over_chunks(&mut summed[from * width..to * width], SIDE * width, |chunk, summed| {
                let from = from + chunk * SIDE;
                let (least, most) = blocks_of([from, from + summed.len() / width]);
                self.sum_up(from, &ways, kept.range(least - first..most - first).flatten(), summed);
            });
        }
        let (seen, more) = self.parted(count, &summed);
        (seen, rays + more)
    }

    fn block(&self, riding: &Riding, grid: &Grid, at: [usize; 2]) -> Vec<Sample> {
        let key = self.sampling.key.with(OF_BLOCK | u64_from(at[1])).with(u64_from(at[0]));
        let (origin_px, corners, change) = (grid.place_px(at), grid.velocities_px(at), grid.change(at));
        dispatch(Block { riding, origin_px, corners, change, key })
    }

    /// What rows of pixels from one on see of some samples.
    fn sum_up<'a>(
        &self,
        first: usize,
        ways: &Ways,
        blocks: impl Iterator<Item = &'a Vec<Sample>>,
        summed: &mut [Summed],
    ) {
        let width = self.width();
        let of = |at: usize| self.photons_per_lux_behind(at % width, first + at / width);
        let photons_per_lux: Vec<Bands> = (0..summed.len()).map(of).collect();
        let rows = Rows { width, first, ways, photons_per_lux: &photons_per_lux };
        let mut sums = vec![Sum::NONE; summed.len()];
        for samples in blocks {
            rows.add(samples, &mut sums);
        }
        for (summed, sum) in summed.iter_mut().zip(&sums) {
            if let Some(seen) = sum.seen() {
                let [velocity_px, slip_px] = sum.velocity_px();
                *summed = Summed { seen: Some(seen), velocity_px, slip_px };
            }
        }
    }

    /// Photons of a pixel for a lux behind its filter and its lens; none where it has no bearing.
    fn photons_per_lux_behind(&self, column: usize, row: usize) -> Bands {
        let Some(corners) = self.view.camera.corners(column, row) else { return [0.0; BANDS] };
        let cos = 0.25 * (corners[0][2] + corners[1][2] + corners[2][2] + corners[3][2]);
        let left = self.view.camera.roll_off_at(cos);
        self.photons_per_lux(column, row).map(|per_lux| per_lux * left)
    }

    /// Takes pixels by themselves whose points may be hidden on their ways, and those that no sample's point goes through, or those of one
    /// half only; and says how many samples that took.
    fn parted(&self, count: u32, summed: &[Summed]) -> (Vec<Seen>, u64) {
        let width = self.width();
        let bearings = collected(summed.len(), |at| self.view.camera.corners(at % width, at / width).is_some());
        let is_alone = self.hidden(summed, &bearings);
        let alone: Vec<usize> = (0..summed.len()).filter(|&at| is_alone[at] && bearings[at]).collect();
        let of = |number: usize| {
            let at = alone[number];
            // Even samples are not asked how far they went.
            let nearest_m = summed[at].seen.map_or(f32::MAX, |seen| seen.nearest_m);
            Seen { nearest_m, ..self.pixel(at, 0).alone(count, &mut Desk::new()) }
        };
        let taken = collected(alone.len(), of);
        let mut all: Vec<Seen> = summed.iter().map(|summed| summed.seen.unwrap_or(Seen::NONE)).collect();
        for (&at, seen) in alone.iter().zip(taken) {
            all[at] = seen;
        }
        (all, u64::from(count) * u64_from(alone.len()))
    }

    /// Which pixels points go through that something else may hide meanwhile. What is near goes otherwise than what is far: pixels at its
    /// rim have points of both. Others are hidden on their way from or to as many pixels as the two part by over the exposure.
    fn hidden(&self, summed: &[Summed], bearings: &[bool]) -> Vec<bool> {
        let (width, height) = (self.width(), self.shutter.len());
        let has_blind = !bearings.iter().all(|&has| has);
        let mut hidden = vec![false; summed.len()];
        for (at, Summed { seen, velocity_px, slip_px }) in summed.iter().enumerate() {
            let [x, y] = [at % width, at / width].map(|place| f32_from_u32(u32_from(place)) + 0.5);
            let place = |[x, y]: [f32; 2]| {
                let is_within = |place: f32, most: usize| place >= 0.0 && place < f32_from_u32(u32_from(most));
                let [column, row] = [x, y].map(|place| index(u32_truncated_f32(greater(place, 0.0))));
                (is_within(x, width) && is_within(y, height)).then(|| row * width + column)
            };
            let ([right, down], speed_px) = (*slip_px, greater(velocity_px[0].abs(), velocity_px[1].abs()));
            if seen.is_none() || greater(right, down) > SLIP_MAX_PX + OF_SPEED * speed_px {
                // Which of the two goes where is not known: along both diagonals of what they are apart.
                let steps = u32_truncated_f32(greater(right, down)) + 2;
                for step in 0..=steps {
                    let share = f32_from_u32(step) / f32_from_u32(steps - 1);
                    for [a, b] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
                        if let Some(other) = place([x + a * right * share, y + b * down * share]) {
                            hidden[other] = true;
                        }
                    }
                }
            } else if has_blind {
                // Nothing is sampled where pixels have no bearing.
                let [right, down] = *velocity_px;
                let is_blind =
                    |share: f32| place([x + right * share, y + down * share]).is_some_and(|at| !bearings[at]);
                hidden[at] |= is_blind(1.0) || is_blind(-1.0);
            }
        }
        hidden
    }
}
