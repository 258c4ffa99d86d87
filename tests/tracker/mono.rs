//! One camera: the map starts from two views, and its unit is its own.

use sensel::pose::{Pose, TimedPose};
use sensel::report::trajectory_figures;
use sensel::tracker::{Status, TrackedFrame, Tracker, TrackerParams};

use glam::DVec3;
use sensel::tracker::lie::so3_exp;

use crate::synthetic::{World, lively, mono_rig, resting, stereo_rig, time_s, turning};

fn mono(seed: u64) -> World {
    World { cameras: mono_rig(), ..World::usual(seed) }
}

/// Answers beside the truth.
fn follow(world: &World, motion: fn(f64) -> Pose, frames: u64, row_time_s: f64) -> Vec<(TimedPose, TrackedFrame)> {
    let mut tracker = Tracker::new(world.cameras.clone(), TrackerParams::room(world.seed)).expect("a valid rig");
    let step = |number| {
        let timed = TimedPose { t_s: time_s(number), world_from_body: motion(time_s(number)) };
        let input = if row_time_s == 0.0 {
            world.frame(number, &timed.world_from_body)
        } else {
            world.rolling_frame(number, motion, row_time_s)
        };
        (timed, tracker.track(&input))
    };
    (0..frames).map(step).collect()
}

/// ATE after alignment with scale in metres, frames with a pose, and the first of them.
fn figures(answers: &[(TimedPose, TrackedFrame)]) -> (f64, usize, usize) {
    let truth: Vec<TimedPose> = answers.iter().map(|(truth, _)| *truth).collect();
    let pose = |(truth, answer): &(TimedPose, TrackedFrame)| {
        Some(TimedPose { t_s: truth.t_s, world_from_body: answer.world_from_body? })
    };
    let estimate: Vec<TimedPose> = answers.iter().filter_map(pose).collect();
    let first = answers.iter().position(|(_, answer)| answer.world_from_body.is_some()).unwrap_or(answers.len());
    let sim3 = trajectory_figures(&truth, &estimate).expect("poses").sim3.expect("a path that is no line");
    (sim3.ate_m, estimate.len(), first)
}

#[test]
fn one_camera_in_a_lively_hand_is_tracked_up_to_scale() {
    for seed in [61, 62, 63] {
        let answers = follow(&mono(seed), lively, 300, 0.0);
        let (ate_m, tracked, first) = figures(&answers);
        let lost = answers.iter().filter(|(_, answer)| answer.status == Status::Lost).count();
        println!("seed {seed}: ATE {ate_m} m, {tracked} tracked from {first}, {lost} lost");
    }
}

#[test]
fn one_camera_with_a_rolling_shutter_is_tracked_up_to_scale() {
    for seed in [64, 65, 66, 164, 165, 166] {
        let answers = follow(&mono(seed), lively, 300, 33e-6);
        let (ate_m, tracked, first) = figures(&answers);
        let lost = answers.iter().filter(|(_, answer)| answer.status == Status::Lost).count();
        println!("seed {seed}: ATE {ate_m} m, {tracked} tracked from {first}, {lost} lost");
    }
}

/// A rig whose two cameras look to opposite sides, 20 cm apart: nothing is seen twice at one instant.
fn opposite(seed: u64) -> World {
    let mut world = World::usual(seed);
    world.cameras[0].body_from_camera = Pose::new(so3_exp(DVec3::Y * 1.5), DVec3::new(0.1, 0.0, 0.0));
    world.cameras[1].body_from_camera = Pose::new(so3_exp(DVec3::Y * -1.6), DVec3::new(-0.1, 0.02, 0.0));
    world
}

#[test]
fn cameras_that_see_nothing_in_common_find_their_metre_by_turning() {
    for seed in [71, 72, 73] {
        let answers = follow(&opposite(seed), lively, 200, 0.0);
        let truth: Vec<TimedPose> = answers.iter().map(|(truth, _)| *truth).collect();
        let pose = |(truth, answer): &(TimedPose, TrackedFrame)| {
            Some(TimedPose { t_s: truth.t_s, world_from_body: answer.world_from_body? })
        };
        let estimate: Vec<TimedPose> = answers.iter().filter_map(pose).collect();
        let figures = trajectory_figures(&truth, &estimate).expect("poses");
        let sim3 = figures.sim3.expect("a path");
        println!("seed {seed}: se3 {:?} sim3 {} scale {} tracked {}", figures.se3.map(|f| f.ate_m), sim3.ate_m, sim3.alignment.scale, estimate.len());
    }
}

#[test]
fn four_cameras_are_tracked() {
    let mut world = opposite(74);
    let stereo = stereo_rig();
    world.cameras.extend(stereo);
    let answers = follow(&world, lively, 100, 0.0);
    println!("{:?}", figures(&answers));
}

#[test]
fn no_map_starts_from_one_camera_that_rests_or_turns_on_the_spot() {
    for (seed, motion) in [(67, resting as fn(f64) -> Pose), (68, turning)] {
        for (truth, answer) in follow(&mono(seed), motion, 60, 0.0) {
            assert_eq!(answer.status, Status::Waiting, "seed {seed}: at {} s", truth.t_s);
        }
    }
}
