//! Time of the tracker a frame, at 500 features a camera, over a second of a lively hand.

#[path = "../tests/tracker/synthetic.rs"]
#[allow(dead_code)]
mod synthetic;

use criterion::{Criterion, criterion_group, criterion_main};
use sensel::tracker::{Tracker, TrackerParams};
use synthetic::{RATE_HZ, World, lively};

fn thirty_frames(criterion: &mut Criterion) {
    let world = World::usual(1);
    let pose = |number| lively(sensel::num::f64_from_u64(number) / RATE_HZ);
    let inputs: Vec<_> = (0..30).map(|number| world.frame(number, &pose(number))).collect();
    criterion.bench_function("tracker/thirty_frames_of_500_features", |bencher| {
        bencher.iter(|| {
            let mut tracker = Tracker::new(world.cameras.clone(), TrackerParams::room(1)).expect("a valid rig");
            inputs.iter().map(|input| tracker.track(input).tracked_features).sum::<u32>()
        });
    });
}

criterion_group!(benches, thirty_frames);
criterion_main!(benches);
