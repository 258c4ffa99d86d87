//! Follows the map: locates a frame, judges its pose, and makes it a keyframe where one is due, which may close a loop.

use super::answer::{LossReason, Status, TrackedFrame, TrackerWork, unlocated};
use super::close;
use super::extend::{Growth, adjust_window};
use super::lie::Twist;
use super::localiser::{LocalisedPose, Localiser};
use super::map::Map;
use super::preintegrate::filter::{ImuFilter, ImuPrediction};
use super::rig::CameraKeypoints;
use super::row_motion::{Moving, VelocityModel, ahead_of, between};
use super::state::{LastKeyframe, MapHistory, TrackerState};
use super::{DRAWS, Tracker};
use crate::draw::DrawKey;
use crate::num::index;
use crate::pose::Pose;

/// A monocular map that has been lost for this many frames is discarded if it is young: fewer keyframes than YOUNG_KEYFRAMES,
/// or tracked for fewer frames than YOUNG_FRAMES. Its initialisation was false.
const GIVEN_UP_FRAMES: u64 = 15;
const YOUNG_KEYFRAMES: usize = 6;
const YOUNG_FRAMES: u64 = 30;

/// From so many consecutive frames with an uncertain position on, one counts as lost.
const WEAK_FRAMES_LOST: u32 = 3;
/// It does not where this many times the required number of landmarks agree on it: something close that has most of the corners makes a
/// position uncertain, not wrong.
const SUPPORTED_FACTOR: u32 = 4;

impl Tracker {
    /// Locates a frame near where the IMU or the motion `before` it predicts it, else by descriptors; makes it a keyframe where one is due.
    /// Gives the next state.
    pub(super) fn follow(
        &mut self,
        (t_s, views): (f64, &[CameraKeypoints]),
        mut history: MapHistory,
        before: Option<VelocityModel>,
    ) -> (TrackerState, TrackedFrame) {
        let mut work = TrackerWork::default();
        let imu_prediction = self.imu_filter.as_mut().and_then(|imu_filter| imu_filter.advance(t_s));
        let by_motion = || before.map(|motion| motion.predict(t_s));
        let predicted = imu_prediction.map(|imu_prediction| imu_prediction.moving).or_else(by_motion);
        let has_velocity = imu_prediction.is_some() || before.is_some_and(|motion| motion.step.is_some());
        let predicted_position_m =
            predicted.filter(|_| has_velocity).map(|state| state.body_from_world.inverse().translation_m);
        let found = self.locate((t_s, views), before, (predicted, imu_prediction), &mut work);
        let found = found.map(|(located, status)| {
            (self.with_swept_start((t_s, views), (&history, before), located, &mut work), status)
        });
        let imu_is_sure = imu_prediction.is_some_and(|imu_prediction| self.is_sure(&imu_prediction));
        let judged = found.map(|(located, status)| (self.judge(&located, imu_is_sure), located, status));
        let has_pose = judged.is_some();
        let supported = SUPPORTED_FACTOR * self.params.inliers_min;
        let Some((is_sound, located, status)) = judged.filter(|(is_sound, located, status)| {
            let is_supported = crate::num::u32_from(located.inliers.len()) >= supported;
            *is_sound || (*status == Status::Tracked && (self.weak_frames < WEAK_FRAMES_LOST || is_supported))
        }) else {
            let loss = Some(if has_pose { LossReason::Uncertain } else { LossReason::NoPose });
            let answer = TrackedFrame { loss, predicted_position_m, ..unlocated(t_s, Status::Lost, work) };
            return (self.lose(history), answer);
        };
        history.located_frame = self.frame;
        let innovation_px =
            predicted.filter(|_| has_velocity).and_then(|state| self.innovation_px(views, &located, &state));
        let (inliers, tracked_features) = self.account(views, &located);
        self.inliers_before = crate::num::u32_from(inliers.len());
        let single_picture_sigma_m = located.single_picture_sigma_m;
        let world_from_body = located.state.body_from_world.inverse();
        let keyframe = is_sound && self.keyframe_is_due(&mut history.keyframe, &world_from_body, tracked_features);
        // The step to this pose is measured before the adjustment, so that both ends refer to the same map.
        let body_from_world = located.state.body_from_world;
        let step = before.and_then(|motion| motion.then(t_s, body_from_world).step);
        if views.iter().any(CameraKeypoints::sweeps) {
            self.correct_last_rate(&history, before, step);
        }
        if let Some(imu_filter) = &mut self.imu_filter {
            if status == Status::Relocalised {
                imu_filter.reset();
            }
            imu_filter.correct(t_s, &body_from_world, &located.information);
        }
        let mut motion = VelocityModel { t_s, body_from_world, step, sigma_m: single_picture_sigma_m.unwrap_or(0.0) };
        let mut loop_closed = false;
        if keyframe {
            let known = (&mut history, &mut motion);
            self.add_keyframe((t_s, views), known, &located, (tracked_features, status), &mut work);
            let known = (&mut history, &mut motion);
            loop_closed = self.params.loop_closing && self.close_loop((t_s, views), known, &mut work);
        }
        let answer = TrackedFrame {
            t_s,
            status,
            loss: None,
            world_from_body: Some(motion.body_from_world.inverse()),
            tracked_features,
            inliers,
            predicted_position_m,
            innovation_px,
            single_picture_sigma_m,
            keyframe,
            loop_closed,
            work,
        };
        (TrackerState::Tracking { history, motion }, answer)
    }

    /// Corrects the first frame's rolling shutter. Its rows were taken as simultaneous, which distorts the initial map; the
    /// step to the second frame gives the first frame's rate. Rate and map are refined in turns.
    fn with_swept_start(
        &mut self,
        (t_s, views): (f64, &[CameraKeypoints]),
        (history, before): (&MapHistory, Option<VelocityModel>),
        mut located: LocalisedPose,
        work: &mut TrackerWork,
    ) -> LocalisedPose {
        let is_second = history.started_by_depth && self.frame == history.started_frame + 1;
        if !is_second || !views.iter().any(CameraKeypoints::sweeps) {
            return located;
        }
        for _ in 0..3 {
            let step = before.and_then(|motion| motion.then(t_s, located.state.body_from_world).step);
            let Some((rate, _)) = step else { break };
            self.map.set_rate(0, rate);
            let Some((again, _)) = self.locate((t_s, views), before, (Some(located.state), None), work) else { break };
            located = again;
        }
        located
    }

    /// The step after a keyframe measures its rate better than the steps before it. The first two steps give the first
    /// keyframe's rate.
    fn correct_last_rate(&mut self, history: &MapHistory, before: Option<VelocityModel>, step: Option<(Twist, f64)>) {
        let (Some(after), Some(before)) = (step, before.and_then(|motion| motion.step)) else { return };
        if history.started_by_depth && self.frame == history.started_frame + 2 {
            self.map.set_rate(0, ahead_of(before, after));
        }
        if self.frame == history.keyframe.frame + 1 {
            self.map.set_rate(self.map.keyframes.len() - 1, between(before, after));
        }
    }

    /// Makes the frame a keyframe: new landmarks, then adjustment, which moves the frame's pose.
    fn add_keyframe(
        &mut self,
        (t_s, views): (f64, &[CameraKeypoints]),
        (history, motion): (&mut MapHistory, &mut VelocityModel),
        located: &LocalisedPose,
        (tracked, status): (u32, Status),
        work: &mut TrackerWork,
    ) {
        let mut straight = Vec::new();
        let views = if views.iter().any(CameraKeypoints::sweeps) {
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
        let adjusted = adjust_window(&mut self.map, (&self.cameras, &self.params), self.imu_filter.as_ref(), work);
        let state = adjusted.unwrap_or(located.state);
        match &mut self.imu_filter {
            // The filter keeps its state, so that a pose does not jump with the map: the pictures to come say how the map has moved.
            Some(imu_filter) if status == Status::Tracked => {
                let moved = located.state.body_from_world.then(&state.body_from_world.inverse());
                imu_filter.loosen(moved.translation_m.length(), moved.angle_rad());
            }
            _ => self.stand_at(motion, &state.body_from_world, 1.0),
        }
        let world_from_body = state.body_from_world.inverse();
        let expected = if self.depends_on_motion() { 0 } else { made };
        history.keyframe = LastKeyframe { frame: self.frame, world_from_body, landmarks: tracked + expected };
    }

    /// Looks for an earlier visit of the place that the last keyframe sees, and bends the map where two keyframes agree on one.
    pub(super) fn close_loop(
        &mut self,
        (t_s, views): (f64, &[CameraKeypoints]),
        (history, motion): (&mut MapHistory, &mut VelocityModel),
        work: &mut TrackerWork,
    ) -> bool {
        let Some(last) = self.map.keyframes.last().copied() else { return false };
        let params = self.params;
        let key = DrawKey::root(params.seed).with(DRAWS).with(self.frame).with(2);
        let found = close::recognise(&self.localiser((t_s, views)), self.frame, &last.state, key, work);
        let Some(found) = found else { return false };
        let before = self.loop_candidate.replace(found.loop_candidate(last.id));
        if !before.is_some_and(|before| found.confirms(last.id, &before)) {
            return false;
        }
        let has_scale = self.cameras.len() > 1 || self.imu_filter.as_ref().is_some_and(ImuFilter::knows_unit);
        let Some(scale) = found.close(&mut self.map, views, (has_scale, &params)) else { return false };
        self.loop_candidate = None;
        adjust_window(&mut self.map, (&self.cameras, &self.params), None, work);
        if let Some(state) = self.map.keyframes.last().map(|last| last.state) {
            self.stand_at(motion, &state.body_from_world, scale);
            history.keyframe.world_from_body = state.body_from_world.inverse();
        }
        true
    }

    /// The map has moved, and the body with it; lengths are multiplied.
    fn stand_at(&mut self, motion: &mut VelocityModel, body_from_world: &Pose, scale: f64) {
        if let Some(imu_filter) = &mut self.imu_filter {
            imu_filter.moved(&motion.body_from_world, body_from_world, scale);
        }
        motion.body_from_world = *body_from_world;
        motion.step = motion.step.map(|(step, span_s)| (Twist { linear_m: step.linear_m * scale, ..step }, span_s));
    }

    /// A search for a frame's pose without a prediction.
    fn localiser<'a>(&'a self, (t_s, views): (f64, &'a [CameraKeypoints])) -> Localiser<'a> {
        Localiser {
            cameras: &self.cameras,
            views,
            map: &self.map,
            params: &self.params,
            t_s,
            motion: None,
            prior: None,
            imu_rate: None,
            least_px: self.least_px(),
            sure: false,
            number: self.frame,
            inliers_before: self.inliers_before,
        }
    }

    /// Around the prediction first, then by descriptors among recent landmarks, then among all.
    fn locate(
        &self,
        (t_s, views): (f64, &[CameraKeypoints]),
        motion: Option<VelocityModel>,
        (predicted, imu_prediction): (Option<Moving>, Option<ImuPrediction>),
        work: &mut TrackerWork,
    ) -> Option<(LocalisedPose, Status)> {
        // A map without a metre does not know what a hand's accelerations are in it.
        let has_metre = self.cameras.len() > 1;
        let by_motion = || motion.filter(|_| has_metre).and_then(|motion| motion.pose_prior(t_s));
        let prior = imu_prediction.map(|imu_prediction| imu_prediction.prior).or_else(by_motion);
        let sure = imu_prediction.is_some_and(|imu_prediction| self.is_sure(&imu_prediction));
        let imu_rate = self.imu_filter.as_ref().and_then(ImuFilter::rate_prior);
        let frame = Localiser { motion, prior, imu_rate, sure, ..self.localiser((t_s, views)) };
        if let Some(located) = predicted.and_then(|predicted| frame.near(&predicted, work)) {
            return Some((located, Status::Tracked));
        }
        let frame = Localiser { motion: None, prior: None, sure: false, ..frame };
        let key = DrawKey::root(self.params.seed).with(DRAWS).with(self.frame);
        let recently = self.frame.saturating_sub(self.params.recent_frames.into());
        let recent = motion.and_then(|_| frame.anywhere(recently, key.with(0), work));
        let located = recent.or_else(|| frame.anywhere(0, key.with(1), work))?;
        Some((located, Status::Relocalised))
    }

    /// The state after a frame without a pose. A young map of one camera was started falsely and is given up.
    fn lose(&mut self, history: MapHistory) -> TrackerState {
        let MapHistory { started_frame, started_by_depth, located_frame, .. } = history;
        let is_young = self.map.keyframes.len() < YOUNG_KEYFRAMES || located_frame - started_frame < YOUNG_FRAMES;
        if started_by_depth || self.frame - located_frame < GIVEN_UP_FRAMES || !is_young {
            return TrackerState::Lost { history };
        }
        self.map = Map::default();
        self.params.position_sigma_px = self.position_sigma_px_min;
        TrackerState::Waiting
    }
}
