//! The report of a run: every figure computed from what the run counted, sent and tracked.

use super::alternatives::Counted;
use super::plan_summary::PlanSummary;
use super::state::{STAGES, Session};
use super::timing::{burst_utilisation, timing_record};
use super::totals::FrameNotes;
use super::waterfall::waterfall_reasons;
use super::world::World;
use crate::config::presets::PresetKind;
use crate::error::Error;
use crate::facts::{Fact, ScenarioFacts, Tile};
use crate::num::{f64_from_u64, f64_from_usize, u32_from, u64_from};
use crate::optics::Camera;
use crate::pose::TimedPose;
use crate::report::energy_record::EnergyRecord;
use crate::report::figures::bring_to_metres;
use crate::report::latency_record::Waterfall;
use crate::report::pose_series::pose_series;
use crate::report::record::{
    Bandwidth, ExtractorClocks, FactRecord, FrameRecord, Hashes, LinkRecord, Measured, OmittedEffect, PlanRecord,
    Scenario, StageCost, TileRecord, Timing, TrackingEvent,
};
use crate::report::{NotMeasurable, Report, median, prediction_error_m, trajectory_figures};
use crate::scene::{Illuminant, LitScene};
use crate::tracker::Status;
use crate::units::{FrameIndex, RowIndex};

/// What the plan cannot say where an effect is left out that nothing bounds.
const OF_THE_PLAN: [&str; 6] = [
    "plan.bias_e",
    "plan.sigma_e",
    "plan.budget_used",
    "plan.omitted.bias_e",
    "plan.omitted.sigma_e",
    "plan.omitted.budget_share",
];

impl Session {
    /// The report of all frames so far. `name` is what a person calls the scenario. Fails on before the first frame.
    pub fn report(&self, name: &str) -> Result<Report, Error> {
        if self.notes.is_empty() {
            return Err(Error::Run("a report needs at least one frame".to_owned()));
        }
        let setup = &self.setup;
        let mut report = Report {
            schema_version: crate::report::record::SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: setup.resolved.scenario.seed,
            config_hash: setup.resolved.hash(),
            scenario: self.scenario(name),
            plan: plan_record(&setup.plan, &setup.facts, setup.fidelity.accuracy),
            timing: self.timing()?,
            bandwidth: self.bandwidth(),
            energy: EnergyRecord { line: Some(setup.sensor.line_power()?), ..(&self.energy()).into() },
            gates: setup.sensor.gates(),
            features: self.totals.extractor.figures(),
            link: self.link(),
            hashes: self.hash_record(),
            frames: self.notes.iter().map(frame_record).collect(),
            config: setup.resolved.recorded(),
            measured: Measured { threads: threads(), ..Measured::default() },
            warnings: self.final_warnings(),
            ..Report::default()
        };
        self.set_absent(&mut report);
        self.set_costs(&mut report);
        self.set_tracking(&mut report);
        let counted = self.counted(report.tracking.ate_m, &report.timing.waterfall);
        report.alternatives = setup.sensor.alternatives(&counted)?;
        let reasons = report.alternatives.reasons();
        report.not_measurable.extend(reasons.into_iter().map(|(path, why)| (path.to_owned(), why.to_owned())));
        Ok(report)
    }

    /// Why figures of scenario, plan, timing, bandwidth and features are absent.
    fn set_absent(&self, report: &mut Report) {
        let (plan, timing) = (&report.plan, &report.timing);
        let sends_features = self.setup.sensor.link.mode.sends_features();
        let render = match *self.setup.world {
            World::Scene(_) => "one sample per pixel says nothing about its own error",
            #[cfg(feature = "pictures")]
            World::Images(_) => "pictures are integrated without chance, and their own noise is not known",
        };
        let reduction = if sends_features {
            "no feature was found, so that none was sent"
        } else {
            "link.mode = frames sends no features"
        };
        let queue = "the hardware's twin does not count its queue; use run.rung = sampled";
        let has_no_queue = timing.extractor.as_ref().is_some_and(|clocks| clocks.queue_most.is_none());
        let is_unbounded = plan.bias_e.is_none() || plan.budget_used.is_none();
        let mut absent = vec![
            ("scenario.render_variance_ratio", report.scenario.render_variance_ratio.is_none(), render),
            (
                "plan.facts.greatest",
                plan.facts.iter().any(|fact| fact.greatest.is_none()),
                "a fact that nothing bounds; its words say why",
            ),
            ("bandwidth.reduction", report.bandwidth.reduction.is_none(), reduction),
            ("timing.feature_latency_us", !sends_features, "features are not sent"),
            ("link.feature_latency_us", !sends_features, "features are not sent"),
            ("timing.first_feature_us", timing.first_feature_us.is_none(), "no feature left the extractor"),
            ("timing.last_feature_us", timing.last_feature_us.is_none(), "no feature left the extractor"),
            ("timing.extractor", timing.extractor.is_none(), "the sensor extracts nothing"),
            ("timing.extractor.queue_most", has_no_queue, queue),
            ("features.threshold", report.features.threshold.is_none(), "the sensor extracts nothing"),
        ];
        absent.extend(OF_THE_PLAN.map(|key| (key, is_unbounded, "an effect is left out that nothing bounds")));
        let absent = absent.into_iter().filter(|(_, is_absent, _)| *is_absent);
        let reasons = absent.map(|(key, _, reason)| (key.to_owned(), reason.to_owned()));
        let waterfall = waterfall_reasons(&timing.waterfall, "timing.");
        report.not_measurable.extend(reasons.chain(waterfall));
    }

    fn counted<'a>(&'a self, ate_m: Option<f64>, waterfall: &'a Waterfall) -> Counted<'a> {
        Counted {
            events: &self.totals.events,
            frames: u32_from(self.notes.len()),
            cameras: u32_from(self.setup.cameras.len()),
            features: self.mean_features(),
            ate_m,
            waterfall: Some(waterfall),
        }
    }

    fn scenario(&self, name: &str) -> Scenario {
        let setup = &self.setup;
        let source = &setup.resolved.scenario;
        let truth = self.truth();
        let mut path_m = 0.0;
        for pair in truth.windows(2) {
            path_m += (pair[1].world_from_body.translation_m - pair[0].world_from_body.translation_m).length();
        }
        let scene = &source.scene;
        let named = scene.file.as_ref().or(scene.generator.as_ref()).or(scene.target.as_ref());
        let folders = scene.images.as_ref().map(|folders| folders.list().join(", "));
        let frames = f64_from_usize(self.notes.len());
        let cameras = f64_from_usize(setup.cameras.len());
        let optics = &source.optics;
        let lit = setup.world.scene();
        Scenario {
            name: name.to_owned(),
            scene: named.cloned().or(folders).unwrap_or_default(),
            scene_notes: setup.scene_notes.clone(),
            illuminance_lux: lit.map_or(scene.illuminance_lux, LitScene::illuminance_lux),
            illuminant: spectrum(setup.world.illuminant()),
            light: lit.map_or_else(String::new, LitScene::describe_light),
            motion: source.motion.file.as_ref().or(source.motion.kind.as_ref()).cloned().unwrap_or_default(),
            motion_notes: setup.motion_notes.clone(),
            motion_scale: source.motion.factor().expect("checked where the motion was placed"),
            path_m,
            duration_s: truth.last().map_or(0.0, |last| last.t_s) - truth.first().map_or(0.0, |first| first.t_s),
            frames: u32_from(self.notes.len()),
            cameras: u32_from(setup.cameras.len()),
            baseline_mm: source.rig.baseline_mm.unwrap_or_else(|| first_distance_mm(&setup.cameras)),
            sensor: setup.resolved.label(PresetKind::Sensor),
            width_px: setup.sensor.size.width_px,
            height_px: setup.sensor.size.height_px,
            bits: setup.sensor.bits(),
            shutter: source.sensor.readout.shutter.clone(),
            exposure_us: 1e6 * setup.sensor.schedule.exposure(FrameIndex(0), RowIndex(0)).length_s(),
            optics: format!("{}, f/{}", setup.resolved.label(PresetKind::Lens), optics.f_number),
            rung: setup.fidelity.rung.name().to_owned(),
            samples_per_pixel: f64_from_u64(self.totals.rays)
                / (f64_from_usize(setup.sensor.size.pixel_count()) * frames * cameras),
            render_variance_ratio: Some(self.totals.render_variance_ratio / (frames * cameras))
                .filter(|ratio| ratio.is_finite()),
        }
    }

    fn timing(&self) -> Result<Timing, Error> {
        let sensor = &self.setup.sensor;
        let totals = &self.totals.extractor;
        let us = |clk: u64| 1e6 * f64_from_u64(clk) / f64_from_u64(sensor.compute_hz);
        // Clocks count from the reading of the first row.
        let rows_clk = sensor.row_spacing().start_clk(sensor.size.height_px - 1);
        let cameras = u32_from(self.setup.cameras.len());
        let mut timing = timing_record(sensor, self.mean_features(), cameras)?;
        timing.latency_us = 1e6 * self.totals.link.latency_s;
        let queue_most = self.extractors.iter().map(crate::compute::Extractor::queue_most).max().flatten();
        timing.extractor = totals.clocks(sensor).map(|clocks| ExtractorClocks { queue_most, ..clocks });
        if let Some(slowest) = &self.totals.link.slowest {
            // A host that extracts by itself tracks what it found.
            let sent = u64_from(slowest.out_clk.len());
            let features = if sensor.link.mode.sends_features() { sent } else { self.mean_features() };
            timing.waterfall = sensor.waterfall_of(slowest, features, cameras);
        }
        let measured_s: f64 = self.totals.stage_s[STAGES.len() - 2..].iter().sum();
        timing.waterfall.measured_host_us =
            (measured_s > 0.0).then(|| 1e6 * measured_s / f64_from_usize(self.notes.len()));
        timing.first_feature_us = totals.first_clk.map(us);
        timing.last_feature_us = totals.last_clk.map(|clk| us(clk.saturating_sub(rows_clk)));
        Ok(timing)
    }

    fn bandwidth(&self) -> Bandwidth {
        let sensor = &self.setup.sensor;
        let frames = f64_from_usize(self.notes.len());
        let cameras = f64_from_usize(self.setup.cameras.len());
        let frame_time_s = sensor.schedule.frame_time_s();
        let traffic = &self.totals.link.traffic;
        let raw_bits = f64_from_usize(sensor.size.pixel_count()) * f64::from(sensor.bits());
        let feature_bits = f64_from_u64(traffic.feature_bits);
        Bandwidth {
            raw_bits_per_frame: raw_bits * cameras,
            container_bits_per_frame: f64_from_u64(traffic.container_bits) / frames,
            feature_bits_per_frame: feature_bits / frames,
            link_bits_per_s: 8.0 * f64_from_u64(traffic.link_bytes) / (frames * frame_time_s),
            reduction: (self.totals.feature_count > 0 && feature_bits > 0.0)
                .then(|| raw_bits * cameras * frames / feature_bits),
            link_utilisation: sensor.link.mean_utilisation(traffic, frames * cameras * frame_time_s),
            link_utilisation_burst: burst_utilisation(sensor).unwrap_or(0.0),
        }
    }

    /// Features of a camera's frame, mean over the run, rounded down.
    pub fn mean_features(&self) -> u64 {
        self.totals.feature_count / u64_from(self.notes.len() * self.setup.cameras.len())
    }

    /// Payload bits of the feature packets of one camera's frame whose features leave at these clocks; 0 where features are not sent.
    pub fn feature_bits_of(&self, frame: FrameIndex, out_clk: &[u64]) -> u64 {
        let sensor = &self.setup.sensor;
        let traffic = sensor
            .packets(frame, &sensor.batches(out_clk))
            .and_then(|packets| sensor.link.traffic_of(&packets, sensor.size, sensor.bits()));
        traffic.map_or(0, |traffic| traffic.feature_bits)
    }

    fn link(&self) -> LinkRecord {
        let totals = &self.totals.link;
        let counts = &totals.counts;
        let frames = f64_from_usize(self.notes.len() * self.setup.cameras.len());
        LinkRecord {
            packets: counts.packets,
            headers_corrected: counts.headers_corrected,
            packets_refused: counts.headers_refused + counts.payloads_refused + counts.cut_short,
            headers_refused: counts.headers_refused,
            payloads_refused: counts.payloads_refused,
            packets_cut_short: counts.cut_short,
            packets_doubled: counts.packets_doubled,
            bytes_skipped: counts.bytes_skipped,
            frames_damaged: counts.frames_damaged,
            rows_lost: counts.rows_lost,
            bits_flipped: totals.bits_flipped,
            frames_with_rows: totals.frames_with_rows,
            rows_stalled: totals.rows_stalled,
            stalled_us_per_frame: 1e6 * totals.stalled_s / frames,
            fifo_rows_most: totals.fifo_rows_most,
            feature_latency_us: totals.feature_latency_s.map(|latency_s| 1e6 * latency_s),
            features_dropped: totals.features_dropped,
        }
    }

    fn hash_record(&self) -> Hashes {
        let [photons, codes, features, energy, poses] = self.hashes();
        Hashes { photons, codes, features, energy, poses }
    }

    fn set_costs(&self, report: &mut Report) {
        let frames = f64_from_usize(self.notes.len());
        for (stage, seconds) in STAGES.into_iter().zip(self.totals.stage_s) {
            report.cost.insert(stage, StageCost { ms_per_frame: 1e3 * seconds / frames });
        }
        if let Some(alone) = &self.alone {
            report.cost.insert("tracker_cameras_alone", StageCost { ms_per_frame: 1e3 * alone.seconds / frames });
        }
        report.tracking.ms_per_frame = 1e3 * self.totals.stage_s[STAGES.len() - 1] / frames;
    }

    fn set_tracking(&self, report: &mut Report) {
        let frames = f64_from_usize(self.notes.len());
        let found: Vec<f64> =
            self.notes.iter().flat_map(|note| note.found.iter().map(|&count| f64::from(count))).collect();
        let tracked: Vec<f64> = self.notes.iter().map(|note| f64::from(note.tracked)).collect();
        report.features.median_found = median(&found);
        report.features.median_tracked = median(&tracked);
        report.features.min_tracked = self.notes.iter().map(|note| note.tracked).min();
        let mut estimate = self.estimate();
        report.tracking.tracked_fraction = f64_from_usize(estimate.len()) / frames;
        let mut predicted: Vec<TimedPose> = self.notes.iter().filter_map(|note| note.predicted).collect();
        let unit_m = bring_to_metres(&self.truth(), &mut estimate, self.setup.cameras.len());
        for pose in &mut predicted {
            pose.world_from_body.translation_m *= unit_m;
        }
        let figures = trajectory_figures(&self.truth(), &estimate);
        let prediction = figures.as_ref().map_err(Clone::clone).and_then(|figures| {
            let aligned = figures.se3.as_ref().map_err(Clone::clone)?;
            prediction_error_m(&self.truth(), &predicted, &aligned.alignment)
        });
        report.tracking.prediction_error_m = report.figure("tracking.prediction_error_m", prediction);
        let innovations: Vec<f64> = self.notes.iter().filter_map(|note| note.innovation_px).collect();
        let innovation = median(&innovations)
            .ok_or_else(|| NotMeasurable::Absent("no landmark was predicted into a frame and found again".to_owned()));
        report.tracking.innovation_px = report.figure("tracking.innovation_px", innovation);
        report.set_trajectory(figures, unit_m);
        let (cameras, fps) = (report.scenario.cameras, report.timing.fps);
        report.set_orientation(&pose_series(&self.truth(), &estimate, cameras, fps));
        report.cameras_alone = self.figures_of_cameras_alone(&mut report.not_measurable);
        let sigmas_m = self.notes.iter().filter_map(|note| note.single_picture_sigma_m);
        report.set_single_picture_sigma(sigmas_m.map(|sigma| sigma * unit_m));
        self.set_course(report);
    }

    /// What happened to the tracker.
    fn set_course(&self, report: &mut Report) {
        let (mut lost_since_s, mut lost_s) = (None, Vec::new());
        for (frame, note) in (0..).zip(&self.notes) {
            let t_s = note.truth.t_s;
            let events = note.events.iter().map(|&event| TrackingEvent::of(frame, t_s, event));
            report.tracking.events.extend(events);
            match note.status {
                Status::Lost => lost_since_s = lost_since_s.or(Some(t_s)),
                Status::Tracked | Status::Relocalised => {
                    lost_s.extend(lost_since_s.take().map(|since_s| t_s - since_s));
                }
                Status::Waiting | Status::Initialised => {}
            }
        }
        let relocalise =
            median(&lost_s).ok_or_else(|| NotMeasurable::Absent("the tracker never came back from a loss".to_owned()));
        report.tracking.relocalise_s = report.figure("tracking.relocalise_s", relocalise);
    }
}

/// Threads that share the work.
fn threads() -> u32 {
    #[cfg(feature = "parallel")]
    return u32_from(rayon::current_num_threads());
    #[cfg(not(feature = "parallel"))]
    1
}

/// Between the first two cameras; 0 where there is one.
fn first_distance_mm(cameras: &[Camera]) -> f64 {
    let position_m = |camera: &Camera| camera.body_from_camera.translation_m;
    cameras.get(1).map_or(0.0, |second| 1e3 * (position_m(second) - position_m(&cameras[0])).length())
}

/// The light's spectrum, by name or temperature.
fn spectrum(illuminant: Illuminant) -> String {
    match illuminant {
        Illuminant::Blackbody(kelvin) => format!("black body of {kelvin} K"),
        named => named.name().to_owned(),
    }
}

fn frame_record(note: &FrameNotes) -> FrameRecord {
    FrameRecord {
        t_s: note.truth.t_s,
        mean_code_dn: note.mean_code_dn,
        exposure_us: note.exposure_us,
        gain: note.gain,
        found: note.found.iter().sum(),
        tracked: note.tracked,
        innovation_px: note.innovation_px,
        truth_m: note.truth.world_from_body.translation_m.to_array(),
        estimate_m: None,
        error_m: None,
        orientation_deg: None,
        link_bits: Some(note.link_bits),
        energy_pj: Some(note.energy_pj),
        latency_us: Some(note.latency_us),
        status: note.status.name().to_owned(),
        thresholds: note.thresholds.clone(),
    }
}

/// A bound, or none where nothing bounds the value.
fn bounded(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

/// The plan as the report and the verb `plan` show it.
pub fn plan_record(plan: &PlanSummary, facts: &ScenarioFacts, accuracy: f64) -> PlanRecord {
    let omitted = plan.omitted.iter().map(|effect| OmittedEffect {
        name: effect.name.to_owned(),
        bias_e: bounded(effect.bias_e),
        sigma_e: bounded(effect.sigma_e),
        budget_share: bounded(effect.budget_share),
        cost_ns_per_px: effect.cost_ns_per_px,
        reason: effect.reason.clone(),
    });
    let fact = |fact: &Fact| FactRecord {
        name: fact.name.to_owned(),
        least: fact.least,
        greatest: bounded(fact.greatest),
        how: fact.how.clone(),
    };
    let tile = |tile: &Tile| TileRecord { columns: tile.columns, rows: tile.rows, signal_e: tile.signal_e };
    PlanRecord {
        kept: plan.kept.iter().map(|effect| effect.name.to_owned()).collect(),
        kept_reasons: plan.kept.iter().map(|effect| (effect.name, effect.reason.clone())).collect(),
        omitted: omitted.collect(),
        bias_e: bounded(plan.bias_e),
        sigma_e: bounded(plan.sigma_e),
        accuracy,
        budget_e: plan.budget_e,
        budget_used: bounded(plan.budget_used),
        cost_ns_per_px: plan.cost_ns_per_px,
        cost_of_all_ns_per_px: plan.cost_of_all_ns_per_px,
        cost_of_none_ns_per_px: plan.cost_of_none_ns_per_px,
        sensor_ms_per_frame: plan.sensor_ms_per_frame,
        facts: facts.facts.iter().map(fact).collect(),
        tiles: facts.tiles.iter().map(tile).collect(),
    }
}
