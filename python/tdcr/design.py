"""Design: the robot that takes a wanted shape. Mathematics: `docs/design.md`.

>>> import numpy as np, tdcr
>>> from tdcr import design
>>> robot = tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(np.pi, 0.008)])
>>> turn = np.linspace(0, 2, 50)[:, None]
>>> circle = 0.1 * np.hstack([1 - np.cos(turn), 0 * turn, np.sin(turn)])
>>> finger = design.prebend(robot, design.on_curve(robot, circle), [-0.005])
>>> finger.status, finger.robot.backbone.rest[4].round(4).tolist()
(<Status.converged: 'converged'>, [0.0, 0.2736, 0.0])
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._core import PrebendSettings, Robot
from tdcr._fit import Fit, fit
from tdcr._status import Status
from tdcr._value import Value
from tdcr.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Shape

    Array: TypeAlias = NDArray[np.float64]
    Curve: TypeAlias = Callable[[float], ArrayLike]

__all__ = ["Fit", "Prebend", "PrebendSettings", "fit", "on_curve", "prebend"]

# A curve given as a function is sampled so often per subsegment, and so far beyond the robot's
# length: arcs and chords need more of a curve than their own length where it bends.
_SAMPLES, _BEYOND = 20, 1.25


@dataclass(frozen=True, eq=False, repr=False)
class Prebend(Value):
    """A robot designed for a shape, and how it went. Arrays are read-only."""

    robot: Robot
    """The robot with its new rest shape."""
    shape: Shape
    """Its shape under the displacements, solved from rest."""
    error: Array
    """Distance of each disk from its wanted place, (n + 1,) [m]; disk 0 is in its place."""
    iterations: int
    """Marches and Levenberg-Marquardt steps."""
    status: Status
    """converged: every disk is in its place (with `smoothness`: least sum of both); unreachable:
    the nearest robot that was found; others: the rod does not follow the displacements."""
    message: str
    """What stood in the way; empty when it converged."""
    target_positions: Array
    """Wanted places of disks 1 to n, (n, 3), world frame [m]."""
    settings: PrebendSettings

    _hashed: ClassVar[tuple[str, ...]] = ("robot", "target_positions", "settings")

    @property
    def ok(self) -> bool:
        """Whether it converged."""
        return self.status is Status.converged

    def require(self) -> Prebend:
        """Return the result itself, or raise `NotConverged` with its message."""
        if self.ok:
            return self
        raise NotConverged(f"{self.status}: {self.message}", self)

    def __repr__(self) -> str:
        """Tell outcome and error."""
        count = len(self.target_positions)
        return f"<Prebend of {count} subsegments, {self.status}, {self.error.max():.3g} m off>"


def prebend(
    robot: Robot,
    target_positions: ArrayLike | Curve,
    displacements: ArrayLike,
    *,
    settings: PrebendSettings | None = None,
) -> Prebend:
    """Find the rest shape that takes a wanted shape when the tendons are pulled.

    Where each subsegment can be inverted by itself (one element, sliding tendons, no bounds met)
    the answer is exact, and its rest shape has the twists of the robot's: none, if that is
    straight. Elsewhere the rest bends are found by Levenberg-Marquardt steps on the rod's exact
    derivatives.

    Parameters
    ----------
    robot : Robot
        Its rest shape counts as a first guess only, but for its twists.
    target_positions : array_like, shape (n, 3) or (n + 1, 3), or callable
        Wanted places of disks 1 to n, or of all disks, the base first, world frame [m]. Or a curve:
        a function from arc length from the base [m] to a point (3,), which is called from 0 to 1.25
        times the robot's length and on which `on_curve` finds places.
    displacements : array_like, shape (K,)
        Tendon displacements under which the shape is wanted [m]: negative pulls, `inf` is free.
    settings : PrebendSettings, optional

    Returns
    -------
    Prebend
        Places that no rest shape reaches are an outcome: the nearest robot that was found, with
        status "unreachable" and a message that says why.

    Raises
    ------
    InvalidInput
        Places of another shape or number, not finite, or whose first of n + 1 is not the base; a
        curve that is too short; displacements that do not fit the robot.
    TypeError
        A value of another type.
    KeyboardInterrupt
        On Ctrl-C, within about 0.1 s.
    """
    settings = PrebendSettings() if settings is None else settings
    for name, value, kind in (("robot", robot, Robot), ("settings", settings, PrebendSettings)):
        if not isinstance(value, kind):
            got = type(value).__name__
            raise TypeError(f"{name}: expected {kind.__name__}, got {got}")
    if callable(target_positions):
        places = _sampled(robot, target_positions, settings.rod.subsegment)
    else:
        places = _disks(robot, target_positions)
    fields = _core._prebend(robot, places, displacements, settings)
    return Prebend(*fields, places, settings)


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
        Points of another shape, fewer than two, not finite or repeated, a curve that is too short.
    """
    return _core._points_on_curve(robot, points, subsegment)


def _sampled(robot: Robot, curve: Curve, subsegment: str) -> Array:
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
