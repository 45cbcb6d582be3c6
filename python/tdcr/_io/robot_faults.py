"""Faults of robot files in words: the field, what was expected and what was there."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ValidationError

from tdcr._io.lengths import metres
from tdcr._io.robot_schema import TENDON_TABLES, BackboneTable, RobotTable
from tdcr.errors import InvalidInput

__all__ = ["meaning", "structure"]

_EXPECTED = {
    "float_type": "a number",
    "int_type": "an integer",
    "int_from_float": "an integer",
    "string_type": "text",
    "list_type": "a list",
    "model_type": "a table",
    "extra_forbidden": "no such key",
}
_LENGTHS = ("length", "diameter", "disk_radius", "radius")
_ANGLES = ("azimuth", "rest")
_SECTIONS: dict[str, type[BaseModel]] = {"": RobotTable, "backbone": BackboneTable}


def structure(data: Any, error: ValidationError) -> list[tuple[str, str]]:
    """Field and text of every fault; of another format version that fault alone."""
    faults = []
    for one in error.errors(include_url=False):
        parts = [part for part in one["loc"] if not str(part).startswith("~")]
        if one["type"] == "routing":
            parts.append("routing")
        field = _name(parts)
        text = _text(data, parts, field, one["type"], one["msg"], one.get("ctx", {}))
        if field == "format" and one["type"] == "literal_error":
            return [(field, f"{text} (another version of tdcr reads that)")]
        faults.append((field, text))
    return faults


def _name(parts: list[Any]) -> str:
    name = ""
    for part in parts:
        name += f"[{part}]" if isinstance(part, int) else f".{part}"
    return name.removeprefix(".") or "file"


def _text(
    data: Any, parts: list[Any], field: str, kind: str, message: str, context: dict[str, Any]
) -> str:
    if kind == "missing":
        return f"missing; expected {_description(data, parts)}"
    value = _at(data, parts)
    if kind == "extra_forbidden":
        keys = [info.alias or key for key, info in _section(data, parts).model_fields.items()]
        close = get_close_matches(str(parts[-1]), keys, 1)
        hint = f"did you mean {close[0]!r}?" if close else f"expected one of {', '.join(keys)}"
        return f"unknown key; {hint}"
    if kind == "routing":
        expected = " or ".join(f"'{name}'" for name in TENDON_TABLES)
    elif kind == "literal_error":
        expected = str(context["expected"])
    elif kind in ("too_short", "too_long"):
        expected = f"{context.get('min_length', context.get('max_length'))} values"
        return f"expected {expected}, got {len(value)}"
    else:
        expected = _EXPECTED.get(kind, message) + _unit(data, parts, kind)
    return f"expected {expected}, got {_show(value)}"


def _section(data: Any, parts: list[Any]) -> type[BaseModel]:
    if parts[0] == "tendons" and len(parts) > 1:
        return TENDON_TABLES[data["tendons"][parts[1]].get("routing", "angles")]
    return _SECTIONS[parts[0] if len(parts) > 1 else ""]


def _description(data: Any, parts: list[Any]) -> str:
    for key, info in _section(data, parts).model_fields.items():
        if (info.alias or key) == parts[-1]:
            text = str(info.description)
            return text[0].lower() + text[1:].rstrip(".")
    return "a value"


def _unit(data: Any, parts: list[Any], kind: str) -> str:
    keys = [part for part in parts if isinstance(part, str)]
    if kind != "float_type":
        return ""
    if keys[-1] in _LENGTHS:
        return f" [{data.get('length_unit', 'length_unit')}]"
    return " [rad]" if keys[-1] in _ANGLES else ""


def _at(data: Any, parts: list[Any]) -> Any:
    for part in parts:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _show(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return repr(value if len(value) <= 40 else value[:37] + "...")
        case list():
            return f"a list of {len(value)}"
        case dict():
            return "a table"
        case None:
            return "null"
    return repr(value)


@contextmanager
def meaning(path: str | os.PathLike[str], data: Any, prefix: str) -> Iterator[None]:
    """Put the path and the file's name of the field in front of a constructor's fault."""
    try:
        yield
    except InvalidInput as error:
        if str(error).startswith(os.fspath(path)):
            raise
        field = prefix + error.argument
        text = str(error).removeprefix(f"{error.argument}: ")
        in_file = _in_file(data, field, text)
    except (TypeError, OverflowError) as error:
        field, text, in_file = prefix.rstrip(".") or "file", str(error), ""
    else:
        return
    raise InvalidInput(f"{os.fspath(path)}: {field}: {text}{in_file}", field) from None


def _in_file(data: Any, field: str, text: str) -> str:
    """Say the refused length as the file has it, where the file is in mm."""
    parts = [int(p) if p.isdigit() else p for p in re.findall(r"[^.\[\]]+", field)]
    if data["length_unit"] != "mm" or parts[-1] not in _LENGTHS:
        return ""
    value = _at(data, parts)
    got = text.rpartition("got ")[2]
    for one in value if isinstance(value, list) else [value]:
        with suppress(ValueError):
            if float(got) == metres(one):
                return f" (in the file: {one} mm)"
    return ""
