//! Pose of the body from known points and their places on the pictures of all cameras: Levenberg-Marquardt with Huber's
//! kernel. Enters: a first guess. Leaves: the refined pose and each measurement's squared error in sigmas.

use glam::{DMat3, DVec2, DVec3};

use crate::num::index;
use crate::pose::Pose;
use crate::tracker::dense::solve_cholesky;
use crate::tracker::lie::{Twist, se3_exp};
use crate::tracker::rig::RigCamera;
use crate::units::CameraIndex;

/// A point of the map found on a picture.
#[derive(Clone, Copy, Debug)]
pub struct Measurement {
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// The point in metres.
    pub point_in_world_m: DVec3,
    /// Where it was found.
    pub place_px: DVec2,
    /// One over the standard deviation of the place, per axis, in 1/px.
    pub inverse_sigma: f64,
}

/// Huber's threshold in sigmas: the 95 % quantile of a two-dimensional normal error, sqrt(5.991).
pub const HUBER_SIGMAS: f64 = 2.448;

/// Squared error in sigmas of what cannot be projected: beyond every gate, yet finite, so costs stay comparable.
pub const UNSEEN_SIGMAS2: f64 = 1e6;

/// Rows of d(error)/d(twist): the twist acts from the left on `body_from_world`, linear part first.
pub type PoseJacobian = [[f64; 6]; 2];

/// Error (found minus predicted, in sigmas) and the derivatives of the prediction by the pose and by the point in the body.
pub fn linearise(
    camera: &RigCamera,
    point_in_body_m: DVec3,
    measurement: (DVec2, f64),
) -> Option<(DVec2, PoseJacobian, [DVec3; 2])> {
    let (place_px, inverse_sigma) = measurement;
    let (predicted_px, by_body) = camera.project_with_jacobian(point_in_body_m)?;
    let rows = by_body.map(|row| DVec3::from_array(row) * inverse_sigma);
    let by_pose = rows.map(|row| {
        // d(point)/d(rotation) is -skew(point), and row * -skew(point) = point x row.
        let turn = point_in_body_m.cross(row);
        [row.x, row.y, row.z, turn.x, turn.y, turn.z]
    });
    Some(((place_px - predicted_px) * inverse_sigma, by_pose, rows))
}

/// Huber's cost of a squared error, and the weight of its linearisation.
#[inline]
pub fn huber(error2: f64) -> (f64, f64) {
    if error2 <= HUBER_SIGMAS * HUBER_SIGMAS {
        (error2, 1.0)
    } else {
        let error = error2.sqrt();
        (2.0 * HUBER_SIGMAS * error - HUBER_SIGMAS * HUBER_SIGMAS, HUBER_SIGMAS / error)
    }
}

/// Squared errors of all measurements, in sigmas.
pub fn errors2(cameras: &[RigCamera], measurements: &[Measurement], body_from_world: &Pose) -> Vec<f64> {
    let rotation = DMat3::from_quat(body_from_world.rotation);
    let error2 = |m: &Measurement| {
        let in_body_m = rotation * m.point_in_world_m + body_from_world.translation_m;
        let projected = cameras[index(m.camera.0)].project_with_jacobian(in_body_m);
        projected.map_or(UNSEEN_SIGMAS2, |(place_px, _)| {
            ((m.place_px - place_px) * m.inverse_sigma).length_squared().clamp(0.0, UNSEEN_SIGMAS2)
        })
    };
    measurements.iter().map(error2).collect()
}

fn cost(cameras: &[RigCamera], measurements: &[Measurement], body_from_world: &Pose) -> f64 {
    errors2(cameras, measurements, body_from_world).iter().map(|&error2| huber(error2).0).sum()
}

/// Refines `body_from_world`; gives the pose and the number of iterations. A system without a unique solution leaves the pose
/// where damping holds it.
pub fn refine(cameras: &[RigCamera], measurements: &[Measurement], start: &Pose, iterations_max: u32) -> (Pose, u32) {
    let mut pose = *start;
    let mut cost_now = cost(cameras, measurements, &pose);
    let mut damping = 1e-4;
    for iteration in 0..iterations_max {
        let (hessian, gradient) = normal_equations(cameras, measurements, &pose);
        let Some((next, cost_next, step2)) = damped_step(cameras, measurements, &pose, (&hessian, &gradient), damping)
        else {
            return (pose, iteration);
        };
        if cost_next < cost_now {
            let gain = cost_now - cost_next;
            (pose, damping) = (next, damping * 0.1);
            let done = gain <= 1e-6 * cost_now || step2 < 1e-14;
            cost_now = cost_next;
            if done {
                return (pose, iteration + 1);
            }
        } else {
            if step2 < 1e-14 || damping > 1e6 {
                return (pose, iteration + 1);
            }
            damping *= 10.0;
        }
    }
    (pose, iterations_max)
}

/// The pose after a damped step, its cost, and the step's squared length.
fn damped_step(
    cameras: &[RigCamera],
    measurements: &[Measurement],
    pose: &Pose,
    (hessian, gradient): (&[f64; 36], &[f64; 6]),
    damping: f64,
) -> Option<(Pose, f64, f64)> {
    let (mut matrix, mut step) = (*hessian, *gradient);
    for k in 0..6 {
        // The floor keeps a direction that nothing measures (no features, all on a line of sight) solvable and at rest.
        matrix[k * 7] += damping * matrix[k * 7] + 1e-6;
    }
    if !solve_cholesky(&mut matrix, &mut step) {
        return None;
    }
    let next = se3_exp(Twist::from_array(step)).then(pose);
    let step2 = step.iter().map(|s| s * s).sum();
    Some((next, cost(cameras, measurements, &next), step2))
}

fn normal_equations(cameras: &[RigCamera], measurements: &[Measurement], pose: &Pose) -> ([f64; 36], [f64; 6]) {
    let (mut hessian, mut gradient) = ([0.0; 36], [0.0; 6]);
    let rotation = DMat3::from_quat(pose.rotation);
    for m in measurements {
        let in_body_m = rotation * m.point_in_world_m + pose.translation_m;
        let camera = &cameras[index(m.camera.0)];
        let Some((error, by_pose, _)) = linearise(camera, in_body_m, (m.place_px, m.inverse_sigma)) else { continue };
        let (_, weight) = huber(error.length_squared());
        for (row, error) in by_pose.iter().zip(error.to_array()) {
            for i in 0..6 {
                let weighted = weight * row[i];
                gradient[i] += weighted * error;
                for j in 0..=i {
                    hessian[i * 6 + j] += weighted * row[j];
                }
            }
        }
    }
    (hessian, gradient)
}
