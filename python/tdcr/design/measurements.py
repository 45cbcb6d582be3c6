"""Measured displacements and positions, from tables of others."""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from tdcr._base.arguments import number
from tdcr._base.value import Value
from tdcr._io.csv_columns import LengthUnit, Table, length_unit, numbered_points, read_table
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Measurements", "read_measurements"]

# First words of columns that hold displacements, and words of those that hold something else.
_DISPLACEMENT = re.compile(r"(d|dl|displacement|pull|tendon)\d*")
_OTHER = {"tension", "force", "torque", "current", "x", "y", "z"}


@dataclass(frozen=True, eq=False, repr=False)
class Measurements(Value):
    """Displacements of tendons and where they brought the robot, in SI. Arrays are read-only."""

    displacements: NDArray[np.float64]
    """(B, K) [m]: negative pulls, `inf` is free."""
    positions: NDArray[np.float64]
    """Positions of one point, (B, 3), or of several, (B, points, 3) [m]."""
    lines: NDArray[np.int64]
    """Line of the file that each row is on, from 1, (B,)."""
    dropped: int
    """Rows left out for a blank or NaN."""
    displacement_columns: tuple[str, ...]
    """Names of the columns that were read as displacements, (K,)."""
    position_columns: tuple[str, ...]
    """Names of the columns that were read as positions, x, y, z of each point."""

    _hashed: ClassVar[tuple[str, ...]] = ("displacements", "positions")

    def __len__(self) -> int:
        """Return the number of rows B."""
        return len(self.displacements)

    def __repr__(self) -> str:
        """Tell sizes and columns."""
        count = self.displacements.shape[1]
        points = len(self.position_columns) // 3
        return (
            f"<Measurements of {len(self)} rows, {self.dropped} dropped: {count} displacements "
            f"({', '.join(self.displacement_columns)}), {points} point{'s' * (points != 1)} "
            f"({', '.join(self.position_columns[:3])}{', ...' * (points > 1)})>"
        )


def read_measurements(
    path: str | os.PathLike[str],
    *,
    unit: LengthUnit,
    pull_sign: Literal["positive", "negative"],
    displacements: Sequence[str] | None = None,
    positions: Sequence[str] | None = None,
    free_from: float | None = None,
) -> Measurements:
    """Read measured displacements and positions from a CSV file, for `design.fit`.

    The first line names the columns; between cells is a comma, a semicolon or a tab; decimals have
    a point. Empty lines are skipped, lines that start with # are comments. Rows with a blank or NaN
    in a column that is read are dropped and counted. Columns that are not named are found by their
    names, in lower case and without a unit at the end (``x [mm]``, ``x (mm)``, ``x_mm``), cut into
    words at what is no letter or digit:

    - displacements: the first word is d, dl, displacement, pull or tendon, with or without a
      number, and no word is tension, force, torque, current, x, y or z; in the order of the file;
    - positions: three columns that end in x, y and z and are else the same make a point. There is
      one such point, or the names of all end in a number, which is their order.

    Parameters
    ----------
    path : str or os.PathLike
    unit : {"m", "cm", "mm", "um", "in"}
        Unit of all lengths in the file. Columns whose names say another one are refused ("µm" is
        "um").
    pull_sign : {"positive", "negative"}
        Sign that a pull has in the file. What is read has negative pulls. A RuntimeWarning tells
        where there are releases and no pull at all, as with the wrong sign.
    displacements : sequence of str, optional
        Names of the columns with displacements, in the order of the robot's tendons.
    positions : sequence of str, optional
        Names of the columns with x, y, z of the tip, or of every disk, the base first.
    free_from : float, optional
        Tendons released by this much or more are slack, and read as free (`inf`) [unit]. So are
        cells that say "free" or "inf".

    Returns
    -------
    Measurements

    Raises
    ------
    InvalidInput
        A sign that is none, a unit that is none or that the columns contradict; columns that are
        not there, not found, or of both; a cell that is no number; no row without gaps. Names path
        and line.
    TypeError
        A value of another type.
    OSError
        The file cannot be read.
    """
    length_unit(unit)
    if pull_sign not in ("positive", "negative"):
        expected = '"positive" or "negative"'
        raise InvalidInput(f"pull_sign: expected {expected}, got {pull_sign!r}", "pull_sign")
    if free_from is not None and not 0 < number("free_from", free_from) < math.inf:
        message = f"free_from: expected a positive length [{unit}], got {free_from!r}"
        raise InvalidInput(message, "free_from")
    table = read_table(path)
    pulled = _displacements(table, displacements)
    placed = _positions(table, positions)
    both = [table.names[column] for column in pulled if column in placed]
    if both:
        expected = "positions: expected other columns than those of displacements"
        raise table.fault("positions", f"{expected}, got {both[0]!r} in both")
    table.check_unit([*pulled, *placed], unit)
    rows = table.metres(pulled, unit, free=True)
    # 0 - x, not -x: no negative zeros.
    rows = np.where(np.isinf(rows), np.inf, 0.0 - rows if pull_sign == "positive" else rows)
    if free_from is not None:
        rows[rows >= table.scaled(free_from, unit)] = np.inf
    points = table.metres(placed, unit)
    _check_pulls(table.path, rows, pull_sign)
    full = ~(np.isnan(rows).any(axis=1) | np.isnan(points).any(axis=1))
    if not full.any():
        raise table.fault("path", f"expected a row without gaps, got none in {len(full)}")
    points = points[full]
    answer = (
        rows[full],
        points if len(placed) == 3 else points.reshape(len(points), -1, 3),
        np.array(table.lines)[full],
    )
    for array in answer:
        array.flags.writeable = False
    return Measurements(
        *answer,
        dropped=int(np.count_nonzero(~full)),
        displacement_columns=tuple(table.names[column] for column in pulled),
        position_columns=tuple(table.names[column] for column in placed),
    )


def _check_pulls(path: str, rows: NDArray[np.float64], pull_sign: str) -> None:
    """Warn where tendons are released, but none is ever pulled."""
    finite = rows[np.isfinite(rows)]
    if (finite > 0).any() and not (finite < 0).any():
        message = f"{path}: no row pulls a tendon if pulls are {pull_sign}: is it the other sign?"
        warnings.warn(message, RuntimeWarning, stacklevel=3)


def _displacements(table: Table, names: Sequence[str] | None) -> list[int]:
    if names is not None:
        chosen = table.chosen("displacements", names)
        if not chosen:
            raise table.fault("displacements", "displacements: expected columns, got none")
        return chosen
    found = []
    for column in range(len(table.names)):
        words = table.words(column)
        if words and _DISPLACEMENT.fullmatch(words[0]) and not _OTHER & set(words):
            found.append(column)
    if not found:
        known = ", ".join(map(repr, table.names))
        expected = "displacements: expected columns that start with d, dl, displacement, pull or"
        raise table.fault("displacements", f"{expected} tendon, got {known}; name them")
    return found


def _positions(table: Table, names: Sequence[str] | None) -> list[int]:
    if names is None:
        return numbered_points(table, "positions")
    columns = table.chosen("positions", names)
    if not columns or len(columns) % 3:
        expected = "positions: expected columns x, y, z of every point"
        raise table.fault("positions", f"{expected}, got {len(columns)} of them")
    return columns
