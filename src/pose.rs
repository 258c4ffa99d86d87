//! Rigid transforms `a_from_b`, time-stamped poses, and the TUM trajectory format.
//!
//! Quaternions are unit; lengths are metres; a pose `world_from_body` maps points of the body into the world.

use std::fmt::Write as _;

use glam::{DQuat, DVec3};

/// A rotation followed by a translation: `p_a = rotation * p_b + translation_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Metres, in the target frame.
    pub translation_m: DVec3,
}

impl Pose {
    /// Maps every point to itself.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation_m: DVec3::ZERO };

    /// A pose from its parts. The rotation must be a unit quaternion.
    pub fn new(rotation: DQuat, translation_m: DVec3) -> Self {
        Self { rotation, translation_m }
    }

    /// The transform of a point.
    pub fn point(&self, point_m: DVec3) -> DVec3 {
        self.rotation * point_m + self.translation_m
    }

    /// The rotation of a direction.
    pub fn direction(&self, direction: DVec3) -> DVec3 {
        self.rotation * direction
    }

    /// `b_from_a` of `a_from_b`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { rotation, translation_m: -(rotation * self.translation_m) }
    }

    /// `a_from_c` of `a_from_b` (self) and `b_from_c`. Renormalises, so long chains stay rigid.
    pub fn then(&self, b_from_c: &Self) -> Self {
        Self {
            rotation: (self.rotation * b_from_c.rotation).normalize(),
            translation_m: self.point(b_from_c.translation_m),
        }
    }

    /// Angle of the rotation in radians, within 0..=pi; well behaved at both ends.
    pub fn angle_rad(&self) -> f64 {
        2.0 * libm::atan2(self.rotation.xyz().length(), self.rotation.w.abs())
    }
}

/// A pose at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedPose {
    /// Seconds.
    pub t_s: f64,
    /// Where the body is.
    pub world_from_body: Pose,
}

/// Why a line of a trajectory file was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct LineError {
    /// Counted from 1.
    pub line: usize,
    /// What is wrong with it, and an accepted value.
    pub reason: String,
}

/// A quaternion's norm may be off by this much (four-decimal files are) before its line is refused.
pub const QUATERNION_NORM_TOLERANCE: f64 = 5e-3;

/// Quaternions further from unit length than this are worth a note; numbers of five decimals and more stay below.
const NORM_NOTE: f64 = 1e-5;

/// What a reader of a trajectory had to put right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Repairs {
    /// Lines that repeated the time stamp before them; the first of each was kept.
    pub repeated: usize,
    /// Greatest distance of a quaternion's length from 1, before it was normalised.
    pub norm_error: f64,
}

impl Repairs {
    /// In words; nothing where nothing of note was found.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.repeated > 0 {
            let lines = self.repeated;
            notes.push(format!("{lines} line(s) repeat a time stamp: the first pose of each was kept"));
        }
        if self.norm_error > NORM_NOTE {
            notes.push(format!("quaternions up to {:.1e} off unit length were normalised", self.norm_error));
        }
        notes
    }
}

/// How far a quaternion's length is from 1. Fails on what is further than [`QUATERNION_NORM_TOLERANCE`], in words.
pub fn norm_error(rotation: DQuat) -> Result<f64, String> {
    let norm = rotation.length();
    let error = (norm - 1.0).abs();
    if error <= QUATERNION_NORM_TOLERANCE {
        return Ok(error);
    }
    Err(format!("a quaternion of norm {norm:.4}; use 1 to within {QUATERNION_NORM_TOLERANCE}"))
}

/// Reads `t tx ty tz qx qy qz qw` lines; `#` starts a comment. Quaternions are renormalised; of repeated time stamps the
/// first is kept. Fails on a line with a wrong number of fields, a field that is no finite number, a quaternion far from unit, or time
/// going back.
pub fn parse_tum(text: &str) -> Result<Vec<TimedPose>, LineError> {
    read_tum(text).map(|(poses, _)| poses)
}

/// As [`parse_tum`], with what had to be put right.
pub fn read_tum(text: &str) -> Result<(Vec<TimedPose>, Repairs), LineError> {
    let (poses, repairs) = read_poses(text, parse_tum_line)?;
    Ok((poses.into_iter().map(|(t_s, world_from_body)| TimedPose { t_s, world_from_body }).collect(), repairs))
}

/// Reads a time, a pose and its quaternion's distance from unit length from each line; `#` starts a comment line. Of repeated times the
/// first is kept. Fails on a line that `parse_line` refuses, and on time going back; with the line.
pub fn read_poses<T: Copy + PartialOrd + std::fmt::Display>(
    text: &str,
    parse_line: impl Fn(&str) -> Result<(T, Pose, f64), String>,
) -> Result<(Vec<(T, Pose)>, Repairs), LineError> {
    let mut poses: Vec<(T, Pose)> = Vec::new();
    let mut repairs = Repairs::default();
    for (index, line) in crate::text::without_mark(text).lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let refused = |reason: String| LineError { line: index + 1, reason };
        let (time, pose, norm_error) = parse_line(line).map_err(refused)?;
        match poses.last() {
            Some((last, _)) if time < *last => {
                return Err(refused(format!("time goes back from {last} to {time}; use rising times")));
            }
            Some((last, _)) if time == *last => repairs.repeated += 1,
            _ => poses.push((time, pose)),
        }
        repairs.norm_error = crate::num::greater(repairs.norm_error, norm_error);
    }
    Ok((poses, repairs))
}

fn parse_tum_line(line: &str) -> Result<(f64, Pose, f64), String> {
    let mut fields = [0.0_f64; 8];
    let mut count = 0;
    for text in line.split([' ', '\t', ',']).filter(|text| !text.is_empty()) {
        let shortened = || text.chars().take(40).collect::<String>();
        let value: f64 = text.parse().map_err(|_| format!("'{}' is not a number", shortened()))?;
        if !value.is_finite() {
            return Err(format!("'{}' is not finite", shortened()));
        }
        *fields.get_mut(count).ok_or("more than 8 fields; a pose is t tx ty tz qx qy qz qw")? = value;
        count += 1;
    }
    if count != 8 {
        return Err(format!("{count} fields; a pose is t tx ty tz qx qy qz qw"));
    }
    let [t_s, x, y, z, qx, qy, qz, qw] = fields;
    let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
    let norm_error = norm_error(rotation)?;
    Ok((t_s, Pose::new(rotation.normalize(), DVec3::new(x, y, z)), norm_error))
}

/// Writes TUM lines with twelve decimals, so that a reader loses nothing that matters.
pub fn format_tum(poses: &[TimedPose]) -> String {
    let mut text = String::from("# timestamp_s tx_m ty_m tz_m qx qy qz qw\n");
    for TimedPose { t_s, world_from_body } in poses {
        let (t, q) = (world_from_body.translation_m, world_from_body.rotation);
        writeln!(text, "{t_s:.9} {:.12} {:.12} {:.12} {:.12} {:.12} {:.12} {:.12}", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
            .expect("writing to a string cannot fail");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_after_its_inverse_is_the_identity() {
        let pose = Pose::new(DQuat::from_xyzw(0.1, -0.7, 0.2, 0.4).normalize(), DVec3::new(1.0, -2.0, 3.5));
        let point_m = DVec3::new(0.3, 0.1, -5.0);
        let back_m = pose.inverse().then(&pose).point(point_m);
        // Two rotations and two sums of numbers below 8: some ten roundings of 8 * 2^-53.
        assert!((back_m - point_m).length() < 1e-14, "{back_m}");
    }

    #[test]
    fn tum_text_returns_to_within_its_decimals() {
        let pose = Pose::new(DQuat::from_xyzw(0.1, -0.7, 0.2, 0.4).normalize(), DVec3::new(1.0, -2.0, 3.5));
        let poses = [TimedPose { t_s: 0.25, world_from_body: pose }];
        let back = parse_tum(&format_tum(&poses)).unwrap();
        assert_eq!(back.len(), 1);
        assert!((back[0].world_from_body.translation_m - pose.translation_m).length() < 1e-12);
        assert!((back[0].world_from_body.rotation - pose.rotation).length() < 2e-12);
    }

    #[test]
    fn bad_tum_lines_are_refused_with_their_number() {
        for (text, line) in [
            ("# c\n0 0 0 0 0 0 0\n", 2),
            ("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 0.5\n", 2),
            ("1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", 2),
            ("0 nan 0 0 0 0 0 1\n", 1),
            ("0 x 0 0 0 0 0 1\n", 1),
            ("0 0 0 0 0 0 0 1 9\n", 1),
        ] {
            assert_eq!(parse_tum(text).unwrap_err().line, line, "{text}");
        }
    }

    #[test]
    fn repeated_time_stamps_keep_the_first_pose() {
        let poses = parse_tum("0 1 0 0 0 0 0 1\n0 2 0 0 0 0 0 1\n").unwrap();
        assert_eq!(poses.len(), 1);
        assert_eq!(poses[0].world_from_body.translation_m.x, 1.0);
    }
}
