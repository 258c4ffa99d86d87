//! Chooses the cheapest setting that meets an accuracy or time goal, by a pilot on a few frames of the scenario itself. Gives it as
//! configuration assignments, with its measured figures.
//!
//! Error falls and time grows along each family of settings (tolerances or fixed numbers of rays, by number of reflections).
//! `search` finds where each family just meets the goal. Two margins are added to a measured error: the sampling error of the
//! few frames (`margin`) and a twentieth. The fastest candidates are timed again.

use serde::{Deserialize, Serialize};

use super::clocks::MeasuredCost;
use super::knobs::{EffectsKnob, Setting};
use super::margin::hidden;
use super::measure::LadderBench;
use super::pictures::{Rendered, Sensing, mean_square, render_all, sense_all};
use super::reference::{Reference, reference};
use crate::error::Error;
use crate::fidelity::Rung;
use crate::num::{greater, lesser};
use crate::run::Session;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Error of the picture in photon noise, at most.
    Accuracy(f64),
    /// Wall time of a frame of the rig in milliseconds, at most.
    Time(f64),
}

/// A setting that meets a goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChosenSetting {
    /// Assignments that make the run.
    pub settings: Vec<String>,
    /// The setting, for a person.
    pub words: String,
    /// Error in photon noise on the pilot's frames.
    pub photon_noise_ratio: f64,
    /// The same with its margin: what was held against the goal.
    pub with_margin: f64,
    /// Wall time of a frame of the rig.
    pub wall_ms_per_frame: f64,
    /// Processor time of a frame of the rig.
    pub ms_per_frame: f64,
    /// Settings that were tried.
    pub tried: usize,
    /// Finest accuracy that the pilot can distinguish.
    pub finest: f64,
    /// Pictures that it looked at.
    pub pictures: usize,
}

/// Frames that a pilot looks at.
pub const PILOT_FRAMES: u32 = 12;
/// Settings that take at most this many times as long as the fastest that meets the goal are timed again.
const NEARLY: f64 = 1.1;
const TIMED_AGAIN: u32 = 1;
/// Factor on a measured error, for frames that were not measured.
const MARGIN: f64 = 1.05;
/// Finest error that is distinguished when the goal is a time.
const FINEST_FOR_TIME: f64 = 0.5;
/// Tolerances of effects beside the scenario's own.
const EFFECT_TOLERANCES: [f64; 7] = [0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0];
/// The share of the goal that the reference's standard error may have. Each pixel's square is then known to within
/// 1/4 + 1/4 + 1/16 of its own variance 2, which costs a quarter more frames and saves half of the reference's rays.
/// Where images of lamps have most of the error, both halves of such a reference may lack one, and every setting that has it looks wrong,
/// the finer the surer. So where nothing meets the goal, a finer reference has the last word.
const REFERENCE_SHARES: [f64; 3] = [0.5, 0.25, 0.125];

/// What was measured so far.
pub(super) struct Pilot<'a> {
    pub(super) bench: &'a LadderBench<'a>,
    pub(super) reference: Reference,
    pub(super) rendered: Vec<Rendered>,
    pub(super) sensing: Vec<Sensing>,
    /// Of extractor, link and tracker.
    rest: MeasuredCost,
    pub(super) own: Setting,
    pub(super) goal: Goal,
    /// Of the run, of all cameras.
    pictures: u64,
}

/// Finds the cheapest setting that meets the goal: the least time for an accuracy, the least error for a time. Fails on a time that no
/// setting meets, with the least possible one; a reference too coarse for the accuracy.
pub fn choose(bench: &LadderBench<'_>, goal: Goal) -> Result<ChosenSetting, Error> {
    let own = Setting { rung: Rung::Sampled, ..Setting::of(&bench.setup.resolved.scenario) };
    let finest = match goal {
        Goal::Accuracy(accuracy) => accuracy,
        Goal::Time(_) => FINEST_FOR_TIME,
    };
    let rest = rest_of_run(bench)?;
    let mut refusal = None;
    for share in REFERENCE_SHARES {
        let reference = reference(bench, &bench.picture_ids(PILOT_FRAMES), finest, share);
        let reference = reference.map_err(|error| refusal.take().unwrap_or(error))?;
        let sensing = sense_all(bench, &reference, &chains(&own), 3)?;
        let pictures = u64::from(bench.setup.frames) * u64::from(bench.cameras());
        let own = own.clone();
        let mut pilot = Pilot { bench, reference, rendered: Vec::new(), sensing, rest, own, goal, pictures };
        pilot.search()?;
        pilot.time_again()?;
        match (pilot.best(finest), goal) {
            (Err(error), Goal::Accuracy(_)) => refusal = Some(error),
            (found, _) => return found,
        }
    }
    Err(refusal.expect("a round ended without a choice"))
}

/// The scenario's own first.
fn chains(own: &Setting) -> Vec<Setting> {
    let EffectsKnob::Planned { words, tolerance } = &own.effects else { return vec![own.clone()] };
    let mut tolerances = vec![*tolerance];
    tolerances.extend(EFFECT_TOLERANCES.into_iter().filter(|one| one != tolerance));
    let of = |tolerance| Setting { effects: EffectsKnob::Planned { words: words.clone(), tolerance }, ..own.clone() };
    tolerances.into_iter().map(of).collect()
}

/// What follows the sensor, from the run's first frames; cameras that are no pair have no tracker, and their links cost the same.
fn rest_of_run(bench: &LadderBench<'_>) -> Result<MeasuredCost, Error> {
    let frames = bench.setup.frames.min(3);
    let mut session = Session::new(bench.setup.clone())?;
    let mut least = MeasuredCost::UNKNOWN;
    for _ in 0..frames {
        let exposures = session.next_exposures()?;
        let (stepped, cost) = bench.clocks.time(|| session.step_with(exposures, bench.clocks.wall));
        stepped?;
        least = least.best(cost);
    }
    Ok(least)
}

impl Pilot<'_> {
    /// Times what is nearly as fast as the fastest once more, in turns.
    fn time_again(&mut self) -> Result<(), Error> {
        let least_ms = self.least_time_ms();
        let near = |one: &Rendered| self.meets_with_any(one) && one.cost.work_ms <= NEARLY * least_ms;
        let indices: Vec<usize> = (0..self.rendered.len()).filter(|&at| near(&self.rendered[at])).collect();
        if indices.len() < 2 {
            return Ok(());
        }
        let settings: Vec<Setting> = indices.iter().map(|&at| self.rendered[at].setting.clone()).collect();
        let again = render_all(self.bench, &self.reference, &settings, TIMED_AGAIN)?;
        for (at, again) in indices.into_iter().zip(again) {
            self.rendered[at].cost = self.rendered[at].cost.best(again.cost);
        }
        Ok(())
    }

    /// Render, sensor and the rest of a run.
    pub(super) fn cost(&self, rendered: &Rendered, sensing: &Sensing) -> MeasuredCost {
        // The rest holds the sensor at the scenario's own effects.
        let rest = self.rest.work_ms - self.sensing[0].cost.work_ms;
        let wall = self.rest.wall_ms - self.sensing[0].cost.wall_ms;
        let rest = MeasuredCost { work_ms: greater(rest, 0.0), wall_ms: greater(wall, 0.0) };
        rendered.cost.and(sensing.cost).and(rest)
    }

    /// Error with what its few frames may hide, and a twentieth.
    pub(super) fn with_margin(&self, rendered: &Rendered, sensing: &Sensing) -> f64 {
        let hidden = hidden(&rendered.errors, self.pictures);
        MARGIN * (mean_square(&rendered.errors) + hidden + mean_square(&sensing.errors)).sqrt()
    }

    /// What the goal bounds.
    pub(super) fn bounded(&self, rendered: &Rendered, sensing: &Sensing) -> f64 {
        match self.goal {
            Goal::Accuracy(_) => self.with_margin(rendered, sensing),
            Goal::Time(_) => self.cost(rendered, sensing).wall_ms,
        }
    }

    /// What the goal bounds it by.
    pub(super) fn bound(&self) -> f64 {
        match self.goal {
            Goal::Accuracy(accuracy) => accuracy,
            Goal::Time(wall_ms) => wall_ms,
        }
    }

    /// Of settings that meet the goal that with the least is chosen: time for an accuracy, error for a time.
    pub(super) fn rank(&self, rendered: &Rendered, sensing: &Sensing) -> f64 {
        match self.goal {
            Goal::Accuracy(_) => self.cost(rendered, sensing).work_ms,
            Goal::Time(_) => greater(self.with_margin(rendered, sensing), 1e-3),
        }
    }

    pub(super) fn meets(&self, rendered: &Rendered, sensing: &Sensing) -> bool {
        self.bounded(rendered, sensing) <= self.bound()
    }

    fn all(&self) -> impl Iterator<Item = (&Rendered, &Sensing)> {
        self.rendered.iter().flat_map(|rendered| self.sensing.iter().map(move |sensing| (rendered, sensing)))
    }

    fn met(&self) -> impl Iterator<Item = (&Rendered, &Sensing)> {
        self.all().filter(move |(rendered, sensing)| self.meets(rendered, sensing))
    }

    /// The least rank of what met the goal so far; infinite before anything did.
    pub(super) fn least_rank(&self) -> f64 {
        self.met().fold(f64::INFINITY, |least, (rendered, sensing)| lesser(least, self.rank(rendered, sensing)))
    }

    pub(super) fn least_time_ms(&self) -> f64 {
        self.met().fold(f64::INFINITY, |least, (rendered, _)| lesser(least, rendered.cost.work_ms))
    }

    /// Whether a render meets the goal with some chain.
    pub(super) fn meets_with_any(&self, rendered: &Rendered) -> bool {
        self.sensing.iter().any(|sensing| self.meets(rendered, sensing))
    }

    fn best(&self, finest: f64) -> Result<ChosenSetting, Error> {
        let ranks = |(rendered, sensing): &(&Rendered, &Sensing)| {
            [self.rank(rendered, sensing), self.cost(rendered, sensing).work_ms]
        };
        let by_rank = |a: &_, b: &_| ranks(a)[0].total_cmp(&ranks(b)[0]).then(ranks(a)[1].total_cmp(&ranks(b)[1]));
        let best = self.met().min_by(by_rank);
        let Some((rendered, sensing)) = best else { return Err(self.nothing_meets()) };
        let setting = Setting { effects: sensing.setting.effects.clone(), ..rendered.setting.clone() };
        let cost = self.cost(rendered, sensing);
        Ok(ChosenSetting {
            settings: setting.assignments(&self.bench.setup.resolved.scenario),
            words: setting.words(),
            photon_noise_ratio: (mean_square(&rendered.errors) + mean_square(&sensing.errors)).sqrt(),
            with_margin: self.with_margin(rendered, sensing),
            wall_ms_per_frame: cost.wall_ms,
            ms_per_frame: cost.work_ms,
            tried: self.rendered.len() * self.sensing.len(),
            finest,
            pictures: rendered.errors.len(),
        })
    }

    fn nothing_meets(&self) -> Error {
        let least = self.all().fold(f64::INFINITY, |least, (one, sensing)| lesser(least, self.bounded(one, sensing)));
        match self.goal {
            Goal::Accuracy(accuracy) => {
                let tried = self.rendered.len();
                let reason = format!("the best of {tried} settings reaches {least:.2}; use that or more");
                Error::key("--accuracy", accuracy, reason)
            }
            Goal::Time(wall_ms) => {
                let most = least.ceil();
                let reason = format!("the fastest setting takes {least:.0} ms per frame here; use {most:.0}ms or more");
                Error::key("--time-budget", format!("{wall_ms}ms"), reason)
            }
        }
    }
}
