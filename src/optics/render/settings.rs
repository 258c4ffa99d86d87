//! Settings of the render, and the exposure that it computes.

use crate::draw::DrawKey;
use crate::plane::Plane;
use crate::scene::lanes::LANES;
use crate::scene::lit::REFLECTIONS_MAX;

/// Columns of the square of pixels that a packet covers: a tile.
pub const COLUMNS: usize = 4;
/// Rows of it, and of a unit of parallel work.
pub const ROWS: usize = LANES / COLUMNS;

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
    /// Rays are sent until the mean of render variance is at most this many times photon variance, both in electrons; 0: every
    /// pixel has as many.
    pub tolerance: f64,
    /// Still pictures that are averaged, at the middles of equal parts of the exposure: how others merge sub-frames, and a
    /// reference; 0 for rays that each have their own instant.
    pub subframes: u32,
    /// Reflections that a ray follows, up to `REFLECTIONS_MAX`; 0: every surface is diffuse.
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
            reflections: REFLECTIONS_MAX,
            follows_gloss: true,
            electrons_per_photon: 1.0,
            saturation_photons: f32::INFINITY,
            key,
        }
    }

    pub(super) fn is_adaptive(&self) -> bool {
        self.tolerance > 0.0 && self.subframes == 0
    }
}
