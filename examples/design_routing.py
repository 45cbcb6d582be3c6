"""One wanted curve in space, and the routings of one and of two tendons that come nearest to it.

A straight backbone of 180 mm with 9 subsegments and 12 holes per disk, 8 mm from its centre, is to
lie on a curve that bends and winds. `design.routing` chooses the holes and the pulls. The picture
has the disks, how far they are from their places, and the holes; it is written as PNG and CSV.

    python examples/design_routing.py --output examples/figures
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import tdcr
from tdcr import design

LENGTH, SUBSEGMENTS, RADIUS, HOLES = 0.180, 9, 0.008, 12
COLOURS = {1: "#C8553D", 2: "#2A7F9E"}
MM = 1e3

Array = NDArray[np.float64]


def backbone() -> tdcr.Backbone:
    """Return the straight backbone."""
    return tdcr.Backbone(LENGTH, SUBSEGMENTS, poisson_ratio=0.39)


def wanted() -> Array:
    """Places (9, 3) of disks 1 to 9 on a curve whose bend turns by 150 degrees on its way [m]."""
    s = np.arange(SUBSEGMENTS) / (SUBSEGMENTS - 1)
    size, side = 0.20 - 0.08 * s, np.radians(150) * s
    rest = np.stack([-size * np.sin(side), size * np.cos(side), 0 * s], axis=1)
    bent = tdcr.Backbone(LENGTH, SUBSEGMENTS, rest=rest)
    return tdcr.Robot(bent, [tdcr.Tendon(0.0, RADIUS)]).rest_frames[1:, :3, 3]


def designed(tendons: int) -> design.Routing:
    """Return the nearest routing of so many tendons."""
    own = [tdcr.Tendon(0.0, RADIUS, name=f"tendon {k + 1}") for k in range(tendons)]
    return design.routing(tdcr.Robot(backbone(), own), wanted())


def figure(folder: Path) -> dict[int, design.Routing]:
    """Write the picture and its numbers."""
    answers = {tendons: designed(tendons) for tendons in (1, 2)}
    places = MM * np.vstack([np.zeros(3), wanted()])
    picture = Figure(figsize=(7.2, 3.4), layout="constrained")
    shape, off, holes = picture.subplots(1, 3, width_ratios=[0.8, 1, 1])
    shape.set(xlabel="x, y [mm]", ylabel="z [mm]", aspect="equal", xlim=(-15, 90), ylim=(-5, 155))
    for across, name in enumerate("xy"):
        shape.plot(places[:, across], places[:, 2], "o", mfc="none", color="#222B35", ms=6)
        end = places[-1, [across, 2]] + [3 if across == 0 else -10, 5]
        shape.annotate(name, end, fontstyle="italic")
    rows = [["wanted", i, *(p.round(4) + 0.0), ""] for i, p in enumerate(places)]
    for tendons, answer in answers.items():
        disks, own = MM * answer.shape.positions, {"color": COLOURS[tendons], "lw": 1.2, "ms": 4}
        for across in (0, 1):
            shape.plot(disks[:, across], disks[:, 2], ".-", **own)
        off.plot(MM * answer.error, ".-", **own)
    off.set(xlabel="disk", ylabel="distance from its place [mm]", ylim=(0, None))
    for axis in (off, holes):
        axis.set_xticks(range(0, SUBSEGMENTS + 1, 3))
    for axis in (shape, off, holes):
        axis.grid(True)
    for tendons, answer in answers.items():
        disks = MM * answer.shape.positions
        label = f"{tendons} tendon{'s' * (tendons > 1)}: {MM * answer.rms:.2f} mm rms"
        for k, own in enumerate(answer.holes or ()):
            # Every hole the short way round from the one before.
            path = np.unwrap(own, period=HOLES)
            style = {"color": COLOURS[tendons], "ls": "-" if k == 0 else "--", "lw": 1.2}
            holes.plot(path, ".", **style, ms=5, label=label if k == 0 else None)
        names = ["; ".join(str(own[i]) for own in answer.holes or ()) for i in range(len(disks))]
        rows += [
            [f"{tendons} tendons", i, *(p.round(4) + 0.0), names[i]] for i, p in enumerate(disks)
        ]
    holes.set(xlabel="disk", ylabel=f"hole ({HOLES} to a turn)", yticks=range(0, 2 * HOLES, 3))
    shape.plot([], [], "o", mfc="none", color="#222B35", ms=6, label="wanted")
    handles, labels = (
        [*one, *other]
        for one, other in zip(
            shape.get_legend_handles_labels(), holes.get_legend_handles_labels(), strict=True
        )
    )
    picture.legend(handles, labels, frameon=False, loc="outside upper center", ncols=3)
    picture.savefig(folder / "design_routing.png", dpi=160)
    with (folder / "design_routing.csv").open("w", newline="") as file:
        header = ["shape", "disk", "x_mm", "y_mm", "z_mm", "holes"]
        csv.writer(file).writerows([header, *rows])
    return answers


def main() -> None:
    """Write the figure and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    mpl.rcParams.update({"font.size": 9, "grid.color": "#DDE0E4", "grid.linewidth": 0.6})
    for answer in figure(folder).values():
        print(answer)
        for own, pull in zip(answer.holes or (), answer.displacements, strict=True):
            print(f"  holes {' '.join(map(str, own))}, pulled by {-MM * pull:.2f} mm")
        print(f"  rms {MM * answer.rms:.3f} mm, any azimuth {MM * answer.relaxed_rms:.3f} mm")
    print(f"figure written to {folder}")


if __name__ == "__main__":
    main()
