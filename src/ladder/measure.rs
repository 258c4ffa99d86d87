//! Measurement bench: a lit scenario with clocks and a frame selection. Makes the setups of other settings and the pictures that are
//! judged.

use super::clocks::StudyClocks;
use super::errors::Judge;
use super::knobs::Setting;
use crate::config::Resolved;
use crate::config::scenario::Run;
use crate::error::Error;
use crate::fidelity::Rung;
use crate::num::u32_from;
use crate::report::ladder_record::LADDER_VERSION;
use crate::run::probe::PictureId;
use crate::run::{Assets, Progress, Setup};
use crate::units::FrameIndex;

/// Names what a ladder holds for: the scenario and the program, whatever its knobs of accuracy, frames and threads are.
pub fn study_key(resolved: &Resolved) -> String {
    let mut scenario = resolved.scenario.clone();
    let rung = Rung::Sampled.name().to_owned();
    scenario.run = Run {
        frames: 0,
        rung,
        effects: String::new(),
        threads: 0,
        samples_per_pixel: None,
        render_tolerance: None,
        samples_max: 0,
        sampling: String::new(),
        subframes: 0,
        reflections: 0,
        gloss: String::new(),
        accuracy: 0.0,
        ..scenario.run
    };
    scenario.tracker.window = 0;
    let text = toml::to_string(&scenario).expect("every field has a TOML form");
    let named = format!("ladder {LADDER_VERSION} of {} for\n{text}", env!("CARGO_PKG_VERSION"));
    blake3::hash(named.as_bytes()).to_hex().to_string()
}

/// How much is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LadderOptions {
    /// Pictures of the first camera, spread evenly over the run.
    pub frames: u32,
    /// Frames of each run whose poses are judged; 0: none.
    pub pose_frames: u32,
    /// Finest accuracy that is distinguished, in photon noise.
    pub finest: f64,
    /// Times that each setting is timed; the least counts.
    pub repeats: u32,
}

/// A scenario under its light, ready to be measured.
pub struct LadderBench<'a> {
    /// As the scenario says.
    pub setup: Setup,
    /// Clocks from outside.
    pub clocks: StudyClocks<'a>,
    /// Told how far the study has come.
    pub progress: &'a dyn Progress,
    /// Where a simulator of the sensor's Verilog comes from; where there is none, the ladder says so.
    pub assets: &'a dyn Assets,
}

impl LadderBench<'_> {
    /// The same scenario at another setting. Fails on a setting that the scenario does not admit.
    pub fn setup_of(&self, setting: &Setting) -> Result<Setup, Error> {
        let resolved = &self.setup.resolved;
        self.setup.again(resolved.with(&setting.assignments(&resolved.scenario))?)
    }

    /// The pictures that are judged: the middles of equal parts of the run.
    pub fn picture_ids(&self, frames: u32) -> Vec<PictureId> {
        let (run, count) = (u64::from(self.setup.frames), u64::from(frames));
        let middle = |part: u64| u32::try_from((2 * part + 1) * run / (2 * count)).expect("a frame of the run");
        let mut all: Vec<u32> = (0..count).map(middle).collect();
        all.dedup();
        all.into_iter().map(|frame| PictureId { frame: FrameIndex(frame), camera: 0 }).collect()
    }

    /// What photons mean to the scenario's pixels.
    pub fn judge(&self) -> Judge {
        let sensor = &self.setup.sensor;
        Judge { electrons_per_photon: sensor.electrons_per_photon(), saturation_photons: sensor.saturation_photons() }
    }

    /// Whether rays and their knobs play a part: pictures from elsewhere are averaged exactly.
    pub fn has_rays(&self) -> bool {
        self.setup.world.scene().is_some()
    }

    /// Pixels of one picture.
    pub fn pixels(&self) -> f64 {
        crate::num::f64_from_usize(self.setup.sensor.size.pixel_count())
    }

    /// Cameras of the rig.
    pub fn cameras(&self) -> u32 {
        u32_from(self.setup.cameras.len())
    }
}
