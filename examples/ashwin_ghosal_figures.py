"""Figures 7, 8, 11 and 12 of Ashwin & Ghosal, remade: linkage chains beside the analytic curve.

The paper (Forward Kinematics of Cable-driven Continuum Robot Using Optimization Method) prints no
numbers for these figures; the trunk here is 500 mm long with tendons 20 mm from the backbone. Each
figure is written as a picture and as CSV, with the deviation from the analytic curve.

    python examples/ashwin_ghosal_figures.py --output examples/figures
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import tdcr

LENGTH, RADIUS = 0.5, 0.02
# Chains drawn in figure 8, with their markers.
DRAWN = {4: "s-", 8: "^-", 32: "."}
AZIMUTHS = (0.0, np.pi / 2)
MM = 1e3

Array = NDArray[np.float64]


def trunk(n: int, tendons: int) -> tdcr.Robot:
    """Return the trunk with n subsegments and one or two straight tendons."""
    cables = [tdcr.Tendon(azimuth, RADIUS) for azimuth in AZIMUTHS[:tendons]]
    return tdcr.Robot(tdcr.Backbone(LENGTH, n), cables)


def analytic(pulls: tuple[float, ...], s: Array) -> Array:
    """Points of the circular arc at arc lengths s, shape (m, 3) [m].

    The bend is the norm of (pull_a, pull_b)/radius, towards their angle (Gravagne & Walker; the
    tendons stand at right angles).
    """
    c, t = pulls[0] / RADIUS, (pulls[1] / RADIUS if len(pulls) > 1 else 0.0)
    bend, towards = np.hypot(c, t), np.arctan2(t, c)
    reach = LENGTH / bend
    angle = bend * s / LENGTH
    radial = reach * (1 - np.cos(angle))
    return np.stack([radial * np.cos(towards), radial * np.sin(towards), reach * np.sin(angle)], 1)


def solve(n: int, pulls: tuple[float, ...]) -> tuple[tdcr.Shape, Array]:
    """Return the converged shape and the distance of every disk from the analytic curve [m]."""
    robot = trunk(n, len(pulls))
    shape = tdcr.forward(robot, [-pull for pull in pulls], model="linkage").require()
    return shape, np.linalg.norm(
        shape.positions - analytic(pulls, robot.backbone.arc_lengths), axis=1
    )


def save(
    figure: Figure, folder: Path, name: str, header: list[str], rows: list[list[object]]
) -> None:
    """Write picture and table."""
    figure.savefig(folder / f"{name}.png", dpi=160)
    with (folder / f"{name}.csv").open("w", newline="") as file:
        csv.writer(file).writerows([header, *rows])


def plane(axes: Axes) -> None:
    """Label a picture of the bending plane."""
    axes.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal")
    axes.grid(alpha=0.25)


def figure_7(folder: Path) -> None:
    """One tendon, several pulls: the optimised profile lies on the analytic one."""
    figure = Figure(figsize=(4.0, 5.2), layout="constrained")
    axes = figure.add_subplot()
    rows: list[list[object]] = []
    s = np.linspace(0, LENGTH, 200)
    for k, pull in enumerate((0.01, 0.02, 0.03)):
        shape, off = solve(30, (pull,))
        curve = analytic((pull,), s) * MM
        points = shape.positions * MM
        axes.plot(curve[:, 0], curve[:, 2], "k-", lw=1, label="analytic" if k == 0 else None)
        axes.plot(
            points[:, 0], points[:, 2], "o", ms=3.5, label=f"linkage, pull {pull * MM:.0f} mm"
        )
        rows += [
            [pull * MM, i, *p.round(9), d * MM]
            for i, (p, d) in enumerate(zip(points, off, strict=True))
        ]
    plane(axes)
    axes.legend(frameon=False)
    axes.set_title("One tendon, 30 subsegments")
    save(figure, folder, "figure_07", ["pull_mm", "disk", "x_mm", "y_mm", "z_mm", "off_mm"], rows)


def figure_8(folder: Path) -> None:
    """Draw one pull with more and more subsegments, and the error of the tip."""
    pull = (0.03,)
    figure = Figure(figsize=(9.2, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    curve = analytic(pull, np.linspace(0, LENGTH, 200)) * MM
    left.plot(curve[:, 0], curve[:, 2], "k-", lw=1, label="analytic")
    rows: list[list[object]] = []
    counts = [2, 4, 8, 16, 32, 64, 128, 256]
    errors = []
    for n in counts:
        shape, off = solve(n, pull)
        errors.append(off[-1] / LENGTH)
        rows.append([n, *(shape.positions[-1] * MM).round(9), off[-1] * MM])
        if n in DRAWN:
            points = shape.positions * MM
            left.plot(points[:, 0], points[:, 2], DRAWN[n], mfc="none", lw=0.8, label=f"n = {n}")
    plane(left)
    left.legend(frameon=False)
    left.set_title(f"One tendon pulled by {pull[0] * MM:.0f} mm")
    right.loglog(counts, errors, "o-", ms=4, label="tip of the linkage chain")
    right.loglog(
        counts, errors[0] * (counts[0] / np.array(counts)) ** 2, "k--", lw=0.8, label="order 2"
    )
    right.set(xlabel="subsegments n", ylabel="distance from the analytic tip / length")
    right.grid(alpha=0.25)
    right.legend(frameon=False)
    save(figure, folder, "figure_08", ["n", "tip_x_mm", "tip_y_mm", "tip_z_mm", "off_mm"], rows)


def figure_3d(folder: Path, name: str, title: str, cases: list[tuple[float, float]]) -> None:
    """Two tendons: the shapes in space, analytic curves beside them."""
    figure = Figure(figsize=(5.6, 5.2), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    rows: list[list[object]] = []
    s = np.linspace(0, LENGTH, 200)
    everything = []
    for k, pulls in enumerate(cases):
        shape, off = solve(30, pulls)
        curve, points = analytic(pulls, s) * MM, shape.positions * MM
        everything.append(points)
        axes.plot(*curve.T, "k-", lw=1, label="analytic" if k == 0 else None)
        label = f"pulls {pulls[0] * MM:.0f}, {pulls[1] * MM:.0f} mm"
        axes.plot(*points.T, "o", ms=3, label=label)
        rows += [
            [pulls[0] * MM, pulls[1] * MM, i, *p.round(9), d * MM]
            for i, (p, d) in enumerate(zip(points, off, strict=True))
        ]
    low, high = np.vstack(everything).min(axis=0), np.vstack(everything).max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(0, high[2]))
    axes.set_box_aspect(np.maximum(high - low, 1.0), zoom=0.88)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", title=title)
    axes.view_init(elev=22, azim=-60)
    figure.legend(frameon=False, loc="outside lower center", ncols=2)
    header = ["pull_a_mm", "pull_b_mm", "disk", "x_mm", "y_mm", "z_mm", "off_mm"]
    save(figure, folder, name, header, rows)


def main() -> None:
    """Write all figures and print the deviations."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    mpl.rcParams["font.size"] = 9
    figure_7(folder)
    figure_8(folder)
    equal = [(0.01, 0.01), (0.02, 0.02), (0.03, 0.03)]
    figure_3d(folder, "figure_11", "Two tendons, equal pulls, 30 subsegments", equal)
    unequal = [(0.03, 0.01), (0.03, 0.02), (0.01, 0.03)]
    figure_3d(folder, "figure_12", "Two tendons, different pulls, 30 subsegments", unequal)
    for n in (30, 60):
        off = solve(n, (0.03, 0.02))[1][-1]
        print(f"n = {n}: tip off the analytic curve by {off / LENGTH:.2e} of the length")
    print(f"figures written to {folder}")


if __name__ == "__main__":
    main()
