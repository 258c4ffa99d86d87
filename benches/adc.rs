//! Time of a row's conversions, in one thread: the plain ramp, each thing that leaves its fast path, and the clocked rung. Elements
//! are pixels: the inverse of "elem/s" is the time per pixel.

// A bench's sizes are small and whole.
#![allow(clippy::cast_possible_truncation, missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sensel::adc::Converter;
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::fidelity::Rung;

const WIDTH: usize = 640;

/// Name, rung, and what is set besides the default sensor.
const CASES: &[(&str, Rung, &[&str])] = &[
    ("plain/analog", Rung::Sampled, &["sensor.adc.cds=analog"]),
    ("plain/digital", Rung::Sampled, &[]),
    ("table/digital", Rung::Sampled, &["sensor.adc.ramp_inl_lsb=1.0"]),
    ("delays/digital", Rung::Sampled, &["sensor.adc.comparator_delay_sigma_clk=1.0"]),
    ("kickback/digital", Rung::Sampled, &["sensor.adc.kickback_uv=1.0"]),
    ("plain/digital/clocked", Rung::Clocked, &[]),
    ("kickback/digital/clocked", Rung::Clocked, &["sensor.adc.kickback_uv=1.0"]),
];

fn conversions(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("adc");
    group.throughput(Throughput::Elements(WIDTH as u64));
    for (name, rung, more) in CASES {
        let mut assignments = vec!["scene.generator=box".to_owned()];
        assignments.extend(more.iter().map(|assignment| (*assignment).to_owned()));
        let resolved = Resolved::from_layers("bench", "", &assignments).expect("the keys are known");
        let converter = Converter::new(&resolved.scenario.adc().expect("in range")).at(*rung);
        let columns = converter.columns(DrawKey::root(1), WIDTH);
        let signal_uv: Vec<f32> = (0..WIDTH).map(|column| column as f32 * 150.0).collect();
        let (reset_uv, mut codes) = (vec![0.0; WIDTH], vec![0; WIDTH]);
        group.bench_function(*name, |bencher| {
            bencher.iter(|| columns.convert_row(&signal_uv, &reset_uv, &mut codes));
        });
    }
    group.finish();
}

criterion_group! {
    name = adc;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(1));
    targets = conversions
}
criterion_main!(adc);
