//! The program as a user meets it: what it refuses, in which words and with which exit code; and what it prints.

#![allow(clippy::unwrap_used)]

use crate::common;
#[path = "command_line/compare.rs"]
mod compare;
#[path = "command_line/ends.rs"]
mod ends;
#[path = "command_line/late.rs"]
mod late;
#[path = "command_line/results.rs"]
mod results;
#[cfg(all(feature = "outside", target_os = "linux"))]
#[path = "command_line/kills.rs"]
mod kills;
#[path = "command_line/machine.rs"]
mod machine;

use common::{Outcome, Scratch, names, sensel, sensel_alone};
use serde_json::Value;

/// Runs a scenario with one assignment; it must be refused in one line, before anything is written.
fn refused(assignment: &str) -> Outcome {
    let folder = Scratch::new("refused");
    let outcome =
        sensel(&["run", "box", "--frames", "1", "--quiet", "--set", assignment, "--out", &folder.join("out")]);
    check_refusal(&outcome, &folder, assignment);
    outcome
}

fn check_refusal(outcome: &Outcome, folder: &Scratch, case: &str) {
    assert_eq!(outcome.code, 2, "{case}: {outcome:?}");
    assert_eq!(outcome.stdout, "", "{case}");
    assert_eq!(outcome.stderr.lines().count(), 1, "{case}: {}", outcome.stderr);
    assert!(folder.names().iter().all(|name| !name.contains("out")), "{case} left {:?}", folder.names());
}

/// Key, value as a user writes it, and words that name an accepted value.
const OUT_OF_RANGE: &[(&str, &str, &str)] = &[
    ("seed", "-1", "a whole number from 0"),
    ("scene.illuminance_lux", "nan", "1e-6 to 200,000"),
    ("scene.illuminance_lux", "inf", "1e-6 to 200,000"),
    ("scene.illuminance_lux", "0.0", "1e-6 to 200,000"),
    ("scene.illuminant", "sun", "D65, A, E, FL11"),
    ("scene.generator", "palace", "one of box"),
    ("scene.reflectance", "1.5", "0 to 1"),
    ("motion.kind", "jump", "still or sway"),
    ("motion.start_s", "nan", "0 to 10,000"),
    ("motion.start_s", "1e9", "0 to 10,000"),
    ("motion.scale", "0.0", "1e-9 to 100"),
    ("motion.offset_m", "[0.0, nan, 0.0]", "-1000000 to 1000000"),
    ("motion.offset_m", "[1e308, 0.0, 0.0]", "-1000000 to 1000000"),
    ("motion.offset_m", "[1.0, 2.0]", "an array of length 3"),
    ("motion.world_from_motion", "[0.0, 0.0, 0.0, 0.0]", "use norm 1"),
    ("run.frames", "0", "1 to 1,000,000"),
    ("run.rung", "gates", "expected, sampled, clocked, rtl"),
    ("run.effects", "prnu", "auto, all, none"),
    ("run.effects", "-glow", "known: prnu"),
    ("run.samples_per_pixel", "0", "1 to 4096"),
    ("run.accuracy", "-0.1", "0 to 10"),
    ("run.accuracy", "nan", "0 to 10"),
    ("run.threads", "-1", "a whole number from 0"),
    ("rig.baseline_mm", "-65.0", "0 to 10,000"),
    ("rig.imu", "brick", "mems_phone, adis16448, ideal, none"),
    ("rig.body_from_rig", "[1.0, 1.0, 0.0, 0.0]", "use norm 1"),
    ("optics.preset", "fisheye", "pinhole_90, radtan_90, kb4_120, kb4_190, double_sphere_195"),
    ("optics.model", "omni", "pinhole, radtan, kb4"),
    ("optics.horizontal_fov_deg", "180.0", "1 to 170"),
    ("optics.k1", "-3.0", "nearer to 0"),
    ("optics.k4", "0.1", "optics.model = kb4"),
    ("sensor.pixel.optical_crosstalk", "0.7", "0 to 0.5"),
    ("optics.k2", "inf", "-10 to 10"),
    ("optics.f_number", "0.0", "0.5 to 64"),
    ("optics.transmission", "0.0", "1e-6 to 1"),
    ("optics.pupil", "round", "thin_lens, aplanatic"),
    ("optics.roll_off", "cos3", "cos4, none, solid_angle, table"),
    ("sensor.preset", "paper", "paper_6t_vga"),
    ("sensor.width", "0", "16 to 4096"),
    ("sensor.width", "642", "whole groups of 4 pixels"),
    ("sensor.height", "0", "16 to 4096"),
    ("sensor.height", "4097", "16 to 4096"),
    ("sensor.temperature_k", "500.0", "0 to 450"),
    ("sensor.pixel.type", "7T", "3T, 4T, 5T, 6T"),
    ("sensor.pixel.pitch_um", "0.0", "0.001 to 100"),
    ("sensor.pixel.quantum_efficiency", "1.01", "0 to 1"),
    ("sensor.pixel.fill_factor", "0.0", "use 0.000001 to 1"),
    ("sensor.pixel.conversion_gain_uv_per_e", "1e-300", "0.001 to 1000"),
    ("sensor.pixel.full_well_e", "0.0", "1 to 1000000000"),
    ("sensor.pixel.dark_current_e_per_s", "-1.0", "0 to"),
    ("sensor.pixel.read_noise_uv", "inf", "0 to 1000000"),
    ("sensor.pixel.ktc_noise_uv", "nan", "0 to 1000000"),
    ("sensor.pixel.prnu", "0.6", "0 to 0.15"),
    ("sensor.pixel.dsnu_e", "-1.0", "0 to"),
    ("sensor.adc.bits", "0", "1 to 16"),
    ("sensor.adc.bits", "17", "1 to 16"),
    ("sensor.adc.bits", "ten", "a whole number from 0"),
    ("sensor.adc.bits", "10.5", "a whole number from 0"),
    ("sensor.adc.clock_hz", "0", "1 kHz to 100 GHz"),
    ("sensor.adc.full_scale_uv", "0.0", "100 to 10000000"),
    ("sensor.adc.gain", "nan", "0.001 to 1000"),
    ("sensor.adc.black_level_dn", "1023", "0 to 1022"),
    ("sensor.adc.column_gain_sigma", "1.0", "0 to 0.15"),
    ("sensor.adc.reset_counts", "70000", "0 to 65536"),
    ("sensor.adc.settle_signal_us", "-1.0", "0 to"),
    ("sensor.adc.ramp", "curved", "linear"),
    ("sensor.adc.cds", "twice", "none, analog, digital"),
    ("sensor.readout.shutter", "iris", "global, rolling"),
    ("sensor.readout.exposure", "sometimes", "fixed, auto"),
    ("sensor.readout.hts", "100", "use hts = 665"),
    ("sensor.readout.vts", "100", "vts = 498"),
    ("sensor.preset", "1", "name of a preset"),
    ("sensor.readout.pixel_rate_hz", "0", "1 kHz to 100 GHz"),
    // VTS 1724 less a margin of 20 lines of 19.333 us.
    ("sensor.readout.exposure_us", "33000.0", "32944.000"),
    ("compute.detector", "sift", "fast9"),
    ("compute.threshold", "0", "1 to 255"),
    ("compute.top_k", "500", "per_cell and cell_px do this"),
    ("compute.threshold", "300", "1 to 255"),
    ("compute.cell_px", "3", "16, 32 or 64"),
    ("compute.octaves", "5", "1 to 4"),
    ("compute.per_cell", "0", "1 to 4"),
    ("compute.smoothing", "gaussian", "off, binomial"),
    ("compute.pipeline_bits", "7", "8 to 16"),
    ("compute.overflow", "drop", "drop_weakest"),
    ("compute.subpixel", "1", "true or false"),
    ("link.lanes", "5", "1 to 4"),
    ("link.frequency_hz", "3", "40000000 to 2250000000"),
    ("link.format", "raw11", "raw8, raw10"),
    ("link.format", "raw8", "raw10 or wider"),
    ("link.mode", "smoke", "frames, features, both"),
    ("link.frames_every", "0", "1 (rows in every frame) or more"),
    ("link.fifo_rows", "0", "1 to 65535 rows"),
    ("link.when_full", "drop", "refuse, stall"),
    ("link.bit_error_rate", "0.5", "0 to 0.01"),
    ("link.bit_error_rate", "nan", "0 to 0.01"),
    ("tracker.window", "1", "2 to 50"),
    ("energy.technology", "3nm", "28nm, 22nm"),
    ("energy.adc", "flash", "single_slope, sar"),
    ("energy.port", "usb", "dphy, lvds"),
    ("energy.periphery", "none", "full, low_power"),
    ("energy.idle_bias", "2.0", "0 to 1"),
    ("energy.digital_v", "9.0", "0.2 to 5.5"),
    ("energy.port_lanes", "0", "1 to 128"),
    ("energy.sleep_period_ms", "0.0", "0.001 to"),
    ("energy.constant.link_byte.pj", "-1.0", "0 to"),
    ("energy.constant.link_byte.furlong", "1.0", "use pj"),
    ("host.model", "phone", "microcontroller"),
];

#[test]
fn a_value_that_cannot_be_is_refused_with_its_layer_key_and_what_would_do() {
    let mut seen = 0;
    for (key, value, would_do) in OUT_OF_RANGE {
        let said = refused(&format!("{key}={value}")).stderr;
        assert!(said.starts_with(&format!("sensel: --set: {key} = ")), "{key}={value}: {said}");
        // TOML may print a number in another form; words and whole numbers stay as they are.
        let shown = value.parse::<f64>().is_ok() || value.starts_with('[') || said.contains(value);
        assert!(shown && said.contains(would_do), "{key}={value} should say '{would_do}': {said}");
        seen += 1;
    }
    assert!(seen > 75, "only {seen} cases");
}

/// Without Verilator the rung that is made of it is refused by its name, not replaced by another.
#[test]
fn the_rung_rtl_without_verilator_is_refused() {
    let scratch = Scratch::new("no-verilator");
    let outcome = sensel_alone(&["run", "box", "--rung", "rtl", "--quiet", "--out", &scratch.join("out")]);
    check_refusal(&outcome, &scratch, "no Verilator");
    for word in ["run.rung = rtl", "needs Verilator", "or use clocked"] {
        assert!(outcome.stderr.contains(word), "{word}: {}", outcome.stderr);
    }
}

#[test]
fn keys_that_do_not_exist_are_refused_with_the_nearest_that_does() {
    for (assignment, hint) in [
        ("sensor.adc.bitz=3", "did you mean 'bits'?"),
        ("sensr.adc.bits=3", "did you mean 'sensor'?"),
        ("link.lane=3", "did you mean 'lanes'?"),
        ("sensor.adc.umbrella=3", "known here: bits, clock_hz"),
        ("link=1", "a table of keys"),
    ] {
        let said = refused(assignment).stderr;
        assert!(said.starts_with("sensel: --set: ") && said.contains(hint), "{assignment}: {said}");
    }
    for assignment in ["sensor.adc.bits", "=3", "a..b=3"] {
        assert!(refused(assignment).stderr.contains("expected"), "{assignment}");
    }
}

const GLB: &[u8] = include_bytes!("../scenes/bathroom/bathroom.glb");

/// Scenario text, a file beside it, the line that is to blame, and words of the message.
fn broken_scenarios() -> Vec<(String, &'static str, Vec<u8>, usize, &'static str)> {
    let glb = "[scene]\nfile = \"room.glb\"\n".to_owned();
    let moving = "[scene]\ngenerator = \"box\"\n[motion]\nfile = \"path.txt\"\n";
    let short: String = (0..9).map(|step| format!("{}.0 0 0 0 0 0 0 1\n", 1_500_000_000 + step)).collect();
    let fine: String = (0..99).map(|step| format!("{} 0 0 0 0 0 0 1\n", 0.01 * f64::from(step))).collect();
    vec![
        ("[sensor.adc]\nbits = 30\n".to_owned(), "a", vec![], 2, "sensor.adc.bits = 30: out of range; use 1 to 16"),
        ("[sensor.adc]\nbitz = 3\n".to_owned(), "a", vec![], 2, "did you mean 'bits'?"),
        ("\n[scen]\ngenerator = 3\n".to_owned(), "a", vec![], 2, "did you mean 'scene'?"),
        ("seed = 1\nbits = = 3\n".to_owned(), "a", vec![], 2, "expected"),
        ("seed = 1\nseed = 2\n".to_owned(), "a", vec![], 2, "duplicate key"),
        ("seed = 1\n[sensor.adc]\nclock_hz = 1000000\n".to_owned(), "a", vec![], 0, "use hts = 55536"),
        (format!("{glb}target = \"flat\"\n"), "a", vec![], 3, "exactly one of scene.file, scene.generator"),
        (glb.clone(), "a", vec![], 2, "is not there"),
        (glb.clone(), "room.glb", b"solid room\nendsolid\n".to_vec(), 2, "not a glTF file"),
        (glb.clone(), "room.glb", vec![], 2, "not a glTF file"),
        (glb.clone(), "room.glb", GLB[..12].to_vec(), 2, "cut off"),
        (glb.clone(), "room.glb", GLB[..100_000].to_vec(), 2, "cut off"),
        (glb.replace("room", "../room"), "a", vec![], 2, "leads out of the scenario's folder"),
        (glb.replace("room.glb", "/etc/passwd"), "a", vec![], 2, "leads out of the scenario's folder"),
        (moving.to_owned(), "a", vec![], 4, "is not there"),
        (moving.to_owned(), "path.txt", b"t x y z\n".to_vec(), 4, "line 1"),
        (moving.to_owned(), "path.txt", vec![0xff, 0xfe], 4, "is not text"),
        (format!("{moving}start_s = 0.0\n"), "path.txt", short.into(), 5, "gap of 1.000 s"),
        (
            format!("{moving}start_s = 0.5\n"),
            "path.txt",
            fine.clone().into(),
            5,
            "use an earlier start or fewer frames",
        ),
        (format!("{moving}start_s = 90.0\n"), "path.txt", fine.into(), 5, "an earlier start or fewer frames"),
    ]
}

#[test]
fn broken_scenarios_are_refused_with_file_and_line() {
    for (text, name, content, line, words) in broken_scenarios() {
        let folder = Scratch::new("broken");
        std::fs::create_dir(folder.path().join("mine")).unwrap();
        let file = folder.join("mine/scene.toml");
        std::fs::write(&file, &text).unwrap();
        if name != "a" {
            std::fs::write(folder.path().join("mine").join(name), content).unwrap();
        }
        let outcome = sensel(&["run", &file, "--frames", "30", "--out", &folder.join("out")]);
        check_refusal(&outcome, &folder, &text);
        let said = outcome.stderr;
        let in_file = said.starts_with(&format!("sensel: {file}:{line}: "))
            || said.starts_with(&format!("sensel: {file}: line {line}: "));
        assert!(in_file || line == 0, "line {line} of\n{text}: {said}");
        assert!(said.contains(words), "'{words}' for\n{text}: {said}");
    }
}

#[test]
fn a_run_longer_than_its_trajectory_is_refused() {
    let folder = Scratch::new("long");
    for more in [["--frames", "100000"], ["--set", "motion.start_s=1000.0"]] {
        let outcome = sensel(&["run", "bathroom", more[0], more[1], "--out", &folder.join("out")]);
        check_refusal(&outcome, &folder, more[1]);
        assert!(outcome.stderr.contains("motion.start_s = "), "{}", outcome.stderr);
        assert!(outcome.stderr.contains("outside the trajectory, which covers"), "{}", outcome.stderr);
    }
}

#[test]
fn what_is_not_there_yet_or_not_at_all_is_usage() {
    let folder = Scratch::new("usage");
    let outcome = sensel(&["sweep", "plan", "x.toml"]);
    assert!(outcome.code == 4 && outcome.stderr.contains("x.toml"), "{}", outcome.stderr);
    assert_eq!(sensel(&["sweep"]).code, 2);
    let outcome = sensel(&["plan", "ballroom"]);
    check_refusal(&outcome, &folder, "ballroom");
    assert!(outcome.stderr.contains("'ballroom' is not known; known: bathroom, bathroom_night"), "{}", outcome.stderr);
    let outcome = sensel(&["plan", "ballroom.toml"]);
    assert!(outcome.code == 2 && outcome.stderr.contains("ballroom.toml: is not there"), "{outcome:?}");
    let outcome = sensel(&["run", "box", "--keep", "moon"]);
    assert!(outcome.code == 2 && outcome.stderr.contains("packets, photons"), "{}", outcome.stderr);
    let wrong: [&[&str]; 4] = [&["dance"], &["run", "--dance"], &["run", "box", "--frames", "x"], &["config", "hide"]];
    for words in wrong {
        assert_eq!(sensel(words).code, 2, "{words:?}");
    }
}

#[test]
fn folders_of_others_stay_as_they_are_and_a_disk_that_says_no_is_exit_4() {
    let folder = Scratch::new("others");
    let theirs = folder.path().join("theirs");
    std::fs::create_dir(&theirs).unwrap();
    std::fs::write(theirs.join("thesis.tex"), "x").unwrap();
    let run = |out: &str| {
        let words = ["run", "box", "--frames", "1", "--set", "sensor.width=64", "--set", "sensor.height=48", "--out"];
        sensel(&[&words[..], &[out]].concat())
    };
    for out in [folder.join("theirs"), folder.join("theirs/thesis.tex")] {
        let outcome = run(&out);
        check_refusal(&outcome, &folder, &out);
        assert!(outcome.stderr.starts_with(&format!("sensel: out = {out}: ")), "{}", outcome.stderr);
    }
    let outcome = run(&folder.join("theirs/thesis.tex/deeper"));
    assert_eq!((outcome.code, outcome.stderr.lines().count()), (4, 1), "{outcome:?}");
    assert_eq!(names(&theirs), ["thesis.tex"]);
    assert_eq!(folder.names(), ["theirs"]);
}

#[test]
fn listings_are_json_on_stdout() {
    let presets = sensel(&["presets", "--json"]).json();
    for (list, name) in
        [("sensors", "paper_6t_vga"), ("lenses", "radtan_90"), ("technologies", "65nm"), ("scenes", "box")]
    {
        let items = presets[list].as_array().unwrap();
        assert!(items.iter().any(|item| item["name"] == name), "{name} in {list}: {items:?}");
    }
    let schema = sensel(&["schema"]).json();
    let sections = schema["properties"].as_object().unwrap();
    for section in
        ["seed", "scene", "motion", "run", "rig", "optics", "sensor", "compute", "link", "tracker", "energy", "host"]
    {
        assert!(sections.contains_key(section), "{section}");
    }
    assert!(schema["$defs"]["Adc"]["properties"]["bits"].is_object());
    let plan = sensel(&["plan", "box", "--json"]).json();
    assert!(plan["kept"].as_array().unwrap().iter().all(Value::is_string));
    assert!(plan["bias_e"].is_number() && plan["sigma_e"].is_number());
    for omitted in plan["omitted"].as_array().unwrap() {
        assert!(omitted["name"].is_string() && omitted["reason"].is_string(), "{omitted}");
        assert!(omitted["bias_e"].is_number() && omitted["sigma_e"].is_number(), "{omitted}");
    }
}

#[test]
fn every_value_of_the_effective_configuration_says_where_it_comes_from() {
    let outcome = sensel(&["config", "show", "box", "--set", "sensor.adc.bits=9", "--seed", "3"]);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (0, ""));
    let values: Vec<&str> = outcome.stdout.lines().filter(|line| line.contains(" = ")).collect();
    assert!(values.len() > 60, "{} values", values.len());
    for line in &values {
        assert!(line.contains(" # "), "without an origin: {line}");
    }
    let origin = |key: &str| {
        let line = values.iter().find(|line| line.starts_with(key)).unwrap();
        line.split_once(" # ").unwrap().1
    };
    assert_eq!(origin("bits = 9"), "--set");
    assert_eq!(origin("seed = 3"), "--set");
    let written = include_str!("../scenes/box/scene.toml").lines().position(|line| line.starts_with("generator"));
    let expected = format!("box/scene.toml:{}", 1 + written.unwrap());
    assert!(origin("generator").ends_with(&expected), "{}", origin("generator"));
    assert!(origin("vts").starts_with("preset paper_6t_vga:"), "{}", origin("vts"));
    assert!(origin("lanes").starts_with("defaults:"), "{}", origin("lanes"));
}

#[test]
fn timing_gives_the_clocks_of_the_paper_s_sensor() {
    let timing = sensel(&["timing", "box", "--json"]).json();
    // 928 clocks of 48 MHz a line, 1724 lines a frame, 20 of them kept free.
    let near = |key: &str, expected: f64| {
        let found = timing[key].as_f64().unwrap();
        assert!((found / expected - 1.0).abs() < 1e-12, "{key}: {found} for {expected}");
    };
    near("line_time_us", 928.0 / 48.0);
    near("frame_time_us", 1724.0 * 928.0 / 48.0);
    near("fps", 48e6 / (928.0 * 1724.0));
    assert!((timing["fps"].as_f64().unwrap() - 30.002).abs() < 5e-4);
    assert!((timing["line_time_us"].as_f64().unwrap() - 19.333).abs() < 5e-4);
    assert_eq!((&timing["hts"], &timing["vts"]), (&928.into(), &1724.into()));
    assert_eq!(timing["exposure_max_lines"], 1704);
    let latency_us = timing["latency_us"].as_f64().unwrap();
    assert!(latency_us > 480.0 * 928.0 / 48.0 && latency_us < 1724.0 * 928.0 / 48.0, "{latency_us} us");
    let utilisation = timing["link_utilisation"].as_f64().unwrap();
    assert!(utilisation > 0.0 && utilisation < 1.0, "{utilisation}");
}

#[test]
fn quiet_is_silent_and_data_goes_to_stdout_only() {
    let folder = Scratch::new("quiet");
    let out = folder.join("out");
    let words = ["run", "box", "--frames", "1", "--set", "sensor.width=64", "--set", "sensor.height=48", "--out", &out];
    let quiet = sensel(&[&words[..], &["--quiet"]].concat());
    // Warnings are said all the same: a picture so small has too few features.
    assert_eq!((quiet.code, quiet.stdout.as_str()), (0, ""));
    assert!(quiet.stderr.lines().all(|line| line.starts_with("sensel: warning: ")), "{}", quiet.stderr);
    let json = sensel(&[&words[..], &["--json"]].concat());
    assert!(json.stderr.lines().all(|line| line.starts_with("{\"warning\":")), "{}", json.stderr);
    assert_eq!(json.stdout, std::fs::read_to_string(folder.path().join("out/report.json")).unwrap());
    assert_eq!(folder.names(), ["out"], "a second run replaces the first and leaves nothing beside it");
}
