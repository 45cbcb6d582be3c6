"""What a call from Python costs on top of the core, and how batches scale.

The core's time per solve is taken from a batch on one thread, in the same run.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import tdcr


def best(call: Callable[[], object], number: int, repeats: int = 7) -> float:
    """Return the seconds of one call: the best of several loops."""
    loops = []
    for _ in range(repeats):
        begin = time.perf_counter()
        for _ in range(number):
            call()
        loops.append((time.perf_counter() - begin) / number)
    return min(loops)


def main() -> None:
    """Print a table."""
    rng = np.random.default_rng(0)
    print(f"{'n':>5} {'core [us]':>10} {'call [us]':>10} {'on top':>8} {'2 threads':>10}")
    for n in (1, 10, 100, 1000):
        taper = np.linspace(0.01, 0.008, n + 1)
        tendons = [tdcr.Tendon([azimuth] * (n + 1), taper) for azimuth in (0.0, 1.6)]
        robot = tdcr.Robot(tdcr.Backbone(0.02 * n, n), tendons)
        rows = -0.02 * n * rng.uniform(0.02, 0.08, (max(200, 20_000 // n), 2))
        assert tdcr.forward_batch(robot, rows, model="linkage").ok.all()

        def batch(threads: int) -> float:
            return best(
                lambda: tdcr.forward_batch(robot, rows, model="linkage", threads=threads),  # noqa: B023
                1,
            ) / len(rows)  # noqa: B023

        core = batch(1)
        few = rows[:100]
        call = best(lambda: [tdcr.forward(robot, row, model="linkage") for row in few], 1) / 100  # noqa: B023
        print(
            f"{n:5} {core * 1e6:10.2f} {call * 1e6:10.2f} {(call - core) * 1e6:8.2f} "
            f"{core / batch(2):9.2f}x"
        )


if __name__ == "__main__":
    main()
