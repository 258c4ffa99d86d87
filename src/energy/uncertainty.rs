//! How far a sum of uncertain constants may be off: drawn by Monte Carlo.
//!
//! Constants are log-normal. Those of one scaling class belong to one node and move together: half of the variance of each is common to its
//! class, half its own; an item that rests on a constant moves with it. What remains between a published chip and a model of exact
//! constants is a factor common to all items, the model's discrepancy.

use super::constant::Constant;
use super::item::Item;
use super::technology::Technology;
use crate::draw::{DrawKey, normal_quantile, uniform_at};
use crate::num::{index, lesser};

/// Draws of the Monte Carlo. The 2.5 % quantile of 1,000 draws has a standard error of 0.5 % in probability.
const DRAWS: u32 = 1_000;
/// Names the draws; they are the same in every account.
const SEED: u64 = 0x656e_6572_6779;
/// Standard deviations on either side of the median that a stated factor stands for.
const SIGMAS: f64 = 2.0;
/// Share of a constant's variance that it has in common with the others of its class.
const COMMON: f64 = 0.5;
/// Standard deviation of the logarithm of published over modelled power, of vendors that the fit has not seen. `tests/chips.rs` holds it to
/// what the table of docs/energy.md measures.
pub const DISCREPANCY: f64 = 0.38;

/// A range that holds the true value with 95 % confidence, in the unit of the terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

fn sigma(technology: &Technology, constant: Constant) -> f64 {
    libm::log(technology.of(constant).uncertainty_factor) / SIGMAS
}

/// For each draw, the factor of every item and of the whole model.
pub(super) struct Drawn {
    factors: Vec<Vec<f64>>,
    model: Vec<f64>,
}

impl Drawn {
    /// Draws the constants of these items.
    pub fn of(items: &[Item], technology: &Technology) -> Self {
        let (own, common) = (libm::sqrt(1.0 - COMMON), libm::sqrt(COMMON));
        let (mut factors, mut model) = (Vec::new(), Vec::new());
        for draw in 0..DRAWS {
            let key = DrawKey::root(SEED).with(draw.into());
            let normal = |column: usize| normal_quantile(uniform_at(key, column));
            // The first columns belong to the classes and the model, the others to the constants.
            let classes = [normal(0), normal(1), normal(2)];
            model.push(libm::exp(DISCREPANCY * normal(3)));
            let factor = |item: &Item| {
                let z = common * classes[technology.of(item.of).scaling as usize] + own * normal(4 + item.of as usize);
                libm::exp(sigma(technology, item.of) * z)
            };
            factors.push(items.iter().map(factor).collect());
        }
        Self { factors, model }
    }

    /// The likely range of a sum; `values` has one entry an item.
    pub fn range_of(&self, values: &[f64]) -> Range {
        let sum = |factors: &Vec<f64>| factors.iter().zip(values).map(|(factor, value)| factor * value).sum::<f64>();
        let mut sums: Vec<f64> =
            self.factors.iter().zip(&self.model).map(|(factors, model)| model * sum(factors)).collect();
        sums.sort_by(f64::total_cmp);
        let tail = index(DRAWS / 40);
        Range { low: sums[tail - 1], high: sums[sums.len() - tail] }
    }
}

/// Share of the sum's variance that each item brings beside the model's discrepancy; all zero where nothing is uncertain.
pub(super) fn variance_shares(items: &[Item], values: &[f64], technology: &Technology) -> Vec<f64> {
    let variance = |(item, value): (&Item, &f64)| {
        let log_variance = sigma(technology, item.of) * sigma(technology, item.of);
        value * value * libm::exp(log_variance) * libm::expm1(log_variance)
    };
    let variances: Vec<f64> = items.iter().zip(values).map(variance).collect();
    let whole: f64 = variances.iter().sum();
    variances.iter().map(|one| if whole > 0.0 { lesser(one / whole, 1.0) } else { 0.0 }).collect()
}
