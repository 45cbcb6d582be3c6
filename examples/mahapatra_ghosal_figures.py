"""Figures 3, 5, 6 and 7 of Mahapatra & Ghosal (2024), remade on their prototype's measures.

The paper (Modeling, simulations and experiments with generally routed cable-driven continuum robots
and their application to three-fingered grippers) prints: 180 mm of backbone in 9 subsegments, 12
holes at 8 mm, Poisson's ratio 0.39 (ABS) and 0.35 (PLA). Its Table I (hole numbers, pulls, which
material) and the pre-bent curves are not in its text: those here are ours, so the pictures show the
same kinds of case, not the same shapes. Straight backbones are ABS, pre-bent ones PLA.

Every case is solved with sliding tendons and arcs, the package's default, and with the paper's
choices, proportional tendons and links; the table printed says how far apart the tips are. Each
figure is written as a picture and as CSV.

    python examples/mahapatra_ghosal_figures.py --output examples/figures
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

import tdcr

LENGTH, SUBSEGMENTS, RADIUS, HOLES = 0.180, 9, 0.008, 12
ABS, PLA = 0.39, 0.35
FREE = np.inf
MM = 1e3
# Hole number on disks 0 to 9, counted from 0, counter-clockwise from +x. General 1 crosses over to
# the other side; general 2 winds by a quarter turn and back.
ROUTINGS = {
    "straight": [0] * 10,
    "helical": list(range(10)),
    "general 1": [0, 0, 0, 1, 3, 5, 6, 6, 6, 6],
    "general 2": [0, 1, 2, 3, 3, 3, 2, 1, 0, 0],
}
PULL, PULL_PREBENT = 0.014, 0.010

Array = NDArray[np.float64]

# Heading of the rest curve from +z towards +x [rad], over the share of the length.
PREBENT: dict[str, Callable[[Array], Array]] = {
    "pre-bent 1": lambda u: np.sin(np.pi * u / 2) ** 2,
    "pre-bent 2": lambda u: 0.8 * np.sin(1.5 * np.pi * u),
}
# Holes at -x and +x; the one that is not pulled is free.
SIDES = {"left": (-PULL_PREBENT, FREE), "rest": (FREE, FREE), "right": (FREE, -PULL_PREBENT)}


@dataclass(frozen=True)
class Case:
    """A robot and its displacements [m]."""

    name: str
    robot: tdcr.Robot
    displacements: tuple[float, ...]

    def solve(self, subsegment: str = "arc", tendons: str = "sliding") -> tdcr.Shape:
        """Return the converged shape."""
        settings = tdcr.RodSettings(subsegment=subsegment, tendons=tendons)
        return tdcr.forward(self.robot, self.displacements, settings=settings).require()


def routed(name: str, pull: float = PULL) -> Case:
    """Straight backbone, one tendon."""
    backbone = tdcr.Backbone(LENGTH, SUBSEGMENTS, poisson_ratio=ABS)
    tendon = tdcr.Tendon.from_holes(ROUTINGS[name], HOLES, RADIUS, name="tendon")
    return Case(name, tdcr.Robot(backbone, [tendon]), (-pull,))


def rest_curve(heading: Callable[[Array], Array], points: int = 61) -> Array:
    """Points (points, 3) of a plane curve by its heading, 180 mm long, by the midpoint rule [m]."""
    fine = 100 * (points - 1)
    angle = heading((np.arange(fine) + 0.5) / fine)
    steps = LENGTH / fine * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    curve: Array = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])[::100]
    return curve


def prebent(name: str, side: str) -> Case:
    """Pre-bent backbone, a straight tendon on each side of its plane."""
    curve = rest_curve(PREBENT[name])
    backbone = tdcr.Backbone.from_curve(curve, SUBSEGMENTS, poisson_ratio=PLA)
    tendons = [tdcr.Tendon(np.pi, RADIUS, name="left"), tdcr.Tendon(0.0, RADIUS, name="right")]
    return Case(f"{name}, {side}", tdcr.Robot(backbone, tendons), SIDES[side])


def cases() -> list[Case]:
    """All that are pulled, in the order of the table."""
    bent = [prebent(name, side) for name in PREBENT for side in ("left", "right")]
    return [*map(routed, ROUTINGS), *bent]


def apart(a: tdcr.Shape, b: tdcr.Shape) -> str:
    """Distance of two tips, in mm and as a share of the length."""
    distance = float(np.linalg.norm(a.tip[:3, 3] - b.tip[:3, 3]))
    return f"{distance * MM:.2f} ({distance / LENGTH:.1%})"


def table() -> list[str]:
    """Lines of a table in Markdown: tips by default, and how far the paper's choices are off."""
    lines = [
        "| case | pull | tip x, y, z | proportional | link | both |",
        "|---|--:|--:|--:|--:|--:|",
    ]
    for case in cases():
        shape = case.solve()
        x, y, z = (shape.tip[:3, 3] * MM).round(1) + 0.0  # no -0.0
        others = [("arc", "proportional"), ("link", "sliding"), ("link", "proportional")]
        off = " | ".join(apart(case.solve(*other), shape) for other in others)
        pull = -min(case.displacements) * MM
        lines.append(f"| {case.name} | {pull:.0f} | {x:.1f}, {y:.1f}, {z:.1f} | {off} |")
    return lines


# --- pictures ------------------------------------------------------------------------------------


def one_scale(axes: list[Any]) -> None:
    """Give all 3-D axes the same box, equal in x, y and z, and ticks at every 50 mm."""
    spans = []
    for letter in "xyz":
        limits = np.array([getattr(axis, f"get_{letter}lim")() for axis in axes])
        low, high = limits[:, 0].min(), limits[:, 1].max()
        spans.append(high - low)
        for axis in axes:
            getattr(axis, f"set_{letter}lim")(low, high)
            getattr(axis, f"{letter}axis").set_major_locator(MultipleLocator(50))
            getattr(axis, f"{letter}axis").labelpad = 2 if letter == "z" else -2
    for axis in axes:
        axis.set_box_aspect(spans, zoom=0.98)
        axis.tick_params(pad=0)


def draw(folder: Path, name: str, panels: list[tuple[Case, str, float]]) -> None:
    """Draw shapes at one scale, three in a row, seen from an azimuth [deg]; write their disks."""
    down = -(-len(panels) // 3)
    figure = Figure(figsize=(9.6, 4.1 * down))
    axes: list[Any] = []
    rows: list[list[object]] = []
    for k, (case, title, azimuth) in enumerate(panels):
        shape = case.solve()
        left, top = (k % 3) * 0.328, 1 - (k // 3) / down
        where = (left, top - 0.88 / down, 0.32, 0.8 / down)
        axis = figure.add_axes(where, projection="3d", proj_type="ortho")
        shape.plot(ax=axis, unit="mm", title="", legend=False)
        axis.view_init(elev=14, azim=azimuth)
        # Labels may reach into the space of the next picture.
        axis.patch.set_visible(False)
        axes.append(axis)
        middle, bottom = left + 0.16, top - 0.965 / down
        figure.text(middle, top - 0.05 / down, f"({'abcde'[k]}) {title}", ha="center", fontsize=10)
        handles, _ = axis.get_legend_handles_labels()
        figure.legend(
            handles=handles, loc="center", bbox_to_anchor=(middle, bottom), ncols=2, frameon=False
        )
        rows += [
            [case.name, title, i, *(p * MM).round(6) + 0.0] for i, p in enumerate(shape.positions)
        ]
    one_scale(axes)
    figure.savefig(folder / f"{name}.png", dpi=160)
    with (folder / f"{name}.csv").open("w", newline="") as file:
        header = ["case", "panel", "disk", "x_mm", "y_mm", "z_mm"]
        csv.writer(file).writerows([header, *rows])


def figures(folder: Path) -> None:
    """Write all pictures."""
    gradual = [
        (routed("general 1", pull), f"general 1, pull {pull * MM:.0f} mm", -62.0)
        for pull in (0.0, PULL / 2, PULL)
    ]
    draw(folder, "mahapatra_03", gradual)
    views = [
        ("straight", "straight", -62.0),
        ("helical", "helical, from the front", -80.0),
        ("helical", "helical, from the side", 10.0),
        ("general 1", "general 1", -62.0),
        ("general 2", "general 2", -62.0),
    ]
    draw(folder, "mahapatra_05", [(routed(name), title, a) for name, title, a in views])
    for number, name in (("06", "pre-bent 1"), ("07", "pre-bent 2")):
        titles = {"left": "left pulled", "rest": "at rest", "right": "right pulled"}
        panels = [(prebent(name, side), f"{name}, {t}", -80.0) for side, t in titles.items()]
        draw(folder, f"mahapatra_{number}", panels)


def main() -> None:
    """Write all figures and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    mpl.rcParams.update({"font.size": 9, "grid.color": "#DDE0E4", "grid.linewidth": 0.6})
    figures(folder)
    print(
        "Pull, tip and how far the tip is off with the paper's choices [mm] (share of the length):"
    )
    print("\n".join(table()))
    print(f"figures written to {folder}")


if __name__ == "__main__":
    main()
