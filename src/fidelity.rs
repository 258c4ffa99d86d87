//! The knobs that trade accuracy for time, together: each says what error it buys and what it costs.

/// How exactly the chain from charge to codes is simulated. Each rung is the reference of the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rung {
    /// Mean and variance of each pixel in closed form; ends at the image.
    Expected,
    /// Every pixel drawn, converters in closed form.
    Sampled,
    /// One tick a clock.
    Clocked,
    /// The SystemVerilog under Verilator.
    Rtl,
}

impl Rung {
    /// The one name of this rung.
    pub fn name(self) -> &'static str {
        match self {
            Self::Expected => "expected",
            Self::Sampled => "sampled",
            Self::Clocked => "clocked",
            Self::Rtl => "rtl",
        }
    }
}

/// Accuracy knobs of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fidelity {
    /// Rung of the ladder.
    pub rung: Rung,
    /// Rays of every pixel where there is no render tolerance: render variance falls, time grows in proportion. At least 1.
    pub samples_per_pixel: u32,
    /// Rays a pixel at most, with a render tolerance.
    pub samples_max: u32,
    /// Rays are sent until the mean of render variance is at most so many times photon variance; 0: every pixel has as many.
    pub render_tolerance: f64,
    /// Still pictures that an exposure is the mean of; 0: every ray has its own instant.
    pub subframes: u32,
    /// Reflections that a ray follows; 0: every surface is dull.
    pub reflections: u32,
    /// Whether it follows them at gloss and glaze too, and not only at mirrors. Highlights of lamps in gloss are noisy.
    pub follows_gloss: bool,
    /// Share of a pixel's own noise sigma that all effects left out may add up to (0: keep every effect that could matter).
    pub accuracy: f64,
    /// Which of many independent renders of the same frames: 0 is the run's, others serve as its reference.
    pub render_repeat: u32,
}
