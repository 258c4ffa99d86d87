//! The rungs of the ladder agree: the closed form of a row's conversions gives the codes, and the counted work, of the converters stepped
//! clock by clock, for every column of random converters; a frame of the box room has the same hashes on both rungs. With Verilator, the
//! Verilog gives them too.

#![allow(clippy::unwrap_used)]

use crate::chance;
use crate::common::assets::WithVerilog;

use std::collections::BTreeMap;

use chance::Chance;
use sensel::adc::{AdcParams, Cds, Converter, Counter, Counting, Ramp, Sample};
use sensel::config::Resolved;
use sensel::draw::{DrawKey, EffectNumber};
use sensel::fidelity::Rung;
use sensel::num::{f32_nearest, index};
#[cfg(feature = "outside")]
use sensel::run::Assets;
use sensel::run::{NoClock, NoProgress, Session, Setup};

const SEED: u64 = 20_261_121;
const CONFIGS: u64 = 400;

fn paper_adc() -> AdcParams {
    Resolved::from_layers("twins", "", &["scene.generator=box".to_owned()]).unwrap().scenario.adc().unwrap()
}

/// A random converter; every key of the conversion takes all its kinds of values.
fn random_params(chance: &mut Chance) -> AdcParams {
    let bits = 1 + chance.below(12);
    let code_max = (1_u32 << bits) - 1;
    let mut params = AdcParams {
        bits,
        full_scale_uv: chance.between(2000.0, 500_000.0),
        gain: chance.one(&[1.0, 1.7, 8.0]),
        black_level_dn: chance.below(code_max),
        reset_counts: chance.one(&[0, 1, code_max / 4, code_max]),
        cds: chance.one(&Cds::ALL),
        ramp: chance.one(&Ramp::ALL),
        comparator_delay_clk: chance.one(&[0, 0, 1, 3, 40]),
        comparator_delay_sigma_clk: chance.one(&[0.0, 0.0, 0.7, 6.0]),
        counter: chance.one(&Counter::ALL),
        counting: chance.one(&Counting::ALL),
        columns_per_adc: chance.one(&[1, 1, 2, 5]),
        kickback_decay_clk: chance.one(&[1, 4, 30, 1024]),
        ..paper_adc()
    };
    let lsb_uv = params.lsb_uv();
    params.kickback_uv = chance.one(&[0.0, 0.0, 0.03, -0.03, 0.6, -0.6, 20.0, -20.0]) * lsb_uv.min(500.0);
    params.ramp_settling_clk = chance.one(&[0.0, 0.0, 0.4, 9.0, 200.0]);
    params.ramp_inl_lsb = chance.one(&[0.0, 0.0, 0.2, -0.2]) * f64::from(code_max + 1).min(64.0);
    match params.ramp {
        Ramp::Linear => {}
        Ramp::Piecewise => {
            let (low, high) = (chance.between(0.05, 0.45), chance.between(0.5, 0.95));
            params.ramp_points = vec![[low, chance.between(0.02, 0.4)], [high, chance.between(0.45, 0.97)]];
            params.ramp_inl_lsb = 0.0; // A bow can fold a steep corner; the linear ramps try it.
        }
        Ramp::Table => {
            params.ramp_inl_lsb = 0.0;
            let mut level_uv = 0.0;
            let step_uv = params.full_scale_uv / f64::from(code_max + 1);
            for _ in 0..code_max {
                level_uv += step_uv * chance.one(&[0.0, 0.3, 1.0, 1.0, 1.2]);
                params.ramp_table_uv.push(f64::min(level_uv, params.full_scale_uv));
            }
        }
    }
    params
}

/// Samples all over the range and beyond, some of them equal, some on ramp levels to a nanovolt, some no numbers.
fn random_samples(chance: &mut Chance, converter: &Converter, params: &AdcParams, width: usize) -> Vec<f32> {
    let span_uv = params.full_scale_uv / params.gain;
    let hard = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30];
    (0..width)
        .map(|_| match chance.below(8) {
            0 => chance.one(&hard),
            1 | 2 => {
                let ramp_level_nv = converter.ramp_level_nv(chance.below(params.code_max() + 1));
                converter.sample_uv(ramp_level_nv + chance.one(&[-1, 0, 1]))
            }
            3 => f32_nearest(0.3 * span_uv),
            _ => f32_nearest(chance.between(-0.3, 1.2) * span_uv),
        })
        .collect()
}

#[test]
fn the_closed_form_is_the_clocked_converter_in_every_column_of_random_configs() {
    println!("seed {SEED}");
    let (mut columns_compared, mut configs, mut refused) = (0, 0, 0);
    let mut kinds = BTreeMap::<String, u32>::new();
    for case in 0..CONFIGS {
        let mut chance = Chance::new(SEED, case);
        let params = random_params(&mut chance);
        if let Err(error) = params.check() {
            // A black level that falls on a flat part of a random table is refused, and nothing else is.
            assert!(error.to_string().contains("black_level_dn"), "case {case}: {error}; {params:?}");
            refused += 1;
            continue;
        }
        let sampled = Converter::new(&params);
        let clocked = sampled.clone().at(Rung::Clocked);
        for width in [1, 7, 64] {
            let signal_uv = random_samples(&mut chance, &sampled, &params, width);
            let reset_uv: Vec<f32> = random_samples(&mut chance, &sampled, &params, width)
                .iter()
                .map(|uv| if chance.unit() < 0.7 { 0.02 * uv } else { *uv })
                .collect();
            let (mut codes, mut by_clock) = (vec![0; width], vec![0; width]);
            let die = DrawKey::root(case).with(EffectNumber(211).0);
            let work = sampled.columns(die, width).convert_row(&signal_uv, &reset_uv, &mut codes);
            let work_by_clock = clocked.columns(die, width).convert_row(&signal_uv, &reset_uv, &mut by_clock);
            let said = format!("case {case} of seed {SEED}, width {width}: {params:?}, {signal_uv:?}, {reset_uv:?}");
            assert_eq!(codes, by_clock, "{said}");
            assert_eq!(work, work_by_clock, "{said}");
            columns_compared += width;
        }
        configs += 1;
        let names = [params.cds.name(), params.ramp.name(), params.counter.name(), params.counting.name()];
        names.iter().for_each(|name| *kinds.entry((*name).to_owned()).or_default() += 1);
        for (name, is_there) in [
            ("kickback", params.kickback_uv != 0.0),
            ("kickback and delay", params.kickback_uv != 0.0 && params.comparator_delay_clk > 0),
            ("delay sigma", params.comparator_delay_sigma_clk > 0.0),
            ("shared", params.columns_per_adc > 1),
            ("settling", params.ramp_settling_clk > 0.0),
            ("bow", params.ramp_inl_lsb != 0.0),
            ("no reset counts", params.cds == Cds::Digital && params.reset_counts == 0),
        ] {
            *kinds.entry(name.to_owned()).or_default() += u32::from(is_there);
        }
    }
    println!("{configs} configs, {columns_compared} columns compared, {refused} refused; {kinds:?}");
    assert!(configs > 300 && columns_compared > 20_000 && refused < 80, "{configs}, {columns_compared}, {refused}");
    assert!(kinds.len() == 17 && kinds.values().all(|&tried| tried > 15), "{kinds:?}");
}

/// Columns in Verilog, whose counters see the clocked comparators.
#[cfg(feature = "outside")]
#[test]
fn the_verilog_is_the_clocked_converter_in_every_column_of_random_configs() {
    println!("seed {SEED}");
    let (mut columns_compared, mut clipped) = (0, 0);
    let verilog = sensel::rtl_simulator::SharedRtlSimulator::new(WithVerilog.rtl_simulator().unwrap());
    for case in 0..CONFIGS / 4 {
        let mut chance = Chance::new(SEED, case);
        let params = random_params(&mut chance);
        if params.check().is_err() {
            continue;
        }
        let clocked = Converter::new(&params).at(Rung::Clocked);
        let in_verilog = clocked.clone().in_verilog(Some(verilog.clone()));
        for width in [1, 7, 64] {
            let signal_uv = random_samples(&mut chance, &clocked, &params, width);
            let reset_uv: Vec<f32> =
                random_samples(&mut chance, &clocked, &params, width).iter().map(|uv| 0.02 * uv).collect();
            let (mut codes, mut expected) = (vec![0; width], vec![0; width]);
            let die = DrawKey::root(case).with(EffectNumber(211).0);
            let work = clocked.columns(die, width).convert_row(&signal_uv, &reset_uv, &mut expected);
            let work_too = in_verilog.columns(die, width).convert_row(&signal_uv, &reset_uv, &mut codes);
            verilog.check().unwrap();
            let said = format!("case {case} of seed {SEED}, width {width}: {params:?}, {signal_uv:?}, {reset_uv:?}");
            assert_eq!((codes, work_too), (expected.clone(), work), "{said}");
            columns_compared += width;
            clipped += expected.iter().filter(|&&code| code == 0 || u32::from(code) == params.code_max()).count();
        }
    }
    println!("{columns_compared} columns compared, {clipped} of them clipped");
    assert!(columns_compared > 5000 && clipped > 500 && clipped < columns_compared / 2);
}

/// The kickback is no decoration: it moves codes, and it moves them alike on both rungs only if its order of events is right.
#[test]
fn kickback_moves_codes_of_columns_that_cross_after_others() {
    let quiet = AdcParams { cds: Cds::Analog, ..paper_adc() };
    let loud = AdcParams { kickback_uv: 30.0, kickback_decay_clk: 16, ..quiet.clone() };
    // Columns two LSB apart: all but the first meet a ramp that others have lifted.
    let signal_uv: Vec<f32> = (0..64_u16).map(|column| f32::from(column) * 215.0).collect();
    let codes = |params: &AdcParams, rung| {
        let mut codes = vec![0; signal_uv.len()];
        Converter::new(params).at(rung).convert_row(&signal_uv, &[], &mut codes);
        codes
    };
    let (before, after) = (codes(&quiet, Rung::Sampled), codes(&loud, Rung::Sampled));
    assert_eq!(after, codes(&loud, Rung::Clocked));
    let moved = before.iter().zip(&after).filter(|(before, after)| before != after).count();
    assert_eq!(before[0], after[0], "nobody flips before the first");
    assert!(moved > 40, "{moved} of {} moved", before.len());
    assert!(before.iter().zip(&after).all(|(before, after)| after <= before), "a lifted ramp crosses sooner");
}

#[test]
fn waveforms_show_the_conversion_that_gives_the_codes() {
    let mut shown = 0;
    for (counting, columns_per_adc, kickback_uv) in
        [(Counting::UpDown, 1, 0.0), (Counting::Latch, 2, 4.0), (Counting::UpDown, 3, -4.0)]
    {
        let params = AdcParams {
            bits: 6,
            black_level_dn: 4,
            reset_counts: 16,
            comparator_delay_clk: 1,
            counting,
            columns_per_adc,
            kickback_uv,
            ..paper_adc()
        };
        let converter = Converter::new(&params);
        let columns = converter.columns(DrawKey::root(3), 9);
        let signal_uv: Vec<f32> = (0..9_u16).map(|column| f32::from(column) * 11_000.0).collect();
        let reset_uv = vec![900.0; 9];
        let crossings = columns.crossings(&signal_uv, &reset_uv);
        let mut codes = vec![0; 9];
        columns.convert_row(&signal_uv, &reset_uv, &mut codes);
        let (mut first_high, mut last) = (BTreeMap::new(), BTreeMap::new());
        columns.watch(&signal_uv, &reset_uv, &[4, 8], &mut |view| {
            let watched: Vec<usize> =
                [4_usize, 8].into_iter().filter(|column| column % index(columns_per_adc) == index(view.pass)).collect();
            assert_eq!((view.bits.len(), view.counters.len()), (watched.len(), watched.len()));
            for (at, &column) in watched.iter().enumerate() {
                if view.bits[at] {
                    first_high.entry((view.sample == Sample::Reset, column)).or_insert(view.clock);
                }
                last.insert((view.sample == Sample::Reset, column), view.counters[at]);
            }
            shown += 1;
        });
        for column in [4, 8] {
            let high = |is_reset| first_high.get(&(is_reset, column)).copied().unwrap_or(u32::MAX);
            assert_eq!(high(true), crossings.reset_clk[column]);
            assert_eq!(high(false), crossings.signal_clk[column]);
            let reading = match counting {
                Counting::UpDown => last[&(false, column)],
                Counting::Latch => 4 + last[&(false, column)] - last[&(true, column)],
            };
            assert_eq!(reading.clamp(0, 63), i64::from(codes[column]));
        }
    }
    assert_eq!(shown, (1 + 2 + 3) * (63 + 16));
}

/// Codes, features and energy of whole frames, from the scene on.
#[test]
fn frames_of_the_box_room_have_the_same_hashes_on_all_rungs() {
    let rare = [
        "sensor.adc.kickback_uv=3.0",
        "sensor.adc.comparator_delay_clk=3",
        "sensor.adc.comparator_delay_sigma_clk=0.8",
        "sensor.adc.ramp_settling_clk=6.0",
        "sensor.adc.ramp_inl_lsb=1.5",
        "sensor.adc.ramp_noise_uv=30.0",
        "sensor.adc.comparator_noise_uv=60.0",
        "sensor.adc.counting=latch",
        "sensor.adc.counter=gray",
    ];
    let mut hashes = Vec::new();
    for more in [&[][..], &rare[..]] {
        let frames = |rung: &str| {
            let mut assignments: Vec<String> = more.iter().map(|assignment| (*assignment).to_owned()).collect();
            assignments.push(format!("run.rung={rung}"));
            let text = "[scene]\ngenerator = \"box\"\nilluminance_lux = 1000.0\n[motion]\noffset_m = [0.0, 1.5, 0.3]\n\
                        [sensor]\nwidth = 128\nheight = 96\n[run]\nframes = 2\n";
            let resolved = Resolved::from_layers("twins", text, &assignments).unwrap();
            let mut session = Session::new(Setup::new(resolved, &WithVerilog, &NoProgress).unwrap()).unwrap();
            let codes: Vec<_> = (0..2)
                .flat_map(|_| session.step(&NoClock).unwrap().cameras.into_iter().map(|camera| camera.codes))
                .collect();
            let energy = session.energy();
            (codes, session.hashes(), format!("{energy:?}"))
        };
        let (sampled, clocked) = (frames("sampled"), frames("clocked"));
        if cfg!(feature = "outside") {
            assert!(clocked == frames("rtl"), "the Verilog gives something else with {more:?}");
        }
        let pixels: usize = sampled.0.iter().map(|codes| codes.values().len()).sum();
        assert_eq!(pixels, 4 * 128 * 96);
        assert!(sampled.0 == clocked.0, "codes differ with {more:?}");
        assert_eq!((&sampled.1, &sampled.2), (&clocked.1, &clocked.2), "{more:?}");
        hashes.push(sampled.1);
    }
    assert_ne!(hashes[0], hashes[1], "the rarer keys act");
}
