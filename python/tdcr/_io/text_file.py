"""Text files: TOML and JSON, parsed with faults that start with the path."""

from __future__ import annotations

import json
import os
import tomllib
from typing import Any, TypeAlias

from tdcr.errors import InvalidInput

__all__ = ["StrPath", "parse"]

StrPath: TypeAlias = str | os.PathLike[str]


def parse(path: StrPath, raw: bytes, kind: str) -> Any:
    """Parse a TOML or JSON text, by the ending of its file."""
    name = kind[1:].upper()
    try:
        text = raw.decode("utf-8-sig")
        if kind == ".toml":
            return tomllib.loads(text)
        return json.loads(text, object_pairs_hook=_unique)
    except UnicodeDecodeError as error:
        fault = f"byte {error.start} is not UTF-8 text"
    except RecursionError:
        fault = "nested too deeply"
    except ValueError as error:
        fault = str(error)
    raise InvalidInput(f"{os.fspath(path)}: not a {name} file: {fault}", "path")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {twice!r} is given twice")
    return table
