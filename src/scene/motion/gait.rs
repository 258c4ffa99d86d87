//! Head motion in walking, running, turning and oscillating, from published figures of gait. Computes the pose of a camera as a function of
//! time. Its frame has y up; the body is the rig (x right, y down, z forward) and looks along the path, along -z at first.
//!
//! A head in gait bobs once a step and sways once in two; its pitch compensates the bob, so that it stays on a target
//! ahead. Surge along the path, yaw and roll are left out: they are smaller, and no figure for them is at hand.

use core::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

use super::imu::GRAVITY_M_PER_S2;
use super::path::PathShape;
use super::spline::Spline;
use rand::RngExt;

use crate::draw::DrawKey;
use crate::num;
use crate::pose::Pose;
use crate::so3;

/// Knot spacing of generated motions: the fastest harmonic, 8 Hz, then has 6 knots a period.
pub const GENERATED_KNOT_S: f64 = 0.02;

/// Published number of the wander of the step rate in keys.
const GAIT_NUMBER: u64 = 3;

/// The step rate's wander is a sum of as many slow waves of equal height, whose periods have no common multiple within hours.
const WANDER_HZ: [f64; 8] = [0.053, 0.071, 0.097, 0.131, 0.173, 0.229, 0.307, 0.401];

/// Figures of a gait. Amplitudes are half of the peak-to-peak height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaitFigures {
    /// Along the path.
    pub speed_m_per_s: f64,
    /// Mean steps a second.
    pub step_rate_hz: f64,
    /// Standard deviation of the step rate, from step to step.
    pub step_rate_sd_hz: f64,
    /// Vertical acceleration's waves at the step rate and at twice of it, at the mean step rate. Both peak upwards together.
    pub bob_g: [f64; 2],
    /// Height of the sway at half the step rate.
    pub sway_m: f64,
    /// Peak rate of pitch, at the mean step rate.
    pub pitch_rate_deg_per_s: f64,
}

/// Walking. MacDougall and Moore 2005 ("Marching to the beat of the same drummer"): 2.0 Hz, standard deviation 0.13 Hz.
/// Hirasaki, Moore, Raphan and Cohen 1999 (Exp. Brain Res. 127, 117), at 1.2 to 1.8 m/s: the head's vertical acceleration peaks
/// at 0.3 to 0.5 g, its pitch rate at 15 to 22 deg/s: the middle of each. The sway of 2 cm is half of a step's width, of
/// some 10 cm, less what the trunk takes.
pub const WALK: GaitFigures = GaitFigures {
    speed_m_per_s: 1.4,
    step_rate_hz: 2.0,
    step_rate_sd_hz: 0.13,
    bob_g: [0.4, 0.0],
    sway_m: 0.02,
    pitch_rate_deg_per_s: 18.0,
};

/// Running. Step rate: Lieberman et al. 2015 (J. Exp. Biol. 218, 3406; 3.0 m/s, 14 runners asked for 75 to 95 strides a minute, least
/// effort at 84.8 +- 3.6, which are 2.83 steps a second). Bob: Cavagna et al. 1988 (J. Physiol. 399, 81): at low speed the
/// rebound is nearly symmetric about the body's weight; the flight is a free fall, so the lower end is -1 g (here 1.25 - 0.3 =
/// 0.95) and the upper end, at mid-stance, 1.55 g. Pitch: Grossman et al. 1988 (Exp. Brain Res. 70, 470): median pitch
/// frequency of running in place 3.2 Hz, greatest velocities not over 90 deg/s: half of that here.
pub const RUN: GaitFigures = GaitFigures {
    speed_m_per_s: 3.0,
    step_rate_hz: 2.7,
    step_rate_sd_hz: 0.13,
    bob_g: [1.25, 0.3],
    sway_m: 0.015,
    pitch_rate_deg_per_s: 45.0,
};

/// A gait along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Gait {
    figures: GaitFigures,
    path: PathShape,
    /// Starting phases of the step rate's waves.
    wander_rad: [f64; WANDER_HZ.len()],
    bob_m: [f64; 2],
    pitch_rad: f64,
}

impl Gait {
    /// The figures must be finite, the step rate above 0. `root` is the run's root key.
    pub fn new(figures: GaitFigures, path: PathShape, root: DrawKey) -> Self {
        assert!(figures.step_rate_hz > 0.0, "a gait has steps");
        let key = root.with(GAIT_NUMBER);
        let mut stream = key.stream();
        let wander_rad = core::array::from_fn(|_| TAU * stream.random::<f64>());
        let step_rad_per_s = TAU * figures.step_rate_hz;
        let height_m = |wave: usize, harmonic: f64| {
            let rate = harmonic * step_rad_per_s;
            figures.bob_g[wave] * GRAVITY_M_PER_S2 / (rate * rate)
        };
        Self {
            figures,
            path,
            wander_rad,
            bob_m: [height_m(0, 1.0), height_m(1, 2.0)],
            pitch_rad: figures.pitch_rate_deg_per_s.to_radians() / step_rad_per_s,
        }
    }

    /// Steps a second at a time.
    pub fn step_rate_hz(&self, t_s: f64) -> f64 {
        let waves = WANDER_HZ.iter().zip(&self.wander_rad);
        let sum = waves.fold(0.0, |sum, (hz, start_rad)| sum + libm::cos(TAU * hz * t_s + start_rad));
        self.figures.step_rate_hz + self.wave_hz() * sum
    }

    /// Steps since the start, in radians: the integral of the step rate.
    fn phase_rad(&self, t_s: f64) -> f64 {
        let waves = WANDER_HZ.iter().zip(&self.wander_rad);
        let sum = waves.fold(0.0, |sum, (hz, start_rad)| {
            sum + (libm::sin(TAU * hz * t_s + start_rad) - libm::sin(*start_rad)) / hz
        });
        TAU * self.figures.step_rate_hz * t_s + self.wave_hz() * sum
    }

    /// Height of each of the rate's waves: n waves of height a have a variance of n a^2 / 2.
    fn wave_hz(&self) -> f64 {
        self.figures.step_rate_sd_hz * (2.0 / num::f64_from_usize(WANDER_HZ.len())).sqrt()
    }

    /// Where the camera is.
    pub fn pose(&self, t_s: f64) -> Pose {
        let (position_m, heading_rad) = self.path.at(self.figures.speed_m_per_s * t_s);
        let phase_rad = self.phase_rad(t_s);
        // The body is lowest, and pushed upwards most, at phase 0.
        let bob_m = -self.bob_m[0] * libm::cos(phase_rad) - self.bob_m[1] * libm::cos(2.0 * phase_rad);
        let sway_m = self.figures.sway_m * libm::sin(0.5 * phase_rad);
        let (sine, cosine) = libm::sincos(heading_rad);
        let right = DVec3::new(cosine, 0.0, -sine);
        // Nose up where the head is low.
        let pitch_rad = self.pitch_rad * libm::cos(phase_rad);
        Pose::new(looking(heading_rad, pitch_rad), position_m + right * sway_m + DVec3::Y * bob_m)
    }
}

/// Turning on the spot, to the right for rates above 0.
pub fn spin(rate_deg_per_s: f64, t_s: f64) -> Pose {
    Pose::new(looking(-rate_deg_per_s.to_radians() * t_s, 0.0), DVec3::ZERO)
}

/// Trembling on the spot, with the body's axes along the frame's: a sine of this height along an axis.
pub fn oscillation(height_m: f64, frequency_hz: f64, axis: DVec3, t_s: f64) -> Pose {
    Pose::new(DQuat::IDENTITY, axis * (height_m * libm::sin(TAU * frequency_hz * t_s)))
}

/// The spline that follows a generated motion from before 0 s to beyond `end_s`.
pub fn generated(pose: impl Fn(f64) -> Pose, knot_s: f64, end_s: f64) -> Spline {
    let intervals = num::index(num::u32_truncated(end_s / knot_s)) + 4;
    Spline::following(pose, -knot_s, knot_s, intervals)
}

/// A camera's orientation: level along -z, then the nose up, then turned to the left.
fn looking(left_rad: f64, up_rad: f64) -> DQuat {
    // Half a turn about x brings z forward to -z and y down to -y.
    let level = so3::exp(DVec3::X * PI);
    (so3::exp(DVec3::Y * left_rad) * so3::exp(DVec3::X * up_rad) * level).normalize()
}
