//! A rig at rest must neither shake nor freeze, and a tremble must come through.

use glam::{DQuat, DVec3};
use sensel::num::f64_from_usize;
use sensel::pose::{Pose, TimedPose};
use sensel::report::trajectory_figures;
use sensel::tracker::{Tracker, TrackerParams};

use super::synthetic::{Hardship, RATE_HZ, World, resting, time_s};
use sensel::words::PositionPx;

/// A sensor of 10 bit at 1,000 lux: positions scatter by 0.15 px from frame to frame where nothing moves (measured in the furnished room).
fn calm(seed: u64) -> World {
    let mut world = World::usual(seed);
    world.hardship = Hardship { noise_px: 0.15, flipped: 0.02, ..world.hardship };
    world
}

fn follow(world: &World, motion: fn(f64) -> Pose, frames: u64) -> (Vec<TimedPose>, Vec<TimedPose>) {
    follow_positions(world, motion, frames, |position| position)
}

/// The same, of corners whose columns and rows an extractor gives in its own way.
fn follow_positions(
    world: &World,
    motion: fn(f64) -> Pose,
    frames: u64,
    given: fn(PositionPx) -> PositionPx,
) -> (Vec<TimedPose>, Vec<TimedPose>) {
    let mut tracker = Tracker::new(world.cameras.clone(), TrackerParams::room(world.seed)).expect("a valid rig");
    let (mut truth, mut estimate) = (Vec::new(), Vec::new());
    for number in 0..frames {
        let timed = |world_from_body: Pose| TimedPose { t_s: time_s(number), world_from_body };
        truth.push(timed(motion(time_s(number))));
        let mut frame = world.frame(number, &motion(time_s(number)));
        for feature in frame.features.iter_mut().flatten() {
            (feature.x, feature.y) = (given(feature.x), given(feature.y));
        }
        let answer = tracker.track(&frame);
        estimate.push(timed(answer.world_from_body.expect("tracked")));
    }
    (truth, estimate)
}

#[test]
fn a_still_rig_shakes_by_less_than_a_quarter_of_a_millimetre_and_is_not_frozen() {
    for seed in [31, 32, 33] {
        let (truth, estimate) = follow(&calm(seed), resting, 90);
        let still = trajectory_figures(&truth, &estimate).unwrap().still;
        println!("seed {seed}: {still:?}");
        // Issue 6; 0.15 px on some 250 positions leave 0.15 / 320 * 1.5 m / sqrt(250 / 6) = 0.11 mm.
        assert!(*still.jitter_d2_m.as_ref().unwrap() < 0.25e-3, "seed {seed}: {still:?}");
        assert!(still.steps_under_1um < 0.05, "seed {seed}: {still:?}");
    }
}

/// A tremble of 1 mm at 1 Hz along the rig's x.
fn trembling(t_s: f64) -> Pose {
    let x_m = 1e-3 * libm::sin(std::f64::consts::TAU * t_s);
    Pose::new(DQuat::IDENTITY, DVec3::new(x_m, 0.0, 0.0))
}

/// Amplitude of the path along x at 1 Hz. Over whole periods, so that the sine and the cosine are orthogonal to each other and to a
/// constant.
fn amplitude_m(estimate: &[TimedPose]) -> f64 {
    let of = |wave: fn(f64) -> f64| {
        let at = |pose: &TimedPose| pose.world_from_body.translation_m.x * wave(std::f64::consts::TAU * pose.t_s);
        2.0 * estimate.iter().map(at).sum::<f64>() / f64_from_usize(estimate.len())
    };
    libm::hypot(of(libm::sin), of(libm::cos))
}

#[test]
fn a_tremble_of_a_millimetre_a_second_comes_through_within_a_fifth() {
    for seed in [34, 35, 36] {
        let (_, estimate) = follow(&calm(seed), trembling, 90);
        let amplitude_m = amplitude_m(&estimate);
        println!("seed {seed}: {:.4} mm at {RATE_HZ} Hz", 1e3 * amplitude_m);
        // Issue 6: within 20 %. The noise of a frame, 0.11 mm, leaves 0.11 * sqrt(2 / 90) = 0.016 mm of an amplitude.
        assert!((amplitude_m - 1e-3).abs() < 0.2e-3, "seed {seed}: {amplitude_m}");
    }
}

/// Positions are drawn to whole pixels: a tenth of a motion shows there, and 1.9 of it half-way between. Where little else is wrong with
/// them, those that stay must not outvote those that go.
#[test]
fn a_tremble_comes_through_where_corners_stick_to_whole_pixels() {
    let sticky = |position: PositionPx| {
        let position_px = f64::from(position) + 0.5;
        let off = position_px - libm::floor(position_px) - 0.5;
        let drawn = off - 0.9 / std::f64::consts::TAU * libm::sin(std::f64::consts::TAU * off);
        PositionPx::saturating_from_num(libm::floor(position_px) + drawn)
    };
    for seed in [37, 38, 39] {
        let mut world = calm(seed);
        world.hardship.noise_px = 0.05;
        let (_, estimate) = follow_positions(&world, trembling, 90, sticky);
        let amplitude_m = amplitude_m(&estimate);
        println!("seed {seed}: {:.4} mm", 1e3 * amplitude_m);
        assert!((amplitude_m - 1e-3).abs() < 0.2e-3, "seed {seed}: {amplitude_m}");
    }
}
