//! Speed of rendering: the first VGA frame of one camera of each scene, as its scenario asks for it, on one thread at each level and on
//! all threads; and the time that building the furnished room's tree takes.

#[path = "common/scenario.rs"]
mod scenario;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use scenario::first_frame;
use sensel::scene::{Scene, bvh::Bvh};
use sensel::simd::{Level, limit};
use std::hint::black_box;
use std::time::Duration;

const BATHROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bathroom/bathroom.glb");

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("render_vga_first_frame");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    group.throughput(Throughput::Elements(640 * 480));
    for scene in scenario::FIVE {
        let session = first_frame(scene, &[]);
        let run = || black_box(&session).next_exposures().expect("a sound scenario");
        for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
            limit(level);
            let id = BenchmarkId::new(format!("{scene}_one_thread"), format!("{level:?}"));
            group.bench_function(id, |bencher| bencher.iter(|| on_one_thread(run)));
        }
        limit(Level::Avx512);
        group.bench_function(format!("{scene}_all_threads"), |bencher| bencher.iter(run));
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

fn trees(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("tree");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5));
    let bytes = std::fs::read(BATHROOM).expect("the bathroom lies among the scenes");
    let mesh = Scene::from_glb("bathroom", &bytes).expect("the bathroom is a scene").mesh;
    let corners_m: Vec<_> = (0..mesh.triangles.len()).map(|triangle| mesh.corners_m(triangle)).collect();
    group.throughput(Throughput::Elements(u64::try_from(corners_m.len()).expect("a count")));
    group.bench_function("bathroom", |bencher| bencher.iter(|| Bvh::build(black_box(&corners_m))));
    group.finish();
}

criterion_group!(benches, frames, trees);
criterion_main!(benches);
