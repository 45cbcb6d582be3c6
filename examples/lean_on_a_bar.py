"""What was pulled, from where the tip went while the trunk leaned on a bar: an inverse in contact.

Two segments with a tendon each, on the side of the bar. The tip's path leads back to the pulls only
when the bar is known.

    python examples/lean_on_a_bar.py --output examples/figures
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

import tdcr

MM = 1e3
COUNT, RADIUS = 12, 0.006
BAR, SIZE = (0.030, 0.110), 0.012
LEANING, IGNORANT = "#2a6f97", "#c8553d"

Array = NDArray[np.float64]


def trunk() -> tdcr.Robot:
    """Return the trunk: a steel wire of 1 mm, tendons towards the bar up to each segment's end."""
    tendons = [
        tdcr.Tendon(0.0, RADIUS, end=end, name=segment)
        for segment, end in (("near", COUNT), ("far", 2 * COUNT))
    ]
    backbone = tdcr.Backbone([0.09, 0.09], [COUNT] * 2, youngs_modulus=200e9, diameter=0.001)
    return tdcr.Robot(backbone, tendons)


def seen(robot: tdcr.Robot, bar: tdcr.Cylinder, points: int) -> tuple[Array, Array]:
    """Displacements (points, 2) and where they bring the tip (points, 3), bar in the way [m]."""
    share = np.linspace(0, 1, points)[:, None]
    pulls = np.array([-0.002, -0.003]) + share * np.array([0.0003, -0.0060])
    shapes = tdcr.forward_batch(robot, pulls, obstacles=bar, fields=["positions"], warm=True)
    return pulls, shapes.positions[:, -1]


def forces(path: tdcr.InverseBatch) -> Array:
    """Sum of the contact forces of every row [N]."""
    return np.array([sum(np.linalg.norm(c.force) for c in row.shape.contacts) for row in path])


def draw(
    leaning: tdcr.InverseBatch, ignorant: tdcr.InverseBatch, targets: Array, pulls: Array
) -> Figure:
    """Return the trunk at some targets, and displacements found with and without the bar."""
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    scene, axes = figure.subplots(1, 2, width_ratios=(1, 1.3))
    scene.add_patch(Circle((BAR[0] * MM, BAR[1] * MM), SIZE * MM, color="0.8"))
    for i in (0, len(targets) // 2, len(targets) - 1):
        for path, colour, style in ((ignorant, IGNORANT, "--"), (leaning, LEANING, "-")):
            points = path[i].shape.positions * MM
            scene.plot(points[:, 0], points[:, 2], style, color=colour, linewidth=1.8)
    scene.plot(targets[:, 0] * MM, targets[:, 2] * MM, "k:", linewidth=1.5)
    scene.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal", xlim=(-20, 100))
    handles = [
        mpl.lines.Line2D([], [], color=LEANING, label="bar known"),
        mpl.lines.Line2D([], [], color=IGNORANT, linestyle="--", label="bar ignored"),
        mpl.lines.Line2D([], [], color="k", linestyle=":", label="tip"),
    ]
    scene.legend(handles=handles, fontsize=8, frameon=False, loc="lower right")
    share = np.linspace(0, 1, len(targets))
    for k, name in enumerate(leaning.robot.tendon_names):
        for path, colour in ((ignorant, IGNORANT), (leaning, LEANING)):
            style = "-" if k == 0 else "--"
            found = path.displacements[:, k] * MM
            label = f"{name} tendon, bar {'known' if path is leaning else 'ignored'}"
            axes.plot(share, found, style, color=colour, label=label)
        axes.plot(share[::10], pulls[::10, k] * MM, "k.", label=None if k else "what was pulled")
    axes.legend(fontsize=8, frameon=False)
    axes.set(xlabel="share of the path", ylabel="tendon displacement [mm]", xlim=(0, 1))
    for each in (scene, axes):
        each.spines[["top", "right"]].set_visible(False)
    return figure


def main() -> None:
    """Solve, check and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    output = parser.parse_args().output
    output.mkdir(parents=True, exist_ok=True)
    mpl.use("Agg")

    robot = trunk()
    bar = tdcr.Cylinder(point=(BAR[0], 0, BAR[1]), axis=(0, 1, 0), radius=SIZE)
    pulls, targets = seen(robot, bar, 101)
    leaning = tdcr.track(robot, targets, start=pulls[0], obstacles=bar)
    ignorant = tdcr.track(robot, targets, start=pulls[0])
    off = np.abs(leaning.displacements - pulls).max()
    print(f"{len(leaning)} places of the tip, all met: {leaning.ok.all()}")
    print(f"taken up from the one before: {np.count_nonzero(leaning.starts == 1)}")
    print(f"displacements found again to {off * MM:.1e} mm")
    print(f"force on the bar: {forces(leaning).min():.2f} to {forces(leaning).max():.2f} N")
    print(f"bar ignored: met {ignorant.ok.sum()}, up to {ignorant.error.max() * MM:.1f} mm off")
    draw(leaning, ignorant, targets, pulls).savefig(output / "lean_on_a_bar.png", dpi=150)


if __name__ == "__main__":
    main()
