//! Renders mean photons of every pixel from a lit scene, a camera, its motion, and an exposure span for each row.
//!
//! Adaptive sampling in four steps, each a module that uses only those before it:
//! 1. `tile`: a first batch of two or four samples in every pixel, traced in packets of neighbouring pixels.
//! 2. `first_batch`, `allocation`: estimate each pixel's variance from its neighbourhood, and find the marginal gain per ray down to which
//!    pixels must be sampled so that the picture meets its target.
//! 3. `pixel`, `estimate`: refine the pixels above that level in packets of sixteen samples of one pixel, doubling until each is below it.
//! 4. `replicate`: sample a few pixels again with other samples, to state the error.
//!
//! Under these lie the sample points (`sobol`, `shear`), the rays (`rays`, `reflect`) and texture footprints (`footprint`). `frame` runs
//! the steps over a picture on all cores.

mod allocation;
mod estimate;
mod footprint;
mod frame;
mod first_batch;
mod pixel;
mod rays;
mod reflect;
mod replicate;
mod shear;
mod sobol;
mod tile;

use super::camera::Camera;
use crate::draw::DrawKey;
use crate::num::{index, u64_from};
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::LitScene;
use crate::scene::lit::BOUNCES_MAX;
use crate::units::Span;
use allocation::{Estimate, Stage};
use estimate::PixelSamples;
use first_batch::FirstBatch;
use frame::{Picture, Refined};
use pixel::{FIRST, StoppingRule};
use rays::View;

/// What a camera saw in one exposure.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// Mean photons of each pixel, all bands by their weights.
    pub photons: Plane<f32>,
    /// Mean over lit pixels below saturation of (estimated variance of the pixel's mean) / (its photon variance), both in
    /// electrons: render noise over photon noise. Replicates of some pixels state it; for fewer than 32 fixed samples, halves of the
    /// samples do. Infinite for one sample, which says nothing about its own error; 0 without such a pixel.
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
    /// Reflections that a ray follows, up to `BOUNCES_MAX`; 0: every surface is diffuse.
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

/// Samples of the first batch: for a tolerance below `LOOSE`, and from there on.
const FIRST_BATCH: [u32; 2] = [4, 2];
/// Tolerance from which on a first batch of two samples is enough.
const LOOSE: f64 = 1.0;
/// Fixed number of samples from which on each pixel is sampled by itself, along its motion. Fewer samples gain less by that than their
/// packets lose in coherence.
const BY_PIXEL_FROM: u32 = 32;
/// Upper bound on the passes of refinement. Each pass allocates anew from the estimates of the one before.
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
    let follows_gloss = sampling.follows_gloss;
    let reflections = if scene.has_gloss(follows_gloss) { sampling.reflections } else { 0 };
    let view = View { scene, camera, reflections, follows_gloss };
    let picture = Picture::new(view, shutter, world_from_body, sampling);
    if sampling.is_adaptive() {
        return to_target(picture);
    }
    let samples = sampling.samples_per_pixel * sampling.subframes.max(1);
    assert!(samples > 0, "a render needs a sample");
    if sampling.subframes == 0 && samples >= BY_PIXEL_FROM {
        return stratified_by_pixel(picture, samples);
    }
    let seen = picture.even(samples);
    let rays = u64::from(samples) * u64_from(seen.len());
    let ratio = first_batch::variance_ratio(&seen, samples, sampling.saturation_photons);
    Exposure {
        photons: plane(camera, seen.iter().map(|pixel| pixel.photons)),
        render_variance_ratio: if samples > 1 { ratio * sampling.electrons_per_photon } else { f64::INFINITY },
        rays,
    }
}

fn plane(camera: &Camera, photons: impl Iterator<Item = f32>) -> Plane<f32> {
    Plane::from_values(camera.size, photons.collect())
}

/// Renders the same number of samples for each pixel, along its motion. One more ray each finds the nearest surface first.
fn stratified_by_pixel(picture: Picture, samples: u32) -> Exposure {
    let Sampling { saturation_photons, .. } = picture.sampling;
    let seen = picture.even(1);
    let rule = StoppingRule { samples, least_gain: None, saturation_photons, share: Some(pixel::share(samples)) };
    let mut refined: Vec<Refined> = (0..seen.len()).map(|at| Refined { at, net: PixelSamples::new(0.0) }).collect();
    picture.refine(&mut refined, &seen, &rule);
    let of = |Refined { net, .. }: &Refined| Estimate::refined(net.photons, net.variance(), 1, samples);
    let estimates: Vec<Estimate> = refined.iter().map(of).collect();
    with_stated_error(&picture, &estimates, &seen, 1, &rule)
}

/// Renders with as few samples as bring the mean of variance over photons down to the tolerance.
fn to_target(picture: Picture) -> Exposure {
    let Sampling { samples_max, saturation_photons, .. } = picture.sampling;
    let target = picture.sampling.tolerance / picture.sampling.electrons_per_photon;
    let first = FIRST_BATCH[usize::from(picture.sampling.tolerance >= LOOSE)];
    let width = index(picture.view.camera.size.width_px);
    let seen = picture.even(first);
    let mut estimates = allocation::first_estimates(&seen, width, first, saturation_photons);
    let mut rule = StoppingRule { samples: samples_max, least_gain: None, saturation_photons, share: None };
    let mut refined: Vec<Refined> = Vec::new();
    for _ in 0..PASSES_MAX {
        if samples_max < FIRST {
            break;
        }
        let Some(least) = allocation::least_gain(&estimates, target, saturation_photons) else { break };
        rule.least_gain = Some(least);
        for (at, estimate) in estimates.iter_mut().enumerate() {
            let is_first = estimate.stage != Stage::Refined;
            if is_first && estimate.may_count(saturation_photons) && estimate.marginal_gain() >= least {
                estimate.stage = Stage::Refined;
                refined.push(Refined { at, net: PixelSamples::new(0.0) });
            }
        }
        picture.refine(&mut refined, &seen, &rule);
        let mut grown = false;
        for Refined { at, net } in &refined {
            let estimate = &mut estimates[*at];
            grown |= first + net.samples != estimate.samples;
            *estimate = Estimate::refined(net.photons, net.variance(), first, net.samples);
        }
        if !grown {
            break;
        }
    }
    with_stated_error(&picture, &estimates, &seen, first, &rule)
}

/// The picture, with the error that replicates of some pixels state.
fn with_stated_error(
    picture: &Picture,
    estimates: &[Estimate],
    seen: &[FirstBatch],
    first: u32,
    rule: &StoppingRule,
) -> Exposure {
    let Sampling { saturation_photons, key, electrons_per_photon, .. } = picture.sampling;
    let width = index(picture.view.camera.size.width_px);
    let replicates = replicate::choose(estimates, width, saturation_photons, key.with(REPLICATE_KEY));
    let (others, more) = picture.replicates(&replicates, estimates, seen, first, rule);
    let ratio = replicate::variance_ratio(estimates, &replicates, &others, saturation_photons);
    let rays = estimates.iter().map(|estimate| u64::from(estimate.samples)).sum::<u64>() + more;
    let photons = plane(picture.view.camera, estimates.iter().map(|estimate| estimate.photons));
    Exposure { photons, render_variance_ratio: ratio * electrons_per_photon, rays }
}

/// Names the draws that choose replicates, beyond any row.
const REPLICATE_KEY: u64 = 1 << 43;

#[cfg(test)]
mod tests;
