"""Codecs of inverses."""

from __future__ import annotations

from typing import Any

import numpy as np

from tdcr._forward.codecs import statuses
from tdcr._inverse.results import Inverse, InverseBatch
from tdcr._io.codecs import Columns, Readers, read_nested, register, value_codec, write_value
from tdcr._io.field_reader import FieldReader
from tdcr._io.tables import force_unit, point_columns, row_columns, tendon_columns


def _target(reader: FieldReader, name: str) -> Any:
    """Position, frame, or positions of all disks."""
    sizes = _sizes(reader.get(name))
    if len(sizes) == 2 and sizes[1] == 3:
        return reader.array(name, -1, 3)
    return reader.array(name, *((4, 4) if len(sizes) == 2 else (3,)))


def _targets(reader: FieldReader, name: str) -> Any:
    """Positions or frames of all rows."""
    sizes = _sizes(reader.get(name))
    # In JSON no row tells what the others would be.
    frames = reader.flag("frames") if sizes == (0,) else len(sizes) == 3
    return reader.array(name, "B", *((4, 4) if frames else (3,)))


def _sizes(value: Any) -> tuple[int, ...]:
    """Shape of an array, or of lists by the first ones in them."""
    if isinstance(value, np.ndarray):
        return tuple(value.shape)
    sizes = []
    while isinstance(value, list):
        sizes.append(len(value))
        value = value[0] if value else None
    return tuple(sizes)


_BOTH: Readers = {
    "robot": FieldReader.robot,
    "model": FieldReader.model,
    "settings": FieldReader.settings,
    "bounds": lambda r, name: r.optional(name, ("Bounds",)),
    "search": lambda r, name: r.optional(name, ("InverseSettings",)),
    "method": lambda r, name: r.text(name, "newton", "pso"),
    "obstacles": FieldReader.objects,
    "loads": lambda r, name: r.optional(name, ("Loads",)),
}
_ONE: Readers = {
    "target": _target,
    "displacements": lambda r, name: r.array(name, "K"),
    "tensions": lambda r, name: r.array(name, "K"),
    "status": FieldReader.status,
    "message": FieldReader.text,
    "error": FieldReader.number,
    "rotation_error": FieldReader.number,
    "iterations": FieldReader.whole,
    "starts": FieldReader.whole,
    "hits": FieldReader.whole,
    "known_shape": lambda r, name: None if r.get(name) is None else read_nested(r, name, "Shape"),
}
_ROWS: Readers = {
    "targets": _targets,
    "displacements": lambda r, name: r.array(name, "B", "K"),
    "tensions": lambda r, name: r.array(name, "B", "K"),
    "status": statuses,
    "ok": lambda r, name: r.array(name, "B", dtype=np.bool_),
    "error": lambda r, name: r.array(name, "B"),
    "rotation_error": lambda r, name: r.array(name, "B"),
    "iterations": lambda r, name: r.array(name, "B", dtype=np.uint64),
    "starts": lambda r, name: r.array(name, "B", dtype=np.uint64),
}


def _write_batch(batch: InverseBatch) -> dict[str, Any]:
    return write_value(batch) | {"frames": batch.targets.ndim == 3}


def _batch_columns(batch: InverseBatch) -> Columns:
    """Table of the answers, a row per target."""
    targets, tendons = batch.targets, batch.robot.tendon_names
    return {
        **row_columns(batch),
        **point_columns("target ", targets[:, :3, 3] if targets.ndim == 3 else targets),
        **{"error [m]": batch.error, "rotation error [rad]": batch.rotation_error},
        **tendon_columns("displacement", tendons, batch.displacements, "m"),
        **tendon_columns("tension", tendons, batch.tensions, force_unit(batch.robot)),
    }


register(value_codec(Inverse, _BOTH | _ONE, instead="; its shape can be saved as .csv"))
register(
    value_codec(
        InverseBatch, _BOTH | _ROWS, write=_write_batch, columns=_batch_columns, has_rows=True
    )
)
