"""The fields of a file of results, checked one by one as they are read."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from tdcr._base.models import MODELS
from tdcr._base.status import Status
from tdcr._core import Robot
from tdcr._io.plain_data import OBSTACLES, from_plain
from tdcr.errors import InvalidInput

__all__ = ["FieldReader"]

_SETTINGS = tuple(settings.__name__ for settings in MODELS.values())
_WORDS = {None: np.nan, "inf": np.inf, "-inf": -np.inf}
_KINDS = {"f": "numbers", "i": "whole numbers", "u": "whole numbers", "b": "true or false"}

Size = int | str


class FieldReader:
    """Fields by name; a fault says path, field, what was expected and what was there.

    Sizes that are names (K tendons, n subsegments, B rows) are what they are at their first use.
    """

    def __init__(self, path: str | os.PathLike[str], fields: dict[str, Any]) -> None:
        self.path, self.fields = os.fspath(path), fields
        self.sizes: dict[str, int] = {}

    def fault(self, name: str, text: str) -> InvalidInput:
        return InvalidInput(f"{self.path}: {name}: {text}", name)

    @contextmanager
    def at(self, name: str) -> Iterator[None]:
        """Put path and field in front of what a constructor says."""
        try:
            yield
        except (InvalidInput, TypeError, OverflowError) as error:
            if str(error).startswith(self.path):
                raise
            raise self.fault(name, str(error)) from None

    def get(self, name: str) -> Any:
        if name not in self.fields:
            raise self.fault(name, f"missing from the file of a {self.fields['kind']}")
        return self.fields[name]

    def robot(self, name: str = "robot") -> Robot:
        from tdcr._io.robot_tables import build_robot

        robot = build_robot(f"{self.path}: {name}", self.get(name))
        self.sizes |= {"K": len(robot.tendons), "n": robot.backbone.count}
        self.sizes["n+1"] = robot.backbone.count + 1
        return robot

    def text(self, name: str, *among: str) -> str:
        value = self.get(name)
        if not isinstance(value, str) or (among and value not in among):
            expected = " or ".join(map(repr, among)) if among else "text"
            raise self.fault(name, f"expected {expected}, got {value!r}")
        return value

    def status(self, name: str = "status") -> Status:
        return Status(self.text(name, *map(str, Status)))

    def number(self, name: str) -> float:
        value = self.get(name)
        if value is None or (isinstance(value, str) and value in _WORDS):
            return float(_WORDS[value])
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fault(name, f"expected a number, got {value!r}"[:200])
        with self.at(name):
            return float(value)

    def whole(self, name: str, most: float = 2**63 - 1) -> int:
        value = self.get(name)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
            raise self.fault(name, f"expected a whole number, got {value!r}"[:200])
        return value

    def flag(self, name: str) -> bool:
        value = self.get(name)
        if not isinstance(value, bool):
            raise self.fault(name, f"expected true or false, got {value!r}")
        return value

    def model(self, name: str = "model") -> str:
        return self.text(name, *MODELS)

    def settings(self, name: str = "settings") -> Any:
        """Give the settings of a model, or None."""
        return self.optional(name, _SETTINGS)

    def optional(self, name: str, kinds: tuple[str, ...]) -> Any:
        value = self.get(name)
        if value is None:
            return None
        with self.at(name):
            return from_plain(value, kinds)

    def object(self, name: str, kinds: tuple[str, ...]) -> Any:
        """Object of one of some kinds."""
        with self.at(name):
            return from_plain(self.get(name), kinds)

    def objects(self, name: str, kinds: tuple[str, ...] = tuple(OBSTACLES)) -> tuple[Any, ...]:
        value = self.get(name)
        if not isinstance(value, list):
            raise self.fault(name, f"expected a list, got {value!r}")
        found = []
        for i, one in enumerate(value):
            with self.at(f"{name}[{i}]"):
                found.append(from_plain(one, kinds))
        return tuple(found)

    def array(self, name: str, *sizes: Size, dtype: Any = np.float64) -> Any:
        """Array of a shape, read-only; sizes of -1 may be any."""
        return self.convert(name, self.get(name), sizes, dtype)

    def convert(self, name: str, value: Any, sizes: tuple[Size, ...], dtype: Any) -> Any:
        wanted = np.dtype(dtype)
        if not isinstance(value, np.ndarray):
            value = self._array_of_lists(name, value, wanted)
            if not value.size:
                # Lists do not tell the sizes inside of none.
                inner = sizes[value.ndim :]
                known = (self.sizes.get(s, 0) if isinstance(s, str) else max(s, 0) for s in inner)
                value = value.reshape(*value.shape, *known)
        same_kind = value.dtype.kind == wanted.kind
        if not (value.dtype == wanted or (same_kind and np.can_cast(value.dtype, wanted))):
            what = f"{_KINDS.get(wanted.kind, 'text')} ({wanted})"
            raise self.fault(name, f"expected {what}, got dtype {value.dtype}")
        if len(value.shape) == len(sizes):
            for size, got in zip(sizes, value.shape, strict=True):
                if isinstance(size, str):
                    self.sizes.setdefault(size, got)
        expected = tuple(self.sizes.get(s, -1) if isinstance(s, str) else s for s in sizes)
        if len(expected) != value.ndim or any(
            size not in (-1, got) for size, got in zip(expected, value.shape, strict=True)
        ):
            shown = ", ".join("any" if size == -1 else str(size) for size in expected)
            raise self.fault(name, f"expected shape ({shown}), got {value.shape}")
        # A copy in memory order, that nothing else writes to.
        answer = np.array(value, wanted, order="C")
        answer.flags.writeable = False
        return answer

    def _array_of_lists(self, name: str, value: Any, wanted: np.dtype[Any]) -> Any:
        """Make an array of the lists of a JSON file."""
        if not isinstance(value, list):
            raise self.fault(name, f"expected an array, got {value!r}"[:200])
        if wanted.kind == "f":
            value = self._numbers(name, value)
        try:
            array = np.array(value)
        except ValueError:
            raise self.fault(name, "expected a rectangular array") from None
        if not array.size or (wanted.kind == "f" and array.dtype.kind in "iu"):
            return array.astype(wanted)
        if wanted.kind in "iu" and array.dtype.kind in "iu":
            low, high = np.iinfo(wanted).min, np.iinfo(wanted).max
            if array.min() < low or array.max() > high:
                raise self.fault(name, f"expected whole numbers from {low} to {high}")
            return array.astype(wanted)
        return array

    def _numbers(self, name: str, value: Any) -> Any:
        if isinstance(value, list):
            return [self._numbers(name, one) for one in value]
        if value is None or isinstance(value, str):
            if value not in _WORDS:
                raise self.fault(name, f"expected numbers, got {value!r}")
            return _WORDS[value]
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fault(name, f"expected numbers, got {value!r}"[:200])
        return value
