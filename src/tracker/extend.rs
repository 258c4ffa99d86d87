//! Growth of the map at a keyframe: new landmarks from stereo pairs and from the last keyframe, then adjustment and culling.
//!
//! Positions are metres in the map's frame.

use super::answer::TrackerWork;
use super::localiser::LandmarkMatch;
use super::params::TrackerParams;
use crate::num::{index, u32_from, u32_truncated};
use crate::tracker::epipolar::{Band, Fix, Ray, matches, triangulate};
use crate::tracker::map::{Keyframe, Landmark, Map, Sighting};
use crate::tracker::matching::MatchRule;
use crate::tracker::preintegrate::filter::ImuFilter;
use crate::tracker::refine::{PointMeasurement, WITHIN_PIXEL_PX, refine};
use crate::tracker::rig::{CameraKeypoints, Keypoint, RigCamera};
use crate::tracker::row_motion::{Moving, RatePrior};
use crate::tracker::start::Begun;
use crate::tracker::unit::solve_in_unit;
use crate::units::CameraIndex;

/// Keypoints of a keyframe that no landmark claims, by camera; a later view may give them depth.
#[derive(Clone, Debug)]
struct Unclaimed {
    keyframe: u32,
    keypoints: Vec<Vec<Keypoint>>,
}

/// Keypoints without a landmark, of the last keyframes, the newest last.
#[derive(Clone, Debug)]
pub struct PendingKeypoints {
    keyframes: Vec<Unclaimed>,
    /// Keyframes held.
    reach: usize,
}

impl PendingKeypoints {
    /// Holds none yet, and never more than `reach` keyframes'.
    pub fn new(reach: usize) -> Self {
        Self { keyframes: Vec::new(), reach }
    }

    /// Holds at most this many keyframes from here on.
    pub fn set_reach(&mut self, reach: usize) {
        self.reach = reach;
    }

    /// Whether new points wait for the body's motion: no two cameras give depth at once.
    pub fn waits_for_motion(&self) -> bool {
        self.reach > 1
    }

    /// Keeps the keypoints of these keyframes only, given in rising order.
    pub fn keep(&mut self, keyframes: &[Keyframe]) {
        self.keyframes.retain(|held| keyframes.binary_search_by_key(&held.keyframe, |keyframe| keyframe.id).is_ok());
    }

    pub fn clear(&mut self) {
        self.keyframes.clear();
    }

    /// Takes a keyframe's keypoints; the oldest give way.
    pub fn push(&mut self, keyframe: u32, keypoints: Vec<Vec<Keypoint>>) {
        self.keyframes.push(Unclaimed { keyframe, keypoints });
        let spare = self.keyframes.len().saturating_sub(self.reach);
        self.keyframes.drain(..spare);
    }
}

/// The map's surroundings while it grows.
pub struct Growth<'a> {
    pub cameras: &'a [RigCamera],
    pub views: &'a [CameraKeypoints],
    pub params: &'a TrackerParams,
    pub frame: u64,
}

/// Noise in the position of a new point's partner, in sigmas, that matching allows for.
const BAND_SIGMAS: f64 = 4.0;
/// A new point whose positions miss by more, in sigmas squared, is refused: the 95 % quantile of chi2 with 2.
const NEW_POINT_SIGMAS2: f64 = 5.991;
/// A new point must be seen under an angle of this many sigmas, else its depth is not even known to a factor of 2.
const PARALLAX_SIGMAS_MIN: f64 = 3.0;
/// Between keyframes a point must be seen under this angle (1 degree): the pose is uncertain too.
const PARALLAX_RAD_MIN: f64 = 0.0175;
/// Neighbours on the picture that vote on a stereo pair stand this near.
const NEIGHBOUR_PX: f64 = 80.0;
/// A neighbour agrees within this many sigmas of its position plus this share of its parallax: surfaces are mostly continuous.
const NEIGHBOUR_SIGMAS: f64 = 5.0;
const NEIGHBOUR_SHARE: f64 = 0.1;
/// Least agreeing share of the neighbours. On tiles, false partners one or two tiles away scatter and lose this vote.
const AGREEING_SHARE_MIN: f64 = 0.4;
/// Two cameras of one instant see nearly the same patch: fewer bits may differ than over time.
const STEREO_DISTANCE_SHARE: f64 = 0.75;

impl Growth<'_> {
    /// Adds a keyframe with its sightings, and new landmarks; gives the number of new landmarks.
    pub fn add_keyframe(
        &self,
        map: &mut Map,
        (t_s, state): (f64, Moving),
        inliers: &[LandmarkMatch],
        pending: &mut PendingKeypoints,
        work: &mut TrackerWork,
    ) -> u32 {
        let keyframe = map.add_keyframe(t_s, state);
        let mut claimed: Vec<Vec<bool>> = self.views.iter().map(|view| vec![false; view.keypoints.len()]).collect();
        for found in inliers {
            let keypoint = &self.views[index(found.camera.0)].keypoints[found.keypoint];
            let landmark = &mut map.landmarks[found.landmark];
            landmark.sightings.push(Sighting::of((keyframe, found.camera), keypoint, self.params));
            landmark.remember(keypoint.descriptor);
            claimed[index(found.camera.0)][found.keypoint] = true;
        }
        let before = map.landmarks.len();
        self.add_stereo_points(map, (keyframe, &state), &mut claimed, work);
        for earlier in pending.keyframes.iter_mut().rev() {
            self.add_motion_points(map, (keyframe, &state), &mut claimed, earlier, work);
        }
        let free = |(view, claimed): (&CameraKeypoints, &Vec<bool>)| -> Vec<Keypoint> {
            let free = view.keypoints.iter().zip(claimed).filter(|(_, claimed)| !**claimed);
            free.map(|(keypoint, _)| *keypoint).collect()
        };
        let keypoints = self.views.iter().zip(&claimed).map(free).collect();
        pending.push(keyframe, keypoints);
        u32_from(map.landmarks.len() - before)
    }

    /// Points that two cameras of this frame see, for every pair of cameras.
    fn add_stereo_points(
        &self,
        map: &mut Map,
        (keyframe, state): (u32, &Moving),
        claimed: &mut [Vec<bool>],
        work: &mut TrackerWork,
    ) {
        for a in 0..self.views.len() {
            for b in a + 1..self.views.len() {
                let b_from_a = self.cameras[b].camera_from_body.then(&self.cameras[a].calibration.body_from_camera);
                let band = self.band(a);
                let (first, second) = (&self.views[a].keypoints, &self.views[b].keypoints);
                let distance_max = u32_truncated(STEREO_DISTANCE_SHARE * f64::from(self.params.distance_bits_max));
                let rule = MatchRule { distance_max, ratio_max: 0.8 };
                let pairs = matches(
                    (first, &claimed[a]),
                    (second, &claimed[b]),
                    &b_from_a,
                    (band, rule),
                    &mut work.descriptors_compared,
                );
                let parallax_rad_min = PARALLAX_SIGMAS_MIN * self.params.position_sigma_px / self.cameras[a].focal_px;
                let fix = |(i, j): (usize, usize)| {
                    let rays =
                        [Ray::new(&self.cameras[a], state, &first[i]), Ray::new(&self.cameras[b], state, &second[j])];
                    self.accepted(&rays, parallax_rad_min).map(|fix| (i, j, fix))
                };
                let fixes: Vec<(usize, usize, Fix)> = pairs.into_iter().filter_map(fix).collect();
                for &(i, j, fix) in &fixes {
                    if !self.neighbours_agree(a, (i, &fix), &fixes) {
                        continue;
                    }
                    let sightings = [(a, &first[i]), (b, &second[j])].map(|(camera, keypoint)| {
                        Sighting::of((keyframe, CameraIndex(u32_from(camera))), keypoint, self.params)
                    });
                    let sightings = sightings.to_vec();
                    map.add_landmark(fix.point_m, first[i].descriptor, sightings, self.frame);
                    (claimed[a][i], claimed[b][j]) = (true, true);
                }
            }
        }
    }

    /// Whether enough of the pairs around a pair have its depth. A pair without neighbours stands.
    fn neighbours_agree(&self, camera: usize, (own, fix): (usize, &Fix), fixes: &[(usize, usize, Fix)]) -> bool {
        let keypoints = &self.views[camera].keypoints;
        let noise_rad = NEIGHBOUR_SIGMAS * self.params.position_sigma_px / self.cameras[camera].focal_px;
        let (mut neighbours, mut agreeing) = (0, 0);
        for (other, _, near) in fixes.iter().filter(|(other, _, _)| *other != own) {
            let apart_px2 = (keypoints[*other].position_px - keypoints[own].position_px).length_squared();
            if apart_px2 <= NEIGHBOUR_PX * NEIGHBOUR_PX {
                neighbours += 1;
                let difference_rad = (near.parallax_rad - fix.parallax_rad).abs();
                agreeing += u32::from(difference_rad <= noise_rad + NEIGHBOUR_SHARE * near.parallax_rad);
            }
        }
        f64::from(agreeing) >= AGREEING_SHARE_MIN * f64::from(neighbours)
    }

    /// Points that one camera sees now and saw at an earlier keyframe.
    fn add_motion_points(
        &self,
        map: &mut Map,
        (keyframe, state): (u32, &Moving),
        claimed: &mut [Vec<bool>],
        earlier: &mut Unclaimed,
        work: &mut TrackerWork,
    ) {
        let Ok(held) = map.keyframes.binary_search_by_key(&earlier.keyframe, |keyframe| keyframe.id) else { return };
        let earlier_state = map.keyframes[held].state;
        for (camera, claimed) in claimed.iter_mut().enumerate() {
            let rig = &self.cameras[camera];
            let now_from_earlier = rig
                .camera_from_body
                .then(&state.body_from_world.then(&earlier_state.body_from_world.inverse()))
                .then(&rig.calibration.body_from_camera);
            let (first, second) = (&earlier.keypoints[camera], &self.views[camera].keypoints);
            let rule = MatchRule { distance_max: self.params.distance_bits_max, ratio_max: 0.8 };
            let free = vec![false; first.len()];
            let band = self.band(camera);
            let pairs = matches(
                (first, &free),
                (second, claimed),
                &now_from_earlier,
                (band, rule),
                &mut work.descriptors_compared,
            );
            let camera_index = CameraIndex(u32_from(camera));
            let mut taken = free;
            for (i, j) in pairs {
                let (number, first, second) = (i, &first[i], &second[j]);
                let rays = [Ray::new(rig, &earlier_state, first), Ray::new(rig, state, second)];
                let Some(Fix { point_m, .. }) = self.accepted(&rays, PARALLAX_RAD_MIN) else { continue };
                let sightings = [(earlier.keyframe, first), (keyframe, second)]
                    .map(|(keyframe, keypoint)| Sighting::of((keyframe, camera_index), keypoint, self.params));
                map.add_landmark(point_m, second.descriptor, sightings.to_vec(), self.frame);
                (claimed[j], taken[number]) = (true, true);
            }
            let mut taken = taken.iter();
            earlier.keypoints[camera].retain(|_| taken.next() == Some(&false));
        }
    }

    fn band(&self, camera: usize) -> Band {
        let noise_rad = BAND_SIGMAS * self.params.position_sigma_px / self.cameras[camera].focal_px;
        Band { off_plane_rad_max: noise_rad, range_m_min: self.params.range_m_min, beyond_rad_max: noise_rad }
    }

    fn accepted(&self, rays: &[Ray<'_>; 2], parallax_rad_min: f64) -> Option<Fix> {
        let fix = triangulate(rays)?;
        let sigma2 = self.params.position_sigma_px * self.params.position_sigma_px;
        (fix.miss2_px2 <= NEW_POINT_SIGMAS2 * sigma2 && fix.parallax_rad >= parallax_rad_min).then_some(fix)
    }
}

/// Puts two views into an empty map, as two keyframes.
pub fn begin(
    map: &mut Map,
    (begun, t_s, frame): (&Begun, f64, u64),
    params: &TrackerParams,
    pending: &mut PendingKeypoints,
) {
    let camera = CameraIndex(u32_from(begun.camera));
    let first = map.add_keyframe(begun.first_t_s, begun.first);
    let second = map.add_keyframe(t_s, begun.second);
    let sides = [(first, &begun.first_views), (second, &begun.second_views)];
    for &(i, j, point_m) in &begun.points {
        let sighting = |(keyframe, views): (u32, &Vec<CameraKeypoints>), keypoint: usize| {
            Sighting::of((keyframe, camera), &views[begun.camera].keypoints[keypoint], params)
        };
        let descriptor = begun.second_views[begun.camera].keypoints[j].descriptor;
        map.add_landmark(point_m, descriptor, vec![sighting(sides[0], i), sighting(sides[1], j)], frame);
    }
    for (keyframe, views) in sides {
        let is_used =
            |keypoint: usize| begun.points.iter().any(|p| (if keyframe == first { p.0 } else { p.1 }) == keypoint);
        let of_view = |(number, view): (usize, &CameraKeypoints)| -> Vec<Keypoint> {
            let free = |(keypoint, _): &(usize, &Keypoint)| number != begun.camera || !is_used(*keypoint);
            view.keypoints.iter().enumerate().filter(free).map(|(_, keypoint)| *keypoint).collect()
        };
        pending.push(keyframe, views.iter().enumerate().map(of_view).collect());
    }
}

/// Lets the rows of the first two keyframes say how the body moved, held by what the start knows of it.
pub fn refine_rates(map: &mut Map, cameras: &[RigCamera], begun: &Begun) {
    for (keyframe, mean) in [begun.first.rate, begun.second.rate].into_iter().enumerate() {
        let held = map.keyframes[keyframe];
        let measured = |landmark: &Landmark| {
            let of = |s: &Sighting| PointMeasurement {
                camera: s.camera,
                point_in_world_m: landmark.position_m,
                position_px: s.position_px,
                inverse_sigma: s.inverse_sigma,
                offset_s: s.offset_s,
            };
            landmark.sightings.iter().filter(|s| s.keyframe == held.id).map(of).collect::<Vec<_>>()
        };
        let measurements: Vec<PointMeasurement> = map.landmarks.iter().flat_map(measured).collect();
        let prior = RatePrior::step(mean);
        let (state, _) = refine(cameras, &measurements, &held.state, Some(&prior), 12);
        map.keyframes[keyframe].state.rate = state.rate;
    }
}

/// Adjusts the last keyframes with their landmarks, under what an IMU says of them, and culls. Gives the state of the last
/// keyframe.
pub fn adjust_window(
    map: &mut Map,
    (cameras, params): (&[RigCamera], &TrackerParams),
    imu_filter: Option<&ImuFilter>,
    work: &mut TrackerWork,
) -> Option<Moving> {
    let free = index(params.window);
    let mut window = map.window(cameras, free, 2 * free);
    let prior = imu_filter.and_then(|imu_filter| imu_filter.chain(&window.nodes(map)));
    let outcome = if cameras.len() == 1 && prior.is_none() {
        solve_in_unit(&mut window.problem, params.adjust_iterations)
    } else {
        window.problem.solve_tailed(prior.as_ref(), WITHIN_PIXEL_PX, params.adjust_iterations)
    };
    work.adjust_iterations += outcome.iterations;
    work.adjusted_observations += crate::num::u64_from(window.problem.observations.len());
    map.put_back(&window);
    map.cull(free, index(params.keyframes_max), index(params.landmarks_max));
    map.keyframes.last().map(|keyframe| keyframe.state)
}
