//! From the rig's keys to cameras and an IMU on the body.

use glam::{DQuat, DVec3};

use super::check::{one_of, unit_quaternion, within};
use super::scenario::{RigCamera, Scenario};
use crate::error::Error;
use crate::pose::Pose;
use crate::scene::motion::imu::{ADIS16448, IDEAL, Imu, MEMS_PHONE};
use crate::so3;

/// Furthest position on a rig, along an axis.
const POSITION_MM_MAX: f64 = 10_000.0;

/// Cameras of a rig, at most.
const CAMERAS_MAX: usize = 16;

impl Scenario {
    /// Where each camera sits on the body. Fails on a quaternion far from unit, a baseline or position out of range, two ways to say one
    /// thing, no camera or too many.
    pub fn cameras(&self) -> Result<Vec<Pose>, Error> {
        let rig = &self.rig;
        let rotation = unit_quaternion("rig.body_from_rig", rig.body_from_rig)?;
        let cameras = match (rig.baseline_mm, &rig.camera) {
            (Some(baseline_mm), None) => return along_baseline(rotation, baseline_mm),
            (None, Some(cameras)) => cameras,
            (Some(baseline_mm), Some(_)) => {
                let reason = "rig.camera is written too; use either these or a baseline";
                return Err(Error::key("rig.baseline_mm", baseline_mm, reason));
            }
            (None, None) => return Err(Error::key("rig.baseline_mm", "", "is missing; give this, or cameras")),
        };
        let would_do = format!("1 to {CAMERAS_MAX} of [[rig.camera]]");
        within("rig.camera", cameras.len(), 1..=CAMERAS_MAX, &would_do)?;
        cameras.iter().enumerate().map(|(number, camera)| placed(rotation, number, camera)).collect()
    }

    /// The IMU on the body, if there is one. Fails on an unknown preset, a rate or position out of range.
    pub fn imu(&self) -> Result<Option<Imu>, Error> {
        let rig = &self.rig;
        let presets =
            [("mems_phone", Some(MEMS_PHONE)), ("adis16448", Some(ADIS16448)), ("ideal", Some(IDEAL)), ("none", None)];
        let preset = one_of("rig.imu", &rig.imu, &presets)?;
        let rate_hz = within("rig.imu_rate_hz", rig.imu_rate_hz, 1.0..=10_000.0, "1 to 10,000")?;
        let position_m = position_m("rig.imu_position_mm", rig.imu_position_mm)?;
        let body_from_rig = unit_quaternion("rig.body_from_rig", rig.body_from_rig)?;
        Ok(preset.map(|mut noise| {
            noise.rate_hz = rate_hz;
            Imu { noise, body_from_imu: Pose::new(DQuat::IDENTITY, body_from_rig * position_m) }
        }))
    }
}

fn along_baseline(rotation: DQuat, baseline_mm: f64) -> Result<Vec<Pose>, Error> {
    let baseline_m = within("rig.baseline_mm", baseline_mm, 0.0..=10_000.0, "0 to 10,000")? * 1e-3;
    let at = |x_m: f64| Pose::new(rotation, rotation * DVec3::new(x_m, 0.0, 0.0));
    if baseline_m == 0.0 { Ok(vec![at(0.0)]) } else { Ok(vec![at(-0.5 * baseline_m), at(0.5 * baseline_m)]) }
}

fn placed(body_from_rig: DQuat, number: usize, camera: &RigCamera) -> Result<Pose, Error> {
    let key = |name: &str| format!("rig.camera.{number}.{name}");
    let position_m = position_m(&key("position_mm"), camera.position_mm)?;
    let turned = orientation(&key("orientation"), camera.orientation, camera.yaw_pitch_roll_deg)?;
    let rotation = turned.map_or(body_from_rig, |turned| (body_from_rig * turned).normalize());
    Ok(Pose::new(rotation, body_from_rig * position_m))
}

fn position_m(key: &str, position_mm: [f64; 3]) -> Result<DVec3, Error> {
    if position_mm.iter().all(|axis_mm| axis_mm.abs() <= POSITION_MM_MAX) {
        return Ok(DVec3::from_array(position_mm) * 1e-3);
    }
    Err(Error::key(
        key,
        format!("{position_mm:?}"),
        format!("out of range; use -{POSITION_MM_MAX} to {POSITION_MM_MAX}"),
    ))
}

/// An orientation from its quaternion x y z w, or from angles that turn x right, y down, z forward: to the right about y, then nose up
/// about x, then clockwise about z. None where neither is given. Fails where both are given, and on a quaternion far from unit, angles
/// that are not finite.
pub(super) fn orientation(
    key: &str,
    xyzw: Option<[f64; 4]>,
    yaw_pitch_roll_deg: Option<[f64; 3]>,
) -> Result<Option<DQuat>, Error> {
    match (xyzw, yaw_pitch_roll_deg) {
        (None, None) => Ok(None),
        (Some(xyzw), None) => unit_quaternion(key, xyzw).map(Some),
        (Some(xyzw), Some(_)) => {
            let reason = "stands beside yaw_pitch_roll_deg; use one of the two";
            Err(Error::key(key, format!("{xyzw:?}"), reason))
        }
        (None, Some(degrees)) => {
            if !degrees.iter().all(|degrees| degrees.abs() <= 360.0) {
                let key = key.replace("orientation", "yaw_pitch_roll_deg");
                return Err(Error::key(&key, format!("{degrees:?}"), "use angles of -360 to 360"));
            }
            let [yaw, pitch, roll] = degrees.map(f64::to_radians);
            let turn = so3::exp(DVec3::Y * yaw) * so3::exp(DVec3::X * pitch) * so3::exp(DVec3::Z * roll);
            Ok(Some(turn.normalize()))
        }
    }
}
