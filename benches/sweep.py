"""Time and memory of sweeps into files: each in a process of its own, so that the peak is its own.

python benches/sweep.py
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tdcr

ROWS = {"constant_curvature": 1_000_000, "rod": 100_000}


def robot() -> tdcr.Robot:
    """Return three segments of three tendons."""
    azimuths = [0, 2 * np.pi / 3, 4 * np.pi / 3]
    tendons = [tdcr.Tendon(azimuth, 0.008, end=end) for end in (10, 20, 30) for azimuth in azimuths]
    return tdcr.Robot(tdcr.Backbone([0.060, 0.0625, 0.064], [10, 10, 10]), tendons)


def run(model: str, path: Path) -> None:
    """Sweep once and print a line of what it took."""
    rng = np.random.default_rng(0)

    def pulls(taken: int, wanted: int) -> NDArray[np.float64]:
        count = min(wanted, ROWS[model] - taken)
        if model == "constant_curvature":
            return rng.uniform(-0.008, 0.008, (count, 9))
        rows = rng.uniform(-0.004, 0.0, (count, 9))
        rows[:, 2::3] = np.inf  # two of each segment are pulled
        return rows

    done = tdcr.sweep(robot(), pulls, path, model=model)
    greatest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak = greatest / 1e6 if sys.platform == "darwin" else greatest * 1024 / 1e6  # bytes there
    print(
        f"{model:20} {path.suffix:9} {done.rows:9,} rows, {done.converged:,} converged: "
        f"{done.seconds:5.1f} s, peak {peak:4.0f} MB, file {path.stat().st_size / 1e6:4.0f} MB",
        flush=True,
    )


def main() -> None:
    """Run every model into every kind of file."""
    if len(sys.argv) == 3:
        run(sys.argv[1], Path(sys.argv[2]))
        return
    with tempfile.TemporaryDirectory() as folder:
        for model in ROWS:
            for ending in ("npz", "parquet"):
                path = Path(folder) / f"sweep.{ending}"
                subprocess.run([sys.executable, __file__, model, str(path)], check=True)


if __name__ == "__main__":
    main()
