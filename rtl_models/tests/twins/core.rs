//! The whole core clock by clock with stalls: what the lanes carry is the rows' codes by their formula.

use crate::cases::{Random, code_by_formula, comparators, core_config};
use rtl_models::cds::Cds;
use rtl_models::lane_shift::LaneOut;
use rtl_models::readout_seq::SeqIn;
use rtl_models::sensor_core::{CoreConfig, CoreIn, SensorCore};

/// Puts the rows on the lanes together again.
#[derive(Default)]
struct Deserialiser {
    rows: Vec<Vec<u16>>,
    words: Vec<u16>,
    bits: u32,
}

impl Deserialiser {
    fn clock(&mut self, config: &CoreConfig, out: &LaneOut) {
        if !out.valid {
            assert_eq!(out.lane, 0, "lanes are low between rows: {config:?}");
            return;
        }
        if out.row_start {
            self.rows.push(Vec::new());
        }
        if out.word_start {
            (self.words, self.bits) = (vec![0; usize::try_from(config.lanes).unwrap()], 0);
        }
        for (lane, word) in self.words.iter_mut().enumerate() {
            *word = *word << 1 | (out.lane >> lane & 1);
        }
        self.bits += 1;
        if self.bits == config.cds.bits {
            self.rows.last_mut().unwrap().append(&mut self.words);
        }
    }
}

/// Runs two frames and a rest in which the last row goes out. Returns clocks, rows on the lanes, and rows lost.
fn check(config: CoreConfig, random: &mut Random) -> (u64, usize, u32) {
    let seq = config.seq;
    let columns = usize::try_from(config.columns).unwrap();
    let cells = columns * usize::try_from(seq.vts).unwrap();
    let reset: Vec<u32> = (0..cells).map(|_| random.crossing(seq.n_ramp_reset)).collect();
    let signal: Vec<u32> = (0..cells).map(|_| random.crossing(seq.n_ramp_signal)).collect();
    let (frame, rest) = (u64::from(seq.hts * seq.vts), u64::from(config.lane().hts_min() + 8));
    let enabled = frame + u64::from(seq.hts * seq.exposure_lines) + 5;
    let clocks = enabled + frame + rest;

    let (mut counters, mut codes, mut held) = (vec![Cds::new(); columns], vec![0; columns], vec![0; columns]);
    let mut core = SensorCore::new(config, &mut counters, &mut codes, &mut held);
    let mut bits = vec![0; columns.div_ceil(64)];
    let (mut lanes, mut expected) = (Deserialiser::default(), Vec::new());
    let (mut clock, mut free_at, mut lost, mut row) = (0, 0, 0, 0..0);
    while clock < clocks {
        let before = core.out();
        if before.ramp.step {
            let line = usize::try_from(before.seq.line).unwrap();
            row = line * columns..(line + 1) * columns;
            comparators(&before.ramp, &if before.seq.ramp_down { &reset } else { &signal }[row.clone()], &mut bits);
        }
        let stall = random.one_in(9);
        let out = core.tick(CoreIn { stall, enable: clock < enabled, ..SeqIn::default() }, &bits);
        if stall {
            assert_eq!(out, before, "a stall holds every pin");
            continue;
        }
        lanes.clock(&config, &out.lane);
        assert_eq!(out.lane.overrun, lost > 0, "clock {clock}: {config:?}");
        if out.seq.latch {
            let by_formula = row.clone().map(|cell| code_by_formula(&config.cds, &seq, reset[cell], signal[cell]));
            let by_formula: Vec<u16> = by_formula.collect();
            assert_eq!(core.codes(), by_formula, "clock {clock}: {config:?}");
            if clock < free_at {
                lost += 1;
            } else {
                expected.push(by_formula);
                free_at = clock + u64::from(config.lane().hts_min());
            }
        }
        clock += 1;
    }
    assert_eq!(lanes.rows, expected, "{config:?}");
    (clocks, expected.len(), lost)
}

#[test]
fn the_lanes_carry_the_rows_codes_over_random_configs_with_stalls() {
    let mut random = Random::new(21);
    let (mut clocks, mut sent, mut lost) = (0, 0, 0);
    for case in 0..400 {
        let config = core_config(&mut random, 1 + case % 9, 70, 6);
        let (run, rows_sent, rows_lost) = check(config, &mut random);
        clocks += run;
        sent += rows_sent;
        lost += rows_lost;
    }
    println!("seed 21: {clocks} clocks, {sent} rows, {lost} lost to overrun");
    assert!(clocks > 500_000 && sent > 1_000 && lost > 10);
}

#[test]
fn sixteen_bits_and_one_bit() {
    let mut random = Random::new(22);
    for bits in [16, 1, 15, 1] {
        let mut config = core_config(&mut random, bits, 4, 100);
        config.seq.rows = config.seq.rows.min(2);
        check(config, &mut random);
    }
}
