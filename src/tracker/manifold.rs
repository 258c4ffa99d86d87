//! Rotations and rigid motions as vectors: exp and log of SO(3) and SE(3).
//!
//! Radians and metres. A twist acts from the left, `exp(twist).then(&pose)`. Seams between series and closed forms are named
//! constants; both sides are tested.

use glam::{DMat3, DQuat, DVec3};

use crate::pose::Pose;

/// Below this half-angle's double the sine quotient is a series whose first dropped term is angle^6 / 645,120 < 2e-18.
pub const QUATERNION_SERIES_ANGLE_RAD_MAX: f64 = 1e-2;

/// Below this angle the coefficients of SE(3) are series whose first dropped term, angle^10 / 479,001,600, is under 2e-15;
/// above it the closed forms cancel to no worse than 2^-52 / angle^2 < 4e-15.
pub const TWIST_SERIES_ANGLE_RAD_MAX: f64 = 0.25;

/// A rigid motion's logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Translational part in metres (not the pose's translation: see `se3_exp`).
    pub linear_m: DVec3,
    /// Axis times angle in radians.
    pub angular_rad: DVec3,
}

impl Twist {
    /// From six numbers, the linear part first.
    pub fn from_array(values: [f64; 6]) -> Self {
        let [x, y, z, a, b, c] = values;
        Self { linear_m: DVec3::new(x, y, z), angular_rad: DVec3::new(a, b, c) }
    }

    /// The motion over `factor` times the span, at constant velocity.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { linear_m: self.linear_m * factor, angular_rad: self.angular_rad * factor }
    }

    /// The sum, part by part.
    #[must_use]
    pub fn plus(self, other: &Self) -> Self {
        Self { linear_m: self.linear_m + other.linear_m, angular_rad: self.angular_rad + other.angular_rad }
    }
}

/// Unit quaternion of a rotation vector.
pub fn so3_exp(angular_rad: DVec3) -> DQuat {
    let angle2 = angular_rad.length_squared();
    let (factor, w) = if angle2 < QUATERNION_SERIES_ANGLE_RAD_MAX * QUATERNION_SERIES_ANGLE_RAD_MAX {
        (0.5 - angle2 / 48.0 + angle2 * angle2 / 3840.0, 1.0 - angle2 / 8.0 + angle2 * angle2 / 384.0)
    } else {
        let angle = angle2.sqrt();
        (libm::sin(0.5 * angle) / angle, libm::cos(0.5 * angle))
    };
    let v = angular_rad * factor;
    DQuat::from_xyzw(v.x, v.y, v.z, w).normalize()
}

/// Rotation vector of a unit quaternion, of length 0..=pi; q and -q give the same.
pub fn so3_log(rotation: DQuat) -> DVec3 {
    let (v, w) = if rotation.w < 0.0 { (-rotation.xyz(), -rotation.w) } else { (rotation.xyz(), rotation.w) };
    let n = v.length();
    if n < 1e-12 {
        // Here w is 1 and the next term is n^2 / 3 of the result; n itself may have underflowed to 0.
        return v * (2.0 / w);
    }
    v * (2.0 * libm::atan2(n, w) / n)
}

/// The matrix of the cross product: `skew(a) * b = a x b`.
pub fn skew(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
}

/// Rigid motion of a twist.
pub fn se3_exp(twist: Twist) -> Pose {
    let w = twist.angular_rad;
    let a2 = w.length_squared();
    let (b, c) = if a2 < TWIST_SERIES_ANGLE_RAD_MAX * TWIST_SERIES_ANGLE_RAD_MAX {
        (
            series(a2, [1.0 / 2.0, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40_320.0, 1.0 / 3_628_800.0]),
            series(a2, [1.0 / 6.0, -1.0 / 120.0, 1.0 / 5_040.0, -1.0 / 362_880.0, 1.0 / 39_916_800.0]),
        )
    } else {
        let angle = a2.sqrt();
        let half = libm::sin(0.5 * angle);
        (2.0 * half * half / a2, (angle - libm::sin(angle)) / (a2 * angle))
    };
    let once = w.cross(twist.linear_m);
    Pose::new(so3_exp(w), twist.linear_m + once * b + w.cross(once) * c)
}

/// Twist of a rigid motion, with an angle of 0..=pi.
pub fn se3_log(motion: &Pose) -> Twist {
    let w = so3_log(motion.rotation);
    let a2 = w.length_squared();
    let d = if a2 < TWIST_SERIES_ANGLE_RAD_MAX * TWIST_SERIES_ANGLE_RAD_MAX {
        series(a2, [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0, 1.0 / 1_209_600.0, 1.0 / 47_900_160.0])
    } else {
        let half = 0.5 * a2.sqrt();
        (1.0 - half * libm::cos(half) / libm::sin(half)) / a2
    };
    let t = motion.translation_m;
    let once = w.cross(t);
    Twist { linear_m: t - once * 0.5 + w.cross(once) * d, angular_rad: w }
}

fn series(x: f64, [c0, c1, c2, c3, c4]: [f64; 5]) -> f64 {
    c0 + x * (c1 + x * (c2 + x * (c3 + x * c4)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const AXES: [DVec3; 4] =
        [DVec3::X, DVec3::NEG_Y, DVec3::new(0.6, 0.0, -0.8), DVec3::new(2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0)];

    /// Hard angles: 0, subnormal, both seams from both sides, and pi from both sides.
    fn angles_rad() -> Vec<f64> {
        let mut angles = vec![0.0, 5e-324, 1e-200, 1e-12, 1e-9, 1e-4, 1.0, 3.0];
        for seam in [QUATERNION_SERIES_ANGLE_RAD_MAX, TWIST_SERIES_ANGLE_RAD_MAX, PI] {
            angles.extend([seam * (1.0 - 1e-9), seam.next_down(), seam]);
            if seam < PI {
                angles.extend([seam.next_up(), seam * (1.0 + 1e-9)]);
            }
        }
        angles.extend((0..2_000_u32).map(|step| f64::from(step) / 2_000.0 * PI));
        angles
    }

    #[test]
    fn the_logarithm_undoes_the_exponential_from_zero_to_pi_across_all_seams() {
        let (mut below, mut above) = (0, 0);
        for angle_rad in angles_rad() {
            for axis in AXES {
                let twist = Twist { linear_m: DVec3::new(0.3, -1.2, 2.0), angular_rad: axis * angle_rad };
                let back = se3_log(&se3_exp(twist));
                // At pi both ends of the axis are the same rotation: compare the rotation there.
                let sign = if back.angular_rad.dot(axis) < 0.0 && angle_rad > 3.1 { -1.0 } else { 1.0 };
                let angular_error = (back.angular_rad * sign - twist.angular_rad).length();
                // Ten roundings of numbers below 4: 10 * 4 * 2^-53 = 5e-15; pi itself is a rounded number.
                assert!(angular_error < 2e-14, "angle {angle_rad:e} axis {axis}: off by {angular_error:e}");
                if sign > 0.0 {
                    // The linear part passes two maps, each with 4e-15 relative coefficients times |w|^2 |t| <= 24.
                    let linear_error = (back.linear_m - twist.linear_m).length();
                    assert!(linear_error < 2e-13, "angle {angle_rad:e} axis {axis}: off by {linear_error:e} m");
                }
                if angle_rad < TWIST_SERIES_ANGLE_RAD_MAX { below += 1 } else { above += 1 }
            }
        }
        assert!(below > 500 && above > 5_000, "both sides of the seam must be tried: {below}, {above}");
    }

    #[test]
    fn both_branches_agree_at_their_seams() {
        for seam in [QUATERNION_SERIES_ANGLE_RAD_MAX, TWIST_SERIES_ANGLE_RAD_MAX] {
            for axis in AXES {
                let at =
                    |angle: f64| se3_exp(Twist { linear_m: DVec3::new(1.0, 2.0, -0.5), angular_rad: axis * angle });
                let (series_side, closed_side) = (at(seam * (1.0 - 1e-15)), at(seam * (1.0 + 1e-15)));
                // The angle moves by 2e-15 times a lever of 2.3 m, plus the branches' own 2e-14.
                assert!((series_side.translation_m - closed_side.translation_m).length() < 3e-14);
                assert!((series_side.rotation - closed_side.rotation).length() < 1e-15);
            }
        }
    }

    #[test]
    fn half_a_motion_done_twice_is_the_motion() {
        for angle_rad in angles_rad() {
            let twist = Twist { linear_m: DVec3::new(-0.7, 0.1, 0.4), angular_rad: AXES[3] * angle_rad };
            let half = se3_exp(twist.scaled(0.5));
            let (twice, whole) = (half.then(&half), se3_exp(twist));
            // Three maps of 1e-14 relative error on lengths below 1 m.
            assert!((twice.translation_m - whole.translation_m).length() < 5e-14, "angle {angle_rad:e}");
            assert!((twice.rotation.dot(whole.rotation).abs() - 1.0).abs() < 1e-14, "angle {angle_rad:e}");
        }
    }

    #[test]
    fn a_quaternion_and_its_negative_have_one_logarithm() {
        for angle_rad in [1e-9, 0.5, 3.0] {
            let rotation = so3_exp(AXES[2] * angle_rad);
            assert_eq!(so3_log(rotation), so3_log(-rotation));
        }
    }
}
