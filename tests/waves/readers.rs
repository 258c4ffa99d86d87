//! Readers of waveforms: files by wellen, and pins by what a receiver would make of them.

use std::io::Cursor;

use sensel::adc::{AdcParams, Cds};
use sensel::waves::{SignalKind, Value, Waves};

/// A value as viewers print it: bits, greatest first, or a number.
pub fn text(kind: SignalKind, value: Value) -> String {
    let width = match kind {
        SignalKind::Bits(bits) | SignalKind::Signed(bits) => bits,
        SignalKind::Real => 0,
    };
    match value {
        Value::Real(value) => format!("{value}"),
        Value::Unknown => (0..width).map(|_| 'x').collect(),
        Value::Bits(word) => (0..width).rev().map(|bit| if word >> bit & 1 == 1 { '1' } else { '0' }).collect(),
    }
}

/// Full names and changes of all signals of a file, in its order.
pub fn read(bytes: Vec<u8>) -> Vec<(String, Vec<(u64, String)>)> {
    let mut file = wellen::simple::read_from_reader(Cursor::new(bytes)).unwrap();
    assert_eq!(file.hierarchy().timescale().unwrap().unit.to_exponent(), Some(-12));
    let variables: Vec<_> = file
        .hierarchy()
        .all_vars()
        .map(|variable| {
            let hierarchy = file.hierarchy();
            (hierarchy[variable].full_name(hierarchy), hierarchy[variable].signal_ref())
        })
        .collect();
    file.load_signals(&variables.iter().map(|(_, signal)| *signal).collect::<Vec<_>>());
    let changes = |signal| {
        let signal = file.get_signal(signal).unwrap();
        signal.iter_changes().map(|(time, value)| (file.time_table()[time as usize], value.to_string())).collect()
    };
    variables.iter().map(|(name, signal)| (name.clone(), changes(*signal))).collect()
}

/// What a signal stands at from an instant on.
fn at(values: &[(u64, Value)], time_ps: u64) -> u64 {
    match values[values.partition_point(|(time, _)| *time <= time_ps) - 1].1 {
        Value::Bits(word) => word,
        other => panic!("{other:?} at {time_ps} ps"),
    }
}

fn of(waves: &Waves, scope: &str, name: &str) -> Vec<(u64, Value)> {
    waves.of(waves.find(scope, name).unwrap())
}

/// Packets on the link: bytes of all lanes at rising byte clocks while the transmitter is ready, split where the request ends. The
/// serial bits of each lane must say the same.
pub fn link_bytes(waves: &Waves, lanes: usize, byte_ps: u64) -> Vec<Vec<u8>> {
    let wires: Vec<_> = (0..lanes).map(|lane| of(waves, "link", &format!("lane_{lane}"))).collect();
    let data: Vec<_> = (0..lanes).map(|lane| of(waves, "link", &format!("tx_data_hs_{lane}"))).collect();
    let request = of(waves, "link", "tx_request_hs");
    let mut packets: Vec<Vec<u8>> = Vec::new();
    let mut before_ps = 0;
    for (time_ps, value) in of(waves, "link", "tx_byte_clk_hs") {
        if value != Value::Bits(1) {
            continue;
        }
        let ended = request.iter().any(|(time, value)| (before_ps..time_ps).contains(time) && *value == Value::Bits(1));
        if ended || packets.is_empty() {
            packets.push(Vec::new());
        }
        before_ps = time_ps;
        let bytes: Vec<u8> = data.iter().map(|lane| u8::try_from(at(lane, time_ps)).unwrap()).collect();
        for (wire, &byte) in wires.iter().zip(&bytes) {
            // A byte clock is eight unit intervals long; each bit is looked at in the middle of its own.
            let bit = |number: u64| at(wire, time_ps + byte_ps * (2 * number + 1) / 16) << number;
            assert_eq!((0..8).map(bit).sum::<u64>(), u64::from(byte), "the wire at {time_ps} ps");
        }
        packets.last_mut().unwrap().extend(bytes);
    }
    packets
}

/// Codes of the rows on the serial lanes: bits at falling lane clocks, most significant first, words in turn over the lanes.
pub fn lane_codes(waves: &Waves, lanes: usize, bits: u32) -> Vec<Vec<u16>> {
    let pins: Vec<_> = (0..lanes).map(|lane| of(waves, "lanes", &format!("lane_{lane}"))).collect();
    let (row_start, word_start) = (of(waves, "lanes", "row_start"), of(waves, "lanes", "word_start"));
    let mut rows: Vec<Vec<u16>> = Vec::new();
    let clock = of(waves, "lanes", "lane_clk");
    for pair in clock.windows(2) {
        let (rise_ps, fall_ps) = (pair[0].0, pair[1].0);
        if pair[0].1 != Value::Bits(1) {
            continue;
        }
        if at(&row_start, rise_ps) == 1 {
            rows.push(Vec::new());
        }
        let row = rows.last_mut().expect("a row starts first");
        if at(&word_start, rise_ps) == 1 {
            row.resize(row.len() + lanes, 0);
        }
        let words = row.len() - lanes;
        for (lane, pin) in pins.iter().enumerate() {
            row[words + lane] = row[words + lane] << 1 | u16::try_from(at(pin, fall_ps)).unwrap();
        }
    }
    assert!(rows.iter().flatten().all(|&code| u32::from(code) < 1 << bits), "a word has more than its bits");
    rows
}

/// Checks that an up/down counter moves by one a clock, down in the reset ramp and up in the signal's; gives back the steps.
pub fn counter_steps(waves: &Waves, scope: &str, adc: &AdcParams) -> usize {
    let values = of(waves, scope, "counter");
    let (down, clear) = (of(waves, "ramp", "ramp_down"), of(waves, "sequencer", "clear"));
    let counts_itself = adc.counting == sensel::adc::Counting::UpDown;
    let mut steps = 0;
    for pair in values.windows(2) {
        let [(before_ps, before), (time_ps, after)] = [pair[0], pair[1]];
        let (Value::Bits(before), Value::Bits(after)) = (before, after) else { continue };
        let cleared = at(&clear, before_ps) == 1
            || clear.iter().any(|(time, value)| (before_ps..time_ps).contains(time) && *value == Value::Bits(1));
        if cleared || !counts_itself {
            continue;
        }
        let moved = after.cast_signed() - before.cast_signed();
        let expected = if at(&down, time_ps - 1) == 1 { -1 } else { 1 };
        assert_eq!(moved, expected, "{scope} at {time_ps} ps");
        assert!(expected == 1 || adc.cds == Cds::Digital, "only digital double sampling counts down");
        steps += 1;
    }
    steps
}
