//! Left and right Jacobians of SO(3). Rotation vectors are radians.

use glam::{DMat3, DVec3};

use super::coefficients::{cotangent, lag, versine};

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
