"""Shapes of planar trunks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from tdcr import _core
from tdcr._base.value import Value
from tdcr.errors import InvalidInput
from tdcr.planar.angle_function import AngleFunction, Curve

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["PlanarShape", "Trunk"]


class Trunk(Protocol):
    """Trunk of a shape or an inverse: a `PlanarTrunk`."""

    @property
    def lengths(self) -> tuple[float, ...]:
        """Length of every section [m]."""

    @property
    def cable_distance(self) -> float:
        """Distance between the two cables [m]."""

    @property
    def _data(self) -> tuple[Sequence[float], float]: ...

    def __len__(self) -> int: ...

    def shape(self, turns: ArrayLike) -> PlanarShape:
        """Find the shape at given turns."""


@dataclass(frozen=True, eq=False, repr=False)
class PlanarShape(Value):
    """A bent planar trunk.

    Attributes
    ----------
    trunk : PlanarTrunk
    turns : ndarray, shape (m,)
        Turn of every section [rad].
    positions : ndarray, shape (m, 2)
        Platform (end) of every section [m].
    absolute_headings : ndarray, shape (m,)
        Direction of every platform's axis against x: the sum of the turns up to there [rad].
    misfit : ndarray, shape (m,) or None
        Mean cable length given minus the mean that fits the section [m]; None without cables.
    """

    _hashed: ClassVar[tuple[str, ...]] = ("trunk", "turns")

    trunk: Trunk
    turns: Array
    positions: Array
    absolute_headings: Array
    misfit: Array | None = None

    @property
    def relative_headings(self) -> Array:
        """Direction of every platform against the one before, (m,) [rad]: the turns."""
        return self.turns

    @property
    def tip(self) -> Array:
        """Position of the last platform, (2,) [m]."""
        tip: Array = self.positions[-1]
        return tip

    @property
    def energy(self) -> float:
        """Bending energy for EI = 1, sum of turn**2/(2 length) [1/m]."""
        return float((self.turns**2 / np.array(self.trunk.lengths)).sum() / 2)

    def clearance(self, obstacles: ArrayLike) -> float:
        """Smallest distance of the axis from circles (x, y, radius), rows (k, 3) [m], exactly.

        Negative where it enters one, infinite without any.

        Raises
        ------
        InvalidInput
            Another shape, NaN, a radius that is not positive.
        """
        return _core._planar_clearance(*self.trunk._data, self.turns, obstacles)

    def curve(self, points: int = 50) -> Curve:
        """Sample the exact arcs: `points` on every section, its two ends included.

        Raises
        ------
        InvalidInput
            Fewer than 2 points.
        """
        rows = _core._planar_curve(*self.trunk._data, self.turns, points)
        return Curve(rows[:, 0], rows[:, 1:3], rows[:, 3], 0.0)

    def angle(self, s: ArrayLike) -> Any:
        """Angle of the tangent at arc lengths s from the base [rad]: linear on every section."""
        ends = np.concatenate([[0.0], np.cumsum(self.trunk.lengths)])
        return np.interp(
            np.asarray(s, dtype=np.float64), ends, np.concatenate([[0.0], self.absolute_headings])
        )

    def angle_functions(self, nodes: int = 11) -> list[AngleFunction]:
        """Return one spline per section through `nodes` evenly spaced angles, ends included.

        Raises
        ------
        InvalidInput
            Fewer than 2 nodes.
        """
        if nodes < 2:
            raise InvalidInput(f"nodes: expected at least 2 per section, got {nodes}", "nodes")
        ends = np.concatenate([[0.0], np.cumsum(self.trunk.lengths)])
        pieces = [np.linspace(a, b, nodes) for a, b in pairwise(ends)]
        return [AngleFunction(s, self.angle(s)) for s in pieces]

    def __repr__(self) -> str:
        """Tell turns and tip."""
        x, y = self.tip
        return f"<PlanarShape: turns {np.round(self.turns, 6).tolist()} rad, tip ({x:g}, {y:g}) m>"
