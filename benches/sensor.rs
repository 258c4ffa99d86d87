//! Time of the sensor, from mean photons to codes, in one thread. The scene is the peers' (judges/sensor_speed.py): VGA, a ramp
//! of 0 to 20,000 photons, QE 0.6, full well 11,000 e-, PRNU 1 %, DSNU 3 e-, read noise 4 e-, 10 bit; ours adds dark current
//! and column offsets. Elements are pixels: the inverse of "elem/s" is the time a pixel.

// A bench's sizes are small and whole.
#![allow(clippy::cast_possible_truncation, missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sensel::adc::{AdcParams, Cds, Converter, Ramp};
use sensel::draw::{DrawKey, fill_uniforms, normals, poisson};
use sensel::effects::chain::{Capture, Chain, RowTimes};
use sensel::effects::{self, Parameters};
use sensel::pixel::{PixelParams, PixelType};
use sensel::plane::Plane;
use sensel::simd::{self, Level};
use sensel::units::{CameraIndex, FrameIndex, Size};

const WIDTH: usize = 640;
const HEIGHT: u32 = 480;

fn pixel_params() -> PixelParams {
    PixelParams {
        pixel_type: PixelType::T6,
        pitch_um: 3.0,
        quantum_efficiency: 0.6,
        fill_factor: 1.0,
        conversion_gain_uv_per_e: 10.0,
        full_well_e: 11_000.0,
        dark_current_e_per_s: 100.0,
        dark_doubling_k: 8.0,
        temperature_k: 300.0,
        read_noise_uv: 40.0,
        ktc_noise_uv: None,
        prnu: 0.01,
        dsnu_e: 3.0,
        double_sampling: true,
    }
}

fn adc_params() -> AdcParams {
    AdcParams {
        bits: 10,
        clock_hz: 480_000_000,
        full_scale_uv: 110_000.0 * 1024.0 / 959.0,
        gain: 1.0,
        black_level_dn: 64,
        column_offset_uv: 200.0,
        column_offset_residual_uv: 20.0,
        column_gain_sigma: 0.0,
        reset_counts: 128,
        settle_reset_us: 2.0,
        settle_signal_us: 3.0,
        cds: Cds::Digital,
        ramp: Ramp::Linear,
    }
}

struct Sensor {
    chain: Chain,
    photons: Plane<f32>,
    times: Vec<RowTimes>,
}

impl Sensor {
    fn new(photons_max: f32) -> Self {
        let parameters = Parameters { pixel: pixel_params(), adc: adc_params() };
        let effects = effects::build_all(&parameters);
        let row = (0..WIDTH).map(|column| photons_max * column as f32 / (WIDTH - 1) as f32);
        let size = Size { width_px: WIDTH as u32, height_px: HEIGHT };
        let photons = Plane::from_values(size, row.cycle().take(size.pixel_count()).collect());
        let times = vec![RowTimes { exposure_s: 0.01, storage_s: 0.001 }; HEIGHT as usize];
        Self { chain: Chain::new(parameters, effects, 1, 2), photons, times }
    }

    fn frame(&self, frame: u32) -> u16 {
        let capture = Capture { camera: CameraIndex(0), frame: FrameIndex(frame) };
        let (codes, events) = self.chain.capture(&self.photons, capture, &self.times);
        std::hint::black_box(events);
        codes.at(320, 240)
    }
}

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
    let volts: Vec<f32> = (0..WIDTH).map(|column| column as f32 * 200.0).collect();
    let converter = Converter::new(&adc_params());
    let mut codes = vec![0; WIDTH];
    group.bench_function("convert_row", |bencher| {
        bencher.iter(|| converter.convert_row(&volts, &mut codes));
    });
    group.finish();
}

criterion_group! {
    name = sensor;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(2));
    targets = whole_sensor, parts
}
criterion_main!(sensor);
