//! An inertial measurement unit on the body. Computes angular rates and specific forces at the IMU's position, with Kalibr's noise: white
//! noise of density sigma, and random-walk biases.

use glam::DVec3;
use rand::distr::OpenClosed01;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::limits::MotionError;
use super::{BodyState, Motion};
use crate::draw::DrawKey;
use crate::num;
use crate::pose::Pose;
use crate::units::Span;

/// Standard gravity in m/s^2.
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Gravity in a room with y up.
pub const GRAVITY_IN_WORLD_M_PER_S2: DVec3 = DVec3::new(0.0, -GRAVITY_M_PER_S2, 0.0);

/// Kalibr's noise model. Densities are those of the continuous processes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuNoise {
    /// Rate of samples.
    pub rate_hz: f64,
    /// White noise of the gyroscope, rad/s/sqrt(Hz).
    pub gyroscope_noise_density: f64,
    /// White noise of the accelerometer, m/s^2/sqrt(Hz).
    pub accelerometer_noise_density: f64,
    /// Walk of the gyroscope's bias, rad/s^2/sqrt(Hz).
    pub gyroscope_random_walk: f64,
    /// Walk of the accelerometer's bias, m/s^3/sqrt(Hz).
    pub accelerometer_random_walk: f64,
}

/// A phone's MEMS unit: the example figures of Kalibr's documentation, at 200 Hz.
pub const MEMS_PHONE: ImuNoise = ImuNoise {
    rate_hz: 200.0,
    gyroscope_noise_density: 1.86e-4,
    accelerometer_noise_density: 1.86e-3,
    gyroscope_random_walk: 2.66e-5,
    accelerometer_random_walk: 4.33e-4,
};

/// Analog Devices' ADIS16448 at 200 Hz: random walks of 0.66 deg/sqrt(h) in angle and 0.11 m/s/sqrt(h) in velocity (datasheet); an
/// hour's root is 60 roots of a second, and the walk of an integral is its rate's density. The datasheet states no walk of the
/// biases; those are what EuRoC's `imu0/sensor.yaml` states for the same unit.
pub const ADIS16448: ImuNoise = ImuNoise {
    rate_hz: 200.0,
    gyroscope_noise_density: 0.66 / 60.0 * core::f64::consts::PI / 180.0,
    accelerometer_noise_density: 0.11 / 60.0,
    gyroscope_random_walk: 1.9393e-5,
    accelerometer_random_walk: 3.0e-3,
};

/// A unit without noise.
pub const IDEAL: ImuNoise = ImuNoise {
    rate_hz: 200.0,
    gyroscope_noise_density: 0.0,
    accelerometer_noise_density: 0.0,
    gyroscope_random_walk: 0.0,
    accelerometer_random_walk: 0.0,
};

/// A unit and its mounting position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imu {
    /// Its rate and noise.
    pub noise: ImuNoise,
    /// Its pose on the body; readings are along its axes.
    pub body_from_imu: Pose,
}

/// One reading, with the truth of its biases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// Time of the run.
    pub t_s: f64,
    /// The IMU's frame, bias and noise included.
    pub angular_velocity_rad_per_s: DVec3,
    /// Specific force in the IMU's frame (at rest: gravity's opposite), bias and noise included.
    pub acceleration_m_per_s2: DVec3,
    /// Bias within the reading.
    pub gyroscope_bias_rad_per_s: DVec3,
    /// Bias within the reading.
    pub accelerometer_bias_m_per_s2: DVec3,
}

/// Readings at `k / rate` for all whole k within the span. Biases start at zero with the first reading. The noise of
/// reading k is a function of `key` and k. Gives [`MotionError::OutsideSpan`] where the motion does not cover the span.
pub fn samples(
    motion: &Motion,
    span: Span,
    imu: &Imu,
    gravity_in_world_m_per_s2: DVec3,
    key: DrawKey,
) -> Result<Vec<ImuSample>, MotionError> {
    let noise = &imu.noise;
    let dt_s = 1.0 / noise.rate_hz;
    let white = noise.rate_hz.sqrt(); // sigma_d = sigma / sqrt(dt)
    let walk = dt_s.sqrt(); // sigma_bd = sigma_b * sqrt(dt)
    let first = num::i64_truncated((span.start_s * noise.rate_hz).ceil());
    let last = num::i64_truncated((span.end_s * noise.rate_hz).floor());
    let mut gyroscope_bias_rad_per_s = DVec3::ZERO;
    let mut accelerometer_bias_m_per_s2 = DVec3::ZERO;
    let mut readings = Vec::new();
    for k in first..=last {
        let mut stream = Xoshiro256PlusPlus::seed_from_u64(key.with(k.cast_unsigned()).0);
        let t_s = num::f64_from_i64(k) / noise.rate_hz;
        let (rate_rad_per_s, force_m_per_s2) =
            truth(&motion.state(t_s)?, &imu.body_from_imu, gravity_in_world_m_per_s2);
        let (gyroscope_white, accelerometer_white) = (normals(&mut stream), normals(&mut stream));
        let (gyroscope_step, accelerometer_step) = (normals(&mut stream), normals(&mut stream));
        if k > first {
            gyroscope_bias_rad_per_s += gyroscope_step * (noise.gyroscope_random_walk * walk);
            accelerometer_bias_m_per_s2 += accelerometer_step * (noise.accelerometer_random_walk * walk);
        }
        readings.push(ImuSample {
            t_s,
            angular_velocity_rad_per_s: rate_rad_per_s
                + gyroscope_bias_rad_per_s
                + gyroscope_white * (noise.gyroscope_noise_density * white),
            acceleration_m_per_s2: force_m_per_s2
                + accelerometer_bias_m_per_s2
                + accelerometer_white * (noise.accelerometer_noise_density * white),
            gyroscope_bias_rad_per_s,
            accelerometer_bias_m_per_s2,
        });
    }
    Ok(readings)
}

/// What a unit without noise reads: the angular rate, and the specific force at its own position. A point r of a rigid body has
/// the origin's acceleration, Euler's alpha x r and the centripetal omega x (omega x r).
pub fn truth(state: &BodyState, body_from_imu: &Pose, gravity_in_world_m_per_s2: DVec3) -> (DVec3, DVec3) {
    let (position_m, rate) = (body_from_imu.translation_m, state.angular_velocity_rad_per_s);
    let body_from_world = state.world_from_body.rotation.conjugate();
    let origin_force = body_from_world * (state.acceleration_m_per_s2 - gravity_in_world_m_per_s2);
    let lever = state.angular_acceleration_rad_per_s2.cross(position_m) + rate.cross(rate.cross(position_m));
    let imu_from_body = body_from_imu.rotation.conjugate();
    (imu_from_body * rate, imu_from_body * (origin_force + lever))
}

/// Three standard normals of two pairs by Box and Muller's transform; the fourth is left, so that every vector takes the same number of
/// draws.
fn normals(stream: &mut Xoshiro256PlusPlus) -> DVec3 {
    let mut pair = || {
        // 53 bits each; the first lies in (0, 1], so its logarithm is finite.
        let uniform: f64 = stream.sample(OpenClosed01);
        let turn: f64 = stream.random();
        let radius = (-2.0 * libm::log(uniform)).sqrt();
        let (sine, cosine) = libm::sincos(core::f64::consts::TAU * turn);
        [radius * cosine, radius * sine]
    };
    let ([x, y], [z, _]) = (pair(), pair());
    DVec3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn at_origin(noise: &ImuNoise) -> Imu {
        Imu { noise: *noise, body_from_imu: Pose::IDENTITY }
    }

    fn still_readings(noise: &ImuNoise, seconds: f64, seed: u64) -> Vec<ImuSample> {
        let span = Span { start_s: 0.0, end_s: seconds };
        let motion = Motion::Still(Pose::IDENTITY);
        samples(&motion, span, &at_origin(noise), GRAVITY_IN_WORLD_M_PER_S2, DrawKey::root(seed)).unwrap()
    }

    #[test]
    fn a_unit_at_rest_feels_gravity_upwards() {
        let tilted = Pose::new(DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8), DVec3::ZERO);
        let span = Span { start_s: 0.0, end_s: 1.0 };
        let (motion, imu) = (Motion::Still(tilted), at_origin(&IDEAL));
        let readings = samples(&motion, span, &imu, GRAVITY_IN_WORLD_M_PER_S2, DrawKey::root(1)).unwrap();
        assert_eq!(readings.len(), 201);
        let expected = tilted.rotation.conjugate() * DVec3::new(0.0, GRAVITY_M_PER_S2, 0.0);
        assert_eq!(readings[7].acceleration_m_per_s2, expected);
        assert_eq!(readings[7].angular_velocity_rad_per_s, DVec3::ZERO);
        assert_eq!(readings[200].t_s, 1.0);
    }

    #[test]
    fn white_noise_has_its_density_and_biases_walk_at_theirs() {
        let readings = still_readings(&MEMS_PHONE, 100.0, 7);
        let count = num::f64_from_usize(readings.len() - 1) * 3.0;
        let (mut noise2, mut step2, mut mean) = (0.0, 0.0, 0.0);
        for pair in readings.windows(2) {
            let white = pair[1].angular_velocity_rad_per_s - pair[1].gyroscope_bias_rad_per_s;
            let step = pair[1].accelerometer_bias_m_per_s2 - pair[0].accelerometer_bias_m_per_s2;
            noise2 += white.length_squared();
            step2 += step.length_squared();
            mean += white.x + white.y + white.z;
        }
        let sigma = 1.86e-4 * 200.0_f64.sqrt();
        let sigma_step = 4.33e-4 / 200.0_f64.sqrt();
        // 60,000 normals: a variance has a relative standard error of sqrt(2/60,000) = 0.58 %; 4.5 of them, seed 7.
        assert!((noise2 / count / (sigma * sigma) - 1.0).abs() < 0.026, "{}", noise2 / count / (sigma * sigma));
        assert!((step2 / count / (sigma_step * sigma_step) - 1.0).abs() < 0.026);
        assert!((mean / count).abs() < 4.5 * sigma / count.sqrt());
    }

    #[test]
    fn a_reading_keeps_its_noise_whatever_span_is_asked_for() {
        let (short, long) = (still_readings(&MEMS_PHONE, 0.5, 3), still_readings(&MEMS_PHONE, 2.0, 3));
        assert_eq!(short[..], long[..short.len()]);
        assert_ne!(short[5], still_readings(&MEMS_PHONE, 0.5, 4)[5]);
    }
}
