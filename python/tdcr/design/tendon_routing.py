"""Routing design: which holes and pulls bring a robot nearest to a wanted shape."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdcr import _core
from tdcr._base.progress import progress_callback
from tdcr._base.status import Status
from tdcr._base.value import Value
from tdcr._core import Robot, RoutingSettings
from tdcr._io.save_load import Saved
from tdcr.design.targets import wanted_places
from tdcr.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from tdcr._core import Shape
    from tdcr.design.targets import Array, Curve

__all__ = ["Routing", "routing", "routing_batch"]


@dataclass(frozen=True, eq=False, repr=False)
class Routing(Saved, Value):
    """A robot routed for a shape, and how it went. Arrays are read-only."""

    robot: Robot
    """The robot with its tendons through the holes that were found."""
    shape: Shape
    """Its shape under `displacements`, solved from rest."""
    displacements: Array
    """Tendon displacements that go with the holes, (K,) [m]: negative pulls."""
    holes: tuple[tuple[int, ...], ...] | None
    """Hole numbers of each tendon, disk 0 to its end, as in `Tendon.from_holes`; None where any
    azimuth was allowed."""
    error: Array
    """Distance of each disk from its wanted place, (n + 1,) [m]; disk 0 is in its place."""
    rms: float
    """Root mean square of the distances of disks 1 to n [m]: what is least."""
    relaxed_rms: float
    """Like `rms`, of the nearest routing of any azimuth that descents from this one and from simple
    ones led to [m]: a local minimum, no bound. With `holes=None`, `rms` itself."""
    optimality: str
    """reached: every disk is in its place, nothing is nearer; exhaustive: all routings of the one
    tendon were looked at over a row of tensions, between which one may be missed; searched: the
    nearest that the search met. Without proof, the last two."""
    iterations: int
    """Steps of descents and rounds of the search."""
    evaluations: int
    """Equilibria of subsegments that the search solved."""
    status: Status
    """converged: every disk is in its place; unreachable: the nearest that was found; others: the
    rod does not follow the displacements."""
    message: str
    """Reason why it did not converge; empty when it converged."""
    target_positions: Array
    """Wanted places of disks 1 to n, (n, 3), world frame [m]."""
    settings: RoutingSettings
    bounds: tuple[Array, Array] | None
    """Lowest and highest displacements, (K,) each [m]."""

    _hashed: ClassVar[tuple[str, ...]] = ("robot", "target_positions", "settings")

    @property
    def gap(self) -> float:
        """Distance by which any azimuth comes nearer, by root mean square, as far as known [m]."""
        return self.rms - self.relaxed_rms

    @property
    def ok(self) -> bool:
        """True if it converged."""
        return self.status is Status.converged

    def require(self) -> Routing:
        """Return the result itself, or raise `NotConverged` with its message."""
        if self.ok:
            return self
        raise NotConverged(f"{self.status}: {self.message}", self)

    def __repr__(self) -> str:
        """Tell outcome and error."""
        count = len(self.displacements)
        tendons = "1 tendon" if count == 1 else f"{count} tendons"
        return (
            f"<Routing of {tendons}, {self.status}, {self.error.max():.3g} m off, "
            f"{self.optimality}>"
        )


def routing(
    robot: Robot,
    target_positions: ArrayLike | Curve,
    *,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    start: Routing | None = None,
    settings: RoutingSettings | None = None,
) -> Routing:
    """Find the holes and displacements that bring a robot nearest to a wanted shape.

    The backbone is given; so are number, ends, stiffness and names of the tendons, and their radii
    unless `settings.radius` bounds them. The least sum of squared distances of disks 1 to n is
    sought: among holes by a search from disk to disk, with any azimuth by Levenberg-Marquardt steps
    on the rod's exact derivatives. The same input has the same answer.

    Parameters
    ----------
    robot : Robot
        Its tendons' own holes do not count.
    target_positions : array_like, shape (n, 3) or (n + 1, 3), or callable
        Wanted places of disks 1 to n, or of all disks, the base first, world frame [m]. Or a curve:
        a function from arc length from the base [m] to a point (3,), as for `prebend`.
    bounds : (lower, upper), optional
        Of the tendon displacements [m]: numbers, or sequences with one value per tendon. Negative
        pulls; infinite is no bound.
    start : Routing, optional
        An earlier answer to look at first, with tendons that end at the same disks.
    settings : RoutingSettings, optional

    Returns
    -------
    Routing
        Places that no routing reaches are an outcome: the nearest that was found, with status
        "unreachable" and a message that says how near.

    Raises
    ------
    InvalidInput
        Places of another shape or number, not finite, more than 1e6 lengths away, or whose first of
        n + 1 is not the base; a curve that is too short; a robot without tendons; bounds or a start
        that do not fit it.
    TypeError
        A value of another type.
    KeyboardInterrupt
        On Ctrl-C, within about 0.1 s.
    """
    settings = _check_arguments(robot, settings)
    pairs = _pairs(robot, bounds)
    before = None
    if start is not None:
        if not isinstance(start, Routing):
            message = f"start: expected Routing, got {type(start).__name__}"
            raise TypeError(message)
        before = (start.robot, start.shape.tensions.tolist())
    places = wanted_places(robot, target_positions, settings.rod.subsegment)
    return Routing(*_core._routing(robot, places, pairs, before, settings), places, settings, pairs)


def routing_batch(
    robot: Robot,
    target_positions: Iterable[ArrayLike | Curve],
    *,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    settings: RoutingSettings | None = None,
    threads: int | None = None,
    progress: bool | Callable[[int], object] = False,
) -> list[Routing]:
    """Find routings for many wanted shapes on all cores, each as `routing` does alone.

    Parameters
    ----------
    robot, bounds, settings
        As for `routing`.
    target_positions : array_like, shape (B, n, 3) or (B, n + 1, 3), or iterable of curves
        One wanted shape per row, world frame [m].
    threads : int, optional
        All cores by default; the answers are the same on any number.
    progress : bool or callable, optional
        True draws a progress bar on a terminal; a callable gets the number of rows done about every
        50 ms and at the end.

    Returns
    -------
    list of Routing
        One per row, in order.

    Raises
    ------
    InvalidInput
        As `routing`, before any row is solved and naming the row; what has no rows; a number of
        threads that is not positive.
    TypeError
        A value of another type.
    KeyboardInterrupt
        On Ctrl-C, within about 0.1 s.
    """
    settings = _check_arguments(robot, settings)
    pairs = _pairs(robot, bounds)
    rows = _rows(robot, target_positions, settings.rod.subsegment)
    with progress_callback(progress, "routings", len(rows)) as tell:
        answers = _core._routing_batch(robot, rows, pairs, settings, threads, tell)
    return [
        Routing(*fields, row, settings, pairs) for fields, row in zip(answers, rows, strict=True)
    ]


def _check_arguments(robot: Robot, settings: RoutingSettings | None) -> RoutingSettings:
    settings = RoutingSettings() if settings is None else settings
    for name, value, kind in (("robot", robot, Robot), ("settings", settings, RoutingSettings)):
        if not isinstance(value, kind):
            got = type(value).__name__
            raise TypeError(f"{name}: expected {kind.__name__}, got {got}")
    return settings


def _pairs(robot: Robot, bounds: tuple[ArrayLike, ArrayLike] | None) -> tuple[Array, Array] | None:
    """Bounds with one value per tendon, read-only."""
    if bounds is None:
        return None
    count = len(robot.tendons)
    message = (
        f"bounds: expected a pair (lower, upper) of numbers or of {count} numbers each, one per "
        f"tendon, infinite for no bound, got {bounds!r}"
    )
    try:
        lower, upper = (_side(side, count) for side in bounds)
    except TypeError:
        raise TypeError(message) from None
    except ValueError:
        raise InvalidInput(message, "bounds") from None
    return lower, upper


def _side(values: ArrayLike, count: int) -> Array:
    given = np.asarray(values)
    if given.dtype.kind not in "fiu":  # None would become NaN, and text a number
        raise TypeError(given.dtype)
    side = np.broadcast_to(given.astype(np.float64), (count,)).copy()
    side.flags.writeable = False
    return side


def _rows(robot: Robot, given: Iterable[ArrayLike | Curve], subsegment: str) -> list[Array]:
    """Wanted places of every row; what is wrong with one names it."""
    try:
        rows = list(given)
    except TypeError:
        message = (
            "target_positions: expected wanted shapes, one per row: shape (B, n, 3) or "
            f"(B, n + 1, 3), or an iterable of curves, got {type(given).__name__}"
        )
        raise TypeError(message) from None
    places = []
    for i, row in enumerate(rows):
        try:
            places.append(wanted_places(robot, row, subsegment))
        except InvalidInput as error:
            raise InvalidInput(f"{error} in row {i}", error.argument) from None
        except TypeError as error:
            message = f"{error} in row {i}"
            raise TypeError(message) from None
    return places
