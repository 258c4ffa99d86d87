"""Exponentials and left Jacobians of SE(3) and Sim(3) at 60 digits, by power series of their matrices.

Writes JSON for tests/lie.rs (stored as tests/data/lie.json): python lie_reference.py > tests/data/lie.json
Needs mpmath. Tangents are linear, angular, scale; matrices are row-major.
"""
import json

from mpmath import eye, matrix, mp, mpf, zeros

mp.dps = 60


def skew(v):
    return matrix([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def put(target, block, row, column):
    for i in range(block.rows):
        for j in range(block.cols):
            target[row + i, column + j] = block[i, j]


def series(a, shift):
    """Sum of a^k / (k + shift)!."""
    total, term = zeros(a.rows), eye(a.rows)
    for n in range(1, shift + 1):
        term = term / n
    k = 0
    while k < 400:
        total = total + term
        k += 1
        term = term * a / (k + shift)
    return total


def case(values):
    p, w, s = [mpf(v) for v in values[:3]], [mpf(v) for v in values[3:6]], mpf(values[6])

    def algebra(sigma):
        a = zeros(4)
        put(a, skew(w) + sigma * eye(3), 0, 0)
        put(a, matrix(p), 0, 3)
        return a

    def commutator(size, sigma):
        a = zeros(size)
        put(a, skew(w) + sigma * eye(3), 0, 0)
        put(a, skew(p), 0, 3)
        put(a, skew(w), 3, 3)
        if size == 7:
            put(a, -matrix(p), 0, 6)
        return a

    flat = lambda m, rows: [float(m[i, j]) for i in range(rows) for j in range(m.cols)]
    return {
        "tangent": values,
        "se3_exp": flat(series(algebra(mpf(0)), 0), 3),
        "sim3_exp": flat(series(algebra(s), 0), 3),
        "se3_left_jacobian": flat(series(commutator(6, mpf(0)), 1), 6),
        "sim3_left_jacobian": flat(series(commutator(7, s), 1), 7),
    }


pi = 3.141592653589793
angles = [0.0, 1e-300, 1e-9, 1e-5, 9.999e-3, 1.0001e-2, 0.3, 0.9999, 1.0001, 2.0, 3.0, pi - 1e-6, pi - 1e-12, pi]
axes = [[0.6, 0.0, -0.8], [2 / 3, -1 / 3, 2 / 3]]
linears = [[0.3, -1.2, 2.0], [40.0, -7.0, 0.01]]
scales = [0.0, 1e-12, -0.02, 0.9, -2.0]
cases = []
for n, angle in enumerate(angles):
    for m in range(2):
        axis = axes[m]
        cases.append(case(linears[(n + m) % 2] + [angle * x for x in axis] + [scales[(2 * n + m) % 5]]))
print("[\n" + ",\n".join(json.dumps(c, separators=(",", ":")) for c in cases) + "\n]")
