//! Bundle adjustment against GTSAM on the same problem.

use glam::{DVec2, DVec3};

use sensel::optics::lens::{Intrinsics, Lens, Mapping};
use sensel::pose::Pose;
use sensel::tracker::CameraCalibration;
use sensel::tracker::adjust::{Observation, Problem};
use sensel::tracker::rig::RigCamera;
use sensel::units::{CameraIndex, Size};

use super::{apart, pose};

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
        position_px: DVec2::new(x_px, y_px),
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
