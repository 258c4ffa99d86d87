//! Single settings held against a reference, on frames that a caller names: what a search by brute force is made of. Enters: a bench,
//! settings, frames. Leaves: error and time of each.

use super::clocks::Cost;
use super::errors::Squares;
use super::knobs::Setting;
use super::measure::Bench;
use super::pictures::{mean_square, render_all, sense_all};
use super::reference::reference;
use crate::error::Error;
use crate::run::probe::Place;
use crate::units::FrameIndex;

/// What a setting is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Error in photon noise, below the finest of the study where it cannot be told.
    pub photon_noise_ratio: f64,
    /// Of render and sensor, per frame of the rig.
    pub cost: Cost,
    /// Rays a pixel.
    pub rays_per_pixel: f64,
}

impl Verdict {
    /// Of a render and a chain together: their errors add in squares, their times add.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let (one, two) = (self.photon_noise_ratio, other.photon_noise_ratio);
        Self {
            photon_noise_ratio: (one * one + two * two).sqrt(),
            cost: self.cost.and(other.cost),
            rays_per_pixel: self.rays_per_pixel + other.rays_per_pixel,
        }
    }
}

/// Renders and chains, each judged alone: any of the one goes with any of the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// One entry a setting of rays and reflections: the render's error and time.
    pub renders: Vec<Verdict>,
    /// One entry a setting of effects: the chain's error and time, on the reference's photons.
    pub chains: Vec<Verdict>,
}

/// Judges renders and chains apart on these frames of the first camera, against one reference that can tell errors from `finest` on.
///
/// # Errors
/// As `ladder`.
pub fn judge_parts(
    bench: &Bench<'_>,
    renders: &[Setting],
    chains: &[Setting],
    frames: &[u32],
    finest: f64,
    repeats: u32,
) -> Result<Parts, Error> {
    let places: Vec<Place> = frames.iter().map(|&frame| Place { frame: FrameIndex(frame), camera: 0 }).collect();
    let reference = reference(bench, &places, finest)?;
    let verdict = |errors: &[Squares], cost: Cost, rays_per_pixel: f64| Verdict {
        photon_noise_ratio: mean_square(errors).sqrt(),
        cost,
        rays_per_pixel,
    };
    let rendered = render_all(bench, &reference, renders, repeats)?;
    let sensed = sense_all(bench, &reference, chains, repeats)?;
    Ok(Parts {
        renders: rendered.iter().map(|one| verdict(&one.errors, one.cost, one.rays_per_pixel)).collect(),
        chains: sensed.iter().map(|one| verdict(&one.errors, one.cost, 0.0)).collect(),
    })
}

/// Judges settings on these frames of the first camera against a reference that can tell errors from `finest` on.
///
/// # Errors
/// As `ladder`.
pub fn judge(
    bench: &Bench<'_>,
    settings: &[Setting],
    frames: &[u32],
    finest: f64,
    repeats: u32,
) -> Result<Vec<Verdict>, Error> {
    let parts = judge_parts(bench, settings, settings, frames, finest, repeats)?;
    Ok(parts.renders.iter().zip(&parts.chains).map(|(render, chain)| render.and(*chain)).collect())
}
