"""Constant curvature, side by side in one run: forward with numpy, inverse with scipy.

Three segments with three coupled tendons each. Forward: tip poses of random displacements; numpy
works on whole arrays (one least-squares solve for all rows, arcs and products vectorised over
rows). Inverse: random reachable frames; tdcr and scipy's least_squares get the same random starts,
one after the other until one meets the target, the same weights, and the same exact Jacobian
(tdcr's own, so that scipy is not held back by Python kinematics). Every answer is checked before
its time counts.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import tdcr

MODEL = "constant_curvature"
LENGTHS, COUNT, RADIUS = np.array([0.06, 0.0625, 0.064]), 10, 0.0045
AZIMUTHS = np.array([2 * np.pi * (k % 3) / 3 + (k // 3) * np.pi / 4 for k in range(9)])
ENDS = np.array([k // 3 for k in range(9)])
RADIAN = 0.3 * LENGTHS.sum()
TOLERANCE = 1e-9

Array = NDArray[np.float64]

# From bending vectors (6,) to coupled displacements (9,).
THROUGH = (ENDS[:, None] >= np.arange(3)).astype(float)
TO_DISPLACEMENTS = -RADIUS * np.stack(
    [np.cos(AZIMUTHS)[:, None] * THROUGH, np.sin(AZIMUTHS)[:, None] * THROUGH], axis=2
).reshape(9, 6)


def robot() -> tdcr.Robot:
    """Return the robot: tendons of a distal segment run through the proximal ones."""
    tendons = [
        tdcr.Tendon(azimuth, RADIUS, end=COUNT * (end + 1))
        for azimuth, end in zip(AZIMUTHS, ENDS, strict=True)
    ]
    return tdcr.Robot(tdcr.Backbone(LENGTHS, [COUNT] * 3), tendons)


def by_numpy(rows: Array) -> Array:
    """Tip poses (B, 4, 4) of displacements (B, 9)."""
    bends = np.linalg.lstsq(TO_DISPLACEMENTS, rows.T, rcond=None)[0].T.reshape(-1, 3, 2)
    tip = np.broadcast_to(np.eye(4), (len(rows), 4, 4))
    for i, length in enumerate(LENGTHS):
        x, y = bends[:, i, 0], bends[:, i, 1]
        angle = np.hypot(x, y)
        small = np.where(angle > 1e-8, angle, 1.0)
        a = np.where(angle > 1e-8, np.sin(small) / small, 1.0)
        b = np.where(angle > 1e-8, (1 - np.cos(small)) / small**2, 0.5)
        zero, one = np.zeros_like(x), np.ones_like(x)
        frame = np.array(
            [
                [1 - b * x * x, -b * x * y, a * x, length * b * x],
                [-b * x * y, 1 - b * y * y, a * y, length * b * y],
                [-a * x, -a * y, 1 - b * angle**2, length * a],
                [zero, zero, zero, one],
            ]
        ).transpose(2, 0, 1)
        tip = tip @ frame
    return tip


def draw(rng: np.random.Generator, count: int) -> Array:
    """Bending vectors (count, 6): angles to half a turn, any direction."""
    angle = np.pi * rng.random((count, 3))
    phi = 2 * np.pi * rng.random((count, 3))
    bends: Array = np.stack([angle * np.cos(phi), angle * np.sin(phi)], axis=2)
    return bends.reshape(count, 6)


def rotation_vector(matrix: Array) -> Array:
    """Logarithm of a rotation."""
    frame = np.eye(4)
    frame[:3, :3] = matrix
    return np.array(tdcr._core._rotation_vector(frame))


def hat(w: Array) -> Array:
    """Matrix of the cross product."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


class Residual:
    """Residual (6,) and Jacobian (6, 6) by bending vectors, in metres."""

    def __init__(self, trunk: tdcr.Robot, target: Array) -> None:
        """Aim at a frame (4, 4)."""
        self.trunk, self.target = trunk, target

    def error(self, bends: Array) -> tuple[Array, Array, Array]:
        """Tip, its distance vector and its rotation error in tool axes."""
        tip = tdcr.forward(self.trunk, TO_DISPLACEMENTS @ bends, model=MODEL).tip
        turned = rotation_vector(tip[:3, :3].T @ self.target[:3, :3])
        return tip, self.target[:3, 3] - tip[:3, 3], turned

    def value(self, bends: Array) -> Array:
        """Residual."""
        _, off, turned = self.error(bends)
        return np.concatenate([off, RADIAN * turned])

    def jacobian(self, bends: Array) -> Array:
        """Exact Jacobian."""
        tip, _, turned = self.error(bends)
        by_pulls = tdcr.jacobian(self.trunk, TO_DISPLACEMENTS @ bends, model=MODEL)
        matrix = by_pulls @ TO_DISPLACEMENTS
        angle = np.linalg.norm(turned)
        small = angle < 1e-4
        square = 1 / 12 if small else (1 - angle / 2 / np.tan(angle / 2)) / angle**2
        cross = hat(turned)
        inverse = np.eye(3) - cross / 2 + square * cross @ cross
        return -np.vstack([matrix[:3], RADIAN * inverse @ tip[:3, :3].T @ matrix[3:]])


def met(trunk: tdcr.Robot, target: Array, displacements: Array) -> bool:
    """Whether the forward model reaches the target with these displacements."""
    tip = tdcr.forward(trunk, displacements, model=MODEL).tip
    angle = np.linalg.norm(rotation_vector(tip[:3, :3].T @ target[:3, :3]))
    return bool(np.linalg.norm(tip[:3, 3] - target[:3, 3]) < TOLERANCE and angle < TOLERANCE)


Solver = Callable[[tdcr.Robot, Array, Array], Array]


def by_scipy(method: str) -> Solver:
    """Return a solver that runs least_squares from one start."""

    def solve(trunk: tdcr.Robot, target: Array, start: Array) -> Array:
        problem = Residual(trunk, target)
        options = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "max_nfev": 100}
        found = least_squares(problem.value, start, problem.jacobian, method=method, **options)
        answer: Array = TO_DISPLACEMENTS @ found.x
        return answer

    return solve


def by_tdcr(trunk: tdcr.Robot, target: Array, start: Array) -> Array:
    """Run tdcr from one start."""
    search = tdcr.InverseSettings(starts=1, max_iterations=100, rotation_weight=RADIAN)
    given = TO_DISPLACEMENTS @ start
    return tdcr.inverse(trunk, target, model=MODEL, start=given, search=search).displacements


def run(
    solve: Solver, trunk: tdcr.Robot, targets: Array, starts: Array
) -> tuple[float, float, float]:
    """Mean time per target [s], share solved from the first start, share solved at all."""
    first, solved, seconds = 0, 0, 0.0
    for target in targets:
        for k, start in enumerate(starts):
            begin = time.perf_counter()
            answer = solve(trunk, target, start)
            seconds += time.perf_counter() - begin
            if met(trunk, target, answer):
                first += k == 0
                solved += 1
                break
    return seconds / len(targets), first / len(targets), solved / len(targets)


class Timed(NamedTuple):
    """A line of the table."""

    name: str
    seconds: float
    """Per row or per target."""
    ratio: float
    first: float
    """Share solved from the first start."""
    solved: float


def forward(trunk: tdcr.Robot, count: int) -> list[Timed]:
    """Time tips of many rows."""
    rows = 0.002 * np.random.default_rng(5).normal(size=(count, 9))
    reference = by_numpy(rows)
    lines: list[tuple[str, float]] = []
    for threads in (1, 2):
        seconds = np.inf
        for _ in range(3):
            begin = time.perf_counter()
            batch = tdcr.forward_batch(trunk, rows, model=MODEL, threads=threads)
            seconds = min(seconds, time.perf_counter() - begin)
        off = np.abs(batch.tip - reference).max()
        assert off < 1e-12, off
        lines.append((f"tdcr, {threads} thread{'s' * (threads > 1)}", seconds / count))
    begin = time.perf_counter()
    by_numpy(rows)
    lines.append(("numpy, vectorised", (time.perf_counter() - begin) / count))
    print(f"{count} rows, largest difference of their tips {off:.1e}")
    return [Timed(f"forward: {name}", s, s / lines[0][1], 1.0, 1.0) for name, s in lines]


def inverse(trunk: tdcr.Robot, count: int) -> list[Timed]:
    """Time inverses of many frames."""
    rng = np.random.default_rng(11)
    made = draw(rng, count) @ TO_DISPLACEMENTS.T
    targets = tdcr.forward_batch(trunk, made, model=MODEL).tip
    starts = draw(rng, 20)
    lines: list[tuple[str, float, float, float]] = []
    for name, solve in (
        ("tdcr, same starts, one call each", by_tdcr),
        ("scipy least_squares 'lm'", by_scipy("lm")),
        ("scipy least_squares 'trf'", by_scipy("trf")),
    ):
        lines.append((name, *run(solve, trunk, targets, starts)))
    begin = time.perf_counter()
    batch = tdcr.inverse_batch(trunk, targets, model=MODEL, threads=1)
    seconds = (time.perf_counter() - begin) / count
    pairs = zip(targets, batch.displacements, strict=True)
    solved = float(np.mean([met(trunk, target, pulls) for target, pulls in pairs]))
    # Its first start is no random one.
    first = float(np.mean(batch.starts == 1))
    lines.append(("tdcr, its own starts, a batch", seconds, first, solved))
    print(f"{count} frames, up to {len(starts)} starts, solved to {TOLERANCE:g} m and rad")
    base = lines[0][1]
    return [Timed(f"inverse: {name}", s, s / base, *shares) for name, s, *shares in lines]


def main() -> None:
    """Run the comparison and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few rows: checks, no figures")
    quick = parser.parse_args().quick
    trunk = robot()
    lines = forward(trunk, 2_000 if quick else 1_000_000)
    lines += inverse(trunk, 5 if quick else 300)
    title = "three segments, nine tendons"
    print(f"\n{title:42} {'each':>12} {'ratio':>8} {'first':>7} {'solved':>7}")
    for line in lines:
        print(
            f"{line.name:42} {line.seconds * 1e6:9.3f} us {line.ratio:8.2f} "
            f"{line.first:7.1%} {line.solved:7.1%}"
        )


if __name__ == "__main__":
    main()
