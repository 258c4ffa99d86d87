//! The tracker's memory over a long run, as the allocator counts it: what it holds is bounded by its parameters, not by time.

use sensel::tracker::{Status, Tracker, TrackerParams};

use super::synthetic::{Hardship, World, lively, mono_rig, room, time_s};

/// Frames of a run, and those that the map needs to fill: 15 keyframes at 12 frames at most, and 300 landmarks of 700.
const FRAMES: u64 = 1_800;
const FILLED: u64 = 600;

/// Every 300 frames, two thirds of a second in the dark: lost, found again, recognised.
fn is_dark(number: u64) -> bool {
    number % 300 >= 280
}

/// Greatest number of bytes held after a frame: until the map is full, and in the first and second half of what follows.
fn held(world: &World, count: impl Fn() -> usize) -> [usize; 3] {
    let bounds = TrackerParams { window: 4, keyframes_max: 15, landmarks_max: 300, ..TrackerParams::room(world.seed) };
    let empty = count();
    let mut tracker = Tracker::new(world.cameras.clone(), bounds).expect("a valid rig");
    let (mut most, mut tracked, mut lost, mut keyframes) = ([0; 3], 0_u32, 0_u32, 0_u32);
    for number in 0..FRAMES {
        let mut input = world.frame(number, &lively(time_s(number)));
        if is_dark(number) {
            input.features.iter_mut().for_each(Vec::clear);
        }
        let answer = tracker.track(&input);
        tracked += u32::from(matches!(answer.status, Status::Tracked));
        lost += u32::from(matches!(answer.status, Status::Lost));
        keyframes += u32::from(answer.keyframe);
        drop((input, answer));
        assert!(tracker.landmarks().len() <= 300 && tracker.keyframes().len() <= 15, "frame {number}");
        let part = usize::from(number >= FILLED) + usize::from(number >= (FILLED + FRAMES) / 2);
        most[part] = most[part].max(count() - empty);
    }
    println!("{} cameras: {most:?} bytes, {tracked} tracked, {lost} lost, {keyframes} keyframes", world.cameras.len());
    // A run that stood still or was lost for good would hold nothing and prove nothing.
    assert!(tracked > 1_500 && lost >= 100 && keyframes > 250, "{tracked} tracked, {lost} lost, {keyframes} keyframes");
    assert!(tracker.landmarks().len() > 100, "{} landmarks", tracker.landmarks().len());
    most
}

/// Vectors double as they grow, so a bound that is met once may be met again with some capacity to spare: a quarter more is allowed, where
/// the second half alone makes a hundred keyframes, seven times what may be held.
pub fn check(count: impl Fn() -> usize) {
    for cameras in [1, 2] {
        let mut world =
            World { features_max: if cameras == 1 { 200 } else { 80 }, landmarks: room(91, 700), ..World::usual(91) };
        world.hardship = Hardship { noise_px: 0.3, ..world.hardship };
        if cameras == 1 {
            world.cameras = mono_rig();
        }
        let [_, early, late] = held(&world, &count);
        assert!(early > 100_000, "{early} bytes are no map of 300 landmarks: nothing was counted");
        assert!(4 * late <= 5 * early, "{cameras} cameras: {late} bytes late, {early} early");
    }
}
