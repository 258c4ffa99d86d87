//! Each block's `tick` against the form that skips clocks, over random parameters and pauses.

use crate::cases::Random;
use rtl_models::cds::{Cds, CdsConfig, CdsIn, ColumnRow, RowCrossings};
use rtl_models::lane_planes::{LanePlanes, plane_bit, write_row};
use rtl_models::lane_shift::{LaneConfig, LaneIn, LaneShift};
use rtl_models::ramp_counter::{RampCounter, RampCounterIn, binary_from_gray, gray_from_binary};
use rtl_models::readout_seq::{ReadoutSeq, SeqIn};
use rtl_models::steps_below;

#[test]
fn gray_codes_differ_in_one_bit_and_decode() {
    for count in 0..1 << 17 {
        assert_eq!(binary_from_gray(gray_from_binary(count)), count);
        assert_eq!((gray_from_binary(count) ^ gray_from_binary(count + 1)).count_ones(), 1);
    }
}

#[test]
fn the_ramp_counter_advances_as_it_ticks() {
    let mut random = Random::new(11);
    let mut clocks = 0;
    for case in 0..400 {
        let bits = random.within(1, 12);
        let (gray, steps) = (random.one_in(2), random.below(1 << bits));
        let (mut ticked, mut advanced) = (RampCounter::new(), RampCounter::new());
        for _ in 0..12 {
            let start = RampCounterIn { start: random.one_in(2), gray, steps, ..RampCounterIn::default() };
            assert_eq!(ticked.tick(start), advanced.tick(start));
            let pause = random.below(steps + 4);
            for _ in 0..pause {
                ticked.tick(RampCounterIn { gray, steps, ..RampCounterIn::default() });
            }
            advanced.advance(pause.into(), gray, steps);
            assert_eq!(ticked, advanced, "case {case}: {steps} steps, {pause} clocks");
            clocks += pause;
        }
    }
    println!("{clocks} clocks");
    assert!(clocks > 100_000);
}

/// A column under a real ramp counter, clock by clock: arm, all steps, done.
fn tick_ramp(column: &mut Cds, config: &CdsConfig, down: bool, steps: u32, crossing: u32) {
    let mut ramp = RampCounter::new();
    let gray = config.gray;
    let mut out = ramp.tick(RampCounterIn { start: true, gray, steps, ..RampCounterIn::default() });
    column.tick(config, CdsIn { arm: true, down, ..CdsIn::default() });
    while out.running || out.step || out.done {
        let comparator = out.ramp_code >= crossing;
        column.tick(
            config,
            CdsIn { step: out.step, done: out.done, down, comparator, count: out.count, ..CdsIn::default() },
        );
        out = ramp.tick(RampCounterIn { gray, steps, ..RampCounterIn::default() });
    }
}

#[test]
fn both_ways_of_double_sampling_give_the_formula_and_count_the_bits_they_flip() {
    const COLUMNS: usize = 12;
    let mut random = Random::new(12);
    let (mut below_zero, mut above) = (0, 0);
    for case in 0..480_u32 {
        let bits = if case < 16 { case + 1 } else { random.within(1, 11) };
        let black = u16::try_from(random.below(1 << bits)).unwrap();
        let counting = CdsConfig { bits, black, latch_mode: false, gray: random.one_in(2) };
        let (reset_steps, signal_steps) = (random.below(1 << bits), 1 << bits);
        for config in [counting, CdsConfig { latch_mode: true, ..counting }] {
            let (mut values, mut latched, mut codes) = ([0; COLUMNS], [0; COLUMNS], [0; COLUMNS]);
            let mut row = ColumnRow::new(config, &mut values, &mut latched);
            let (mut ticked, mut skipped) = ([Cds::new(); COLUMNS], [Cds::new(); COLUMNS]);
            let mut toggles = 0;
            for _ in 0..2 {
                let reset: [u32; COLUMNS] = std::array::from_fn(|_| random.crossing(reset_steps));
                let signal: [u32; COLUMNS] = std::array::from_fn(|_| random.crossing(signal_steps));
                toggles += row
                    .convert(&RowCrossings { reset_steps, reset: &reset, signal_steps, signal: &signal }, &mut codes);
                for column in 0..COLUMNS {
                    let (ticked, skipped) = (&mut ticked[column], &mut skipped[column]);
                    ticked.tick(&config, CdsIn { clear: true, ..CdsIn::default() });
                    skipped.clear(&config);
                    let mut expected = i64::from(black);
                    for (down, steps, crossing) in
                        [(true, reset_steps, reset[column]), (false, signal_steps, signal[column])]
                    {
                        if steps == 0 {
                            continue;
                        }
                        tick_ramp(ticked, &config, down, steps, crossing);
                        skipped.run_ramp(&config, down, steps, crossing);
                        expected += i64::from(steps_below(crossing, steps)) * if down { -1 } else { 1 };
                    }
                    assert_eq!(ticked, skipped, "case {case}, column {column}: {config:?}");
                    let clipped = expected.clamp(0, (1 << bits) - 1);
                    below_zero += u32::from(expected < 0);
                    above += u32::from(expected > clipped);
                    assert_eq!(i64::from(ticked.out(&config).code), clipped, "case {case}");
                    assert_eq!(codes[column], ticked.out(&config).code, "case {case}");
                }
            }
            assert_eq!(toggles, ticked.iter().map(Cds::toggles).sum::<u64>(), "case {case}: {config:?}");
        }
    }
    println!("{below_zero} differences below zero, {above} above the greatest code");
    assert!(below_zero > 100 && above > 100);
}

#[test]
fn the_sequencer_advances_as_it_ticks() {
    let mut random = Random::new(13);
    let (mut quiet, mut clocks) = (0, 0);
    for case in 0..300 {
        let bits = random.within(1, 8);
        let config = crate::cases::core_config(&mut random, bits, 16, 3).seq;
        let (mut ticked, mut advanced) = (ReadoutSeq::new(config), ReadoutSeq::new(config));
        for _ in 0..40 {
            let (pause, enable) = (random.below(3 * config.hts), !random.one_in(5));
            for _ in 0..pause {
                let promised = ticked.quiet_clocks(enable);
                let before = ticked.out();
                let after = ticked.tick(SeqIn { enable, ..SeqIn::default() });
                assert!(promised == 0 || before == after, "case {case}: a pin moved in a quiet clock, {config:?}");
                quiet += u32::from(promised > 0);
            }
            assert_eq!(advanced.advance(pause.into(), enable), ticked.out(), "case {case}: {config:?}");
            clocks += pause;
        }
        assert_eq!(format!("{ticked:?}"), format!("{advanced:?}"), "case {case}");
    }
    println!("{clocks} clocks, {quiet} of them quiet");
    assert!(clocks > 500_000 && quiet > clocks / 2);
}

#[test]
fn exposure_is_exactly_the_lines_that_were_asked_for_and_rows_wrap() {
    let mut random = Random::new(14);
    let mut rows_seen = 0;
    for case in 0..200 {
        let config = crate::cases::core_config(&mut random, 3, 16, 3).seq;
        let mut seq = ReadoutSeq::new(config);
        let mut reset_at = std::collections::BTreeMap::new();
        let expected = u64::from(config.exposure_lines * config.hts);
        for clock in 0..u64::from(4 * config.vts * config.hts) {
            let pins = seq.tick(SeqIn { enable: true, ..SeqIn::default() });
            // The pointer may reset the row that is transferred only after a whole frame, which exposure stays below.
            let ends = if config.global_shutter { pins.global_transfer } else { pins.transfer };
            if ends {
                let row = if config.global_shutter { 0 } else { pins.row };
                assert_eq!(clock - reset_at[&row], expected, "case {case}, row {row}: {config:?}");
                rows_seen += 1;
            }
            if pins.transfer {
                assert_eq!(pins.row, config.first_row + pins.line * config.row_step, "case {case}");
            }
            if pins.shutter_reset {
                reset_at.insert(if config.global_shutter { 0 } else { pins.shutter_row }, clock);
            }
        }
    }
    println!("{rows_seen} exposures");
    assert!(rows_seen > 1000);
}

#[test]
fn a_row_written_at_once_equals_the_shifters_ticks() {
    let mut random = Random::new(15);
    let mut compared = 0;
    for case in 0..400 {
        let (bits, lanes) = (1 + case % 16, random.within(1, 16));
        let config = LaneConfig { bits, lanes, columns: lanes * random.within(1, 20) };
        let columns = usize::try_from(config.columns).unwrap();
        let mut held = vec![0; columns];
        let mut shifter = LaneShift::new(config, &mut held);
        let words = 40;
        let mut lane_words = vec![0; words * usize::try_from(lanes).unwrap()];
        let [mut busy, mut valid, mut word_start, mut row_start] = [(); 4].map(|()| vec![0; words]);
        let mut planes = LanePlanes {
            lanes: &mut lane_words,
            busy: &mut busy,
            valid: &mut valid,
            word_start: &mut word_start,
            row_start: &mut row_start,
        };
        let clocks = 64 * u64::try_from(words).unwrap();
        let (mut latch_at, mut free_at) = (u64::from(random.below(70)), 0);
        let mask = u16::MAX >> (16 - bits);
        let (mut outs, mut toggles) = (Vec::new(), 0);
        for clock in 0..clocks {
            let latch = clock == latch_at;
            let codes: Vec<u16> = (0..columns).map(|_| u16::try_from(random.below(1 << 16)).unwrap() & mask).collect();
            if latch && clock >= free_at {
                // The edge of clock t takes the codes, so the bits stand from clock t + 1 on.
                toggles += write_row(&config, &codes, clock + 1, &mut planes);
                free_at = clock + u64::from(config.hts_min());
            }
            if latch {
                latch_at = free_at + u64::from(if random.one_in(2) { 0 } else { random.below(50) });
                latch_at -= u64::from(random.one_in(3) && latch_at > clock + 3) * 2;
                latch_at = latch_at.max(clock + 1);
            }
            outs.push(shifter.tick(LaneIn { latch, ..LaneIn::default() }, &codes));
        }
        let mut before = 0;
        let mut flipped = 0;
        for (clock, out) in (0..).zip(&outs) {
            let lane = (0..usize::try_from(lanes).unwrap())
                .fold(0, |pins, l| pins | u16::from(plane_bit(&planes.lanes[words * l..words * (l + 1)], clock)) << l);
            let pins =
                [&*planes.busy, planes.valid, planes.word_start, planes.row_start].map(|plane| plane_bit(plane, clock));
            assert_eq!(lane, out.lane, "case {case}, clock {clock}: {config:?}");
            assert_eq!(
                pins,
                [out.busy, out.valid, out.word_start, out.row_start],
                "case {case}, clock {clock}: {config:?}"
            );
            flipped += u64::from((before ^ lane).count_ones());
            before = lane;
            compared += 1;
        }
        // A row that still shifts at the end is counted whole by the writer.
        assert!(flipped <= toggles && (outs.last().unwrap().busy || flipped == toggles), "case {case}");
    }
    println!("{compared} clocks");
}
