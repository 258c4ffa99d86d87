//! Each block's `tick` against formulas, over random parameters.

use crate::cases::{Random, difference, tick_ramp};
use rtl_models::cds::{Cds, CdsConfig, CdsIn};
use rtl_models::ramp_counter::{binary_from_gray, gray_from_binary};
use rtl_models::readout_seq::{ReadoutSeq, SeqIn};

#[test]
fn gray_codes_differ_in_one_bit_and_decode() {
    for count in 0..1 << 17 {
        assert_eq!(binary_from_gray(gray_from_binary(count)), count);
        assert_eq!((gray_from_binary(count) ^ gray_from_binary(count + 1)).count_ones(), 1);
    }
}

#[test]
fn both_ways_of_double_sampling_give_the_formula() {
    let mut random = Random::new(12);
    let (mut below_zero, mut above) = (0, 0);
    for case in 0..480_u32 {
        let bits = if case < 16 { case + 1 } else { random.within(1, 11) };
        let black = u16::try_from(random.below(1 << bits)).unwrap();
        let counting = CdsConfig { bits, black, latch_mode: false, gray: random.one_in(2) };
        let (n_ramp_reset, n_ramp_signal) = (random.below(1 << bits), 1 << bits);
        for config in [counting, CdsConfig { latch_mode: true, ..counting }] {
            for _ in 0..12 {
                let mut column = Cds::new();
                for _ in 0..2 {
                    let (reset, signal) = (random.crossing(n_ramp_reset), random.crossing(n_ramp_signal));
                    column.tick(&config, CdsIn { clear: true, ..CdsIn::default() });
                    if n_ramp_reset > 0 {
                        tick_ramp(&mut column, &config, true, n_ramp_reset, reset);
                    }
                    tick_ramp(&mut column, &config, false, n_ramp_signal, signal);
                    let expected = difference(&config, n_ramp_reset, reset, n_ramp_signal, signal);
                    below_zero += u32::from(expected < 0);
                    above += u32::from(expected >= 1 << bits);
                    let clipped = expected.clamp(0, (1 << bits) - 1);
                    assert_eq!(i64::from(column.out(&config).code), clipped, "case {case}: {config:?}");
                }
            }
        }
    }
    println!("{below_zero} differences below zero, {above} above the greatest code");
    assert!(below_zero > 100 && above > 100);
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
