//! Converts the motion keys of a scenario to one checked source of motion. Refuses keys that the chosen source does not read.

use glam::{DQuat, DVec3};

use super::check::{one_of, within};
use super::presets::DEFAULTS;
use super::resolved::Resolved;
use super::rig::orientation;
use super::scenario::{Motion, MotionPose, ObjectMotion};
use crate::draw::DrawKey;
use crate::error::Error;
use crate::num;
use crate::pose::{Pose, TimedPose};
use crate::scene::motion::gait::{Gait, RUN, WALK};
use crate::scene::motion::path::PathShape;

/// Control poses may stand this share of a step from their even times: times of an epoch in a double do.
pub const STEP_TOLERANCE: f64 = 1e-3;

/// A body that looks level along -z with y up: half a turn about x.
const LEVEL: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);

/// What moves the rig.
pub enum MotionSource<'a> {
    /// A recording, followed closely; gaps up to `bridge_gaps_s` are bridged.
    Recording {
        /// In the scenario's folder.
        file: &'a str,
        /// 0: none.
        bridge_gaps_s: f64,
    },
    /// Control poses of a file.
    ControlFile(&'a str),
    /// Control poses.
    ControlPoses(Vec<TimedPose>),
    /// Nothing.
    Still,
    /// A sine on the spot.
    Oscillation {
        /// Height of the sine.
        height_m: f64,
        /// Its frequency.
        frequency_hz: f64,
        /// Its axis.
        axis: DVec3,
    },
    /// A slow sway.
    Sway,
    /// Walking or running.
    Gait(Box<Gait>),
    /// Turning to the right on the spot.
    Spin {
        /// Constant.
        rate_deg_per_s: f64,
    },
}

impl Motion {
    /// What moves the rig, or an object. Fails on a kind that is not known or does not go with a file, values out of range.
    pub fn source(&self) -> Result<MotionSource<'_>, Error> {
        match (self.file.as_deref(), self.kind.as_deref()) {
            (Some(file), None) => {
                let would_do = "0 (none) to 2";
                let bridge_gaps_s = within("motion.bridge_gaps_s", self.bridge_gaps_s, 0.0..=2.0, would_do)?;
                Ok(MotionSource::Recording { file, bridge_gaps_s })
            }
            (Some(file), Some("spline")) => Ok(MotionSource::ControlFile(file)),
            (Some(_), Some(kind)) => {
                let reason = "does not go with a file; leave one of the two out, or use spline";
                Err(Error::key("motion.kind", kind, reason))
            }
            (None, None | Some("still")) => self.still(),
            (None, Some("sway")) => Ok(MotionSource::Sway),
            (None, Some("spline")) => Ok(MotionSource::ControlPoses(control_poses(self)?)),
            (None, Some("walk" | "run")) => Ok(MotionSource::Gait(Box::new(self.gait()?))),
            (None, Some("spin")) => {
                let would_do = "-1,800 to 1,800";
                let rate_deg_per_s = within("motion.rate_deg_per_s", self.rate_deg_per_s, -1800.0..=1800.0, would_do)?;
                Ok(MotionSource::Spin { rate_deg_per_s })
            }
            (None, Some(kind)) => {
                let reason = "not known; use still or sway, walk, run, spin or spline";
                Err(Error::key("motion.kind", kind, reason))
            }
        }
    }

    /// Factor on the source's translation: `motion.scale`, or 1 where the source's own keys state metres.
    pub fn factor(&self) -> Result<f64, Error> {
        let scale = within("motion.scale", self.scale, 1e-9..=100.0, "1e-9 to 100")?;
        let states_metres = matches!(self.source()?, MotionSource::Oscillation { .. } | MotionSource::Gait(_));
        Ok(if states_metres { 1.0 } else { scale })
    }

    fn still(&self) -> Result<MotionSource<'_>, Error> {
        let height_mm = within("motion.oscillation_mm", self.oscillation_mm, 0.0..=1000.0, "0 to 1,000")?;
        let frequency_hz = within("motion.oscillation_hz", self.oscillation_hz, 0.01..=50.0, "0.01 to 50")?;
        let axes = [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z)];
        let axis = one_of("motion.oscillation_axis", &self.oscillation_axis, &axes)?;
        if height_mm == 0.0 {
            return Ok(MotionSource::Still);
        }
        Ok(MotionSource::Oscillation { height_m: height_mm * 1e-3, frequency_hz, axis })
    }

    fn gait(&self) -> Result<Gait, Error> {
        let mut figures = if self.kind.as_deref() == Some("run") { RUN } else { WALK };
        if let Some(speed) = self.speed_m_per_s {
            figures.speed_m_per_s = within("motion.speed_m_per_s", speed, 1e-3..=20.0, "0.001 to 20")?;
        }
        if let Some(rate_hz) = self.step_rate_hz {
            figures.step_rate_hz = within("motion.step_rate_hz", rate_hz, 0.5..=4.0, "0.5 to 4")?;
        }
        // Eight waves of the wander can stand together at four standard deviations: steps must not go backwards.
        let most_hz = num::lesser(0.3, 0.2 * figures.step_rate_hz);
        let would_do = format!("0 to {most_hz}");
        figures.step_rate_sd_hz = within("motion.step_rate_sd_hz", self.step_rate_sd_hz, 0.0..=most_hz, &would_do)?;
        let radius_m = within("motion.radius_m", self.radius_m, 0.1..=10_000.0, "0.1 to 10,000")?;
        let paths =
            [("line", PathShape::Line), ("circle", PathShape::Circle(radius_m)), ("loop", PathShape::eight(radius_m))];
        let path = one_of("motion.path", &self.path, &paths)?;
        Ok(Gait::new(figures, path, DrawKey::root(self.seed)))
    }
}

impl ObjectMotion {
    /// The same as a motion of the rig is written, with the defaults of what is not given.
    pub fn motion(&self) -> Result<Motion, Error> {
        let refused = |error: String| Error::Run(format!("an object's motion: {error}"));
        let mut defaults: toml::Table = toml::from_str(DEFAULTS).map_err(|error| refused(error.to_string()))?;
        let Some(toml::Value::Table(mut keys)) = defaults.remove("motion") else {
            return Err(refused("no defaults".to_owned()));
        };
        let given = toml::Table::try_from(self).map_err(|error| refused(error.to_string()))?;
        if given.contains_key("file") {
            keys.remove("kind");
        }
        keys.extend(given);
        keys.try_into().map_err(|error: toml::de::Error| refused(error.to_string()))
    }
}

fn control_poses(section: &Motion) -> Result<Vec<TimedPose>, Error> {
    let poses = section.pose.as_deref().unwrap_or_default();
    if poses.len() < 4 {
        let reason = "too few control poses; use 4 or more of [[motion.pose]], or a file of them";
        return Err(Error::key("motion.pose", format!("{} poses", poses.len()), reason));
    }
    poses.iter().enumerate().map(|(number, pose)| control_pose(number, pose)).collect()
}

fn control_pose(number: usize, pose: &MotionPose) -> Result<TimedPose, Error> {
    let key = |name: &str| format!("motion.pose.{number}.{name}");
    within(&key("t_s"), pose.t_s, -1e10..=1e10, "finite seconds")?;
    let position_m = DVec3::from_array(pose.position_m);
    if !position_m.is_finite() {
        return Err(Error::key(&key("position_m"), format!("{position_m}"), "use finite metres"));
    }
    let key = key("orientation");
    let turned = match pose.orientation {
        Some(xyzw) => orientation(&key, Some(xyzw), pose.yaw_pitch_roll_deg)?,
        None => orientation(&key, None, pose.yaw_pitch_roll_deg)?.map(|turned| (LEVEL * turned).normalize()),
    };
    Ok(TimedPose { t_s: pose.t_s, world_from_body: Pose::new(turned.unwrap_or(LEVEL), position_m) })
}

/// Keys that nothing reads under the chosen motion and IMU, and what would make them act.
pub(super) fn check_idle(resolved: &Resolved) -> Result<(), Error> {
    let (section, rig) = (&resolved.scenario.motion, &resolved.scenario.rig);
    let kind = section.kind.as_deref().unwrap_or_default();
    let gait = ["walk", "run"].contains(&kind);
    let closed = gait && section.path != "line";
    let oscillates = kind == "still" && section.oscillation_mm > 0.0;
    let fitted = section.file.is_some() && kind.is_empty();
    let poses = section.file.is_none() && kind == "spline";
    let gait_keys =
        ["path", "speed_m_per_s", "step_rate_hz", "step_rate_sd_hz", "seed"].map(|key| format!("motion.{key}"));
    let gait_keys: Vec<&str> = gait_keys.iter().map(String::as_str).collect();
    let groups: [(bool, &str, &[&str]); 8] = [
        (fitted, "a recorded motion.file", &["motion.bridge_gaps_s"]),
        (poses, "motion.kind = \"spline\" without a file", &["motion.pose"]),
        (gait, "motion.kind = \"walk\" or \"run\"", &gait_keys),
        (closed, "a walk or run with motion.path = \"circle\" or \"loop\"", &["motion.radius_m"]),
        (kind == "spin", "motion.kind = \"spin\"", &["motion.rate_deg_per_s"]),
        (kind == "still", "motion.kind = \"still\"", &["motion.oscillation_mm"]),
        (oscillates, "motion.oscillation_mm above 0", &["motion.oscillation_hz", "motion.oscillation_axis"]),
        (rig.imu != "none", "an IMU", &["rig.imu_rate_hz", "rig.imu_position_mm"]),
    ];
    for (is_on, would_do, keys) in groups {
        keys.iter().try_for_each(|key| resolved.check_idle(!is_on, key, would_do))?;
    }
    Ok(())
}
