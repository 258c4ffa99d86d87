//! Vectors made by hand, committed beside the blocks.

use rtl_models::NEVER;
use rtl_models::cds::{Cds, CdsConfig};
use rtl_models::readout_seq::SeqConfig;
use rtl_models::sensor_core::{CoreConfig, CoreIn, CoreOut, SensorCore};

fn lines(text: &str) -> impl Iterator<Item = Vec<&str>> {
    text.lines().filter(|line| !line.starts_with('#')).map(|line| line.split_whitespace().collect())
}

fn one_row() -> CoreConfig {
    let seq = SeqConfig {
        global_shutter: false,
        hts: 14,
        vts: 3,
        rows: 1,
        first_row: 5,
        row_step: 1,
        n_settle_reset: 2,
        n_ramp_reset: 2,
        n_settle_signal: 2,
        n_ramp_signal: 8,
        exposure_lines: 1,
    };
    let cds = CdsConfig { bits: 3, black: 1, latch_mode: false, gray: false };
    CoreConfig { seq, cds, lanes: 2, columns: 4 }
}

fn strobes(out: &CoreOut) -> String {
    let (seq, ramp, lane) = (&out.seq, &out.ramp, &out.lane);
    let pins = [
        (seq.frame_valid, 'V'),
        (seq.clear, 'C'),
        (seq.fd_reset, 'F'),
        (seq.sample_reset, 'R'),
        (seq.transfer, 'T'),
        (seq.sample_signal, 'S'),
        (seq.ramp_start, 'A'),
        (seq.ramp_down, 'D'),
        (seq.latch, 'L'),
        (seq.shutter_reset, 'X'),
        (ramp.running, 'r'),
        (ramp.step, 'p'),
        (ramp.done, 'd'),
        (lane.busy, 'b'),
        (lane.valid, 'v'),
        (lane.word_start, 'w'),
        (lane.row_start, 'o'),
    ];
    let high: String = pins.into_iter().filter(|(pin, _)| *pin).map(|(_, name)| name).collect();
    if high.is_empty() { "-".into() } else { high }
}

#[test]
fn one_row_of_four_columns_on_two_lanes_is_as_worked_out_by_hand() {
    for (latch_mode, gray) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut config = one_row();
        (config.cds.latch_mode, config.cds.gray) = (latch_mode, gray);
        let (mut counters, mut codes, mut held) = ([Cds::new(); 4], [0; 4], [0; 4]);
        let mut core = SensorCore::new(config, &mut counters, &mut codes, &mut held);
        let mut clocks = 0;
        for fields in lines(include_str!("../../vectors/one_row.txt")) {
            let comparators = u64::from_str_radix(fields[3], 2).unwrap();
            let pins = CoreIn { rst: fields[1] == "1", stall: false, enable: fields[2] == "1" };
            let out = core.tick(pins, &[comparators]);
            let seq = &out.seq;
            let codes: String = core.codes().iter().map(ToString::to_string).collect();
            let mut shown = vec![
                (seq.state as u8).to_string(),
                seq.line.to_string(),
                seq.row.to_string(),
                seq.shutter_row.to_string(),
                strobes(&out),
                out.ramp.ramp_code.to_string(),
            ];
            let lanes = format!("{:02b}", out.lane.lane);
            if latch_mode || gray {
                // Codes move at other clocks when they are latched, and the count is encoded; what goes out is the same.
                assert_eq!(
                    (shown, lanes.as_str()),
                    (fields[4..10].iter().map(|&f| f.into()).collect(), fields[12]),
                    "{fields:?}"
                );
            } else {
                shown.extend([out.ramp.count.to_string(), codes, lanes]);
                assert_eq!(shown, fields[4..], "{fields:?}");
            }
            clocks += 1;
        }
        assert_eq!((clocks, core.codes()), (59, &[4, 0, 7, 5][..]));
    }
}

#[test]
fn single_columns_are_as_worked_out_by_hand() {
    let mut tried = 0;
    for fields in lines(include_str!("../../vectors/cds.txt")) {
        let number = |index: usize| if fields[index] == "-" { NEVER } else { fields[index].parse::<u32>().unwrap() };
        let black = u16::try_from(number(1)).unwrap();
        for latch_mode in [false, true] {
            let config = CdsConfig { bits: number(0), black, latch_mode, gray: true };
            let mut column = Cds::new();
            column.clear(&config);
            if number(2) > 0 {
                column.run_ramp(&config, true, number(2), number(3));
            }
            column.run_ramp(&config, false, number(4), number(5));
            assert_eq!(u32::from(column.out(&config).code), number(6), "{fields:?}");
            assert!(latch_mode || column.toggles() == u64::from(number(7)), "{} bits: {fields:?}", column.toggles());
            tried += 1;
        }
    }
    assert_eq!(tried, 24);
}
