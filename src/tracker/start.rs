//! Starts a mono map from two pictures of a moving body. Takes one frame after the other until the motion between two of them is
//! verified.
//!
//! Each frame is compared with a first one: pairs by descriptors alone, the motion by [`two_view`]. One camera gives no metric
//! scale: the map's unit is such that the median depth of the first points is `MONO_DEPTH_M` of the proof. With several cameras that do
//! not overlap, the rotation of their lever arms gives the scale: each pair of another camera must satisfy the epipolar
//! constraint of the whole rig's motion, an equation linear in the scale (Pless, "Using many cameras as one", CVPR 2003).

use glam::{DQuat, DVec3};

use super::answer::TrackerWork;
use super::params::TrackerParams;
use crate::draw::DrawKey;
use crate::num::{greater, lesser, u64_from};
use crate::pose::Pose;
use crate::so3;
use crate::tracker::initial::{BearingPair, Refusal, TwoViewSettings, turn, two_view};
use crate::tracker::lie::Twist;
use crate::tracker::matching::{Best, MatchRule, mutual};
use crate::tracker::proof::{self, Hypothesis, PathView};
use crate::tracker::rig::{CameraKeypoints, Keypoint, RigCamera};
use crate::tracker::row_motion::{AT_REST, Moving, mean_rate};
use crate::tracker::tracks::{Tracks, median_step_px};

/// Least median angle between the rays of the first points: half a pixel of 320 px leaves 5 % of a depth at 0.04.
const PARALLAX_RAD_MIN: f64 = 0.04;
/// Pairs that the opening picture must keep, as a multiple of the landmarks that a start needs.
const PAIRS_FACTOR: usize = 2;
/// A start needs a point from at least one in this many pairs.
const POINTS_SHARE: usize = 2;
/// The rig's scale must be known to this share.
const SCALE_SIGMA_MAX: f64 = 0.05;
/// Until the body is known to move, a turn between neighbouring frames explains its pairs to this many sigmas only.
const TURN_SIGMAS: f64 = 4.0;

/// A view between the two is kept where the corners have moved this far since the last one, up to this many.
const BETWEEN_STEP_PX: f64 = 4.0;
const BETWEEN_MAX: usize = 12;

/// A frame as the start needs it.
#[derive(Clone, Debug)]
struct InitialFrame {
    frame: u64,
    t_s: f64,
    views: Vec<CameraKeypoints>,
    /// The body's rate of rotation, with a rolling shutter.
    rate: Option<Twist>,
}

/// What the frames so far leave for a start.
#[derive(Clone, Debug, Default)]
pub struct MonoInitialiser {
    first: Option<InitialFrame>,
    last: Option<InitialFrame>,
    /// One camera's corners of the opening frame.
    tracks: Tracks,
    /// Views between, each with what it shows of them.
    between: Vec<(InitialFrame, Vec<(usize, usize)>)>,
}

/// Two views that a map can start from.
#[derive(Clone, Debug)]
pub struct Begun {
    /// Time of the opening frame in seconds.
    pub first_t_s: f64,
    /// Its views, keypoints straightened.
    pub first_views: Vec<CameraKeypoints>,
    /// How the body moved when the opening frame was taken; the world is its frame.
    pub first: Moving,
    /// The same of this frame.
    pub second: Moving,
    /// Views of this frame, keypoints straightened.
    pub second_views: Vec<CameraKeypoints>,
    /// Camera that gave the points.
    pub camera: usize,
    /// Keypoint in the opening view, keypoint in this one, point in the world in metres.
    pub points: Vec<(usize, usize, DVec3)>,
    /// Noise of positions that the views between have shown, in units of the assumed one; `None` where two views are all there is.
    pub noise_sigmas: Option<f64>,
}

/// The surroundings of a start.
pub struct Initialisation<'a> {
    pub cameras: &'a [RigCamera],
    pub params: &'a TrackerParams,
    pub frame: u64,
    pub key: DrawKey,
}

impl MonoInitialiser {
    /// Takes a frame; gives two views where a map can start from them.
    pub fn take(
        &mut self,
        stage: &Initialisation<'_>,
        (t_s, views): (f64, &[CameraKeypoints]),
        work: &mut TrackerWork,
    ) -> Option<Begun> {
        let mut shot = InitialFrame { frame: stage.frame, t_s, views: views.to_vec(), rate: None };
        let sweeps = views.iter().any(CameraKeypoints::sweeps);
        let alone = views.len() == 1;
        if let Some(last) = self.last.as_ref().filter(|_| sweeps || alone) {
            let turning = stage.turn_rate(last, &shot, work);
            if alone {
                self.tracks.follow(
                    (&stage.cameras[0], &views[0], stage.turn(turning, t_s - last.t_s)),
                    stage.params,
                    work,
                );
            }
            shot.rate = turning.filter(|_| sweeps);
            let opens = |first: &&mut InitialFrame| first.frame == last.frame && first.rate.is_none();
            if let Some(first) = self.first.as_mut().filter(opens) {
                first.rate = shot.rate;
            }
        }
        let begun = match self.first.as_ref().filter(|first| first.t_s < t_s) {
            Some(first) if alone => stage.hold_alone(first, &shot, (&self.tracks, &self.between), work),
            Some(first) => stage.hold(first, &shot, work),
            None => Err(()),
        };
        if begun.is_err() {
            self.first = Some(shot.clone());
            self.between.clear();
            self.tracks = if alone { Tracks::of(&shot.views[0]) } else { Tracks::default() };
        } else if alone {
            self.keep_between(&shot);
        }
        self.last = (sweeps || alone).then_some(shot);
        begun.ok().flatten()
    }

    /// Keeps a view in which the corners have moved on; of too many every other.
    fn keep_between(&mut self, shot: &InitialFrame) {
        let pairs = self.tracks.pairs();
        let step_px = self.between.last().map_or(Some(f64::INFINITY), |(before, held)| {
            median_step_px((&before.views[0], held), (&shot.views[0], &pairs))
        });
        if step_px.is_none_or(|step_px| step_px >= BETWEEN_STEP_PX) {
            self.between.push((shot.clone(), pairs));
            proof::thin(&mut self.between, BETWEEN_MAX);
        }
    }

    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

/// A start from two frames and the motion between them, with the points that a camera saw in both.
fn begun(
    (first, first_views): (&InitialFrame, Vec<CameraKeypoints>),
    (second, second_views): (&InitialFrame, Vec<CameraKeypoints>),
    second_from_first: Pose,
    (camera, points): (usize, Vec<(usize, usize, DVec3)>),
) -> Begun {
    let mean = mean_rate(&Pose::IDENTITY, &second_from_first, second.t_s - first.t_s);
    let moving = |body_from_world: Pose, shot: &InitialFrame| Moving {
        body_from_world,
        rate: shot.rate.map_or(AT_REST, |rate| Twist { linear_m: mean.linear_m, ..rate }),
    };
    Begun {
        first_t_s: first.t_s,
        first: moving(Pose::IDENTITY, first),
        second: moving(second_from_first, second),
        first_views,
        second_views,
        camera,
        points,
        noise_sigmas: None,
    }
}

impl Initialisation<'_> {
    /// One camera's frame against the opening one and those between.
    fn hold_alone(
        &self,
        first: &InitialFrame,
        second: &InitialFrame,
        (tracks, between): (&Tracks, &[(InitialFrame, Vec<(usize, usize)>)]),
        work: &mut TrackerWork,
    ) -> Result<Option<Begun>, ()> {
        let least = crate::num::index(self.params.start_landmarks_min);
        let numbers = tracks.pairs();
        if numbers.len() < PAIRS_FACTOR * least {
            return Err(());
        }
        let (first_views, second_views) = (self.straightened(first), self.straightened(second));
        let pair = |&(i, j): &(usize, usize)| BearingPair {
            first: first_views[0].keypoints[i].bearing_at_frame_time,
            second: second_views[0].keypoints[j].bearing_at_frame_time,
        };
        let own: Vec<BearingPair> = numbers.iter().map(pair).collect();
        let search = self.search(0, 1.0);
        let Some(found) = two_view(&own, &search, self.key) else { return Ok(None) };
        let checked = found.check(least.max(own.len() / POINTS_SHARE), PARALLAX_RAD_MIN);
        if checked.is_err_and(|why| why != Refusal::TwoMotions) {
            return Ok(None);
        }
        let views: Vec<PathView<'_>> = std::iter::once(path_view(first, &first_views, &[]))
            .chain(between.iter().map(|(shot, pairs)| path_view(shot, &shot.views, pairs)))
            .chain([path_view(second, &second_views, &numbers)])
            .collect();
        let hypothesis = Hypothesis { cameras: self.cameras, params: self.params, views: &views, search };
        let Some(path) = hypothesis.prove(&found, self.key.with(4), work) else { return Ok(None) };
        if path.points_m.len() < least {
            return Ok(None);
        }
        let second_from_first = path.poses[path.poses.len() - 1];
        let keypoint_of =
            |track: usize| numbers.binary_search_by_key(&track, |pair| pair.0).ok().map(|at| numbers[at].1);
        let paired = |&(track, point_m): &(usize, DVec3)| keypoint_of(track).map(|j| (track, j, point_m));
        let points = path.points_m.iter().filter_map(paired).collect();
        let begun = begun((first, first_views), (second, second_views), second_from_first, (0, points));
        Ok(Some(Begun { noise_sigmas: Some(path.noise_sigmas), ..begun }))
    }

    /// The camera's turn over a time, at a rate of the body's.
    fn turn(&self, turning: Option<Twist>, span_s: f64) -> DQuat {
        let axis_rad = turning.map_or(DVec3::ZERO, |rate| rate.angular_rad * span_s);
        so3::exp(self.cameras[0].camera_from_body.direction(axis_rad))
    }

    /// Two frames against each other: a start, none yet, or an opening that has too little in common with the present.
    fn hold(&self, first: &InitialFrame, second: &InitialFrame, work: &mut TrackerWork) -> Result<Option<Begun>, ()> {
        let (first_views, second_views) = (self.straightened(first), self.straightened(second));
        let views = first_views.iter().zip(&second_views);
        let numbers: Vec<Vec<(usize, usize)>> =
            views.map(|(a, b)| self.look_alikes(&a.keypoints, &b.keypoints, work)).collect();
        let best = (0..numbers.len()).fold(0, |best, k| if numbers[k].len() > numbers[best].len() { k } else { best });
        let least = crate::num::index(self.params.start_landmarks_min);
        if numbers[best].len() < PAIRS_FACTOR * least {
            return Err(());
        }
        let pairs = |camera: usize| -> Vec<BearingPair> {
            let (a, b) = (&first_views[camera].keypoints, &second_views[camera].keypoints);
            numbers[camera]
                .iter()
                .map(|&(i, j)| BearingPair { first: a[i].bearing_at_frame_time, second: b[j].bearing_at_frame_time })
                .collect()
        };
        let own = pairs(best);
        let Some(found) = two_view(&own, &self.search(best, 1.0), self.key) else { return Ok(None) };
        if found.check(least.max(own.len() / POINTS_SHARE), PARALLAX_RAD_MIN).is_err() {
            return Ok(None);
        }
        let others: Vec<(usize, Vec<BearingPair>)> =
            (0..numbers.len()).filter(|&camera| camera != best).map(|camera| (camera, pairs(camera))).collect();
        let Some(scale) = self.rig_scale(best, &found.second_from_first, &others) else { return Ok(None) };
        let mounting = self.cameras[best].calibration.body_from_camera;
        let moved = Pose { translation_m: found.second_from_first.translation_m * scale, ..found.second_from_first };
        let second_from_first = mounting.then(&moved).then(&mounting.inverse());
        let placed = |(&(i, j), point): (&(usize, usize), &Option<DVec3>)| {
            point.map(|point_m| (i, j, mounting.point(point_m * scale)))
        };
        let points = numbers[best].iter().zip(&found.points).filter_map(placed).collect();
        Ok(Some(begun((first, first_views), (second, second_views), second_from_first, (best, points))))
    }

    fn search(&self, camera: usize, widening: f64) -> TwoViewSettings {
        let sigma_rad = widening * self.params.position_sigma_px / self.cameras[camera].focal_px;
        TwoViewSettings { sigma_rad, samples_max: self.params.samples_max, confidence: 0.999 }
    }

    /// A shot's views with their keypoints at the frame's time.
    fn straightened(&self, shot: &InitialFrame) -> Vec<CameraKeypoints> {
        let mut views = shot.views.clone();
        if let Some(rate) = shot.rate {
            let state = Moving { body_from_world: Pose::IDENTITY, rate };
            views.iter_mut().zip(self.cameras).for_each(|(view, camera)| view.straighten(camera, &state));
        }
        views
    }

    /// How fast the body turns between neighbouring frames, by the camera that has most to say.
    fn turn_rate(&self, before: &InitialFrame, now: &InitialFrame, work: &mut TrackerWork) -> Option<Twist> {
        let mut most: Option<(usize, Vec<BearingPair>)> = None;
        for (camera, (a, b)) in before.views.iter().zip(&now.views).enumerate() {
            let numbers = self.look_alikes(&a.keypoints, &b.keypoints, work);
            let pair = |&(i, j): &(usize, usize)| BearingPair {
                first: a.keypoints[i].bearing,
                second: b.keypoints[j].bearing,
            };
            if most.as_ref().is_none_or(|(_, held)| numbers.len() > held.len()) {
                most = Some((camera, numbers.iter().map(pair).collect()));
            }
        }
        let (camera, pairs) = most?;
        let now_from_before = turn(&pairs, &self.search(camera, TURN_SIGMAS), self.key.with(3))?;
        let axis_rad = self.cameras[camera].calibration.body_from_camera.direction(so3::log(now_from_before));
        Some(Twist { linear_m: DVec3::ZERO, angular_rad: axis_rad / (now.t_s - before.t_s) })
    }

    /// Keypoints that resemble each other most, and clearly more than any third.
    fn look_alikes(&self, first: &[Keypoint], second: &[Keypoint], work: &mut TrackerWork) -> Vec<(usize, usize)> {
        let rule = MatchRule { distance_max: self.params.distance_bits_max, ratio_max: 0.8 };
        let (mut forward, mut backward) = (vec![Best::NONE; first.len()], vec![Best::NONE; second.len()]);
        for (i, a) in first.iter().enumerate() {
            for (j, b) in second.iter().enumerate() {
                let distance = a.descriptor.distance(&b.descriptor);
                forward[i].offer(j, distance);
                backward[j].offer(i, distance);
            }
        }
        work.descriptors_compared += u64_from(first.len() * second.len());
        mutual(&forward, &backward, rule)
    }

    /// Length in metres of one camera's unit baseline, from the other cameras' pairs; `None` if they do not determine it.
    fn rig_scale(&self, reference: usize, motion: &Pose, others: &[(usize, Vec<BearingPair>)]) -> Option<f64> {
        let of = |camera: usize| self.cameras[camera].calibration.body_from_camera;
        let turn = (of(reference).rotation * motion.rotation * of(reference).rotation.conjugate()).normalize();
        let mut lines: Vec<ScaleLine> = Vec::new();
        for (camera, pairs) in others {
            let own = of(*camera);
            let to_camera = |v: DVec3| own.rotation.conjugate() * v;
            let arm_m = of(reference).translation_m - own.translation_m;
            let by_scale = to_camera(of(reference).direction(motion.translation_m));
            let rest_m = to_camera(arm_m - turn * arm_m);
            let sigma_rad = self.search(*camera, 1.0).sigma_rad;
            lines.extend(pairs.iter().map(|pair| {
                let turned = to_camera(turn * own.direction(pair.first));
                let plane = turned.cross(pair.second);
                ScaleLine { slope: by_scale.dot(plane), rest_m: rest_m.dot(plane), by_scale, held_m: rest_m, sigma_rad }
            }));
        }
        common_root(&lines, crate::num::index(self.params.start_landmarks_min))
    }
}

/// A pair's distance from its epipolar plane, `scale * slope + rest_m`, for a translation of `scale * by_scale + held_m`.
#[derive(Clone, Copy, Debug)]
struct ScaleLine {
    slope: f64,
    rest_m: f64,
    by_scale: DVec3,
    held_m: DVec3,
    sigma_rad: f64,
}

impl ScaleLine {
    /// Noise of the distance at a scale.
    fn sigma_m(&self, scale: f64) -> f64 {
        greater((self.by_scale * scale + self.held_m).length(), 1e-9) * self.sigma_rad * std::f64::consts::SQRT_2
    }
}

/// The scale that most lines agree on, refined; `None` where few agree, or where they agree on too wide a range.
fn common_root(lines: &[ScaleLine], agreeing_min: usize) -> Option<f64> {
    const GATE_SIGMAS2: f64 = 9.0;
    let error2 = |line: &ScaleLine, scale: f64| {
        let error = (scale * line.slope + line.rest_m) / line.sigma_m(scale);
        error * error
    };
    let cost = |scale: f64| lines.iter().map(|line| lesser(error2(line, scale), GATE_SIGMAS2)).sum::<f64>();
    let roots = lines.iter().map(|line| -line.rest_m / line.slope).filter(|root| root.is_finite() && *root > 0.0);
    let (mut scale, _) = roots.map(|root| (root, cost(root))).reduce(|a, b| if b.1 < a.1 { b } else { a })?;
    let (mut information, mut agreeing) = (0.0, 0);
    for _ in 0..5 {
        let mut rhs = 0.0;
        (information, agreeing) = (0.0, 0);
        for line in lines.iter().filter(|line| error2(line, scale) <= GATE_SIGMAS2) {
            let weight = 1.0 / (line.sigma_m(scale) * line.sigma_m(scale));
            information += weight * line.slope * line.slope;
            rhs -= weight * line.slope * line.rest_m;
            agreeing += 1;
        }
        scale = rhs / information;
    }
    let is_known = scale > 0.0 && scale * SCALE_SIGMA_MAX * information.sqrt() >= 1.0;
    (is_known && agreeing >= agreeing_min && 2 * agreeing >= lines.len()).then_some(scale)
}

/// A view as the proof takes it, its keypoints straightened where bearings of it are asked for.
fn path_view<'a>(shot: &InitialFrame, views: &'a [CameraKeypoints], pairs: &'a [(usize, usize)]) -> PathView<'a> {
    PathView { t_s: shot.t_s, keypoints: &views[0].keypoints, rate: shot.rate, pairs }
}
