//! Pose graphs: against GTSAM's answer, false loops, drifting scale, gauge, parts, and bits.

use glam::DVec3;
use sensel::draw::DrawKey;
use sensel::num::{f64_from_usize, u32_from, u64_from};
use sensel::pose::Pose;
use sensel::tracker::lie::{Sim3, SimTwist, Twist, se3_exp};
use sensel::tracker::pose_graph::{Edge, PoseGraph, RobustKernel, information};

use super::{apart, normal, normals, pose};

#[derive(serde::Deserialize)]
struct Stored {
    #[serde(rename = "loop")]
    ring: Ring,
}

#[derive(serde::Deserialize)]
struct Ring {
    linear_m: f64,
    angular_rad: f64,
    huber: f64,
    edges: Vec<(u32, u32, u32, [f64; 7])>,
    start: Vec<[f64; 7]>,
    poses: Vec<[f64; 7]>,
    error: f64,
}

#[test]
fn a_ring_with_a_false_loop_is_solved_as_gtsam_solves_it() {
    let stored: Stored = serde_json::from_str(include_str!("../data/estimation.json")).unwrap();
    let ring = stored.ring;
    let mut graph = PoseGraph::new(ring.start.iter().map(|numbers| pose(numbers).into()).collect(), false);
    graph.held[0] = true;
    for (from, to, is_loop, motion) in &ring.edges {
        let kernel = if *is_loop == 1 { RobustKernel::Huber(ring.huber) } else { RobustKernel::Full };
        let information = information(ring.linear_m, ring.angular_rad, 1.0);
        graph.edges.push(Edge { from: *from, to: *to, from_to: pose(motion).into(), information, kernel });
    }
    let outcome = graph.solve(100);
    assert!(outcome.converged, "{outcome:?}");
    // GTSAM reports half of the Huber cost in its own scaling, k |e| - k^2 / 2; twice that is ours.
    assert!((outcome.cost_after / ring.error - 1.0).abs() < 1e-9, "{outcome:?} for {}", ring.error);
    let worst = graph.nodes.iter().zip(&ring.poses).map(|(node, truth)| apart(&node.pose(), &pose(truth)));
    let worst = worst.fold(0.0, f64::max);
    assert!(worst < 1e-6, "worst node off by {worst:e}");
    assert_eq!(graph.nodes.len(), 40);
    assert!(outcome.factor_blocks < 120, "39 nodes in a chain with four loops: {outcome:?}");
}

/// Keyframes on a circle, walked twice round, with the truth.
fn walk(count: usize) -> Vec<Pose> {
    let at = |n: usize| {
        let turn = 2.0 * std::f64::consts::TAU * f64_from_usize(n) / f64_from_usize(count);
        let rotation = se3_exp(Twist::from_array([0.0, 0.0, 0.0, 0.1 * libm::sin(3.0 * turn), turn, 0.0])).rotation;
        Pose::new(rotation, DVec3::new(2.0 * libm::sin(turn), 0.2 * libm::sin(5.0 * turn), 2.0 * libm::cos(turn)))
    };
    (0..count).map(at).collect()
}

/// Odometry with drift (a scale that shrinks by `shrink` a step), and true loops between the two rounds.
fn drifted(seed: u64, shrink: f64, noise: f64) -> (Vec<Pose>, PoseGraph) {
    let truth = walk(120);
    let key = DrawKey::root(seed);
    let mut nodes = vec![Sim3::from(truth[0])];
    let mut edges = Vec::new();
    for n in 1..truth.len() {
        let step = key.with(u64_from(n));
        let noise = SimTwist {
            linear_m: normals(step) * 0.01 * noise,
            angular_rad: normals(step.with(1)) * 0.004 * noise,
            log_scale: -shrink,
        };
        // The map's unit shrinks: the same metre is measured shorter from step to step.
        let from_to = Sim3::from(truth[n - 1].inverse().then(&truth[n])).then(&Sim3::exp(noise));
        nodes.push(nodes[n - 1].then(&from_to));
        edges.push((u32_from(n - 1), u32_from(n), from_to, RobustKernel::Full));
    }
    let mut graph = PoseGraph::new(nodes, shrink != 0.0);
    graph.held[0] = true;
    for n in (3..60).step_by(6) {
        let from_to = Sim3::from(truth[n].inverse().then(&truth[n + 60]));
        edges.push((u32_from(n), u32_from(n + 60), from_to, RobustKernel::Switchable(16.8)));
    }
    for (from, to, from_to, kernel) in edges {
        graph.edges.push(Edge { from, to, from_to, information: information(0.01, 0.004, 0.003), kernel });
    }
    (truth, graph)
}

fn ate_m(graph: &PoseGraph, truth: &[Pose]) -> f64 {
    let miss2: f64 =
        graph.nodes.iter().zip(truth).map(|(n, t)| (n.translation_m - t.translation_m).length_squared()).sum();
    (miss2 / f64_from_usize(truth.len())).sqrt()
}

#[test]
fn loops_take_the_drift_out_and_false_ones_are_switched_off() {
    let (mut tried, mut sum_before_m, mut sum_after_m) = (0, 0.0, 0.0);
    for seed in 1..=8 {
        let (truth, mut graph) = drifted(seed, 0.0, 1.0);
        let before_m = ate_m(&graph, &truth);
        let mut lied_to = graph.clone();
        for lie in 0..3_u32 {
            let from_to = Sim3::from(se3_exp(Twist::from_array([0.1, -0.2, 0.1, 0.3, f64::from(lie), 0.2])));
            let information = information(0.01, 0.004, 1.0);
            lied_to.edges.push(Edge {
                from: 10 + 9 * lie,
                to: 70 + 17 * lie,
                from_to,
                information,
                kernel: RobustKernel::Switchable(16.8),
            });
        }
        graph.solve_graduated(100);
        lied_to.solve_graduated(100);
        let (honest_m, lied_m) = (ate_m(&graph, &truth), ate_m(&lied_to, &truth));
        // One round ends where it began; what is left is its own bend: 4 mrad * sqrt(60 / 4) over 4 m is 6 cm, and
        // three times that at the worst.
        assert!(honest_m < 0.19, "seed {seed}: {honest_m} m after, {before_m} m before");
        (sum_before_m, sum_after_m) = (sum_before_m + before_m, sum_after_m + honest_m);
        assert!((lied_m - honest_m).abs() < 0.002, "seed {seed}: {lied_m} m with lies, {honest_m} m without");
        let weights = lied_to.weights();
        let (lies, loops) = (&weights[weights.len() - 3..], &weights[119..129]);
        assert!(lies.iter().all(|&weight| weight < 1e-3), "seed {seed}: {lies:?}");
        assert!(loops.iter().filter(|&&weight| weight > 0.3).count() >= 8, "seed {seed}: {loops:?}");
        tried += 1;
    }
    assert!(tried == 8 && sum_after_m < 0.5 * sum_before_m, "{sum_after_m} m after, {sum_before_m} m before");
}

#[test]
fn drifting_scale_of_a_mono_map_is_brought_back() {
    let (truth, mut graph) = drifted(5, 0.003, 0.0);
    // 119 steps of 0.3 % leave the last node's unit at 0.70 of the first's.
    assert!((graph.nodes[119].scale - libm::exp(-0.003 * 119.0)).abs() < 1e-9);
    let before_m = ate_m(&graph, &truth);
    let outcome = graph.solve_graduated(100);
    assert!(outcome.converged, "{outcome:?}");
    let after_m = ate_m(&graph, &truth);
    assert!(before_m > 0.2 && after_m < 0.5 * before_m, "{before_m} m before, {after_m} m after");
    // Loops demand equal units on both rounds: the drift of one round is shared out and what is left is the walk within
    // a round.
    assert!((graph.nodes[119].scale / graph.nodes[59].scale - 1.0).abs() < 0.02, "{}", graph.nodes[119].scale);
}

#[test]
fn the_gauge_stays_and_each_part_keeps_its_own() {
    let (truth, mut graph) = drifted(3, 0.0, 1.0);
    let first = graph.nodes[0];
    graph.nodes.extend([Sim3::from(truth[7]), Sim3::IDENTITY]);
    graph.held.extend([false, false]);
    let from_to = Sim3::from(se3_exp(Twist::from_array([0.5, 0.0, 0.0, 0.0, 0.2, 0.0])));
    graph.edges.push(Edge {
        from: 120,
        to: 121,
        from_to,
        information: information(0.1, 0.1, 0.1),
        kernel: RobustKernel::Full,
    });
    let mut again = graph.clone();
    let outcome = graph.solve(100);
    assert_eq!(graph.nodes[0], first, "the held node moved");
    assert_eq!(graph.nodes[120], Sim3::from(truth[7]), "the first node of the other part moved");
    let expected = graph.nodes[120].then(&from_to).pose();
    assert!(apart(&expected, &graph.nodes[121].pose()) < 1e-9);
    assert_eq!(again.solve(100), outcome);
    assert_eq!(again.nodes, graph.nodes, "equal input must give equal bits");
    // No node, no edge, and identical poses are solved by standing still.
    assert_eq!(PoseGraph::default().solve(5).cost_after, 0.0);
    let mut still = PoseGraph::new(vec![Sim3::IDENTITY; 3], true);
    still.add_present_edge(0, 1, information(0.1, 0.1, 0.1));
    still.add_present_edge(1, 2, information(0.1, 0.1, 0.1));
    assert_eq!(still.solve(5).cost_after, 0.0);
    assert_eq!(still.nodes, vec![Sim3::IDENTITY; 3]);
}

#[test]
fn kernels_are_smooth_and_their_weight_is_the_slope_of_their_cost() {
    let mut tried = 0;
    for kernel in [RobustKernel::Full, RobustKernel::Huber(2.0), RobustKernel::Switchable(4.0)] {
        for step in 1..200_u32 {
            let error2 = 0.1 * f64::from(step) + 1e-7 * normal(DrawKey::root(u64::from(step)));
            let h = 1e-5;
            let slope = (kernel.at(error2 + h).0 - kernel.at(error2 - h).0) / (2.0 * h);
            // Second derivatives below 1 either side of the seam: a step of 1e-5 across it moves the slope by that.
            assert!((slope - kernel.at(error2).1).abs() < 2e-5, "{kernel:?} at {error2}");
            tried += 1;
        }
    }
    assert_eq!(tried, 3 * 199);
}
