"""Structure of robot files: keys, types and units, as pydantic models.

Bounds such as "above 0" go into the JSON schema only, for editors: the constructors check them.
Tags start with "~" so that they can be told from keys in the location of a fault.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, WithJsonSchema

__all__ = [
    "TENDON_TABLES",
    "AnglesTable",
    "BackboneTable",
    "HelicalTable",
    "HolesTable",
    "Matrix",
    "RobotTable",
    "robot_schema",
]

Positive = Annotated[float, WithJsonSchema({"type": "number", "exclusiveMinimum": 0})]
Count = Annotated[int, WithJsonSchema({"type": "integer", "minimum": 1})]
Index = Annotated[int, WithJsonSchema({"type": "integer", "minimum": 0})]


def _one_or_many(value: Any) -> str:
    return "~many" if isinstance(value, list) else "~one"


_Select = Discriminator(_one_or_many)
Numbers = Annotated[Annotated[float, Tag("~one")] | Annotated[list[float], Tag("~many")], _Select]
Positives = Annotated[
    Annotated[Positive, Tag("~one")] | Annotated[list[Positive], Tag("~many")], _Select
]
Counts = Annotated[Annotated[Count, Tag("~one")] | Annotated[list[Count], Tag("~many")], _Select]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Row = Annotated[list[float], Field(min_length=4, max_length=4)]
Matrix = Annotated[list[Row], Field(min_length=4, max_length=4)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class BackboneTable(_Table):
    """The flexible spine, cut into subsegments by the disks 0 (base) to n (tip)."""

    length: Positives = Field(
        description="Length of the backbone, or of each of its stretches, base first [length_unit]."
    )
    subsegments: Counts = Field(
        description="Number of equal subsegments of the backbone, or of each stretch; n in all."
    )
    poisson_ratio: float = Field(
        0.35,
        description="Poisson's ratio of the material, above -1, at most 0.5 [1].",
        json_schema_extra={"exclusiveMinimum": -1, "maximum": 0.5},
    )
    rest: list[Vector] | None = Field(
        None,
        description="Rest rotation vector (about x, y, z of its base disk) of each of the n "
        "subsegments of a pre-bent backbone [rad]. Default: straight.",
    )
    youngs_modulus: Positive | None = Field(
        None,
        description="Young's modulus [Pa], always in SI. With it and the diameter, forces come "
        "out in newtons.",
    )
    diameter: Positives | None = Field(
        None,
        description="Diameter of the round backbone, or of each of the n subsegments "
        "[length_unit].",
    )
    disk_radius: Positive | None = Field(
        None,
        description="Outer radius of the disks [length_unit]; holes outside it are refused.",
    )


class _TendonTable(_Table):
    end: Count | None = Field(
        None, description="Disk where the tendon terminates, 1 to n. Default: the tip."
    )
    stiffness: Positive | None = Field(
        None, description="Axial stiffness EA of the cable [N]. Default: rigid."
    )
    name: str | None = Field(
        None, description='Name of the tendon. Default: "t0", "t1", ... by its place.'
    )


class AnglesTable(_TendonTable):
    """A tendon by azimuth and radius of its holes; both constant is straight routing."""

    routing: Literal["angles"] = Field("angles", description="How the holes are described.")
    azimuth: Numbers = Field(
        description="Azimuth of the hole, counter-clockwise about +z from +x: one for all disks, "
        "or one for each of the disks 0..end [rad]."
    )
    radius: Positives = Field(
        description="Distance of the hole from the disk centre: one for all disks, or one for each "
        "of the disks 0..end [length_unit]."
    )


class HelicalTable(_TendonTable):
    """A tendon whose azimuth grows linearly with arc length from the base to its end."""

    routing: Literal["helical"] = Field(description="How the holes are described.")
    azimuth: float = Field(description="Azimuth of the hole in disk 0 [rad].")
    radius: Positive = Field(
        description="Distance of the holes from the disk centre [length_unit]."
    )
    turns: float = Field(
        1.0, description="Turns from base to end, positive counter-clockwise about +z [1]."
    )


class HolesTable(_TendonTable):
    """A tendon by the numbers of the holes it passes."""

    routing: Literal["holes"] = Field(description="How the holes are described.")
    indices: list[Index] = Field(
        description="Hole number on each of the disks 0..end, from 0, counter-clockwise."
    )
    count: Count = Field(description="Number of evenly spaced holes per disk.")
    radius: Positives = Field(
        description="Distance of the holes from the disk centre: one for all disks, or one for "
        "each of the disks 0..end [length_unit]."
    )
    azimuth: float = Field(0.0, description="Azimuth of hole 0 [rad].")


TENDON_TABLES: dict[str, type[_TendonTable]] = {
    "angles": AnglesTable,
    "helical": HelicalTable,
    "holes": HolesTable,
}


def _routing(table: Any) -> str | None:
    if not isinstance(table, dict):
        return "~angles"
    routing = table.get("routing", "angles")
    return f"~{routing}" if isinstance(routing, str) and routing in TENDON_TABLES else None


AnyTendon = Annotated[
    Annotated[AnglesTable, Tag("~angles")]
    | Annotated[HelicalTable, Tag("~helical")]
    | Annotated[HolesTable, Tag("~holes")],
    Discriminator(_routing, custom_error_type="routing", custom_error_message="routing"),
]


class RobotTable(_Table):
    """A tendon-driven continuum robot."""

    model_config = ConfigDict(title="tdcr robot file")

    format: Literal[1] = Field(description="Version of this file format: 1.")
    length_unit: Literal["m", "mm"] = Field(
        description="Unit of every length in this file. Everything else is SI (rad, Pa, N)."
    )
    name: str | None = Field(None, description="Name of the robot.")
    base: Matrix | None = Field(
        None,
        description="Frame of disk 0 in the world: homogeneous matrix by rows, rotation [1], "
        "translation in the last column [length_unit]. Default: identity.",
    )
    tool: Matrix | None = Field(
        None,
        description="Frame of the tool in the frame of the tip disk: homogeneous matrix by rows, "
        "translation in the last column [length_unit]. Default: identity.",
    )
    backbone: BackboneTable = Field(description="The flexible spine.")
    tendons: list[AnyTendon] = Field(
        description="The cables; displacements and results follow their order."
    )
    schema_reference: str | None = Field(
        None, alias="$schema", description="JSON schema of this file, for editors; not read."
    )


def robot_schema() -> dict[str, Any]:
    """JSON schema of robot files, for editors.

    Returns
    -------
    dict
        Draft 2020-12; titles, descriptions and units for every key.
    """
    schema = RobotTable.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
