//! Checks the prediction and the pose of a located frame, and decides whether it becomes a keyframe. Changes no pose.

use super::locate::{Found, Located, MEDIAN_SIGMAS2, NARROW_PX};
use super::preintegrate::filter::Foreseen;
use super::refine::{WITHIN_PIXEL_PX, upper_median};
use super::rig::View;
use super::sweep::Moving;
use super::{Inlier, Tracker};
use crate::num::{greater, index};
use crate::pose::Pose;

/// A pose whose place is known worse than to this share of the median depth, and so many times worse than those before, makes no landmarks.
const SOUND_SHARE_MAX: f64 = 0.001;
const SOUND_FACTOR: f64 = 2.5;
/// Those before are averaged over so many frames.
const USUAL_FRAMES: f64 = 300.0;

/// The noise of places is averaged over so many frames.
const NOISE_FRAMES: f64 = 15.0;

/// What a pose is worth.
#[derive(Clone, Copy, Debug)]
pub struct Judgement {
    /// Single-picture position sigma given the map.
    pub single_picture_sigma_m: Option<f64>,
    /// Whether landmarks may be made from it.
    pub is_sound: bool,
}

impl Tracker {
    /// Whether a foreseen pose leaves less open than a narrow search reaches: three sigma of turn and of place at the least depth.
    pub(super) fn is_sure(&self, foreseen: &Foreseen) -> bool {
        let (sigma_m, sigma_rad) = foreseen.sigmas();
        let focal_px = self.cameras[0].focal_px;
        3.0 * focal_px * (sigma_rad + sigma_m) < NARROW_PX
    }

    /// Whether all depth and scale come from the rig's own motion: no two cameras see the same, and no inertial unit binds the keyframes by
    /// its steps from one to the next.
    pub(super) fn hangs_on_motion(&self) -> bool {
        self.waiting.waits_for_motion() && self.inertia.is_none()
    }

    /// Places are off by no less: a map that hangs on its motion learns their noise from what they show.
    pub(super) fn least_px(&self) -> f64 {
        if self.hangs_on_motion() { 0.0 } else { WITHIN_PIXEL_PX }
    }

    /// Judges a pose; what is felt besides the picture vouches for it.
    pub(super) fn judge(&mut self, located: &Located, is_felt: bool) -> Judgement {
        let single_picture_sigma_m = located.single_picture_sigma_m;
        let is_sound = is_felt || self.is_sound(located, single_picture_sigma_m);
        self.weak_frames = if is_sound { 0 } else { self.weak_frames + 1 };
        let sigma_m = single_picture_sigma_m.unwrap_or(self.usual_sigma_m);
        let usual_m = if self.usual_sigma_m > 0.0 { self.usual_sigma_m } else { sigma_m };
        self.usual_sigma_m = usual_m + (sigma_m - usual_m) / USUAL_FRAMES;
        Judgement { single_picture_sigma_m, is_sound }
    }

    /// Whether a pose is known well enough to make landmarks from: they would carry its error on.
    fn is_sound(&self, located: &Located, single_picture_sigma_m: Option<f64>) -> bool {
        let body_from_world = &located.state.body_from_world;
        let depth_m = |found: &Found| body_from_world.point(self.map.landmarks[found.landmark].position_m).length();
        let mut depths_m: Vec<f64> = located.inliers.iter().map(depth_m).collect();
        depths_m.sort_by(f64::total_cmp);
        let median_m = depths_m.get(depths_m.len() / 2).copied().unwrap_or(0.0);
        let known = |sigma_m: f64| sigma_m <= greater(SOUND_SHARE_MAX * median_m, SOUND_FACTOR * self.usual_sigma_m);
        self.cameras.len() == 1 || single_picture_sigma_m.is_some_and(known)
    }

    /// Takes a frame's residuals for the noise of places, by their median. Corners on the steps of few bits jump by a pixel: points made
    /// from them with the noise of fine pictures look certain, and certain ones are refused. The residuals of a false map grow without end,
    /// and a noise that grew with them would let anything fit: what the start has shown is the bound.
    fn learn_noise(&mut self, views: &[View], located: &Located) {
        if !self.hangs_on_motion() {
            return;
        }
        let params = &self.params;
        let error2 = |found: &Found| {
            let sight = &views[index(found.camera.0)].sights[found.sight];
            let landmark_m = located.state.at(sight.offset_s).point(self.map.landmarks[found.landmark].position_m);
            let place_px = self.cameras[index(found.camera.0)].place(landmark_m)?;
            Some(((sight.place_px - place_px) * params.inverse_sigma(sight.scale)).length_squared())
        };
        let errors2: Vec<f64> = located.inliers.iter().filter_map(error2).collect();
        let Some(median) = upper_median(&errors2) else { return };
        let (now_px, least_px) = (params.place_sigma_px, self.place_sigma_px_min);
        let shown_px2 = now_px * now_px * median / MEDIAN_SIGMAS2;
        let smoothed_px2 = now_px * now_px + (shown_px2 - now_px * now_px) / NOISE_FRAMES;
        self.params.place_sigma_px = smoothed_px2.sqrt().clamp(least_px, self.place_sigma_px_max);
    }

    /// Counts what was predicted and found, for culling, and learns from it; gives the inliers and the number of different landmarks.
    pub(super) fn account(&mut self, views: &[View], located: &Located) -> (Vec<Inlier>, u32) {
        self.learn_noise(views, located);
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
        let inlier = |found: &Found| Inlier {
            camera: found.camera,
            feature: views[index(found.camera.0)].sights[found.sight].feature,
            landmark: self.map.landmarks[found.landmark].id,
        };
        (located.inliers.iter().map(inlier).collect(), different)
    }

    pub(super) fn innovation_px(&self, views: &[View], located: &Located, predicted: &Moving) -> Option<f64> {
        let distance_px = |found: &Found| {
            let sight = &views[index(found.camera.0)].sights[found.sight];
            let landmark_m = predicted.at(sight.offset_s).point(self.map.landmarks[found.landmark].position_m);
            let place_px = self.cameras[index(found.camera.0)].place(landmark_m)?;
            Some((sight.place_px - place_px).length())
        };
        let distances_px: Vec<f64> = located.inliers.iter().filter_map(distance_px).collect();
        upper_median(&distances_px)
    }

    /// Whether a located frame has moved far from the last keyframe, or has lost too many of its landmarks.
    ///
    /// Of the points that two cameras make at once nearly all are found again. Those that wait for the body's motion are fewer, and corners
    /// that flicker as many: counting them as found made a keyframe of every frame or two. There only what was found since counts.
    pub(super) fn keyframe_is_due(&mut self, world_from_body: &Pose, tracked: u32) -> bool {
        let waits = self.hangs_on_motion();
        let Some(last) = &mut self.last_keyframe else { return true };
        if waits {
            last.landmarks = last.landmarks.max(tracked);
        }
        let last = *last;
        let moved = last.world_from_body.inverse().then(world_from_body);
        self.frame - last.frame >= u64::from(self.params.keyframe_frames_max)
            || moved.translation_m.length() > self.params.keyframe_distance_m
            || moved.angle_rad() > self.params.keyframe_angle_rad
            || f64::from(tracked) < self.params.keyframe_share_min * f64::from(last.landmarks)
    }
}
