"""Plane of a shape, and its backbone as a smooth line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tdcr._core import Shape

__all__ = ["Plane", "plane_of", "smooth"]

Array = NDArray[np.float64]

_FLAT = 1e-6  # of the length [1] and in angle [rad]: what is closer to a plane is drawn as plane


@dataclass(frozen=True)
class Plane:
    """The plane through the base axis in which a shape bends, or bends most.

    Attributes
    ----------
    across, up, normal : ndarray, shape (3,)
        Unit vectors in the world: to the right in the picture, up in it, towards the viewer.
    across_name, up_name : str
        What the coordinates along them are.
    azimuth : float
        Direction of the bend about the world's z axis [deg].
    holds : bool
        Whether the shape stays in the plane.
    """

    across: Array
    up: Array
    normal: Array
    across_name: str
    up_name: str
    azimuth: float
    holds: bool


def plane_of(shape: Shape) -> Plane:
    """Find the plane through the base axis in which a shape bends."""
    base = shape.robot.base[:3, :3]
    frames = shape.frames[np.isfinite(shape.frames).all(axis=(1, 2))]
    rotations = base.T @ frames[:, :3, :3]
    offsets = (frames[:, :3, 3] - shape.robot.base[:3, 3]) @ base
    length = shape.robot.backbone.total_length
    radial = np.hypot(offsets[:, 0], offsets[:, 1])
    far = int(radial.argmax()) if len(radial) else 0
    if len(radial) and radial[far] > _FLAT * length:
        x, y = offsets[far, :2]
    else:
        x, y = _first_azimuth(shape)
    normal = np.array([-y, x, 0.0]) / math.hypot(x, y)
    straying = np.abs(offsets @ normal).max(initial=0.0) / length
    turning = np.abs(rotations @ normal - normal).max(initial=0.0)
    holds = bool(max(straying, turning) <= _FLAT)
    bend = base @ np.array([x, y, 0.0])
    azimuth = math.degrees(math.atan2(bend[1], bend[0]))
    return _in_world(base @ normal, base[:, 2], azimuth, holds)


def _first_azimuth(shape: Shape) -> tuple[float, float]:
    """Direction of the first tendon's hole in the base; azimuth 0 without tendons."""
    for tendon in shape.robot.tendons:
        azimuth = tendon.azimuth
        if tendon.indices is not None and tendon.count:
            turn = 2 * math.pi * tendon.indices[0] / tendon.count
            azimuth = turn + (azimuth if isinstance(azimuth, float) else azimuth[0])
        first = azimuth if isinstance(azimuth, float) else azimuth[0]
        return math.cos(first), math.sin(first)
    return 1.0, 0.0


def _in_world(normal: Array, axis: Array, azimuth: float, holds: bool) -> Plane:
    """Lay the picture's axes along the world's where the plane allows it."""
    vertical = np.array([0.0, 0.0, 1.0])
    if abs(normal[2]) < _FLAT:
        across, up, up_name = np.cross(normal, vertical), vertical, "z"
    elif abs(normal[2]) > 1.0 - _FLAT:
        across, up, up_name = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), "y"
    else:
        across, up, up_name = np.cross(normal, axis), axis, "along the base axis"
        name = "across the base axis"
        return Plane(across, up, np.cross(across, up), name, up_name, azimuth, holds)
    across = across / np.linalg.norm(across)
    heading = math.degrees(math.atan2(across[1], across[0]))
    # Left to right is towards +x, or +y in the y-z plane.
    if not -90.0 + 1e-6 < heading <= 90.0 + 1e-6:
        across, heading = -across, (heading + 360.0) % 360.0 - 180.0
    if abs(heading) < 1e-4:
        name = "x"
    elif abs(heading - 90.0) < 1e-4:
        name = "y"
    else:
        degrees = f"{heading:.4g}".replace("-", "\N{MINUS SIGN}")
        name = f"horizontal, along azimuth {degrees}\N{DEGREE SIGN}"
    return Plane(across, up, np.cross(across, up), name, up_name, azimuth, holds)


def smooth(frames: Array, samples: int = 8) -> Array:
    """Join the disk centres by cubic Hermite pieces along the disk axes.

    Parameters
    ----------
    frames : ndarray, shape (n + 1, 4, 4)
    samples : int
        Points per piece.

    Returns
    -------
    ndarray, shape (n * samples + 1, 3)
    """
    points, axes = frames[:, :3, 3], frames[:, :3, 2]
    chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
    cosine = np.clip(np.einsum("ij,ij->i", axes[:-1], axes[1:]), -1.0, 1.0)
    # chord / cos^2(angle / 4) is the tangent with which a cubic comes closest to an arc.
    speed = (chord / np.cos(np.arccos(cosine) / 4) ** 2)[:, None, None]
    t = np.linspace(0.0, 1.0, samples, endpoint=False)[None, :, None]
    start, end = points[:-1, None], points[1:, None]
    leave, arrive = axes[:-1, None] * speed, axes[1:, None] * speed
    curve = (
        (1 + 2 * t) * (1 - t) ** 2 * start
        + t * (1 - t) ** 2 * leave
        + t**2 * (3 - 2 * t) * end
        + t**2 * (t - 1) * arrive
    )
    return np.vstack([curve.reshape(-1, 3), points[-1:]])
