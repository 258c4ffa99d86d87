//! A pixel whose number of samples is given. Enters: its place, its motion, how many samples. Leaves: their mean, with each triangle
//! counted by its share (`outlines`) where that may matter.

use super::filter::Shares;
use super::net::Net;
use super::outlines::{Told, Ways, plain};
use super::refine::{Desk, Pixel, Places};
use super::shot::Pixels;
use super::spend::ratio;
use super::strata::Parting;
use crate::num::{f32_from_u32, f32_nearest, f64_from_usize, index, u32_from};
use crate::scene::lanes::{Floats, LANES};
use crate::scene::tracer::Hits;
use crate::simd::{Kernel, dispatch};

/// Rays that are asked which triangle is in front, over those that are traced,
const FINER: u32 = 16;
/// but about so many at most,
const FINE_MAX: u32 = 4_096;
/// and so many times as many at least, so that nothing is left that more samples do not take away.
const FINER_LEAST: u32 = 4;

/// How much farther than the farthest sample triangles are listed: directions of a pixel's rays differ in length by less.
const FARTHER: f32 = 1.01;

/// Rays whose textures are looked at, over the samples, and what of a sample's share of the width each stands for.
const TINTED: u32 = FINER_LEAST;
const TINTED_SHARE: f32 = 0.5;

/// Names the draw that chooses rays of a gap.
const OF_GAP: u64 = 1;

/// Corners of a pixel at four instants of the exposure.
const CORNERS: [[f32; 3]; LANES] = {
    let mut places = [[0.0; 3]; LANES];
    let mut lane = 0;
    while lane < LANES {
        let ends = [0.0, 1.0];
        places[lane] = [ends[lane & 1], ends[lane >> 1 & 1], [0.0, 0.333, 0.667, 0.999_999][lane >> 2]];
        lane += 1;
    }
    places
};

/// What is asked of a pixel.
pub struct Whole {
    /// How far it goes over the exposure, in its own widths and heights.
    pub velocity_px: [f32; 2],
    /// Samples.
    pub samples: u32,
    /// Share of the pixel's width that each stands for.
    pub share: f32,
    /// Variance over photons from which on outlines are looked for.
    pub least: f32,
}

impl Net {
    fn take(&mut self, told: &Told) {
        let apart = f32_nearest(told.halves[1] - told.halves[0]);
        (self.photons, self.spread) = (f32_nearest(told.mean), f32_nearest(told.spread));
        self.taken = 0.25 * apart * apart;
    }

    /// Adds what boxes say.
    fn add(&mut self, told: &Told) {
        let apart = f32_nearest(told.halves[1] - told.halves[0]);
        self.photons += f32_nearest(told.mean);
        self.spread += f32_nearest(told.spread);
        self.taken += 0.25 * apart * apart;
    }
}

impl Pixel<'_> {
    /// Takes all of a pixel's samples.
    pub fn whole(&self, net: &mut Net, pixels: &Pixels, whole: &Whole, desk: &mut Desk) {
        let shares = Shares::over_motion(whole.share);
        let (mut lights, mut far_m) = (Vec::with_capacity(index(whole.samples)), 0.0_f32);
        let mut added = Vec::new();
        for from in (0..whole.samples).step_by(LANES) {
            let lanes = LANES.min(index(whole.samples - from));
            let (places, at) = self.places_at(whole.velocity_px, &numbers(from), lanes);
            let [mut seen, gone_m] = self.shoot(pixels, places, lanes, &shares, desk);
            if !self.glints.is_empty() {
                let parting = Parting { pixels, shares: &shares, numbers: &numbers(from), lanes };
                let mut own = Floats::splat(0.0);
                self.add_boxes(&parting, &mut own, desk);
                added.extend_from_slice(&own.0[..lanes]);
                self.take_out(&at, lanes, &mut seen);
            }
            lights.extend_from_slice(&seen.0[..lanes]);
            for &gone_m in &gone_m.0[..lanes] {
                far_m = if gone_m > far_m { gone_m } else { far_m };
            }
        }
        net.samples = whole.samples;
        net.take(&plain(&lights));
        for &photons in &lights {
            let apart = photons - net.photons;
            net.contrast2 = if apart * apart > net.contrast2 { apart * apart } else { net.contrast2 };
        }
        let n = f32_from_u32(whole.samples);
        let left = net.spread / (n * n.sqrt()) + net.hidden / (n * n * n);
        net.is_asked = ratio(net.photons, left) > whole.least;
        if net.is_asked {
            self.tell(net, pixels, whole, &lights, far_m, desk);
        }
        if !added.is_empty() {
            net.add(&plain(&added));
            net.extra += self.beside(whole.samples);
        }
    }

    /// Lets each triangle count by its share of the finer net, if the triangles can be known.
    fn tell(&self, net: &mut Net, pixels: &Pixels, whole: &Whole, lights: &[f32], far_m: f32, desk: &mut Desk) {
        if pixels.seen.1 == 0 || !self.ask(far_m, pixels, whole, desk) {
            return;
        }
        let (gap, rays) = self.gap(pixels, whole, desk);
        net.extra += rays;
        let mut told = desk.outlines.told(lights, gap);
        let n = f32_from_u32(whole.samples);
        let left = f32_nearest(told.spread) / (n * n.sqrt());
        if ratio(f32_nearest(told.mean), left) > whole.least && desk.outlines.has_texture(self.view.scene) {
            self.tint(pixels, whole, desk);
            told = desk.outlines.told(lights, gap);
        }
        net.take(&told);
    }

    /// Sorts the rays of the finer net, and says whether the triangles are known.
    fn ask(&self, far_m: f32, pixels: &Pixels, whole: &Whole, desk: &mut Desk) -> bool {
        let corners = self.placed(&CORNERS, &[0; LANES], LANES);
        let beam = dispatch(Ways { timeline: self.timeline, pixels, places: &corners });
        if !desk.outlines.list(self.view.scene.scene(), &beam, FARTHER * far_m, &mut desk.stack) {
            return false;
        }
        let samples = whole.samples;
        // The samples themselves come first, in packets of their own: the last may be short.
        for (first, end) in [(0, samples), (samples, finer(samples))] {
            for from in (first..end).step_by(LANES) {
                let lanes = LANES.min(index(end - from));
                let (places, at) = self.places_at(whole.velocity_px, &numbers(from), lanes);
                let rays = dispatch(Ways { timeline: self.timeline, pixels, places: &places });
                desk.outlines.ask(&rays, &at[..lanes], &|at| self.is_taken(at));
            }
        }
        true
    }

    /// Looks at the textures where the samples and the first rays of the finer net meet them.
    fn tint(&self, pixels: &Pixels, whole: &Whole, desk: &mut Desk) {
        let samples = whole.samples;
        let finer = samples * TINTED;
        for (first, end, is_fine) in [(0, samples, false), (0, samples, true), (samples, finer, true)] {
            let shares = Shares::over_motion(if is_fine { TINTED_SHARE * whole.share } else { whole.share });
            for from in (first..end).step_by(LANES) {
                let lanes = LANES.min(index(end - from));
                let places = self.places(whole.velocity_px, &numbers(from), lanes);
                let hits = desk.outlines.hits(index(from), lanes);
                let tint = dispatch(Tints { pixel: self, pixels, places: &places, shares: &shares, hits });
                desk.outlines.tint(&tint.0[..lanes], is_fine);
            }
        }
    }

    /// The mean of some rays that met what no sample did, if there are any, and how many were traced.
    fn gap(&self, pixels: &Pixels, whole: &Whole, desk: &mut Desk) -> (Option<f64>, u32) {
        let Some((numbers, lanes)) = desk.outlines.unmet(index(whole.samples), self.key.with(OF_GAP).uniform()) else {
            return (None, 0);
        };
        let places = self.places(whole.velocity_px, &numbers, lanes);
        let [photons, _] = self.shoot(pixels, places, lanes, &Shares::over_motion(whole.share), desk);
        let sum: f64 = photons.0[..lanes].iter().map(|&photons| f64::from(photons)).sum();
        (Some(sum / f64_from_usize(lanes)), u32_from(lanes))
    }
}

/// What textures do to the samples of a packet.
struct Tints<'a> {
    pixel: &'a Pixel<'a>,
    pixels: &'a Pixels,
    places: &'a Places,
    shares: &'a Shares,
    hits: Hits,
}

impl Kernel for Tints<'_> {
    type Output = Floats;

    #[inline(always)]
    fn run(self) -> Floats {
        let aim = self.places.aim(self.pixel.timeline, self.shares);
        self.pixel.view.tint(self.pixels, &aim, self.hits)
    }
}

/// Rays of the finer net of so many samples.
fn finer(samples: u32) -> u32 {
    samples * (FINE_MAX / samples).clamp(FINER_LEAST, FINER)
}

fn numbers(from: u32) -> [u32; LANES] {
    std::array::from_fn(|lane| from + u32_from(lane))
}
