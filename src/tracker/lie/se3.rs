//! Rigid motions SE(3): exp, log and adjoint. Twists are metres and radians.
//!
//! A twist acts from the left, `exp(twist).then(&pose)`. Matrices are 6 x 6, linear part first.

use glam::{DMat3, DVec3};
use nalgebra::SMatrix;

use super::coefficients::{cotangent, lag, versine};
use super::jacobians::skew;
use crate::pose::Pose;
use crate::so3;

/// A 6 x 6 matrix over twists, linear part first.
pub type Matrix6 = SMatrix<f64, 6, 6>;

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

    /// As six numbers, the linear part first.
    pub fn to_array(self) -> [f64; 6] {
        let (t, w) = (self.linear_m, self.angular_rad);
        [t.x, t.y, t.z, w.x, w.y, w.z]
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

/// Rigid motion of a twist.
pub fn se3_exp(twist: Twist) -> Pose {
    let w = twist.angular_rad;
    let a2 = w.length_squared();
    let once = w.cross(twist.linear_m);
    Pose::new(so3::exp(w), twist.linear_m + once * versine(a2) + w.cross(once) * lag(a2))
}

/// Twist of a rigid motion, with an angle of 0..=pi.
pub fn se3_log(motion: &Pose) -> Twist {
    let w = so3::log(motion.rotation);
    let t = motion.translation_m;
    let once = w.cross(t);
    Twist { linear_m: t - once * 0.5 + w.cross(once) * cotangent(w.length_squared()), angular_rad: w }
}

/// `motion exp(d) motion^-1 = exp(adjoint(motion) d)`.
pub fn se3_adjoint(motion: &Pose) -> Matrix6 {
    let rotation = DMat3::from_quat(motion.rotation);
    let turned = skew(motion.translation_m) * rotation;
    Matrix6::from_fn(|row, column| match (row / 3, column / 3) {
        (0, 1) => turned.col(column - 3)[row],
        (1, 0) => 0.0,
        _ => rotation.col(column % 3)[row % 3],
    })
}

#[cfg(test)]
mod tests {
    use super::super::SERIES_ANGLE_RAD_MAX;
    use super::*;
    use crate::so3::EXP_SERIES_ANGLE_RAD_MAX;
    use std::f64::consts::PI;

    const AXES: [DVec3; 4] =
        [DVec3::X, DVec3::NEG_Y, DVec3::new(0.6, 0.0, -0.8), DVec3::new(2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0)];

    /// Hard angles: 0, subnormal, both seams from both sides, and pi from both sides.
    fn angles_rad() -> Vec<f64> {
        let mut angles = vec![0.0, 5e-324, 1e-200, 1e-12, 1e-9, 1e-4, 1.0, 3.0];
        for seam in [EXP_SERIES_ANGLE_RAD_MAX, SERIES_ANGLE_RAD_MAX, PI] {
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
                if angle_rad < SERIES_ANGLE_RAD_MAX { below += 1 } else { above += 1 }
            }
        }
        assert!(below > 500 && above > 5_000, "both sides of the seam must be tried: {below}, {above}");
    }

    #[test]
    fn both_branches_agree_at_their_seams() {
        for seam in [EXP_SERIES_ANGLE_RAD_MAX, SERIES_ANGLE_RAD_MAX] {
            for axis in AXES {
                let at =
                    |angle: f64| se3_exp(Twist { linear_m: DVec3::new(1.0, 2.0, -0.5), angular_rad: axis * angle });
                let (series_side, closed_side) = (at(seam * (1.0 - 1e-15)), at(seam * (1.0 + 1e-15)));
                // The angle moves by 2e-15 times a lever of 2.3 m, plus the branches' own 2e-14.
                assert!((series_side.translation_m - closed_side.translation_m).length() < 3e-14);
                assert!((series_side.rotation - closed_side.rotation).length() < 2e-15);
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
            let rotation = so3::exp(AXES[2] * angle_rad);
            assert_eq!(so3::log(rotation), so3::log(-rotation));
        }
    }
}
