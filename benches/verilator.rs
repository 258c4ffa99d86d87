//! The digital half of a VGA sensor, the front of its extractor and the whole extractor for one frame: the twins that skip clocks against
//! Verilator, in one run. Prints one JSON row for each Verilator and mode; a missing Verilator or pins that differ are a failed run.
//!
//!     cargo bench --bench verilator [-- readout|front|extractor ...]
//!
//! 640 columns of 10 bits, 480 rows; a line is settle 2, 16 reset steps, settle 2 with the transfer, 1024 steps, and the blank that one
//! bit-serial lane needs. Stimulus is worked out outside of both timers; both run on one thread, without waveforms. The twin gives
//! every latch's value and clock, each clock at which a control pin changes, every clock's lane pins, and bits flipped. Verilator's
//! time is that of the fastest of three ways to write the columns and the lane, and excludes looking at any pin. Before a row is
//! printed, the hash of every pin in every clock is equal: on 24 rows of ramp, random and never-crossing stimulus in each style, and
//! on the timed frame in the fastest. `SENSEL_VERILATOR` names another Verilator beside the one in PATH.
#![allow(clippy::unwrap_used)] // A bench fails by panicking.

#[path = "verilator/extractor.rs"]
mod extractor;
#[path = "verilator/front.rs"]
mod front;
#[path = "verilator/workload.rs"]
mod workload;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use sensel::files::verilator::{Build, version};
use workload::{CONFIG_PINS, LevelPattern, OUTPUT_PINS, Twin, Workload};

const STYLES: [&str; 3] = ["packed_vectors", "column_loops", "rising_edges"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn build(verilator: &str, style: &str) -> PathBuf {
    let list = |names: &[&str]| names.iter().map(|name| format!(" PIN({name})")).collect::<String>();
    let header = format!("#define CONFIG{}\n#define OUTPUTS{}\n", list(CONFIG_PINS), list(OUTPUT_PINS));
    let read = |folder: &str, name: String| {
        let text = std::fs::read_to_string(root().join(folder).join(&name)).expect("a file of the repository");
        (name, text.into())
    };
    let own = [format!("{style}.sv"), "ports.svh".to_owned(), "front.svh".to_owned()];
    let blocks = ["readout_seq", "ramp_counter", "lane_shift"];
    let own = own.map(|name| read("benches/verilator", name)).into_iter();
    let sources = own.chain(blocks.map(|block| read("rtl_models/verilog", format!("{block}.sv")))).collect();
    let harness = include_str!("verilator/harness.cpp");
    program(&Build { verilator, top: style, sources, harness, header: &header, flags: &["-Wno-WIDTHCONCAT"] })
}

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

/// Median of several frames by the twin, each into buffers that are cleared within the timed part.
fn twin_frame(twin: &mut Twin<'_>) -> f64 {
    let mut times = Vec::new();
    for _ in 0..15 {
        let start = Instant::now();
        twin.run();
        times.push(start.elapsed().as_secs_f64() * 1e9);
    }
    median(times)
}

fn stimulus_file(workload: &Workload, name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("verilator-{name}.bin"));
    let words: Vec<u8> = workload.stimulus().iter().flat_map(|word| word.to_le_bytes()).collect();
    std::fs::write(&path, words).unwrap();
    path
}

/// Every pin of every clock, by its hash.
fn pins_equal(workload: &Workload, program: &Path) -> bool {
    let mut twin = Twin::new(workload);
    twin.run();
    let file = stimulus_file(workload, "checked");
    verilator_frame(program, &file, true).1 == format!("{:016x}", twin.hash())
}

fn compare(verilator: &str, latch_mode: bool) {
    let mode = if latch_mode { "latched Gray count" } else { "up/down counters" };
    let programs = STYLES.map(|style| build(verilator, style));
    for kind in [LevelPattern::Ramp, LevelPattern::Random, LevelPattern::Never] {
        let workload = Workload::new(kind, latch_mode, 24);
        for (style, program) in STYLES.iter().zip(&programs) {
            assert!(pins_equal(&workload, program), "{style}, {mode}, {kind:?}: pins differ");
        }
    }
    let workload = Workload::new(LevelPattern::Random, latch_mode, 480);
    let file = stimulus_file(&workload, "timed");
    let mut twin = Twin::new(&workload);
    twin.run();
    let times = [0, 1, 2].map(|index: usize| verilator_frame(&programs[index], &file, false).0);
    let fastest = (0..3).min_by(|&a, &b| times[a].total_cmp(&times[b])).unwrap();
    assert!(pins_equal(&workload, &programs[fastest]), "{mode}: pins differ");
    // A B B A, so that a drift of the machine's speed falls on both.
    let peer = || verilator_frame(&programs[fastest], &file, false).0;
    let ours_first = twin_frame(&mut twin);
    let theirs = peer() + peer();
    let ours = ours_first + twin_frame(&mut twin);
    let row = serde_json::json!({
        "work": "clocked ADC + readout, 640 x 480, 10 bit, bit-serial lane",
        "mode": mode,
        "hts": workload.config.seq.hts,
        "clocks": workload.clocks,
        "verilator": version(verilator).expect("it was just run"),
        "style": STYLES[fastest],
        "styles_ms": times.map(|time| (time / 1e4).round() / 1e2),
        "verilator_ms": (theirs / 2e4).round() / 1e2,
        "sensel_ms": (ours / 2e3).round() / 1e3,
        "ratio": (theirs / ours).round(),
        "pins_equal": true,
    });
    println!("{row}");
}

fn main() {
    let other = std::env::var("SENSEL_VERILATOR").ok();
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let wanted = |work: &str| arguments.is_empty() || arguments.iter().any(|argument| argument == work);
    for verilator in std::iter::once("verilator").chain(other.as_deref()) {
        for latch_mode in [true, false].into_iter().filter(|_| wanted("readout")) {
            compare(verilator, latch_mode);
        }
        for octaves in [1, 3].into_iter().filter(|_| wanted("front")) {
            front::compare(verilator, octaves);
        }
        for (octaves, threshold) in [(1, 20), (1, 100), (3, 20)].into_iter().filter(|_| wanted("extractor")) {
            extractor::compare(verilator, octaves, threshold);
        }
    }
}
