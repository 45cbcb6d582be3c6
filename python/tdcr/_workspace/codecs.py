"""Codec of workspaces; their Parquet files load again."""

from __future__ import annotations

import math
import os
from dataclasses import fields
from typing import Any

import numpy as np

from tdcr._base.status import Status
from tdcr._forward.codecs import column
from tdcr._io.codecs import Columns, Readers, register, value_codec
from tdcr._io.field_reader import FieldReader
from tdcr._io.plain_data import to_plain
from tdcr._io.result_file import header_text
from tdcr._io.tables import (
    AXES,
    parquet_header,
    point_columns,
    require_pyarrow,
    row_columns,
    tendon_columns,
)
from tdcr._workspace.results import Workspace
from tdcr.errors import InvalidInput

# Fields that are columns of a Parquet file.
_ROWS = ("displacements", "tips", "directions", "codes", "values")


def _codes(reader: FieldReader, name: str) -> Any:
    codes = reader.array(name, "B", dtype=np.uint8)
    if codes.size and codes.max() >= len(Status):
        raise reader.fault(name, f"expected places below {len(Status)}, got {codes.max()}")
    return codes


def _values(reader: FieldReader, name: str) -> dict[str, Any]:
    values, settings = reader.get(name), reader.settings()
    if not isinstance(values, dict):
        raise reader.fault(name, f"expected columns by name, got {values!r}"[:200])
    return {name: column(reader, name, value, settings) for name, value in values.items()}


_READERS: Readers = {
    "robot": FieldReader.robot,
    "ranges": lambda r, name: r.array(name, "K", 2),
    "displacements": lambda r, name: r.array(name, "B", "K"),
    "tips": lambda r, name: r.array(name, "B", 3),
    "directions": lambda r, name: r.array(name, "B", 3),
    "codes": _codes,
    "values": _values,
    "model": FieldReader.model,
    "settings": FieldReader.settings,
    "obstacles": FieldReader.objects,
    "loads": lambda r, name: r.optional(name, ("Loads",)),
    "sampling": lambda r, name: r.text(name, "sobol", "grid", "random"),
    "seed": lambda r, name: r.whole(name, math.inf),
}


def _columns(found: Workspace) -> Columns:
    """Table of the samples, a row each."""
    return {
        **row_columns(found),
        **tendon_columns("displacement", found.robot.tendon_names, found.displacements, "m"),
        **point_columns("tip ", found.tips),
        **point_columns("direction ", found.directions, None),
    }


def _pack(found: Workspace, arrow: Any) -> tuple[Columns, dict[str, str]]:
    """Further fields as columns of lists, and the rest as the metadata of a Parquet file."""
    names = [field.name for field in fields(found) if field.name not in _ROWS]
    header = {name: to_plain(getattr(found, name), name) for name in names}
    header["values"] = {name: list(column.shape) for name, column in found.values.items()}
    columns: Columns = {}
    for name, values in found.values.items():
        width = math.prod(values.shape[1:])
        if width:  # None of a robot without tendons; lists of nothing there are not.
            flat = arrow.array(values.ravel())
            columns[name] = arrow.FixedSizeListArray.from_arrays(flat, width)
    return columns, {"tdcr": header_text("Workspace", header)}


def _unpack(path: Any, table: Any) -> dict[str, Any]:
    """Fields of a workspace from the table and the metadata of its Parquet file."""
    from tdcr._io.robot_tables import build_robot

    shown, arrow = os.fspath(path), require_pyarrow()
    # Fields of the header, with the shapes of further columns.
    header = parquet_header(path, table, "Workspace")
    if not isinstance(header.get("values"), dict):
        expected = f"{shown}: values: expected shapes by name"
        raise InvalidInput(f"{expected}, got {header.get('values')!r}"[:500], "values")

    def column(name: str) -> Any:
        if name not in table.column_names:
            raise InvalidInput(f"{shown}: {name}: the column is missing", name)
        return table[name].combine_chunks()

    def stack(*names: str) -> Any:
        columns = [column(name).to_numpy(zero_copy_only=False) for name in names]
        return np.column_stack(columns) if columns else np.empty((table.num_rows, 0))

    def unfold(name: str, sizes: Any) -> Any:
        inner = _inner_sizes(shown, name, sizes)
        if not math.prod(inner):
            return np.empty((table.num_rows, *inner))
        lists = column(name)
        flat = lists.flatten() if arrow.types.is_fixed_size_list(lists.type) else lists
        if len(flat) != table.num_rows * math.prod(inner):
            expected = f"{table.num_rows} lists of {math.prod(inner)} numbers"
            raise InvalidInput(f"{shown}: {name}: expected {expected}, got {lists.type}", name)
        return flat.to_numpy(zero_copy_only=False).reshape(table.num_rows, *inner)

    # By name: other programs may have put the columns into another order.
    tendons = build_robot(f"{shown}: robot", header.get("robot")).tendon_names
    places = {str(status): code for code, status in enumerate(Status)}
    words = stack("status")[:, 0].tolist()
    codes = [places.get(word, len(places)) for word in words]
    return header | {
        "displacements": stack(*(f"displacement {name} [m]" for name in tendons)),
        "tips": stack(*(f"tip {axis} [m]" for axis in AXES)),
        "directions": stack(*(f"direction {axis}" for axis in AXES)),
        "codes": np.array(codes, np.uint8),
        "values": {name: unfold(name, sizes) for name, sizes in header["values"].items()},
    }


def _inner_sizes(shown: str, name: str, sizes: Any) -> list[int]:
    """Shape of a row of a further column."""
    whole = isinstance(sizes, list) and all(type(size) is int and size >= 0 for size in sizes)
    if not whole or not sizes:
        raise InvalidInput(f"{shown}: {name}: expected a shape, got {sizes!r}"[:500], name)
    return list(sizes[1:])


register(
    value_codec(Workspace, _READERS, columns=_columns, has_rows=True, pack=_pack, unpack=_unpack)
)
