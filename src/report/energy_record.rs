//! The energy part of `report.json`. Enters: an energy account. Leaves: picojoules and milliwatts as plain data.

use serde::{Deserialize, Serialize};

use crate::energy::{Contribution, EnergyAccount, Range};
use crate::events::{Block, Event};
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
    /// Sum of the blocks.
    pub total_pj_per_frame: f64,
    /// Likely range of the sum.
    pub total_interval: Interval,
    /// Of the sum, as a mean over the run.
    pub power_mw: f64,
    /// Part of `power_mw` that flows whether or not anything happens.
    pub static_power_mw: f64,
    /// Of the sum, over the pixels of all cameras.
    pub pj_per_pixel: f64,
    /// Every event and every static power, in the data's order.
    pub entries: Vec<EnergyEntry>,
    /// Which constants decided the answer, the greatest share first.
    pub deciders: Vec<Decider>,
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

/// One event, or the static power of one block.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnergyEntry {
    /// Event, or `static_` and the block.
    pub name: String,
    /// Block that pays.
    pub block: String,
    /// Times per frame; for static power the frame's length in ms.
    pub times_per_frame: f64,
    /// In pJ per event; for static power in mW.
    pub constant: f64,
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
    /// Event, or `static_` and the block.
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
        Self {
            technology: account.technology.clone(),
            blocks: blocks.clone().map(|&b| (b.name(), account.pj_per_frame(account.block_aj(b)))).collect(),
            blocks_interval: blocks.map(|&b| (b.name(), account.block_range_pj(b).into())).collect(),
            total_pj_per_frame: account.total_pj_per_frame(),
            total_interval: account.total_range_pj().into(),
            power_mw: account.power_mw(),
            static_power_mw: account.static_power_mw(),
            pj_per_pixel: account.pj_per_pixel(),
            entries: account.contributions.iter().enumerate().map(|(i, part)| entry(account, i, part)).collect(),
            deciders: deciders(account),
        }
    }
}

fn entry(account: &EnergyAccount, place: usize, part: &Contribution) -> EnergyEntry {
    let frames = f64::from(account.length.frames);
    // Events come first and are counted one by one; static power is counted in nanoseconds and shown in milliseconds.
    let times_of_unit = if place < Event::ALL.len() { 1.0 } else { 1e6 };
    EnergyEntry {
        name: part.name.clone(),
        block: part.block.name().to_owned(),
        times_per_frame: f64_from_u64(part.times) / times_of_unit / frames,
        constant: f64_from_u64(part.constant) / 1e6,
        pj_per_frame: account.pj_per_frame(part.energy_aj),
        uncertainty_factor: part.uncertainty_factor,
        source: part.source.clone(),
    }
}

fn deciders(account: &EnergyAccount) -> Vec<Decider> {
    let total = account.total_pj_per_frame();
    let share = |part: &Contribution| if total > 0.0 { account.pj_per_frame(part.energy_aj) / total } else { 0.0 };
    let decider = |(part, variance_share): (&Contribution, f64)| Decider {
        name: part.name.clone(),
        energy_share: share(part),
        variance_share,
    };
    account.deciders().into_iter().map(decider).collect()
}
