//! Similarities `x -> s R x + t`, Sim(3), for maps whose scale drifts: exp, log, adjoint and Jacobians. Tangents are metres, radians and
//! the logarithm of scale.
//!
//! With `z = sigma + i angle`, translation and linear tangent are linked by `V = (exp z - 1) / z` of the matrix
//! (Strasdat 2012, "Local accuracy and global consistency", equations 3.15 to 3.17; his coefficients cancel near 0,
//! these do not).

use glam::{DMat3, DQuat, DVec3};
use nalgebra::SMatrix;

use super::coefficients::in_series;
use super::jacobians::skew;
use crate::pose::Pose;
use crate::so3;

/// A 7 x 7 matrix over tangents: linear, angular, scale.
pub type Matrix7 = SMatrix<f64, 7, 7>;

/// A similarity's logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimTwist {
    /// Linear part in metres (not the similarity's translation).
    pub linear_m: DVec3,
    /// Axis times angle in radians.
    pub angular_rad: DVec3,
    /// Natural logarithm of the scale.
    pub log_scale: f64,
}

impl SimTwist {
    /// From seven numbers: linear, angular, scale.
    pub fn from_array(values: [f64; 7]) -> Self {
        let [x, y, z, a, b, c, log_scale] = values;
        Self { linear_m: DVec3::new(x, y, z), angular_rad: DVec3::new(a, b, c), log_scale }
    }

    /// As seven numbers: linear, angular, scale.
    pub fn to_array(self) -> [f64; 7] {
        let (t, w) = (self.linear_m, self.angular_rad);
        [t.x, t.y, t.z, w.x, w.y, w.z, self.log_scale]
    }

    /// The tangent times a factor.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            linear_m: self.linear_m * factor,
            angular_rad: self.angular_rad * factor,
            log_scale: self.log_scale * factor,
        }
    }
}

/// A similarity `a_from_b`: `p_a = scale * rotation * p_b + translation_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sim3 {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Metres, in the target frame.
    pub translation_m: DVec3,
    /// Above 0.
    pub scale: f64,
}

impl From<Pose> for Sim3 {
    fn from(pose: Pose) -> Self {
        Self { rotation: pose.rotation, translation_m: pose.translation_m, scale: 1.0 }
    }
}

impl Sim3 {
    /// Maps every point to itself.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation_m: DVec3::ZERO, scale: 1.0 };

    /// The image of a point.
    pub fn point(&self, point_m: DVec3) -> DVec3 {
        self.rotation * (point_m * self.scale) + self.translation_m
    }

    /// `b_from_a` of `a_from_b`.
    pub fn inverse(&self) -> Self {
        let (rotation, scale) = (self.rotation.conjugate(), 1.0 / self.scale);
        Self { rotation, translation_m: -(rotation * (self.translation_m * scale)), scale }
    }

    /// `a_from_c` of `a_from_b` (self) and `b_from_c`. Renormalises, so long chains stay similarities.
    pub fn then(&self, b_from_c: &Self) -> Self {
        Self {
            rotation: (self.rotation * b_from_c.rotation).normalize(),
            translation_m: self.point(b_from_c.translation_m),
            scale: self.scale * b_from_c.scale,
        }
    }

    /// The rigid motion that puts the target's origin and axes where this does: what a camera's pose is once its own unit of
    /// length is dropped. Exact for `world_from_body`.
    pub fn pose(&self) -> Pose {
        Pose::new(self.rotation, self.translation_m)
    }

    /// The similarity of a tangent.
    pub fn exp(tangent: SimTwist) -> Self {
        let translation_m = link(tangent.angular_rad, tangent.log_scale) * tangent.linear_m;
        Self { rotation: so3::exp(tangent.angular_rad), translation_m, scale: libm::exp(tangent.log_scale) }
    }

    /// Tangent of the similarity, with an angle of 0..=pi.
    pub fn log(&self) -> SimTwist {
        let (angular_rad, log_scale) = (so3::log(self.rotation), libm::log(self.scale));
        // The eigenvalues of the matrix are (exp z - 1) / z; for angles up to pi none is near 0, so the inverse is well
        // conditioned.
        let linear_m = link(angular_rad, log_scale).inverse() * self.translation_m;
        SimTwist { linear_m, angular_rad, log_scale }
    }

    /// `self exp(d) self^-1 = exp(adjoint d)`.
    pub fn adjoint(&self) -> Matrix7 {
        let rotation = DMat3::from_quat(self.rotation);
        let turned = skew(self.translation_m) * rotation;
        let t = self.translation_m;
        Matrix7::from_fn(|row, column| match (row, column) {
            (0..3, 0..3) => self.scale * rotation.col(column)[row],
            (0..3, 3..6) => turned.col(column - 3)[row],
            (0..3, _) => -t[row],
            (3..6, 3..6) => rotation.col(column - 3)[row - 3],
            (6, 6) => 1.0,
            _ => 0.0,
        })
    }

    /// `exp(x + d) = exp(J d) exp(x)` to first order. The sum of `ad(x)^k / (k + 1)!`, taken where it converges at once
    /// and doubled from there: `J(2 x) = (1 + adjoint(exp x)) / 2 J(x)`.
    pub fn left_jacobian(tangent: SimTwist) -> Matrix7 {
        let size = tangent.angular_rad.length() + tangent.log_scale.abs();
        let (mut halvings, mut factor) = (0, 1.0);
        while size * factor > 0.5 && halvings < 64 {
            halvings += 1;
            factor *= 0.5;
        }
        let ad = small_adjoint(tangent.scaled(factor));
        let mut jacobian = Matrix7::identity();
        // Powers fall by 0.5 / (k + 1) a term (twice 0.5 where the linear part stands beside): after 18 they are below 2^-53.
        for k in (1..=18_u32).rev() {
            jacobian = Matrix7::identity() + ad * jacobian / f64::from(k + 1);
        }
        for _ in 0..halvings {
            let adjoint = Self::exp(tangent.scaled(factor)).adjoint();
            jacobian = (jacobian + adjoint * jacobian) * 0.5;
            factor *= 2.0;
        }
        jacobian
    }

    /// The inverse of [`Self::left_jacobian`], finite up to a full turn.
    pub fn left_jacobian_inverse(tangent: SimTwist) -> Matrix7 {
        Self::left_jacobian(tangent).try_inverse().expect("a Jacobian of an angle below a full turn is regular")
    }

    /// `exp(x + d) = exp(x) exp(J d)` to first order.
    pub fn right_jacobian(tangent: SimTwist) -> Matrix7 {
        Self::left_jacobian(tangent.scaled(-1.0))
    }

    /// The inverse of [`Self::right_jacobian`].
    pub fn right_jacobian_inverse(tangent: SimTwist) -> Matrix7 {
        Self::left_jacobian_inverse(tangent.scaled(-1.0))
    }
}

/// The matrix of the commutator: `exp(small_adjoint(x)) = adjoint(exp(x))`.
fn small_adjoint(tangent: SimTwist) -> Matrix7 {
    let (p, w) = (skew(tangent.linear_m), skew(tangent.angular_rad));
    Matrix7::from_fn(|row, column| match (row, column) {
        (0..3, 0..3) => w.col(column)[row] + if row == column { tangent.log_scale } else { 0.0 },
        (0..3, 3..6) => p.col(column - 3)[row],
        (0..3, _) => -tangent.linear_m[row],
        (3..6, 3..6) => w.col(column - 3)[row - 3],
        _ => 0.0,
    })
}

/// `V = A + B skew(w) + C skew(w)^2`: the mean of `exp(s (sigma + skew(w)))` over s in 0..1.
fn link(w: DVec3, sigma: f64) -> DMat3 {
    let angle2 = w.length_squared();
    let a = if sigma == 0.0 { 1.0 } else { libm::expm1(sigma) / sigma };
    let (b, c) = if in_series(angle2) {
        // B = sum (-1)^k a^2k / (2k + 1)! m(2k + 1), C the same with 2k + 2; m(n) is the mean of s^n exp(sigma s) over
        // s in 0..1.
        let (mut b, mut c, mut factor) = (0.0, 0.0, 1.0);
        for k in 0..9_u32 {
            b += factor * moment(2 * k + 1, sigma);
            factor /= f64::from(2 * k + 2);
            c += factor * moment(2 * k + 2, sigma);
            factor *= -angle2 / f64::from(2 * k + 3);
        }
        (b, c)
    } else {
        let (angle, scale) = (angle2.sqrt(), libm::exp(sigma));
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let size2 = sigma * sigma + angle2;
        let imaginary = (scale * (sigma * sine - angle * cosine) + angle) / size2;
        let real = (scale * (sigma * cosine + angle * sine) - sigma) / size2;
        (imaginary / angle, (a - real) / angle2)
    };
    let once = skew(w);
    DMat3::IDENTITY * a + once * b + once * once * c
}

/// The mean of `s^n exp(sigma s)` over s in 0..1, as a series without change of sign, whichever sign sigma has.
fn moment(n: u32, sigma: f64) -> f64 {
    let n = f64::from(n);
    let (mut sum, mut term, mut j) = (0.0, 1.0, 0.0);
    if sigma > 0.0 {
        // Sum of sigma^j / j! / (n + 1 + j).
        while term / (n + 1.0 + j) > 1e-17 * sum {
            sum += term / (n + 1.0 + j);
            j += 1.0;
            term *= sigma / j;
        }
        return sum;
    }
    // exp(sigma) times the sum of (-sigma)^j n! / (n + 1 + j)!.
    term /= n + 1.0;
    while term > 1e-17 * sum {
        sum += term;
        j += 1.0;
        term *= -sigma / (n + 1.0 + j);
    }
    libm::exp(sigma) * sum
}
