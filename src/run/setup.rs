//! From a resolved scenario to everything a run needs, checked before the first frame: scene under light, motion, cameras,
//! schedule, plan, link, tracker's calibration.

use crate::fidelity::{Fidelity, Rung};
use crate::units::{CameraIndex, FrameIndex, RowIndex, Size, Span};
use std::sync::Arc;

use glam::DVec2;

use super::assets::{Assets, NoFiles, NoProgress, PhotonStore, Progress};
use super::exposure_control::ExposureControl;
use super::facts::FactInputs;
use super::imu_check::check_readings;
use super::motion::placed_motion;
pub use super::plan_summary::PlanSummary;
use super::sensor::SensorSetup;
use super::warnings::Warnings;
use super::world::{Demand, World};
use crate::config::check::within;
use crate::config::{Resolved, Scenario};
use crate::effects::chain::Chain;
use crate::effects::plan::{self, EffectChoice, Plan};
use crate::effects::regions::LightBounds;
use crate::effects::{self, Parameters, regions};
use crate::error::Error;
use crate::facts::{DieSpread, ScenarioFacts};
use crate::num::{f64_from_usize, greater, lesser, u32_from};
use crate::optics::lens::Lens;
use crate::optics::{Camera, Rounding};
use crate::pixel;
use crate::pose::Pose;
use crate::readout::{Geometry, Schedule, Shutter};
use crate::rtl_simulator::SharedRtlSimulator;
use crate::scene::motion::Motion;
use crate::scene::motion::imu::Imu;
use crate::tracker::{CameraCalibration, Tracker, TrackerParams};

/// Everything a run needs.
#[derive(Clone)]
pub struct Setup {
    /// The scenario as it was resolved.
    pub resolved: Resolved,
    /// Knobs of accuracy.
    pub fidelity: Fidelity,
    /// Frames of the run.
    pub frames: u32,
    /// The sensor, alike for all cameras.
    pub sensor: SensorSetup,
    /// What is looked at.
    pub world: Arc<World>,
    /// What a person should know of it.
    pub scene_notes: Vec<String>,
    /// How the body moves.
    pub motion: Motion,
    /// What was put right or bridged in the motion's file, for a person.
    pub motion_notes: Vec<String>,
    /// The IMU on the body, if there is one.
    pub imu: Option<Imu>,
    /// Whether the tracker takes its readings.
    pub(super) uses_imu: bool,
    /// Cameras on the body, with the pixels of their pictures.
    pub cameras: Vec<Camera>,
    /// The same cameras with the pixels of the array that are read.
    pub windows: Vec<Camera>,
    /// Exposure and gain of each frame.
    pub(super) exposure: ExposureControl,
    /// What was known before anything was simulated.
    pub facts: ScenarioFacts,
    /// What the planner decided.
    pub plan: PlanSummary,
    /// The effects that run.
    chosen: ChosenEffects,
    /// The tracker's knobs.
    pub tracker: TrackerParams,
    /// What runs the Verilog, on the rung `rtl`.
    verilog: Option<SharedRtlSimulator>,
    /// Where photons are kept from run to run.
    pub(super) photon_store: Option<Arc<dyn PhotonStore>>,
    /// What a user should know of this setup before its first frame.
    pub warnings: Warnings,
}

impl Setup {
    /// Checks the whole scenario and bakes (or loads) its light.
    pub fn new(mut resolved: Resolved, assets: &dyn Assets, progress: &dyn Progress) -> Result<Self, Error> {
        resolved.read_technology(&|name| assets.read(name))?;
        Self::located(resolved, assets, progress, None)
    }

    /// The same world and run under another configuration of sensor, effects and knobs of accuracy: nothing is lit or read again. Scene,
    /// motion, rig and number of frames must be this one's.
    pub fn again(&self, resolved: Resolved) -> Result<Self, Error> {
        Self::located(resolved, &NoFiles, &NoProgress, Some(TakenOver { setup: self, is_compared: false }))
    }

    /// Another configuration, which takes over what it has in common with this one: the motion where `[motion]`, `[rig]` and the run's
    /// times are equal, and the scene under its light where `[scene]` and the start are, and cameras of equal
    /// lenses and pixels. The bytes are those of `new`.
    pub fn beside(&self, mut resolved: Resolved, assets: &dyn Assets, progress: &dyn Progress) -> Result<Self, Error> {
        resolved.read_technology(&|name| assets.read(name))?;
        Self::located(resolved, assets, progress, Some(TakenOver { setup: self, is_compared: true }))
    }

    fn located(
        resolved: Resolved,
        assets: &dyn Assets,
        progress: &dyn Progress,
        taken: Option<TakenOver<'_>>,
    ) -> Result<Self, Error> {
        let tree = resolved.tree.clone();
        Self::build(resolved, assets, progress, taken).map_err(|error| tree.locate(error))
    }

    fn build(
        resolved: Resolved,
        assets: &dyn Assets,
        progress: &dyn Progress,
        taken: Option<TakenOver<'_>>,
    ) -> Result<Self, Error> {
        let sensor = SensorSetup::new(&resolved)?;
        let kept = taken.as_ref().map(|taken| taken.setup);
        let scenario = &resolved.scenario;
        let (fidelity, frames) = (scenario.fidelity()?, scenario.frames()?);
        let choice = scenario.effects(&effects::names())?;
        let (cameras, windows) = match taken.as_ref().and_then(|taken| taken.cameras_for(scenario, &sensor)) {
            Some(kept) => (kept.cameras.clone(), kept.windows.clone()),
            None => cameras(&resolved, &sensor)?,
        };
        let exposure = ExposureControl::new(&sensor, cameras.len())?;
        let tracker = scenario.tracker_params()?;
        let imu = scenario.imu()?;
        let verilog = match (fidelity.rung, kept.and_then(|kept| kept.verilog.clone())) {
            (Rung::Rtl, None) => Some(SharedRtlSimulator::new(assets.rtl_simulator()?)),
            (_, kept) => kept,
        };
        let uses_imu = scenario.tracker_uses_imu(imu.is_some())?;
        let run_span = span_of_run(&sensor, cameras.len(), frames);
        check_end(&sensor, frames, run_span.end_s)?;
        check_readings(imu.as_ref(), run_span.end_s)?;
        let (motion, motion_notes) = match taken.as_ref().and_then(|taken| taken.motion_for(scenario, run_span)) {
            Some(kept) => (kept.motion.clone(), kept.motion_notes.clone()),
            None => placed_motion(scenario, run_span, assets).map(|placed| (placed.motion, placed.notes))?,
        };
        let start =
            motion.world_from_body(0.0).map_err(|error| error.at_key("motion.start_s", scenario.motion.start_s))?;
        let exposed_from_s = first_exposure_s(&sensor, windows.len());
        let span_of = |frames: u32| Span { start_s: exposed_from_s, ..span_of_run(&sensor, windows.len(), frames) };
        let demand = Demand { start_m: start.translation_m, cameras: &windows, frames, span_of: &span_of };
        let (world, scene_notes) = match taken
            .as_ref()
            .and_then(|taken| taken.world_for(scenario, start.translation_m, run_span))
        {
            Some(kept) => (kept.world.clone(), kept.scene_notes.clone()),
            None => World::new(scenario, &demand, assets, progress).map(|(world, notes)| (Arc::new(world), notes))?,
        };

        let (run, dies) = (span_of(frames), dies(&sensor, scenario, windows.len()));
        let known = FactInputs { sensor: &sensor, world: &world, motion: &motion, windows: &windows, run, dies };
        let (facts, plan, chosen) = planned(&known, fidelity, &choice)?;
        let mut setup = Self {
            resolved,
            fidelity,
            frames,
            sensor,
            world,
            scene_notes,
            motion,
            motion_notes,
            imu,
            uses_imu,
            cameras,
            windows,
            exposure,
            facts,
            plan,
            chosen,
            tracker,
            verilog,
            photon_store: kept.and_then(|kept| kept.photon_store.clone()),
            warnings: Warnings::default(),
        };
        let (start, sleep) = (short_start(&setup), sleep_warning(&setup.sensor));
        setup
            .resolved
            .inheritance_warnings()
            .into_iter()
            .chain(start)
            .chain(sleep)
            .for_each(|text| setup.warnings.add(text));
        if setup.fidelity.rung == Rung::Expected {
            setup.first_chain().check_expected()?;
        }
        Ok(setup)
    }

    /// Facts and plan, made anew from the loaded scene: what `new` made, for measuring how long that takes.
    pub fn planned_anew(&self) -> Result<(ScenarioFacts, PlanSummary), Error> {
        let first_s = first_exposure_s(&self.sensor, self.windows.len());
        let run = Span { start_s: first_s, ..span_of_run(&self.sensor, self.windows.len(), self.frames) };
        let (sensor, world, motion, windows) = (&self.sensor, &self.world, &self.motion, &self.windows[..]);
        let choice = self.resolved.scenario.effects(&effects::names())?;
        let dies = dies(sensor, &self.resolved.scenario, windows.len());
        planned(&FactInputs { sensor, world, motion, windows, run, dies }, self.fidelity, &choice)
            .map(|(facts, plan, _)| (facts, plan))
    }

    /// Photons to codes, at a gain of the ramp.
    pub fn chain(&self, gain: f64) -> Chain {
        let scenario = &self.resolved.scenario;
        let chosen = [&self.chosen[0][..], &self.chosen[1][..]];
        self.sensor
            .chain(gain, chosen, scenario.seed, scenario.sensor.die)
            .on_rung(self.fidelity.rung)
            .in_verilog(self.verilog())
    }

    /// What runs the Verilog, on the rung `rtl`.
    pub(super) fn verilog(&self) -> Option<&SharedRtlSimulator> {
        self.verilog.as_ref().filter(|_| self.fidelity.rung == Rung::Rtl)
    }

    /// Camera calibrations for the tracker.
    pub fn calibration(&self) -> Vec<CameraCalibration> {
        calibrations(&self.cameras)
    }

    /// A tracker of the cameras alone. Fails on a calibration that it refuses.
    pub(super) fn camera_tracker(&self) -> Result<Tracker, Error> {
        Tracker::new(self.calibration(), self.tracker).map_err(|error| self.resolved.tree.locate(error))
    }

    /// When the last exposure of the run ends.
    pub fn end_s(&self) -> f64 {
        span_of_run(&self.sensor, self.windows.len(), self.frames).end_s
    }

    /// Whether every exposure of the same length sees the same light: nothing moves and nothing flickers.
    pub fn is_still(&self) -> bool {
        self.world.is_still(&self.motion)
    }

    /// Whether rows are exposed one after the other.
    pub fn is_rolling(&self) -> bool {
        self.sensor.schedule.shutter() == Shutter::Rolling
    }
}

/// A setup of which another one takes parts over.
struct TakenOver<'a> {
    setup: &'a Setup,
    /// Whether only what is equal is taken; else the caller knows that scene, motion and run are.
    is_compared: bool,
}

impl<'a> TakenOver<'a> {
    /// Cameras follow from lens, rig, the pixels that are read, and the filters between lens and photodiode.
    fn cameras_for(&self, scenario: &Scenario, sensor: &SensorSetup) -> Option<&'a Setup> {
        let (own, own_sensor) = (&self.setup.resolved.scenario, &self.setup.sensor);
        let pixel_of = |scenario: &Scenario| {
            let pixel = &scenario.sensor.pixel;
            let infrared = pixel.electrical_crosstalk_nir.map(f64::to_bits);
            let shared = [pixel.pitch_um, pixel.optical_crosstalk, pixel.electrical_crosstalk].map(f64::to_bits);
            (shared, infrared, scenario.sensor.width, scenario.sensor.height)
        };
        let read_of = |sensor: &SensorSetup| (sensor.array, sensor.size, *sensor.schedule.geometry());
        let is_equal = own.optics == scenario.optics
            && own.rig == scenario.rig
            && pixel_of(own) == pixel_of(scenario)
            && own_sensor.mosaic == sensor.mosaic
            && read_of(own_sensor) == read_of(sensor);
        (self.is_compared && is_equal).then_some(self.setup)
    }

    fn motion_for(&self, scenario: &Scenario, run: Span) -> Option<&'a Setup> {
        let own = &self.setup.resolved.scenario;
        let own_run = span_of_run(&self.setup.sensor, self.setup.cameras.len(), self.setup.frames);
        let is_equal = own.motion == scenario.motion && own.rig == scenario.rig && own_run == run;
        (!self.is_compared || is_equal).then_some(self.setup)
    }

    fn world_for(&self, scenario: &Scenario, start_m: glam::DVec3, run: Span) -> Option<&'a Setup> {
        let own = &self.setup.resolved.scenario;
        let own_start_m = self.setup.motion.world_from_body(0.0).ok()?.translation_m;
        // Pictures from elsewhere are bound to cameras and times of the run.
        // What moves is bound to the run's times.
        let same_times = scenario.scene.object.is_empty() || self.motion_for(scenario, run).is_some();
        let is_equal =
            own.scene == scenario.scene && scenario.scene.images.is_none() && own_start_m == start_m && same_times;
        (!self.is_compared || is_equal).then_some(self.setup)
    }
}

/// Names of effects in the first reading and in the second.
type ChosenEffects = [Vec<&'static str>; 2];

/// Facts, the plan's summary, and the effects that run, from what is known; renders nothing.
fn planned(
    known: &FactInputs<'_>,
    fidelity: Fidelity,
    choice: &EffectChoice,
) -> Result<(ScenarioFacts, PlanSummary, ChosenEffects), Error> {
    let sensor = known.sensor;
    let exposures_s = exposure_bounds_s(&sensor.schedule);
    let exact = known.world.photon_bounds(known.windows, exposures_s);
    let light = Rounding::new(fidelity.render.rounding_sigma).map_or(exact, |rounding| {
        let [photons_min, photons_max] = rounding.widened([exact.photons_min, exact.photons_max]);
        LightBounds { photons_min, photons_max }
    });
    let plan_of = |parameters: &Parameters| {
        let storage_s = sensor.schedule.storage_s_max();
        let regions = regions::regions(parameters, light, exposures_s[1], storage_s, known.dies);
        plan::plan(effects::build_all(parameters), &regions, fidelity.accuracy, choice)
    };
    let plan = plan_of(&sensor.parameters);
    let chosen_second = sensor.second.as_ref().map_or_else(Vec::new, |second| names(&plan_of(second)));
    let chosen = [names(&plan), chosen_second];
    let signal_e = [light.photons_min, light.photons_max].map(|photons| photons * sensor.electrons_per_photon());
    let facts = known.facts(light, exposures_s)?;
    Ok((facts, PlanSummary::new(plan, signal_e, sensor, known.windows.len()), chosen))
}

/// How far the rig's dies lie from the mean of all dies.
fn dies(sensor: &SensorSetup, scenario: &Scenario, cameras: usize) -> DieSpread {
    let (pixel, array) = (&sensor.parameters.pixel, sensor.schedule.geometry().array_size());
    pixel::die_spread(pixel, scenario.sensor.die, u32_from(cameras), array)
}

fn names(plan: &Plan) -> Vec<&'static str> {
    plan.effects.iter().map(|effect| effect.name()).collect()
}

/// Longest run: its stamps are nanoseconds in 64 bits, and the host's times rise by at least one of them.
const RUN_S_MAX: f64 = 9e9;

/// Refuses a run whose stamps would leave their range.
fn check_end(sensor: &SensorSetup, frames: u32, end_s: f64) -> Result<(), Error> {
    if end_s <= RUN_S_MAX {
        return Ok(());
    }
    let frame_s = sensor.schedule.frame_time_s();
    let most = (RUN_S_MAX / frame_s - 2.0).floor();
    let fewer = if most >= 1.0 { format!("use {most} or fewer") } else { "use a higher frame rate".to_owned() };
    Err(Error::key("run.frames", frames, format!("frames of {frame_s} s would end after {RUN_S_MAX:e} s; {fewer}")))
}

/// What a sensor that sleeps between frames has to say where frames come at another period than it sleeps by.
fn sleep_warning(sensor: &SensorSetup) -> Option<String> {
    let period_s = sensor.power.sensor.params.period_s?;
    let frame_s = sensor.schedule.frame_time_s();
    let (period_ms, frame_ms) = (1e3 * period_s, 1e3 * frame_s);
    ((period_s - frame_s).abs() > 1e-9).then(|| {
        format!(
            "energy.sleep_period_ms = {period_ms} counts for power alone: frames, poses, bits and latency are those of a frame every \
             {frame_ms:.3} ms; for one rate use sensor.readout.trigger = external with trigger_period_us = {}",
            1e3 * period_ms
        )
    })
}

/// From the start of the run to the end of its last exposure, whichever camera's.
pub(super) fn span_of_run(sensor: &SensorSetup, cameras: usize, frames: u32) -> Span {
    let end_s = |camera| {
        let schedule = sensor.schedule.for_camera(CameraIndex(u32_from(camera)));
        schedule.span(schedule.frame_window_clk(FrameIndex(frames - 1))).end_s
    };
    Span { start_s: 0.0, end_s: (0..cameras).fold(0.0, |most, camera| greater(most, end_s(camera))) }
}

/// When light is first gathered, by whichever camera: from the start of the run on where exposures may grow.
pub(super) fn first_exposure_s(sensor: &SensorSetup, cameras: usize) -> f64 {
    if sensor.schedule.params().auto.is_some() {
        return 0.0;
    }
    let start_s = |camera| {
        let schedule = sensor.schedule.for_camera(CameraIndex(u32_from(camera)));
        schedule.span(schedule.frame_window_clk(FrameIndex(0))).start_s
    };
    (0..cameras).fold(f64::INFINITY, |least, camera| lesser(least, start_s(camera)))
}

/// Shortest and longest exposure that a frame of the run can have, in seconds.
fn exposure_bounds_s(schedule: &Schedule) -> [f64; 2] {
    let last = schedule.slots().len() - 1;
    let of = |schedule: &Schedule, slot| schedule.slot_exposure(FrameIndex(0), slot, RowIndex(0)).length_s();
    let (mut least_s, mut most_s) = (of(schedule, last), of(schedule, 0));
    if schedule.params().auto.is_some() {
        let bounds = [u64::from(schedule.params().exposure_lines_min).max(1), schedule.exposure_lines_max()];
        for changed in bounds.iter().filter_map(|&lines| schedule.with_exposure(lines, 0).ok()) {
            (least_s, most_s) = (lesser(least_s, of(&changed, last)), greater(most_s, of(&changed, 0)));
        }
    }
    [least_s, most_s]
}

/// Cameras with the pixels of their pictures, and with those of the array that are read.
pub(super) fn cameras(resolved: &Resolved, sensor: &SensorSetup) -> Result<(Vec<Camera>, Vec<Camera>), Error> {
    let scenario = &resolved.scenario;
    let body_from_cameras = scenario.cameras()?;
    let geometry = sensor.schedule.geometry();
    let window = geometry.window();
    let read = Size { width_px: window.width_px, height_px: window.height_px };
    let array_lens = scenario.lens()?;
    let window_lens = array_lens.of_part(DVec2::new(window.x_px.into(), window.y_px.into()), 1.0);
    let picture_lens = array_lens.of_part(first_position_px(geometry), geometry.binning().into());
    let (aperture, roll_off) = scenario.aperture()?;
    let infrared = within(
        "optics.infrared_transmission",
        scenario.optics.infrared_transmission,
        0.0..=1.0,
        "0 (a cut filter) to 1",
    )?;
    let pitch_um = sensor.parameters.pixel.pitch_um;
    let camera = |body_from_camera: Pose, lens: Lens, size: Size| {
        let camera = Camera::new(lens, size, body_from_camera, aperture, pitch_um, roll_off)?;
        Ok(camera.with_mosaic(sensor.mosaic.clone()).with_infrared(infrared))
    };
    let all = |lens: Lens, size: Size| -> Result<Vec<Camera>, Error> {
        body_from_cameras.iter().map(|&body_from_camera| camera(body_from_camera, lens, size)).collect()
    };
    let windows: Result<Vec<Camera>, Error> =
        all(window_lens, read)?.into_iter().map(|window| scenario.fitted(window)).collect();
    Ok((all(picture_lens, sensor.size)?, windows?))
}

/// What the tracker knows of cameras.
pub(super) fn calibrations(cameras: &[Camera]) -> Vec<CameraCalibration> {
    let of = |camera: &Camera| {
        let Camera { lens, size, body_from_camera, .. } = *camera;
        CameraCalibration { lens, size, body_from_camera }
    };
    cameras.iter().map(of).collect()
}

/// Position in the array of the picture's first pixel: the middle of the pixels that it is made of, and, behind colour filters, the mean
/// over one pattern of the picture, since binned pixels of a mosaic do not lie evenly.
fn first_position_px(geometry: &Geometry) -> DVec2 {
    let (mut sum, count) = (DVec2::ZERO, 4_u32);
    let step = f64::from(geometry.binning());
    for number in 0..count {
        let mean =
            |pixels: Vec<u32>| pixels.iter().map(|&pixel| f64::from(pixel)).sum::<f64>() / f64_from_usize(pixels.len());
        let columns = geometry.columns_of(number).collect();
        let rows = geometry.rows_of(RowIndex(number)).map(|row| row.0).collect();
        sum += DVec2::new(mean(columns), mean(rows)) - step * f64::from(number);
    }
    sum / f64::from(count)
}

/// Angle at which the rays of a map's first points must meet (`tracker`: two-view start).
pub(super) const START_RAD: f64 = 0.04;

/// Features of a frame below which a pose is chance.
pub(super) const FEATURES_LEAST: f64 = 20.0;

/// What is wrong with a run of one camera that moves too little to start a map, if so.
pub(super) fn short_start(setup: &Setup) -> Option<String> {
    // The rung expected has no poses; pictures from elsewhere have no path and no depth that is known.
    if setup.fidelity.rung == Rung::Expected || setup.cameras.len() != 1 || setup.world.scene().is_none() {
        return None;
    }
    let span = Span { start_s: 0.0, end_s: setup.end_s() };
    let (low_m, high_m) = setup.motion.extent_m(span).ok()?;
    let depth_m = setup.facts.facts.iter().find(|fact| fact.name == "depth_m")?.least;
    let (path_m, needed_m) = ((high_m - low_m).length(), START_RAD * depth_m);
    (path_m < needed_m).then(|| {
        format!(
            "run.frames = {} is too short for one camera to start a map: it moves within {path_m:.3} m and needs {needed_m:.3} m or more \
             past surfaces {depth_m:.2} m away; raise run.frames, move faster, or set rig.baseline_mm = 65 for two cameras",
            setup.frames
        )
    })
}
