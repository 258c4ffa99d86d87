//! Speed of rendering: a VGA frame of 16 samples with blur, rolling shutter, distortion and filtered textures, in the furnished bathroom
//! and in the box room, on one thread and on all; and the time that building the bathroom's tree takes.
//!
//! Mirrors are followed as scenarios do by default, and gloss is not.
//!
//! The light is even: what a ray costs does not depend on how bright it is, and a bake would take longer than the bench.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DQuat, DVec3};
use sensel::draw::DrawKey;
use sensel::optics::lens::{Lens, Mapping, Radtan};
use sensel::optics::{Aperture, Camera, Pupil, RollOff, Sampling, render};
use sensel::pose::Pose;
use sensel::scene::{Illuminant, LitScene, Scene, Surroundings, box_room, bvh::Bvh};
use sensel::simd::{Level, limit};
use sensel::units::{Size, Span};
use std::hint::black_box;
use std::time::Duration;

const SIZE: Size = Size { width_px: 640, height_px: 480 };
const SAMPLES: u32 = 16;
const BATHROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bathroom/bathroom.glb");

fn bathroom() -> Scene {
    let bytes = std::fs::read(BATHROOM).expect("the bathroom lies among the scenes");
    Scene::from_glb_in("bathroom", &bytes, &Surroundings::default()).expect("the bathroom is a scene")
}

/// A walking turn: 0.5 rad/s and 0.5 m/s, over 10 ms.
fn pose(eye_m: DVec3, yaw_rad: f64, t_s: f64) -> Pose {
    Pose::new(DQuat::from_rotation_y(yaw_rad + 0.5 * t_s), eye_m + DVec3::new(0.5 * t_s, 0.0, 0.0))
}

fn camera() -> Camera {
    let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
    let mapping = Mapping::Radtan(Radtan { k1: -0.05, k2: 0.01, p1: 1e-4, p2: -2e-4, k3: 0.0 });
    let lens = Lens { mapping, ..Lens::pinhole(SIZE, 1.57) };
    Camera::new(lens, SIZE, Pose::IDENTITY, aperture, 3.0, RollOff::Cos4).expect("a sound camera")
}

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("render_vga_16_samples");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    group.throughput(Throughput::Elements(640 * 480 * u64::from(SAMPLES)));
    let camera = camera();
    let row = |row: u32| Span { start_s: 30e-6 * f64::from(row), end_s: 30e-6 * f64::from(row) + 0.01 };
    let shutter: Vec<Span> = (0..480).map(row).collect();
    for (name, scene) in [("bathroom", bathroom()), ("box", box_room::box_room(1))] {
        let eye_m = middle_m(&scene);
        let scene = scene.evenly_lit(300.0, Illuminant::D65);
        let sampling = Sampling { reflections: 2, follows_gloss: false, ..Sampling::fixed(SAMPLES, DrawKey::root(1)) };
        let run = |scene: &LitScene| render(scene, &camera, &shutter, &|t_s| pose(eye_m, 0.4, t_s), sampling);
        for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
            limit(level);
            let id = BenchmarkId::new(format!("{name}_one_thread"), format!("{level:?}"));
            group.bench_with_input(id, &scene, |bencher, scene| {
                bencher.iter(|| on_one_thread(|| run(black_box(scene))))
            });
        }
        limit(Level::Avx512);
        group.bench_function(format!("{name}_all_threads"), |bencher| bencher.iter(|| run(black_box(&scene))));
    }
    group.finish();
}

#[cfg(feature = "parallel")]
fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    use std::sync::LazyLock;
    static POOL: LazyLock<rayon::ThreadPool> =
        LazyLock::new(|| rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread"));
    POOL.install(work)
}

#[cfg(not(feature = "parallel"))]
fn on_one_thread<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// The middle of a scene's bounding box.
fn middle_m(scene: &Scene) -> DVec3 {
    let (mut least, mut greatest) = (DVec3::MAX, DVec3::MIN);
    for vertex in &scene.mesh.vertices {
        let at = DVec3::from_array(vertex.position_m.map(f64::from));
        (least, greatest) = (least.min(at), greatest.max(at));
    }
    (least + greatest) * 0.5
}

fn trees(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("tree");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5));
    let mesh = bathroom().mesh;
    let corners_m: Vec<_> = (0..mesh.triangles.len()).map(|triangle| mesh.corners_m(triangle)).collect();
    group.throughput(Throughput::Elements(u64::try_from(corners_m.len()).expect("a count")));
    group.bench_function("bathroom", |bencher| bencher.iter(|| Bvh::build(black_box(&corners_m))));
    group.finish();
}

criterion_group!(benches, frames, trees);
criterion_main!(benches);
