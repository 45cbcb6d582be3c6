"""Workspace of a robot's tip: many forward solves over ranges of displacements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from tdcr import _core
from tdcr._base.arguments import numbers, several_obstacles, tendons_of, whole
from tdcr._base.progress import progress_callback
from tdcr._forward.chunks import Solver, spread
from tdcr._workspace.results import Sampling, Workspace
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._base.models import Settings
    from tdcr._core import Loads, Obstacle, Robot

__all__ = ["workspace"]

# One array per row; points of tendons and contacts are lists and tables.
_FIELDS = tuple(n for n in _core._fields() if n not in ("tip", "tendon_points", "contacts"))


def workspace(
    robot: Robot,
    ranges: ArrayLike,
    samples: int,
    *,
    sampling: Sampling = "sobol",
    model: str = "rod",
    settings: Settings | None = None,
    obstacles: Obstacle | Iterable[Obstacle] = (),
    loads: Loads | None = None,
    seed: int = 0,
    fields: Sequence[str] = (),
    chunk: int = 16_384,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: bool | Callable[[int], object] = False,
) -> Workspace:
    """Sample where the tip gets when every tendon moves within a range.

    Rows are solved by `forward_batch` in chunks, so memory holds what is returned (8 K + 50 bytes
    per sample and the further fields) and a few chunks.

    Parameters
    ----------
    robot : Robot
    ranges : array_like, shape (K, 2)
        Least and greatest displacement of each tendon [m], negative pulls. Equal ones keep a tendon
        there; (inf, inf) frees it.
    samples : int
        Rows to solve, m. Of a grid the most that fit: as many steps in every range that is not a
        point.
    sampling : {"sobol", "grid", "random"}, optional
        "sobol": a scrambled Sobol sequence, the most even, best in powers of two; needs scipy, an
        optional extra. "grid": with both ends of every range, the last tendon fastest. "random":
        uniform, independent.
    model, settings, obstacles, loads
        As for `forward_batch`.
    seed : int, optional
        Of "sobol" and "random": same seed, same rows.
    fields : sequence of str, optional
        Further columns to keep of every row: "frames", "positions", "strains", "tendon_lengths",
        "tensions", "energy".
    chunk : int, optional
        Rows solved at once. The answer does not depend on it.
    threads : int, optional
        Threads of a chunk. Default: all cores, but one with an executor.
    executor : concurrent.futures.Executor, optional
        Solves the chunks, each as a task of its own: `ProcessPoolExecutor`, dask's
        `Client.get_executor()`. Rows are equal to the bit to those solved here. A chunk that fails
        because of the executor, not of the solve, is given to it up to three times; if the executor
        is broken (a worker of a process pool died), a RuntimeWarning says so and what is left is
        solved in this process. Nothing is lost either way.
    progress : bool or callable, optional
        True draws a progress bar on a terminal; a callable gets the number of rows done.

    Returns
    -------
    Workspace
        Every row, those that did not converge with their status.

    Raises
    ------
    InvalidInput
        As `forward_batch`; ranges of another shape, NaN or the wrong way round; fewer samples than
        one, or than two steps in every range of a grid; an unknown `sampling` or field; a negative
        seed; a chunk below 1.
    TypeError
        A value of another type.
    ImportError
        "sobol" without scipy.
    Exception
        Whatever a `SignedDistance` raises, or the executor a third time for the same chunk.
    KeyboardInterrupt
        On Ctrl-C, as `forward_batch`. Chunks that an executor's workers have in work go on there:
        leaving its ``with`` waits for them, the less the smaller they are.

    Examples
    --------
    >>> import tdcr
    >>> tendons = [tdcr.Tendon(azimuth, 0.01) for azimuth in (0.0, 1.5708)]
    >>> robot = tdcr.Robot(tdcr.Backbone(0.2, 10), tendons)
    >>> found = tdcr.workspace(robot, [(-0.01, 0)] * 2, 121, sampling="grid")
    >>> found.tips.shape, round(found.reach.farthest, 6)
    ((121, 3), 0.2)
    """
    # Arguments, and the rows to solve.
    kind = _kind(sampling)
    limits = _limits(ranges, tendons_of(robot))
    count, size = whole("samples", samples, 1), whole("chunk", chunk, 1)
    obstacles = several_obstacles(obstacles)
    names = _names(fields)
    seed = whole("seed", seed, 0)
    rows = _rows(limits, count, kind, seed)
    solver = Solver(robot, model, settings, obstacles, loads, names, threads)
    # No row: settings, model and fields are checked before anything is solved or sent.
    columns = {
        name: np.empty((len(rows), *column.shape[1:]), column.dtype)
        for name, column in solver(rows[:0]).items()
    }
    # Pieces, in the order in which they are done.
    done = 0
    with progress_callback(progress, "workspace", len(rows)) as tell:

        def keep(start: int, piece: dict[str, NDArray[Any]]) -> None:
            nonlocal done
            for name, column in piece.items():
                columns[name][start : start + len(column)] = column
            done += len(piece["codes"])
            if tell is not None:
                tell(done)

        spread(solver, rows, size, executor, keep)
    for array in (limits, rows, *columns.values()):
        array.flags.writeable = False
    tips, directions, codes = (columns.pop(name) for name in ("tips", "directions", "codes"))
    return Workspace(
        robot, limits, rows, tips, directions, codes, columns,
        model, settings, obstacles, loads, kind, seed,
    )  # fmt: skip


def _kind(sampling: str) -> Literal["sobol", "grid", "random"]:
    if sampling not in get_args(Sampling):
        expected = '"sobol", "grid" or "random"'
        raise InvalidInput(f"sampling: expected {expected}, got {sampling!r}", "sampling")
    return sampling  # type: ignore[return-value]


def _names(fields: Sequence[str]) -> tuple[str, ...]:
    names = (fields,) if isinstance(fields, str) else tuple(dict.fromkeys(fields))
    for name in names:
        if name not in _FIELDS:
            known = ", ".join(_FIELDS)
            raise InvalidInput(f"fields: expected names of {known}, got {name!r}", "fields")
    return names


def _limits(ranges: ArrayLike, tendons: int) -> NDArray[np.float64]:
    """Ranges as an array of their own, or say what is wrong with them."""
    limits = numbers("ranges", ranges)
    if limits.shape != (tendons, 2):
        expected = f"shape ({tendons}, 2), least and greatest displacement of each tendon"
        raise InvalidInput(f"ranges: expected {expected}, got {limits.shape}", "ranges")
    for k, (low, high) in enumerate(limits):
        free = low == high == math.inf
        if not (free or (math.isfinite(low) and math.isfinite(high) and low <= high)):
            expected = "least <= greatest, both finite, or both inf for a free tendon"
            got = f"({low}, {high}) for tendon {k}"
            raise InvalidInput(f"ranges: expected {expected}, got {got}", "ranges")
    return limits


def _rows(
    limits: NDArray[np.float64], samples: int, sampling: Sampling, seed: int
) -> NDArray[np.float64]:
    """Displacements, (m, K): those that move sampled, the others where they are kept."""
    moving = np.flatnonzero(limits[:, 0] < limits[:, 1])
    if not len(moving):
        # All samples would be the same one.
        return limits[None, :, 0].copy()
    if sampling == "grid":
        shares = _grid(len(moving), samples)
    elif sampling == "sobol":
        shares = _sobol(len(moving), samples, seed)
    else:
        shares = np.random.default_rng(seed).random((samples, len(moving)))
    rows = np.empty((len(shares), len(limits)))
    rows[:] = limits[:, 0]
    low, high = limits[moving, 0], limits[moving, 1]
    # This way round both ends are met exactly.
    rows[:, moving] = (1.0 - shares) * low + shares * high
    return rows


def _grid(dimensions: int, samples: int) -> NDArray[np.float64]:
    steps = int(samples ** (1.0 / dimensions)) + 1
    while steps**dimensions > samples:
        steps -= 1
    if steps < 2:
        expected = f"at least 2^{dimensions} for a grid over {dimensions} ranges"
        raise InvalidInput(f"samples: expected {expected}, got {samples}", "samples")
    index = np.unravel_index(np.arange(steps**dimensions), (steps,) * dimensions)
    return np.stack(index, axis=1) / (steps - 1.0)


def _sobol(dimensions: int, samples: int, seed: int) -> NDArray[np.float64]:
    try:
        from scipy.stats import qmc  # type: ignore[import-untyped, import-not-found, unused-ignore]
    except ImportError as error:
        raise ImportError(
            "Sobol samples need scipy, which is not installed: pip install tdcr[sobol]; "
            'sampling="random" and "grid" do without'
        ) from error
    engine = qmc.Sobol(dimensions, scramble=True, rng=seed)
    # The first one by itself: a first draw of another number than a power of two warns.
    first = engine.random(1)
    return np.concatenate([first, engine.random(samples - 1)]) if samples > 1 else first
