//! What a run cost. Enters: counted events, its length and a technology. Leaves: energy by block and by constant, the
//! likely range, and which constants decided the answer.

use crate::energy::technology::Technology;
use crate::energy::uncertainty::{Range, Term, range_of, variance_shares};
use crate::events::{Block, Event, Events};
use crate::num::{f64_from_u64, f64_from_u128, u64_half_even};

/// Attojoules of a picojoule.
const AJ_PER_PJ: f64 = 1e6;

/// How long a run was and how much sensor took part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunLength {
    /// Frames of the rig. At least 1.
    pub frames: u32,
    /// Sensors that draw static power.
    pub sensors: u32,
    /// Pixels of all sensors together. At least 1.
    pub pixels: u64,
    /// Frames times frame time, in seconds. Above 0.
    pub run_time_s: f64,
}

/// Energy that one constant is answerable for.
#[derive(Clone, Debug, PartialEq)]
pub struct Contribution {
    /// The event, or `static_` and the block.
    pub name: String,
    /// Who pays.
    pub block: Block,
    /// Times the event happened in the run; for static power the run's length in nanoseconds times sensors.
    pub times: u64,
    /// Attojoules an event; for static power nanowatts a sensor (a nanowatt for a nanosecond is an attojoule).
    pub constant: u64,
    /// The product: attojoules of the run.
    pub energy_aj: u128,
    /// The constant lies within this factor both ways.
    pub uncertainty_factor: f64,
    /// Where the constant comes from.
    pub source: String,
}

/// Energy of a run, by constant.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyAccount {
    /// Name of the technology.
    pub technology: String,
    /// The run.
    pub length: RunLength,
    /// One for each event in the data's order, then one for the static power of each block.
    pub contributions: Vec<Contribution>,
}

impl EnergyAccount {
    /// Multiplies counts by constants. Panics on a run without frames, pixels or time.
    pub fn of(events: &Events, length: RunLength, technology: &Technology) -> Self {
        assert!(length.frames > 0 && length.pixels > 0, "an account needs frames and pixels");
        assert!(length.run_time_s > 0.0, "an account needs time");
        let dynamic = events.iter().map(|(event, times)| event_contribution(event, times, technology));
        let still = Block::ALL.iter().map(|&block| static_contribution(block, length, technology));
        Self { technology: technology.name.clone(), length, contributions: dynamic.chain(still).collect() }
    }

    /// Attojoules of the whole run.
    pub fn total_aj(&self) -> u128 {
        self.contributions.iter().map(|part| part.energy_aj).sum()
    }

    /// Attojoules of one block in the whole run.
    pub fn block_aj(&self, block: Block) -> u128 {
        self.of_block(block).map(|part| part.energy_aj).sum()
    }

    /// Picojoules a frame of an energy of the run.
    pub fn pj_per_frame(&self, energy_aj: u128) -> f64 {
        f64_from_u128(energy_aj) / AJ_PER_PJ / f64::from(self.length.frames)
    }

    /// Picojoules a frame of the whole rig.
    pub fn total_pj_per_frame(&self) -> f64 {
        self.pj_per_frame(self.total_aj())
    }

    /// Picojoules a pixel and frame.
    pub fn pj_per_pixel(&self) -> f64 {
        self.total_pj_per_frame() / f64_from_u64(self.length.pixels)
    }

    /// Mean power of the run in milliwatts.
    pub fn power_mw(&self) -> f64 {
        self.mean_power_mw(self.total_aj())
    }

    /// The part of the power in milliwatts that flows whether or not anything happens.
    pub fn static_power_mw(&self) -> f64 {
        self.mean_power_mw(self.contributions[Event::ALL.len()..].iter().map(|part| part.energy_aj).sum())
    }

    /// Likely range of the total in pJ a frame.
    pub fn total_range_pj(&self) -> Range {
        range_of(&self.terms(&mut self.contributions.iter()))
    }

    /// Likely range of one block in pJ a frame.
    pub fn block_range_pj(&self, block: Block) -> Range {
        range_of(&self.terms(&mut self.of_block(block)))
    }

    /// Contributions with their share of the total's variance, the greatest first; equal ones in the data's order. The
    /// first few are the constants that decided the answer.
    pub fn deciders(&self) -> Vec<(&Contribution, f64)> {
        let shares = variance_shares(&self.terms(&mut self.contributions.iter()));
        let mut ranked: Vec<_> = self.contributions.iter().zip(shares).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked
    }

    /// Counts and energies as bytes, little-endian in the data's order: what the run's energy hash is taken of.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for part in &self.contributions {
            bytes.extend(part.times.to_le_bytes());
            bytes.extend(part.constant.to_le_bytes());
            bytes.extend(part.energy_aj.to_le_bytes());
        }
        bytes
    }

    fn of_block(&self, block: Block) -> impl Iterator<Item = &Contribution> {
        self.contributions.iter().filter(move |part| part.block == block)
    }

    fn terms(&self, parts: &mut dyn Iterator<Item = &Contribution>) -> Vec<Term> {
        parts.map(|part| Term { value: self.pj_per_frame(part.energy_aj), factor: part.uncertainty_factor }).collect()
    }

    fn mean_power_mw(&self, energy_aj: u128) -> f64 {
        // An attojoule a second is 1e-15 mW.
        f64_from_u128(energy_aj) / 1e15 / self.length.run_time_s
    }
}

fn event_contribution(event: Event, times: u64, technology: &Technology) -> Contribution {
    let (constant, facts) = (technology.energy_aj(event), technology.event(event));
    Contribution {
        name: event.name().to_owned(),
        block: event.block(),
        times,
        constant,
        energy_aj: u128::from(times) * u128::from(constant),
        uncertainty_factor: facts.uncertainty_factor,
        source: facts.source.clone(),
    }
}

fn static_contribution(block: Block, length: RunLength, technology: &Technology) -> Contribution {
    let (constant, facts) = (technology.power_nw(block), technology.static_power(block));
    let times = u64_half_even(length.run_time_s * 1e9).saturating_mul(u64::from(length.sensors));
    Contribution {
        name: format!("static_{}", block.name()),
        block,
        times,
        constant,
        energy_aj: u128::from(times) * u128::from(constant),
        uncertainty_factor: facts.uncertainty_factor,
        source: facts.source.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn account(sensors: u32) -> EnergyAccount {
        let mut events = Events::default();
        events.add(Event::LinkByte, 4_000);
        events.add(Event::ComputeOp, 7);
        let length = RunLength { frames: 4, sensors, pixels: 1_000, run_time_s: 0.125 };
        EnergyAccount::of(&events, length, &Technology::by_name("65nm").unwrap())
    }

    #[test]
    fn events_times_constants_are_exact_to_the_attojoule() {
        let account = account(0);
        assert_eq!(account.block_aj(Block::Link), 4_000 * 100_000_000);
        assert_eq!(account.block_aj(Block::Compute), 7 * 500_000);
        assert_eq!(account.total_aj(), 4_000 * 100_000_000 + 7 * 500_000);
        assert_eq!(account.total_pj_per_frame(), (400_000.0 + 3.5) / 4.0);
        assert_eq!(account.pj_per_pixel(), (400_000.0 + 3.5) / 4_000.0);
    }

    #[test]
    fn static_power_flows_in_every_sensor_all_the_time() {
        // 65nm.toml: 0.2 + 0.3 + 0.5 = 1 mW a sensor; converters and link have none beside their events.
        assert_eq!(account(2).static_power_mw(), 2.0);
        let dynamic_mw = account(0).power_mw();
        // One division each way: two roundings of a number below 8.
        assert!((account(2).power_mw() - dynamic_mw - 2.0).abs() < 1e-14);
    }

    #[test]
    fn the_blocks_add_up_to_the_total() {
        let account = account(2);
        let sum: u128 = Block::ALL.iter().map(|&block| account.block_aj(block)).sum();
        assert_eq!(sum, account.total_aj());
        let range = account.total_range_pj();
        assert!(range.low < account.total_pj_per_frame() && account.total_pj_per_frame() < range.high);
    }

    #[test]
    fn the_constant_that_decides_comes_first_and_shares_add_to_one() {
        let account = account(0);
        let deciders = account.deciders();
        assert_eq!(deciders[0].0.name, "link_byte");
        let sum: f64 = deciders.iter().map(|(_, share)| share).sum();
        // Twenty-two shares, each rounded once.
        assert!((sum - 1.0).abs() < 1e-14, "{sum}");
    }

    #[test]
    fn the_bytes_change_with_a_single_event() {
        assert_ne!(account(0).to_bytes(), account(1).to_bytes());
        assert_eq!(account(1).to_bytes(), account(1).to_bytes());
    }
}
