//! The linear ramp in closed form. Enters: microvolts of a row. Leaves: codes in LSB.
//!
//! Edge k (1 .. 2^b - 1) stands at round(k span / 2^b) nV, halves up. A count is the number of edges at or below a sample plus
//! pedestal. One conversion: its count is the code, and the pedestal is the edge of the black level, so that no signal gives that
//! code. Digital double sampling: black level minus the count of the reset ramp plus the count of the signal ramp, clipped to
//! 0 .. 2^b - 1 (an up/down counter that starts at the black level).
//! `rtl_models::ramp_adc` counts the same edges clock by clock.

use super::AdcParams;
use crate::num::{f64_from_i64, low_u16, low_u32};
use crate::pixel::Samples;
use crate::simd::{Kernel, dispatch};

/// A row's conversions, with everything that does not depend on the signal done beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct Converter {
    bits: u32,
    span_nv: i64,
    pedestal_nv: f64,
    /// Last edge of the signal's ramp.
    last_edge_nv: f64,
    /// Last edge of the reset ramp.
    last_reset_edge_nv: f64,
    black_level_dn: i32,
    code_max: i32,
    /// Whether the reset sample is converted apart.
    converts_reset: bool,
    twice_codes: f64,
    inverse_span_per_nv: f64,
}

/// Adding and subtracting 1.5 * 2^52 rounds |x| <= 2^51 half-even without a cast; the sum's low bits hold the integer.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

impl Converter {
    /// Prepares checked parameters. Panics where `AdcParams::check` would refuse depth or span.
    pub fn new(params: &AdcParams) -> Self {
        assert!((1..=16).contains(&params.bits), "depths go from 1 to 16 bits");
        let span_nv = params.span_nv();
        assert!((100_000..=10_000_000_000).contains(&span_nv), "a ramp spans 100 uV to 10 V");
        let edge_nv = |k| f64_from_i64(edge_nv(params.bits, span_nv, k));
        Self {
            bits: params.bits,
            span_nv,
            pedestal_nv: edge_nv(params.pedestal_lsb()),
            last_edge_nv: edge_nv(params.code_max()),
            last_reset_edge_nv: edge_nv(params.reset_counts_used()),
            black_level_dn: i32::try_from(params.black_level_dn).expect("a black level has at most 16 bits"),
            code_max: i32::try_from(params.code_max()).expect("a code has at most 16 bits"),
            converts_reset: params.cds.samples() == Samples::Both,
            twice_codes: f64_from_i64(1 << (params.bits - 1)),
            inverse_span_per_nv: 1.0 / f64_from_i64(span_nv),
        }
    }

    /// Place of edge `k` in nV above the bottom of the ramp.
    pub fn edge_nv(&self, k: u32) -> i64 {
        edge_nv(self.bits, self.span_nv, k)
    }

    /// Converts a row of samples (uV above the dark level, rounded once, half-even, to nV). `reset_uv` is read only where the reset
    /// sample is converted apart, and may be empty otherwise. A NaN counts no edge. Panics if the lengths differ.
    pub fn convert_row(&self, signal_uv: &[f32], reset_uv: &[f32], codes: &mut [u16]) {
        assert!(signal_uv.len() == codes.len(), "a column has one code");
        if self.converts_reset {
            assert!(reset_uv.len() == codes.len(), "a column has one reset sample");
            dispatch(ConvertBoth { converter: self, signal_uv, reset_uv, codes });
        } else {
            dispatch(ConvertOne { converter: self, signal_uv, codes });
        }
    }

    /// The level that the comparator sees, in nV above the bottom of the ramp, clipped to the ramp's first and last edge.
    #[inline(always)]
    fn level_nv(&self, microvolts: f32, last_edge_nv: f64) -> f64 {
        // An f32 times 1000 is exact in f64. Beyond 2^40 nV (1,100 V) only the side matters.
        const FAR_NV: f64 = 1_099_511_627_776.0;
        let exact_nv = f64::from(microvolts) * 1000.0;
        let exact_nv = if exact_nv > -FAR_NV { exact_nv } else { -FAR_NV };
        let exact_nv = if exact_nv < FAR_NV { exact_nv } else { FAR_NV };
        let level_nv = (exact_nv + ROUNDER) - ROUNDER + self.pedestal_nv;
        let level_nv = if level_nv > 0.0 { level_nv } else { 0.0 };
        if level_nv < last_edge_nv { level_nv } else { last_edge_nv }
    }

    /// Edge k lies at or below level s when 2 k span < (2 s + 1) 2^b, so the count is floor(((2 s + 1) 2^(b-1) - 1) / span).
    /// Half of the last unit is added so that no quotient lies within 1 / (2 span) >= 5e-11 of an integer, which is more than
    /// the 3 roundings of a product below 2^17 (4.4e-11); so multiplying by the inverse floors as exact division would.
    #[inline(always)]
    fn count(&self, microvolts: f32, last_edge_nv: f64) -> u32 {
        let units = (2.0 * self.level_nv(microvolts, last_edge_nv) + 1.0) * self.twice_codes - 0.5;
        let count = units * self.inverse_span_per_nv;
        low_u32(((count - 0.5) + ROUNDER).to_bits())
    }

    #[inline(always)]
    fn code(&self, signal_uv: f32) -> u16 {
        low_u16(self.count(signal_uv, self.last_edge_nv))
    }

    #[inline(always)]
    fn code_of_both(&self, signal_uv: f32, reset_uv: f32) -> u16 {
        let up = self.count(signal_uv, self.last_edge_nv).cast_signed();
        let down = self.count(reset_uv, self.last_reset_edge_nv).cast_signed();
        let counter = self.black_level_dn - down + up;
        let counter = if counter > 0 { counter } else { 0 };
        let counter = if counter < self.code_max { counter } else { self.code_max };
        low_u16(counter.cast_unsigned())
    }
}

fn edge_nv(bits: u32, span_nv: i64, k: u32) -> i64 {
    (i64::from(k) * span_nv + (1 << (bits - 1))) >> bits
}

struct ConvertOne<'a> {
    converter: &'a Converter,
    signal_uv: &'a [f32],
    codes: &'a mut [u16],
}

impl Kernel for ConvertOne<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let converter = self.converter.clone();
        for (code, &signal_uv) in self.codes.iter_mut().zip(self.signal_uv) {
            *code = converter.code(signal_uv);
        }
    }
}

struct ConvertBoth<'a> {
    converter: &'a Converter,
    signal_uv: &'a [f32],
    reset_uv: &'a [f32],
    codes: &'a mut [u16],
}

impl Kernel for ConvertBoth<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let converter = self.converter.clone();
        for ((code, &signal_uv), &reset_uv) in self.codes.iter_mut().zip(self.signal_uv).zip(self.reset_uv) {
            *code = converter.code_of_both(signal_uv, reset_uv);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::Cds;
    use crate::adc::params::tests::paper_adc;
    use crate::draw::{DrawKey, uniform_f64};
    use crate::num::{f32_nearest, i64_half_even, u32_truncated};

    /// The definition: edges at or below signal plus pedestal, counted one by one by bisection of the sorted edges.
    fn counted(edges_nv: &[i64], pedestal_nv: i64, microvolts: f32) -> u16 {
        let signal_nv = i64_half_even((f64::from(microvolts) * 1000.0).clamp(-1e15, 1e15));
        u16::try_from(edges_nv.partition_point(|&edge_nv| edge_nv <= signal_nv + pedestal_nv)).unwrap()
    }

    fn check(params: &AdcParams, microvolts: &[f32]) {
        let converter = Converter::new(params);
        let edges_nv: Vec<i64> = (1..=params.code_max()).map(|k| converter.edge_nv(k)).collect();
        let pedestal_nv = converter.edge_nv(params.black_level_dn);
        let mut codes = vec![0; microvolts.len()];
        converter.convert_row(microvolts, &[], &mut codes);
        for (&microvolts, &code) in microvolts.iter().zip(&codes) {
            let expected = counted(&edges_nv, pedestal_nv, microvolts);
            assert_eq!(code, expected, "{microvolts} uV of {params:?}");
        }
    }

    /// Small spans, so that an f32 of microvolts holds each nanovolt around every edge.
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
                    .map(|(k, step)| f32_nearest(f64_from_i64(converter.edge_nv(k) + step) / 1000.0))
                    .collect();
                check(&params, &signals);
                tried += signals.len();
            }
        }
        println!("{tried} boundaries");
        assert_eq!(tried, 4 * 3 * (131_072 - 2));
    }

    #[test]
    fn random_configs_agree_with_the_count_of_edges() {
        let mut stream = DrawKey::root(21).stream();
        let mut draw = |least: f64, most: f64| least + (most - least) * uniform_f64(&mut stream);
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
    fn the_clocked_twin_gives_the_same_codes_on_random_configs() {
        use rtl_models::ramp_adc::{RampAdc, RampConfig};
        let mut stream = DrawKey::root(22).stream();
        let mut draw = |least: f64, most: f64| least + (most - least) * uniform_f64(&mut stream);
        for case in 0..64 {
            let bits = 1 + case % 16;
            let full_scale_uv = libm::exp(draw(libm::log(100.0), libm::log(1e7)));
            let black_level_dn = u32_truncated(draw(0.0, f64::from(1 << bits)));
            let params = AdcParams { bits, full_scale_uv, black_level_dn, cds: Cds::Analog, ..paper_adc() };
            let converter = Converter::new(&params);
            let signals: Vec<f32> = (0..40).map(|_| f32_nearest(draw(-0.5, 1.5) * full_scale_uv)).collect();
            let pedestal_nv = converter.edge_nv(black_level_dn);
            let level_nv = |&signal: &f32| i64_half_even(f64::from(signal) * 1000.0) + pedestal_nv;
            let levels_nv: Vec<i64> = signals.iter().map(level_nv).collect();
            let (mut codes, mut clocked, mut latched) = ([0; 40], [0; 40], [false; 40]);
            converter.convert_row(&signals, &[], &mut codes);
            let config = RampConfig { bits, span_nv: params.span_nv() };
            let mut adc = RampAdc::new(config, &mut clocked, &mut latched);
            while !adc.tick(&levels_nv).done {}
            assert_eq!(codes, adc.codes(), "case {case}: {params:?}");
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
