//! The motion that a scenario names, laid into the scene.

use glam::{DQuat, DVec3};

use super::assets::Assets;
use crate::config::Scenario;
use crate::config::check::{unit_quaternion, within};
use crate::error::Error;
use crate::pose::{Pose, TimedPose, parse_tum};
use crate::scene::motion::{KNOT_S, Motion, PlacedSpline, Spline, from_first_sample, without_gaps};
use crate::units::Span;

/// Step of the poses of a generated motion; its fastest part has 0.9 Hz.
const GENERATED_STEP_S: f64 = 0.02;

/// Latest start: the generated motion is made up to it.
const START_S_MAX: f64 = 10_000.0;

/// The scenario's motion over the whole `run`.
///
/// # Errors
/// A file that is no trajectory, a run that leaves its time range, values out of range.
pub fn placed_motion(scenario: &Scenario, run: Span, assets: &dyn Assets) -> Result<Motion, Error> {
    let section = &scenario.motion;
    let turn = unit_quaternion("motion.world_from_motion", section.world_from_motion)?;
    let offset_m = DVec3::from_array(section.offset_m);
    if !offset_m.is_finite() {
        return Err(Error::key("motion.offset_m", format!("{offset_m}"), "finite metres would do"));
    }
    within("motion.start_s", section.start_s, 0.0..=START_S_MAX, "0 to 10,000")?;
    let samples = match (&section.file, section.kind.as_str()) {
        (Some(file), _) => recorded(file, section.start_s, run, assets)?,
        (None, "still") => return Ok(Motion::Still(Pose::new(turn, offset_m))),
        (None, "sway") => sway(section.start_s + run.end_s),
        (None, kind) => return Err(Error::key("motion.kind", kind, "not known; still or sway would do")),
    };
    let scale = within("motion.scale", section.scale, 1e-9..=100.0, "above 0 to 100")?;
    let spline = Spline::fit(&samples, KNOT_S).map_err(|error| error.at_key("motion.file", file_name(scenario)))?;
    let at_start = |error: crate::scene::motion::MotionError| error.at_key("motion.start_s", section.start_s);
    let placed = PlacedSpline::new(spline, section.start_s, scale, offset_m, turn).map_err(at_start)?;
    let motion = Motion::Spline(placed);
    motion.covers(run).map_err(|error| {
        let reason = format!("{error} (times of the run); an earlier start or fewer frames would do");
        Error::key("motion.start_s", section.start_s, reason)
    })?;
    Ok(motion)
}

fn file_name(scenario: &Scenario) -> &str {
    scenario.motion.file.as_deref().unwrap_or("generated motion")
}

fn recorded(file: &str, start_s: f64, run: Span, assets: &dyn Assets) -> Result<Vec<TimedPose>, Error> {
    let refused = |reason: String| Error::key("motion.file", file, reason);
    let bytes = assets.read(file).map_err(|error| error.named_by("motion.file", file))?;
    let text = String::from_utf8(bytes).map_err(|_| refused("is not text".to_owned()))?;
    let poses = parse_tum(&text).map_err(|error| refused(error.to_string()))?;
    let samples = from_first_sample(&poses);
    let asked = Span { start_s: start_s + run.start_s, end_s: start_s + run.end_s };
    let whole = without_gaps(&samples, asked).map_err(|error| {
        let reason = format!(
            "{error}; the run needs {:.3} s to {:.3} s of it: an earlier start or fewer frames would do",
            asked.start_s, asked.end_s
        );
        Error::key("motion.start_s", start_s, reason)
    })?;
    Ok(whole.to_vec())
}

/// A smooth generated motion about the start: a slow walk-like sway of 0.25 m with turns of up to 20 degrees, from sums of sines whose
/// periods have no common multiple within minutes. The body is the rig: x right, y down, z forward, looking along the world's -z.
fn sway(end_s: f64) -> Vec<TimedPose> {
    let steps = crate::num::u32_truncated((end_s + 1.0) / GENERATED_STEP_S) + 4;
    (0..=steps)
        .map(|step| {
            let t_s = f64::from(step) * GENERATED_STEP_S;
            let wave = |frequency_hz: f64| libm::sin(std::f64::consts::TAU * frequency_hz * t_s);
            let place_m = DVec3::new(0.25 * wave(0.23), 0.04 * wave(0.9) + 0.05 * wave(0.31), 0.2 * wave(0.17));
            let (yaw_rad, pitch_rad) = (0.35 * wave(0.19), 0.12 * wave(0.37));
            let about = |axis: DVec3, angle_rad: f64| {
                let (sine, cosine) = libm::sincos(0.5 * angle_rad);
                DQuat::from_xyzw(axis.x * sine, axis.y * sine, axis.z * sine, cosine)
            };
            // Half a turn about x brings z forward to -z and y down to -y.
            let level = about(DVec3::X, std::f64::consts::PI);
            let rotation = about(DVec3::Y, yaw_rad) * about(DVec3::X, pitch_rad) * level;
            TimedPose { t_s, world_from_body: Pose::new(rotation.normalize(), place_m) }
        })
        .collect()
}
