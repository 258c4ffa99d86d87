//! The host's tracker. Enters: decoded features of every camera, and calibration. Leaves: a pose a frame and a map. It never
//! sees the simulation.
//!
//! Stereo odometry with a lasting map: landmarks are searched where constant velocity predicts them, the pose is the robust
//! least-squares fit to the places where they are found, and at keyframes new landmarks come in and a window of keyframes is
//! adjusted. After loss the map is searched by descriptors alone. The world is the body's frame at the first frame.
//! Poses are metres and unit quaternions, places pixels, times seconds. Equal input gives equal bytes.

pub mod adjust;
pub mod covariance;
pub mod dense;
pub mod epipolar;
pub mod extend;
pub mod initial;
pub mod lie;
pub mod locate;
pub mod map;
pub mod marginal;
pub mod matching;
pub mod p3p;
pub mod polynomial;
pub mod pose_graph;
pub mod preintegrate;
pub mod ransac;
pub mod refine;
pub mod rig;

use glam::DVec3;

use crate::compute::Feature;
use crate::draw::DrawKey;
use crate::error::Error;
use crate::num::index;
use crate::pose::{Pose, TimedPose};
use crate::units::CameraIndex;

use extend::{Growth, Unclaimed, adjust_window};
use lie::{se3_exp, se3_log};
use locate::{Frame, Located};
use map::{Landmark, Map};
pub use rig::CameraCalibration;
use rig::{RigCamera, View};

/// The published number of the tracker's draws.
const DRAWS: u64 = 0x7472_6163_6b65_7231;

/// Knobs of the tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerParams {
    /// Keyframes that an adjustment moves, 2..=50. Time grows with it, drift falls.
    pub window: u32,
    /// Seed of the searches after loss.
    pub seed: u64,
    /// Standard deviation of a full-size corner's place, per axis, in pixels; > 0.
    pub place_sigma_px: f64,
    /// Radius around a predicted place within which a landmark is searched first, in pixels; > 0.
    pub search_radius_px: f64,
    /// The same where the first search fails; at least the first.
    pub search_radius_wide_px: f64,
    /// Greatest descriptor distance of a match in bits, 1..=127. Unrelated descriptors differ in 128.
    pub distance_bits_max: u32,
    /// Found landmarks that a pose must have, at least 6.
    pub inliers_min: u32,
    /// Landmarks that the first frame must give, at least 6.
    pub start_landmarks_min: u32,
    /// Nearest distance of a landmark when it is made, in metres; > 0.
    pub range_m_min: f64,
    /// Frames from keyframe to keyframe at most; at least 1.
    pub keyframe_frames_max: u32,
    /// Distance that makes a new keyframe, in metres; > 0.
    pub keyframe_distance_m: f64,
    /// Rotation that makes a new keyframe, in radians; > 0.
    pub keyframe_angle_rad: f64,
    /// Share of the last keyframe's landmarks below which a new keyframe is made, 0..1.
    pub keyframe_share_min: f64,
    /// Steps of an adjustment; at least 1.
    pub adjust_iterations: u32,
    /// Samples of a search after loss; at least 1.
    pub samples_max: u32,
    /// Frames after which a landmark that was not seen takes no part in the first fall-back search.
    pub recent_frames: u32,
    /// Bound of the map's memory in keyframes; at least `window`.
    pub keyframes_max: u32,
    /// Bound of the map's memory in landmarks; at least 100.
    pub landmarks_max: u32,
}

impl TrackerParams {
    /// Values for a hand-held VGA rig at 30 frames a second in a room.
    pub fn room(seed: u64) -> Self {
        Self {
            window: 10,
            seed,
            place_sigma_px: 0.6,
            search_radius_px: 14.0,
            search_radius_wide_px: 40.0,
            distance_bits_max: 64,
            inliers_min: 12,
            start_landmarks_min: 25,
            range_m_min: 0.3,
            keyframe_frames_max: 12,
            keyframe_distance_m: 0.15,
            keyframe_angle_rad: 0.2,
            keyframe_share_min: 0.8,
            adjust_iterations: 4,
            samples_max: 400,
            recent_frames: 60,
            keyframes_max: 150,
            landmarks_max: 8_000,
        }
    }

    /// Weight of a place whose standard deviation is `scale` times that of a full-size corner, in 1/px.
    pub(crate) fn inverse_sigma(&self, scale: f64) -> f64 {
        1.0 / (self.place_sigma_px * scale)
    }

    fn check(&self) -> Result<(), Error> {
        let within = |key: &str, value: u32, least: u32, most: u32| {
            let reason = format!("must be {least} to {most}");
            if (least..=most).contains(&value) { Ok(()) } else { Err(Error::key(key, value, reason)) }
        };
        let positive = |key: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(Error::key(key, value, "must be a finite number above 0"))
            }
        };
        within("tracker.window", self.window, 2, 50)?;
        within("tracker.distance_bits_max", self.distance_bits_max, 1, 127)?;
        within("tracker.inliers_min", self.inliers_min, 6, 10_000)?;
        within("tracker.start_landmarks_min", self.start_landmarks_min, 6, 10_000)?;
        within("tracker.keyframe_frames_max", self.keyframe_frames_max, 1, 10_000)?;
        within("tracker.adjust_iterations", self.adjust_iterations, 1, 100)?;
        within("tracker.samples_max", self.samples_max, 1, 100_000)?;
        within("tracker.keyframes_max", self.keyframes_max, self.window, 10_000)?;
        within("tracker.landmarks_max", self.landmarks_max, 100, 1_000_000)?;
        positive("tracker.place_sigma_px", self.place_sigma_px)?;
        positive("tracker.search_radius_px", self.search_radius_px)?;
        positive("tracker.range_m_min", self.range_m_min)?;
        positive("tracker.keyframe_distance_m", self.keyframe_distance_m)?;
        positive("tracker.keyframe_angle_rad", self.keyframe_angle_rad)?;
        if !(self.search_radius_wide_px >= self.search_radius_px && self.search_radius_wide_px.is_finite()) {
            let reason = format!("must be at least tracker.search_radius_px = {}", self.search_radius_px);
            return Err(Error::key("tracker.search_radius_wide_px", self.search_radius_wide_px, reason));
        }
        if !(0.0..1.0).contains(&self.keyframe_share_min) {
            return Err(Error::key("tracker.keyframe_share_min", self.keyframe_share_min, "must be 0 to below 1"));
        }
        Ok(())
    }
}

/// What one frame brings.
#[derive(Clone, Debug)]
pub struct FrameInput {
    /// Time of the frame in seconds, rising.
    pub t_s: f64,
    /// Features of each camera, in the order of the calibrations.
    pub features: Vec<Vec<Feature>>,
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// No frame so far had enough stereo pairs to start a map.
    Waiting,
    /// The map starts here; the pose is the identity by definition.
    Initialised,
    /// The pose follows from landmarks near their predicted places.
    Tracked,
    /// The pose was found by descriptors alone.
    Relocalised,
    /// No pose is supported by enough landmarks.
    Lost,
}

impl Status {
    /// The one name of this status.
    pub fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Initialised => "initialised",
            Self::Tracked => "tracked",
            Self::Relocalised => "relocalised",
            Self::Lost => "lost",
        }
    }
}

/// A landmark that supports the frame's pose, and the feature it was found as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inlier {
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// Place in the camera's list of the frame.
    pub feature: u32,
    /// Number of the landmark (`Landmark::id`).
    pub landmark: u32,
}

/// What a frame cost, in counted operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Landmarks projected into a camera.
    pub projections: u64,
    /// Descriptor distances.
    pub descriptors_compared: u64,
    /// P3P samples.
    pub ransac_samples: u32,
    /// Steps of pose refinements.
    pub pose_iterations: u32,
    /// Steps of bundle adjustments.
    pub adjust_iterations: u32,
    /// Observations in the adjusted window.
    pub adjusted_observations: u64,
}

/// The tracker's answer to one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedFrame {
    /// Time of the frame in seconds.
    pub t_s: f64,
    /// What became of it.
    pub status: Status,
    /// Pose of the body; the world is the body's frame when the map started. `None` while waiting or lost.
    pub world_from_body: Option<Pose>,
    /// Different landmarks that support the pose.
    pub tracked_features: u32,
    /// All supporting sightings, camera by camera.
    pub inliers: Vec<Inlier>,
    /// The body's position at this frame, predicted from the frames before by constant velocity. `None` where fewer than two
    /// frames in a row were located before.
    pub predicted_position_m: Option<DVec3>,
    /// Median over the inliers of the distance in pixels between a landmark's place predicted for this frame and the place
    /// where it was found. `None` without prediction or inliers.
    pub innovation_px: Option<f64>,
    /// Whether the frame became a keyframe.
    pub keyframe: bool,
    /// What it cost.
    pub work: Work,
}

/// Where the body was last, and how it moved.
#[derive(Clone, Copy, Debug)]
struct Motion {
    t_s: f64,
    world_from_body: Pose,
    /// Motion in the body's frame over the span in seconds.
    step: Option<(Pose, f64)>,
}

impl Motion {
    /// Pose at a time by constant velocity in the body's frame; the last pose where no velocity is known.
    fn predict(&self, t_s: f64) -> Pose {
        let Some((step, span_s)) = self.step else { return self.world_from_body };
        self.world_from_body.then(&se3_exp(se3_log(&step).scaled((t_s - self.t_s) / span_s)))
    }
}

/// The last keyframe, as far as the next one depends on it.
#[derive(Clone, Copy, Debug)]
struct LastKeyframe {
    frame: u64,
    world_from_body: Pose,
    landmarks: u32,
}

/// A stereo tracker; its structure holds any number of cameras above one.
#[derive(Clone, Debug)]
pub struct Tracker {
    cameras: Vec<RigCamera>,
    params: TrackerParams,
    map: Map,
    unclaimed: Unclaimed,
    motion: Option<Motion>,
    last_keyframe: Option<LastKeyframe>,
    lost: bool,
    frame: u64,
    last_t_s: f64,
}

impl Tracker {
    /// A tracker without a map.
    ///
    /// # Errors
    /// Fewer than two cameras, two cameras at one place (no depth), or a parameter out of its range.
    pub fn new(calibrations: Vec<CameraCalibration>, params: TrackerParams) -> Result<Self, Error> {
        params.check()?;
        if calibrations.len() < 2 {
            return Err(Error::key("rig.cameras", calibrations.len(), "the tracker needs two cameras for depth"));
        }
        let baseline = calibrations[0].body_from_camera.translation_m - calibrations[1].body_from_camera.translation_m;
        if baseline.length() <= 1e-3 || !baseline.is_finite() {
            return Err(Error::key(
                "rig.baseline_mm",
                1e3 * baseline.length(),
                "too short for depth; above 1 would do",
            ));
        }
        let cameras = calibrations.into_iter().map(RigCamera::new).collect();
        Ok(Self {
            cameras,
            params,
            map: Map::default(),
            unclaimed: Unclaimed::default(),
            motion: None,
            last_keyframe: None,
            lost: false,
            frame: 0,
            last_t_s: f64::NEG_INFINITY,
        })
    }

    /// Takes one frame.
    ///
    /// # Panics
    /// Where the frame has another number of cameras than the rig, or its time does not rise.
    pub fn track(&mut self, input: &FrameInput) -> TrackedFrame {
        assert!(input.features.len() == self.cameras.len(), "a frame needs one feature list a camera");
        assert!(input.t_s > self.last_t_s, "frames come in the order of their times");
        self.last_t_s = input.t_s;
        let views: Vec<View> =
            self.cameras.iter().zip(&input.features).map(|(camera, features)| View::new(camera, features)).collect();
        let answer =
            if self.map.keyframes.is_empty() { self.start(input.t_s, &views) } else { self.follow(input.t_s, &views) };
        self.frame += 1;
        answer
    }

    /// Landmarks as they stand now, in rising order of their numbers.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.map.landmarks
    }

    /// Refined poses of the keyframes still held, in the order of time.
    pub fn keyframes(&self) -> Vec<TimedPose> {
        let timed = |keyframe: &map::Keyframe| TimedPose {
            t_s: keyframe.t_s,
            world_from_body: keyframe.body_from_world.inverse(),
        };
        self.map.keyframes.iter().map(timed).collect()
    }

    fn start(&mut self, t_s: f64, views: &[View]) -> TrackedFrame {
        let mut work = Work::default();
        let mut map = Map::default();
        let growth = Growth { cameras: &self.cameras, views, params: &self.params, frame: self.frame };
        let made = growth.add_keyframe(&mut map, (t_s, Pose::IDENTITY), &[], &mut self.unclaimed, &mut work);
        let mut answer = unlocated(t_s, Status::Waiting, work);
        if made < self.params.start_landmarks_min {
            return answer;
        }
        self.map = map;
        self.motion = Some(Motion { t_s, world_from_body: Pose::IDENTITY, step: None });
        self.last_keyframe = Some(LastKeyframe { frame: self.frame, world_from_body: Pose::IDENTITY, landmarks: made });
        answer.status = Status::Initialised;
        answer.world_from_body = Some(Pose::IDENTITY);
        answer.tracked_features = made;
        answer.keyframe = true;
        answer
    }

    fn follow(&mut self, t_s: f64, views: &[View]) -> TrackedFrame {
        let mut work = Work::default();
        let predicted = self.motion.as_ref().map(|motion| motion.predict(t_s));
        let has_velocity = self.motion.as_ref().is_some_and(|motion| motion.step.is_some());
        let predicted_position_m = predicted.filter(|_| has_velocity).map(|pose| pose.translation_m);
        let Some((located, status)) = self.locate(views, predicted.filter(|_| !self.lost), &mut work) else {
            self.lost = true;
            self.motion = None;
            return TrackedFrame { predicted_position_m, ..unlocated(t_s, Status::Lost, work) };
        };
        self.lost = false;
        let innovation_px =
            predicted.filter(|_| has_velocity).and_then(|pose| self.innovation_px(views, &located, &pose.inverse()));
        let (inliers, tracked_features) = self.account(views, &located);
        let located_pose = located.body_from_world.inverse();
        let step = self.motion.map(|last| (last.world_from_body.inverse().then(&located_pose), t_s - last.t_s));
        let keyframe = self.keyframe_is_due(&located_pose, tracked_features);
        let mut world_from_body = located_pose;
        if keyframe {
            let growth = Growth { cameras: &self.cameras, views, params: &self.params, frame: self.frame };
            let at = (t_s, located.body_from_world);
            let made = growth.add_keyframe(&mut self.map, at, &located.inliers, &mut self.unclaimed, &mut work);
            if let Some(adjusted) = adjust_window(&mut self.map, &self.cameras, &self.params, &mut work) {
                world_from_body = adjusted.inverse();
                self.unclaimed.moved_to(adjusted);
            }
            let landmarks = tracked_features + made;
            self.last_keyframe = Some(LastKeyframe { frame: self.frame, world_from_body, landmarks });
        }
        self.motion = Some(Motion { t_s, world_from_body, step });
        TrackedFrame {
            t_s,
            status,
            world_from_body: Some(world_from_body),
            tracked_features,
            inliers,
            predicted_position_m,
            innovation_px,
            keyframe,
            work,
        }
    }

    /// Around the prediction first, then by descriptors among recent landmarks, then among all.
    fn locate(&self, views: &[View], predicted: Option<Pose>, work: &mut Work) -> Option<(Located, Status)> {
        let frame = Frame { cameras: &self.cameras, views, map: &self.map, params: &self.params };
        if let Some(located) = predicted.and_then(|predicted| frame.near(&predicted.inverse(), work)) {
            return Some((located, Status::Tracked));
        }
        let key = DrawKey::root(self.params.seed).with(DRAWS).with(self.frame);
        let recently = self.frame.saturating_sub(self.params.recent_frames.into());
        let recent = (!self.lost).then(|| frame.anywhere(recently, key.with(0), work)).flatten();
        let located = recent.or_else(|| frame.anywhere(0, key.with(1), work))?;
        Some((located, Status::Relocalised))
    }

    /// Counts what was predicted and found, for culling; gives the inliers and the number of different landmarks.
    fn account(&mut self, views: &[View], located: &Located) -> (Vec<Inlier>, u32) {
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
        let inlier = |found: &locate::Found| Inlier {
            camera: found.camera,
            feature: views[index(found.camera.0)].sights[found.sight].feature,
            landmark: self.map.landmarks[found.landmark].id,
        };
        (located.inliers.iter().map(inlier).collect(), different)
    }

    fn innovation_px(&self, views: &[View], located: &Located, predicted: &Pose) -> Option<f64> {
        let distance_px = |found: &locate::Found| {
            let landmark_m = predicted.point(self.map.landmarks[found.landmark].position_m);
            let (place_px, _) = self.cameras[index(found.camera.0)].project_with_jacobian(landmark_m)?;
            let sight = &views[index(found.camera.0)].sights[found.sight];
            Some((sight.place_px - place_px).length())
        };
        let mut distances_px: Vec<f64> = located.inliers.iter().filter_map(distance_px).collect();
        distances_px.sort_by(f64::total_cmp);
        distances_px.get(distances_px.len() / 2).copied()
    }

    fn keyframe_is_due(&self, world_from_body: &Pose, tracked: u32) -> bool {
        let Some(last) = self.last_keyframe else { return true };
        let moved = last.world_from_body.inverse().then(world_from_body);
        self.frame - last.frame >= u64::from(self.params.keyframe_frames_max)
            || moved.translation_m.length() > self.params.keyframe_distance_m
            || moved.angle_rad() > self.params.keyframe_angle_rad
            || f64::from(tracked) < self.params.keyframe_share_min * f64::from(last.landmarks)
    }
}

/// An answer without a pose.
fn unlocated(t_s: f64, status: Status, work: Work) -> TrackedFrame {
    TrackedFrame {
        t_s,
        status,
        world_from_body: None,
        tracked_features: 0,
        inliers: Vec::new(),
        predicted_position_m: None,
        innovation_px: None,
        keyframe: false,
        work,
    }
}
