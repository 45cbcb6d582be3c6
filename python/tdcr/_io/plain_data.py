"""Plain data of objects in files, and back through their constructors."""

from __future__ import annotations

from typing import Any

import numpy as np

from tdcr import _core
from tdcr._base.models import MODELS
from tdcr._base.status import Status
from tdcr._core import Contact, Robot, SignedDistance
from tdcr.errors import InvalidInput

__all__ = ["LENGTHS", "OBSTACLES", "from_plain", "to_plain"]

# Obstacles that files may name, with the positional arguments of their constructors.
OBSTACLES = {
    "Sphere": ("center", "radius"),
    "Cylinder": ("point", "axis", "radius"),
    "HalfSpace": ("point", "normal"),
    "Capsule": ("a", "b", "radius"),
    "Box": ("center", "half_extents", "rotation"),
    "Mesh": ("vertices", "faces"),
}
# Arguments of them that are lengths or places; the others have no unit.
LENGTHS = ("a", "b", "center", "half_extents", "point", "radius", "vertices")
_SETTINGS = (
    *(settings.__name__ for settings in MODELS.values()),
    *("InverseSettings", "PrebendSettings", "PsoSettings", "RoutingSettings"),
)
# All that files may name, likewise.
_ARGUMENTS: dict[str, tuple[str, ...]] = {
    **OBSTACLES,
    **dict.fromkeys((*_SETTINGS, "Bounds", "Loads"), ()),
    "Contact": ("disk", "kind", "tendon", "obstacle", "point", "normal", "gap", "force"),
}
_INFINITE = {"inf": np.inf, "-inf": -np.inf}


def to_plain(value: Any, name: str) -> Any:
    """Plain data and arrays of a value of a result.

    Parameters
    ----------
    value : object
        Robots, settings, obstacles, contacts, loads, status; containers and arrays of such.
    name : str
        Of the field, for the error.

    Raises
    ------
    InvalidInput
        A `SignedDistance`: it is made of functions.
    """
    match value:
        case Robot():
            from tdcr._io.robot_tables import tables_of

            return tables_of(value)
        case Status():
            return str(value)
        case SignedDistance():
            expected = f"{name}: expected obstacles that are data"
            message = f"{expected}, got a SignedDistance, whose Python functions no file can hold"
            raise InvalidInput(message, name)
        case np.ndarray() if value.dtype == object:
            return np.array([str(one) for one in value], dtype=np.str_)
        case dict():
            return {key: to_plain(one, f"{name}.{key}") for key, one in value.items()}
        case list() | tuple():
            return [to_plain(one, f"{name}[{i}]") for i, one in enumerate(value)]
    # Objects, by the arguments of their constructors; anything else is plain.
    kind = type(value).__name__
    if kind not in _ARGUMENTS:
        return value
    if isinstance(value, Contact):
        positional, keywords = value.__getnewargs__(), {}
    else:
        positional, keywords = value.__getnewargs_ex__()
    given = dict(zip(_ARGUMENTS[kind], positional, strict=True)) | keywords
    return {"type": kind, **{key: to_plain(one, f"{name}.{key}") for key, one in given.items()}}


def from_plain(data: Any, kinds: tuple[str, ...]) -> Any:
    """Build what `to_plain` said, one of some kinds.

    Raises
    ------
    InvalidInput
        Another kind, or arguments that its constructor refuses.
    """
    kind = data.get("type") if isinstance(data, dict) else None
    if not isinstance(kind, str) or kind not in kinds or kind not in _ARGUMENTS:
        got = repr(kind) if isinstance(kind, str) else f"no type in {type(data).__name__}"
        raise InvalidInput(f"type: expected one of {', '.join(kinds)}, got {got}", "type")
    given = {key: _argument(value) for key, value in data.items() if key != "type"}
    try:
        built = getattr(_core, kind)(**given)
    except (TypeError, OverflowError) as error:
        raise InvalidInput(f"{kind}: {error}", "type") from None
    return built


def _argument(value: Any) -> Any:
    match value:
        case str() if value in _INFINITE:
            return _INFINITE[value]
        case list():
            return tuple(map(_argument, value))
        case {"type": "PsoSettings" | "RodSettings" as kind}:
            return from_plain(value, (kind,))
    return value
