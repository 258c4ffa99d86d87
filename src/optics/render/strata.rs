//! A pixel with parts that have samples of their own. Enters: even samples, and boxes that hold images of lamps. Leaves: samples of the
//! whole, each of one even sample outside the boxes and one of each box.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::filter::Shares;
use super::glints::{EACH_MAX, Glint};
use super::halves::{Parts, Seen};
use super::net::Powers;
use super::refine::{Pixel, even, share};
use super::shot::Pixels;
use crate::num::{f32_from_u32, f32_nearest, index, u32_from, u64_from};
use crate::scene::lanes::{Floats, LANES};
use crate::scene::tracer::Stack;

/// Says that a key is of a box's samples.
const OF_BOX: u64 = 1 << 44;
/// Samples, at most, that show whether an image is there: it takes a twentieth of its box and more unless something hides it.
const PROBES: u32 = 64;

/// What samples of a pixel share that some boxes part.
pub struct Parting<'a> {
    pub pixels: &'a Pixels,
    pub shares: &'a Shares,
    /// Their numbers, and how many there are.
    pub numbers: &'a [u32; LANES],
    pub lanes: usize,
}

/// A pixel's first batch, parted.
#[derive(Clone, Copy, Debug)]
pub struct Parted {
    /// What is outside its boxes.
    pub outside: Seen,
    /// Mean photons of all.
    pub photons: f32,
    /// What samples of its boxes may leave of the variance.
    pub variance: f32,
}

impl Pixel<'_> {
    /// Takes out of even samples what lies in a box, and adds samples of the boxes by their volume.
    pub fn part(&self, parting: &Parting, at: &[[f32; 3]; LANES], photons: &mut Floats, stack: &mut Stack) {
        self.take_out(at, parting.lanes, photons);
        self.add_boxes(parting, photons, stack);
    }

    /// Leaves nothing of even samples that lie in a box.
    pub fn take_out(&self, at: &[[f32; 3]; LANES], lanes: usize, photons: &mut Floats) {
        for lane in 0..lanes {
            if self.is_taken(at[lane]) {
                photons.0[lane] = 0.0;
            }
        }
    }

    /// Whether a place lies in a box.
    pub fn is_taken(&self, at: [f32; 3]) -> bool {
        self.glints.iter().any(|glint| glint.holds(at))
    }

    /// Adds samples of the boxes by their volume.
    pub fn add_boxes(&self, parting: &Parting, photons: &mut Floats, stack: &mut Stack) {
        for number in 0..self.glints.len() {
            let own = self.of_box(number, parting, stack);
            for lane in 0..parting.lanes {
                photons.0[lane] += own.0[lane];
            }
        }
    }

    /// What samples of a box add: their photons times its volume, none beyond the pixel, and none where a box before has it.
    fn of_box(&self, number: usize, parting: &Parting, stack: &mut Stack) -> Floats {
        let (glint, before) = (&self.glints[number], &self.glints[..number]);
        let key = self.key.with(OF_BOX | u64_from(number));
        let mut at = [[0.0; 3]; LANES];
        let mut weight = [0.0; LANES];
        for lane in 0..parting.lanes {
            at[lane] = glint.place(even(key, parting.numbers[lane]));
            let [x, y, _] = at[lane];
            let is_within = [x, y].iter().all(|place| (0.0..1.0).contains(place));
            if is_within && !before.iter().any(|other| other.holds(at[lane])) {
                weight[lane] = glint.volume();
            }
        }
        let places = self.placed(&at, parting.numbers, parting.lanes);
        let [photons, _] = self.shoot(parting.pixels, places, parting.lanes, parting.shares, stack);
        let mut own = Floats::splat(0.0);
        for lane in 0..parting.lanes {
            own.0[lane] = if weight[lane] > 0.0 { photons.0[lane] * weight[lane] } else { 0.0 };
        }
        own
    }

    /// The boxes that matter, strongest first: those that would leave the pixel more than this variance for each of its even samples. With
    /// the variance of a sample of all of them, and how many rays that took.
    pub fn lit_boxes(&self, least: f32, stack: &mut Stack) -> (Vec<Glint>, f32, u32) {
        let pixels = self.pixels();
        let shares = Shares::even(share(PROBES), share(PROBES));
        let mut lit: Vec<(f32, Glint)> = Vec::new();
        let mut rays = 0;
        for (number, glint) in self.glints.iter().enumerate() {
            let mut powers = Powers::NONE;
            for from in (0..PROBES).step_by(LANES) {
                let numbers = std::array::from_fn(|lane| from + u32_from(lane));
                let parting = Parting { pixels: &pixels, shares: &shares, numbers: &numbers, lanes: LANES };
                self.of_box(number, &parting, stack).0.iter().for_each(|&photons| powers.add(photons));
                rays += u32_from(LANES);
                if powers.spread_and_tail()[0] > f64::from(least * glint.volume()) {
                    break;
                }
            }
            // Samples of a box are worth its volume; an even sample that meets it is worth all, as often as its volume says.
            let variance = f32_nearest(powers.spread_and_tail()[0]) / glint.volume();
            if variance > least {
                lit.push((variance, *glint));
            }
        }
        lit.sort_by(|a, b| b.0.total_cmp(&a.0));
        lit.truncate(EACH_MAX);
        let left = lit.iter().map(|(variance, glint)| variance * glint.volume()).sum();
        (lit.into_iter().map(|(_, glint)| glint).collect(), left, rays)
    }

    /// A first batch of a pixel with boxes, which is a packet at most. `nearest_m` is what a tile's batch said, `left` the variance of a
    /// sample of the boxes.
    pub fn first_parted(&self, count: u32, nearest_m: f32, left: f32, stack: &mut Stack) -> Parted {
        let pixels = self.pixels();
        let shares = Shares::even(share(count), share(count));
        let (numbers, lanes) = (std::array::from_fn(u32_from), LANES.min(index(count)));
        let parting = Parting { pixels: &pixels, shares: &shares, numbers: &numbers, lanes };
        let mut at = [[0.0; 3]; LANES];
        for lane in 0..lanes {
            at[lane] = even(self.key, numbers[lane]);
        }
        let [mut photons, _] = self.shoot(&pixels, self.placed(&at, &numbers, lanes), lanes, &shares, stack);
        self.take_out(&at, lanes, &mut photons);
        let mut parts = Parts::new(count);
        for lane in 0..lanes {
            parts.add(numbers[lane], Floats::splat(photons.0[lane]));
        }
        let outside = parts.seen(0, nearest_m);
        self.add_boxes(&parting, &mut photons, stack);
        let mut powers = Powers::NONE;
        photons.0[..lanes].iter().for_each(|&photons| powers.add(photons));
        // Few samples of a box that all met the image, or none, differ by less than its probes.
        let spread = f32_nearest(powers.spread_and_tail()[0]);
        let variance = if left > spread { left } else { spread } / f32_from_u32(count);
        Parted { outside, photons: f32_nearest(powers.mean()), variance }
    }
}
