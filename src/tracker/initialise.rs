//! Initialises the map, from one frame of cameras with overlapping views or from two frames. The first frame's body is the origin.

use super::answer::{Status, TrackedFrame, TrackerWork, unlocated};
use super::extend::{self, Growth, adjust_window};
use super::map::Map;
pub use super::params::UNPROVEN_NOISE;
use super::rig::CameraKeypoints;
use super::row_motion::{Moving, VelocityModel};
use super::start::Initialisation;
use super::state::{LastKeyframe, MapHistory, TrackerState};
use super::{DRAWS, Tracker};
use crate::draw::DrawKey;
use crate::num::{greater, lesser};
use crate::pose::Pose;

/// Keyframes whose keypoints without a landmark wait for a second view where no other camera gives depth: a hand that turns comes by.
const REACH_WITHOUT_DEPTH: usize = 6;

/// Turns of rates and adjustment at a start from two views of moving rows.
const SWEPT_ROUNDS: u32 = 3;

const PROVEN_NOISE: f64 = 2.0;

impl Tracker {
    /// Starts a map from this frame, or from this one and an earlier one. Gives the next state.
    pub(super) fn initialise(&mut self, frame: (f64, &[CameraKeypoints])) -> (TrackerState, TrackedFrame) {
        let mut work = TrackerWork::default();
        if let Some(imu_filter) = &mut self.imu_filter {
            imu_filter.reset();
        }
        let by_depth = self.start_by_depth(frame, &mut work);
        let started_by_depth = by_depth.is_some();
        let started = by_depth.or_else(|| self.start_by_motion(frame, &mut work));
        let mut answer = unlocated(frame.0, Status::Waiting, work);
        let Some((motion, landmarks)) = started else { return (TrackerState::Waiting, answer) };
        let world_from_body = motion.body_from_world.inverse();
        answer.status = Status::Initialised;
        answer.world_from_body = Some(world_from_body);
        answer.tracked_features = landmarks;
        answer.keyframe = true;
        let keyframe = LastKeyframe { frame: self.frame, world_from_body, landmarks };
        let (started_frame, located_frame) = (self.frame, self.frame);
        let history = MapHistory { started_frame, started_by_depth, located_frame, keyframe };
        (TrackerState::Tracking { history, motion }, answer)
    }

    /// A map from one frame of cameras that see the same; gives the body's motion and the number of landmarks.
    fn start_by_depth(
        &mut self,
        (t_s, views): (f64, &[CameraKeypoints]),
        work: &mut TrackerWork,
    ) -> Option<(VelocityModel, u32)> {
        if views.len() < 2 {
            return None;
        }
        let mut map = Map::default();
        let growth = Growth { cameras: &self.cameras, views, params: &self.params, frame: self.frame };
        let start = Moving::resting(Pose::IDENTITY);
        self.pending.clear();
        let made = growth.add_keyframe(&mut map, (t_s, start), &[], &mut self.pending, work);
        if made < self.params.start_landmarks_min {
            return None;
        }
        self.map = map;
        Some((VelocityModel { t_s, body_from_world: Pose::IDENTITY, step: None, sigma_m: 0.0 }, made))
    }

    /// A map from this frame and an earlier one.
    fn start_by_motion(
        &mut self,
        (t_s, views): (f64, &[CameraKeypoints]),
        work: &mut TrackerWork,
    ) -> Option<(VelocityModel, u32)> {
        let key = DrawKey::root(self.params.seed).with(DRAWS).with(self.frame).with(3);
        let stage = Initialisation { cameras: &self.cameras, params: &self.params, frame: self.frame, key };
        let begun = self.mono_initialiser.take(&stage, (t_s, views), work)?;
        let mut map = Map::default();
        self.pending.clear();
        extend::begin(&mut map, (&begun, t_s, self.frame), &self.params, &mut self.pending);
        let mut state = adjust_window(&mut map, (&self.cameras, &self.params), None, work)?;
        if views.iter().any(CameraKeypoints::sweeps) {
            for _ in 0..SWEPT_ROUNDS {
                extend::refine_rates(&mut map, &self.cameras, &begun);
                state = adjust_window(&mut map, (&self.cameras, &self.params), None, work)?;
            }
        }
        let made = crate::num::u32_from(map.landmarks.len());
        if made < self.params.start_landmarks_min {
            return None;
        }
        let shown_px = self.position_sigma_px_min * greater(begun.noise_sigmas.unwrap_or(1.0), 1.0);
        let most_px = UNPROVEN_NOISE * self.position_sigma_px_min;
        self.position_sigma_px_max = begun.noise_sigmas.map_or(most_px, |_| lesser(PROVEN_NOISE * shown_px, most_px));
        self.mono_initialiser.clear();
        self.pending.set_reach(REACH_WITHOUT_DEPTH);
        let first = VelocityModel {
            t_s: begun.first_t_s,
            body_from_world: begun.first.body_from_world,
            step: None,
            sigma_m: 0.0,
        };
        self.map = map;
        Some((first.then(t_s, state.body_from_world), made))
    }
}
