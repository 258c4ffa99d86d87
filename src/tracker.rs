//! The host's tracker: visual-inertial SLAM from decoded features and calibration to a pose a frame and a map. It never sees the
//! simulation.
//!
//! Each frame: constant velocity or the IMU predicts the pose, landmarks are matched near their predicted positions, and the
//! pose is the robust least-squares fit to the matches. Each keyframe: new landmarks are triangulated and a window of keyframes
//! is adjusted. Every keypoint counts at its row's time. After loss the map is searched by descriptors alone; a revisited place
//! closes a loop. The world frame is the body's frame at the first frame. Poses are metres and unit quaternions, image
//! positions pixels, times seconds. Equal input gives equal bytes.

pub mod adjust;
mod answer;
mod close;
pub mod dense;
mod epipolar;
mod extend;
mod follow;
mod localiser;
pub mod initial;
mod initialise;
pub mod lie;
mod judge;
mod locate;
mod map;
pub mod marginal;
pub mod matching;
pub mod p3p;
mod params;
pub mod polynomial;
pub mod pose_graph;
pub mod preintegrate;
mod prior;
mod problem;
mod proof;
pub mod ransac;
pub mod refine;
pub mod rig;
mod shift;
mod start;
mod state;
pub mod row_motion;
mod tracks;
mod unit;

use glam::DVec3;

use crate::error::Error;
use crate::pose::TimedPose;

pub use answer::{FrameInput, Inlier, LossReason, Status, TrackedFrame, TrackerWork};
use close::LoopCandidate;
use extend::PendingKeypoints;
pub use map::Landmark;
use map::Map;
pub use params::TrackerParams;
pub use preintegrate::filter::{ImuCalibration, ImuFilter};
pub use preintegrate::{ImuMeasurement, Noise};
pub use rig::CameraCalibration;
use rig::{CameraKeypoints, RigCamera};
pub use row_motion::RowClock;
use start::MonoInitialiser;
use state::TrackerState;

/// The published number of the tracker's draws.
const DRAWS: u64 = 0x7472_6163_6b65_7231;

/// A tracker of any number of cameras.
#[derive(Clone, Debug)]
pub struct Tracker {
    cameras: Vec<RigCamera>,
    params: TrackerParams,
    map: Map,
    pending: PendingKeypoints,
    mono_initialiser: MonoInitialiser,
    state: TrackerState,
    /// Keypoints that supported the last pose.
    inliers_before: u32,
    frame: u64,
    loop_candidate: Option<LoopCandidate>,
    last_t_s: f64,
    imu_filter: Option<ImuFilter>,
    /// Running mean of the position sigma of recent frames.
    usual_sigma_m: f64,
    /// Consecutive frames with an uncertain position.
    weak_frames: u32,
    /// Lower bound on the keypoint noise: the configured sigma. `params` holds the current estimate.
    position_sigma_px_min: f64,
    /// Upper bound on the keypoint noise estimated from residuals.
    position_sigma_px_max: f64,
    /// From the body to the only camera, whose position stands for the body's.
    arm_m: DVec3,
}

impl Tracker {
    /// A tracker without a map. Fails on no camera, two cameras at one position (no depth), or a parameter out of its range.
    pub fn new(mut calibrations: Vec<CameraCalibration>, params: TrackerParams) -> Result<Self, Error> {
        params.check()?;
        let mut arm_m = DVec3::ZERO;
        let position_m = |camera: &CameraCalibration| camera.body_from_camera.translation_m;
        match &mut calibrations[..] {
            [] => return Err(Error::key("rig.cameras", 0, "the tracker needs a camera")),
            // A monocular map has no metric scale, so an arm from body to camera has no length in it: the camera's position
            // stands for the body's.
            [only] => arm_m = std::mem::take(&mut only.body_from_camera.translation_m),
            [first, rest @ ..] => {
                let apart_m = rest.iter().map(|other| (position_m(first) - position_m(other)).length());
                let baseline_m = apart_m.fold(0.0, crate::num::greater);
                if !(baseline_m > 1e-3 && baseline_m.is_finite()) {
                    let reason = "too short for depth; use more than 1";
                    return Err(Error::key("rig.baseline_mm", 1e3 * baseline_m, reason));
                }
            }
        }
        let cameras = calibrations.into_iter().map(RigCamera::new).collect();
        Ok(Self {
            cameras,
            params,
            map: Map::default(),
            pending: PendingKeypoints::new(1),
            mono_initialiser: MonoInitialiser::default(),
            state: TrackerState::Waiting,
            inliers_before: 0,
            frame: 0,
            loop_candidate: None,
            last_t_s: f64::NEG_INFINITY,
            imu_filter: None,
            arm_m,
            usual_sigma_m: 0.0,
            weak_frames: 0,
            position_sigma_px_min: params.position_sigma_px,
            position_sigma_px_max: params::UNPROVEN_NOISE * params.position_sigma_px,
        })
    }

    /// Gives the rig an IMU.
    #[must_use]
    pub fn with_imu(mut self, mut calibration: ImuCalibration) -> Self {
        calibration.body_from_imu.translation_m -= self.arm_m;
        self.imu_filter = Some(ImuFilter::new(calibration, self.cameras.len() > 1));
        self
    }

    /// Adds IMU readings in ascending time, up to the first one after the next frame. Ignored without an IMU.
    pub fn add_imu_readings(&mut self, readings: &[ImuMeasurement]) {
        if let Some(imu_filter) = &mut self.imu_filter {
            imu_filter.add_imu_readings(readings);
        }
    }

    /// Takes one frame.
    ///
    /// # Panics
    /// Where the frame has another number of cameras than the rig, or its time does not rise.
    pub fn track(&mut self, input: &FrameInput) -> TrackedFrame {
        assert!(input.features.len() == self.cameras.len(), "a frame needs one feature list a camera");
        assert!(
            input.clocks.is_empty() || input.clocks.len() == self.cameras.len(),
            "rows have one clock per camera, or none"
        );
        assert!(input.t_s > self.last_t_s, "frames come in the order of their times");
        self.last_t_s = input.t_s;
        let clock = |camera: usize| {
            if self.params.rolling_shutter {
                input.clocks.get(camera).copied().unwrap_or_default()
            } else {
                RowClock::GLOBAL
            }
        };
        let view = |(number, camera): (usize, &RigCamera)| {
            CameraKeypoints::new(camera, &input.features[number], clock(number))
        };
        let views: Vec<CameraKeypoints> = self.cameras.iter().enumerate().map(view).collect();
        let frame = (input.t_s, &views[..]);
        let (state, answer) = match self.state {
            TrackerState::Waiting => self.initialise(frame),
            TrackerState::Tracking { history, motion } => self.follow(frame, history, Some(motion)),
            TrackerState::Lost { history } => self.follow(frame, history, None),
        };
        self.state = state;
        self.frame += 1;
        answer
    }

    /// Current estimate of the keypoint noise at octave 0, in pixels; at least the configured sigma.
    pub fn position_sigma_px(&self) -> f64 {
        self.params.position_sigma_px
    }

    /// Landmarks as they stand now, in rising order of their numbers.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.map.landmarks
    }

    /// Refined poses of the keyframes still held, in the order of time.
    pub fn keyframes(&self) -> Vec<TimedPose> {
        let timed = |keyframe: &map::Keyframe| TimedPose {
            t_s: keyframe.t_s,
            world_from_body: keyframe.state.body_from_world.inverse(),
        };
        self.map.keyframes.iter().map(timed).collect()
    }

    /// The IMU filter; `None` without an IMU.
    pub fn imu_filter(&self) -> Option<&ImuFilter> {
        self.imu_filter.as_ref()
    }
}
