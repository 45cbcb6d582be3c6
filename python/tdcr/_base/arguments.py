"""Checks of arguments that do not go through the core, with its words."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr._core import Obstacle, Robot
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array: TypeAlias = NDArray[np.float64]

__all__ = ["index", "number", "numbers", "several_obstacles", "tendons_of", "vector", "whole"]


def several_obstacles(obstacles: Any) -> tuple[Any, ...]:
    """Give one obstacle or several as a tuple, which nobody can change.

    What is among them and no obstacle the core refuses.
    """
    if isinstance(obstacles, Obstacle):
        return (obstacles,)
    if not isinstance(obstacles, Iterable):
        got = type(obstacles).__name__
        raise TypeError(f"obstacles: expected an obstacle or a sequence of obstacles, got {got}")
    return tuple(obstacles)


def tendons_of(robot: Any) -> int:
    """Count the tendons of a robot; what is none is a TypeError."""
    if not isinstance(robot, Robot):
        raise TypeError(f"robot: expected a Robot, got {type(robot).__name__}")
    return len(robot.tendons)


def whole(name: str, value: Any, least: int | None = None) -> int:
    """Give an integer, numpy's too, that is not below the least; what is none is a TypeError."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__"):
        raise TypeError(f"{name}: expected an int, got {type(value).__name__}")
    try:
        found = operator.index(value)
    except TypeError:  # an array of more than one number has the method and refuses
        raise TypeError(f"{name}: expected an int, got {type(value).__name__}") from None
    if least is not None and found < least:
        raise InvalidInput(f"{name}: expected {least} or more, got {found}", name)
    return found


def index(name: str, value: Any, first: int, count: int) -> int:
    """Give an integer from the first to count - 1."""
    found = whole(name, value)
    if not first <= found < count:
        range_ = f"an index from {first} to {count - 1}"
        none = f"the index of an {name}, of which there are none"
        raise InvalidInput(f"{name}: expected {range_ if count else none}, got {found}", name)
    return found


def number(name: str, value: Any) -> float:
    """Give a float, infinite or NaN too; what is no real number is a TypeError."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")
    try:
        return float(value)
    except OverflowError:
        return -math.inf if value < 0 else math.inf


def numbers(name: str, value: Any) -> Array:
    """Give an array of floats of any shape, a copy."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        message = f"{name}: expected a rectangular array of numbers, got {error}"
        raise InvalidInput(message, name) from None
    if array.dtype.kind not in "fiu":
        got = f"{type(value).__name__} of dtype {array.dtype}"
        raise TypeError(f"{name}: expected numbers, got {got}")
    return array.astype(np.float64)


def vector(name: str, value: Any, unit: str = "") -> Array:
    """Give three finite numbers."""
    array = numbers(name, value)
    if array.shape != (3,):
        message = f"{name}: expected three numbers, shape (3,), got shape {array.shape}"
        raise InvalidInput(message, name)
    if not np.isfinite(array).all():
        message = f"{name}: expected three finite numbers{unit}, got {array.tolist()}"
        raise InvalidInput(message, name)
    return array
