//! A setting: one value for each knob that trades accuracy for time. Converts to and from configuration assignments, so a user can write
//! every setting.

use crate::config::Scenario;
use crate::fidelity::Rung;

/// Largest number of rays per pixel in a search for an accuracy: the maximum of the configuration. A high limit is cheap, since
/// a pixel gets rays only where they reduce the error as much as elsewhere. A low limit is not enough for small mirror images
/// of lamps, which dominate the error of some pictures (docs/ladder.md).
pub const RAYS_MOST: u32 = 65_536;

/// How many rays, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayBudget {
    /// A fixed number in every pixel.
    Fixed(u32),
    /// As few as bring render variance to a multiple of photon variance, up to a number per pixel.
    Tolerance {
        /// The target of the mean.
        tolerance: f64,
        /// Rays a pixel at most.
        most: u32,
    },
    /// The mean of still pictures of one ray per pixel, by their number.
    Subframes(u32),
}

/// Which effects run.
#[derive(Clone, Debug, PartialEq)]
pub enum EffectsKnob {
    /// Every one whose parameters are not zero.
    All,
    /// By the scenario's own words, with this tolerance.
    Planned {
        /// `run.effects`.
        words: String,
        /// `run.accuracy`, in units of a pixel's own noise.
        tolerance: f64,
    },
}

/// One setting of all knobs.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Rung of the chain.
    pub rung: Rung,
    /// Rays.
    pub rays: RayBudget,
    /// Reflections that a ray follows.
    pub reflections: u32,
    /// Effects.
    pub effects: EffectsKnob,
    /// Keyframes that the tracker refines together.
    pub window: u32,
}

impl Setting {
    /// What a scenario asks for.
    pub fn of(scenario: &Scenario) -> Self {
        let run = &scenario.run;
        let rays = match (run.sampling.as_str(), run.samples_per_pixel, run.render_tolerance) {
            ("subframes", _, _) => RayBudget::Subframes(run.subframes),
            (_, Some(samples), _) => RayBudget::Fixed(samples),
            (_, None, Some(tolerance)) => RayBudget::Tolerance { tolerance, most: run.samples_max },
            (_, None, None) => RayBudget::Fixed(1),
        };
        let rung = if run.rung == Rung::Clocked.name() { Rung::Clocked } else { Rung::Sampled };
        let effects = match run.effects.trim() {
            "all" => EffectsKnob::All,
            words => EffectsKnob::Planned { words: words.to_owned(), tolerance: run.accuracy },
        };
        Self { rung, rays, reflections: run.reflections, effects, window: scenario.tracker.window }
    }

    /// The assignments that make a configuration of it. Keys that this setting leaves without effect go back to their defaults.
    pub fn assignments(&self, scenario: &Scenario) -> Vec<String> {
        let (sampling, most, rays, subframes) = match self.rays {
            RayBudget::Fixed(samples) => ("stratified", 256, format!("run.samples_per_pixel={samples}"), 16),
            RayBudget::Tolerance { tolerance, most } => {
                ("stratified", most, format!("run.render_tolerance={tolerance:?}"), 16)
            }
            // The default tolerance stands idle beside sub-frames, and takes away a fixed number that the scenario may have.
            RayBudget::Subframes(count) => ("subframes", 256, "run.render_tolerance=1.0".to_owned(), count),
        };
        let mut all = vec![
            format!("run.rung='{}'", self.rung.name()),
            format!("run.sampling='{sampling}'"),
            format!("run.samples_max={most}"),
            rays,
            format!("run.subframes={subframes}"),
            format!("run.reflections={}", self.reflections),
        ];
        if self.reflections == 0 {
            all.push("run.gloss='mirrors'".to_owned());
        }
        match &self.effects {
            EffectsKnob::All => all.push("run.effects='all'".to_owned()),
            EffectsKnob::Planned { words, tolerance } => {
                all.extend([format!("run.effects='{words}'"), format!("run.accuracy={tolerance:?}")]);
            }
        }
        if self.window != scenario.tracker.window {
            all.push(format!("tracker.window={}", self.window));
        }
        all
    }

    /// Whether two settings see the same photons.
    pub fn renders_as(&self, other: &Self) -> bool {
        self.rays == other.rays && self.reflections == other.reflections
    }

    /// Whether two settings make the same codes of the same photons.
    pub(super) fn senses_as(&self, other: &Self) -> bool {
        self.rung == other.rung && self.effects == other.effects
    }

    /// For a person.
    pub fn words(&self) -> String {
        let effects = match &self.effects {
            EffectsKnob::All => "all effects".to_owned(),
            EffectsKnob::Planned { words, .. } if words == "none" => "no effects".to_owned(),
            EffectsKnob::Planned { tolerance, .. } => format!("effects to {tolerance}"),
        };
        format!("{}, {} reflections, {effects}", self.rays.words(), self.reflections)
    }
}

impl RayBudget {
    /// For a person.
    pub fn words(&self) -> String {
        match self {
            Self::Fixed(1) => "1 ray a pixel".to_owned(),
            Self::Fixed(samples) => format!("{samples} rays per pixel"),
            Self::Tolerance { tolerance, most: 256 } => format!("render tolerance {tolerance}"),
            Self::Tolerance { tolerance, most } => format!("render tolerance {tolerance}, up to {most}"),
            Self::Subframes(count) => format!("{count} sub-frames"),
        }
    }
}
