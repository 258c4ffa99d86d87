//! Times of the feature extractor and the link, per VGA frame: detector, whole extractor, packing and decoding.
//!
//! `drawn` is a ramp with a bar of its own contrast in each tile of 37 x 29 pixels, under uniform noise of 7 codes; how many corners
//! each picture has is printed before its times. `noise` is the worst case, a corner at every few pixels.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sensel::compute::{ExtractorParams, extract, fast9};
use sensel::draw::mix;
use sensel::events::Events;
use sensel::link::{FrameMetadata, FrameOut, LinkParams, Mode, decode, pack_frame};
use sensel::plane::Plane;
use sensel::simd::{Level, limit};
use sensel::units::Size;
use std::hint::black_box;

const VGA: Size = Size { width_px: 640, height_px: 480 };
const PIXELS: u64 = 640 * 480;

fn drawn() -> Plane<u8> {
    let value = |i: u64| {
        let (x, y) = (i % 640, i / 640);
        let tile = mix(x / 37 + 100 * (y / 29));
        let (dx, dy) = (x % 37, y % 29);
        let bar = dx > tile % 20 && dx < tile % 20 + 9 && dy > tile / 64 % 12 && dy < tile / 64 % 12 + 7;
        let base = 50 + x / 8 + y / 10 + if bar { tile / 4096 % 90 } else { 0 };
        u8::try_from((base + mix(i) % 7).min(255)).expect("clipped")
    };
    Plane::from_values(VGA, (0..PIXELS).map(value).collect())
}

fn noise() -> Plane<u8> {
    Plane::from_values(VGA, (0..PIXELS).map(|i| u8::try_from(mix(i) % 256).expect("below 256")).collect())
}

fn detector(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fast9_nms_t20");
    group.throughput(Throughput::Elements(PIXELS));
    for (name, picture) in [("drawn", drawn()), ("noise", noise())] {
        println!("{name}: {} corners at threshold 20", fast9(&picture, 20).len());
        for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
            limit(level);
            let id = BenchmarkId::new(name, format!("{level:?}"));
            group.bench_with_input(id, &picture, |bencher, picture| bencher.iter(|| fast9(black_box(picture), 20_u8)));
        }
    }
    limit(Level::Avx512);
}

fn extractor(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("extract_vga_10_bit");
    group.throughput(Throughput::Elements(PIXELS));
    let codes = drawn().map(|value| u16::from(value) << 2);
    let usual = ExtractorParams::USUAL;
    let octaves = ExtractorParams { octaves: 4, ..usual };
    let wide = ExtractorParams { pipeline_bits: 10, threshold: 80, ..usual };
    for (name, params) in [("usual", usual), ("four_octaves", octaves), ("ten_bits", wide)] {
        group.bench_function(name, |bencher| {
            bencher
                .iter(|| extract(black_box(&codes), 10, &params, &mut Events::default()).expect("a picture that fits"));
        });
    }
}

fn link(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("link_vga_10_bit");
    group.throughput(Throughput::Elements(PIXELS));
    let codes = drawn().map(|value| u16::from(value) << 2);
    let params = LinkParams::new(1, 240_000_000, Mode::Frames);
    let metadata = FrameMetadata::default();
    let frame = FrameOut {
        virtual_channel: 0,
        metadata,
        codes: Some(&codes),
        bits: 10,
        features: None,
        batches: &[],
        features_per_gap: 0,
    };
    group.bench_function("pack", |bencher| {
        bencher.iter(|| pack_frame(black_box(&frame), &params, &mut Events::default()).expect("a legal frame"));
    });
    let bytes = pack_frame(&frame, &params, &mut Events::default()).expect("a legal frame");
    group.bench_function("decode", |bencher| bencher.iter(|| decode(black_box(&bytes))));
}

criterion_group!(benches, detector, extractor, link);
criterion_main!(benches);
