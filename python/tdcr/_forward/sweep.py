"""More forward solves than memory holds: solved in chunks, each written before the next one."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

import numpy as np

from tdcr._base.arguments import numbers, several_obstacles, tendons_of, whole
from tdcr._base.progress import progress_callback
from tdcr._base.status import Status
from tdcr._forward.batch import ShapeBatch, forward_batch
from tdcr._io.atomic_write import replace_file
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._base.models import Settings
    from tdcr._core import Loads, Obstacle, Robot

    Rows: TypeAlias = ArrayLike | Iterable[ArrayLike] | Callable[[int, int], ArrayLike]
    Array = NDArray[np.float64]

__all__ = ["Sweep", "sweep"]


@dataclass(frozen=True)
class Sweep:
    """File that `sweep` wrote, the number of its rows and how they ended."""

    path: str
    """The file."""
    rows: int
    """Number of its rows."""
    counts: dict[Status, int] = field(hash=False)
    """Number of rows by status, the most frequent first."""
    seconds: float
    """Time that it took, writing included [s]."""

    @property
    def converged(self) -> int:
        """Number of rows that converged."""
        return self.counts.get(Status.converged, 0)

    @property
    def ok(self) -> bool:
        """True if all rows converged."""
        return self.converged == self.rows


def sweep(
    robot: Robot,
    displacements: Rows,
    path: str | os.PathLike[str],
    *,
    fields: Sequence[str] = ("tip",),
    model: str = "rod",
    obstacles: Obstacle | Iterable[Obstacle] = (),
    loads: Loads | None = None,
    settings: Settings | None = None,
    chunk: int = 16_384,
    threads: int | None = None,
    progress: bool | Callable[[int], object] = False,
) -> Sweep:
    """Solve any number of displacements into a file, with memory for a chunk of them.

    The rows are those of `forward_batch`, equal to the bit, each with its status and in its place.
    The file appears complete or not at all: after an error or Ctrl-C there is none, or the old one.

    Parameters
    ----------
    robot : Robot
    displacements : array_like, iterable or callable
        An array (B, K) [m], as for `forward_batch`; what is on disk, as a `numpy.memmap`, is read
        chunk by chunk. Or an iterator, as a generator is, or a list of arrays: blocks (b, K) of any
        lengths. Or a function that is called with the number of rows that were taken and of those
        that are wanted next, and returns a block (b, K), one of no rows at the end.
    path : str or os.PathLike
        Replaced if it exists. Ending in .npz: all of the fields, as `ShapeBatch.save` writes them
        and `ShapeBatch.load` reads them. The length of its arrays is known at the end alone, so
        columns are gathered in a hidden folder beside it: it takes twice its size on disk on the
        way. Ending in .parquet: the table that `ShapeBatch.save` writes, a row group per chunk.
    fields : sequence of str, optional
        As for `forward_batch`; in Parquet "tip", "positions" (places alone), "tendon_lengths",
        "tensions" and "energy".
    model, obstacles, loads, settings, threads
        As for `forward_batch`.
    chunk : int, optional
        Rows solved and written at once. The rows do not depend on it.
    progress : bool or callable, optional
        True draws a progress bar on a terminal, without an end where the number of rows is not
        known; a callable gets the number of rows done about every 50 ms.

    Returns
    -------
    Sweep
        How many rows the file has and how they ended.

    Raises
    ------
    InvalidInput
        As `forward_batch`, of displacements when their chunk is reached; another file ending, a
        field that a Parquet file does not hold, a chunk below 1; a `SignedDistance` for .npz,
        whose functions no file holds.
    TypeError
        A value of another type.
    ImportError
        .parquet without pyarrow, an optional extra: ``pip install tdcr[parquet]``.
    OSError
        The file cannot be written.
    KeyboardInterrupt
        On Ctrl-C, as `forward_batch`.
    Exception
        Whatever the iterator or the function raises, or the one of a `SignedDistance`.

    Examples
    --------
    >>> import numpy as np, os, tdcr, tempfile
    >>> robot = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(0.0, 0.01)])
    >>> blocks = (np.full((50, 1), -1e-3 * pull) for pull in range(4))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = tdcr.sweep(robot, blocks, os.path.join(folder, "pulls.npz"))
    ...     done.rows, done.converged, tdcr.ShapeBatch.load(done.path).tip.shape
    (200, 200, (200, 4, 4))
    """
    from tdcr._forward.sweep_files import writer_of

    start, size = perf_counter(), whole("chunk", chunk, 1)
    writer = writer_of(path)
    # Once: every chunk is solved among them.
    obstacles = several_obstacles(obstacles)

    def solve(rows: Array, tell: Callable[[int], object] | None = None) -> ShapeBatch:
        return forward_batch(
            robot, rows, model=model, obstacles=obstacles, loads=loads, settings=settings,
            fields=fields, threads=threads, progress=tell or False,
        )  # fmt: skip

    tendons = tendons_of(robot)
    # No row: everything but the displacements is checked before a file is begun.
    blank = solve(np.empty((0, tendons)))
    columns = writer(path, blank)
    given, total = _blocks(displacements, tendons, size)
    counts: Counter[Status] = Counter()

    def write(stream: Any) -> None:
        done = 0
        with progress_callback(progress, "sweep", total) as tell, columns.into(stream) as keep:
            for rows in _cut(given, size):
                with _faults_in(done, len(rows)):
                    batch = solve(rows, _after(done, tell))
                keep(done, batch)
                counts.update(batch.status.tolist())
                done += len(rows)
                if tell is not None:
                    tell(done)

    replace_file(path, write)
    ended = dict(counts.most_common())
    return Sweep(os.fspath(path), counts.total(), ended, perf_counter() - start)


def _blocks(displacements: Any, tendons: int, size: int) -> tuple[Iterator[Array], int | None]:
    """Blocks of rows in their order, and how many rows they have if that is known."""
    if callable(displacements):
        return _call_blocks(displacements, tendons, size), None
    if isinstance(displacements, Sequence):
        blocks = len(displacements) and getattr(displacements[0], "ndim", 0) == 2
        displacements = iter(displacements) if blocks else numbers("displacements", displacements)
    if hasattr(displacements, "shape"):
        if len(displacements.shape) != 2 or displacements.shape[1] != tendons:
            _refuse("displacements", tendons, displacements.shape)
        starts = range(0, len(displacements), size)
        parts = (displacements[start : start + size] for start in starts)
        return (_block("displacements", one, tendons) for one in parts), len(displacements)
    if isinstance(displacements, Iterable):
        named = enumerate(displacements)
        return (_block(f"displacements: block {i}", one, tendons) for i, one in named), None
    expected = "an array, an iterator over blocks of rows or a function that gives them"
    got = type(displacements).__name__
    raise TypeError(f"displacements: expected {expected}, got {got}")


def _call_blocks(give: Callable[[int, int], Any], tendons: int, size: int) -> Iterator[Array]:
    taken = 0
    name = "displacements: what the function gives"
    while len(block := _block(name, give(taken, size), tendons)):
        yield block
        taken += len(block)


def _block(name: str, value: Any, tendons: int) -> Array:
    """Rows as an array of their own: what is given may be filled anew for the next ones."""
    try:
        rows = numbers(name, value)
    except InvalidInput as error:
        raise InvalidInput(str(error), "displacements") from None
    if rows.ndim != 2 or rows.shape[1] != tendons:
        _refuse(name, tendons, rows.shape)
    return rows


def _refuse(name: str, tendons: int, shape: tuple[int, ...]) -> NoReturn:
    expected = f"shape (B, {tendons}), one column per tendon"
    raise InvalidInput(f"{name}: expected {expected}, got shape {tuple(shape)}", "displacements")


def _cut(blocks: Iterable[Array], size: int) -> Iterator[Array]:
    """Blocks of `size` rows out of those of any lengths; the last one may be shorter."""
    held: list[Array] = []
    count = 0
    for block in blocks:
        rest = block
        while count + len(rest) >= size:
            first, rest = np.split(rest, [size - count])
            yield np.concatenate([*held, first])
            held, count = [], 0
        if len(rest):
            held.append(rest)
            count += len(rest)
    if held:
        yield np.concatenate(held)


@contextmanager
def _faults_in(start: int, count: int) -> Iterator[None]:
    """Tell of which rows a chunk's fault is: the core counts from the chunk's first."""
    try:
        yield
    except InvalidInput as error:
        if error.argument != "displacements":
            raise
        text = str(error).removeprefix("displacements: ")
        where = f"displacements[{start}:{start + count}]"
        raise InvalidInput(f"{where}: {text}", "displacements") from None


def _after(done: int, tell: Callable[[int], object] | None) -> Callable[[int], object] | None:
    return None if tell is None else (lambda more: tell(done + more))
