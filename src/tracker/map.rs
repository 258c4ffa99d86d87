//! The map: landmarks, keyframes and their observations, in metres and pixels. Selects the windows for bundle adjustment. Its memory is
//! bounded.

use glam::{DVec2, DVec3};

use super::params::TrackerParams;
use super::problem::{Observation, Problem};
use crate::num::{f64_from_u64, index, u32_from};
use crate::pose::Pose;
use crate::tracker::lie::{Sim3, Twist};
use crate::tracker::matching::Descriptor;
use crate::tracker::preintegrate::chain::WindowKeyframe;
use crate::tracker::rig::{Keypoint, RigCamera};
use crate::tracker::row_motion::Moving;
use crate::units::CameraIndex;

/// Descriptors kept per landmark, from different views; a new one replaces the oldest.
pub const DESCRIPTORS_MAX: usize = 4;
/// A view whose descriptor differs from all kept ones by more bits than this is kept too.
const DESCRIPTOR_NEWS_BITS: u32 = 20;
/// An observation beyond this squared error in sigmas is dropped after an adjustment: the 99.9 % quantile of chi2 with 2.
const OUTLIER_SIGMAS2: f64 = 13.8;
/// Fewer observations than this in held keyframes do not hold a window.
const HOLDING_OBSERVATIONS_MIN: usize = 30;
/// A keyframe may be thinned out where at least this share of its sightings is made by three others too.
const THINNED_SHARE_MIN: f64 = 0.5;
/// A landmark must prove itself within this many keyframes.
const PROBATION_KEYFRAMES: u32 = 3;

/// A landmark seen by a camera at a keyframe.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    pub keyframe: u32,
    pub camera: CameraIndex,
    pub position_px: DVec2,
    /// One over the standard deviation per axis, in 1/px.
    pub inverse_sigma: f64,
    /// From the time of the keyframe to that of the position's row, in seconds.
    pub offset_s: f64,
}

impl Sighting {
    /// A keypoint of a keyframe's camera.
    pub fn of((keyframe, camera): (u32, CameraIndex), keypoint: &Keypoint, params: &TrackerParams) -> Self {
        let inverse_sigma = params.inverse_sigma(keypoint.scale);
        Self { keyframe, camera, position_px: keypoint.position_px, inverse_sigma, offset_s: keypoint.offset_s }
    }
}

/// A point of the world that was recognised more than once.
#[derive(Clone, Debug)]
pub struct Landmark {
    /// Its number, never reused.
    pub id: u32,
    /// Metres in the world's frame.
    pub position_m: DVec3,
    pub(crate) descriptors: Vec<Descriptor>,
    pub(crate) sightings: Vec<Sighting>,
    pub(crate) predicted: u32,
    pub(crate) found: u32,
    pub(crate) last_frame: u64,
    pub(crate) born_keyframe: u32,
}

impl Landmark {
    /// Least distance in bits of a descriptor to any of the landmark's.
    pub(crate) fn distance(&self, descriptor: &Descriptor) -> u32 {
        self.descriptors.iter().map(|own| own.distance(descriptor)).min().unwrap_or(256)
    }

    /// Number of different keyframes that saw it; sightings stand in the order of keyframes.
    pub(crate) fn keyframe_count(&self) -> usize {
        let repeats = self.sightings.windows(2).filter(|pair| pair[0].keyframe == pair[1].keyframe).count();
        self.sightings.len() - repeats
    }

    /// Takes a sighting, unless it has one of the same keyframe and camera.
    pub(crate) fn see(&mut self, sighting: Sighting) {
        let key = |s: &Sighting| (s.keyframe, s.camera);
        if let Err(at) = self.sightings.binary_search_by_key(&key(&sighting), key) {
            self.sightings.insert(at, sighting);
        }
    }

    pub(crate) fn remember(&mut self, descriptor: Descriptor) {
        if self.distance(&descriptor) <= DESCRIPTOR_NEWS_BITS {
            return;
        }
        if self.descriptors.len() == DESCRIPTORS_MAX {
            self.descriptors.remove(1); // The first view stays: it is what a return to the start finds.
        }
        self.descriptors.push(descriptor);
    }
}

/// A frame whose sightings stay in the map.
#[derive(Clone, Copy, Debug)]
pub struct Keyframe {
    /// Its number, rising, never reused.
    pub id: u32,
    pub t_s: f64,
    /// Where the body was, and how it moved.
    pub state: Moving,
}

/// Landmarks in rising order of their numbers, keyframes too.
#[derive(Clone, Debug, Default)]
pub struct Map {
    pub landmarks: Vec<Landmark>,
    pub keyframes: Vec<Keyframe>,
    next_landmark: u32,
    next_keyframe: u32,
}

/// A window taken out for adjustment, with the way back.
pub struct AdjustmentWindow<'a> {
    pub problem: Problem<'a>,
    keyframes: Vec<usize>,
    landmarks: Vec<usize>,
}

impl AdjustmentWindow<'_> {
    /// Its keyframes as a chain of inertial steps knows them.
    pub fn nodes(&self, map: &Map) -> Vec<WindowKeyframe> {
        let node = |(number, &keyframe): (usize, &usize)| {
            let held = &map.keyframes[keyframe];
            let free = (number < self.problem.free).then(|| u32_from(number));
            WindowKeyframe { keyframe: held.id, body_from_world: held.state.body_from_world, free }
        };
        self.keyframes.iter().enumerate().map(node).collect()
    }
}

impl Map {
    /// Adds a keyframe and gives its number.
    pub fn add_keyframe(&mut self, t_s: f64, state: Moving) -> u32 {
        let id = self.next_keyframe;
        self.next_keyframe += 1;
        self.keyframes.push(Keyframe { id, t_s, state });
        id
    }

    /// A keyframe's rate is known better than when it was made: landmarks that only it saw move with their rows.
    pub fn set_rate(&mut self, keyframe: usize, rate: Twist) {
        let held = &mut self.keyframes[keyframe];
        let (id, before) = (held.id, held.state);
        held.state.rate = rate;
        let after = held.state;
        let from_world = before.body_from_world;
        let alone = |landmark: &&mut Landmark| landmark.sightings.iter().all(|sighting| sighting.keyframe == id);
        for landmark in self.landmarks.iter_mut().filter(alone) {
            let Some(sighting) = landmark.sightings.first() else { continue };
            let at_row_m = before.row_from_frame(sighting.offset_s).point(from_world.point(landmark.position_m));
            let at_frame_m = after.row_from_frame(sighting.offset_s).inverse().point(at_row_m);
            landmark.position_m = from_world.inverse().point(at_frame_m);
        }
    }

    /// Keyframes move from poses (`world_from_body`) to others, and each landmark with the last keyframe that saw it, in its unit.
    pub fn deform(&mut self, before: &[Pose], after: &[Sim3]) {
        for landmark in &mut self.landmarks {
            let last = landmark.sightings.last().map_or(0, |sighting| sighting.keyframe);
            if let Ok(k) = self.keyframes.binary_search_by_key(&last, |keyframe| keyframe.id) {
                landmark.position_m = after[k].point(before[k].inverse().point(landmark.position_m));
            }
        }
        for (keyframe, after) in self.keyframes.iter_mut().zip(after) {
            keyframe.state.body_from_world = after.pose().inverse();
            keyframe.state.rate.linear_m *= after.scale;
        }
    }

    /// Puts the sightings of the first landmark of each pair into the second, and removes the first.
    pub fn merge(&mut self, pairs: &[(usize, usize)]) {
        let mut gone = vec![false; self.landmarks.len()];
        for &(from, into) in pairs {
            if gone[from] || gone[into] {
                continue;
            }
            gone[from] = true;
            for sighting in std::mem::take(&mut self.landmarks[from].sightings) {
                self.landmarks[into].see(sighting);
            }
            let last_frame = self.landmarks[from].last_frame;
            self.landmarks[into].last_frame = self.landmarks[into].last_frame.max(last_frame);
        }
        let mut gone = gone.iter();
        self.landmarks.retain(|_| gone.next() == Some(&false));
    }

    /// Adds a landmark with its first sightings.
    pub fn add_landmark(&mut self, position_m: DVec3, descriptor: Descriptor, sightings: Vec<Sighting>, frame: u64) {
        let born_keyframe = sightings.last().map_or(0, |sighting| sighting.keyframe);
        self.landmarks.push(Landmark {
            id: self.next_landmark,
            position_m,
            descriptors: vec![descriptor],
            sightings,
            predicted: 1,
            found: 1,
            last_frame: frame,
            born_keyframe,
        });
        self.next_landmark += 1;
    }

    /// The last `free` keyframes, all landmarks they see, and the older keyframes that hold those landmarks. The first
    /// keyframe never moves: it is the world's frame.
    pub fn window<'a>(&self, cameras: &'a [RigCamera], free: usize, held_max: usize) -> AdjustmentWindow<'a> {
        let start = self.keyframes.len().saturating_sub(free).max(1).min(self.keyframes.len());
        let first_free = self.keyframes.get(start).map_or(u32::MAX, |keyframe| keyframe.id);
        let inside = |landmark: &Landmark| {
            landmark.sightings.len() >= 2 && landmark.sightings.last().is_some_and(|last| last.keyframe >= first_free)
        };
        let landmarks: Vec<usize> = (0..self.landmarks.len()).filter(|&l| inside(&self.landmarks[l])).collect();
        let mut shared = vec![0_usize; start];
        for sighting in landmarks.iter().flat_map(|&l| &self.landmarks[l].sightings) {
            if let Ok(keyframe) = self.keyframes[..start].binary_search_by_key(&sighting.keyframe, |k| k.id) {
                shared[keyframe] += 1;
            }
        }
        let mut held: Vec<usize> = (0..start).filter(|&keyframe| shared[keyframe] > 0).collect();
        held.sort_by_key(|&keyframe| (std::cmp::Reverse(shared[keyframe]), keyframe));
        held.truncate(held_max);
        let holding: usize = held.iter().map(|&keyframe| shared[keyframe]).sum();
        let mut moving: Vec<usize> = (start..self.keyframes.len()).collect();
        if holding < HOLDING_OBSERVATIONS_MIN && !moving.is_empty() {
            held.push(moving.remove(0)); // Nothing else says where the window stands.
        }
        let free = moving.len();
        let keyframes: Vec<usize> = moving.into_iter().chain(held).collect();
        let problem = self.problem(cameras, free, (&keyframes, &landmarks));
        AdjustmentWindow { problem, keyframes, landmarks }
    }

    fn problem<'a>(
        &self,
        cameras: &'a [RigCamera],
        free: usize,
        (keyframes, landmarks): (&[usize], &[usize]),
    ) -> Problem<'a> {
        let mut number = vec![None; self.keyframes.len()];
        for (pose, &keyframe) in keyframes.iter().enumerate() {
            number[keyframe] = Some(u32_from(pose));
        }
        let mut observations = Vec::new();
        for (point, &landmark) in landmarks.iter().enumerate() {
            for sighting in &self.landmarks[landmark].sightings {
                let keyframe = self.keyframes.binary_search_by_key(&sighting.keyframe, |k| k.id);
                let Some(pose) = keyframe.ok().and_then(|keyframe| number[keyframe]) else { continue };
                let row_from_frame = self.keyframes[keyframes[index(pose)]].state.row_from_frame(sighting.offset_s);
                let Sighting { camera, position_px, inverse_sigma, .. } = *sighting;
                let point = u32_from(point);
                observations.push(Observation { pose, point, camera, position_px, inverse_sigma, row_from_frame });
            }
        }
        let poses = keyframes.iter().map(|&keyframe| self.keyframes[keyframe].state.body_from_world).collect();
        let points_m = landmarks.iter().map(|&landmark| self.landmarks[landmark].position_m).collect();
        Problem { cameras, poses, free, points_m, observations }
    }

    /// Takes an adjusted window back and drops observations that do not fit it.
    pub fn put_back(&mut self, window: &AdjustmentWindow<'_>) {
        let problem = &window.problem;
        for (&keyframe, pose) in window.keyframes.iter().zip(&problem.poses).take(problem.free) {
            self.keyframes[keyframe].state.body_from_world = *pose;
        }
        for (&landmark, point_m) in window.landmarks.iter().zip(&problem.points_m) {
            self.landmarks[landmark].position_m = *point_m;
        }
        for (observation, error2) in problem.observations.iter().zip(problem.errors2()) {
            if error2 > OUTLIER_SIGMAS2 {
                let keyframe = self.keyframes[window.keyframes[index(observation.pose)]].id;
                let sightings = &mut self.landmarks[window.landmarks[index(observation.point)]].sightings;
                sightings.retain(|s| s.keyframe != keyframe || s.camera != observation.camera);
            }
        }
    }

    /// Removes landmarks that did not prove themselves, then keyframes and landmarks beyond the bounds of memory.
    pub fn cull(&mut self, window: usize, keyframes_max: usize, landmarks_max: usize) {
        while self.keyframes.len() > keyframes_max.max(window + 1) {
            self.drop_most_redundant_keyframe(window);
        }
        let now = self.next_keyframe;
        self.landmarks.retain(|landmark| {
            let on_probation = now <= landmark.born_keyframe + PROBATION_KEYFRAMES;
            let rarely_found = 4 * u64::from(landmark.found) < u64::from(landmark.predicted);
            let seen_once = landmark.keyframe_count() < 2;
            landmark.sightings.len() >= 2
                && landmark.position_m.is_finite()
                && if on_probation { !(rarely_found && landmark.predicted >= 4) } else { !seen_once }
        });
        if self.landmarks.len() > landmarks_max {
            // What the window works with stays, however young; of the rest what many keyframes know is worth most.
            let window_from = self.keyframes.len().checked_sub(window).map_or(0, |first| self.keyframes[first].id);
            let value = |landmark: &Landmark| {
                let is_at_work = landmark.sightings.last().is_some_and(|last| last.keyframe >= window_from);
                (is_at_work, landmark.keyframe_count(), landmark.last_frame, landmark.id)
            };
            let values: Vec<_> = self.landmarks.iter().map(value).collect();
            let spare = values.len() - landmarks_max;
            let least = *values.clone().select_nth_unstable(spare).1;
            let mut value = values.into_iter();
            self.landmarks.retain(|_| value.next().is_some_and(|value| value >= least));
        }
    }

    /// Removes window keyframes between two near neighbours (metres, radians) that observe few landmarks alone. Ten keyframes
    /// then span enough parallax to fix one camera's depths. The first keyframe and the last two stay.
    pub fn thin(&mut self, window: usize, (near_m, near_rad): (f64, f64)) {
        let count = self.keyframes.len();
        let is_between = |keyframes: &[Keyframe], k: usize| {
            let world_from_before = keyframes[k - 1].state.body_from_world.inverse();
            let step = keyframes[k + 1].state.body_from_world.then(&world_from_before);
            step.translation_m.length() <= near_m && step.angle_rad() <= near_rad
        };
        for _ in 0..count.min(window) {
            let from = self.keyframes.len().saturating_sub(window).max(1);
            let to = self.keyframes.len().saturating_sub(2);
            let shares = self.redundant_shares(from, to);
            let redundant = |&k: &usize| is_between(&self.keyframes, k) && shares[k - from] >= THINNED_SHARE_MIN;
            let most = |best: usize, next: usize| if shares[next - from] > shares[best - from] { next } else { best };
            let Some(dropped) = (from..to).filter(redundant).reduce(most) else { return };
            self.drop_keyframe(dropped);
        }
    }

    /// Drops, outside the window and after the first, the keyframe with the greatest share of sightings that three other
    /// keyframes make as well.
    fn drop_most_redundant_keyframe(&mut self, window: usize) {
        let old = self.keyframes.len() - window;
        let shares = self.redundant_shares(0, old);
        let dropped = (1..old).reduce(|best, next| if shares[next] > shares[best] { next } else { best }).unwrap_or(0);
        self.drop_keyframe(dropped);
    }

    /// Of each keyframe of a range, the share of sightings that three other keyframes make as well.
    fn redundant_shares(&self, from: usize, to: usize) -> Vec<f64> {
        let keyframes = self.keyframes.get(from..to).unwrap_or_default();
        let mut counts = vec![(0_u64, 0_u64); keyframes.len()];
        for landmark in &self.landmarks {
            let well_known = landmark.keyframe_count() > 3;
            for sighting in &landmark.sightings {
                if let Ok(keyframe) = keyframes.binary_search_by_key(&sighting.keyframe, |k| k.id) {
                    counts[keyframe].0 += 1;
                    counts[keyframe].1 += u64::from(well_known);
                }
            }
        }
        counts.into_iter().map(|(seen, spare)| (f64_from_u64(spare) + 1.0) / (f64_from_u64(seen) + 1.0)).collect()
    }

    fn drop_keyframe(&mut self, number: usize) {
        let id = self.keyframes.remove(number).id;
        for landmark in &mut self.landmarks {
            landmark.sightings.retain(|sighting| sighting.keyframe != id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::f64_from_u64;

    /// Keyframes at these positions along x; 20 landmarks seen by all of them, and 30 more by each of `alone` with its next one only.
    fn map(positions_m: &[f64], alone: &[u32]) -> Map {
        let mut map = Map::default();
        for (t_s, &x_m) in positions_m.iter().enumerate() {
            let world_from_body = Pose::new(glam::DQuat::IDENTITY, DVec3::X * x_m);
            map.add_keyframe(f64_from_u64(crate::num::u64_from(t_s)), Moving::resting(world_from_body.inverse()));
        }
        let sighting = |keyframe: u32| Sighting {
            keyframe,
            camera: CameraIndex(0),
            position_px: DVec2::ZERO,
            inverse_sigma: 1.0,
            offset_s: 0.0,
        };
        let mut add = |keyframes: Vec<u32>, count: u32| {
            for _ in 0..count {
                let descriptor = Descriptor::new(&[0; 32]);
                map.add_landmark(DVec3::Z, descriptor, keyframes.iter().copied().map(sighting).collect(), 0);
            }
        };
        add((0..u32_from(positions_m.len())).collect(), 20);
        alone.iter().for_each(|&keyframe| add(vec![keyframe, keyframe + 1], 30));
        map
    }

    fn numbers(map: &Map) -> Vec<u32> {
        map.keyframes.iter().map(|keyframe| keyframe.id).collect()
    }

    #[test]
    fn thinning_leaves_keyframes_that_span_the_way_and_the_last_two() {
        let positions_m: Vec<f64> = (0..12).map(|k| 0.02 * f64::from(k)).collect();
        let mut dense = map(&positions_m, &[]);
        dense.thin(10, (0.1, 0.2));
        // A window of ten reaches back to the first once two are gone. Any two neighbours but one lie more than 0.1 m apart: six steps.
        let kept = numbers(&dense);
        assert_eq!((kept[0], &kept[kept.len() - 2..]), (0, &[10, 11][..]));
        let inner = &kept[..kept.len() - 1];
        assert!(inner.windows(3).all(|three| three[2] - three[0] >= 6) && kept.len() < 8, "{kept:?}");
        let is_held = |s: &Sighting| kept.contains(&s.keyframe);
        assert!(dense.landmarks.iter().all(|l| l.sightings.len() == kept.len() && l.sightings.iter().all(is_held)));
        let mut wide = map(&[0.0, 0.06, 0.12, 0.18, 0.24, 0.30], &[]);
        wide.thin(10, (0.1, 0.2));
        assert_eq!(numbers(&wide), [0, 1, 2, 3, 4, 5], "keyframes that span parallax stay");
    }

    #[test]
    fn a_keyframe_that_sees_much_of_its_own_is_not_thinned_out() {
        let mut map = map(&[0.0, 0.01, 0.02, 0.03, 0.04, 0.05], &[2]);
        map.thin(10, (0.1, 0.2));
        // 20 of the 50 sightings of keyframes 2 and 3 are made by three others.
        assert_eq!(numbers(&map), [0, 2, 3, 4, 5]);
    }
}
