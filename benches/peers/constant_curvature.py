"""Constant curvature forward, side by side: tdcr and vectorised numpy in one run.

Three segments with three coupled tendons each, random displacements of a fixed seed: tip poses of
all rows. numpy works on whole arrays (one least-squares solve for all rows, arcs and products
vectorised over rows). Answers are compared before any time is printed.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from numpy.typing import NDArray

import tdcr

LENGTHS, COUNT, RADIUS = (0.06, 0.0625, 0.064), 10, 0.0045
AZIMUTHS = np.array([2 * np.pi * (k % 3) / 3 + (k // 3) * np.pi / 4 for k in range(9)])
ENDS = np.array([k // 3 for k in range(9)])

Array = NDArray[np.float64]


def robot() -> tdcr.Robot:
    """Return the robot: tendons of a distal segment run through the proximal ones."""
    tendons = [
        tdcr.Tendon(azimuth, RADIUS, end=COUNT * (end + 1))
        for azimuth, end in zip(AZIMUTHS, ENDS, strict=True)
    ]
    return tdcr.Robot(tdcr.Backbone(LENGTHS, [COUNT] * 3), tendons)


def by_numpy(rows: Array) -> Array:
    """Tip poses (B, 4, 4) of displacements (B, 9)."""
    through = (ENDS[:, None] >= np.arange(3)).astype(float)
    columns = [-RADIUS * np.cos(AZIMUTHS), -RADIUS * np.sin(AZIMUTHS)]
    matrix = np.stack([column[:, None] * through for column in columns], axis=2).reshape(9, 6)
    bends = np.linalg.lstsq(matrix, rows.T, rcond=None)[0].T.reshape(-1, 3, 2)
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


def main() -> None:
    """Run the comparison and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few rows: checks, no figures")
    count = 2_000 if parser.parse_args().quick else 1_000_000
    rows = 0.002 * np.random.default_rng(5).normal(size=(count, 9))
    trunk = robot()
    timed: list[tuple[str, float]] = []
    reference = by_numpy(rows)
    for threads in (1, 2):
        batch = tdcr.forward_batch(trunk, rows, model="constant_curvature", threads=threads)
        off = np.abs(batch.tip - reference).max()
        assert off < 1e-12, off
        best = np.inf
        for _ in range(3):
            begin = time.perf_counter()
            tdcr.forward_batch(trunk, rows, model="constant_curvature", threads=threads)
            best = min(best, time.perf_counter() - begin)
        timed.append((f"tdcr, {threads} thread{'s' * (threads > 1)}, all disks", best / count))
    begin = time.perf_counter()
    by_numpy(rows)
    timed.append(("numpy, vectorised, tips alone", (time.perf_counter() - begin) / count))
    print(f"{count} rows, largest difference {off:.1e}\n")
    print(f"{'tip of 3 segments, 9 tendons':32} {'per row':>10} {'rows/s':>12} {'ratio':>7}")
    for name, seconds in timed:
        ratio = seconds / timed[0][1]
        print(f"{name:32} {seconds * 1e6:7.3f} us {1 / seconds:12.3g} {ratio:7.2f}")


if __name__ == "__main__":
    main()
