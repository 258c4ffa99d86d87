//! Solves a bundle adjustment of a mono map while its scale stays fixed.
//!
//! One camera's pictures are the same at any size of the world, so an adjustment that holds a single pose leaves one direction unmeasured.
//! Steps along it cost nothing and add up: with few-bit pictures the first adjustments shrank maps to a twentieth, and then the
//! tracker's lengths (least distance of a landmark, distance between keyframes) no longer were those of a room.

use glam::DVec3;

use super::problem::{AdjustmentOutcome, Problem};
use crate::pose::Pose;

/// Adjusts under the errors' own law. Where one pose is held, the free ones keep the sum of their distances from it.
pub fn solve_in_unit(problem: &mut Problem<'_>, iterations_max: u32) -> AdjustmentOutcome {
    let spread_m = spread_m(problem);
    let outcome = problem.solve_tailed(None, 0.0, iterations_max);
    if problem.free + 1 == problem.poses.len() {
        multiply(problem, spread_m / self::spread_m(problem));
    }
    outcome
}

/// Where the body of a pose stands.
fn position_m(body_from_world: &Pose) -> DVec3 {
    body_from_world.inverse().translation_m
}

/// Sum of the free poses' distances from the last held one, in metres.
fn spread_m(problem: &Problem<'_>) -> f64 {
    let held_m = problem.poses.last().map_or(DVec3::ZERO, position_m);
    problem.poses[..problem.free].iter().map(|pose| (position_m(pose) - held_m).length()).sum()
}

/// Multiplies all distances from the last pose. A factor that no spread gives (0 over 0) leaves the problem as it is.
fn multiply(problem: &mut Problem<'_>, factor: f64) {
    let Some(held_m) = problem.poses.last().map(position_m).filter(|_| factor.is_finite() && factor > 0.0) else {
        return;
    };
    let scaled = |at_m: DVec3| held_m + (at_m - held_m) * factor;
    problem.points_m.iter_mut().for_each(|point_m| *point_m = scaled(*point_m));
    for pose in &mut problem.poses[..problem.free] {
        pose.translation_m = -(pose.rotation * scaled(position_m(pose)));
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::draw::DrawKey;
    use crate::num::f64_from_usize;
    use crate::tracker::adjust::Observation;
    use crate::tracker::lie::{Twist, se3_exp};
    use crate::tracker::rig::RigCamera;
    use crate::units::CameraIndex;

    /// Two free poses and a held one before 40 points, positions off by up to 0.5 px.
    fn problem(cameras: &[RigCamera]) -> Problem<'_> {
        // -1 to 1: the law asked of the residuals holds for errors that know nothing of each other.
        let number = |n: u32, k: u32| 2.0 * DrawKey::root(1).with(n.into()).with(k.into()).uniform() - 1.0;
        let points_m: Vec<DVec3> =
            (0..40).map(|n| DVec3::new(number(n, 1), number(n, 2) * 0.7, 2.5 + number(n, 3))).collect();
        let pose = |x_m: f64| se3_exp(Twist { linear_m: DVec3::new(x_m, 0.0, -x_m), angular_rad: DVec3::Y * x_m });
        let poses = vec![pose(0.1), pose(-0.08), pose(0.02)];
        let mut observations = Vec::new();
        for (point, point_m) in (0..).zip(&points_m) {
            for (pose, body_from_world) in (0..).zip(&poses) {
                let Some(position_px) = cameras[0].project_unclipped(body_from_world.point(*point_m)) else { continue };
                let off_px = 0.5 * DVec2::new(number(point, 4 + pose), number(point, 9 + pose));
                let (camera, inverse_sigma, row_from_frame) = (CameraIndex(0), 2.0, Pose::IDENTITY);
                let position_px = position_px + off_px;
                observations.push(Observation { pose, point, camera, position_px, inverse_sigma, row_from_frame });
            }
        }
        Problem { cameras, poses, free: 2, points_m, observations }
    }

    fn camera() -> [RigCamera; 1] {
        [RigCamera::vga_pinhole([319.5, 239.5])]
    }

    #[test]
    fn a_map_of_one_camera_keeps_its_unit_over_a_hundred_adjustments() {
        let cameras = camera();
        let mut held = problem(&cameras);
        let before_m = spread_m(&held);
        let of_truth: f64 = held.errors2().iter().sum();
        let share = |held: &Problem<'_>| held.errors2().iter().sum::<f64>() / of_truth;
        // Two poses, 40 points and their unit take up 131 of two equations a position. What is left of the truth's errors has a relative
        // standard error of a tenth. Less would be a world that shrank into the held pose.
        let equations = 2.0 * f64_from_usize(held.observations.len());
        let law = (equations - 131.0) / equations;
        solve_in_unit(&mut held, 4);
        assert!((share(&held) / law - 1.0).abs() < 0.3, "{} of what the truth leaves, {law} by the law", share(&held));
        for _ in 1..100 {
            solve_in_unit(&mut held, 4);
        }
        // The tailed law is fitted anew to what each adjustment left; with three views a point it narrows to a limit above the least sum.
        assert!((0.7 * law..1.0).contains(&share(&held)), "{} of what the truth leaves", share(&held));
        // A hundred sums of two lengths, each rounded some ten times by 2^-53.
        assert!((spread_m(&held) / before_m - 1.0).abs() < 1e-12, "{} m of {before_m} m", spread_m(&held));
    }

    #[test]
    fn pictures_are_the_same_at_any_size() {
        let cameras = camera();
        let mut held = problem(&cameras);
        held.solve_tailed(None, 0.0, 20);
        let before = held.errors2();
        multiply(&mut held, 7.0);
        // Positions of 500 px rounded by 2^-53 some hundred times, half a pixel a sigma: squares of 10 sigmas move by 2e-10.
        let moved = before.iter().zip(held.errors2()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 1e-9 && before.len() >= 100, "{moved} over {} errors", before.len());
    }
}
