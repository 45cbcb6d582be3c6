"""Parameters that a fit estimates, and the measured rows without gaps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Robot

    Array: TypeAlias = NDArray[np.float64]

__all__ = ["NAMES", "PER_TENDON", "SIZES", "Measured"]

PER_TENDON = ("offset", "gain", "radius", "azimuth", "stiffness")
# Numbers of values by name, K of a robot with K tendons.
SIZES: dict[str, int | str] = {
    **dict.fromkeys(PER_TENDON, "K"),
    **{"poisson_ratio": 1, "rest": 2, "base": 6},
}
NAMES = tuple(SIZES)
# Measured points are no further from the base than so many lengths.
_FARTHEST = 1e6


@dataclass(frozen=True)
class Measured:
    """Rows without gaps: displacements (rows, K) and points (rows, points, 3)."""

    displacements: Array
    points: Array
    rows: NDArray[np.int64]
    dropped: int

    @staticmethod
    def checked(robot: Robot, displacements: ArrayLike, measurements: ArrayLike) -> Measured:
        """Check shapes and drop rows with gaps."""
        pulls = _numbers("displacements", displacements)
        points = _numbers("measurements", measurements)
        tendons, disks = len(robot.tendons), robot.backbone.count + 1
        if pulls.ndim != 2 or pulls.shape[1] != tendons:
            message = f"displacements: expected shape (B, {tendons}), got shape {pulls.shape}"
            raise InvalidInput(message, "displacements")
        rows = len(pulls)
        if rows == 0:
            message = "measurements: expected at least one row, got none"
            raise InvalidInput(message, "measurements")
        if points.shape not in ((rows, 3), (rows, disks, 3)):
            raise InvalidInput(
                f"measurements: expected one row per displacement, shape ({rows}, 3) or "
                f"({rows}, {disks}, 3), got shape {points.shape}",
                "measurements",
            )
        if np.isinf(points).any():
            message = "measurements: expected finite positions, or NaN for gaps, got inf"
            raise InvalidInput(message, "measurements")
        points = points.reshape(rows, -1, 3)
        far = np.abs(points - robot.base[:3, 3]) / robot.backbone.total_length
        if np.nanmax(far, initial=0.0) > _FARTHEST:
            raise InvalidInput(
                f"measurements: expected positions within {_FARTHEST:g} lengths of the robot from "
                f"its base [m], got one {np.nanmax(far):.3g} lengths away",
                "measurements",
            )
        full = ~np.isnan(points).any(axis=(1, 2)) & ~np.isnan(pulls).any(axis=1)
        if not full.any():
            message = f"measurements: expected a row without NaN, got none in {rows}"
            raise InvalidInput(message, "measurements")
        dropped = rows - int(full.sum())
        return Measured(pulls[full], points[full], np.flatnonzero(full), dropped)


def _numbers(argument: str, given: ArrayLike) -> Array:
    try:
        array = np.asarray(given)
    except ValueError as error:
        message = f"{argument}: expected a rectangular array of numbers, got {error}"
        raise InvalidInput(message, argument) from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{argument}: expected numbers, got dtype {array.dtype}")
    return array.astype(np.float64)
