//! Follows corners of an initial frame from picture to picture, given the rotation between neighbours.
//!
//! Two views far apart that are matched by descriptors alone share 44 to 82 % of false pairs in a room of wallpaper after half a second, as
//! many as can agree on a false motion. From one picture to the next a corner moves a few pixels once the turn is taken off,
//! and there little resembles it.

use glam::{DQuat, DVec3};

use super::answer::TrackerWork;
use super::params::TrackerParams;
use crate::num::u64_from;
use crate::tracker::matching::{Best, Descriptor, MatchRule, one_to_one};
use crate::tracker::refine::upper_median;
use crate::tracker::rig::{CameraKeypoints, Keypoint, RigCamera};

/// Frames for which a corner that flickers is looked for where the turns have taken it.
const MISSING_FRAMES_MAX: u32 = 15;

/// A corner of the opening view.
#[derive(Clone, Debug)]
struct CornerTrack {
    /// Where it is, or was taken by turns, in the camera's frame.
    bearing: DVec3,
    /// What it looked like at first and last.
    looks: [Descriptor; 2],
    missing: u32,
    /// Its keypoint in the present view.
    keypoint: Option<usize>,
}

/// All corners of an opening view.
#[derive(Clone, Debug, Default)]
pub struct Tracks {
    tracks: Vec<CornerTrack>,
}

impl Tracks {
    /// Every keypoint of a view begins a track of its number.
    pub fn of(view: &CameraKeypoints) -> Self {
        let track = |(number, keypoint): (usize, &Keypoint)| CornerTrack {
            bearing: keypoint.bearing,
            looks: [keypoint.descriptor; 2],
            missing: 0,
            keypoint: Some(number),
        };
        Self { tracks: view.keypoints.iter().enumerate().map(track).collect() }
    }

    /// Takes the next view; `turn` leads from the last camera to this one.
    pub fn follow(
        &mut self,
        (camera, view, turn): (&RigCamera, &CameraKeypoints, DQuat),
        params: &TrackerParams,
        work: &mut TrackerWork,
    ) {
        let rule = MatchRule { distance_max: params.distance_bits_max, ratio_max: 0.8 };
        let mut pairs = Vec::new();
        for (number, track) in self.tracks.iter_mut().enumerate() {
            (track.bearing, track.keypoint) = (turn * track.bearing, None);
            track.missing += 1;
            if track.missing > MISSING_FRAMES_MAX {
                continue;
            }
            let Some(position_px) = camera.project(camera.calibration.body_from_camera.direction(track.bearing)) else {
                continue;
            };
            let mut best = Best::NONE;
            for keypoint in view.near(position_px, params.search_radius_px) {
                let distance = |look: &Descriptor| look.distance(&view.keypoints[keypoint].descriptor);
                best.offer(keypoint, distance(&track.looks[0]).min(distance(&track.looks[1])));
                work.descriptors_compared += u64_from(track.looks.len());
            }
            pairs.extend(best.accepted(rule).map(|keypoint| (number, keypoint, best.distance)));
        }
        for (number, keypoint) in one_to_one(&pairs, view.keypoints.len()) {
            let (track, found) = (&mut self.tracks[number], &view.keypoints[keypoint]);
            (track.bearing, track.looks[1]) = (found.bearing, found.descriptor);
            (track.missing, track.keypoint) = (0, Some(keypoint));
        }
    }

    /// Tracks that the present view shows: keypoint of the opening view, keypoint of this one.
    pub fn pairs(&self) -> Vec<(usize, usize)> {
        let pair = |(number, track): (usize, &CornerTrack)| track.keypoint.map(|keypoint| (number, keypoint));
        self.tracks.iter().enumerate().filter_map(pair).collect()
    }
}

/// Median distance in pixels between the positions of the same tracks in two views; `None` where they share none.
pub fn median_step_px(
    (before, before_pairs): (&CameraKeypoints, &[(usize, usize)]),
    (now, now_pairs): (&CameraKeypoints, &[(usize, usize)]),
) -> Option<f64> {
    // Tracks rise in both lists.
    let step_px = |&(track, i): &(usize, usize)| {
        let at = now_pairs.binary_search_by_key(&track, |pair| pair.0).ok()?;
        Some((now.keypoints[now_pairs[at].1].position_px - before.keypoints[i].position_px).length())
    };
    let steps_px: Vec<f64> = before_pairs.iter().filter_map(step_px).collect();
    upper_median(&steps_px)
}
