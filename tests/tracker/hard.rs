//! Hard cases by name.

use glam::DVec2;
use sensel::num::f64_from_u64;
use sensel::tracker::{FrameInput, LossReason, Status, Tracker, TrackerParams};

use super::synthetic::{RATE_HZ, World, lively, resting};
use sensel::words::PositionPx;

fn tracker(world: &World) -> Tracker {
    Tracker::new(world.cameras.clone(), TrackerParams::room(world.seed)).expect("a valid rig")
}

/// Status of each frame, with a change of the frame on its way; poses must be finite and near the truth wherever there are any.
fn run(world: &World, frames: u64, mut change: impl FnMut(u64, &mut FrameInput)) -> Vec<Status> {
    let mut tracker = tracker(world);
    let mut first = None;
    let step = |number| {
        let truth = lively(f64_from_u64(number) / RATE_HZ);
        let mut input = world.frame(number, &truth);
        change(number, &mut input);
        let answer = tracker.track(&input);
        if let Some(pose) = answer.world_from_body {
            let world_from_room = *first.get_or_insert(truth.inverse());
            let off_m = (pose.translation_m - world_from_room.then(&truth).translation_m).length();
            assert!(off_m < 0.05, "frame {number} is {off_m} m off");
        }
        answer.status
    };
    (0..frames).map(step).collect()
}

#[test]
fn dark_frames_wait_and_the_map_starts_with_the_light() {
    let statuses = run(&World::usual(41), 30, |number, input| {
        if number < 10 {
            input.features.iter_mut().for_each(Vec::clear);
        }
    });
    assert!(statuses[..10].iter().all(|&status| status == Status::Waiting));
    assert_eq!(statuses[10], Status::Initialised);
    assert!(statuses[11..].iter().all(|&status| status == Status::Tracked));
}

/// The host missed a second: the motion model is of no use, the map is.
#[test]
fn a_jump_in_time_is_bridged_by_the_map() {
    let world = World::usual(42);
    let mut tracker = tracker(&world);
    let mut found = 0;
    for number in (0..60).chain(90..120) {
        let answer = tracker.track(&world.frame(number, &lively(f64_from_u64(number) / RATE_HZ)));
        found += u32::from(matches!(answer.status, Status::Tracked | Status::Relocalised));
        assert!(number < 92 || answer.status == Status::Tracked, "frame {number}: {:?}", answer.status);
    }
    assert!(found >= 88, "{found} of 89 frames after the first have a pose");
}

#[test]
fn identical_pictures_give_identical_poses() {
    let world = World::usual(43);
    let mut tracker = tracker(&world);
    let input = world.frame(0, &resting(0.0));
    let mut worst_m = 0.0_f64;
    for number in 0..20 {
        let t_s = f64_from_u64(number) / RATE_HZ;
        let answer = tracker.track(&FrameInput { t_s, ..input.clone() });
        worst_m = worst_m.max(answer.world_from_body.expect("tracked").translation_m.length());
    }
    // Every frame has the errors of the first, which made the map: nothing is left to move by but the adjustment's weights.
    assert!(worst_m < 1e-3, "{worst_m}");
}

/// Codes of 2 bits leave plateaus: corners snap to whole pixels, and every second bit of a descriptor is a toss among equal values.
#[test]
fn plateaus_of_two_bits_are_tracked() {
    let mut world = World::usual(44);
    world.hardship.flipped = 0.1;
    let statuses = run(&world, 60, |_, input| {
        for feature in input.features.iter_mut().flatten() {
            let whole = |position: PositionPx| position.saturating_add(PositionPx::lit("0.5")).int();
            (feature.x, feature.y) = (whole(feature.x), whole(feature.y));
        }
    });
    let tracked = statuses.iter().filter(|&&status| status == Status::Tracked).count();
    assert!(tracked >= 58, "{tracked} of 59 frames after the first");
}

/// All at one position in the picture, and all with one look.
#[test]
fn a_thousand_equal_features_are_neither_tracked_nor_a_panic() {
    let world = World::usual(45);
    let mut tracker = tracker(&world);
    let one = world.frame(0, &resting(0.0)).features[0][0];
    for number in 0..5 {
        let t_s = f64_from_u64(number) / RATE_HZ;
        let answer = tracker.track(&FrameInput { t_s, features: vec![vec![one; 1_000]; 2], clocks: Vec::new() });
        assert_eq!(answer.status, Status::Waiting);
    }
}

/// A doorway in the dark: the few corners that are left lie close together. They support a pose whose position is uncertain, which is
/// taken for two frames at most.
#[test]
fn a_position_that_stays_uncertain_is_lost_and_says_why() {
    let world = World::usual(46);
    let mut tracker = tracker(&world);
    let answers: Vec<_> = (0..50)
        .map(|number| {
            let mut input = world.frame(number, &lively(f64_from_u64(number) / RATE_HZ));
            if number >= 40 {
                for features in &mut input.features {
                    features.retain(|feature| {
                        DVec2::new(feature.x_px(), feature.y_px()).distance(DVec2::new(320.0, 240.0)) < 44.0
                    });
                }
            }
            tracker.track(&input)
        })
        .collect();
    assert!(answers[1..42].iter().all(|answer| answer.status == Status::Tracked && answer.loss.is_none()));
    assert_eq!((answers[42].status, answers[42].loss), (Status::Lost, Some(LossReason::Uncertain)));
    let events: Vec<_> = answers[42].events(Some(Status::Tracked)).collect();
    assert_eq!(events, [("lost", Some("the position is too uncertain"))]);
}
