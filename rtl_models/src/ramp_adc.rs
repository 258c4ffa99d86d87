//! Single-slope column ADC, clock by clock. Converts each column's level in nV to the code at which the ramp passes it.
//!
//! One accumulator serves all columns: it adds the span each clock, so that after k clocks the ramp stands at
//! round(k span / 2^b) nV, halves up, with no error that grows. A column counts while the ramp stands at or below its level.
//! The levels are a model in integers of the analog side; hardware sees only the comparator's bit.

/// Run-time parameters of the ramp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RampConfig {
    /// Depth in bits, 1 to 16.
    pub bits: u32,
    /// Span of the ramp in nV, 1 to 2^40.
    pub span_nv: i64,
}

impl RampConfig {
    /// Ramp steps of a conversion, which is the greatest code.
    pub fn steps(self) -> u32 {
        (1 << self.bits) - 1
    }
}

/// Shared outputs after a rising edge of `adc_clk`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RampOut {
    /// Where the ramp stands, in nV above its bottom.
    pub ramp_nv: i64,
    /// Clocks since the start of the conversion.
    pub clock: u32,
    /// The ramp has made its last step: all codes are final.
    pub done: bool,
}

/// The columns of one row under one ramp. Buffers are borrowed, one entry a column.
#[derive(Debug)]
pub struct RampAdc<'a> {
    config: RampConfig,
    accumulator: i64,
    clock: u32,
    codes: &'a mut [u16],
    latched: &'a mut [bool],
}

impl<'a> RampAdc<'a> {
    /// A converter in reset. Panics on parameters out of range or buffers of different lengths.
    pub fn new(config: RampConfig, codes: &'a mut [u16], latched: &'a mut [bool]) -> Self {
        assert!((1..=16).contains(&config.bits), "depths go from 1 to 16 bits");
        assert!((1..=1 << 40).contains(&config.span_nv), "a span goes from 1 nV to 2^40 nV");
        assert!(codes.len() == latched.len(), "a column has one code and one latch");
        let mut adc = Self { config, accumulator: 0, clock: 0, codes, latched };
        adc.reset();
        adc
    }

    /// Synchronous reset: the ramp at its bottom, codes 0, no column latched.
    pub fn reset(&mut self) {
        self.accumulator = 1 << (self.config.bits - 1);
        self.clock = 0;
        self.codes.fill(0);
        self.latched.fill(false);
    }

    /// Shared outputs as they stand.
    pub fn out(&self) -> RampOut {
        RampOut {
            ramp_nv: self.accumulator >> self.config.bits,
            clock: self.clock,
            done: self.clock == self.config.steps(),
        }
    }

    /// Codes as they stand.
    pub fn codes(&self) -> &[u16] {
        self.codes
    }

    /// Which columns have crossed.
    pub fn latched(&self) -> &[bool] {
        self.latched
    }

    /// One rising edge of `adc_clk`: the ramp steps, then each column that has not crossed either counts or latches. Does
    /// nothing once the ramp is done. Panics if there is not one level a column.
    pub fn tick(&mut self, levels_nv: &[i64]) -> RampOut {
        assert!(levels_nv.len() == self.codes.len(), "a column has one level");
        if self.clock == self.config.steps() {
            return self.out();
        }
        self.accumulator += self.config.span_nv;
        self.clock += 1;
        let ramp_nv = self.accumulator >> self.config.bits;
        for ((code, latched), &level_nv) in self.codes.iter_mut().zip(self.latched.iter_mut()).zip(levels_nv) {
            let above = ramp_nv > level_nv;
            *latched |= above;
            *code += u16::from(!*latched);
        }
        self.out()
    }

    /// The same as `clocks` ticks under levels that do not change, in one step a column.
    pub fn advance(&mut self, clocks: u32, levels_nv: &[i64]) -> RampOut {
        assert!(levels_nv.len() == self.codes.len(), "a column has one level");
        let clocks = clocks.min(self.config.steps() - self.clock);
        self.clock += clocks;
        self.accumulator += self.config.span_nv * i64::from(clocks);
        for ((code, latched), &level_nv) in self.codes.iter_mut().zip(self.latched.iter_mut()).zip(levels_nv) {
            if *latched {
                continue;
            }
            // A level that moved since the last clock can be behind the ramp: then the next clock latches at the code held.
            let reached = edges_reached(self.config, level_nv, self.clock).max((*code).into());
            *latched = clocks > 0 && reached < self.clock;
            *code = u16::try_from(reached).expect("at most 2^16 - 1 ramp steps");
        }
        self.out()
    }
}

/// How many of the first `most` edges stand at or below a level.
fn edges_reached(config: RampConfig, level_nv: i64, most: u32) -> u32 {
    if level_nv < 0 {
        return 0;
    }
    // Edge k is at or below s when k span < (2 s + 1) 2^(b-1); beyond the span the count is `most` anyway.
    let level_nv = level_nv.min(config.span_nv);
    let count = (((2 * level_nv + 1) << (config.bits - 1)) - 1) / config.span_nv;
    u32::try_from(count).expect("a level within the span reaches at most 2^16 edges").min(most)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};
    use std::{vec, vec::Vec};

    /// For cases; prints nothing, since a case is named by its number.
    fn below(random: &mut Xoshiro256PlusPlus, bound: i64) -> i64 {
        i64::try_from(random.next_u64() >> 1).unwrap() % bound
    }

    #[test]
    fn advance_equals_ticks_at_every_pause_and_with_levels_that_move() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut pauses = 0;
        for case in 0..200_u32 {
            let bits = 1 + case % 11;
            let span_nv = 1 + below(&mut random, 1 << (4 + case % 30));
            let config = RampConfig { bits, span_nv };
            let (mut codes_a, mut codes_b) = ([0; 16], [0; 16]);
            let (mut latched_a, mut latched_b) = ([false; 16], [false; 16]);
            let mut ticked = RampAdc::new(config, &mut codes_a, &mut latched_a);
            let mut advanced = RampAdc::new(config, &mut codes_b, &mut latched_b);
            let mut levels: Vec<i64> = (0..16).map(|_| below(&mut random, 2 * span_nv + 2) - span_nv / 2).collect();
            while !ticked.out().done {
                let clocks = u32::try_from(below(&mut random, 1 + i64::from(config.steps() / 3))).unwrap();
                for _ in 0..clocks {
                    ticked.tick(&levels);
                }
                assert_eq!(advanced.advance(clocks, &levels), ticked.out(), "case {case}");
                assert_eq!(advanced.codes(), ticked.codes(), "case {case}");
                assert_eq!(advanced.latched(), ticked.latched(), "case {case}");
                pauses += 1;
                if case % 2 == 0 {
                    levels[pauses % 16] = below(&mut random, 2 * span_nv + 2) - span_nv / 2;
                }
                if clocks == 0 {
                    ticked.tick(&levels);
                    advanced.tick(&levels);
                }
            }
        }
        assert!(pauses > 1000, "{pauses} pauses tried");
    }

    #[test]
    fn a_level_on_an_edge_counts_it_and_one_nanovolt_less_does_not() {
        let config = RampConfig { bits: 4, span_nv: 1000 };
        for k in 1..16 {
            let edge_nv = (k * 1000 + 8) / 16;
            let levels = vec![edge_nv - 1, edge_nv, -1, 5000];
            let (mut codes, mut latched) = ([0; 4], [false; 4]);
            let mut adc = RampAdc::new(config, &mut codes, &mut latched);
            while !adc.tick(&levels).done {}
            let k = u16::try_from(k).unwrap();
            assert_eq!(adc.codes(), [k - 1, k, 0, 15]);
            assert_eq!(adc.latched(), [true, k < 15, true, false]);
        }
    }

    #[test]
    fn reset_starts_again_and_a_finished_ramp_stays() {
        let (mut codes, mut latched) = ([0; 1], [false; 1]);
        let mut adc = RampAdc::new(RampConfig { bits: 3, span_nv: 80 }, &mut codes, &mut latched);
        let end = adc.advance(99, &[35]);
        assert_eq!((end, adc.codes()), (RampOut { ramp_nv: 70, clock: 7, done: true }, &[3_u16][..]));
        assert_eq!(adc.tick(&[35]), end);
        adc.reset();
        assert_eq!((adc.out().clock, adc.out().ramp_nv, adc.codes()), (0, 0, &[0_u16][..]));
    }
}
