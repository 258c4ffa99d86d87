//! The tracker's mathematics against other solvers and its own laws: adjustment and pose graph against GTSAM
//! (tests/judges/estimation_reference.py), initialisation, preintegration, the prior that unknowns leave and the pose of one frame.
#![allow(clippy::unwrap_used)] // A helper of tests may panic as the tests do.

#[path = "estimation/adjustment.rs"]
mod adjustment;
#[path = "estimation/graph.rs"]
mod graph;
#[path = "estimation/initial.rs"]
mod initial;
#[path = "estimation/inertial.rs"]
mod inertial;
#[path = "estimation/pnp.rs"]
mod pnp;
#[path = "estimation/prior.rs"]
mod prior;

use glam::{DQuat, DVec3};
use sensel::draw::DrawKey;
use sensel::pose::Pose;

/// A standard normal number (Box-Muller).
fn normal(key: DrawKey) -> f64 {
    let (u, v) = (1.0 - key.with(0).uniform(), key.with(1).uniform());
    (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
}

fn normals(key: DrawKey) -> DVec3 {
    DVec3::new(normal(key.with(11)), normal(key.with(12)), normal(key.with(13)))
}

/// A pose from `tx ty tz qx qy qz qw`.
fn pose(numbers: &[f64; 7]) -> Pose {
    let [x, y, z, a, b, c, w] = *numbers;
    Pose::new(DQuat::from_xyzw(a, b, c, w).normalize(), DVec3::new(x, y, z))
}

/// Distance in metres plus radians.
fn apart(a: &Pose, b: &Pose) -> f64 {
    let between = a.inverse().then(b);
    between.translation_m.length() + between.angle_rad()
}
