//! IMU preintegration between two frames on SO(3) (Forster et al. 2017, "On-manifold preintegration for real-time visual-inertial
//! odometry"). Converts readings (rad/s, m/s^2, s) to rotation, velocity and position steps with covariance and first-order bias
//! dependence, and to residuals with Jacobians.
//!
//! Each interval between readings takes their mean and turns forces by the rotation at its middle, so the error falls
//! with the square of the interval. All frames are the IMU's own; `world_from_imu = world_from_body * body_from_imu`
//! carries a pose here.

pub mod chain;
pub mod filter;
mod state;

use glam::{DMat3, DQuat, DVec3};
use nalgebra::SMatrix;

use crate::pose::Pose;
use crate::so3;
use crate::tracker::lie::{skew, so3_right_jacobian, so3_right_jacobian_inverse};

/// One reading, in the IMU's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuMeasurement {
    /// Seconds.
    pub t_s: f64,
    /// Angular rate.
    pub angular_velocity_rad_per_s: DVec3,
    /// Specific force: at rest, gravity's opposite.
    pub acceleration_m_per_s2: DVec3,
}

/// Offsets of the readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bias {
    /// Of the gyroscope.
    pub gyroscope_rad_per_s: DVec3,
    /// Of the accelerometer.
    pub accelerometer_m_per_s2: DVec3,
}

/// Noise of the readings, as Kalibr states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// White noise of the gyroscope, rad/s/sqrt(Hz).
    pub gyroscope_noise_density: f64,
    /// White noise of the accelerometer, m/s^2/sqrt(Hz).
    pub accelerometer_noise_density: f64,
    /// Walk of the gyroscope's bias, rad/s^2/sqrt(Hz).
    pub gyroscope_random_walk: f64,
    /// Walk of the accelerometer's bias, m/s^3/sqrt(Hz).
    pub accelerometer_random_walk: f64,
}

/// Covariances over rotation, velocity, position.
pub type Matrix9 = SMatrix<f64, 9, 9>;
/// Derivatives of a residual by one state: position (in the IMU's axes), turn, velocity, gyroscope bias, accelerometer bias.
pub type StateJacobian = SMatrix<f64, 15, 15>;
/// Rotation, velocity, position, gyroscope bias, accelerometer bias.
pub type Residual = SMatrix<f64, 15, 1>;

/// What the adjustment moves at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuState {
    /// Where the IMU is.
    pub world_from_imu: Pose,
    /// In the world's axes.
    pub velocity_m_per_s: DVec3,
    /// Offsets of its readings.
    pub bias: Bias,
}

/// The step between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preintegrated {
    /// Its length.
    pub span_s: f64,
    /// Rotation from the later IMU frame to the earlier one.
    pub rotation: DQuat,
    /// Velocity gained in the earlier frame, gravity left out.
    pub velocity_m_per_s: DVec3,
    /// Way gained beside the first velocity and gravity, in the earlier frame.
    pub position_m: DVec3,
    /// Covariance of (rotation on the right, velocity, position) from white noise.
    pub covariance: Matrix9,
    /// Biases that were taken off.
    pub bias: Bias,
    rotation_by_gyroscope: DMat3,
    velocity_by_gyroscope: DMat3,
    velocity_by_accelerometer: DMat3,
    position_by_gyroscope: DMat3,
    position_by_accelerometer: DMat3,
}

/// Why readings cannot be preintegrated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // The messages name every field.
pub enum ImuError {
    #[error("readings from {first_s} s to {last_s} s do not cover {from_s} s to {to_s} s")]
    Uncovered { first_s: f64, last_s: f64, from_s: f64, to_s: f64 },
    #[error("time does not rise at {t_s} s")]
    TimeStandsStill { t_s: f64 },
    #[error("the reading at {t_s} s is not finite")]
    NotFinite { t_s: f64 },
}

impl Preintegrated {
    /// Gathers the readings from one time to a later one; at both ends they are interpolated. Fails on readings that do not cover the
    /// span, or whose times do not rise, or that are not finite.
    pub fn new(
        readings: &[ImuMeasurement],
        (from_s, to_s): (f64, f64),
        bias: Bias,
        noise: &Noise,
    ) -> Result<Self, ImuError> {
        let (first_s, last_s) =
            (readings.first().map_or(f64::NAN, |r| r.t_s), readings.last().map_or(f64::NAN, |r| r.t_s));
        if !(first_s <= from_s && from_s < to_s && to_s <= last_s) {
            return Err(ImuError::Uncovered { first_s, last_s, from_s, to_s });
        }
        let mut whole = Self {
            span_s: 0.0,
            rotation: DQuat::IDENTITY,
            velocity_m_per_s: DVec3::ZERO,
            position_m: DVec3::ZERO,
            covariance: Matrix9::zeros(),
            bias,
            rotation_by_gyroscope: DMat3::ZERO,
            velocity_by_gyroscope: DMat3::ZERO,
            velocity_by_accelerometer: DMat3::ZERO,
            position_by_gyroscope: DMat3::ZERO,
            position_by_accelerometer: DMat3::ZERO,
        };
        for pair in readings.windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            if !(b.t_s > a.t_s) {
                return Err(ImuError::TimeStandsStill { t_s: b.t_s });
            }
            for reading in pair {
                if !(reading.angular_velocity_rad_per_s.is_finite() && reading.acceleration_m_per_s2.is_finite()) {
                    return Err(ImuError::NotFinite { t_s: reading.t_s });
                }
            }
            if b.t_s <= from_s || a.t_s >= to_s {
                continue;
            }
            let (start, end) =
                (between(a, b, crate::num::greater(a.t_s, from_s)), between(a, b, crate::num::lesser(b.t_s, to_s)));
            whole.add(&start, &end, noise);
        }
        whole.span_s = to_s - from_s;
        Ok(whole)
    }

    /// One interval between two readings.
    fn add(&mut self, start: &ImuMeasurement, end: &ImuMeasurement, noise: &Noise) {
        let dt = end.t_s - start.t_s;
        let mean = |a: DVec3, b: DVec3| (a + b) * 0.5;
        let rate =
            mean(start.angular_velocity_rad_per_s, end.angular_velocity_rad_per_s) - self.bias.gyroscope_rad_per_s;
        let force = mean(start.acceleration_m_per_s2, end.acceleration_m_per_s2) - self.bias.accelerometer_m_per_s2;
        let (turn, half) = (rate * dt, rate * (0.5 * dt));
        let middle = self.rotation * so3::exp(half);
        let middle_matrix = DMat3::from_quat(middle);
        let (back, half_back) = (DMat3::from_quat(so3::exp(-turn)), DMat3::from_quat(so3::exp(-half)));
        let (by_rate, by_rate_half) = (so3_right_jacobian(turn) * dt, so3_right_jacobian(half) * (0.5 * dt));
        // A turn d of the middle frame, on its right, turns the force by -[force] d.
        let force_by_turn = -(middle_matrix * skew(force));
        let middle_by_gyroscope = half_back * self.rotation_by_gyroscope - by_rate_half;
        let acceleration_by_gyroscope = force_by_turn * middle_by_gyroscope;
        self.position_by_gyroscope += self.velocity_by_gyroscope * dt + acceleration_by_gyroscope * (0.5 * dt * dt);
        self.position_by_accelerometer += self.velocity_by_accelerometer * dt - middle_matrix * (0.5 * dt * dt);
        self.velocity_by_gyroscope += acceleration_by_gyroscope * dt;
        self.velocity_by_accelerometer -= middle_matrix * dt;
        self.rotation_by_gyroscope = back * self.rotation_by_gyroscope - by_rate;
        self.spread(
            dt,
            (back, force_by_turn * half_back),
            (by_rate, force_by_turn * by_rate_half, middle_matrix),
            noise,
        );
        let acceleration = middle * force;
        self.position_m += self.velocity_m_per_s * dt + acceleration * (0.5 * dt * dt);
        self.velocity_m_per_s += acceleration * dt;
        self.rotation = (self.rotation * so3::exp(turn)).normalize();
    }

    /// Carries the covariance over an interval. White noise of density s has the variance s^2 / dt in a mean over dt.
    fn spread(
        &mut self,
        dt: f64,
        (back, acceleration_by_turn): (DMat3, DMat3),
        (by_rate, acceleration_by_rate, by_force): (DMat3, DMat3, DMat3),
        noise: &Noise,
    ) {
        let mut carry = Matrix9::identity();
        put(&mut carry, (0, 0), back);
        put(&mut carry, (3, 0), acceleration_by_turn * dt);
        put(&mut carry, (6, 0), acceleration_by_turn * (0.5 * dt * dt));
        put(&mut carry, (6, 3), DMat3::IDENTITY * dt);
        let mut by_noise = SMatrix::<f64, 9, 6>::zeros();
        put(&mut by_noise, (0, 0), by_rate);
        put(&mut by_noise, (3, 0), acceleration_by_rate * dt);
        put(&mut by_noise, (6, 0), acceleration_by_rate * (0.5 * dt * dt));
        put(&mut by_noise, (3, 3), by_force * dt);
        put(&mut by_noise, (6, 3), by_force * (0.5 * dt * dt));
        let density = |k: usize| if k < 3 { noise.gyroscope_noise_density } else { noise.accelerometer_noise_density };
        let scaled = SMatrix::<f64, 9, 6>::from_fn(|i, k| by_noise[(i, k)] * density(k) / dt.sqrt());
        self.covariance = carry * self.covariance * carry.transpose() + scaled * scaled.transpose();
    }

    /// The same step with another point of the rigid body as its position, given in the IMU's frame; velocities stay the IMU's.
    #[must_use]
    pub fn at_point(mut self, point_m: DVec3) -> Self {
        self.position_m += self.rotation * point_m - point_m;
        let by_turn = -(DMat3::from_quat(self.rotation) * skew(point_m));
        self.position_by_gyroscope += by_turn * self.rotation_by_gyroscope;
        let mut carry = Matrix9::identity();
        put(&mut carry, (6, 0), by_turn);
        self.covariance = carry * self.covariance * carry.transpose();
        self
    }

    /// Rotation, velocity and position steps for biases near those that were taken off, to first order.
    pub fn corrected(&self, bias: &Bias) -> (DQuat, DVec3, DVec3) {
        let gyroscope = bias.gyroscope_rad_per_s - self.bias.gyroscope_rad_per_s;
        let accelerometer = bias.accelerometer_m_per_s2 - self.bias.accelerometer_m_per_s2;
        let velocity = self.velocity_by_gyroscope * gyroscope + self.velocity_by_accelerometer * accelerometer;
        let position = self.position_by_gyroscope * gyroscope + self.position_by_accelerometer * accelerometer;
        let rotation = (self.rotation * so3::exp(self.rotation_by_gyroscope * gyroscope)).normalize();
        (rotation, self.velocity_m_per_s + velocity, self.position_m + position)
    }

    /// What two states miss of the step: rotation, velocity, position, and the change of the biases (Forster's equation 45).
    pub fn residual(&self, (from, to): (&ImuState, &ImuState), gravity_m_per_s2: DVec3) -> Residual {
        let (rotation, velocity, position) = self.corrected(&from.bias);
        let (turned, gained, way) = self.relative(from, to, gravity_m_per_s2);
        let parts = [
            so3::log(rotation.conjugate() * turned),
            gained - velocity,
            way - position,
            to.bias.gyroscope_rad_per_s - from.bias.gyroscope_rad_per_s,
            to.bias.accelerometer_m_per_s2 - from.bias.accelerometer_m_per_s2,
        ];
        Residual::from_fn(|k, _| parts[k / 3][k % 3])
    }

    /// The steps as the states have them.
    fn relative(&self, from: &ImuState, to: &ImuState, gravity: DVec3) -> (DQuat, DVec3, DVec3) {
        let (back, dt) = (from.world_from_imu.rotation.conjugate(), self.span_s);
        let gained = to.velocity_m_per_s - from.velocity_m_per_s - gravity * dt;
        let way = to.world_from_imu.translation_m
            - from.world_from_imu.translation_m
            - from.velocity_m_per_s * dt
            - gravity * (0.5 * dt * dt);
        (back * to.world_from_imu.rotation, back * gained, back * way)
    }

    /// Derivatives of the residual by the earlier and the later state: a pose moves on its right (`exp` of a twist in
    /// the IMU's axes), velocity and biases by addition.
    pub fn jacobians(
        &self,
        (from, to): (&ImuState, &ImuState),
        gravity_m_per_s2: DVec3,
    ) -> (StateJacobian, StateJacobian) {
        let residual = self.residual((from, to), gravity_m_per_s2);
        let miss = DVec3::new(residual[0], residual[1], residual[2]);
        let (turned, gained, way) = self.relative(from, to, gravity_m_per_s2);
        let (turned, back) = (DMat3::from_quat(turned), DMat3::from_quat(from.world_from_imu.rotation).transpose());
        let inverse = so3_right_jacobian_inverse(miss);
        let shift = self.rotation_by_gyroscope * (from.bias.gyroscope_rad_per_s - self.bias.gyroscope_rad_per_s);
        let by_gyroscope = so3_right_jacobian(shift) * self.rotation_by_gyroscope;
        let (mut a, mut b) = (StateJacobian::zeros(), StateJacobian::zeros());
        put(&mut a, (0, 3), -(inverse * turned.transpose()));
        put(&mut b, (0, 3), inverse);
        put(&mut a, (0, 9), -(inverse * DMat3::from_quat(so3::exp(-miss)) * by_gyroscope));
        put(&mut a, (3, 3), skew(gained));
        put(&mut a, (3, 6), -back);
        put(&mut b, (3, 6), back);
        put(&mut a, (3, 9), -self.velocity_by_gyroscope);
        put(&mut a, (3, 12), -self.velocity_by_accelerometer);
        put(&mut a, (6, 0), -DMat3::IDENTITY);
        put(&mut b, (6, 0), turned);
        put(&mut a, (6, 3), skew(way));
        put(&mut a, (6, 6), back * -self.span_s);
        put(&mut a, (6, 9), -self.position_by_gyroscope);
        put(&mut a, (6, 12), -self.position_by_accelerometer);
        for row in [9, 12] {
            put(&mut a, (row, row), -DMat3::IDENTITY);
            put(&mut b, (row, row), DMat3::IDENTITY);
        }
        (a, b)
    }
}

/// A reading at a time between two.
fn between(a: &ImuMeasurement, b: &ImuMeasurement, t_s: f64) -> ImuMeasurement {
    let share = (t_s - a.t_s) / (b.t_s - a.t_s);
    let mixed = |x: DVec3, y: DVec3| x * (1.0 - share) + y * share;
    ImuMeasurement {
        t_s,
        angular_velocity_rad_per_s: mixed(a.angular_velocity_rad_per_s, b.angular_velocity_rad_per_s),
        acceleration_m_per_s2: mixed(a.acceleration_m_per_s2, b.acceleration_m_per_s2),
    }
}

fn put<const R: usize, const C: usize>(matrix: &mut SMatrix<f64, R, C>, (row, column): (usize, usize), block: DMat3) {
    for i in 0..3 {
        for j in 0..3 {
            matrix[(row + i, column + j)] = block.col(j)[i];
        }
    }
}
