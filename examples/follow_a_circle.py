"""A three-segment trunk draws a circle with its tool held upright: the inverse along a path.

Nine coupled tendons, constant curvature. Every frame of the path is met exactly, each from the one
before; a bound keeps every tendon within 10 mm.

    python examples/follow_a_circle.py --output examples/figures
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import tdcr

MODEL = "constant_curvature"
MM = 1e3
LENGTHS, COUNT, RADIUS = (0.060, 0.0625, 0.064), 10, 0.0045
COLOURS = ("#2a6f97", "#e07a3f", "#5a9367")
LIMIT = 0.010

Array = NDArray[np.float64]


def trunk() -> tdcr.Robot:
    """Return the trunk: three tendons end at each segment and run through those below."""
    azimuths = [2 * np.pi * (k % 3) / 3 + (k // 3) * np.pi / 4 for k in range(9)]
    ends = [COUNT * (k // 3 + 1) for k in range(9)]
    tendons = [tdcr.Tendon(a, RADIUS, end=end) for a, end in zip(azimuths, ends, strict=True)]
    return tdcr.Robot(tdcr.Backbone(LENGTHS, [COUNT] * 3), tendons)


def circle(points: int) -> Array:
    """Frames (points, 4, 4) around a circle of 40 mm, 150 mm up, axes parallel to the base's."""
    t = np.linspace(0, 2 * np.pi, points)
    frames = np.tile(np.eye(4), (points, 1, 1))
    frames[:, :3, 3] = np.stack([0.04 * np.cos(t), 0.04 * np.sin(t), np.full(points, 0.15)], axis=1)
    return frames


def draw(path: tdcr.InverseBatch, frames: Array) -> Figure:
    """Return the trunk at six poses of the path, and the displacements along it."""
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    scene = figure.add_subplot(1, 2, 1, projection="3d")
    for i in np.linspace(0, len(path) - 1, 7).astype(int)[:-1]:
        points = path[int(i)].shape.positions * MM
        for k, colour in enumerate(COLOURS):
            piece = points[COUNT * k : COUNT * (k + 1) + 1]
            scene.plot(*piece.T, color=colour, linewidth=2.4, alpha=0.35 + 0.1 * (i == 0))
    points = path[0].shape.positions * MM
    for k, colour in enumerate(COLOURS):
        piece = points[COUNT * k : COUNT * (k + 1) + 1]
        scene.plot(*piece.T, "o-", color=colour, linewidth=2.4, markersize=3)
    scene.plot(*(frames[:, :3, 3] * MM).T, "k--", linewidth=1)
    scene.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    scene.set_aspect("equal")
    scene.view_init(elev=22, azim=-58)
    axes = figure.add_subplot(1, 2, 2)
    share = np.linspace(0, 1, len(path))
    for k in range(9):
        line, style = COLOURS[k // 3], ("-", "--", ":")[k % 3]
        name = f"tendons of segment {k // 3 + 1}" if k % 3 == 0 else None
        pulls = path.displacements[:, k] * MM
        axes.plot(share, pulls, style, color=line, linewidth=1.4, label=name)
    axes.legend(loc="upper center", ncols=3, fontsize=8, frameon=False, bbox_to_anchor=(0.5, 1.1))
    axes.set(xlabel="share of the path", ylabel="tendon displacement [mm]", xlim=(0, 1))
    axes.axhline(0, color="0.7", linewidth=0.8, zorder=0)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def main() -> None:
    """Solve, check and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    output = parser.parse_args().output
    output.mkdir(parents=True, exist_ok=True)
    mpl.use("Agg")

    robot, frames = trunk(), circle(1001)
    bounds = tdcr.Bounds(displacement=(-LIMIT, LIMIT))
    path = tdcr.track(robot, frames, model=MODEL, bounds=bounds)
    tips = tdcr.forward_batch(robot, path.displacements, model=MODEL).tip
    off = np.abs(tips - frames).max()
    closed = np.abs(path.displacements[-1] - path.displacements[0]).max()
    print(f"{len(path)} frames, all met: {path.ok.all()}; largest error of a tip {off:.1e}")
    print(f"taken up from the frame before: {np.count_nonzero(path.starts == 1)}")
    print(f"after one turn the displacements return to within {closed * MM:.1e} mm")
    draw(path, frames).savefig(output / "follow_a_circle.png", dpi=150)


if __name__ == "__main__":
    main()
