//! Error-state Kalman filter of the IMU (Sola 2017, "Quaternion kinematics for the error-state Kalman filter"). States: position,
//! rotation, velocity, both biases, gravity, and the scale of a map without metres. Predicts the next frame's pose and velocity with
//! covariance; each picture's pose corrects it.
//!
//! Gravity and scale need no separate initialisation: once pictures give the rotation, the model is linear in velocity, gravity
//! and scale. Until they are known, the covariance is large. Lengths are in the map's unit, in the map's world frame.

use std::collections::VecDeque;

use glam::{DMat3, DVec3};
use nalgebra::{Matrix6, SMatrix, Vector6};

use super::super::prior::PosePrior;
use super::state::{ACCELEROMETER, Covariance, N};
pub(super) use super::state::{GRAVITY, GYROSCOPE, Knowledge, UNIT, VELOCITY};
pub use super::state::{ImuCalibration, ImuFilter};
use super::{ImuMeasurement, ImuState, Noise, Preintegrated, put};
use crate::num::greater;
use crate::pose::Pose;
use crate::so3;
use crate::tracker::lie::{Twist, se3_adjoint, skew};
use crate::tracker::row_motion::{Moving, RatePrior};

/// Magnitude of gravity in m/s^2, and its variation on the Earth.
const GRAVITY_M_PER_S2: f64 = 9.806_65;
const GRAVITY_SIGMA_M_PER_S2: f64 = 0.03;
/// Initial standard deviations: velocity of a hand in m/s, biases of a phone's IMU in rad/s and m/s^2, gravity from the mean of
/// some readings in m/s^2, and the scale of a monocular map as a share.
const START_VELOCITY: f64 = 1.0;
const START_GYROSCOPE: f64 = 0.03;
const START_ACCELEROMETER: f64 = 0.1;
const START_GRAVITY: f64 = 2.0;
const START_UNIT: f64 = 0.7;
/// Standard deviation of the scale, as a share, below which it counts as known.
pub(super) const UNIT_SHARE_MAX: f64 = 0.05;
/// Lower bounds on the noise densities: the path between readings is not straight.
const GYROSCOPE_FLOOR: f64 = 1e-4;
const ACCELEROMETER_FLOOR: f64 = 1.5e-3;
/// Random walk of the map's tilt and scale, per square root of a second, in m/s^2 and as a share.
const GRAVITY_WALK: f64 = 3e-3;
const UNIT_WALK: f64 = 3e-4;
/// Share of a picture's information that is new: landmark errors are correlated from frame to frame.
const PICTURE_SHARE: f64 = 0.5;
/// Share of the squared correction of the last pose that is added to its covariance. With 1 the filter follows every jump of
/// the map; with 0 it lags behind permanent corrections.
const MOVED_SHARE: f64 = 0.1;
/// The filter restarts after this time without a picture.
const COAST_S_MAX: f64 = 1.0;
/// Seconds of readings kept, and seconds averaged at a start.
const KEPT_S: f64 = COAST_S_MAX + 0.2;
const MEAN_S: f64 = 0.1;
/// Largest time by which a frame may be newer than the last reading.
const AHEAD_S_MAX: f64 = 0.02;

/// Pose predicted from IMU readings, before the picture is used.
#[derive(Clone, Copy, Debug)]
pub struct ImuPrediction {
    /// The body and how it moves.
    pub moving: Moving,
    /// How sure.
    pub prior: PosePrior,
}

impl ImuPrediction {
    /// Standard deviations of position and rotation, an upper bound over the axes.
    pub fn sigmas(&self) -> (f64, f64) {
        let Some(covariance) = self.prior.information.try_inverse() else { return (f64::INFINITY, f64::INFINITY) };
        let of = |from: usize| (0..3).map(|k| covariance[(from + k, from + k)]).sum::<f64>().sqrt();
        (of(0), of(3))
    }
}

impl ImuFilter {
    /// A filter without a state.
    pub fn new(mut calibration: ImuCalibration, is_metric: bool) -> Self {
        let noise = &mut calibration.noise;
        noise.gyroscope_noise_density = greater(noise.gyroscope_noise_density, GYROSCOPE_FLOOR);
        noise.accelerometer_noise_density = greater(noise.accelerometer_noise_density, ACCELEROMETER_FLOOR);
        Self { calibration, is_metric, readings: VecDeque::new(), now: None, links: VecDeque::new() }
    }

    /// Adds readings in ascending time; readings that are not finite or not ascending are skipped.
    pub fn add_imu_readings(&mut self, readings: &[ImuMeasurement]) {
        for reading in readings {
            let rises = self.readings.back().is_none_or(|last| reading.t_s > last.t_s);
            let is_finite = reading.angular_velocity_rad_per_s.is_finite() && reading.acceleration_m_per_s2.is_finite();
            if rises && is_finite && reading.t_s.is_finite() {
                self.readings.push_back(*reading);
                while self.readings.front().is_some_and(|first| first.t_s < reading.t_s - KEPT_S) {
                    self.readings.pop_front();
                }
            }
        }
    }

    /// Forgets all but the readings.
    pub fn reset(&mut self) {
        self.now = None;
        self.links.clear();
    }

    /// Goes on to a frame's time, by readings alone. `None` where nothing is known, or readings are missing.
    pub fn advance(&mut self, t_s: f64) -> Option<ImuPrediction> {
        let from = self.now.take()?;
        if t_s - from.seen_s > COAST_S_MAX {
            return None;
        }
        let step = self.step((from.t_s, t_s), from.state.bias)?;
        let rate_rad_per_s = rate_at(&self.span(from.t_s, t_s)?, t_s) - from.state.bias.gyroscope_rad_per_s;
        let mut now = from.after(&step, &self.calibration.noise, self.is_metric);
        (now.t_s, now.rate_rad_per_s) = (t_s, rate_rad_per_s);
        let imu_prediction = self.prediction(&now);
        self.now = Some(now);
        imu_prediction
    }

    /// Readings around a span; the last one is held where the frame is a little younger.
    fn span(&self, from_s: f64, to_s: f64) -> Option<Vec<ImuMeasurement>> {
        let first = self.readings.partition_point(|reading| reading.t_s <= from_s).checked_sub(1)?;
        let mut readings: Vec<ImuMeasurement> = self.readings.range(first..).copied().collect();
        let last = *readings.last()?;
        if last.t_s < to_s {
            if last.t_s + AHEAD_S_MAX < to_s {
                return None;
            }
            readings.push(ImuMeasurement { t_s: to_s, ..last });
        }
        Some(readings)
    }

    /// The IMU's axes at the body's origin: so no arm of some metres enters a map that has no metre.
    pub(super) fn axes(&self) -> Pose {
        Pose { translation_m: DVec3::ZERO, ..self.calibration.body_from_imu }
    }

    /// The step between two times, with the body's position.
    pub(super) fn step(&self, (from_s, to_s): (f64, f64), bias: super::Bias) -> Option<Preintegrated> {
        let readings = self.span(from_s, to_s)?;
        let step = Preintegrated::new(&readings, (from_s, to_s), bias, &self.calibration.noise).ok()?;
        Some(step.at_point(self.calibration.body_from_imu.inverse().translation_m))
    }

    fn prediction(&self, now: &Knowledge) -> Option<ImuPrediction> {
        let body_from_imu = &self.axes();
        let body_from_world = body_from_imu.then(&now.state.world_from_imu.inverse());
        let adjoint = se3_adjoint(body_from_imu);
        let pose = now.covariance.fixed_view::<6, 6>(0, 0).into_owned();
        let information = (adjoint * pose * adjoint.transpose()).try_inverse()?;
        let moving = Moving { body_from_world, rate: self.rate(now) };
        Some(ImuPrediction { moving, prior: PosePrior { mean: body_from_world, information } })
    }

    /// Twist a second that acts from the left on `body_from_world`.
    fn rate(&self, now: &Knowledge) -> Twist {
        let body_from_imu = &self.axes();
        let angular = body_from_imu.rotation * now.rate_rad_per_s;
        let of_imu = now.state.world_from_imu.rotation.conjugate() * now.state.velocity_m_per_s;
        let linear =
            body_from_imu.rotation * of_imu - angular.cross(self.calibration.body_from_imu.translation_m) * now.unit;
        Twist { linear_m: -linear, angular_rad: -angular }
    }

    /// What is known of a frame's rate beside its rows. A hand's 5 m/s^2 and 20 rad/s^2 change it by 0.04 m/s and 0.16 rad/s over the 8 ms
    /// from a frame's middle to its last row: half of that at the rows' mean distance.
    pub fn rate_prior(&self) -> Option<RatePrior> {
        let mean = self.now.as_ref().map(|now| self.rate(now))?;
        Some(RatePrior { mean, inverse_sigma_linear: 1.0 / 0.02, inverse_sigma_angular: 1.0 / 0.05 })
    }

    /// Takes the pose that a picture gave, with what the picture alone knows of it (information of the left twist).
    pub fn correct(&mut self, t_s: f64, body_from_world: &Pose, picture: &Matrix6<f64>) {
        let body_from_imu = self.axes();
        let world_from_imu = body_from_world.inverse().then(&body_from_imu);
        let adjoint = se3_adjoint(&body_from_imu);
        match &mut self.now {
            Some(now) if now.t_s == t_s => {
                let information = adjoint.transpose() * picture * adjoint * PICTURE_SHARE;
                now.take(&world_from_imu, &information);
                now.seen_s = t_s;
            }
            _ => self.begin(t_s, world_from_imu),
        }
    }

    /// Adds uncertainty after the map has moved by some metres and radians; later pictures correct the filter.
    pub fn loosen(&mut self, moved_m: f64, moved_rad: f64) {
        let Some(now) = &mut self.now else { return };
        let by = |moved: f64| MOVED_SHARE * moved * moved / 3.0;
        (0..6).for_each(|k| now.covariance[(k, k)] += if k < 3 { by(moved_m) } else { by(moved_rad) });
    }

    /// Applies a correction of the map: a new pose of the body in it, and a scale factor.
    pub fn moved(&mut self, before: &Pose, after: &Pose, scale: f64) {
        let body_from_imu = self.axes();
        let Some(now) = &mut self.now else { return };
        // Poses are body_from_world: the world's frame turns by this.
        let turn = after.rotation.conjugate() * before.rotation;
        now.state.world_from_imu = after.inverse().then(&body_from_imu);
        now.state.velocity_m_per_s = turn * now.state.velocity_m_per_s * scale;
        now.gravity = turn * now.gravity * scale;
        if !self.is_metric {
            now.unit *= scale;
        }
    }

    fn begin(&mut self, t_s: f64, world_from_imu: Pose) {
        let near: Vec<&ImuMeasurement> = self.readings.iter().filter(|r| (r.t_s - t_s).abs() < MEAN_S).collect();
        if near.is_empty() {
            return;
        }
        let share = 1.0 / crate::num::f64_from_usize(near.len());
        let force = near.iter().map(|r| r.acceleration_m_per_s2).sum::<DVec3>() * share;
        let gravity = -(world_from_imu.rotation * force);
        let (start_gravity, start_unit) = if self.is_metric { (START_GRAVITY, 0.0) } else { (10.0, START_UNIT) };
        let sigma = |k: usize| match k {
            0..VELOCITY => 1e-3,
            VELOCITY..GYROSCOPE => START_VELOCITY,
            GYROSCOPE..ACCELEROMETER => START_GYROSCOPE,
            ACCELEROMETER..GRAVITY => START_ACCELEROMETER,
            GRAVITY..UNIT => start_gravity,
            _ => start_unit,
        };
        let covariance = Covariance::from_fn(|i, j| if i == j { sigma(i) * sigma(i) } else { 0.0 });
        let state = ImuState { world_from_imu, velocity_m_per_s: DVec3::ZERO, bias: super::Bias::default() };
        let rate_rad_per_s = DVec3::ZERO;
        self.now = Some(Knowledge { t_s, seen_s: t_s, state, gravity, unit: 1.0, covariance, rate_rad_per_s });
    }

    /// Gravity in the map's frame, with its standard deviation as a share; `None` where nothing is known.
    pub fn gravity(&self) -> Option<(DVec3, f64)> {
        let now = self.now.as_ref()?;
        let variance: f64 = (0..3).map(|k| now.covariance[(GRAVITY + k, GRAVITY + k)]).sum();
        Some((now.gravity, variance.sqrt() / greater(now.gravity.length(), 1e-9)))
    }

    /// The map's units of length a metre, with the standard deviation as a share.
    pub fn unit_per_m(&self) -> Option<(f64, f64)> {
        let now = self.now.as_ref()?;
        Some((now.unit, now.covariance[(UNIT, UNIT)].sqrt() / greater(now.unit.abs(), 1e-9)))
    }

    /// Whether lengths of the map are known in metres.
    pub fn knows_unit(&self) -> bool {
        self.unit_per_m().is_some_and(|(_, share)| share < UNIT_SHARE_MAX)
    }

    /// Offsets of the readings.
    pub fn bias(&self) -> Option<super::Bias> {
        self.now.as_ref().map(|now| now.state.bias)
    }
}

fn rate_at(readings: &[ImuMeasurement], t_s: f64) -> DVec3 {
    let after = readings.partition_point(|reading| reading.t_s < t_s);
    match (after.checked_sub(1).and_then(|before| readings.get(before)), readings.get(after)) {
        (Some(a), Some(b)) => super::between(a, b, t_s).angular_velocity_rad_per_s,
        (a, b) => a.or(b).map_or(DVec3::ZERO, |reading| reading.angular_velocity_rad_per_s),
    }
}

impl Knowledge {
    fn after(&self, step: &Preintegrated, noise: &Noise, is_metric: bool) -> Self {
        let (dt, unit) = (step.span_s, self.unit);
        let turn = self.state.world_from_imu.rotation;
        let matrix = DMat3::from_quat(turn);
        let rotation = (turn * step.rotation).normalize();
        let (gain, way) = (turn * step.velocity_m_per_s, turn * step.position_m);
        let velocity = self.state.velocity_m_per_s + self.gravity * dt + gain * unit;
        let position = self.state.world_from_imu.translation_m
            + self.state.velocity_m_per_s * dt
            + self.gravity * (0.5 * dt * dt)
            + way * unit;
        let (back, step_back) = (DMat3::from_quat(rotation.conjugate()), DMat3::from_quat(step.rotation.conjugate()));
        let mut carry = Covariance::identity();
        put(&mut carry, (3, 3), step_back);
        put(&mut carry, (3, GYROSCOPE), step.rotation_by_gyroscope);
        put(&mut carry, (VELOCITY, 3), matrix * skew(step.velocity_m_per_s) * -unit);
        put(&mut carry, (VELOCITY, GYROSCOPE), matrix * step.velocity_by_gyroscope * unit);
        put(&mut carry, (VELOCITY, ACCELEROMETER), matrix * step.velocity_by_accelerometer * unit);
        put(&mut carry, (VELOCITY, GRAVITY), DMat3::IDENTITY * dt);
        put(&mut carry, (0, 0), step_back);
        put(&mut carry, (0, 3), step_back * skew(step.position_m) * -unit);
        put(&mut carry, (0, VELOCITY), back * dt);
        put(&mut carry, (0, GYROSCOPE), step_back * step.position_by_gyroscope * unit);
        put(&mut carry, (0, ACCELEROMETER), step_back * step.position_by_accelerometer * unit);
        put(&mut carry, (0, GRAVITY), back * (0.5 * dt * dt));
        let by_unit = back * way;
        for k in 0..3 {
            carry[(VELOCITY + k, UNIT)] = gain[k];
            carry[(k, UNIT)] = by_unit[k];
        }
        let mut by_noise = SMatrix::<f64, N, 9>::zeros();
        put(&mut by_noise, (3, 0), DMat3::IDENTITY);
        put(&mut by_noise, (VELOCITY, 3), matrix * unit);
        put(&mut by_noise, (0, 6), step_back * unit);
        let mut covariance =
            carry * self.covariance * carry.transpose() + by_noise * step.covariance * by_noise.transpose();
        let walks = [
            (GYROSCOPE..ACCELEROMETER, noise.gyroscope_random_walk),
            (ACCELEROMETER..GRAVITY, noise.accelerometer_random_walk),
            (GRAVITY..UNIT, GRAVITY_WALK * unit),
            (UNIT..N, if is_metric { 0.0 } else { UNIT_WALK * unit }),
        ];
        for (range, walk) in walks {
            range.for_each(|k| covariance[(k, k)] += walk * walk * dt);
        }
        let state =
            ImuState { world_from_imu: Pose::new(rotation, position), velocity_m_per_s: velocity, ..self.state };
        Self { state, covariance, ..self.clone() }
    }

    /// Updates with a pose that already combines the prediction and a picture with this information on the right twist.
    fn take(&mut self, world_from_imu: &Pose, picture: &Matrix6<f64>) {
        let before = &self.state.world_from_imu;
        let apart = before.inverse().then(world_from_imu);
        let turn = so3::log(apart.rotation);
        let moved =
            Vector6::new(apart.translation_m.x, apart.translation_m.y, apart.translation_m.z, turn.x, turn.y, turn.z);
        let own = self.covariance.fixed_view::<6, 6>(0, 0).into_owned();
        let Some(own_information) = own.try_inverse() else { return };
        let Some(joined) = (own_information + picture).try_inverse() else { return };
        let gain = self.covariance.fixed_columns::<6>(0) * own_information;
        let step = gain * moved;
        self.covariance -= gain * (own - joined) * gain.transpose();
        self.step(step.as_slice());
        self.state.world_from_imu = *world_from_imu;
        self.hold_gravity();
    }

    /// Measurement update with the known magnitude of gravity in metres.
    fn hold_gravity(&mut self) {
        let length = greater(self.gravity.length(), 1e-6);
        let mut by = SMatrix::<f64, 1, N>::zeros();
        (0..3).for_each(|k| by[GRAVITY + k] = self.gravity[k] / length);
        by[UNIT] = -GRAVITY_M_PER_S2;
        let miss = GRAVITY_M_PER_S2 * self.unit - length;
        let sigma = GRAVITY_SIGMA_M_PER_S2 * self.unit;
        let carried = self.covariance * by.transpose();
        let variance = (by * carried)[0] + sigma * sigma;
        let gain = carried / variance;
        self.covariance -= gain * carried.transpose();
        let step = gain * miss;
        self.step(step.as_slice());
        // Keep the covariance symmetric under rounding.
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }

    fn step(&mut self, step: &[f64]) {
        let at = |k: usize| DVec3::new(step[k], step[k + 1], step[k + 2]);
        let pose = &mut self.state.world_from_imu;
        pose.translation_m += pose.rotation * at(0);
        pose.rotation = (pose.rotation * so3::exp(at(3))).normalize();
        self.state.velocity_m_per_s += at(VELOCITY);
        self.state.bias.gyroscope_rad_per_s += at(GYROSCOPE);
        self.state.bias.accelerometer_m_per_s2 += at(ACCELEROMETER);
        self.gravity += at(GRAVITY);
        self.unit += step[UNIT];
    }
}
