//! Loop closing: recognises a place that the map has drifted away from, corrects the poses between both visits, and merges duplicate
//! landmarks.
//!
//! Landmarks that were not found for long are recognised by descriptors, a pose must agree with them by geometry (P3P, refinement, a second
//! search around their positions), the next keyframe must see the same offset, and a pose graph over the keyframes shares it out. The
//! candidates are bounded, so a keyframe's time is too.

#[cfg(test)]
mod tests;

use super::answer::TrackerWork;
use super::localiser::{LandmarkMatch, Localiser};
use super::params::TrackerParams;
use crate::draw::DrawKey;
use crate::num::{greater, index, u32_from};
use crate::pose::Pose;
use crate::tracker::lie::Sim3;
use crate::tracker::map::{Landmark, Map, Sighting};
use crate::tracker::pose_graph::{Edge, PoseGraph, RobustKernel, information};
use crate::tracker::refine::upper_median;
use crate::tracker::rig::{CameraKeypoints, Keypoint, RigCamera};
use crate::tracker::row_motion::Moving;

/// Frames for which a landmark must not have been found to count as one of an earlier visit: five seconds at 30 Hz.
const AWAY_FRAMES: u64 = 150;
/// Candidates of one recognition at most: with 500 features, two cameras and four descriptors 2.4 million distances, some 5 ms.
const CANDIDATES_MAX: usize = 600;
/// Landmarks of an earlier visit that must agree on a pose.
const AGREEING_MIN: u32 = 30;
/// Cosine of the angle off the body's view within which candidates are looked for: 75 degrees allow for turns that drifted.
const VIEW_COSINE_MIN: f64 = 0.26;
/// Two keyframes' offsets must agree within this share of the offset and this floor (metres, radians).
const AGREE_SHARE: f64 = 0.3;
const AGREE_FLOOR: f64 = 0.02;
/// Smaller offsets (metres, radians) are the adjustment's to remove: a search around predicted positions still finds them.
const OFFSET_MIN: f64 = 0.01;
/// What a step from keyframe to keyframe may be off by, in metres and radians, and what a closed loop's may.
const STEP_SIGMAS: [f64; 2] = [0.01, 0.005];
const LOOP_SIGMAS: [f64; 2] = [0.005, 0.0025];
/// Drift of the logarithm of a map's scale per step, and its sigma from a loop: 30 depths, each to a tenth. Used only without a
/// metric scale.
const STEP_LOG_SCALE: f64 = 0.01;
const LOOP_LOG_SCALE: f64 = 0.02;
/// Largest drift that a loop may correct: metres and radians, plus shares of path length and rotation since the earlier visit.
/// A lens that is 1.5 % wrong, the worst calibration in the tests, drifts by 2.3 % of the path and 1.4 % of the rotation.
const DRIFT_FLOORS: [f64; 2] = [0.1, 0.05];
const DRIFT_SHARES: [f64; 2] = [0.025, 0.025];
/// Factor on the drift shares without a metric scale.
const DRIFT_FACTOR_WITHOUT_SCALE: f64 = 2.0;
/// Keypoints that must have a depth from both visits.
const RATIOS_MIN: usize = 10;
/// Where the graph begins to doubt a loop: three times the 99 % quantile of chi2 with 6 degrees of freedom, since two keyframes agreed
/// on it.
const DOUBT_SIGMAS2: f64 = 50.0;

/// A recognised place that the next keyframe must confirm.
#[derive(Clone, Copy, Debug)]
pub struct LoopCandidate {
    keyframe: u32,
    /// The current pose estimate relative to the pose from the earlier visit's landmarks: `believed_from_seen` in the world.
    offset: Pose,
}

/// A loop to close.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Earlier landmarks found in the keyframe's views.
    found: Vec<LandmarkMatch>,
    /// Pose of the body by the earlier visit's landmarks.
    seen: Moving,
    offset: Pose,
}

/// Looks for an earlier visit of the place that a located frame sees.
pub fn recognise(
    frame: &Localiser<'_>,
    number: u64,
    state: &Moving,
    key: DrawKey,
    work: &mut TrackerWork,
) -> Option<Loop> {
    let candidates = candidates(frame, number, state);
    if u32_from(candidates.len()) < AGREEING_MIN {
        return None;
    }

    let (seen, support) = frame.recognise(&candidates, key, work)?;
    if support < AGREEING_MIN {
        return None;
    }
    let (seen, found) = frame.revisit(&seen, &candidates, work)?;
    let offset = state.body_from_world.inverse().then(&seen.body_from_world);
    let is_new = offset.translation_m.length() > OFFSET_MIN || offset.angle_rad() > OFFSET_MIN;
    (u32_from(found.len()) >= AGREEING_MIN && is_new).then_some(Loop { found, seen, offset })
}

/// Landmarks of earlier visits in front of a camera, the ones nearest to its axis first.
fn candidates(frame: &Localiser<'_>, number: u64, state: &Moving) -> Vec<usize> {
    let mut near: Vec<(f64, usize)> = Vec::new();
    for (landmark, held) in frame.map.landmarks.iter().enumerate() {
        if held.last_frame + AWAY_FRAMES > number {
            continue;
        }
        let in_body_m = state.body_from_world.point(held.position_m);
        let cosine = |camera: &RigCamera| {
            let in_camera_m = camera.camera_from_body.point(in_body_m);
            in_camera_m.z / greater(in_camera_m.length(), 1e-9)
        };
        let best = frame.cameras.iter().map(cosine).fold(-1.0, greater);
        if best > VIEW_COSINE_MIN {
            near.push((-best, landmark));
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near.truncate(CANDIDATES_MAX);
    near.into_iter().map(|(_, landmark)| landmark).collect()
}

impl Loop {
    /// What the next keyframe is asked to confirm.
    pub fn loop_candidate(&self, keyframe: u32) -> LoopCandidate {
        LoopCandidate { keyframe, offset: self.offset }
    }

    /// Whether an earlier keyframe, one of the last three, saw the same offset.
    pub fn confirms(&self, keyframe: u32, before: &LoopCandidate) -> bool {
        let between = before.offset.inverse().then(&self.offset);
        let metres = AGREE_FLOOR + AGREE_SHARE * self.offset.translation_m.length();
        let radians = AGREE_FLOOR + AGREE_SHARE * self.offset.angle_rad();
        keyframe <= before.keyframe + 3 && between.translation_m.length() < metres && between.angle_rad() < radians
    }

    /// Corrects the map so that the last keyframe agrees with the earlier visit's landmarks, in their scale if the map has no
    /// metric one. Gives the scale factor of the last keyframe; `None`, with the map unchanged, if the pose graph rejects the
    /// loop.
    pub fn close(
        &self,
        map: &mut Map,
        views: &[CameraKeypoints],
        (has_scale, params): (bool, &TrackerParams),
    ) -> Option<f64> {
        let from = self.earlier_keyframe(map)?;
        let last = map.keyframes.len() - 1;
        if !self.is_credible(map, from, has_scale) || self.stands_on_both(map, from) {
            return None;
        }
        let scale = if has_scale { 1.0 } else { self.scale(map, views)? };
        let before: Vec<Pose> = map.keyframes.iter().map(|keyframe| keyframe.state.body_from_world.inverse()).collect();
        let mut graph = PoseGraph::new(before.iter().copied().map(Sim3::from).collect(), !has_scale);
        graph.held[0] = true;
        for k in 0..last {
            let [linear_m, angular_rad] = STEP_SIGMAS;
            graph.add_present_edge(u32_from(k), u32_from(k + 1), information(linear_m, angular_rad, STEP_LOG_SCALE));
        }
        let measured = before[from].inverse().then(&self.seen.body_from_world.inverse());
        graph.edges.push(Edge {
            from: u32_from(from),
            to: u32_from(last),
            from_to: Sim3 { scale, ..Sim3::from(measured) },
            information: information(LOOP_SIGMAS[0], LOOP_SIGMAS[1], LOOP_LOG_SCALE),
            kernel: RobustKernel::Switchable(DOUBT_SIGMAS2),
        });
        graph.solve_graduated(30);
        if graph.weights().last().is_none_or(|&weight| weight < 0.25) {
            return None;
        }
        map.deform(&before, &graph.nodes);
        self.fuse(map, views, params);
        graph.nodes.last().map(|node| node.scale)
    }

    /// Whether the way since the earlier visit may have drifted by the offset. What is farther off is another place that looks alike.
    fn is_credible(&self, map: &Map, from: usize, has_scale: bool) -> bool {
        let (mut path_m, mut turn_rad) = (0.0, 0.0);
        for pair in map.keyframes[from..].windows(2) {
            let step = pair[0].state.body_from_world.then(&pair[1].state.body_from_world.inverse());
            path_m += step.translation_m.length();
            turn_rad += step.angle_rad();
        }
        let share = if has_scale { 1.0 } else { DRIFT_FACTOR_WITHOUT_SCALE };
        self.offset.translation_m.length() <= DRIFT_FLOORS[0] + share * DRIFT_SHARES[0] * path_m
            && self.offset.angle_rad() <= DRIFT_FLOORS[1] + DRIFT_SHARES[1] * turn_rad
    }

    /// Whether the last keyframe is held by landmarks of the earlier visit's time as well as by others: then nothing has drifted since,
    /// and what was recognised is another place that looks alike.
    fn stands_on_both(&self, map: &Map, from: usize) -> bool {
        let (Some(last), earlier) = (map.keyframes.last(), map.keyframes[from].id) else { return false };
        let is_old = |landmark: &&Landmark| {
            landmark.born_keyframe <= earlier && landmark.sightings.last().is_some_and(|seen| seen.keyframe == last.id)
        };
        2 * map.landmarks.iter().filter(is_old).count() >= self.found.len()
    }

    /// Length of the present's unit in that of the earlier visit: the median ratio of the depths that both have for the same keypoints.
    /// `None` where too few keypoints have both.
    fn scale(&self, map: &Map, views: &[CameraKeypoints]) -> Option<f64> {
        let keyframe = map.keyframes.last()?;
        let depth_m =
            |state: &Moving, landmark: usize| state.body_from_world.point(map.landmarks[landmark].position_m).length();
        let mut ratios: Vec<f64> = Vec::new();
        for (_, found, holder) in self.holders(map, views) {
            if let Some(holder) = holder.filter(|&holder| holder != found.landmark) {
                ratios.push(depth_m(&self.seen, found.landmark) / depth_m(&keyframe.state, holder));
            }
        }
        upper_median(&ratios).filter(|ratio| ratios.len() >= RATIOS_MIN && ratio.is_finite() && *ratio > 0.0)
    }

    /// The keypoints of the earlier landmarks, and which landmark has taken each of them by now.
    fn holders<'a>(
        &'a self,
        map: &'a Map,
        views: &'a [CameraKeypoints],
    ) -> impl Iterator<Item = (&'a Keypoint, &'a LandmarkMatch, Option<usize>)> + 'a {
        let keyframe = map.keyframes.last().map(|keyframe| keyframe.id);
        self.found.iter().map(move |found| {
            let keypoint = &views[index(found.camera.0)].keypoints[found.keypoint];
            let same = |s: &Sighting| {
                Some(s.keyframe) == keyframe && s.camera == found.camera && s.position_px == keypoint.position_px
            };
            let holder = (0..map.landmarks.len()).find(|&l| map.landmarks[l].sightings.iter().any(same));
            (keypoint, found, holder)
        })
    }

    /// The keyframe that saw most of the landmarks found again; the earlier of equals.
    fn earlier_keyframe(&self, map: &Map) -> Option<usize> {
        let mut seen = vec![0_u32; map.keyframes.len()];
        for sighting in self.found.iter().flat_map(|found| &map.landmarks[found.landmark].sightings) {
            if let Ok(keyframe) = map.keyframes.binary_search_by_key(&sighting.keyframe, |k| k.id) {
                seen[keyframe] += 1;
            }
        }
        let last = seen.len().checked_sub(1)?;
        (0..last).filter(|&k| seen[k] > 0).reduce(|best, next| if seen[next] > seen[best] { next } else { best })
    }

    /// The earlier landmarks are seen by the last keyframe too; what had taken their keypoints goes into them.
    fn fuse(&self, map: &mut Map, views: &[CameraKeypoints], params: &TrackerParams) {
        let Some(keyframe) = map.keyframes.last().map(|keyframe| keyframe.id) else { return };
        let mut doubled = Vec::new();
        let mut seen = Vec::new();
        for (keypoint, found, holder) in self.holders(map, views) {
            doubled.extend(holder.filter(|&holder| holder != found.landmark).map(|holder| (holder, found.landmark)));
            seen.push((found.landmark, Sighting::of((keyframe, found.camera), keypoint, params)));
        }
        for (landmark, sighting) in seen {
            map.landmarks[landmark].see(sighting);
        }
        map.merge(&doubled);
    }
}
