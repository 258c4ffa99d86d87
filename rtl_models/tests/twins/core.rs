//! The whole core: clock by clock with stalls against the form that runs from event to event.

use crate::cases::{Random, comparators, core_config};
use rtl_models::NEVER;
use rtl_models::cds::Cds;
use rtl_models::event_core::{CHANGES_PER_LINE, Change, Counts, EventCore, FrameCrossings, LatchedRow, Trace};
use rtl_models::lane_planes::{LanePlanes, plane_bit};
use rtl_models::readout_seq::SeqIn;
use rtl_models::sensor_core::{CoreConfig, CoreIn, CoreOut, SensorCore};

/// What a run by ticks shows at its pins, stalled clocks left out.
struct Ticked {
    outs: Vec<CoreOut>,
    latched: Vec<(u64, Vec<u16>)>,
    column_toggles: u64,
    ramp_toggles: u64,
    count_toggles: u64,
}

fn ticked(config: CoreConfig, clocks: u64, enabled: u64, reset: &[u32], signal: &[u32], random: &mut Random) -> Ticked {
    let columns = usize::try_from(config.columns).unwrap();
    let (mut counters, mut codes, mut held) = (vec![Cds::new(); columns], vec![0; columns], vec![0; columns]);
    let mut core = SensorCore::new(config, &mut counters, &mut codes, &mut held);
    let mut bits = vec![0; columns.div_ceil(64)];
    let (mut outs, mut latched) = (Vec::new(), Vec::new());
    while u64::try_from(outs.len()).unwrap() < clocks {
        let clock = u64::try_from(outs.len()).unwrap();
        let before = core.out();
        let line = usize::try_from(before.seq.line).unwrap();
        let crossings = if before.seq.ramp_down { reset } else { signal };
        let row = if before.ramp.step { &crossings[line * columns..(line + 1) * columns] } else { &[] };
        comparators(&before.ramp, row, &mut bits);
        let stall = random.one_in(9);
        let out = core.tick(CoreIn { stall, enable: clock < enabled, ..SeqIn::default() }, &bits);
        if stall {
            assert_eq!(out, before, "a stall holds every pin");
            continue;
        }
        if out.seq.latch {
            latched.push((clock, core.codes().to_vec()));
        }
        outs.push(out);
    }
    let (ramp_toggles, count_toggles) = (core.ramp().ramp_toggles(), core.ramp().count_toggles());
    Ticked { outs, latched, column_toggles: core.column_toggles(), ramp_toggles, count_toggles }
}

/// Every pin of every clock; returns the bits that flipped on the lanes.
fn compare_pins(config: &CoreConfig, ticked: &Ticked, trace: &Trace<'_>, counts: &Counts) -> u64 {
    let lanes = usize::try_from(config.lanes).unwrap();
    let words = trace.planes.valid.len();
    let mut change = 0;
    let (mut lane_pins, mut lane_toggles, mut overrun) = (0, 0, false);
    for (clock, out) in (0..).zip(&ticked.outs) {
        while change < counts.changes && trace.changes[change].clock <= clock {
            change += 1;
        }
        let pins = if change == 0 { Default::default() } else { trace.changes[change - 1].pins };
        assert_eq!(pins, out.seq, "clock {clock}: {config:?}");
        let planes = &trace.planes;
        let lane =
            (0..lanes).fold(0, |pins, l| pins | u16::from(plane_bit(&planes.lanes[words * l..][..words], clock)) << l);
        let strobes =
            [&*planes.busy, planes.valid, planes.word_start, planes.row_start].map(|plane| plane_bit(plane, clock));
        assert_eq!(lane, out.lane.lane, "clock {clock}: {config:?}");
        let lane_out = &out.lane;
        assert_eq!(
            strobes,
            [lane_out.busy, lane_out.valid, lane_out.word_start, lane_out.row_start],
            "clock {clock}: {config:?}"
        );
        overrun |= trace.rows[..counts.rows].iter().any(|row| row.lost && row.clock + 1 == clock);
        assert_eq!(overrun, out.lane.overrun, "clock {clock}: {config:?}");
        lane_toggles += u64::from((lane ^ lane_pins).count_ones());
        lane_pins = lane;
    }
    lane_toggles
}

/// Runs both forms and compares all; returns the clocks compared, and the rows lost.
fn check(config: CoreConfig, random: &mut Random) -> (u64, u32) {
    let seq = config.seq;
    let cells = usize::try_from(config.columns * seq.vts).unwrap();
    let reset: Vec<u32> = (0..cells).map(|_| random.crossing(seq.n_ramp_reset)).collect();
    let signal: Vec<u32> = (0..cells).map(|_| random.crossing(seq.n_ramp_signal)).collect();
    // Two frames, then a rest in which the last row goes out.
    let (frame, rest) = (u64::from(seq.hts * seq.vts), u64::from(config.lane().hts_min() + 8));
    let enabled = frame + u64::from(seq.hts * seq.exposure_lines) + 5;
    let clocks = enabled + frame + rest;
    let ticked = ticked(config, clocks, enabled, &reset, &signal, random);

    let columns = usize::try_from(config.columns).unwrap();
    let words = usize::try_from(clocks.div_ceil(64)).unwrap();
    let lanes = usize::try_from(config.lanes).unwrap();
    let lines = usize::try_from(clocks.div_ceil(seq.hts.into())).unwrap() + 1;
    let (mut values, mut latches, mut codes) = (vec![0; columns], vec![0; columns], vec![0; columns]);
    let mut core = EventCore::new(config, &mut values, &mut latches, &mut codes);
    let mut lane_words = vec![0; words * lanes];
    let [mut busy, mut valid, mut word_start, mut row_start] = [(); 4].map(|()| vec![0; words]);
    let (mut changes, mut rows) =
        (vec![Change::default(); lines * CHANGES_PER_LINE], vec![LatchedRow::default(); lines]);
    let mut row_codes = vec![0; lines * columns];
    let planes = LanePlanes {
        lanes: &mut lane_words,
        busy: &mut busy,
        valid: &mut valid,
        word_start: &mut word_start,
        row_start: &mut row_start,
    };
    let mut trace = Trace { changes: &mut changes, rows: &mut rows, codes: &mut row_codes, planes };
    let all = FrameCrossings { first_line: 0, reset: &reset, signal: &signal };
    while core.clock() < clocks {
        // Pauses fall anywhere; `enable` is constant between them.
        let enable = core.clock() < enabled;
        let most = if enable { enabled - core.clock() } else { clocks - core.clock() };
        core.run(most.min(1 + random.next() % (2 * u64::from(seq.hts))), enable, &all, &mut trace);
    }
    let counts = core.counts();
    let lane_toggles = compare_pins(&config, &ticked, &trace, &counts);
    assert_eq!(counts.rows, ticked.latched.len(), "{config:?}");
    for (index, (clock, codes)) in ticked.latched.iter().enumerate() {
        assert_eq!(trace.rows[index].clock, *clock, "{config:?}");
        assert_eq!(&trace.codes[index * columns..(index + 1) * columns], codes, "{config:?}");
    }
    let flipped = [counts.column_toggles, counts.ramp_toggles, counts.count_toggles, counts.lane_toggles];
    assert_eq!(flipped, [ticked.column_toggles, ticked.ramp_toggles, ticked.count_toggles, lane_toggles], "{config:?}");
    let lost = trace.rows[..counts.rows].iter().filter(|row| row.lost).count();
    (clocks, u32::try_from(lost).unwrap())
}

#[test]
fn events_equal_ticks_over_random_configs_with_stalls_and_pauses() {
    let mut random = Random::new(21);
    let (mut clocks, mut lost) = (0, 0);
    for case in 0..400 {
        let config = core_config(&mut random, 1 + case % 9, 70, 6);
        let (compared, rows_lost) = check(config, &mut random);
        clocks += compared;
        lost += rows_lost;
    }
    println!("seed 21: {clocks} clocks, {lost} rows lost to overrun");
    assert!(clocks > 500_000 && lost > 10);
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

#[test]
fn a_line_after_a_line_gives_the_same_as_a_frame() {
    let mut random = Random::new(23);
    let mut config = core_config(&mut random, 6, 16, 100);
    config.seq = rtl_models::readout_seq::SeqConfig { rows: 5, vts: 8, exposure_lines: 2, ..config.seq };
    let columns = usize::try_from(config.columns).unwrap();
    let signal: Vec<u32> = (0..5 * columns).map(|_| random.crossing(config.seq.n_ramp_signal)).collect();
    let reset = vec![NEVER; 5 * columns];
    let run = |by_line: bool| {
        let (mut values, mut latches, mut codes) = (vec![0; columns], vec![0; columns], vec![0; columns]);
        let mut core = EventCore::new(config, &mut values, &mut latches, &mut codes);
        let (mut changes, mut rows, mut row_codes) =
            ([Change::default(); 400], [LatchedRow::default(); 6], vec![0; 6 * columns]);
        let planes =
            LanePlanes { lanes: &mut [], busy: &mut [], valid: &mut [], word_start: &mut [], row_start: &mut [] };
        let mut trace = Trace { changes: &mut changes, rows: &mut rows, codes: &mut row_codes, planes };
        let hts = u64::from(config.seq.hts);
        for line in 0..9 {
            // After enable come exposure_lines lines without rows.
            let first = if by_line && (2..7).contains(&line) { line - 2 } else { 0 };
            let part = usize::try_from(first).unwrap() * columns;
            let end = if by_line && (2..7).contains(&line) { part + columns } else { 5 * columns };
            let rows = FrameCrossings { first_line: first, reset: &reset[part..end], signal: &signal[part..end] };
            core.run(hts, true, &rows, &mut trace);
        }
        let counts = core.counts();
        assert_eq!(counts.rows, 5);
        (changes, row_codes, counts)
    };
    assert_eq!(run(true), run(false));
}
