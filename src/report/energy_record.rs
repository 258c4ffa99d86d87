//! The energy part of `report.json`: an energy account as picojoules and milliwatts.

use serde::{Deserialize, Serialize};

use crate::energy::{Amount, Contribution, EnergyAccount, Rail, Range};
use crate::events::Block;
use crate::num::f64_from_u64;
use crate::report::ordered::Ordered;

/// Energy of all sensors of the rig, per frame of the rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnergyRecord {
    /// Technology file.
    pub technology: String,
    /// Dynamic and static energy of each block, in pJ per frame.
    pub blocks: Ordered<f64>,
    /// Likely range of each block.
    pub blocks_interval: Ordered<Interval>,
    /// The same energy by supply rail: analog, digital, io.
    pub rails: Ordered<f64>,
    /// Sum of the blocks, and of the rails.
    pub total_pj_per_frame: f64,
    /// Likely range of the sum.
    pub total_interval: Interval,
    /// Of the sum, as a mean over the run.
    pub power_mw: f64,
    /// Part of `power_mw` that flows whether or not anything happens.
    pub static_power_mw: f64,
    /// Of the sum, over the pixels of all cameras.
    pub pj_per_pixel: f64,
    /// Power of one sensor over a line in which a row is converted; none where it was not asked for.
    pub line: Option<LinePower>,
    /// Every item, in the data's order.
    pub entries: Vec<EnergyEntry>,
    /// Which constants decided the answer, the greatest share first.
    pub deciders: Vec<Decider>,
}

/// Power of one sensor over a line in which a row is converted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinePower {
    /// Length of the line.
    pub line_us: f64,
    /// Spans of equal power, one after another from the line's start.
    pub spans: Vec<PowerSpan>,
    /// Mean over the frame, blanking included.
    pub frame_mean_mw: f64,
    /// The greatest of the spans.
    pub peak_mw: f64,
    /// The greatest over the frame's mean.
    pub peak_over_mean: f64,
}

/// A span of a line.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PowerSpan {
    /// From the start of the line.
    pub start_us: f64,
    /// From the start of the line.
    pub end_us: f64,
    /// Mean power of each block within the span.
    pub blocks_mw: Ordered<f64>,
}

/// A range in pJ per frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    /// Lower end.
    pub low_pj: f64,
    /// Upper end.
    pub high_pj: f64,
}

/// An item of the model: an event, or a bias over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnergyEntry {
    /// Name of the constant.
    pub name: String,
    /// Block that pays.
    pub block: String,
    /// Supply rail.
    pub rail: String,
    /// Times per frame; for bias milliseconds per frame, of all sensors.
    pub times_per_frame: f64,
    /// In `unit`.
    pub constant: f64,
    /// "pJ" a time, or "mW" while bias flows.
    pub unit: String,
    /// Of the product.
    pub pj_per_frame: f64,
    /// The constant may be this factor lower or higher.
    pub uncertainty_factor: f64,
    /// Where the constant comes from.
    pub source: String,
}

/// A constant that decided the answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Decider {
    /// Name of the constant.
    pub name: String,
    /// Share of the total's energy.
    pub energy_share: f64,
    /// Share of the variance of the total.
    pub variance_share: f64,
}

impl From<Range> for Interval {
    fn from(range: Range) -> Self {
        Self { low_pj: range.low, high_pj: range.high }
    }
}

impl From<&EnergyAccount> for EnergyRecord {
    fn from(account: &EnergyAccount) -> Self {
        let blocks = Block::ALL.iter();
        let (total, ranges) = account.ranges_pj();
        let rail = |&rail: &Rail| (rail.name(), account.pj_per_frame(account.rail_aj(rail)));
        Self {
            technology: account.power.technology.name.clone(),
            blocks: blocks.clone().map(|&b| (b.name(), account.pj_per_frame(account.block_aj(b)))).collect(),
            blocks_interval: blocks.zip(ranges).map(|(&b, range)| (b.name(), range.into())).collect(),
            rails: Rail::ALL.iter().map(rail).collect(),
            total_pj_per_frame: account.total_pj_per_frame(),
            total_interval: total.into(),
            power_mw: account.power_mw(),
            static_power_mw: account.static_power_mw(),
            pj_per_pixel: account.pj_per_pixel(),
            line: None,
            entries: account.contributions.iter().map(|part| entry(account, part)).collect(),
            deciders: deciders(account),
        }
    }
}

fn entry(account: &EnergyAccount, part: &Contribution) -> EnergyEntry {
    // Bias is counted in nanoseconds and shown in milliseconds.
    let (unit, times_of_unit) = match part.item.amount {
        Amount::Event(_) | Amount::PerFrame(_) => ("pJ", 1.0),
        Amount::Nanoseconds(_) | Amount::LaneNanoseconds => ("mW", 1e6),
    };
    EnergyEntry {
        name: part.item.name.to_owned(),
        block: part.item.block.name().to_owned(),
        rail: part.item.rail.name().to_owned(),
        times_per_frame: f64_from_u64(part.times) / times_of_unit / f64::from(account.frames),
        constant: f64_from_u64(part.item.constant) / 1e6,
        unit: unit.to_owned(),
        pj_per_frame: account.pj_per_frame(part.energy_aj),
        uncertainty_factor: part.uncertainty_factor,
        source: part.source.clone(),
    }
}

fn deciders(account: &EnergyAccount) -> Vec<Decider> {
    let total = account.total_pj_per_frame();
    let share = |part: &Contribution| if total > 0.0 { account.pj_per_frame(part.energy_aj) / total } else { 0.0 };
    let decider = |(part, variance_share): (&Contribution, f64)| Decider {
        name: part.item.name.to_owned(),
        energy_share: share(part),
        variance_share,
    };
    account.deciders().into_iter().map(decider).collect()
}
