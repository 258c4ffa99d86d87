//! The motion of the rig, from timed poses (motion capture), control poses, a generator, or one pose. Computes the body's pose with its
//! derivatives at any instant of a run, and what an IMU on it measures. The room has y up; all times are seconds.

pub mod band;
pub mod fit;
pub mod gait;
pub mod imu;
mod limits;
pub mod path;
pub mod recording;
pub mod spline;

use glam::{DQuat, DVec3};

pub use fit::{gaps_within, without_gaps};
pub use spline::{BodyState, Spline};

use crate::pose::{Pose, TimedPose};
use crate::units::Span;
pub use limits::{GAP_S_MAX, MotionError, TURN_DEG_MAX};

/// Knot spacing for motion capture of heads and hands: six samples of 120 Hz a knot, and a band of 10 Hz that holds what a
/// neck or wrist can do.
pub const KNOT_S: f64 = 0.05;

/// Turns motion capture with z up into a room with y up: (x, y, z) -> (x, z, -y), a quarter turn about -x.
pub const Y_UP_FROM_Z_UP: DQuat =
    DQuat::from_xyzw(-core::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, core::f64::consts::FRAC_1_SQRT_2);

/// A spline laid into the room: `p = offset + scale * world_from_motion * (p_motion - p_motion(start))`; orientations are
/// turned by `world_from_motion` and otherwise kept.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedSpline {
    spline: Spline,
    start_s: f64,
    scale: f64,
    offset_m: DVec3,
    world_from_motion: DQuat,
    origin_m: DVec3,
}

/// How the rig moves during a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Not at all: `world_from_body` at all times.
    Still(Pose),
    /// Along a spline.
    Spline(PlacedSpline),
}

impl PlacedSpline {
    /// Lays a spline into the room so that its pose at `start_s` of its clock occurs at 0 s of the run, at `offset_m`. Fails on `start_s`
    /// outside the spline's span, or a scale outside 0..=100.
    pub fn new(
        spline: Spline,
        start_s: f64,
        scale: f64,
        offset_m: DVec3,
        world_from_motion: DQuat,
    ) -> Result<Self, MotionError> {
        if !(scale > 0.0 && scale <= 100.0) {
            return Err(MotionError::Scale { scale });
        }
        let origin_m = spline.world_from_body(start_s)?.translation_m;
        Ok(Self { spline, start_s, scale, offset_m, world_from_motion: world_from_motion.normalize(), origin_m })
    }

    fn own(&self, run: Span) -> Span {
        Span { start_s: self.start_s + run.start_s, end_s: self.start_s + run.end_s }
    }

    /// Errors use the run's clock and name where it starts in the trajectory's.
    fn in_run_time(&self, error: MotionError) -> MotionError {
        match error {
            MotionError::OutsideSpan { t_s, start_s, end_s } => MotionError::OutsideSpan {
                t_s: t_s - self.start_s,
                start_s: start_s - self.start_s,
                end_s: end_s - self.start_s,
            },
            other => other,
        }
    }

    fn state(&self, run_s: f64) -> Result<BodyState, MotionError> {
        let state = self.spline.state(self.start_s + run_s).map_err(|error| self.in_run_time(error))?;
        let turn = self.world_from_motion;
        let position_m = state.world_from_body.translation_m;
        Ok(BodyState {
            world_from_body: Pose::new(
                (turn * state.world_from_body.rotation).normalize(),
                turn * (position_m - self.origin_m) * self.scale + self.offset_m,
            ),
            velocity_m_per_s: turn * state.velocity_m_per_s * self.scale,
            acceleration_m_per_s2: turn * state.acceleration_m_per_s2 * self.scale,
            angular_velocity_rad_per_s: state.angular_velocity_rad_per_s,
            angular_acceleration_rad_per_s2: state.angular_acceleration_rad_per_s2,
        })
    }
}

impl Motion {
    /// Where the body is at a time of the run. Gives [`MotionError::OutsideSpan`], in run time, where the trajectory ends before.
    pub fn world_from_body(&self, run_s: f64) -> Result<Pose, MotionError> {
        self.state(run_s).map(|state| state.world_from_body)
    }

    /// Pose and derivatives at a time of the run.
    pub fn state(&self, run_s: f64) -> Result<BodyState, MotionError> {
        match self {
            Self::Still(pose) => Ok(BodyState {
                world_from_body: *pose,
                velocity_m_per_s: DVec3::ZERO,
                acceleration_m_per_s2: DVec3::ZERO,
                angular_velocity_rad_per_s: DVec3::ZERO,
                angular_acceleration_rad_per_s2: DVec3::ZERO,
            }),
            Self::Spline(placed) => placed.state(run_s),
        }
    }

    /// Run times at which the motion is defined; infinite for a static rig.
    pub fn span(&self) -> Span {
        match self {
            Self::Still(_) => Span { start_s: f64::NEG_INFINITY, end_s: f64::INFINITY },
            Self::Spline(placed) => {
                let own = placed.spline.span();
                Span { start_s: own.start_s - placed.start_s, end_s: own.end_s - placed.start_s }
            }
        }
    }

    /// No greater speed in m/s and rate of turn in rad/s is met within a span of the run.
    pub fn speeds_max(&self, run: Span) -> Result<[f64; 2], MotionError> {
        match self {
            Self::Still(_) => Ok([0.0; 2]),
            Self::Spline(placed) => {
                let [speed, turn] =
                    placed.spline.speeds_max(placed.own(run)).map_err(|error| placed.in_run_time(error))?;
                Ok([speed * placed.scale, turn])
            }
        }
    }

    /// The lowest and highest coordinates of the body within a span of the run.
    pub fn extent_m(&self, run: Span) -> Result<(DVec3, DVec3), MotionError> {
        match self {
            Self::Still(pose) => Ok((pose.translation_m, pose.translation_m)),
            Self::Spline(placed) => {
                let turn = placed.world_from_motion;
                let extent =
                    placed.spline.extent_m(placed.own(run), turn).map_err(|error| placed.in_run_time(error))?;
                let in_room = |at_m: DVec3| (at_m - turn * placed.origin_m) * placed.scale + placed.offset_m;
                Ok((in_room(extent.0), in_room(extent.1)))
            }
        }
    }

    /// Checks before a run starts that the motion lasts for all of it.
    pub fn covers(&self, run: Span) -> Result<(), MotionError> {
        self.state(run.start_s).and_then(|_| self.state(run.end_s)).map(|_| ())
    }
}

/// Samples with times counted from the first one. (Time stamps of 1.5e9 s resolve a quarter of a microsecond only, so the
/// subtraction comes before all arithmetic; it is exact for neighbours and within that quarter for all.)
pub fn from_first_sample(samples: &[TimedPose]) -> Vec<TimedPose> {
    let first_s = samples.first().map_or(0.0, |sample| sample.t_s);
    samples.iter().map(|sample| TimedPose { t_s: sample.t_s - first_s, ..*sample }).collect()
}
