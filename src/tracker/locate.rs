//! Localises a frame in the map: searches landmarks around their predicted positions and refines the pose. After loss it relocalises by
//! descriptors alone.

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::answer::TrackerWork;
use super::localiser::{LandmarkMatch, LocalisedPose, Localiser};
use super::prior::PosePrior;
use crate::draw::DrawKey;
use crate::num::{greater, index, lesser, u32_from};
use crate::tracker::map::Landmark;
use crate::tracker::matching::{Best, Distances, MatchRule, one_to_one};
use crate::tracker::ransac::{RansacSettings, search};
use crate::tracker::refine::{
    FramePriors, PointMeasurement, StudentT, errors2, information, refine_with, single_picture_sigma_m, upper_median,
};
use crate::tracker::rig::CameraKeypoints;
use crate::tracker::row_motion::{Moving, RatePrior};
use crate::tracker::shift;
use crate::units::CameraIndex;

/// Search radius around a prediction corrected by the vote: one bin, and the remaining effect of translation and roll.
pub const NARROW_PX: f64 = 6.0;
/// The narrow search must find one in this many of the last frame's matches.
const NARROW_SHARE: u32 = 2;
/// Radius of the second search, around positions predicted by the refined pose.
const SECOND_RADIUS_PX: f64 = 4.0;
/// Squared error in sigmas up to which a found landmark supports the pose: the 99 % quantile of chi2 with 2.
const GATE_SIGMAS2: f64 = 9.21;
/// Largest accepted squared deviation of a pose from its prior, whatever the support: 5 sigma, the 99.96 % quantile of chi2
/// with 6 degrees of freedom.
const SURPRISE_SIGMAS2: f64 = 25.0;
/// Local error of the map between neighbouring poses, in metres and radians.
const MAP_SIGMAS: [f64; 2] = [0.003, 0.003];
/// Median of chi2 with 2 degrees of freedom: 2 ln 2.
pub const MEDIAN_SIGMAS2: f64 = 1.386;
/// Largest factor by which the gate widens when residuals exceed the assumed noise.
const GATE_FACTOR_MAX: f64 = 4.0;
/// Squared errors before the rate is known are larger by this: 10 px at the first and last row of a quick turn, in place of 3.6.
const SWEEP_SIGMAS2_FACTOR: f64 = 8.0;
/// A landmark this near to the best match is a duplicate of it, not a rival.
const TWIN_DISTANCE_M: f64 = 0.1;
/// Steps of a refinement; it stops by itself after some four.
const REFINE_ITERATIONS_MAX: u32 = 12;

/// The pose uses verified landmarks alone if there are this many times the required number.
const PROVEN_FACTOR: u32 = 2;

impl Localiser<'_> {
    /// Finds the pose near a prediction; `None` where the landmarks do not support one.
    pub fn near(&self, predicted: &Moving, work: &mut TrackerWork) -> Option<LocalisedPose> {
        let params = self.params;
        let rule = MatchRule { distance_max: params.distance_bits_max, ratio_max: 0.85 };
        // Texture that repeats within the radius pulls a whole frame one period aside: the search stays near what most landmarks vote for.
        let turned = if self.sure { Some(*predicted) } else { shift::turned(self, predicted, work) };
        let turned = turned.map(|turned| (turned, NARROW_PX));
        let usual = [params.search_radius_px, params.search_radius_wide_px].map(|radius_px| (*predicted, radius_px));
        for (predicted, radius_px) in turned.into_iter().chain(usual) {
            let (found, _) = self.search(self.all(), &predicted, radius_px, rule, work);
            let Some((state, inliers)) = self.settle(&predicted, found, work) else { continue };
            let Some(located) = self.confirm(&state, u32_from(inliers.len()), work) else { continue };
            if !self.is_credible(&located) {
                continue;
            }
            let enough = self.sure || NARROW_SHARE * u32_from(located.inliers.len()) >= self.inliers_before;
            if enough || radius_px > NARROW_PX {
                return Some(located);
            }
        }
        None
    }

    /// All landmarks.
    fn all(&self) -> Range<usize> {
        0..self.map.landmarks.len()
    }

    /// Whether the pose agrees with its prior.
    fn is_credible(&self, located: &LocalisedPose) -> bool {
        let is_near = |prior: PosePrior| {
            let [sigma_m, sigma_rad] = MAP_SIGMAS;
            prior.loosened(sigma_m, sigma_rad).deviation2(&located.state.body_from_world) <= SURPRISE_SIGMAS2
        };
        self.prior.is_none_or(is_near)
    }

    /// Finds the pose by descriptors alone, among the landmarks seen since a frame.
    pub fn anywhere(&self, seen_since: u64, key: DrawKey, work: &mut TrackerWork) -> Option<LocalisedPose> {
        let landmarks: Vec<usize> = self.all().filter(|&l| self.map.landmarks[l].last_frame >= seen_since).collect();
        let (start, support) = self.recognise(&landmarks, key, work)?;
        self.confirm(&start, support, work)
    }

    /// The pose from which some landmarks are seen, by descriptors alone, and its number of inliers.
    pub fn recognise(&self, landmarks: &[usize], key: DrawKey, work: &mut TrackerWork) -> Option<(Moving, u32)> {
        let found: Vec<LandmarkMatch> =
            (0..self.views.len()).flat_map(|camera| self.look_alikes(camera, landmarks, work)).collect();
        let measurements = self.measurements(&found);
        let bearing = |found: &LandmarkMatch| self.views[index(found.camera.0)].keypoints[found.keypoint].bearing;
        let bearings: Vec<DVec3> = found.iter().map(bearing).collect();
        // Until the rate is known, rows far from the frame's time have larger errors.
        let sweep = if self.sweeps() { SWEEP_SIGMAS2_FACTOR } else { 1.0 };
        let gate_sigmas2 = GATE_SIGMAS2 * GATE_FACTOR_MAX * sweep;
        let limits = RansacSettings { samples_max: self.params.samples_max, confidence: 0.999, gate_sigmas2 };
        let consensus = search(self.cameras, (&measurements, &bearings), key, limits)?;
        work.ransac_samples += consensus.samples;
        if consensus.agreeing < self.params.inliers_min {
            return None;
        }
        let agreed = found.iter().zip(&consensus.agrees).filter(|(_, agrees)| **agrees).map(|(found, _)| *found);
        let start = Moving::resting(consensus.body_from_world);
        let (state, inliers) = self.settle(&start, agreed.collect(), work)?;
        Some((state, u32_from(inliers.len())))
    }

    /// Keypoints of some landmarks around where a pose predicts them, and the pose that they agree on.
    pub fn revisit(
        &self,
        state: &Moving,
        landmarks: &[usize],
        work: &mut TrackerWork,
    ) -> Option<(Moving, Vec<LandmarkMatch>)> {
        let rule = MatchRule { distance_max: self.params.distance_bits_max, ratio_max: 0.95 };
        let (found, _) = self.search(landmarks.iter().copied(), state, SECOND_RADIUS_PX, rule, work);
        self.settle(state, found, work)
    }

    /// Searches again closely around a pose, which must keep its support. Wrong poses lose theirs here: chance matches do
    /// not line up within a few pixels.
    fn confirm(&self, state: &Moving, support: u32, work: &mut TrackerWork) -> Option<LocalisedPose> {
        let rule = MatchRule { distance_max: self.params.distance_bits_max, ratio_max: 0.95 };
        let (found, in_view) = self.search(self.all(), state, SECOND_RADIUS_PX, rule, work);
        let count = u32_from(found.len());
        let (state, inliers) = self.settle(state, found, work)?;
        let kept = u32_from(inliers.len());
        let enough = kept >= self.params.inliers_min && 2 * kept >= count && 2 * kept >= support;
        enough.then(|| {
            let prior = self.rate_prior(&state);
            let measurements = self.measurements(&inliers);
            // What the errors show of their noise, by the median, and what they are known to have besides.
            let shown = StudentT::of(&errors2(self.cameras, &measurements, &state));
            let known = shown.no_narrower(self.least_px, measurements.iter().map(|m| m.inverse_sigma));
            let under = |law| information(self.cameras, &measurements, &state, prior.as_ref(), law);
            let information = under(known);
            // In motion the two are one mostly.
            let single_picture_sigma_m =
                single_picture_sigma_m(&if shown == known { information } else { under(shown) });
            LocalisedPose { state, inliers, in_view, information, single_picture_sigma_m }
        })
    }

    /// Refines from a start, drops what does not fit, refines again. `None` below the least number of inliers.
    fn settle(
        &self,
        start: &Moving,
        found: Vec<LandmarkMatch>,
        work: &mut TrackerWork,
    ) -> Option<(Moving, Vec<LandmarkMatch>)> {
        let (mut state, mut kept) = (*start, found);
        for _ in 0..2 {
            if u32_from(kept.len()) < self.params.inliers_min {
                return None;
            }
            let proven: Vec<LandmarkMatch> = kept.iter().filter(|found| self.is_proven(found)).copied().collect();
            let held = if u32_from(proven.len()) >= PROVEN_FACTOR * self.params.inliers_min { &proven } else { &kept };
            let measurements = self.measurements(held);
            let prior = self.rate_prior(&state);
            let known = FramePriors { rate: prior.as_ref(), pose: self.prior.as_ref(), least_px: self.least_px };
            let (refined, iterations) = refine_with(self.cameras, &measurements, &state, known, REFINE_ITERATIONS_MAX);
            work.pose_iterations += iterations;
            state = refined;
            let gate = gate(&errors2(self.cameras, &measurements, &state));
            let errors2 = errors2(self.cameras, &self.measurements(&kept), &state);
            kept = kept.iter().zip(&errors2).filter(|(_, e)| **e <= gate).map(|(found, _)| *found).collect();
        }
        (u32_from(kept.len()) >= self.params.inliers_min).then_some((state, kept))
    }

    /// Whether a landmark has more than two views of one camera: two rays nearly always meet, and only a third can contradict
    /// them.
    fn is_proven(&self, found: &LandmarkMatch) -> bool {
        self.cameras.len() > 1 || self.map.landmarks[found.landmark].keyframe_count() > 2
    }

    fn sweeps(&self) -> bool {
        self.views.iter().any(CameraKeypoints::sweeps)
    }

    /// Prior of the rate; `None` with a global shutter.
    fn rate_prior(&self, state: &Moving) -> Option<RatePrior> {
        self.sweeps().then(|| {
            self.imu_rate
                .or_else(|| self.motion.map(|motion| motion.rate_prior(self.t_s, &state.body_from_world)))
                .unwrap_or(RatePrior::ANY)
        })
    }

    /// Of some landmarks those found within a radius of where the pose predicts them, and those that it predicts on any picture.
    fn search(
        &self,
        landmarks: impl Iterator<Item = usize>,
        state: &Moving,
        radius_px: f64,
        rule: MatchRule,
        work: &mut TrackerWork,
    ) -> (Vec<LandmarkMatch>, Vec<usize>) {
        let rotation = DMat3::from_quat(state.body_from_world.rotation);
        let mut pairs = vec![Vec::new(); self.views.len()];
        let mut in_view = Vec::new();
        for number in landmarks {
            let landmark = &self.map.landmarks[number];
            let in_body_m = rotation * landmark.position_m + state.body_from_world.translation_m;
            let mut visible = false;
            for (camera, view) in self.views.iter().enumerate() {
                work.projections += 1;
                let Some(position_px) = view.project(&self.cameras[camera], in_body_m, state) else { continue };
                visible = true;
                let mut best = Best::NONE;
                for keypoint in view.near(position_px, radius_px) {
                    work.descriptors_compared += crate::num::u64_from(landmark.descriptors.len());
                    best.offer(keypoint, landmark.distance(&view.keypoints[keypoint].descriptor));
                }
                if let Some(keypoint) = best.accepted(rule) {
                    pairs[camera].push((number, keypoint, best.distance));
                }
            }
            if visible {
                in_view.push(number);
            }
        }
        let found = |(camera, pairs): (usize, &Vec<(usize, usize, u32)>)| {
            let camera_index = CameraIndex(u32_from(camera));
            one_to_one(pairs, self.views[camera].keypoints.len())
                .into_iter()
                .map(move |(landmark, keypoint)| LandmarkMatch { camera: camera_index, keypoint, landmark })
        };
        (pairs.iter().enumerate().flat_map(found).collect(), in_view)
    }

    /// The landmark that each keypoint of a camera resembles most, where no other resembles it as much.
    fn look_alikes(&self, camera: usize, landmarks: &[usize], work: &mut TrackerWork) -> Vec<LandmarkMatch> {
        let rule = MatchRule { distance_max: self.params.distance_bits_max, ratio_max: 0.8 };
        let keypoints = &self.views[camera].keypoints;
        let mut pairs = Vec::new();
        // Landmark by landmark, then keypoint by keypoint: a landmark's views stay at hand for all keypoints.
        let mut best_of = vec![Best::NONE; keypoints.len()];
        let mut distances = Vec::with_capacity(keypoints.len());
        for &number in landmarks {
            let landmark = &self.map.landmarks[number];
            let others = keypoints.iter().map(|keypoint| &keypoint.descriptor);
            Distances { own: &landmark.descriptors, others, least: &mut distances }.fill();
            for (best, &distance) in best_of.iter_mut().zip(&distances) {
                if distance < best.second {
                    offer_unless_twin(best, (number, landmark, distance), &self.map.landmarks);
                }
            }
        }
        for (keypoint, best) in best_of.iter().enumerate() {
            work.descriptors_compared += crate::num::u64_from(landmarks.len());
            if let Some(landmark) = best.accepted(rule) {
                pairs.push((keypoint, landmark, best.distance));
            }
        }
        one_to_one(&pairs, self.map.landmarks.len())
            .into_iter()
            .map(|(keypoint, landmark)| LandmarkMatch { camera: CameraIndex(u32_from(camera)), keypoint, landmark })
            .collect()
    }

    /// Measurements of the matched landmarks.
    pub fn measurements(&self, found: &[LandmarkMatch]) -> Vec<PointMeasurement> {
        let measurement = |found: &LandmarkMatch| {
            let keypoint = &self.views[index(found.camera.0)].keypoints[found.keypoint];
            PointMeasurement::of(found.camera, keypoint, self.map.landmarks[found.landmark].position_m, self.params)
        };
        found.iter().map(measurement).collect()
    }
}

/// Offers a landmark. A duplicate of the best one replaces it or is skipped, but is no runner-up.
fn offer_unless_twin(best: &mut Best, (number, landmark, distance): (usize, &Landmark, u32), all: &[Landmark]) {
    let twin = best.distance != u32::MAX
        && (all[best.number].position_m - landmark.position_m).length_squared() < TWIN_DISTANCE_M * TWIN_DISTANCE_M;
    if !twin {
        best.offer(number, distance);
    } else if distance < best.distance {
        (best.number, best.distance) = (number, distance);
    }
}

/// Inlier gate, widened if the median residual exceeds the assumed noise.
fn gate(errors2: &[f64]) -> f64 {
    let median = upper_median(errors2).unwrap_or(0.0);
    GATE_SIGMAS2 * lesser(greater(median / MEDIAN_SIGMAS2, 1.0), GATE_FACTOR_MAX)
}
