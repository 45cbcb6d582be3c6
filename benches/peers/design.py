"""Pre-bent design side by side: tdcr, scipy least_squares and CasADi + IPOPT in one run.

The finger of Mahapatra & Ghosal around a sphere: 9 subsegments, one tendon, the rest bends that
take the disks to wanted places under a pull of 3 % of the length. scipy changes all 18 rest bends,
by differences of tdcr's own forward solves. CasADi + IPOPT gets the plane's problem alone, with
exact derivatives: bends, rest bends and tension as unknowns, balance and tendon length as
constraints. Both start from the straight finger, as tdcr does.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from math import factorial

# A pool of BLAS threads makes these small problems slower.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import tdcr
from tdcr import design

LENGTH, N, RADIUS, PULL = 0.18, 9, 0.008, -0.0054
ELL = LENGTH / N
# Bends of the wanted shape, towards +x: two entry arcs and a circle of 64 mm.
WANTED = np.repeat([0.0365, 0.225, -0.3125], [2, 2, 5])
# Largest distance of a disk from its place that counts as an answer, as a share of the length.
REACHED = 1e-6

Array = NDArray[np.float64]
# Rest bends about y and largest distance of a disk from its place, found by another forward solve.
Answer = tuple[Array, float]


def finger(rest: Array | None = None) -> tdcr.Robot:
    """Return the finger with rest rotation vectors (n, 3)."""
    return tdcr.Robot(tdcr.Backbone(LENGTH, N, rest=rest), [tdcr.Tendon(np.pi, RADIUS)])


def along_y(bends: Array) -> Array:
    """Rotation vectors (n, 3) of bends in the plane."""
    return np.stack([0 * bends, bends, 0 * bends], axis=1)


PLACES = finger(along_y(WANTED)).rest_frames[1:, :3, 3]


def off(rest: Array) -> float:
    """Largest distance of a disk from its place, as a share of the length."""
    positions = tdcr.forward(finger(rest), [PULL]).require().positions[1:]
    return float(np.linalg.norm(positions - PLACES, axis=1).max() / LENGTH)


def by_tdcr() -> Array:
    """Rest rotation vectors (n, 3)."""
    rest = design.prebend(finger(), PLACES, [PULL]).require().robot.backbone.rest
    assert rest is not None
    return rest


def by_scipy(method: str) -> Callable[[], Array]:
    """Return a run of least_squares."""

    def rotation(bends: Array) -> Array:
        return np.column_stack([bends.reshape(N, 2), np.zeros(N)])

    def miss(bends: Array) -> Array:
        positions = tdcr.forward(finger(rotation(bends)), [PULL]).positions[1:]
        flat: Array = ((positions - PLACES) / LENGTH).ravel()
        return flat

    def run() -> Array:
        tight = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}
        return rotation(least_squares(miss, np.zeros(2 * N), method=method, **tight).x)

    return run


def by_ipopt(options: dict[str, object]) -> Callable[[], Array]:
    """Return a run of IPOPT on the plane's problem, its solver made once."""
    bend, rest, tension = ca.SX.sym("b", N), ca.SX.sym("r", N), ca.SX.sym("t")

    def chord(b: ca.SX) -> ca.SX:
        # l sin(b/2)/(b/2) as a series, which has no special case at rest.
        return ELL * sum((-1) ** k * (b / 2) ** (2 * k) / factorial(2 * k + 1) for k in range(9))

    def piece(b: ca.SX) -> ca.SX:
        return chord(b) + 2 * RADIUS * ca.sin(b / 2)

    pieces = ca.sum1(piece(bend))
    energy = ca.sumsqr(bend - rest) / (2 * ELL)
    balance = ca.gradient(energy + tension * pieces, bend)
    length = (pieces - ca.sum1(piece(rest)) - PULL) / LENGTH
    x = z = heading = ca.SX(0)
    miss = ca.SX(0)
    for i in range(N):
        x += chord(bend[i]) * ca.sin(heading + bend[i] / 2)
        z += chord(bend[i]) * ca.cos(heading + bend[i] / 2)
        heading += bend[i]
        miss += ((x - PLACES[i, 0]) ** 2 + (z - PLACES[i, 2]) ** 2) / LENGTH**2
    unknowns = ca.vertcat(bend, rest, tension)
    nlp = {"x": unknowns, "f": miss, "g": ca.vertcat(balance, length)}
    quiet = {"print_level": 0, "sb": "yes", **options}
    solver = ca.nlpsol("solver", "ipopt", nlp, {"print_time": 0, "ipopt": quiet})

    def run() -> Array:
        found = np.asarray(solver(x0=np.zeros(2 * N + 1), lbg=0, ubg=0)["x"]).ravel()
        return along_y(found[N : 2 * N])

    return run


def main() -> None:
    """Check the answers, measure in turns and print a table; times are medians."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few repeats: rough figures")
    repeats = 3 if parser.parse_args().quick else 15
    runs = {
        "tdcr, call from Python": by_tdcr,
        "scipy least_squares, lm": by_scipy("lm"),
        "scipy least_squares, trf": by_scipy("trf"),
        "CasADi + IPOPT, plane": by_ipopt({}),
        "CasADi + IPOPT, plane, tol 1e-12": by_ipopt({"tol": 1e-12}),
    }
    times: dict[str, list[float]] = {name: [] for name in runs}
    worst = dict.fromkeys(runs, 0.0)
    for _ in range(repeats):
        for name, run in runs.items():
            begin = time.perf_counter()
            rest = run()
            times[name].append(time.perf_counter() - begin)
            worst[name] = max(worst[name], off(rest))
    assert worst["tdcr, call from Python"] < 1e-12
    medians = {name: float(np.median(seconds)) for name, seconds in times.items()}
    own = medians["tdcr, call from Python"]
    print("off: largest distance of a disk from its place / length")
    for name, median in medians.items():
        reached = "" if worst[name] < REACHED else "  not reached"
        line = f"{name:34} {median * 1e6:10.0f} us {median / own:9.1f}x   {worst[name]:.0e}"
        print(line + reached)


if __name__ == "__main__":
    main()
