"""What files of results hold: for each kind its fields, as they are written and read."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from tdcr import _core
from tdcr._base.status import Status
from tdcr._forward.batch import CONTACT, ShapeBatch
from tdcr._inverse.results import Inverse, InverseBatch
from tdcr._io.field_reader import Record
from tdcr._io.plain_data import described
from tdcr._workspace.results import Workspace

__all__ = ["KINDS", "Kind"]

_MODELS = ("rod", "linkage", "constant_curvature")
_STATE = (
    "robot", "model", "settings", "displacements", "frames", "strains", "tendon_lengths",
    "tensions", "energy",
)  # fmt: skip
_OUTCOME = ("status", "message", "residual", "iterations")
_AROUND = ("obstacles", "loads", "contacts")


class Kind(NamedTuple):
    """How results of a kind become fields of a file, and back."""

    said: Callable[[Any], dict[str, Any]]
    read: Callable[[Record], Any]


def _shape_said(shape: Any) -> dict[str, Any]:
    _, (*state, outcome, around) = shape.__reduce__()
    own = dict(zip((*_STATE, *_OUTCOME, *_AROUND), (*state, *outcome, *around), strict=True))
    # For readers without tdcr; not read back.
    own |= {"ok": shape.ok, "units": shape.units, "positions": shape.positions}
    own |= {"tip": shape.tip, "tendon_points": shape.tendon_points}
    own["tendon_names"] = list(shape.robot.tendon_names)
    return {name: described(value, name) for name, value in own.items()}


def _shape_read(record: Record) -> Any:
    robot = record.robot()
    model = record.text("model", *_MODELS)
    settings = record.settings()
    rows = record.sizes["n"] * getattr(settings, "elements", 1)
    wide = bool(np.shape(record.array("strains", rows, -1))[1] == 4)
    frames = record.array("frames", "n+1", 4, 4)
    if not np.array_equal(frames[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (len(frames), 1))):
        raise record.fault("frames", "expected homogeneous matrices, with last rows 0 0 0 1")
    contacts = record.things("contacts", ("Contact",))
    obstacles = record.things("obstacles")
    ends = [tendon.end or record.sizes["n"] for tendon in robot.tendons]
    for i, contact in enumerate(contacts):
        known = contact.disk <= record.sizes["n"] and contact.obstacle < len(obstacles)
        if contact.tendon is not None:
            known = known and contact.tendon < len(ends) and contact.disk <= ends[contact.tendon]
        if not known:
            raise record.fault(f"contacts[{i}]", "of a disk, tendon or obstacle that is not there")
    state = (
        record.array("displacements", "K"),
        frames,
        record.array("strains", rows, 4 if wide else 3),
        record.array("tendon_lengths", "K"),
        record.array("tensions", "K"),
        record.number("energy"),
        (
            str(record.status()),
            record.text("message"),
            record.number("residual"),
            record.whole("iterations"),
        ),
        (obstacles, record.optional("loads", ("Loads",)), list(contacts)),
    )
    with record.at("model"):
        return _core._shape(robot, model, settings, *state)


_INVERSE: dict[str, Callable[[Record, str], Any]] = {
    "robot": Record.robot,
    "displacements": lambda r, name: r.array(name, *_rows(r), "K"),
    "tensions": lambda r, name: r.array(name, *_rows(r), "K"),
    "status": lambda r, name: _statuses(r, name) if _rows(r) else r.status(name),
    "ok": lambda r, name: r.array(name, "B", dtype=np.bool_),
    "message": Record.text,
    "error": lambda r, name: r.array(name, "B") if _rows(r) else r.number(name),
    "rotation_error": lambda r, name: r.array(name, "B") if _rows(r) else r.number(name),
    "iterations": lambda r, name: _count(r, name),
    "starts": lambda r, name: _count(r, name),
    "hits": Record.whole,
    "model": lambda r, name: r.text(name, *_MODELS),
    "settings": Record.settings,
    "bounds": lambda r, name: r.optional(name, ("Bounds",)),
    "search": lambda r, name: r.optional(name, ("InverseSettings",)),
    "method": lambda r, name: r.text(name, "newton", "pso"),
    "target": lambda r, name: _places(r, name),
    "targets": lambda r, name: _places(r, name),
    "obstacles": Record.things,
    "loads": lambda r, name: r.optional(name, ("Loads",)),
    "known_shape": lambda r, name: _shape_within(r, name),
}


def _rows(record: Record) -> tuple[str, ...]:
    return ("B",) if record.fields["kind"] == "InverseBatch" else ()


def _count(record: Record, name: str) -> Any:
    return record.array(name, "B", dtype=np.uint64) if _rows(record) else record.whole(name)


def _places(record: Record, name: str) -> Any:
    """Positions or frames, or the places of all disks."""
    sizes = _sizes(record.get(name))
    if not _rows(record) and len(sizes) == 2 and sizes[1] == 3:
        return record.array(name, -1, 3)
    frames = len(sizes) - len(_rows(record)) == 2
    if sizes == (0,) and _rows(record):
        # In JSON no row tells what the others would be.
        frames = record.flag("frames")
    return record.array(name, *_rows(record), *((4, 4) if frames else (3,)))


def _sizes(value: Any) -> tuple[int, ...]:
    """Shape of an array, or of lists as the first ones in them tell."""
    if isinstance(value, np.ndarray):
        return tuple(value.shape)
    sizes = []
    while isinstance(value, list):
        sizes.append(len(value))
        value = value[0] if value else None
    return tuple(sizes)


def _shape_within(record: Record, name: str) -> Any:
    """Give a shape that is a field, or None."""
    value = record.get(name)
    if value is None:
        return None
    if not isinstance(value, dict) or value.get("kind") != "Shape":
        raise record.fault(name, "expected the fields of a Shape")
    return _shape_read(Record(f"{record.path}: {name}", value))


def _statuses(record: Record, name: str) -> Any:
    words = record.array(name, "B", dtype=np.str_)
    try:
        found = np.array([Status(word) for word in words.tolist()], dtype=object)
    except ValueError as error:
        raise record.fault(name, f"expected words of tdcr.Status, got {error}") from None
    found.flags.writeable = False
    return found


def _value_said(result: Any) -> dict[str, Any]:
    said: dict[str, Any] = {}
    for field in fields(result):
        value = getattr(result, field.name)
        if isinstance(value, _core.Shape):
            said[field.name] = {"kind": "Shape", **_shape_said(value)}
        else:
            said[field.name] = described(value, field.name)
    if isinstance(result, InverseBatch):
        said["frames"] = result.targets.ndim == 3
    return said


def _inverse_read(kind: Any) -> Callable[[Record], Any]:
    def read(record: Record) -> Any:
        robot = record.robot()
        names = [field.name for field in fields(kind) if field.name != "robot"]
        return kind(robot=robot, **{name: _INVERSE[name](record, name) for name in names})

    return read


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


def _column(record: Record, name: str, value: Any, settings: Any) -> Any:
    """Check a column of a batch or a workspace."""
    if name == "strains":
        rows = record.sizes["n"] * getattr(settings, "elements", 1)
        long = getattr(settings, "axial", False) or getattr(settings, "extensible", False)
        return record.converted(name, value, ("B", rows, 4 if long else 3), np.float64)
    if name not in _COLUMNS:
        raise record.fault(name, f"expected one of {', '.join(_COLUMNS)}, strains")
    return record.converted(name, value, ("B", *_COLUMNS[name]), np.float64)


def _batch_said(batch: Any) -> dict[str, Any]:
    names = ("robot", "model", "settings", "displacements", "obstacles", "loads", "warm")
    always = ("status", "ok", "residual", "iterations")
    own = {name: getattr(batch, name) for name in (*names, *always, *batch.fields)}
    return {name: described(value, name) for name, value in own.items()}


def _batch_read(record: Record) -> ShapeBatch:
    robot, model = record.robot(), record.text("model", *_MODELS)
    settings, given = record.settings(), record.array("displacements", "B", "K")
    columns = {
        "status": _statuses(record, "status"),
        "ok": record.array("ok", "B", dtype=np.bool_),
        "residual": record.array("residual", "B"),
        "iterations": record.array("iterations", "B", dtype=np.uint64),
    }
    for name in _core._fields():
        if name not in record.fields:
            continue
        value = record.get(name)
        if name == "tendon_points":
            columns[name] = _points(record, robot, value)
        elif name == "contacts":
            columns[name] = _contacts(record, value)
        else:
            columns[name] = _column(record, name, value, settings)
    loads = record.optional("loads", ("Loads",))
    around = record.things("obstacles")
    return ShapeBatch(robot, given, model, settings, columns, record.flag("warm"), around, loads)


def _points(record: Record, robot: Any, value: Any) -> Any:
    if not isinstance(value, list) or len(value) != record.sizes["K"]:
        raise record.fault("tendon_points", "expected a list of an array for every tendon")
    ends = [tendon.end or record.sizes["n"] for tendon in robot.tendons]
    return [
        record.converted(f"tendon_points[{k}]", one, ("B", end + 1, 3), np.float64)
        for k, (one, end) in enumerate(zip(value, ends, strict=True))
    ]


def _contacts(record: Record, value: Any) -> Any:
    """Table of contacts: of JSON a column by name."""
    names = CONTACT.names or ()
    if isinstance(value, np.ndarray):
        if value.dtype != CONTACT or value.ndim != 1:
            raise record.fault("contacts", f"expected a table of {', '.join(names)}")
        table = value.copy()
    else:
        if not isinstance(value, dict) or set(value) != set(names):
            raise record.fault("contacts", f"expected columns {', '.join(names)}")
        rows = value["row"]
        table = np.empty(len(rows) if isinstance(rows, list) else 0, CONTACT)
        for name in names:
            own = CONTACT[name]
            sizes = (len(table), *own.shape)
            table[name] = record.converted(f"contacts.{name}", value[name], sizes, own.base)
    rows = table["row"]
    if len(rows) and not (rows.min() >= 0 and rows.max() < record.sizes["B"]):
        raise record.fault("contacts", f"expected rows below {record.sizes['B']}")
    table.flags.writeable = False
    return table


def _workspace_read(record: Record) -> Workspace:
    robot, settings = record.robot(), record.settings()
    given = record.array("displacements", "B", "K")
    codes = record.array("codes", "B", dtype=np.uint8)
    if codes.size and codes.max() >= len(Status):
        raise record.fault("codes", f"expected places below {len(Status)}, got {codes.max()}")
    values = record.get("values")
    if not isinstance(values, dict):
        raise record.fault("values", f"expected columns by name, got {values!r}"[:200])
    return Workspace(
        robot=robot,
        ranges=record.array("ranges", "K", 2),
        displacements=given,
        tips=record.array("tips", "B", 3),
        directions=record.array("directions", "B", 3),
        codes=codes,
        values={name: _column(record, name, value, settings) for name, value in values.items()},
        model=record.text("model", *_MODELS),
        settings=settings,
        obstacles=record.things("obstacles"),
        loads=record.optional("loads", ("Loads",)),
        sampling=record.text("sampling", "sobol", "grid", "random"),  # type: ignore[arg-type]
        seed=record.whole("seed", math.inf),
    )


KINDS: dict[str, Kind] = {
    "Shape": Kind(_shape_said, _shape_read),
    "ShapeBatch": Kind(_batch_said, _batch_read),
    "Inverse": Kind(_value_said, _inverse_read(Inverse)),
    "InverseBatch": Kind(_value_said, _inverse_read(InverseBatch)),
    "Workspace": Kind(_value_said, _workspace_read),
}
"""Kinds of files by their names, which are those of the classes in `tdcr`."""
