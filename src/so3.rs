//! Rotations as vectors: exponential and logarithm of SO(3) on unit quaternions.
//!
//! Converts between rotation vectors (axis times angle, radians) and unit quaternions. Both limits are stable: small angles use a series,
//! angles near pi the two-argument arctangent.

use glam::{DQuat, DVec3};

/// Angle in radians below which `sin(angle/2)/angle` is taken from its series; the first term left out is below
/// angle^6 / 645120 = 2e-18 there.
pub const EXP_SERIES_ANGLE_RAD_MAX: f64 = 1e-2;

/// Length of the quaternion's vector part below which the logarithm is taken from its series; the first term left out is
/// n^6 / 7 = 2e-19 of the leading one there.
const LOG_SEAM: f64 = 1e-3;

/// The rotation about `vector_rad` by its length.
pub fn exp(vector_rad: DVec3) -> DQuat {
    let angle2 = vector_rad.length_squared();
    let angle_rad = angle2.sqrt();
    let (half_sine, cosine) = libm::sincos(0.5 * angle_rad);
    let factor = if angle_rad < EXP_SERIES_ANGLE_RAD_MAX {
        0.5 - angle2 * (1.0 / 48.0 - angle2 / 3840.0)
    } else {
        half_sine / angle_rad
    };
    let axis = vector_rad * factor;
    DQuat::from_xyzw(axis.x, axis.y, axis.z, cosine)
}

/// The rotation vector in radians, of length 0..=pi. q and -q give the same.
pub fn log(rotation: DQuat) -> DVec3 {
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let (vector, w) = (rotation.xyz(), rotation.w);
    let length = vector.length();
    let factor = if length < LOG_SEAM {
        // 2 atan(n/w) / n with x = n/w: the series of the arctangent.
        let x2 = (length / w) * (length / w);
        2.0 / w * (1.0 - x2 * (1.0 / 3.0 - x2 / 5.0))
    } else {
        2.0 * libm::atan2(length, w) / length
    };
    vector * factor
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_return_through_exponentials_at_every_size() {
        let axis = DVec3::new(0.48, -0.6, 0.64);
        let near_pi = core::f64::consts::PI - 1e-6;
        for angle_rad in [0.0, 1e-300, 1e-12, 1e-6, 9.9e-4, 1.9e-3, 2.1e-3, 9.999e-3, 1.0001e-2, 0.3, 2.0, 3.0, near_pi]
        {
            let vector_rad = axis * angle_rad;
            let back_rad = log(exp(vector_rad));
            // Cosine and sine are within an ulp of 1: the angle is, too, at any size (relatively where it is small).
            let tolerance_rad = 8.0 * f64::EPSILON * angle_rad;
            assert!((back_rad - vector_rad).length() <= tolerance_rad, "{angle_rad}: {back_rad} {vector_rad}");
            assert!((exp(vector_rad).length() - 1.0).abs() < 4.0 * f64::EPSILON, "{angle_rad}");
        }
    }

    #[test]
    fn half_turns_keep_their_axis_and_signs_do_not_matter() {
        let half_turn = DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0);
        assert_eq!(log(half_turn), DVec3::new(0.0, core::f64::consts::PI, 0.0));
        let rotation = exp(DVec3::new(0.3, -0.2, 2.9));
        assert_eq!(log(rotation), log(-rotation));
    }

    #[test]
    fn the_series_meet_their_closed_forms_at_the_seams() {
        // Just below and above each seam the factor may differ by what the series leaves out and by roundings: 4 ulp.
        for (seam_rad, step) in [(EXP_SERIES_ANGLE_RAD_MAX, 1e-9), (2.0 * LOG_SEAM, 1e-9)] {
            let below = exp(DVec3::X * (seam_rad * (1.0 - step)));
            let above = exp(DVec3::X * (seam_rad * (1.0 + step)));
            let rise_rad = log(above).x - log(below).x;
            assert!((rise_rad - 2.0 * step * seam_rad).abs() < 4.0 * f64::EPSILON * seam_rad, "{seam_rad}: {rise_rad}");
        }
    }
}
