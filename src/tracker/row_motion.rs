//! Rolling-shutter motion model: gives the pose at each row's own time, from the frame's pose and its rate.
//!
//! Within a frame the twist is constant (Hedborg et al., "Rolling shutter bundle adjustment", CVPR 2012; Schubert et al., "Direct sparse
//! odometry with rolling shutter", ECCV 2018). It acts from the left on `body_from_world`. Metres, radians, seconds.

use glam::DVec3;

use super::prior::PosePrior;
use crate::pose::Pose;
use crate::tracker::lie::{Twist, se3_exp, se3_log};
use crate::units::Size;

/// When the rows of a camera are exposed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowClock {
    /// From the time of the rig's frame to the middle of this camera's, in seconds.
    pub offset_s: f64,
    /// From row to row in seconds; 0 for a global shutter.
    pub row_time_s: f64,
}

impl RowClock {
    /// All rows at the time of the frame.
    pub const GLOBAL: Self = Self { offset_s: 0.0, row_time_s: 0.0 };

    /// From the time of the rig's frame to that of a row.
    pub fn row_offset_s(&self, row_px: f64, size: Size) -> f64 {
        self.offset_s + (row_px - 0.5 * f64::from(size.height_px - 1)) * self.row_time_s
    }

    /// Whether any row has another time than the frame.
    pub fn sweeps(&self) -> bool {
        self.offset_s != 0.0 || self.row_time_s != 0.0
    }
}

/// A body at the time of a frame, and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moving {
    /// Where it is.
    pub body_from_world: Pose,
    /// Twist a second: after t it is at `exp(t * rate).then(&body_from_world)`.
    pub rate: Twist,
}

/// No motion.
pub const AT_REST: Twist = Twist { linear_m: DVec3::ZERO, angular_rad: DVec3::ZERO };

impl Moving {
    /// A body that does not move within a frame.
    pub fn resting(body_from_world: Pose) -> Self {
        Self { body_from_world, rate: AT_REST }
    }

    /// The body's frame at a row's time, from that at the frame's.
    pub fn row_from_frame(&self, offset_s: f64) -> Pose {
        if offset_s == 0.0 { Pose::IDENTITY } else { se3_exp(self.rate.scaled(offset_s)) }
    }

    /// The body at a row's time.
    pub fn at(&self, offset_s: f64) -> Pose {
        if offset_s == 0.0 { self.body_from_world } else { self.row_from_frame(offset_s).then(&self.body_from_world) }
    }

    /// A point of the body's frame, seen from the body so much later. The dropped term is (angle)^2 / 2 of its range: 4e-4 at 3.5 rad/s and
    /// 8 ms, a tenth of a pixel, which a search does not see.
    pub fn soon(&self, point_in_body_m: DVec3, offset_s: f64) -> DVec3 {
        point_in_body_m + (self.rate.angular_rad.cross(point_in_body_m) + self.rate.linear_m) * offset_s
    }
}

/// Mean twist a second between two poses of the body.
pub fn mean_rate(from: &Pose, to: &Pose, span_s: f64) -> Twist {
    se3_log(&to.then(&from.inverse())).scaled(1.0 / span_s)
}

/// Twist a second at the pose between two steps, each with its length in seconds: rates run straight from the middle of one to that of the
/// other.
pub fn between((before, span_before_s): (Twist, f64), (after, span_after_s): (Twist, f64)) -> Twist {
    let share = span_before_s / (span_before_s + span_after_s);
    before.scaled(1.0 - share).plus(&after.scaled(share))
}

/// Twist a second at the pose ahead of two steps.
pub fn ahead_of((first, span_first_s): (Twist, f64), (second, span_second_s): (Twist, f64)) -> Twist {
    let share = span_first_s / (span_first_s + span_second_s);
    first.scaled(1.0 + share).plus(&second.scaled(-share))
}

/// What is known of a rate before the frame's own rows are asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatePrior {
    /// Expected twist a second.
    pub mean: Twist,
    /// One over its standard deviation per axis, linear in s/m.
    pub inverse_sigma_linear: f64,
    /// The same of the angular part in s/rad.
    pub inverse_sigma_angular: f64,
}

impl RatePrior {
    /// After two located frames. Two poses of 0.4 mm and 0.25 mrad say a step's rate to 0.02 m/s and 0.01 rad/s, its trend to 1.5 times
    /// that; a hand's jerk of 30 m/s^3 and 100 rad/s^3 adds 0.01 m/s and 0.03 rad/s over a frame at 30 Hz. Wider priors take the
    /// positions' own noise for motion within the frame: three times as wide doubled the error of a lively hand.
    pub fn trend(mean: Twist) -> Self {
        Self { mean, inverse_sigma_linear: 1.0 / 0.02, inverse_sigma_angular: 1.0 / 0.04 }
    }

    /// With one step only: its middle is half a frame old, in which 5 m/s^2 and 20 rad/s^2 add 0.1 m/s and 0.3 rad/s.
    pub fn step(mean: Twist) -> Self {
        Self { mean, inverse_sigma_linear: 1.0 / 0.15, inverse_sigma_angular: 1.0 / 0.4 }
    }

    /// Nothing is known but that a hand carries the rig: up to 2 m/s and 3 rad/s.
    pub const ANY: Self = Self { mean: AT_REST, inverse_sigma_linear: 1.0, inverse_sigma_angular: 0.7 };

    /// Deviation from the mean in sigmas.
    pub fn error(&self, rate: &Twist) -> [f64; 6] {
        let linear = (self.mean.linear_m - rate.linear_m) * self.inverse_sigma_linear;
        let angular = (self.mean.angular_rad - rate.angular_rad) * self.inverse_sigma_angular;
        [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
    }

    /// One over the standard deviation of each number.
    pub fn inverse_sigmas(&self) -> [f64; 6] {
        let (l, a) = (self.inverse_sigma_linear, self.inverse_sigma_angular);
        [l, l, l, a, a, a]
    }
}

/// The last located frames, as far as the next one depends on them.
#[derive(Clone, Copy, Debug)]
pub struct VelocityModel {
    /// Time of the last frame.
    pub t_s: f64,
    /// Where the body was.
    pub body_from_world: Pose,
    /// Mean rate of the step that led there, and its length in seconds.
    pub step: Option<(Twist, f64)>,
    /// Standard deviation of the last position, per axis, in metres.
    pub sigma_m: f64,
}

/// What constant velocity leaves out: accelerations of a hand, as standard deviations per axis.
const HAND_M_PER_S2: f64 = 7.0;
const HAND_RAD_PER_S2: f64 = 40.0;

impl VelocityModel {
    /// The body at a time by constant velocity; the last pose where no velocity is known.
    pub fn predict(&self, t_s: f64) -> Moving {
        let Some((rate, _)) = self.step else { return Moving::resting(self.body_from_world) };
        let body_from_world = se3_exp(rate.scaled(t_s - self.t_s)).then(&self.body_from_world);
        Moving { body_from_world, rate }
    }

    /// The pose at a time as constant velocity knows it: the last two positions' errors, and what a hand may do in between. `None` where no
    /// velocity is known.
    pub fn pose_prior(&self, t_s: f64) -> Option<PosePrior> {
        self.step?;
        let span_s = t_s - self.t_s;
        let by_hand = |per_s2: f64| per_s2 * span_s * span_s;
        // Two positions of sigma s, the later one doubled: sqrt(5) s.
        let sigma_m = (by_hand(HAND_M_PER_S2) * by_hand(HAND_M_PER_S2) + 5.0 * self.sigma_m * self.sigma_m).sqrt();
        Some(PosePrior::isotropic(self.predict(t_s).body_from_world, (sigma_m, by_hand(HAND_RAD_PER_S2))))
    }

    /// What the steps so far and one to a pose say about the rate there.
    pub fn rate_prior(&self, t_s: f64, body_from_world: &Pose) -> RatePrior {
        let span_s = t_s - self.t_s;
        let rate = mean_rate(&self.body_from_world, body_from_world, span_s);
        let Some((before, span_before_s)) = self.step else { return RatePrior::step(rate) };
        // From the middle of the step to its end at the pace of change between the two steps' middles.
        let share = span_s / (span_s + span_before_s);
        let extend = |now: DVec3, before: DVec3| now + (now - before) * share;
        RatePrior::trend(Twist {
            linear_m: extend(rate.linear_m, before.linear_m),
            angular_rad: extend(rate.angular_rad, before.angular_rad),
        })
    }

    /// After a step to a pose.
    #[must_use]
    pub fn then(self, t_s: f64, body_from_world: Pose) -> Self {
        let span_s = t_s - self.t_s;
        let step = Some((mean_rate(&self.body_from_world, &body_from_world, span_s), span_s));
        Self { t_s, body_from_world, step, ..self }
    }
}
