//! Measures error and time of single settings on given frames. The brute-force search is made of this.

use super::clocks::MeasuredCost;
use super::errors::Squares;
use super::knobs::Setting;
use super::measure::LadderBench;
use super::pictures::{Rendered, mean_square, render_all, render_until, sense_all};
use super::reference::{Reference, SHARE, reference};
use crate::error::Error;
use crate::num::f64_from_usize;
use crate::run::probe::PictureId;
use crate::units::FrameIndex;

/// Error and time of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettingVerdict {
    /// Error in photon noise; unreliable below the finest of the study.
    pub photon_noise_ratio: f64,
    /// Of render and sensor, per frame of the rig.
    pub cost: MeasuredCost,
    /// Rays per pixel.
    pub rays_per_pixel: f64,
}

impl SettingVerdict {
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

/// Frames of the first camera with their reference, ready to judge.
pub struct HeldOut<'a> {
    bench: &'a LadderBench<'a>,
    reference: Reference,
}

impl<'a> HeldOut<'a> {
    /// A reference of these frames for errors from `finest` on.
    pub fn new(bench: &'a LadderBench<'a>, frames: &[u32], finest: f64) -> Result<Self, Error> {
        let ids: Vec<PictureId> =
            frames.iter().map(|&frame| PictureId { frame: FrameIndex(frame), camera: 0 }).collect();
        Ok(Self { bench, reference: reference(bench, &ids, finest, SHARE)? })
    }

    /// Renders alone, timed this many times in turns.
    pub fn renders(&self, settings: &[Setting], repeats: u32) -> Result<Vec<SettingVerdict>, Error> {
        let rendered = render_all(self.bench, &self.reference, settings, repeats)?;
        Ok(rendered.iter().map(|one| verdict(&one.errors, one.cost, one.rays_per_pixel)).collect())
    }

    /// A render alone, timed once; none where its error is above `worst` whatever its last frames show.
    pub fn render_within(&self, setting: &Setting, worst: f64) -> Result<Option<SettingVerdict>, Error> {
        let all = f64_from_usize(self.reference.judged.len());
        let hopeless =
            |one: &Rendered| f64_from_usize(one.errors.len()) / all * mean_square(&one.errors) > worst * worst;
        let one = render_until(self.bench, &self.reference, setting, &hopeless)?;
        let is_whole = one.errors.len() == self.reference.judged.len() && !hopeless(&one);
        Ok(is_whole.then(|| verdict(&one.errors, one.cost, one.rays_per_pixel)))
    }

    /// Chains alone, on the reference's photons, timed this many times in turns.
    pub fn chains(&self, settings: &[Setting], repeats: u32) -> Result<Vec<SettingVerdict>, Error> {
        let sensed = sense_all(self.bench, &self.reference, settings, repeats)?;
        Ok(sensed.iter().map(|one| verdict(&one.errors, one.cost, 0.0)).collect())
    }
}

fn verdict(errors: &[Squares], cost: MeasuredCost, rays_per_pixel: f64) -> SettingVerdict {
    SettingVerdict { photon_noise_ratio: mean_square(errors).sqrt(), cost, rays_per_pixel }
}

/// Measures settings on these frames of the first camera against a reference for errors from `finest` on.
pub fn judge(
    bench: &LadderBench<'_>,
    settings: &[Setting],
    frames: &[u32],
    finest: f64,
    repeats: u32,
) -> Result<Vec<SettingVerdict>, Error> {
    let held_out = HeldOut::new(bench, frames, finest)?;
    let (renders, chains) = (held_out.renders(settings, repeats)?, held_out.chains(settings, repeats)?);
    Ok(renders.iter().zip(&chains).map(|(render, chain)| render.and(*chain)).collect())
}
