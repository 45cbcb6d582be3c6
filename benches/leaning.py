"""The rod's inverse among random obstacles and under loads, each answer solved again from rest.

Robots of 1 to 3 segments, straight or winding tendons, some pre-bent, elastic, with a tool, on a
turned base; balls, bars, capsules, boxes and walls that a shape under random tensions leans on. Its
tool is the target: a position or a pose, with equal weights or none about one axis.

    python benches/leaning.py --cases 200 --seed 1000
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from numpy.typing import NDArray

import tdcr

Array = NDArray[np.float64]

SEGMENT, RADIUS = 0.06, 0.008
WITHIN, TURN = 1e-8, 1e-7


def rotation(vector: Array) -> Array:
    """Rotation matrix of a rotation vector."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def frame(rng: np.random.Generator, turn: float, shift: float) -> Array:
    """Return a random frame."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation(rng.normal(0, turn, 3)), rng.normal(0, shift, 3)
    return pose


def robot(rng: np.random.Generator) -> tdcr.Robot:
    """Return a random robot with three tendons per segment."""
    segments, each = int(rng.integers(1, 4)), int(rng.integers(6, 11))
    count = segments * each
    rest = rng.normal(0, 0.03, (count, 3)) * [1, 1, 0.2] if rng.random() < 0.3 else None
    tendons = []
    for k in range(segments):
        end = each * (k + 1)
        first = rng.uniform(0, 2 * np.pi)
        winding = rng.uniform(-0.4, 0.4) * (rng.random() < 0.5) * (k + 1)
        stiffness = 5e4 if rng.random() < 0.2 else None
        for j in range(3):
            azimuth = first + 2 * np.pi * (j / 3 + np.linspace(0, winding, end + 1))
            tendons.append(tdcr.Tendon(azimuth, RADIUS, end=end, stiffness=stiffness))
    backbone = tdcr.Backbone(
        SEGMENT * segments, count, youngs_modulus=200e9, diameter=0.001, rest=rest
    )
    base = frame(rng, 1, 0.3) if rng.random() < 0.6 else None
    tool = frame(rng, 0.6, 0.02) if rng.random() < 0.5 else None
    return tdcr.Robot(backbone, tendons, base=base, tool=tool)


def loads(rng: np.random.Generator) -> tdcr.Loads | None:
    """Return weight and a force on the tip, in half of the cases."""
    if rng.random() < 0.5:
        return None
    return tdcr.Loads(
        gravity=rng.normal(0, 6, 3),
        backbone_density=7850,
        disk_mass=0.0005 * rng.random(),
        tip_force=rng.normal(0, 0.03, 3),
    )


def obstacle(rng: np.random.Generator, shape: tdcr.Shape) -> tdcr.Obstacle:
    """Return something that a shape is a little inside of, or close to, beside one of its disks."""
    disk = shape.frames[rng.integers(len(shape.frames) // 3, len(shape.frames))]
    angle, size = rng.uniform(0, 2 * np.pi), rng.uniform(0.005, 0.02)
    side = disk[:3, :3] @ [np.cos(angle), np.sin(angle), 0]
    gap = RADIUS - rng.uniform(-0.004, 0.008)
    center = disk[:3, 3] + side * (size + gap)
    way = rng.normal(size=3)
    makes = (
        lambda: tdcr.Sphere(center, size),
        lambda: tdcr.Cylinder(center, way, size),
        lambda: tdcr.Capsule(center - 0.02 * way, center + 0.02 * way, size),
        lambda: tdcr.Box(center, (size, 0.8 * size, 0.9 * size), rotation=rotation(way)),
        lambda: tdcr.HalfSpace(disk[:3, 3] + side * gap, -side),
    )
    return makes[rng.integers(len(makes))]()


def obstacles(rng: np.random.Generator, arm: tdcr.Robot, shape: tdcr.Shape) -> list[tdcr.Obstacle]:
    """Return up to two obstacles that leave the robot room at rest."""
    rest = tdcr.forward(arm, tensions=np.zeros(len(arm.tendons)))
    places = np.vstack([rest.positions, *rest.tendon_points])
    wanted, found = int(rng.integers(1, 3)), list[tdcr.Obstacle]()
    for _ in range(12):
        if len(found) == wanted:
            break
        new = obstacle(rng, shape)
        if tdcr.clearance(new, places).min() > 0.0005:
            found.append(new)
    return found


def turned(a: Array, b: Array) -> float:
    """Angle from one rotation to another [rad]."""
    off = a.T @ b
    skew = 0.5 * (off - off.T)
    return float(np.arctan2(np.linalg.norm(skew) / np.sqrt(2), (np.trace(off) - 1) / 2))


def case(seed: int) -> tuple[float, bool, bool, float, float] | None:
    """Time, whether met and with a message, how far rest leads off [m], [rad]; None for no case."""
    rng = np.random.default_rng(seed)
    arm, around = robot(rng), loads(rng)
    segments = len(arm.tendons) // 3
    pulls = rng.uniform(0, 3.5 / segments + 1.5, len(arm.tendons))
    pulls[3 * np.arange(segments) + rng.integers(3, size=segments)] = 0
    free = tdcr.forward(arm, tensions=pulls, loads=around)
    among = obstacles(rng, arm, free) if free.ok else []
    leaning = tdcr.forward(arm, tensions=pulls, obstacles=among, loads=around)
    if not leaning.ok:
        return None
    tool = np.eye(4) if arm.tool is None else arm.tool
    goal = leaning.tip @ tool
    posed = segments > 1 and rng.random() < 0.35
    begin = time.perf_counter()
    target = goal if posed else goal[:3, 3]
    found = tdcr.inverse(arm, target, obstacles=among, loads=around)
    took = time.perf_counter() - begin
    again = tdcr.forward(arm, found.displacements, obstacles=among, loads=around).tip @ tool
    off = float(np.linalg.norm(again[:3, 3] - goal[:3, 3]))
    return took, found.ok, bool(found.message), off, turned(again[:3, :3], goal[:3, :3]) * posed


def main() -> None:
    """Print how many targets are met, how exactly, and how long it takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1000, help="of the first case")
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.cases)
    rows = np.array([row for row in map(case, seeds) if row is not None])
    took, met, told, off, turn = rows.T
    plain = (met == 1) & (told == 0)
    exact = plain & (off <= WITHIN) & (turn <= TURN)
    print(f"targets {len(rows)}, met {met.sum():.0f}")
    print(f"of these another shape from rest, and said so: {(met * told).sum():.0f}")
    print(f"from rest within {WITHIN:g} m and {TURN:g} rad: {exact.sum()} of {plain.sum()}")
    print(f"the others at most {off[plain].max():.1e} m and {turn[plain].max():.1e} rad off")
    share = np.quantile(took, [0.5, 0.9, 1]) * 1e3
    print(f"median {share[0]:.1f} ms, 90 % within {share[1]:.0f} ms, longest {share[2]:.0f} ms")


if __name__ == "__main__":
    main()
