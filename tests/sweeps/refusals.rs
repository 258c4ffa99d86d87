//! Sweeps that cannot be are refused before anything runs, with a word on what is accepted.

use super::{SMALL, SweepTest, started};

#[test]
fn a_bad_sweep_file_is_refused_with_key_and_line() {
    let factor = |body: &str| format!("scenario = \"box\"\n[[factor]]\nname = \"f\"\n{body}\n");
    let many = |count: u32| {
        let one = "[[factor]]\nname = \"N\"\nkey = \"sensor.die\"\nlow = 1.0\nhigh = 2.0\nsteps = 1000\n";
        let all: String = (0..count).map(|number| one.replace('N', &format!("f{number}"))).collect();
        format!("scenario = \"box\"\n{all}")
    };
    let named = |name: &str| factor("key = \"sensor.adc.bits\"\nvalues = [6, 8]").replace("\"f\"", name);
    let cases: [(String, &[&str]); 17] = [
        (factor("key = \"sensor.adc.bit\"\nvalues = [8]"), &["sweep.toml:4", "sensor.adc.bit", "did you mean 'bits'"]),
        (factor("key = \"sensor.adc.bits\"\nvalues = [\"x\"]"), &["sweep.toml:4", "whole number"]),
        (factor("key = \"sensor.adc.bits\"\nvalues = []"), &["empty", "at least one"]),
        ("scenario = \"box\"\n".to_owned(), &["factor", "nothing is varied"]),
        (many(3), &["1000000000", "1000000 or fewer"]),
        (many(40), &["1000000 or fewer"]),
        (factor("key = \"sensor.adc.bits\"\nvalues = [8, 8]"), &["same configuration"]),
        (factor("key = \"sensor.adc.bits\"\nlow = 1\nhigh = 8"), &["steps"]),
        (factor("values = [8]"), &["key"]),
        (format!("method = \"simplex\"\n{}", factor("key = \"seed\"\nvalues = [1]")), &["simplex", "latin_hypercube"]),
        (format!("method = \"sobol\"\n{}", factor("key = \"seed\"\nvalues = [1]")), &["samples"]),
        (
            format!("methods = \"grid\"\n{}", factor("key = \"seed\"\nvalues = [1]")),
            &["sweep.toml:1", "did you mean 'method'"],
        ),
        (factor("key = \"seed\"\nvalues = [1]").replace("box", "no_such_scene"), &["no_such_scene"]),
        ("scenario = ".to_owned(), &["sweep.toml", "line 1"]),
        // A table has one column of a name.
        (named("\"seed\""), &["factor.0.name = seed", "use another"]),
        (named("\"tracking.ate_m\""), &["factor.0.name = tracking.ate_m", "use another"]),
        (named("\"\""), &["factor.0.name", "name the factor"]),
    ];
    let mut tried = 0;
    for (text, words) in cases {
        let test = SweepTest::new("refused", &text);
        let said = test.sweep("run", "out", &[]);
        assert_eq!(said.code, 2, "{text}\n{}", said.stderr);
        for word in words {
            assert!(said.stderr.contains(word), "{word}: {}\n{text}", said.stderr);
        }
        assert!(!test.scratch.path().join("out").exists(), "nothing is written: {text}");
        tried += 1;
    }
    assert_eq!(tried, 17);
}

#[test]
fn a_specification_of_no_figure_names_the_nearest_ones() {
    let test = SweepTest::new("spec", &SMALL.replace("values = [4, 10]", "values = [4]"));
    let said = test.sweep("run", "out", &["--spec", "ate_mm < 1 for 90 %"]);
    assert_eq!(said.code, 2, "{}", said.stderr);
    assert!(said.stderr.contains("ate_mm") && said.stderr.contains("tracking.ate_m"), "{}", said.stderr);
    assert!(!test.scratch.path().join("out").exists(), "it is refused before anything runs");
    let said = test.sweep("run", "out", &["--spec", "ate_m"]);
    assert!(said.code == 2 && said.stderr.contains("for 99 %"), "{}", said.stderr);
    // Only a run with an extractor has its clocks.
    let said = test.done("run", "keeps-up", &["--spec", "timing.extractor.frames_over <= 0 for 20 %"]);
    assert!(said.stdout.contains("2 of 2 runs"), "{}", said.stdout);
    let said = test.done("run", "out", &["--spec", "power_mw > 0 for 20 %"]);
    assert!(said.stdout.contains("open: 2 of 2 runs") && said.stdout.contains("further runs"), "{}", said.stdout);
}

#[test]
fn a_sequential_test_runs_no_more_cells_than_it_needs() {
    let text = SMALL.replace("seeds = 2", "seeds = 60").replace("values = [100.0, 600.0]", "values = [100.0]");
    let test = SweepTest::new("decided", &text);
    let spec = ["--spec", "power_mw > 0 for 60 %", "--until-decided", "--json", "--threads", "2"];
    let said = test.done("run", "out", &spec);
    let ran = said.json();
    let said = said.stdout;
    // ln(1/0.05) / ln(0.9/0.6) = 7.4: eight runs of each of the two points pass.
    assert_eq!(ran["run"].as_u64(), Some(16), "{said}");
    assert_eq!(said.matches("\"sequential\":\"pass\"").count(), 2, "{said}");
}

#[test]
fn failing_cells_end_with_3_and_the_others_are_kept() {
    let text =
        SMALL.replace("\"sensor.height\" = 72", "\"sensor.height\" = 72\n\"sensor.readout.exposure_us\" = 4000.0");
    let text =
        text.replace("key = \"sensor.adc.bits\"\nvalues = [4, 10]", "key = \"sensor.adc.bits\"\nvalues = [4, 99]");
    let test = SweepTest::new("failing", &text);
    let said = test.sweep("run", "out", &["--json"]);
    assert_eq!(said.code, 3, "{}", said.stderr);
    assert!(said.stderr.contains("4 of 8 cells failed") && said.stderr.contains("sensor.adc.bits"), "{}", said.stderr);
    assert_eq!(said.stderr.matches("a cell failed (").count(), 1, "all four for one reason: {}", said.stderr);
    let csv = String::from_utf8(test.gathered("out")[1].clone()).unwrap();
    assert_eq!((csv.matches(",failed,").count(), csv.matches(",done,").count()), (4, 4));
}

#[test]
fn two_sweeps_in_one_folder_at_once_are_refused() {
    let test = SweepTest::new("busy", &SMALL.replace("seeds = 2", "seeds = 400"));
    let mut child = started(&test, "run", "out", &["--threads", "1"]);
    while !test.scratch.path().join("out/.lock").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let said = test.sweep("run", "out", &[]);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(said.code == 2 && said.stderr.contains("another process"), "{} {}", said.code, said.stderr);
}

#[test]
fn a_folder_of_others_and_a_path_that_cannot_be_written_are_refused() {
    let test = SweepTest::new("paths", SMALL);
    let theirs = test.scratch.path().join("theirs");
    std::fs::create_dir(&theirs).unwrap();
    std::fs::write(theirs.join("diary.txt"), "x").unwrap();
    let said = test.sweep("run", "theirs", &[]);
    assert!(said.code == 2 && said.stderr.contains("diary.txt") && said.stderr.contains("--out"), "{}", said.stderr);
    // A file in a folder's place fails for root too, where no folder is read-only.
    std::fs::write(test.scratch.path().join("file"), "x").unwrap();
    let said = test.sweep("run", "file/out", &[]);
    assert_eq!(said.code, 4, "{}", said.stderr);
    let said = test.sweep("gather", "nothing", &[]);
    assert!(said.code == 2 && said.stderr.contains("sensel sweep run"), "{}", said.stderr);
}

#[test]
fn a_script_for_slurm_names_every_part() {
    let test = SweepTest::new("slurm", SMALL);
    let script = test.done("submit", "out", &["--engine", "slurm", "--shards", "3", "--cpus", "2"]).stdout;
    for line in ["#!/bin/bash", "#SBATCH --array=1-3", "#SBATCH --cpus-per-task=2"] {
        assert!(script.lines().any(|found| found == line), "{line}\n{script}");
    }
    // Each task's line is run as a shell would.
    for task in 1..=3 {
        let status = std::process::Command::new("bash")
            .args(["-c", &script])
            .env("SLURM_ARRAY_TASK_ID", task.to_string())
            .env("SLURM_CPUS_PER_TASK", "1")
            .stdout(std::process::Stdio::null())
            .status();
        assert!(status.unwrap().success(), "task {task}");
    }
    test.done("run", "alone", &["--quiet"]);
    assert!(test.gathered("out") == test.gathered("alone"), "parts of a cluster");
}
