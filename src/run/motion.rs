//! The motion that a scenario names, laid into the scene.

use glam::{DQuat, DVec3};

use super::assets::Assets;
use crate::config::Scenario;
use crate::config::check::{unit_quaternion, within};
use crate::config::motion::{MotionSource, STEP_TOLERANCE};
use crate::config::scenario::Motion as MotionKeys;
use crate::error::Error;
use crate::facts::readable;
use crate::num::{f64_from_usize, greater, lesser};
use crate::pose::{Pose, TimedPose};
use crate::scene::motion::gait::{self, GENERATED_KNOT_S, generated};
use crate::scene::motion::recording::{self, Recording};
use crate::scene::motion::{
    GAP_S_MAX, KNOT_S, Motion, MotionError, PlacedSpline, Spline, from_first_sample, gaps_within, without_gaps,
};
use crate::units::Span;

/// Step of the poses of the sway; its fastest part has 0.9 Hz.
const SWAY_STEP_S: f64 = 0.02;

/// Knots a period of an oscillation: it then misses (2 pi / 20)^4 / 30 = 3e-4 of its height at most.
const OSCILLATION_KNOTS: f64 = 20.0;

/// Latest start: generated motions are made up to it.
const START_S_MAX: f64 = 10_000.0;

/// Knots of a generated motion, at most: 56 bytes each, and as much again while they are made.
const KNOTS_MAX: f64 = 4e6;

/// Poses of a sway, at most: some 250 bytes each while the spline is fitted to them.
const SWAY_POSES_MAX: f64 = 2e6;

/// Greatest distance from the scene's origin along an axis: meshes end there too.
const POSITION_M_MAX: f64 = 1e6;

/// Greatest speeds, in m/s and in rad/s: beyond them a picture shows nothing.
const SPEEDS_MAX: [f64; 2] = [1e6, 1e6];

/// A motion, and what a person should know of it.
pub struct NotedMotion {
    /// Over the whole run.
    pub motion: Motion,
    /// What was put right or bridged.
    pub notes: Vec<String>,
}

/// The scenario's motion over the whole `run`. Fails on a file that is no trajectory, a run that leaves its time range, values out of
/// range.
pub fn placed_motion(scenario: &Scenario, run: Span, assets: &dyn Assets) -> Result<NotedMotion, Error> {
    placed(&scenario.motion, scenario.run.frames, run, assets)
}

/// The motion of a section's keys over the whole `run` of so many frames.
pub fn placed(section: &MotionKeys, frames: u32, run: Span, assets: &dyn Assets) -> Result<NotedMotion, Error> {
    let turn = unit_quaternion("motion.world_from_motion", section.world_from_motion)?;
    let offset_m = DVec3::from_array(section.offset_m);
    if !is_in_reach(offset_m) {
        let reason = format!("out of range; use -{POSITION_M_MAX} to {POSITION_M_MAX} along each axis");
        return Err(Error::key("motion.offset_m", format!("{:?}", section.offset_m), reason));
    }
    let start_s = within("motion.start_s", section.start_s, 0.0..=START_S_MAX, "0 to 10,000")?;
    let scale = section.factor()?;
    let asked = Span { start_s: start_s + run.start_s, end_s: start_s + run.end_s };
    let Some((spline, notes)) = spline(section, frames, asked, assets)? else {
        return Ok(NotedMotion { motion: Motion::Still(Pose::new(turn, offset_m)), notes: Vec::new() });
    };
    let at_start = |error: MotionError| error.at_key("motion.start_s", start_s);
    let motion = Motion::Spline(PlacedSpline::new(spline, start_s, scale, offset_m, turn).map_err(at_start)?);
    motion.covers(run).map_err(|error| {
        let reason = format!("{error} (times of the run); use an earlier start or fewer frames");
        Error::key("motion.start_s", start_s, reason)
    })?;
    check_reach(section, &motion, run)?;
    Ok(NotedMotion { motion, notes })
}

fn is_in_reach(position_m: DVec3) -> bool {
    position_m.abs().cmple(DVec3::splat(POSITION_M_MAX)).all()
}

/// Refuses a path that leaves the space that scenes have, or on which no picture could be taken.
fn check_reach(section: &MotionKeys, motion: &Motion, run: Span) -> Result<(), Error> {
    let named = section.file.as_deref().or(section.kind.as_deref()).unwrap_or_default();
    let key = if section.file.is_some() { "motion.file" } else { "motion.kind" };
    let refused = |reason: String| Error::key(key, named, reason);
    let (low_m, high_m) = motion.extent_m(run).map_err(|error| refused(error.to_string()))?;
    if !(is_in_reach(low_m) && is_in_reach(high_m)) {
        return Err(refused(format!(
            "the run's path goes from {low_m} to {high_m} m; use one within {POSITION_M_MAX} m of the scene's origin along each axis, \
             or a smaller motion.scale"
        )));
    }
    let speeds = motion.speeds_max(run).map_err(|error| refused(error.to_string()))?;
    if !(speeds[0] <= SPEEDS_MAX[0] && speeds[1] <= SPEEDS_MAX[1]) {
        let ([speed, turn], [speed_max, turn_max]) = (speeds.map(readable), SPEEDS_MAX);
        return Err(refused(format!(
            "the run's path has {speed} m/s and {turn} rad/s; use one of at most {speed_max} m/s and {turn_max} rad/s"
        )));
    }
    Ok(())
}

/// The spline of the scenario's source over `asked`, in the source's own frame and time, with notes; none where nothing moves.
fn spline(
    section: &MotionKeys,
    frames: u32,
    asked: Span,
    assets: &dyn Assets,
) -> Result<Option<(Spline, Vec<String>)>, Error> {
    let check_end = |end_s_max: f64| {
        if asked.end_s <= end_s_max {
            return Ok(());
        }
        let reason = format!(
            "the run ends {:.0} s into a generated motion; use fewer frames, a higher frame rate or an earlier start, so that it ends \
             within {end_s_max:.0} s",
            asked.end_s
        );
        Err(Error::key("run.frames", frames, reason))
    };
    let follow = |knot_s: f64, pose: &dyn Fn(f64) -> Pose| {
        check_end(KNOTS_MAX * knot_s)?;
        Ok((generated(pose, knot_s, asked.end_s), Vec::new()))
    };
    let made = match section.source()? {
        MotionSource::Still => return Ok(None),
        MotionSource::Recording { file, bridge_gaps_s } => recorded(file, bridge_gaps_s, asked, assets),
        MotionSource::ControlFile(file) => {
            let Recording { samples, notes } = read(file, assets)?;
            on_control_poses("motion.file", file, &samples).map(|spline| (spline, notes))
        }
        MotionSource::ControlPoses(poses) => {
            let count = format!("{} poses", poses.len());
            on_control_poses("motion.pose", &count, &poses).map(|spline| (spline, Vec::new()))
        }
        MotionSource::Sway => {
            check_end(SWAY_POSES_MAX * SWAY_STEP_S)?;
            Spline::fit(&sway(asked.end_s), KNOT_S)
                .map(|spline| (spline, Vec::new()))
                .map_err(|error| error.at_key("motion.kind", "sway"))
        }
        MotionSource::Gait(gait) => follow(GENERATED_KNOT_S, &|t_s| gait.pose(t_s)),
        MotionSource::Spin { rate_deg_per_s } => follow(GENERATED_KNOT_S, &|t_s| gait::spin(rate_deg_per_s, t_s)),
        MotionSource::Oscillation { height_m, frequency_hz, axis } => {
            let knot_s = lesser(GENERATED_KNOT_S, 1.0 / (OSCILLATION_KNOTS * frequency_hz));
            follow(knot_s, &|t_s| gait::oscillation(height_m, frequency_hz, axis, t_s))
        }
    };
    made.map(Some)
}

fn read(file: &str, assets: &dyn Assets) -> Result<Recording, Error> {
    let refused = |reason: String| Error::key("motion.file", file, reason);
    let bytes = assets.read(file).map_err(|error| error.named_by("motion.file", file))?;
    let text = crate::text::from_bytes(bytes).map_err(&refused)?;
    let recording = recording::parse(&text).map_err(|error| refused(error.to_string()))?;
    if recording.samples.is_empty() {
        return Err(refused("has no pose; use a recording, a pose a line".to_owned()));
    }
    Ok(recording)
}

fn recorded(file: &str, bridge_gaps_s: f64, asked: Span, assets: &dyn Assets) -> Result<(Spline, Vec<String>), Error> {
    let Recording { samples, mut notes } = read(file, assets)?;
    let gap_s_max = greater(bridge_gaps_s, GAP_S_MAX);
    let whole = without_gaps(&samples, asked, gap_s_max).map_err(|error| {
        let reason = format!(
            "{error}; the run needs {:.3} s to {:.3} s of it: use an earlier start or fewer frames",
            asked.start_s, asked.end_s
        );
        Error::key("motion.start_s", asked.start_s, reason)
    })?;
    let spline = Spline::fit_over_gaps(whole, KNOT_S, gap_s_max);
    for (at_s, length_s) in gaps_within(whole, asked) {
        notes.push(format!("a gap of {length_s:.3} s at {at_s:.3} s is bridged by the path of least acceleration"));
    }
    Ok((spline.map_err(|error| error.at_key("motion.file", file))?, notes))
}

/// The spline on poses at even times, counted from the first.
fn on_control_poses(key: &str, value: &str, poses: &[TimedPose]) -> Result<Spline, Error> {
    let refused = |reason: String| Error::key(key, value, reason);
    let poses = from_first_sample(poses);
    let [first, .., last] = poses.as_slice() else {
        return Err(refused(MotionError::TooFewSamples { count: poses.len() }.to_string()));
    };
    let step_s = (last.t_s - first.t_s) / f64_from_usize(poses.len() - 1);
    for (index, pose) in poses.iter().enumerate() {
        let even_s = f64_from_usize(index) * step_s;
        if !((pose.t_s - even_s).abs() <= STEP_TOLERANCE * step_s && step_s > 0.0) {
            let reason = format!(
                "control pose {index} stands at {:.6} s after the first; use {even_s:.6} s: control poses are evenly spaced",
                pose.t_s
            );
            return Err(refused(reason));
        }
    }
    let poses: Vec<Pose> = poses.iter().map(|pose| pose.world_from_body).collect();
    Spline::on_control_poses(0.0, step_s, &poses).map_err(|error| error.at_key(key, value))
}

/// A smooth generated motion about the start: a slow walk-like sway of 0.25 m with turns of up to 20 degrees, from sums of sines whose
/// periods have no common multiple within minutes. The body is the rig: x right, y down, z forward, looking along the world's -z.
fn sway(end_s: f64) -> Vec<TimedPose> {
    let steps = crate::num::u32_truncated((end_s + 1.0) / SWAY_STEP_S) + 4;
    (0..=steps)
        .map(|step| {
            let t_s = f64::from(step) * SWAY_STEP_S;
            let wave = |frequency_hz: f64| libm::sin(std::f64::consts::TAU * frequency_hz * t_s);
            let position_m = DVec3::new(0.25 * wave(0.23), 0.04 * wave(0.9) + 0.05 * wave(0.31), 0.2 * wave(0.17));
            let (yaw_rad, pitch_rad) = (0.35 * wave(0.19), 0.12 * wave(0.37));
            let about = |axis: DVec3, angle_rad: f64| {
                let (sine, cosine) = libm::sincos(0.5 * angle_rad);
                DQuat::from_xyzw(axis.x * sine, axis.y * sine, axis.z * sine, cosine)
            };
            // Half a turn about x brings z forward to -z and y down to -y.
            let level = about(DVec3::X, std::f64::consts::PI);
            let rotation = about(DVec3::Y, yaw_rad) * about(DVec3::X, pitch_rad) * level;
            TimedPose { t_s, world_from_body: Pose::new(rotation.normalize(), position_m) }
        })
        .collect()
}
