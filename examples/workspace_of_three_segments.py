"""Where the tip of a three-segment trunk gets and in how many directions it points: a section.

Nine tendons by 16 mm each way, constant curvature, 2^20 samples of a Sobol sequence (needs scipy).

    python examples/workspace_of_three_segments.py --output examples/figures
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import tdcr

LIMIT = 0.016
SAMPLES = 2**20


def trunk() -> tdcr.Robot:
    """Return the trunk: three tendons end at each segment and run through those below."""
    azimuths = [0, 2 * np.pi / 3, 4 * np.pi / 3]
    tendons = [tdcr.Tendon(azimuth, 0.008, end=end) for end in (10, 20, 30) for azimuth in azimuths]
    return tdcr.Robot(tdcr.Backbone([0.060, 0.0625, 0.064], [10, 10, 10]), tendons)


def sampled(samples: int) -> tdcr.Workspace:
    """Return the workspace of the trunk."""
    ranges = [(-LIMIT, LIMIT)] * 9
    return tdcr.workspace(trunk(), ranges, samples, model="constant_curvature")


def draw(found: tdcr.Workspace) -> Figure:
    """Return the solid angle of the directions, in the plane y = 0."""
    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    found.plot(ax=figure.add_subplot())
    return figure


def main() -> None:
    """Sample, measure and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    output = parser.parse_args().output
    output.mkdir(parents=True, exist_ok=True)
    mpl.use("Agg")

    found = sampled(SAMPLES)
    volume, reach = found.volume(), found.reach
    print(found)
    print(f"tips {reach.nearest:.3f} to {reach.farthest:.3f} m from the base")
    print(f"volume {volume.value * 1e6:.0f} +- {volume.error * 1e6:.0f} cm^3")
    draw(found).savefig(output / "workspace.png", dpi=130)


if __name__ == "__main__":
    main()
