//! Cases for the twins' tests: a seeded stream, random configs, and comparators that follow given crossings.

use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use rtl_models::NEVER;
use rtl_models::cds::CdsConfig;
use rtl_models::ramp_counter::RampCounterOut;
use rtl_models::readout_seq::SeqConfig;
use rtl_models::sensor_core::CoreConfig;

/// SplitMix64: a seed is its whole state, so a function of the clock can begin one for each clock.
pub struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::seed_from_u64(seed))
    }

    pub fn next(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// 0 .. bound-1.
    pub fn below(&mut self, bound: u32) -> u32 {
        u32::try_from(self.next() % u64::from(bound)).unwrap()
    }

    pub fn within(&mut self, least: u32, most: u32) -> u32 {
        least + self.below(most - least + 1)
    }

    /// True once in `n`.
    pub fn one_in(&mut self, n: u32) -> bool {
        self.below(n) == 0
    }

    /// A crossing of a ramp: anywhere, its first and last step, beyond the last, never.
    pub fn crossing(&mut self, steps: u32) -> u32 {
        let steps = steps.max(1);
        match self.below(8) {
            0 => 1,
            1 => steps,
            2 => steps + 1,
            3 => NEVER,
            _ => self.within(1, steps),
        }
    }
}

/// A legal core: any depth and mode, lines with and without blank, room for the lanes or (once in `tight`) too little.
pub fn core_config(random: &mut Random, bits: u32, columns_max: u32, tight: u32) -> CoreConfig {
    let lanes = random.within(1, columns_max.min(16));
    let columns = lanes * random.within(1, columns_max / lanes);
    let n_settle_reset = random.within(2, 9);
    let n_settle_signal = random.within(2, 9);
    let n_ramp_reset = if random.one_in(3) { 0 } else { random.within(1, 1 << (bits - bits / 3)) };
    let n_ramp_signal = if random.one_in(4) { random.within(1, 1 << bits) } else { 1 << bits };
    let used = n_settle_reset + n_ramp_reset + n_settle_signal + n_ramp_signal;
    let shift = if random.one_in(tight) { 0 } else { columns / lanes * bits + 1 };
    let hts = used.max(shift) + if random.one_in(2) { 0 } else { random.below(30) };
    let rows = random.within(1, 5);
    let vts = rows.max(2) + random.below(4);
    let seq = SeqConfig {
        global_shutter: random.one_in(2),
        hts,
        vts,
        rows,
        first_row: random.below(100),
        row_step: random.within(1, 3),
        n_settle_reset,
        n_ramp_reset,
        n_settle_signal,
        n_ramp_signal,
        exposure_lines: random.within(1, vts - 1),
    };
    let black = random.below(1 << bits);
    let black = u16::try_from(if random.one_in(4) { black / 16 } else { black }).unwrap();
    let cds = CdsConfig { bits, black, latch_mode: random.one_in(2), gray: random.one_in(2) };
    CoreConfig { seq, cds, lanes, columns }
}

/// The comparators' bits in the coming clock, for the crossings of the row that is read.
pub fn comparators(ramp: &RampCounterOut, crossings: &[u32], bits: &mut [u64]) {
    bits.fill(0);
    for (column, &crossing) in crossings.iter().enumerate() {
        bits[column / 64] |= u64::from(ramp.ramp_code >= crossing) << (column % 64);
    }
}
