"""How well a robot moves its tool: measures of a Jacobian."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

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
        stack of Jacobians.

    Raises
    ------
    InvalidInput
        Another shape, numbers that are not finite, an unknown part, a pose without `radian`.

    Notes
    -----
    T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985,
    doi:10.1177/027836498500400201.
    """
    matrix = np.asarray(jacobian, dtype=np.float64)
    if matrix.ndim < 2 or matrix.shape[-2] != 6:
        raise InvalidInput(f"jacobian: expected shape (..., 6, K), got {matrix.shape}", "jacobian")
    if not np.isfinite(matrix).all():
        raise InvalidInput("jacobian: expected finite numbers, got others", "jacobian")
    if part not in _PARTS:
        names = ", ".join(f'"{name}"' for name in _PARTS)
        raise InvalidInput(f"part: expected one of {names}, got {part!r}", "part")
    if part == "pose":
        if radian is None or not (np.isfinite(radian) and radian > 0):
            expected = "what one radian counts, a positive number [m], for a pose"
            raise InvalidInput(f"radian: expected {expected}, got {radian}", "radian")
        scale = np.array([1.0, 1.0, 1.0, radian, radian, radian])
        matrix = matrix * scale[:, None]
    matrix = matrix[..., _PARTS[part], :]
    rows, columns = matrix.shape[-2:]
    axes = np.zeros((*matrix.shape[:-2], rows))
    count = min(rows, columns)
    axes[..., :count] = np.linalg.svd(matrix, compute_uv=False)
    # What rounding leaves of a lost direction is none.
    lost = axes < 1e-12 * axes[..., :1]
    axes[lost] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = np.where(axes[..., -1] > 0, axes[..., 0] / axes[..., -1], np.inf)
    axes.flags.writeable = False
    value = axes.prod(axis=-1)
    if matrix.ndim == 2:
        return Manipulability(float(value), float(condition), axes)
    return Manipulability(value, condition, axes)
