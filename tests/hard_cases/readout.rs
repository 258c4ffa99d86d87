//! Hard cases of times and merged exposures, against 128-bit integers.

use sensel::adc::{AdcParams, Cds};
use sensel::config::Resolved;
use sensel::link::{LinkParams, Mode, RowPeriod};
use sensel::num::{f64_from_u64, low_u16};
use sensel::readout::{ExposureSetting, FrameClock, HdrMerge, ReadoutParams, Schedule, Shutter, Trigger};
use sensel::units::{CameraIndex, Clocks, FrameIndex, Size};

use super::double_double::{dd, whole};
use super::table::{Chance, Stage};

pub fn run(stage: &mut Stage) {
    clocks_in_seconds(stage);
    triggered_frames(stage);
    half_lines(stage);
    merged(stage);
}

/// Rates of real sensors and the ends of the range.
const RATES_HZ: [u64; 7] = [1_000, 13_500_000, 23_999_999, 48_000_000, 74_250_000, 182_400_000, 100_000_000_000];

/// The frequency rounds once where the camera deviates (its small part thrice, at most 1e-3 of it), the quotient once, and a count beyond
/// 2^53 clocks once: (1 + 0.003 + 1 + 1) * 2^-53 = 3.4e-16, relative.
fn clocks_in_seconds(stage: &mut Stage) {
    let name = "instants after up to 1e15 clocks of a rational clock";
    let case =
        stage.case(name, "double-double of the rational", "relative", &["true clock", "deviating", "beyond 2^53"]);
    let mut chance = Chance::new(401);
    for number in 0..6000_u64 {
        let rate_hz = RATES_HZ[usize::try_from(number % 7).unwrap()];
        let ppb = if number % 2 == 0 { 0 } else { i64::try_from(chance.below(2_000_001)).unwrap() - 1_000_000 };
        let params = ReadoutParams {
            clock_ppb: vec![ppb],
            ..ReadoutParams::plain(Shutter::Rolling, 1000, 1000, rate_hz, ExposureSetting::Lines(1))
        };
        let clock = FrameClock::new(&params, CameraIndex(0), Clocks(1_000_000));
        let count =
            if number % 3 == 0 { (1 << 53) + chance.below(1 << 60) } else { chance.below(1_000_000_000_000_000) };
        let found = clock.length_s(Clocks(count));
        let parts = i128::from(1_000_000_000 + ppb);
        let exact = whole(i128::from(count)) * dd(1e9) / whole(i128::from(rate_hz) * parts);
        let side = if count > 1 << 53 { 2 } else { usize::from(ppb != 0) };
        let at = || format!("{count} clocks of {rate_hz} Hz + {ppb} ppb: {found} s");
        case.see(side, if count == 0 { 0.0 } else { exact.miss(found) / exact.high }, 3.4e-16, at);
    }
}

/// The first edge at or after a pulse: the least e with e / f >= pulse, and f rational. Also frames counted by a free clock, and rows on
/// the link's clock: integers have no error.
fn triggered_frames(stage: &mut Stage) {
    let name = "frame and row starts over 1e12 clocks and more";
    let sides = &["free", "triggered", "rows on the link"];
    let case = stage.case(name, "128-bit integers", "clocks", sides);
    let mut chance = Chance::new(402);
    for number in 0..3000_u64 {
        let rate_hz = RATES_HZ[usize::try_from(number % 7).unwrap()];
        let (ppb, skew) = (i64::try_from(chance.below(2_000_001)).unwrap() - 1_000_000, chance.below(1_000_000));
        let period_ns = 1 + chance.below(100_000_000_000);
        let base = ReadoutParams {
            clock_ppb: vec![ppb],
            sync_skew_ns: vec![skew],
            ..ReadoutParams::plain(Shutter::Rolling, 1000, 1000, rate_hz, ExposureSetting::Lines(1))
        };
        let frame = sensel::num::low_u32(chance.below(1_000_000));
        let frame_clk = 1 + chance.below(1 << 40);
        let free = FrameClock::new(&base, CameraIndex(0), Clocks(frame_clk)).frame_start(FrameIndex(frame));
        let exact = i128::from(frame) * i128::from(frame_clk);
        case.hold(0, i128::from(free.0) == exact, || format!("frame {frame} of {frame_clk}: {free:?}"));
        let late = sensel::num::low_u32(chance.below(1000));
        let triggered = ReadoutParams { trigger: Trigger::External { period_ns, delay_clk: late }, ..base };
        let found = FrameClock::new(&triggered, CameraIndex(0), Clocks(frame_clk)).frame_start(FrameIndex(frame));
        // e / (rate parts / 1e9) >= pulse / 1e9, so e 1e18 >= pulse rate parts; and one less does not do.
        let edge = i128::from(found.0) - i128::from(late);
        let pulse = i128::from(frame) * i128::from(period_ns) + i128::from(skew);
        let need = pulse * i128::from(rate_hz) * i128::from(1_000_000_000 + ppb);
        let unit = 1_000_000_000_000_000_000_i128;
        let first = edge * unit >= need && (edge - 1) * unit < need;
        case.hold(1, first, || format!("frame {frame}, {period_ns} ns, {rate_hz} Hz + {ppb} ppb: {found:?}"));
        let link = LinkParams::new(2, 80_000_000 + chance.below(1_000_000_000), Mode::Frames);
        // A run has less than 2^64 clocks of any clock.
        let (hts, rows) = (1 + chance.below(100_000), chance.below(1_000_000_000_000) % (rate_hz * 50_000));
        let found = RowPeriod::new(Clocks(hts), rate_hz, &link).clocks(rows);
        let need = i128::from(rows) * i128::from(hts) * i128::from(link.frequency_hz);
        let (found_by, unit) = (i128::from(found.0), 4 * i128::from(rate_hz));
        let first = found_by * unit >= need && (found_by - 1) * unit < need;
        case.hold(2, first, || format!("{rows} rows of {hts} at {rate_hz} Hz on {} Hz: {found:?}", link.frequency_hz));
    }
}

fn adc() -> AdcParams {
    let resolved = Resolved::from_layers("hard", "", &["scene.generator=box".to_owned()]).expect("the default holds");
    let params = resolved.scenario.adc().expect("the default holds");
    AdcParams { bits: 4, black_level_dn: 1, cds: Cds::None, ..params }
}

/// Lines of an exposure in microseconds, half to even, by integers: the f64 is m / 2^20 exactly in these cases.
fn exact_lines(parts: i128, hts: u32, rate_hz: u64) -> i128 {
    // lines = parts / 2^20 us * rate / (1e6 hts)
    let (above, below) = (parts * i128::from(rate_hz), (1_000_000 * i128::from(hts)) << 20);
    let (floor, rest) = (above / below, above % below);
    floor + i128::from(2 * rest > below || (2 * rest == below && floor % 2 == 1))
}

/// An exposure that lies half-way between two lines goes to the even one, also where a line has no f64 in microseconds.
fn half_lines(stage: &mut Stage) {
    let sides = &["line exact in us", "line not exact in us", "not half-way"];
    let case = stage.case("exposure rounding at half lines", "128-bit integers", "lines", sides);
    let adc = adc();
    let size = Size { width_px: 64, height_px: 48 };
    let mut chance = Chance::new(403);
    for number in 0..4000_u64 {
        let rate_hz = [48_000_000, 24_000_000, 64_000_000, 74_250_000, 72_000_000, 1_000_000]
            [usize::try_from(number % 6).unwrap()];
        let hts = sensel::num::low_u32(100_000 + 64 * chance.below(2000));
        let lines = 1 + chance.below(900);
        // (lines + 1/2) hts / rate in units of 2^-20 us; a tie where that is an integer.
        let above = ((2 * i128::from(lines) + 1) * i128::from(hts) * 1_000_000) << 20;
        let below = 2 * i128::from(rate_hz);
        let is_tie = above % below == 0;
        let parts = above / below + if number % 4 == 0 { 1 } else { 0 };
        let exposure_us = whole(parts).f64() / 1_048_576.0;
        let params = ReadoutParams::plain(Shutter::Rolling, hts, 1000, rate_hz, ExposureSetting::Us(exposure_us));
        let schedule = Schedule::new(size, &params, &adc, 0.0).unwrap_or_else(|error| panic!("{error}"));
        let (found, exact) = (schedule.exposure_lines(), exact_lines(parts, hts, rate_hz));
        let line_is_exact = 1_000_000 * i128::from(hts) % i128::from(rate_hz) == 0 || {
            // Dyadic: the denominator left is a power of two.
            let rest = i128::from(rate_hz) / gcd(i128::from(rate_hz), 1_000_000 * i128::from(hts));
            rest & (rest - 1) == 0
        };
        let side = if !is_tie || number % 4 == 0 { 2 } else { usize::from(!line_is_exact) };
        let error = (f64_from_u64(found) - whole(exact).f64()).abs();
        let at = || format!("{exposure_us} us in lines of {hts} clocks of {rate_hz} Hz: {found} for {exact}");
        case.see(side, error, 0.0, at);
    }
}

fn gcd(a: i128, b: i128) -> i128 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Two readings of one light. The first is right to half its LSB until it blends; beyond that the second is right to half its own, which is
/// half the ratio of the first's, and each scaled value and the blend round by half an LSB: (ratio + 2) / 2. The scale itself is rounded to
/// 1/4096: (code 2^-13) more. The greatest ratio that 24 bits hold is accepted and twice as much refused.
fn merged(stage: &mut Stage) {
    let sides = &["first reading", "blend and second", "greatest ratio", "refused"];
    let case = stage.case("merged exposures at ratios of 1 to 2^14", "light itself, in rationals", "LSB", sides);
    let mut chance = Chance::new(404);
    for number in 0..400_u64 {
        let bits = 8 + u32::try_from(number % 3).unwrap() * 2;
        let black = chance.below(64);
        let greatest = f64_from_u64(1 << (24 - bits));
        // What 16 bits hold without companding.
        let ratio = if number % 2 == 0 { 1.0 } else { chance.decade(1.0, f64_from_u64(1 << (16 - bits))) };
        let merge = HdrMerge::new("k", bits, u32::try_from(black).unwrap(), &[1.0, 1.0 / ratio]).unwrap();
        let code_max = (1_u64 << bits) - 1;
        for _ in 0..40 {
            let room = f64_from_u64(code_max - black);
            let light = chance.unit() * room * ratio;
            let code = |scale: f64| {
                let exact = (f64_from_u64(black) + light / scale).round_ties_even();
                low_u16(u32::try_from(sensel::num::u64_truncated(exact).min(code_max)).unwrap())
            };
            let (first, second) = (code(1.0), code(ratio));
            let mut merged = [0];
            merge.merge_row(&[&[first], &[second]], &mut merged);
            let error = (f64::from(merged[0]) - (f64_from_u64(black) + light)).abs();
            let blends = u64::from(first) > code_max - code_max / 4;
            let rounding = 0.5 * f64::from(second) / 4096.0;
            let bound = if blends { 0.5 * (ratio + 2.0) + rounding } else { 0.5 };
            let at = || format!("{bits} bits, ratio {ratio}, light {light}: {first} and {second} give {merged:?}");
            case.see(usize::from(blends), error, bound, at);
        }
        for (side, share, accepted) in [(2, 1.0, true), (3, 2.0, false)] {
            let found = HdrMerge::new("k", bits, 0, &[1.0, 1.0 / (share * greatest)]);
            case.hold(side, found.is_ok() == accepted, || format!("{bits} bits at a ratio of {}", share * greatest));
        }
    }
}
