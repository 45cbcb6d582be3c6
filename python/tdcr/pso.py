"""Particle swarms: minima of any function over a box, without derivatives.

The update runs in the Rust core; the function is called from it. Mathematics, presets and their
sources: `docs/pso.md`.

>>> import numpy as np
>>> from tdcr import pso
>>> def rosenbrock(x):
...     return 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2
>>> settings = pso.PsoSettings(target=1e-12)
>>> found = pso.minimize(rosenbrock, [-5, -5], [5, 5], settings=settings)
>>> found.status, bool(np.allclose(found.x, 1, atol=1e-5))
(<Status.converged: 'converged'>, True)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tdcr import _core
from tdcr._base.progress import progress_callback
from tdcr._base.status import Status
from tdcr._base.value import Value
from tdcr._core import PsoSettings
from tdcr.errors import NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["PsoResult", "PsoSettings", "minimize"]


@dataclass(frozen=True, eq=False, repr=False)
class PsoResult(Value):
    """The best point of a run, and how it ended. A value: compared, hashed and pickled as such."""

    _hashed: ClassVar[tuple[str, ...]] = ("x", "settings")

    x: Array
    """The best point, (n,)."""
    value: float
    """Its value; infinity if no value below that was seen."""
    status: Status
    """converged: the target was reached, or, without a target, the run stagnated. iteration_limit:
    it ended above its target, or by a budget or the callback. numerical_error: no evaluation gave a
    value below infinity."""
    stop: str
    """Reason why it ended: "target", "stagnation", "iterations", "evaluations" or "callback"."""
    message: str
    """Reason why it did not converge; empty when it converged."""
    iterations: int
    """Moves of the whole swarm."""
    evaluations: int
    """Evaluations of points, those of the start included."""
    nan_count: int
    """Evaluations that gave NaN."""
    history: Array
    """The best value at the start and after every iteration, (iterations + 1,)."""
    settings: PsoSettings
    """Those of the run, its seed among them."""

    @property
    def ok(self) -> bool:
        """True if it converged."""
        return self.status is Status.converged

    def require(self) -> PsoResult:
        """Return the result itself, or raise `NotConverged` with its message."""
        if self.ok:
            return self
        raise NotConverged(f"{self.status}: {self.message}", self)

    def __repr__(self) -> str:
        """Tell point, value and outcome."""
        return (
            f"<PsoResult x={self.x}, value={self.value:.6g}, {self.status} by {self.stop} after "
            f"{self.iterations} iterations, {self.evaluations} evaluations>"
        )


def minimize(
    f: Callable[[Array], Any],
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    settings: PsoSettings | None = None,
    start: ArrayLike | None = None,
    vectorized: bool = False,
    callback: Callable[[int, float], object] | None = None,
    progress: bool | Callable[[int], object] = False,
) -> PsoResult:
    """Minimise a function over a box with a particle swarm.

    Parameters
    ----------
    f : callable
        From a point (n,) to a number; with `vectorized` from all points (S, n) to numbers (S,). NaN
        is no value: it is counted and never best. Infinity is worse than any other value. What it
        raises ends the run.
    lower, upper : array_like, shape (n,)
        The box. Equal bounds hold a coordinate.
    settings : PsoSettings, optional
        Size and rules of the swarm, when it stops, its seed.
    start : array_like, shape (n,) or (m, n), optional
        Points inside the box where the first particles start.
    vectorized : bool, optional
        Whether `f` takes the whole swarm at once.
    callback : callable, optional
        Gets the number of moves so far and the best value, after the start and after every move.
        The run ends when it returns True.
    progress : bool or callable, optional
        True draws a progress bar on a terminal; a callable gets the number of moves so far about
        every 50 ms.

    Returns
    -------
    PsoResult
        Not converging is an outcome: see its `status`, `message` and `require`.

    Raises
    ------
    InvalidInput
        Bounds that are not finite, of different number, or whose lower is above the upper; a start
        outside the box; a function that returns another shape.
    TypeError
        A function that returns something else than numbers, an argument of another type.
    KeyboardInterrupt
        On Ctrl-C, as soon as the call of `f` in work has returned.
    """
    if settings is None:
        settings = PsoSettings()
    elif not isinstance(settings, PsoSettings):
        raise TypeError(f"settings: expected PsoSettings, got {type(settings).__name__}")
    if not callable(f):
        raise TypeError(f"f: expected a callable, got {type(f).__name__}")
    if callback is not None and not callable(callback):
        raise TypeError(f"callback: expected a callable, got {type(callback).__name__}")
    with progress_callback(progress, "minimize", settings.max_iterations) as tell:
        fields = _core._pso_minimize(
            f,
            lower,
            upper,
            settings=settings,
            start=start,
            vectorized=vectorized,
            callback=callback,
            progress=tell,
        )
    return PsoResult(*fields, settings)
