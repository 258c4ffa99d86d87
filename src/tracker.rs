//! The host's tracker: visual-inertial SLAM from decoded features and calibration to a pose a frame and a map. It never sees the
//! simulation.
//!
//! Each frame: constant velocity or the IMU predicts the pose, landmarks are matched near their predicted positions, and the
//! pose is the robust least-squares fit to the matches. Each keyframe: new landmarks are triangulated and a window of keyframes
//! is adjusted. Every keypoint counts at its row's time. After loss the map is searched by descriptors alone; a revisited place
//! closes a loop. The world frame is the body's frame at the first frame. Poses are metres and unit quaternions, image
//! positions pixels, times seconds. Equal input gives equal bytes.

pub mod adjust;
mod answer;
mod begin;
mod close;
pub mod dense;
mod depth;
pub mod epipolar;
pub mod extend;
mod frame;
pub mod initial;
pub mod lie;
mod judge;
pub mod locate;
pub mod map;
pub mod marginal;
pub mod matching;
pub mod p3p;
mod params;
pub mod polynomial;
pub mod pose_graph;
pub mod preintegrate;
mod prior;
mod problem;
mod proof;
pub mod ransac;
pub mod refine;
pub mod rig;
mod shift;
pub mod start;
pub mod sweep;
mod tracks;
mod unit;

use glam::DVec3;

use crate::draw::DrawKey;
use crate::error::Error;
use crate::num::index;
use crate::pose::{Pose, TimedPose};

pub use answer::{FrameInput, Inlier, Status, TrackedFrame, Work};
use close::LoopCandidate;
use extend::{Growth, PendingKeypoints, adjust_window};
use frame::{Frame, LocalisedPose};
use lie::Twist;
pub use map::Landmark;
use map::Map;
pub use params::TrackerParams;
use preintegrate::filter::ImuPrediction;
pub use preintegrate::filter::{ImuCalibration, ImuFilter};
pub use preintegrate::{Noise, Reading};
pub use rig::CameraCalibration;
use rig::{RigCamera, View};
use start::MonoInitialiser;
pub use sweep::RowClock;
use sweep::{Motion, Moving, ahead_of, between};

/// The published number of the tracker's draws.
const DRAWS: u64 = 0x7472_6163_6b65_7231;

/// A monocular map that has been lost for this many frames is discarded if it is young: fewer keyframes than YOUNG_KEYFRAMES,
/// or tracked for fewer frames than YOUNG_FRAMES. Its initialisation was false.
const GIVEN_UP_FRAMES: u64 = 15;
const YOUNG_KEYFRAMES: usize = 6;
const YOUNG_FRAMES: u64 = 30;

/// Maximum number of consecutive frames with an uncertain position; the next one counts as lost.
const WEAK_FRAMES_MAX: u32 = 3;

/// The last keyframe, as far as the next one depends on it.
#[derive(Clone, Copy, Debug)]
struct LastKeyframe {
    frame: u64,
    world_from_body: Pose,
    /// Landmarks that a frame at this pose can match.
    landmarks: u32,
}

/// A tracker of any number of cameras.
#[derive(Clone, Debug)]
pub struct Tracker {
    cameras: Vec<RigCamera>,
    params: TrackerParams,
    map: Map,
    pending: PendingKeypoints,
    mono_initialiser: MonoInitialiser,
    motion: Option<Motion>,
    last_keyframe: Option<LastKeyframe>,
    lost: bool,
    last_located_frame: Option<u64>,
    started_frame: u64,
    /// Keypoints that supported the last pose.
    inliers_before: u32,
    frame: u64,
    /// The first frame, where its rows were taken as simultaneous.
    unswept_frame: Option<u64>,
    loop_candidate: Option<LoopCandidate>,
    last_t_s: f64,
    imu_filter: Option<ImuFilter>,
    /// Running mean of the position sigma of recent frames.
    usual_sigma_m: f64,
    /// Consecutive frames with an uncertain position.
    weak_frames: u32,
    /// Lower bound on the keypoint noise: the configured sigma. `params` holds the current estimate.
    place_sigma_px_min: f64,
    /// Upper bound on the keypoint noise estimated from residuals.
    place_sigma_px_max: f64,
    /// From the body to the only camera, whose position stands for the body's.
    arm_m: DVec3,
}

impl Tracker {
    /// A tracker without a map. Fails on no camera, two cameras at one place (no depth), or a parameter out of its range.
    pub fn new(mut calibrations: Vec<CameraCalibration>, params: TrackerParams) -> Result<Self, Error> {
        params.check()?;
        let mut arm_m = DVec3::ZERO;
        let place_m = |camera: &CameraCalibration| camera.body_from_camera.translation_m;
        match &mut calibrations[..] {
            [] => return Err(Error::key("rig.cameras", 0, "the tracker needs a camera")),
            // A monocular map has no metric scale, so an arm from body to camera has no length in it: the camera's position
            // stands for the body's.
            [only] => arm_m = std::mem::take(&mut only.body_from_camera.translation_m),
            [first, rest @ ..] => {
                let apart_m = rest.iter().map(|other| (place_m(first) - place_m(other)).length());
                let baseline_m = apart_m.fold(0.0, crate::num::greater);
                if !(baseline_m > 1e-3 && baseline_m.is_finite()) {
                    let reason = "too short for depth; use more than 1";
                    return Err(Error::key("rig.baseline_mm", 1e3 * baseline_m, reason));
                }
            }
        }
        let cameras = calibrations.into_iter().map(RigCamera::new).collect();
        Ok(Self {
            cameras,
            params,
            map: Map::default(),
            pending: PendingKeypoints::new(1),
            mono_initialiser: MonoInitialiser::default(),
            motion: None,
            last_keyframe: None,
            lost: false,
            last_located_frame: None,
            started_frame: 0,
            inliers_before: 0,
            frame: 0,
            unswept_frame: None,
            loop_candidate: None,
            last_t_s: f64::NEG_INFINITY,
            imu_filter: None,
            arm_m,
            usual_sigma_m: 0.0,
            weak_frames: 0,
            place_sigma_px_min: params.place_sigma_px,
            place_sigma_px_max: params::UNPROVEN_NOISE * params.place_sigma_px,
        })
    }

    /// Gives the rig an inertial unit.
    #[must_use]
    pub fn with_imu(mut self, mut calibration: ImuCalibration) -> Self {
        calibration.body_from_imu.translation_m -= self.arm_m;
        self.imu_filter = Some(ImuFilter::new(calibration, self.cameras.len() > 1));
        self
    }

    /// Adds IMU readings in ascending time, up to the first one after the next frame. Ignored without an IMU.
    pub fn add_imu_readings(&mut self, readings: &[Reading]) {
        if let Some(imu_filter) = &mut self.imu_filter {
            imu_filter.add_imu_readings(readings);
        }
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

    /// Current estimate of the keypoint noise at octave 0, in pixels; at least the configured sigma.
    pub fn place_sigma_px(&self) -> f64 {
        self.params.place_sigma_px
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

    /// The IMU filter; `None` without an IMU.
    pub fn imu_filter(&self) -> Option<&ImuFilter> {
        self.imu_filter.as_ref()
    }

    fn follow(&mut self, t_s: f64, views: &[View]) -> TrackedFrame {
        let mut work = Work::default();
        let imu_prediction = self.imu_filter.as_mut().and_then(|imu_filter| imu_filter.advance(t_s));
        let by_motion = self.motion.map(|motion| motion.predict(t_s));
        let predicted = imu_prediction.map(|imu_prediction| imu_prediction.moving).or(by_motion.filter(|_| !self.lost));
        let has_velocity = imu_prediction.is_some() || self.motion.is_some_and(|motion| motion.step.is_some());
        let predicted_position_m =
            predicted.filter(|_| has_velocity).map(|state| state.body_from_world.inverse().translation_m);
        let found = self.locate((t_s, views), (predicted, imu_prediction), &mut work);
        let found = found.map(|(located, status)| (self.with_swept_start((t_s, views), located, &mut work), status));
        let imu_is_sure = imu_prediction.is_some_and(|imu_prediction| self.is_sure(&imu_prediction));
        let judged = found.map(|(located, status)| (self.judge(&located, imu_is_sure), located, status));
        let Some((judgement, located, status)) = judged.filter(|(judgement, _, status)| {
            judgement.is_sound || (*status == Status::Tracked && self.weak_frames < WEAK_FRAMES_MAX)
        }) else {
            self.lose();
            return TrackedFrame { predicted_position_m, ..unlocated(t_s, Status::Lost, work) };
        };
        self.lost = false;
        self.last_located_frame = Some(self.frame);
        let innovation_px =
            predicted.filter(|_| has_velocity).and_then(|state| self.innovation_px(views, &located, &state));
        let (inliers, tracked_features) = self.account(views, &located);
        self.inliers_before = crate::num::u32_from(inliers.len());
        let single_picture_sigma_m = judgement.single_picture_sigma_m;
        let keyframe =
            judgement.is_sound && self.keyframe_is_due(&located.state.body_from_world.inverse(), tracked_features);
        // The step to this pose is measured before the adjustment, so that both ends refer to the same map.
        let body_from_world = located.state.body_from_world;
        let step = self.motion.and_then(|motion| motion.then(t_s, body_from_world).step);
        if views.iter().any(View::sweeps) {
            self.correct_last_rate(step);
        }
        if let Some(imu_filter) = &mut self.imu_filter {
            if status == Status::Relocalised {
                imu_filter.reset();
            }
            imu_filter.correct(t_s, &body_from_world, &located.information);
        }
        self.motion = Some(Motion { t_s, body_from_world, step, sigma_m: single_picture_sigma_m.unwrap_or(0.0) });
        let mut loop_closed = false;
        if keyframe {
            self.add_keyframe((t_s, views), &located, (tracked_features, status), &mut work);
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
            single_picture_sigma_m,
            keyframe,
            loop_closed,
            work,
        }
    }

    /// Corrects the first frame's rolling shutter. Its rows were taken as simultaneous, which distorts the initial map; the
    /// step to the second frame gives the first frame's rate. Rate and map are refined in turns.
    fn with_swept_start(
        &mut self,
        (t_s, views): (f64, &[View]),
        mut located: LocalisedPose,
        work: &mut Work,
    ) -> LocalisedPose {
        if self.unswept_frame.is_none_or(|first| self.frame != first + 1) || !views.iter().any(View::sweeps) {
            return located;
        }
        for _ in 0..3 {
            let Some((rate, _)) = self.motion.and_then(|motion| motion.then(t_s, located.state.body_from_world).step)
            else {
                break;
            };
            self.map.set_rate(0, rate);
            let Some((again, _)) = self.locate((t_s, views), (Some(located.state), None), work) else { break };
            located = again;
        }
        located
    }

    /// The step after a keyframe measures its rate better than the steps before it. The first two steps give the first
    /// keyframe's rate.
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
    fn add_keyframe(
        &mut self,
        (t_s, views): (f64, &[View]),
        located: &LocalisedPose,
        (tracked, status): (u32, Status),
        work: &mut Work,
    ) {
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
        let made = growth.add_keyframe(&mut self.map, at, &located.inliers, &mut self.pending, work);
        if let (Some(imu_filter), [.., before, last]) = (&mut self.imu_filter, &self.map.keyframes[..]) {
            imu_filter.link((before.id, before.t_s), (last.id, last.t_s));
        }
        if self.depends_on_motion() {
            let near = (self.params.keyframe_distance_m, self.params.keyframe_angle_rad);
            self.map.thin(index(self.params.window), near);
            self.pending.keep(&self.map.keyframes);
        }
        let mut state = located.state;
        if let Some(adjusted) =
            adjust_window(&mut self.map, (&self.cameras, &self.params), self.imu_filter.as_ref(), work)
        {
            state = adjusted;
        }
        match &mut self.imu_filter {
            // The filter keeps its state, so that a pose does not jump with the map: the pictures to come say how the map has moved.
            Some(imu_filter) if status == Status::Tracked => {
                let moved = located.state.body_from_world.then(&state.body_from_world.inverse());
                imu_filter.loosen(moved.translation_m.length(), moved.angle_rad());
            }
            _ => self.stand_at(&state.body_from_world, 1.0),
        }
        let world_from_body = state.body_from_world.inverse();
        let expected = if self.depends_on_motion() { 0 } else { made };
        self.last_keyframe = Some(LastKeyframe { frame: self.frame, world_from_body, landmarks: tracked + expected });
    }

    /// Looks for an earlier visit of the place that the last keyframe sees, and bends the map where two keyframes agree on one.
    fn close_loop(&mut self, (t_s, views): (f64, &[View]), work: &mut Work) -> bool {
        let Some(last) = self.map.keyframes.last().copied() else { return false };
        let (cameras, map, params) = (&self.cameras[..], &self.map, &self.params);
        let frame = Frame {
            cameras,
            views,
            map,
            params,
            t_s,
            motion: None,
            prior: None,
            imu_rate: None,
            least_px: self.least_px(),
            sure: false,
            number: self.frame,
            inliers_before: 0,
        };
        let key = DrawKey::root(params.seed).with(DRAWS).with(self.frame).with(2);
        let found = close::recognise(&frame, self.frame, &last.state, key, work);
        let Some(found) = found else { return false };
        let before = self.loop_candidate.replace(found.loop_candidate(last.id));
        let confirmed = before.is_some_and(|before| found.confirms(last.id, &before));
        let params = self.params;
        if !confirmed {
            return false;
        }
        let has_scale = self.cameras.len() > 1 || self.imu_filter.as_ref().is_some_and(ImuFilter::knows_unit);
        let by_sigma = |scale| params.inverse_sigma(scale);
        let Some(scale) = found.close(&mut self.map, views, (has_scale, by_sigma)) else { return false };
        self.loop_candidate = None;
        adjust_window(&mut self.map, (&self.cameras, &self.params), None, work);
        if let Some(state) = self.map.keyframes.last().map(|last| last.state) {
            self.stand_at(&state.body_from_world, scale);
            let world_from_body = state.body_from_world.inverse();
            self.last_keyframe = self.last_keyframe.map(|held| LastKeyframe { world_from_body, ..held });
        }
        true
    }

    /// The map has moved, and the body with it; lengths are multiplied.
    fn stand_at(&mut self, body_from_world: &Pose, scale: f64) {
        let Some(motion) = self.motion.as_mut() else { return };
        if let Some(imu_filter) = &mut self.imu_filter {
            imu_filter.moved(&motion.body_from_world, body_from_world, scale);
        }
        motion.body_from_world = *body_from_world;
        motion.step = motion.step.map(|(step, span_s)| (Twist { linear_m: step.linear_m * scale, ..step }, span_s));
    }

    /// Around the prediction first, then by descriptors among recent landmarks, then among all.
    fn locate(
        &self,
        (t_s, views): (f64, &[View]),
        (predicted, imu_prediction): (Option<Moving>, Option<ImuPrediction>),
        work: &mut Work,
    ) -> Option<(LocalisedPose, Status)> {
        let (cameras, map, params) = (&self.cameras[..], &self.map, &self.params);
        let (number, inliers_before) = (self.frame, self.inliers_before);
        // A map without a metre does not know what a hand's accelerations are in it.
        let has_metre = self.cameras.len() > 1;
        let by_motion =
            || self.motion.filter(|_| predicted.is_some() && has_metre).and_then(|motion| motion.pose_prior(t_s));
        let prior = imu_prediction.map(|imu_prediction| imu_prediction.prior).or_else(by_motion);
        let imu_rate = self.imu_filter.as_ref().and_then(ImuFilter::rate_prior);
        let sure = imu_prediction.is_some_and(|imu_prediction| self.is_sure(&imu_prediction));
        let motion = self.motion;
        let least_px = self.least_px();
        let frame =
            Frame { cameras, views, map, params, t_s, motion, prior, imu_rate, least_px, sure, number, inliers_before };
        if let Some(located) = predicted.and_then(|predicted| frame.near(&predicted, work)) {
            return Some((located, Status::Tracked));
        }
        let frame = Frame { motion: None, prior: None, sure: false, ..frame };
        let key = DrawKey::root(self.params.seed).with(DRAWS).with(self.frame);
        let recently = self.frame.saturating_sub(self.params.recent_frames.into());
        let recent = (!self.lost).then(|| frame.anywhere(recently, key.with(0), work)).flatten();
        let located = recent.or_else(|| frame.anywhere(0, key.with(1), work))?;
        Some((located, Status::Relocalised))
    }

    /// A frame without a pose; a young map of one camera whose start was false is given up.
    fn lose(&mut self) {
        self.lost = true;
        self.motion = None;
        let last_frame = self.last_located_frame.unwrap_or(self.frame);
        let is_young = self.map.keyframes.len() < YOUNG_KEYFRAMES || last_frame - self.started_frame < YOUNG_FRAMES;
        if self.unswept_frame.is_none() && self.frame - last_frame >= GIVEN_UP_FRAMES && is_young {
            self.map = Map::default();
            self.lost = false;
            self.params.place_sigma_px = self.place_sigma_px_min;
        }
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
        single_picture_sigma_m: None,
        keyframe: false,
        loop_closed: false,
        work,
    }
}
