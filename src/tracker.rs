//! The host's tracker. Enters: decoded features of every camera, and calibration. Leaves: a pose a frame and a map. It never
//! sees the simulation.
//!
//! Stereo odometry with a lasting map: landmarks are searched where constant velocity predicts them, the pose is the robust
//! least-squares fit to the places where they are found, and at keyframes new landmarks come in and a window of keyframes is
//! adjusted. Every place counts at its row's own time. After loss the map is searched by descriptors alone; a place seen again far from
//! where the map has it closes a loop. The world is the body's frame at the first frame.
//! Poses are metres and unit quaternions, places pixels, times seconds. Equal input gives equal bytes.

pub mod adjust;
mod answer;
mod close;
pub mod covariance;
pub mod dense;
pub mod epipolar;
pub mod extend;
pub mod initial;
pub mod lie;
pub mod locate;
pub mod map;
pub mod marginal;
pub mod matching;
pub mod p3p;
mod params;
pub mod polynomial;
pub mod pose_graph;
pub mod preintegrate;
pub mod ransac;
pub mod refine;
pub mod rig;
mod shift;
pub mod start;
pub mod sweep;

use crate::draw::DrawKey;
use crate::error::Error;
use crate::num::index;
use crate::pose::{Pose, TimedPose};

pub use answer::{FrameInput, Inlier, Status, TrackedFrame, Work};
use close::Suspicion;
use extend::{Growth, Waiting, adjust_window};
use lie::Twist;
use locate::{Frame, Located};
use map::{Landmark, Map};
pub use params::TrackerParams;
pub use rig::CameraCalibration;
use rig::{RigCamera, View};
use start::{Opening, Stage};
pub use sweep::RowClock;
use sweep::{Motion, Moving, ahead_of, between};

/// The published number of the tracker's draws.
const DRAWS: u64 = 0x7472_6163_6b65_7231;

/// Keyframes whose sights without a landmark wait for a second view where no other camera gives depth: a hand that turns comes by.
const REACH_WITHOUT_DEPTH: usize = 6;

/// Turns of rates and adjustment at a start from two views of moving rows.
const SWEPT_ROUNDS: u32 = 3;
/// A map that one camera started and lost for so many frames is given up while it has fewer keyframes than this: its start was false.
const GIVEN_UP_FRAMES: u64 = 15;
const YOUNG_KEYFRAMES: usize = 6;

/// The last keyframe, as far as the next one depends on it.
#[derive(Clone, Copy, Debug)]
struct LastKeyframe {
    frame: u64,
    world_from_body: Pose,
    landmarks: u32,
}

/// A tracker of any number of cameras.
#[derive(Clone, Debug)]
pub struct Tracker {
    cameras: Vec<RigCamera>,
    params: TrackerParams,
    map: Map,
    waiting: Waiting,
    opening: Opening,
    motion: Option<Motion>,
    last_keyframe: Option<LastKeyframe>,
    lost: bool,
    last_located_frame: Option<u64>,
    /// Sights that supported the last pose.
    inliers_before: u32,
    frame: u64,
    /// The first frame, where its rows were taken as simultaneous.
    unswept_frame: Option<u64>,
    suspicion: Option<Suspicion>,
    last_t_s: f64,
}

impl Tracker {
    /// A tracker without a map.
    ///
    /// # Errors
    /// No camera, two cameras at one place (no depth), or a parameter out of its range.
    pub fn new(mut calibrations: Vec<CameraCalibration>, params: TrackerParams) -> Result<Self, Error> {
        params.check()?;
        let place_m = |camera: &CameraCalibration| camera.body_from_camera.translation_m;
        match &mut calibrations[..] {
            [] => return Err(Error::key("rig.cameras", 0, "the tracker needs a camera")),
            // In a map without a metre, an arm from the body to the camera has no length: the camera's place is the body's.
            [only] => only.body_from_camera.translation_m = glam::DVec3::ZERO,
            [first, rest @ ..] => {
                let apart_m = rest.iter().map(|other| (place_m(first) - place_m(other)).length());
                let baseline_m = apart_m.fold(0.0, crate::num::greater);
                if !(baseline_m > 1e-3 && baseline_m.is_finite()) {
                    let reason = "too short for depth; above 1 would do";
                    return Err(Error::key("rig.baseline_mm", 1e3 * baseline_m, reason));
                }
            }
        }
        let cameras = calibrations.into_iter().map(RigCamera::new).collect();
        Ok(Self {
            cameras,
            params,
            map: Map::default(),
            waiting: Waiting::new(1),
            opening: Opening::default(),
            motion: None,
            last_keyframe: None,
            lost: false,
            last_located_frame: None,
            inliers_before: 0,
            frame: 0,
            unswept_frame: None,
            suspicion: None,
            last_t_s: f64::NEG_INFINITY,
        })
    }

    /// Takes one frame.
    ///
    /// # Panics
    /// Where the frame has another number of cameras than the rig, or its time does not rise.
    pub fn track(&mut self, input: &FrameInput) -> TrackedFrame {
        assert!(input.features.len() == self.cameras.len(), "a frame needs one feature list a camera");
        assert!(
            input.clocks.is_empty() || input.clocks.len() == self.cameras.len(),
            "rows have one clock a camera, or none"
        );
        assert!(input.t_s > self.last_t_s, "frames come in the order of their times");
        self.last_t_s = input.t_s;
        let clock = |camera: usize| {
            if self.params.rolling_shutter {
                input.clocks.get(camera).copied().unwrap_or_default()
            } else {
                RowClock::GLOBAL
            }
        };
        let view = |(number, camera): (usize, &RigCamera)| View::new(camera, &input.features[number], clock(number));
        let views: Vec<View> = self.cameras.iter().enumerate().map(view).collect();
        let answer =
            if self.map.keyframes.is_empty() { self.start(input.t_s, &views) } else { self.follow(input.t_s, &views) };
        self.frame += 1;
        answer
    }

    /// Landmarks as they stand now, in rising order of their numbers.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.map.landmarks
    }

    /// Refined poses of the keyframes still held, in the order of time.
    pub fn keyframes(&self) -> Vec<TimedPose> {
        let timed = |keyframe: &map::Keyframe| TimedPose {
            t_s: keyframe.t_s,
            world_from_body: keyframe.state.body_from_world.inverse(),
        };
        self.map.keyframes.iter().map(timed).collect()
    }

    fn start(&mut self, t_s: f64, views: &[View]) -> TrackedFrame {
        let mut work = Work::default();
        let made = self.start_by_depth(t_s, views, &mut work).or_else(|| self.start_by_motion(t_s, views, &mut work));
        let mut answer = unlocated(t_s, Status::Waiting, work);
        let Some((state, made)) = made else { return answer };
        let world_from_body = state.body_from_world.inverse();
        self.last_keyframe = Some(LastKeyframe { frame: self.frame, world_from_body, landmarks: made });
        self.last_located_frame = Some(self.frame);
        answer.status = Status::Initialised;
        answer.world_from_body = Some(world_from_body);
        answer.tracked_features = made;
        answer.keyframe = true;
        answer
    }

    /// A map from one frame of cameras that see the same; gives the body and the number of landmarks.
    fn start_by_depth(&mut self, t_s: f64, views: &[View], work: &mut Work) -> Option<(Moving, u32)> {
        if views.len() < 2 {
            return None;
        }
        let mut map = Map::default();
        let growth = Growth { cameras: &self.cameras, views, params: &self.params, frame: self.frame };
        let start = Moving::resting(Pose::IDENTITY);
        self.waiting.clear();
        let made = growth.add_keyframe(&mut map, (t_s, start), &[], &mut self.waiting, work);
        if made < self.params.start_landmarks_min {
            return None;
        }
        self.map = map;
        self.unswept_frame = Some(self.frame);
        self.motion = Some(Motion { t_s, body_from_world: Pose::IDENTITY, step: None });
        Some((start, made))
    }

    /// A map from this frame and an earlier one.
    fn start_by_motion(&mut self, t_s: f64, views: &[View], work: &mut Work) -> Option<(Moving, u32)> {
        let key = DrawKey::root(self.params.seed).with(DRAWS).with(self.frame).with(3);
        let stage = Stage { cameras: &self.cameras, params: &self.params, frame: self.frame, key };
        let begun = self.opening.take(&stage, (t_s, views), work)?;
        let mut map = Map::default();
        self.waiting.clear();
        extend::begin(&mut map, (&begun, t_s, self.frame), &self.params, &mut self.waiting);
        let mut state = adjust_window(&mut map, &self.cameras, &self.params, work)?;
        if views.iter().any(View::sweeps) {
            for _ in 0..SWEPT_ROUNDS {
                extend::refine_rates(&mut map, &self.cameras, &begun);
                state = adjust_window(&mut map, &self.cameras, &self.params, work)?;
            }
        }
        let made = crate::num::u32_from(map.landmarks.len());
        if made < self.params.start_landmarks_min {
            return None;
        }
        self.opening.clear();
        self.waiting.set_reach(REACH_WITHOUT_DEPTH);
        let first = Motion { t_s: begun.first_t_s, body_from_world: begun.first.body_from_world, step: None };
        self.motion = Some(first.then(t_s, state.body_from_world));
        self.map = map;
        self.unswept_frame = None;
        Some((state, made))
    }

    fn follow(&mut self, t_s: f64, views: &[View]) -> TrackedFrame {
        let mut work = Work::default();
        let predicted = self.motion.map(|motion| motion.predict(t_s));
        let has_velocity = self.motion.is_some_and(|motion| motion.step.is_some());
        let predicted_position_m =
            predicted.filter(|_| has_velocity).map(|state| state.body_from_world.inverse().translation_m);
        let found = self.locate((t_s, views), predicted.filter(|_| !self.lost), &mut work);
        let found = found.map(|(located, status)| (self.with_swept_start((t_s, views), located, &mut work), status));
        let Some((located, status)) = found else {
            self.lost = true;
            self.motion = None;
            let since = self.last_located_frame.map_or(0, |last| self.frame - last);
            if self.unswept_frame.is_none() && since >= GIVEN_UP_FRAMES && self.map.keyframes.len() < YOUNG_KEYFRAMES {
                self.map = Map::default();
                self.lost = false;
            }
            return TrackedFrame { predicted_position_m, ..unlocated(t_s, Status::Lost, work) };
        };
        self.lost = false;
        self.last_located_frame = Some(self.frame);
        let innovation_px =
            predicted.filter(|_| has_velocity).and_then(|state| self.innovation_px(views, &located, &state));
        let (inliers, tracked_features) = self.account(views, &located);
        self.inliers_before = crate::num::u32_from(inliers.len());
        let keyframe = self.keyframe_is_due(&located.state.body_from_world.inverse(), tracked_features);
        // The step that leads here is measured before the adjustment: both ends then hang on the same map.
        let body_from_world = located.state.body_from_world;
        let step = self.motion.and_then(|motion| motion.then(t_s, body_from_world).step);
        if views.iter().any(View::sweeps) {
            self.correct_last_rate(step);
        }
        self.motion = Some(Motion { t_s, body_from_world, step });
        let mut loop_closed = false;
        if keyframe {
            self.add_keyframe(t_s, views, &located, tracked_features, &mut work);
            loop_closed = self.params.loop_closing && self.close_loop((t_s, views), &mut work);
        }
        let world_from_body = self.motion.map_or(body_from_world, |motion| motion.body_from_world).inverse();
        TrackedFrame {
            t_s,
            status,
            world_from_body: Some(world_from_body),
            tracked_features,
            inliers,
            predicted_position_m,
            innovation_px,
            position_bound_m: located.position_bound_m,
            keyframe,
            loop_closed,
            work,
        }
    }

    /// The first frame's rows were taken as simultaneous, which bends the map that the second one is held against: the step between the two
    /// says how the first one moved, in turns with the map. An error of the step comes back by the share of the readout in it, a quarter at
    /// 16 ms and 30 Hz.
    fn with_swept_start(&mut self, (t_s, views): (f64, &[View]), mut located: Located, work: &mut Work) -> Located {
        if self.unswept_frame.is_none_or(|first| self.frame != first + 1) || !views.iter().any(View::sweeps) {
            return located;
        }
        for _ in 0..3 {
            let Some((rate, _)) = self.motion.and_then(|motion| motion.then(t_s, located.state.body_from_world).step)
            else {
                break;
            };
            self.map.set_rate(0, rate);
            let Some((again, _)) = self.locate((t_s, views), Some(located.state), work) else { break };
            located = again;
        }
        located
    }

    /// The step after a keyframe says how it moved better than the steps before it. The first two steps tell the first keyframe's rate.
    fn correct_last_rate(&mut self, step: Option<(Twist, f64)>) {
        let (Some(after), Some(last)) = (step, self.last_keyframe) else { return };
        let before = self.motion.and_then(|motion| motion.step);
        let keyframe = self.map.keyframes.len() - 1;
        if let (true, Some(first)) = (self.unswept_frame.is_some_and(|first| self.frame == first + 2), before) {
            self.map.set_rate(0, ahead_of(first, after));
        }
        if let (true, Some(before)) = (self.frame == last.frame + 1, before) {
            self.map.set_rate(keyframe, between(before, after));
        }
    }

    /// Makes the frame a keyframe: new landmarks, then adjustment, which moves the frame's pose.
    fn add_keyframe(&mut self, t_s: f64, views: &[View], located: &Located, tracked: u32, work: &mut Work) {
        let mut straight = Vec::new();
        let views = if views.iter().any(View::sweeps) {
            straight.extend_from_slice(views);
            straight.iter_mut().zip(&self.cameras).for_each(|(view, camera)| view.straighten(camera, &located.state));
            &straight
        } else {
            views
        };
        let growth = Growth { cameras: &self.cameras, views, params: &self.params, frame: self.frame };
        let at = (t_s, located.state);
        let made = growth.add_keyframe(&mut self.map, at, &located.inliers, &mut self.waiting, work);
        let mut state = located.state;
        if let Some(adjusted) = adjust_window(&mut self.map, &self.cameras, &self.params, work) {
            state = adjusted;
        }
        self.motion = self.motion.map(|motion| Motion { body_from_world: state.body_from_world, ..motion });
        let world_from_body = state.body_from_world.inverse();
        self.last_keyframe = Some(LastKeyframe { frame: self.frame, world_from_body, landmarks: tracked + made });
    }

    /// Looks for an earlier visit of the place that the last keyframe sees, and bends the map where two keyframes agree on one.
    fn close_loop(&mut self, (t_s, views): (f64, &[View]), work: &mut Work) -> bool {
        let Some(last) = self.map.keyframes.last().copied() else { return false };
        let (cameras, map, params) = (&self.cameras[..], &self.map, &self.params);
        let frame = Frame { cameras, views, map, params, t_s, motion: None, number: self.frame, inliers_before: 0 };
        let key = DrawKey::root(params.seed).with(DRAWS).with(self.frame).with(2);
        let found = close::recognise(&frame, self.frame, &last.state, key, work);
        let Some(found) = found else { return false };
        let before = self.suspicion.replace(found.suspicion(last.id));
        let confirmed = before.is_some_and(|before| found.confirms(last.id, &before));
        let params = self.params;
        if !confirmed {
            return false;
        }
        let has_scale = self.cameras.len() > 1;
        let by_sigma = |scale| params.inverse_sigma(scale);
        let Some(scale) = found.close(&mut self.map, views, (has_scale, by_sigma)) else { return false };
        self.suspicion = None;
        adjust_window(&mut self.map, &self.cameras, &self.params, work);
        if let (Some(last), Some(motion)) = (self.map.keyframes.last(), self.motion.as_mut()) {
            motion.body_from_world = last.state.body_from_world;
            motion.step = motion.step.map(|(step, span_s)| (Twist { linear_m: step.linear_m * scale, ..step }, span_s));
            let world_from_body = last.state.body_from_world.inverse();
            self.last_keyframe = self.last_keyframe.map(|held| LastKeyframe { world_from_body, ..held });
        }
        true
    }

    /// Around the prediction first, then by descriptors among recent landmarks, then among all.
    fn locate(
        &self,
        (t_s, views): (f64, &[View]),
        predicted: Option<Moving>,
        work: &mut Work,
    ) -> Option<(Located, Status)> {
        let (cameras, map, params) = (&self.cameras[..], &self.map, &self.params);
        let (number, inliers_before) = (self.frame, self.inliers_before);
        let frame = Frame { cameras, views, map, params, t_s, motion: self.motion, number, inliers_before };
        if let Some(located) = predicted.and_then(|predicted| frame.near(&predicted, work)) {
            return Some((located, Status::Tracked));
        }
        let frame = Frame { motion: None, ..frame };
        let key = DrawKey::root(self.params.seed).with(DRAWS).with(self.frame);
        let recently = self.frame.saturating_sub(self.params.recent_frames.into());
        let recent = (!self.lost).then(|| frame.anywhere(recently, key.with(0), work)).flatten();
        let located = recent.or_else(|| frame.anywhere(0, key.with(1), work))?;
        Some((located, Status::Relocalised))
    }

    /// Counts what was predicted and found, for culling; gives the inliers and the number of different landmarks.
    fn account(&mut self, views: &[View], located: &Located) -> (Vec<Inlier>, u32) {
        for &number in &located.in_view {
            self.map.landmarks[number].predicted += 1;
        }
        let mut different = 0;
        for found in &located.inliers {
            let landmark = &mut self.map.landmarks[found.landmark];
            if landmark.last_frame != self.frame {
                landmark.last_frame = self.frame;
                landmark.found += 1;
                different += 1;
            }
        }
        let inlier = |found: &locate::Found| Inlier {
            camera: found.camera,
            feature: views[index(found.camera.0)].sights[found.sight].feature,
            landmark: self.map.landmarks[found.landmark].id,
        };
        (located.inliers.iter().map(inlier).collect(), different)
    }

    fn innovation_px(&self, views: &[View], located: &Located, predicted: &Moving) -> Option<f64> {
        let distance_px = |found: &locate::Found| {
            let sight = &views[index(found.camera.0)].sights[found.sight];
            let landmark_m = predicted.at(sight.offset_s).point(self.map.landmarks[found.landmark].position_m);
            let place_px = self.cameras[index(found.camera.0)].place(landmark_m)?;
            Some((sight.place_px - place_px).length())
        };
        let distances_px: Vec<f64> = located.inliers.iter().filter_map(distance_px).collect();
        refine::upper_median(&distances_px)
    }

    fn keyframe_is_due(&self, world_from_body: &Pose, tracked: u32) -> bool {
        let Some(last) = self.last_keyframe else { return true };
        let moved = last.world_from_body.inverse().then(world_from_body);
        self.frame - last.frame >= u64::from(self.params.keyframe_frames_max)
            || moved.translation_m.length() > self.params.keyframe_distance_m
            || moved.angle_rad() > self.params.keyframe_angle_rad
            || f64::from(tracked) < self.params.keyframe_share_min * f64::from(last.landmarks)
    }
}

/// An answer without a pose.
fn unlocated(t_s: f64, status: Status, work: Work) -> TrackedFrame {
    TrackedFrame {
        t_s,
        status,
        world_from_body: None,
        tracked_features: 0,
        inliers: Vec::new(),
        predicted_position_m: None,
        innovation_px: None,
        position_bound_m: None,
        keyframe: false,
        loop_closed: false,
        work,
    }
}
