//! A bench: one sensor before uniform light.

use super::measure::ChannelMeasurement;
use super::set::{MeasurementSize, PlannedShot, SeriesExposure, Set};
use super::shoot::ReadoutTiming;
use super::truth::ChannelTruth;
use crate::config::Resolved;
use crate::effects;
use crate::effects::chain::Chain;
use crate::error::Error;
use crate::plane::Plane;
use crate::run::SensorSetup;
use crate::units::Size;

/// A sensor under test: what it is, what will be shot, and the chain that makes its frames.
pub struct SensorBench {
    sensor: SensorSetup,
    set: Set,
    chain: Chain,
    times: ReadoutTiming,
}

impl SensorBench {
    /// The sensor of a scenario with all its effects.
    /// Fails as `SensorSetup::new` does, on options out of range, on a sensor without any response to light.
    pub fn new(resolved: &Resolved, options: &MeasurementSize) -> Result<Self, Error> {
        let sensor = SensorSetup::new(resolved)?;
        let effects = effects::build_all(&sensor.parameters);
        let chain =
            Chain::new(sensor.parameters.clone(), effects, resolved.scenario.seed, resolved.scenario.sensor.die);
        Self::with_chain(resolved, options, chain)
    }

    /// The same with a chain of the caller's, which need not be what the scenario says: how tests show that a wrong sensor fails.
    /// Fails as [`SensorBench::new`] does.
    pub fn with_chain(resolved: &Resolved, options: &MeasurementSize, chain: Chain) -> Result<Self, Error> {
        let sensor = SensorSetup::new(resolved)?;
        let set = Set::new(&sensor, options).map_err(|error| resolved.tree.locate(error))?;
        let times = ReadoutTiming::new(&sensor, &set);
        Ok(Self { sensor, set, chain, times })
    }

    /// The sensor of a scenario with all its effects, before the light of frames that exist.
    /// Fails as [`SensorBench::new`] does.
    pub fn of_frames(
        resolved: &Resolved,
        size: Size,
        points: Vec<SeriesExposure>,
        half: SeriesExposure,
        stack: u32,
    ) -> Result<Self, Error> {
        let Self { sensor, chain, .. } =
            Self::new(resolved, &MeasurementSize { size: Some(size), ..MeasurementSize::default() })?;
        let set = Set::of_frames(&sensor, size, points, half, stack)?;
        let times = ReadoutTiming::new(&sensor, &set);
        Ok(Self { sensor, set, chain, times })
    }

    /// What is shot.
    pub fn set(&self) -> &Set {
        &self.set
    }

    /// Shoots everything in order; `sink` sees each frame once.
    /// Fails as the sink does.
    pub fn run(
        &self,
        mut sink: impl FnMut(&PlannedShot, &Plane<u16>) -> Result<(), Error>,
    ) -> Result<ChannelMeasurement, Error> {
        let mut measurement = ChannelMeasurement::new(&self.set);
        for shot in self.set.shots() {
            let codes = self.frame(&shot);
            sink(&shot, &codes)?;
            measurement.add(&shot, &codes);
        }
        Ok(measurement)
    }

    /// Codes of one shot.
    pub fn frame(&self, shot: &PlannedShot) -> Plane<u16> {
        super::shoot::capture_frame(&self.chain, &self.set, shot, &self.times)
    }

    /// What the configuration implies for this set.
    pub fn truth(&self) -> ChannelTruth {
        super::truth::truth(&self.sensor, &self.set)
    }

    /// The sensor under test.
    pub fn sensor(&self) -> &SensorSetup {
        &self.sensor
    }
}
