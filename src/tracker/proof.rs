//! Verifies a two-view motion: the views between must agree with it, and two halves of the points must give the same motion. Gives poses,
//! points and the keypoint noise, or nothing yet.
//!
//! Two views alone fit many false motions: chance agreements, the second solution of a plane, a rotation taken for a
//! translation. A path through all views is fitted to each candidate under Student's t; the cheapest counts if it costs clearly
//! less than any other. The remaining uncertainty is measured: each half of the points, with its own RANSAC samples, must give
//! the same motion. The difference of two halves has twice the standard deviation of the whole.

use glam::DVec3;

use super::answer::TrackerWork;
use super::params::TrackerParams;
use super::problem::{Observation, Problem};
use crate::draw::DrawKey;
use crate::num::{f64_from_usize, greater, index, lesser, u32_from, u64_from};
use crate::pose::Pose;
use crate::tracker::initial::models::{essential, from_essential};
use crate::tracker::initial::{BearingPair, PAIRS_MIN, TwoView, TwoViewModel, TwoViewSettings, triangulated, two_view};
use crate::tracker::lie::Twist;
use crate::tracker::locate::MEDIAN_SIGMAS2;
use crate::tracker::refine::{PointMeasurement, refine, upper_median};
use crate::tracker::rig::{Keypoint, RigCamera};
use crate::tracker::row_motion::{Moving, mean_rate};
use crate::tracker::unit::solve_in_unit;
use crate::units::CameraIndex;

/// Median depth of the first points of a map without a metre, in its unit. The tracker's lengths are those of a room, so this is one's.
const MONO_DEPTH_M: f64 = 2.0;
/// Largest difference between the two halves' baseline directions and rotations, in radians. The whole is then certain to half
/// of it, which is 5 % of a depth.
const HALVES_RAD_MAX: f64 = 0.1;
/// Squared error in sigmas above which an observation is rejected: the 99 % quantile of chi2 with 2 degrees of freedom.
const GATE_SIGMAS2: f64 = 9.21;
/// Cost difference above which the other motion is rejected: the 99.9 % quantile of chi2 with one degree of freedom.
const CLEARLY_WORSE: f64 = 10.8;
/// Steps of an adjustment.
const ITERATIONS: u32 = 15;

/// A view of the camera.
#[derive(Clone, Copy, Debug)]
pub struct PathView<'a> {
    pub t_s: f64,
    pub keypoints: &'a [Keypoint],
    /// The body's rate of rotation, with a rolling shutter.
    pub rate: Option<Twist>,
    /// Track and keypoint, in rising order of tracks.
    pub pairs: &'a [(usize, usize)],
}

/// A two-view motion to verify, and the views between.
pub struct Hypothesis<'a> {
    /// The rig's only camera.
    pub cameras: &'a [RigCamera],
    pub params: &'a TrackerParams,
    /// The opening view, those between in the order of time, the present one.
    pub views: &'a [PathView<'a>],
    pub search: TwoViewSettings,
}

/// A path through all views.
#[derive(Clone, Debug)]
pub struct VerifiedPath {
    /// `body_from_world` of each view; the first is the origin.
    pub poses: Vec<Pose>,
    /// Points of the world by track, with the tracks' numbers.
    pub points_m: Vec<(usize, DVec3)>,
    /// Keypoint noise per axis relative to the assumed one, from the median, corrected for degrees of freedom.
    pub noise_sigmas: f64,
    /// Cost of all sightings of all pairs, each with no more than the gate.
    cost: f64,
}

impl Hypothesis<'_> {
    /// The verified path; `None` if the motion is not certain.
    pub fn prove(&self, found: &TwoView, key: DrawKey, work: &mut TrackerWork) -> Option<VerifiedPath> {
        let all: Vec<usize> = self.pairs().iter().map(|pair| pair.0).collect();
        let motions = [Some(found.second_from_first), found.alternative];
        let mut paths: Vec<VerifiedPath> =
            motions.into_iter().flatten().filter_map(|motion| self.path(&all, &motion, work)).collect();
        paths.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let clear = paths.get(1).is_none_or(|other| other.cost > paths[0].cost + CLEARLY_WORSE);
        let whole = paths.into_iter().next().filter(|_| clear)?;
        let halves: Vec<Pose> =
            (0..2).filter_map(|half| self.half(&all, half, key.with(u64_from(half)), work)).collect();
        let last = *whole.poses.last()?;
        let agree = |a: &Pose, b: &Pose| {
            a.rotation.angle_between(b.rotation) <= HALVES_RAD_MAX
                && a.translation_m.angle_between(b.translation_m) <= HALVES_RAD_MAX
        };
        (halves.len() == 2 && agree(&halves[0], &halves[1]) && halves.iter().all(|half| agree(half, &last)))
            .then_some(whole)
    }

    /// Where every other pair alone has the last view.
    fn half(&self, all: &[usize], half: usize, key: DrawKey, work: &mut TrackerWork) -> Option<Pose> {
        let own: Vec<usize> = all.iter().skip(half).step_by(2).copied().collect();
        let alone =
            two_view(&self.of_tracks(&own), &self.search, key).filter(|alone| alone.model != TwoViewModel::Rotation)?;
        let motions = [Some(alone.second_from_first), alone.alternative].into_iter().flatten();
        let paths = motions.filter_map(|motion| self.path(&own, &motion, work));
        paths.reduce(|a, b| if b.cost < a.cost { b } else { a })?.poses.last().copied()
    }

    /// Tracks that the first and the last view show: track (the first view's keypoint), the last view's keypoint.
    fn pairs(&self) -> &[(usize, usize)] {
        self.views[self.views.len() - 1].pairs
    }

    fn keypoint(&self, view: usize, track: usize) -> Option<&Keypoint> {
        if view == 0 {
            return self.views[0].keypoints.get(track);
        }
        let pairs = self.views[view].pairs;
        let at = pairs.binary_search_by_key(&track, |pair| pair.0).ok()?;
        Some(&self.views[view].keypoints[pairs[at].1])
    }

    fn of_tracks(&self, tracks: &[usize]) -> Vec<BearingPair> {
        let last = self.views.len() - 1;
        let pair = |&track: &usize| {
            Some(BearingPair {
                first: self.keypoint(0, track)?.bearing_at_frame_time,
                second: self.keypoint(last, track)?.bearing_at_frame_time,
            })
        };
        tracks.iter().filter_map(pair).collect()
    }

    /// The path through all views that begins with a motion between the first and the last.
    fn path(&self, tracks: &[usize], motion: &Pose, work: &mut TrackerWork) -> Option<VerifiedPath> {
        let pairs = self.of_tracks(tracks);
        let mounting = self.cameras[0].calibration.body_from_camera;
        let gate = GATE_SIGMAS2 * self.search.sigma_rad * self.search.sigma_rad;
        let e = essential(motion);
        let point = |(&track, pair): (&usize, &BearingPair)| {
            let agrees = from_essential(&e, pair) <= gate;
            agrees.then(|| triangulated(motion, pair)).flatten().map(|point| (track, point))
        };
        let made: Vec<(usize, DVec3)> = tracks.iter().zip(&pairs).filter_map(point).collect();
        let depths: Vec<f64> = made.iter().map(|(_, point)| point.length()).collect();
        let scale = MONO_DEPTH_M / upper_median(&depths).filter(|depth| depth.is_finite() && *depth > 0.0)?;
        let mut points_m: Vec<(usize, DVec3)> =
            made.into_iter().map(|(track, point)| (track, mounting.point(point * scale))).collect();
        if points_m.len() < PAIRS_MIN {
            return None;
        }
        let moved = Pose { translation_m: motion.translation_m * scale, ..*motion };
        let last = mounting.then(&moved).then(&mounting.inverse());
        let mut poses = self.poses_between(&points_m, &last);
        for round in 0..2 {
            let mut problem = self.problem(&poses, &points_m, round > 0);
            let outcome = solve_in_unit(&mut problem, ITERATIONS);
            work.adjust_iterations += outcome.iterations;
            let views = self.views.len();
            poses = problem.poses[views - 1..].iter().chain(&problem.poses[..views - 1]).copied().collect();
            points_m.iter_mut().zip(&problem.points_m).for_each(|(held, moved)| held.1 = *moved);
        }
        self.judged(poses, points_m, tracks)
    }

    /// Poses of all views, those between by the points that they see.
    fn poses_between(&self, points_m: &[(usize, DVec3)], last: &Pose) -> Vec<Pose> {
        let (first_s, last_s) = (self.views[0].t_s, self.views[self.views.len() - 1].t_s);
        let pose = |(view, seen): (usize, &PathView<'_>)| {
            let share = (seen.t_s - first_s) / (last_s - first_s);
            let guess =
                Pose::new(glam::DQuat::IDENTITY.slerp(last.rotation, share).normalize(), last.translation_m * share);
            if view == 0 || view + 1 == self.views.len() {
                return guess;
            }
            let measurement = |&(track, point_in_world_m): &(usize, DVec3)| {
                let keypoint = self.keypoint(view, track)?;
                Some(PointMeasurement::of(CameraIndex(0), keypoint, point_in_world_m, self.params))
            };
            let measurements: Vec<PointMeasurement> = points_m.iter().filter_map(measurement).collect();
            refine(self.cameras, &measurements, &self.moving(view, guess, last), None, 20).0.body_from_world
        };
        self.views.iter().enumerate().map(pose).collect()
    }

    /// A body at a view, as far as the rows' times need it: turning as neighbouring pictures say, going on average.
    fn moving(&self, view: usize, body_from_world: Pose, last: &Pose) -> Moving {
        let span_s = self.views[self.views.len() - 1].t_s - self.views[0].t_s;
        let mean = mean_rate(&Pose::IDENTITY, last, span_s);
        let rate = self.views[view].rate.map(|rate| Twist { linear_m: mean.linear_m, ..rate });
        rate.map_or(Moving::resting(body_from_world), |rate| Moving { body_from_world, rate })
    }

    /// The adjustment of all views but the first; where it is asked for without sightings beyond the gate.
    fn problem(&self, poses: &[Pose], points_m: &[(usize, DVec3)], gated: bool) -> Problem<'_> {
        let views = self.views.len();
        let last = poses[views - 1];
        let mut observations = Vec::new();
        for (point, &(track, _)) in points_m.iter().enumerate() {
            for view in 0..views {
                let Some(keypoint) = self.keypoint(view, track) else { continue };
                let row_from_frame = self.moving(view, poses[view], &last).row_from_frame(keypoint.offset_s);
                observations.push(Observation {
                    pose: u32_from((view + views - 1) % views),
                    point: u32_from(point),
                    camera: CameraIndex(0),
                    position_px: keypoint.position_px,
                    inverse_sigma: self.params.inverse_sigma(keypoint.scale),
                    row_from_frame,
                });
            }
        }
        let turned: Vec<Pose> = poses[1..].iter().chain(&poses[..1]).copied().collect();
        let points_m = points_m.iter().map(|(_, point_m)| *point_m).collect();
        let mut problem = Problem { cameras: self.cameras, poses: turned, free: views - 1, points_m, observations };
        if gated {
            let errors2 = problem.errors2();
            let gate = GATE_SIGMAS2 * greater(upper_median(&errors2).unwrap_or(0.0) / MEDIAN_SIGMAS2, 1.0);
            let mut errors2 = errors2.iter();
            problem.observations.retain(|_| errors2.next().is_some_and(|error2| *error2 <= gate));
        }
        problem
    }

    /// Cost and noise of an adjusted path. Points that one of their views contradicts are removed.
    fn judged(&self, poses: Vec<Pose>, mut points_m: Vec<(usize, DVec3)>, tracks: &[usize]) -> Option<VerifiedPath> {
        let problem = self.problem(&poses, &points_m, false);
        let errors2 = problem.errors2();
        let median = upper_median(&errors2)?;
        let (equations, unknowns) = (2 * errors2.len(), 6 * problem.free + 3 * points_m.len());
        if equations <= unknowns {
            return None;
        }
        let freedom = f64_from_usize(equations) / f64_from_usize(equations - unknowns);
        let noise_sigmas = (median / MEDIAN_SIGMAS2 * freedom).sqrt();
        let gate = GATE_SIGMAS2 * greater(noise_sigmas * noise_sigmas, 1.0);
        let mut fits = vec![true; points_m.len()];
        for (observation, error2) in problem.observations.iter().zip(&errors2) {
            fits[index(observation.point)] &= *error2 <= gate;
        }
        let mut fit = fits.iter();
        points_m.retain(|_| fit.next().is_some_and(|fits| *fits));
        // Pairs without a point count as outliers in all their views; otherwise a path would gain by what it does not explain.
        let views = 0..self.views.len();
        let seen = |track: &usize| views.clone().filter(|&view| self.keypoint(view, *track).is_some()).count();
        let sightings: usize = tracks.iter().map(seen).sum();
        let kept: f64 = errors2.iter().map(|&error2| lesser(error2, GATE_SIGMAS2)).sum();
        let cost = kept + GATE_SIGMAS2 * f64_from_usize(sightings - errors2.len());
        Some(VerifiedPath { poses, points_m, noise_sigmas, cost })
    }
}

/// Drops every other element of a list longer than `most`.
pub fn thin<T>(list: &mut Vec<T>, most: usize) {
    if list.len() > most {
        *list = std::mem::take(list).into_iter().skip(1).step_by(2).collect();
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::tracker::lie::se3_exp;
    use crate::tracker::matching::Descriptor;

    const VIEWS: usize = 5;
    const SIGMA_PX: f64 = 0.5;

    /// A camera that moves 0.2 m and turns 0.1 rad past 100 points 2 to 4 m away; positions off by the square root of three sigma at most.
    /// Of `wrong` tracks of a hundred the last view shows something else.
    fn keypoints(camera: &RigCamera, key: DrawKey, wrong: u64) -> Vec<Vec<Keypoint>> {
        let view = |view: usize| {
            let share = f64_from_usize(view) / f64_from_usize(VIEWS - 1);
            let pose = se3_exp(Twist { linear_m: DVec3::X * 0.2, angular_rad: DVec3::Y * 0.1 }.scaled(share));
            let keypoint = |track: u64| {
                let lost = view + 1 == VIEWS && track * 7 % 100 < wrong;
                let own = key.with(track).with(u64::from(lost));
                let at = |axis: u64| 2.0 * own.with(axis).uniform() - 1.0;
                let depth_m = 3.0 + at(2);
                let point_m = DVec3::new(0.6 * depth_m * at(0), 0.5 * depth_m * at(1), depth_m);
                let off = |axis: u64| {
                    SIGMA_PX * 3_f64.sqrt() * (2.0 * own.with(9 + u64_from(view)).with(axis).uniform() - 1.0)
                };
                let position_px = camera.project_unclipped(pose.point(point_m)).expect("before the camera")
                    + DVec2::new(off(0), off(1));
                let bearing = camera.calibration.lens.unproject(position_px).expect("a pinhole");
                let (descriptor, bearing_at_frame_time) = (Descriptor::new(&[0; 32]), bearing);
                let (feature, offset_s, scale, octave) = (0, 0.0, 1.0, 0);
                Keypoint { feature, position_px, offset_s, bearing, bearing_at_frame_time, scale, octave, descriptor }
            };
            (0..100).map(keypoint).collect()
        };
        (0..VIEWS).map(view).collect()
    }

    /// What the views prove, if two of them find any motion.
    fn proved(wrong: u64, seed: u64) -> Option<VerifiedPath> {
        let cameras = [RigCamera::vga_pinhole([319.5, 239.5])];
        let key = DrawKey::root(seed);
        let all = keypoints(&cameras[0], key, wrong);
        let pairs: Vec<(usize, usize)> = (0..100).map(|track| (track, track)).collect();
        let seen = |(view, keypoints)| PathView { t_s: f64_from_usize(view), keypoints, rate: None, pairs: &pairs };
        let views: Vec<PathView<'_>> = all.iter().map(|keypoints| &keypoints[..]).enumerate().map(seen).collect();
        let params = TrackerParams::room(seed);
        let search =
            TwoViewSettings { sigma_rad: params.position_sigma_px / 320.0, samples_max: 400, confidence: 0.999 };
        let hypothesis = Hypothesis { cameras: &cameras, params: &params, views: &views, search };
        let found = two_view(&hypothesis.of_tracks(&(0..100).collect::<Vec<_>>()), &search, key)?;
        hypothesis.prove(&found, key, &mut TrackerWork::default())
    }

    #[test]
    fn several_views_prove_a_motion_and_tell_the_noise_of_positions() {
        let mut tried = 0;
        let mut noise_px = Vec::new();
        for seed in 0..30 {
            for wrong in [0, 30] {
                tried += 1;
                let Some(path) = proved(wrong, seed) else { continue };
                let last = path.poses[VIEWS - 1];
                // What the halves may differ by; the whole has half of it.
                assert!(last.translation_m.angle_between(DVec3::X) < HALVES_RAD_MAX, "seed {seed}: {last:?}");
                assert!(path.points_m.len() >= 50, "seed {seed}: {} points", path.points_m.len());
                noise_px.push(path.noise_sigmas * TrackerParams::room(0).position_sigma_px);
            }
        }
        // Residuals mix errors: between a normal law's 0.5 px and a uniform one's, whose squares have their median at
        // 2 a^2 / pi for a = 3^0.5 sigma, 0.59 px. The fit takes more of the outer views' errors than of the middle ones' (0.6 against
        // 0.2 of the variance along the motion), so the median lies below the mean: up to a tenth less of sigma is expected.
        let mean_px = noise_px.iter().sum::<f64>() / f64_from_usize(noise_px.len());
        println!("seeds 0 to 29: {} proofs of {tried}, noise {mean_px} px: {noise_px:?}", noise_px.len());
        assert!((0.45..0.6).contains(&mean_px), "{mean_px} px");
        assert!(noise_px.iter().all(|px| (px / mean_px - 1.0).abs() < 0.3), "{mean_px} px, {noise_px:?}");
        // Some four of five are proved; 40 of 60 is 2.6 standard deviations below 48.
        assert!(noise_px.len() >= 40, "{} of {tried}", noise_px.len());
    }

    #[test]
    fn pairs_that_agree_by_chance_prove_nothing() {
        let proofs = (0..12).filter(|&seed| proved(100, seed).is_some()).count();
        println!("seeds 0 to 11: {proofs} proofs");
        assert_eq!(proofs, 0);
    }
}
