//! One camera: the map starts from two views, and its unit is its own.

use sensel::pose::{Pose, TimedPose};
use sensel::report::trajectory_figures;
use sensel::tracker::{Status, TrackedFrame, Tracker, TrackerParams};

use glam::DVec3;
use sensel::so3;

use super::synthetic::{World, lively, mono_rig, resting, stereo_rig, time_s, turning};

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

/// Truth and estimate.
fn paths(answers: &[(TimedPose, TrackedFrame)]) -> (Vec<TimedPose>, Vec<TimedPose>) {
    let pose = |(truth, answer): &(TimedPose, TrackedFrame)| {
        Some(TimedPose { t_s: truth.t_s, world_from_body: answer.world_from_body? })
    };
    (answers.iter().map(|(truth, _)| *truth).collect(), answers.iter().filter_map(pose).collect())
}

/// ATE after alignment with scale in metres, frames with a pose, and the first of them.
fn figures(answers: &[(TimedPose, TrackedFrame)]) -> (f64, usize, usize) {
    let (truth, estimate) = paths(answers);
    let first = answers.iter().position(|(_, answer)| answer.world_from_body.is_some()).unwrap_or(answers.len());
    let sim3 = trajectory_figures(&truth, &estimate).expect("poses").sim3.expect("a path that is no line");
    (sim3.ate_m, estimate.len(), first)
}

/// The frame's own error is that of two cameras, 0.5 mm: 0.5 px of 320 px at 1.5 m over 150 positions. What the map adds is larger
/// and depends on the start; with two cameras it is 2 mm. Five times that is the bound, of which 3 to 4 mm were measured.
#[test]
fn one_camera_in_a_lively_hand_is_tracked_up_to_scale() {
    for seed in [61, 62] {
        let answers = follow(&mono(seed), lively, 200, 0.0);
        let (ate_m, tracked, first) = figures(&answers);
        println!("seed {seed}: ATE {ate_m} m, {tracked} tracked from frame {first}");
        assert!(first <= 15 && tracked == 200 - first, "seed {seed}: {tracked} tracked from frame {first}");
        assert_eq!(answers[first].1.status, Status::Initialised, "seed {seed}");
        assert!(ate_m < 0.01, "seed {seed}: {ate_m} m");
    }
}

/// The rates of the two frames that start the map are held by a prior of 0.15 m/s, which over 8 ms is 1.2 mm of a first baseline of
/// some 0.1 m: about 1 % of the map's shape, 15 mm at the median depth of 1.5 m. Twice that is the bound;
/// 4 to 17 mm were measured over six seeds.
#[test]
fn one_camera_with_a_rolling_shutter_is_tracked_up_to_scale() {
    for seed in [64, 65] {
        let answers = follow(&mono(seed), lively, 150, 33e-6);
        let (ate_m, tracked, first) = figures(&answers);
        println!("seed {seed}: ATE {ate_m} m, {tracked} tracked from frame {first}");
        assert!(first <= 15 && tracked == 150 - first, "seed {seed}: {tracked} tracked from frame {first}");
        assert!(ate_m < 0.03, "seed {seed}: {ate_m} m");
    }
}

/// Corners that are found in every other frame, by chance: no frame finds all landmarks that a keyframe sees and makes, so a rule that
/// counts them makes keyframes that the way does not ask for, and ten of those span less parallax. Every fourth frame is the bound: with
/// that rule it was one in 3.4, with what is found again one in 4.5.
#[test]
fn corners_that_flicker_do_not_make_keyframes() {
    for seed in [61, 62] {
        let mut world = mono(seed);
        world.hardship.missed = 0.5;
        let answers = follow(&world, lively, 200, 0.0);
        let (ate_m, tracked, first) = figures(&answers);
        let keyframes = answers.iter().filter(|(_, answer)| answer.keyframe).count();
        println!("seed {seed}: {keyframes} keyframes of {tracked} frames, ATE {ate_m} m");
        assert!(tracked > 180, "seed {seed}: {tracked} tracked from frame {first}");
        assert!(4 * keyframes <= tracked, "seed {seed}: {keyframes} keyframes of {tracked} frames");
        assert!(ate_m < 0.01, "seed {seed}: {ate_m} m");
    }
}

/// The noise of positions is what residuals show: 1.5 px in the world show as much, less the share of the 12 unknowns that a frame and the
/// map fit to them, and what the map is wrong by on top; a third either way. Half a pixel, below the given 0.6 px, leaves a little on top
/// of it.
#[test]
fn the_noise_of_positions_is_learnt_from_one_cameras_residuals() {
    for (noise_px, least_px, most_px) in [(0.5, 0.6, 0.8), (1.5, 1.0, 2.0)] {
        let mut world = mono(63);
        world.hardship.noise_px = noise_px;
        let mut tracker = Tracker::new(world.cameras.clone(), TrackerParams::room(63)).expect("a valid rig");
        let located = (0..120).filter(|&number| {
            let answer = tracker.track(&world.frame(number, &lively(time_s(number))));
            answer.world_from_body.is_some()
        });
        let tracked = located.count();
        let learnt_px = tracker.position_sigma_px();
        println!("seed 63: {noise_px} px in the world, {learnt_px} px learnt from {tracked} frames");
        assert!(tracked > 80, "{noise_px} px: {tracked} frames");
        assert!((least_px..most_px).contains(&learnt_px), "{noise_px} px: {learnt_px} px");
    }
}

/// A rig whose two cameras look to opposite sides, 20 cm apart: nothing is seen twice at one instant.
fn opposite(seed: u64) -> World {
    let mut world = World::usual(seed);
    world.cameras[0].body_from_camera = Pose::new(so3::exp(DVec3::Y * 1.5), DVec3::new(0.1, 0.0, 0.0));
    world.cameras[1].body_from_camera = Pose::new(so3::exp(DVec3::Y * -1.6), DVec3::new(-0.1, 0.02, 0.0));
    world
}

/// The start knows the scale to 5 % at worst, and the adjustment of ten keyframes to about 1 %: of a path of 0.7 m 7 mm, and a
/// frame's own error on top. Three times that is the bound.
#[test]
fn cameras_that_see_nothing_in_common_find_their_metre_by_turning() {
    let seed = 71;
    let answers = follow(&opposite(seed), lively, 150, 0.0);
    let (truth, estimate) = paths(&answers);
    let found = trajectory_figures(&truth, &estimate).expect("poses");
    let (rigid, scaled) = (found.se3.expect("a path that is no line"), found.sim3.expect("a path that is no line"));
    println!("seed {seed}: ATE {} m, scale {}, {} tracked", rigid.ate_m, scaled.alignment.scale, estimate.len());
    assert!(estimate.len() > 120, "seed {seed}: {} tracked", estimate.len());
    assert!((scaled.alignment.scale - 1.0).abs() < 0.03, "seed {seed}: scale {}", scaled.alignment.scale);
    assert!(rigid.ate_m < 0.025, "seed {seed}: {} m", rigid.ate_m);
}

/// Four cameras see twice as much as two, so the bound of two cameras holds.
#[test]
fn four_cameras_in_any_pose_are_tracked() {
    let mut world = opposite(74);
    world.cameras.extend(stereo_rig());
    let answers = follow(&world, lively, 60, 0.0);
    let (truth, estimate) = paths(&answers);
    let ate_m = trajectory_figures(&truth, &estimate).expect("poses").se3.expect("a path that is no line").ate_m;
    println!("ATE {ate_m} m");
    assert_eq!(estimate.len(), 60);
    assert!(ate_m < 0.01, "{ate_m} m");
    let used: std::collections::BTreeSet<u32> =
        answers.iter().flat_map(|(_, answer)| &answer.inliers).map(|inlier| inlier.camera.0).collect();
    assert_eq!(used.len(), 4, "every camera supports poses");
}

#[test]
fn no_map_starts_from_one_camera_that_rests_or_turns_on_the_spot() {
    for (seed, motion) in [(67, resting as fn(f64) -> Pose), (68, turning)] {
        for (truth, answer) in follow(&mono(seed), motion, 60, 0.0) {
            assert_eq!(answer.status, Status::Waiting, "seed {seed}: at {} s", truth.t_s);
        }
    }
}

/// Wallpaper: a wall whose points look alike every 12 cm, beside a third of points of their own. A hand that starts to turn within a frame
/// puts predictions 20 px beside the picture, more than a period there.
#[test]
fn texture_that_repeats_does_not_pull_a_frame_one_period_aside() {
    let mut world = World::usual(75);
    let mut alike = 0;
    for (number, landmark) in world.landmarks.iter_mut().enumerate() {
        if number % 3 > 0 {
            // One look a row of the pattern; points at one height repeat along the wall.
            let row = sensel::num::i64_half_even(landmark.position_m.y / 0.06);
            landmark.position_m.y = 0.06 * sensel::num::f64_from_i64(row);
            let along = if landmark.position_m.x.abs() > 2.49 {
                &mut landmark.position_m.z
            } else {
                &mut landmark.position_m.x
            };
            *along = 0.12 * sensel::num::f64_from_i64(sensel::num::i64_half_even(*along / 0.12));
            landmark.look = sensel::draw::DrawKey::root(75).with(row.unsigned_abs());
            alike += 1;
        }
    }
    let jerky = |t_s: f64| {
        let turned = if t_s > 1.0 { 2.0 * (t_s - 1.0) } else { 0.0 };
        Pose::new(so3::exp(DVec3::Y * turned.min(0.6)), DVec3::new(0.3 * libm::sin(t_s), 0.0, 0.1 * t_s))
    };
    let answers = follow(&world, jerky, 60, 0.0);
    let first = answers[0].0.world_from_body.inverse();
    let mut worst_m = 0.0_f64;
    for (truth, answer) in &answers {
        let pose = answer.world_from_body.expect("tracked");
        worst_m = worst_m.max((pose.translation_m - first.then(&truth.world_from_body).translation_m).length());
    }
    println!("{alike} of {} points repeat; worst {worst_m} m", world.landmarks.len());
    assert!(alike > 1_000);
    // Half a period would be a slip; a frame's error is a few millimetres.
    assert!(worst_m < 0.03, "{worst_m} m");
}
