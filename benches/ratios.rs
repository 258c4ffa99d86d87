//! Ours against each peer, in one run: alternating processes (ours, peer, peer, ours), pinned to one core where `taskset` exists, one
//! thread each, the best of each side. Prints one JSON row a scene and level; a peer that cannot run makes its row and the run fail.
//!
//!     SENSEL_JUDGE_PYTHON=path/to/python cargo bench --bench ratios [-- PEER ...]
//!
//! Peers are those of benches/peers/sensor_speed.py: `numpy32`, `numpy`, `galsim`; `embree`, the row of rays; `frame`, whole frames over
//! Embree's one ray a pixel; `opencv`, the rows of features. Without names: `numpy32`, `embree`, `frame` and `opencv`.

#![allow(missing_docs)]

mod common;
#[path = "embree/compare.rs"]
mod compare;
#[path = "embree/rays.rs"]
mod rays;
#[path = "embree/row.rs"]
mod embree;
#[path = "features/row.rs"]
mod features;
#[path = "embree/frame.rs"]
mod frame;
#[path = "common/scenario.rs"]
mod scenario;

use std::process::{Command, ExitCode};
use std::time::Instant;

use common::{HEIGHT, PEERS_ALONE, Sensor, WIDTH, parameters_with};
use sensel::simd::{self, Level};

/// Scenes by name and greatest photons per pixel. The peers' job is theirs, effect by effect; ours has dark current and column offsets
/// besides.
const SCENES: [(&str, f32); 3] = [
    (PEERS_JOB, 20_000.0),
    ("ramp_0_to_20000_photons_with_dark_and_columns", 20_000.0),
    ("ramp_0_to_20_photons_with_dark_and_columns", 20.0),
];
const PEERS_JOB: &str = "ramp_0_to_20000_photons";
const LEVELS: [Level; 3] = [Level::Baseline, Level::Avx2, Level::Avx512];
/// Frames timed as one span, so that a span lasts about as long as a peer's frame and meets as many interruptions.
const FRAMES_A_SPAN: u32 = 8;
/// Spans that each of our processes times, after one that it does not.
const SPANS: u32 = 15;
/// Frames that each peer's process times, after one that it does not.
const PEER_FRAMES: &str = "15";
const PYTHON: &str = "SENSEL_JUDGE_PYTHON";
/// What the parent calls itself with.
const CHILD: &str = "--ours";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some(at) = arguments.iter().position(|argument| argument == CHILD) {
        let (work, level) = (&arguments[at + 1], &arguments[at + 2]);
        let is_of_features = features::WORKS.iter().any(|(name, _)| name == work);
        let time = match work.as_str() {
            embree::WORK => embree::ours_s(level),
            work if work.starts_with(frame::WORK) => frame::ours_s(work[frame::WORK.len()..].trim_start(), level),
            work if is_of_features => features::ours_ns_per_px(work, level),
            work => ours_ns_per_px(work, level),
        };
        println!("{time}");
        return ExitCode::SUCCESS;
    }
    let named: Vec<&str> = arguments.iter().map(String::as_str).filter(|argument| !argument.starts_with('-')).collect();
    let peers = if named.is_empty() { vec!["numpy32", embree::PEER, frame::WORK, features::PEER] } else { named };
    let mut failed = false;
    let (rays, peers): (Vec<&str>, Vec<&str>) = peers.iter().partition(|&&peer| peer == embree::PEER);
    if !rays.is_empty() {
        failed |= !embree::rows();
    }
    let (frames, peers): (Vec<&str>, Vec<&str>) = peers.iter().partition(|&&peer| peer == frame::WORK);
    if !frames.is_empty() {
        failed |= !frame::rows();
    }
    let (of_features, peers): (Vec<&str>, Vec<&str>) = peers.iter().partition(|&&peer| peer == features::PEER);
    if !of_features.is_empty() {
        failed |= !features::rows();
    }
    for (scene, photons_max) in SCENES {
        for level in LEVELS.into_iter().filter(|&level| level <= simd::level()) {
            for peer in &peers {
                failed |= !row(scene, photons_max, level, peer);
            }
        }
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

/// Times both sides and prints their row; gives back whether both ran.
fn row(scene: &str, photons_max: f32, level: Level, peer: &str) -> bool {
    let ours = || ourselves(scene, level);
    let theirs = || peer_ns_per_px(peer, photons_max);
    let times = || -> Result<(f64, f64), String> {
        let (first, second, third, fourth) = (ours()?, theirs()?, theirs()?, ours()?);
        Ok((first.min(fourth), second.min(third)))
    };
    let work = format!("sensor {WIDTH}x{HEIGHT} 10 bit {scene}");
    match times() {
        Ok((ours_ns, peer_ns)) => {
            let ratio = peer_ns / ours_ns;
            let times = format!(r#""ours_ns_per_px":{ours_ns:.2},"peer_ns_per_px":{peer_ns:.2},"ratio":{ratio:.2}"#);
            println!(r#"{{"work":"{work}","peer":"{peer}",{times},"level":"{level:?}"}}"#);
        }
        Err(reason) => {
            let reason = reason.replace(['\\', '"', '\n'], " ");
            println!(r#"{{"work":"{work}","peer":"{peer}","level":"{level:?}","failed":"{reason}"}}"#);
            return false;
        }
    }
    true
}

/// What this program says as a child about a piece of work at a level.
fn ourselves(work: &str, level: Level) -> Result<f64, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = run(&program.to_string_lossy(), &[CHILD, work, &format!("{level:?}")])?;
    output.trim().parse::<f64>().map_err(|error| format!("ours said {output:?}: {error}"))
}

fn peer_ns_per_px(peer: &str, photons_max: f32) -> Result<f64, String> {
    let python = std::env::var(PYTHON).map_err(|_| format!("{PYTHON} names no python with {peer}"))?;
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/sensor_speed.py");
    let (width, height) = (WIDTH.to_string(), HEIGHT.to_string());
    let output = run(&python, &[script, peer, &width, &height, "10", PEER_FRAMES, &photons_max.to_string()])?;
    let row: serde_json::Value = serde_json::from_str(&output).map_err(|error| format!("{output:?}: {error}"))?;
    row["ns_per_px"].as_f64().ok_or_else(|| format!("{output:?} names no ns_per_px"))
}

/// Runs one side in a process of its own, pinned where the system can, with one thread; gives back what it prints.
fn run(program: &str, arguments: &[&str]) -> Result<String, String> {
    let pinned = Command::new("taskset").arg("--version").output().is_ok_and(|output| output.status.success());
    let mut command = if pinned { Command::new("taskset") } else { Command::new(program) };
    if pinned {
        command.args(["-c", "0", program]);
    }
    command.args(arguments).env("OMP_NUM_THREADS", "1").env("RAYON_NUM_THREADS", "1");
    let output = command.output().map_err(|error| format!("{program}: {error}"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    Err(said.lines().last().unwrap_or("it failed and said nothing").to_owned())
}

/// Uses the level that the parent names.
fn keep_to(level: &str) {
    let level = LEVELS.into_iter().find(|found| format!("{found:?}") == level).expect("the parent names a level");
    simd::limit(level);
    assert!(simd::level() == level, "the parent names a level of this machine");
}

/// The best time of a frame, in nanoseconds a pixel.
fn ours_ns_per_px(scene: &str, level: &str) -> f64 {
    let (_, photons_max) = SCENES.into_iter().find(|(name, _)| *name == scene).expect("the parent names a scene");
    // The thread that asks is the pool, so that no frame waits for another thread to wake.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
    assert!(pool.is_ok(), "nothing has used the pool yet");
    keep_to(level);
    let more = if scene == PEERS_JOB { &PEERS_ALONE[..] } else { &[] };
    let sensor = Sensor::of(parameters_with(more), photons_max);
    let mut best_s = f64::INFINITY;
    for span in 0..=SPANS {
        let begin = Instant::now();
        for frame in 0..FRAMES_A_SPAN {
            std::hint::black_box(sensor.frame(span * FRAMES_A_SPAN + frame));
        }
        let taken_s = begin.elapsed().as_secs_f64();
        if span > 0 {
            best_s = best_s.min(taken_s);
        }
    }
    let pixels = f64::from(u32::try_from(WIDTH).expect("a VGA row is short")) * f64::from(HEIGHT);
    best_s * 1e9 / (pixels * f64::from(FRAMES_A_SPAN))
}
