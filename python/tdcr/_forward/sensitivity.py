"""Derivatives of a rod by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tdcr._base.value import rebuild

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Gradient", "Variation"]


class Variation(NamedTuple):
    """Change of a shape, by `Sensitivity.forward`. Arrays are read-only."""

    strains: NDArray[np.float64]
    """Change of every element's strain, as in `Shape.strains`: rotation [rad] and elongation."""
    tensions: NDArray[np.float64]
    """Change of each tension, (K,), in the unit of `Shape.tensions`; 0 where one does not count."""
    velocities: NDArray[np.float64]
    """Change of each disk's centre, (n + 1, 3), world axes [m]."""
    spins: NDArray[np.float64]
    """Rotation of each disk, (n + 1, 3), about world axes [rad]."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle so that arrays stay read-only."""
        return rebuild, (type(self), *self)


class Gradient(NamedTuple):
    """A gradient by all that a rod is made of, by `Sensitivity.adjoint`. Arrays are read-only."""

    displacements: NDArray[np.float64]
    """By each displacement, (K,); 0 where a tendon does not count."""
    rest: NDArray[np.float64]
    """By each subsegment's rest rotation vector, (n, 3)."""
    holes: list[NDArray[np.float64]]
    """By each tendon's holes, K arrays (end + 1, 3), in the frames of the disks."""
    lengths: NDArray[np.float64]
    """By each subsegment's length at constant bending stiffness EI, (n,)."""
    poisson_ratio: float
    """By Poisson's ratio at constant bending stiffness EI."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle so that arrays stay read-only."""
        return rebuild, (type(self), *self)
