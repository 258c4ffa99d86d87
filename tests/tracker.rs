//! The tracker on synthetic worlds, through its front door.

#[path = "tracker/synthetic.rs"]
mod synthetic;

use sensel::pose::Pose;
use sensel::tracker::{Status, TrackedFrame, Tracker, TrackerParams};
use synthetic::{RATE_HZ, Score, World, lively, score};

/// Runs a world along a motion.
fn run(world: &World, motion: fn(f64) -> Pose, frames: u64) -> Vec<(Pose, TrackedFrame)> {
    let mut tracker = Tracker::new(world.cameras.clone(), TrackerParams::room(world.seed)).unwrap();
    (0..frames)
        .map(|number| {
            let truth = motion(sensel::num::f64_from_u64(number) / RATE_HZ);
            (truth, tracker.track(&world.frame(number, &truth)))
        })
        .collect()
}

#[test]
fn a_lively_hand_in_a_room_is_tracked_in_every_frame_within_a_centimetre() {
    for seed in [1, 2, 3] {
        let answers = run(&World::usual(seed), lively, 300);
        let score: Score = score(&answers);
        println!("seed {seed}: {score:?}");
        assert_eq!(score.tracked, 300, "seed {seed}");
        assert_eq!(answers[0].1.status, Status::Initialised);
        assert!(score.ate_m < 0.01, "seed {seed}: ATE {} m", score.ate_m);
    }
}
