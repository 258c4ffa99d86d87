//! Waveforms: what they show is what the sensor computes, and what readers read is what was written.

#![allow(clippy::unwrap_used)]

use crate::common;
#[path = "waves/readers.rs"]
mod readers;

use crate::common::assets::KeptBakes;
use common::{Scratch, sensel};
use sensel::config::Resolved;
use sensel::files::waves::{fst_bytes, vcd_bytes};
use sensel::link;
use sensel::run::{NoClock, NoProgress, SensorSetup, Session, Setup};
use sensel::units::{CameraIndex, FrameIndex, RowIndex};
use sensel::waves::{Asked, SignalKind, Value, WavePlan, WaveRow, Waves};

/// Values of a signal by name; at least one.
fn of(waves: &Waves, scope: &str, name: &str) -> Vec<(u64, Value)> {
    let signal = waves.find(scope, name).unwrap_or_else(|| panic!("no signal {scope}.{name}"));
    waves.of(signal)
}

/// What a signal stands at from an instant on.
fn at(values: &[(u64, Value)], time_ps: u64) -> Value {
    values[values.partition_point(|(time, _)| *time <= time_ps) - 1].1
}

/// Instants at which a pin rises.
fn rises(values: &[(u64, Value)]) -> Vec<u64> {
    values.iter().filter(|(_, value)| *value == Value::Bits(1)).map(|(time_ps, _)| *time_ps).collect()
}

/// Picoseconds, halves up, of `line_clk` at `pix_hz` and `clocks` at `hz`: the definition, in one division.
fn ps(line_clk: u64, pix_hz: u64, clocks: u64, hz: u64) -> u64 {
    let [line_clk, pix_hz, clocks, hz] = [line_clk, pix_hz, clocks, hz].map(u128::from);
    let below = pix_hz * hz;
    let above = (line_clk * hz + clocks * pix_hz) * 1_000_000_000_000;
    u64::try_from((2 * above + below) / (2 * below)).unwrap()
}

const SMALL: &str =
    "[sensor]\nwidth = 96\nheight = 64\n[scene]\ngenerator = \"box\"\n[motion]\noffset_m = [0.0, 1.5, 0.3]\n";

fn resolved(assignments: &[&str]) -> Resolved {
    let assignments: Vec<String> = assignments.iter().map(|&text| text.to_owned()).collect();
    Resolved::from_layers("test.toml", SMALL, &assignments).unwrap()
}

fn wedge_of(sensor: &SensorSetup, asked: Asked<'_>) -> Waves {
    let plan = WavePlan::new(sensor, asked, 1).unwrap();
    let chain = sensor.chain(sensor.parameters.adc.gain, [&[], &[]], 0, 7);
    let width = usize::try_from(sensor.schedule.output_size().width_px).unwrap();
    plan.waves(&chain.first_columns(CameraIndex(0), width), &plan.wedge()).unwrap()
}

/// Shows three rows of the second frame of a run: every chosen column's counter ends at the frame's code, the comparator rises in the
/// clock of the closed form's crossing, and the bytes on the link are in the frame's packets.
#[test]
fn a_run_shows_the_codes_crossings_and_packets_of_its_frame() {
    let cases: [&[&str]; 3] = [
        &["sensor.adc.comparator_delay_clk=3", "sensor.adc.kickback_uv=5.0"],
        &[
            "sensor.readout.window=[8, 8, 64, 48]",
            "sensor.readout.shutter='rolling'",
            "run.effects='all'",
            "sensor.adc.comparator_delay_sigma_clk=2.0",
        ],
        &["sensor.readout.binning=2", "sensor.adc.counting='latch'", "run.rung='clocked'"],
    ];
    for case in cases {
        check_run(case);
    }
}

fn check_run(case: &[&str]) {
    let assignments = [&["run.frames=2"], case].concat();
    let (resolved, again) = (resolved(&assignments), resolved(&assignments));
    let sensor = SensorSetup::new(&resolved).unwrap();
    let width = usize::try_from(sensor.schedule.output_size().width_px).unwrap();
    let columns = [0, 1, 17, width / 2, width - 2, width - 1];
    let listed = columns.map(|column| column.to_string()).join(",");
    let asked = Asked { rows: Some("0,5,6"), columns: Some(&listed), frame: Some(1) };
    let plan = WavePlan::new(&sensor, asked, 2).unwrap();
    let mut session = Session::new(Setup::new(resolved, &KeptBakes, &NoProgress).unwrap()).unwrap();
    session.probe_rows(FrameIndex(1), &plan.selection().rows);
    session.step(&NoClock).unwrap();
    assert!(session.probed_rows().is_empty(), "the other frame is kept");
    let frame = session.step(&NoClock).unwrap();
    let mut unprobed = Session::new(Setup::new(again, &KeptBakes, &NoProgress).unwrap()).unwrap();
    unprobed.step(&NoClock).unwrap();
    unprobed.step(&NoClock).unwrap();
    assert_eq!(session.hashes(), unprobed.hashes(), "watching changed the run");
    let codes = &frame.cameras[0].codes;
    let rows: Vec<WaveRow> = session
        .probed_rows()
        .iter()
        .zip([0, 5, 6])
        .map(|(samples, row)| WaveRow { samples: samples.clone(), sent: Some(codes.row(row).to_vec()) })
        .collect();
    let chain = session.setup().chain(sensor.parameters.adc.gain);
    let converters = chain.first_columns(CameraIndex(0), width);
    let waves = plan.waves(&converters, &rows).unwrap();

    let latches = rises(&of(&waves, "sequencer", "latch"));
    assert_eq!(latches.len(), 3);
    let (hts, vts) = (u64::from(sensor.schedule.hts()), sensor.schedule.vts());
    let mut compared = 0;
    for ((&row, samples), &latch_ps) in [0, 5, 6].iter().zip(session.probed_rows()).zip(&latches) {
        let crossings = converters.crossings(&samples.signal_uv, &samples.reset_uv);
        let line_clk = vts * hts + u64::try_from(row).unwrap() * hts;
        for column in columns {
            let scope = format!("column_{column}");
            let code = Value::Bits(codes.row(row)[column].into());
            assert_eq!(at(&of(&waves, &scope, "code"), latch_ps), code, "row {row}, column {column}");
            // Settling takes 2 and 3 us at 480 MHz, the reset ramp 128 clocks; step k stands in clock k - 1 of its ramp.
            let rise = |before: u64, crossing: u32| match crossing {
                u32::MAX => None,
                k => Some(ps(line_clk, 48_000_000, before + u64::from(k) - 1, 480_000_000)),
            };
            let expected =
                [rise(960, crossings.reset_clk[column]), rise(960 + 128 + 1440, crossings.signal_clk[column])];
            let line_ps = ps(line_clk, 48_000_000, 0, 1)..ps(line_clk + hts, 48_000_000, 0, 1);
            let found: Vec<u64> =
                rises(&of(&waves, &scope, "comparator")).into_iter().filter(|time| line_ps.contains(time)).collect();
            assert_eq!(found, expected.into_iter().flatten().collect::<Vec<_>>(), "row {row}, column {column}");
            compared += 1;
        }
    }
    assert_eq!(compared, 18);

    // 240 MHz carry 480 Mbit/s: 16.667 ns a byte.
    let packets = readers::link_bytes(&waves, 1, 16_667);
    assert_eq!(packets.len(), 3);
    for (packet, row) in packets.iter().zip([0, 5, 6]) {
        assert_eq!(packet, &link::pack_row(codes.row(row), 10, 0, &sensor.link).unwrap());
        assert!(frame.cameras[0].packets.windows(packet.len()).any(|bytes| bytes == packet), "row {row} was not sent");
    }
}

/// Configs over converters, clocks, shutters, windows and lanes. `waves` itself asserts that the core's codes are the closed form's.
#[test]
fn counters_lanes_and_times_hold_over_many_sensors() {
    let base = "sensor.readout.hts=2000";
    let cases: &[&[&str]] = &[
        &[],
        &["sensor.adc.cds='analog'"],
        &["sensor.adc.cds='none'", "sensor.adc.bits=8", "sensor.adc.black_level_dn=16"],
        &["sensor.adc.counting='latch'", "sensor.adc.counter='gray'"],
        &["sensor.adc.bits=1", "sensor.adc.black_level_dn=0", "sensor.adc.reset_counts=40"],
        &["sensor.adc.bits=12", "sensor.adc.clock_hz=400000001", "sensor.readout.pixel_rate_hz=47999999"],
        &["sensor.adc.comparator_delay_sigma_clk=4.0", "sensor.adc.kickback_uv=-30.0"],
        &["sensor.adc.ramp_inl_lsb=3.0", "sensor.adc.ramp_settling_clk=9.0"],
        &["sensor.readout.shutter='rolling'", "sensor.readout.reset_clk=7", "sensor.readout.transfer_clk=9"],
        &["sensor.readout.window=[8, 6, 48, 32]", "sensor.adc.reset_counts=0"],
        &["sensor.readout.lane_clock_hz=333333333"],
        &["link.lanes=2"],
        // 7.4 us hold settling and ramps and not a clock more: the latch shows in the next line.
        &["sensor.readout.pixel_rate_hz=50000000", "sensor.readout.hts=370", "sensor.readout.lane_clock_hz=480000000"],
    ];
    let mut steps = 0;
    for (number, case) in cases.iter().enumerate() {
        let lanes = 1 + number % 4;
        let lane = format!("sensor.readout.lanes={lanes}");
        let sensor = SensorSetup::new(&resolved(&[&[base, &lane], *case].concat())).unwrap();
        let last = sensor.schedule.output_size().width_px - 1;
        let columns = format!("0,{},{last}", last / 2);
        let waves = wedge_of(&sensor, Asked { rows: Some("1,2,4"), columns: Some(&columns), frame: None });
        let adc = &sensor.parameters.adc;
        let codes = readers::lane_codes(&waves, lanes, adc.bits);
        let latches = rises(&of(&waves, "sequencer", "latch"));
        assert_eq!((codes.len(), latches.len()), (3, 3), "{case:?}");
        for (row, &latch_ps) in codes.iter().zip(&latches) {
            for column in [0, last / 2, last] {
                let code = at(&of(&waves, &format!("column_{column}"), "code"), latch_ps);
                assert_eq!(code, Value::Bits(row[usize::try_from(column).unwrap()].into()), "{case:?}");
            }
        }
        let first = adc.black_level_dn.abs_diff(codes[0][0].into());
        // Offsets of the ramp's shape are a few codes; a delay moves reset and signal alike, but for the clipping at the ends.
        assert!(first <= 8, "{case:?}: a dark column gives {} for {}", codes[0][0], adc.black_level_dn);
        steps += readers::counter_steps(&waves, &format!("column_{last}"), adc);
        check_lines(&sensor, &waves);
        assert!(waves.changes.is_sorted_by_key(|change| (change.time_ps, change.signal)), "{case:?}");
    }
    assert!(steps > 20_000, "only {steps} counter steps were looked at");
}

/// `frame_valid`, exposures and starts of lines from the schedule's seconds: within half a picosecond and the rounding of a double.
fn check_lines(sensor: &SensorSetup, waves: &Waves) {
    let schedule = &sensor.schedule;
    let near = |found_ps: u64, expected_s: f64| {
        let error_ps = found_ps as f64 - 1e12 * expected_s;
        assert!(error_ps.abs() <= 0.5 + 1e-3 * expected_s, "{found_ps} ps for {expected_s} s");
    };
    let valid = of(waves, "frame", "frame_valid");
    assert_eq!(valid.len(), 3);
    near(valid[1].0, schedule.readout(FrameIndex(0), RowIndex(0)).start_s);
    near(valid[2].0, schedule.readout(FrameIndex(0), schedule.last_row()).end_s);
    let starts = rises(&of(waves, "sequencer", "fd_reset"));
    assert_eq!(starts.len(), 3);
    for (row, start_ps) in [1, 2, 4].into_iter().zip(starts) {
        let exposure = of(waves, "exposure", &format!("row_{row}"));
        let span = schedule.exposure(FrameIndex(0), RowIndex(row));
        near(exposure[1].0, span.start_s);
        near(exposure[2].0, span.end_s);
        near(start_ps, schedule.readout(FrameIndex(0), RowIndex(row)).start_s);
    }
}

#[test]
fn both_formats_read_back_as_they_were_written_and_are_the_same_bytes_again() {
    let sensor = SensorSetup::new(&resolved(&["sensor.readout.lanes=2"])).unwrap();
    let waves = wedge_of(&sensor, Asked { rows: Some("0,1,3"), ..Asked::default() });
    for (name, write) in [("fst", fst_bytes as fn(&Waves) -> std::io::Result<Vec<u8>>), ("vcd", vcd_bytes)] {
        let bytes = write(&waves).unwrap();
        assert!(bytes == write(&waves).unwrap(), "{name} differs from itself");
        let read = readers::read(bytes);
        assert_eq!(read.len(), waves.signals.len(), "{name}");
        let mut compared = 0;
        for (signal, (path, values)) in waves.signals.iter().zip(&read) {
            assert_eq!(path, &format!("sensor.{}.{}", signal.scope, signal.name), "{name}");
            let expected = of(&waves, &signal.scope, &signal.name);
            let expected: Vec<(u64, String)> =
                expected.into_iter().map(|(time, value)| (time, readers::text(signal.kind, value))).collect();
            assert_eq!(values, &expected, "{name}: {path}");
            compared += values.len();
        }
        assert_eq!(compared, waves.changes.len(), "{name}");
        println!("{name}: {compared} changes");
    }
}

/// GTKWave's own reader of FST finds the changes that the VCD has.
#[cfg(feature = "outside")]
#[test]
fn fst2vcd_finds_the_same_changes() {
    let folder = Scratch::new("fst2vcd");
    let sensor = SensorSetup::new(&resolved(&["sensor.readout.lanes=2"])).unwrap();
    let waves = wedge_of(&sensor, Asked::default());
    let file = folder.join("wave.fst");
    std::fs::write(&file, fst_bytes(&waves).unwrap()).unwrap();
    let output = std::process::Command::new("fst2vcd").arg(&file).output().expect("fst2vcd (Debian: gtkwave)");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (theirs, ours) = (readers::read(output.stdout), readers::read(vcd_bytes(&waves).unwrap()));
    assert_eq!(theirs.len(), ours.len());
    for (their, our) in theirs.iter().zip(&ours) {
        assert_eq!(their, our);
    }
    assert!(ours.iter().map(|(_, values)| values.len()).sum::<usize>() > 5000);
}

#[test]
fn kinds_and_widths_are_as_documented() {
    let sensor = SensorSetup::new(&resolved(&[])).unwrap();
    let waves = wedge_of(&sensor, Asked::default());
    let kind = |scope: &str, name: &str| waves.signals[waves.find(scope, name).unwrap().0].kind;
    assert_eq!(kind("column_0", "counter"), SignalKind::Signed(13));
    assert_eq!(kind("column_0", "code"), SignalKind::Bits(10));
    assert_eq!(kind("ramp", "ramp_uv"), SignalKind::Real);
    assert!(waves.find("lanes", "lane_0").is_none(), "a parallel readout has no serial lanes");
    // A reset ramp longer than the code needs a wider counter: -200 to 1 + 0.
    let long = ["sensor.adc.bits=1", "sensor.adc.black_level_dn=0", "sensor.adc.reset_counts=200"];
    let sensor = SensorSetup::new(&resolved(&long)).unwrap();
    let waves = wedge_of(&sensor, Asked::default());
    assert_eq!(waves.signals[waves.find("column_0", "counter").unwrap().0].kind, SignalKind::Signed(9));
}

/// Options that are refused before anything is written, with words that name an accepted value.
const REFUSED: &[(&[&str], &str)] = &[
    (&["--waves", "w.txt"], ".fst, .vcd or .svg"),
    (&["--waves", "w"], "use a name ending in .fst, .vcd or .svg"),
    (&["--waves", "w.fst", "--wave-rows", "480"], "--wave-rows = 480: 480 is out of range; use 0 to 479"),
    (&["--waves", "w.fst", "--wave-columns", "0,640"], "640 is out of range; use 0 to 639"),
    (&["--waves", "w.fst", "--wave-rows", "a"], "'a' is no number"),
    (&["--waves", "w.fst", "--set", "sensor.adc.columns_per_adc=2"], "columns_per_adc"),
    (&["--waves", "w.fst", "--set", "sensor.readout.hdr='dual_gain'"], "hdr"),
    (&["--waves", "w.fst", "--set", "sensor.readout.exposure='auto'"], "use fixed"),
];

#[test]
fn the_program_writes_waves_and_refuses_what_it_cannot_show() {
    let folder = Scratch::new("waves");
    for verb in ["run", "timing"] {
        for (options, words) in REFUSED {
            let mut arguments = vec![verb, "box", "--quiet"];
            let (out, file) = (folder.join("out"), folder.join(options[1]));
            if verb == "run" {
                arguments.extend(["--out", &out]);
            }
            arguments.extend(["--waves", &file]);
            arguments.extend(&options[2..]);
            let outcome = sensel(&arguments);
            assert_eq!((outcome.code, outcome.stderr.lines().count()), (2, 1), "{options:?}: {outcome:?}");
            assert!(outcome.stderr.contains(words), "{options:?}: {}", outcome.stderr);
            assert!(folder.names().is_empty(), "{options:?} left {:?}", folder.names());
        }
    }
    let (fst, vcd, out) = (folder.join("deep/a.fst"), folder.join("deep/a.vcd"), folder.join("out"));
    let size = ["--set", "sensor.width=96", "--set", "sensor.height=64", "--quiet"];
    for file in [&fst, &vcd] {
        let outcome = sensel(&[&["timing", "box", "--waves", file, "--wave-columns", "0,95"], &size[..]].concat());
        assert_eq!(outcome.code, 0, "{outcome:?}");
    }
    assert_eq!(readers::read(std::fs::read(&fst).unwrap()), readers::read(std::fs::read(&vcd).unwrap()));
    let run =
        ["run", "box", "--frames", "1", "--out", &out, "--waves", &fst, "--wave-columns", "5", "--wave-rows", "3"];
    let outcome = sensel(&[&run, &size[..]].concat());
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let read = readers::read(std::fs::read(&fst).unwrap());
    assert!(read.iter().any(|(path, values)| path == "sensor.column_5.counter" && values.len() > 64), "no counts");
    assert_eq!(folder.names(), ["deep", "out"]);
    assert_eq!(common::names(&folder.path().join("deep")), ["a.fst", "a.vcd"]);
}

#[test]
fn the_picture_of_a_row_says_the_codes_of_its_converters_and_is_the_same_twice() {
    let sensor = SensorSetup::new(&resolved(&[])).unwrap();
    let waves = wedge_of(&sensor, Asked { rows: Some("7"), columns: Some("0,31,95"), frame: None });
    let picture = sensel::waves::plot::svg(&waves, "a <b>");
    assert_eq!(picture, sensel::waves::plot::svg(&waves, "a <b>"));
    assert!(picture.contains("a &lt;b&gt;") && !picture.contains("NaN") && !picture.contains("inf"), "{picture}");
    // The wedge goes from no signal to the least signal of the greatest code; the last latch of the row holds its codes.
    for column in ["0", "31", "95"] {
        let codes = of(&waves, &format!("column_{column}"), "code");
        let latch_ps = rises(&of(&waves, "sequencer", "latch"))[0];
        let Value::Bits(code) = at(&codes, latch_ps) else { panic!("column {column} has no code") };
        assert!(picture.contains(&format!(">code {code}<")), "column {column}: {code}\n{picture}");
        assert!(picture.contains(&format!(">column {column}<")));
    }
    for phase in ["ramp reset", "ramp signal"] {
        assert!(picture.contains(&format!("<title>{phase}</title>")), "{phase}");
    }
    // A row's conversions are one page of text, whatever the ramp's length.
    assert!(picture.len() < 200_000, "{} bytes", picture.len());
}
