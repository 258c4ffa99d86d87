//! Bundle adjustment and covariances against GTSAM on the same problem, and the covariance of a frame's pose.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix3, Matrix6, Vector6};
use sensel::draw::DrawKey;
use sensel::num::{f64_from_usize, u64_from};
use sensel::optics::lens::{Intrinsics, Lens, Mapping};
use sensel::pose::Pose;
use sensel::tracker::CameraCalibration;
use sensel::tracker::adjust::{Observation, Problem};
use sensel::tracker::covariance::{frame_covariance, frame_information, position_sigma_m, window_uncertainty};
use sensel::tracker::lie::{Twist, se3_exp, se3_log};
use sensel::tracker::refine::{Measurement, refine};
use sensel::tracker::rig::RigCamera;
use sensel::tracker::sweep::Moving;
use sensel::units::{CameraIndex, Size};

use super::{apart, normal, pose};

#[derive(serde::Deserialize)]
struct Stored {
    adjustment: Adjustment,
}

#[derive(serde::Deserialize)]
struct Adjustment {
    focal_and_centre_px: [f64; 4],
    sigma_px: f64,
    mountings: Vec<[f64; 7]>,
    observations: Vec<(u32, u32, u32, f64, f64)>,
    start_poses: Vec<[f64; 7]>,
    start_points: Vec<[f64; 3]>,
    poses: Vec<[f64; 7]>,
    points: Vec<[f64; 3]>,
    error: f64,
    pose_covariances: Vec<Vec<f64>>,
    point_covariances: Vec<Vec<f64>>,
}

fn stored() -> Adjustment {
    serde_json::from_str::<Stored>(include_str!("../data/estimation.json")).unwrap().adjustment
}

pub(super) fn cameras(focal_and_centre_px: [f64; 4], mountings: &[Pose]) -> Vec<RigCamera> {
    let [fx_px, fy_px, cx_px, cy_px] = focal_and_centre_px;
    let lens = Lens { intrinsics: Intrinsics { fx_px, fy_px, cx_px, cy_px }, mapping: Mapping::Pinhole };
    let size = Size { width_px: 640, height_px: 480 };
    mountings
        .iter()
        .map(|&body_from_camera| RigCamera::new(CameraCalibration { lens, size, body_from_camera }))
        .collect()
}

/// The stored problem; the held pose goes last, as the adjustment wants it.
fn problem<'a>(stored: &Adjustment, cameras: &'a [RigCamera], poses: &[[f64; 7]], points: &[[f64; 3]]) -> Problem<'a> {
    let mut poses: Vec<Pose> = poses.iter().map(|numbers| pose(numbers).inverse()).collect();
    poses.rotate_left(1);
    let count = u32::try_from(poses.len()).unwrap();
    let observation = |&(n, point, camera, x_px, y_px): &(u32, u32, u32, f64, f64)| Observation {
        pose: (n + count - 1) % count,
        point,
        camera: CameraIndex(camera),
        place_px: DVec2::new(x_px, y_px),
        inverse_sigma: 1.0 / stored.sigma_px,
        row_from_frame: Pose::IDENTITY,
    };
    Problem {
        cameras,
        free: poses.len() - 1,
        poses,
        points_m: points.iter().map(|&point| DVec3::from_array(point)).collect(),
        observations: stored.observations.iter().map(observation).collect(),
    }
}

/// Steps until nothing moves: the adjustment itself stops at a gain of 1e-5.
fn settle(problem: &mut Problem<'_>) -> f64 {
    let mut cost = f64::INFINITY;
    for _ in 0..200 {
        let outcome = problem.solve(50);
        if outcome.cost_after >= cost {
            break;
        }
        cost = outcome.cost_after;
    }
    cost
}

#[test]
fn an_adjustment_with_outliers_ends_where_gtsam_ends() {
    let stored = stored();
    let mountings: Vec<Pose> = stored.mountings.iter().map(pose).collect();
    let cameras = cameras(stored.focal_and_centre_px, &mountings);
    let mut problem = problem(&stored, &cameras, &stored.start_poses, &stored.start_points);
    let outliers = problem.errors2().len();
    let cost = settle(&mut problem);
    assert!((cost / stored.error - 1.0).abs() < 1e-9, "{cost} for {}", stored.error);
    let mut compared = 0;
    for (found, truth) in problem.poses.iter().zip(stored.poses[1..].iter().chain(&stored.poses[..1])) {
        let off = apart(&found.inverse(), &pose(truth));
        assert!(off < 1e-6, "a pose is off by {off:e}");
        compared += 1;
    }
    for (found, truth) in problem.points_m.iter().zip(&stored.points) {
        let off_m = (*found - DVec3::from_array(*truth)).length();
        assert!(off_m < 1e-6, "a point is off by {off_m:e} m");
        compared += 1;
    }
    assert_eq!(compared, 45);
    let beyond = problem.errors2().iter().filter(|&&error2| error2 > 6.0).count();
    assert!(outliers > 250 && beyond >= 5, "the kernel must have had work: {beyond} of {outliers}");
}

#[test]
fn covariances_with_uncertain_landmarks_equal_gtsams() {
    let stored = stored();
    let mountings: Vec<Pose> = stored.mountings.iter().map(pose).collect();
    let cameras = cameras(stored.focal_and_centre_px, &mountings);
    let problem = problem(&stored, &cameras, &stored.poses, &stored.points);
    let uncertainty = window_uncertainty(&problem).expect("a held pose and many points");
    for (found, reference) in uncertainty.poses.iter().zip(&stored.pose_covariances) {
        let reference = Matrix6::from_row_slice(reference);
        // The reference knows its held pose to 1e-6 only, some 1e-6 of the variances here (mm^2); linear algebra adds less.
        assert!((found - reference).amax() < 1e-5 * reference.amax(), "{found} for {reference}");
    }
    for (found, reference) in uncertainty.points.iter().zip(&stored.point_covariances) {
        let reference = Matrix3::from_row_slice(reference);
        assert!((found.unwrap() - reference).amax() < 1e-5 * reference.amax());
    }
    let nothing_held = Problem { free: 5, ..problem.clone() };
    assert!(window_uncertainty(&nothing_held).is_none(), "without a held pose nothing says where the world is");
}

fn frame(cameras: &[RigCamera], truth: &Pose, count: usize, key: DrawKey) -> Vec<(u32, Measurement)> {
    let mut seen = Vec::new();
    for n in 0..count {
        let key = key.with(u64_from(n));
        let spread = |k: u64| key.with(k).uniform() - 0.5;
        let in_body_m = DVec3::new(3.0 * spread(1), 2.0 * spread(2), 3.0 + 2.0 * spread(3));
        for (camera, rig) in cameras.iter().enumerate() {
            let Some(place_px) = rig.project(in_body_m) else { continue };
            let camera = CameraIndex(u32::try_from(camera).unwrap());
            let point_in_world_m = truth.inverse().point(in_body_m);
            seen.push((
                u32::try_from(n).unwrap(),
                Measurement { camera, point_in_world_m, place_px, inverse_sigma: 2.0, offset_s: 0.0 },
            ));
        }
    }
    seen
}

#[test]
fn the_frame_covariance_is_what_the_pose_fit_scatters_by() {
    let seed = 21;
    let cameras = cameras(
        [320.0, 320.0, 320.0, 240.0],
        &[Pose::IDENTITY, Pose::new(glam::DQuat::IDENTITY, DVec3::new(0.065, 0.0, 0.0))],
    );
    let truth = se3_exp(Twist::from_array([0.3, -0.2, 0.1, 0.2, -0.4, 0.9]));
    let exact = frame(&cameras, &truth, 60, DrawKey::root(seed));
    let landmark = Matrix3::from_diagonal(&nalgebra::Vector3::new(4e-6, 1e-6, 9e-6));
    for uncertain in [false, true] {
        let covariance = |_| uncertain.then_some(landmark);
        let covariance_of_pose = frame_covariance(&cameras, &truth, &exact, covariance).unwrap();
        let whitener = frame_information(&cameras, &truth, &exact, covariance);
        let trials = 600;
        let mut mean = 0.0;
        for trial in 0..trials {
            let key = DrawKey::root(seed).with(100 + u64_from(trial));
            let noisy: Vec<Measurement> = exact
                .iter()
                .enumerate()
                .map(|(k, (number, m))| {
                    let key_px = key.with(u64_from(k));
                    let shift_px = DVec2::new(normal(key_px.with(1)), normal(key_px.with(2))) / m.inverse_sigma;
                    let key_m = key.with(10_000 + u64::from(*number));
                    let off = if uncertain { 1.0 } else { 0.0 };
                    let shift_m = DVec3::new(
                        2e-3 * normal(key_m.with(1)),
                        1e-3 * normal(key_m.with(2)),
                        3e-3 * normal(key_m.with(3)),
                    );
                    Measurement {
                        place_px: m.place_px + shift_px,
                        point_in_world_m: m.point_in_world_m + shift_m * off,
                        ..*m
                    }
                })
                .collect();
            let (found, _) = refine(&cameras, &noisy, &Moving::resting(truth), None, 20);
            let found = found.body_from_world;
            let step = Vector6::from(se3_log(&found.then(&truth.inverse())).to_array());
            mean += (step.dot(&(whitener * step))) / f64_from_usize(trials);
        }
        // Normalised squared errors have mean 6 and variance 12: a mean of 600 scatters by 0.14, four of that 0.57. The
        // fit weighs all places alike, Huber's kernel costs 5 %, and unequal landmark errors some more: at most 10 %
        // together, always above.
        assert!(mean > 6.0 - 0.57 && mean < 6.6 + 0.6, "seed {seed}, uncertain {uncertain}: {mean}");
        assert!(
            position_sigma_m(&covariance_of_pose) > 1e-4 && position_sigma_m(&covariance_of_pose) < 3e-3,
            "{}",
            position_sigma_m(&covariance_of_pose)
        );
    }
}

#[test]
fn uncertain_landmarks_never_make_a_frame_surer_and_known_ones_are_the_limit() {
    let cameras = cameras([320.0, 320.0, 320.0, 240.0], &[Pose::IDENTITY]);
    let truth = se3_exp(Twist::from_array([0.1, 0.0, 0.2, 0.0, 0.1, 0.0]));
    let seen = frame(&cameras, &truth, 40, DrawKey::root(4));
    let sigma = |covariance: Option<Matrix3<f64>>| {
        position_sigma_m(&frame_covariance(&cameras, &truth, &seen, |_| covariance).unwrap())
    };
    let known = sigma(None);
    let mut last = known;
    for exponent in -12..=0 {
        let variance = libm::pow(10.0, f64::from(exponent));
        let now = sigma(Some(Matrix3::identity() * variance));
        assert!(now >= last * (1.0 - 1e-9), "1e{exponent} m^2: {now} after {last}");
        last = now;
    }
    assert!((sigma(Some(Matrix3::zeros())) / known - 1.0).abs() < 1e-9 && last > 10.0 * known);
    // All on one line, or nothing at all: no covariance.
    let line: Vec<_> = seen.iter().take(2).copied().collect();
    assert!(frame_covariance(&cameras, &truth, &line, |_| None).is_none());
    assert!(frame_covariance(&cameras, &truth, &[], |_| None).is_none());
}
