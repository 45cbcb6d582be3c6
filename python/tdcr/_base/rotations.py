"""Rotation vectors: their matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array: TypeAlias = NDArray[np.float64]

__all__ = ["rotation"]


def rotation(vector: Array) -> Array:
    """Rotation matrix of a rotation vector [rad], by Rodrigues' formula."""
    x, y, z = vector
    angle, cross = np.linalg.norm(vector), np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # sin(a)/a and (1 - cos(a))/a^2, the latter by half angles.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / 2 / np.pi) ** 2
    turned: Array = np.eye(3) + first * cross + second * cross @ cross
    return turned
