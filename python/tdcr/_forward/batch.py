"""Many forward solves at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence, Sized
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._base.arguments import several_obstacles
from tdcr._base.progress import progress_callback
from tdcr._base.value import Value, same
from tdcr._io.save_load import Saved

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._base.models import Settings
    from tdcr._core import (
        Loads,
        Obstacle,
        Robot,
        Shape,
    )

    Floats: TypeAlias = NDArray[np.float64]

__all__ = ["ShapeBatch", "forward_batch"]

FIELDS = _core._fields()

CONTACT = np.dtype(
    [
        ("row", np.int64),
        ("disk", np.int64),
        ("kind", "U6"),
        ("tendon", np.int64),
        ("obstacle", np.int64),
        ("point", np.float64, 3),
        ("normal", np.float64, 3),
        ("gap", np.float64),
        ("force", np.float64, 3),
    ]
)


class _Column:
    """Column of a batch that is there if it was computed; else reading it says how to get it."""

    def __set_name__(self, owner: type[object], name: str) -> None:
        self.name = name

    def __get__(self, batch: ShapeBatch | None, owner: type[object]) -> Any:
        if batch is None:
            return self
        # Through __dict__: while a pickle is being read there is no _columns yet.
        columns = batch.__dict__.get("_columns", {})
        if self.name in columns:
            return columns[self.name]
        raise AttributeError(
            f"{self.name}: not computed; ask for it with forward_batch(..., "
            f"fields={(*batch.fields, self.name)!r})"
        )


def _column() -> Any:
    """Give a column under the type that its annotation says."""
    return _Column()


class ShapeBatch(Saved, Sequence["Shape"]):
    """Shapes of one robot under many displacements, in the order of the rows.

    The fields asked for are attributes, and so are `status` (B,), `ok` (B,), `residual` (B,) and
    `iterations` (B,); reading a field that was not asked for raises. `batch[i]` is a `Shape`,
    solved anew from its row: the same to the bit. Of a warm batch that takes the rows of its block
    up to it, 64 at most.

    Attributes
    ----------
    robot : Robot
    displacements : ndarray, shape (B, K)
        Negative pulls [m].
    model : str
    settings : RodSettings, LinkageSettings or ConstantCurvatureSettings or None
    obstacles : tuple of Obstacle
    loads : Loads or None
    warm : bool
        Whether rows started from the row before.
    fields : tuple of str
        Names of the fields that were asked for.
    tip : ndarray, shape (B, 4, 4)
        Frame of the tip disk in the world.
    frames : ndarray, shape (B, n + 1, 4, 4)
        Frame of every disk.
    positions : ndarray, shape (B, n + 1, 3)
        Centre of every disk [m].
    strains : ndarray, shape (B, n, 3)
        Rotation vector of every element [rad]; (B, n, 4) with the elongation in extensible models.
        A rod of m elements per subsegment has n m of them.
    tendon_points : list of ndarray, shape (B, end + 1, 3)
        Holes of every tendon [m].
    tendon_lengths : ndarray, shape (B, K)
        [m].
    tensions : ndarray, shape (B, K)
        As in `Shape`.
    energy : ndarray, shape (B,)
        As in `Shape`.
    contacts : structured ndarray, one record per contact
        Columns "row", in ascending order, and those of `Contact`: "disk", "kind", "tendon" (-1
        where there is none), "obstacle", "point" [m], "normal", "gap" [m], "force".
    status : ndarray of Status, shape (B,)
    ok : ndarray of bool, shape (B,)
        Whether the row converged.
    """

    def __init__(
        self,
        robot: Robot,
        displacements: Floats,
        model: str,
        settings: Settings | None,
        columns: dict[str, Any],
        warm: bool = False,
        obstacles: tuple[Obstacle, ...] = (),
        loads: Loads | None = None,
    ) -> None:
        self.__dict__.update(
            robot=robot,
            displacements=displacements,
            model=model,
            settings=settings,
            warm=warm,
            obstacles=obstacles,
            loads=loads,
            _columns=columns,
        )

    robot: Robot
    displacements: Floats
    model: str
    settings: Settings | None
    warm: bool
    obstacles: tuple[Obstacle, ...]
    loads: Loads | None
    _columns: dict[str, Any]

    tip: Floats = _column()
    frames: Floats = _column()
    positions: Floats = _column()
    strains: Floats = _column()
    tendon_points: list[Floats] = _column()
    tendon_lengths: Floats = _column()
    tensions: Floats = _column()
    energy: Floats = _column()
    contacts: NDArray[np.void] = _column()
    status: NDArray[np.object_] = _column()
    ok: NDArray[np.bool_] = _column()
    residual: Floats = _column()
    iterations: NDArray[np.uint64] = _column()

    # From a pickle or a copy, with arrays that stay read-only.
    __setstate__ = Value.__setstate__

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse: a result does not change."""
        raise AttributeError(f"{name}: a ShapeBatch cannot be changed")

    def __delattr__(self, name: str) -> None:
        """Refuse: a result does not change."""
        raise AttributeError(f"{name}: a ShapeBatch cannot be changed")

    def __dir__(self) -> list[str]:
        """List the computed fields alone."""
        return sorted({*super().__dir__()} - ({*FIELDS} - {*self._columns}))

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that were asked for."""
        return tuple(name for name in FIELDS if name in self._columns)

    def __eq__(self, other: object) -> bool:
        """Compare by value: robot, rows, model, settings, surroundings, starts, computed fields."""
        if not isinstance(other, ShapeBatch):
            return NotImplemented
        return (
            (self.robot, self.model, self.settings) == (other.robot, other.model, other.settings)
            and (self.warm, self.loads) == (other.warm, other.loads)
            and self.obstacles == other.obstacles
            and np.array_equal(self.displacements, other.displacements)
            and self._columns.keys() == other._columns.keys()
            and all(same(mine, other._columns[name]) for name, mine in self._columns.items())
        )

    def __hash__(self) -> int:
        """Hash by robot and rows."""
        return hash((self.robot, self.model, self.displacements.tobytes()))

    def __len__(self) -> int:
        """Return the number of rows B."""
        return len(self.displacements)

    def __getitem__(self, index: Any) -> Any:
        """Return the shape of one row, or a list of shapes for a slice."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        row = range(len(self))[index]
        settings: Any = self.settings
        around: dict[str, Any] = {"obstacles": self.obstacles, "loads": self.loads}
        if self.warm:
            return _core._chained_shape(self.robot, self.displacements, row, settings, **around)
        own = self.displacements[row]
        return _core.forward(self.robot, own, model=self.model, settings=settings, **around)

    def __repr__(self) -> str:
        """Tell size, outcome and fields."""
        converged = int(np.count_nonzero(self._columns["ok"]))
        return (
            f"<ShapeBatch of {len(self)} rows, {converged} converged: "
            f"fields {', '.join(self.fields) or 'none'}, model {self.model!r}>"
        )


def forward_batch(
    robot: Robot,
    displacements: ArrayLike,
    *,
    model: str = "rod",
    obstacles: Obstacle | Iterable[Obstacle] = (),
    loads: Loads | None = None,
    settings: Settings | None = None,
    fields: Sequence[str] = ("tip",),
    warm: bool = False,
    threads: int | None = None,
    progress: bool | Callable[[int], object] = False,
) -> ShapeBatch:
    """Solve many displacements on all cores, with the GIL released.

    Python functions of a `SignedDistance` take the GIL whenever they are called.

    Parameters
    ----------
    robot : Robot
    displacements : array_like, shape (B, K)
        One row per solve, as for `forward` [m].
    model, obstacles, loads, settings
        As for `forward`.
    fields : sequence of str, optional
        What to compute of "tip", "frames", "positions", "strains", "tendon_points",
        "tendon_lengths", "tensions", "energy", "contacts". Status, residual and iterations always
        are.
    warm : bool, optional
        Whether a row starts from the solution of the row before, not from rest: faster where
        neighbours are alike, as on a path. Model "rod" only. The first row of every 64 starts from
        rest, and so does one after a row that failed or had other tendons free. Where several
        shapes are stable under the same displacements, it may be another one than from rest.
    threads : int, optional
        Default: all cores. The answer does not depend on it.
    progress : bool or callable, optional
        True draws a progress bar on a terminal; a callable gets the number of rows done about every
        50 ms.

    Returns
    -------
    ShapeBatch
        Every row in its place; one that did not converge has its status.

    Raises
    ------
    InvalidInput
        As `forward`, before any row is solved and naming the row; an unknown field, a number of
        threads below 1, `warm` with another model than the rod.
    KeyboardInterrupt
        On Ctrl-C, within about 0.1 s; among obstacles when the rows in work are done.
    Exception
        Whatever the function of a `SignedDistance` raises.
    """
    if isinstance(fields, str):
        fields = (fields,)
    # Once: each row's shape is made of them again.
    obstacles = several_obstacles(obstacles)
    total = len(displacements) if isinstance(displacements, Sized) else None
    with progress_callback(progress, "forward_batch", total) as tell:
        columns = _core._forward_batch(
            robot,
            displacements,
            model=model,
            obstacles=obstacles,
            loads=loads,
            settings=settings,
            fields=list(fields),
            threads=threads,
            progress=tell,
            warm=warm,
        )
    # Records of contacts; the rows are the result's own.
    if "contacts" in columns:
        columns["contacts"] = _table(columns["contacts"])
    given = columns.pop("displacements")
    return ShapeBatch(robot, given, model, settings, columns, warm, obstacles, loads)


def _table(columns: dict[str, Any]) -> NDArray[np.void]:
    """Make records of the columns of contacts."""
    table = np.empty(len(columns["row"]), CONTACT)
    for name, values in columns.items():
        table[name] = values
    table.flags.writeable = False
    return table
