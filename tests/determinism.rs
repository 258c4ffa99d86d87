//! One config, seed and version give the same bytes: on any number of threads, again, and from the configuration that a run
//! itself wrote.

#![allow(clippy::unwrap_used)]

use crate::common;
#[path = "determinism/photons.rs"]
mod photons;

use common::{Scratch, run_box, sensel};
use serde_json::Value;

const FRAMES: u32 = 3;

fn hashes(report: &Value) -> &Value {
    let hashes = &report["hashes"];
    for stage in ["photons", "codes", "features", "energy", "poses"] {
        assert_eq!(hashes[stage].as_str().map(str::len), Some(64), "{stage}: {hashes}");
    }
    hashes
}

fn bytes(folder: &Scratch, run: &str, file: &str) -> Vec<u8> {
    std::fs::read(folder.path().join(run).join(file)).unwrap()
}

/// Everything in an output folder that holds no measured time.
const FILES: [&str; 8] = [
    "trajectory_gt.tum",
    "trajectory_est.tum",
    "cam0.csi2",
    "cam1.csi2",
    "mav0/imu0/data.csv",
    "mav0/cam1/data.csv",
    "mav0/cam0/sensor.yaml",
    "mav0/state_groundtruth_estimate0/data.csv",
];

#[test]
fn threads_and_repetition_change_no_byte() {
    let folder = Scratch::new("determinism");
    let keep = ["--keep", "packets"];
    let one = run_box(&folder.join("one"), FRAMES, &[&keep[..], &["--threads", "1"]].concat());
    for (name, threads) in [("two", "2"), ("three", "3"), ("again", "1")] {
        let other = run_box(&folder.join(name), FRAMES, &[&keep[..], &["--threads", threads]].concat());
        assert_eq!(hashes(&other), hashes(&one), "{threads} threads");
        assert_eq!(other["config_hash"], one["config_hash"], "threads decide no byte, so they are not in the hash");
        for part in ["tracking", "plan", "bandwidth", "features", "frames", "energy", "link", "timing"] {
            let strip = |report: &Value| {
                let mut value = report[part].clone();
                if let Some(map) = value.as_object_mut() {
                    map.remove("ms_per_frame");
                    if let Some(waterfall) = map.get_mut("waterfall").and_then(Value::as_object_mut) {
                        waterfall.remove("measured_host_us");
                    }
                }
                value
            };
            assert_eq!(strip(&other), strip(&one), "{part} on {threads} threads");
        }
        for file in FILES {
            assert!(bytes(&folder, name, file) == bytes(&folder, "one", file), "{file} on {threads} threads");
        }
    }
}

#[test]
fn another_seed_is_another_run_in_the_same_room() {
    let folder = Scratch::new("seeds");
    let one = run_box(&folder.join("one"), 1, &["--seed", "1"]);
    let two = run_box(&folder.join("two"), 1, &["--seed", "2"]);
    assert_eq!((&one["seed"], &two["seed"]), (&1.into(), &2.into()));
    assert_ne!(one["config_hash"], two["config_hash"]);
    assert_eq!(hashes(&one)["photons"], hashes(&two)["photons"], "the seed changes the sensor's noise and no photon");
    for stage in ["codes", "features"] {
        assert_ne!(hashes(&one)[stage], hashes(&two)[stage], "{stage}");
    }
    // The rig moves alike and the room is the same one.
    assert_eq!(bytes(&folder, "one", "trajectory_gt.tum"), bytes(&folder, "two", "trajectory_gt.tum"));
    let mean = |report: &Value| report["frames"][0]["mean_code_dn"].as_f64().unwrap();
    assert!((mean(&one) / mean(&two) - 1.0).abs() < 0.01, "{} and {} DN", mean(&one), mean(&two));
}

#[test]
fn another_die_changes_codes_and_no_photon() {
    let folder = Scratch::new("dies");
    let one = run_box(&folder.join("one"), 1, &[]);
    let two = run_box(&folder.join("two"), 1, &["--set", "sensor.die=2"]);
    assert_eq!(hashes(&one)["photons"], hashes(&two)["photons"]);
    assert_ne!(hashes(&one)["codes"], hashes(&two)["codes"]);
}

#[test]
fn the_configuration_that_a_run_wrote_gives_the_same_run_again() {
    let folder = Scratch::new("effective");
    let more = ["--set", "sensor.adc.bits=9", "--set", "sensor.readout.shutter=rolling", "--seed", "7"];
    let first = run_box(&folder.join("first"), 2, &more);
    let config = folder.join("first/config.toml");
    let second = sensel(&["run", &config, "--out", &folder.join("second"), "--json"]).json();
    assert_eq!(hashes(&second), hashes(&first));
    assert_eq!(second["config_hash"], first["config_hash"]);
    assert_eq!(bytes(&folder, "second", "config.toml"), bytes(&folder, "first", "config.toml"));
    for file in ["trajectory_gt.tum", "trajectory_est.tum", "mav0/imu0/data.csv"] {
        assert!(bytes(&folder, "second", file) == bytes(&folder, "first", file), "{file}");
    }
}

/// The report without the paths that it says were measured.
fn without_measured(folder: &Scratch, run: &str) -> (String, Value) {
    let whole: Value = serde_json::from_slice(&bytes(folder, run, "report.json")).unwrap();
    let mut rest = whole.clone();
    for path in whole["measured"]["keys"].as_array().unwrap() {
        let keys: Vec<&str> = path.as_str().unwrap().split('.').collect();
        let (last, parents) = keys.split_last().unwrap();
        let parent = parents.iter().try_fold(&mut rest, |value, key| value.get_mut(*key)).unwrap();
        parent.as_object_mut().unwrap().remove(*last);
    }
    (serde_json::to_string_pretty(&rest).unwrap(), whole)
}

#[test]
fn without_its_measured_keys_a_report_is_the_same_bytes_on_any_number_of_threads() {
    let folder = Scratch::new("measured");
    for (name, threads) in [("one", "1"), ("two", "2")] {
        run_box(&folder.join(name), FRAMES, &["--threads", threads]);
    }
    let ((one, whole), (two, other)) = (without_measured(&folder, "one"), without_measured(&folder, "two"));
    assert!(one == two, "reports differ beside what was measured");
    assert_eq!((&whole["measured"]["threads"], &other["measured"]["threads"]), (&1.into(), &2.into()));
    assert!(whole["cost"].is_object() && whole["tracking"]["ms_per_frame"].is_number());
    assert_eq!(whole["config"]["sensor"]["width"], 320, "the configuration is an object");
    assert!(bytes(&folder, "one", "config.toml") == bytes(&folder, "two", "config.toml"), "threads decide no byte");
}
