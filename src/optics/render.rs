//! Renders mean photons of every pixel from a lit scene, a camera, its motion, and an exposure span for each row.
//!
//! Adaptive sampling in four steps, each a module that uses only those before it:
//! 1. `tile`: a first batch of two or four samples in every pixel, traced in packets of neighbouring pixels.
//! 2. `first_batch`, `allocation`: estimate each pixel's variance from its neighbourhood, and find the marginal gain per ray down to which
//!    pixels must be sampled so that the picture meets its target.
//! 3. `pixel`, `pixel_samples`: refine the pixels above that level in packets of sixteen samples of one pixel, doubling their number
//!    until each pixel is below it.
//! 4. `replicate`: sample a few pixels again with other samples, to state the error.
//!
//! A pixel on an edge gets the two or four samples of the first batch as all others do. They contrast with those of its neighbours, and the
//! bound on edges that samples missed grows with that contrast. So its estimated variance is high, and one more ray there gains more than
//! elsewhere. `refine_pixel` then replaces them by 16 samples along the motion of the nearest surface, and doubles these until the gain of
//! one more is below the level of all pixels, or `run.samples_max` is reached. Formulas, errors and costs: docs/sampling.md.
//!
//! Under these lie the sample points (`draw/sobol`, `shear`), the rays (`rays`, `reflect`, `shadows`, `objects`, `among`) and texture
//! footprints (`scene/texture/footprint`). `frame` has what all steps share.

mod allocation;
mod among;
mod first_batch;
mod frame;
mod objects;
mod pixel;
mod pixel_samples;
mod rays;
mod reflect;
mod replicate;
mod settings;
mod shadows;
mod shear;
mod tile;
mod view;

use super::camera::Camera;
use crate::num::{f64_from_usize, greater, index, u64_from};
use crate::parallel::collected;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::object::DynamicScene;
use crate::units::Span;
use allocation::{Estimate, INITIAL_SAMPLES, Stage};
use first_batch::FirstBatch;
use frame::{FrameRender, Kept};
use pixel::StoppingRule;
use pixel_samples::PixelSamples;
pub use settings::{Exposure, Sampling};
use view::View;

/// Samples of the first batch: for a tolerance below `LOOSE`, and from there on.
const FIRST_BATCH_SAMPLES: [u32; 2] = [4, 2];
/// Tolerance from which on a first batch of two samples is enough.
const LOOSE: f64 = 1.0;
/// Fixed number of samples from which on each pixel is sampled by itself, along its motion. Fewer samples gain less by that than their
/// packets lose in coherence.
const BY_PIXEL_FROM: u32 = 32;
/// Upper bound on the passes of refinement. Each pass allocates anew from the estimates of the one before.
const PASSES_MAX: usize = 12;

/// Renders one exposure. `shutter` has one span a row (all equal for a global shutter). Panics if it does not, or without samples.
pub fn render<'a>(
    scene: impl Into<DynamicScene<'a>>,
    camera: &Camera,
    shutter: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    sampling: Sampling,
) -> Exposure {
    assert!(shutter.len() == index(camera.size.height_px), "a render needs one span for each row");
    let scene = scene.into();
    let view = View::new(scene, camera, sampling);
    rendered(&FrameRender::new(view, scene.objects, shutter, world_from_body, sampling))
}

/// Renders one exposure of a still camera under steady light over a picture of the static scene alone: only tiles in which an object may be
/// seen are rendered, until the whole picture meets the target.
pub fn render_over(
    static_picture: &Exposure,
    scene: DynamicScene<'_>,
    camera: &Camera,
    shutter: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    sampling: Sampling,
) -> Exposure {
    let view = View::new(scene, camera, sampling);
    let mut frame = FrameRender::new(view, scene.objects, shutter, world_from_body, sampling);
    frame.kept = Some(Kept {
        tiles: among::tiles_in_view(&frame.objects, &view, &frame.timelines),
        photons: &static_picture.photons,
        variance_ratio: static_picture.render_variance_ratio / sampling.electrons_per_photon,
    });
    let mut exposure = rendered(&frame);
    let (mut anew, mut kept) = (0_u32, 0_u32);
    let pairs = exposure.photons.values_mut().iter_mut().zip(static_picture.photons.values());
    for (pixel, (photons, of_static)) in pairs.enumerate() {
        if frame.is_rendered(pixel) {
            anew += 1;
        } else {
            *photons = *of_static;
            kept += 1;
        }
    }
    // Each states the mean over its own pixels.
    let share = f64::from(anew) / f64::from(anew + kept);
    let ratios = [exposure.render_variance_ratio, static_picture.render_variance_ratio];
    exposure.render_variance_ratio = match (anew, kept) {
        (0, _) => ratios[1],
        (_, 0) => ratios[0],
        _ => share * ratios[0] + (1.0 - share) * ratios[1],
    };
    exposure.rays += static_picture.rays;
    exposure
}

fn rendered(frame: &FrameRender) -> Exposure {
    if frame.sampling.is_adaptive() { to_target(frame) } else { evenly(frame) }
}

/// Renders with a given number of samples for each pixel.
fn evenly(frame: &FrameRender) -> Exposure {
    let (camera, sampling) = (frame.view.camera, frame.sampling);
    let samples = sampling.samples_per_pixel * sampling.subframes.max(1);
    assert!(samples > 0, "a render needs a sample");
    if sampling.subframes == 0 && samples >= BY_PIXEL_FROM {
        return stratified_by_pixel(frame, samples);
    }
    let first_batches = frame.render_first_batch(samples);
    let own: Vec<FirstBatch> =
        (0..first_batches.len()).filter(|&pixel| frame.is_rendered(pixel)).map(|pixel| first_batches[pixel]).collect();
    let rays = u64::from(samples) * u64_from(own.len());
    let ratio = first_batch::variance_ratio(&own, samples, sampling.saturation_photons);
    Exposure {
        photons: plane(camera, first_batches.iter().map(|first_batch| first_batch.photons)),
        render_variance_ratio: if samples > 1 { ratio * sampling.electrons_per_photon } else { f64::INFINITY },
        rays,
    }
}

fn plane(camera: &Camera, photons: impl Iterator<Item = f32>) -> Plane<f32> {
    Plane::from_values(camera.size, photons.collect())
}

/// Renders the same number of samples for each pixel, along its motion. One more ray each finds the nearest surface first.
fn stratified_by_pixel(frame: &FrameRender, samples: u32) -> Exposure {
    let Sampling { saturation_photons, .. } = frame.sampling;
    let first_batches = frame.render_first_batch(1);
    let rule = StoppingRule { samples, least_gain: None, saturation_photons, share: Some(frame::share(samples)) };
    let begun = |pixel: usize| PixelSamples { pixel, ..PixelSamples::default() };
    let mut refined: Vec<_> = (0..first_batches.len()).filter(|&pixel| frame.is_rendered(pixel)).map(begun).collect();
    frame.refine(&mut refined, &first_batches, &rule);
    let width = frame.width();
    let mut estimates =
        allocation::first_estimates(&first_batches, width, 1, saturation_photons, |pixel| frame.is_rendered(pixel));
    refined.iter().for_each(|pixel_samples| estimates[pixel_samples.pixel] = pixel_samples.estimate(1));
    with_stated_error(frame, estimates, &first_batches, 1, &rule)
}

/// Renders with as few samples as bring the mean of variance over photons down to the tolerance. What is kept counts by the error that it
/// states.
fn to_target(frame: &FrameRender) -> Exposure {
    let Sampling { samples_max, saturation_photons, .. } = frame.sampling;
    let target = frame.sampling.tolerance / frame.sampling.electrons_per_photon;
    let first_batch_samples = FIRST_BATCH_SAMPLES[usize::from(frame.sampling.tolerance >= LOOSE)];
    let width = index(frame.view.camera.size.width_px);
    let first_batches = frame.render_first_batch(first_batch_samples);
    let mut estimates =
        allocation::first_estimates(&first_batches, width, first_batch_samples, saturation_photons, |pixel| {
            frame.is_rendered(pixel)
        });
    let spare = spare(frame, target);
    let mut rule = StoppingRule { samples: samples_max, least_gain: None, saturation_photons, share: None };
    let mut refined: Vec<PixelSamples> = Vec::new();
    for _ in 0..PASSES_MAX {
        if samples_max < INITIAL_SAMPLES {
            break;
        }
        let Some(least) = allocation::least_gain(&estimates, target, spare, saturation_photons) else { break };
        rule.least_gain = Some(least);
        let is_above = |&pixel: &usize| {
            let estimate = &estimates[pixel];
            let is_first = estimate.stage != Stage::Refined;
            let may_count = is_first && frame.is_rendered(pixel) && estimate.may_count(saturation_photons);
            may_count && estimate.marginal_gain() >= least
        };
        let above_in = |row: usize| (row * width..(row + 1) * width).filter(is_above).collect::<Vec<usize>>();
        for pixel in collected(frame.shutter.len(), above_in).into_iter().flatten() {
            estimates[pixel].stage = Stage::Refined;
            refined.push(PixelSamples { pixel, ..PixelSamples::default() });
        }
        frame.refine(&mut refined, &first_batches, &rule);
        let mut grown = false;
        for pixel_samples in &refined {
            let estimate = pixel_samples.estimate(first_batch_samples);
            grown |= estimate.samples != estimates[pixel_samples.pixel].samples;
            estimates[pixel_samples.pixel] = estimate;
        }
        if !grown {
            break;
        }
    }
    with_stated_error(frame, estimates, &first_batches, first_batch_samples, &rule)
}

/// Variance over photons that kept pixels leave to the others, in all: what they have less than the target.
fn spare(frame: &FrameRender, target: f64) -> f64 {
    let Some(kept) = &frame.kept else { return 0.0 };
    let counts = |&(pixel, &photons): &(usize, &f32)| {
        !frame.is_rendered(pixel) && photons > 0.0 && photons < frame.sampling.saturation_photons
    };
    let count = kept.photons.values().iter().enumerate().filter(counts).count();
    greater(target - kept.variance_ratio, 0.0) * f64_from_usize(count)
}

/// The picture, with the error that replicates of some pixels state.
fn with_stated_error(
    frame: &FrameRender,
    estimates: Vec<Estimate>,
    first_batches: &[FirstBatch],
    first_batch_samples: u32,
    rule: &StoppingRule,
) -> Exposure {
    let Sampling { saturation_photons, key, electrons_per_photon, .. } = frame.sampling;
    let width = index(frame.view.camera.size.width_px);
    let replicates = replicate::choose(&estimates, width, saturation_photons, key.with(REPLICATE_KEY));
    let (others, more) = frame.replicates(&replicates, &estimates, first_batches, first_batch_samples, rule);
    let ratio = replicate::variance_ratio(&estimates, &replicates, &others, saturation_photons);
    let rays = estimates.iter().map(|estimate| u64::from(estimate.samples)).sum::<u64>() + more;
    let photons = plane(frame.view.camera, estimates.iter().map(|estimate| estimate.photons));
    Exposure { photons, render_variance_ratio: ratio * electrons_per_photon, rays }
}

/// Names the draws that choose replicates, beyond any row.
const REPLICATE_KEY: u64 = 1 << 43;

#[cfg(test)]
mod tests;
