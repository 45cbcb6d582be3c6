"""Codecs of designs and fits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tdcr._io.codecs import Readers, read_nested, register, value_codec
from tdcr._io.field_reader import FieldReader
from tdcr.design.fit_problem import SIZES
from tdcr.design.fitting import Fit
from tdcr.design.prebending import Prebend
from tdcr.design.tendon_routing import Routing


def _holes(reader: FieldReader, name: str) -> tuple[tuple[int, ...], ...] | None:
    """Hole numbers of every tendon, disk 0 to its end."""
    value, tendons = reader.get(name), reader.sizes["K"]
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != tendons:
        raise reader.fault(name, f"expected a list of hole numbers for each of {tendons} tendons")
    rows = (reader.convert(f"{name}[{k}]", own, (-1,), np.int64) for k, own in enumerate(value))
    return tuple(tuple(row.tolist()) for row in rows)


def _bounds(reader: FieldReader, name: str) -> tuple[Any, Any] | None:
    """Lowest and highest displacements."""
    value = reader.get(name)
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 2:
        raise reader.fault(name, "expected a list of lowest and highest displacements")
    low, high = (
        reader.convert(f"{name}[{i}]", own, ("K",), np.float64) for i, own in enumerate(value)
    )
    return low, high


def _parameters(reader: FieldReader, name: str) -> dict[str, Any]:
    """Values of each fitted parameter."""
    value = reader.get(name)
    if not isinstance(value, dict):
        raise reader.fault(name, f"expected values by name, got {value!r}"[:200])
    unknown = [key for key in value if key not in SIZES]
    if unknown:
        raise reader.fault(f"{name}.{unknown[0]}", f"expected one of {', '.join(SIZES)}")
    return {
        key: reader.convert(f"{name}.{key}", own, (SIZES[key],), np.float64)
        for key, own in value.items()
    }


_DESIGN: Readers = {
    "robot": FieldReader.robot,
    "shape": lambda r, name: read_nested(r, name, "Shape"),
    "error": lambda r, name: r.array(name, "n+1"),
    "iterations": FieldReader.whole,
    "status": FieldReader.status,
    "message": FieldReader.text,
    "target_positions": lambda r, name: r.array(name, "n", 3),
}
_PREBEND: Readers = {
    "settings": lambda r, name: r.object(name, ("PrebendSettings",)),
    "clearance": lambda r, name: None if r.get(name) is None else r.number(name),
}
_ROUTING: Readers = {
    "displacements": lambda r, name: r.array(name, "K"),
    "holes": _holes,
    "rms": FieldReader.number,
    "relaxed_rms": FieldReader.number,
    "optimality": lambda r, name: r.text(name, "reached", "exhaustive", "searched"),
    "evaluations": FieldReader.whole,
    "settings": lambda r, name: r.object(name, ("RoutingSettings",)),
    "bounds": _bounds,
}
_FIT: Readers = {
    "robot": FieldReader.robot,
    "parameters": _parameters,
    "standard_errors": _parameters,
    "residuals": lambda r, name: r.array(name, "B", "points", 3),
    "residuals_before": lambda r, name: r.array(name, "B", "points", 3),
    "rows": lambda r, name: r.array(name, "B", dtype=np.int64),
    "validation": lambda r, name: r.array(name, "B", dtype=np.bool_),
    "dropped": FieldReader.whole,
    "failed": FieldReader.whole,
    "status": FieldReader.status,
    "message": FieldReader.text,
    "iterations": FieldReader.whole,
    "seed": lambda r, name: r.whole(name, math.inf),
}

_SHAPE = "; its shape can be saved as .csv"
register(value_codec(Prebend, _DESIGN | _PREBEND, home="tdcr.design", instead=_SHAPE))
register(value_codec(Routing, _DESIGN | _ROUTING, home="tdcr.design", instead=_SHAPE))
register(value_codec(Fit, _FIT, home="tdcr.design"))
