"""Codecs between results and the fields of a file. Rooms register those of their results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any, NamedTuple, TypeAlias

from tdcr._io.field_reader import FieldReader
from tdcr._io.plain_data import to_plain

__all__ = [
    "FORMAT",
    "Codec",
    "Columns",
    "Readers",
    "codec_of",
    "find_codec",
    "kinds",
    "read_nested",
    "register",
    "value_codec",
    "write_nested",
    "write_value",
]

FORMAT = 1
"""Version of the format of every kind, unless its codec says another."""

Columns: TypeAlias = dict[str, Any]
Readers: TypeAlias = dict[str, Callable[[FieldReader, str], Any]]


class Codec(NamedTuple):
    """Fields of a result in files, and the tables that it can be."""

    kind: str
    """Name of the class."""
    write: Callable[[Any], dict[str, Any]]
    """Fields of a result, as plain data and arrays."""
    read: Callable[[FieldReader], Any]
    """Result of its fields."""
    home: str = "tdcr"
    """Package that users import the class from."""
    version: int = FORMAT
    columns: Callable[[Any], Columns] | None = None
    """Table for other programs, by name and unit."""
    has_rows: bool = False
    """The table has a row per solve, which Parquet files are for."""
    instead: str = ""
    """Hint for a table, where this result is none."""
    robot: str = "its .robot is the robot"
    """Place of the robot, for a reader of robot files."""
    pack: Callable[[Any, Any], tuple[Columns, dict[str, str]]] | None = None
    """More columns and the metadata with which a Parquet file loads again; called with pyarrow."""
    unpack: Callable[[Any, Any], dict[str, Any]] | None = None
    """Fields of a Parquet file, from its path and table."""


_CODECS: dict[str, Codec] = {}


def register(codec: Codec) -> None:
    """Make a kind known to all files."""
    _CODECS[codec.kind] = codec


def kinds() -> tuple[str, ...]:
    """Names of all kinds."""
    return tuple(_CODECS)


def find_codec(kind: object) -> Codec | None:
    """Codec of a kind, if there is such a kind."""
    return _CODECS.get(kind) if isinstance(kind, str) else None


def codec_of(result: Any) -> Codec:
    """Codec of a result."""
    return _CODECS[type(result).__name__]


def write_nested(result: Any) -> dict[str, Any]:
    """Fields of a result that is a field of another one, with its kind."""
    codec = codec_of(result)
    return {"kind": codec.kind, **codec.write(result)}


def read_nested(reader: FieldReader, name: str, kind: str) -> Any:
    """Read a result that is a field of another one."""
    value = reader.get(name)
    if not isinstance(value, dict) or value.get("kind") != kind:
        raise reader.fault(name, f"expected the fields of a {kind}")
    return _CODECS[kind].read(FieldReader(f"{reader.path}: {name}", value))


def write_value(result: Any) -> dict[str, Any]:
    """Fields of a dataclass, results among them with their kind."""
    found = {field.name: getattr(result, field.name) for field in fields(result)}
    return {
        name: write_nested(value) if type(value).__name__ in _CODECS else to_plain(value, name)
        for name, value in found.items()
    }


def value_codec(
    cls: type[Any],
    readers: Readers,
    *,
    write: Callable[[Any], dict[str, Any]] = write_value,
    **options: Any,
) -> Codec:
    """Codec of a dataclass: a reader for each field, called in the order of the class."""
    names = [field.name for field in fields(cls)]

    def read(reader: FieldReader) -> Any:
        return cls(**{name: readers[name](reader, name) for name in names})

    return Codec(cls.__name__, write, read, **options)
