"""The strain-energy rod side by side: tdcr, CasADi + IPOPT and scipy's SLSQP in one run.

One statement for all: least energy of the subsegments' strains (arcs, sliding tendons) under tendon
lengths that may not exceed their bounds. The peers get it in the form that suits them best: the
energy is half the square of the unknowns, tendon pieces depend on one subsegment alone, free
tendons are left out, rotations are series without a special case at rest, and derivatives are exact
(CasADi's, made once; the SLSQP calls them on arrays in place). A problem is a path of
displacements; warm means from the solution of the row before. Several settings of each peer are
tried, and the fastest whose disks are where tdcr's are, in every row, counts.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from math import factorial
from typing import Any

# A pool of BLAS threads makes these small problems slower, up to 200 times on a busy machine.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import tdcr

# No disk may be further off than this share of the length.
AGREE = 1e-7
# A subsegment here bends by less than 0.5 rad: what the series leaves out is below 1e-25.
TERMS = 10

WARM = {
    "warm_start_init_point": "yes",
    "warm_start_bound_push": 1e-9,
    "warm_start_bound_frac": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_slack_bound_frac": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
}
IPOPT: list[dict[str, Any]] = [
    {},
    {"tol": 1e-10},
    *({**WARM, "mu_init": mu} for mu in (1e-7, 1e-9, 1e-11)),
    *({**WARM, "mu_init": mu, "tol": 1e-10} for mu in (1e-7, 1e-9, 1e-11)),
    {**WARM, "mu_init": 1e-9, "mu_strategy": "adaptive"},
]
SLSQP: list[dict[str, Any]] = [
    {"ftol": ftol, "maxiter": 1000} for ftol in (1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14)
]

Array = NDArray[np.float64]
# Of warm or not: unknowns and seconds, row by row.
Run = Callable[[bool], tuple[Array, Array]]


# --- problems ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Problem:
    """A robot with equal subsegments and a path of displacements, shape (B, K) [m]."""

    name: str
    length: float
    rest: Array
    azimuths: list[Array]
    radius: float
    poisson_ratio: float
    path: Array

    def robot(self) -> tdcr.Robot:
        """Return it as tdcr's."""
        backbone = tdcr.Backbone(
            self.length, len(self.rest), poisson_ratio=self.poisson_ratio, rest=self.rest
        )
        tendons = [tdcr.Tendon(a, self.radius, end=len(a) - 1) for a in self.azimuths]
        return tdcr.Robot(backbone, tendons)


def helical(rows: int) -> Problem:
    """One tendon of half a turn, pulled from 8 to 12 mm."""
    n = 10
    azimuth = np.pi * np.linspace(0, 1, n + 1)
    path = np.linspace(-0.008, -0.012, rows)[:, None]
    return Problem(
        "helical, one tendon, n = 10", 0.2, np.zeros((n, 3)), [azimuth], 0.01, 0.35, path
    )


def prebent(rows: int) -> Problem:
    """Mahapatra & Ghosal's prototype, pre-bent in space, with a general routing, 3 to 6 mm."""
    s = np.linspace(0, 0.180, 60)
    curve = np.stack([0.020 * np.sin(s / 0.045) ** 2, 0.030 * (s / 0.180) ** 2, s], axis=1)
    backbone = tdcr.Backbone.from_curve(curve, 9)
    holes = np.array([0, 1, 1, 2, 4, 5, 5, 4, 3, 3]) * np.pi / 6
    rest = np.array(backbone.rest)
    path = np.linspace(-0.003, -0.006, rows)[:, None]
    name = "pre-bent, general routing, n = 9"
    return Problem(name, backbone.total_length, rest, [holes], 0.008, 0.39, path)


SEGMENT, SEGMENTS, DISKS = 0.06, 3, 10


def segments(name: str, path: Array) -> Problem:
    """Three segments of ten subsegments, with three straight tendons each."""
    azimuths = [
        np.full(DISKS * (s + 1) + 1, s * np.pi / 4 + 2 * np.pi * k / 3)
        for s in range(SEGMENTS)
        for k in range(3)
    ]
    rest = np.zeros((DISKS * SEGMENTS, 3))
    return Problem(name, SEGMENTS * SEGMENT, rest, azimuths, 0.0045, 0.35, path)


def pulled(rows: int) -> Problem:
    """Two of a segment's tendons pulled and taut, the third free."""
    tensions = np.array([1500.0, 800.0, 0.0, 300.0, 1200.0, 0.0, 900.0, 1100.0, 0.0])
    robot = segments("", np.zeros((1, 9))).robot()
    path = [
        tdcr.forward(robot, tensions=share * tensions).require().displacements
        for share in np.linspace(0.8, 1.2, rows)
    ]
    free = np.where(tensions == 0, np.inf, path)
    return segments("three segments, two of three tendons pulled, n = 30", free)


def commanded(rows: int) -> Problem:
    """All nine commanded, as constant curvature says for three bends whose directions turn."""
    share = np.linspace(0, 1, rows)[:, None]
    path = np.zeros((rows, 9))
    for s, (bend, towards) in enumerate([(0.9, 0.4), (0.7, 2.5), (1.1, -1.2)]):
        for k in range(3 * s, 9):
            azimuth = (k // 3) * np.pi / 4 + (k % 3) * 2 * np.pi / 3
            turned = np.cos(azimuth - towards - 0.5 * share[:, 0])
            path[:, k] -= 0.0045 * bend * (1 + 0.2 * share[:, 0]) * turned
    return segments("three segments, all nine tendons commanded, n = 30", path)


# --- the peers' statement ------------------------------------------------------------------------


def series(q: ca.SX, first: int) -> ca.SX:
    """Return the sum of (-q)^k / (2k + first)!, Horner's way."""
    found = ca.SX(0)
    for k in reversed(range(TERMS)):
        found = 1 / factorial(2 * k + first) - q * found
    return found


class Statement:
    """Unknowns y, tendon bounds p, energy and constraints g <= 0; y = 0 is rest.

    Lengths count in subsegments; a strain is y, torsion over the root of its weight.
    """

    def __init__(self, problem: Problem) -> None:
        n, self.unit = len(problem.rest), problem.length / len(problem.rest)
        held = np.isfinite(problem.path[0])
        self.y, self.p = ca.SX.sym("y", 3 * n), ca.SX.sym("p", int(held.sum()))
        self.energy = ca.sumsqr(self.y) / 2
        to_strain = np.sqrt([1.0, 1.0, 1 + problem.poisson_ratio])
        holes = [
            problem.radius / self.unit * np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
            for a, used in zip(problem.azimuths, held, strict=True)
            if used
        ]
        lengths = [ca.SX(0) for _ in holes]
        frame, at, positions = ca.SX.eye(3), ca.SX.zeros(3), [ca.SX.zeros(3)]
        for i in range(n):
            w = problem.rest[i] + self.y[3 * i : 3 * i + 3] * to_strain
            a, b, c = (series(ca.sumsqr(w), first) for first in (1, 2, 3))
            cross = ca.skew(w)
            turn = ca.SX.eye(3) + a * cross + b * cross @ cross
            step = (ca.SX.eye(3) + b * cross + c * cross @ cross)[:, 2]
            for k, hole in enumerate(holes):
                if i + 1 < len(hole):
                    lengths[k] += ca.norm_2(step + turn @ hole[i + 1] - hole[i])
            at, frame = at + frame @ step, frame @ turn
            positions.append(at)
        self.g = ca.vertcat(*lengths) - self.p
        self.positions = ca.Function("positions", [self.y], [ca.horzcat(*positions).T])
        at_rest = ca.Function("lengths", [self.y], [ca.vertcat(*lengths)])(0)
        self.bounds = np.asarray(at_rest).ravel() + problem.path[:, held] / self.unit

    def shapes(self, unknowns: Array) -> Array:
        """Disk positions (B, n + 1, 3) [m] of solutions (B, 3n)."""
        return np.array([self.unit * np.asarray(self.positions(y)) for y in unknowns])


def ipopt(statement: Statement, options: dict[str, Any]) -> Run:
    """Return a run of IPOPT over the path; warm is in unknowns and multipliers."""
    nlp = {"x": statement.y, "p": statement.p, "f": statement.energy, "g": statement.g}
    quiet = {"print_level": 0, "sb": "yes", **options}
    solver = ca.nlpsol("solver", "ipopt", nlp, {"print_time": 0, "ipopt": quiet})
    rest = {"x0": np.zeros(statement.y.numel()), "lam_g0": 0, "lam_x0": 0}

    def run(warm: bool) -> tuple[Array, Array]:
        start, found, seconds = rest, [], []
        for bounds in statement.bounds:
            begin = time.perf_counter()
            got = solver(**start, p=bounds, lbg=-ca.inf, ubg=0)
            seconds.append(time.perf_counter() - begin)
            found.append(np.asarray(got["x"]).ravel())
            if warm:
                start = {"x0": got["x"], "lam_g0": got["lam_g"], "lam_x0": got["lam_x"]}
        return np.array(found), np.array(seconds)

    return run


def in_place(statement: Statement, result: ca.SX) -> Callable[[Array, Array], Array]:
    """Return a function of (y, p) that CasADi evaluates on arrays in place."""
    function = ca.Function("result", [statement.y, statement.p], [ca.densify(result)])
    buffer, evaluate = function.buffer()
    y, p = np.zeros(statement.y.numel()), np.zeros(statement.p.numel())
    by_columns = np.zeros(result.numel())
    buffer.set_arg(0, memoryview(y))
    buffer.set_arg(1, memoryview(p))
    buffer.set_res(0, memoryview(by_columns))

    # The evaluation does not keep its buffer.
    def call(at: Array, bounds: Array, _alive: object = buffer) -> Array:
        y[:], p[:] = at, bounds
        evaluate()
        return by_columns.reshape(result.shape, order="F").copy()

    return call


def slsqp(statement: Statement, options: dict[str, Any]) -> Run:
    """Return a run of SLSQP over the path with exact gradients."""
    slack = in_place(statement, -statement.g)
    normals = in_place(statement, -ca.jacobian(statement.g, statement.y))

    def run(warm: bool) -> tuple[Array, Array]:
        start, found, seconds = np.zeros(statement.y.numel()), [], []
        for bounds in statement.bounds:
            constraint = {
                "type": "ineq",
                "fun": lambda at, bounds=bounds: slack(at, bounds)[:, 0],
                "jac": lambda at, bounds=bounds: normals(at, bounds),
            }
            begin = time.perf_counter()
            got = minimize(
                lambda at: 0.5 * (at @ at),
                start,
                jac=lambda at: at,
                constraints=[constraint],
                method="SLSQP",
                options=options,
            )
            seconds.append(time.perf_counter() - begin)
            found.append(got.x)
            start = got.x if warm else start
        return np.array(found), np.array(seconds)

    return run


# --- comparison ----------------------------------------------------------------------------------


def off(statement: Statement, unknowns: Array, positions: Array) -> float:
    """Largest distance of a disk from tdcr's, as a share of the length."""
    apart = np.linalg.norm(statement.shapes(unknowns) - positions, axis=2)
    return float(apart.max() / (statement.unit * (positions.shape[1] - 1)))


def fastest(name: str, runs: list[Run], warm: bool, check: Callable[[Array], float]) -> Run:
    """Return the run whose settings agree in the least time."""
    tried = []
    for run in runs:
        unknowns, seconds = run(warm)
        tried.append((check(unknowns), float(np.median(seconds)), run))
    good = [(seconds, run) for error, seconds, run in tried if error < AGREE]
    assert good, f"{name} differs by {min(error for error, *_ in tried):.1e} of the length"
    return min(good, key=lambda pair: pair[0])[1]


def row_of_batch(robot: tdcr.Robot, path: Array, warm: bool) -> float:
    """Seconds per row of a batch on one thread, to and fro along the path."""
    rows = np.tile(np.concatenate([path, path[::-1]]), (max(1, 1000 // len(path)), 1))
    begin = time.perf_counter()
    tdcr.forward_batch(robot, rows, threads=1, warm=warm)
    return (time.perf_counter() - begin) / len(rows)


def calls(robot: tdcr.Robot, path: Array, warm: bool) -> Array:
    """Seconds of calls from Python, one after the other along the path."""
    start, seconds = None, []
    for row in path:
        begin = time.perf_counter()
        shape = tdcr.forward(robot, row, start=start)
        seconds.append(time.perf_counter() - begin)
        start = shape if warm else None
    return np.array(seconds)


def chosen(statement: Statement, check: Callable[[Array], float]) -> dict[tuple[str, bool], Run]:
    """Try every setting of every peer: the run that counts, by name and start."""
    found = {}
    for name, solver, settings in (
        ("CasADi + IPOPT", ipopt, IPOPT),
        ("scipy SLSQP", slsqp, SLSQP),
    ):
        begin = time.perf_counter()
        runs = [solver(statement, options) for options in settings]
        build = (time.perf_counter() - begin) / len(runs)
        print(f"  {name}: {len(runs)} settings tried, {build * 1e3:.0f} ms to build, not counted")
        for warm in (False, True):
            found[name, warm] = fastest(name, runs, warm, check)
    return found


def compare(problem: Problem, repeats: int) -> None:
    """Check the answers, measure in turns and print a table; times are medians."""
    robot, path = problem.robot(), problem.path
    batch = tdcr.forward_batch(robot, path, fields=["positions"])
    assert batch.ok.all(), problem.name
    statement = Statement(problem)

    def check(unknowns: Array) -> float:
        return off(statement, unknowns, batch.positions)

    print(f"\n{problem.name}")
    runs = chosen(statement, check)
    print(f"  {'':34} {'time':>11} {'/ row':>8} {'/ call':>8}   off")
    for warm, start in ((False, "from rest"), (True, "warm")):
        times = defaultdict(list)
        worst: dict[str, float] = defaultdict(float)
        for _ in range(repeats):
            times["tdcr, row of a batch"].append(row_of_batch(robot, path, warm))
            times["tdcr, call from Python"].extend(calls(robot, path, warm))
            for name in (name for name, started in runs if started == warm):
                unknowns, seconds = runs[name, warm](warm)
                times[name].extend(seconds)
                worst[name] = max(worst[name], check(unknowns))
        medians = {name: float(np.median(seconds)) for name, seconds in times.items()}
        row, call, *_ = medians.values()
        for name, median in medians.items():
            line = f"  {name + ', ' + start:34} {median * 1e6:8.1f} us"
            if name in worst:
                assert worst[name] < AGREE, f"{name} differs by {worst[name]:.1e} of the length"
                line += f" {median / row:7.1f}x {median / call:7.1f}x   {worst[name]:.0e}"
            print(line)


def main() -> None:
    """Run the comparison and print a table per problem."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few rows: checks, rough figures")
    quick = parser.parse_args().quick
    rows, repeats = (5, 2) if quick else (20, 9)
    print(f"{rows} rows of each; ratios to a row of tdcr's batch, on one thread, and to its call")
    print("off: largest distance of a disk from tdcr's / length")
    for make in (helical, prebent, pulled, commanded):
        compare(make(rows), repeats)


if __name__ == "__main__":
    main()
