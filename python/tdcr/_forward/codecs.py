"""Codecs of shapes and of batches of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from tdcr import _core
from tdcr._base.status import Status
from tdcr._forward.batch import CONTACT, ShapeBatch
from tdcr._io.codecs import Codec, Columns, register
from tdcr._io.field_reader import FieldReader
from tdcr._io.plain_data import to_plain
from tdcr._io.tables import force_unit, point_columns, row_columns, tendon_columns

__all__ = ["batch_columns", "column", "statuses", "write_batch"]

_STATE = (
    "robot", "model", "settings", "displacements", "frames", "strains", "tendon_lengths",
    "tensions", "energy",
)  # fmt: skip
_OUTCOME = ("status", "message", "residual", "iterations")
_AROUND = ("obstacles", "loads", "contacts")


def _write_shape(shape: Any) -> dict[str, Any]:
    _, (*state, outcome, around) = shape.__reduce__()
    own = dict(zip((*_STATE, *_OUTCOME, *_AROUND), (*state, *outcome, *around), strict=True))
    # For readers without tdcr; not read back.
    own |= {"ok": shape.ok, "units": shape.units, "positions": shape.positions}
    own |= {"tip": shape.tip, "tendon_points": shape.tendon_points}
    own["tendon_names"] = list(shape.robot.tendon_names)
    return {name: to_plain(value, name) for name, value in own.items()}


def _read_shape(reader: FieldReader) -> Any:
    robot = reader.robot()
    model = reader.model()
    settings = reader.settings()
    rows = reader.sizes["n"] * getattr(settings, "elements", 1)
    wide = bool(np.shape(reader.array("strains", rows, -1))[1] == 4)
    frames = reader.array("frames", "n+1", 4, 4)
    if not np.array_equal(frames[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (len(frames), 1))):
        raise reader.fault("frames", "expected homogeneous matrices, with last rows 0 0 0 1")
    contacts = reader.objects("contacts", ("Contact",))
    obstacles = reader.objects("obstacles")
    ends = [tendon.end or reader.sizes["n"] for tendon in robot.tendons]
    for i, contact in enumerate(contacts):
        there = contact.disk <= reader.sizes["n"] and contact.obstacle < len(obstacles)
        if contact.tendon is not None:
            there = there and contact.tendon < len(ends) and contact.disk <= ends[contact.tendon]
        if not there:
            raise reader.fault(f"contacts[{i}]", "of a disk, tendon or obstacle that is not there")
    state = (
        reader.array("displacements", "K"),
        frames,
        reader.array("strains", rows, 4 if wide else 3),
        reader.array("tendon_lengths", "K"),
        reader.array("tensions", "K"),
        reader.number("energy"),
        (
            str(reader.status()),
            reader.text("message"),
            reader.number("residual"),
            reader.whole("iterations"),
        ),
        (obstacles, reader.optional("loads", ("Loads",)), list(contacts)),
    )
    with reader.at("model"):
        return _core._shape(robot, model, settings, *state)


def _shape_columns(shape: Any) -> Columns:
    disks = np.arange(len(shape.positions))
    return {"disk": disks, **point_columns("", shape.positions)}


def statuses(reader: FieldReader, name: str) -> Any:
    """Status of every row."""
    words = reader.array(name, "B", dtype=np.str_)
    try:
        found = np.array([Status(word) for word in words.tolist()], dtype=object)
    except ValueError as error:
        raise reader.fault(name, f"expected words of tdcr.Status, got {error}") from None
    found.flags.writeable = False
    return found


# Fields that any number of rows may have, by name, with what each row holds.
_COLUMNS: dict[str, tuple[Any, ...]] = {
    "tip": (4, 4),
    "frames": ("n+1", 4, 4),
    "positions": ("n+1", 3),
    "tendon_lengths": ("K",),
    "tensions": ("K",),
    "energy": (),
    "residual": (),
}


def column(reader: FieldReader, name: str, value: Any, settings: Any) -> Any:
    """Column of a batch or a workspace."""
    if name == "strains":
        rows = reader.sizes["n"] * getattr(settings, "elements", 1)
        long = getattr(settings, "axial", False) or getattr(settings, "extensible", False)
        return reader.convert(name, value, ("B", rows, 4 if long else 3), np.float64)
    if name not in _COLUMNS:
        raise reader.fault(name, f"expected one of {', '.join(_COLUMNS)}, strains")
    return reader.convert(name, value, ("B", *_COLUMNS[name]), np.float64)


def write_batch(batch: Any) -> dict[str, Any]:
    """Fields of a batch."""
    names = ("robot", "model", "settings", "displacements", "obstacles", "loads", "warm")
    always = ("status", "ok", "residual", "iterations")
    own = {name: getattr(batch, name) for name in (*names, *always, *batch.fields)}
    return {name: to_plain(value, name) for name, value in own.items()}


def _read_batch(reader: FieldReader) -> ShapeBatch:
    robot, model = reader.robot(), reader.model()
    settings, given = reader.settings(), reader.array("displacements", "B", "K")
    columns = {
        "status": statuses(reader, "status"),
        "ok": reader.array("ok", "B", dtype=np.bool_),
        "residual": reader.array("residual", "B"),
        "iterations": reader.array("iterations", "B", dtype=np.uint64),
    }
    for name in _core._fields():
        if name not in reader.fields:
            continue
        value = reader.get(name)
        if name == "tendon_points":
            columns[name] = _points(reader, robot, value)
        elif name == "contacts":
            columns[name] = _contacts(reader, value)
        else:
            columns[name] = column(reader, name, value, settings)
    loads = reader.optional("loads", ("Loads",))
    around = reader.objects("obstacles")
    return ShapeBatch(robot, given, model, settings, columns, reader.flag("warm"), around, loads)


def _points(reader: FieldReader, robot: Any, value: Any) -> Any:
    if not isinstance(value, list) or len(value) != reader.sizes["K"]:
        raise reader.fault("tendon_points", "expected a list of an array for every tendon")
    ends = [tendon.end or reader.sizes["n"] for tendon in robot.tendons]
    return [
        reader.convert(f"tendon_points[{k}]", one, ("B", end + 1, 3), np.float64)
        for k, (one, end) in enumerate(zip(value, ends, strict=True))
    ]


def _contacts(reader: FieldReader, value: Any) -> Any:
    """Table of contacts: of JSON a column by name."""
    names = CONTACT.names or ()
    if isinstance(value, np.ndarray):
        if value.dtype != CONTACT or value.ndim != 1:
            raise reader.fault("contacts", f"expected a table of {', '.join(names)}")
        table = value.copy()
    else:
        if not isinstance(value, dict) or set(value) != set(names):
            raise reader.fault("contacts", f"expected columns {', '.join(names)}")
        rows = value["row"]
        table = np.empty(len(rows) if isinstance(rows, list) else 0, CONTACT)
        for name in names:
            own = CONTACT[name]
            sizes = (len(table), *own.shape)
            table[name] = reader.convert(f"contacts.{name}", value[name], sizes, own.base)
    rows = table["row"]
    if len(rows) and not (rows.min() >= 0 and rows.max() < reader.sizes["B"]):
        raise reader.fault("contacts", f"expected rows below {reader.sizes['B']}")
    table.flags.writeable = False
    return table


def batch_columns(batch: ShapeBatch) -> Columns:
    """Table of a batch, a row per solve: displacements, and fields but those of many numbers."""
    fields, tendons = batch.fields, batch.robot.tendon_names
    columns = row_columns(batch) | tendon_columns("displacement", tendons, batch.displacements, "m")
    whole = [batch.frames[:, :, :3, 3]] if "frames" in fields else []
    whole += [batch.positions] if "positions" in fields else []
    if "tip" in fields:
        columns |= point_columns("tip ", batch.tip[:, :3, 3])
    for disk in range(whole[0].shape[1] if whole else 0):
        columns |= point_columns(f"disk {disk} ", whole[0][:, disk])
    if "tendon_lengths" in fields:
        columns |= tendon_columns("length", tendons, batch.tendon_lengths, "m")
    if "tensions" in fields:
        columns |= tendon_columns("tension", tendons, batch.tensions, force_unit(batch.robot))
    if "energy" in fields:
        joule = batch.robot.backbone.youngs_modulus and batch.robot.backbone.diameter
        columns[f"energy [{'J' if joule else '1/m'}]"] = batch.energy
    return columns


register(Codec("Shape", _write_shape, _read_shape, columns=_shape_columns))
register(Codec("ShapeBatch", write_batch, _read_batch, columns=batch_columns, has_rows=True))
