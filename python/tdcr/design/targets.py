"""Wanted places of a robot's disks: given one by one, or on a curve."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from tdcr import _core
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Robot

    Array: TypeAlias = NDArray[np.float64]
    Curve: TypeAlias = Callable[[float], ArrayLike]

__all__ = ["on_curve", "wanted_places"]

# A curve given as a function is sampled so often per subsegment, and so far beyond the robot's
# length: arcs and chords need more of a curve than their own length where it bends.
_SAMPLES, _BEYOND = 20, 1.25
# Angle off the base's z axis from which it is said that disks will swing about a curve [deg].
_ASIDE = 10


def on_curve(robot: Robot, points: ArrayLike, subsegment: str = "arc") -> Array:
    """Find places on a curve that a robot's disks can have, one after the other.

    Parameters
    ----------
    robot : Robot
        Its base and the lengths of its subsegments count.
    points : array_like, shape (m, 3)
        At least two points along the curve [m]; a cubic spline goes through them. It is moved to
        start at the robot's base, not turned.
    subsegment : {"arc", "link"}, optional
        As in `RodSettings`: links have equal chords; arcs go over into each other, the first along
        the base's z axis.

    Returns
    -------
    ndarray, shape (n, 3)
        Places of disks 1 to n, world frame [m]; read-only.

    Raises
    ------
    InvalidInput
        Points of another shape, fewer than two, not finite or repeated, a curve that is too short
        or leaves the base by 90 degrees or more off its z axis.

    Warns
    -----
    RuntimeWarning
        A curve that leaves the base by more than 10 degrees off its z axis: the places are on it,
        but subsegments bend to one side and the other between them.
    """
    places, angle = _core._points_on_curve(robot, points, subsegment)
    if np.degrees(angle) > _ASIDE:
        message = (
            f"the curve leaves the base {np.degrees(angle):.1f} deg off its z axis, along which "
            f"the robot leaves: subsegments will swing about it; turn the curve or the robot's base"
        )
        warnings.warn(message, RuntimeWarning, stacklevel=2)
    return places


def wanted_places(robot: Robot, given: ArrayLike | Curve, subsegment: str) -> Array:
    """Find places of disks 1 to n from themselves, those of all disks or a curve, read-only."""
    return _sample(robot, given, subsegment) if callable(given) else _disks(robot, given)


def _sample(robot: Robot, curve: Curve, subsegment: str) -> Array:
    """Places on a curve given as a function."""
    lengths = robot.backbone.arc_lengths
    stations = np.linspace(0.0, _BEYOND * lengths[-1], _SAMPLES * len(lengths))
    points = [np.asarray(curve(s)) for s in stations]
    for s, point in zip(stations, points, strict=True):
        if point.shape != (3,):
            raise InvalidInput(
                f"target_positions: expected a function that returns points of shape (3,), "
                f"got shape {point.shape} at {s:.6g} m",
                "target_positions",
            )
    try:
        return on_curve(robot, points, subsegment)
    except (InvalidInput, TypeError) as error:
        message = f"target_positions: of the curve's points, {error}"
        if isinstance(error, InvalidInput):
            raise InvalidInput(message, "target_positions") from None
        raise TypeError(message) from None


def _disks(robot: Robot, given: ArrayLike) -> Array:
    """Places of disks 1 to n from those of all, or from themselves."""
    try:
        places = np.array(given)
    except ValueError as error:
        message = f"target_positions: expected a rectangular array of numbers, got {error}"
        raise InvalidInput(message, "target_positions") from None
    if places.dtype.kind not in "fiu":
        message = f"target_positions: expected numbers, got dtype {places.dtype}"
        raise TypeError(message)
    places = places.astype(np.float64)
    count, length = robot.backbone.count, robot.backbone.total_length
    if places.shape not in ((count, 3), (count + 1, 3)):
        raise InvalidInput(
            f"target_positions: expected places of disks 1 to n, shape ({count}, 3), or with the "
            f"base, shape ({count + 1}, 3), got shape {places.shape}",
            "target_positions",
        )
    if len(places) > count:
        base = robot.base[:3, 3]
        if not np.linalg.norm(places[0] - base) <= 1e-9 * length:
            raise InvalidInput(
                f"target_positions[0]: expected the robot's base {base.tolist()} [m], "
                f"got {places[0].tolist()}",
                "target_positions[0]",
            )
        places = places[1:].copy()
    places.flags.writeable = False
    return places
