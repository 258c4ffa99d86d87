//! Time of the host a frame of a stereo VGA rig, on one thread: the tracker alone, and the extraction that comes before it where frames,
//! not features, are on the link. Bar: 8 ms per frame at 500 features per camera.
//!
//! The tracker follows three seconds of a lively hand through the synthetic room of `tests/tracker`; the median and the worst frame of
//! one run are printed before the samples. The pictures to extract from are drawn, with some 1,350 features each.

#[path = "../tests/tracker/synthetic.rs"]
#[allow(dead_code)]
mod synthetic;

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sensel::compute::{ExtractorParams, extract};
use sensel::draw::mix;
use sensel::events::Events;
use sensel::plane::Plane;
use sensel::tracker::{FrameInput, Tracker, TrackerParams};
use sensel::units::Size;
use synthetic::{RATE_HZ, World, lively, room};

const FRAMES: u64 = 90;

/// Frames of a room with so many features per camera.
fn frames(features: usize) -> (World, Vec<FrameInput>) {
    let mut world = World::usual(1);
    world.features_max = features;
    world.landmarks = room(1, 9 * sensel::num::u64_from(features));
    let pose = |number| lively(sensel::num::f64_from_u64(number) / RATE_HZ);
    let inputs = (0..FRAMES).map(|number| world.frame(number, &pose(number))).collect();
    (world, inputs)
}

fn track(world: &World, inputs: &[FrameInput]) -> Vec<f64> {
    let mut tracker = Tracker::new(world.cameras.clone(), TrackerParams::room(1)).expect("a valid rig");
    let mut times_ms = Vec::with_capacity(inputs.len());
    for input in inputs {
        let start = Instant::now();
        let answer = black_box(tracker.track(input));
        times_ms.push(1e3 * start.elapsed().as_secs_f64());
        assert!(answer.world_from_body.is_some(), "every frame has a pose");
    }
    times_ms
}

fn tracker(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("tracker/90_stereo_frames");
    group.throughput(Throughput::Elements(FRAMES)).sample_size(10);
    for features in [500, 1_365] {
        let (world, inputs) = frames(features);
        let mut times_ms = track(&world, &inputs);
        times_ms.sort_by(f64::total_cmp);
        let mean_ms = times_ms.iter().sum::<f64>() / times_ms.len() as f64;
        let sent = inputs.iter().flat_map(|input| &input.features).map(Vec::len).sum::<usize>() / (2 * inputs.len());
        println!(
            "tracker alone, {sent} features per camera: {mean_ms:.2} ms per frame, median {:.2}, worst {:.2} (with its adjustment)",
            times_ms[times_ms.len() / 2],
            times_ms[times_ms.len() - 1]
        );
        let id = BenchmarkId::from_parameter(features);
        group.bench_with_input(id, &inputs, |bencher, inputs| bencher.iter(|| track(&world, inputs)));
    }
}

/// A ramp with a bar of its own contrast in each tile of 25 by 22 pixels, under uniform noise of 7 codes of 8 bits.
fn picture(seed: u64) -> Plane<u16> {
    let value = |i: u64| {
        let (x, y) = (i % 640, i / 640);
        let tile = mix(seed + x / 25 + 100 * (y / 22));
        let (dx, dy) = (x % 25, y % 22);
        let bar = dx > tile % 12 && dx < tile % 12 + 8 && dy > tile / 64 % 9 && dy < tile / 64 % 9 + 7;
        let base = 50 + x / 8 + y / 10 + if bar { tile / 4096 % 90 } else { 0 };
        u16::try_from((base + mix(i) % 7).min(255)).expect("clipped") << 2
    };
    Plane::from_values(Size { width_px: 640, height_px: 480 }, (0..640 * 480).map(value).collect())
}

fn extraction(criterion: &mut Criterion) {
    let pictures = [picture(1), picture(2)];
    let of =
        |picture| extract(picture, 10, &ExtractorParams::USUAL, &mut Events::default()).expect("a picture that fits");
    println!("features to extract: {:?} in the two pictures", pictures.each_ref().map(|picture| of(picture).len()));
    criterion.bench_function("extraction/two_vga_pictures", |bencher| {
        bencher.iter(|| pictures.iter().map(|picture| of(black_box(picture)).len()).sum::<usize>());
    });
}

criterion_group!(benches, tracker, extraction);
criterion_main!(benches);
