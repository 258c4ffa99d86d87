//! From a resolved scenario to everything a run needs, checked before the first frame: scene under light, motion, cameras,
//! schedule, plan, link, tracker's calibration.

use glam::{DQuat, DVec3};

use super::assets::{Assets, Progress};
use super::light::lit_scene;
use super::motion::placed_motion;
use crate::compute::ExtractorParams;
use crate::config::Resolved;
use crate::effects::chain::Chain;
use crate::effects::plan::{self, Kept, Omitted};
use crate::effects::regions::{self, LightBounds};
use crate::effects::{self, Parameters};
use crate::energy::Technology;
use crate::error::Error;
use crate::events::Block;
use crate::fidelity::Fidelity;
use crate::link::LinkParams;
use crate::num::{f64_from_u64, f64_from_usize};
use crate::optics::{self, Camera, Mosaic};
use crate::pose::Pose;
use crate::readout::{AutoExposure, CodeRange, FrameLength, Geometry, Schedule, Shutter};
use crate::scene::LitScene;
use crate::scene::motion::Motion;
use crate::tracker::{CameraCalibration, TrackerParams};
use crate::units::{FrameIndex, RowIndex, Size, Span};

/// What the planner decided, without the effects themselves.
#[derive(Clone, Debug)]
pub struct PlanSummary {
    /// Run, in physical order.
    pub kept: Vec<Kept>,
    /// Left out, in physical order.
    pub omitted: Vec<Omitted>,
    /// Sum of the systematic bounds in electrons, in the region where the whole bound is greatest.
    pub bias_e: f64,
    /// Root of the sum of the variances in electrons, in the same region.
    pub sigma_e: f64,
    /// What all omissions together were allowed to reach in the tightest region, in electrons.
    pub budget_e: f64,
    /// Predicted cost of the kept effects.
    pub cost_ns_per_px: f64,
    /// Bounds of a pixel's mean signal that the plan was made for, in electrons.
    pub signal_e: [f64; 2],
}

/// A sensor's parameters and times, without any scene: enough for `timing`.
#[derive(Clone, Debug)]
pub struct SensorSetup {
    /// The array; `schedule.output_size()` is the picture.
    pub size: Size,
    /// Colour filters over the pixels.
    pub mosaic: Mosaic,
    /// Pixel and converters.
    pub parameters: Parameters,
    /// The sequencer's times.
    pub schedule: Schedule,
    /// The link.
    pub link: LinkParams,
    /// The extractor.
    pub extractor: ExtractorParams,
    /// Constants of energy.
    pub technology: Technology,
}

/// Everything a run needs.
pub struct Setup {
    /// The scenario as it was resolved.
    pub resolved: Resolved,
    /// Knobs of accuracy.
    pub fidelity: Fidelity,
    /// Frames of the run.
    pub frames: u32,
    /// The sensor, alike for all cameras.
    pub sensor: SensorSetup,
    /// The scene under its light.
    pub scene: LitScene,
    /// How the body moves.
    pub motion: Motion,
    /// Cameras on the body.
    pub cameras: Vec<Camera>,
    /// What the planner decided.
    pub plan: PlanSummary,
    /// Photons to codes.
    pub chain: Chain,
    /// The tracker's knobs.
    pub tracker: TrackerParams,
}

impl SensorSetup {
    /// Checks sensor, extractor, link and technology.
    ///
    /// # Errors
    /// Any value out of range or combination that cannot be; with file, line, key, value and what would do.
    pub fn new(resolved: &Resolved) -> Result<Self, Error> {
        Self::build(resolved).map_err(|error| resolved.tree.locate(error))
    }

    /// Mean photons that fill a pixel's well, or its converter's range where that is less.
    pub fn saturation_photons(&self) -> f64 {
        let (pixel, adc) = (&self.parameters.pixel, &self.parameters.adc);
        let range_e = adc.saturation_uv() / pixel.conversion_gain_uv_per_e;
        crate::num::lesser(range_e, pixel.full_well_e) / (pixel.quantum_efficiency * pixel.fill_factor)
    }

    /// Columns and rows after which the colour filters repeat.
    pub fn pattern_px(&self) -> (usize, usize) {
        (self.mosaic.width_px(), self.mosaic.height_px())
    }

    /// The controller of an automatic exposure, as it stands before the first frame; none where the exposure is fixed.
    ///
    /// # Errors
    /// Limits that contradict schedule or converter.
    pub fn auto_exposure(&self) -> Result<Option<AutoExposure>, Error> {
        let adc = &self.parameters.adc;
        let range = CodeRange { black_dn: adc.black_level_dn.into(), max_dn: adc.code_max().into(), gain: adc.gain };
        let auto = self.schedule.params().auto.as_ref();
        auto.map(|auto| AutoExposure::new(auto, &self.schedule, range)).transpose()
    }

    fn build(resolved: &Resolved) -> Result<Self, Error> {
        let scenario = &resolved.scenario;
        let size = scenario.size()?;
        let parameters = Parameters { pixel: scenario.pixel()?, adc: scenario.adc()? };
        parameters.adc.check_pitch(&parameters.pixel)?;
        let link = scenario.link()?;
        let readout = scenario.readout()?;
        let output = Geometry::new(size, &readout)?.output_size();
        let packet_time_s = if link.mode.sends_codes() {
            link.seconds(link.line_packet_time(output.width_px, parameters.adc.bits)?)
        } else {
            0.0
        };
        let schedule = Schedule::new(size, &readout, &parameters.adc, packet_time_s)?;
        let extractor = scenario.extractor()?;
        let sensor_frame =
            FrameOnLink { size: output, bits: parameters.adc.bits, features: extractor.top_k.unwrap_or(0).into() };
        sensor_frame.check(&link, &schedule)?;
        let technology = Technology::by_name(&scenario.energy.technology)
            .map_err(|error| Error::key("energy.technology", &scenario.energy.technology, error.to_string()))?;
        let technology = if link.mode.sends_features() { technology } else { technology.without(Block::Compute) };
        let mosaic = scenario.mosaic()?.0;
        let setup = Self { size, mosaic, parameters, schedule, link, extractor, technology };
        setup.auto_exposure()?;
        Ok(setup)
    }
}

impl Setup {
    /// Checks the whole scenario and bakes (or loads) its light.
    ///
    /// # Errors
    /// As `SensorSetup::new`; files that are missing or not what they should be; a trajectory shorter than the run.
    pub fn new(resolved: Resolved, assets: &dyn Assets, progress: &dyn Progress) -> Result<Self, Error> {
        let sensor = SensorSetup::new(&resolved)?;
        Self::build(&resolved, sensor, assets, progress).map_err(|error| resolved.tree.locate(error)).map(|parts| {
            let Parts { fidelity, frames, sensor, scene, motion, cameras, plan, chain, tracker } = parts;
            Self { resolved, fidelity, frames, sensor, scene, motion, cameras, plan, chain, tracker }
        })
    }

    fn build(
        resolved: &Resolved,
        sensor: SensorSetup,
        assets: &dyn Assets,
        progress: &dyn Progress,
    ) -> Result<Parts, Error> {
        check_runs(&sensor.schedule)?;
        let scenario = &resolved.scenario;
        let (fidelity, frames) = (scenario.fidelity()?, scenario.frames()?);
        let choice = scenario.effects(&effects::names())?;
        let cameras = cameras(resolved, &sensor)?;
        let tracker = scenario.tracker_params()?;
        let run =
            Span { start_s: 0.0, end_s: sensor.schedule.exposure(FrameIndex(frames - 1), last_row(sensor.size)).end_s };
        let motion = placed_motion(scenario, run, assets)?;
        let start =
            motion.world_from_body(0.0).map_err(|error| error.at_key("motion.start_s", scenario.motion.start_s))?;
        let scene = lit_scene(scenario, start.translation_m, assets, progress)?;

        let light = photon_bounds(&scene, &cameras, &sensor);
        let exposure_s = sensor.schedule.exposure(FrameIndex(0), RowIndex(0)).length_s();
        let pixels = f64_from_usize(sensor.size.pixel_count());
        let storage_s = sensor.schedule.storage_s_max();
        let regions = regions::regions(&sensor.parameters, light, exposure_s, storage_s, pixels);
        let plan = plan::plan(effects::build_all(&sensor.parameters), &regions, fidelity.accuracy, &choice);
        let pixel = &sensor.parameters.pixel;
        let efficiency = pixel.quantum_efficiency * pixel.fill_factor;
        let summary = PlanSummary {
            kept: plan.kept,
            omitted: plan.omitted,
            bias_e: plan.bound.bias_e,
            sigma_e: plan.bound.variance_e2.sqrt(),
            budget_e: plan.budget_e,
            cost_ns_per_px: plan.cost_ns_per_px,
            signal_e: [light.photons_min * efficiency, light.photons_max * efficiency],
        };
        let chain = Chain::new(sensor.parameters.clone(), plan.effects, scenario.seed, scenario.sensor.die);
        let chain = chain.at(fidelity.rung);
        Ok(Parts { fidelity, frames, sensor, scene, motion, cameras, plan: summary, chain, tracker })
    }

    /// What the tracker is told of the cameras.
    pub fn calibration(&self) -> Vec<CameraCalibration> {
        let of = |camera: &Camera| CameraCalibration {
            lens: camera.lens,
            size: camera.size,
            body_from_camera: camera.body_from_camera,
        };
        self.cameras.iter().map(of).collect()
    }

    /// Whether rows are exposed one after the other.
    pub fn is_rolling(&self) -> bool {
        self.sensor.schedule.shutter() == Shutter::Rolling
    }
}

/// What one frame puts on the link.
pub(super) struct FrameOnLink {
    pub size: Size,
    pub bits: u32,
    pub features: u64,
}

impl FrameOnLink {
    /// Whether rows, features and the packets around them pass within a frame's time.
    ///
    /// # Errors
    /// They do not; the error names the frame length that would do.
    pub fn check(&self, link: &LinkParams, schedule: &Schedule) -> Result<(), Error> {
        let busy = link.traffic(self.size, self.bits, self.features)?.busy;
        let rows = if link.mode.sends_codes() { self.size.height_px } else { 0 };
        let row_time_s =
            if rows > 0 { link.seconds(link.line_packet_time(self.size.width_px, self.bits)?) } else { 0.0 };
        // Rows leave as they are read; everything else needs the lines that are left.
        let rows_lines = if rows > 0 { f64_from_u64(schedule.frame_demand().rows) } else { 0.0 };
        let rest_s = link.seconds(busy) - f64::from(rows) * row_time_s;
        let lines = rows_lines + (rest_s / schedule.line_time_s()).ceil();
        // A triggered frame has its trigger's period; a millionth of a line is rounding.
        if lines <= schedule.frame_time_s() / schedule.line_time_s() + 1e-6 {
            return Ok(());
        }
        let needed = format!("rows and {} features a frame need {lines:.0} lines on this link", self.features);
        if let FrameLength::RateHz(rate_hz) = schedule.params().frame {
            let fastest_hz = 1.0 / (lines * schedule.line_time_s());
            let reason = format!("{needed}; {fastest_hz:.3} or less, fewer features or a faster link would do");
            return Err(Error::key("sensor.readout.frame_rate_hz", rate_hz, reason));
        }
        let reason = format!("{needed}; vts = {lines:.0}, fewer features or a faster link would do");
        Err(Error::key("sensor.readout.vts", schedule.vts(), reason))
    }
}

/// Refuses what the schedule knows and a run does not carry through its pixels, rather than leaving it out.
fn check_runs(schedule: &Schedule) -> Result<(), Error> {
    let readout = schedule.params();
    let skewed = readout.sync_skew_ns.iter().any(|&skew_ns| skew_ns > 0);
    let drifts = readout.clock_ppb.iter().any(|&ppb| ppb != 0);
    let asked = [
        (readout.window.is_some(), "window", "leaving it out"),
        (readout.binning > 1, "binning", "1"),
        (readout.hdr.exposures() > 1, "hdr", "none"),
        (readout.auto.is_some(), "exposure", "fixed"),
        (skewed, "sync_skew_us", "0"),
        (drifts, "clock_ppm", "0"),
    ];
    let Some((_, key, would_do)) = asked.into_iter().find(|(is_asked, ..)| *is_asked) else { return Ok(()) };
    let reason = format!("`timing` knows it, a run comes with a later version; {would_do} would do");
    Err(Error::key(&format!("sensor.readout.{key}"), "", reason))
}

/// All of `Setup` but the scenario that it was made from.
struct Parts {
    fidelity: Fidelity,
    frames: u32,
    sensor: SensorSetup,
    scene: LitScene,
    motion: Motion,
    cameras: Vec<Camera>,
    plan: PlanSummary,
    chain: Chain,
    tracker: TrackerParams,
}

fn last_row(size: Size) -> RowIndex {
    RowIndex(size.height_px - 1)
}

fn cameras(resolved: &Resolved, sensor: &SensorSetup) -> Result<Vec<Camera>, Error> {
    let scenario = &resolved.scenario;
    let (rotation, places_m): (DQuat, Vec<DVec3>) = scenario.cameras()?;
    let lens = scenario.lens()?;
    let (aperture, roll_off) = scenario.aperture()?;
    let pitch_um = sensor.parameters.pixel.pitch_um;
    let camera = |place_m: DVec3| {
        let body_from_camera = Pose::new(rotation, rotation * place_m);
        let camera = Camera::new(lens, sensor.size, body_from_camera, aperture, pitch_um, roll_off)?;
        Ok(camera.with_mosaic(sensor.mosaic.clone()))
    };
    places_m.into_iter().map(camera).collect()
}

/// Bounds of a pixel's mean photons, from the scene's light and the lens alone.
fn photon_bounds(scene: &LitScene, cameras: &[Camera], sensor: &SensorSetup) -> LightBounds {
    let exposure_s = sensor.schedule.exposure(FrameIndex(0), RowIndex(0)).length_s();
    let [photons_min, photons_max] = optics::photon_bounds(scene, &cameras[0], exposure_s);
    LightBounds { photons_min, photons_max }
}
