//! From the rig's keys to cameras on the body.

use glam::{DQuat, DVec3};

use super::check::{one_of, unit_quaternion, within};
use super::scenario::Scenario;
use crate::error::Error;

impl Scenario {
    /// Rotation from the rig into the body, and the cameras' places along the baseline, in metres.
    ///
    /// # Errors
    /// A quaternion far from unit, a baseline out of range, an unknown inertial unit.
    pub fn cameras(&self) -> Result<(DQuat, Vec<DVec3>), Error> {
        one_of("rig.imu", &self.rig.imu, &[("mems_phone", ()), ("none", ())])?;
        let rotation = unit_quaternion("rig.body_from_rig", self.rig.body_from_rig)?;
        let baseline_m = within("rig.baseline_mm", self.rig.baseline_mm, 0.0..=10_000.0, "0 to 10,000")? * 1e-3;
        if baseline_m == 0.0 {
            return Ok((rotation, vec![DVec3::ZERO]));
        }
        Ok((rotation, vec![DVec3::new(-0.5 * baseline_m, 0.0, 0.0), DVec3::new(0.5 * baseline_m, 0.0, 0.0)]))
    }
}
