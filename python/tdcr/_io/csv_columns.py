"""Tables of lengths from CSV files: columns by name, cells as metres."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import chain
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from tdcr.errors import InvalidInput

__all__ = ["LengthUnit", "Table", "length_unit", "numbered_points", "read_points", "read_table"]

LengthUnit: TypeAlias = Literal["m", "cm", "mm", "um", "in"]
StrPath: TypeAlias = str | os.PathLike[str]

# Decimal: 25.333 mm is the float 0.025333, not its neighbour 25.333 * 0.001.
_METRES = {
    "m": Decimal(1),
    "cm": Decimal("1e-2"),
    "mm": Decimal("1e-3"),
    "um": Decimal("1e-6"),
    "in": Decimal("0.0254"),
}
# With the micro sign or the Greek letter too.
_UNIT = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|[ _](m|cm|mm|[u\u00b5\u03bc]m))$")
_MICRO = str.maketrans("\u00b5\u03bc", "uu")
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Table:
    """Cells of a CSV file as text, with the lines they are on."""

    path: str
    names: tuple[str, ...]
    cells: list[list[str]]
    lines: list[int]

    def fault(self, argument: str, text: str) -> InvalidInput:
        return InvalidInput(f"{self.path}: {text}", argument)

    def chosen(self, argument: str, names: Sequence[str]) -> list[int]:
        """Find columns that are named, each once."""
        if isinstance(names, str) or not all(isinstance(name, str) for name in names):
            raise TypeError(f"{argument}: expected names of columns, got {names!r}")
        for name in names:
            if name not in self.names:
                known = ", ".join(map(repr, self.names))
                raise self.fault(argument, f"{argument}: expected columns of {known}, got {name!r}")
        if len(set(names)) < len(names):
            raise self.fault(argument, f"{argument}: expected columns once each, got {names}")
        return [self.names.index(name) for name in names]

    def unit_of(self, column: int) -> str | None:
        """Read the unit off the end of a column's name: ``x [mm]``, ``x (mm)`` or ``x_mm``."""
        found = _UNIT.match(self.names[column])
        said = found and (found[2] or found[3] or found[4])
        return said and said.strip().translate(_MICRO)

    def words(self, column: int) -> list[str]:
        """Give the words of a column's name in lower case, without its unit."""
        found = _UNIT.match(self.names[column])
        name = found[1] if found else self.names[column]
        return [word for word in re.split(r"[^a-z0-9]+", name.lower()) if word]

    def check_unit(self, columns: Sequence[int], unit: str) -> None:
        """Refuse columns whose names say another unit."""
        for column in columns:
            said = self.unit_of(column)
            if said is not None and said != unit:
                name = self.names[column]
                raise self.fault("unit", f"unit: column {name!r} says {said!r}, got {unit!r}")

    def metres(self, columns: Sequence[int], unit: str, *, free: bool = False) -> Any:
        """Cells in metres, (rows, columns): NaN where blank; where `free`, "free" is inf."""
        values = np.empty((len(self.cells), len(columns)))
        for row, (cells, line) in enumerate(zip(self.cells, self.lines, strict=True)):
            for place, column in enumerate(columns):
                text = cells[column].strip() if column < len(cells) else ""
                values[row, place] = self._cell(text, line, column, unit, free)
        return values

    def _cell(self, text: str, line: int, column: int, unit: str, free: bool) -> float:
        if re.fullmatch(r"([+-]?nan)?", text.lower()):
            return math.nan
        if free and text.lower() in ("free", "inf", "+inf"):
            return math.inf
        # Python reads 1_000 too, which no instrument writes.
        number = float(text) if _is_number(text) and "_" not in text else math.inf
        if not math.isfinite(number):
            what = "a number, inf or free" if free else "a number"
            where = f"line {line}, column {self.names[column]!r}"
            hint = "; decimals have a point" if re.fullmatch(r"[+-]?\d*,\d+", text) else ""
            raise self.fault("path", f"{where}: expected {what} [{unit}], got {text[:40]!r}{hint}")
        return float(Decimal(text) * _METRES[unit])

    @staticmethod
    def scaled(length: float, unit: str) -> float:
        """Convert a length of the file's unit to metres."""
        return float(Decimal(repr(float(length))) * _METRES[unit])


def length_unit(unit: str) -> str:
    """Check the name of a unit."""
    if not isinstance(unit, str):
        raise TypeError(f"unit: expected the name of a unit, got {type(unit).__name__}")
    if unit not in _METRES:
        expected = ", ".join(f'"{name}"' for name in _METRES)
        raise InvalidInput(f"unit: expected one of {expected}, got {unit!r}", "unit")
    return unit


def read_table(path: StrPath) -> Table:
    """Read a CSV file whose first line names the columns.

    Between cells is a comma, a semicolon or a tab, whichever the first line has most of. Empty
    lines and those that start with # are no rows. A cell in quotes may go on in the next lines.

    Raises
    ------
    InvalidInput
        No text, a first line that does not name every column once, a quote without its end.
    OSError
        The file cannot be read.
    """
    shown = os.fspath(path)
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        message = f"{shown}: not a CSV file: byte {error.start} is not UTF-8 text"
        raise InvalidInput(message, "path") from None
    numbered = list(_records(shown, text))
    if not numbered:
        raise InvalidInput(f"{shown}: expected a line with names of columns, got none", "path")
    first, cells = numbered[0]
    names = tuple(re.sub(r"\s*[\r\n]\s*", " ", name.strip()) for name in cells)
    table = Table(shown, names, [one for _, one in numbered[1:]], [i for i, _ in numbered[1:]])
    if any(_is_number(name) for name in names):
        hint = "; lines that start with # are comments" if first > 1 else ""
        expected, got = "expected names of columns in the first line", ",".join(names)[:60]
        raise table.fault("path", f"{expected}, got {got!r}{hint}")
    twice = [name for name in names if names.count(name) > 1 and name]
    if twice:
        raise table.fault("path", f"expected columns of different names, got {twice[0]!r} twice")
    for row, line in zip(table.cells, table.lines, strict=True):
        if any(cell.strip() for cell in row[len(names) :]):
            expected = f"expected {len(names)} cells, as many as names of columns"
            raise table.fault("path", f"line {line}: {expected}, got {len(row)}")
    if not table.cells:
        raise table.fault("path", "expected rows below the names of columns, got none")
    return table


def _records(shown: str, text: str) -> Iterator[tuple[int, list[str]]]:
    """Cells of every record, with the line it starts on."""
    # Not str.splitlines, which also ends lines at a form feed, as no editor does.
    lines = enumerate(re.split(r"\r\n|\r|\n", text), 1)
    between = ""
    for number, line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        between = between or max(",;\t", key=line.count)
        # Takes further lines for as long as a quote is open.
        more = (f"{one}\n" for one in chain([line], (later for _, later in lines)))
        try:
            yield number, next(csv.reader(more, delimiter=between, strict=True))
        except csv.Error as error:
            message = f"{shown}: line {number}: expected cells as of a CSV file, got {error}"
            raise InvalidInput(message, "path") from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def numbered_points(table: Table, argument: str) -> list[int]:
    """Columns of the one point of a table, or of points with numbers, in their order.

    A point is three columns whose names end in x, y and z and are else the same.
    """
    points: dict[tuple[str, ...], dict[str, int]] = {}
    for column in range(len(table.names)):
        words = table.words(column)
        if words and words[-1] in _AXES:
            points.setdefault(tuple(words[:-1]), {})[words[-1]] = column
    whole = {name: axes for name, axes in points.items() if len(axes) == 3}
    numbers = {name: re.search(r"(\d+)$", " ".join(name)) for name in whole}
    if len(whole) == 1:
        names = list(whole)
    elif whole and all(numbers.values()):
        names = sorted(whole, key=lambda name: int((numbers[name] or [0, 0])[1]))
    else:
        known = ", ".join(map(repr, table.names))
        got = "none" if not whole else "those of " + ", ".join(repr(" ".join(n)) for n in whole)
        expected = "expected columns x, y and z of one point"
        if argument == "positions":
            expected = f"positions: {expected}, or of points with numbers"
            known += "; name them"
        raise table.fault(argument, f"{expected}, got {got} among {known}")
    return [whole[name][axis] for name in names for axis in _AXES]


def read_points(path: StrPath, unit: str | None) -> tuple[Any, str]:
    """Points of a CSV file with columns x, y and z, (B, 3) [m], and the unit they were in.

    Parameters
    ----------
    path : str or os.PathLike
    unit : str or None
        None takes the one that the names of the columns say.

    Raises
    ------
    InvalidInput
        No unit, or another one than the columns say; a cell that is no number.
    """
    table = read_table(path)
    columns = numbered_points(table, "path")
    if len(columns) != 3:
        count = len(columns) // 3
        raise table.fault("path", f"expected one point per row, got columns of {count}")
    if unit is None:
        unit = table.unit_of(columns[0])
        if unit is None:
            raise table.fault("unit", "expected a unit: name the columns 'x [mm]', or give it")
    table.check_unit(columns, length_unit(unit))
    points = table.metres(columns, unit)
    gaps = np.flatnonzero(np.isnan(points).any(axis=1))
    if len(gaps):
        line = table.lines[int(gaps[0])]
        raise table.fault("path", f"line {line}: expected numbers for x, y and z, got a gap")
    return points, unit
