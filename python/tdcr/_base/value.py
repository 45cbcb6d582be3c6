"""Results as values: compared, hashed, copied and pickled as such."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar

import numpy as np

__all__ = ["Value", "rebuild", "same"]


class Value:
    """Base of frozen dataclasses: equal by their fields, NaN to NaN; copies are read-only."""

    _hashed: ClassVar[tuple[str, ...]]

    def __eq__(self, other: object) -> bool:
        """Compare field by field, but for a message."""
        if type(other) is not type(self):
            return NotImplemented
        mine, theirs = self.__getstate__(), other.__getstate__()
        return all(same(mine[name], theirs[name]) for name in mine if name != "message")

    def __hash__(self) -> int:
        """Hash by the fields that tell one from another."""
        return hash(tuple(_key(getattr(self, name)) for name in self._hashed))

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields."""
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take the fields, arrays read-only."""
        self.__dict__.update({name: _read_only(value) for name, value in state.items()})


def rebuild(kind: Any, *values: Any) -> Any:
    """Return a named tuple from its values, arrays read-only: its way out of a pickle."""
    return kind(*map(_read_only, values))


def _read_only(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    if type(value) in (list, tuple):
        return type(value)(_read_only(item) for item in value)
    if isinstance(value, dict):
        return {name: _read_only(item) for name, item in value.items()}
    return value


def same(mine: Any, theirs: Any) -> bool:
    """Compare arrays by their numbers, NaN to NaN, containers by items, others as they are."""
    if isinstance(mine, dict) and isinstance(theirs, dict):
        return mine.keys() == theirs.keys() and all(same(mine[name], theirs[name]) for name in mine)
    if isinstance(mine, list | tuple) and type(mine) is type(theirs):
        return len(mine) == len(theirs) and all(map(same, mine, theirs))
    if isinstance(mine, np.ndarray) and isinstance(theirs, np.ndarray):
        return np.array_equal(mine, theirs, equal_nan=mine.dtype.kind == "f")
    if isinstance(mine, np.ndarray) or isinstance(theirs, np.ndarray):
        return False
    # NaN alone differs from itself.
    return bool(mine == theirs) or bool(mine != mine and theirs != theirs)


def _key(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        # + 0.0: negative zeros are equal to zeros, and NaN to NaN.
        return value.shape, np.where(np.isnan(value), np.nan, value + 0.0).tobytes()
    return value
