//! Places seen again.

use glam::DVec3;
use sensel::pose::{Pose, TimedPose};
use sensel::report::trajectory_figures;
use sensel::so3;
use sensel::tracker::{Tracker, TrackerParams};

use super::synthetic::{Hardship, World, room, time_s};

/// A hall of 20 x 2.5 x 14 m with landmarks some metres away, seen by pixels that are worse than usual, so that a lap drifts.
fn hall(seed: u64) -> World {
    let mut world = World::usual(seed);
    world.landmarks = room(seed, 2_200);
    for landmark in &mut world.landmarks {
        landmark.position_m *= DVec3::new(4.0, 1.0, 5.0);
    }
    world.hardship = Hardship { noise_px: 0.8, ..world.hardship };
    world.features_max = 500;
    world
}

const LAP_S: f64 = 10.0;

/// Around a circle of 3 m in 10 s, looking ahead.
fn lapping(t_s: f64) -> Pose {
    let turn = std::f64::consts::TAU * t_s / LAP_S;
    let position_m = DVec3::new(3.0 * libm::sin(turn), 0.0, -3.0 * libm::cos(turn));
    let ahead = so3::exp(DVec3::Y * (0.5 * std::f64::consts::PI - turn));
    Pose::new(ahead, position_m)
}

/// ATE in metres over the poses as they were given out, closed loops, and landmarks held at the end.
fn lap(world: &World, loop_closing: bool, frames: u64) -> (f64, u32, usize) {
    let params = TrackerParams { loop_closing, ..TrackerParams::room(world.seed) };
    // Focal lengths that are told 1.5 % too long make every turn too short: a lap ends 5 degrees, 30 px, beside its start.
    let mut cameras = world.cameras.clone();
    for camera in &mut cameras {
        camera.lens.intrinsics.fx_px *= 1.015;
        camera.lens.intrinsics.fy_px *= 1.015;
    }
    let mut tracker = Tracker::new(cameras, params).expect("a valid rig");
    let (mut truth, mut estimate, mut closed) = (Vec::new(), Vec::new(), 0);
    for number in 0..frames {
        let timed = |world_from_body: Pose| TimedPose { t_s: time_s(number), world_from_body };
        truth.push(timed(lapping(time_s(number))));
        let answer = tracker.track(&world.frame(number, &lapping(time_s(number))));
        estimate.extend(answer.world_from_body.map(timed));
        closed += u32::from(answer.loop_closed);
        if answer.loop_closed {
            println!("frame {number}: loop closed");
        }
    }
    let se3 = trajectory_figures(&truth, &estimate).expect("poses").se3.expect("a path that is no line");
    let kept = trajectory_figures(&truth, &tracker.keyframes()).expect("poses").se3.expect("a path that is no line");
    println!(
        "seed {}: loops {closed}, frames {:.4} m, keyframes {:.4} m, {}",
        world.seed,
        se3.ate_m,
        kept.ate_m,
        estimate.len()
    );
    (se3.ate_m, closed, tracker.landmarks().len())
}

#[test]
fn a_second_lap_closes_the_loop_and_straightens_the_map() {
    let seed = 51;
    let world = hall(seed);
    let (open_m, none, _) = lap(&world, false, 400);
    let (closed_m, closed, landmarks) = lap(&world, true, 400);
    assert_eq!(none, 0);
    assert!(closed >= 1, "seed {seed}: no loop was closed");
    // Measured: 0.29 m of 0.44 m. The wrong focal length goes on bending the path after each closing, so the rest stays.
    assert!(closed_m < 0.8 * open_m, "seed {seed}: {closed_m} m closed, {open_m} m open");
    assert!(landmarks <= 8_000);
}

/// With room for 600 landmarks a lap of 10 s through a hall of 2,200 fills the map several times over. What is dropped must be what is far
/// away: each frame still rests on a quarter of the 250 or so landmarks that it rests on with room for all.
#[test]
fn a_full_map_takes_in_what_is_new() {
    let world = hall(61);
    let least_of = |landmarks_max: u32| {
        let params = TrackerParams { landmarks_max, loop_closing: false, ..TrackerParams::room(world.seed) };
        let mut tracker = Tracker::new(world.cameras.clone(), params).expect("a valid rig");
        let mut least = u32::MAX;
        for number in 0..300 {
            let answer = tracker.track(&world.frame(number, &lapping(time_s(number))));
            assert!(answer.world_from_body.is_some(), "frame {number} is lost with room for {landmarks_max}");
            least = least.min(answer.tracked_features);
        }
        (least, tracker.landmarks().len())
    };
    let (roomy, held) = least_of(8_000);
    let (tight, kept) = least_of(600);
    println!("{roomy} features at least with {held} landmarks, {tight} with {kept}");
    assert!(held > 1_500, "{held} landmarks do not fill the map");
    assert!(kept <= 600 && 4 * tight >= roomy, "{tight} features of {roomy}, {kept} landmarks");
}
