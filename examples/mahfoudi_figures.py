"""Figures 4 to 7 of Mahfoudi, Amouri & Zaatri, remade, and their printed platforms beside ours.

The paper ("New approach to modeling a planar flexible continuum robot simulating elephant trunk")
bends one section of 200 mm and three of 200, 150 and 100 mm, and prints the platforms of the three.
Its cable distance is not printed; 60 mm gives the first platform to all printed digits. Each figure
is written as a picture and as CSV; the table says which numbers follow from which reading.

    python examples/mahfoudi_figures.py --output examples/figures
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

from tdcr import planar

MM = 1e3
ONE = planar.PlanarTrunk(0.200, 0.060)
THREE = planar.PlanarTrunk([0.200, 0.150, 0.100], 0.060)
# Figure 4: l1 = l - step, l2 = l + step.
STEPS = (0.0, 0.010, 0.020, 0.030)
# Section 2.5 b of the paper.
CABLES = [(0.170, 0.230), (0.170, 0.130), (0.130, 0.070)]
PRINTED = np.array([[165.40, 95.49], [294.05, 133.97], [382.77, 158.08]])
HEADINGS = np.array([np.pi / 3, -0.486, np.pi / 3])

Array = NDArray[np.float64]


def readings() -> dict[str, planar.PlanarShape]:
    """Return the three-section trunk by every reading of what is printed."""
    return {
        "headings, absolute": THREE.shape(np.diff(HEADINGS, prepend=0.0)),
        "headings, relative": THREE.shape(HEADINGS),
        "cable lengths": THREE.forward(CABLES),
    }


def simpson(shape: planar.PlanarShape, intervals: int = 1000) -> tuple[Array, float]:
    """Return the curve by spline and Simpson's rule, section by section, and its bound [m]."""
    start, error = np.zeros(2), 0.0
    parts = []
    for function in shape.angle_functions():
        curve = function.curve(intervals)
        parts.append(start + curve.points)
        start, error = parts[-1][-1], error + curve.error
    return np.vstack(parts), error


def save(
    figure: Figure, folder: Path, name: str, header: list[str], rows: list[list[object]]
) -> None:
    """Write picture and table."""
    figure.savefig(folder / f"{name}.png", dpi=160)
    with (folder / f"{name}.csv").open("w", newline="") as file:
        csv.writer(file).writerows([header, *rows])


def plane(axes: Axes) -> None:
    """Label a picture of the trunk's plane."""
    axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    axes.grid(alpha=0.25)


def angles(axes: Axes) -> None:
    """Label a picture of angle functions."""
    axes.set(xlabel="s [mm]", ylabel="angle α [rad]")
    axes.grid(alpha=0.25)


def figures_4_and_5(folder: Path) -> None:
    """Draw one section under four cable steps: its shapes and its angle functions."""
    shapes, functions = (Figure(figsize=(4.8, 3.2), layout="constrained") for _ in range(2))
    left, right = shapes.add_subplot(), functions.add_subplot()
    points: list[list[object]] = []
    nodes: list[list[object]] = []
    for step in STEPS:
        shape = ONE.forward([(0.200 - step, 0.200 + step)])
        curve, _ = simpson(shape)
        (line,) = left.plot(*(curve * MM).T, lw=1.6, label=f"Δl = {step * MM:.0f} mm")
        left.plot(*(shape.positions * MM).T, "o", ms=4, color=line.get_color())
        (function,) = shape.angle_functions()
        fine = np.linspace(0, 0.200, 200)
        label = f"Δl = {step * MM:.0f} mm"
        right.plot(fine * MM, function(fine), lw=1.2, color=line.get_color(), label=label)
        right.plot(function.s * MM, function.angles, "o", ms=3.5, color=line.get_color())
        points += [[step * MM, *(p * MM).round(9)] for p in curve[::25]]
        nodes += [[step * MM, s * MM, a] for s, a in zip(function.s, function.angles, strict=True)]
    plane(left)
    angles(right)
    left.set_title("One section of 200 mm, cables 200 ∓ Δl")
    right.set_title("Its angle functions: nodes and natural spline")
    left.legend(frameon=False)
    right.legend(frameon=False)
    save(shapes, folder, "mahfoudi_04", ["step_mm", "x_mm", "y_mm"], points)
    save(functions, folder, "mahfoudi_05", ["step_mm", "s_mm", "angle_rad"], nodes)


def figures_6_and_7(folder: Path) -> None:
    """Draw three sections: shapes, angle functions and the printed platforms."""
    shapes, functions = (Figure(figsize=(5.6, 3.6), layout="constrained") for _ in range(2))
    left, right = shapes.add_subplot(), functions.add_subplot()
    straight = THREE.shape(np.zeros(3)).curve().points * MM
    left.plot(*straight.T, color="0.6", lw=1.6, label="initial")
    points: list[list[object]] = []
    nodes: list[list[object]] = []
    styles = {"headings, absolute": "-", "cable lengths": "--"}
    for name, shape in readings().items():
        if name not in styles:
            continue
        curve, _ = simpson(shape)
        (line,) = left.plot(*(curve * MM).T, styles[name], lw=1.6, label=f"printed {name}")
        left.plot(*(shape.positions * MM).T, "o", ms=4, color=line.get_color())
        points += [[name, *(p * MM).round(9)] for p in curve[::25]]
        s = np.linspace(0, 0.450, 451)
        label = f"printed {name}"
        right.plot(s * MM, shape.angle(s), styles[name], color=line.get_color(), label=label)
        for function in shape.angle_functions(6):
            right.plot(function.s * MM, function.angles, "o", ms=3, color=line.get_color())
            nodes += [[name, s * MM, a] for s, a in zip(function.s, function.angles, strict=True)]
    left.plot(*PRINTED.T, "kx", ms=8, mew=1.5, label="printed platforms")
    ends = np.cumsum(THREE.lengths) * MM
    right.plot(ends, HEADINGS, "kx", ms=8, mew=1.5, label="printed headings")
    plane(left)
    angles(right)
    left.set_title("Three sections of 200, 150 and 100 mm")
    right.set_title("Their angle functions")
    left.set_ylim(top=260)
    left.legend(frameon=False, loc="upper left")
    right.legend(frameon=False)
    save(shapes, folder, "mahfoudi_06", ["reading", "x_mm", "y_mm"], points)
    save(functions, folder, "mahfoudi_07", ["reading", "s_mm", "angle_rad"], nodes)


def table() -> None:
    """Print our platforms beside the printed ones, and say what cannot be reproduced."""
    known = readings()
    print(f"{'x, y [mm], heading [rad]':24}" + "".join(f"{f'platform {k}':>27}" for k in (1, 2, 3)))
    rows = {"printed in the paper": (PRINTED, HEADINGS)}
    rows |= {name: (shape.positions * MM, shape.absolute_headings) for name, shape in known.items()}
    for name, (at, headings) in rows.items():
        cells = [f"{x:10.2f}{y:8.2f}{h:9.4f}" for (x, y), h in zip(at, headings, strict=True)]
        print(f"{name:24}" + "".join(cells))
    absolute, cables = known["headings, absolute"], known["cable lengths"]
    curve = absolute.curve(6001)
    off = np.linalg.norm(curve.points * MM - PRINTED[1], axis=1)
    nearest = off.argmin()
    needed = np.diff(THREE.cable_lengths(absolute.turns))[:, 0] * MM
    given = np.diff(CABLES)[:, 0] * MM
    exact = absolute.curve(2).points[-1]
    simpsons, bound = simpson(absolute)
    rule = np.linalg.norm(simpsons[-1] - exact) / 0.450
    print(f"""
platform 1  follows from its cables and its heading, with cables 60 mm apart
platform 2  is no platform: the curve passes there at s = {curve.s[nearest] * MM:.1f} mm, within \
{off[nearest]:.2f} mm; its end is at 350 mm
platform 3  follows from the headings as absolute ones (y to 0.06 mm)
headings 2, 3 do not follow from the printed cables: l2 - l1 would be {needed[1]:.1f} and \
{needed[2]:.1f} mm, printed are {given[1]:.0f} and {given[2]:.0f} mm
cables      are no chords of such sections: their means are {(cables.misfit * MM).round(1)} mm off
figures 4-7 print no numbers; the curves here are spline and Simpson, 1000 intervals per section,
            {rule:.0e} of the length from the exact arcs (stated bound {bound / 0.450:.0e})""")


def main() -> None:
    """Write all figures and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    mpl.rcParams["font.size"] = 9
    figures_4_and_5(folder)
    figures_6_and_7(folder)
    table()
    print(f"\nfigures written to {folder}")


if __name__ == "__main__":
    main()
