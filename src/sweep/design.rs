//! Points of a design space: which value each factor has in each of them.

use rand::RngExt;
use rand::seq::SliceRandom;
use toml::{Table, Value};

use super::file::{Factor, SweepFile};
use crate::draw::DrawKey;
use crate::error::Error;
use crate::num::{f64_from_usize, i64_half_even, index, low_u32, u32_truncated, u64_from};

/// Most cells of a sweep.
pub const CELLS_MAX: u128 = 1_000_000;

/// Published number of a design's draws in keys.
const DESIGN_NUMBER: u64 = 0x6465_7369_676e;

/// Most factors of a Sobol' design: the sequence has no more dimensions.
const SOBOL_FACTORS_MAX: usize = 256;

/// What one factor is in one point.
#[derive(Clone, Debug, PartialEq)]
pub struct FactorSetting {
    /// As tables show it: the value, or the name of the level.
    pub shown: Value,
    /// Keys of the scenario and their values.
    pub set: Vec<(String, Value)>,
}

/// One setting a factor.
pub type Point = Vec<FactorSetting>;

/// Names of the columns that tell points apart.
pub fn factor_names(sweep: &SweepFile) -> Vec<String> {
    if sweep.method == "list" {
        return vec!["cell".to_owned()];
    }
    sweep.factor.iter().map(|factor| factor.name.clone()).collect()
}

/// Number of cells without making them.
pub fn count(sweep: &SweepFile) -> u128 {
    let points = match (sweep.method.as_str(), sweep.samples) {
        ("list", _) => u128::from(u64_from(sweep.cell.len())),
        (_, Some(samples)) => u128::from(samples),
        _ => {
            sweep.factor.iter().map(|factor| u128::from(u64_from(factor.steps_in_grid()))).fold(1, u128::saturating_mul)
        }
    };
    let numbers = |numbers: &Option<super::file::Numbers>| numbers.as_ref().map_or(1, |some| some.list().len());
    let replicates = [numbers(&sweep.seeds), numbers(&sweep.dies), sweep.trajectory.len().max(1)];
    replicates.into_iter().map(|count| u128::from(u64_from(count))).fold(points, u128::saturating_mul)
}

/// All points, in the order of the file. Fails on more cells than a sweep may have, or more factors than a Sobol' sequence has
/// dimensions.
pub fn points(sweep: &SweepFile) -> Result<Vec<Point>, Error> {
    let cells = count(sweep);
    if cells > CELLS_MAX {
        let reason =
            format!("the sweep has {cells} cells; use {CELLS_MAX} or fewer (fewer values, seeds, or a random design)");
        return Err(Error::key("cells", cells, reason));
    }
    let factors = &sweep.factor;
    let samples = index(sweep.samples.unwrap_or(0));
    let key = DrawKey::root(sweep.seed).with(DESIGN_NUMBER);
    match sweep.method.as_str() {
        "list" => Ok(sweep.cell.iter().map(|cell| vec![level(&cell.name, &cell.set)]).collect()),
        "random" => {
            let mut stream = key.stream();
            let point = |_| factors.iter().map(|factor| factor.at(stream.random::<f64>())).collect();
            Ok((0..samples).map(point).collect())
        }
        "latin_hypercube" => Ok(latin_hypercube(factors, samples, key)),
        "sobol" => {
            if factors.len() > SOBOL_FACTORS_MAX {
                let reason = format!("a Sobol' design has up to {SOBOL_FACTORS_MAX} factors; use latin_hypercube");
                return Err(Error::key("method", "sobol", reason));
            }
            let scramble = low_u32(key.0);
            let share = |sample: u32, factor: u32| f64::from(sobol_burley::sample(sample, factor, scramble));
            let point = |sample: usize| {
                let of = |(number, factor): (usize, &Factor)| {
                    factor.at(share(crate::num::u32_from(sample), crate::num::u32_from(number)))
                };
                factors.iter().enumerate().map(of).collect()
            };
            Ok((0..samples).map(point).collect())
        }
        _ => Ok(grid(factors)),
    }
}

/// All combinations; the last factor changes fastest.
fn grid(factors: &[Factor]) -> Vec<Point> {
    let mut points: Vec<Point> = vec![Vec::new()];
    for factor in factors {
        let settings: Vec<FactorSetting> = (0..factor.steps_in_grid()).map(|step| factor.step(step)).collect();
        let longer = |point: &Point| {
            let own = point.clone();
            settings
                .iter()
                .map(move |setting| own.iter().cloned().chain([setting.clone()]).collect())
                .collect::<Vec<_>>()
        };
        points = points.iter().flat_map(longer).collect();
    }
    points
}

/// Each factor's range has as many equal parts as there are points, and each part one point (McKay 1979).
fn latin_hypercube(factors: &[Factor], samples: usize, key: DrawKey) -> Vec<Point> {
    let column = |number: usize| {
        let mut stream = key.with(u64_from(number)).stream();
        let mut parts: Vec<usize> = (0..samples).collect();
        parts.shuffle(&mut stream);
        let share = |part: usize| (f64_from_usize(part) + stream.random::<f64>()) / f64_from_usize(samples);
        parts.into_iter().map(share).collect::<Vec<f64>>()
    };
    let columns: Vec<Vec<f64>> = (0..factors.len()).map(column).collect();
    let point =
        |sample: usize| factors.iter().zip(&columns).map(|(factor, column)| factor.at(column[sample])).collect();
    (0..samples).map(point).collect()
}

fn level(name: &str, set: &Table) -> FactorSetting {
    FactorSetting { shown: Value::String(name.to_owned()), set: assignments(set) }
}

/// A table's values by dotted path: nested tables and dotted keys say the same.
pub fn assignments(set: &Table) -> Vec<(String, Value)> {
    let mut all = Vec::new();
    for (key, value) in set {
        match value {
            Value::Table(inner) => {
                all.extend(assignments(inner).into_iter().map(|(rest, value)| (format!("{key}.{rest}"), value)));
            }
            other => all.push((key.clone(), other.clone())),
        }
    }
    all
}

impl Factor {
    fn steps_in_grid(&self) -> usize {
        match (&self.values, self.steps) {
            (Some(values), _) => values.len(),
            (None, Some(steps)) => index(steps),
            (None, None) => self.level.len(),
        }
    }

    /// The setting of one step of a grid.
    fn step(&self, step: usize) -> FactorSetting {
        match &self.values {
            Some(values) => self.of_value(values[step].clone()),
            None if !self.level.is_empty() => level(&self.level[step].name, &self.level[step].set),
            None => {
                let last = f64_from_usize(self.steps_in_grid() - 1);
                self.of_share(f64_from_usize(step) / last)
            }
        }
    }

    /// The setting at a share of its range, 0 to below 1: values and levels are equally likely.
    fn at(&self, share: f64) -> FactorSetting {
        let choice = |count: usize| index(u32_truncated(share * f64_from_usize(count))).min(count - 1);
        match &self.values {
            Some(values) => self.of_value(values[choice(values.len())].clone()),
            None if !self.level.is_empty() => self.step(choice(self.level.len())),
            None => self.of_share(share),
        }
    }

    fn of_share(&self, share: f64) -> FactorSetting {
        let (low, high) = (self.low.unwrap_or(0.0), self.high.unwrap_or(1.0));
        let value = if self.spacing == "log" {
            low * libm::exp(share * libm::log(high / low))
        } else {
            low + share * (high - low)
        };
        // The ends are met exactly.
        let value = if share >= 1.0 { high } else { value };
        self.of_value(if self.whole { Value::Integer(i64_half_even(value)) } else { Value::Float(value) })
    }

    fn of_value(&self, value: Value) -> FactorSetting {
        let key = self.key.clone().unwrap_or_default();
        FactorSetting { shown: value.clone(), set: vec![(key, value)] }
    }
}
