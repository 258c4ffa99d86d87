//! Time of the sensor, from mean photons to codes, in one thread. The scene is the peers' (judges/sensor_speed.py): VGA, a ramp
//! of 0 to 20,000 photons, QE 0.6, full well 11,000 e-, PRNU 1 %, DSNU 3 e-, read noise 4 e-, 10 bit; ours adds dark current
//! and column offsets. Elements are pixels: the inverse of "elem/s" is the time a pixel.

// A bench's sizes are small and whole.
#![allow(clippy::cast_possible_truncation, missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sensel::adc::{self, AdcParams, Cds, Converter, Ramp};
use sensel::draw::{DrawKey, RowPlace, fill_uniforms, normals, poisson};
use sensel::effect::{Effect, RowPass};
use sensel::pixel::{self, PixelParams, PixelType};
use sensel::simd::{self, Level};
use sensel::units::{CameraIndex, FrameIndex, RowIndex};

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
    pixel: PixelParams,
    in_electrons: Vec<Box<dyn Effect>>,
    in_microvolts: Vec<Box<dyn Effect>>,
    converter: Converter,
    photons: Vec<f32>,
    values: Vec<f32>,
    uniforms: Vec<u32>,
    draws: Vec<f32>,
    codes: Vec<u16>,
}

impl Sensor {
    fn new(photons_max: f32) -> Self {
        let (pixel, adc) = (pixel_params(), adc_params());
        let mut in_electrons = pixel::effects(&pixel);
        let seam = in_electrons.iter().position(|effect| effect.domain() == sensel::effect::Domain::Microvolts);
        let mut in_microvolts = in_electrons.split_off(seam.expect("read noise is on"));
        in_microvolts.extend(adc::effects(&adc));
        let photons = (0..WIDTH).map(|column| photons_max * column as f32 / (WIDTH - 1) as f32).collect();
        let (values, uniforms, draws) = (vec![0.0; WIDTH], vec![0; WIDTH], vec![0.0; WIDTH]);
        let codes = vec![0; WIDTH * HEIGHT as usize];
        let converter = Converter::new(&adc);
        Self { pixel, in_electrons, in_microvolts, converter, photons, values, uniforms, draws, codes }
    }

    fn frame(&mut self, frame: u32) -> u16 {
        for row in 0..HEIGHT {
            self.values.copy_from_slice(&self.photons);
            pixel::photons_to_mean_electrons(&self.pixel, &mut self.values);
            self.apply(frame, row, false);
            pixel::electrons_to_microvolts(&self.pixel, &mut self.values);
            self.apply(frame, row, true);
            let start = row as usize * WIDTH;
            self.converter.convert_row(&self.values, &mut self.codes[start..start + WIDTH]);
        }
        self.codes[WIDTH * 240 + 320]
    }

    fn apply(&mut self, frame: u32, row: u32, microvolts: bool) {
        let (frame, row) = (FrameIndex(frame), RowIndex(row));
        let mut pass = RowPass {
            place: RowPlace { seed: 1, camera: CameraIndex(0), frame, slot: 0, row },
            die_seed: 2,
            exposure_s: 0.01,
            storage_s: 0.001,
            values: &mut self.values,
            uniforms: &mut self.uniforms,
            draws: &mut self.draws,
        };
        for effect in if microvolts { &self.in_microvolts } else { &self.in_electrons } {
            effect.apply(&mut pass);
        }
    }
}

fn whole_sensor(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sensor");
    group.throughput(Throughput::Elements(WIDTH as u64 * u64::from(HEIGHT)));
    for (scene, photons_max) in [("ramp_20000_photons", 20_000.0), ("ramp_20_photons", 20.0)] {
        for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
            simd::limit(level);
            let mut sensor = Sensor::new(photons_max);
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
    let mut sensor = Sensor::new(20_000.0);
    let mut key = 0;
    group.bench_function("fill_uniforms", |bencher| {
        bencher.iter(|| {
            key += 1;
            fill_uniforms(DrawKey::root(key), &mut sensor.uniforms);
        });
    });
    group.bench_function("normals", |bencher| bencher.iter(|| normals(&sensor.uniforms, &mut sensor.draws)));
    for mean_e in [0.02_f32, 1.0, 6.0, 10.0, 100.0, 10_000.0] {
        group.bench_function(format!("poisson/{mean_e}"), |bencher| {
            bencher.iter(|| {
                sensor.values.fill(mean_e);
                poisson(&sensor.uniforms, &mut sensor.values);
            });
        });
    }
    let volts: Vec<f32> = sensor.photons.iter().map(|photons| photons * 6.0).collect();
    group.bench_function("convert_row", |bencher| {
        bencher.iter(|| sensor.converter.convert_row(&volts, &mut sensor.codes[..WIDTH]));
    });
    group.finish();
}

criterion_group! {
    name = sensor;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(2));
    targets = whole_sensor, parts
}
criterion_main!(sensor);
