"""Results as tables for other programs: CSV and Parquet, with the units in the names of columns."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from typing import Any, TypeAlias

import numpy as np

from tdcr._core import Robot, Shape
from tdcr._io.atomic_write import replace_file
from tdcr._io.plain_data import described
from tdcr._io.result_file import check_header, header_text
from tdcr.errors import InvalidInput

__all__ = ["read_parquet", "require_pyarrow", "write_csv", "write_parquet"]

StrPath: TypeAlias = str | os.PathLike[str]
Columns: TypeAlias = dict[str, Any]

_AXES = ("x", "y", "z")
# Where the columns of a Parquet file hold what is a field of a workspace.
_ROWS = ("displacements", "tips", "directions", "codes", "values")


def columns_of(result: Any) -> Columns:
    """Columns of a result by name and unit: a row per disk of a shape, else per row."""
    if isinstance(result, Shape):
        disks = np.arange(len(result.positions))
        return {"disk": disks, **_points("", result.positions)}
    kind = type(result).__name__
    tendons = result.robot.tendon_names
    columns: Columns = {"row": np.arange(len(result))}
    columns["status"] = np.array([str(one) for one in result.status], dtype=np.str_)
    if kind == "InverseBatch":
        targets = result.targets
        columns |= _points("target ", targets[:, :3, 3] if targets.ndim == 3 else targets)
        columns |= {"error [m]": result.error, "rotation error [rad]": result.rotation_error}
    columns |= _per_tendon("displacement", tendons, result.displacements, "m")
    if kind == "InverseBatch":
        columns |= _per_tendon("tension", tendons, result.tensions, _force(result.robot))
    elif kind == "Workspace":
        columns |= _points("tip ", result.tips)
        columns |= _points("direction ", result.directions, None)
    else:
        columns |= _of_batch(result)
    return columns


def _of_batch(batch: Any) -> Columns:
    columns: Columns = {}
    fields, tendons = batch.fields, batch.robot.tendon_names
    whole = [batch.frames[:, :, :3, 3]] if "frames" in fields else []
    whole += [batch.positions] if "positions" in fields else []
    if "tip" in fields:
        columns |= _points("tip ", batch.tip[:, :3, 3])
    for disk in range(whole[0].shape[1] if whole else 0):
        columns |= _points(f"disk {disk} ", whole[0][:, disk])
    if "tendon_lengths" in fields:
        columns |= _per_tendon("length", tendons, batch.tendon_lengths, "m")
    if "tensions" in fields:
        columns |= _per_tendon("tension", tendons, batch.tensions, _force(batch.robot))
    if "energy" in fields:
        joule = batch.robot.backbone.youngs_modulus and batch.robot.backbone.diameter
        columns[f"energy [{'J' if joule else '1/m'}]"] = batch.energy
    return columns


def _force(robot: Robot) -> str:
    return "N" if robot.backbone.youngs_modulus and robot.backbone.diameter else "1/m^2"


def _points(name: str, points: Any, unit: str | None = "m") -> Columns:
    end = f" [{unit}]" if unit else ""
    return {f"{name}{axis}{end}": points[:, i] for i, axis in enumerate(_AXES)}


def _per_tendon(name: str, tendons: tuple[str, ...], values: Any, unit: str) -> Columns:
    return {f"{name} {tendon} [{unit}]": values[:, k] for k, tendon in enumerate(tendons)}


def write_csv(path: StrPath, result: Any) -> None:
    """Write the table of a result, numbers in full."""
    if type(result).__name__ == "Inverse":
        raise InvalidInput(
            f"path: expected .npz or .json for an Inverse, got {os.fspath(path)!r}; "
            "its shape can be saved as .csv",
            "path",
        )
    columns = columns_of(result)
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
    """Write the table of a batch or a workspace; of a workspace all that loads it again."""
    if type(result).__name__ not in ("ShapeBatch", "InverseBatch", "Workspace"):
        kind = type(result).__name__
        message = f"path: expected no .parquet for {kind}, which is no table of rows"
        raise InvalidInput(f"{message}, got {os.fspath(path)!r}", "path")
    arrow = require_pyarrow()
    columns = {name: arrow.array(column) for name, column in columns_of(result).items()}
    metadata = {}
    if type(result).__name__ == "Workspace":
        said = {name: described(getattr(result, name), name) for name in _fields(result)}
        said["values"] = {name: list(column.shape) for name, column in result.values.items()}
        metadata = {"tdcr": header_text("Workspace", said)}
        for name, column in result.values.items():
            width = math.prod(column.shape[1:])
            if width:  # None of a robot without tendons; lists of nothing there are not.
                values = arrow.array(column.ravel())
                columns[name] = arrow.FixedSizeListArray.from_arrays(values, width)
    table = arrow.table(columns).replace_schema_metadata(metadata)
    replace_file(
        path, lambda stream: arrow.parquet.write_table(table, stream, write_page_checksum=True)
    )


def _fields(workspace: Any) -> list[str]:
    from dataclasses import fields

    return [field.name for field in fields(workspace) if field.name not in _ROWS]


def read_parquet(path: StrPath) -> dict[str, Any]:
    """Read the fields of a workspace from the Parquet file that it wrote."""
    from tdcr._base.status import Status
    from tdcr._io.robot_file import robot_of

    shown = os.fspath(path)
    arrow = require_pyarrow()
    with open(path, "rb") as stream:
        try:
            table = arrow.parquet.read_table(stream, page_checksum_verification=True)
        except (arrow.ArrowException, OSError) as error:
            fault = " ".join(str(error).split())
            message = f"{shown}: not a Parquet file, or one that is cut off or damaged: {fault}"
            raise InvalidInput(message, "path") from None
    fields = _workspace_header(path, table)

    def column(name: str) -> Any:
        if name not in table.column_names:
            raise InvalidInput(f"{shown}: {name}: the column is missing", name)
        return table[name].combine_chunks()

    def stacked(*names: str) -> Any:
        columns = [column(name).to_numpy(zero_copy_only=False) for name in names]
        return np.column_stack(columns) if columns else np.empty((table.num_rows, 0))

    def within(name: str, sizes: Any) -> Any:
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
    tendons = robot_of(f"{shown}: robot", fields.get("robot")).tendon_names
    places = {str(status): code for code, status in enumerate(Status)}
    words = stacked("status")[:, 0].tolist()
    codes = [places.get(word, len(places)) for word in words]
    return fields | {
        "displacements": stacked(*(f"displacement {name} [m]" for name in tendons)),
        "tips": stacked(*(f"tip {axis} [m]" for axis in _AXES)),
        "directions": stacked(*(f"direction {axis}" for axis in _AXES)),
        "codes": np.array(codes, np.uint8),
        "values": {name: within(name, sizes) for name, sizes in fields["values"].items()},
    }


def _workspace_header(path: StrPath, table: Any) -> dict[str, Any]:
    """Fields of a workspace that are no columns, with the shapes of its further ones."""
    shown = os.fspath(path)
    own = (table.schema.metadata or {}).get(b"tdcr")
    if own is None:
        message = f"{shown}: expected the Parquet file of a Workspace, got one of something else"
        raise InvalidInput(message, "path")
    try:
        data = json.loads(own)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{shown}: header: not JSON: {error}", "header") from None
    fields = check_header(path, data, "Workspace")
    if not isinstance(fields.get("values"), dict):
        expected = f"{shown}: values: expected shapes by name"
        raise InvalidInput(f"{expected}, got {fields.get('values')!r}"[:500], "values")
    return fields


def _inner_sizes(shown: str, name: str, sizes: Any) -> list[int]:
    """Shape of what each row of a further column holds."""
    whole = isinstance(sizes, list) and all(type(size) is int and size >= 0 for size in sizes)
    if not whole or not sizes:
        raise InvalidInput(f"{shown}: {name}: expected a shape, got {sizes!r}"[:500], name)
    return list(sizes[1:])
