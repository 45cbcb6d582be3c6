"""Rotation vectors: their matrices, and the angular velocities of their entries."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array: TypeAlias = NDArray[np.float64]

__all__ = ["rotation", "spins"]


def _cross(vector: Array) -> tuple[float, Array]:
    """Length of a vector, and the matrix of its cross product."""
    x, y, z = vector
    return float(np.linalg.norm(vector)), np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def spins(vector: Array) -> Array:
    """Rows: angular velocity by each entry of a rotation vector, the left Jacobian's columns."""
    angle, cross = _cross(vector)
    second = 0.5 * np.sinc(angle / 2 / np.pi) ** 2
    # (a - sin(a))/a^3, by its series where that cancels.
    third = (angle - np.sin(angle)) / angle**3 if angle > 1e-2 else 1 / 6 - angle**2 / 120
    spins: Array = (np.eye(3) + second * cross + third * cross @ cross).T
    return spins


def rotation(vector: Array) -> Array:
    """Rotation matrix of a rotation vector [rad], by Rodrigues' formula."""
    angle, cross = _cross(vector)
    # sin(a)/a and (1 - cos(a))/a^2, the latter by half angles.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / 2 / np.pi) ** 2
    turned: Array = np.eye(3) + first * cross + second * cross @ cross
    return turned
