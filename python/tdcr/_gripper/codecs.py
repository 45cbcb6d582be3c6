"""Codec of grasps: their shapes share robots and obstacles, which are written once."""

from __future__ import annotations

from typing import Any

from tdcr._gripper.grasp import Grasp
from tdcr._io.codecs import Codec, find_codec, register, write_nested
from tdcr._io.field_reader import FieldReader
from tdcr._io.plain_data import to_plain


def _place(pool: list[Any], thing: Any) -> int:
    """Index of a thing in a pool, which it joins where no equal is in it."""
    if thing not in pool:
        pool.append(thing)
    return pool.index(thing)


def _write(grasp: Grasp) -> dict[str, Any]:
    robots: list[Any] = []
    obstacles: list[Any] = []

    def write_shape(shape: Any) -> dict[str, Any]:
        shared = {
            "robot": _place(robots, shape.robot),
            "obstacles": [_place(obstacles, one) for one in shape.obstacles],
        }
        return write_nested(shape) | shared

    shapes = [[write_shape(shape) for shape in row] for row in grasp.shapes]
    return {
        "robots": to_plain(robots, "robots"),
        "obstacles": to_plain(obstacles, "obstacles"),
        "shares": grasp.shares,
        "shapes": shapes,
    }


def _read(reader: FieldReader) -> Grasp:
    shares = reader.array("shares", "steps")
    robots, obstacles, rows = (_list(reader, name) for name in ("robots", "obstacles", "shapes"))
    if len(rows) != len(shares):
        raise reader.fault("shapes", f"expected shapes of {len(shares)} steps, got {len(rows)}")
    shapes = []
    for step, row in enumerate(rows):
        name = f"shapes[{step}]"
        if not isinstance(row, list) or not row or len(row) != len(rows[0]):
            raise reader.fault(name, "expected the shape of every finger")
        shapes.append(
            tuple(
                _read_shape(reader, f"{name}[{k}]", one, robots, obstacles)
                for k, one in enumerate(row)
            )
        )
    return Grasp(shares, tuple(shapes))


def _read_shape(
    reader: FieldReader, name: str, value: Any, robots: list[Any], obstacles: list[Any]
) -> Any:
    if not isinstance(value, dict) or value.get("kind") != "Shape":
        raise reader.fault(name, "expected the fields of a Shape")
    codec = find_codec("Shape")
    assert codec is not None, "the room of shapes has registered it"
    own = FieldReader(f"{reader.path}: {name}", value)
    places = own.get("obstacles")
    if not isinstance(places, list):
        raise own.fault("obstacles", f"expected a list, got {places!r}"[:200])
    shared = {
        "robot": _pick(own, "robot", own.get("robot"), robots),
        "obstacles": [_pick(own, f"obstacles[{i}]", at, obstacles) for i, at in enumerate(places)],
    }
    return codec.read(FieldReader(own.path, value | shared))


def _pick(reader: FieldReader, name: str, place: Any, pool: list[Any]) -> Any:
    if type(place) is not int or not 0 <= place < len(pool):
        raise reader.fault(name, f"expected a place below {len(pool)}, got {place!r}"[:200])
    return pool[place]


def _list(reader: FieldReader, name: str) -> list[Any]:
    value = reader.get(name)
    if not isinstance(value, list):
        raise reader.fault(name, f"expected a list, got {value!r}"[:200])
    return value


register(Codec("Grasp", _write, _read, robot="its .shapes[0] have those of its fingers"))
