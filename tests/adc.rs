//! The column converters through their front door: hard cases by name, delays, what each effect of the column adds, and what is refused.

#![allow(clippy::unwrap_used)]

use sensel::adc::{AdcParams, Cds, Converter};
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::effects::chain::{Capture, Chain, RowTimes};
use sensel::effects::{self, Parameters};
use sensel::fidelity::Rung;
use sensel::num::{f32_nearest, f64_from_i64, f64_from_usize};
use sensel::units::{CameraIndex, FrameIndex, RowIndex};

const SEED: u64 = 20_261_122;
const WIDTH: usize = 4096;

fn resolved(assignments: &[&str]) -> Resolved {
    let mut all = vec!["scene.generator=box".to_owned()];
    all.extend(assignments.iter().map(|assignment| (*assignment).to_owned()));
    Resolved::from_layers("test", "", &all).unwrap()
}

fn adc(assignments: &[&str]) -> AdcParams {
    resolved(assignments).scenario.adc().unwrap()
}

/// The codes, after both rungs were seen to agree.
fn codes(params: &AdcParams, signal_uv: &[f32], reset_uv: &[f32]) -> Vec<u16> {
    let mut found = [vec![0; signal_uv.len()], vec![0; signal_uv.len()]];
    for (rung, codes) in [Rung::Sampled, Rung::Clocked].into_iter().zip(&mut found) {
        Converter::new(params).at(rung).convert_row(signal_uv, reset_uv, codes);
    }
    let [sampled, clocked] = found;
    assert_eq!(sampled, clocked, "{params:?} {signal_uv:?} {reset_uv:?}");
    sampled
}

#[test]
fn zero_light_is_the_black_level_at_every_depth_and_kind_of_sampling() {
    let mut tried = 0;
    for bits in 1..=16_u32 {
        for cds in Cds::ALL {
            for (reset_counts, ramp_settling_clk) in [(0, 0.0), (1, 0.0), (65_536, 0.0), (1, 20.0)] {
                let code_max = (1_u32 << bits) - 1;
                for black_level_dn in [0, code_max / 16, code_max / 2, code_max - 1] {
                    let params = AdcParams { bits, cds, reset_counts, ramp_settling_clk, black_level_dn, ..adc(&[]) };
                    params.check().unwrap();
                    let mut code = [0];
                    Converter::new(&params).convert_row(&[0.0], &[0.0], &mut code);
                    assert_eq!(u32::from(code[0]), black_level_dn, "{params:?}");
                    tried += 1;
                }
            }
        }
    }
    assert_eq!(tried, 16 * 3 * 4 * 4);
}

#[test]
fn a_ramp_equal_to_the_pixel_counts_its_step_and_a_nanovolt_more_does_not() {
    for assignments in [&["sensor.adc.cds=analog"][..], &["sensor.adc.cds=analog", "sensor.adc.ramp_inl_lsb=3.0"][..]] {
        let params = AdcParams { full_scale_uv: 8192.0, ..adc(assignments) };
        let converter = Converter::new(&params);
        // Ramp level k lies k - 64 LSB above the black level; samples are exact to a nanovolt at this span.
        for k in [1, 2, 63, 64, 65, 511, 512, 1022, 1023_u16] {
            let ramp_level_nv = converter.ramp_level_nv(k.into());
            let around: Vec<f32> = [-1, 0, 1].map(|step| converter.sample_uv(ramp_level_nv + step)).to_vec();
            assert_eq!(codes(&params, &around, &[]), [k - 1, k, k], "{assignments:?}");
        }
    }
}

#[test]
fn first_and_last_code_infinities_and_no_numbers() {
    let hard = [f32::NEG_INFINITY, -1e30, f32::NAN, 1e30, f32::INFINITY];
    for (bits, last) in [(1, 1), (10, 1023), (16, 65_535)] {
        let single = AdcParams { bits, black_level_dn: 0, cds: Cds::None, ..adc(&[]) };
        assert_eq!(codes(&single, &hard, &[]), [0, 0, 0, last, last]);
        let double = AdcParams { cds: Cds::Digital, reset_counts: 1, ..single };
        assert_eq!(codes(&double, &hard, &[0.0; 5]), [0, 0, 0, last, last]);
        assert_eq!(codes(&double, &[1e30; 5], &hard), [last, last, last, last - 1, last - 1]);
    }
}

#[test]
fn a_negative_difference_is_clipped_at_zero_and_stands_above_it_on_a_pedestal() {
    let params = adc(&[]);
    let lsb_uv = f32_nearest(params.lsb_uv());
    // Signals below the reset level by 10, 64, 65 and 100 LSB; the black level is 64. All levels lie on the reset ramp.
    let below = [10.0, 64.0, 65.0, 100.0];
    let signal_uv = below.map(|lsb| (-lsb / 2.0 + 0.25) * lsb_uv);
    let reset_uv = below.map(|lsb| (lsb / 2.0 + 0.25) * lsb_uv);
    assert_eq!(codes(&params, &signal_uv, &reset_uv), [54, 0, 0, 0]);
    // One LSB of light on each is seen where the counter came down to zero, and not below.
    let lit_uv = signal_uv.map(|uv| uv + lsb_uv);
    assert_eq!(codes(&params, &lit_uv, &reset_uv), [55, 1, 0, 0]);
}

#[test]
fn digital_double_sampling_cancels_the_delay_that_a_column_has_and_a_single_conversion_does_not() {
    let signal_uv: Vec<f32> = (0..900_u16).map(|column| f32::from(column) * 107.0).collect();
    let reset_uv = vec![800.0; 900];
    let of = |cds, delay_clk| {
        let params = AdcParams { cds, comparator_delay_clk: delay_clk, ..adc(&[]) };
        codes(&params, &signal_uv, if cds == Cds::Digital { &reset_uv } else { &[] })
    };
    for delay_clk in [1, 17, 50] {
        assert_eq!(of(Cds::Digital, 0), of(Cds::Digital, delay_clk), "{delay_clk} clocks");
        let moved: Vec<u16> =
            of(Cds::None, 0).iter().map(|code| (code + u16::try_from(delay_clk).unwrap()).min(1023)).collect();
        assert_eq!(moved, of(Cds::None, delay_clk));
    }
    // Beyond the reset ramp (128 counts, 71 at this level) the reset count stands at its end and the difference grows.
    let late = of(Cds::Digital, 60);
    assert!(of(Cds::Digital, 0).iter().zip(&late).all(|(before, after)| *after == (before + 3).min(1023)));
}

#[test]
fn delays_of_the_columns_belong_to_the_die() {
    let params = AdcParams { comparator_delay_clk: 40, comparator_delay_sigma_clk: 4.0, ..adc(&[]) };
    let converter = Converter::new(&params);
    let delays = |die| {
        let columns = converter.columns(DrawKey::root(die), WIDTH);
        (0..WIDTH).map(|column| f64::from(columns.delay_clk(column))).collect::<Vec<_>>()
    };
    let (mean, variance) = moments(&delays(1));
    // 5 standard errors of 4096 draws: 0.31 of the mean, 11 % of the variance; rounding to clocks adds 1/12.
    assert!((mean - 40.0).abs() < 0.32 && (variance - 16.0 - 1.0 / 12.0).abs() < 1.8, "{mean} {variance}");
    assert_eq!(delays(1), delays(1));
    assert_ne!(delays(1), delays(2));
}

fn moments(values: &[f64]) -> (f64, f64) {
    let count = f64_from_usize(values.len());
    let mean = values.iter().sum::<f64>() / count;
    (mean, values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count)
}

/// A sensor of which one effect is chosen.
struct OneEffect(Chain);

impl OneEffect {
    fn new(name: &str, assignments: &[&str]) -> Self {
        let scenario = resolved(assignments).scenario;
        let parameters = Parameters { pixel: scenario.pixel().unwrap(), adc: scenario.adc().unwrap() };
        let mut chosen = effects::build_all(&parameters);
        chosen.retain(|effect| effect.name() == name);
        assert_eq!(chosen.len(), 1, "{name} is there");
        Self(Chain::new(parameters, chosen, SEED, 6))
    }

    /// What stands in both samples of a row whose pixels hold `photons`.
    fn samples(&self, photons: f32, frame: u32, row: u32, readout_s: f64) -> [Vec<f64>; 2] {
        let capture = Capture::single(CameraIndex(0), FrameIndex(frame));
        let times = RowTimes { exposure_s: 0.01, storage_s: 0.0, readout_s };
        let samples = self.0.row_samples(&vec![photons; WIDTH], capture, RowIndex(row), times);
        [samples.signal_uv, samples.reset_uv].map(|row| row.iter().map(|&uv| f64::from(uv)).collect())
    }

    fn signal(&self, frame: u32, row: u32) -> Vec<f64> {
        self.samples(0.0, frame, row, 0.0)[0].clone()
    }
}

/// 5 standard errors of a variance of `count` draws: sqrt(2 / count) each.
fn near_variance(found: f64, expected: f64, count: usize) {
    let allowed = 5.0 * (2.0 / f64_from_usize(count)).sqrt() * expected;
    assert!((found - expected).abs() <= allowed, "variance {found} for {expected}");
}

#[test]
fn row_noise_is_one_draw_a_row_and_frame_and_row_offset_one_a_row_of_the_die() {
    for (name, key, stays) in [("row_noise", "row_noise_uv", false), ("row_offset", "row_offset_uv", true)] {
        let effect = OneEffect::new(name, &[&format!("sensor.adc.{key}=50.0")]);
        let mut rows = Vec::new();
        for row in 0..2000 {
            let values = effect.signal(3, row);
            assert!(values.iter().all(|value| value == &values[0]), "{name} is shared");
            rows.push(values[0]);
        }
        near_variance(moments(&rows).1, 2500.0, 2000);
        assert_eq!(effect.signal(4, 7) == effect.signal(3, 7), stays, "{name}");
    }
}

#[test]
fn column_noise_is_one_draw_a_column_and_frame() {
    let effect = OneEffect::new("column_noise", &["sensor.adc.column_noise_uv=50.0"]);
    near_variance(moments(&effect.signal(3, 0)).1, 2500.0, WIDTH);
    assert_eq!(effect.signal(3, 0), effect.signal(3, 99));
    assert_ne!(effect.signal(3, 0), effect.signal(4, 0));
}

#[test]
fn each_conversion_has_its_own_comparator_noise() {
    for (cds, conversions) in [("none", 1.0), ("analog", 1.0), ("digital", 2.0)] {
        let effect = OneEffect::new(
            "comparator_noise",
            &["sensor.adc.comparator_noise_uv=50.0", &format!("sensor.adc.cds={cds}")],
        );
        let [signal, reset] = effect.samples(0.0, 3, 5, 0.0);
        let difference: Vec<f64> =
            signal.iter().enumerate().map(|(column, uv)| uv - reset.get(column).unwrap_or(&0.0)).collect();
        near_variance(moments(&difference).1, conversions * 2500.0, WIDTH);
        assert_ne!(signal, effect.signal(3, 6));
    }
}

#[test]
fn ramp_noise_is_shared_by_the_columns_that_convert_together_and_drawn_for_each_conversion() {
    let effect = OneEffect::new("ramp_noise", &["sensor.adc.ramp_noise_uv=50.0", "sensor.adc.columns_per_adc=2"]);
    let mut draws = Vec::new();
    for row in 0..1000 {
        for samples in effect.samples(0.0, 3, row, 0.0) {
            let (even, odd) = (samples[0], samples[1]);
            assert!(samples.chunks(2).all(|pair| pair == [even, odd]));
            draws.extend([even, odd]);
        }
    }
    near_variance(moments(&draws).1, 2500.0, 4000);
    let neighbours: f64 = draws.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 2500.0 / 4000.0;
    // Reset, signal, even and odd draws know nothing of each other: a correlation of 0 to 5 standard errors.
    assert!(neighbours.abs() < 5.0 / 4000.0_f64.sqrt(), "{neighbours}");
}

#[test]
fn jitter_costs_as_many_microvolts_as_the_ramp_is_steep_where_the_pixel_crosses() {
    let common = ["sensor.adc.ramp_jitter_ps=2000.0", "sensor.adc.cds=analog"];
    let linear = OneEffect::new("ramp_jitter", &common);
    // 110,000 uV in 1024 clocks of 480 MHz: 0.051563 uV a picosecond.
    near_variance(moments(&linear.signal(3, 0)).1, 103.125 * 103.125, WIDTH);
    let pieces = ["sensor.adc.ramp=piecewise", "sensor.adc.ramp_points=[[0.5,0.25]]"];
    let bent = OneEffect::new("ramp_jitter", &[&common[..], &pieces[..]].concat());
    // 0.6 * 0.9 * 10 uV a photon: 1.1 mV and 54 mV above the black level lie on the flat and on the steep part.
    for (photons, slope) in [(200.0, 0.5), (10_000.0, 1.5)] {
        let [signal, _] = bent.samples(photons, 3, 0, 0.0);
        let sigma_uv = 103.125 * slope;
        near_variance(moments(&signal).1, sigma_uv * sigma_uv, WIDTH);
    }
}

#[test]
fn ripple_is_a_sine_of_run_time_at_each_crossing_and_stays_in_phase_for_hours() {
    let (amplitude_uv, hz, clock_hz) = (40.0, 131_072.0, 480e6);
    let assignments =
        ["sensor.adc.supply_ripple_uv=40.0", "sensor.adc.supply_ripple_hz=131072.0", "sensor.adc.cds=none"];
    let effect = OneEffect::new("supply_ripple", &assignments);
    // Black level 64, so the crossing is the 65th clock of the ramp, which starts after 3 us of settling.
    for readout_s in [0.0, 1.0 / 1_048_576.0, 0.25 + 3.0 / 1_048_576.0] {
        let at_s = readout_s + 3e-6 + 65.0 / clock_hz;
        let expected_uv = amplitude_uv * libm::sin(core::f64::consts::TAU * hz * at_s);
        let [signal, _] = effect.samples(0.0, 0, 0, readout_s);
        // An f32 of 40 uV has an ulp of 4e-6; the angle here is below 3e5 rad, so the reference's own rounding is 2e-9 uV.
        assert!(signal.iter().all(|uv| (uv - expected_uv).abs() < 4e-6), "{} for {expected_uv}", signal[0]);
        // Nine hours later: a whole number of periods, and both times are exact floats.
        assert_eq!(effect.samples(0.0, 0, 0, readout_s + 32_768.0)[0], signal);
    }
}

#[test]
fn a_weak_bias_leaves_a_share_of_the_signal_behind() {
    // tau = 2 pF * 0.2 V / (2 * 0.5 uA) = 0.4 us; 1 us are 2.5 of them. Half the overdrive is 100 mV: 18,500 photons.
    let assignments = [
        "sensor.adc.column_bias_ua=0.5",
        "sensor.adc.column_capacitance_pf=2.0",
        "sensor.adc.settle_signal_us=1.0",
        "sensor.adc.cds=analog",
    ];
    let effect = OneEffect::new("column_settling", &assignments);
    let settled = |photons: f32| effect.samples(photons, 0, 0, 0.0)[0][0];
    let small_uv = 5.4 * 1000.0;
    // f32 has 2^-24 of a value, at the sample and at the result.
    assert!((settled(1000.0) / (small_uv * (1.0 - libm::exp(-2.5))) - 1.0).abs() < 2e-7);
    // 200 mV slew for 0.4 us until 100 mV are missing, then settle for 0.6 us: 1.5 time constants.
    let large_uv = 5.4 * 37_037.037;
    let missing_uv = 1e5 * libm::exp(-(2.5 - (large_uv / 1e5 - 1.0)));
    assert!((settled(37_037.037) / (large_uv - missing_uv) - 1.0).abs() < 1e-6);
    // Slewing for the whole time moves it by 250 mV and no more.
    assert!((settled(100_000.0) - 250_000.0).abs() < 0.1);
}

#[test]
fn keys_out_of_place_are_refused_by_name_with_what_would_do() {
    let cases: &[(&[&str], &[&str])] = &[
        (&["sensor.adc.ramp_points=[[0.5,0.2]]"], &["sensor.adc.ramp_points", "piecewise"]),
        (&["sensor.adc.ramp=piecewise"], &["sensor.adc.ramp_points", "1 to 64 points"]),
        (&["sensor.adc.ramp=table"], &["sensor.adc.ramp_table_uv", "1023"]),
        (&["sensor.adc.ramp=sawtooth"], &["sensor.adc.ramp", "linear, piecewise, table"]),
        (
            &["sensor.adc.bits=4", "sensor.adc.reset_counts=8", "sensor.adc.ramp_inl_lsb=6.0"],
            &["sensor.adc.ramp_inl_lsb", "nearer to 0"],
        ),
        (&["sensor.adc.bits=6", "sensor.adc.ramp_settling_clk=2.0"], &["sensor.adc.reset_counts", "at most 63"]),
        (&["sensor.adc.counter=johnson"], &["sensor.adc.counter", "binary, gray"]),
        (&["sensor.adc.counting=down"], &["sensor.adc.counting", "up_down, latch"]),
        (&["sensor.adc.kickback_decay_clk=0"], &["sensor.adc.kickback_decay_clk", "1 to 1024"]),
        (&["sensor.adc.supply_ripple_uv=-1.0"], &["sensor.adc.supply_ripple_uv", "0 to"]),
    ];
    for (assignments, parts) in cases {
        let message = resolved(assignments).scenario.adc().unwrap_err().to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
}

#[test]
fn a_converter_wider_than_its_columns_is_refused_with_the_sharing_that_would_do() {
    let pixel = resolved(&[]).scenario.pixel().unwrap();
    let of = |pitch_um, columns_per_adc, sides| {
        AdcParams { pitch_um, columns_per_adc, sides, ..adc(&[]) }
            .check_pitch(&pixel)
            .map_err(|error| error.to_string())
    };
    // The pixel pitch is 3 um.
    assert!(of(0.0, 1, 1).is_ok() && of(3.0, 1, 1).is_ok() && of(6.0, 1, 2).is_ok() && of(6.0, 2, 1).is_ok());
    let message = of(6.1, 1, 1).unwrap_err();
    assert!(message.contains("sensor.adc.pitch_um = 6.1") && message.contains("use columns_per_adc = 3"), "{message}");
    assert!(of(13.0, 1, 2).unwrap_err().contains("use columns_per_adc = 3"));
    assert!(of(1000.0, 64, 1).unwrap_err().contains("192 um; use fewer"));
    let error = sensel::run::SensorSetup::new(&resolved(&["sensor.adc.pitch_um=9.0"])).err().unwrap().to_string();
    assert!(error.contains("--set") && error.contains("columns_per_adc = 3"), "{error}");
}

#[test]
fn shared_converters_take_a_line_of_as_many_conversions() {
    let line = |columns: u32| {
        let params = AdcParams { columns_per_adc: columns, ..adc(&[]) };
        params.settling_s() + f64_from_i64(i64::try_from(params.ramp_clk().0).unwrap()) / 480e6
    };
    // One rounding a term.
    assert!((line(4) / line(1) - 4.0).abs() < 1e-14);
    let assignments = ["sensor.adc.columns_per_adc=3"];
    let error = sensel::run::SensorSetup::new(&resolved(&assignments)).err().unwrap().to_string();
    // 3 (5 us + 1152 / 480 MHz) are 22.2 us: 1065.6 clocks at 48 MHz; the preset's line has 928.
    assert!(error.contains("sensor.readout.hts") && error.contains("use hts = 1066"), "{error}");
}
