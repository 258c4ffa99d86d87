//! Rigid motions and similarities as vectors: exp, log and adjoints of SE(3) and Sim(3), Jacobians of SO(3) and Sim(3). The module `so3`
//! has exp and log of rotations.
//!
//! Units are radians, metres and logarithms of scale. Everything is smooth from 0 over pi; a logarithm's angle
//! is 0..=pi. Tangents are ordered linear, angular, scale. With `J` the left Jacobian, `exp(x + d) = exp(J(x) d)
//! exp(x)` to first order; the right one is the same of `-x`: `exp(x + d) = exp(x) exp(J(-x) d)` (Solà et al. 2018, "A
//! micro Lie theory").

mod coefficients;
mod jacobians;
mod se3;
mod sim3;

pub use coefficients::SERIES_ANGLE_RAD_MAX;
pub use jacobians::{
    skew, so3_left_jacobian, so3_left_jacobian_inverse, so3_right_jacobian, so3_right_jacobian_inverse,
};
pub use se3::{Matrix6, Twist, se3_adjoint, se3_exp, se3_log};
pub use sim3::{Matrix7, Sim3, SimTwist};
