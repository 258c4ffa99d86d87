//! What a run cost: energy by item, block and rail, the likely range, and which constants decided the answer.

use super::item::{Amount, Item, Rail};
use super::model::SensorPower;
use super::uncertainty::{Drawn, Range, variance_shares};
use crate::events::{Block, Events};
use crate::num::{f64_from_u64, f64_from_u128};

/// Attojoules of a picojoule.
const AJ_PER_PJ: f64 = 1e6;

/// Energy of one item.
#[derive(Clone, Debug, PartialEq)]
pub struct Contribution {
    /// The item.
    pub item: Item,
    /// Times it happened in the run, or nanoseconds of all sensors.
    pub times: u64,
    /// The product with the item's constant: attojoules of the run.
    pub energy_aj: u128,
    /// The constant lies within this factor both ways.
    pub uncertainty_factor: f64,
    /// Where the constant comes from.
    pub source: String,
}

/// Energy of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyAccount {
    /// The sensor.
    pub power: SensorPower,
    /// Frames of the rig. At least 1.
    pub frames: u32,
    /// Pixels of all sensors together. At least 1.
    pub pixels: u64,
    /// In the order of the data.
    pub contributions: Vec<Contribution>,
}

impl EnergyAccount {
    /// Multiplies counts of `frames` frames of `sensors` sensors by constants. Panics on a run without frames or pixels.
    pub fn of(events: &Events, frames: u32, sensors: u32, pixels: u64, power: &SensorPower) -> Self {
        assert!(frames > 0 && pixels > 0, "an account needs frames and pixels");
        let sensor_frames = u64::from(frames) * u64::from(sensors);
        let contribution = |item: &Item| {
            let times = power.times(item.amount, events, sensor_frames);
            let facts = power.technology.of(item.of);
            Contribution {
                item: item.clone(),
                times,
                energy_aj: u128::from(times) * u128::from(item.constant),
                uncertainty_factor: facts.uncertainty_factor,
                source: facts.source.clone(),
            }
        };
        let contributions = power.items.iter().map(contribution).collect();
        Self { power: power.clone(), frames, pixels, contributions }
    }

    /// Attojoules of the whole run.
    pub fn total_aj(&self) -> u128 {
        self.contributions.iter().map(|part| part.energy_aj).sum()
    }

    /// Attojoules of one block in the whole run.
    pub fn block_aj(&self, block: Block) -> u128 {
        self.contributions.iter().filter(|part| part.item.block == block).map(|part| part.energy_aj).sum()
    }

    /// Attojoules from one rail in the whole run.
    pub fn rail_aj(&self, rail: Rail) -> u128 {
        self.contributions.iter().filter(|part| part.item.rail == rail).map(|part| part.energy_aj).sum()
    }

    /// Attojoules of one item of this name; 0 where there is none.
    pub fn item_aj(&self, name: &str) -> u128 {
        self.contributions.iter().filter(|part| part.item.name == name).map(|part| part.energy_aj).sum()
    }

    /// Length of the run in seconds.
    pub fn run_time_s(&self) -> f64 {
        f64::from(self.frames) * f64_from_u64(self.power.period_ns) * 1e-9
    }

    /// Picojoules per frame of an energy of the run.
    pub fn pj_per_frame(&self, energy_aj: u128) -> f64 {
        f64_from_u128(energy_aj) / AJ_PER_PJ / f64::from(self.frames)
    }

    /// Mean power of an energy of the run in milliwatts.
    pub fn mean_power_mw(&self, energy_aj: u128) -> f64 {
        // An attojoule a second is 1e-15 mW.
        f64_from_u128(energy_aj) / 1e15 / self.run_time_s()
    }

    /// Picojoules per frame of the whole rig.
    pub fn total_pj_per_frame(&self) -> f64 {
        self.pj_per_frame(self.total_aj())
    }

    /// Picojoules per pixel and frame.
    pub fn pj_per_pixel(&self) -> f64 {
        self.total_pj_per_frame() / f64_from_u64(self.pixels)
    }

    /// Mean power of the run in milliwatts.
    pub fn power_mw(&self) -> f64 {
        self.mean_power_mw(self.total_aj())
    }

    /// The part of the power in milliwatts that flows whether or not anything happens.
    pub fn static_power_mw(&self) -> f64 {
        let flows = self.contributions.iter().filter(|part| matches!(part.item.amount, Amount::Nanoseconds(_)));
        self.mean_power_mw(flows.map(|part| part.energy_aj).sum())
    }

    /// Likely range in pJ per frame of the total, then of each block in the order of `Block::ALL`.
    pub fn ranges_pj(&self) -> (Range, Vec<Range>) {
        let drawn = Drawn::of(&self.power.items, &self.power.technology);
        let values = self.values_pj();
        let of_block = |&block: &Block| {
            let inside = |(part, &value): (&Contribution, &f64)| if part.item.block == block { value } else { 0.0 };
            drawn.range_of(&self.contributions.iter().zip(&values).map(inside).collect::<Vec<_>>())
        };
        (drawn.range_of(&values), Block::ALL.iter().map(of_block).collect())
    }

    /// Contributions with their share of the total's variance, the greatest first; equal ones in the data's order. The first few are the
    /// constants that decided the answer.
    pub fn deciders(&self) -> Vec<(&Contribution, f64)> {
        let shares = variance_shares(&self.power.items, &self.values_pj(), &self.power.technology);
        let mut ranked: Vec<_> = self.contributions.iter().zip(shares).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked
    }

    /// Counts and energies as bytes, little-endian in the data's order: what the run's energy hash is taken of.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for part in &self.contributions {
            bytes.extend(part.times.to_le_bytes());
            bytes.extend(part.item.constant.to_le_bytes());
            bytes.extend(part.energy_aj.to_le_bytes());
        }
        bytes
    }

    fn values_pj(&self) -> Vec<f64> {
        self.contributions.iter().map(|part| self.pj_per_frame(part.energy_aj)).collect()
    }
}
