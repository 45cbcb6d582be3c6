"""Long tables of displacements, solved piece by piece: here or by an executor's workers."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tdcr._base.status import Status
from tdcr._forward.batch import forward_batch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tdcr._base.models import Settings
    from tdcr._core import Loads, Obstacle, Robot

__all__ = ["Solver", "spread"]

_CODES = {status: code for code, status in enumerate(Status)}
# Pieces in flight: enough for many workers, few enough to bound what waits in memory.
_WINDOW = 64
_TRIES = 3


@dataclass(frozen=True)
class Solver:
    """Solver of a piece; it pickles if its robot's surroundings do."""

    robot: Robot
    model: str
    settings: Settings | None
    obstacles: tuple[Obstacle, ...]
    loads: Loads | None
    fields: tuple[str, ...]
    threads: int | None

    def __call__(self, displacements: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
        """Columns of some rows: "tips", "directions", "codes" and the further fields."""
        # Schedulers hand over arrays in place of a message, aligned to bytes.
        rows = np.require(displacements, np.float64, ["C", "ALIGNED"])
        batch = forward_batch(
            self.robot,
            rows,
            model=self.model,
            settings=self.settings,
            obstacles=self.obstacles,
            loads=self.loads,
            fields=("tip", *self.fields),
            threads=self.threads,
        )
        codes = np.fromiter(map(_CODES.__getitem__, batch.status), np.uint8, len(batch))
        # Copies: views would carry whole frames through memory and to other processes.
        columns = {"tips": batch.tip[:, :3, 3].copy(), "directions": batch.tip[:, :3, 2].copy()}
        return {**columns, "codes": codes, **{name: getattr(batch, name) for name in self.fields}}

    def attempt(self, displacements: NDArray[np.float64]) -> dict[str, NDArray[Any]] | Exception:
        """Return errors of the solve as values: what a future raises is then the executor's."""
        try:
            return self(displacements)
        except Exception as error:
            return error


@dataclass(frozen=True)
class _Piece:
    start: int
    displacements: NDArray[np.float64]
    tries: int = 1


class _Workers:
    """An executor, and which of its futures solves which piece."""

    def __init__(self, executor: Executor, solver: Solver) -> None:
        self.executor, self.here = executor, solver
        # Of a machine's cores every worker has one; what is left to this process has all.
        self.away = replace(solver, threads=solver.threads or 1)
        self.running: dict[Future[Any], _Piece] = {}
        self.broken = False

    def submit(self, piece: _Piece) -> bool:
        """Give a piece to the workers, if there are any left."""
        if not self.broken:
            try:
                future = self.executor.submit(self.away.attempt, piece.displacements)
            except BrokenExecutor as error:
                self.lose(error)
            else:
                self.running[future] = piece
        return not self.broken

    def lose(self, error: BaseException) -> None:
        if not self.broken:
            message = f"executor: broken ({error}); what is left is solved in this process"
            warnings.warn(message, RuntimeWarning, stacklevel=2)
        self.broken = True

    def result(self, future: Future[Any]) -> Any:
        """Columns of a finished piece, None if it is submitted again.

        A dead worker may have broken the executor, then nobody but this process is left; or not
        (schedulers replace workers), then others try.
        """
        piece = self.running.pop(future)
        try:
            columns = future.result()
        except BrokenExecutor as error:
            self.lose(error)
            columns = self.here.attempt(piece.displacements)
        except Exception:
            if piece.tries == _TRIES:
                raise
            again = _Piece(piece.start, piece.displacements, piece.tries + 1)
            if self.submit(again):
                return None
            columns = self.here.attempt(piece.displacements)
        if isinstance(columns, Exception):
            raise columns
        if not isinstance(columns, dict):
            # Else these rows would be whatever was in memory.
            got = type(columns).__name__
            raise TypeError(f"executor: expected futures of what tasks return, got {got}")
        return columns


def spread(
    solver: Solver,
    displacements: NDArray[np.float64],
    chunk: int,
    executor: Executor | None,
    keep: Callable[[int, dict[str, NDArray[Any]]], None],
) -> None:
    """Solve all rows in pieces of `chunk` rows and hand over each with its first row.

    Pieces come in any order, each once. Errors of a solve are raised as they are.

    Raises
    ------
    TypeError
        What is no executor.
    """
    if not (executor is None or callable(getattr(executor, "submit", None))):
        got = type(executor).__name__
        raise TypeError(f"executor: expected a concurrent.futures.Executor or None, got {got}")
    starts = range(0, len(displacements), chunk)
    pieces = (_Piece(start, displacements[start : start + chunk]) for start in starts)
    if executor is None:
        for piece in pieces:
            keep(piece.start, solver(piece.displacements))
        return
    workers = _Workers(executor, solver)
    try:
        _solve_pieces(workers, pieces, keep)
    finally:
        for future in workers.running:
            future.cancel()


def _solve_pieces(
    workers: _Workers,
    pieces: Iterable[_Piece],
    keep: Callable[[int, dict[str, NDArray[Any]]], None],
) -> None:
    waiting = iter(pieces)
    while True:
        while len(workers.running) < _WINDOW and (piece := next(waiting, None)) is not None:
            if not workers.submit(piece):
                keep(piece.start, workers.here(piece.displacements))
        if not workers.running:
            return
        # The timeout lets Ctrl-C through where a wait without one does not.
        finished, _ = wait(workers.running, timeout=0.5, return_when=FIRST_COMPLETED)
        for future in finished:
            start = workers.running[future].start
            columns = workers.result(future)
            if columns is not None:
                keep(start, columns)
