"""Figures 4 to 8 and 10 to 12 of Mahfoudi, Amouri & Zaatri, remade, and their numbers beside ours.

The paper ("New approach to modeling a planar flexible continuum robot simulating elephant trunk")
bends one section of 200 mm and three of 200, 150 and 100 mm, and prints the platforms of the three.
Its cable distance is not printed; 60 mm gives the first platform to all printed digits. Then it
leads two sections of 140 and 120 mm along a line by particle swarm, in 0.128 s per point. Each
figure is written as a picture and as CSV; the table says which numbers follow from which reading.
Figure 9 is a flow chart.

    python examples/mahfoudi_figures.py --output examples/figures
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Callable
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
# Section 3.3: x = 260 - 15 t, y = 15 t mm, and its mean time per point.
TWO = planar.PlanarTrunk([0.140, 0.120], 0.030)
TIMES = (0, 2, 4, 6, 8)
PATH = [(0.260 - 0.015 * t, 0.015 * t) for t in TIMES]
PRINTED_SECONDS = 0.128

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


def figure_8(folder: Path) -> None:
    """Draw an arc with the parameters that eqs. 12 to 14 read off its end."""
    shape = ONE.shape([1.9])
    x, y = shape.tip
    theta = np.arctan2(y, x)
    kappa = np.sqrt(2 * (1 - np.cos(2 * theta)) / (x**2 + y**2))
    figure = Figure(figsize=(4.2, 3.6), layout="constrained")
    axes = figure.add_subplot()
    curve = shape.curve(200).points * MM
    middle = np.array([0, 1 / kappa]) * MM
    (line,) = axes.plot(*curve.T, lw=2.2)
    for end in (np.zeros(2), shape.tip * MM):
        axes.plot(*np.array([middle, end]).T, color="0.6", lw=0.9)
    axes.plot([0, x * MM], [0, y * MM], "k--", lw=0.9)
    axes.plot([0, 90], [0, 0], color="0.6", lw=0.9)
    for radius, start, end, center in ((45, 0, theta, (0, 0)), (30, -np.pi / 2, 0.33, middle)):
        arc = np.linspace(start, end, 60)
        axes.plot(center[0] + radius * np.cos(arc), center[1] + radius * np.sin(arc), "k", lw=0.8)
    axes.plot(*np.array([np.zeros(2), middle, shape.tip * MM]).T, "o", ms=4, color=line.get_color())
    for text, place in (
        ("θ", (50, 18)),
        ("2θ", (middle[0] + 22, middle[1] - 30)),
        ("1/κ", (-20, 55)),
        ("P (x, y)", (x * MM + 5, y * MM)),
        ("o", (-9, -8)),
        ("s = 2θ/κ", (100, 48)),
    ):
        axes.text(*place, text)
    axes.set(xlim=(-40, 175), ylim=(-22, 165))
    axes.set_title("Angle and curvature from the end")
    plane(axes)
    rows: list[list[object]] = [[x * MM, y * MM, theta, kappa / MM, 2 * theta / kappa * MM]]
    assert abs(2 * theta / kappa - 0.200) < 1e-12
    save(figure, folder, "mahfoudi_08", ["x_mm", "y_mm", "theta_rad", "kappa_1_mm", "s_mm"], rows)


def figure_10(folder: Path) -> None:
    """Draw the axis at every printed time, on both branches of exact solutions."""
    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    panes = figure.subplots(1, 2, sharex=True, sharey=True)
    colors = mpl.colormaps["viridis"](np.linspace(0, 0.9, len(TIMES)))
    rows: list[list[object]] = []
    for t, (x, y), color in zip(TIMES, PATH, colors, strict=True):
        exact = planar.two_section_solutions(*TWO.lengths, x, y)
        for branch, axes in enumerate(panes):
            # The straight trunk is the double solution where both begin.
            shape = TWO.shape(exact[min(branch, len(exact) - 1)])
            points = shape.curve(60).points * MM
            axes.plot(*points.T, color=color, lw=1.8, label=f"t = {t}")
            axes.plot(*(shape.positions * MM).T, "o", ms=4, color=color)
            rows += [[t, branch + 1, *shape.turns, *(p * MM).round(6)] for p in points[::12]]
    for branch, axes in enumerate(panes):
        axes.plot(*(np.array(PATH) * MM).T, "k--", lw=0.9, zorder=0)
        plane(axes)
        axes.set_title(("least bending energy", "the other branch")[branch])
    panes[1].set_ylabel("")
    panes[0].legend(frameon=False, loc="upper left")
    header = ["t", "branch", "turn1_rad", "turn2_rad", "x_mm", "y_mm"]
    save(figure, folder, "mahfoudi_10", header, rows)


def figure_11(folder: Path) -> None:
    """Draw the trunk with cables and platforms as the swarm finds it along the path."""
    figure = Figure(figsize=(5.2, 3.75), layout="constrained")
    axes = figure.add_subplot()
    colors = mpl.colormaps["viridis"](np.linspace(0, 0.9, len(TIMES)))
    rows: list[list[object]] = []
    for t, (x, y), color in zip(TIMES, PATH, colors, strict=True):
        best = planar.two_section_solutions(*TWO.lengths, x, y)[0]
        # Another seed, another branch: the first seed on the one of least energy.
        tries = (TWO.inverse(x, y, method="pso", seed=seed) for seed in range(100))
        found = next(a for a in tries if np.allclose(a.turns, best, atol=1e-5))
        assert found.ok
        curve = found.shape.curve(60)
        sideways = np.stack([-np.sin(curve.headings), np.cos(curve.headings)], axis=1)
        left, right = (curve.points + side * 0.015 * sideways for side in (1, -1))
        for cable in (left, right):
            axes.plot(*(cable * MM).T, color=color, lw=0.9)
        ends = [0, 59, 119]
        axes.plot(*np.stack([left[ends], right[ends]]).transpose(2, 0, 1) * MM, color=color, lw=2.2)
        axes.plot(*(curve.points * MM).T, "--", color=color, lw=0.9, label=f"t = {t}")
        rows.append([t, found.seed, *found.turns, found.error * MM, found.energy])
    axes.plot(*(np.array(PATH) * MM).T, "k.", ms=6, zorder=9)
    plane(axes)
    axes.set_title("Two sections on a line, by particle swarm")
    axes.legend(frameon=False, loc="upper right")
    header = ["t", "seed", "turn1_rad", "turn2_rad", "error_mm", "energy_1_m"]
    save(figure, folder, "mahfoudi_11", header, rows)


def seconds(solve: Callable[[int], object], runs: int) -> float:
    """Return the mean time of a run, in seconds of the processor."""
    begin = time.process_time()
    for run in range(runs):
        solve(run)
    return (time.process_time() - begin) / runs


def figure_12(folder: Path) -> None:
    """Draw the time per point: our swarm and exact solver from Python, and the printed mean."""
    figure = Figure(figsize=(5.2, 3.2), layout="constrained")
    axes = figure.add_subplot()
    rows: list[list[object]] = []
    for t, (x, y) in zip(TIMES, PATH, strict=True):

        def swarm(seed: int, x: float = x, y: float = y) -> None:
            assert TWO.inverse(x, y, method="pso", seed=seed).error < 1e-9

        def exact(_: int, x: float = x, y: float = y) -> None:
            planar.two_section_solutions(*TWO.lengths, x, y)

        rows.append([t, seconds(swarm, 1000) * 1e6, seconds(exact, 1000) * 1e6])
    at = np.array(TIMES, dtype=np.float64)
    for k, label in ((1, "swarm and polish, 1,000 seeds"), (2, "every exact solution")):
        bars = axes.bar(at + (k - 1.5) * 0.7, [row[k] for row in rows], 0.66, label=label)
        axes.bar_label(bars, fmt="%.0f", fontsize=7, padding=1)
    axes.axhline(PRINTED_SECONDS * 1e6, color="k", ls="--", lw=1)
    axes.text(8.75, PRINTED_SECONDS * 8.2e5, "mean printed in the paper", ha="right", va="top")
    axes.set(yscale="log", ylim=(1, 4e5), xlabel="t", ylabel="time per point [µs]")
    axes.set_xticks(TIMES)
    axes.set_title("Time per point, called from Python on one core")
    axes.legend(frameon=False, loc="center right")
    save(figure, folder, "mahfoudi_12", ["t", "swarm_us", "exact_us"], rows)
    mean = float(np.mean([row[1] for row in rows]))
    printed = PRINTED_SECONDS * 1e6
    print(f"path of section 3.3: {mean:.0f} us per point by swarm, printed {printed:.0f}")


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
    figure_8(folder)
    figure_10(folder)
    figure_11(folder)
    table()
    figure_12(folder)
    print(f"\nfigures written to {folder}")


if __name__ == "__main__":
    main()
