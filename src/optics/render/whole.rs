//! A pixel whose number of samples is given. Enters: its place, its motion, how many samples. Leaves: their mean, with each triangle
//! counted by its share (`outlines`) where that may matter.

use super::filter::Shares;
use super::outlines::{Told, Ways, plain};
use super::refine::{Desk, Net, Pixel};
use super::shot::Pixels;
use super::spend::ratio;
use crate::num::{f32_from_u32, f32_nearest, f64_from_usize, index, u32_from};
use crate::scene::lanes::LANES;
use crate::simd::dispatch;

/// Rays that are asked which triangle is in front, over those that are traced,
const FINER: u32 = 16;
/// but about so many at most,
const FINE_MAX: u32 = 4_096;
/// and so many times as many at least, so that nothing is left that more samples do not take away.
const FINER_LEAST: u32 = 4;

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

impl Pixel<'_> {
    /// Takes all of a pixel's samples.
    pub fn whole(&self, net: &mut Net, pixels: &Pixels, whole: &Whole, desk: &mut Desk) {
        let shares = Shares::over_motion(whole.share);
        let mut photons: Vec<f32> = Vec::with_capacity(index(whole.samples));
        for from in (0..whole.samples).step_by(LANES) {
            let lanes = LANES.min(index(whole.samples - from));
            let places = self.places(whole.velocity_px, &numbers(from), lanes);
            photons.extend_from_slice(&self.shoot(pixels, places, lanes, &shares, desk).0[..lanes]);
        }
        let of = |sample: usize| f64::from(photons[sample]);
        let plain = plain(&of, photons.len());
        let n = f32_from_u32(whole.samples);
        let left = f32_nearest(plain.spread) / (n * n.sqrt()) + net.hidden / (n * n * n);
        let mut told = plain;
        if ratio(f32_nearest(plain.mean), left) > whole.least && pixels.seen.1 > 0 {
            let (gap, is_known) = self.ask(net, pixels, whole, desk);
            if is_known {
                told = desk.outlines.told(&of, photons.len(), gap);
            }
        }
        let Told { mean, spread, halves } = told;
        let apart = f32_nearest(halves[1] - halves[0]);
        (net.photons, net.samples) = (f32_nearest(mean), whole.samples);
        (net.spread, net.taken) = (f32_nearest(spread), 0.25 * apart * apart);
    }

    /// Sorts the rays of the finer net. Gives back the mean of those that met what no sample did, and whether the triangles are known.
    fn ask(&self, net: &mut Net, pixels: &Pixels, whole: &Whole, desk: &mut Desk) -> (Option<f64>, bool) {
        let corners = self.placed(&CORNERS, &[0; LANES], LANES);
        let beam = dispatch(Ways { timeline: self.timeline, pixels, places: &corners });
        if !desk.outlines.list(self.view.scene.scene(), &beam, &mut desk.stack) {
            return (None, false);
        }
        let samples = whole.samples;
        let times = (FINE_MAX / samples).clamp(FINER_LEAST, FINER);
        // The samples themselves come first, in packets of their own: the last may be short.
        for (first, end) in [(0, samples), (samples, samples * times)] {
            for from in (first..end).step_by(LANES) {
                let lanes = LANES.min(index(end - from));
                let places = self.places(whole.velocity_px, &numbers(from), lanes);
                let rays = dispatch(Ways { timeline: self.timeline, pixels, places: &places });
                desk.outlines.ask(&rays, lanes);
            }
        }
        let Some((numbers, lanes)) = desk.outlines.unmet(index(samples)) else { return (None, true) };
        let places = self.places(whole.velocity_px, &numbers, lanes);
        let photons = self.shoot(pixels, places, lanes, &Shares::over_motion(whole.share), desk);
        net.extra = u32_from(lanes);
        let sum: f64 = photons.0[..lanes].iter().map(|&photons| f64::from(photons)).sum();
        (Some(sum / f64_from_usize(lanes)), true)
    }
}

fn numbers(from: u32) -> [u32; LANES] {
    std::array::from_fn(|lane| from + u32_from(lane))
}
