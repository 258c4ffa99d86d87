//! Time of the default run by stage on this machine: what `sensel run` measures of itself, as a table.
//!
//! `cargo bench --bench stages` runs the program once for its light (kept in the cache afterwards), then over thirty stereo
//! frames. `--frames N` after `--` takes another number.

use std::path::Path;
use std::process::{Command, Stdio};

/// Frames without any other wish: a second of the default camera.
const FRAMES: u32 = 30;

fn main() {
    let frames = frames_wanted();
    let folder = std::env::temp_dir().join(format!("sensel-stages-{}", std::process::id()));
    run(&folder, 1);
    run(&folder, frames);
    let text = std::fs::read_to_string(folder.join("report.json")).expect("a run leaves a report");
    let report: serde_json::Value = serde_json::from_str(&text).expect("a report is JSON");
    let cost = report["cost"].as_object().expect("a report says what it cost");
    println!("{frames} stereo frames of the default scenario");
    println!("{:<12} {:>12}", "stage", "ms per frame");
    let mut total_ms = 0.0;
    for (stage, entry) in cost {
        let Some(ms) = entry["ms_per_frame"].as_f64() else { continue };
        println!("{stage:<12} {ms:>12.2}");
        total_ms += ms;
    }
    println!("{:<12} {total_ms:>12.2}", "all");
    std::fs::remove_dir_all(&folder).expect("the folder was made above");
}

/// The number after `--frames`; `cargo bench` adds arguments of its own, which mean nothing here.
fn frames_wanted() -> u32 {
    let arguments: Vec<String> = std::env::args().collect();
    let named = arguments.windows(2).find(|pair| pair[0] == "--frames");
    named.map_or(FRAMES, |pair| pair[1].parse().expect("--frames takes a number"))
}

fn run(folder: &Path, frames: u32) {
    let status = Command::new(env!("CARGO_BIN_EXE_sensel"))
        .args(["run", "--frames", &frames.to_string(), "--out"])
        .arg(folder)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("the program was built with the bench");
    assert!(status.success(), "the default run: {status}");
}
