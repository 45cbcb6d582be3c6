"""Robot files: TOML or JSON, read and written.

Imported on first use by ``Robot.load``, ``Robot.save`` and the command line.
"""

from __future__ import annotations

import json
import os
import textwrap
from pathlib import Path
from typing import Any

import tomli_w

from tdcr._core import Robot
from tdcr._io.atomic_write import replace_file
from tdcr._io.codecs import find_codec
from tdcr._io.robot_schema import robot_schema
from tdcr._io.robot_tables import build_robot, tables_of
from tdcr._io.text_file import StrPath, parse
from tdcr.errors import InvalidInput

__all__ = ["load_robot", "robot_schema", "save_robot"]


def load_robot(path: StrPath) -> Robot:
    """Read a robot file.

    Parameters
    ----------
    path : str or os.PathLike
        File ending in .toml or .json.

    Returns
    -------
    Robot
        With the recipes of its tendons as the file gives them, lengths in m.

    Raises
    ------
    InvalidInput
        Not a robot file. One line per fault: path, field, what was expected and what was there.
    OSError
        The file cannot be read.
    """
    kind = _kind(path)
    data = parse(path, Path(path).read_bytes(), kind)
    if isinstance(data, dict) and (codec := find_codec(data.get("kind"))):
        got = f"a {codec.kind}, which {codec.home}.{codec.kind}.load reads: {codec.robot}"
        raise InvalidInput(f"{os.fspath(path)}: kind: expected a robot file, got {got}", "kind")
    return build_robot(path, data)


def _kind(path: StrPath) -> str:
    kind = Path(path).suffix.lower()
    if kind not in (".toml", ".json"):
        raise InvalidInput(
            f"path: expected a file ending in .toml or .json, got {os.fspath(path)!r}", "path"
        )
    return kind


def save_robot(robot: Robot, path: StrPath) -> None:
    """Write a robot file that `load_robot` reads back exactly.

    Lengths are written in m, defaults are left out. The file appears complete or not at all.

    Parameters
    ----------
    robot : Robot
    path : str or os.PathLike
        File ending in .toml or .json; replaced if it exists.

    Raises
    ------
    InvalidInput
        Another file ending.
    OSError
        The file cannot be written.
    """
    kind = _kind(path)
    data = tables_of(robot)
    text = _toml(data) if kind == ".toml" else json.dumps(data, indent=2, ensure_ascii=False) + "\n"
    replace_file(path, lambda stream: stream.write(text.encode()))


def _toml(data: dict[str, Any]) -> str:
    """TOML with lists on as few lines as they need (tomli-w gives every number its own)."""
    lines = [_entry(k, v) for k, v in data.items() if k not in ("backbone", "tendons")]
    for header, table in [
        ("[backbone]", data["backbone"]),
        *(("[[tendons]]", tendon) for tendon in data["tendons"]),
    ]:
        lines += ["", header, *(_entry(key, value) for key, value in table.items())]
    if not data["tendons"]:
        lines.insert(2, "tendons = []")
    return "\n".join(lines) + "\n"


def _entry(key: str, value: Any) -> str:
    if not isinstance(value, list):
        return tomli_w.dumps({key: value}).rstrip("\n")
    if value and isinstance(value[0], list):
        return f"{key} = [\n" + "".join(f"  {row},\n" for row in value) + "]"
    text = f"{key} = {value}"
    if len(text) <= 96:
        return text
    numbers = textwrap.fill(", ".join(map(repr, value)), 96, initial_indent="  ",
                            subsequent_indent="  ", break_on_hyphens=False)  # fmt: skip
    return f"{key} = [\n{numbers},\n]"
