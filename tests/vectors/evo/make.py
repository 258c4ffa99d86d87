#!/usr/bin/env python3
"""Makes the trajectory pairs of this folder and evo's answers to them.

    python3 make.py EVO_CHECK.py      (evo 1.38.1, numpy 2.x; writes NN_gt.txt, NN_est.txt and answers.json beside itself)

Each case differs in length, rate, offset, turn, scale, noise, time jitter or gaps; `why` says what it is there for.
"""
import json, pathlib, subprocess, sys
import numpy as np

HERE = pathlib.Path(__file__).parent


def quaternion(axis_angle):
    angle = np.linalg.norm(axis_angle, axis=-1, keepdims=True)
    axis = axis_angle / np.where(angle > 0, angle, 1)
    return np.concatenate([axis * np.sin(angle / 2), np.cos(angle / 2)], axis=-1)


def multiply(a, b):
    av, aw, bv, bw = a[..., :3], a[..., 3:], b[..., :3], b[..., 3:]
    vector = aw * bv + bw * av + np.cross(av, bv)
    return np.concatenate([vector, aw * bw - np.sum(av * bv, axis=-1, keepdims=True)], axis=-1)


def turned(q, v):
    zero = np.zeros((len(v), 1))
    conjugate = q * np.array([-1, -1, -1, 1])
    return multiply(multiply(np.broadcast_to(q, (len(v), 4)), np.hstack([v, zero])), np.broadcast_to(conjugate, (len(v), 4)))[:, :3]


def smooth(rng, t, size):
    """A sum of slow sines in three axes."""
    f, p, a = rng.uniform(0.1, 0.9, (5, 3)), rng.uniform(0, 6.3, (5, 3)), rng.normal(0, size, (5, 3))
    return sum(a[k] * np.sin(2 * np.pi * f[k] * t[:, None] + p[k]) for k in range(5))


def write(path, t, xyz, q):
    rows = np.column_stack([t, xyz, q])
    path.write_text("".join(" ".join(f"{v:.9f}" for v in row) + "\n" for row in rows))


def case(seed, n=90, rate=30.0, n_est=None, rate_est=None, start=0.0, noise=0.01, rot_noise=0.01, scale=1.0, time_jitter=0.0,
         shift_s=0.0, drop=0.0, flatten=None, still=False, mirror=False, offset=(0, 0, 0), size=0.4):
    rng = np.random.default_rng(seed)
    t = start + np.arange(n) / rate
    rate_est, n_est = rate_est or rate, n_est or n
    te = start + shift_s + np.arange(n_est) / rate_est
    state = rng.bit_generator.state

    def truth(at):
        rng.bit_generator.state = state
        xyz, turn = smooth(rng, at - start, size), smooth(rng, at - start, 0.3)
        if still:
            xyz = np.tile([0.25, -1.5, 2.0], (len(at), 1))
        if flatten is not None:
            xyz[:, flatten] = 0.0
        return xyz, quaternion(turn)

    xyz, q = truth(t)
    xyz_e, q_e = truth(te)
    rng = np.random.default_rng(seed + 1000)
    if mirror:
        xyz_e = xyz_e * [-1, 1, 1]
    xyz_e = xyz_e + rng.normal(0, noise, xyz_e.shape) if noise else xyz_e
    q_e = multiply(q_e, quaternion(rng.normal(0, rot_noise, (len(te), 3))))
    move = quaternion(rng.normal(0, 1.0, (1, 3)))[0]
    xyz_e = turned(move, xyz_e * scale) + np.array(offset)
    q_e = multiply(np.broadcast_to(move, q_e.shape), q_e)
    te = te + rng.uniform(-time_jitter, time_jitter, len(te))
    keep = rng.uniform(size=len(te)) >= drop
    return (t, xyz, q), (te[keep], xyz_e[keep], q_e[keep])


CASES = [
    ("30 Hz, small noise", dict(seed=1)),
    ("large offset and turn, big noise", dict(seed=2, n=70, noise=0.2, offset=(100, -50, 7))),
    ("estimate at a third of the rate", dict(seed=3, n=150, n_est=50, rate_est=10.0)),
    ("estimate at twice the rate", dict(seed=4, n=60, n_est=120, rate_est=60.0)),
    ("time jitter up to 8 ms", dict(seed=5, n=80, time_jitter=0.008)),
    ("frames lost", dict(seed=6, n=120, drop=0.3)),
    ("scale of a single camera", dict(seed=7, n=75, scale=0.37, noise=0.003)),
    ("motion in a plane", dict(seed=8, n=64, flatten=2, noise=0.0)),
    ("a mirrored estimate", dict(seed=9, n=64, mirror=True)),
    ("a rig that stands still", dict(seed=10, n=64, still=True, noise=0.001, offset=(1, 2, 3))),
    ("still, and the answer frozen: no alignment", dict(seed=11, n=40, still=True, noise=0.0)),
    ("shorter than a second, epoch stamps, micrometres", dict(seed=12, n=20, start=1403636579.763555, noise=1e-6)),
    ("200 Hz truth, 29.97 Hz estimate, 4 ms apart", dict(seed=13, n=500, rate=200.0, n_est=72, rate_est=29.97, shift_s=0.004)),
    ("three poses", dict(seed=14, n=3, rate=2.0)),
]


def main():
    answers = []
    for number, (why, kw) in enumerate(CASES, 1):
        files = [HERE / f"{number:02d}_{name}.txt" for name in ("gt", "est")]
        for path, rows in zip(files, case(**kw)):
            write(path, *rows)
        done = subprocess.run([sys.executable, sys.argv[1], *map(str, files)], capture_output=True, text=True)
        r = json.loads(done.stdout)
        assert r["ok"], (why, r)
        row = {"case": number, "why": why, "associated": r["n_matched"], "rate_hz": r["est_rate_hz"], "covered": r["covered"],
               "path_m": r["gt_path_m"], "still_steps_under_1um": r["still_steps_under_1um"],
               "still_d2_m": r["jitter"]["origin"]["d2_sigma_m"]}
        for kind in ("none", "se3", "sim3"):
            rpe = r["rpe"].get(kind, {})
            rmse = lambda part: part["trans"]["rmse"] if part and part.get("trans") else None
            row[kind] = {"ate_m": rmse(r["ape"][kind]), "rpe_m": rmse(rpe.get("sec_1")), "jitter_frame_m": rmse(rpe.get("frames_1")),
                         "jitter_d2_m": r["jitter"].get(kind, {}).get("d2_sigma_m"),
                         "scale": r.get("umeyama", {}).get(kind, {}).get("scale")}
        answers.append(row)
    (HERE / "answers.json").write_text(json.dumps(answers, indent=1) + "\n")


main()
