"""Files of sweeps, written chunk by chunk. Imported on first use by `tdcr.sweep`."""

from __future__ import annotations

import errno
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from tdcr._base.status import Status
from tdcr._forward.codecs import batch_columns, write_batch
from tdcr._io.result_file import header_text, move_arrays
from tdcr._io.tables import require_pyarrow
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from tdcr._forward.batch import ShapeBatch

__all__ = ["writer_of"]

StrPath: TypeAlias = str | os.PathLike[str]
# Takes the number of the first row, and a chunk.
Keep: TypeAlias = Callable[[int, "ShapeBatch"], None]

_ROWS = ("displacements", "status", "ok", "residual", "iterations")
_WORD = np.dtype(("U", max(map(len, Status))))
# Fields that have columns of numbers in a table.
_TABLE = ("tip", "positions", "tendon_lengths", "tensions", "energy")


class Writer(Protocol):
    """Writes chunks into a stream; the file is whole when the context ends without an error."""

    def into(self, stream: Any) -> AbstractContextManager[Keep]: ...


def writer_of(path: StrPath) -> Callable[[StrPath, ShapeBatch], Writer]:
    """Give the kind of writer for a path; it takes the path and a batch of no rows."""
    suffix = Path(path).suffix.lower()
    if suffix not in (".npz", ".parquet"):
        expected = "a file ending in .npz or .parquet"
        raise InvalidInput(f"path: expected {expected}, got {os.fspath(path)!r}", "path")
    if Path(path).is_dir():
        # Else the fault would come after the last row.
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if suffix == ".npz":
        return _Npz
    require_pyarrow()
    return _Parquet


class _Parquet:
    """A row group per chunk, with the columns that a batch has in a table."""

    def __init__(self, path: StrPath, blank: ShapeBatch) -> None:
        for name in blank.fields:
            if name not in _TABLE:
                expected = f"of a Parquet file names of {', '.join(_TABLE)}"
                message = f"fields: expected {expected}, got {name!r}, which .npz files hold"
                raise InvalidInput(message, "fields")
        self.arrow = require_pyarrow()
        self.schema = self.table(0, blank).schema

    def table(self, start: int, batch: ShapeBatch) -> Any:
        columns = batch_columns(batch)
        columns["row"] = columns["row"] + start
        return self.arrow.table({name: self.arrow.array(one) for name, one in columns.items()})

    @contextmanager
    def into(self, stream: Any) -> Iterator[Keep]:
        sums = {"write_page_checksum": True}
        with self.arrow.parquet.ParquetWriter(stream, self.schema, **sums) as writer:
            yield lambda start, batch: writer.write_table(
                self.table(start, batch), row_group_size=len(batch)
            )


class _Npz:
    """The file that `ShapeBatch.save` writes: columns are gathered apart, then put together.

    A member of an archive is written from its first byte to its last, and has its shape in front.
    """

    def __init__(self, path: StrPath, blank: ShapeBatch) -> None:
        self.target = Path(os.path.realpath(path))
        self.names = (*_ROWS, *blank.fields)
        self.blank = self.rows(0, blank)
        self.constant: dict[str, Any] = {}
        fields: dict[str, Any] = {}
        for name, value in write_batch(blank).items():
            if name not in self.names:
                fields[name] = move_arrays(value, name, self.constant)
            elif isinstance(value, list):
                fields[name] = [{"array": f"{name}.{k}"} for k in range(len(value))]
            else:
                fields[name] = {"array": name}
        self.header = header_text("ShapeBatch", fields)

    def rows(self, start: int, batch: ShapeBatch) -> dict[str, Any]:
        """Arrays of some rows, by the names of members."""
        arrays: dict[str, Any] = {}
        for name in self.names:
            value = getattr(batch, name)
            if isinstance(value, list):
                arrays |= {f"{name}.{k}": one for k, one in enumerate(value)}
            else:
                arrays[name] = value
        arrays["status"] = arrays["status"].astype(_WORD)
        if "contacts" in arrays:
            arrays["contacts"] = arrays["contacts"].copy()
            arrays["contacts"]["row"] += start
        return arrays

    @contextmanager
    def into(self, stream: Any) -> Iterator[Keep]:
        # Beside the target: folders for what is temporary may be in memory.
        with ExitStack() as opened:
            hidden = TemporaryDirectory(prefix=f".{self.target.name}.", dir=self.target.parent)
            folder = opened.enter_context(hidden)
            parts = {
                name: opened.enter_context((Path(folder) / name).open("w+b")) for name in self.blank
            }
            counts = dict.fromkeys(parts, 0)

            def keep(start: int, batch: ShapeBatch) -> None:
                for name, array in self.rows(start, batch).items():
                    parts[name].write(np.ascontiguousarray(array).data)
                    counts[name] += len(array)

            yield keep
            with zipfile.ZipFile(stream, "w") as archive:
                for name, value in ({"header": np.array(self.header)} | self.constant).items():
                    with _member(archive, name) as member:
                        np.lib.format.write_array(member, np.asarray(value), allow_pickle=False)
                for name, part in parts.items():
                    like = self.blank[name]
                    shape = (counts[name], *like.shape[1:])
                    part.seek(0)
                    with _member(archive, name) as member:
                        said = np.lib.format.header_data_from_array_1_0(like) | {"shape": shape}
                        np.lib.format.write_array_header_1_0(member, said)
                        shutil.copyfileobj(part, member, 1 << 20)


def _member(archive: zipfile.ZipFile, name: str) -> Any:
    return archive.open(f"{name}.npy", "w", force_zip64=True)
