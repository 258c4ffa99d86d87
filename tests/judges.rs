//! Judges from outside, over what the program writes: a CSI-2 decoder written from the packet layout, evo, OpenCV.
#![cfg(feature = "outside")]
#![allow(clippy::unwrap_used)] // A helper of tests may panic as the tests do.

#[path = "judges/packets.rs"]
mod packets;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn scratch(name: &str) -> PathBuf {
    let folder = root().join("target/judged").join(name);
    std::fs::create_dir_all(folder.parent().unwrap()).unwrap();
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    folder
}

fn sensel(arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_sensel")).current_dir(root()).args(arguments).output().unwrap();
    assert!(output.status.success(), "sensel {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Runs a judge; its absence is a failure, not a pass.
fn judge(script: &str, arguments: &[&str]) -> serde_json::Value {
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let script = root().join("tests/judges").join(script);
    let output = Command::new(&python).arg(&script).args(arguments).output().expect("the judges' Python runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{} {arguments:?}: {text}{errors}", script.display());
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn text_of(path: &Path) -> String {
    path.display().to_string()
}

#[test]
fn the_standard_decoder_reads_every_kept_packet() {
    let mut frames = 0;
    for (bits, kind) in
        [(6, "raw6"), (7, "raw7"), (8, "raw8"), (10, "raw10"), (12, "raw12"), (14, "raw14"), (16, "raw16")]
    {
        let out = scratch(&format!("packets{bits}"));
        let set_bits = format!("sensor.adc.bits={bits}");
        let clock = "sensor.adc.clock_hz=8000000000";
        sensel(&[
            "run",
            "box",
            "--frames",
            "2",
            "--keep",
            "packets",
            "--quiet",
            "--set",
            &set_bits,
            "--set",
            clock,
            "--set",
            "link.lanes=4",
            "--set",
            "sensor.width=160",
            "--set",
            "sensor.height=120",
            "--out",
            &text_of(&out),
        ]);
        for camera in ["cam0.csi2", "cam1.csi2"] {
            let found = judge(
                "csi2_check.py",
                &[&text_of(&out.join(camera)), "--expect-width", "160", "--expect-height", "120"],
            );
            assert_eq!(found["frames"], 2, "{found}");
            assert_eq!(found["packets"][kind], 240, "{found}");
            // Cell rows give their features in the gaps between rows, so there is more than one packet.
            assert!(found["packets"]["user_0x30"].as_u64().unwrap() > 2, "{found}");
            assert!(found["feature_bytes"].as_u64().unwrap() > 12 * 2, "{found}");
            frames += 2;
        }
    }
    assert_eq!(frames, 28);
}

#[test]
fn evo_agrees_with_the_figures_of_the_report_to_a_micrometre() {
    let out = scratch("figures");
    let smaller = ["--set", "sensor.width=400", "--set", "sensor.height=300"];
    sensel(&[&["run", "box", "--frames", "40", "--quiet", "--out", &text_of(&out)], &smaller[..]].concat());
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    let (truth, estimate) = (text_of(&out.join("trajectory_gt.tum")), text_of(&out.join("trajectory_est.tum")));
    let evo = judge("evo_check.py", &[&truth, &estimate]);
    let pairs = [
        ("ate_m", &evo["ape"]["se3"]["trans"]["rmse"]),
        ("rpe_m", &evo["rpe"]["se3"]["sec_1"]["trans"]["rmse"]),
        ("jitter_frame_m", &evo["rpe"]["se3"]["frames_1"]["trans"]["rmse"]),
        ("jitter_d2_m", &evo["jitter"]["se3"]["d2_sigma_m"]),
    ];
    for (name, theirs) in pairs {
        let (ours, theirs) = (report["tracking"][name].as_f64().unwrap(), theirs.as_f64().unwrap());
        assert!((ours - theirs).abs() < 1e-6, "{name}: {ours} here, {theirs} by evo");
    }
}

#[test]
fn the_default_run_is_tracked_within_five_centimetres_by_evo_over_its_first_thirty_five_frames() {
    let out = scratch("default");
    sensel(&["run", "--quiet", "--frames", "35", "--out", &text_of(&out)]);
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["tracking"]["tracked_fraction"], 1.0);
    let (truth, estimate) = (text_of(&out.join("trajectory_gt.tum")), text_of(&out.join("trajectory_est.tum")));
    let evo = judge("evo_check.py", &[&truth, &estimate, "--max-ape-se3", "0.05"]);
    assert_eq!(evo["n_matched"], 35);
    for (name, theirs) in [("ate_m", &evo["ape"]["se3"]), ("rpe_m", &evo["rpe"]["se3"]["sec_1"])] {
        let (ours, theirs) = (report["tracking"][name].as_f64().unwrap(), theirs["trans"]["rmse"].as_f64().unwrap());
        assert!((ours - theirs).abs() < 1e-6, "{name}: {ours} here, {theirs} by evo");
    }
}

#[test]
fn evo_reads_the_ground_truth_of_the_euroc_folder() {
    let out = scratch("euroc");
    sensel(&["run", "box", "--frames", "12", "--quiet", "--out", &text_of(&out)]);
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let table = text_of(&out.join("mav0/state_groundtruth_estimate0/data.csv"));
    let code = "import sys; from evo.tools import file_interface; \
                t = file_interface.read_euroc_csv_trajectory(sys.argv[1]); ok, why = t.check(); assert ok, why; print(t.num_poses)";
    let output = Command::new(python).args(["-c", code, &table]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let poses: u32 = String::from_utf8_lossy(&output.stdout).trim().parse().unwrap();
    assert!(poses >= 12, "{poses} poses");
}

#[test]
fn every_corner_and_score_equals_opencv() {
    let mut pictures = 0;
    let folder = scratch("fast");
    std::fs::create_dir_all(&folder).unwrap();
    let out = scratch("fast_frames");
    sensel(&["run", "box", "--frames", "1", "--quiet", "--out", &text_of(&out)]);
    let data = out.join("mav0/cam0/data");
    let picture = std::fs::read_dir(&data).unwrap().next().unwrap().unwrap().path();
    for threshold in ["1", "10", "20", "40"] {
        let list = folder.join(format!("t{threshold}.csv"));
        sensel(&[
            "features",
            &text_of(&picture),
            "--detector",
            "fast9",
            "--threshold",
            threshold,
            "--out",
            &text_of(&list),
        ]);
        let found = judge("fast_check.py", &[&text_of(&picture), &text_of(&list), "--threshold", threshold]);
        assert_eq!(found["wrong"], 0, "{found}");
        pictures += 1;
    }
    assert_eq!(pictures, 4);
}
