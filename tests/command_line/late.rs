//! What used to end a run late, in a panic or without memory, is refused beforehand or has a report that says so.

use std::fs::File;
use std::process::{Command, Stdio};

use serde_json::Value;

use super::{Scratch, check_refusal, sensel};

/// A flat target on a small array.
const FLAT: [&str; 7] = ["flat", "--frames", "2", "--set", "sensor.width=64", "--set", "sensor.height=48"];

#[test]
fn motions_without_measure_are_refused_before_the_first_frame() {
    let folder = Scratch::new("measure");
    let out = folder.join("out");
    let line = |t_s: f64, x_m: &str| format!("{t_s} {x_m} 0 0 0 0 0 1\n");
    let far: String = (0..40).map(|k| line(0.05 * f64::from(k), if k % 2 == 0 { "0" } else { "1e200" })).collect();
    let fast: String = (0..40).map(|k| line(0.05 * f64::from(k), if k % 2 == 0 { "0" } else { "9e5" })).collect();
    std::fs::create_dir(folder.path().join("in")).unwrap();
    let mut tried = 0;
    for (name, text, words) in [("far", far, "within 1000000 m"), ("fast", fast, "at most 1000000 m/s")] {
        let scenario = format!("[scene]\ntarget = \"flat\"\n[motion]\nfile = \"{name}.txt\"\n");
        std::fs::write(folder.path().join(format!("in/{name}.txt")), text).unwrap();
        std::fs::write(folder.path().join(format!("in/{name}.toml")), scenario).unwrap();
        let toml = folder.join(&format!("in/{name}.toml"));
        let outcome = sensel(&["run", &toml, "--frames", "3", "--out", &out]);
        check_refusal(&outcome, &folder, name);
        assert!(outcome.stderr.contains(words), "{}", outcome.stderr);
        tried += 1;
    }
    // Set, frames, and what is named.
    let cases: [(&[&str], &str, &str); 5] = [
        (&["motion.offset_m=[1e308, 0.0, 0.0]"], "2", "use -1000000 to 1000000"),
        (&["sensor.pixel.conversion_gain_uv_per_e=1e-300"], "2", "use 0.001 to 1000"),
        (&["motion.kind=sway", "sensor.readout.frame_rate_hz=1.0", "rig.imu=none"], "1000000", "within 40000 s"),
        (&["motion.kind=walk", "sensor.readout.frame_rate_hz=1.0", "rig.imu=none"], "1000000", "within 80000 s"),
        (&["sensor.readout.frame_rate_hz=1.0"], "1000000", "use 5 or less"),
    ];
    for (set, frames, words) in cases {
        let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
        let arguments = [&["run", "flat", "--frames", frames, "--out", &out][..], &set].concat();
        let outcome = sensel(&arguments);
        check_refusal(&outcome, &folder, words);
        assert!(outcome.stderr.contains(words), "{}", outcome.stderr);
        tried += 1;
    }
    assert_eq!(tried, 7);
}

#[test]
fn an_effect_without_a_bound_that_is_left_out_leaves_the_plan_without_one_and_the_report_says_so() {
    let folder = Scratch::new("unbounded");
    let out = folder.join("out");
    let set = ["--set", "sensor.pixel.stuck_ppm=1000.0", "--effects", "none"];
    let report = sensel(&[&["run"][..], &FLAT, &set, &["--out", &out, "--json"]].concat()).json();
    assert_eq!(report["plan"]["bias_e"], Value::Null);
    assert!(report["not_measurable"]["plan.bias_e"].as_str().unwrap().contains("nothing bounds"));
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("unbounded") && !page.contains("NaN") && !page.contains(">inf"));

    let plan =
        sensel(&["plan", "flat", "--json", "--set", "sensor.pixel.stuck_ppm=1000.0", "--effects", "none"]).json();
    assert_eq!((&plan["is_bounded"], &plan["bias_e"]), (&false.into(), &Value::Null));
    let omitted = plan["omitted"].as_array().unwrap();
    for effect in omitted {
        assert_eq!(effect["is_bounded"], effect["bias_e"].is_number(), "{effect}");
    }
    assert!(omitted.iter().any(|effect| effect["name"] == "stuck_pixels" && effect["is_bounded"] == false));
    let plan = sensel(&["plan", "flat", "--json"]).json();
    assert_eq!(plan["is_bounded"], true);
}

/// A stderr or stdout that takes nothing, as a full disk.
#[cfg(target_os = "linux")]
#[test]
fn a_full_stderr_is_passed_over_and_a_full_stdout_is_exit_4() {
    let folder = Scratch::new("full");
    let out = folder.join("out");
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    let run = |arguments: &[&str], stdout: Stdio, stderr: Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sensel"));
        command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).stdout(stdout).stderr(stderr);
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let flat = [&["run"][..], &FLAT, &["--out", &out]].concat();
    let mut tried = 0;
    for (arguments, code) in [
        (&["run", "flat", "--set", "sensor.adc.bits=99"][..], 2),
        (&["run", "nowhere"], 2),
        (&["walk"], 2),
        (&["schema"], 0),
        (&flat, 0),
    ] {
        assert_eq!(run(arguments, Stdio::piped(), full()).0, Some(code), "{arguments:?} with a full stderr");
        tried += 1;
    }
    for arguments in [&["schema"][..], &["presets"], &["--help"], &["--version"], &["plan", "flat"], &flat] {
        let (code, words) = run(arguments, full(), Stdio::piped());
        assert_eq!(code, Some(4), "{arguments:?} with a full stdout");
        assert!(words.contains("stdout: "), "{arguments:?}: {words}");
        assert_eq!(run(arguments, full(), full()).0, Some(4), "{arguments:?} with both full");
        // For a program the last line is an error.
        if arguments == ["schema"] {
            let (_, words) = run(&["schema", "--json"], full(), Stdio::piped());
            assert!(words.lines().last().is_some_and(|line| line.starts_with("{\"error\":")), "{words}");
        }
        tried += 1;
    }
    assert_eq!(tried, 11);
}
