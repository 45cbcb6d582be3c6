"""Manipulability: measures of a Jacobian."""

from __future__ import annotations

import math
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from tdcr._base.value import rebuild
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Manipulability", "manipulability"]

_PARTS = {"position": slice(0, 3), "rotation": slice(3, 6), "pose": slice(0, 6)}


class Manipulability(NamedTuple):
    """Measures of the velocities that a unit of displacement speed gives."""

    value: Any
    """Volume of the ellipsoid of velocities over that of the unit ball: sqrt(det(J J^T)), 0 where
    a direction is lost."""
    condition: Any
    """Longest over shortest axis of the ellipsoid; infinite where a direction is lost."""
    axes: NDArray[np.float64]
    """Lengths of the ellipsoid's axes, longest first, (3,) or (6,)."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy with arrays that stay read-only."""
        return rebuild, (type(self), *self)


def manipulability(
    jacobian: ArrayLike,
    *,
    part: Literal["position", "rotation", "pose"] = "position",
    radian: float | None = None,
) -> Manipulability:
    """Measure how evenly a Jacobian moves the tool (Yoshikawa's manipulability).

    Parameters
    ----------
    jacobian : array_like, shape (..., 6, K)
        Velocity, then angular velocity, per metre of displacement, as `tdcr.jacobian` gives it.
    part : {"position", "rotation", "pose"}, optional
        Which rows count.
    radian : float, optional
        What one radian counts [m]; needed for "pose", where metres and radians meet.

    Returns
    -------
    Manipulability
        Units of the axes: m/m for a position and a pose, rad/m for a rotation. Arrays (...) for a
        stack of Jacobians, read-only; infinite where a number is too large to represent.

    Raises
    ------
    InvalidInput
        Another shape, numbers that are not finite, an unknown part, a pose without `radian`.
    TypeError
        Text, complex numbers, a `radian` that is not one number.

    Notes
    -----
    T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985,
    doi:10.1177/027836498500400201.
    """
    matrix = _check_jacobians(jacobian)
    if not isinstance(part, str):
        raise TypeError(f"part: expected a string, got {type(part).__name__}")
    if part not in _PARTS:
        names = ", ".join(f'"{name}"' for name in _PARTS)
        raise InvalidInput(f"part: expected one of {names}, got {part!r}", "part")
    length = _length(radian)
    if part == "pose" and length is None:
        expected = "what one radian counts, a positive number [m], for a pose"
        raise InvalidInput(f"radian: expected {expected}, got None", "radian")
    # Rows of the part at the scale of 1, angles as lengths, singular values.
    matrix, size = _unit(matrix[..., _PARTS[part], :])
    if part == "pose":
        weights = np.array([1.0, 1.0, 1.0, length, length, length])
        matrix, again = _unit(matrix * weights[:, None])
    rows, columns = matrix.shape[-2:]
    axes = np.zeros((*matrix.shape[:-2], rows))
    axes[..., : min(rows, columns)] = np.linalg.svd(matrix, compute_uv=False)
    # What rounding leaves of a lost direction is none.
    axes[axes < 1e-12 * axes[..., :1]] = 0.0
    lost = axes[..., -1] == 0.0
    # Numbers too large to represent are infinite.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        condition = np.where(lost, np.inf, axes[..., 0] / axes[..., -1])
        if part == "pose":
            size = size * again
        axes = np.where(axes > 0.0, axes * size[..., None], 0.0)
        value = np.where(lost, 0.0, axes.prod(axis=-1))
    for array in (axes, condition, value):
        array.flags.writeable = False
    if matrix.ndim == 2:
        return Manipulability(float(value), float(condition), axes)
    return Manipulability(value, condition, axes)


def _check_jacobians(jacobian: ArrayLike) -> NDArray[np.float64]:
    """Jacobians as an array, or say what is wrong with them."""
    try:
        given = np.asarray(jacobian)
    except ValueError as error:
        message = f"jacobian: expected a rectangular array of numbers, got {error}"
        raise InvalidInput(message, "jacobian") from None
    if given.dtype.kind not in "fiu":
        kind = f"{type(jacobian).__name__} of dtype {given.dtype}"
        raise TypeError(f"jacobian: expected real numbers, got {kind}")
    matrix = given.astype(np.float64)
    if matrix.ndim < 2 or matrix.shape[-2] != 6:
        raise InvalidInput(f"jacobian: expected shape (..., 6, K), got {matrix.shape}", "jacobian")
    if not np.isfinite(matrix).all():
        raise InvalidInput("jacobian: expected finite numbers, got others", "jacobian")
    return matrix


def _length(radian: float | None) -> float | None:
    """Check what one radian counts."""
    if radian is None:
        return None
    if not isinstance(radian, Real):
        raise TypeError(f"radian: expected a number [m], got {type(radian).__name__}")
    try:
        length = float(radian)
    except OverflowError:
        length = math.inf
    if not (math.isfinite(length) and length > 0):
        raise InvalidInput(f"radian: expected a positive finite number [m], got {radian}", "radian")
    return length


def _unit(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrices over their largest entries, and these: singular values of huge ones overflow."""
    size = np.abs(matrix).max(axis=(-2, -1), initial=0.0)
    size = np.where(size > 0.0, size, 1.0)
    return matrix / size[..., None, None], size
