"""A measured three-segment robot: gains, offsets and base pose from tip positions.

1,620 pulls of nine tendons and the marker at the tip (`examples/data`, ContinuumRoboticsLab's
opencr-mujoco, MIT licence). Its displacements are positive when pulled, and about -10 mm when
slack: `read_measurements` makes them negative when pulled, and slack tendons free. Models: constant
curvature, coupled, and the rod with elastic tendons, of which only the ratio to the backbone's
stiffness counts. A fifth of the rows, drawn by seed, is held out; the publisher's own validation
file is not among the data, so figures that others reached on that one are not of the same rows.

    python examples/fit_measured_robot.py --output examples/figures
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import tdcr
from tdcr import design

DATA = Path(__file__).parent / "data" / "three_segment_v4_train.csv"
LENGTHS, DISKS, RADIUS, MARKER = (0.060, 0.0625, 0.064), 6, 0.0045, 0.008
# Published azimuths of the first tendon of each segment [rad]; the others follow by thirds.
AZIMUTHS = (-3.0589, -2.5615, -2.0506)
NEUTRAL = np.array([-2.269, 9.037, 187.895]) * 1e-3
SLACK_MM = 9.9
CHOICES = (["gain"], ["gain", "offset"], ["gain", "base"], ["gain", "offset", "base"])
ROD_CHOICES = (["stiffness"], ["gain", "offset", "base", "stiffness"])
# A backbone of any stiffness, and what the fit of the tendons' starts from: 1000 N.
WIRE = {"youngs_modulus": 60e9, "diameter": 1e-3}
STIFFNESS = 1e3
MM = 1e3


def measurements() -> tdcr.Measurements:
    """Return pulls and marker positions: nine columns of displacements, the tip's x, y, z."""
    return tdcr.read_measurements(DATA, unit="mm", pull_sign="positive", free_from=SLACK_MM)


def nominal(elastic: bool = False) -> tdcr.Robot:
    """Return the robot by its published geometry; at rest its marker is where it was measured."""
    backbone = tdcr.Backbone(LENGTHS, [DISKS] * 3, **(WIRE if elastic else {}))
    tendons = [
        tdcr.Tendon(
            AZIMUTHS[s] + 2 * np.pi * t / 3,
            RADIUS,
            end=DISKS * (s + 1),
            stiffness=STIFFNESS if elastic else None,
            name=f"s{s}t{t}",
        )
        for s in range(3)
        for t in range(3)
    ]
    base, tool = np.eye(4), np.eye(4)
    tool[2, 3] = MARKER
    base[:3, 3] = NEUTRAL - [0, 0, sum(LENGTHS) + MARKER]
    return tdcr.Robot(backbone, tendons, base=base, tool=tool, name="three segments")


def fitted(names: list[str]) -> design.Fit:
    """Return the fit of some parameters: of the rod, if the tendons' stiffness is among them."""
    elastic = "stiffness" in names
    model = "rod" if elastic else "constant_curvature"
    return design.fit(nominal(elastic), measurements(), names, model=model)


def row(label: str, fit: design.Fit, before: bool) -> str:
    """Line of a table in Markdown: distances of the held-out rows, and of the others [mm]."""
    held = fit.distances(before=before) * MM
    numbers = [held.mean(), np.median(held), fit.rms(before=before) * MM]
    numbers.append(fit.mean("train", before=before) * MM)
    count = 0 if before else sum(map(len, fit.parameters.values()))
    return f"| {label} | {count} | " + " | ".join(f"{number:.1f}" for number in numbers) + " |"


def table(fits: list[design.Fit]) -> list[str]:
    """Lines of a table in Markdown."""
    head = "| fitted | unknowns | held-out mean | median | rms | mean of the others |"
    lines = [head, "|---|--:|--:|--:|--:|--:|"]
    if "stiffness" not in fits[0].parameters:
        lines.append(row("nothing: published geometry", fits[0], True))
    return lines + [row(", ".join(fit.parameters), fit, False) for fit in fits]


def main() -> None:
    """Fit, print the table, draw the distances."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    fits = [fitted(names).require() for names in CHOICES]
    last = fits[-1]
    print("Distance of the marker from where constant curvature puts it [mm]:")
    print("\n".join(table(fits)))
    rods = [fitted(names).require() for names in ROD_CHOICES]
    print("\nFrom where the rod with elastic tendons puts it [mm]:")
    print("\n".join(table(rods)) + "\n")
    print(f"{len(last.rows)} rows, {int(last.validation.sum())} of them held out, seed {last.seed}")
    for name, values in last.parameters.items():
        errors = last.standard_errors[name]
        pairs = zip(values, errors, strict=True)
        print(f"{name}: " + ", ".join(f"{value:.4f}±{error:.4f}" for value, error in pairs))
    mpl.rcParams.update({"font.size": 9, "grid.color": "#DDE0E4", "grid.linewidth": 0.6})
    figure = Figure(figsize=(5.2, 3.6), layout="constrained")
    last.plot(figure.add_subplot())
    figure.savefig(folder / "fit_measured_robot.png", dpi=160)
    axes = last.plot_residuals()
    axes[0].figure.savefig(folder / "fit_measured_robot_residuals.png", dpi=160)
    print(f"figure written to {folder}")


if __name__ == "__main__":
    main()
