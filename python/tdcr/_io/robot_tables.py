"""Tables of a robot file: checked and built into a robot, and back.

The structure of a file (keys, types, units) is checked with pydantic, the meaning of its values by
the constructors of `Backbone`, `Tendon` and `Robot`. Either way a fault is one line with the path,
the field, what was expected and what was there.
"""

from __future__ import annotations

import os
from typing import Any

from pydantic import BaseModel, ValidationError

from tdcr._core import Backbone, Robot, Tendon
from tdcr._io.lengths import metres
from tdcr._io.robot_faults import meaning, structure
from tdcr._io.robot_schema import (
    TENDON_TABLES,
    AnglesTable,
    BackboneTable,
    HelicalTable,
    HolesTable,
    Matrix,
    RobotTable,
)
from tdcr._io.text_file import StrPath
from tdcr.errors import InvalidInput

__all__ = ["build_robot", "tables_of"]


def build_robot(path: StrPath, data: Any) -> Robot:
    """Robot of the tables of a file; faults start with the path."""
    try:
        table = RobotTable.model_validate(data)
    except ValidationError as error:
        faults = structure(data, error)
        lines = "\n".join(f"{os.fspath(path)}: {field}: {text}" for field, text in faults)
        raise InvalidInput(lines, faults[0][0]) from None
    with meaning(path, data, ""):
        return _build(path, data, table)


def _build(path: StrPath, data: Any, table: RobotTable) -> Robot:
    def length(value: Any) -> Any:
        if table.length_unit == "m" or value is None:
            return value
        return [metres(one) for one in value] if isinstance(value, list) else metres(value)

    def frame(matrix: Matrix | None) -> Matrix | None:
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
    base, tool = frame(table.base), frame(table.tool)
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


def tables_of(robot: Robot) -> dict[str, Any]:
    """Tables of a robot file, keys in the order of reading."""
    spine = robot.backbone
    backbone = _keep_given(
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
    return _keep_given(
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
    return _keep_given(
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


def _keep_given(table: type[BaseModel], **values: Any) -> dict[str, Any]:
    """Values that differ from the defaults of a table."""
    fields = table.model_fields
    given = {key: value for key, value in values.items() if value is not None}
    return {key: value for key, value in given.items() if value != fields[key].default}


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
