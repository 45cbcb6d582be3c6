"""Saving and loading of results, of every kind that has a codec."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Self

from tdcr._io.codecs import codec_of, find_codec, kinds
from tdcr._io.field_reader import FieldReader
from tdcr._io.result_file import header_text, read_any, read_file, write_file
from tdcr._io.tables import read_parquet, write_csv, write_parquet
from tdcr._io.text_file import StrPath
from tdcr.errors import InvalidInput

__all__ = ["Saved", "json_text", "load", "load_any", "save"]


class Saved:
    """Base of results that files hold: those whose room has registered a codec."""

    def save(self, path: StrPath) -> None:
        """Write the result into a file that appears complete or not at all.

        Parameters
        ----------
        path : str or os.PathLike
            Ending in .npz or .json, which `load` reads back equal; of batches and workspaces also
            in .csv or .parquet, for other programs: a row per row, of a `ShapeBatch` without
            rotations, strains, holes and contacts. The .parquet of a `Workspace` is read back
            equal too. Replaced if it exists.

        Raises
        ------
        InvalidInput
            Another file ending; a `SignedDistance` among the obstacles, whose functions no file
            holds.
        ImportError
            .parquet without pyarrow, an optional extra: ``pip install tdcr[parquet]``.
        OSError
            The file cannot be written.
        """
        save(self, path)

    @classmethod
    def load(cls, path: StrPath) -> Self:
        """Read a result that `save` wrote. No code of a file is run.

        Parameters
        ----------
        path : str or os.PathLike
            File ending in .npz or .json, of a `Workspace` also .parquet.

        Raises
        ------
        InvalidInput
            Another file: names path and field, what was expected and what was there.
        ImportError
            .parquet without pyarrow, an optional extra: ``pip install tdcr[parquet]``.
        OSError
            The file cannot be read.
        """
        loaded: Self = load(path, cls.__name__)
        return loaded


def save(result: Any, path: StrPath) -> None:
    """Write a result; see `Saved.save`."""
    suffix = Path(path).suffix.lower()
    if suffix == ".csv":
        write_csv(path, result)
    elif suffix == ".parquet":
        write_parquet(path, result)
    elif suffix in (".npz", ".json"):
        codec = codec_of(result)
        write_file(path, codec.kind, codec.write(result))
    else:
        expected = "a file ending in .npz, .json, .csv or .parquet"
        raise InvalidInput(f"path: expected {expected}, got {os.fspath(path)!r}", "path")


def json_text(result: Any, **more: Any) -> str:
    """JSON text of a result, as `save` writes it, and more fields."""
    codec = codec_of(result)
    return header_text(codec.kind, codec.write(result) | more)


def load(path: StrPath, kind: str) -> Any:
    """Read a result of a kind, which is the name of its class; see `Saved.load`."""
    suffix, codec = Path(path).suffix.lower(), find_codec(kind)
    if suffix == ".parquet" and codec and codec.unpack:
        fields = codec.unpack(path, read_parquet(path))
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
        # One kind alone is read back from such files.
        return load(path, next(k for k in kinds() if (codec := find_codec(k)) and codec.unpack))
    return _read(path, read_any(path))


def _read(path: StrPath, fields: dict[str, Any]) -> Any:
    codec = find_codec(fields["kind"])
    assert codec is not None, "files of other kinds are refused when they are read"
    try:
        return codec.read(FieldReader(path, fields))
    except RecursionError:
        raise InvalidInput(f"{os.fspath(path)}: a field is nested too deeply", "path") from None
