"""Many forward solves at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence, Sized
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._base.arguments import several_obstacles
from tdcr._base.progress import told
from tdcr._base.value import Value, same

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import (
        ConstantCurvatureSettings,
        LinkageSettings,
        Loads,
        Obstacle,
        Robot,
        RodSettings,
        Shape,
    )

    Settings: TypeAlias = RodSettings | LinkageSettings | ConstantCurvatureSettings

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


class ShapeBatch(Sequence["Shape"]):
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
        displacements: NDArray[np.float64],
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
    displacements: NDArray[np.float64]
    model: str
    settings: Settings | None
    warm: bool
    obstacles: tuple[Obstacle, ...]
    loads: Loads | None
    _columns: dict[str, Any]

    # From a pickle or a copy, with arrays that stay read-only.
    __setstate__ = Value.__setstate__

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse: a result does not change."""
        raise AttributeError(f"{name}: a ShapeBatch cannot be changed")

    def __delattr__(self, name: str) -> None:
        """Refuse: a result does not change."""
        raise AttributeError(f"{name}: a ShapeBatch cannot be changed")

    def __getattr__(self, name: str) -> Any:
        """Return a computed field; tell how to get one that was not asked for."""
        # Through __dict__: while a pickle is being read there is no _columns yet.
        columns = self.__dict__.get("_columns", {})
        if name in columns:
            return columns[name]
        if name in FIELDS:
            raise AttributeError(
                f"{name}: not computed; ask for it with forward_batch(..., "
                f"fields={(*self.fields, name)!r})"
            )
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        """List the computed fields too."""
        return sorted({*super().__dir__(), *self._columns})

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

    def save(self, path: str | PathLike[str]) -> None:
        """Write the batch into a file that appears complete or not at all.

        Parameters
        ----------
        path : str or os.PathLike
            Ending in .npz or .json, which `load` reads back equal;
            or in .csv or .parquet, for other programs: displacements and computed fields by row,
            but for rotations, strains, holes and contacts. Replaced if it exists.

        Raises
        ------
        InvalidInput
            Another file ending; a `SignedDistance` among the obstacles, whose
            functions no file holds.
        ImportError
            .parquet without pyarrow, an optional extra: ``pip install tdcr[parquet]``.
        OSError
            The file cannot be written.
        """
        from tdcr._io.save_load import save

        save(self, path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> ShapeBatch:
        """Read a batch that `save` wrote. No code of a file is run.

        Parameters
        ----------
        path : str or os.PathLike
            File ending in .npz or .json.

        Raises
        ------
        InvalidInput
            Another file: names path and field, what was expected and what was there.
        OSError
            The file cannot be read.
        """
        from tdcr._io.save_load import load

        loaded: ShapeBatch = load(path, "ShapeBatch")
        return loaded

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
    with told(progress, "forward_batch", total) as tell:
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
