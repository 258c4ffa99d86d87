//! Reads recorded trajectories: the text of a TUM trajectory or of a EuRoC ground-truth table, told apart by content. Returns poses timed
//! from the first, and notes on repairs. What cannot be is refused by line.

use glam::{DQuat, DVec3};

use super::from_first_sample;
use crate::num;
use crate::pose::{LineError, Pose, Repairs, TimedPose, norm_error, read_poses, read_tum};

/// A trajectory as it was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// In rising time, counted from the first.
    pub samples: Vec<TimedPose>,
    /// What was put right, for a person.
    pub notes: Vec<String>,
}

/// A line of a EuRoC table: nanoseconds of its clock and a pose.
pub type EurocPose = (u64, Pose);

/// Reads a trajectory, whichever of the two formats it has.
pub fn parse(text: &str) -> Result<Recording, LineError> {
    let text = crate::text::without_mark(text);
    if is_euroc(text) {
        let (poses, repairs) = parse_euroc(text)?;
        let first_ns = poses.first().map_or(0, |(first_ns, _)| *first_ns);
        // Whole nanoseconds are subtracted before anything is rounded: 1.5e18 of them do not fit a double.
        let timed =
            |(ns, pose): &EurocPose| TimedPose { t_s: num::f64_from_u64(ns - first_ns) / 1e9, world_from_body: *pose };
        return Ok(Recording { samples: poses.iter().map(timed).collect(), notes: repairs.notes() });
    }
    let (poses, repairs) = read_tum(text)?;
    Ok(Recording { samples: from_first_sample(&poses), notes: repairs.notes() })
}

/// EuRoC's table: numbers between commas, the first a whole number of nanoseconds. TUM's times are seconds, so that a table of exactly
/// eight columns is EuRoC's where its header says so or its times have the length of an epoch's nanoseconds.
fn is_euroc(text: &str) -> bool {
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty());
    let Some(line) = lines().find(|line| !line.starts_with('#')) else { return false };
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    let is_whole = !fields[0].is_empty() && fields[0].bytes().all(|byte| byte.is_ascii_digit());
    let says_ns = || lines().take_while(|line| line.starts_with('#')).any(|line| line.contains("[ns]"));
    fields.len() >= 8 && is_whole && (fields.len() > 8 || fields[0].len() >= 13 || says_ns())
}

/// Reads `timestamp_ns, p x y z, q w x y z, ...` lines; `#` starts a comment line, further columns are passed by. Quaternions are
/// renormalised; of repeated time stamps the first is kept. Fails on too few fields, a field that is no finite number, a quaternion far
/// from unit, or time going back; with its line.
pub fn parse_euroc(text: &str) -> Result<(Vec<EurocPose>, Repairs), LineError> {
    read_poses(text, parse_euroc_line)
}

fn parse_euroc_line(line: &str) -> Result<(u64, Pose, f64), String> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    // Velocities and biases may be absent (the Vicon folder's layout); a pose may not.
    if fields.len() < 8 {
        return Err(format!("{} fields; a pose is timestamp, p x y z, q w x y z", fields.len()));
    }
    let shortened = |text: &str| text.chars().take(40).collect::<String>();
    let ns = fields[0].parse();
    let ns = ns.map_err(|_| format!("'{}' is no time stamp in whole nanoseconds", shortened(fields[0])))?;
    let mut values = [0.0; 7];
    for (value, text) in values.iter_mut().zip(&fields[1..]) {
        let parsed = text.parse::<f64>().ok().filter(|value| value.is_finite());
        *value = parsed.ok_or_else(|| format!("'{}' is no finite number", shortened(text)))?;
    }
    let [x, y, z, qw, qx, qy, qz] = values;
    let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
    let norm_error = norm_error(rotation)?;
    Ok((ns, Pose::new(rotation.normalize(), DVec3::new(x, y, z)), norm_error))
}
