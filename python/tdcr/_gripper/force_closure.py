"""Force closure: contacts that can hold a body against any force and moment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tdcr import _core

if TYPE_CHECKING:
    from tdcr._core import Contact, Shape

__all__ = ["place_on_object", "positively_span", "wrenches"]

Array = NDArray[np.float64]

_TOLERANCE = 1e-9


def place_on_object(shape: Shape, contact: Contact) -> Array:
    """Find where the object is touched, shape (3,) [m].

    A contact's own point is the robot's: for "center" that of the disk, a body's radius away.
    """
    away = contact.gap
    if contact.kind == "center" and isinstance(shape.settings, _core.RodSettings):
        away += shape.settings.body_radius
    place: Array = contact.point - away * contact.normal
    return place


def wrenches(points: Array, pushes: Array, friction: float, edges: int) -> Array:
    """Wrenches that contacts can put on a body, up to their size.

    Parameters
    ----------
    points, pushes : ndarray, shape (m, 3)
        Places from any origin [m], and unit vectors into the body.
    friction : float
        Coulomb's coefficient; 0 leaves the pushes alone.
    edges : int
        Of the pyramid that stands for each friction cone, inscribed.

    Returns
    -------
    ndarray, shape (6, m) or (6, m * edges)
        Forces, then moments in units of the mean distance of the points, unit columns.
    """
    points = points - points.mean(axis=0)
    forces = []
    for push in pushes:
        one = np.cross(push, np.eye(3)[np.abs(push).argmin()])
        one /= np.linalg.norm(one)
        other = np.cross(push, one)
        turn = 2 * np.pi * np.arange(edges if friction > 0 else 1)[:, None] / edges
        forces.append(push + friction * (np.cos(turn) * one + np.sin(turn) * other))
    size = np.linalg.norm(points, axis=1).mean() or 1.0
    moments = [np.cross(at / size, force) for at, force in zip(points, forces, strict=True)]
    found: Array = np.vstack([np.concatenate(forces).T, np.concatenate(moments).T])
    found /= np.linalg.norm(found, axis=0)
    return found


def positively_span(columns: Array) -> bool:
    """Tell if sums of the columns with factors >= 0 reach everywhere.

    They do if and only if the columns span the space and some sum with all factors positive is
    zero: the origin is then inside their convex hull. Scaled, the factors are 1 + x with x >= 0, so
    that ``columns @ x = -columns.sum(axis=1)`` has such a solution, which phase 1 of the simplex
    method tells.
    """
    if np.linalg.matrix_rank(columns, tol=_TOLERANCE) < len(columns):
        return False
    return _feasible(columns, -columns.sum(axis=1))


def _feasible(a: Array, b: Array) -> bool:
    """Tell if ``a @ x = b`` has a solution x >= 0; Bland's rule, which ends."""
    rows, count = a.shape
    sign = np.where(b < 0, -1.0, 1.0)
    table = np.hstack([a * sign[:, None], np.eye(rows), (b * sign)[:, None]])
    basis = np.arange(count, count + rows)
    scale = max(1.0, float(np.abs(b).max()))
    # Sum of the artificial variables, and its slopes by the others.
    cost = -table.sum(axis=0)
    while (entering := np.flatnonzero(cost[:count] < -_TOLERANCE)).size:
        column = entering[0]
        able = np.flatnonzero(table[:, column] > _TOLERANCE)
        if not able.size:
            break
        ratios = table[able, -1] / table[able, column]
        least = able[ratios <= ratios.min() + _TOLERANCE * scale]
        row = least[basis[least].argmin()]
        table[row] /= table[row, column]
        for other in range(rows):
            if other != row:
                table[other] -= table[other, column] * table[row]
        cost = cost - cost[column] * table[row]
        basis[row] = column
    left = table[basis >= count, -1].sum()
    return bool(left <= _TOLERANCE * scale)
