//! The plain linear ramp in closed form, many columns at a time. Converts microvolts of a row to codes in LSB, and reports how long
//! counters and comparators ran.
//!
//! Ramp level k (1 .. 2^b - 1) is round(k span / 2^b) nV, halves up. A count is the number of ramp levels at or below a sample plus
//! pedestal. `Converter` takes this path where all steps are equal, no comparator lags and none disturbs the ramp; its slow twin is
//! the general path of the same converter. Blocks of columns far enough from all ramp levels are served in f32 (`FastLine`).

use super::fast::{BLOCK, BlockWork, FastLine};
use super::params::AdcParams;
use super::ramp::linear_level_nv;
use super::sample::{RowWork, Sample};
use crate::num::{f64_from_i64, low_u16, low_u32};
use crate::simd::kernel;

/// A row's conversions, with everything that does not depend on the signal done beforehand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LinearKernel {
    /// None where f32 would be in doubt too often.
    fast: Option<FastLine>,
    pedestal_nv: f64,
    /// Last level of the signal's ramp.
    last_level_nv: f64,
    /// Last level of the reset ramp.
    last_reset_level_nv: f64,
    signal_steps: u32,
    reset_steps: u32,
    black_level_dn: i32,
    code_max: i32,
    twice_codes: f64,
    inverse_span_per_nv: f64,
}

/// Adding and subtracting 1.5 * 2^52 rounds |x| <= 2^51 half-even without a cast; the sum's low bits hold the integer.
pub(super) const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Columns whose sums of clocks stay below 2^32: each runs for at most 2^16 - 1 and 2^16 clocks.
const COLUMNS_PER_SUM: usize = 16_384;

impl LinearKernel {
    /// Prepares checked parameters.
    pub fn new(params: &AdcParams) -> Self {
        let span_nv = params.span_nv();
        let ramp_level_nv = |k| f64_from_i64(linear_level_nv(params.bits, span_nv, k));
        let pedestal_nv = ramp_level_nv(params.pedestal_lsb());
        Self {
            fast: FastLine::new(params, pedestal_nv),
            pedestal_nv,
            last_level_nv: ramp_level_nv(params.code_max()),
            last_reset_level_nv: ramp_level_nv(params.reset_counts_used()),
            signal_steps: params.code_max(),
            reset_steps: params.reset_counts_used(),
            black_level_dn: i32::try_from(params.black_level_dn).expect("a black level has at most 16 bits"),
            code_max: i32::try_from(params.code_max()).expect("a code has at most 16 bits"),
            twice_codes: f64_from_i64(1 << (params.bits - 1)),
            inverse_span_per_nv: 1.0 / f64_from_i64(span_nv),
        }
    }

    /// Counts of one conversion, one a sample.
    pub fn counts(&self, sample: Sample, samples_uv: &[f32]) -> Vec<u32> {
        let last_level_nv = match sample {
            Sample::Reset => self.last_reset_level_nv,
            Sample::Signal => self.last_level_nv,
        };
        let mut counts = vec![0; samples_uv.len()];
        count_all(self, samples_uv, last_level_nv, &mut counts);
        counts
    }

    /// Converts a row; without reset samples its counts are the codes. A NaN counts no ramp level.
    pub fn convert_linear_row(&self, signal_uv: &[f32], reset_uv: &[f32], codes: &mut [u16]) -> RowWork {
        let mut work = RowWork::default();
        let mut reset_parts = reset_uv.chunks(COLUMNS_PER_SUM);
        for (signal_uv, codes) in signal_uv.chunks(COLUMNS_PER_SUM).zip(codes.chunks_mut(COLUMNS_PER_SUM)) {
            let [steps, clocks] = match reset_parts.next() {
                Some(reset_uv) => convert_both(self, signal_uv, reset_uv, codes),
                None => convert_one(self, signal_uv, codes),
            };
            work.counter_steps += u64::from(steps);
            work.comparator_clk += u64::from(clocks);
        }
        work
    }

    /// The level that the comparator sees, in nV above the bottom of the ramp, clipped to the ramp's first and last level.
    #[inline(always)]
    fn level_nv(&self, microvolts: f32, last_level_nv: f64) -> f64 {
        // An f32 times 1000 is exact in f64. Beyond 2^40 nV (1,100 V) only the side matters.
        const FAR_NV: f64 = 1_099_511_627_776.0;
        let exact_nv = f64::from(microvolts) * 1000.0;
        let exact_nv = if exact_nv > -FAR_NV { exact_nv } else { -FAR_NV };
        let exact_nv = if exact_nv < FAR_NV { exact_nv } else { FAR_NV };
        let level_nv = (exact_nv + ROUNDER) - ROUNDER + self.pedestal_nv;
        let level_nv = if level_nv > 0.0 { level_nv } else { 0.0 };
        if level_nv < last_level_nv { level_nv } else { last_level_nv }
    }

    /// Ramp level k lies at or below level s when 2 k span < (2 s + 1) 2^b, so the count is floor(((2 s + 1) 2^(b-1) - 1) / span).
    /// Half of the last unit is added so that no quotient lies within 1 / (2 span) >= 5e-11 of an integer, which is more than
    /// the 3 roundings of a product below 2^17 (4.4e-11); so multiplying by the inverse floors as exact division would.
    #[inline(always)]
    fn count(&self, microvolts: f32, last_level_nv: f64) -> u32 {
        let units = (2.0 * self.level_nv(microvolts, last_level_nv) + 1.0) * self.twice_codes - 0.5;
        let count = units * self.inverse_span_per_nv;
        low_u32(((count - 0.5) + ROUNDER).to_bits())
    }

    /// Exact codes of one conversion a column.
    #[inline(always)]
    fn convert_one(&self, signal_uv: &[f32], codes: &mut [u16]) -> BlockWork {
        let (mut steps, mut clocks) = (0, 0);
        for (code, &signal_uv) in codes.iter_mut().zip(signal_uv) {
            let count = self.count(signal_uv, self.last_level_nv);
            steps += count;
            clocks += active_clk(count, self.signal_steps);
            *code = low_u16(count);
        }
        [steps, clocks]
    }

    /// Exact codes of two conversions a column.
    #[inline(always)]
    fn convert_both(&self, signal_uv: &[f32], reset_uv: &[f32], codes: &mut [u16]) -> BlockWork {
        let (mut steps, mut clocks) = (0, 0);
        for ((code, &signal_uv), &reset_uv) in codes.iter_mut().zip(signal_uv).zip(reset_uv) {
            let up = self.count(signal_uv, self.last_level_nv);
            let down = self.count(reset_uv, self.last_reset_level_nv);
            steps += up + down;
            clocks += active_clk(up, self.signal_steps) + active_clk(down, self.reset_steps);
            let counter = self.black_level_dn - down.cast_signed() + up.cast_signed();
            let counter = if counter > 0 { counter } else { 0 };
            let counter = if counter < self.code_max { counter } else { self.code_max };
            *code = low_u16(counter.cast_unsigned());
        }
        [steps, clocks]
    }
}

/// Clocks in which a comparator is active: up to its crossing, or to the ramp's end.
#[inline(always)]
fn active_clk(count: u32, steps: u32) -> u32 {
    if count < steps { count + 1 } else { steps }
}

kernel! {
    fn count_all<'a>(line: &'a LinearKernel, samples_uv: &'a [f32], last_level_nv: f64, counts: &'a mut [u32]) {
        let line = line.clone();
        for (count, &sample_uv) in counts.iter_mut().zip(samples_uv) {
            *count = line.count(sample_uv, last_level_nv);
        }
    }
}

kernel! {
    fn convert_one<'a>(line: &'a LinearKernel, signal_uv: &'a [f32], codes: &'a mut [u16]) -> BlockWork {
        let line = line.clone();
        let (signals_uv, rest_uv) = signal_uv.as_chunks::<BLOCK>();
        let (codes, rest) = codes.as_chunks_mut::<BLOCK>();
        let mut work = line.convert_one(rest_uv, rest);
        for (codes, signal_uv) in codes.iter_mut().zip(signals_uv) {
            let quick = line.fast.as_ref().and_then(|fast| fast.convert_one(signal_uv, codes));
            work = sum(work, quick.unwrap_or_else(|| line.convert_one(signal_uv, codes)));
        }
        work
    }
}

kernel! {
    fn convert_both<'a>(line: &'a LinearKernel, signal_uv: &'a [f32], reset_uv: &'a [f32], codes: &'a mut [u16]) -> BlockWork {
        let line = line.clone();
        let (signals_uv, rest_signal_uv) = signal_uv.as_chunks::<BLOCK>();
        let (resets_uv, rest_reset_uv) = reset_uv.as_chunks::<BLOCK>();
        let (codes, rest) = codes.as_chunks_mut::<BLOCK>();
        let mut work = line.convert_both(rest_signal_uv, rest_reset_uv, rest);
        for ((codes, signal_uv), reset_uv) in codes.iter_mut().zip(signals_uv).zip(resets_uv) {
            let quick = line.fast.as_ref().and_then(|fast| fast.convert_both(signal_uv, reset_uv, codes));
            work = sum(work, quick.unwrap_or_else(|| line.convert_both(signal_uv, reset_uv, codes)));
        }
        work
    }
}

fn sum(a: BlockWork, b: BlockWork) -> BlockWork {
    [a[0] + b[0], a[1] + b[1]]
}
