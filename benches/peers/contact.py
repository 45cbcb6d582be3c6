"""The rod among obstacles side by side: tdcr and CasADi + IPOPT in one run.

A tendon is pulled in 20 steps, each from the solution of the one before: Mahapatra & Ghosal's bar
(30 mm thick, 16 mm to the left and 136 mm above the base of a trunk of 180 mm that is pulled to the
left) with 9 and 30 subsegments, and a ball that a trunk of 30 goes round. One statement for both:
least energy of the subsegments' strains under the tendon's length and distances that may not be
negative, of all centres, holes and mirrored holes. The peer gets it in two forms, of which the
faster counts: with strains alone, and with the disks' frames as further unknowns, whose derivatives
are sparse. The energy is half the square of the unknowns, rotations are series, derivatives exact
and, where there is a C compiler, compiled (but for 30 subsegments in strains alone, which takes
minutes and is far behind). Several settings are tried, and the fastest counts whose disks and
energies are tdcr's in every step. Times are the processor's, of one thread each: other work on the
machine counts less.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import subprocess
import tempfile
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
from rod import WARM

import tdcr

# No disk may be further off than this share of the length, no energy than this share of the last.
AGREE = 1e-6
# A subsegment here bends by less than 0.7 rad: what the series leaves out is below 1e-20.
TERMS = 9
STEPS, LENGTH, RADIUS = 20, 0.18, 0.008
# Strains alone have a full Hessian: with so many, its C code is not compiled.
DENSE = 50

# The first is from the shape before as well, with IPOPT's own start of multipliers.
SETTINGS: list[dict[str, Any]] = [
    {},
    {"tol": 1e-10},
    *({**WARM, "mu_init": mu} for mu in (1e-7, 1e-8, 1e-9, 1e-10)),
    *({**WARM, "mu_init": mu, "tol": 1e-10} for mu in (1e-7, 1e-9)),
    {**WARM, "mu_init": 1e-8, "mu_strategy": "adaptive"},
]
QUICK = SETTINGS[-3:-2]

Array = NDArray[np.float64]
# Steps in order: disk places (STEPS, n + 1, 3) [m], energies in 1/m, seconds of the processor.
Run = Callable[[], tuple[Array, Array, Array]]


@dataclass(frozen=True)
class Problem:
    """A trunk with one tendon at -x and an obstacle, pulled as far as `pull` [m]."""

    name: str
    rest: Array
    obstacle: tdcr.Obstacle
    distance: Callable[[ca.SX], ca.SX]
    pull: float

    @property
    def path(self) -> Array:
        """Displacements (STEPS, 1) [m]."""
        return -self.pull * np.arange(1, STEPS + 1)[:, None] / STEPS

    def robot(self) -> tdcr.Robot:
        """Return it as tdcr's."""
        backbone = tdcr.Backbone(LENGTH, len(self.rest), rest=self.rest)
        return tdcr.Robot(backbone, [tdcr.Tendon(np.pi, RADIUS)])


def bar(n: int, pull: float) -> Problem:
    """Return the paper's; its pre-bent shape is not in the text, here it is an S."""
    rest = np.zeros((n, 3))
    rest[:, 1] = 1.08 / n * np.cos(6.3 / n * np.arange(n))
    x, z, radius = -0.016, 0.136, 0.015
    obstacle = tdcr.Cylinder((x, 0, z), (0, 1, 0), radius)

    def distance(at: ca.SX) -> ca.SX:
        return ca.sqrt((at[0] - x) ** 2 + (at[2] - z) ** 2) - radius

    return Problem(f"bar, n = {n}", rest, obstacle, distance, pull)


def ball() -> Problem:
    """Return a ball beside the plane of the pull."""
    center, radius = np.array([-0.045, 0.006, 0.13]), 0.02
    obstacle = tdcr.Sphere(center, radius)

    def distance(at: ca.SX) -> ca.SX:
        return ca.norm_2(at - center) - radius

    return Problem("ball, n = 30", np.zeros((30, 3)), obstacle, distance, 0.006)


# --- the peer's statement ------------------------------------------------------------------------


def series(q: ca.SX, first: int) -> ca.SX:
    """Return the sum of (-q)^k / (2k + first)!, Horner's way."""
    found = ca.SX(0)
    for k in reversed(range(TERMS)):
        found = 1 / factorial(2 * k + first) - q * found
    return found


class Statement:
    """Unknowns x, the tendon's bound p, energy f, equations g = 0 and inequalities h <= 0.

    Lengths count in subsegments; a strain is its y, torsion over the root of its weight. With
    `frames`, rotation matrices and places of all disks are unknown too.
    """

    def __init__(self, problem: Problem, frames: bool) -> None:
        n = len(problem.rest)
        self.unit, self.problem = LENGTH / n, problem
        to_strain = np.sqrt([1.0, 1.0, 1.35])
        hole = np.array([-RADIUS / self.unit, 0, 0])
        frame, at, length = ca.SX.eye(3), ca.SX.zeros(3), ca.SX(0)
        now, strains, unknowns, start = (np.eye(3), np.zeros(3)), [], [], []
        equations, inside, positions = [], [], [at]
        for i in range(n):
            y = ca.SX.sym(f"y{i}", 3)
            strains.append(y)
            turn, step = self.element(problem.rest[i] + y * to_strain)
            length += ca.norm_2(step + turn @ hole - hole)
            own, end = frame @ turn, at + frame @ step
            frame, at = own, end
            unknowns.append(y)
            start.append(np.zeros(3))
            if frames:
                frame, at = ca.SX.sym(f"r{i}", 3, 3), ca.SX.sym(f"p{i}", 3)
                unknowns += [ca.vec(frame), at]
                equations += [ca.vec(frame - own), at - end]
                by, ahead = (np.array(ca.DM(v)) for v in self.element(ca.SX(problem.rest[i])))
                now = now[0] @ by, now[1] + now[0] @ ahead.ravel()
                start += [now[0].ravel(order="F"), now[1]]
            positions.append(at)
            for point in (at, at + frame @ hole, at - frame @ hole):
                inside.append(-problem.distance(self.unit * point) / self.unit)
        self.x, self.p = ca.vertcat(*unknowns), ca.SX.sym("p")
        self.f = ca.sumsqr(ca.vertcat(*strains)) / 2
        self.g, self.h = ca.vertcat(*equations), ca.vertcat(length - self.p, *inside)
        self.start = np.concatenate(start)
        self.positions = ca.Function("positions", [self.x], [ca.horzcat(*positions).T, self.f])
        at_rest = float(ca.Function("length", [self.x], [length])(self.start))
        self.bounds = at_rest + problem.path[:, 0] / self.unit

    @staticmethod
    def element(w: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return turn and end of a subsegment of length one."""
        a, b, c = (series(ca.sumsqr(w), first) for first in (1, 2, 3))
        cross = ca.skew(w)
        turn = ca.SX.eye(3) + a * cross + b * cross @ cross
        return turn, (ca.SX.eye(3) + b * cross + c * cross @ cross)[:, 2]

    def solvers(self, settings: list[dict[str, Any]], folder: str) -> list[Run]:
        """Return runs of IPOPT along the path, every step from the one before."""
        nlp: Any = {"x": self.x, "p": self.p, "f": self.f, "g": ca.vertcat(self.g, self.h)}
        compiler = shutil.which("cc")
        if compiler is not None and (self.g.numel() or self.x.numel() < DENSE):
            name = f"unknowns_{self.x.numel()}"
            with contextlib.chdir(folder):  # CasADi writes nowhere else.
                ca.nlpsol("solver", "ipopt", nlp).generate_dependencies(f"{name}.c")
            nlp = os.path.join(folder, f"{name}.so")
            flags = ["-O1", "-shared", "-fPIC", "-o", nlp]
            subprocess.run([compiler, *flags, nlp[:-3] + ".c", "-lm"], check=True)
        quiet = {"print_level": 0, "sb": "yes"}
        return [
            self.run(ca.nlpsol("solver", "ipopt", nlp, {"print_time": 0, "ipopt": quiet | options}))
            for options in settings
        ]

    def run(self, solver: ca.Function) -> Run:
        """Return a run of a solver along the path."""
        lower = np.append(np.zeros(self.g.numel()), np.full(self.h.numel(), -np.inf))

        def run() -> tuple[Array, Array, Array]:
            start: dict[str, Any] = {"x0": self.start, "lam_g0": 0, "lam_x0": 0}
            places, energies, seconds = [], [], []
            for bound in self.bounds:
                begin = time.process_time()
                got = solver(**start, p=bound, lbg=lower, ubg=0)
                seconds.append(time.process_time() - begin)
                at, energy = self.positions(got["x"])
                places.append(self.unit * np.asarray(at))
                energies.append(float(energy) / self.unit)
                start = {"x0": got["x"], "lam_g0": got["lam_g"], "lam_x0": got["lam_x"]}
            return np.array(places), np.array(energies), np.array(seconds)

        return run


# --- comparison ----------------------------------------------------------------------------------


def off(found: tuple[Array, Array, Array], batch: tdcr.ShapeBatch) -> Array:
    """Largest distance of a disk and difference of energies, step by step, from the batch's.

    Shape (2, STEPS): shares of the length and of the last energy.
    """
    places, energies, _ = found
    apart = np.linalg.norm(places - batch.positions, axis=2).max(axis=1) / LENGTH
    return np.stack([apart, np.abs(energies - batch.energy) / batch.energy[-1]])


def fastest(problem: Problem, quick: bool, folder: str, batch: tdcr.ShapeBatch) -> Run:
    """Return the run whose form and settings agree in the least time."""
    good, least = [], np.inf
    forms = [(True, "strains and frames"), *([] if quick else [(False, "strains")])]
    for frames, form in forms:
        begin = time.perf_counter()
        statement = Statement(problem, frames)
        runs = statement.solvers(QUICK if quick else SETTINGS, folder)
        build = time.perf_counter() - begin
        times = []
        for run in runs:
            found = run()
            worst = off(found, batch).max()
            least = min(least, worst)
            if worst < AGREE:
                # Of two runs, as the machine may have other work.
                times.append(float(min(np.sum(found[2]), np.sum(run()[2]))))
                good.append((times[-1], run))
        best = f"the best {min(times) / STEPS * 1e3:.2f} ms a step" if times else "none agrees"
        print(
            f"  {form}: {build:.0f} s to make, {len(times)} of {len(runs)} settings agree, {best}"
        )
    assert good, f"no setting is nearer than {least:.1e}"
    return min(good, key=lambda pair: pair[0])[1]


def batches(problem: Problem) -> Array:
    """Seconds per row of batches on one thread, warm from the row before."""
    robot, rows = problem.robot(), problem.path
    seconds = []
    for _ in range(10):
        begin = time.process_time()
        tdcr.forward_batch(robot, rows, obstacles=problem.obstacle, threads=1, warm=True)
        seconds.append((time.process_time() - begin) / STEPS)
    return np.array(seconds)


def calls(problem: Problem) -> tuple[Array, Array, Array]:
    """Return a run of calls from Python along the path, each with `start=` the one before."""
    robot, start = problem.robot(), None
    places, energies, seconds = [], [], []
    for row in problem.path:
        begin = time.process_time()
        start = tdcr.forward(robot, row, obstacles=problem.obstacle, start=start)
        seconds.append(time.process_time() - begin)
        places.append(start.positions)
        energies.append(start.energy)
    return np.array(places), np.array(energies), np.array(seconds)


def compare(problem: Problem, quick: bool, folder: str) -> None:
    """Check the answers, measure in turns and print a table; times are medians of means."""
    fields = ["positions", "energy", "contacts"]
    batch = tdcr.forward_batch(
        problem.robot(), problem.path, obstacles=problem.obstacle, fields=fields, warm=True
    )
    assert batch.ok.all(), problem.name
    touching = len(np.unique(batch.contacts["row"]))
    print(f"\n{problem.name}: touches in {touching} of {STEPS} steps")
    runs = {
        "tdcr, call from Python": lambda: calls(problem),
        "CasADi + IPOPT": fastest(problem, quick, folder, batch),
    }
    times, worst = defaultdict(list), {}
    for _ in range(2 if quick else 7):
        times["tdcr, row of a batch"].extend(batches(problem))
        for name, run in runs.items():
            found = run()
            times[name].append(float(np.mean(found[2])))
            worst[name] = np.maximum(off(found, batch), worst.get(name, 0.0))
    row, call, peer = (float(np.median(seconds)) for seconds in times.values())
    print(f"  {'':24} {'step':>12} {'IPOPT / it':>11}   off: disks, energies")
    print(f"  {'tdcr, row of a batch':24} {row * 1e6:9.1f} us {peer / row:10.1f}x")
    for name, median in (("tdcr, call from Python", call), ("CasADi + IPOPT", peer)):
        apart, energies = worst[name].max(axis=1)
        ratio = f"{peer / median:10.1f}x" if median != peer else " " * 11
        print(f"  {name:24} {median * 1e6:9.1f} us {ratio}   {apart:.0e}, {energies:.0e}")
    # Several shapes may be stable: which steps are not of the same one is said, not hidden.
    others = np.flatnonzero(worst["tdcr, call from Python"].max(axis=0) > AGREE)
    if others.size:
        print(f"  calls: another minimum in {others.size} steps, from step {others[0] + 1} on")
    assert worst["CasADi + IPOPT"].max() < AGREE, problem.name


def main() -> None:
    """Run the comparison and print a table per problem."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="one form, one setting: checks, rough figures"
    )
    quick = parser.parse_args().quick
    print(f"{STEPS} steps from rest, each from the one before; ratios: IPOPT's time to tdcr's")
    with tempfile.TemporaryDirectory() as folder:
        for problem in (bar(9, 0.010), bar(30, 0.006), ball()):
            compare(problem, quick, folder)


if __name__ == "__main__":
    main()
