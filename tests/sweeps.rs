//! Many runs: the photon store changes no byte, sweeps end the same whichever way their cells ran, and bad sweeps are refused in words.

#![allow(clippy::unwrap_used)]

use crate::common;
#[path = "sweeps/disk.rs"]
mod disk;
#[path = "sweeps/kill.rs"]
mod kill;
#[path = "sweeps/outside.rs"]
mod outside;
#[path = "sweeps/refusals.rs"]
mod refusals;
#[path = "sweeps/search.rs"]
mod search;

use std::path::Path;

use common::{Outcome, Scratch, outcome, sensel_command, sensel_in_cache};
use serde_json::Value;

/// A room of few pixels and frames, two designs, two seeds.
pub const SMALL: &str = r#"
scenario = "box"
seeds = 2
[set]
"run.frames" = 3
"run.samples_per_pixel" = 1
"sensor.width" = 96
"sensor.height" = 72
"run.render_quantum_efficiency" = 0.5
"run.render_full_well_e" = 9000.0
[[factor]]
name = "bits"
key = "sensor.adc.bits"
values = [4, 10]
[[factor]]
name = "read_noise_uv"
key = "sensor.pixel.read_noise_uv"
values = [100.0, 600.0]
"#;

/// A sweep's file, its folder and its cache in one scratch folder.
pub struct SweepTest {
    pub scratch: Scratch,
}

impl SweepTest {
    pub fn new(name: &str, text: &str) -> Self {
        let scratch = Scratch::new(name);
        std::fs::write(scratch.path().join("sweep.toml"), text).unwrap();
        Self { scratch }
    }

    pub fn arguments(&self, part: &str, out: &str, more: &[&str]) -> Vec<String> {
        let (file, out) = (self.scratch.join("sweep.toml"), self.scratch.join(out));
        let own = ["sweep", part, &file, "--out", &out].map(str::to_owned).to_vec();
        with_store(own.into_iter().chain(more.iter().map(|word| (*word).to_owned())).collect())
    }

    /// Runs a part with a separate cache.
    pub fn sweep(&self, part: &str, out: &str, more: &[&str]) -> Outcome {
        sensel_in_cache(&self.arguments(part, out, more), &self.scratch.join("cache"))
    }

    pub fn done(&self, part: &str, out: &str, more: &[&str]) -> Outcome {
        let outcome = self.sweep(part, out, more);
        assert_eq!(outcome.code, 0, "{part}: {}", outcome.stderr);
        outcome
    }

    /// Both files that `gather` writes.
    pub fn gathered(&self, out: &str) -> [Vec<u8>; 2] {
        self.done("gather", out, &["--quiet"]);
        ["cells.parquet", "cells.csv"].map(|file| std::fs::read(self.scratch.path().join(out).join(file)).unwrap())
    }
}

/// The same words, with a photon store unless they say what store.
fn with_store(mut words: Vec<String>) -> Vec<String> {
    if !words.iter().any(|word| word == "--photons-gib") {
        words.extend(["--photons-gib", "1"].map(str::to_owned));
    }
    words
}

fn run_in(scratch: &Scratch, out: &str, cache: &str, more: &[&str]) -> Value {
    let out = scratch.join(out);
    let small = ["--set", "sensor.width=96", "--set", "sensor.height=72"];
    let own = ["run", "box", "--frames", "3", "--json", "--keep", "photons,packets", "--out", &out];
    let words = [&own[..], &small, more].concat();
    sensel_in_cache(&with_store(words.into_iter().map(str::to_owned).collect()), &scratch.join(cache)).json()
}

/// Everything that a folder holds but what was measured.
fn bytes_of(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(inside) = folders.pop() {
        for entry in std::fs::read_dir(inside).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            if path.is_dir() {
                folders.push(path);
            } else if !name.starts_with("report.") && name != ".sensel" {
                files.push((name, std::fs::read(path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

#[test]
fn a_run_from_the_store_has_the_bytes_of_one_without_it() {
    let scratch = Scratch::new("store");
    let without = run_in(&scratch, "without", "a", &["--photons-gib", "0"]);
    let filling = run_in(&scratch, "filling", "b", &[]);
    let from = run_in(&scratch, "from", "b", &["--threads", "1"]);
    let entries = common::names(&scratch.path().join("b/photons")).len();
    assert_eq!(entries, 6, "three frames of two cameras");
    assert!(!scratch.path().join("a/photons").exists());
    let files = bytes_of(&scratch.path().join("without"));
    assert!(files.len() > 8, "{}", files.len());
    for (name, report) in [("filling", &filling), ("from", &from)] {
        assert!(bytes_of(&scratch.path().join(name)) == files, "{name}");
        for part in ["hashes", "scenario", "tracking", "energy", "features"] {
            let strip = |report: &Value| {
                let mut value = report[part].clone();
                if let Some(map) = value.as_object_mut() {
                    map.remove("ms_per_frame");
                }
                value
            };
            assert_eq!(strip(report), strip(&without), "{name}: {part}");
        }
    }
    // Another sensor takes the same photons; another light does not.
    let other = ["--set", "sensor.adc.bits=6", "--seed", "9"];
    assert_eq!(run_in(&scratch, "other", "b", &other)["hashes"]["photons"], without["hashes"]["photons"]);
    assert_eq!(common::names(&scratch.path().join("b/photons")).len(), entries);
    run_in(&scratch, "darker", "b", &["--set", "scene.illuminance_lux=100"]);
    assert_eq!(common::names(&scratch.path().join("b/photons")).len(), 2 * entries);
}

#[test]
fn a_damaged_entry_is_said_and_rendered_again() {
    let scratch = Scratch::new("damage");
    let first = run_in(&scratch, "one", "c", &[]);
    let folder = scratch.path().join("c/photons");
    let entry = folder.join(&common::names(&folder)[0]);
    let whole = std::fs::read(&entry).unwrap();
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 4;
    std::fs::write(&entry, damaged).unwrap();
    let out = scratch.join("two");
    let small = ["--set", "sensor.width=96", "--set", "sensor.height=72"];
    let own = ["run", "box", "--frames", "3", "--photons-gib", "1", "--out", &out];
    let again = sensel_in_cache(&[&own[..], &small].concat(), &scratch.join("c"));
    assert!(again.code == 0 && again.stderr.contains("damaged"), "{}", again.stderr);
    assert!(std::fs::read(&entry).unwrap() == whole, "it is stored again");
    let report: Value =
        serde_json::from_slice(&std::fs::read(scratch.path().join("two/report.json")).unwrap()).unwrap();
    assert_eq!(report["hashes"], first["hashes"]);
}

#[test]
fn a_sweep_gathers_the_same_bytes_on_one_thread_on_two_in_parts_and_by_names() {
    let test = SweepTest::new("sweep", SMALL);
    let plan = test.done("plan", "one", &["--json"]).json();
    let cells = plan["cells"].as_array().unwrap().clone();
    assert_eq!((cells.len(), plan["points"].as_u64(), plan["groups"].as_u64()), (8, Some(4), Some(1)));
    let ran = test.done("run", "one", &["--threads", "1", "--json"]).json();
    assert_eq!((ran["run"].as_u64(), ran["failed"].as_u64()), (Some(8), Some(0)));
    assert_eq!((ran["photons"]["rendered"].as_u64(), ran["photons"]["found"].as_u64()), (Some(6), Some(42)));
    let one = test.gathered("one");
    assert!(one[0].starts_with(b"PAR1") && one[0].ends_with(b"PAR1"));
    let csv = String::from_utf8(one[1].clone()).unwrap();
    assert_eq!(csv.lines().count(), 9);
    let head = csv.lines().next().unwrap();
    assert!(head.starts_with("cell,status,bits,read_noise_uv,seed,config.sensor.adc.bits,"), "{head}");
    for figure in ["tracking.ate_m", "energy.power_mw", "bandwidth.link_bits_per_s", "scenario.render_variance_ratio"] {
        assert!(head.split(',').any(|name| name == figure), "{figure}");
    }
    assert!(!head.contains("ms_per_frame"), "nothing that was measured");
    // Nothing is left to run.
    let again = test.done("run", "one", &["--json"]).json();
    assert_eq!(again["run"].as_u64(), Some(0));
    test.done("run", "two", &["--threads", "2", "--quiet"]);
    assert!(test.gathered("two") == one, "two threads");
    for part in ["2/3", "1/3", "3/3"] {
        test.done("run", "parts", &["--shard", part, "--quiet"]);
    }
    assert!(test.gathered("parts") == one, "parts");
    let names: Vec<&str> = cells.iter().rev().map(|cell| cell["cell"].as_str().unwrap()).collect();
    for (number, names) in names.chunks(3).enumerate() {
        let file = test.scratch.join(&format!("ids{number}"));
        std::fs::write(&file, names.join("\n")).unwrap();
        test.done("run", "named", &["--cells", &file, "--photons-gib", "0", "--quiet"]);
    }
    assert!(test.gathered("named") == one, "by names, without a store");
    let page = test.done("report", "one", &["--spec", "tracked_fraction >= 0 for 50 %"]);
    assert!(page.stdout.contains("report.html"), "{}", page.stdout);
    let page = std::fs::read_to_string(test.scratch.path().join("one/report.html")).unwrap();
    for words in ["Paired differences", "First-order", "on the front", "Specifications", "id=\"cells\""] {
        assert!(page.contains(words), "{words}");
    }
    assert!(!page.contains("http://") && !page.contains("https://"), "the page needs no network");
}

#[test]
fn every_method_lays_out_its_points_and_draws_the_same_again() {
    let design = |method: &str| {
        format!(
            "scenario = \"box\"\nmethod = \"{method}\"\nsamples = 16\nseed = 3\n\
             [[factor]]\nname = \"noise\"\nkey = \"sensor.pixel.read_noise_uv\"\nlow = 50.0\nhigh = 800.0\nspacing = \"log\"\n\
             [[factor]]\nname = \"bits\"\nkey = \"sensor.adc.bits\"\nlow = 1\nhigh = 12\nwhole = true\n"
        )
    };
    let mut layouts = std::collections::BTreeSet::new();
    for method in ["random", "latin_hypercube", "sobol"] {
        let sweep = sensel::sweep::SweepFile::parse("s.toml", &design(method)).unwrap();
        let points = sensel::sweep::design::points(&sweep).unwrap();
        assert_eq!(points, sensel::sweep::design::points(&sweep).unwrap(), "{method}");
        assert_eq!(points.len(), 16);
        let noise: Vec<f64> = points.iter().map(|point| point[0].shown.as_float().unwrap()).collect();
        assert!(noise.iter().all(|value| (50.0..=800.0).contains(value)), "{method}: {noise:?}");
        assert!(points.iter().all(|point| (1..=12).contains(&point[1].shown.as_integer().unwrap())));
        if method != "random" {
            // A sixteenth of the logarithm's range each: one point in every part of a hypercube, and of a Sobol' net.
            let part =
                |value: f64| sensel::num::u32_truncated(16.0 * libm::log(value / 50.0) / libm::log(16.0)).min(15);
            let mut parts: Vec<u32> = noise.iter().map(|&value| part(value)).collect();
            parts.sort_unstable();
            assert_eq!(parts, (0..16).collect::<Vec<_>>(), "{method}");
        }
        layouts.insert(format!("{points:?}"));
    }
    assert_eq!(layouts.len(), 3);
}

/// The program with these words, started and left running.
pub fn started(test: &SweepTest, part: &str, out: &str, more: &[&str]) -> std::process::Child {
    let mut command = sensel_command(&test.arguments(part, out, more));
    command.env("XDG_CACHE_HOME", test.scratch.path());
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap()
}

/// The same to its end.
pub fn ended(test: &SweepTest, part: &str, out: &str, more: &[&str]) -> Outcome {
    outcome(sensel_command(&test.arguments(part, out, more)))
}
