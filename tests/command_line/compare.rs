//! `sensel compare` as a user meets it: a run against itself, against another design, and what is refused.

use std::fs;

use serde_json::Value;

use crate::common::{Outcome, Scratch, sensel};

/// A run of a tiny box into `out`.
fn run(scratch: &Scratch, name: &str, more: &[&str]) -> String {
    let out = scratch.join(name);
    let words = ["run", "box", "--frames", "14", "--quiet", "--threads", "1", "--set", "sensor.width=96"];
    let rest = ["--set", "sensor.height=72", "--set", "run.samples_per_pixel=1", "--out", &out];
    let outcome = sensel(&[&words[..], &rest[..], more].concat());
    assert_eq!(outcome.code, 0, "{outcome:?}");
    out
}

fn compare(scratch: &Scratch, folders: &[&str]) -> Outcome {
    let out = scratch.join("compared");
    sensel(&[&["compare"], folders, &["--json", "--out", &out]].concat())
}

fn figure<'a>(compared: &'a Value, key: &str) -> &'a Value {
    compared["others"][0]["figures"].as_array().unwrap().iter().find(|figure| figure["key"] == key).unwrap()
}

#[test]
fn a_run_equals_itself_and_a_design_of_fewer_bits_sends_less() {
    let scratch = Scratch::new("compare");
    let a = run(&scratch, "a", &[]);
    let b = run(&scratch, "b", &["--set", "sensor.adc.bits=8", "--set", "sensor.adc.black_level_dn=16"]);

    let outcome = compare(&scratch, &[&a, &a]);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let same: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let figures = same["others"][0]["figures"].as_array().unwrap();
    let compared = figures.iter().filter(|figure| figure["verdict"] == "no difference").count();
    let other = figures.iter().filter(|figure| figure["verdict"] == "better" || figure["verdict"] == "worse").count();
    assert!(compared >= 8 && other == 0, "{figures:?}");

    let outcome = compare(&scratch, &[&a, &b]);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let found: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let keys: Vec<&str> =
        found["others"][0]["config"].as_array().unwrap().iter().map(|key| key["key"].as_str().unwrap()).collect();
    assert!(keys.contains(&"sensor.adc.bits") && keys.len() <= 4, "{keys:?}");
    assert_eq!(figure(&found, "link_bits_per_s")["verdict"], "better");
    let page = fs::read_to_string(scratch.path().join("compared/compare.html")).unwrap();
    assert!(page.contains("wiper") && page.contains("sensor.adc.bits") && !page.contains("http://"));
}

#[test]
fn what_is_no_run_is_cut_short_or_of_another_scene_is_refused_in_one_line() {
    let scratch = Scratch::new("compare-refused");
    let a = run(&scratch, "a", &[]);
    let copy = |name: &str, file: &str, text: Option<&str>| {
        let folder = scratch.path().join(name);
        fs::create_dir_all(folder.join("mav0")).unwrap();
        for file in ["report.json", "trajectory_gt.tum", "trajectory_est.tum"] {
            fs::copy(std::path::Path::new(&a).join(file), folder.join(file)).unwrap();
        }
        let path = folder.join(file);
        text.map_or_else(|| fs::remove_file(&path), |text| fs::write(&path, text)).unwrap();
        folder.display().to_string()
    };
    let report = fs::read_to_string(std::path::Path::new(&a).join("report.json")).unwrap();
    let truth = fs::read_to_string(std::path::Path::new(&a).join("trajectory_gt.tum")).unwrap();
    let fewer = truth.lines().take(9).collect::<Vec<_>>().join("\n");
    let elsewhere = report.replace("\"generator\": \"box\"", "\"generator\": \"hall\"");
    assert_ne!(elsewhere, report);
    fs::create_dir(scratch.path().join("empty")).unwrap();
    let cases = [
        (scratch.join("nowhere"), "is no folder"),
        (scratch.join("empty"), "is no run"),
        (copy("stopped", "report.json", None), "cut short"),
        (copy("half", "report.json", Some(&report[..report.len() / 2])), "cut short"),
        (copy("fewer", "trajectory_gt.tum", Some(&fewer)), "cut short"),
        (copy("lost", "trajectory_est.tum", None), "cut short"),
        (copy("hall", "report.json", Some(&elsewhere)), "another scene"),
        (copy("words", "report.json", Some("{}")), "no report of this version"),
    ];
    for (folder, words) in cases {
        let outcome = compare(&scratch, &[&a, &folder]);
        assert_eq!(outcome.code, 2, "{folder}: {outcome:?}");
        assert!(outcome.stderr.contains(words) && outcome.stderr.lines().count() == 1, "{words}: {}", outcome.stderr);
        assert!(!scratch.path().join("compared").exists(), "{words}");
    }
    assert_eq!(sensel(&["compare", &a]).code, 2);
    let onto_itself = sensel(&["compare", &a, &a, "--out", &a]);
    assert!(onto_itself.code == 2 && onto_itself.stderr.contains("--out"), "{onto_itself:?}");
}

#[test]
fn runs_of_three_seeds_of_each_design_are_compared_pair_by_pair() {
    let scratch = Scratch::new("compare-replicates");
    let of = |name: &str, more: &[&str]| -> Vec<String> {
        ["1", "2", "3"]
            .iter()
            .map(|seed| run(&scratch, &format!("{name}{seed}"), &[&["--seed", seed], more].concat()))
            .collect()
    };
    let (a, b) = (of("a", &[]), of("b", &["--set", "sensor.adc.bits=8", "--set", "sensor.adc.black_level_dn=16"]));
    let words = |a: &[String], b: &[String]| -> Vec<String> { [a, &["--against".to_owned()], b].concat() };
    let compared = |a: &[String], b: &[String]| {
        let words = words(a, b);
        compare(&scratch, &words.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let outcome = compared(&a, &b);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let found: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(found["others"][0]["paired_runs"], 3);
    assert!(
        found["others"][0]["pairing"].as_str().unwrap().starts_with("3 pairs of runs, of which 3 share their seed")
    );
    assert_eq!(figure(&found, "link_bits_per_s")["verdict"], "better");
    let page = fs::read_to_string(scratch.path().join("compared/compare.html")).unwrap();
    assert!(page.contains("pairs of runs") && page.contains("wiper"));

    for (a, b, words) in [
        (&a[..3], &b[..2], "3 and 2 folders"),
        (&a[..2], &b[..2], "3 or more"),
        (&[a[0].clone(), a[1].clone(), b[2].clone()][..], &b[..], "is no replicate"),
    ] {
        let outcome = compared(a, b);
        assert!(outcome.code == 2 && outcome.stderr.contains(words), "{words}: {outcome:?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{outcome:?}");
    }
}
