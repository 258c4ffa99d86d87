//! Refuses a scenario for the reasons of which a run knows before its first frame, without baking light.

use super::assets::Assets;
use super::exposure_control::ExposureControl;
use super::motion::placed_motion;
use super::sensor::SensorSetup;
use super::setup::{Setup, calibrations, cameras, first_exposure_s, span_of_run};
use super::world::{Demand, World};
use crate::config::Resolved;
use crate::effects;
use crate::error::Error;
use crate::fidelity::Rung;
use crate::tracker::Tracker;
use crate::units::Span;

impl Setup {
    /// Refuses what `new` and `Session::new` refuse, but for what only the baked light tells. A scenario that names no scene is judged by
    /// the rest of it.
    pub fn check(resolved: &Resolved, assets: &dyn Assets) -> Result<(), Error> {
        let mut resolved = resolved.clone();
        resolved.read_technology(&|name| assets.read(name))?;
        check(&resolved, assets).map_err(|error| resolved.tree.locate(error))
    }
}

fn check(resolved: &Resolved, assets: &dyn Assets) -> Result<(), Error> {
    let sensor = SensorSetup::new(resolved)?;
    let scenario = &resolved.scenario;
    scenario.threads()?;
    let (fidelity, frames) = (scenario.fidelity()?, scenario.frames()?);
    scenario.effects(&effects::names())?;
    let (cameras, windows) = cameras(resolved, &sensor)?;
    ExposureControl::new(&sensor, cameras.len())?;
    let params = scenario.tracker_params()?;
    let imu = scenario.imu()?;
    scenario.tracker_uses_imu(imu.is_some())?;
    if fidelity.rung == Rung::Rtl {
        assets.rtl_simulator()?;
    }
    Tracker::new(calibrations(&cameras), params)?;
    sensor.row_delays_s()?;
    let motion = placed_motion(scenario, span_of_run(&sensor, cameras.len(), frames), assets)?.motion;
    let start = motion.world_from_body(0.0).map_err(|error| error.at_key("motion.start_s", scenario.motion.start_s))?;
    let exposed_from_s = first_exposure_s(&sensor, windows.len());
    let span_of = |frames: u32| Span { start_s: exposed_from_s, ..span_of_run(&sensor, windows.len(), frames) };
    if !scenario.scene.is_named() {
        scenario.light()?;
        return Ok(());
    }
    let demand = Demand { start_m: start.translation_m, cameras: &windows, frames, span_of: &span_of };
    World::check(scenario, &demand, assets)
}
