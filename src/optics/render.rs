//! Photons. Enters: a lit scene, a camera, its motion, an exposure span for each row. Leaves: mean photons of every pixel.
//!
//! Every ray has its own place in the pixel and its own instant, and a look-up averages over what its sample stands for (`filter`).
//! A first batch of even samples (`rows`, `pattern`, `halves`), which many pixels share while the camera moves (`shared`, `grid`,
//! `ride`, `paths`, `sums`), shows where a picture needs more. Those pixels have nets of their own that follow their motion (`refine`,
//! `shear`), as fine as brings the picture's mean error to its target (`spend`), and a few have two, to tell that error (`twins`).

mod filter;
mod fit;
mod glints;
mod grid;
mod halves;
mod net;
mod outlines;
mod passes;
mod paths;
mod pattern;
mod refine;
mod reflect;
mod ride;
mod rows;
mod shared;
mod shear;
mod shot;
mod spend;
mod strata;
mod sums;
mod twins;
mod whole;

use super::camera::Camera;
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, f32_nearest, index, u64_from};
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::LitScene;
use crate::scene::lit::BOUNCES_MAX;
use crate::units::Span;
use halves::Seen;
use net::Net;
use passes::{Growing, Picture};
use refine::{FIRST, Rule};
use shot::View;
use spend::{Estimate, Kind};

/// What a camera saw in one exposure.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// Mean photons of each pixel, all bands by their weights.
    pub photons: Plane<f32>,
    /// Mean over lit pixels below saturation of (estimated variance of the pixel's mean) / (its photon variance), both in
    /// electrons: render noise over photon noise. It comes from what halves of the samples differ by. Infinite for one sample,
    /// which says nothing about its own error; 0 without such a pixel.
    pub render_variance_ratio: f64,
    /// Rays that were traced from the camera.
    pub rays: u64,
}

/// How a render is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Rays of each pixel where there is no tolerance, at least 1; with sub-frames, those of each.
    pub samples_per_pixel: u32,
    /// Rays of a pixel at most, with a tolerance, besides those of the first batch.
    pub samples_max: u32,
    /// Rays are sent until the mean of render variance is at most so many times photon variance, both in electrons; 0: every
    /// pixel has as many.
    pub tolerance: f64,
    /// Still pictures that are averaged, at the middles of equal parts of the exposure: how others merge sub-frames, and a
    /// reference; 0 for rays that each have their own instant.
    pub subframes: u32,
    /// Reflections that a ray follows, up to `BOUNCES_MAX`; 0: every surface is dull.
    pub reflections: u32,
    /// Whether it follows them at gloss and glaze too, and not only at mirrors. Highlights of bright lamps in rough gloss are found
    /// by chance alone, so they cost far more samples than anything else.
    pub follows_gloss: bool,
    /// Electrons of a photon: photon variance in electrons is this times the photons, render variance its square.
    pub electrons_per_photon: f64,
    /// Photons beyond which a pixel shows no difference, so that its render noise does not count. They are rendered all the same.
    pub saturation_photons: f32,
    /// Whether triangles count by their shares of a pixel where there are 32 samples of each or more; else all samples count alike, which
    /// is a reference only.
    pub outlines: bool,
    /// Names the pattern of samples.
    pub key: DrawKey,
}

impl Sampling {
    /// The same number of rays for every pixel.
    pub fn fixed(samples_per_pixel: u32, key: DrawKey) -> Self {
        Self {
            samples_per_pixel,
            samples_max: samples_per_pixel,
            tolerance: 0.0,
            subframes: 0,
            reflections: BOUNCES_MAX,
            follows_gloss: true,
            electrons_per_photon: 1.0,
            saturation_photons: f32::INFINITY,
            outlines: true,
            key,
        }
    }

    fn is_adaptive(&self) -> bool {
        self.tolerance > 0.0 && self.subframes == 0
    }
}

/// Samples of every pixel before it is known which need more: few, or so few that only a loose target is served by them.
const FIRST_BATCH: [u32; 2] = [4, 2];
/// Tolerance from which on a target is loose.
const LOOSE: f64 = 1.0;
/// Of a picture that moves so fast that all pixels have many samples by way of others, to a tolerance that few would not meet.
const FAST_BATCH: u32 = 8;
/// Pixels over the exposure from which on it is fast.
const FAST_PX: f64 = 8.0;
/// Tolerance below which few do not meet it.
const TIGHT: f64 = 0.3;
/// From so many on, a fixed number of samples is a net of each pixel's own, which follows its motion and its outlines. Fewer lose more
/// by rays that lie apart in time than they gain.
const OWN_NETS_FROM: u32 = 32;
/// Outlines are looked for where what they may leave is more than this of the photons' own variance, with a fixed number of samples.
const OUTLINES_FROM: f64 = 0.002;
/// Images of lamps have samples of their own where they would leave more than this share of the target for each of a pixel's samples.
const BOXES_FROM: f64 = 0.1;
/// Passes that bring a picture to its target at most: each begins where the estimates of the one before lead.
const PASSES_MAX: usize = 12;

/// Renders one exposure. `shutter` has one span a row (all equal for a global shutter). Panics if it does not, or without samples.
pub fn render(
    scene: &LitScene,
    camera: &Camera,
    shutter: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    sampling: Sampling,
) -> Exposure {
    assert!(shutter.len() == index(camera.size.height_px), "a render needs one span for each row");
    let view = View { scene, camera, reflections: sampling.reflections, follows_gloss: sampling.follows_gloss };
    let picture = Picture::new(view, shutter, world_from_body, sampling);
    if sampling.is_adaptive() {
        return to_target(picture);
    }
    let samples = sampling.samples_per_pixel * sampling.subframes.max(1);
    assert!(samples > 0, "a render needs a sample");
    if sampling.subframes == 0 && samples >= OWN_NETS_FROM {
        return own_nets(picture, samples);
    }
    let seen = picture.even(samples);
    let rays = u64::from(samples) * u64_from(seen.len());
    let ratio = halves::variance_ratio(&seen, samples, sampling.saturation_photons);
    Exposure {
        photons: plane(camera, seen.iter().map(|pixel| pixel.photons)),
        render_variance_ratio: if samples > 1 { ratio * sampling.electrons_per_photon } else { f64::INFINITY },
        rays,
    }
}

fn plane(camera: &Camera, photons: impl Iterator<Item = f32>) -> Plane<f32> {
    Plane::from_values(camera.size, photons.collect())
}

/// The same number of samples for each pixel, along its own motion. One ray each finds the surface first.
fn own_nets(mut picture: Picture, samples: u32) -> Exposure {
    let saturation_photons = picture.sampling.saturation_photons;
    let mut seen = picture.even(1);
    let share = Some(refine::share(samples));
    let outlines_from =
        picture.sampling.outlines.then(|| f32_nearest(OUTLINES_FROM / picture.sampling.electrons_per_photon));
    let beside = outlines_from.map_or(0, |least| picture.part(1, &mut seen, least * f32_from_u32(samples)).rays);
    let picture = &picture;
    let rule = Rule { samples, least_gain: None, saturation_photons, share, outlines_from };
    let mut nets: Vec<Growing> = (0..seen.len())
        .map(|at| Growing { at, net: Net::new(spend::hidden(&seen, index(picture.view.camera.size.width_px), at)) })
        .collect();
    picture.grow(&mut nets, &seen, &rule);
    ask_beside(picture, &mut nets, &seen, &rule);
    let of = |Growing { net, .. }: &Growing| Estimate::of_net(net.photons, net.variance(), 1, samples + net.extra);
    let estimates: Vec<Estimate> = nets.iter().map(of).collect();
    let exposure = told(picture, &estimates, &seen, 1, &rule);
    Exposure { rays: exposure.rays + beside, ..exposure }
}

/// Takes pixels anew that were not asked for their outlines, where what a neighbour's samples met may be hidden from their own. One ray of
/// each pixel, which `spend::hidden` knows before, seldom meets what is thinner than a pixel.
fn ask_beside(picture: &Picture, nets: &mut [Growing], seen: &[Seen], rule: &Rule) {
    let (Some(least), width) = (rule.outlines_from, index(picture.view.camera.size.width_px)) else { return };
    let n = f32_from_u32(rule.samples);
    let hidden = |at: usize| {
        let (x, y, mut most) = (at % width, at / width, 0.0_f32);
        for row in y.saturating_sub(1)..(y + 2).min(nets.len() / width) {
            for column in x.saturating_sub(1)..(x + 2).min(width) {
                let contrast2 = nets[row * width + column].net.contrast2;
                most = if contrast2 > most { contrast2 } else { most };
            }
        }
        most * spend::OF_HIDDEN
    };
    let is_hidden = |growing: &&Growing| {
        let net = &growing.net;
        !net.is_asked && spend::ratio(net.photons, hidden(growing.at) / (n * n * n)) > least
    };
    let mut again: Vec<Growing> = nets
        .iter()
        .filter(is_hidden)
        .map(|growing| Growing { at: growing.at, net: Net::new(hidden(growing.at)) })
        .collect();
    picture.grow(&mut again, seen, rule);
    for mut growing in again {
        growing.net.extra += rule.samples;
        nets[growing.at].net = growing.net;
    }
}

/// As few samples as bring the mean of variance over photons to what is asked for.
fn to_target(mut picture: Picture) -> Exposure {
    let Sampling { samples_max, saturation_photons, .. } = picture.sampling;
    let target = picture.sampling.tolerance / picture.sampling.electrons_per_photon;
    let first = first_batch(&picture);
    let width = index(picture.view.camera.size.width_px);
    let (mut seen, rays) = picture.first(first);
    let parted = picture.part(first, &mut seen, f32_nearest(target * BOXES_FROM));
    let mut beside = parted.rays + rays;
    let mut estimates = spend::first_estimates(&seen, width, first, saturation_photons);
    parted.correct(&mut estimates);
    let mut rule =
        Rule { samples: samples_max, least_gain: None, saturation_photons, share: None, outlines_from: None };
    let mut nets: Vec<Growing> = Vec::new();
    for _ in 0..PASSES_MAX {
        if samples_max < FIRST {
            break;
        }
        let Some(least) = spend::least_gain(&estimates, target, saturation_photons) else { break };
        rule.least_gain = Some(least);
        for (at, estimate) in estimates.iter_mut().enumerate() {
            let is_first = estimate.kind != Kind::Net;
            if is_first && estimate.may_count(saturation_photons) && estimate.gain() >= least {
                estimate.kind = Kind::Net;
                nets.push(Growing { at, net: Net::new(spend::hidden(&seen, width, at)) });
            }
        }
        picture.grow(&mut nets, &seen, &rule);
        let mut grown = false;
        for Growing { at, net } in &nets {
            let estimate = &mut estimates[*at];
            grown |= first + net.samples != estimate.samples;
            *estimate = Estimate::of_net(net.photons, net.variance(), first, net.samples);
        }
        if !grown {
            break;
        }
    }
    beside += nets.iter().map(|growing| u64::from(growing.net.extra)).sum::<u64>();
    let exposure = told(&picture, &estimates, &seen, first, &rule);
    // Of the first batch it is known how many were taken.
    Exposure { rays: exposure.rays - u64::from(first) * u64_from(seen.len()) + beside, ..exposure }
}

/// Samples of each pixel in the first batch.
fn first_batch(picture: &Picture) -> u32 {
    let tolerance = picture.sampling.tolerance;
    if tolerance >= LOOSE {
        return FIRST_BATCH[1];
    }
    let is_fast = tolerance < TIGHT && picture.rides().is_some_and(|grid| grid.speed_px() >= FAST_PX);
    if is_fast { FAST_BATCH } else { FIRST_BATCH[0] }
}

/// The picture, and its error as pixels tell that are sampled a second time.
fn told(picture: &Picture, estimates: &[Estimate], seen: &[Seen], first: u32, rule: &Rule) -> Exposure {
    let Sampling { saturation_photons, key, electrons_per_photon, .. } = picture.sampling;
    let width = index(picture.view.camera.size.width_px);
    let twins = twins::choose(estimates, width, saturation_photons, key.with(TWIN_KEY));
    let (others, more) = picture.twins(&twins, estimates, seen, first, rule);
    let ratio = twins::variance_ratio(estimates, &twins, &others, saturation_photons);
    let rays = estimates.iter().map(|estimate| u64::from(estimate.samples)).sum::<u64>() + more;
    let photons = plane(picture.view.camera, estimates.iter().map(|estimate| estimate.photons));
    Exposure { photons, render_variance_ratio: ratio * electrons_per_photon, rays }
}

/// Names the draws that choose twins, beyond any row.
const TWIN_KEY: u64 = 1 << 43;

#[cfg(test)]
mod tests;
