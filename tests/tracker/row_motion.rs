//! Rolling shutters: positions count at their rows' own times.

use sensel::pose::{Pose, TimedPose};
use sensel::report::trajectory_figures;
use sensel::tracker::{Tracker, TrackerParams};

use super::synthetic::{World, lively, time_s};

/// ATE and second-difference jitter in metres, and frames with a pose.
fn figures(world: &World, row_time_s: f64, corrected: bool, frames: u64) -> (f64, f64, u64) {
    let params = TrackerParams { rolling_shutter: corrected, ..TrackerParams::room(world.seed) };
    let mut tracker = Tracker::new(world.cameras.clone(), params).expect("a valid rig");
    let (mut truth, mut estimate, mut tracked) = (Vec::new(), Vec::new(), 0);
    for number in 0..frames {
        let timed = |world_from_body: Pose| TimedPose { t_s: time_s(number), world_from_body };
        truth.push(timed(lively(time_s(number))));
        let answer = tracker.track(&world.rolling_frame(number, lively, row_time_s));
        estimate.extend(answer.world_from_body.map(timed));
        tracked += u64::from(answer.world_from_body.is_some());
    }
    let se3 = trajectory_figures(&truth, &estimate).expect("poses").se3.expect("a path that is no line");
    (se3.ate_m, se3.jitter_d2_m.expect("even frames"), tracked)
}

/// 33 us per row: 15.8 ms from the first row to the last, in which this hand moves 11 mm and turns 2 degrees, 12 px. Issue 6 allows 1.5
/// times the global shutter's error and jitter; what is left is that the rate is not known exactly: it adds 12 - 6 unknowns that its
/// prior holds.
#[test]
fn rows_at_their_own_times_track_a_rolling_shutter_nearly_as_well_as_a_global_one() {
    let (mut ate_ratio, mut jitter_ratio, mut without_ratio) = (0.0, 0.0, 0.0);
    let seeds = [21, 22, 23];
    for seed in seeds {
        let world = World::usual(seed);
        let frames = 150;
        let global = figures(&world, 0.0, true, frames);
        let corrected = figures(&world, 33e-6, true, frames);
        let without = figures(&world, 33e-6, false, frames);
        println!("seed {seed}: global {global:?}, rolling corrected {corrected:?}, not corrected {without:?}");
        assert_eq!((global.2, corrected.2), (frames, frames), "seed {seed}");
        ate_ratio += corrected.0 / global.0 / 3.0;
        jitter_ratio += corrected.1 / global.1 / 3.0;
        without_ratio += without.0 / global.0 / 3.0;
    }
    assert!(ate_ratio <= 1.5 && jitter_ratio <= 1.5, "seeds {seeds:?}: {ate_ratio}, {jitter_ratio}");
    assert!(without_ratio > 2.0, "the uncorrected error must stand out: {without_ratio}");
}

#[test]
fn a_global_shutter_gives_the_same_bits_with_and_without_correction() {
    let world = World::usual(24);
    assert_eq!(figures(&world, 0.0, true, 20), figures(&world, 0.0, false, 20));
}
