//! Pose from known points where it is hard: all on a line, behind the camera, at infinity, seen from the same pose twice.

use glam::{DVec2, DVec3};
use sensel::draw::DrawKey;
use sensel::num::u64_from;
use sensel::pose::Pose;
use sensel::tracker::lie::{Twist, se3_exp};
use sensel::tracker::p3p;
use sensel::tracker::ransac::{RansacSettings, search};
use sensel::tracker::refine::{
    FramePriors, PointMeasurement, StudentT, UNSEEN_SIGMAS2, WITHIN_PIXEL_PX, errors2, information, refine, refine_with,
};
use sensel::tracker::rig::RigCamera;
use sensel::tracker::row_motion::Moving;
use sensel::units::CameraIndex;

use super::{apart, normals};

/// The law of errors at the stated sigma.
const EXACT: StudentT = StudentT { scale2: 1.0 };

const LIMITS: RansacSettings = RansacSettings { samples_max: 300, confidence: 0.999, gate_sigmas2: 9.21 };

fn cameras() -> Vec<RigCamera> {
    super::adjustment::cameras([320.0, 320.0, 320.0, 240.0], &[Pose::IDENTITY])
}

fn truth(seed: u64) -> Pose {
    let key = DrawKey::root(seed);
    se3_exp(Twist { linear_m: normals(key.with(1)), angular_rad: normals(key.with(2)) * 0.7 })
}

/// Exact positions of points of the body's frame; those that cannot be seen get a position anyway, as a false match would.
fn measured(in_body_m: &[DVec3], truth: &Pose) -> (Vec<PointMeasurement>, Vec<DVec3>) {
    let cameras = cameras();
    let one = |point: &DVec3| {
        let seen = cameras[0].project_with_jacobian(*point).map(|(position_px, _)| position_px);
        let position_px = seen.unwrap_or(DVec2::new(100.0, 200.0));
        let m = PointMeasurement {
            camera: CameraIndex(0),
            point_in_world_m: truth.inverse().point(*point),
            position_px,
            inverse_sigma: 2.0,
            offset_s: 0.0,
        };
        (m, cameras[0].calibration.lens.unproject(position_px).unwrap())
    };
    in_body_m.iter().map(one).unzip()
}

fn spread(seed: u64, count: usize) -> Vec<DVec3> {
    let number = |n: usize, k: u64| DrawKey::root(seed).with(u64_from(n)).with(k).uniform() - 0.5;
    (0..count).map(|n| DVec3::new(3.0 * number(n, 1), 2.0 * number(n, 2), 3.5 + 2.0 * number(n, 3))).collect()
}

#[test]
fn points_on_a_line_give_no_sample_a_bounded_step_and_no_bound() {
    let mut tried = 0;
    for seed in 1..=20 {
        let truth = truth(seed);
        let line: Vec<DVec3> =
            (0..30).map(|n| DVec3::new(-1.2 + 0.08 * f64::from(n), 0.3, 3.0 + 0.02 * f64::from(n))).collect();
        let (measurements, bearings) = measured(&line, &truth);
        assert!(search(&cameras(), (&measurements, &bearings), DrawKey::root(seed), LIMITS).is_none(), "seed {seed}");
        // The turn about the line is free. From beside the truth the fit must bring the positions home and stay near.
        let start = se3_exp(Twist::from_array([0.02, -0.01, 0.01, 0.01, 0.02, -0.01])).then(&truth);
        let (found, _) = refine(&cameras(), &measurements, &Moving::resting(start), None, 30);
        let worst = errors2(&cameras(), &measurements, &found).into_iter().fold(0.0, f64::max);
        // 0.01 sigmas: the floor of 1e-6 that holds the free turn bends the rest by less.
        assert!(
            worst < 1e-4 && apart(&found.body_from_world, &truth) < 0.5,
            "seed {seed}: {worst}, {}",
            apart(&found.body_from_world, &truth)
        );
        let known = information(&cameras(), &measurements, &Moving::resting(truth), None, EXACT);
        assert!(known.try_inverse().is_none_or(|covariance| covariance.trace().abs() > 1e6), "seed {seed}");
        tried += 1;
    }
    assert_eq!(tried, 20);
}

#[test]
fn points_behind_the_camera_are_outliers_and_pull_at_nothing() {
    let mut tried = 0;
    for seed in 1..=20 {
        let truth = truth(seed);
        let mut points = spread(seed, 40);
        // One in four stands behind the camera, or on its plane.
        for (n, point) in points.iter_mut().enumerate().filter(|(n, _)| n % 4 == 0) {
            point.z = if n % 8 == 0 { -point.z } else { 0.0 };
        }
        let (measurements, bearings) = measured(&points, &truth);
        let found = search(&cameras(), (&measurements, &bearings), DrawKey::root(seed), LIMITS).unwrap();
        assert_eq!(found.agreeing, 30, "seed {seed}");
        assert!(found.agrees.iter().enumerate().all(|(n, agrees)| *agrees == (n % 4 != 0)), "seed {seed}");
        let (pose, _) = refine(&cameras(), &measurements, &Moving::resting(found.body_from_world), None, 20);
        let pose = pose.body_from_world;
        // Exact positions: what is left is the stopping rule, a gain of 1e-6 of a cost that is all unseen points'.
        assert!(apart(&pose, &truth) < 1e-6, "seed {seed}: {}", apart(&pose, &truth));
        let unseen =
            errors2(&cameras(), &measurements, &Moving::resting(pose)).iter().filter(|&&e| e == UNSEEN_SIGMAS2).count();
        assert_eq!(unseen, 10, "seed {seed}");
        tried += 1;
    }
    assert_eq!(tried, 20);
}

#[test]
fn points_at_infinity_fix_the_turn_and_leave_the_position() {
    let mut tried = 0;
    for seed in 1..=20 {
        let truth = truth(seed);
        let near = spread(seed, 40);
        let far: Vec<DVec3> = near.iter().map(|point| *point * 1e9).collect();
        let (measurements, _) = measured(&far, &truth);
        let start = se3_exp(Twist::from_array([0.0, 0.0, 0.0, 0.01, 0.02, -0.01])).then(&truth);
        let (found, _) = refine(&cameras(), &measurements, &Moving::resting(start), None, 30);
        let turn = found.body_from_world.inverse().then(&truth).angle_rad();
        assert!(found.body_from_world.translation_m.is_finite() && turn < 1e-9, "seed {seed}: {turn:e} rad");
        let information = information(&cameras(), &measurements, &Moving::resting(truth), None, EXACT);
        // A metre at 3.5e9 m is 1e-7 px: 40 points have 1e-12 of what they have on a turn.
        assert!((0..3).all(|k| information[(k, k)] < 1e-9 * information[(3, 3)]), "seed {seed}: {information}");
        // A few near ones among them fix the position again.
        let (some, _) = measured(&near[..8], &truth);
        let mixed: Vec<PointMeasurement> = measurements.iter().chain(&some).copied().collect();
        let (found, _) = refine(&cameras(), &mixed, &Moving::resting(start), None, 30);
        assert!(apart(&found.body_from_world, &truth) < 1e-6, "seed {seed}: {}", apart(&found.body_from_world, &truth));
        tried += 1;
    }
    assert_eq!(tried, 20);
}

#[test]
fn three_points_solve_at_the_same_pose_and_far_from_the_origin() {
    let mut tried = 0;
    for seed in 1..=200 {
        // The identical pose, and a world whose origin is a kilometre away.
        for shift_m in [DVec3::ZERO, DVec3::new(700.0, -300.0, 600.0)] {
            let points = spread(seed, 3);
            let area = (points[1] - points[0]).cross(points[2] - points[0]).length();
            if area < 0.2 {
                continue;
            }
            let world: [DVec3; 3] = std::array::from_fn(|k| points[k] + shift_m);
            let poses = p3p::solve(&std::array::from_fn(|k| points[k].normalize()), &world);
            let best =
                poses.iter().map(|pose| pose.point(shift_m).length() + pose.angle_rad()).fold(f64::INFINITY, f64::min);
            // A kilometre keeps 1e-13 of its metres; conditions of such triangles stay below 1e6.
            assert!(best < 1e-6, "seed {seed}: {best:e}");
            tried += 1;
        }
    }
    assert!(tried > 300, "{tried}");
}

#[test]
fn identical_poses_measure_no_motion() {
    let mut tried = 0;
    for seed in 1..=20 {
        let truth = truth(seed);
        let (measurements, _) = measured(&spread(seed, 40), &truth);
        let (first, _) = refine(&cameras(), &measurements, &Moving::resting(truth), None, 20);
        let (second, _) = refine(&cameras(), &measurements, &first, None, 20);
        let (first, second) = (first.body_from_world, second.body_from_world);
        // Exact positions at the exact pose: the residuals are roundings of 600 px, and so are the steps.
        assert!(apart(&first, &truth) < 1e-12 && apart(&first, &second) < 1e-12, "seed {seed}");
        tried += 1;
    }
    assert_eq!(tried, 20);
}

/// Where positions that follow a shift by `parts` (share and slope) draw a pose, in one dimension: the mean under the law's own weights.
fn followed(parts: [(f64, f64); 2], shift_sigmas: f64, scale2: f64) -> f64 {
    (0..200).fold(1.0, |found, _| {
        let (above, below) = parts.iter().fold((0.0, 0.0), |(above, below), &(share, slope)| {
            let error = shift_sigmas * (slope - found);
            let weight = share / (4.0 * scale2 + error * error);
            (above + weight * slope, below + weight)
        });
        above / below
    })
}

#[test]
fn corners_that_stick_to_their_pixels_do_not_outvote_those_that_follow() {
    // Two in three lag behind by half, the third goes ahead: in the mean they follow, as corners within their pixels do.
    let (parts, shift_px) = ([(2.0 / 3.0, 0.5), (1.0 / 3.0, 2.0)], 0.18);
    let mut tried = 0;
    for seed in 1..=20 {
        let truth = truth(seed);
        let (exact, _) = measured(&spread(seed, 300), &truth);
        let shifted: Vec<PointMeasurement> = exact
            .iter()
            .enumerate()
            .map(|(n, m)| {
                let slope = parts[usize::from(n % 3 == 0)].1;
                PointMeasurement { position_px: m.position_px + DVec2::new(slope * shift_px, 0.0), ..*m }
            })
            .collect();
        let found = |least_px: f64| {
            let known = FramePriors { least_px, ..FramePriors::default() };
            let (pose, _) = refine_with(&cameras(), &shifted, &Moving::resting(truth), known, 50);
            let column_px = |m: &PointMeasurement| {
                let in_body_m = pose.body_from_world.point(m.point_in_world_m);
                cameras()[0].project_with_jacobian(in_body_m).unwrap().0.x
            };
            exact.iter().map(|m| column_px(m) - m.position_px.x).sum::<f64>() / (300.0 * shift_px)
        };
        // The scale of errors as they are is the least there is, 0.2 sigmas of half a pixel.
        for (least_px, scale_sigmas) in [(0.0, 0.2), (WITHIN_PIXEL_PX, 2.0 * WITHIN_PIXEL_PX)] {
            let (found, expected) = (found(least_px), followed(parts, 2.0 * shift_px, scale_sigmas * scale_sigmas));
            // What the six unknowns make of 300 corners that are spread by chance.
            assert!((found - expected).abs() < 0.02, "seed {seed}, {least_px} px: {found} for {expected}");
        }
        let (narrow, wide) = (found(0.0), found(WITHIN_PIXEL_PX));
        assert!(narrow < 0.88 && wide > 0.91, "seed {seed}: {narrow}, {wide}");
        tried += 1;
    }
    assert_eq!(tried, 20);
}
