"""Planar trunks: cables to shapes and targets to turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import tau
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tdcr import _core
from tdcr.planar.angle_function import read_only
from tdcr.planar.inverse import PlanarInverse, PlanarInverseBatch, Swarm, many, one
from tdcr.planar.shape import PlanarShape

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import PsoSettings

    Array = NDArray[np.float64]

__all__ = ["PlanarTrunk"]


@dataclass(frozen=True)
class PlanarTrunk:
    """Inextensible sections in a row, each bent to an arc by two cables.

    Cable 1 runs on the left (+y) of the axis, cable 2 on the right.

    Parameters
    ----------
    lengths : float or array_like, shape (m,)
        Length of every section, base first [m].
    cable_distance : float
        Between the two cables [m] (the paper's d).

    Raises
    ------
    InvalidInput
        No section, a length or distance that is not positive.
    """

    lengths: tuple[float, ...]
    cable_distance: float

    def __init__(self, lengths: ArrayLike, cable_distance: float) -> None:
        checked, distance = _core._planar_trunk(lengths, cable_distance)
        object.__setattr__(self, "lengths", tuple(checked))
        object.__setattr__(self, "cable_distance", distance)

    @property
    def _data(self) -> tuple[Sequence[float], float]:
        return self.lengths, self.cable_distance

    def __len__(self) -> int:
        """Return the number of sections m."""
        return len(self.lengths)

    def __reduce__(self) -> tuple[type[PlanarTrunk], tuple[Any, ...]]:
        """Pickle through the constructor."""
        return type(self), self._data

    def forward(
        self, cable_lengths: ArrayLike, *, cables: Literal["chords", "arcs"] = "chords"
    ) -> PlanarShape:
        """Find the shape at given cable lengths.

        Parameters
        ----------
        cable_lengths : array_like, shape (m, 2)
            (l1, l2) of every section [m]. Only l2 - l1 is used; what the mean is off the one that
            fits the section is the shape's `misfit`.
        cables : {"chords", "arcs"}, optional
            "chords": straight lines between the platforms, ``l2 - l1 = 2 d sin(turn/2)`` (the
            paper's eqs. 2-5), turns up to pi. "arcs": parallel to the axis, ``l2 - l1 = d turn``.

        Raises
        ------
        InvalidInput
            Another shape, lengths that are not positive, chords further apart than 2 d, an unknown
            reading.
        """
        turns, misfit = _core._planar_turns(*self._data, cable_lengths, cables)
        return self._shape(turns, misfit)

    def shape(self, turns: ArrayLike) -> PlanarShape:
        """Find the shape at given turns, (m,) [rad].

        Raises
        ------
        InvalidInput
            Another number of turns than sections, NaN.
        """
        return self._shape(turns, None)

    def _shape(self, turns: ArrayLike, misfit: Array | None) -> PlanarShape:
        positions, headings = _core._planar_platforms(*self._data, turns)
        return PlanarShape(self, read_only(np.atleast_1d(turns)), positions, headings, misfit)

    def cable_lengths(
        self, turns: ArrayLike, *, cables: Literal["chords", "arcs"] = "chords"
    ) -> Array:
        """Find the cable lengths (l1, l2), (m, 2) [m], of turns (m,) [rad]: the way back.

        Raises
        ------
        InvalidInput
            Turns that do not fit, chords turned by more than pi, a turn that leaves a cable no
            length, an unknown reading.
        """
        answer: Array = _core._planar_cable_lengths(*self._data, turns, cables)
        return answer

    def inverse(
        self,
        x: float,
        y: float,
        *,
        method: Literal["newton", "pso"] = "newton",
        heading: float | None = None,
        limit: ArrayLike = tau,
        tolerance: float = 1e-12,
        max_iterations: int = 100,
        starts: int | None = None,
        obstacles: ArrayLike = (),
        objective: Literal["bends", "points"] = "bends",
        settings: PsoSettings | None = None,
        seed: int | None = None,
        polish: bool = True,
        restarts: int = 10,
        callback: Callable[[int, float], object] | None = None,
    ) -> PlanarInverse:
        """Find turns that put the tip on (x, y).

        Method "newton" finds the least bending energy of all: two sections without a heading have
        finitely many solutions, all of which are found; other numbers are solved from many starts,
        the same in every call. Method "pso" finds the least energy near where a particle swarm
        leads, another one for another seed, and can keep out of obstacles.

        Parameters
        ----------
        x, y : float
            Target of the tip [m].
        method : {"newton", "pso"}, optional
            Keywords from `obstacles` on are those of "pso", `starts` is that of "newton"; the other
            method refuses them.
        heading : float, optional
            Direction of the tip [rad]; whole turns do not matter. Default: any.
        limit : float or array_like, shape (m,), optional
            Largest |turn|, up to 2 pi [rad].
        tolerance : float, optional
            Miss of the target that counts as none [m]. A heading counts one trunk length per whole
            turn.
        max_iterations : int, optional
            Newton steps per start, or per polish, at most.
        starts : int, optional
            Turns spread over the limits that are tried. Default: 16.
        obstacles : array_like, shape (k, 3), optional
            Circles (x, y, radius) that the trunk's axis stays out of [m]. Newton's method then
            brings every particle onto the target, and the swarm lowers the energy among these.
        objective : {"bends", "points"}, optional
            What the particles are: the turns, with the tip's miss as value; or the paper's
            platforms between base and target, with the misses of the sections' lengths as value.
        settings : PsoSettings, optional
            The swarm; budgets are those of one swarm. Default: `PsoSettings()`, among obstacles
            with topology "ring".
        seed : int, optional
            Default: that of the settings.
        polish : bool, optional
            Whether Newton's method takes over as soon as it reaches the target from the swarm's
            best point. Without it the swarm itself has to come within `tolerance`.
        restarts : int, optional
            Further swarms at most, each with the next seed, as long as no answer is found.
        callback : callable, optional
            Gets the swarm's number of moves and best value after every move; the search ends with
            what it has when it returns True.

        Returns
        -------
        PlanarInverse
            `unreachable` where nothing reaches the target: the nearest turns that were found.

        Raises
        ------
        InvalidInput
            NaN, a limit outside (0, 2 pi], another number of limits than sections, settings out of
            range, an unknown method or objective, a keyword of the other method.
        KeyboardInterrupt
            On Ctrl-C during a search by swarm, within about 0.1 s.
        """
        swarm = Swarm(obstacles, objective, settings, seed, polish, restarts, callback)
        newton = (tolerance, max_iterations, starts)
        return one(self, (x, y, heading), method, limit, newton, swarm)

    def inverse_batch(
        self,
        points: ArrayLike,
        *,
        method: Literal["newton", "pso"] = "newton",
        heading: ArrayLike | None = None,
        limit: ArrayLike = tau,
        tolerance: float = 1e-12,
        max_iterations: int = 100,
        starts: int | None = None,
        obstacles: ArrayLike = (),
        objective: Literal["bends", "points"] = "bends",
        settings: PsoSettings | None = None,
        seed: int | Sequence[int] | NDArray[np.integer] | None = None,
        polish: bool = True,
        restarts: int = 10,
        threads: int | None = None,
        progress: bool | Callable[[int], object] = False,
    ) -> PlanarInverseBatch:
        """Find turns for many targets on all cores, with the GIL released.

        Parameters
        ----------
        points : array_like, shape (B, 2)
            One target (x, y) per row [m].
        heading : float or array_like, shape (B,), optional
            Direction of the tip, for all rows or for each [rad].
        seed : int or array_like, shape (B,), optional
            Seed of the first swarm, for all rows or for each. Default: that of the settings.
        threads : int, optional
            Default: all cores. The answer does not depend on it.
        progress : bool or callable, optional
            True draws a progress bar on a terminal; a callable gets the number of rows done about
            every 50 ms.
        method, limit, tolerance, max_iterations, starts, obstacles, objective, settings, polish, \
        restarts
            As for `inverse`.

        Returns
        -------
        PlanarInverseBatch
            Every row in its place, the same as alone.

        Raises
        ------
        InvalidInput
            As `inverse`, naming the row; a number of threads below 1.
        KeyboardInterrupt
            On Ctrl-C, within about 0.1 s.
        """
        swarm = Swarm(obstacles, objective, settings, seed, polish, restarts)
        newton = (tolerance, max_iterations, starts)
        return many(self, points, heading, method, limit, newton, swarm, threads, progress)
