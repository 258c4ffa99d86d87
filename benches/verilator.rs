//! The front of a VGA sensor's extractor and the whole extractor for one frame: the twins that skip clocks against Verilator, in one
//! run. Prints one JSON row for each Verilator and case; a missing Verilator or results that differ are a failed run.
//!
//!     cargo bench --bench verilator [-- front|extractor ...]
//!
//! Stimulus is worked out outside of both timers; both run on one thread, without waveforms. Verilator's time excludes looking at any
//! pin. `SENSEL_VERILATOR` names another Verilator beside the one in PATH.
#![allow(clippy::unwrap_used)] // A bench fails by panicking.

#[path = "verilator/extractor.rs"]
mod extractor;
#[path = "verilator/front.rs"]
mod front;

use std::path::{Path, PathBuf};
use std::process::Command;

use sensel::files::verilator::Build;

/// As fast a program as Verilator and the compiler make: no checks, registers that wake up with 0, this machine's instructions.
fn program(build: &Build<'_>) -> PathBuf {
    let mut flags = vec!["-Wall", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert"];
    flags.extend(["-CFLAGS", "-O3 -march=native", "-MAKEFLAGS", "OPT_FAST=-O3 OPT_SLOW=-O3 OPT_GLOBAL=-O3"]);
    flags.extend(build.flags);
    let base = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../rtl");
    Build { flags: &flags, ..build.clone() }.program(&base).expect("Verilator takes it; without one: ./check --install")
}

/// Nanoseconds of a frame, and the hash of its pins if asked for.
fn verilator_frame(program: &Path, stimulus: &Path, capture: bool) -> (f64, String) {
    let output = Command::new(program).arg(stimulus).arg(if capture { "1" } else { "0" }).output().unwrap();
    assert!(output.status.success(), "{} failed", program.display());
    let text = String::from_utf8(output.stdout).unwrap();
    let (nanoseconds, hash) = text.trim().split_once(' ').unwrap();
    (nanoseconds.parse().unwrap(), hash.to_owned())
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let other = std::env::var("SENSEL_VERILATOR").ok();
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let wanted = |work: &str| arguments.is_empty() || arguments.iter().any(|argument| argument == work);
    for verilator in std::iter::once("verilator").chain(other.as_deref()) {
        for octaves in [1, 3].into_iter().filter(|_| wanted("front")) {
            front::compare(verilator, octaves);
        }
        for (octaves, threshold) in [(1, 20), (1, 100), (3, 20)].into_iter().filter(|_| wanted("extractor")) {
            extractor::compare(verilator, octaves, threshold);
        }
    }
}
