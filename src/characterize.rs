//! An EMVA 1288 (release 4.0) measurement of the simulated sensor. Takes frames of uniform light and computes every figure of the standard
//! with its standard error, and the truth that the configuration implies. Of the scenario, only the sensor is used. It touches no disk;
//! `files::emva` writes the files for external judges.
//!
//! Light falls straight onto the pixels: no lens, no scene, so photons a pixel and exposure are known. Exposure times are set freely
//! in whole nanoseconds under constant light, also beyond the sequencer's longest, as with a lengthened frame. All effects of the
//! sensor act (no plan). The array's first rows and columns are measured, pixel by pixel, whatever window or binning the readout has. One
//! descriptor holds one colour plane. A sensor of several readings a pixel (HDR) is measured in the first alone, the most sensitive.

pub mod analysis;
mod beyond;
pub mod channel;
mod defects;
mod dither;
pub mod fit;
mod fits;
pub mod measure;
mod model;
mod moments;
#[cfg(feature = "cli")]
pub mod page;
#[cfg(feature = "cli")]
mod map;
pub mod record;
pub mod set;
mod shoot;
mod spatial;
mod uncertainty;
pub mod truth;

pub use analysis::{Figures, figures};
pub use measure::Measurement;
pub use record::Characterization;
pub use set::{Options, Set, Shot};
pub use truth::{Truth, Want};

use crate::config::Resolved;
use crate::effects;
use crate::effects::chain::Chain;
use crate::error::Error;
use crate::plane::Plane;
use crate::run::SensorSetup;

/// A sensor under test: what it is, what will be shot, and the chain that makes its frames.
pub struct Bench {
    sensor: SensorSetup,
    set: Set,
    chain: Chain,
}

impl Bench {
    /// The sensor of a scenario with all its effects.
    ///
    /// # Errors
    /// As `SensorSetup::new`; options out of range; a sensor without any response to light.
    pub fn new(resolved: &Resolved, options: &Options) -> Result<Self, Error> {
        let sensor = SensorSetup::new(resolved)?;
        let effects = effects::build_all(&sensor.parameters);
        let chain =
            Chain::new(sensor.parameters.clone(), effects, resolved.scenario.seed, resolved.scenario.sensor.die);
        Self::with_chain(resolved, options, chain)
    }

    /// The same with a chain of the caller's, which need not be what the scenario says: how tests show that a wrong sensor fails.
    ///
    /// # Errors
    /// As [`Bench::new`].
    pub fn with_chain(resolved: &Resolved, options: &Options, chain: Chain) -> Result<Self, Error> {
        let sensor = SensorSetup::new(resolved)?;
        let set = Set::new(&sensor, options).map_err(|error| resolved.tree.locate(error))?;
        Ok(Self { sensor, set, chain })
    }

    /// What is shot.
    pub fn set(&self) -> &Set {
        &self.set
    }

    /// Shoots everything in order; `sink` sees each frame once.
    ///
    /// # Errors
    /// What the sink says.
    pub fn run(&self, mut sink: impl FnMut(&Shot, &Plane<u16>) -> Result<(), Error>) -> Result<Measurement, Error> {
        let mut measurement = Measurement::new(&self.set);
        let times = shoot::Times::new(&self.sensor, &self.set);
        for shot in self.set.shots() {
            let codes = shoot::shoot(&self.chain, &self.set, &shot, &times);
            sink(&shot, &codes)?;
            measurement.add(&shot, &codes);
        }
        Ok(measurement)
    }

    /// What the configuration implies for this set.
    pub fn truth(&self) -> Truth {
        truth::truth(&self.sensor, &self.set)
    }

    /// The sensor under test.
    pub fn sensor(&self) -> &SensorSetup {
        &self.sensor
    }
}
