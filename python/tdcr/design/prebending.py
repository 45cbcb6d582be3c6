"""Rest shape that takes a wanted shape under given displacements."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdcr import _core
from tdcr._base.arguments import several_obstacles
from tdcr._base.status import Status
from tdcr._base.value import Value
from tdcr._core import Obstacle, PrebendSettings, Robot, clearance, forward
from tdcr._io.save_load import Saved
from tdcr.design.targets import wanted_places
from tdcr.errors import NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from tdcr._core import Shape
    from tdcr.design.targets import Array, Curve

__all__ = ["Prebend", "prebend"]

# Gaps are told apart down to this share of a robot's length; shapes so near are one equilibrium.
_TOUCH, _SAME = 1e-9, 1e-7


@dataclass(frozen=True, eq=False, repr=False)
class Prebend(Saved, Value):
    """A robot designed for a shape, and how it went. Arrays are read-only."""

    robot: Robot
    """The robot with its new rest shape."""
    shape: Shape
    """Its shape under the displacements, solved from rest, among the obstacles if there are any."""
    error: Array
    """Distance of each disk from its wanted place, (n + 1,) [m]; disk 0 is in its place."""
    iterations: int
    """Marches and Levenberg-Marquardt steps."""
    status: Status
    """converged: every disk is in its place (with `smoothness`: least sum of both); unreachable:
    the nearest robot that was found, or obstacles stand in the way; others: the rod does not follow
    the displacements."""
    message: str
    """Reason why it did not converge; when it converged, empty but for disks that `smoothness`
    keeps from their places, obstacles that the designed robot rests in and what the solve among
    them says."""
    target_positions: Array
    """Wanted places of disks 1 to n, (n, 3), world frame [m]."""
    settings: PrebendSettings
    clearance: float | None = None
    """Least signed distance of the points that may touch from the obstacles, when the robot is
    pulled without them: negative is inside [m]. None without obstacles."""

    _hashed: ClassVar[tuple[str, ...]] = ("robot", "target_positions", "settings")

    @property
    def ok(self) -> bool:
        """True if it converged."""
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
    obstacles: Obstacle | Iterable[Obstacle] = (),
    settings: PrebendSettings | None = None,
) -> Prebend:
    """Find the rest shape that takes a wanted shape when the tendons are pulled.

    Where each subsegment can be inverted by itself (one element, sliding tendons, no bounds met)
    the answer is exact, and its rest shape has the twists of the robot's: none, if that is
    straight. Elsewhere the rest bends are found by Levenberg-Marquardt steps on the rod's exact
    derivatives.

    Obstacles do not change the rest shape that is sought: wanted places clear of them are an
    equilibrium without contact, and no rest shape has places inside them. What they change is the
    way there: `shape` is then pulled from rest among them, and "converged" says that it arrives.
    Where it rests inside one, the message says where and how deep.

    Places that no rest shape reaches are sought from several starts: the least distances that rods
    of these lengths can have, whatever bends them, are found first, and descents with the tendons
    go on from there.

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
    obstacles : obstacle or sequence of obstacles, optional
        What the robot stays outside of on its way; sliding tendons only. Its points that may touch
        are those of `forward`.
    settings : PrebendSettings, optional

    Returns
    -------
    Prebend
        Places that no rest shape reaches are an outcome: the nearest robot that was found, with
        status "unreachable" and a message that says why. So are obstacles in the way; the robot is
        then the one for the places without them.

    Raises
    ------
    InvalidInput
        Places of another shape or number, not finite, more than a million lengths of the robot
        away, or whose first of n + 1 is not the base; a curve that is too short or leaves the base
        by 90 degrees or more off its z axis; displacements that do not fit the robot; proportional
        tendons among obstacles.
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
    around = several_obstacles(obstacles)
    places = wanted_places(robot, target_positions, settings.rod.subsegment)
    fields = _core._prebend(robot, places, displacements, settings)
    answer = Prebend(*fields, places, settings)
    return _among(answer, around) if around else answer


def _among(free: Prebend, obstacles: tuple[Obstacle, ...]) -> Prebend:
    """Pull a designed robot from rest among obstacles, and say what they do to it."""
    rod, pulls = free.settings.rod, free.shape.displacements
    shape = forward(free.robot, pulls, obstacles=obstacles, settings=rod)
    length = free.robot.backbone.total_length
    if shape.ok and np.abs(shape.positions - free.shape.positions).max() <= _SAME * length:
        # The same equilibrium, to the accuracy of a solve with contacts: now to the rod's own.
        shape = forward(free.robot, pulls, obstacles=obstacles, settings=rod, start=free.shape)
    # Distances from the wanted places, and the gap of the shape without obstacles.
    error = np.concatenate(
        [[0.0], np.linalg.norm(shape.positions[1:] - free.target_positions, axis=1)]
    )
    error.flags.writeable = False
    gap, where = _gap(free.shape, obstacles, rod.body_radius)
    met = error.max() <= free.settings.tolerance * length
    # The solve pulls it out of what it rests in; who builds it has to know.
    rest = forward(free.robot, np.full(len(pulls), np.inf), settings=rod)
    sunk, at = _gap(rest, obstacles, rod.body_radius)
    # Status and message by the first thing in the way; gaps within rounding touch.
    deep = gap < -_TOUCH * length
    status, parts = Status.converged, []
    if not free.ok:
        status, parts = free.status, [free.message]
    elif deep:
        status = Status.unreachable
        parts = [f"the wanted shape is {-gap:.3e} m inside obstacles at {where}"]
    elif not shape.ok:
        status = shape.status
    elif not met and not free.settings.smoothness:
        status = Status.unreachable
        disk = int(error.argmax())
        parts = [
            f"clear of the obstacles by {gap:.3e} m, the wanted shape is an equilibrium among "
            f"them, but not the one that pulling from rest leads to: disk {disk} stays "
            f"{error[disk]:.3e} m from its place"
        ]
    if sunk < -_TOUCH * length:
        parts.append(
            f"the designed robot rests {-sunk:.3e} m inside obstacles at {at}: they have to be put "
            f"in their places after it is pulled"
        )
    if shape.message:
        parts.append(f"among the obstacles, {shape.message}")
    message = "; ".join(parts)
    return replace(
        free, shape=shape, error=error, status=status, message=message, clearance=float(gap)
    )


def _gap(shape: Shape, obstacles: tuple[Obstacle, ...], body: float) -> tuple[float, str]:
    """Least signed distance of a shape's points that may touch [m], and where it is."""
    least, where = np.inf, ""
    centres = shape.positions
    points = [("the centre of disk", centres[1:], body)]
    for name, own in zip(shape.robot.tendon_names, shape.tendon_points, strict=True):
        points.append((f"the hole of '{name}' in disk", own[1:], 0.0))
        points.append(
            (f"opposite the hole of '{name}' in disk", (2 * centres[: len(own)] - own)[1:], 0.0)
        )
    for what, own, radius in points:
        gaps = clearance(obstacles, own) - radius
        disk = int(gaps.argmin())
        if gaps[disk] < least:
            least, where = float(gaps[disk]), f"{what} {disk + 1}"
    return least, where
