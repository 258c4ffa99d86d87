//! Hard cases of the converters, against 128-bit integers. Levels are microvolts in f32 and nanovolts as integers.

use sensel::adc::{AdcParams, Cds, Converter, Ramp};
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::fidelity::Rung;
use sensel::num::{f32_nearest, f64_from_i64, index};

use super::table::{Chance, Stage};

fn params() -> AdcParams {
    Resolved::from_layers("hard", "", &["scene.generator=box".to_owned()])
        .expect("the default holds")
        .scenario
        .adc()
        .expect("the default holds")
}

pub fn run(stage: &mut Stage) {
    ties(stage);
    ramp_levels(stage);
    blocks(stage);
    bows(stage);
    kickback(stage);
    clipped(stage);
}

/// An f32 of microvolts in nanovolts, rounded half to even, from its bits: mantissa times 1000 over a power of two, all in integers.
fn exact_nv(sample_uv: f32) -> i128 {
    let bits = sample_uv.to_bits();
    let (exponent, fraction) = (i64::from(bits >> 23 & 0xFF), i128::from(bits & 0x7F_FFFF));
    let (mantissa, power) = if exponent == 0 { (fraction, -149) } else { (fraction | 0x80_0000, exponent - 150) };
    let scaled = mantissa * 1000;
    let size = match power {
        0.. => scaled << power.min(60),
        // 34 bits of mantissa times 1000 are under half of 2^40.
        ..=-40 => 0,
        _ => {
            let unit = 1_i128 << -power;
            let (whole, rest) = (scaled / unit, scaled % unit);
            whole + i128::from(2 * rest > unit || (2 * rest == unit && whole % 2 == 1))
        }
    };
    if sample_uv < 0.0 { -size } else { size }
}

/// Ramp level k of a plain ramp, halves up.
fn exact_ramp_level(params: &AdcParams, k: u32) -> i128 {
    (i128::from(k) * i128::from(params.span_nv()) * 2 + (1 << params.bits)) >> (params.bits + 1)
}

/// Ramp levels at or below the sample plus pedestal, counted by bisection of the exact ones.
fn exact_code(params: &AdcParams, sample_uv: f32) -> u32 {
    let level = exact_nv(sample_uv) + exact_ramp_level(params, params.pedestal_lsb());
    let (mut low, mut high) = (0, params.code_max());
    while low < high {
        let middle = low + (high - low).div_ceil(2);
        if exact_ramp_level(params, middle) <= level { low = middle } else { high = middle - 1 }
    }
    low
}

/// An odd multiple of 1/16 uV is an odd multiple of half a nanovolt: a tie. Its neighbours in f32 are none.
fn ties(stage: &mut Stage) {
    let sides = &["ties", "neighbours of ties", "any"];
    let case = stage.case("half-even rounding of samples to nanovolts", "128-bit integers", "nV", sides);
    let converter = Converter::new(&AdcParams { black_level_dn: 0, cds: Cds::None, ..params() });
    let mut chance = Chance::new(301);
    for number in 0..20_000_u64 {
        let digits = chance.below(22);
        let odd = 2 * chance.below(1 << digits) + 1;
        let tie_uv = f32_nearest(sensel::num::f64_from_u64(odd) / 16.0) * if number % 2 == 0 { 1.0 } else { -1.0 };
        let step = if chance.below(2) == 0 { 1 } else { u32::MAX };
        let near_uv = f32::from_bits(tie_uv.to_bits().wrapping_add(step));
        let any_uv = f32_nearest(chance.decade(1e-9, 1e9)) * if number % 3 == 0 { -1.0 } else { 1.0 };
        for (side, sample_uv) in [(0, tie_uv), (1, near_uv), (2, any_uv)] {
            let (found, exact) = (converter.level_nv(sample_uv), exact_nv(sample_uv));
            let error = sensel::num::f64_from_i64(i64::try_from(i128::from(found) - exact).expect("near"));
            case.see(side, error.abs(), 0.0, || format!("{sample_uv} uV: {found} for {exact}"));
        }
    }
}

/// A sample on a ramp level, a nanovolt below it, and between; at every depth. Samples are named by the f32 nearest to a level, so at wide
/// spans they are off the level by its rounding; the reference sees the same f32.
fn ramp_levels(stage: &mut Stage) {
    let sides = &["on an edge", "1 nV below", "anywhere"];
    let case = stage.case("ramps of 1 to 16 bits at their edges", "128-bit rational edges", "LSB", sides);
    let mut chance = Chance::new(302);
    for bits in 1..=16_u32 {
        for _ in 0..8 {
            let code_max = (1_u32 << bits) - 1;
            let params = AdcParams {
                bits,
                cds: Cds::None,
                black_level_dn: sensel::num::low_u32(chance.below(u64::from(code_max))),
                // Small spans keep samples exact to the nanovolt in f32; the last ones do not.
                full_scale_uv: chance.decade(101.0, 1e6),
                ..params()
            };
            let converter = Converter::new(&params);
            let mut samples = Vec::new();
            for _ in 0..40 {
                let k = 1 + sensel::num::low_u32(chance.below(u64::from(code_max)));
                samples.push(converter.sample_uv(converter.ramp_level_nv(k)));
                samples.push(converter.sample_uv(converter.ramp_level_nv(k) - 1));
                samples.push(f32_nearest(chance.between(-0.2, 1.2) * params.full_scale_uv));
            }
            let mut codes = vec![0; samples.len()];
            converter.convert_row(&samples, &[], &mut codes);
            for (number, (&sample_uv, &code)) in samples.iter().zip(&codes).enumerate() {
                let exact = exact_code(&params, sample_uv);
                let error = (f64::from(code) - f64::from(exact)).abs();
                case.see(number % 3, error, 0.0, || {
                    format!("{bits} bits, {sample_uv} uV: {code} for {exact}; {params:?}")
                });
            }
        }
    }
}

/// Blocks of 32 columns are converted in f32 up to 14 bits; a block with a sample in doubt, and all deeper ones, in integers.
fn blocks(stage: &mut Stage) {
    let sides = &["certain blocks", "blocks with edges", "15 and 16 bits"];
    let case = stage.case("conversion by blocks in f32", "128-bit rational edges", "LSB", sides);
    let mut chance = Chance::new(303);
    for number in 0..600_u32 {
        let deep = number % 10 == 0;
        let bits = if deep { 15 + number / 10 % 2 } else { 6 + number % 9 };
        let params =
            AdcParams { bits, cds: Cds::None, black_level_dn: 5, full_scale_uv: chance.decade(3e3, 3e6), ..params() };
        let converter = Converter::new(&params);
        let with_ramp_levels = number % 3 == 0;
        let mut samples: Vec<f32> =
            (0..64).map(|_| f32_nearest(chance.between(-0.05, 1.05) * params.full_scale_uv)).collect();
        if with_ramp_levels {
            let k = 1 + sensel::num::low_u32(chance.below(u64::from(params.code_max())));
            samples[index(number % 64)] = converter.sample_uv(converter.ramp_level_nv(k));
        }
        let mut codes = vec![0; 64];
        converter.convert_row(&samples, &[], &mut codes);
        let side = if deep { 2 } else { usize::from(with_ramp_levels) };
        for (&sample_uv, &code) in samples.iter().zip(&codes) {
            let exact = exact_code(&params, sample_uv);
            let error = (f64::from(code) - f64::from(exact)).abs();
            case.see(side, error, 0.0, || format!("{bits} bits, {sample_uv} uV: {code} for {exact}"));
        }
    }
}

/// The parabola takes 4 h (N - 3) / N^2 off the last of N steps, or 4 h (N - 1) / N^2 off the first where it hangs down. Where that is
/// more than the step levels would be crossed twice, so the ramp is refused; up to it every level is crossed once, and bisection counts
/// what a scan of all ramp levels counts.
fn bows(stage: &mut Stage) {
    let sides = &["rises throughout", "falls at an end"];
    let case = stage.case("a bowed ramp that would cross a level twice", "scan of all edges", "LSB or yes/no", sides);
    for bits in [3_u32, 5, 7] {
        let steps = f64::from(1_u32 << bits);
        for (share, sign) in
            [(0.0, 1.0), (0.5, 1.0), (0.999, 1.0), (0.999, -1.0), (1.001, 1.0), (1.001, -1.0), (1.9, 1.0)]
        {
            let inl = sign * share * steps * steps / (4.0 * (steps - if sign > 0.0 { 3.0 } else { 1.0 }));
            let params = AdcParams {
                bits,
                cds: Cds::None,
                black_level_dn: 2,
                ramp_inl_lsb: inl,
                ramp: Ramp::Linear,
                ..params()
            };
            if share > 1.0 {
                let refused = params.check().is_err();
                case.hold(1, refused, || format!("{bits} bits, bow {inl} LSB is accepted"));
                continue;
            }
            params.check().unwrap_or_else(|error| panic!("{bits} bits, bow {inl} LSB: {error}"));
            let converter = Converter::new(&params);
            let ramp_levels_nv: Vec<i64> = (0..=params.code_max()).map(|k| converter.ramp_level_nv(k)).collect();
            case.hold(0, ramp_levels_nv.is_sorted(), || format!("{bits} bits, bow {inl} LSB falls"));
            let mut samples = Vec::new();
            for &ramp_level_nv in &ramp_levels_nv {
                samples.extend([-1, 0, 1].map(|step| converter.sample_uv(ramp_level_nv + step)));
            }
            let mut codes = vec![0; samples.len()];
            converter.convert_row(&samples, &[], &mut codes);
            for (&sample_uv, &code) in samples.iter().zip(&codes) {
                let level_nv = converter.level_nv(sample_uv);
                let counted = ramp_levels_nv[1..].iter().filter(|&&ramp_level_nv| ramp_level_nv <= level_nv).count();
                let error = (f64::from(code) - sensel::num::f64_from_usize(counted)).abs();
                case.see(0, error, 0.0, || format!("{bits} bits, bow {inl} LSB, {sample_uv} uV: {code} for {counted}"));
            }
        }
    }
}

/// Columns on one level cross at one clock and kick together, whatever their order in the row; stepped clock by clock the same.
fn kickback(stage: &mut Stage) {
    let sides = &["up", "down", "other order"];
    let case = stage.case("kickback of columns that cross together", "clocked rung, permuted row", "LSB", sides);
    let mut chance = Chance::new(304);
    for number in 0..60_u32 {
        let up = number % 2 == 0;
        let base = params();
        let kickback_uv = base.lsb_uv() * chance.between(0.2, 3.0) * if up { 1.0 } else { -1.0 };
        let params = AdcParams { kickback_uv, kickback_decay_clk: 1 + number % 7, cds: Cds::None, ..base };
        let converter = Converter::new(&params);
        // Few levels, many columns: most clocks with a crossing have several.
        let levels: Vec<f32> = (0..6)
            .map(|_| converter.sample_uv(converter.ramp_level_nv(100 + sensel::num::low_u32(chance.below(12)))))
            .collect();
        let samples: Vec<f32> = (0..48).map(|_| levels[index(sensel::num::low_u32(chance.below(6)))]).collect();
        let convert = |converter: &Converter, samples: &[f32]| {
            let mut codes = vec![0_u16; samples.len()];
            converter.columns(DrawKey::root(1), samples.len()).convert_row(samples, &[], &mut codes);
            codes
        };
        let found = convert(&converter, &samples);
        let clocked = convert(&converter.clone().at(Rung::Clocked), &samples);
        let reversed: Vec<f32> = samples.iter().rev().copied().collect();
        let mut turned = convert(&converter, &reversed);
        turned.reverse();
        for (side, others) in [(usize::from(!up), &clocked), (2, &turned)] {
            for (code, other) in found.iter().zip(others) {
                let error = (f64::from(*code) - f64::from(*other)).abs();
                case.see(side, error, 0.0, || format!("{kickback_uv} uV: {code} for {other}"));
            }
        }
    }
}

/// Around the last ramp level and far beyond it, around nothing and far below it; f32's ends and what is no number.
fn clipped(stage: &mut Stage) {
    let case = stage.case("crossings at and beyond the clip", "128-bit integers", "LSB", &["bottom", "top"]);
    for bits in [1_u32, 2, 10, 14, 15, 16] {
        let params = AdcParams { bits, cds: Cds::None, black_level_dn: 0, full_scale_uv: 8192.0, ..params() };
        let converter = Converter::new(&params);
        let last_nv = converter.ramp_level_nv(params.code_max());
        let sample = |nv: i64| f32_nearest(f64_from_i64(nv) / 1000.0);
        let around = |nv: i64| [-2, -1, 0, 1, 2].map(|step| sample(nv + step));
        let ends = [
            (0, [f32::NEG_INFINITY, f32::MIN, -1e9, -f32::MIN_POSITIVE, f32::NAN], Some(0)),
            (0, around(converter.ramp_level_nv(1)), None),
            (1, around(last_nv), None),
            (1, [1e9, 1e30, f32::MAX, f32::INFINITY, sample(2 * last_nv + 10)], Some(params.code_max())),
        ];
        for (side, samples, expected) in ends {
            let mut codes = [0; 5];
            converter.convert_row(&samples, &[], &mut codes);
            for (sample_uv, code) in samples.into_iter().zip(codes) {
                let exact = expected.unwrap_or_else(|| exact_code(&params, sample_uv));
                let error = (f64::from(code) - f64::from(exact)).abs();
                case.see(side, error, 0.0, || format!("{bits} bits, {sample_uv} uV: {code} for {exact}"));
            }
        }
    }
}
