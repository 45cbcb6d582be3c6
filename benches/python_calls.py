"""What a call from Python costs on top of the core, and how batches scale.

The core's time per solve is taken from a batch on one thread, in the same run and on the same rows;
the last column is the gain of a batch on two threads.
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


def batch(trunk: tdcr.Robot, rows: Array, threads: int) -> float:
    """Return the seconds per row of a batch."""
    solve = partial(tdcr.forward_batch, trunk, rows, model="linkage", threads=threads)
    return best(solve, 1) / len(rows)


def singles(trunk: tdcr.Robot, rows: Array) -> float:
    """Return the seconds per call, each result dropped before the next call."""

    def calls() -> None:
        for row in rows:
            tdcr.forward(trunk, row, model="linkage")

    return best(calls, 1) / len(rows)


def main() -> None:
    """Print a table."""
    rng = np.random.default_rng(0)
    print(f"{'robot':>8} {'n':>5} {'core [us]':>10} {'call [us]':>10} {'on top':>8} {'threads':>8}")
    for kind in ("uniform", "varied"):
        for n in (1, 10, 100, 1000):
            trunk = robot(n, kind)
            rows = -0.02 * n * rng.uniform(0.02, 0.08, (64, 2))
            many = np.tile(rows, (max(1, 400 // n), 1))
            assert tdcr.forward_batch(trunk, rows, model="linkage").ok.all()
            # The same rows in both: pulls differ in how many steps they take.
            core, call = batch(trunk, many, 1), singles(trunk, rows)
            print(
                f"{kind:>8} {n:5} {core * 1e6:10.2f} {call * 1e6:10.2f} "
                f"{(call - core) * 1e6:8.2f} {core / batch(trunk, many, 2):7.2f}x"
            )


if __name__ == "__main__":
    main()
