"""The inverse of the rod, side by side in one run: tdcr and scipy on tdcr's forward.

Three segments with three tendons each, straight and winding; positions and poses of shapes under
random tensions. scipy gets what a user would write with this package and without its inverse: the
residual of the tip of `forward`, in displacements (with tdcr's Jacobian or differences; from
constant curvature's answer where there is one, else from small tensions) or in tensions of 0 and
more (differences). An answer counts when `forward` of its displacements, from rest, converges
within 1e-8 m and 1e-8 rad of the target.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import tdcr

Array = NDArray[np.float64]

LENGTH, COUNT, RADIUS, SEGMENTS = 0.06, 10, 0.008, 3
RADIAN = 0.3 * SEGMENTS * LENGTH
WITHIN = 1e-8


def trunk(turns: float) -> tdcr.Robot:
    """Return three segments whose tendons wind by so many turns each."""
    tendons = []
    for k in range(3 * SEGMENTS):
        end = COUNT * (k // 3 + 1)
        first = 2 * np.pi * (k % 3) / 3 + 2 * np.pi / 9 * (k // 3)
        azimuth = first + 2 * np.pi * turns * np.arange(end + 1) / COUNT if turns else first
        tendons.append(tdcr.Tendon(azimuth, RADIUS, end=end))
    return tdcr.Robot(tdcr.Backbone([LENGTH] * SEGMENTS, [COUNT] * SEGMENTS), tendons)


def random_tips(robot: tdcr.Robot, count: int, seed: int) -> Array:
    """Return tips (B, 4, 4) of shapes with two of three tendons of every segment pulled."""
    rng = np.random.default_rng(seed)
    tips = []
    for _ in range(count):
        bends = rng.uniform(0, 1.2, (SEGMENTS, 3))
        bends[np.arange(SEGMENTS), rng.integers(0, 3, SEGMENTS)] = 0.0
        tensions = bends.ravel() / (RADIUS * LENGTH)
        tips.append(tdcr.forward(robot, tensions=tensions).require().tip)
    return np.array(tips)


def miss(tip: Array, target: Array) -> Array:
    """Return position and rotation vector (target's frame, times `RADIAN`) from target to tip."""
    if target.shape == (3,):
        return tip[:3, 3] - target
    turn = target[:3, :3].T @ tip[:3, :3]
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = np.linalg.norm(axis) / 2
    angle = np.arctan2(sine, (np.trace(turn) - 1) / 2)
    spin = axis / 2 * (angle / sine if sine > 1e-12 else 1.0)
    return np.concatenate([tip[:3, 3] - target[:3, 3], RADIAN * spin])


def guess(robot: tdcr.Robot, target: Array) -> Array:
    """Return displacements of constant curvature's answer, else those of small tensions."""
    try:
        return tdcr.inverse(robot, target, model="constant_curvature").displacements
    except tdcr.InvalidInput:
        tensions = np.full(len(robot.tendons), 0.1 / (RADIUS * LENGTH))
        return tdcr.forward(robot, tensions=tensions).displacements


def by_displacements(robot: tdcr.Robot, target: Array, exact: bool) -> Array:
    """Solve in displacements."""

    def residual(d: Array) -> Array:
        return miss(tdcr.forward(robot, d).tip, target)

    def slope(d: Array) -> Array:
        # The rotation's part is exact at the target, and near enough before it.
        both = tdcr.jacobian(robot, d)
        if target.shape == (3,):
            return both[:3]
        return np.concatenate([both[:3], RADIAN * target[:3, :3].T @ both[3:]])

    jac = slope if exact else "2-point"
    options = {"x_scale": RADIUS, "xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14, "max_nfev": 100}
    return least_squares(residual, guess(robot, target), jac=jac, **options).x


def by_tensions(robot: tdcr.Robot, target: Array) -> Array:
    """Solve in tensions of 0 and more; return the displacements that they have."""
    unit = 1 / (RADIUS * LENGTH)

    def residual(z: Array) -> Array:
        return miss(tdcr.forward(robot, tensions=np.maximum(z, 0) * unit).tip, target)

    start = np.full(len(robot.tendons), 0.1)
    options = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14, "max_nfev": 100}
    found = least_squares(residual, start, bounds=(0, np.inf), **options).x
    return tdcr.forward(robot, tensions=found * unit).displacements


def met(robot: tdcr.Robot, displacements: Array, target: Array) -> bool:
    """Tell whether a forward solve from rest agrees."""
    shape = tdcr.forward(robot, displacements)
    off = miss(shape.tip, target)
    return shape.ok and max(np.linalg.norm(off[:3]), np.linalg.norm(off[3:]) / RADIAN) < WITHIN


def compare(robot: tdcr.Robot, targets: Array) -> None:
    """Print success and time of everybody on the same targets."""
    solvers: dict[str, Callable[[Array], Array]] = {
        "tdcr.inverse": lambda target: tdcr.inverse(robot, target).displacements,
        "scipy, displacements, tdcr.jacobian": lambda t: by_displacements(robot, t, exact=True),
        "scipy, displacements, differences": lambda t: by_displacements(robot, t, exact=False),
        "scipy, tensions, differences": lambda t: by_tensions(robot, t),
    }
    ours = 0.0
    for name, solve in solvers.items():
        times, good = [], 0
        for target in targets:
            begin = time.perf_counter()
            try:
                displacements = solve(target)
            except tdcr.NotConverged:
                # The Jacobian of displacements that no shape has: its user gives up here.
                displacements = None
            times.append(time.perf_counter() - begin)
            good += displacements is not None and met(robot, displacements, target)
        median = float(np.median(times))
        ours = ours or median
        share = good / len(targets)
        print(f"{name:<38}{1e3 * median:9.3f} ms {median / ours:8.1f} x {share:8.1%}")


def main() -> None:
    """Run all comparisons."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few targets: checks, rough figures")
    count = 3 if parser.parse_args().quick else 50
    for turns in (0.0, 0.2):
        robot = trunk(turns)
        tips = random_tips(robot, count, seed=0)
        for name, targets in (("positions", tips[:, :3, 3]), ("poses", tips)):
            print(f"\n{count} {name}, {turns} turns per segment: median, ratio, met")
            compare(robot, targets)


if __name__ == "__main__":
    main()
