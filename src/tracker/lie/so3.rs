//! Rotations SO(3): exp, log and Jacobians. Rotation vectors are radians.

use glam::{DMat3, DQuat, DVec3};

use super::coefficients::{cotangent, lag, versine};

/// Below this angle the sine quotient is a series whose first dropped term is angle^6 / 645,120 < 2e-18.
pub const QUATERNION_SERIES_ANGLE_RAD_MAX: f64 = 1e-2;

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

/// `exp(w + d) = exp(J d) exp(w)` to first order.
pub fn so3_left_jacobian(w: DVec3) -> DMat3 {
    let (a2, once) = (w.length_squared(), skew(w));
    DMat3::IDENTITY + once * versine(a2) + once * once * lag(a2)
}

/// The inverse of [`so3_left_jacobian`], finite up to a full turn (a logarithm has at most half of one).
pub fn so3_left_jacobian_inverse(w: DVec3) -> DMat3 {
    let once = skew(w);
    DMat3::IDENTITY - once * 0.5 + once * once * cotangent(w.length_squared())
}

/// `exp(w + d) = exp(w) exp(J d)` to first order.
pub fn so3_right_jacobian(w: DVec3) -> DMat3 {
    so3_left_jacobian(-w)
}

/// The inverse of [`so3_right_jacobian`].
pub fn so3_right_jacobian_inverse(w: DVec3) -> DMat3 {
    so3_left_jacobian_inverse(-w)
}
