//! A row of conversions. Converts microvolts to codes in LSB, and reports how long counters and comparators ran.
//!
//! A column's comparator goes high at the first clock at which the ramp is above the sample plus pedestal, after its delay;
//! its count is the clocks before that, or all. One conversion: the count is the code, and the pedestal is the ramp level of the black
//! level, so that no signal gives that code. Digital double sampling: black level minus the count of the reset ramp plus the count
//! of the signal ramp, clipped to 0 .. 2^b - 1 (an up/down counter that starts at the black level). The pedestal is a level of the
//! actual ramp. docs/adc.md has the details.

use super::column_delay;
pub use super::columns::{Columns, Converter};
use super::crossings::{NEVER, crossings};
use super::kickback::Kickback;
use super::linear::{LinearKernel, ROUNDER};
use super::params::{AdcParams, Cds};
use super::ramp::RampLevels;
pub use super::sample::{RowWork, Sample};
use crate::draw::DrawKey;
use crate::fidelity::Rung;
use crate::num::{f32_nearest, low_u16};
use crate::rtl_simulator::SharedRtlSimulator;

/// Crossings: the first clocks, counted from 1, at which the columns' comparators are high, delays included; `u32::MAX`: never.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crossings {
    /// Of the reset conversion; empty where it is not converted separately.
    pub reset_clk: Vec<u32>,
    /// Of the signal conversion.
    pub signal_clk: Vec<u32>,
}

impl Converter {
    /// Prepares checked parameters in closed form. Panics where `AdcParams::check` would refuse them.
    pub fn new(params: &AdcParams) -> Self {
        let ramp_levels = RampLevels::new(params).expect("the parameters were checked");
        let kickback = Kickback::from_params(params);
        let alike = params.comparator_delay_clk == 0 && params.comparator_delay_sigma_clk == 0.0;
        Self {
            kernel: ramp_levels.has_equal_steps().then(|| LinearKernel::new(params)),
            is_plain: ramp_levels.has_equal_steps() && kickback.is_none() && alike,
            pedestal_nv: ramp_levels.ramp_level_nv(params.pedestal_lsb()),
            params: params.clone(),
            ramp_levels,
            kickback,
            is_clocked: false,
            verilog: None,
        }
    }

    /// The same on another rung: clock by clock, or in closed form.
    #[must_use]
    pub fn at(self, rung: Rung) -> Self {
        Self { is_clocked: matches!(rung, Rung::Clocked | Rung::Rtl), ..self }
    }

    /// The same with the columns' counters in Verilog where conversions run clock by clock.
    #[must_use]
    pub fn in_verilog(self, verilog: Option<SharedRtlSimulator>) -> Self {
        Self { verilog, ..self }
    }

    /// Where the ramp is after `k` clocks, in nV above its bottom, undisturbed.
    pub fn ramp_level_nv(&self, k: u32) -> i64 {
        self.ramp_levels.ramp_level_nv(k)
    }

    /// The converters of a die. `die` is the key of its columns, as `RowPass::column_pattern_key` makes it.
    pub fn columns(&self, die: DrawKey, width: usize) -> Columns<'_> {
        Columns { converter: self, delays_clk: column_delay::delays_clk(&self.params, die, width), array_columns: None }
    }

    /// Converts a row of columns whose comparators all have the mean delay. As `Columns::convert_row`.
    pub fn convert_row(&self, signal_uv: &[f32], reset_uv: &[f32], codes: &mut [u16]) -> RowWork {
        let delays_clk = match self.params.comparator_delay_clk {
            0 => Vec::new(),
            delay_clk => vec![delay_clk; signal_uv.len()],
        };
        Columns { converter: self, delays_clk, array_columns: None }.convert_row(signal_uv, reset_uv, codes)
    }

    /// The level that a comparator sees, in nV above the bottom of the ramp: the sample, rounded once, half-even, plus pedestal.
    /// Beyond 2^40 nV (1,100 V) only the side matters; a NaN is far below.
    pub fn level_nv(&self, sample_uv: f32) -> i64 {
        const FAR_NV: f64 = 1_099_511_627_776.0;
        let exact_nv = f64::from(sample_uv) * 1000.0;
        let exact_nv = if exact_nv > -FAR_NV { exact_nv } else { -FAR_NV };
        let exact_nv = if exact_nv < FAR_NV { exact_nv } else { FAR_NV };
        crate::num::i64_truncated((exact_nv + ROUNDER) - ROUNDER) + self.pedestal_nv
    }

    /// The sample in uV that stands on a level: the inverse of `level_nv` as far as a sample's format goes.
    pub fn sample_uv(&self, level_nv: i64) -> f32 {
        f32_nearest(crate::num::f64_from_i64(level_nv - self.pedestal_nv) / 1000.0)
    }

    /// Ramp steps of a conversion.
    pub fn steps(&self, sample: Sample) -> u32 {
        match sample {
            Sample::Reset => self.params.reset_counts_used(),
            Sample::Signal => self.params.code_max(),
        }
    }

    /// Ramp levels at or below a signal sample on the undisturbed ramp: the clock before the ramp passes its level.
    pub(super) fn undisturbed_count(&self, sample_uv: f32) -> u32 {
        self.ramp_levels.count(self.level_nv(sample_uv), self.params.code_max())
    }
}

impl Columns<'_> {
    /// Some of these columns, named in rising order: the only ones that are converted from now on.
    #[must_use]
    pub fn of(self, array_columns: Vec<usize>) -> Self {
        let delays_clk = match self.delays_clk.is_empty() {
            true => Vec::new(),
            false => array_columns.iter().map(|&column| self.delays_clk[column]).collect(),
        };
        Self { delays_clk, array_columns: Some(array_columns), ..self }
    }

    /// Array columns of those that are converted; none where all are.
    pub fn array_columns(&self) -> Option<&[usize]> {
        self.array_columns.as_deref()
    }

    /// Columns of a row that shared converters take at the same time.
    pub(super) fn of_pass(&self, pass: usize, width: usize) -> impl Iterator<Item = usize> {
        let passes = crate::num::index(self.converter.params.columns_per_adc);
        let array_column =
            move |column| self.array_columns.as_ref().map_or(column, |array_columns| array_columns[column]);
        (0..width).filter(move |&column| array_column(column) % passes == pass)
    }

    /// Converts a row of samples (uV above the dark level, rounded once, half-even, to nV). `reset_uv` is read only where the reset
    /// sample is converted separately, and may be empty otherwise. A NaN counts no ramp level. Panics if the lengths differ.
    pub fn convert_row(&self, signal_uv: &[f32], reset_uv: &[f32], codes: &mut [u16]) -> RowWork {
        let reset_uv = self.checked_reset(signal_uv, reset_uv);
        assert!(signal_uv.len() == codes.len(), "a column has one code");
        match &self.converter.kernel {
            _ if self.converter.is_clocked => self.convert_by_clock(signal_uv, reset_uv, codes),
            Some(kernel) if self.converter.is_plain => kernel.convert_linear_row(signal_uv, reset_uv, codes),
            _ => self.convert_by_crossings(signal_uv, reset_uv, codes),
        }
    }

    /// When the columns' comparators go high, in closed form: jumping from event to event where comparators disturb the ramp.
    pub fn crossings(&self, signal_uv: &[f32], reset_uv: &[f32]) -> Crossings {
        let reset_uv = self.checked_reset(signal_uv, reset_uv);
        Crossings {
            reset_clk: crossings(self, Sample::Reset, reset_uv),
            signal_clk: crossings(self, Sample::Signal, signal_uv),
        }
    }

    /// Delay of one column in `adc_clk`.
    pub fn delay_clk(&self, column: usize) -> u32 {
        self.delays_clk.get(column).copied().unwrap_or(0)
    }

    fn convert_by_crossings(&self, signal_uv: &[f32], reset_uv: &[f32], codes: &mut [u16]) -> RowWork {
        let found = self.crossings(signal_uv, reset_uv);
        let count = |sample: Sample, crossing_clk: u32| match crossing_clk {
            NEVER => self.converter.steps(sample),
            clock => clock - 1,
        };
        let mut work = RowWork::default();
        let mut counts = |sample: Sample, crossings_clk: &[u32]| -> Vec<u32> {
            let counts: Vec<u32> = crossings_clk.iter().map(|&clock| count(sample, clock)).collect();
            for &count in &counts {
                work.counter_steps += u64::from(count);
                work.comparator_clk += u64::from((count + 1).min(self.converter.steps(sample)));
            }
            counts
        };
        let down = counts(Sample::Reset, &found.reset_clk);
        let up = counts(Sample::Signal, &found.signal_clk);
        for (column, (code, up)) in codes.iter_mut().zip(up).enumerate() {
            *code = self.converter.code(down.get(column).copied(), up);
        }
        work
    }

    fn checked_reset<'a>(&self, signal_uv: &[f32], reset_uv: &'a [f32]) -> &'a [f32] {
        assert!(self.delays_clk.is_empty() || self.delays_clk.len() == signal_uv.len(), "a column has one comparator");
        if self.converter.params.cds != Cds::Digital {
            return &[];
        }
        assert!(reset_uv.len() == signal_uv.len(), "a column has one reset sample");
        reset_uv
    }
}

impl Converter {
    /// The code of a column from its counts.
    pub(super) fn code(&self, down: Option<u32>, up: u32) -> u16 {
        let code = match down {
            None => i64::from(up),
            Some(down) => i64::from(self.params.black_level_dn) - i64::from(down) + i64::from(up),
        };
        let code = code.clamp(0, self.params.code_max().into());
        low_u16(u32::try_from(code).expect("clipped above"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::Cds;
    use crate::adc::params::tests::paper_adc;
    use crate::draw::DrawKey;
    use crate::num::{f32_nearest, f64_from_i64, i64_half_even, u32_truncated};
    use rand::RngExt;

    /// The definition: ramp levels at or below signal plus pedestal, counted one by one by bisection of the sorted levels.
    fn counted(ramp_levels_nv: &[i64], pedestal_nv: i64, microvolts: f32) -> u16 {
        let signal_nv = i64_half_even((f64::from(microvolts) * 1000.0).clamp(-1e15, 1e15));
        u16::try_from(ramp_levels_nv.partition_point(|&level_nv| level_nv <= signal_nv + pedestal_nv)).unwrap()
    }

    fn check(params: &AdcParams, microvolts: &[f32]) {
        let converter = Converter::new(params);
        let ramp_levels_nv: Vec<i64> = (1..=params.code_max()).map(|k| converter.ramp_level_nv(k)).collect();
        let pedestal_nv = converter.ramp_level_nv(params.black_level_dn);
        let mut codes = vec![0; microvolts.len()];
        converter.convert_row(microvolts, &[], &mut codes);
        for (&microvolts, &code) in microvolts.iter().zip(&codes) {
            let expected = counted(&ramp_levels_nv, pedestal_nv, microvolts);
            assert_eq!(code, expected, "{microvolts} uV of {params:?}");
        }
    }

    /// Small spans, so that an f32 of microvolts holds each nanovolt around every ramp level.
    #[test]
    fn every_boundary_at_every_depth_is_exact_to_one_nanovolt() {
        let mut tried = 0;
        for bits in 1..=16 {
            for span_uv in [100.0, 999.9, 1000.0, 8192.0] {
                let params =
                    AdcParams { bits, full_scale_uv: span_uv, black_level_dn: 0, cds: Cds::Analog, ..paper_adc() };
                let converter = Converter::new(&params);
                let around = |k| (-1..=1).map(move |step| (k, step));
                let signals: Vec<f32> = (0..=params.code_max())
                    .flat_map(around)
                    .map(|(k, step)| f32_nearest(f64_from_i64(converter.ramp_level_nv(k) + step) / 1000.0))
                    .collect();
                check(&params, &signals);
                tried += signals.len();
            }
        }
        println!("{tried} boundaries");
        assert_eq!(tried, 4 * 3 * (131_072 - 2));
    }

    #[test]
    fn random_configs_agree_with_the_count_of_ramp_levels() {
        let mut stream = DrawKey::root(21).stream();
        let mut draw = |least: f64, most: f64| least + (most - least) * stream.random::<f64>();
        for case in 0..300 {
            let bits = 1 + case % 16;
            let gain = draw(0.1, 16.0);
            let full_scale_uv = gain * libm::exp(draw(libm::log(101.0), libm::log(9.9e6)));
            let black_level_dn = u32_truncated(draw(0.0, f64::from(1 << bits)));
            let params = AdcParams { bits, gain, full_scale_uv, black_level_dn, cds: Cds::Analog, ..paper_adc() };
            params.check().unwrap();
            let span_uv = full_scale_uv / gain;
            let mut signals: Vec<f32> = (0..500).map(|_| f32_nearest(draw(-0.5 * span_uv, 1.5 * span_uv))).collect();
            signals.extend([0.0, -0.0, -1e-4, 1e30, -1e30, f32::INFINITY, f32::NEG_INFINITY, 5e-4, -5e-4, 1.5e-3]);
            check(&params, &signals);
        }
    }

    #[test]
    fn no_signal_gives_the_black_level_and_nan_code_zero() {
        let converter = Converter::new(&AdcParams { cds: Cds::Analog, ..paper_adc() });
        let mut codes = [9; 4];
        converter.convert_row(&[0.0, f32::NAN, -7000.0, 1e9], &[], &mut codes);
        assert_eq!(codes, [64, 0, 0, 1023]);
    }

    /// An LSB is 107.42 uV; the reset ramp has 128 counts and finds an undisturbed column after 64.
    #[test]
    fn both_samples_are_counted_and_subtracted_from_the_black_level() {
        let converter = Converter::new(&paper_adc());
        let mut codes = [9; 7];
        let signal_uv = [0.0, 1080.0, 1080.0, 1e9, -7000.0, 0.0, 0.0];
        let reset_uv = [0.0, 0.0, 1080.0, 0.0, 0.0, 1e9, -1e9];
        converter.convert_row(&signal_uv, &reset_uv, &mut codes);
        // The last two: a reset sample beyond its ramp counts all 128, or none.
        assert_eq!(codes, [64, 74, 64, 1023, 0, 0, 128]);
    }
}
