"""Files of obstacles: ``--obstacles FILE``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from tdcr._cli.options import FILE
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from tdcr import Obstacle

__all__ = ["obstacles_option", "read_obstacles"]

Command = TypeVar("Command", bound=Callable[..., Any])

# Arguments of the constructors that are lengths or places; the others have no unit.
_LENGTHS = ("a", "b", "center", "half_extents", "point", "radius", "vertices")
_KEYS = ("format", "length_unit", "obstacles")


def obstacles_option(command: Command) -> Command:
    """Option for what is in the way."""
    return click.option(
        "--obstacles",
        type=FILE,
        metavar="FILE",
        help="What is in the way: a file of obstacles (.toml, .json), or a saved result, whose "
        "obstacles are taken.",
    )(command)


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
    from tdcr._io.field_reader import Record
    from tdcr._io.result_file import opened
    from tdcr._io.robot_file import parsed

    suffix = path.suffix.lower()
    if suffix == ".npz":
        fields = opened(path)
    elif suffix in (".toml", ".json"):
        fields = parsed(path, path.read_bytes(), suffix)
        if isinstance(fields, dict) and "kind" in fields:
            fields = opened(path)
        else:
            fields = {"kind": "file of obstacles", "obstacles": _in_metres(path, fields)}
    else:
        expected = "a file of obstacles ending in .toml, .json or .npz"
        raise InvalidInput(f"obstacles: expected {expected}, got '{path}'", "obstacles")
    return Record(path, fields).things("obstacles")


def _in_metres(path: Path, data: Any) -> list[Any]:
    """Check the head of a file of obstacles, and give its tables with lengths in m."""
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
    return [_scaled(one, unit) if isinstance(one, dict) else one for one in data["obstacles"]]


def _scaled(table: dict[str, Any], unit: str) -> dict[str, Any]:
    return {k: _metres(value, unit) if k in _LENGTHS else value for k, value in table.items()}


def _metres(value: Any, unit: str) -> Any:
    from tdcr._cli.options import in_metres

    if isinstance(value, list):
        return [_metres(one, unit) for one in value]
    if isinstance(value, int | float) and not isinstance(value, bool):
        return in_metres([value], unit)[0]
    return value
