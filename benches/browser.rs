//! Time of the sensor and the extractor in the page's WebAssembly, against the same library natively: one thread, SSE2 (NEON on aarch64).
//!
//!     web/build && cargo bench --bench browser
//!
//! Both run the same frames of one scenario, in turn; a frame's time is the least of its repetitions, because other work only adds.
//! The first frames are told apart: there tables are made once, and an engine still compiles what it optimises later.

use std::ops::Range;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use sensel::config::Resolved;
use sensel::run::{NoFiles, NoProgress, Session, Setup, Stopwatch};
use sensel::simd::{Level, limit};

/// A VGA sensor with all its effects, as the page has it, and its extractor.
const SCENARIO: &str = r#"seed = 1
[scene]
generator = "box"
bake = "draft"
illuminance_lux = 1000.0
[motion]
kind = "sway"
offset_m = [0.0, 1.5, 0.3]
[rig]
baseline_mm = 0.0
[run]
frames = 300
samples_per_pixel = 1
effects = "all"
[sensor]
width = 640
height = 480
[sensor.readout]
exposure_us = 6000.0
"#;

/// Frames of a run, and how many of them come before the engine has optimised its code.
const FRAMES: usize = 32;
const WARM_UP: usize = 8;
const REPETITIONS: usize = 4;
const STAGES: [&str; 2] = ["sensor", "compute"];
/// What the page's core may take at most, as a multiple.
const RATIO_MAX: f64 = 2.5;

/// Seconds of each stage in each frame.
type Times = [[f64; STAGES.len()]; FRAMES];

struct Wall(Instant);

impl Stopwatch for Wall {
    fn now_s(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

fn natively() -> Times {
    let resolved = Resolved::from_layers("scenario", SCENARIO, &[]).expect("the scenario above holds");
    let setup = Setup::new(resolved, &NoFiles, &NoProgress).expect("the box needs no files");
    let mut session = Session::new(setup).expect("one camera is a rig");
    let (stopwatch, mut before_s) = (Wall(Instant::now()), [0.0; STAGES.len()]);
    std::array::from_fn(|_| {
        session.step(&stopwatch).expect("the run is longer");
        let so_far_s = STAGES.map(|stage| session.stage_s(stage));
        let own_s = std::array::from_fn(|stage| so_far_s[stage] - before_s[stage]);
        before_s = so_far_s;
        own_s
    })
}

fn in_node(folder: &Path) -> Times {
    let scenario = folder.join("scenario.toml");
    std::fs::write(&scenario, SCENARIO).expect("the folder was made");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/stage_times.mjs");
    let run = Command::new("node").arg(script).arg(&scenario).arg(FRAMES.to_string()).args(STAGES).output();
    let run = run.expect("node is installed");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&run.stdout).expect("the script prints seconds by frame and stage")
}

/// Mean over some frames of each one's least time, in milliseconds.
fn least_ms(all: &[Times], stage: usize, frames: Range<usize>) -> f64 {
    let of_frame = |frame: usize| all.iter().map(|times| times[frame][stage]).fold(f64::INFINITY, f64::min);
    let count = frames.len();
    1e3 * frames.map(of_frame).sum::<f64>() / count as f64
}

fn main() {
    // One thread: the page's worker has one.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).build_global();
    limit(Level::Baseline);
    let folder = std::env::temp_dir().join(format!("sensel-browser-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("the temporary folder takes files");
    let (mut native, mut wasm) = (Vec::new(), Vec::new());
    for _ in 0..REPETITIONS / 2 {
        native.push(natively());
        wasm.push(in_node(&folder));
        wasm.push(in_node(&folder));
        native.push(natively());
    }
    std::fs::remove_dir_all(&folder).expect("the folder was made above");
    println!("| stage of a VGA frame, 10 bits, all effects | native, one thread, SSE2 | WebAssembly in Node | ratio |");
    println!("|---|---|---|---|");
    let mut holds = true;
    for (stage, name) in STAGES.iter().enumerate() {
        let [native_ms, wasm_ms] = [&native, &wasm].map(|all| least_ms(all, stage, WARM_UP..FRAMES));
        let ratio = wasm_ms / native_ms;
        println!("| {name} | {native_ms:.2} ms | {wasm_ms:.2} ms | {ratio:.2} |");
        holds &= ratio <= RATIO_MAX;
    }
    for (stage, name) in STAGES.iter().enumerate() {
        let [native_ms, wasm_ms] = [&native, &wasm].map(|all| least_ms(all, stage, 0..1));
        println!("| {name}, first frame of a run | {native_ms:.2} ms | {wasm_ms:.2} ms | {:.2} |", wasm_ms / native_ms);
    }
    assert!(holds, "the page's core takes more than {RATIO_MAX} times the native time");
}
