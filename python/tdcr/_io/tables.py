"""Results as tables for other programs: CSV and Parquet, with the units in the names of columns."""

from __future__ import annotations

import csv
import io
import json
import os
from typing import Any

import numpy as np

from tdcr._core import Robot
from tdcr._io.atomic_write import replace_file
from tdcr._io.codecs import Columns, codec_of
from tdcr._io.result_file import check_header
from tdcr._io.text_file import StrPath
from tdcr.errors import InvalidInput

__all__ = [
    "AXES",
    "force_unit",
    "parquet_header",
    "point_columns",
    "read_parquet",
    "require_pyarrow",
    "row_columns",
    "tendon_columns",
    "write_csv",
    "write_parquet",
]

AXES = ("x", "y", "z")


def row_columns(result: Any) -> Columns:
    """Columns that every table of rows begins with."""
    status = np.array([str(one) for one in result.status], dtype=np.str_)
    return {"row": np.arange(len(result)), "status": status}


def force_unit(robot: Robot) -> str:
    """Give the unit of a robot's tensions."""
    return "N" if robot.backbone.youngs_modulus and robot.backbone.diameter else "1/m^2"


def point_columns(name: str, points: Any, unit: str | None = "m") -> Columns:
    """Columns of x, y and z."""
    end = f" [{unit}]" if unit else ""
    return {f"{name}{axis}{end}": points[:, i] for i, axis in enumerate(AXES)}


def tendon_columns(name: str, tendons: tuple[str, ...], values: Any, unit: str) -> Columns:
    """Column of each tendon."""
    return {f"{name} {tendon} [{unit}]": values[:, k] for k, tendon in enumerate(tendons)}


def write_csv(path: StrPath, result: Any) -> None:
    """Write the table of a result, numbers in full."""
    codec = codec_of(result)
    if codec.columns is None:
        article = "an" if codec.kind[0] in "AEIOU" else "a"
        raise InvalidInput(
            f"path: expected .npz or .json for {article} {codec.kind}, got {os.fspath(path)!r}"
            f"{codec.instead}",
            "path",
        )
    columns = codec.columns(result)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    replace_file(path, lambda stream: stream.write(text.getvalue().encode()))


def require_pyarrow() -> Any:
    """Import pyarrow, or say how to get it."""
    try:
        import pyarrow  # type: ignore[import-untyped, import-not-found, unused-ignore]
        import pyarrow.parquet  # type: ignore[import-untyped, import-not-found, unused-ignore]
    except ImportError as error:
        raise ImportError(
            "Parquet files need pyarrow, which is not installed: pip install tdcr[parquet]"
        ) from error
    return pyarrow


def write_parquet(path: StrPath, result: Any) -> None:
    """Write the rows of a result, with the rest of it where its codec packs that."""
    codec = codec_of(result)
    if codec.columns is None or not codec.has_rows:
        message = f"path: expected no .parquet for {codec.kind}, which is no table of rows"
        raise InvalidInput(f"{message}, got {os.fspath(path)!r}", "path")
    arrow = require_pyarrow()
    columns = {name: arrow.array(column) for name, column in codec.columns(result).items()}
    more, metadata = codec.pack(result, arrow) if codec.pack else ({}, {})
    table = arrow.table(columns | more).replace_schema_metadata(metadata)
    replace_file(
        path, lambda stream: arrow.parquet.write_table(table, stream, write_page_checksum=True)
    )


def read_parquet(path: StrPath) -> Any:
    """Table of a Parquet file."""
    arrow = require_pyarrow()
    with open(path, "rb") as stream:
        try:
            return arrow.parquet.read_table(stream, page_checksum_verification=True)
        except (arrow.ArrowException, OSError) as error:
            fault = " ".join(str(error).split())
            message = f"not a Parquet file, or one that is cut off or damaged: {fault}"
            raise InvalidInput(f"{os.fspath(path)}: {message}", "path") from None


def parquet_header(path: StrPath, table: Any, kind: str) -> dict[str, Any]:
    """Fields of a result that are no columns of its Parquet file."""
    shown = os.fspath(path)
    own = (table.schema.metadata or {}).get(b"tdcr")
    if own is None:
        message = f"{shown}: expected the Parquet file of a {kind}, got one of something else"
        raise InvalidInput(message, "path")
    try:
        data = json.loads(own)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{shown}: header: not JSON: {error}", "header") from None
    return check_header(path, data, kind)
