//! Code density of the simulated converter. Measures DNL and INL from a ramp histogram, and effective bits from a sine fit.
//!
//! IEEE 1241-2010, as a laboratory does it, through the converter's public interface: samples in uV in, codes out. The ramp histogram takes
//! equally spaced samples over the whole range; the share of samples below code k locates its transition `T[k]`; DNL is the width of a
//! code over the mean width less 1, INL the distance of `T[k]` from the straight line through the first and the last
//! transition (terminal-based). The sine fit has three parameters at a known frequency with whole periods in the record; effective bits are
//! log2(2^bits / (rms residual sqrt 12)), so that a perfect converter has exactly its number of bits. Columns that share a ramp
//! are measured one at a time: kickback between columns is not in these figures. The histogram has no noise.

use super::{AdcParams, Cds, Converter};
use crate::draw::{DrawKey, fill_uniforms, normals};
use crate::num::{f32_nearest, f64_from_i64, f64_from_u64, f64_from_usize, greater, index, lesser, u64_half_even};

/// Samples that are converted as one row.
const ROW: usize = 4096;

/// Periods of the sine in its record of 2^14 samples: odd, so that no sample meets the same phase twice.
const SINE_PERIODS: u32 = 1021;
const SINE_SAMPLES: u32 = 1 << 14;

/// What a ramp histogram shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Density {
    /// Codes at the bottom and at the top of the range; both are open and have no width.
    pub code_lowest: u16,
    /// The code at the top.
    pub code_highest: u16,
    /// Transition into each code above the lowest, in uV of signal.
    pub transitions_uv: Vec<f64>,
    /// Differential non-linearity of each code between the two, in mean code widths.
    pub dnl_lsb: Vec<f64>,
    /// Integral non-linearity of each transition, in mean code widths.
    pub inl_lsb: Vec<f64>,
    /// Mean width of a code in uV.
    pub lsb_uv: f64,
    /// A transition's level is known to this many uV: half a step of the samples, their rounding to f32, and to whole nV.
    pub error_uv: f64,
}

/// Static figures of a converter, for a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearity {
    /// Depth in bits.
    pub bits: u32,
    /// Lowest and highest code that a column at its nominal reset level gives.
    pub codes: [u16; 2],
    /// Mean width of a code in uV.
    pub lsb_uv: f64,
    /// Least and greatest DNL in mean code widths.
    pub dnl_lsb: [f64; 2],
    /// Least and greatest INL in mean code widths.
    pub inl_lsb: [f64; 2],
    /// Codes that no signal gives.
    pub missing_codes: u32,
    /// Both are known to this many mean code widths.
    pub error_lsb: f64,
    /// Effective bits of a full-scale sine without noise; none below 4 bits, where a residual is no noise.
    pub enob_bits: Option<f64>,
}

/// DNL, INL and effective bits of what these parameters make.
pub fn linearity(params: &AdcParams) -> Linearity {
    let converter = Converter::new(params);
    let density = ramp_histogram(&converter, 64);
    let range = |values: &[f64]| {
        values.iter().fold([0.0, 0.0], |[least, most], &value| [lesser(least, value), greater(most, value)])
    };
    let missing = density.dnl_lsb.iter().filter(|&&dnl_lsb| dnl_lsb == -1.0).count();
    Linearity {
        bits: params.bits,
        codes: [density.code_lowest, density.code_highest],
        lsb_uv: density.lsb_uv,
        dnl_lsb: range(&density.dnl_lsb),
        inl_lsb: range(&density.inl_lsb),
        missing_codes: crate::num::u32_from(missing),
        error_lsb: 2.0 * density.error_uv / density.lsb_uv,
        enob_bits: (params.bits >= 4).then(|| sine_fit_enob_bits(&converter, 0.0, DrawKey::root(0))),
    }
}

/// The histogram of a ramp of `samples_per_lsb` samples in each nominal LSB.
pub fn ramp_histogram(converter: &Converter, samples_per_lsb: u32) -> Density {
    assert!(samples_per_lsb > 0, "a code needs samples");
    let params = &converter.params;
    let step_uv = params.lsb_uv() / f64::from(samples_per_lsb);
    let [bottom_uv, top_uv] = range_uv(converter);
    let start_uv = bottom_uv - params.lsb_uv();
    let samples = u64_half_even((top_uv + params.lsb_uv() - start_uv) / step_uv) + 1;
    let ramp_uv = |number: u64| f32_nearest(start_uv + (f64_from_u64(number) + 0.5) * step_uv);
    let mut counts = vec![0_u64; index(params.code_max()) + 1];
    convert_all(converter, samples, ramp_uv, |code| counts[usize::from(code)] += 1);

    let (code_lowest, code_highest) = (end_code(converter, f32::MIN), end_code(converter, f32::MAX));
    let mut below = 0;
    let mut transitions_uv = Vec::new();
    for code in code_lowest..code_highest {
        below += counts[usize::from(code)];
        transitions_uv.push(start_uv + step_uv * f64_from_u64(below));
    }
    let greatest_uv = greater(bottom_uv.abs(), top_uv.abs()) + params.lsb_uv();
    // Half an ulp of 24 bits, and half a nanovolt.
    let error_uv = 0.5 * step_uv + greatest_uv / 16_777_216.0 + 0.0005;
    density(code_lowest, code_highest, transitions_uv, error_uv)
}

fn density(code_lowest: u16, code_highest: u16, transitions_uv: Vec<f64>, error_uv: f64) -> Density {
    let widths = transitions_uv.len().saturating_sub(1);
    let (first_uv, last_uv) =
        (transitions_uv.first().copied().unwrap_or(0.0), transitions_uv.last().copied().unwrap_or(0.0));
    let lsb_uv = (last_uv - first_uv) / f64_from_usize(widths.max(1));
    let dnl_lsb = transitions_uv.windows(2).map(|pair| (pair[1] - pair[0]) / lsb_uv - 1.0).collect();
    let of_line = |(number, &level_uv): (usize, &f64)| (level_uv - first_uv) / lsb_uv - f64_from_usize(number);
    // A single transition lies on any line.
    let inl_lsb = transitions_uv.iter().enumerate().map(|of| if widths == 0 { 0.0 } else { of_line(of) }).collect();
    Density { code_lowest, code_highest, transitions_uv, dnl_lsb, inl_lsb, lsb_uv, error_uv }
}

/// Effective bits of a sine over the whole range, with normal noise of that sigma at the input, by a three-parameter fit.
pub fn sine_fit_enob_bits(converter: &Converter, noise_uv: f64, noise: DrawKey) -> f64 {
    let [bottom_uv, top_uv] = range_uv(converter);
    let (middle_uv, amplitude_uv) = (0.5 * (bottom_uv + top_uv), 0.5 * (top_uv - bottom_uv));
    let record = index(SINE_SAMPLES);
    let (mut uniforms, mut draws) = (vec![0; record], vec![0.0_f32; record]);
    fill_uniforms(noise, &mut uniforms);
    normals(&uniforms, &mut draws);
    let wave: Vec<[f64; 2]> = (0..SINE_SAMPLES)
        .map(|number| {
            // Whole periods fall away in integers.
            let turn = f64::from(number * SINE_PERIODS % SINE_SAMPLES) / f64::from(SINE_SAMPLES);
            let (sine, cosine) = libm::sincos(core::f64::consts::TAU * turn);
            [sine, cosine]
        })
        .collect();
    let sample_uv = |number: u64| {
        let number = usize::try_from(number).expect("a record is short");
        f32_nearest(middle_uv + amplitude_uv * wave[number][0] + noise_uv * f64::from(draws[number]))
    };
    let mut codes = Vec::with_capacity(record);
    convert_all(converter, SINE_SAMPLES.into(), sample_uv, |code| codes.push(f64::from(code)));
    let residual_lsb = rms_residual(&codes, &wave);
    let full_scale = f64::from(1_u32 << converter.params.bits);
    libm::log2(full_scale / (residual_lsb * 12.0_f64.sqrt()))
}

/// Least squares of offset, sine and cosine: orthogonal over whole periods, so each coefficient is a mean.
fn rms_residual(codes: &[f64], wave: &[[f64; 2]]) -> f64 {
    let count = f64_from_usize(codes.len());
    let mut sums = [0.0; 3];
    for (code, [sine, cosine]) in codes.iter().zip(wave) {
        sums[0] += code;
        sums[1] += code * sine;
        sums[2] += code * cosine;
    }
    let (offset, in_phase, quadrature) = (sums[0] / count, 2.0 * sums[1] / count, 2.0 * sums[2] / count);
    let mut squares = 0.0;
    for (code, [sine, cosine]) in codes.iter().zip(wave) {
        let residual = code - offset - in_phase * sine - quadrature * cosine;
        squares += residual * residual;
    }
    (squares / count).sqrt()
}

/// Signals between which codes change: half an LSB below the first ramp level and above the last that the code follows.
fn range_uv(converter: &Converter) -> [f64; 2] {
    let level_uv = |k: u32| f64_from_i64(converter.ramp_level_nv(k) - converter.pedestal_nv) / 1000.0;
    let half_uv = 0.5 * converter.params.lsb_uv();
    let transitions = end_code(converter, f32::MAX) - end_code(converter, f32::MIN);
    [level_uv(1) - half_uv, level_uv(transitions.max(1).into()) + half_uv]
}

fn end_code(converter: &Converter, sample_uv: f32) -> u16 {
    let mut code = [0];
    convert(converter, &[sample_uv], &mut code);
    code[0]
}

/// Converts samples by their numbers, in rows; one column at a time where columns would disturb each other.
fn convert_all(converter: &Converter, samples: u64, sample_uv: impl Fn(u64) -> f32, mut take: impl FnMut(u16)) {
    let row = if converter.kickback.is_some() { 1 } else { ROW };
    let mut codes = vec![0; row];
    let mut numbers = 0..samples;
    loop {
        let row_uv: Vec<f32> = numbers.by_ref().take(row).map(&sample_uv).collect();
        if row_uv.is_empty() {
            return;
        }
        let codes = &mut codes[..row_uv.len()];
        convert(converter, &row_uv, codes);
        codes.iter().for_each(|&code| take(code));
    }
}

fn convert(converter: &Converter, signal_uv: &[f32], codes: &mut [u16]) {
    let reset_uv = if converter.params.cds == Cds::Digital { vec![0.0; signal_uv.len()] } else { Vec::new() };
    converter.convert_row(signal_uv, &reset_uv, codes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::Ramp;
    use crate::adc::params::tests::paper_adc;

    /// Each measured transition against the ramp level that was configured for it.
    fn check_transitions(params: &AdcParams) -> Density {
        let converter = Converter::new(params);
        let density = ramp_histogram(&converter, 64);
        let first = u32::from(density.code_lowest);
        for (number, &found_uv) in density.transitions_uv.iter().enumerate() {
            // Counts start at the lowest code: code c is entered at ramp level c less the lowest, at single conversion at level c.
            let step = crate::num::u32_from(number) + 1;
            let configured_uv = f64_from_i64(converter.ramp_level_nv(step) - converter.pedestal_nv) / 1000.0;
            let error_uv = (found_uv - configured_uv).abs();
            assert!(error_uv <= density.error_uv, "code {}: {error_uv} uV of {params:?}", first + step);
        }
        density
    }

    #[test]
    fn a_straight_ramp_has_straight_codes_and_all_its_bits() {
        for (bits, cds) in [(4, Cds::None), (8, Cds::Analog), (10, Cds::Digital), (12, Cds::Digital)] {
            let black_level_dn = (1 << bits) / 16;
            let params = AdcParams { bits, cds, black_level_dn, reset_counts: 8, ..paper_adc() };
            let found = linearity(&params);
            check_transitions(&params);
            // Two transitions bound a width, and the mean width has their error too.
            assert!(greater(-found.dnl_lsb[0], found.dnl_lsb[1]) <= 2.0 * found.error_lsb, "{found:?}");
            assert!(greater(-found.inl_lsb[0], found.inl_lsb[1]) <= 2.0 * found.error_lsb, "{found:?}");
            assert_eq!(found.missing_codes, 0);
            // A quantised sine of amplitude A LSB has the variance 1/12 + sum +-J0(2 pi n A) / (pi n)^2 (Bennett): with
            // |J0(x)| <= sqrt(2 / pi x) within 0.52 / sqrt A of 1/12, and the fit's gain takes 0.6 / A of it at most.
            let amplitude = f64::from(1 << (bits - 1));
            let allowed = 0.5 * libm::log2(1.0 + 0.52 / amplitude.sqrt() + 0.6 / amplitude);
            let enob_bits = found.enob_bits.unwrap();
            assert!((enob_bits - f64::from(bits)).abs() <= allowed, "{enob_bits} of {bits}");
        }
    }

    /// The bow is measured against the line through the transitions' ends, so that what the ends carry of it is known and small:
    /// 4 x (1 - x) at x = 1 / 2^b.
    #[test]
    fn a_configured_bow_is_found_in_inl_dnl_and_effective_bits() {
        for inl_lsb in [-3.0, 2.0, 8.0] {
            let params = AdcParams { ramp_inl_lsb: inl_lsb, cds: Cds::Analog, ..paper_adc() };
            let density = check_transitions(&params);
            let found = linearity(&params);
            let most = if inl_lsb > 0.0 { found.inl_lsb[1] } else { found.inl_lsb[0] };
            let at_ends = 4.0 / 1024.0 * inl_lsb.abs();
            assert!((most - inl_lsb).abs() <= at_ends + 2.0 * found.error_lsb + 0.01 * inl_lsb.abs(), "{most}");
            // A parabola's step changes by 8 inl / 2^b from one end to the other: half of it at each.
            let end = 4.0 * inl_lsb / 1024.0;
            assert!(
                (density.dnl_lsb[0] - end).abs() <= 2.0 * found.error_lsb + 0.05 * end.abs(),
                "{}",
                density.dnl_lsb[0]
            );
            // 4 x (1 - x) of a full-scale sine is half plus half of its second harmonic: rms inl / sqrt 8.
            let rms_lsb = (1.0 / 12.0 + inl_lsb * inl_lsb / 8.0).sqrt();
            let expected = 10.0 - libm::log2(rms_lsb * 12.0_f64.sqrt());
            // As for the straight ramp, and the sine ends half an LSB beyond the ramp's levels.
            assert!((found.enob_bits.unwrap() - expected).abs() < 0.05, "{found:?} for {expected}");
        }
    }

    #[test]
    fn pieces_and_tables_are_found_level_by_level() {
        let pieces = AdcParams {
            ramp: Ramp::Piecewise,
            ramp_points: vec![[0.5, 0.25]],
            ramp_settling_clk: 3.0,
            cds: Cds::Analog,
            ..paper_adc()
        };
        let density = check_transitions(&pieces);
        // The slopes are 1/2 and 3/2 of the mean; levels beside the lag at the start and at the corner are as configured too.
        let near =
            |dnl_lsb: f64, slope: f64| (dnl_lsb + 1.0 - slope).abs() <= 4.0 * density.error_uv / density.lsb_uv + 0.01;
        assert!(near(density.dnl_lsb[300], 0.5) && near(density.dnl_lsb[900], 1.5));
        let mut levels_uv: Vec<f64> = (1..16).map(|k| 1000.0 * f64::from(k)).collect();
        levels_uv[7] = levels_uv[6]; // Level 8 on level 7: code 7 is missing.
        let table = AdcParams {
            bits: 4,
            ramp: Ramp::Table,
            ramp_table_uv: levels_uv,
            full_scale_uv: 16_000.0,
            black_level_dn: 0,
            cds: Cds::None,
            ..paper_adc()
        };
        check_transitions(&table);
        assert_eq!(linearity(&table).missing_codes, 1);
    }

    #[test]
    fn noise_costs_the_bits_that_its_variance_says() {
        let params = AdcParams { cds: Cds::Analog, ..paper_adc() };
        let noise_uv = 2.0 * params.lsb_uv();
        let found = sine_fit_enob_bits(&Converter::new(&params), noise_uv, DrawKey::root(31));
        let expected = 10.0 - 0.5 * libm::log2(1.0 + 12.0 * 4.0);
        // Sigma of a variance of 16384 draws is 1.1 %: 0.008 bits; five of them, a false alarm in 1.7e6.
        assert!((found - expected).abs() < 0.04, "{found} for {expected}");
    }
}
