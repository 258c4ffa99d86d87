//! The pilot's search over settings: from measured effect chains it chooses renders to measure, most densely where the goal is just met.
//!
//! A knob is measured where a curve through its measured points meets the goal, until that point itself is measured. Frames are
//! rendered in an order that is spread over the run, and stop when the rest cannot bring the setting to the goal.

use super::choice::{Goal, Pilot};
use super::curve::Curve;
use super::knobs::{RAYS_MOST, RayBudget, Setting};
use super::pictures::{Rendered, mean_square, render_until};
use crate::error::Error;
use crate::num::{f64_from_usize, greater, lesser};
use crate::scene::lit::REFLECTIONS_MAX;

/// Settings along one knob at most: where some setting meets the goal, and before one does.
const STEPS_MAX: [usize; 2] = [7, 16];
/// Tolerances closer than this are one: time goes as the root of a tolerance at most, so that less than 3 % is lost.
const CLOSE: f64 = 1.05;
/// The share of the goal that is aimed at, so that rounding and a bend of the curve seldom cost another setting.
const AIM: f64 = 0.99;
/// Least gain for which another setting is measured.
const WORTH: f64 = 0.97;
/// Times the goal's square beyond which an error that more reflections would mend is not searched further.
const FAR: f64 = 2.0;
/// The least that `run.render_tolerance` takes, and beyond what no target spares a ray any more: the first batch serves it.
const TOLERANCES: [f64; 2] = [0.001, 16.0];
/// How much finer than the reference's own a tolerance may be: where images of lamps have most of the error, all tolerances show more
/// than they aim at, and it is the last of them that meets the goal.
const BEYOND: f64 = 4.0;
/// Power of the rank along a knob, beyond what was measured: time goes as the root of a tolerance at most, error as its root.
const RANK_POWER: f64 = -0.5;
/// Settings that a pilot looks at, about: for the bar alone.
const EXPECTED: f64 = 14.0;

impl Pilot<'_> {
    /// Measures settings along every family.
    pub(super) fn search(&mut self) -> Result<(), Error> {
        if !self.bench.has_rays() {
            let own = self.own.clone();
            return self.measure(own).map(|_| ());
        }
        let start = match self.goal {
            Goal::Accuracy(accuracy) => 0.7 * accuracy * accuracy,
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
        let follows_gloss = setup.fidelity.render.follows_gloss;
        let keeps_images = setup.world.dynamic_scene().is_some_and(|scene| scene.has_gloss(follows_gloss));
        let mut all =
            if keeps_images { vec![REFLECTIONS_MAX, self.own.reflections, 0] } else { vec![self.own.reflections] };
        all.dedup();
        all
    }

    /// The abscissa of a tolerance on its knob, its own inverse: what the goal bounds grows along it. Fine tolerances cost time.
    fn abscissa(&self, tolerance: f64) -> f64 {
        match self.goal {
            Goal::Accuracy(_) => tolerance,
            Goal::Time(_) => 1.0 / tolerance,
        }
    }

    /// Tolerances with a given number of reflections; the one of those measured that meets the goal and lies farthest along the knob.
    fn search_tolerance(&mut self, reflections: u32, start: f64) -> Result<Option<f64>, Error> {
        let mut tolerance = rounded(start);
        for step in 0..STEPS_MAX[1] {
            let rays = RayBudget::Tolerance { tolerance, most: RAYS_MOST };
            self.measure(Setting { rays, reflections, ..self.own.clone() })?;
            let is_known = self.least_rank().is_finite();
            if (reflections < REFLECTIONS_MAX && self.is_far()) || (is_known && step + 1 >= STEPS_MAX[0]) {
                break;
            }
            let Some((next, rank)) = self.aim(reflections) else { break };
            if rank > WORTH * self.least_rank() || self.met_near(reflections, next) {
                break;
            }
            let Some(unseen) = self.unseen(reflections, next) else { break };
            tolerance = unseen;
        }
        let met = self.family(reflections).filter(|(_, one)| self.meets(one, &self.sensing[0]));
        let farthest = met.max_by(|a, b| self.abscissa(a.0).total_cmp(&self.abscissa(b.0)));
        Ok(farthest.map(|(tolerance, _)| tolerance))
    }

    /// Whether a setting close to this tolerance meets the goal with some chain.
    fn met_near(&self, reflections: u32, next: f64) -> bool {
        self.family(reflections).any(|(tolerance, one)| is_close(tolerance, next) && self.meets_with_any(one))
    }

    /// This tolerance, or where one close to it was measured and missed the goal, the next on the safe side of it.
    fn unseen(&self, reflections: u32, next: f64) -> Option<f64> {
        let mut abscissa = self.abscissa(next);
        for _ in 0..STEPS_MAX[1] {
            let tolerance = rounded(self.abscissa(abscissa));
            if !self.family(reflections).any(|(measured, _)| is_close(measured, tolerance)) {
                let [fine, coarse] = self.tolerances();
                return (fine..=coarse).contains(&tolerance).then_some(tolerance);
            }
            abscissa /= CLOSE;
        }
        None
    }

    /// Finest and coarsest tolerance to measure. The reference cannot distinguish much finer ones.
    fn tolerances(&self) -> [f64; 2] {
        let of_reference = match self.reference.setting.rays {
            RayBudget::Tolerance { tolerance, .. } => tolerance,
            RayBudget::Fixed(_) | RayBudget::Subframes(_) => 0.0,
        };
        [greater(TOLERANCES[0], of_reference / BEYOND), TOLERANCES[1]]
    }

    /// What was measured along the tolerances.
    fn family(&self, reflections: u32) -> impl Iterator<Item = (f64, &Rendered)> {
        self.rendered.iter().filter_map(move |one| match one.setting.rays {
            RayBudget::Tolerance { tolerance, .. } if one.setting.reflections == reflections => Some((tolerance, one)),
            _ => None,
        })
    }

    /// The tolerance at which some chain is thought to meet the goal just so, at the best rank of all chains, and that rank.
    fn aim(&self, reflections: u32) -> Option<(f64, f64)> {
        // Squares are powers of a tolerance, wall time is one of its inverse.
        let power = match self.goal {
            Goal::Accuracy(_) => 2.0,
            Goal::Time(_) => 1.0,
        };
        let raised = |value: f64| libm::pow(value, power);
        let of = |sensing| {
            let points = || self.family(reflections).map(|(tolerance, one)| (self.abscissa(tolerance), one));
            let bounded =
                Curve::new(points().map(|(abscissa, one)| (abscissa, raised(self.bounded(one, sensing))))).growing();
            let [fine, coarse] = self.tolerances().map(|end| self.abscissa(end));
            let abscissa = bounded.reaches(raised(AIM * self.bound()))?;
            let abscissa = greater(lesser(fine, coarse), lesser(abscissa, greater(fine, coarse)));
            let ranks = Curve::new(points().map(|(abscissa, one)| (abscissa, self.rank(one, sensing))));
            Some((self.abscissa(abscissa), ranks.at(abscissa, RANK_POWER)))
        };
        self.sensing.iter().filter_map(of).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether the last setting's error is beyond what finer tolerances could mend: what it does not follow is missing.
    fn is_far(&self) -> bool {
        let (Goal::Accuracy(accuracy), Some(last)) = (self.goal, self.rendered.last()) else { return false };
        mean_square(&last.errors) > FAR * accuracy * accuracy
    }

    /// Twice as many rays each time, until the goal is met (or, for a time, missed), or the best so far is faster.
    fn search_fixed(&mut self, reflections: u32) -> Result<(), Error> {
        for power in 0..8 {
            let setting = Setting { rays: RayBudget::Fixed(1 << power), reflections, ..self.own.clone() };
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
        let share = lesser(f64_from_usize(self.rendered.len()) / EXPECTED, 0.95);
        self.bench.progress.at("settings", share);
        let all = f64_from_usize(self.reference.judged.len());
        let goal = self.goal;
        // Even if the frames to come had no error, or took no time.
        let hopeless = |one: &Rendered| {
            let seen = f64_from_usize(one.errors.len()) / all;
            match goal {
                Goal::Accuracy(accuracy) => seen * mean_square(&one.errors) > accuracy * accuracy,
                Goal::Time(wall_ms) => seen * one.cost.wall_ms > wall_ms,
            }
        };
        let one = render_until(self.bench, &self.reference, &setting, &hopeless)?;
        let meets = self.meets(&one, &self.sensing[0]);
        self.rendered.push(one);
        Ok(meets)
    }
}

fn is_close(one: f64, other: f64) -> bool {
    (1.0 / CLOSE..=CLOSE).contains(&(one / other))
}

/// Two leading digits, so that a person can read what was written; below 2 of the first, steps of half of the second.
fn rounded(tolerance: f64) -> f64 {
    let unit = libm::pow(10.0, libm::floor(libm::log10(tolerance)) - 1.0);
    let unit = if tolerance < 20.0 * unit { 0.5 * unit } else { unit };
    let kept = (tolerance / unit).round_ties_even() * unit;
    // A power of ten is not exact; its decimal form is.
    format!("{kept:.6}").parse().unwrap_or(tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_written_with_few_digits_and_within_three_percent() {
        let mut tried = 0;
        let mut tolerance = TOLERANCES[0];
        while tolerance <= TOLERANCES[1] {
            let found = rounded(tolerance);
            // Half a unit of 20 and more, or a quarter of one of 10 and more: 2.5 %; the last bit of f64 besides.
            assert!((found / tolerance - 1.0).abs() <= 0.025 + 1e-9, "{tolerance}: {found}");
            let digits = format!("{found}").chars().filter(char::is_ascii_digit).collect::<String>();
            assert!(digits.trim_matches('0').len() <= 3, "{tolerance}: {found}");
            tolerance *= 1.013;
            tried += 1;
        }
        assert!(tried > 700, "{tried}");
        assert_eq!([rounded(0.1049), rounded(0.47), rounded(1.23)], [0.105, 0.47, 1.25]);
    }
}
