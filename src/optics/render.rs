//! Photons. Enters: a lit scene, a camera, its motion, an exposure span for each row. Leaves: mean photons of every pixel.
//!
//! Every ray has its own place in the pixel and its own instant, and a look-up averages over what its sample stands for (`filter`).
//! A first batch of even samples (`rows`, `pattern`, `halves`) shows where a picture needs more. Those pixels have nets of their own that
//! follow their motion (`refine`, `shear`), as fine as brings the picture's mean error to its target (`spend`), and a few have two, to
//! tell that error (`twins`).

mod filter;
mod glints;
mod halves;
mod net;
mod passes;
mod pattern;
mod refine;
mod reflect;
mod rows;
mod shear;
mod shot;
mod spend;
mod strata;
mod twins;

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
/// From so many on, a fixed number of samples is a net of each pixel's own, which follows its motion. Fewer lose more by rays that lie
/// apart in time than they gain.
const OWN_NETS_FROM: u32 = 32;
/// With a fixed number of samples, images of lamps have their own where they would leave more than this of the photons' variance.
const BOXES_LEAST: f64 = 0.002;
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
    let Sampling { saturation_photons, electrons_per_photon, .. } = picture.sampling;
    let mut seen = picture.even(1);
    let least = f32_nearest(BOXES_LEAST / electrons_per_photon) * f32_from_u32(samples);
    let beside = picture.part(1, &mut seen, least).rays;
    let picture = &picture;
    let rule = Rule { samples, least_gain: None, saturation_photons, share: Some(refine::share(samples)) };
    let mut nets: Vec<Growing> = (0..seen.len())
        .map(|at| Growing { at, net: Net::new(spend::hidden(&seen, index(picture.view.camera.size.width_px), at)) })
        .collect();
    picture.grow(&mut nets, &seen, &rule);
    let of = |Growing { net, .. }: &Growing| Estimate::of_net(net.photons, net.variance(), 1, samples + net.extra);
    let estimates: Vec<Estimate> = nets.iter().map(of).collect();
    let exposure = told(picture, &estimates, &seen, 1, &rule);
    Exposure { rays: exposure.rays + beside, ..exposure }
}

/// As few samples as bring the mean of variance over photons to what is asked for.
fn to_target(mut picture: Picture) -> Exposure {
    let Sampling { samples_max, saturation_photons, .. } = picture.sampling;
    let target = picture.sampling.tolerance / picture.sampling.electrons_per_photon;
    let first = FIRST_BATCH[usize::from(picture.sampling.tolerance >= LOOSE)];
    let width = index(picture.view.camera.size.width_px);
    let mut seen = picture.even(first);
    let parted = picture.part(first, &mut seen, f32_nearest(target * BOXES_FROM));
    let mut beside = 0;
    let mut estimates = spend::first_estimates(&seen, width, first, saturation_photons);
    parted.correct(&mut estimates);
    let mut rule = Rule { samples: samples_max, least_gain: None, saturation_photons, share: None };
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
    Exposure { rays: exposure.rays + parted.rays + beside, ..exposure }
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
