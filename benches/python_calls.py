"""What a call from Python costs on top of the core, and how batches scale.

The core's time per solve is taken from a batch on one thread, in the same run and on the same rows;
the last column is the gain of a batch on two threads (a path is followed on one).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

import tdcr

Array = NDArray[np.float64]


def best(call: Callable[[], object], number: int, repeats: int = 15) -> float:
    """Return the seconds of one call: the best of several loops."""
    loops = []
    for _ in range(repeats):
        begin = time.perf_counter()
        for _ in range(number):
            call()
        loops.append((time.perf_counter() - begin) / number)
    return min(loops)


def robot(n: int, kind: str) -> tdcr.Robot:
    """Return a trunk of n subsegments: all alike, or every one a problem of its own."""
    radius = np.full(n + 1, 0.01) if kind == "uniform" else np.linspace(0.01, 0.008, n + 1)
    tendons = [tdcr.Tendon([azimuth] * (n + 1), radius) for azimuth in (0.0, 1.6)]
    return tdcr.Robot(tdcr.Backbone(0.02 * n, n), tendons)


def line(name: str, many: Callable[[int], object], one: Callable[[int], object], rows: int) -> None:
    """Print a line: `many(threads)` solves all rows at once, `one(i)` a row alone."""
    core = best(partial(many, 1), 1) / rows

    # Each result is dropped before the next call.
    def calls() -> None:
        for i in range(rows):
            one(i)

    call = best(calls, 1) / rows
    gain = core / (best(partial(many, 2), 1) / rows)
    print(
        f"{name:34} {core * 1e6:10.2f} {call * 1e6:10.2f} {(call - core) * 1e6:8.2f} {gain:7.2f}x"
    )


def forwards(rng: np.random.Generator, model: str, furthest: float) -> None:
    """Forward solves of a model, pulls up to a share of the length."""
    for kind in ("uniform", "varied"):
        for n in (1, 10, 100, 1000):
            trunk = robot(n, kind)
            rows = -0.02 * n * rng.uniform(furthest / 4, furthest, (64, 2))
            rows = np.tile(rows, (max(1, 400 // n), 1))
            forward = partial(tdcr.forward_batch, trunk, rows, model=model)
            assert forward().ok.all()
            line(
                f"{model}, {kind}, n = {n}",
                lambda threads, forward=forward: forward(threads=threads),
                lambda i, trunk=trunk, rows=rows: tdcr.forward(trunk, rows[i], model=model),
                len(rows),
            )


def rod_paths() -> None:
    """Rods along a path: every row from rest, or from the row before."""
    trunk = robot(20, "varied")
    t = np.linspace(0, 2 * np.pi, 2000)
    rows = -0.01 * (1 + 0.5 * np.stack([np.cos(t), np.sin(t)], axis=1))
    for warm in (False, True):
        forward = partial(tdcr.forward_batch, trunk, rows, warm=warm)
        before = [tdcr.forward(trunk, rows[0])] if warm else [None]

        def follow(i: int, before: list[tdcr.Shape | None] = before) -> None:
            shape = tdcr.forward(trunk, rows[i], start=before[0])
            before[:] = [shape if before[0] else None]

        solved = forward()
        assert solved.ok.all()
        start = f"{'warm' if warm else 'cold'}, {solved.iterations.mean():.1f} steps"
        line(
            f"rod, path, n = 20, {start}",
            lambda threads, forward=forward: forward(threads=threads),
            follow,
            len(rows),
        )


def derivatives() -> None:
    """Print derivatives of the rod beside the solve that they belong to."""
    helical = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon.helical(0.0, 0.01)])
    ends = [end for end in (10, 20, 30) for _ in range(3)]
    places = [2 * np.pi * k / 3 + 0.3 * (k // 3) for k in range(9)]
    tendons = [tdcr.Tendon(place, 0.01, end=end) for place, end in zip(places, ends, strict=True)]
    three = tdcr.Robot(tdcr.Backbone(0.3, 30), tendons)
    free = np.inf
    pulls = [-0.002, -0.001, free, -0.003, -0.004, free, -0.005, -0.004, free]
    cases = {
        "rod, one helical tendon, n = 10": (helical, [-0.004]),
        "rod, 6 of 9 tendons, n = 30": (three, pulls),
    }
    print(f"\n{'[us] per call':34} {'forward':>10} {'jacobian':>10} {'sensitivity':>12}", end="")
    print(f" {'.jacobian':>10} {'.forward':>10} {'.adjoint':>10}")
    for name, (trunk, displacements) in cases.items():
        shape = tdcr.forward(trunk, displacements).require()
        at = tdcr.sensitivity(shape)
        weights = np.ones((len(shape.positions), 3))
        calls: list[Callable[[], object]] = [
            partial(tdcr.forward, trunk, displacements),
            partial(tdcr.jacobian, trunk, displacements),
            partial(tdcr.sensitivity, shape),
            at.jacobian,
            partial(at.forward, poisson_ratio=1.0),
            partial(at.adjoint, weights),
        ]
        times = [best(call, 100) * 1e6 for call in calls]
        print(f"{name:34} {times[0]:10.2f} {times[1]:10.2f} {times[2]:12.2f}", end="")
        print(f" {times[3]:10.2f} {times[4]:10.2f} {times[5]:10.2f}")


def inverses(rng: np.random.Generator) -> None:
    """Inverses of the constant-curvature model, alone and along a path."""
    ends = [10 * (k // 3 + 1) for k in range(9)]
    tendons = [tdcr.Tendon(2.1 * k, 0.0045, end=end) for k, end in enumerate(ends)]
    trunk = tdcr.Robot(tdcr.Backbone([0.06, 0.0625, 0.064], [10] * 3), tendons)
    rows = rng.normal(size=(2000, 9)) * 0.003
    t = np.linspace(0, 1, 2000)[:, None]
    solve = partial(tdcr.inverse, trunk, model="constant_curvature")
    targets = tdcr.forward_batch(trunk, rows, model="constant_curvature").tip
    line(
        "inverse, frames",
        lambda threads: tdcr.inverse_batch(
            trunk, targets, model="constant_curvature", threads=threads
        ),
        lambda i: solve(targets[i]),
        len(rows),
    )
    t = np.linspace(0, 1, len(rows))[:, None]
    pulls = rows[:1] * (1 - t) + rows[1:2] * t
    path = tdcr.forward_batch(trunk, pulls, model="constant_curvature").tip
    follow = partial(tdcr.track, trunk, path, model="constant_curvature", start=pulls[0])
    found = follow()
    assert found.ok.all()
    line(
        "inverse, along a path",
        lambda threads: follow(),
        lambda i: solve(path[i], start=found.displacements[max(i - 1, 0)]),
        len(rows),
    )


def main() -> None:
    """Print a table."""
    rng = np.random.default_rng(0)
    print(f"{'':34} {'core [us]':>10} {'call [us]':>10} {'on top':>8} {'threads':>8}")
    forwards(rng, "rod", 0.08)
    rod_paths()
    forwards(rng, "linkage", 0.08)
    inverses(rng)
    derivatives()


if __name__ == "__main__":
    main()
