//! Sweeps beyond this program: its table in other tools, its cells on Dask and on Slurm.
#![cfg(feature = "outside")]

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::{SMALL, SweepTest};

/// A script of the judges; its absence is a failure, not a pass.
pub fn judge(script: &str, arguments: &[&str]) -> Value {
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(python);
    command.arg(root.join("tests/judges").join(script)).args(arguments).env("PYTHONPATH", root.join("python"));
    let output = command.output().expect("the judges' Python runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{script}: {text}{}", String::from_utf8_lossy(&output.stderr));
    let last = text.lines().last().unwrap_or_default();
    serde_json::from_str(last).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// 120 cells with columns of every type.
fn wide() -> String {
    let levels = "[[factor]]\nname = \"subpixel\"\n[[factor.level]]\nname = \"on, \\\"as usual\\\"\"\n\
                  set = { \"compute.subpixel\" = true }\n[[factor.level]]\nname = \"off\"\nset = { \"compute.subpixel\" = false }\n";
    SMALL.replace("seeds = 2", "seeds = 15\ncameras_alone = true") + levels
}

#[test]
fn the_table_opens_in_pyarrow_duckdb_and_polars_with_units_and_types() {
    let test = SweepTest::new("tools", &wide().replace("seeds = 15", "seeds = 2"));
    test.done("run", "out", &["--quiet"]);
    let csv = String::from_utf8(test.gathered("out")[1].clone()).unwrap();
    let file = |name: &str| test.scratch.join(&format!("out/{name}"));
    let found = judge("parquet_check.py", &[&file("cells.parquet"), &file("cells.csv")]);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert_eq!((found["rows"].as_u64(), found["columns"].as_u64()), (Some(16), u64::try_from(columns).ok()));
    assert_eq!(found["compared"].as_u64(), u64::try_from(3 * 16 * columns).ok(), "every value in three tools");
    for (name, unit) in
        [("tracking.ate_m", "m"), ("cameras_alone.ate_m", "m"), ("energy.power_mw", "mW"), ("subpixel", "")]
    {
        assert_eq!(found["units"][name], unit, "{name}");
    }
}

#[test]
fn a_dask_worker_that_is_killed_in_mid_sweep_costs_no_cell() {
    let test = SweepTest::new("dask", &wide());
    test.done("run", "alone", &["--quiet"]);
    let (file, out, cache) = (test.scratch.join("sweep.toml"), test.scratch.join("out"), test.scratch.join("cache"));
    let store = ["--cache", &cache, "--photons-gib", "1"];
    let said = judge("dask_sweep.py", &[&[env!("CARGO_BIN_EXE_sensel"), &file, &out], &store[..]].concat());
    assert_eq!((said["exit"].as_u64(), said["workers"].as_u64()), (Some(0), Some(2)), "{said}");
    // The worker and the program that it ran.
    assert!(said["killed"].as_u64().unwrap() >= 2, "a worker was killed while it ran cells: {said}");
    assert!((1..120).contains(&said["finished_at_kill"].as_u64().unwrap()), "in mid-sweep: {said}");
    assert!(test.gathered("out") == test.gathered("alone"), "{said}");
}

/// Whether Slurm's daemons ran. Root must be able to start them where all cases are taken; other machines may forbid it.
pub fn had_slurm(said: &Value) -> bool {
    let Some(reason) = said["not_started"].as_str() else { return true };
    #[cfg(unix)]
    assert!(!crate::common::takes_all_cases() || !rustix::process::geteuid().is_root(), "{reason}");
    println!("{reason}; the array script runs in bash alone");
    false
}

#[test]
fn slurm_runs_the_array_script_and_its_table_is_byte_identical() {
    let test = SweepTest::new("slurm-daemons", &wide());
    test.done("run", "alone", &["--quiet"]);
    let submit = ["--engine", "slurm", "--shards", "4", "--cpus", "1"];
    let script = test.scratch.join("job.sh");
    std::fs::write(&script, test.done("submit", "out", &submit).stdout).unwrap();
    let said = judge("slurm_sweep.py", &[&script]);
    if !had_slurm(&said) {
        return;
    }
    assert_eq!((said["exit"].as_u64(), said["tasks"].as_u64()), (Some(0), Some(4)), "{said}");
    assert!(test.gathered("out") == test.gathered("alone"), "{said}");
}
