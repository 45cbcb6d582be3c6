"""Golden values of the Lie rooms, from power series of the matrices at 50 digits (needs mpmath).

    python make_lie.py        writes lie.json beside this file

Nothing here knows the closed forms of the Rust code: every value comes from the defining series
(sums of W^k/k!, W^k/(k+1)!, ad^k/(k+1)!), differentiated term by term, or from a matrix inverse.
Inputs are f64 and taken as exact; outputs are rounded once, at the end.

Numbers are kept in strings, matrices row by row: not every JSON reader rounds decimals correctly,
and 1 ulp matters here.
"""

import json
import math
from pathlib import Path

import mpmath as mp

mp.mp.dps = 60  # 50 digits and a reserve for the alternating series at large angles
TERMS = 90
X = (0.3, -0.7, 1.1)  # the vector that derivatives are taken of, and the twist's translation part

GENERIC = (0.48, -0.6, 0.64)
NEGATIVE = (-1 / 3, -2 / 3, -2 / 3)
ANGLES = [
    1e-300, 1e-160, 1e-100, 1e-30, 1e-16, 1e-8, 1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.1, 0.3,
    math.nextafter(0.5, 0), 0.5, math.nextafter(0.5, 1), 1.0, 2.0, 3.0,
    math.pi - 1e-3, math.pi - 1e-6, math.pi - 1e-9, math.pi,
    math.nextafter(3.5, 0), 3.5, math.nextafter(3.5, 4), 4.0, 5.0, 6.0,
]  # fmt: skip
FEW = [1e-300, 1e-8, 0.1, 1.0, 3.0, math.pi - 1e-9, math.pi]
CASES = (
    [(0.0, (0, 0, 1))]
    + [(t, axis) for axis in (GENERIC, NEGATIVE, (0, 0, 1)) for t in ANGLES]
    + [(t, axis) for axis in ((1, 0, 0), (0, -1, 0)) for t in FEW]
)


def hat(v):
    return mp.matrix([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def ad(v, w):
    matrix = mp.zeros(6)
    matrix[0:3, 0:3] = matrix[3:6, 3:6] = hat(w)
    matrix[0:3, 3:6] = hat(v)
    return matrix


def series(matrix, shift):
    """The sum of matrix^k / (k + shift)!."""
    power = mp.eye(matrix.rows)
    total = mp.zeros(matrix.rows)
    for k in range(TERMS):
        total += power / mp.factorial(k + shift)
        power = power * matrix
    return total


def series_derivative(w, x, shift):
    """The derivative of sum hat(w)^k x / (k + shift)! by w: columns are the components of w."""
    big = hat(w)
    columns = []
    for i in range(3):
        unit = hat([1 if j == i else 0 for j in range(3)])
        y, dy, total = x, mp.zeros(3, 1), mp.zeros(3, 1)
        for k in range(TERMS):
            total += dy / mp.factorial(k + shift)
            y, dy = big * y, unit * y + big * dy
        columns.append(total)
    return mp.matrix([[columns[j][i] for j in range(3)] for i in range(3)])


def inverse(m):
    """3x3 inverse by cofactors, which keeps tiny entries to all digits."""

    def cofactor(i, j):
        a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
        return m[a, c] * m[b, d] - m[a, d] * m[b, c]

    det = sum(m[0, j] * cofactor(0, j) for j in range(3))
    return mp.matrix([[cofactor(j, i) / det for j in range(3)] for i in range(3)])


def log(rotation):
    """The rotation vector of the rotation nearest to `rotation` (its polar factor)."""
    for _ in range(8):  # Newton's iteration, quadratic from 1e-16 off
        rotation = (rotation + inverse(rotation).T) / 2
    skew = [
        (rotation[2, 1] - rotation[1, 2]) / 2,
        (rotation[0, 2] - rotation[2, 0]) / 2,
        (rotation[1, 0] - rotation[0, 1]) / 2,
    ]
    sine = mp.sqrt(sum(s * s for s in skew))
    trace = sum(rotation[i, i] for i in range(3))
    angle = mp.atan2(sine, (trace - 1) / 2)
    if sine == 0:
        return mp.zeros(3, 1)
    return mp.matrix([s / sine * angle for s in skew])


def rounded(matrix):
    return [[float(matrix[i, j]) for j in range(matrix.cols)] for i in range(matrix.rows)]


def text(matrix):
    return " ".join(repr(float(value)) for value in matrix)


def case(angle, axis):
    w64 = [angle * a for a in axis]
    w = mp.matrix([mp.mpf(value) for value in w64])
    x = mp.matrix([mp.mpf(value) for value in X])
    rotation, v = series(hat(w), 0), series(hat(w), 1)
    v_inverse = inverse(v)
    dv = series_derivative(w, x, 1)
    # With V z = x and x fixed, dV z + V dz = 0.
    dv_inverse = -v_inverse * series_derivative(w, v_inverse * x, 1)
    out = {
        "w": text(w),
        "exp": text(rotation),
        "left_jacobian": text(v),
        "left_jacobian_inverse": text(v_inverse),
        "exp_derivative": text(series_derivative(w, x, 0)),
        "left_jacobian_derivative": text(dv),
        "left_jacobian_inverse_derivative": text(dv_inverse),
        "translation": text(v * x),
    }
    q = series(ad(x, w), 1)[0:3, 3:6]
    out["coupling"] = text(q)
    out["coupling_inverse"] = text(-v_inverse * q * v_inverse)
    if angle <= math.pi:
        out["log"] = text(log(mp.matrix(rounded(rotation))))
    return out


def main():
    cases = [case(angle, axis) for angle, axis in CASES]
    lines = ",\n".join(json.dumps(c) for c in cases)
    header = json.dumps({"x": text(X)})[:-1]
    Path(__file__).with_name("lie.json").write_text(f'{header}, "cases": [\n{lines}\n]}}\n')


if __name__ == "__main__":
    main()
