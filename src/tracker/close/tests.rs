//! One camera goes round a ring of points and drifts in scale as it goes: no step tells, since a picture has no metre. The place where
//! it started, seen again, must give the map its unit back. Metres of the first keyframe's map.

use glam::{DQuat, DVec3};

use crate::compute::Feature;
use crate::draw::DrawKey;
use crate::num::{f64_from_u64, index, low_u8, low_u16, low_u32, u32_truncated, u64_from};
use crate::optics::lens::Lens;
use crate::pose::Pose;
use crate::tracker::map::Sighting;
use crate::tracker::rig::CameraKeypoints;
use crate::tracker::row_motion::{Moving, VelocityModel};
use crate::tracker::state::{LastKeyframe, MapHistory};
use crate::tracker::{CameraCalibration, RowClock, Tracker, TrackerParams, TrackerWork};
use crate::units::{CameraIndex, Size};
use crate::words::{PositionPx, Turns};

const SIZE: Size = Size { width_px: 640, height_px: 480 };
/// Keyframes of a lap; the last one stands where the first one stood.
const LAP: u64 = 40;
const FRAMES_A_KEYFRAME: u64 = 10;
const POINTS: u64 = 500;
/// What the scale has drifted to after the lap.
const DRIFT: f64 = 1.1;

fn turn(angle_rad: f64) -> DQuat {
    DQuat::from_axis_angle(DVec3::Y, angle_rad)
}

/// On a circle of 3 m, looking outwards.
fn truth(keyframe: u64) -> Pose {
    let angle_rad = std::f64::consts::TAU * f64_from_u64(keyframe) / f64_from_u64(LAP);
    Pose::new(turn(angle_rad), turn(angle_rad) * (DVec3::Z * 3.0))
}

fn scale(keyframe: u64) -> f64 {
    libm::pow(DRIFT, f64_from_u64(keyframe) / f64_from_u64(LAP))
}

/// Where the camera believes to be: each step is measured in the unit of its time.
fn believed(keyframe: u64) -> Pose {
    (0..keyframe).fold(truth(0), |at, k| {
        let step = truth(k).inverse().then(&truth(k + 1));
        at.then(&Pose { translation_m: step.translation_m * scale(k), ..step })
    })
}

/// Points 1.5 to 3 m outside the circle, up to 1.2 m above and below it.
fn point_m(seed: u64, number: u64) -> DVec3 {
    let key = DrawKey::root(seed).with(number);
    let [around, out, up] = [0, 1, 2].map(|field| key.with(field).uniform());
    turn(std::f64::consts::TAU * around) * DVec3::new(0.0, 2.4 * up - 1.2, 4.5 + 1.5 * out)
}

struct Ring {
    seed: u64,
    tracker: Tracker,
    /// Landmark of each point in the keyframe before, by its index in the map.
    known: Vec<Option<usize>>,
}

impl Ring {
    fn new(seed: u64) -> Self {
        let lens = Lens::pinhole(SIZE, 1.5);
        let calibration = CameraCalibration { lens, size: SIZE, body_from_camera: Pose::IDENTITY };
        let tracker = Tracker::new(vec![calibration], TrackerParams::room(seed)).expect("a valid rig");
        Self { seed, tracker, known: vec![None; index(u32_truncated(f64_from_u64(POINTS)))] }
    }

    /// What the camera sees at a keyframe, with the numbers of the points.
    fn view(&self, keyframe: u64) -> (CameraKeypoints, Vec<u64>) {
        let camera = &self.tracker.cameras[0];
        let (mut features, mut numbers) = (Vec::new(), Vec::new());
        for number in 0..POINTS {
            let Some(position_px) = camera.project(truth(keyframe).inverse().point(point_m(self.seed, number))) else {
                continue;
            };
            let noise_px =
                |field| 0.5 * (DrawKey::root(self.seed).with(number).with(keyframe).with(field).uniform() - 0.5);
            let below = |position_px: f64| {
                PositionPx::from_bits(low_u16(u32_truncated(16.0 * crate::num::greater(position_px, 0.0))))
            };
            let (x, y) = (below(position_px.x + noise_px(7)), below(position_px.y + noise_px(8)));
            let look = DrawKey::root(self.seed).with(number).with(9);
            let mut descriptor = [0; 32];
            descriptor.iter_mut().zip(0_u64..).for_each(|(byte, at)| *byte = low_u8(low_u32(look.with(at).0)));
            features.push(Feature { x, y, score: 40, angle: Turns::ZERO, octave: 0, descriptor });
            numbers.push(number);
        }
        let view = CameraKeypoints::new(camera, &features, RowClock::GLOBAL);
        let numbers = view.keypoints.iter().map(|keypoint| numbers[index(keypoint.feature)]).collect();
        (view, numbers)
    }

    /// Adds a keyframe in the unit of its time. Points of the keyframe before are known; all others are new, seen before or not.
    fn visit(&mut self, keyframe: u64) -> CameraKeypoints {
        let (view, numbers) = self.view(keyframe);
        let (frame, t_s) = (keyframe * FRAMES_A_KEYFRAME, f64_from_u64(keyframe));
        let state = Moving::resting(believed(keyframe).inverse());
        let id = self.tracker.map.add_keyframe(t_s, state);
        let none = vec![None; self.known.len()];
        let before = std::mem::replace(&mut self.known, none);
        for (keypoint, &number) in view.keypoints.iter().zip(&numbers) {
            let point = index(u32_truncated(f64_from_u64(number)));
            let sighting = Sighting::of((id, CameraIndex(0)), keypoint, &self.tracker.params);
            let map = &mut self.tracker.map;
            let landmark = before[point].unwrap_or_else(|| {
                let in_camera_m = truth(keyframe).inverse().point(point_m(self.seed, number)) * scale(keyframe);
                map.add_landmark(believed(keyframe).point(in_camera_m), keypoint.descriptor, Vec::new(), frame);
                let made = map.landmarks.len() - 1;
                map.landmarks[made].born_keyframe = id;
                made
            });
            map.landmarks[landmark].see(sighting);
            map.landmarks[landmark].last_frame = frame;
            self.known[point] = Some(landmark);
        }
        self.tracker.frame = frame;
        view
    }

    fn close(&mut self, keyframe: u64, view: CameraKeypoints) -> bool {
        let t_s = f64_from_u64(keyframe);
        let last = LastKeyframe { frame: 0, world_from_body: Pose::IDENTITY, landmarks: 0 };
        let mut history = MapHistory { started_frame: 0, started_by_depth: false, located_frame: 0, keyframe: last };
        let mut motion = VelocityModel { t_s, body_from_world: Pose::IDENTITY, step: None, sigma_m: 0.0 };
        self.tracker.close_loop((t_s, &[view]), (&mut history, &mut motion), &mut TrackerWork::default())
    }

    /// How far the last keyframe is from where it is in truth, and the length of the last step in true ones.
    fn error(&self) -> (f64, f64) {
        let at_m = |back: usize| {
            let keyframes = &self.tracker.map.keyframes;
            keyframes[keyframes.len() - 1 - back].state.body_from_world.inverse().translation_m
        };
        let Some(last) = u64_from(self.tracker.map.keyframes.len()).checked_sub(1).filter(|&last| last > 0) else {
            return (0.0, 1.0);
        };
        let step_m = (truth(last).translation_m - truth(last - 1).translation_m).length();
        ((at_m(0) - truth(last).translation_m).length(), (at_m(0) - at_m(1)).length() / step_m)
    }
}

/// Four tenths of a metre off and a tenth too large, the map comes back. The graph shares the scale between the loop, known to 0.02, and 41
/// steps of 0.01: 0.02^2 / (0.02^2 + 41 * 0.01^2), a tenth, stays with the steps, and so does some of the offset. The adjustment that
/// follows rests on the first lap's landmarks, so less is left: a fifth of the offset and 3 % of the scale are the bounds.
#[test]
fn one_camera_that_drifts_in_scale_around_a_loop_has_its_unit_back_when_it_closes() {
    for seed in [81, 82, 83] {
        let mut ring = Ring::new(seed);
        let mut closed = None;
        for keyframe in 0..=LAP {
            let view = ring.visit(keyframe);
            let suspected = ring.tracker.loop_candidate.is_some();
            let (before, landmarks) = (ring.error(), ring.tracker.map.landmarks.len());
            if ring.close(keyframe, view) {
                assert!(suspected, "seed {seed}: keyframe {keyframe} alone closes nothing");
                closed = Some((keyframe, before, landmarks));
                break;
            }
        }
        let (keyframe, before, landmarks) = closed.expect("a loop is closed");
        let (after, left) = (ring.error(), ring.tracker.map.landmarks.len());
        assert!(keyframe + 3 >= LAP, "seed {seed}: keyframe {keyframe} sees too little of the first places");
        println!(
            "seed {seed}, keyframe {keyframe}: {before:.3?} m and steps before, {after:.3?} after; {landmarks} landmarks, then {left}"
        );
        assert!(before.0 > 0.2 && before.1 > 1.08, "seed {seed}: nothing drifted: {before:?}");
        assert!(after.0 < 0.2 * before.0 && (after.1 - 1.0).abs() < 0.03, "seed {seed}: {after:?} of {before:?}");
        assert!(left + 30 <= landmarks, "seed {seed}: doubled landmarks become one: {landmarks}, then {left}");
    }
}
