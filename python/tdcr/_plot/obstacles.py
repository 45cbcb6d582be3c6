"""Surfaces of obstacles as polygons, cut to what a picture shows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdcr import _core

__all__ = ["is_endless", "section", "surface"]

Points = NDArray[np.float64]

_AROUND, _ALONG, _CELLS, _GRID = 48, 24, 14, 181


def surface(obstacle: Any, low: Points, high: Points) -> Points | None:
    """Polygons of an obstacle's surface whose middle is in a box.

    Parameters
    ----------
    obstacle : Obstacle
    low, high : ndarray, shape (3,)
        The box, in the world [m]. What is infinite is cut to it.

    Returns
    -------
    ndarray, shape (m, 3 or 4, 3), or None
        Corners [m]; None for a `SignedDistance`, which has no surface to draw.
    """
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    polygons: Points
    match obstacle:
        case _core.Sphere():
            polygons = _capsule(obstacle.center, obstacle.center, obstacle.radius)
        case _core.Capsule():
            polygons = _capsule(obstacle.a, obstacle.b, obstacle.radius)
        case _core.Cylinder():
            axis = obstacle.axis
            foot = obstacle.point + axis * ((middle - obstacle.point) @ axis)
            rings = [(foot + s * axis, obstacle.radius) for s in np.linspace(-1, 1, 41) * size]
            polygons = _lathe(rings, axis)
        case _core.HalfSpace():
            normal = obstacle.normal
            foot = middle - normal * ((middle - obstacle.point) @ normal)
            one, other = _across(normal)
            polygons = _patch(foot, size * one, size * other, 3 * _CELLS)
        case _core.Box():
            axes = obstacle.rotation.T * obstacle.half_extents[:, None]
            sides = [(s * axes[i], axes[i - 2], axes[i - 1]) for i in range(3) for s in (-1, 1)]
            polygons = np.concatenate(
                [_patch(obstacle.center + out, one, other, _CELLS) for out, one, other in sides]
            )
        case _core.Mesh():
            polygons = obstacle.vertices[obstacle.faces]
            near = (polygons.max(axis=1) >= low) & (polygons.min(axis=1) <= high)
            polygons = polygons[near.all(axis=1)]
            return polygons
        case _:
            return None
    places = polygons.mean(axis=1)
    kept: Points = polygons[((places >= low) & (places <= high)).all(axis=1)]
    return kept


def is_endless(obstacle: Any) -> bool:
    """Presence of a surface without an end, of which a picture shows a part."""
    return isinstance(obstacle, (_core.Cylinder, _core.HalfSpace))


def section(
    obstacle: Any, origin: Points, across: Points, up: Points, low: Points, high: Points
) -> tuple[Points, Points, Points]:
    """Signed distances on a grid of a plane, for contours.

    Parameters
    ----------
    obstacle : Obstacle
        Of any kind.
    origin, across, up : ndarray, shape (3,)
        A point of the plane [m] and its axes.
    low, high : ndarray, shape (2,)
        Corners of the grid along the axes [m].

    Returns
    -------
    tuple of ndarray
        Coordinates (m,) and (m,) [m], distances (m, m) [m].
    """
    u, v = (np.linspace(low[i], high[i], _GRID) for i in (0, 1))
    points = origin + u[None, :, None] * across + v[:, None, None] * up
    return u, v, obstacle.distance(points.reshape(-1, 3)).reshape(_GRID, _GRID)


def _across(axis: Points) -> tuple[Points, Points]:
    """Two unit vectors across a unit vector and each other."""
    one = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    one /= np.linalg.norm(one)
    return one, np.cross(axis, one)


def _lathe(rings: list[tuple[Points, float]], axis: Points) -> Points:
    """Quadrilaterals between rings (centre, radius) around an axis."""
    one, other = _across(axis)
    turn = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)[:, None]
    rim = np.cos(turn) * one + np.sin(turn) * other
    grid = np.array([centre + radius * rim for centre, radius in rings])
    return _cells(grid)


def _capsule(a: Points, b: Points, radius: float) -> Points:
    length = float(np.linalg.norm(b - a))
    axis = (b - a) / length if length > 0 else np.array([0.0, 0.0, 1.0])
    rings = []
    for end, start in ((a, -np.pi / 2), (b, 0.0)):
        for angle in np.linspace(start, start + np.pi / 2, _ALONG // 2 + 1):
            rings.append((end + radius * np.sin(angle) * axis, radius * float(np.cos(angle))))
    return _lathe(rings, axis)


def _patch(middle: Points, one: Points, other: Points, cells: int) -> Points:
    """Quadrilaterals of the parallelogram with these half sides."""
    share = np.linspace(-1.0, 1.0, cells + 1)
    return _cells(middle + share[:, None, None] * one + share[None, :, None] * other)


def _cells(grid: Points) -> Points:
    corners = [grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]]
    return np.stack(corners, axis=2).reshape(-1, 4, 3)
