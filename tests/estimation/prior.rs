//! The marginalisation prior: it says what the dropped factors said, nothing about the gauge, and it survives missing rank.

use glam::DVec3;
use sensel::draw::DrawKey;
use sensel::num::{f64_from_usize, index, u32_from, u64_from};
use sensel::pose::Pose;
use sensel::tracker::adjust::{Observation, Problem};
use sensel::tracker::lie::{Twist, se3_exp};
use sensel::tracker::marginal::{Prior, gauge, marginalise};
use sensel::tracker::rig::RigCamera;
use sensel::units::CameraIndex;

use super::{apart, normals};

fn rig() -> Vec<RigCamera> {
    let right = Pose::new(glam::DQuat::IDENTITY, DVec3::new(0.065, 0.0, 0.0));
    super::adjustment::cameras([320.0, 320.0, 320.0, 240.0], &[Pose::IDENTITY, right])
}

/// Poses 0..6 all free, 60 points, half-pixel noise.
fn window(cameras: &[RigCamera], seed: u64, noise_px: f64) -> Problem<'_> {
    let key = DrawKey::root(seed);
    let pose = |n: usize| {
        let n = f64_from_usize(n);
        se3_exp(Twist::from_array([-0.1 * n, 0.02 * n, 0.03 * n, 0.01 * n, -0.02 * n, 0.03 * n]))
    };
    let poses: Vec<Pose> = (0..6).map(pose).collect();
    let spread = |n: usize, k: u64| key.with(u64_from(n)).with(k).uniform() - 0.5;
    let points_m: Vec<DVec3> =
        (0..60).map(|n| DVec3::new(4.0 * spread(n, 1), 2.5 * spread(n, 2), 3.0 + 2.0 * spread(n, 3))).collect();
    let mut observations = Vec::new();
    for (point, point_m) in points_m.iter().enumerate() {
        for (pose, body_from_world) in poses.iter().enumerate() {
            for (camera, rig) in cameras.iter().enumerate() {
                let Some(place_px) = rig.project(body_from_world.point(*point_m)) else { continue };
                let noise = normals(key.with(9).with(u64_from(point)).with(u64_from(pose)).with(u64_from(camera)));
                observations.push(Observation {
                    pose: u32_from(pose),
                    point: u32_from(point),
                    camera: CameraIndex(u32_from(camera)),
                    place_px: place_px + noise.truncate() * noise_px,
                    inverse_sigma: 2.0,
                    row_from_frame: Pose::IDENTITY,
                });
            }
        }
    }
    let free = poses.len();
    Problem { cameras, poses, free, points_m, observations }
}

/// The first two poses leave, with all points that they saw.
fn leaves(problem: &Problem<'_>) -> (Vec<bool>, Vec<bool>) {
    let poses = (0..problem.free).map(|pose| pose < 2).collect();
    let mut points = vec![false; problem.points_m.len()];
    problem.observations.iter().filter(|o| o.pose < 2 && o.point % 3 != 0).for_each(|o| points[index(o.point)] = true);
    (poses, points)
}

/// What stays of a problem, renumbered.
fn remainder<'a>(problem: &Problem<'a>, points: &[bool]) -> Problem<'a> {
    let mut rest = problem.clone();
    rest.observations.retain(|o| o.pose >= 2 && !points[index(o.point)]);
    rest.observations.iter_mut().for_each(|o| o.pose -= 2);
    rest.poses.drain(..2);
    rest.free -= 2;
    rest
}

fn information(prior: &Prior, poses: &[Pose]) -> Vec<f64> {
    let n = 6 * poses.len();
    let (mut matrix, mut side) = (vec![0.0; n * n], vec![0.0; n]);
    prior.add_to(poses, &mut matrix, &mut side);
    matrix
}

/// Greatest share that a gauge direction has in the information: |N^T H N| over |N|^2 trace(H).
fn gauge_share(prior: &Prior, poses: &[Pose]) -> f64 {
    let matrix = information(prior, poses);
    let n = 6 * poses.len();
    let trace: f64 = (0..n).map(|k| matrix[k * (n + 1)]).sum();
    let share = |direction: Vec<f64>| {
        let pull: f64 =
            (0..n).map(|i| (0..n).map(|j| direction[i] * matrix[i * n + j] * direction[j]).sum::<f64>()).sum();
        pull.abs() / (trace * direction.iter().map(|x| x * x).sum::<f64>())
    };
    gauge(poses).into_iter().map(share).fold(0.0, f64::max)
}

#[test]
fn the_prior_measures_nothing_of_the_gauge_and_all_else() {
    let cameras = rig();
    let mut tried = 0;
    for seed in 1..=5 {
        let mut problem = window(&cameras, seed, 0.5);
        problem.solve(30);
        let (poses, points) = leaves(&problem);
        let prior =
            marginalise(&problem, (&poses, &points), None).expect("the leaving poses saw the staying ones' points");
        // Four staying poses have 24 directions, six of them the gauge.
        assert_eq!(prior.rank(), 18, "seed {seed}");
        let prior = prior.renumbered(|pose| pose - 2);
        let share = gauge_share(&prior, &problem.poses[2..]);
        // Elimination leaves 1e-16 times the information before it, some 1e3 times that after.
        assert!(share < 1e-12, "seed {seed}: the gauge has a share of {share:e}");
        tried += 1;
    }
    assert_eq!(tried, 5);
}

#[test]
fn first_estimates_keep_the_gauge_free_over_a_second_marginalisation() {
    let cameras = rig();
    let mut problem = window(&cameras, 3, 0.5);
    problem.solve(30);
    let (poses, points) = leaves(&problem);
    let prior = marginalise(&problem, (&poses, &points), None).unwrap().renumbered(|pose| pose - 2);
    let mut rest = remainder(&problem, &points);
    // The estimate moves on by millimetres after the prior was made.
    for (n, pose) in rest.poses.iter_mut().enumerate() {
        let key = DrawKey::root(77).with(u64_from(n));
        *pose = se3_exp(Twist { linear_m: normals(key) * 5e-3, angular_rad: normals(key.with(1)) * 3e-3 }).then(pose);
    }
    let pose_leaves = [true, false, false, false];
    let point_leaves = vec![true; rest.points_m.len()];
    let second = marginalise(&rest, (&pose_leaves, &point_leaves), Some(&prior)).unwrap();
    let firsts: Vec<Pose> = prior.poses.iter().map(|(_, first)| *first).collect();
    assert_eq!(second.rank(), 12, "three poses less the gauge");
    let share = gauge_share(&second.clone().renumbered(|pose| pose - 1), &firsts[1..]);
    assert!(share < 1e-12, "with first estimates the gauge has a share of {share:e}");
    // Without them the same factors would measure it: the prior taken as if it had been made at today's poses.
    let mut moved = prior.clone();
    moved.poses.iter_mut().for_each(|(pose, first)| *first = rest.poses[index(*pose)]);
    let inconsistent = marginalise(&rest, (&pose_leaves, &point_leaves), Some(&moved)).unwrap();
    let wrong = gauge_share(&inconsistent.clone().renumbered(|pose| pose - 1), &rest.poses[1..]);
    assert!(wrong > 1e3 * share && inconsistent.rank() > 12, "{wrong:e}, rank {}", inconsistent.rank());
}

#[test]
fn a_window_under_its_prior_answers_like_the_window_that_still_has_all() {
    let cameras = rig();
    let mut tried = 0;
    for seed in 1..=5 {
        let mut whole = window(&cameras, seed, 0.5);
        // Points that stay are not seen by the leaving poses: nothing is lost, so both answers are the same up to
        // linearisation.
        let (poses, points) = leaves(&whole);
        whole.observations.retain(|o| o.pose >= 2 || points[index(o.point)]);
        for _ in 0..20 {
            whole.solve(30);
        }
        let prior = marginalise(&whole, (&poses, &points), None).unwrap().renumbered(|pose| pose - 2);
        let mut rest = remainder(&whole, &points);
        let truth = rest.poses.clone();
        let blind = {
            let mut alone = rest.clone();
            for _ in 0..20 {
                alone.solve(30);
            }
            alone.poses
        };
        for _ in 0..20 {
            rest.solve_under(Some(&prior), 30);
        }
        let relative = |poses: &[Pose]| apart(&truth[3].then(&truth[0].inverse()), &poses[3].then(&poses[0].inverse()));
        let (with, without) = (relative(&rest.poses), relative(&blind));
        // The optimum of the whole is where the prior was made, so the rest must stay there: steps of 1e-6 by the
        // stopping rule (gain 1e-5 of the cost of some 500 is 0.1 sigma of a millimetre at most; 20 rounds go well
        // below).
        assert!(with < 2e-5, "seed {seed}: moved by {with:e} from the whole window's answer");
        assert!(without > 5.0 * with, "seed {seed}: the prior must have mattered: {without:e} without, {with:e} with");
        tried += 1;
    }
    assert_eq!(tried, 5);
}

#[test]
fn missing_rank_is_handled_pose_without_points_points_at_infinity_and_single_sights() {
    let cameras = rig();
    let mut problem = window(&cameras, 8, 0.2);
    // Pose 1 sees nothing; point 1 is seen once by one camera; point 2 stands 1e9 m away.
    problem.observations.retain(|o| o.pose != 1 && (o.point != 1 || (o.pose == 0 && o.camera == CameraIndex(0))));
    problem.points_m[2] = DVec3::new(0.05, 0.1, 1.0) * 1e9;
    let far_m = problem.points_m[2];
    for o in problem.observations.iter_mut().filter(|o| o.point == 2) {
        let in_body_m = problem.poses[index(o.pose)].point(far_m);
        o.place_px = cameras[index(o.camera.0)].project_with_jacobian(in_body_m).unwrap().0;
    }
    let (poses, mut points) = leaves(&problem);
    (points[1], points[2]) = (true, true);
    let prior = marginalise(&problem, (&poses, &points), None).unwrap().renumbered(|pose| pose - 2);
    assert_eq!(prior.rank(), 18);
    assert!(gauge_share(&prior, &problem.poses[2..]) < 1e-11);
    assert!(information(&prior, &problem.poses[2..]).iter().all(|x| x.is_finite()));
    // One camera at the body's origin: scale is not measured either.
    let mut mono = window(&cameras, 8, 0.2);
    mono.observations.retain(|o| o.camera == CameraIndex(0));
    let (poses, points) = leaves(&mono);
    let prior = marginalise(&mono, (&poses, &points), None).unwrap();
    assert_eq!(prior.rank(), 17);
    // Nothing leaves but a pose that saw nothing: nothing to say.
    let none = vec![false; problem.points_m.len()];
    assert!(marginalise(&problem, (&[false, true, false, false, false, false], &none), None).is_none());
}
