"""From where the tool should be to tendon displacements: one target, many, a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._core import InverseSettings
from tdcr._progress import told
from tdcr._status import Status
from tdcr.errors import NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Bounds, ConstantCurvatureSettings, LinkageSettings, Robot, Shape

    Settings: TypeAlias = LinkageSettings | ConstantCurvatureSettings
    BoundsLike: TypeAlias = Bounds | tuple[ArrayLike, ArrayLike]
    Array: TypeAlias = NDArray[np.float64]
    Method: TypeAlias = Literal["newton", "pso"]

__all__ = [
    "Inverse",
    "InverseBatch",
    "inverse",
    "inverse_batch",
    "inverse_solutions",
    "track",
]


@dataclass(frozen=True, eq=False, repr=False)
class Inverse:
    """Displacements that bring the tool to a target, and how it went. Arrays are read-only."""

    robot: Robot
    target: Array
    """A position (3,) or a frame (4, 4), world frame [m]."""
    displacements: Array
    """Tendon displacements, (K,) [m]: negative pulls."""
    status: Status
    """converged: the target is met, with the least bending energy nearby where there is freedom;
    unreachable: the nearest answer that was found; infeasible: the bounds exclude each other;
    iteration_limit, numerical_error: stopped before either."""
    message: str
    """What stood in the way; empty when it converged."""
    error: float
    """Distance from the tool to the target, over the axes that count [m]."""
    rotation_error: float
    """Angle from the tool to the target, over the axes that count [rad]; 0 for a position."""
    iterations: int
    """Steps taken from all starts."""
    starts: int
    """Starts tried."""
    model: str
    settings: Settings | None
    bounds: BoundsLike | None
    search: InverseSettings
    method: Method
    hits: int = 1
    """How many starts led to this answer (`inverse_solutions`)."""

    @property
    def ok(self) -> bool:
        """Whether it converged."""
        return self.status is Status.converged

    @cached_property
    def shape(self) -> Shape:
        """The robot under the displacements."""
        return _core.forward(
            self.robot, self.displacements, model=self.model, settings=self.settings
        )

    def require(self) -> Inverse:
        """Return the result itself, or raise `NotConverged` with its message."""
        if self.ok:
            return self
        raise NotConverged(f"{self.status}: {self.message}", self)

    def __eq__(self, other: object) -> bool:
        """Compare by value: the same robot, target, choices and answer."""
        if not isinstance(other, Inverse):
            return NotImplemented
        mine, theirs = (
            (a.robot, a.status, a.model, a.settings, a.search, a.method, a.hits)
            for a in (self, other)
        )
        return (
            mine == theirs
            and np.array_equal(self.target, other.target)
            and np.array_equal(self.displacements, other.displacements)
        )

    def __hash__(self) -> int:
        """Hash by robot and displacements."""
        return hash((self.robot, self.model, self.displacements.tobytes()))

    def __repr__(self) -> str:
        """Tell the outcome and the displacements."""
        pulls = np.array2string(
            self.displacements, precision=6, separator=", ", threshold=12, max_line_width=1000
        )
        off = f"{self.error:.3g} m"
        if self.target.shape == (4, 4):
            off += f", {self.rotation_error:.3g} rad"
        return f"<Inverse {self.status}, {off} off, displacements {pulls}>"


@dataclass(frozen=True, eq=False, repr=False)
class InverseBatch(Sequence[Inverse]):
    """Inverses of one robot, in the order of their targets; `batch[i]` is an `Inverse`."""

    robot: Robot
    targets: Array
    """Positions (B, 3) or frames (B, 4, 4), world frame [m]."""
    displacements: Array
    """Tendon displacements, (B, K) [m]."""
    status: NDArray[Any]
    """`Status` of every row, (B,)."""
    ok: NDArray[np.bool_]
    """Whether the row converged, (B,)."""
    error: Array
    """Distances to the targets, (B,) [m]."""
    rotation_error: Array
    """Angles to the targets, (B,) [rad]."""
    iterations: NDArray[np.uint64]
    """Steps taken, (B,)."""
    starts: NDArray[np.uint64]
    """Starts tried, (B,). Along a path 1 means that the row went on from the one before; more, that
    this failed and the answer may be far from it."""
    model: str
    settings: Settings | None
    bounds: BoundsLike | None
    search: InverseSettings
    method: Method

    def __len__(self) -> int:
        """Return the number of targets B."""
        return len(self.targets)

    def __getitem__(self, index: Any) -> Any:
        """Return the inverse of one target, or a list of them for a slice."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        i = range(len(self))[index]
        ok = bool(self.ok[i])
        off = f"{self.error[i]:.6f} m and {self.rotation_error[i]:.6f} rad off the target"
        return Inverse(
            self.robot,
            self.targets[i],
            self.displacements[i],
            self.status[i],
            "" if ok else f"row {i} is {off} after {self.starts[i]} starts",
            float(self.error[i]),
            float(self.rotation_error[i]),
            int(self.iterations[i]),
            int(self.starts[i]),
            self.model,
            self.settings,
            self.bounds,
            self.search,
            self.method,
        )

    def __repr__(self) -> str:
        """Tell size and outcome."""
        converged = int(np.count_nonzero(self.ok))
        return f"<InverseBatch of {len(self)} targets, {converged} converged, model {self.model!r}>"


def inverse(
    robot: Robot,
    target: ArrayLike,
    *,
    model: str,
    start: ArrayLike | Inverse | Shape | None = None,
    method: Method = "newton",
    bounds: BoundsLike | None = None,
    settings: Settings | None = None,
    search: InverseSettings | None = None,
) -> Inverse:
    """Find displacements that bring the tool to a target.

    Descents (damped least squares with the exact Jacobian) from many starts inside the bounds, the
    same ones every time; the first that meets the target wins. For a single segment the first start
    is the closed form. Freedom that the target leaves goes to the least bending energy.

    Parameters
    ----------
    robot : Robot
    target : array_like, shape (3,) or (4, 4)
        Where the tool (``robot.tool``) should be, world frame [m]: a position, or a frame.
    model : {"constant_curvature"}
    method : {"newton", "pso"}, optional
        "newton" descends from guessed and random starts, and from where a swarm settles as the last
        resort; "pso" from where particle swarms settle.
    start : array_like of shape (K,), Inverse or Shape, optional
        Displacements to try first, as along a path [m].
    bounds : Bounds or (lower, upper), optional
        What may be used; a pair bounds displacements [m].
    settings : ConstantCurvatureSettings, optional
        Those of the model.
    search : InverseSettings, optional
        Tolerances, weights, number of starts, seed.

    Returns
    -------
    Inverse
        A target out of reach is an outcome: the nearest answer, with status "unreachable".

    Raises
    ------
    InvalidInput
        A target that is not finite or no rigid motion, bounds or a start that do not fit the robot,
        a model without inverse.

    Examples
    --------
    >>> import numpy as np, tdcr
    >>> tendons = [tdcr.Tendon(2 * np.pi * k / 3, 0.008) for k in range(3)]
    >>> robot = tdcr.Robot(tdcr.Backbone(0.1, 10), tendons)
    >>> there = tdcr.forward(robot, [-0.002, -0.002, 0.004], model="constant_curvature").tip
    >>> answer = tdcr.inverse(robot, there, model="constant_curvature")
    >>> answer.status, (answer.displacements * 1e3).round(6).tolist()
    (<Status.converged: 'converged'>, [-2.0, -2.0, 4.0])
    """
    search = InverseSettings() if search is None else search
    row = _core._inverse(
        robot, target, model, _displacements(start), bounds, settings, search, method
    )
    return Inverse(robot, _frozen(target), *row, model, settings, bounds, search, method)


def inverse_solutions(
    robot: Robot,
    target: ArrayLike,
    *,
    model: str,
    method: Method = "newton",
    bounds: BoundsLike | None = None,
    settings: Settings | None = None,
    search: InverseSettings | None = None,
) -> list[Inverse]:
    """Find every distinct answer that the starts lead to, least bending energy first.

    All ``search.starts`` starts are tried. An answer to which several of them lead (`hits`) is
    seldom the last one to be found: when some have a single hit, try more starts. Where the target
    leaves freedom, these are the least-energy answers of different branches.

    Parameters
    ----------
    robot, target, model, method, bounds, settings, search
        As for `inverse`.

    Returns
    -------
    list of Inverse
        Empty when none meets the target.
    """
    search = InverseSettings() if search is None else search
    rows = _core._inverse_solutions(robot, target, model, bounds, settings, search, method)
    fixed = _frozen(target)
    return [
        Inverse(robot, fixed, *row, model, settings, bounds, search, method, hits)
        for row, hits in rows
    ]


def inverse_batch(
    robot: Robot,
    targets: ArrayLike,
    *,
    model: str,
    start: ArrayLike | None = None,
    method: Method = "newton",
    bounds: BoundsLike | None = None,
    settings: Settings | None = None,
    search: InverseSettings | None = None,
    threads: int | None = None,
    progress: bool | Callable[[int], object] = False,
) -> InverseBatch:
    """Find displacements for many targets on all cores, with the GIL released.

    Parameters
    ----------
    robot, model, method, bounds, settings, search
        As for `inverse`.
    targets : array_like, shape (B, 3) or (B, 4, 4)
        One target per row [m].
    start : array_like, shape (K,) or (B, K), optional
        Displacements to try first, for all rows or for each [m].
    threads : int, optional
        Default: all cores. The answer does not depend on it.
    progress : bool or callable, optional
        True draws a progress bar on a terminal; a callable gets the number of rows done about every
        50 ms.

    Returns
    -------
    InverseBatch
        Every row in its place, the same as alone; one that did not converge has its status.

    Raises
    ------
    InvalidInput
        As `inverse`, before any row is solved and naming the row.
    KeyboardInterrupt
        On Ctrl-C, within about 0.1 s.
    """
    options = {"start": start, "threads": threads, "chain": False, "method": method}
    return _many(robot, targets, model, bounds, settings, search, progress, options)


def track(
    robot: Robot,
    targets: ArrayLike,
    *,
    model: str,
    start: ArrayLike | Inverse | Shape | None = None,
    bounds: BoundsLike | None = None,
    settings: Settings | None = None,
    search: InverseSettings | None = None,
    progress: bool | Callable[[int], object] = False,
) -> InverseBatch:
    """Follow a path: every target from the answer of the one before.

    A target that cannot be met from there is sought from all starts, and `InverseBatch.starts` says
    so: the arm may jump between such a row and the one before.

    Parameters
    ----------
    robot, model, bounds, settings, search
        As for `inverse`.
    targets : array_like, shape (B, 3) or (B, 4, 4)
        The path, target by target [m].
    start : array_like of shape (K,), Inverse or Shape, optional
        Where the path starts [m].
    progress
        As for `inverse_batch`.

    Returns
    -------
    InverseBatch

    Raises
    ------
    InvalidInput, KeyboardInterrupt
        As `inverse_batch`.
    """
    options = {
        "start": _displacements(start),
        "threads": None,
        "chain": True,
        "method": "newton",
    }
    return _many(robot, targets, model, bounds, settings, search, progress, options)


def _many(
    robot: Robot,
    targets: ArrayLike,
    model: str,
    bounds: BoundsLike | None,
    settings: Settings | None,
    search: InverseSettings | None,
    progress: bool | Callable[[int], object],
    options: dict[str, Any],
) -> InverseBatch:
    search = InverseSettings() if search is None else search
    name = "track" if options["chain"] else "inverse_batch"
    with told(progress, name, len(targets) if isinstance(targets, Sized) else None) as tell:
        columns = _core._inverse_batch(
            robot,
            targets,
            model=model,
            bounds=bounds,
            settings=settings,
            search=search,
            progress=tell,
            **options,
        )
    return InverseBatch(
        robot,
        _frozen(targets),
        **columns,
        model=model,
        settings=settings,
        bounds=bounds,
        search=search,
        method=options["method"],
    )


def _displacements(start: Any) -> Any:
    """Displacements of a start."""
    return getattr(start, "displacements", start)


def _frozen(numbers: ArrayLike) -> Array:
    """Copy numbers, so that nobody changes them under a result."""
    copy = np.array(numbers, dtype=np.float64)
    copy.flags.writeable = False
    return copy
