"""Pre-bent fingers of Mahapatra & Ghosal (2024): around a sphere, and one shape by several pulls.

The paper (section 4) designs a finger of 9 subsegments, 180 mm long, that lies on a circle around a
sphere of 112 mm in diameter when its tendon is pulled by 3 % of the length; the finger's base is 42
mm from the sphere's axis, the centre 110 mm above the base. It states 214 s with fmincon. Here the
circle has 64 mm, so that the tendon's holes, 8 mm towards the sphere, clear it; the first four
subsegments lead from the base, upwards, to the circle, the other five lie on it. Figure 10 shows
the same wanted shape with different pulls. Each figure is written as a picture and as CSV.

    python examples/mahapatra_ghosal_prebend.py --output examples/figures
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import tdcr
from tdcr import design

LENGTH, SUBSEGMENTS, RADIUS = 0.180, 9, 0.008
BASE, CENTRE, SPHERE, CIRCLE = 0.042, 0.110, 0.056, 0.064
PULL = 0.03
SHARES = (0.015, 0.03, 0.045)
MM = 1e3

Array = NDArray[np.float64]


def finger() -> tdcr.Robot:
    """Return the straight finger, its tendon on the side of the sphere."""
    base = np.eye(4)
    base[0, 3] = BASE
    tendon = tdcr.Tendon(np.pi, RADIUS, name="tendon")
    return tdcr.Robot(tdcr.Backbone(LENGTH, SUBSEGMENTS), [tendon], base=base)


def wanted() -> Array:
    """Places (9, 3) of disks 1 to 9: two entry arcs of two subsegments each, then the circle [m].

    The bends of the entry arcs are such that the fourth disk has the circle's centre to its left,
    in the distance of the circle's radius: two equations, by Newton's method with differences.
    """
    ell = LENGTH / SUBSEGMENTS

    def frames(bends: Array) -> Array:
        rest = np.zeros((SUBSEGMENTS, 3))
        rest[:, 1] = np.repeat([*bends, -ell / CIRCLE], [2, 2, SUBSEGMENTS - 4])
        backbone = tdcr.Backbone(LENGTH, SUBSEGMENTS, rest=rest)
        return tdcr.Robot(backbone, [tdcr.Tendon(np.pi, RADIUS)], base=finger().base).rest_frames

    def miss(bends: Array) -> Array:
        disk = frames(bends)[4]
        centre = disk[:3, 3] - CIRCLE * disk[:3, 0]
        return centre[[0, 2]] - [0.0, CENTRE]

    bends, step = np.array([0.2, -0.05]), 1e-7
    for _ in range(20):
        slopes = [(miss(bends + step * e) - miss(bends)) / step for e in np.eye(2)]
        bends = bends - np.linalg.solve(np.transpose(slopes), miss(bends))
    return frames(bends)[1:, :3, 3]


def designed(share: float) -> design.Prebend:
    """Return the finger that takes the wanted shape when pulled by a share of its length."""
    return design.prebend(finger(), wanted(), [-share * LENGTH]).require()


def curve_of(shape: tdcr.Shape) -> Array:
    """Points (m, 3) along the arcs between the disks, which bend in the plane of x and z [m]."""
    ell = LENGTH / SUBSEGMENTS
    points = []
    for frame, (_, bend, _) in zip(shape.frames[:-1], shape.strains, strict=True):
        s = np.linspace(0, 1, 11)[:, None]
        # Chord of the arc up to s, at half its angle.
        chord = ell * s * np.sinc(bend * s / 2 / np.pi)
        local = chord * np.hstack([np.sin(bend * s / 2), 0 * s, np.cos(bend * s / 2)])
        points.append(frame[:3, 3] + local @ frame[:3, :3].T)
    return np.concatenate(points)


def draw(folder: Path, name: str, answers: dict[float, design.Prebend], sphere: bool) -> None:
    """Draw rest shapes and the final shape of all pulls; write their disks."""
    figure = Figure(figsize=(5.6, 5.2) if sphere else (5.2, 4.8), layout="constrained")
    axis = figure.add_subplot(aspect="equal", xlabel="x [mm]", ylabel="z [mm]")
    rows = []
    colours = ["#3E7CB1", "#2A9D6F", "#C8553D"]
    for colour, (share, answer) in zip(colours[-len(answers) :], answers.items(), strict=True):
        free = tdcr.forward(answer.robot, [np.inf]).require()
        for shape, state in ((free, "at rest"), (answer.shape, "pulled")):
            (x, _, z), disks = MM * curve_of(shape).T, MM * shape.positions
            last = share == max(answers)
            if state == "at rest" or last:
                line = {"ls": "--", "color": colour} if state == "at rest" else {"color": "#222B35"}
                label = f"at rest, for a pull of {share:.1%}" if state == "at rest" else state
                axis.plot(x, z, **line, lw=1.6, label=label)
                axis.plot(disks[:, 0], disks[:, 2], ".", color=line["color"], ms=6)
            rows += [[share, state, i, *(p.round(6) + 0.0)] for i, p in enumerate(disks)]
    if sphere:
        angle = np.linspace(0, 2 * np.pi, 200)
        x, z = MM * SPHERE * np.cos(angle), MM * (CENTRE + SPHERE * np.sin(angle))
        axis.fill(x, z, color="#E7E2D8", label="sphere")
        tendon = MM * answers[PULL].shape.tendon_points[0]
        axis.plot(tendon[:, 0], tendon[:, 2], color="#C8553D", lw=0.8, label="tendon")
    axis.grid(True)
    if sphere:
        axis.legend(frameon=False, loc="lower left")
    else:
        figure.legend(frameon=False, loc="outside center right")
    figure.savefig(folder / f"{name}.png", dpi=160)
    with (folder / f"{name}.csv").open("w", newline="") as file:
        header = ["pull_share", "state", "disk", "x_mm", "y_mm", "z_mm"]
        csv.writer(file).writerows([header, *rows])


def figures(folder: Path) -> None:
    """Write all pictures."""
    draw(folder, "mahapatra_sphere_finger", {PULL: designed(PULL)}, sphere=True)
    draw(folder, "mahapatra_10", {share: designed(share) for share in SHARES}, sphere=False)


def main() -> None:
    """Write all figures and print what the designs are."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("examples/figures"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    mpl.rcParams.update({"font.size": 9, "grid.color": "#DDE0E4", "grid.linewidth": 0.6})
    figures(folder)
    places = wanted()
    seconds = []
    for _ in range(50):
        begin = time.perf_counter()
        answer = design.prebend(finger(), places, [-PULL * LENGTH]).require()
        seconds.append(time.perf_counter() - begin)
    squared = float((answer.error**2).sum())
    print(f"finger around the sphere: {answer.status}, squared error {squared:.1e} m2,")
    print(f"{answer.iterations} marches, {np.median(seconds) * 1e3:.2f} ms a call (median of 50)")
    print("pull   rest bends towards +x [deg], base to tip")
    for share in SHARES:
        bends = np.degrees(designed(share).robot.backbone.rest[:, 1])
        print(f"{share:5.1%}  " + " ".join(f"{bend:6.1f}" for bend in bends))
    print(f"figures written to {folder}")


if __name__ == "__main__":
    main()
