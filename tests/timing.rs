//! The schedule against what is known of real sensors, and against itself: modes of published drivers, the lines and frames that
//! errors name, spans of random readouts, the committed pictures of the presets.

#![allow(clippy::unwrap_used)]

use crate::chance;
use crate::common;

use std::collections::BTreeMap;

use chance::Chance;
use common::{Scratch, sensel};
use sensel::adc::AdcParams;
use sensel::config::{Resolved, presets};
use sensel::num::{u32_truncated, u64_half_even};
use sensel::readout::{
    BinningMode, ExposureSetting, FrameLength, Hdr, LongExposure, Pulses, ReadoutParams, Schedule, Shutter, Trigger,
    Window,
};
use sensel::units::{FrameIndex, RowIndex, Size};
use serde_json::Value;

/// Rows of the table by column name.
fn modes() -> Vec<BTreeMap<String, String>> {
    let text = include_str!("data/timings.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    // Only the last column, a note, holds commas.
    let row = |line: &str| {
        let cells = line.splitn(names.len(), ',').map(str::to_owned);
        names.iter().map(|name| (*name).to_owned()).zip(cells).collect()
    };
    lines.map(row).collect()
}

/// Array, and what is read of it, where a mode is not the whole array: drivers crop IMX219 about its centre and skip on OV9282.
fn array_of(sensor: &str, width: &str) -> (&'static str, &'static str) {
    match (sensor, width) {
        ("OV7251", _) => ("width = 640\nheight = 480", ""),
        ("OV9282", "1280") => ("width = 1280\nheight = 800", ""),
        ("OV9282", _) => ("width = 1280\nheight = 800", "binning = 2\nbinning_mode = \"skip\""),
        ("IMX219", "3280") => ("width = 3280\nheight = 2464", ""),
        _ => ("width = 3280\nheight = 2464", "window = [680, 692, 1920, 1080]"),
    }
}

fn margin_of(sensor: &str) -> u32 {
    match sensor {
        "OV7251" => 20,
        "OV9282" => 25,
        _ => 4,
    }
}

/// `sensel timing --json` of a mode, from a file that has only sections of a sensor.
fn timing_of(mode: &BTreeMap<String, String>, folder: &Scratch) -> Value {
    let (array, part) = array_of(&mode["sensor"], &mode["width"]);
    let shutter = if mode["shutter"] == "GS" { "global" } else { "rolling" };
    let text = format!(
        "[sensor]\n{array}\n[sensor.adc]\nbits = {}\n[sensor.readout]\nshutter = \"{shutter}\"\nhts = {}\nvts = {}\n\
         pixel_rate_hz = {}\nexposure_lines = 100\nexposure_margin_lines = {}\n{part}\n",
        mode["bpp"],
        mode["hts"],
        mode["vts"],
        mode["pixel_rate_hz"],
        margin_of(&mode["sensor"])
    );
    let file = folder.join("sensor.toml");
    std::fs::write(&file, text).unwrap();
    let link = [format!("link.lanes={}", mode["lanes"]), format!("link.frequency_hz={}", mode["link_freq_hz"])];
    let arguments = ["timing", &file, "--json", "--set", "link.mode=frames", "--set", &link[0], "--set", &link[1]];
    sensel(&arguments).json()
}

/// Rates and line times of the task: 0.02 %. Exposure limits are whole lines. Payload is width height depth fps, printed as whole
/// bits a second; utilisation is printed with three decimals.
#[test]
fn every_mode_of_published_drivers_has_its_rate_line_time_limit_and_link_use() {
    let folder = Scratch::new("timing-modes");
    let modes = modes();
    assert_eq!(modes.len(), 7);
    for mode in &modes {
        let timing = timing_of(mode, &folder);
        let number = |column: &str| mode[column].parse::<f64>().unwrap();
        let found = |key: &str| timing[key].as_f64().unwrap();
        let near = |key: &str, expected: f64, tolerance: f64| {
            assert!((found(key) / expected - 1.0).abs() <= tolerance, "{mode:?}: {key} is {}", found(key));
        };
        near("fps", number("fps_computed"), 2e-4);
        if !mode["fps_driver_stated"].is_empty() {
            near("fps", number("fps_driver_stated"), 2e-4);
        }
        near("line_time_us", number("line_time_us"), 2e-4);
        assert_eq!(timing["exposure_max_lines"].to_string(), mode["exposure_max_lines"], "{mode:?}");
        assert_eq!(timing["hts"].to_string(), mode["hts"]);
        assert_eq!(timing["vts"].to_string(), mode["vts"]);
        assert_eq!((&timing["width"].to_string(), &timing["height"].to_string()), (&mode["width"], &mode["height"]));
        assert_eq!(timing["link_capacity_bps"].to_string(), mode["link_capacity_bps"]);
        near("link_payload_bps", number("payload_bps_active"), 0.5 / number("payload_bps_active") * 1.001);
        assert!((found("link_utilisation") - number("link_utilisation")).abs() <= 0.000_501, "{mode:?}");
    }
}

const ARRAY: Size = Size { width_px: 96, height_px: 64 };

/// A readout that may or may not do.
fn random_params(cases: &mut Chance) -> ReadoutParams {
    let hts = cases.within(20, 1500);
    let lines = if cases.within(0, 4) == 0 { cases.within(0, 2) } else { cases.within(0, 300) };
    let exposure = if cases.within(0, 1) == 0 {
        ExposureSetting::Lines(lines)
    } else {
        ExposureSetting::Us(f64::from(lines) * f64::from(hts) / 48.0 + 0.1)
    };
    let plain = ReadoutParams::plain(Shutter::Rolling, hts, cases.within(1, 400), 48_000_000, exposure);
    let hdr = if cases.within(0, 2) == 0 {
        Hdr::MultiExposure { exposures: cases.within(2, 4), ratio: f64::from(cases.within(3, 40)) / 2.0 }
    } else {
        Hdr::None
    };
    let is_global = hdr == Hdr::None && cases.within(0, 1) == 0;
    let window = Window { x_px: 16 * cases.within(0, 2), y_px: 16 * cases.within(0, 1), width_px: 64, height_px: 48 };
    let rate_hz = f64::from(cases.within(10, 400_000)) / 10.0;
    ReadoutParams {
        shutter: if is_global { Shutter::Global } else { Shutter::Rolling },
        frame: if cases.within(0, 3) == 0 { FrameLength::RateHz(rate_hz) } else { plain.frame },
        exposure_fine_clk: if hdr == Hdr::None { cases.within(0, 1) * cases.within(0, 19) } else { 0 },
        exposure_margin_lines: cases.within(0, 25),
        exposure_lines_min: cases.within(u32::from(hdr != Hdr::None), 2),
        long_exposure: cases.one(&[LongExposure::Refuse, LongExposure::Refuse, LongExposure::ExtendFrame]),
        window: (cases.within(0, 1) == 0).then_some(window),
        binning: cases.one(&[1, 2, 4]),
        binning_mode: cases.one(&BinningMode::ALL),
        mosaic_px: cases.one(&[1, 2]),
        hdr,
        lanes: cases.one(&[0, 1, 3, 8]),
        lane_clock_hz: 1_000_000 * u64::from(cases.within(20, 200)),
        pulses: Pulses { reset_clk: cases.within(0, 9), transfer_clk: cases.within(0, 9), latch_clk: 1 },
        trigger: match cases.within(0, 3) {
            0 => {
                Trigger::External { period_ns: u64::from(cases.within(1000, 9_000_000)), delay_clk: cases.within(0, 9) }
            }
            _ => Trigger::Free,
        },
        clock_ppb: vec![0, -50_000],
        ..plain
    }
}

/// The number that stands after some words of a message, where they occur last.
fn named(message: &str, before: &str) -> Option<f64> {
    let (_, rest) = message.rsplit_once(before)?;
    rest.split([' ', ',', ';', ':']).next()?.parse().ok()
}

/// Parameters with the value that an error names, which is accepted, and with one less (for a rate: a line less a frame).
fn remedy(message: &str, params: &ReadoutParams) -> (&'static str, ReadoutParams, ReadoutParams) {
    let with_vts = |vts: u32| ReadoutParams { frame: FrameLength::Lines(vts), ..params.clone() };
    let with_hts = |hts: u32| ReadoutParams { hts, exposure_fine_clk: 0, ..params.clone() };
    if message.contains("a line must hold") {
        let hts = u32_truncated(named(message, "hts = ").unwrap());
        return ("hts", with_hts(hts), with_hts(hts - 1));
    }
    if message.contains("or less") {
        let with = |rate_hz| ReadoutParams { frame: FrameLength::RateHz(rate_hz), ..params.clone() };
        let (rate_hz, lines) = (named(message, "; use ").unwrap(), named(message, "which need ").unwrap());
        return ("rate", with(rate_hz), with(rate_hz * lines / (lines - 1.0)));
    }
    if message.contains("trigger_period_us") {
        let period_ns = u64_half_even(1000.0 * named(message, "; use ").unwrap());
        let with =
            |period_ns| ReadoutParams { trigger: Trigger::External { period_ns, delay_clk: 0 }, ..params.clone() };
        return ("trigger", with(period_ns), with(period_ns - 1));
    }
    if message.contains("shorter than") {
        let with = |lines| ReadoutParams { exposure: ExposureSetting::Lines(lines), ..params.clone() };
        return ("shortest", with(params.exposure_lines_min), with(params.exposure_lines_min - 1));
    }
    let vts = u32_truncated(named(message, "vts = ").unwrap_or_else(|| panic!("an error without a remedy: {message}")));
    ("vts", with_vts(vts), with_vts(vts - 1))
}

/// Whether two errors complain of the same: for a frame by the length that is accepted (rows and exposure have keys of their own), else
/// by their key.
fn same_complaint(kind: &str, one: &str, other: &str) -> bool {
    match kind {
        "vts" => named(one, "vts = ").is_some() && named(one, "vts = ") == named(other, "vts = "),
        _ => one.split(" = ").next() == other.split(" = ").next(),
    }
}

fn converter(bits: u32) -> AdcParams {
    Resolved::from_layers("test", "", &[format!("sensor.adc.bits={bits}")]).unwrap().scenario.adc().unwrap()
}

#[test]
fn the_line_or_frame_that_an_error_names_does_do_and_one_less_does_not() {
    let seed = 20_260_217;
    println!("seed {seed}");
    let mut cases = Chance::new(seed, 0);
    let converters: Vec<AdcParams> = (1..=12).map(converter).collect();
    let mut hit = BTreeMap::<&str, u32>::new();
    let mut checked = 0;
    for case in 0..3000 {
        let mut params = random_params(&mut cases);
        let adc = &converters[usize::try_from(cases.within(0, 11)).unwrap()];
        let packet_s = f64::from(cases.within(0, 20)) * 1e-6;
        let made = |params: &ReadoutParams| Schedule::new(ARRAY, params, adc, packet_s);
        for step in 0.. {
            assert!(step < 8, "case {case}: no end of errors: {params:?}");
            match made(&params) {
                Ok(schedule) => {
                    check_spans(&schedule, case);
                    checked += 1;
                    break;
                }
                Err(error) => {
                    let message = error.to_string();
                    let (kind, enough, short) = remedy(&message, &params);
                    if let Err(next) = made(&enough) {
                        let next = next.to_string();
                        assert!(!same_complaint(kind, &message, &next), "case {case}: {message}, then {next}");
                        assert!(kind != "vts" || !next.contains("vts = "), "case {case}: {message}, then {next}");
                    }
                    let refused = made(&short).expect_err("one less does not do").to_string();
                    assert!(same_complaint(kind, &message, &refused), "case {case}: {message}, one less: {refused}");
                    *hit.entry(kind).or_default() += 1;
                    params = enough;
                }
            }
        }
    }
    println!("{checked} schedules, errors by kind: {hit:?}");
    assert_eq!(checked, 3000);
    for kind in ["hts", "vts", "rate", "trigger", "shortest"] {
        assert!(hit.get(kind).is_some_and(|count| *count >= 50), "{kind}: {hit:?}");
    }
}

/// Every read of every slot has a line of its own over two frames; a row is exposed until its line (or its frame) ends, never while
/// it is exposed or read for another slot or frame; frames do not run backwards; output spans agree with array rows'.
fn check_spans(schedule: &Schedule, case: u32) {
    let line_clk = schedule.line_clk().0;
    let window = schedule.geometry().window();
    let mut reads = BTreeMap::new();
    for array_row in (window.y_px..window.y_px + window.height_px).map(RowIndex) {
        let mut free_from = 0;
        for (frame, slot) in (0..2).flat_map(|frame| (0..schedule.slots().len()).map(move |slot| (frame, slot))) {
            let frame = FrameIndex(frame);
            let Some(exposure) = schedule.row_exposure_clk(frame, slot, array_row) else { continue };
            let read = schedule.row_readout_clk(frame, slot, array_row).unwrap();
            assert_eq!(exposure.length(), schedule.exposure_clk(slot));
            assert_eq!(read.length().0, line_clk);
            assert!(exposure.end <= read.start, "case {case}: read while exposed");
            if schedule.shutter() == Shutter::Rolling {
                assert_eq!(exposure.end, read.start, "case {case}");
                assert!(exposure.start.0 >= free_from, "case {case}: exposed for two at once");
            }
            // The charge has left when the line begins; slots wait for its end.
            free_from = if schedule.slots().len() > 1 { read.end.0 } else { read.start.0 };
            let line = schedule.geometry().read_of(array_row).unwrap();
            let holder = reads.entry(read.start.0).or_insert((frame, slot, line));
            assert_eq!(*holder, (frame, slot, line), "case {case}: two rows want one line");
        }
    }
    let starts: Vec<u64> = reads.keys().copied().collect();
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] >= line_clk), "case {case}: lines overlap");
    assert_eq!(reads.len(), 2 * schedule.slots().len() * sensel::num::index(schedule.geometry().reads()));
    let second = schedule.frame_start_clk(FrameIndex(1)).0;
    assert!(
        second >= schedule.frame_start_clk(FrameIndex(0)).0 + schedule.frame_clk().0,
        "case {case}: frames overlap"
    );
    let window_clk = schedule.frame_window_clk(FrameIndex(0));
    let middle_s = schedule.t_frame(FrameIndex(0));
    let span = schedule.span(window_clk);
    // Rounding of seconds up to 1e4 s: 1e-12.
    assert!((middle_s - span.middle_s()).abs() < 1e-12, "case {case}");
    let (first, last) = (schedule.slot_exposure(FrameIndex(0), 0, RowIndex(0)), schedule.last_row());
    assert!(
        first.start_s >= 0.0 && first.start_s <= schedule.exposure(FrameIndex(0), last).start_s + 1e-12,
        "case {case}"
    );
}

/// The pictures of the presets are those of this version: `SENSEL_UPDATE=1 cargo test --test all timing::pictures` writes them anew; look
/// at them, and say in the commit why they changed.
#[test]
fn pictures_of_the_presets_are_up_to_date() {
    let folder = Scratch::new("timing-pictures");
    let names = presets::names(presets::PresetKind::Sensor);
    assert!(!names.is_empty());
    for name in names {
        let file = folder.join(&format!("{name}.svg"));
        let outcome = sensel(&["timing", name, "--svg", &file, "--quiet"]);
        assert_eq!(outcome.code, 0, "{outcome:?}");
        let picture = std::fs::read_to_string(&file).unwrap();
        let kept = format!("{}/docs/timing/{name}.svg", env!("CARGO_MANIFEST_DIR"));
        if std::env::var_os("SENSEL_UPDATE").is_some() {
            std::fs::write(&kept, &picture).unwrap();
        }
        let committed = std::fs::read_to_string(&kept).unwrap_or_default();
        assert!(picture == committed, "docs/timing/{name}.svg is not this version's; see the comment of this test");
        let page = include_str!("../docs/timing.md");
        assert!(page.contains(&format!("timing/{name}.svg")), "docs/timing.md does not show {name}");
    }
}

#[test]
fn a_sensor_is_named_by_preset_by_file_or_by_scenario() {
    let folder = Scratch::new("timing-names");
    let file = folder.join("mine.toml");
    std::fs::write(&file, "[sensor.readout]\nvts = 860\n").unwrap();
    let fps = |name: &str| sensel(&["timing", name, "--json"]).json()["fps"].as_f64().unwrap();
    // 48 MHz over 928 times VTS.
    for (name, expected) in [("paper_6t_vga", 30.0024), ("box", 30.0024), (file.as_str(), 60.1444)] {
        assert!((fps(name) - expected).abs() < 1e-4, "{name}");
    }
    let unknown = sensel(&["timing", "no_such_sensor"]);
    assert_eq!(unknown.code, 2);
    assert!(unknown.stderr.contains("no_such_sensor"), "{}", unknown.stderr);
}

/// What is refused, and the words that name an accepted value.
#[test]
fn impossible_timing_is_refused_with_what_would_do() {
    let cases: &[(&[&str], &str)] = &[
        (&["hts=640"], "use hts = 665"),
        (&["lanes=4", "lane_clock_hz=60000000"], "the readout of its lanes of 26.667 us; use hts = 1280"),
        (
            &["exposure_lines=1705"],
            "exposure_lines = 1705: longer than the frame less its margin; use at most 1704, vts = 1725",
        ),
        (&["exposure_lines=0"], "use 1"),
        (&["exposure_us=5.0", "exposure_lines=3"], "use one of the two"),
        (&["vts=900", "frame_rate_hz=30.0"], "use one of the two"),
        (&["frame_rate_hz=200.0"], "need 498 lines on this link; use 103.863 or less"),
        (&["exposure_fine_clk=928"], "0 to 927"),
        (&["trigger=external"], "trigger_period_us"),
        (&["trigger=external", "trigger_period_us=33330.0"], "use 33330.667"),
        (&["trigger_period_us=40000.0"], "use trigger = external"),
        (&["trigger_delay_clk=4"], "trigger = external"),
        (&["window=[0, 0, 640, 482]"], "up to 480 together"),
        (&["window=[1, 0, 320, 240]"], "off the steps of 2 px; use 0 with a width of 320"),
        (&["binning=3"], "1, 2 or 4"),
        (&["binning_mode=sum"], "charge, average, skip"),
        (&["row_order=random"], "top_to_bottom"),
        (&["long_exposure=wait"], "refuse, extend_frame"),
        (&["hdr=multi_exposure"], "rolling shutter"),
        (&["hdr=multi_exposure", "shutter=rolling", "hdr_exposures=5"], "2 to 4"),
        (&["hdr=multi_exposure", "shutter=rolling", "exposure_lines=1700"], "exposure_lines = 1700"),
        (&["sync_skew_us=[0.0, 1.0, 2.0]"], "one for each camera, 2 numbers"),
        (&["sync_skew_us=late"], "a number, or a list of numbers"),
        (&["sync_skew_us=-1.0"], "0 to 1,000,000"),
        (&["clock_ppm=[0.0, 2000.0]"], "-1000 to 1000"),
        (&["register_latency_frames=9"], "0 to 8"),
        (&["target_mean=0.0"], "use 0.001 to 0.99"),
        (&["target_mean=0.3"], "use sensor.readout.exposure = \"auto\", or leave it out"),
        (&["hdr_bits=12"], "an hdr other than none"),
        (&["binning_mode=average"], "sensor.readout.binning = 2, or leave it out"),
        (&["exposure=auto", "exposure_lines_max=1705"], "use 1 to 1704"),
        (&["exposure=auto", "gain_max=0.5"], "use 1 or more"),
        (&["exposure=auto", "target_mean=0.01"], "not above the black level"),
        (&["exposure=auto", "long_exposure=extend_frame"], "use refuse"),
        (&["exposure_lines=20000000", "long_exposure=extend_frame"], "use at most 16777216 lines"),
    ];
    for (assignments, words) in cases {
        let mut arguments = vec!["timing".to_owned(), "paper_6t_vga".to_owned()];
        for assignment in *assignments {
            arguments.extend(["--set".to_owned(), format!("sensor.readout.{assignment}")]);
        }
        let outcome = sensel(&arguments);
        assert_eq!((outcome.code, outcome.stdout.as_str()), (2, ""), "{assignments:?}: {outcome:?}");
        assert!(outcome.stderr.contains(words), "{assignments:?}: {}", outcome.stderr);
        assert!(outcome.stderr.contains("sensor.readout."), "{assignments:?}: {}", outcome.stderr);
    }
}

#[test]
fn a_key_of_a_higher_layer_takes_the_place_of_its_rival() {
    let timing = |set: &str| sensel(&["timing", "paper_6t_vga", "--json", "--set", set]).json();
    assert_eq!(timing("sensor.readout.frame_rate_hz=60.0")["vts"], 862);
    assert_eq!(timing("sensor.readout.exposure_lines=7")["exposure_lines"], 7);
    let shown = sensel(&["config", "show", "box", "--set", "sensor.readout.exposure_lines=7"]).stdout;
    assert!(!shown.contains("exposure_us"), "{shown}");
}

/// What the schedule knows is carried through a run's pixels, and its report says so.
#[test]
fn a_run_carries_what_timing_knows() {
    let size = |report: &serde_json::Value| {
        let side = |name: &str| report["scenario"][name].as_u64().unwrap();
        (side("width_px"), side("height_px"), side("bits"))
    };
    for (assignments, expected) in [
        (&["window=[64, 32, 320, 240]"][..], (320, 240, 10)),
        (&["binning=2", "binning_mode=charge"], (320, 240, 10)),
        (&["binning=2", "binning_mode=average"], (320, 240, 10)),
        (&["binning=4", "binning_mode=skip"], (160, 120, 10)),
        (&["shutter=rolling", "hdr=multi_exposure", "hdr_bits=12"], (640, 480, 12)),
        (&["exposure=auto"], (640, 480, 10)),
        (&["clock_ppm=1.0"], (640, 480, 10)),
        (&["sync_skew_us=1.0"], (640, 480, 10)),
    ] {
        let folder = common::Scratch::new("carried");
        let out = folder.join("out");
        let mut arguments =
            vec!["run", "box", "--frames", "1", "--json", "--out", &out, "--set", "run.samples_per_pixel=1"];
        let sets: Vec<String> = assignments.iter().map(|key| format!("sensor.readout.{key}")).collect();
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        assert_eq!(size(&sensel(&arguments).json()), expected, "{assignments:?}");
    }
}

/// One readout that has everything: pulses, serial lanes, three exposures, averaged rows, features on the link.
fn everything() -> Vec<String> {
    let keys = [
        "shutter=rolling",
        "exposure_lines=600",
        "hdr=multi_exposure",
        "hdr_exposures=3",
        "binning=2",
        "binning_mode=average",
        "lanes=8",
        "reset_clk=24",
        "transfer_clk=48",
        "latch_clk=2",
        "vts=2400",
    ];
    keys.iter().flat_map(|key| ["--set".to_owned(), format!("sensor.readout.{key}")]).collect()
}

#[test]
fn the_spans_of_a_line_are_those_of_its_budget() {
    let mut arguments = vec!["timing".to_owned(), "paper_6t_vga".to_owned(), "--json".to_owned()];
    arguments.extend(everything());
    let timing = sensel(&arguments).json();
    let spans = timing["line"].as_array().unwrap();
    let names: Vec<&str> = spans.iter().map(|span| span["name"].as_str().unwrap()).collect();
    let columns = ["reset", "settle reset", "ramp reset", "transfer", "settle signal", "ramp signal", "latch"];
    assert_eq!(names[..7], columns);
    assert_eq!(names[7..], ["shift out", "LP to HS", "header", "payload", "footer", "HS to LP"]);
    let us = |value: &Value| value.as_f64().unwrap();
    for pair in spans.windows(2).filter(|pair| pair[0]["lane"] == pair[1]["lane"]) {
        assert_eq!(pair[0]["end_us"], pair[1]["start_us"], "spans of a lane follow one another");
    }
    let line_us = us(&timing["line_time_us"]);
    for (demand, last) in [("conversion", 6), ("shift out", 7), ("packet", 12)] {
        let budget = timing["line_budget"].as_array().unwrap().iter().find(|part| part["name"] == demand).unwrap();
        // The same sums in another order: some 1e-15 of 20 us.
        assert!((us(&budget["time_us"]) - us(&spans[last]["end_us"])).abs() < 1e-9, "{demand}");
        let clocks = us(&budget["needed_hts"]) + us(&budget["slack_us"]) * 48.0;
        assert!(
            (clocks - 928.0).abs() < 1e-6,
            "{demand}: what is needed and what is left are the line of {line_us} us"
        );
    }
}

#[test]
fn a_picture_of_everything_stays_inside_its_frame() {
    let folder = Scratch::new("timing-everything");
    let file = folder.join("all.svg");
    let mut arguments = vec!["timing".to_owned(), "paper_6t_vga".to_owned(), "--svg".to_owned(), file.clone()];
    arguments.extend(everything());
    let outcome = sensel(&arguments);
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let svg = std::fs::read_to_string(&file).unwrap();
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    let mut texts = 0;
    for part in svg.split("<text x=\"").skip(1) {
        let x_px: f64 = part.split('"').next().unwrap().parse().unwrap();
        assert!((0.0..=960.0).contains(&x_px), "{part}");
        texts += 1;
    }
    assert!(texts > 40, "only {texts} words were drawn");
    for words in ["exposure 3", "shift out", "LP to HS", "blanking", "free"] {
        assert!(svg.contains(words), "{words} is missing");
    }
    let nowhere = sensel(&["timing", "paper_6t_vga", "--svg", &folder.join("all.svg/beyond.svg")]);
    assert_eq!(nowhere.code, 4, "{}", nowhere.stderr);
}
