//! IMU readings of a run: simulates them with their truth from the motion, and gives each frame its share for the tracker.

use super::setup::Setup;
use crate::draw::DrawKey;
use crate::error::Error;
use crate::scene::motion::imu::{GRAVITY_IN_WORLD_M_PER_S2, ImuNoise, ImuSample, samples};
use crate::tracker::{ImuCalibration, ImuMeasurement, Noise};
use crate::units::Span;

/// Published number of the IMU's noise in keys.
const IMU_NUMBER: u64 = 2;

/// Readings of a run, handed out frame by frame.
#[derive(Default)]
pub(super) struct ImuReadings {
    readings: Vec<ImuMeasurement>,
    next: usize,
}

impl ImuReadings {
    /// All readings of a run whose tracker uses them, else none.
    pub fn of(setup: &Setup) -> Result<Self, Error> {
        if !setup.uses_imu {
            return Ok(Self::default());
        }
        let reading = |sample: ImuSample| ImuMeasurement {
            t_s: sample.t_s,
            angular_velocity_rad_per_s: sample.angular_velocity_rad_per_s,
            acceleration_m_per_s2: sample.acceleration_m_per_s2,
        };
        let readings = setup.imu_samples(setup.end_s())?.into_iter().map(reading).collect();
        Ok(Self { readings, next: 0 })
    }

    /// Readings since the previous frame, up to the first one after a time.
    pub fn until(&mut self, t_s: f64) -> &[ImuMeasurement] {
        let to = self.readings.partition_point(|reading| reading.t_s <= t_s) + 1;
        let range = self.next..to.min(self.readings.len()).max(self.next);
        self.next = range.end;
        &self.readings[range]
    }
}

/// The IMU's noise as the tracker takes it.
pub fn noise_of(noise: &ImuNoise) -> Noise {
    Noise {
        gyroscope_noise_density: noise.gyroscope_noise_density,
        accelerometer_noise_density: noise.accelerometer_noise_density,
        gyroscope_random_walk: noise.gyroscope_random_walk,
        accelerometer_random_walk: noise.accelerometer_random_walk,
    }
}

impl Setup {
    /// Readings of the rig's IMU from the start of the run to a time; none without a unit. Fails on a motion that ends before.
    pub fn imu_samples(&self, end_s: f64) -> Result<Vec<ImuSample>, Error> {
        let Some(imu) = &self.imu else { return Ok(Vec::new()) };
        let key = DrawKey::root(self.resolved.scenario.seed).with(IMU_NUMBER);
        let span = Span { start_s: 0.0, end_s };
        samples(&self.motion, span, imu, GRAVITY_IN_WORLD_M_PER_S2, key).map_err(|error| Error::Run(error.to_string()))
    }

    /// The IMU calibration for the tracker, if it uses the IMU.
    pub(super) fn imu_calibration(&self) -> Option<ImuCalibration> {
        let of = |imu: &crate::scene::motion::imu::Imu| ImuCalibration {
            body_from_imu: imu.body_from_imu,
            noise: noise_of(&imu.noise),
        };
        self.imu.as_ref().filter(|_| self.uses_imu).map(of)
    }
}
