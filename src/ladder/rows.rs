//! Builds the ladder of a scenario: every rung, every knob alone, and the Pareto front of their combinations. Tables, pictures and pages
//! are made from this record.

use super::clocks::MeasuredCost;
use super::errors::CodeError;
use super::front::front;
use super::knobs::{EffectsKnob, RAYS_MOST, RayBudget, Setting};
use super::measure::{LadderBench, LadderOptions};
use super::pictures::{Rendered, Sensing, mean_square, outcome, render_all, sense_all};
use super::poses::{LATER_STAGES, Poses, frames_of, poses_of};
use super::reference::{Reference, SHARE, reference};
use super::verilog::{self, InVerilog};
use crate::error::Error;
use crate::fidelity::Rung;
use crate::num::{f64_from_usize, low_u16, u32_truncated_f32};
use crate::report::Ordered;
use crate::report::ladder_record::{LADDER_VERSION, LadderRecord, LadderRow, ReferenceRecord};
use crate::run::Setup;
use crate::scene::lit::REFLECTIONS_MAX;

/// A knob other than the scenario's own is run for its poses where it takes at most this share of the scenario's rays: a rule of counts,
/// so that the same rows have poses every time.
const POSE_RAYS_SHARE: f64 = 0.7;

struct LadderMeasurements<'a> {
    bench: &'a LadderBench<'a>,
    options: LadderOptions,
    reference: Reference,
    rendered: Vec<Rendered>,
    sensing: Vec<Sensing>,
    own: Setting,
}

/// A row before it is written.
struct Draft {
    knob: &'static str,
    value: String,
    setting: Setting,
    on_front: bool,
}

/// Measures a scenario's ladder. Fails on a reference that cannot judge the finest accuracy; whatever stops a run.
pub fn ladder(
    bench: &LadderBench<'_>,
    options: LadderOptions,
    name: &str,
    threads: u32,
) -> Result<LadderRecord, Error> {
    let own = Setting { rung: Rung::Sampled, ..Setting::of(&bench.setup.resolved.scenario) };
    let ids = bench.picture_ids(options.frames);
    let reference = reference(bench, &ids, options.finest, SHARE)?;
    let rendered = render_all(bench, &reference, &render_settings(bench, &own), options.repeats)?;
    // Sensors are quick: more turns cost little and bring the least time out of a busy machine.
    let sensing = sense_all(bench, &reference, &sensing_settings(&own), 3 * options.repeats)?;
    let measured = LadderMeasurements { bench, options, reference, rendered, sensing, own };
    let drafts = measured.drafts();
    let (wanted, poses) = measured.poses(&drafts)?;
    let poses_for = |setting: &Setting| {
        let at = wanted.iter().position(|one| one == setting)?;
        poses.get(at)
    };
    let own_later = poses_for(&measured.own).map_or([MeasuredCost::default(); LATER_STAGES.len()], |poses| poses.later);
    let reference_row = measured.reference_row(own_later);
    let reference_ms = reference_row.ms_per_frame;
    let mut rows = vec![reference_row];
    for draft in &drafts {
        rows.push(measured.row(draft, poses_for(&draft.setting), own_later, reference_ms)?);
    }
    let mut others = measured.other_rungs()?;
    others.iter_mut().for_each(|row| row.time_ratio = ratio(row.ms_per_frame, reference_ms));
    let at = rows.iter().position(|row| row.knob != "reference" && row.knob != "rung").unwrap_or(rows.len());
    rows.splice(at..at, others);
    Ok(measured.record(name, threads, rows))
}

/// Rays and reflections: the scenario's own first.
fn render_settings(bench: &LadderBench<'_>, own: &Setting) -> Vec<Setting> {
    let mut all = vec![own.clone()];
    if !bench.has_rays() {
        return all;
    }
    let rays = |rays: RayBudget| Setting { rays, ..own.clone() };
    all.extend([1, 2, 4, 8, 16].map(|samples| rays(RayBudget::Fixed(samples))));
    all.extend(
        [8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125].map(|tolerance| rays(RayBudget::Tolerance { tolerance, most: 256 })),
    );
    all.extend([0.5, 0.25, 0.125].map(|tolerance| rays(RayBudget::Tolerance { tolerance, most: RAYS_MOST })));
    all.push(rays(RayBudget::Subframes(16)));
    all.extend((0..=REFLECTIONS_MAX).map(|reflections| Setting { reflections, ..own.clone() }));
    for tolerance in [4.0, 0.25] {
        all.push(Setting { reflections: 0, rays: RayBudget::Tolerance { tolerance, most: 256 }, ..own.clone() });
    }
    distinct(all, Setting::renders_as)
}

/// Rungs and effects: the scenario's own first.
fn sensing_settings(own: &Setting) -> Vec<Setting> {
    let words = match &own.effects {
        EffectsKnob::All => "auto".to_owned(),
        EffectsKnob::Planned { words, .. } => words.clone(),
    };
    let effects = |effects: EffectsKnob| Setting { effects, rung: Rung::Sampled, ..own.clone() };
    let mut all = vec![own.clone()];
    all.extend([Rung::Sampled, Rung::Clocked].map(|rung| Setting { rung, ..own.clone() }));
    all.push(effects(EffectsKnob::All));
    for tolerance in [0.01, 0.03, 0.1, 0.3, 1.0] {
        all.push(effects(EffectsKnob::Planned { words: words.clone(), tolerance }));
    }
    distinct(all, Setting::senses_as)
}

fn distinct(all: Vec<Setting>, same: impl Fn(&Setting, &Setting) -> bool) -> Vec<Setting> {
    let mut kept: Vec<Setting> = Vec::new();
    for setting in all {
        if !kept.iter().any(|one| same(one, &setting)) {
            kept.push(setting);
        }
    }
    kept
}

impl LadderMeasurements<'_> {
    fn rendered_as(&self, setting: &Setting) -> &Rendered {
        let found = self.rendered.iter().find(|one| one.setting.renders_as(setting));
        found.expect("every row is made of renders that were measured")
    }

    fn sensed_as(&self, setting: &Setting) -> &Sensing {
        let found = self.sensing.iter().find(|one| one.setting.senses_as(setting));
        found.expect("every row is made of chains that were measured")
    }

    /// Error in photon noise: the two parts add in squares.
    fn error(&self, setting: &Setting) -> f64 {
        let render = mean_square(&self.rendered_as(setting).errors);
        (render + mean_square(&self.sensed_as(setting).errors)).sqrt()
    }

    fn work_ms(&self, setting: &Setting) -> f64 {
        self.rendered_as(setting).cost.and(self.sensed_as(setting).cost).work_ms
    }

    /// Rungs, each knob alone, and the front of all combinations.
    fn drafts(&self) -> Vec<Draft> {
        let own = &self.own;
        let draft = |knob, value: String, setting: Setting| Draft { knob, value, setting, on_front: false };
        let mut all: Vec<Draft> = [Rung::Sampled, Rung::Clocked]
            .map(|rung| draft("rung", rung.name().to_owned(), Setting { rung, ..own.clone() }))
            .into();
        for one in self.rendered.iter().filter(|one| one.setting.reflections == own.reflections) {
            let (knob, value) = match one.setting.rays {
                RayBudget::Fixed(samples) => ("samples_per_pixel", samples.to_string()),
                RayBudget::Tolerance { tolerance, most: RAYS_MOST } => {
                    ("render_tolerance", format!("{tolerance}, up to {RAYS_MOST}"))
                }
                RayBudget::Tolerance { tolerance, .. } => ("render_tolerance", tolerance.to_string()),
                RayBudget::Subframes(count) => ("subframes", count.to_string()),
            };
            if self.bench.has_rays() {
                all.push(draft(knob, value, one.setting.clone()));
            }
        }
        for one in self.rendered.iter().filter(|one| one.setting.rays == own.rays && self.bench.has_rays()) {
            all.push(draft("reflections", one.setting.reflections.to_string(), one.setting.clone()));
        }
        for one in self.sensing.iter().filter(|one| one.setting.rung == Rung::Sampled) {
            let value = match &one.setting.effects {
                EffectsKnob::All => "all".to_owned(),
                EffectsKnob::Planned { tolerance, .. } => tolerance.to_string(),
            };
            all.push(draft("effects", value, Setting { effects: one.setting.effects.clone(), ..own.clone() }));
        }
        all.retain(|draft| self.sensing.iter().any(|one| one.setting.senses_as(&draft.setting)));
        if self.bench.cameras() == 2 {
            let windows = [5, own.window, 20]
                .map(|window| draft("window", window.to_string(), Setting { window, ..own.clone() }));
            all.extend(windows);
        }
        all.extend(self.front_drafts());
        all
    }

    fn front_drafts(&self) -> Vec<Draft> {
        let mut combined = Vec::new();
        for render in &self.rendered {
            for chain in self.sensing.iter().filter(|one| one.setting.rung == Rung::Sampled) {
                let (rung, effects) = (Rung::Sampled, chain.setting.effects.clone());
                combined.push(Setting { rung, effects, ..render.setting.clone() });
            }
        }
        let points: Vec<(f64, f64)> = combined
            .iter()
            .map(|one| {
                // What is finer than the reference can judge counts as equally good, so that the fastest of it stands on the front.
                let error = self.error(one);
                (self.work_ms(one), if error < self.options.finest { 0.0 } else { error })
            })
            .collect();
        let on_front = |at: usize| Draft {
            knob: "combination",
            value: combined[at].words(),
            setting: combined[at].clone(),
            on_front: true,
        };
        front(&points).into_iter().map(on_front).collect()
    }

    /// Which settings are run for their poses, and what that showed.
    fn poses(&self, drafts: &[Draft]) -> Result<(Vec<Setting>, Vec<Poses>), Error> {
        let frames = frames_of(self.bench, self.options.pose_frames);
        let most = POSE_RAYS_SHARE * self.rendered_as(&self.own).rays_per_pixel;
        let mut wanted = vec![self.own.clone()];
        for draft in drafts.iter().filter(|draft| draft.setting.rung == Rung::Sampled) {
            let rendered = self.rendered_as(&draft.setting);
            let cheap = draft.setting.renders_as(&self.own) || rendered.rays_per_pixel <= most;
            if cheap && !wanted.contains(&draft.setting) {
                wanted.push(draft.setting.clone());
            }
        }
        let poses = if frames == 0 { Vec::new() } else { poses_of(self.bench, &wanted, frames)? };
        Ok((wanted, poses))
    }

    fn row(
        &self,
        draft: &Draft,
        poses: Option<&Poses>,
        own_later: [MeasuredCost; LATER_STAGES.len()],
        reference_ms: f64,
    ) -> Result<LadderRow, Error> {
        let (rendered, sensing) = (self.rendered_as(&draft.setting), self.sensed_as(&draft.setting));
        let outcome = outcome(self.bench, &self.reference, &rendered.photons, sensing)?;
        let later = poses.map_or(own_later, |poses| poses.later);
        let costs = [rendered.cost, sensing.cost, outcome.compute];
        let (stages, total) = stages(&costs, &later);
        let error = self.error(&draft.setting);
        let judged = error >= self.options.finest;
        let mut notes = Vec::new();
        if !judged {
            notes.push(format!("finer than {}, which the reference can judge", self.options.finest));
        }
        match poses {
            Some(poses) => notes.extend(poses.reason.clone()),
            None if self.bench.cameras() != 2 => notes.push("poses need two cameras".to_owned()),
            None => notes.push("not run for its poses".to_owned()),
        }
        Ok(LadderRow {
            rung: draft.setting.rung.name().to_owned(),
            knob: draft.knob.to_owned(),
            value: draft.value.clone(),
            ms_per_frame: total.work_ms,
            wall_ms_per_frame: total.wall_ms,
            stages,
            time_ratio: ratio(total.work_ms, reference_ms),
            rms_dn: Some(outcome.codes.rms_dn()),
            max_dn: Some(f64::from(outcome.codes.max_dn)),
            photon_noise_ratio: judged.then_some(error),
            feature_f1: Some(outcome.features.f1()),
            ate_m: poses.and_then(|poses| poses.ate_m),
            jitter_d2_m: poses.and_then(|poses| poses.jitter_d2_m),
            tracked_fraction: poses.map(|poses| poses.tracked_fraction),
            energy_error: Some(outcome.energy_error),
            rays_per_pixel: Some(rendered.rays_per_pixel),
            on_front: draft.on_front,
            settings: draft.setting.assignments(&self.bench.setup.resolved.scenario),
            note: (!notes.is_empty()).then(|| notes.join("; ")),
        })
    }

    fn reference_row(&self, own_later: [MeasuredCost; LATER_STAGES.len()]) -> LadderRow {
        let reference = &self.reference;
        let (stages, total) = stages(&reference.costs, &own_later);
        LadderRow {
            rung: Rung::Clocked.name().to_owned(),
            knob: "reference".to_owned(),
            value: reference.setting.words(),
            ms_per_frame: total.work_ms,
            wall_ms_per_frame: total.wall_ms,
            stages,
            time_ratio: 1.0,
            rms_dn: Some(0.0),
            max_dn: Some(0.0),
            photon_noise_ratio: Some(reference.standard_error),
            feature_f1: Some(1.0),
            energy_error: Some(0.0),
            rays_per_pixel: Some(reference.rays_per_pixel),
            settings: reference.setting.assignments(&self.bench.setup.resolved.scenario),
            note: Some("what the others are measured against; its ratio is its own standard error".to_owned()),
            ..LadderRow::default()
        }
    }

    /// Rungs without codes here.
    fn other_rungs(&self) -> Result<Vec<LadderRow>, Error> {
        let empty = |rung: Rung, note: String| LadderRow {
            rung: rung.name().to_owned(),
            knob: "rung".to_owned(),
            value: rung.name().to_owned(),
            note: Some(note),
            ..LadderRow::default()
        };
        let setting = Setting { rung: Rung::Expected, ..self.own.clone() };
        let expected = match self.bench.setup_of(&setting) {
            Ok(setup) => self.expected_row(&setting, &setup),
            Err(error) => empty(Rung::Expected, format!("not measured: {error}")),
        };
        let rtl = match verilog::measured(self.bench, &self.reference) {
            Ok(part) => self.rtl_row(&part),
            Err(error) => empty(Rung::Rtl, format!("not measured: {error}")),
        };
        Ok(vec![expected, rtl])
    }

    /// A part of a picture in the Verilog, the whole in proportion.
    fn rtl_row(&self, part: &InVerilog) -> LadderRow {
        let (setting, rendered) = (Setting { rung: Rung::Rtl, ..self.own.clone() }, self.rendered_as(&self.own));
        let sensor = part.cost.times(f64::from(self.bench.cameras()) * part.frame_over_part);
        LadderRow { note: Some(part.words()), ..self.rung_row(&setting, rendered, sensor, &part.codes) }
    }

    /// A rung that is not among the combinations: what it renders and what its sensor takes and shows.
    fn rung_row(&self, setting: &Setting, rendered: &Rendered, sensor: MeasuredCost, codes: &CodeError) -> LadderRow {
        let total = rendered.cost.and(sensor);
        LadderRow {
            rung: setting.rung.name().to_owned(),
            knob: "rung".to_owned(),
            value: setting.rung.name().to_owned(),
            ms_per_frame: total.work_ms,
            wall_ms_per_frame: total.wall_ms,
            stages: [("render", rendered.cost.work_ms), ("sensor", sensor.work_ms)].into_iter().collect(),
            rms_dn: Some(codes.rms_dn()),
            max_dn: Some(f64::from(codes.max_dn)),
            rays_per_pixel: Some(rendered.rays_per_pixel),
            settings: setting.assignments(&self.bench.setup.resolved.scenario),
            ..LadderRow::default()
        }
    }

    /// Means of codes against the reference's codes: what differs is the sensor's own noise, which means do not have.
    fn expected_row(&self, setting: &Setting, setup: &Setup) -> LadderRow {
        let (chain, rendered) = (setup.first_chain(), self.rendered_as(setting));
        let (mut codes, mut sensor) = (CodeError::default(), MeasuredCost::default());
        let pictures = f64_from_usize(rendered.photons.len());
        for (photons, judged) in rendered.photons.iter().zip(&self.reference.judged) {
            let (expected, cost) = self.bench.clocks.time(|| setup.expected_at(&chain, judged.id, &photons[0]));
            let mean = expected.mean_dn.map(|mean_dn| low_u16(u32_truncated_f32(mean_dn + 0.5)));
            codes.add(&mean, &judged.codes);
            sensor = sensor.and(cost.times(f64::from(self.bench.cameras()) / pictures));
        }
        let error = mean_square(&rendered.errors).sqrt();
        let note = "ends at the image; in DN its means differ from drawn codes by the sensor's own noise";
        LadderRow {
            photon_noise_ratio: (error >= self.options.finest).then_some(error),
            note: Some(note.to_owned()),
            ..self.rung_row(setting, rendered, sensor, &codes)
        }
    }

    fn record(&self, name: &str, threads: u32, rows: Vec<LadderRow>) -> LadderRecord {
        let (setup, reference) = (&self.bench.setup, &self.reference);
        let all = self.bench.pixels() * f64_from_usize(reference.judged.len());
        LadderRecord {
            ladder_version: LADDER_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario: name.to_owned(),
            config_hash: setup.resolved.hash(),
            seed: setup.resolved.scenario.seed,
            frames: reference.judged.iter().map(|one| one.id.frame.0).collect(),
            pose_frames: frames_of(self.bench, self.options.pose_frames),
            cameras: self.bench.cameras(),
            threads,
            reference: ReferenceRecord {
                finest: self.options.finest,
                standard_error: reference.standard_error,
                rays_per_pixel: reference.rays_per_pixel,
                pixels: reference.pixels,
                saturated_share: 1.0 - crate::num::f64_from_u64(reference.pixels) / all,
            },
            rows,
        }
    }
}

fn stages(costs: &[MeasuredCost; 3], later: &[MeasuredCost; LATER_STAGES.len()]) -> (Ordered<f64>, MeasuredCost) {
    let names = ["render", "sensor", "compute"].into_iter().chain(LATER_STAGES);
    let all: Vec<MeasuredCost> = costs.iter().chain(later).copied().collect();
    let total = all.iter().fold(MeasuredCost::default(), |sum, &cost| sum.and(cost));
    (names.zip(&all).map(|(name, cost)| (name, cost.work_ms)).collect(), total)
}

/// Of times; 0 where no clock runs.
fn ratio(ms: f64, reference_ms: f64) -> f64 {
    if reference_ms > 0.0 { ms / reference_ms } else { 0.0 }
}
