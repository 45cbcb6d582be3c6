"""Files of obstacles, and the obstacles of saved results."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdcr._io.field_reader import FieldReader
from tdcr._io.lengths import to_metres
from tdcr._io.plain_data import LENGTHS
from tdcr._io.result_file import read_any
from tdcr._io.text_file import parse
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from tdcr._core import Obstacle

__all__ = ["read_obstacles"]

_KEYS = ("format", "length_unit", "obstacles")


def read_obstacles(path: Path | None) -> tuple[Obstacle, ...]:
    """Read obstacles: tables as files of results have them, with a unit of length.

    Raises
    ------
    InvalidInput
        Another file; names path and field, what was expected and what was there.
    OSError
        The file cannot be read.
    """
    if path is None:
        return ()
    suffix = path.suffix.lower()
    if suffix == ".npz":
        fields = read_any(path)
    elif suffix in (".toml", ".json"):
        fields = parse(path, path.read_bytes(), suffix)
        if isinstance(fields, dict) and "kind" in fields:
            fields = read_any(path)
        else:
            fields = {"kind": "file of obstacles", "obstacles": _check_tables(path, fields)}
    else:
        expected = "a file of obstacles ending in .toml, .json or .npz"
        raise InvalidInput(f"obstacles: expected {expected}, got '{path}'", "obstacles")
    return FieldReader(path, fields).objects("obstacles")


def _check_tables(path: Path, data: Any) -> list[Any]:
    """Tables of a file of obstacles with lengths in m; its head is checked."""
    if not isinstance(data, dict) or not isinstance(data.get("obstacles"), list):
        expected = "expected a list of tables 'obstacles', each with its type"
        raise InvalidInput(f"{path}: {expected}", "obstacles")
    for key in data:
        if key not in _KEYS:
            known = ", ".join(_KEYS)
            raise InvalidInput(f"{path}: {key}: unknown key; expected one of {known}", key)
    if data.get("format") != 1 or isinstance(data["format"], bool):
        raise InvalidInput(f"{path}: format: expected 1, got {data.get('format')!r}", "format")
    unit = data.get("length_unit")
    if unit not in ("m", "mm"):
        raise InvalidInput(f"{path}: length_unit: expected 'm' or 'mm', got {unit!r}", "unit")
    return [_in_metres(one, unit) if isinstance(one, dict) else one for one in data["obstacles"]]


def _in_metres(table: dict[str, Any], unit: str) -> dict[str, Any]:
    return {k: _metres(value, unit) if k in LENGTHS else value for k, value in table.items()}


def _metres(value: Any, unit: str) -> Any:
    if isinstance(value, list):
        return [_metres(one, unit) for one in value]
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return to_metres([value], unit)[0] if number else value
