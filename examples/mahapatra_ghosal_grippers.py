"""The three-fingered grippers of Mahapatra & Ghosal 2024, section 4.1 (figures 11 and 12), remade.

Sphere: three pre-bent fingers, 42 mm from the axis, around a ball of diameter 112 mm whose centre
is 110 mm above the base. The holes (radius 8 mm) are to touch it, so the backbone is to run on a
radius of 64 mm. An arc outwards from the vertical base runs into that circle; `design.prebend`
finds the finger that lies there when it is pulled by 3 % of its length. It is then pulled a ninth
further.

Cube: three straight fingers hold it; one of them has a helical second tendon. When that is pulled,
the finger winds and its hold gets a moment about the vertical axis. Material and cube are ours, the
paper does not state them.

    python examples/mahapatra_ghosal_grippers.py --output figures
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import tdcr

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

LENGTH, COUNT, HOLE = 0.180, 9, 0.008
DISTANCE, HEIGHT, RADIUS = 0.042, 0.110, 0.056
PULL = 0.03 * LENGTH
MATERIAL = {"poisson_ratio": 0.35, "youngs_modulus": 2e9, "diameter": 0.003}


def heading(s: np.ndarray) -> np.ndarray:
    """Outward angle of the contour at arc lengths: an arc of radius r, then the circle of 64 mm."""
    circle = RADIUS + HOLE
    # Tangent to the vertical at the base and to the circle from outside.
    r = (DISTANCE**2 + HEIGHT**2 - circle**2) / (2 * (circle - DISTANCE))
    angle = np.arctan2(HEIGHT, DISTANCE + r)
    return np.where(s < r * angle, s / r, angle - (s - r * angle) / circle)


def sphere_gripper() -> tuple[tdcr.Gripper, tdcr.Sphere]:
    """Return three fingers that lie on the ball after a pull of 3 %, and the ball."""
    s = np.linspace(0, LENGTH * 1.05, 2001)
    slope = np.stack([-np.sin(heading(s)), np.zeros_like(s), np.cos(heading(s))], axis=1)
    # The finger's x axis points to the ball; the trapezoidal rule from its base.
    contour = np.zeros((len(s), 3))
    contour[1:] = np.cumsum(0.5 * (slope[1:] + slope[:-1]) * s[1], axis=0)
    straight = tdcr.Robot(tdcr.Backbone(LENGTH, COUNT, **MATERIAL), [tdcr.Tendon(0.0, HOLE)])
    places = tdcr.design.on_curve(straight, contour)
    finger = tdcr.design.prebend(straight, places, [-PULL]).require().robot
    gripper = tdcr.Gripper.around(finger, 3, DISTANCE)
    return gripper, tdcr.Sphere((0, 0, HEIGHT), RADIUS)


def cube_gripper() -> tuple[tdcr.Gripper, tdcr.Box]:
    """Return two fingers of one tendon and one with a winding second tendon, and the cube."""
    backbone = tdcr.Backbone(LENGTH, COUNT, **MATERIAL)
    plain = tdcr.Robot(backbone, [tdcr.Tendon(0.0, HOLE)])
    winding = tdcr.Tendon.helical(np.pi / 2, HOLE, turns=0.5)
    fingers = list(tdcr.Gripper.around(plain, 3, 0.060).fingers)
    fingers[0] = tdcr.Robot(backbone, [tdcr.Tendon(0.0, HOLE), winding], base=fingers[0].base)
    return tdcr.Gripper(fingers), tdcr.Box((0, 0, 0.165), (0.025, 0.025, 0.025))


def turn_cube(most: float = 0.0045, steps: int = 20) -> tuple[np.ndarray, list[np.ndarray], list]:
    """Hold the cube, then pull the second tendon: pulls [m], moments on the cube [N m], grasps."""
    gripper, cube = cube_gripper()
    held = gripper.close([[-0.006, np.inf], [-0.006], [-0.006]], cube, steps=12).shapes[-1]
    # Where the first tendon's pull has left the second: taut from there on.
    finger, shape = gripper.fingers[0], held[0].require()
    taut = shape.tendon_lengths[1] - finger.rest_lengths[1]
    pulls, moments, grasps = np.linspace(0, most, steps + 1), [], []
    for pull in pulls:
        shape = tdcr.forward(finger, [-0.006, taut - pull], obstacles=cube, start=shape)
        grasp = tdcr.Grasp(np.array([1.0]), ((shape, *held[1:]),))
        moments.append(grasp.moment())
        grasps.append(grasp)
    return pulls, moments, grasps


def leave_room(ax: Axes3D, zoom: float) -> None:
    """Draw smaller, in the same proportions, so that arrows and labels stay inside."""
    spans = np.ptp([ax.get_xlim3d(), ax.get_ylim3d(), ax.get_zlim3d()], axis=1)
    ax.set_box_aspect(tuple(spans), zoom=zoom)


def figures(output: Path) -> None:
    """Write all pictures and tables."""
    from matplotlib.figure import Figure

    output.mkdir(parents=True, exist_ok=True)
    gripper, ball = sphere_gripper()
    grasp = gripper.close([-PULL * 10 / 9], ball, steps=20)
    figure = Figure(figsize=(10, 5.2), layout="constrained")
    for k, step in enumerate((0, -1)):
        ax = figure.add_subplot(1, 2, k + 1, projection="3d")
        grasp.plot(step, ax=ax)
        leave_room(ax, 0.9)
    figure.savefig(output / "mahapatra_11.png", dpi=110)
    rows = [
        [f"{share * PULL * 10 / 9 * 1e3:.3f}", k, c.disk, c.kind, f"{np.linalg.norm(c.force):.6f}"]
        for step, share in enumerate(grasp.shares)
        for k, c in grasp.contacts(step)
    ]
    write(output / "mahapatra_11.csv", ["pull [mm]", "finger", "disk", "point", "force [N]"], rows)
    print(grasp, "first touch at", grasp.touch, "of the pull")
    held = {friction: grasp.force_closure(friction) for friction in (0.0, 0.5, 2.0)}
    print("force closure by friction coefficient:", held)

    pulls, moments, grasps = turn_cube()
    figure = Figure(figsize=(10, 4.8), layout="constrained")
    ax = figure.add_subplot(1, 2, 1, projection="3d")
    grasps[-1].plot(ax=ax, title="cube, both tendons")
    leave_room(ax, 0.85)
    ax = figure.add_subplot(1, 2, 2)
    ax.plot(pulls * 1e3, np.array(moments)[:, 2] * 1e3, color="#0072B2")
    ax.set_xlabel("pull of the winding tendon [mm]")
    ax.set_ylabel("moment on the cube about z [N mm]")
    ax.grid(True, color="#E6E8EB")
    figure.savefig(output / "mahapatra_12.png", dpi=110)
    rows = [
        [f"{pull * 1e3:.3f}", *(f"{1e3 * value:.6f}" for value in moment)]
        for pull, moment in zip(pulls, moments, strict=True)
    ]
    write(output / "mahapatra_12.csv", ["pull [mm]", "Mx [N mm]", "My", "Mz"], rows)
    print(
        "all converged:", all(each.ok for each in grasps), "- moment about z [N mm]", rows[-1][-1]
    )


def write(path: Path, header: list[str], rows: list[list[object]]) -> None:
    """Write a table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("figures"))
    figures(parser.parse_args().output)
