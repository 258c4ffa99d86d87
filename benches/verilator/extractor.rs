//! The whole extractor on one VGA frame of 8 bits: the rung `clocked` as `run` drives it, against Verilator's clocks. Before a row is
//! printed, every record and the clock in which it left are Verilator's, by their hash.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sensel::compute::{AlwaysReady, AtOnce, Extracted, Extractor, ExtractorParams};
use sensel::events::Events;
use sensel::fidelity::Rung;
use sensel::files::verilator::{Build, sources, version};
use sensel::plane::Plane;
use sensel::units::Size;

use crate::front::{HEIGHT, WIDTH, picture};
use crate::{median, program, verilator_frame};
use sensel::words::PositionPx;

/// Pins of a record that are hashed behind its clock, in this order; the descriptor follows as words of 32 bits.
const PINS: &[&str] = &["out_x_q4", "out_y_q4", "out_score", "out_angle", "out_octave"];

fn build(verilator: &str, params: &ExtractorParams) -> PathBuf {
    let pins: String = PINS.iter().map(|name| format!(" PIN({name})")).collect();
    let generics = [("OCTAVES", params.octaves), ("PER_CELL", params.per_cell), ("ENGINES", params.engines)];
    let generics = generics.map(|(name, value)| format!("-G{name}={value}"));
    program(&Build {
        verilator,
        top: "extractor_core",
        sources: sources("extractor_core"),
        harness: include_str!("extractor_harness.cpp"),
        header: &format!("#define OUTPUTS{pins}\n"),
        flags: &generics.each_ref().map(String::as_str),
    })
}

fn hash(extracted: &Extracted) -> u64 {
    let mut hash = 0xCBF2_9CE4_8422_2325_u64;
    for (feature, clk) in extracted.features.iter().zip(&extracted.out_clk) {
        let [x, y] = [feature.x, feature.y].map(PositionPx::to_bits);
        let fields = [x, y, feature.score, feature.angle.to_bits().into(), feature.octave.into()];
        let bits = feature.descriptor.as_chunks::<4>().0.iter().map(|&bytes| u32::from_le_bytes(bytes).into());
        let words = std::iter::once(*clk).chain(fields.map(u64::from)).chain(bits);
        words.for_each(|word| hash = (hash ^ word).wrapping_mul(0x100_0000_01B3));
    }
    hash
}

/// One row of the table.
pub fn compare(verilator: &str, octaves: u32, threshold: u16) {
    let params = ExtractorParams { octaves, threshold, target_features: 0, ..ExtractorParams::USUAL };
    let pixels = picture();
    let size = Size { width_px: WIDTH, height_px: HEIGHT };
    let codes = Plane::from_values(size, pixels.iter().map(|&pixel| pixel.into()).collect());
    let frame = |rung: Rung| {
        let io: (&mut dyn sensel::compute::Pixels, &mut dyn sensel::compute::Records) = (&mut AtOnce, &mut AlwaysReady);
        let mut extractor = Extractor::new(&params).on_rung(rung);
        extractor.frame(&codes, 8, (1, 1), io, &mut Events::default()).unwrap()
    };
    let found = frame(Rung::Clocked);
    let clocks = found.end_clk.max(found.out_clk.last().map_or(0, |clk| clk + 1));
    let program = build(verilator, &params);
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("verilator-core.bin");
    let settings = [WIDTH, HEIGHT, threshold.into(), u32::try_from(clocks).unwrap()];
    let words = settings.into_iter().chain(pixels.iter().map(|&pixel| pixel.into()));
    std::fs::write(&file, words.flat_map(u32::to_le_bytes).collect::<Vec<_>>()).unwrap();
    assert_eq!(verilator_frame(&program, &file, true).1, format!("{:016x}", hash(&found)), "{octaves} octaves");
    let ours = |rung: Rung| {
        let time = |_| {
            let start = Instant::now();
            std::hint::black_box(frame(rung));
            start.elapsed().as_secs_f64() * 1e9
        };
        median((0..15).map(time).collect())
    };
    // A B B A, so that a drift of the machine's speed falls on both.
    let peer = || verilator_frame(&program, &file, false).0;
    let ours_first = ours(Rung::Clocked);
    let theirs = peer() + peer();
    let clocked = ours_first + ours(Rung::Clocked);
    let per_second = |nanoseconds: f64| (clocks as f64 * 1e3 / nanoseconds * 10.0).round() / 10.0;
    let row = serde_json::json!({
        "work": "whole extractor, 640 x 480, 8 bit, 256-bit descriptors",
        "octaves": octaves,
        "threshold": threshold,
        "clocks": clocks,
        "features": found.features.len(),
        "verilator": version(verilator).expect("it was just run"),
        "verilator_mclk_per_s": per_second(theirs / 2.0),
        "sensel_clocked_mclk_per_s": per_second(clocked / 2.0),
        "sensel_sampled_mclk_per_s": per_second(ours(Rung::Sampled)),
        "ratio": (theirs / clocked * 10.0).round() / 10.0,
        "records_equal": true,
    });
    println!("{row}");
}
