"""From where the tool should be to tendon displacements: one target, many, a path."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._base.arguments import several_obstacles
from tdcr._base.progress import progress_callback
from tdcr._core import Bounds, InverseSettings
from tdcr._inverse.results import Inverse, InverseBatch
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from tdcr._base.models import Settings
    from tdcr._core import Loads, Obstacle, Robot, Shape
    from tdcr._inverse.results import Array, Method

    BoundsLike: TypeAlias = Bounds | tuple[ArrayLike, ArrayLike]

__all__ = [
    "Inverse",
    "InverseBatch",
    "inverse",
    "inverse_batch",
    "inverse_solutions",
    "track",
]


def inverse(
    robot: Robot,
    target: ArrayLike | None = None,
    *,
    positions: ArrayLike | None = None,
    model: str = "rod",
    start: ArrayLike | Inverse | Shape | None = None,
    method: Method = "newton",
    bounds: BoundsLike | None = None,
    obstacles: Obstacle | Iterable[Obstacle] = (),
    loads: Loads | None = None,
    settings: Settings | None = None,
    search: InverseSettings | None = None,
) -> Inverse:
    """Find displacements that bring the tool to a target.

    Descents (damped least squares with the exact Jacobian) from many starts inside the bounds, the
    same ones every time; the first that meets the target wins.

    With the rod the unknowns are the tensions: none becomes negative, and every tendon is as long
    as its way through the robot, so that none hangs slack. First guesses are those of constant
    curvature where the routing allows. Freedom that the target leaves goes to the least sum of
    squared tensions; with constant curvature, to the least bending energy.

    Parameters
    ----------
    robot : Robot
    target : array_like, shape (3,) or (4, 4)
        Where the tool (``robot.tool``) should be, world frame [m]: a position, or a frame.
    positions : array_like, shape (n, 3) or (n + 1, 3)
        Instead, where disks 1 to n should be [m], or all disks, of which the base's row does not
        count; rows of NaN where it does not matter. What comes nearest by the sum of squared
        distances; converged when every disk is there. The rod only. To change the robot itself,
        `design.prebend` and `design.routing`.
    model : {"rod", "constant_curvature"}, optional
    method : {"newton", "pso"}, optional
        "newton" descends from guessed and random starts, and from where a swarm settles as the last
        resort; "pso" from where particle swarms settle, among obstacles and under loads only the
        first few.
    start : array_like of shape (K,), Inverse or Shape, optional
        Displacements to try first, as along a path [m].
    bounds : Bounds or (lower, upper), optional
        What may be used; a pair bounds displacements [m].
    obstacles : Obstacle or iterable of Obstacle, optional
        What the rod stays out of, or inside of, as in `forward`; it may lean on them.
    loads : Loads, optional
        Weight, forces and moments on the rod, as in `forward`.
    settings : RodSettings or ConstantCurvatureSettings, optional
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
        Both or neither of target and positions, one that is not finite or further from the base
        than a million lengths of the robot and its tool, a frame that is no rigid motion, bounds
        or a start that do not fit the robot, a model without inverse, proportional tendons,
        obstacles, loads or positions for another model than the rod.
    Exception
        What the function of a `SignedDistance` raises.

    Examples
    --------
    >>> import numpy as np, tdcr
    >>> tendons = [tdcr.Tendon(2 * np.pi * k / 3, 0.008) for k in range(3)]
    >>> robot = tdcr.Robot(tdcr.Backbone(0.1, 10), tendons)
    >>> there = tdcr.forward(robot, [-0.002, -0.002, 0.004], model="constant_curvature").tip
    >>> answer = tdcr.inverse(robot, there, model="constant_curvature")
    >>> answer.status, (answer.displacements * 1e3).round(6).tolist()
    (<Status.converged: 'converged'>, [-2.0, -2.0, 4.0])
    >>> pulled = tdcr.forward(robot, [-0.003, float("inf"), float("inf")])
    >>> answer = tdcr.inverse(robot, pulled.positions[-1])
    >>> answer.status, (answer.displacements * 1e3).round(6).tolist()
    (<Status.converged: 'converged'>, [-3.0, 1.491244, 1.491244])
    """
    search = InverseSettings() if search is None else search
    bounds = _bounds(bounds)
    around = several_obstacles(obstacles)
    if (target is None) == (positions is None):
        got = "neither" if target is None else "both"
        raise InvalidInput(f"target: expected a target or positions, got {got}", "target")
    row, shape = _core._inverse(
        robot,
        target,
        positions,
        model,
        _displacements(start),
        bounds,
        settings,
        search,
        method,
        around,
        loads,
    )
    return Inverse(
        robot,
        _read_only(target if positions is None else positions),  # type: ignore[arg-type]
        *row,
        model,
        settings,
        bounds,
        search,
        method,
        obstacles=around,
        loads=loads,
        known_shape=shape,
    )


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
    leaves freedom, these are the least-energy answers of different branches. A target on the axis
    of the base has continua of answers where the robot may turn about it: every start then finds
    another one, the hits are 1 however many starts are tried, and the list is a sample.

    Parameters
    ----------
    robot, target, method, bounds, settings, search
        As for `inverse`.
    model : {"constant_curvature"}
        The rod has one answer: that of `inverse`.

    Returns
    -------
    list of Inverse
        Empty when none meets the target.

    Raises
    ------
    InvalidInput
        As `inverse`; also for the model "rod".
    """
    search = InverseSettings() if search is None else search
    bounds = _bounds(bounds)
    rows = _core._inverse_solutions(robot, target, model, bounds, settings, search, method)
    fixed = _read_only(target)
    return [
        Inverse(robot, fixed, *row, model, settings, bounds, search, method, hits)
        for row, hits in rows
    ]


def inverse_batch(
    robot: Robot,
    targets: ArrayLike,
    *,
    model: str = "rod",
    start: ArrayLike | Inverse | InverseBatch | Shape | None = None,
    method: Method = "newton",
    bounds: BoundsLike | None = None,
    obstacles: Obstacle | Iterable[Obstacle] = (),
    loads: Loads | None = None,
    settings: Settings | None = None,
    search: InverseSettings | None = None,
    threads: int | None = None,
    progress: bool | Callable[[int], object] = False,
) -> InverseBatch:
    """Find displacements for many targets on all cores, with the GIL released.

    Parameters
    ----------
    robot, model, method, bounds, obstacles, loads, settings, search
        As for `inverse`.
    targets : array_like, shape (B, 3) or (B, 4, 4)
        One target per row [m].
    start : array_like of shape (K,) or (B, K), Inverse, InverseBatch or Shape, optional
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
    options = {
        "start": _displacements(start),
        "threads": threads,
        "chain": False,
        "method": method,
        "obstacles": several_obstacles(obstacles),
        "loads": loads,
    }
    return _many(robot, targets, model, bounds, settings, search, progress, options)


def track(
    robot: Robot,
    targets: ArrayLike,
    *,
    model: str = "rod",
    start: ArrayLike | Inverse | Shape | None = None,
    bounds: BoundsLike | None = None,
    obstacles: Obstacle | Iterable[Obstacle] = (),
    loads: Loads | None = None,
    settings: Settings | None = None,
    search: InverseSettings | None = None,
    progress: bool | Callable[[int], object] = False,
) -> InverseBatch:
    """Follow a path: every target from the answer of the one before.

    With the rod, a step that does not lead to the target, or only by a jump, is divided: the tool
    moves and turns evenly from where it is to the target. A target that cannot be met so is sought
    from other starts, all of them or a few of the rod's, and `InverseBatch.starts` says so: the arm
    may jump between such a row and the one before.

    Parameters
    ----------
    robot, model, bounds, obstacles, loads, settings, search
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
        "obstacles": several_obstacles(obstacles),
        "loads": loads,
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
    bounds = _bounds(bounds)
    name = "track" if options["chain"] else "inverse_batch"
    try:
        count = len(targets)  # type: ignore[arg-type]
    except TypeError:
        # Of no length: the core says what is wrong.
        count = None
    with progress_callback(progress, name, count) as tell:
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
        _read_only(targets),
        **columns,
        model=model,
        settings=settings,
        bounds=bounds,
        search=search,
        method=options["method"],
        obstacles=options["obstacles"],
        loads=options["loads"],
    )


def _bounds(bounds: BoundsLike | None) -> Bounds | None:
    """Turn a pair of bounds on displacements into `Bounds`, which nobody can change."""
    if bounds is None or isinstance(bounds, Bounds):
        return bounds
    try:
        return Bounds(displacement=bounds)  # type: ignore[arg-type]  # Checked there.
    except InvalidInput as error:
        message = str(error).removeprefix("displacement")
        argument = error.argument.removeprefix("displacement")
        raise InvalidInput(f"bounds{message}", f"bounds{argument}") from None
    except TypeError as error:
        message = str(error).removeprefix("displacement")
        raise TypeError(f"bounds{message}") from None


def _displacements(start: Any) -> Any:
    """Displacements of a start."""
    return getattr(start, "displacements", start)


def _read_only(numbers: ArrayLike) -> Array:
    """Copy numbers, so that nobody changes them under a result."""
    copy = np.array(numbers, dtype=np.float64)
    copy.flags.writeable = False
    return copy
