"""Files of results, npz or JSON: a header with the kind of the file, and fields by name.

In JSON everything is in one object, with NaN as null and infinities as "inf" and "-inf". In npz
every array is a member of its own, and the member ``header`` is the JSON text of the rest, in which
``{"array": name}`` stands where an array was. Neither holds code: pickles are refused.
"""

from __future__ import annotations

import json
import math
import os
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from tdcr._core import __version__
from tdcr._io.atomic_write import replace_file
from tdcr._io.codecs import FORMAT, find_codec, kinds
from tdcr._io.text_file import StrPath, parse
from tdcr.errors import InvalidInput

__all__ = ["check_header", "header_text", "move_arrays", "read_any", "read_file", "write_file"]

# What numpy and zipfile raise over files that are none or damaged.
_DAMAGE = (
    ValueError, EOFError, KeyError, OSError, RuntimeError, struct.error, zipfile.BadZipFile,
    zlib.error,
)  # fmt: skip


def write_file(path: StrPath, kind: str, fields: dict[str, Any]) -> None:
    """Write fields of plain data and arrays, as npz or JSON by the ending of the path."""
    if Path(path).suffix.lower() == ".json":
        text = header_text(kind, fields) + "\n"
        replace_file(path, lambda stream: stream.write(text.encode()))
        return
    arrays: dict[str, Any] = {}
    header = header_text(kind, {name: move_arrays(v, name, arrays) for name, v in fields.items()})
    replace_file(path, lambda stream: np.savez(stream, header=np.array(header), **arrays))


def header_text(kind: str, fields: dict[str, Any]) -> str:
    """JSON text of fields, after those that every file starts with."""
    codec = find_codec(kind)
    version = codec.version if codec else FORMAT
    data = {"format": version, "kind": kind, "tdcr": __version__, **fields}
    return json.dumps(_standard(data), ensure_ascii=False, allow_nan=False)


def move_arrays(value: Any, name: str, arrays: dict[str, Any]) -> Any:
    """Move the arrays of a value out of it; the few numbers of an obstacle, say, stay."""
    if isinstance(value, np.ndarray) and ("." not in name or value.size > 16):
        arrays[name] = value
        return {"array": name}
    if isinstance(value, dict):
        return {key: move_arrays(one, f"{name}.{key}", arrays) for key, one in value.items()}
    if isinstance(value, list):
        return [move_arrays(one, f"{name}.{i}", arrays) for i, one in enumerate(value)]
    return value


def _standard(value: Any) -> Any:
    """Value without arrays, NaN and infinities, which JSON has not."""
    match value:
        case np.ndarray() if value.dtype.names:
            return {name: _standard(value[name]) for name in value.dtype.names}
        case np.ndarray():
            plain = value.tolist()
            finite = value.dtype.kind != "f" or np.isfinite(value).all()
            return plain if finite else _standard(plain)
        case np.generic():
            return _standard(value.item())
        case dict():
            return {str(key): _standard(one) for key, one in value.items()}
        case list() | tuple():
            return [_standard(one) for one in value]
        case float() if math.isnan(value):
            return None
        case float() if math.isinf(value):
            return "inf" if value > 0 else "-inf"
    return value


def read_file(path: StrPath, kind: str) -> dict[str, Any]:
    """Read the fields of a file of a kind.

    Raises
    ------
    InvalidInput
        Another kind, a newer format, or no such file at all; names the path.
    OSError
        The file cannot be read.
    """
    return check_header(path, read_any(path), kind)


def check_header(path: StrPath, data: Any, kind: str) -> dict[str, Any]:
    """Check that fields are those of a kind."""
    fields = _check(path, data)
    if fields["kind"] != kind:
        found = fields["kind"]
        codec = find_codec(found)
        home = codec.home if codec else "tdcr"
        raise InvalidInput(
            f"{os.fspath(path)}: kind: expected {kind!r}, got {found!r}: "
            f"{home}.{found}.load reads it",
            "kind",
        )
    return fields


def read_any(path: StrPath) -> dict[str, Any]:
    """Read the fields of a file of any kind; see `read_file`."""
    suffix = Path(path).suffix.lower()
    if suffix == ".npz":
        return _check(path, _read_npz(path))
    if suffix == ".json":
        return _check(path, parse(path, Path(path).read_bytes(), suffix))
    raise InvalidInput(
        f"path: expected a file ending in .npz or .json, got {os.fspath(path)!r}", "path"
    )


def _check(path: StrPath, data: Any) -> dict[str, Any]:
    shown = os.fspath(path)
    expected = f"{shown}: expected a file that tdcr saved, one of {', '.join(kinds())}"
    if not isinstance(data, dict):
        raise InvalidInput(f"{expected}; got no table of fields", "path")
    if "kind" not in data and {"backbone", "tendons"} <= data.keys():
        raise InvalidInput(f"{expected}; got a robot file, which tdcr.Robot.load reads", "path")
    if "kind" not in data or "format" not in data:
        raise InvalidInput(f"{expected}; got a file without 'format' and 'kind'", "path")
    version, kind = data["format"], data["kind"]
    codec = find_codec(kind)
    known = codec.version if codec else FORMAT
    if type(version) is not int or version != known:
        newer = type(version) is int and version > known
        hint = f" (tdcr {data.get('tdcr', 'of a later version')} wrote it)" if newer else ""
        raise InvalidInput(f"{shown}: format: expected {known}, got {version!r}{hint}", "format")
    if codec is None:
        raise InvalidInput(f"{expected}; got the kind {kind!r}"[:500], "kind")
    return data


def _read_npz(path: StrPath) -> Any:
    shown = os.fspath(path)
    with Path(path).open("rb") as stream:
        try:
            archive = np.load(stream, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise InvalidInput(f"{shown}: not an npz file: it is a single array", "path")
            # Members that are no arrays come as bytes.
            found = ((name, archive[name]) for name in archive.files)
            arrays = {name: one for name, one in found if isinstance(one, np.ndarray)}
        except _DAMAGE as error:
            if isinstance(error, InvalidInput):
                raise
            fault = " ".join(str(error).split()) or type(error).__name__
            # numpy takes what it does not know for a pickle, and goes on to say how to run it.
            if "Object arrays" in fault:
                fault = "it holds pickled objects, which are not read"
            elif "pickle" in fault:
                fault = "no archive"
            message = f"{shown}: not an npz file, or one that is cut off or damaged: {fault}"
            raise InvalidInput(message, "path") from None
    header = arrays.pop("header", None)
    if header is None or header.dtype.kind != "U" or header.ndim:
        names = ", ".join(map(str, arrays)) or "none"
        message = f"{shown}: header: expected the text that tdcr writes, got members {names}"
        raise InvalidInput(message, "header")
    try:
        return _put_back(json.loads(str(header)), arrays)
    except KeyError as error:
        raise InvalidInput(f"{shown}: {error.args[0]}: the array is missing", "path") from None
    except (json.JSONDecodeError, RecursionError) as error:
        raise InvalidInput(f"{shown}: header: not JSON: {error}", "header") from None
    except ValueError as error:
        raise InvalidInput(f"{shown}: header: {error}", "header") from None


def _put_back(value: Any, arrays: dict[str, Any]) -> Any:
    """Put arrays where they were."""
    if isinstance(value, dict):
        if value.keys() == {"array"}:
            name = value["array"]
            if not isinstance(name, str):
                raise ValueError(f"expected the name of an array, got {name!r}"[:200])
            return arrays[name]
        return {key: _put_back(one, arrays) for key, one in value.items()}
    if isinstance(value, list):
        return [_put_back(one, arrays) for one in value]
    return value
