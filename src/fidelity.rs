//! The knobs that trade accuracy for time, together: each says what error it buys and what it costs.

use crate::text::named;

named! {
    /// How exactly the chain from charge to codes is simulated. Each rung is the reference of the one before it.
    pub enum Rung {
        /// Mean and variance of each pixel in closed form; ends at the image.
        Expected = "expected",
        /// Every pixel drawn, converters in closed form.
        Sampled = "sampled",
        /// One tick a clock.
        Clocked = "clocked",
        /// The SystemVerilog under Verilator.
        Rtl = "rtl",
    }
}

/// Accuracy knobs of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fidelity {
    /// Rung of the ladder.
    pub rung: Rung,
    /// Share of a pixel's own noise sigma that all effects left out may add up to (0: keep every effect that could matter).
    pub accuracy: f64,
    /// How exposures are rendered.
    pub render: RenderSettings,
}

/// All that reaches the render besides scene, light, camera (lens, filters and geometry of its pixels), motion and row exposures: the
/// keys of `[run]` that belong to it. No sensor, converter, extractor or link is among them, so designs that differ behind the lens see
/// the same photons; the two figures of the sensor that a tolerance needs are stated here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Names the samples.
    pub seed: u64,
    /// Rays of every pixel where there is no tolerance: render variance falls, time grows in proportion. At least 1.
    pub samples_per_pixel: u32,
    /// Rays a pixel at most, with a tolerance.
    pub samples_max: u32,
    /// Rays are sent until the mean of render variance is at most this many times photon variance; 0: every pixel has as many.
    pub tolerance: f64,
    /// Still pictures that an exposure is the mean of; 0: every ray has its own instant.
    pub subframes: u32,
    /// Reflections that a ray follows; 0: every surface is diffuse.
    pub reflections: u32,
    /// Whether it follows them at gloss and glaze too, and not only at mirrors. Highlights of lamps in gloss are noisy.
    pub follows_gloss: bool,
    /// Electrons of a photon that the tolerance counts with: quantum efficiency with the fill factor, as EMVA 1288 states it.
    pub quantum_efficiency: f64,
    /// Electrons that fill a pixel: render noise of brighter pixels does not count.
    pub full_well_e: f64,
    /// Steps of the mean photons in photon sigmas; 0: photons as they are.
    pub rounding_sigma: f64,
    /// Which of many independent renders of the same frames: 0 is the run's, others serve as its reference.
    pub repeat: u32,
}

impl RenderSettings {
    /// Mean photons that fill a pixel; infinite for a pixel that sees no light.
    pub fn saturation_photons(&self) -> f64 {
        self.full_well_e / self.quantum_efficiency
    }
}
