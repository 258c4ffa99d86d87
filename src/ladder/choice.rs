//! The cheapest setting that an accuracy or a time allows, from a pilot on a few frames of this very scenario. Enters: a bench and a goal.
//! Leaves: a setting as assignments, with what was measured of it.
//!
//! Error falls and time grows along each family of settings (a tolerance, a fixed number of rays, with more, with fewer and without
//! reflections), so each family is searched by steps from where its own claim would place it. What is measured may be off on frames that
//! were not looked at: what the mean of these few frames may lie below the mean of all, and a twentieth, are added before it is held
//! against the goal. Frames are looked at once each, because another frame tells more than the same one again; what is nearly as
//! fast as the fastest is then timed again.

use serde::{Deserialize, Serialize};

use super::clocks::Cost;
use super::errors::Squares;
use super::knobs::{EffectsKnob, RAYS_MOST, Rays, Setting};
use super::measure::Bench;
use super::pictures::{Rendered, Sensing, mean_square, render_all, sense_all};
use super::reference::{Reference, reference};
use crate::error::Error;
use crate::fidelity::Rung;
use crate::num::{f64_from_usize, greater, lesser};
use crate::run::Session;
use crate::scene::lit::BOUNCES_MAX;

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
pub struct Choice {
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
    /// Finest accuracy that the pilot could tell apart.
    pub finest: f64,
}

/// Frames that a pilot looks at.
const PILOT_FRAMES: u32 = 5;
/// Settings that take at most so many times as long as the fastest that meets the goal are timed again.
const NEARLY: f64 = 1.25;
/// How often.
const TIMED_AGAIN: u32 = 2;
/// Step of a tolerance: time goes as its root, so the best lies within a seventh of what is found.
const STEP: f64 = 1.3;
/// Added to what was measured, for frames that were not looked at.
const MARGIN: f64 = 1.05;
/// Double steps of a search at most.
const STRIDES_MAX: usize = 6;
/// Times the goal's square beyond which an error that more reflections would mend is not searched further.
const FAR: f64 = 2.0;
/// With a time as goal, errors below this are not told apart.
const FINEST_FOR_TIME: f64 = 0.5;
/// The least that `run.render_tolerance` takes, and beyond what no target spares a ray any more: the first batch serves it.
const TOLERANCES: [f64; 2] = [0.001, 16.0];

struct Pilot<'a> {
    bench: &'a Bench<'a>,
    reference: Reference,
    rendered: Vec<Rendered>,
    sensing: Vec<Sensing>,
    /// Of extractor, link and tracker.
    rest: Cost,
    own: Setting,
    goal: Goal,
}

/// Finds the cheapest setting that meets the goal: the least time for an accuracy, the least error for a time.
///
/// # Errors
/// A time in which nothing can be done, with the least that would do; a reference that cannot judge so fine an accuracy.
pub fn choose(bench: &Bench<'_>, goal: Goal) -> Result<Choice, Error> {
    let own = Setting { rung: Rung::Sampled, ..Setting::of(&bench.setup.resolved.scenario) };
    let finest = match goal {
        Goal::Accuracy(accuracy) => accuracy,
        Goal::Time(_) => FINEST_FOR_TIME,
    };
    let reference = reference(bench, &bench.places(PILOT_FRAMES), finest)?;
    let sensing = sense_all(bench, &reference, &chains(&own), 3)?;
    let rest = rest_of_run(bench)?;
    let mut pilot = Pilot { bench, reference, rendered: Vec::new(), sensing, rest, own, goal };
    pilot.search()?;
    pilot.time_again()?;
    pilot.best(finest)
}

fn chains(own: &Setting) -> Vec<Setting> {
    let EffectsKnob::Planned { words, tolerance } = &own.effects else { return vec![own.clone()] };
    let mut tolerances = vec![*tolerance];
    tolerances.extend([0.03, 0.1, 0.3, 1.0].into_iter().filter(|one| one != tolerance));
    let of = |tolerance| Setting { effects: EffectsKnob::Planned { words: words.clone(), tolerance }, ..own.clone() };
    tolerances.into_iter().map(of).collect()
}

/// What follows the sensor, from the run's first frames; cameras that are no pair have no tracker, and their links cost the same.
fn rest_of_run(bench: &Bench<'_>) -> Result<Cost, Error> {
    let frames = bench.setup.frames.min(3);
    let mut session = Session::new(bench.setup.clone())?;
    let mut least = Cost::UNKNOWN;
    for _ in 0..frames {
        let exposures = session.expose()?;
        let (stepped, cost) = bench.clocks.time(|| session.step_with(exposures, bench.clocks.wall));
        stepped?;
        least = least.best(cost);
    }
    Ok(least)
}

impl Pilot<'_> {
    /// Measures settings along every family.
    fn search(&mut self) -> Result<(), Error> {
        if !self.bench.has_rays() {
            let own = self.own.clone();
            return self.measure(own).map(|_| ());
        }
        let start = match self.goal {
            Goal::Accuracy(accuracy) => 0.8 * accuracy * accuracy,
            Goal::Time(_) => 1.0,
        };
        let families = self.families();
        let found = self.search_tolerance(families[0], start)?;
        self.search_fixed(families[0])?;
        for &reflections in &families[1..] {
            self.search_tolerance(reflections, found.unwrap_or(start))?;
        }
        Ok(())
    }

    /// Numbers of reflections that are tried: all that the reference follows first, which have no error but for too few rays; the
    /// scenario's own; none. Where nothing keeps an image they are one and the same.
    fn families(&self) -> Vec<u32> {
        let setup = &self.bench.setup;
        let keeps_images = setup.world.scene().is_some_and(|scene| scene.has_gloss(setup.fidelity.follows_gloss));
        let mut all =
            if keeps_images { vec![BOUNCES_MAX, self.own.reflections, 0] } else { vec![self.own.reflections] };
        all.dedup();
        all
    }

    /// Whether the last setting's error is beyond what finer tolerances could mend: what it does not follow is missing.
    fn is_far(&self) -> bool {
        let (Goal::Accuracy(accuracy), Some(last)) = (self.goal, self.rendered.last()) else { return false };
        mean_square(&last.errors) > FAR * accuracy * accuracy
    }

    /// Times what is nearly as fast as the fastest once more, in turns.
    fn time_again(&mut self) -> Result<(), Error> {
        let least_ms = self.least_time_ms();
        let near = |one: &Rendered| {
            let meets = self.sensing.iter().any(|sensing| self.meets(one, sensing));
            meets && one.cost.work_ms <= NEARLY * least_ms
        };
        let places: Vec<usize> = (0..self.rendered.len()).filter(|&place| near(&self.rendered[place])).collect();
        if places.len() < 2 {
            return Ok(());
        }
        let settings: Vec<Setting> = places.iter().map(|&place| self.rendered[place].setting.clone()).collect();
        let again = render_all(self.bench, &self.reference, &settings, TIMED_AGAIN)?;
        for (place, again) in places.into_iter().zip(again) {
            self.rendered[place].cost = self.rendered[place].cost.best(again.cost);
        }
        Ok(())
    }

    /// From a tolerance down until the goal is met and up while it is; the coarsest that met it.
    fn search_tolerance(&mut self, reflections: u32, start: f64) -> Result<Option<f64>, Error> {
        // With a time as goal the meaning of the two directions changes places: a finer setting is one that may be too slow.
        let met = self.measure(self.with_tolerance(start, reflections))?;
        if !met && self.is_far() && reflections < BOUNCES_MAX && self.families().len() > 1 {
            return Ok(None);
        }
        let coarser = matches!(self.goal, Goal::Accuracy(_)) == met;
        let factor = if coarser { STEP } else { 1.0 / STEP };
        let (mut tolerance, mut found) = (start, met.then_some(start));
        for _ in 0..STRIDES_MAX {
            let (between, next) = (tolerance * factor, tolerance * factor * factor);
            if !(TOLERANCES[0]..=TOLERANCES[1]).contains(&next) {
                break;
            }
            let now = self.measure(self.with_tolerance(next, reflections))?;
            found = if now { Some(next) } else { found };
            if now != met {
                let also = self.measure(self.with_tolerance(between, reflections))?;
                // It lies between what met the goal and what did not, on the cheaper (or finer) side of the former.
                found = if also { Some(between) } else { found };
                break;
            }
            tolerance = next;
        }
        Ok(found)
    }

    fn with_tolerance(&self, tolerance: f64, reflections: u32) -> Setting {
        let rays = Rays::Tolerance { tolerance: rounded(tolerance), most: RAYS_MOST };
        Setting { rays, reflections, ..self.own.clone() }
    }

    /// Twice as many rays each time, until the goal is met (or, for a time, missed), or the best so far is faster.
    fn search_fixed(&mut self, reflections: u32) -> Result<(), Error> {
        for power in 0..8 {
            let setting = Setting { rays: Rays::Fixed(1 << power), reflections, ..self.own.clone() };
            let met = self.measure(setting)?;
            let last = self.rendered.last().map_or(0.0, |one| one.cost.work_ms);
            let beaten = match self.goal {
                Goal::Accuracy(_) => met || self.least_time_ms() < last,
                Goal::Time(_) => !met,
            };
            if beaten {
                break;
            }
        }
        Ok(())
    }

    /// Renders a setting; whether it meets the goal with the scenario's own effects.
    fn measure(&mut self, setting: Setting) -> Result<bool, Error> {
        let one = render_all(self.bench, &self.reference, &[setting], 1)?.swap_remove(0);
        let meets = self.meets(&one, &self.sensing[0]);
        self.rendered.push(Rendered { photons: Vec::new(), ..one });
        Ok(meets)
    }

    fn cost(&self, rendered: &Rendered, sensing: &Sensing) -> Cost {
        // The rest holds the sensor at the scenario's own effects.
        let rest = self.rest.work_ms - self.sensing[0].cost.work_ms;
        let wall = self.rest.wall_ms - self.sensing[0].cost.wall_ms;
        let rest = Cost { work_ms: greater(rest, 0.0), wall_ms: greater(wall, 0.0) };
        rendered.cost.and(sensing.cost).and(rest)
    }

    fn meets(&self, rendered: &Rendered, sensing: &Sensing) -> bool {
        match self.goal {
            Goal::Accuracy(accuracy) => with_margin(rendered, sensing) <= accuracy,
            Goal::Time(wall_ms) => self.cost(rendered, sensing).wall_ms <= wall_ms,
        }
    }

    fn all(&self) -> impl Iterator<Item = (&Rendered, &Sensing)> {
        self.rendered.iter().flat_map(|rendered| self.sensing.iter().map(move |sensing| (rendered, sensing)))
    }

    fn least_time_ms(&self) -> f64 {
        let met = self.all().filter(|(rendered, sensing)| self.meets(rendered, sensing));
        met.fold(f64::INFINITY, |least, (rendered, _)| lesser(least, rendered.cost.work_ms))
    }

    fn best(&self, finest: f64) -> Result<Choice, Error> {
        let rank = |(rendered, sensing): &(&Rendered, &Sensing)| {
            let work_ms = self.cost(rendered, sensing).work_ms;
            match self.goal {
                Goal::Accuracy(_) => [work_ms, 0.0],
                Goal::Time(_) => [greater(with_margin(rendered, sensing), 1e-3), work_ms],
            }
        };
        let met = self.all().filter(|(rendered, sensing)| self.meets(rendered, sensing));
        let best = met.min_by(|a, b| rank(a)[0].total_cmp(&rank(b)[0]).then(rank(a)[1].total_cmp(&rank(b)[1])));
        let Some((rendered, sensing)) = best else { return Err(self.nothing_meets()) };
        let setting = Setting { effects: sensing.setting.effects.clone(), ..rendered.setting.clone() };
        let cost = self.cost(rendered, sensing);
        Ok(Choice {
            settings: setting.assignments(&self.bench.setup.resolved.scenario),
            words: setting.words(),
            photon_noise_ratio: (mean_square(&rendered.errors) + mean_square(&sensing.errors)).sqrt(),
            with_margin: with_margin(rendered, sensing),
            wall_ms_per_frame: cost.wall_ms,
            ms_per_frame: cost.work_ms,
            tried: self.rendered.len() * self.sensing.len(),
            finest,
        })
    }

    fn nothing_meets(&self) -> Error {
        let least = |of: &dyn Fn(&Rendered, &Sensing) -> f64| {
            self.all().fold(f64::INFINITY, |least, (rendered, sensing)| lesser(least, of(rendered, sensing)))
        };
        match self.goal {
            Goal::Accuracy(accuracy) => {
                let found = least(&with_margin);
                let reason = format!("the best of {} settings reaches {found:.2}; that would do", self.rendered.len());
                Error::key("--accuracy", accuracy, reason)
            }
            Goal::Time(wall_ms) => {
                let found = least(&|rendered, sensing| self.cost(rendered, sensing).wall_ms);
                let reason =
                    format!("the fastest setting takes {found:.0} ms a frame here; {:.0}ms would do", found.ceil());
                Error::key("--time-budget", format!("{wall_ms}ms"), reason)
            }
        }
    }
}

/// Two leading digits, so that a person can read what was written.
fn rounded(tolerance: f64) -> f64 {
    let unit = libm::pow(10.0, libm::floor(libm::log10(tolerance)) - 1.0);
    let kept = (tolerance / unit).round_ties_even() * unit;
    // A power of ten is not exact; its decimal form is.
    format!("{kept:.6}").parse().unwrap_or(tolerance)
}

/// Standard errors by which the mean of so many frames lies below that of all in one case of twenty: Student's t of one frame less.
fn student_95(frames: usize) -> f64 {
    match frames {
        0 | 1 => 0.0,
        2 => 6.314,
        3 => 2.920,
        4 => 2.353,
        _ => 2.132,
    }
}

/// Error with what its few frames may hide, and a twentieth.
fn with_margin(rendered: &Rendered, sensing: &Sensing) -> f64 {
    let hidden = student_95(rendered.errors.len()) * standard_error(&rendered.errors);
    let squares = mean_square(&rendered.errors) + hidden + mean_square(&sensing.errors);
    MARGIN * squares.sqrt()
}

/// Standard error over frames of the mean square.
fn standard_error(errors: &[Squares]) -> f64 {
    if errors.len() < 2 {
        return 0.0;
    }
    let count = f64_from_usize(errors.len());
    let mean = errors.iter().map(|one| one.mean()).sum::<f64>() / count;
    let spread: f64 = errors.iter().map(|one| (one.mean() - mean) * (one.mean() - mean)).sum();
    (spread / (count - 1.0) / count).sqrt()
}
