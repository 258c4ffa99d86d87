//! Compares FAST with suppression, and the whole extractor, with OpenCV's FAST and ORB (one level, 500 features) on one picture. Prints
//! one JSON row a level and task.

use std::path::PathBuf;
use std::time::Instant;

use sensel::compute::{ExtractorParams, extract, fast9};
use sensel::events::Events;
use sensel::plane::Plane;
use sensel::simd;
use sensel::units::Size;

use crate::{LEVELS, PYTHON, keep_to, ourselves, run};

/// The peer's name.
pub const PEER: &str = "opencv";
/// What the parent calls its child's work, with the peer's word for it.
pub const WORKS: [(&str, &str); 2] = [("fast_nms", "fast"), ("features_500", "orb")];
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/feature_speed.py");
const VGA: Size = Size { width_px: 640, height_px: 480 };
/// Passes that each process times.
const PASSES: u32 = 60;
/// ORB's number of features: ours has at least as many.
const FEATURES: usize = 500;

fn file() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("features_vga.raw")
}

/// Prints the rows; gives back whether all ran.
pub fn rows() -> bool {
    let python = std::env::var(PYTHON).map_err(|_| format!("{PYTHON} names no python with OpenCV and scikit-image"));
    let made = python.and_then(|python| {
        run(&python, &[SCRIPT, "picture", &file().to_string_lossy()])?;
        Ok(python)
    });
    let mut fine = true;
    for level in LEVELS.into_iter().filter(|&level| level <= simd::level()) {
        for (work, peer) in WORKS {
            let times = made.as_ref().map_err(Clone::clone).and_then(|python| {
                let (ours, theirs) = (|| ourselves(work, level), || opencv_ns(python, peer));
                let (first, second, third, fourth) = (ours()?, theirs()?, theirs()?, ours()?);
                Ok((first.min(fourth), second.min(third)))
            });
            let named = format!(r#""work":"{work} 640x480 threshold 20","peer":"{PEER} {peer}","level":"{level:?}""#);
            match times {
                Ok((ours_ns, peer_ns)) => {
                    let ratio = ours_ns / peer_ns;
                    println!(
                        r#"{{{named},"ours_ns_per_px":{ours_ns:.2},"peer_ns_per_px":{peer_ns:.2},"time_ratio":{ratio:.2}}}"#
                    );
                }
                Err(reason) => {
                    println!(r#"{{{named},"failed":"{}"}}"#, reason.replace(['\\', '"', '\n'], " "));
                    fine = false;
                }
            }
        }
    }
    fine
}

fn opencv_ns(python: &str, peer: &str) -> Result<f64, String> {
    let output = run(python, &[SCRIPT, peer, &file().to_string_lossy(), &PASSES.to_string()])?;
    let row: serde_json::Value = serde_json::from_str(&output).map_err(|error| format!("{output:?}: {error}"))?;
    row["ns_per_px"].as_f64().ok_or_else(|| format!("{output:?} names no ns_per_px"))
}

/// Our best time, in nanoseconds a pixel.
pub fn ours_ns_per_px(work: &str, level: &str) -> f64 {
    keep_to(level);
    let picture = Plane::from_values(VGA, std::fs::read(file()).expect("the parent wrote the picture"));
    let codes = picture.map(u16::from);
    let features =
        |params: &ExtractorParams| extract(&codes, 8, params, &mut Events::default()).expect("VGA is large enough");
    let cells = (1..=4).map(|per_cell| ExtractorParams { cell_px: 32, per_cell, ..ExtractorParams::USUAL });
    let params = cells.chain([ExtractorParams::USUAL]).find(|params| features(params).len() >= FEATURES);
    let params = params.expect("the picture has 500 corners");
    let mut best_s = f64::INFINITY;
    for _ in 0..=PASSES {
        let begin = Instant::now();
        if work == WORKS[0].0 {
            std::hint::black_box(fast9(&picture, 20_u8));
        } else {
            std::hint::black_box(features(&params));
        }
        best_s = best_s.min(begin.elapsed().as_secs_f64());
    }
    best_s * 1e9 / f64::from(VGA.width_px * VGA.height_px)
}
