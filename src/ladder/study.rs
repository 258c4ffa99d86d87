//! Single settings held against a reference, on frames that a caller names: what a search by brute force is made of. Enters: a bench,
//! settings, frames. Leaves: error and time of each.

use super::clocks::Cost;
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
    let places: Vec<Place> = frames.iter().map(|&frame| Place { frame: FrameIndex(frame), camera: 0 }).collect();
    let reference = reference(bench, &places, finest)?;
    let rendered = render_all(bench, &reference, settings, repeats)?;
    let sensed = sense_all(bench, &reference, settings, repeats)?;
    let verdict = |(rendered, sensed): (&super::pictures::Rendered, &super::pictures::Sensing)| Verdict {
        photon_noise_ratio: (mean_square(&rendered.errors) + mean_square(&sensed.errors)).sqrt(),
        cost: rendered.cost.and(sensed.cost),
        rays_per_pixel: rendered.rays_per_pixel,
    };
    Ok(rendered.iter().zip(&sensed).map(verdict).collect())
}
