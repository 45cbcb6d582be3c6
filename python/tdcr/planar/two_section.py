"""Two sections exactly: every pair of turns that puts the tip on a target."""

from __future__ import annotations

from collections.abc import Callable, Sized
from math import tau
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tdcr import _core
from tdcr._base.progress import progress_callback
from tdcr._base.value import rebuild

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = [
    "Nearest",
    "TwoSectionBatch",
    "two_section_batch",
    "two_section_nearest",
    "two_section_solutions",
]


class Nearest(NamedTuple):
    """The nearest point that two sections reach."""

    turns: Array
    """Turns of both sections, (2,) [rad]."""
    distance: float
    """From the tip to the target [m]."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy with arrays that stay read-only."""
        return rebuild, (type(self), *self)


class TwoSectionBatch(NamedTuple):
    """Every solution of many targets, in one flat table."""

    turns: Array
    """Turns of all solutions, (T, 2) [rad]: target by target, each by bending energy."""
    row: NDArray[np.intp]
    """Number of the target that a solution belongs to, (T,)."""
    counts: NDArray[np.uint64]
    """Number of solutions of every target, (B,)."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy with arrays that stay read-only."""
        return rebuild, (type(self), *self)


def two_section_solutions(l1: float, l2: float, x: float, y: float, limit: float = tau) -> Array:
    """Find every pair of turns that puts the tip of two sections on (x, y).

    Parameters
    ----------
    l1, l2 : float
        Lengths of the sections, base first [m].
    x, y : float
        Target of the tip [m].
    limit : float, optional
        Largest |turn|, up to 2 pi [rad].

    Returns
    -------
    ndarray, shape (S, 2)
        Turns [rad] by bending energy, least first; (0, 2) where there is no solution. At the edge
        of the workspace, within 1e-13 of the trunk's length, the double solution is given once.

    Raises
    ------
    InvalidInput
        A length that is not positive, NaN, a limit outside (0, 2 pi].
    """
    answer: Array = _core._two_section_solutions(l1, l2, x, y, limit)
    return answer


def two_section_batch(
    l1: float,
    l2: float,
    targets: ArrayLike,
    limit: float = tau,
    *,
    threads: int | None = None,
    progress: bool | Callable[[int], object] = False,
) -> TwoSectionBatch:
    """Find every solution of many targets on all cores, with the GIL released.

    Parameters
    ----------
    l1, l2, limit
        As for `two_section_solutions`.
    targets : array_like, shape (B, 2)
        One (x, y) per row [m].
    threads : int, optional
        Default: all cores. The answer does not depend on it.
    progress : bool or callable, optional
        True draws a progress bar on a terminal; a callable gets the number of targets done about
        every 50 ms.

    Returns
    -------
    TwoSectionBatch
        ``batch.turns[batch.row == i]`` are the solutions of target i.

    Raises
    ------
    InvalidInput
        As `two_section_solutions`, naming the row; a number of threads below 1.
    KeyboardInterrupt
        On Ctrl-C, within about 0.1 s.
    """
    total = len(targets) if isinstance(targets, Sized) else None
    with progress_callback(progress, "two_section_batch", total) as tell:
        turns, counts = _core._two_section_batch(l1, l2, targets, limit, threads, tell)
    row = np.repeat(np.arange(len(counts)), counts.astype(np.intp))
    row.flags.writeable = False
    return TwoSectionBatch(turns, row, counts)


def two_section_nearest(l1: float, l2: float, x: float, y: float, limit: float = tau) -> Nearest:
    """Find the turns whose tip is nearest to (x, y).

    Parameters and errors are those of `two_section_solutions`. A target that can be reached gives
    its solution of least bending energy.

    Returns
    -------
    Nearest
        turns (2,) [rad] and distance [m]: the best of the local minima of the distance that a grid
        of 41 x 41 turns leads to.
    """
    return Nearest(*_core._two_section_nearest(l1, l2, x, y, limit))
