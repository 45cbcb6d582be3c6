"""Bases of the fingers of a gripper, and their pulls."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr._base.arguments import number, numbers, vector, whole
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tdcr._core import Robot

    Array: TypeAlias = NDArray[np.float64]

__all__ = ["least_turn", "places_around", "pulls"]

# Nearer than this to -z an axis is -z: the side it leans to would be of rounding alone.
_ROUNDING = 1e-15


def places_around(count: Any, distance: Any, axis: Any, center: Any, azimuth: Any) -> list[Array]:
    """Frames around an axis, x towards it and z along it; see `Gripper.around`."""
    count = whole("count", count, 1)
    distance = number("distance", distance)
    if not 0 < distance < math.inf:
        raise InvalidInput(f"distance: expected a length > 0 m, got {distance!r}", "distance")
    azimuth = number("azimuth", azimuth)
    if not math.isfinite(azimuth):
        raise InvalidInput(f"azimuth: expected a finite number [rad], got {azimuth!r}", "azimuth")
    frame = np.eye(4)
    frame[:3, :3] = least_turn(vector("axis", axis))
    frame[:3, 3] = vector("center", center, " [m]")
    places = []
    for k in range(count):
        cos, sin = (f(azimuth + 2 * math.pi * k / count) for f in (math.cos, math.sin))
        place = np.array(
            [
                [-cos, sin, 0, distance * cos],
                [-sin, -cos, 0, distance * sin],
                [0, 0, 1, 0],
                [0, 0, 0, 1.0],
            ]
        )
        places.append(frame @ place)
    return places


def least_turn(axis: Array) -> Array:
    """Rotation by the least angle that takes z to an axis, shape (3,); about x to -z.

    Two turns about z and one about y between them: no small divisor before -z, as in x²/(1 + z).
    """
    largest = np.abs(axis).max()
    if not largest > 0:
        message = f"axis: expected three numbers of positive length, got {axis.tolist()}"
        raise InvalidInput(message, "axis")
    x, y, z = (axis / largest).tolist()  # squares of what is very short or long are no floats
    across = math.hypot(x, y)
    length = math.hypot(across, z)
    if across < _ROUNDING * length:
        return np.eye(3) if z > 0 else np.diag([1.0, -1.0, -1.0])
    u, v = x / across, y / across
    sin, cos = across / length, z / length
    return np.array(
        [
            [u * u * cos + v * v, u * v * (cos - 1), u * sin],
            [u * v * (cos - 1), v * v * cos + u * u, v * sin],
            [-u * sin, -v * sin, cos],
        ]
    )


def pulls(displacements: Any, fingers: Sequence[Robot]) -> list[Array]:
    """Displacements of each finger from one row for all or one per finger; see `Gripper.close`."""
    name = "displacements"
    if (
        isinstance(displacements, str)
        or not isinstance(displacements, Iterable)
        or (isinstance(displacements, np.ndarray) and displacements.ndim == 0)
    ):
        shape = numbers(name, displacements).shape  # what is no number is a TypeError
        raise InvalidInput(
            f"{name}: expected shape (K,) or a row per finger, got shape {shape}", name
        )
    rows = [numbers(f"{name}[{k}]", row) for k, row in enumerate(displacements)]
    names = [f"{name}[{k}]" for k in range(len(rows))]
    if all(row.ndim == 0 for row in rows):
        rows, names = [np.array(rows, float)] * len(fingers), [name] * len(fingers)
    if len(rows) != len(fingers):
        raise InvalidInput(
            f"{name}: expected one row for all or {len(fingers)} rows, one per finger, "
            f"got {len(rows)} rows",
            name,
        )
    for k, (named, row, finger) in enumerate(zip(names, rows, fingers, strict=True)):
        expected = (len(finger.tendons),)
        if row.shape != expected:
            message = f"{named}: expected shape {expected} of fingers[{k}], got shape {row.shape}"
            raise InvalidInput(message, named)
    return rows
