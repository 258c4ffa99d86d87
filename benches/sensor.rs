//! Time of the sensor, from mean photons to codes, in one thread. Elements are pixels: the inverse of "elem/s" is the time per pixel.
//! `benches/ratios.rs` compares it with its peers.

// A bench's sizes are small and whole.
#![allow(clippy::cast_possible_truncation, missing_docs)]

mod common;

use common::{HEIGHT, Sensor, WIDTH, parameters};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sensel::adc::Converter;
use sensel::draw::{DrawKey, fill_uniforms, normals, poisson, poisson_of_one_mean};
use sensel::simd::{self, Level};

fn whole_sensor(criterion: &mut Criterion) {
    // One thread: the figure is a core's. A pool that exists already was made by this same call.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).build_global();
    let mut group = criterion.benchmark_group("sensor");
    group.throughput(Throughput::Elements(WIDTH as u64 * u64::from(HEIGHT)));
    for (scene, photons_max) in [("ramp_20000_photons", 20_000.0), ("ramp_20_photons", 20.0)] {
        for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
            simd::limit(level);
            if simd::level() != level {
                continue; // This machine lacks it.
            }
            let sensor = Sensor::new(photons_max);
            let mut frame = 0;
            group.bench_function(format!("{scene}/{:?}", simd::level()), |bencher| {
                bencher.iter(|| {
                    frame += 1;
                    sensor.frame(frame)
                });
            });
        }
    }
    group.finish();
}

/// One row in L1 a pass: what the effects' stated costs come from.
fn parts(criterion: &mut Criterion) {
    simd::limit(Level::Avx2);
    let mut group = criterion.benchmark_group("parts");
    group.throughput(Throughput::Elements(WIDTH as u64));
    let (mut uniforms, mut draws, mut values) = (vec![0_u32; WIDTH], vec![0.0_f32; WIDTH], vec![0.0_f32; WIDTH]);
    let mut key = 0;
    group.bench_function("fill_uniforms", |bencher| {
        bencher.iter(|| {
            key += 1;
            fill_uniforms(DrawKey::root(key), &mut uniforms);
        });
    });
    group.bench_function("normals", |bencher| bencher.iter(|| normals(&uniforms, &mut draws)));
    for mean_e in [0.02_f32, 1.0, 6.0, 10.0, 100.0, 10_000.0] {
        group.bench_function(format!("poisson/{mean_e}"), |bencher| {
            bencher.iter(|| {
                values.fill(mean_e);
                poisson(&uniforms, &mut values);
            });
        });
    }
    group.bench_function("poisson_of_one_mean/1.1", |bencher| {
        bencher.iter(|| poisson_of_one_mean(&uniforms, 1.1, &mut values));
    });
    let volts: Vec<f32> = (0..WIDTH).map(|column| column as f32 * 200.0).collect();
    let converter = Converter::new(&parameters().adc);
    let mut codes = vec![0; WIDTH];
    group.bench_function("convert_row", |bencher| {
        bencher.iter(|| converter.convert_row(&volts, &[], &mut codes));
    });
    group.finish();
}

criterion_group! {
    name = sensor;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(2));
    targets = whole_sensor, parts
}
criterion_main!(sensor);
