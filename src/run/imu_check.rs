//! Checks of a recorded IMU against the span of a run.

use crate::error::Error;
use crate::scene::motion::imu::Imu;

/// Largest number of readings of a run; all are kept in memory.
const READINGS_MAX: f64 = 5e6;

/// Refuses an IMU that gives more readings in a run than fit. Fails on too high a rate for the run's length.
pub(super) fn check_readings(imu: Option<&Imu>, end_s: f64) -> Result<(), Error> {
    let Some(imu) = imu.filter(|imu| imu.noise.rate_hz * end_s > READINGS_MAX) else { return Ok(()) };
    let most_hz = (READINGS_MAX / end_s).floor();
    let slower = if most_hz >= 1.0 { format!("use {most_hz} or less, ") } else { String::new() };
    let reason = format!(
        "the run of {end_s:.0} s would have more than {READINGS_MAX} readings; {slower}use fewer frames, or rig.imu = \"none\""
    );
    Err(Error::key("rig.imu_rate_hz", imu.noise.rate_hz, reason))
}
