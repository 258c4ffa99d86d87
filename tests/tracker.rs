//! The tracker on synthetic worlds, through its front door.

#[path = "tracker/hard.rs"]
mod hard;
#[path = "tracker/imu.rs"]
mod imu;
#[path = "tracker/loops.rs"]
mod loops;
#[path = "tracker/mono.rs"]
mod mono;
#[path = "tracker/still.rs"]
mod still;
#[path = "tracker/row_motion.rs"]
mod row_motion;
#[path = "tracker/synthetic.rs"]
mod synthetic;

use glam::{DVec2, DVec3};
use sensel::pose::Pose;
use sensel::tracker::{FrameInput, Status, TrackedFrame, Tracker, TrackerParams};
use synthetic::{RATE_HZ, World, corner, fisheye_rig, lively, resting, room, score, stereo_rig, turning};

fn tracker(world: &World) -> Tracker {
    Tracker::new(world.cameras.clone(), TrackerParams::room(world.seed)).expect("a valid rig")
}

/// Runs a world along a motion, with a change of each frame on its way.
fn run_with(
    world: &World,
    (motion, frames): (fn(f64) -> Pose, u64),
    change: impl Fn(u64, &mut FrameInput),
) -> Vec<(Pose, TrackedFrame)> {
    let mut tracker = tracker(world);
    let step = |number| {
        let truth = motion(sensel::num::f64_from_u64(number) / RATE_HZ);
        let mut input = world.frame(number, &truth);
        change(number, &mut input);
        (truth, tracker.track(&input))
    };
    (0..frames).map(step).collect()
}

fn run(world: &World, motion: fn(f64) -> Pose, frames: u64) -> Vec<(Pose, TrackedFrame)> {
    run_with(world, (motion, frames), |_, _| {})
}

/// A frame's pose hangs on some 150 positions of 0.5 px: the position error of a frame is about
/// 0.5 px / 320 px * 1.5 m / sqrt(150 / 6) = 0.5 mm. The map it hangs on starts from one stereo pair whose depths are off by
/// 0.7 px * 1.5 m^2 / (320 px * 0.065 m) = 8 cm each, which averages out over 150 points and ten keyframes to about 2 mm. A
/// centimetre is four times that.
#[test]
fn a_lively_hand_in_a_room_is_tracked_in_every_frame_within_a_centimetre() {
    for seed in [1, 2, 3] {
        let answers = run(&World::usual(seed), lively, 300);
        let score = score(&answers);
        println!("seed {seed}: {score:?}");
        assert_eq!((score.tracked, score.relocalised), (300, 0), "seed {seed}");
        assert_eq!(answers[0].1.status, Status::Initialised);
        assert!(score.ate_m < 0.01 && score.worst_m < 0.03, "seed {seed}: {score:?}");
        assert!(score.keyframes > 10 && score.features_min >= 30, "seed {seed}: {score:?}");
    }
}

/// As above with pixels of 1 / 191 rad in place of 1 / 320: positions and depths are known less well by that ratio, 1.7.
#[test]
fn fisheyes_that_see_behind_themselves_are_tracked_as_well() {
    let world = World { cameras: fisheye_rig(), ..World::usual(4) };
    let lens = world.cameras[0].lens;
    let behind = |input: &FrameInput| {
        let positions = input.features[0].iter().map(|feature| DVec2::new(feature.x_px(), feature.y_px()));
        positions.filter(|&position_px| lens.unproject(position_px).is_some_and(|bearing| bearing.z < 0.0)).count()
    };
    assert!(behind(&world.frame(0, &lively(0.0))) > 20, "features lie behind the camera's plane");
    let score = score(&run(&world, lively, 150));
    println!("seed 4: {score:?}");
    assert_eq!((score.tracked, score.relocalised), (150, 0));
    assert!(score.ate_m < 0.02 && score.worst_m < 0.05, "{score:?}");
}

#[test]
fn two_runs_give_the_same_bytes_and_another_seed_gives_others() {
    let answers = |seed| run(&World::usual(seed), lively, 60);
    assert_eq!(answers(4), answers(4));
    assert_ne!(answers(4), answers(5));
}

#[test]
fn a_frame_without_features_is_lost_and_never_a_panic() {
    let world = World::usual(6);
    let mut tracker = tracker(&world);
    let empty = |t_s| FrameInput { t_s, features: vec![Vec::new(); 2], clocks: Vec::new() };
    assert_eq!(tracker.track(&empty(0.0)).status, Status::Waiting);
    let mut input = world.frame(1, &resting(0.0));
    assert_eq!(tracker.track(&input).status, Status::Initialised);
    let lost = tracker.track(&empty(0.1));
    assert_eq!((lost.status, lost.world_from_body), (Status::Lost, None));
    input.t_s = 0.2;
    assert_eq!(tracker.track(&input).status, Status::Relocalised);
}

#[test]
fn ten_lost_frames_are_followed_by_the_pose_that_the_map_knows() {
    let world = World::usual(7);
    let answers = run_with(&world, (lively, 90), |number, input| {
        if (50..60).contains(&number) {
            input.features.iter_mut().for_each(Vec::clear);
        }
    });
    for (number, (_, answer)) in answers.iter().enumerate() {
        let expected = if (50..60).contains(&number) { Status::Lost } else { answer.status };
        assert_eq!(answer.status, expected, "frame {number}");
    }
    assert_eq!(answers[60].1.status, Status::Relocalised);
    let score = score(&answers);
    assert_eq!((score.tracked, score.relocalised), (80, 1));
    assert!(score.worst_m < 0.03, "{score:?}"); // As in the undisturbed run.
}

#[test]
fn turning_on_the_spot_moves_no_position() {
    let score = score(&run(&World::usual(8), turning, 120));
    assert_eq!(score.tracked, 120);
    // No parallax ever improves the stereo depths of 8 cm, but position hangs on them only through the turned baseline arm.
    assert!(score.worst_m < 0.02, "{score:?}");
}

#[test]
fn a_single_plane_is_enough() {
    let mut world = World::usual(9);
    world.landmarks = room(9, 6_000);
    world.landmarks.retain(|landmark| landmark.position_m.z == synthetic::ROOM_M.z);
    let score = score(&run(&world, |t_s| Pose::new(glam::DQuat::IDENTITY, lively(t_s).translation_m), 90));
    assert_eq!(score.tracked, 90);
    assert!(score.worst_m < 0.03, "{score:?}");
}

/// Features on one line leave the turn about that line to far fewer digits, yet every answer must be finite.
#[test]
fn features_on_one_line_give_finite_poses_or_none() {
    let mut world = World::usual(10);
    for landmark in &mut world.landmarks {
        landmark.position_m = DVec3::new(landmark.position_m.x, 0.2, 1.2);
    }
    let answers = run(&world, resting, 20);
    for (_, answer) in &answers {
        assert!(answer.world_from_body.is_none_or(|pose| pose.translation_m.is_finite() && pose.rotation.is_finite()));
    }
    assert!(answers.iter().any(|(_, answer)| answer.world_from_body.is_some()), "a line has depth: it can start a map");
}

#[test]
fn points_at_infinity_start_no_map() {
    let mut world = World::usual(11);
    for landmark in &mut world.landmarks {
        landmark.position_m *= 1e6;
    }
    for (_, answer) in run(&world, resting, 5) {
        assert_eq!(answer.status, Status::Waiting);
    }
}

#[test]
fn a_body_at_rest_stays_within_millimetres_and_does_not_freeze() {
    let answers = run(&World::usual(12), resting, 60);
    let score = score(&answers);
    assert_eq!(score.tracked, 60);
    assert!(score.worst_m < 0.005, "{score:?}");
    let position_m = |n: usize| answers[n].1.world_from_body.unwrap().translation_m;
    let moved = (1..60).filter(|&n| (position_m(n) - position_m(n - 1)).length() > 1e-6).count();
    assert!(moved >= 55, "a pose that does not follow its noise is not measured: {moved} of 59 steps");
}

#[test]
fn points_behind_the_camera_and_corners_without_descriptor_are_passed_over() {
    let world = World::usual(13);
    let mut tracker = tracker(&world);
    let blank = corner(DVec2::new(100.0, 100.0), world.cameras[0].size, [0; 32]).unwrap();
    assert_eq!(
        tracker.track(&FrameInput { t_s: 0.0, features: vec![vec![blank; 300]; 2], clocks: Vec::new() }).status,
        Status::Waiting
    );
    // Turned about by half a turn between two frames, all landmarks lie behind: lost, not tracked.
    assert_eq!(tracker.track(&world.frame(1, &resting(0.0))).status, Status::Initialised);
    let about = Pose::new(glam::DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0), DVec3::ZERO);
    assert_eq!(tracker.track(&world.frame(2, &about)).status, Status::Lost);
}

#[test]
fn senseless_rigs_and_parameters_are_refused_by_name() {
    let room = TrackerParams::room(1);
    let refused = |cameras: usize, params| {
        let calibrations = stereo_rig().into_iter().take(cameras).collect();
        Tracker::new(calibrations, params).map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused(0, room).contains("rig.cameras"));
    assert!(refused(2, TrackerParams { window: 1, ..room }).contains("tracker.window"));
    assert!(refused(2, TrackerParams { position_sigma_px: f64::NAN, ..room }).contains("tracker.position_sigma_px"));
    assert!(refused(2, TrackerParams { search_radius_wide_px: 1.0, ..room }).contains("search_radius_wide_px"));
    let same = vec![stereo_rig()[0]; 2];
    assert!(Tracker::new(same, room).is_err());
}
