//! Rust twin = Verilog on every clock and every pin, under Verilator, over more than a million clocks a block: random and directed
//! parameters, stalls, resets in mid-conversion. Registers wake up with random values. And Yosys: synthesisable, at the size that
//! docs/rtl.md gives.
#![cfg(feature = "outside")]
#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

#[path = "rtl/extractor.rs"]
mod extractor;
#[path = "rtl/extractor_synthesis.rs"]
mod extractor_synthesis;
#[path = "rtl/energy.rs"]
mod energy;
#[path = "rtl/found_before.rs"]
pub mod found_before;
#[path = "rtl/front.rs"]
mod front;
#[path = "rtl/csi2.rs"]
mod csi2;
#[path = "rtl/judge.rs"]
mod judge;
#[path = "rtl/liberty.rs"]
mod liberty;
#[path = "rtl/photographs.rs"]
mod photographs;
#[path = "rtl/pins.rs"]
mod pins;
#[path = "rtl/synthesis.rs"]
mod synthesis;

use crate::{cases, csi2_cases, extractor_forms, extractor_play, front_pictures, front_reference};
use cases::{Random, comparators, core_config};
use judge::Judge;
use pins::{cds_in, cds_out, core_in, core_out, lane_in, lane_out, ramp_in, ramp_out, seq_in, seq_out};
use rtl_models::cds::{Cds, CdsConfig, CdsIn, CdsOut};
use rtl_models::lane_shift::{LaneConfig, LaneIn, LaneOut, LaneShift};
use rtl_models::ramp_counter::{RampCounter, RampCounterIn, RampCounterOut};
use rtl_models::readout_seq::{ReadoutSeq, SeqConfig, SeqIn, SeqOut};
use rtl_models::sensor_core::{CoreConfig, CoreIn, CoreOut, SensorCore};

/// Steps of a case: mostly short ramps, and those of one and sixteen bits.
fn some_steps(random: &mut Random, case: u32) -> u32 {
    let bits = random.within(1, 9);
    match case {
        0 | 1 => 1 << 16,
        2 | 3 => 2,
        4 => 0,
        _ => random.within(1, 1 << bits),
    }
}

#[test]
fn the_ramp_counter_equals_its_twin_on_every_clock() {
    const SEED: u64 = 31;
    let mut random = Random::new(SEED);
    let nothing = RampCounterIn::default();
    let mut judge = Judge::new("ramp_counter", &[], &ramp_in(&nothing), &ramp_out(&RampCounterOut::default()));
    let mut ramps = 0;
    for case in 0..1500 {
        let (steps, gray) = (some_steps(&mut random, case), random.one_in(2));
        let mut twin = RampCounter::new();
        let (mut before, mut toggles) = (RampCounterOut::default(), [0; 2]);
        let clocks = if case < 2 { 140_000 } else { 560 };
        for clock in 0..clocks {
            let rst = clock == 0 || random.one_in(2 * clocks);
            let stall = random.one_in(5);
            let start = random.one_in(if case < 2 { 2 } else { 15 });
            let pins = RampCounterIn { rst, stall, start, gray, steps };
            let out = twin.tick(pins);
            if clock == 0 {
                (before, toggles) = (out, [0; 2]);
                twin = RampCounter::new();
            }
            judge.clock(&ramp_in(&pins), &ramp_out(&out));
            // What flipped is counted again from the pins, which are Verilog's.
            toggles[0] += u64::from((before.ramp_code ^ out.ramp_code).count_ones());
            toggles[1] += u64::from((before.count ^ out.count).count_ones());
            ramps += u32::from(out.done);
            before = out;
        }
        assert_eq!([twin.ramp_toggles(), twin.count_toggles()], toggles, "case {case}");
    }
    assert!(ramps > 5000, "{ramps} ramps ended");
    judge.finish(SEED);
}

/// Pins of a column during real ramps, or any pins at all.
fn column_pins(random: &mut Random, wild: bool, ramp: &RampCounterOut, crossing: u32) -> CdsIn {
    if wild {
        let flags: [bool; 6] = std::array::from_fn(|_| random.one_in(3));
        let [clear, arm, step, done, down, comparator] = flags;
        return CdsIn {
            rst: false,
            stall: false,
            clear,
            arm,
            step,
            done,
            down,
            comparator,
            count: random.below(1 << 17),
        };
    }
    // Outside of steps the comparator says anything.
    let comparator = if ramp.step { ramp.ramp_code >= crossing } else { random.one_in(2) };
    CdsIn { step: ramp.step, done: ramp.done, comparator, count: ramp.count, ..CdsIn::default() }
}

#[test]
fn the_column_equals_its_twin_on_every_clock() {
    const SEED: u64 = 32;
    let mut random = Random::new(SEED);
    let config = CdsConfig { bits: 1, black: 0, latch_mode: false, gray: false };
    let mut judge = Judge::new("cds", &[], &cds_in(&config, &CdsIn::default()), &cds_out(&CdsOut::default()));
    let (mut first, mut last, mut never) = (0, 0, 0);
    for case in 0..1400_u32 {
        let bits = if case < 2 { 16 } else { random.within(1, 10) };
        let black = u16::try_from(random.below(1 << bits)).unwrap();
        let config = CdsConfig { bits, black, latch_mode: random.one_in(2), gray: random.one_in(2) };
        let (steps, wild) = (1 << bits, case % 4 == 3);
        let (mut twin, mut ramp) = (Cds::new(), RampCounter::new());
        let clocks = if case < 2 { 160_000 } else { 560 };
        let (mut down, mut crossing, mut ramp_out) = (false, 0, RampCounterOut::default());
        for clock in 0..clocks {
            let rst = clock == 0 || random.one_in(3 * clocks);
            let stall = random.one_in(6);
            let idle = !ramp_out.running && !ramp_out.step && !ramp_out.done;
            let start = idle && random.one_in(3);
            if start && !stall {
                down = random.one_in(2);
                crossing = random.crossing(steps);
                first += u32::from(crossing == 1);
                last += u32::from(crossing == steps);
                never += u32::from(crossing > steps);
            }
            let pins = column_pins(&mut random, wild, &ramp_out, crossing);
            let clear = if wild { pins.clear } else { idle && random.one_in(3) };
            let (arm, down) = if wild { (pins.arm, pins.down) } else { (start, down) };
            let pins = CdsIn { rst, stall, clear, arm, down, ..pins };
            judge.clock(&cds_in(&config, &pins), &cds_out(&twin.tick(&config, pins)));
            ramp_out = ramp.tick(RampCounterIn { rst, stall, start, gray: config.gray, steps });
        }
    }
    println!("crossings: {first} at the first step, {last} at the last, {never} never");
    assert!(first > 200 && last > 200 && never > 200);
    judge.finish(SEED);
}

/// Any numbers at all, for what a config would refuse.
fn wild_seq(random: &mut Random) -> SeqConfig {
    SeqConfig {
        global_shutter: random.one_in(2),
        hts: random.within(1, 40),
        vts: random.within(1, 6),
        rows: random.below(8),
        first_row: random.below(1 << 16),
        row_step: random.below(1 << 16),
        n_settle_reset: random.below(4),
        n_ramp_reset: random.below(4),
        n_settle_signal: random.below(4),
        n_ramp_signal: random.below(20),
        exposure_lines: random.below(7),
    }
}

#[test]
fn the_sequencer_equals_its_twin_on_every_clock() {
    const SEED: u64 = 33;
    let mut random = Random::new(SEED);
    let config = core_config(&mut random, 3, 16, 2).seq;
    let mut judge = Judge::new("readout_seq", &[], &seq_in(&config, &SeqIn::default()), &seq_out(&SeqOut::default()));
    let (mut wraps, mut shutters, mut globals) = (0, 0, 0);
    for case in 0..700_u32 {
        let bits = if case < 4 { 14 } else { random.within(1, 7) };
        let config = if case % 4 == 3 { wild_seq(&mut random) } else { core_config(&mut random, bits, 16, 2).seq };
        let mut twin = ReadoutSeq::new(config);
        let clocks = if case < 4 { 60_000 } else { 1300 };
        let mut before = SeqOut::default();
        for clock in 0..clocks {
            let rst = clock == 0 || random.one_in(2 * clocks);
            let pins = SeqIn { rst, stall: random.one_in(6), enable: !random.one_in(60) };
            let out = twin.tick(pins);
            judge.clock(&seq_in(&config, &pins), &seq_out(&out));
            wraps += u32::from(out.line < before.line);
            shutters += u32::from(out.shutter_reset && !before.shutter_reset);
            globals += u32::from(out.global_transfer && !before.global_transfer);
            before = out;
        }
    }
    println!("{wraps} frame ends, {shutters} shutter resets, {globals} global transfers");
    assert!(wraps > 1000 && shutters > 1000 && globals > 500);
    judge.finish(SEED);
}

fn le_bytes(codes: &[u16], width: usize) -> Vec<u8> {
    let mut bytes: Vec<u8> = codes.iter().flat_map(|code| code.to_le_bytes()).collect();
    bytes.resize(width, 0);
    bytes
}

#[test]
fn the_shifter_equals_its_twin_on_every_clock() {
    const SEED: u64 = 34;
    const COLUMNS: usize = 48;
    let mut random = Random::new(SEED);
    let config = LaneConfig { bits: 1, lanes: 1, columns: 1 };
    let (no_codes, no_pins) = ([0; 2 * COLUMNS], LaneIn::default());
    let inputs = lane_in(&config, &no_pins, &no_codes);
    let mut judge = Judge::new("lane_shift", &["-GCOLUMNS=48"], &inputs, &lane_out(&LaneOut::default()));
    let (mut rows, mut overruns) = (0, 0);
    for case in 0..1600_u32 {
        let (bits, lanes) = (1 + case % 16, 1 + case / 16 % 16);
        let config = LaneConfig { bits, lanes, columns: lanes * random.within(1, 48 / lanes) };
        let mut held = vec![0; usize::try_from(config.columns).unwrap()];
        let mut twin = LaneShift::new(config, &mut held);
        let overdue = random.one_in(4);
        let mut before = LaneOut::default();
        for clock in 0..660 {
            let rst = clock == 0 || random.one_in(1500);
            // Rows come when the shifter is free, in the clock of the last bit, or (overdue) at any time.
            let soon = !before.busy || overdue || twin.out().valid && random.one_in(40);
            let pins = LaneIn { rst, stall: random.one_in(6), latch: soon && random.one_in(4) };
            let codes: Vec<u16> = (0..config.columns).map(|_| u16::try_from(random.below(1 << 16)).unwrap()).collect();
            let out = twin.tick(pins, &codes);
            judge.clock(&lane_in(&config, &pins, &le_bytes(&codes, 2 * COLUMNS)), &lane_out(&out));
            rows += u32::from(out.row_start);
            overruns += u32::from(out.overrun && !before.overrun);
            before = out;
        }
    }
    println!("{rows} rows, {overruns} cases with overrun");
    assert!(rows > 1000 && overruns > 100);
    judge.finish(SEED);
}

const CORE_COLUMNS: usize = 32;

struct CoreCase<'a> {
    config: CoreConfig,
    clocks: u32,
    random: &'a mut Random,
    judge: &'a mut Judge,
}

/// Plays one config; returns the rows that began to shift out.
fn play_core(case: CoreCase<'_>) -> u32 {
    let CoreCase { config, clocks, random, judge } = case;
    let columns = usize::try_from(config.columns).unwrap();
    let (mut counters, mut codes, mut held) = (vec![Cds::new(); columns], vec![0; columns], vec![0; columns]);
    let mut twin = SensorCore::new(config, &mut counters, &mut codes, &mut held);
    let (mut crossings, mut words, mut rows) = (vec![0; columns], [0], 0);
    // Columns beyond the config's stand in the hardware too; a second twin without lanes of its own follows them.
    let (mut spare, nothing) = (vec![Cds::new(); CORE_COLUMNS - columns], CdsIn::default());
    for clock in 0..clocks {
        let before = twin.out();
        if before.seq.ramp_start {
            let steps = if before.seq.ramp_down { config.seq.n_ramp_reset } else { config.seq.n_ramp_signal };
            crossings.iter_mut().for_each(|crossing| *crossing = random.crossing(steps));
        }
        comparators(&before.ramp, &crossings, &mut words);
        let rst = clock == 0 || random.one_in(2 * clocks);
        let pins = CoreIn { rst, stall: random.one_in(6), enable: !random.one_in(40) };
        let out = twin.tick(pins, &words);
        let shared = CdsIn {
            rst,
            stall: pins.stall,
            clear: before.seq.clear,
            arm: before.seq.ramp_start,
            step: before.ramp.step,
            done: before.ramp.done,
            down: before.seq.ramp_down,
            count: before.ramp.count,
            ..nothing
        };
        spare.iter_mut().for_each(|column| _ = column.tick(&config.cds, shared));
        let all = twin.columns().iter().chain(&spare).map(|column| column.out(&config.cds));
        let (mut codes, mut crossed) = (Vec::with_capacity(2 * CORE_COLUMNS), 0_u64);
        for (index, column) in all.enumerate() {
            codes.extend(column.code.to_le_bytes());
            crossed |= u64::from(column.crossed) << index;
        }
        judge.clock(&core_in(&config, &pins, words[0]), &core_out(&out, crossed, &codes));
        rows += u32::from(out.lane.row_start && !before.lane.row_start);
    }
    rows
}

#[test]
fn the_whole_core_equals_its_twin_on_every_clock() {
    const SEED: u64 = 35;
    let mut random = Random::new(SEED);
    let columns_max = u32::try_from(CORE_COLUMNS).unwrap();
    let config = core_config(&mut random, 3, columns_max, 6);
    let (inputs, no_codes) = (core_in(&config, &CoreIn::default(), 0), [0; 2 * CORE_COLUMNS]);
    let outputs = core_out(&CoreOut::default(), 0, &no_codes);
    let mut judge = Judge::new("sensor_core", &["-GCOLUMNS=32"], &inputs, &outputs);
    let mut rows = 0;
    for case in 0..330_u32 {
        let bits = if case < 2 { 16 } else { 1 + case % 9 };
        let mut config = core_config(&mut random, bits, columns_max, 6);
        let mut clocks = 2600;
        if case < 2 {
            // One whole frame of few lines, so that both ramps of sixteen bits run.
            config.seq = SeqConfig { rows: 1, vts: 2, exposure_lines: 1, ..config.seq };
            clocks = 2 * config.seq.hts + 10_000;
        }
        rows += play_core(CoreCase { config, clocks, random: &mut random, judge: &mut judge });
    }
    println!("{rows} rows shifted out");
    assert!(rows > 1000);
    judge.finish(SEED);
}
