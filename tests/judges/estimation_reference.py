"""Bundle adjustment, its covariances, and a pose graph, solved by GTSAM.

Writes JSON for tests/estimation.rs (stored as tests/data/estimation.json): python estimation_reference.py > tests/data/estimation.json
Needs gtsam and numpy. Poses are world_from_body as tx ty tz qx qy qz qw; covariances are of (linear, angular) in the body's frame.
"""
import json

import gtsam
import numpy as np
from gtsam import Point3, Pose3, Rot3

rng = np.random.default_rng(7)
SIGMA_PX, HUBER = 0.5, 2.448
FX, FY, CX, CY = 320.0, 321.0, 320.0, 240.0
TO_LINEAR_FIRST = [3, 4, 5, 0, 1, 2]


def key(letter, number):
    return gtsam.symbol(letter, number)


def numbers(pose):
    q = pose.rotation().toQuaternion()
    return [float(x) for x in [*pose.translation(), q.x(), q.y(), q.z(), q.w()]]


def twist(linear, angular):
    return Pose3.Expmap(np.array([*angular, *linear]))


def parameters():
    p = gtsam.LevenbergMarquardtParams()
    p.setRelativeErrorTol(1e-16)
    p.setAbsoluteErrorTol(1e-16)
    p.setMaxIterations(500)
    return p


def adjustment():
    mountings = [twist([-0.03, 0.01, 0.0], [0.01, -0.03, -0.02]), twist([0.04, 0.01, 0.0], [0.01, 0.04, -0.02])]
    truth = [twist([0.25 * n, 0.03 * n * n, -0.1 * n], [0.02 * n, -0.05 * n, 0.03 * n]) for n in range(5)]
    points = np.column_stack([rng.uniform(-1.6, 2.2, 40), rng.uniform(-1.2, 1.2, 40), rng.uniform(2.5, 6.0, 40)])
    calibration = gtsam.Cal3_S2(FX, FY, 0.0, CX, CY)
    plain = gtsam.noiseModel.Isotropic.Sigma(2, SIGMA_PX)
    robust = gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Huber.Create(HUBER), plain)
    graphs = [gtsam.NonlinearFactorGraph(), gtsam.NonlinearFactorGraph()]
    observations = []
    for p, point in enumerate(points):
        for n, pose in enumerate(truth):
            for c, mounting in enumerate(mountings):
                local = pose.compose(mounting).transformTo(Point3(*point))
                if local[2] < 0.3:
                    continue
                pixel = np.array([FX * local[0] / local[2] + CX, FY * local[1] / local[2] + CY])
                if not (0 <= pixel[0] <= 639 and 0 <= pixel[1] <= 479):
                    continue
                pixel = pixel + rng.normal(0, SIGMA_PX, 2)
                if rng.uniform() < 0.03:
                    pixel = pixel + rng.uniform(-9, 9, 2)
                observations.append([n, p, c, float(pixel[0]), float(pixel[1])])
                for graph, noise in zip(graphs, [robust, plain]):
                    graph.add(gtsam.GenericProjectionFactorCal3_S2(pixel, noise, key("x", n), key("p", p), calibration, mounting))
    start = gtsam.Values()
    starts = [truth[0]] + [pose.compose(twist(rng.normal(0, 0.02, 3), rng.normal(0, 0.01, 3))) for pose in truth[1:]]
    moved = points + rng.normal(0, 0.05, points.shape)
    for n, pose in enumerate(starts):
        start.insert(key("x", n), pose)
    for p, point in enumerate(moved):
        start.insert(key("p", p), Point3(*point))
    for graph in graphs:
        graph.add(gtsam.NonlinearEqualityPose3(key("x", 0), truth[0]))
    result = gtsam.LevenbergMarquardtOptimizer(graphs[0], start, parameters()).optimize()
    # Covariances of the plain model at the robust answer, the held pose known to a micrometre.
    exact = gtsam.NonlinearFactorGraph()
    for k in range(graphs[1].size() - 1):
        exact.add(graphs[1].at(k))
    exact.add(gtsam.PriorFactorPose3(key("x", 0), truth[0], gtsam.noiseModel.Isotropic.Sigma(6, 1e-6)))
    marginals = gtsam.Marginals(exact, result)
    pose_covariances = []
    for n in range(1, 5):
        c = np.array(marginals.marginalCovariance(key("x", n)))[np.ix_(TO_LINEAR_FIRST, TO_LINEAR_FIRST)]
        pose_covariances.append([float(x) for x in c.flatten()])
    return {
        "focal_and_centre_px": [FX, FY, CX, CY], "sigma_px": SIGMA_PX, "mountings": [numbers(m) for m in mountings],
        "observations": observations, "start_poses": [numbers(p) for p in starts], "start_points": moved.tolist(),
        "poses": [numbers(result.atPose3(key("x", n))) for n in range(5)],
        "points": [[float(x) for x in result.atPoint3(key("p", p))] for p in range(40)],
        "error": 2 * graphs[0].error(result), "pose_covariances": pose_covariances,
        "point_covariances": [[float(x) for x in np.array(marginals.marginalCovariance(key("p", p))).flatten()] for p in range(5)],
    }


def loop():
    count, linear, angular = 40, 0.02, 0.01
    turn = 2 * np.pi / count
    truth = [Pose3(Rot3.RzRyRx(0.1 * np.sin(n), 0.1 * np.cos(n), turn * n),
                   Point3(2 * np.cos(turn * n), 2 * np.sin(turn * n), 0.3 * np.sin(3 * turn * n))) for n in range(count)]
    sigmas = np.array([angular] * 3 + [linear] * 3)
    plain = gtsam.noiseModel.Diagonal.Sigmas(sigmas)
    robust = gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Huber.Create(2.0), plain)
    graph, start, edges = gtsam.NonlinearFactorGraph(), gtsam.Values(), []
    links = [(n, n + 1) for n in range(count - 1)] + [(39, 0), (5, 25), (12, 33), (20, 2)]
    for a, b in links:
        motion = truth[a].between(truth[b]).compose(Pose3.Expmap(rng.normal(0, 1, 6) * sigmas))
        if (a, b) == (20, 2):
            motion = Pose3()  # A false loop.
        is_loop = b != a + 1
        graph.add(gtsam.BetweenFactorPose3(a, b, motion, robust if is_loop else plain))
        edges.append([a, b, int(is_loop), numbers(motion)])
    graph.add(gtsam.NonlinearEqualityPose3(0, truth[0]))
    pose, starts = truth[0], [truth[0]]
    for edge in range(count - 1):
        pose = pose.compose(graph.at(edge).measured())
        starts.append(pose)
    for n, pose in enumerate(starts):
        start.insert(n, pose)
    result = gtsam.LevenbergMarquardtOptimizer(graph, start, parameters()).optimize()
    return {"linear_m": linear, "angular_rad": angular, "huber": 2.0, "edges": edges, "start": [numbers(p) for p in starts],
            "poses": [numbers(result.atPose3(n)) for n in range(count)], "error": 2 * graph.error(result)}


print(json.dumps({"adjustment": adjustment(), "loop": loop()}, separators=(",", ":")))
