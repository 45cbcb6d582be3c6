"""Lengths of files as metres: the floats nearest to their decimal numbers."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal
from math import isfinite

__all__ = ["metres", "to_metres"]


def metres(millimetres: float) -> float:
    """Length in m of one in mm.

    25.333 mm is exactly the float 0.025333; ``25.333 / 1000`` is its neighbour.
    """
    return float(Decimal(repr(float(millimetres))).scaleb(-3))


def to_metres(values: Iterable[float], unit: str) -> list[float]:
    """Lengths in m of those in m or mm; what is not finite stays."""
    if unit == "m":
        return list(values)
    return [metres(value) if isfinite(value) else value for value in values]
