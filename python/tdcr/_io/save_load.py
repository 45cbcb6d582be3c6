"""Saving and loading results. Imported on first use by their methods and the command line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, TypeAlias

from tdcr._io.codecs import KINDS
from tdcr._io.field_reader import Record
from tdcr._io.result_file import opened, read_file, write_file
from tdcr._io.tables import read_parquet, write_csv, write_parquet
from tdcr.errors import InvalidInput

__all__ = ["load", "load_any", "save"]

StrPath: TypeAlias = str | os.PathLike[str]


def save(result: Any, path: StrPath) -> None:
    """Write a result, by the ending of the path as npz, JSON, CSV or Parquet.

    The file appears complete or not at all.

    Parameters
    ----------
    result : Shape, ShapeBatch, Inverse, InverseBatch or Workspace
    path : str or os.PathLike
        Replaced if it exists.

    Raises
    ------
    InvalidInput
        Another file ending; a result that holds Python functions.
    ImportError
        Parquet without pyarrow.
    OSError
        The file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".csv":
        write_csv(path, result)
    elif suffix == ".parquet":
        write_parquet(path, result)
    elif suffix in (".npz", ".json"):
        kind = type(result).__name__
        write_file(path, kind, KINDS[kind].said(result))
    else:
        expected = "a file ending in .npz, .json, .csv or .parquet"
        raise InvalidInput(f"path: expected {expected}, got {os.fspath(path)!r}", "path")


def load(path: StrPath, kind: str) -> Any:
    """Read a result of a kind.

    Parameters
    ----------
    path : str or os.PathLike
        File ending in .npz or .json, of a Workspace also .parquet.
    kind : str
        Name of its class.

    Raises
    ------
    InvalidInput
        Another file: names path and field, what was expected and what was there.
    ImportError
        Parquet without pyarrow.
    OSError
        The file cannot be read.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".parquet" and kind == "Workspace":
        fields = read_parquet(path)
    elif suffix in (".csv", ".parquet"):
        raise InvalidInput(
            f"path: {suffix} files are for other programs and not read back; expected one ending "
            f"in .npz or .json, got {os.fspath(path)!r}",
            "path",
        )
    else:
        fields = read_file(path, kind)
    return _read(path, fields)


def load_any(path: StrPath) -> Any:
    """Read a result of whatever kind it is."""
    if Path(path).suffix.lower() == ".parquet":
        return load(path, "Workspace")
    return _read(path, opened(path))


def _read(path: StrPath, fields: dict[str, Any]) -> Any:
    try:
        return KINDS[fields["kind"]].read(Record(path, fields))
    except RecursionError:
        raise InvalidInput(f"{os.fspath(path)}: a field is nested too deeply", "path") from None
