"""Robot files: TOML or JSON, read, checked and written.

The structure of a file (keys, types, units) is checked with pydantic, the meaning of its values by
the constructors of `Backbone`, `Tendon` and `Robot`. Either way a fault is one line with the path,
the field, what was expected and what was there. Imported on first use by ``Robot.load``,
``Robot.save`` and the command line.
"""

from __future__ import annotations

import json
import os
import textwrap
import tomllib
from pathlib import Path
from typing import Any, TypeAlias

import tomli_w
from pydantic import BaseModel, ValidationError

from tdcr._core import Backbone, Robot, Tendon
from tdcr._io.atomic_write import replace_file
from tdcr._io.robot_faults import meaning, structure
from tdcr._io.robot_schema import (
    TENDON_TABLES,
    AnglesTable,
    BackboneTable,
    HelicalTable,
    HolesTable,
    Matrix,
    RobotTable,
    metres,
    robot_schema,
)
from tdcr.errors import InvalidInput

__all__ = ["load_robot", "parsed", "robot_data", "robot_of", "robot_schema", "save_robot"]

StrPath: TypeAlias = str | os.PathLike[str]


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
    data = parsed(path, Path(path).read_bytes(), kind)
    if isinstance(data, dict) and isinstance(said := data.get("kind"), str):
        from tdcr._io.codecs import KINDS

        if said in KINDS:
            got = f"a {said}, which tdcr.{said}.load reads: its .robot is the robot"
            raise InvalidInput(f"{os.fspath(path)}: kind: expected a robot file, got {got}", "kind")
    return robot_of(path, data)


def robot_of(path: StrPath, data: Any) -> Robot:
    """Build a robot from the tables of a file; faults start with the path."""
    try:
        table = RobotTable.model_validate(data)
    except ValidationError as error:
        faults = structure(data, error)
        lines = "\n".join(f"{os.fspath(path)}: {field}: {text}" for field, text in faults)
        raise InvalidInput(lines, faults[0][0]) from None
    with meaning(path, data, ""):
        return _build(path, data, table)


def _kind(path: StrPath) -> str:
    kind = Path(path).suffix.lower()
    if kind not in (".toml", ".json"):
        raise InvalidInput(
            f"path: expected a file ending in .toml or .json, got {os.fspath(path)!r}", "path"
        )
    return kind


def parsed(path: StrPath, raw: bytes, kind: str) -> Any:
    """Parse the text of a TOML or JSON file; faults start with the path."""
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


def _build(path: StrPath, data: Any, table: RobotTable) -> Robot:
    def length(value: Any) -> Any:
        if table.length_unit == "m" or value is None:
            return value
        return [metres(one) for one in value] if isinstance(value, list) else metres(value)

    def placed(matrix: Matrix | None) -> Matrix | None:
        # The translation alone is a length: first three rows, last column.
        return matrix and [[*row[:3], length(row[3])] for row in matrix[:3]] + matrix[3:]

    spine = table.backbone
    with meaning(path, data, "backbone."):
        backbone = Backbone(
            length(spine.length),
            spine.subsegments,
            poisson_ratio=spine.poisson_ratio,
            rest=spine.rest,
            youngs_modulus=spine.youngs_modulus,
            diameter=length(spine.diameter),
            disk_radius=length(spine.disk_radius),
        )
    tendons = []
    for k, tendon in enumerate(table.tendons):
        with meaning(path, data, f"tendons[{k}]."):
            tendons.append(_tendon(tendon, length(tendon.radius)))
    base, tool = placed(table.base), placed(table.tool)
    return Robot(backbone, tendons, base=base, tool=tool, name=table.name)


def _tendon(table: AnglesTable | HelicalTable | HolesTable, radius: Any) -> Tendon:
    end, stiffness, name = table.end, table.stiffness, table.name
    match table:
        case AnglesTable():
            return Tendon(table.azimuth, radius, end=end, stiffness=stiffness, name=name)
        case HelicalTable():
            return Tendon.helical(
                table.azimuth, radius, turns=table.turns, end=end, stiffness=stiffness, name=name
            )
        case HolesTable():
            return Tendon.from_holes(
                table.indices,
                table.count,
                radius,
                azimuth=table.azimuth,
                end=end,
                stiffness=stiffness,
                name=name,
            )


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
    data = robot_data(robot)
    text = _toml(data) if kind == ".toml" else json.dumps(data, indent=2, ensure_ascii=False) + "\n"
    replace_file(path, lambda stream: stream.write(text.encode()))


def robot_data(robot: Robot) -> dict[str, Any]:
    """Say what a robot file says of a robot; keys in the order of reading."""
    spine = robot.backbone
    backbone = _said(
        BackboneTable,
        length=_plain(spine.length),
        subsegments=_plain(spine.subsegments),
        poisson_ratio=spine.poisson_ratio,
        youngs_modulus=spine.youngs_modulus,
        diameter=_plain(spine.diameter),
        disk_radius=spine.disk_radius,
        rest=None if spine.rest is None else spine.rest.tolist(),
    )
    identity = [[float(i == j) for j in range(4)] for i in range(4)]
    base, tool = robot.base.tolist(), robot.tool.tolist()
    return _said(
        RobotTable,
        format=1,
        length_unit="m",
        name=robot.name,
        base=None if base == identity else base,
        tool=None if tool == identity else tool,
        backbone=backbone,
        tendons=[_tendon_data(tendon) for tendon in robot.tendons],
    )


def _tendon_data(tendon: Tendon) -> dict[str, Any]:
    return _said(
        TENDON_TABLES[tendon.routing],
        name=tendon.name,
        routing=tendon.routing,
        indices=_plain(tendon.indices),
        count=tendon.count,
        azimuth=_plain(tendon.azimuth),
        radius=_plain(tendon.radius),
        turns=tendon.turns,
        end=tendon.end,
        stiffness=tendon.stiffness,
    )


def _said(table: type[BaseModel], **values: Any) -> dict[str, Any]:
    """Keep the values that differ from the defaults of the table."""
    fields = table.model_fields
    given = {key: value for key, value in values.items() if value is not None}
    return {key: value for key, value in given.items() if value != fields[key].default}


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


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
