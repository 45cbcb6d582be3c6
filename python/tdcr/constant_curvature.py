"""Constant curvature: between tendon displacements, arc parameters and frames.

The robot-dependent mapping (displacements to the curvature kappa, the azimuth phi of the bending
plane and the length ell of a segment, and back) and the robot-independent one (arc parameters to
frames), for any number of tendons. Source: "Constant-Curvature Model of Tendon-driven Continuum
Robots", opencontinuumrobotics.com; signs and frames are those of `tdcr`. For a whole robot use
``tdcr.forward(robot, displacements, model="constant_curvature")``.

>>> import numpy as np
>>> from tdcr import constant_curvature as cc
>>> azimuth = np.radians([0, 120, 240])
>>> cc.displacements_from_arc(5.0, np.radians(60), 0.1, azimuth, 0.008).round(6).tolist()
[-0.002, -0.002, 0.004]
>>> arc = cc.arc_from_displacements([-0.002, -0.002, 0.004], azimuth, 0.008, 0.1)
>>> round(arc.kappa, 9), round(float(np.degrees(arc.phi)), 9)
(5.0, 60.0)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from tdcr import _core
from tdcr._base.value import rebuild
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = [
    "ArcFit",
    "arc_from_displacements",
    "displacements_from_arc",
    "frames",
    "jacobian",
]


class ArcFit(NamedTuple):
    """Arc parameters of a segment, and what they leave of the displacements.

    For a batch every field has one row per row of the displacements.
    """

    kappa: Any
    """Curvature [1/m], 0 or more."""
    phi: Any
    """Azimuth of the bending plane [rad] in (-pi, pi]; 0 where the segment is straight."""
    ell: Any
    """Length [m]."""
    residual: Any
    """Displacement given minus displacement of the arc, (N,) or (B, N) [m]; 0 for tendons that do
    not count."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy with arrays that stay read-only."""
        return rebuild, (type(self), *self)


def arc_from_displacements(
    displacements: ArrayLike,
    azimuth: ArrayLike,
    radius: ArrayLike,
    length: float,
    *,
    ell: float | None = None,
    extensible: bool = False,
) -> ArcFit:
    """Fit the arc of one segment to its tendon displacements.

    Least squares over all tendons (the Clarke form when they are evenly spaced); the least bend
    where they span one direction only (one tendon, an antagonistic pair).

    Parameters
    ----------
    displacements : array_like, shape (N,) or (B, N)
        Change of each tendon's length inside the segment [m]: negative pulls, `inf` is free. A
        single tendon that counts and is released leaves the segment straight.
    azimuth : array_like, shape (N,)
        Azimuth of each tendon [rad].
    radius : float or array_like, shape (N,)
        Distance of each tendon from the backbone [m].
    length : float
        Rest length of the segment [m].
    ell : float, optional
        Length of the extended segment [m]. Default: the rest length.
    extensible : bool, optional
        Find the length too, instead of giving `ell`; at least three tendons must count.

    Returns
    -------
    ArcFit
        Of floats and a residual (N,), or of arrays for a batch.

    Raises
    ------
    InvalidInput
        NaN, -inf, shapes that do not fit, a radius or length that is not positive, an unknown
        length with fewer than three tendons that count, displacements that leave no length or
        overflow, `ell` together with `extensible`.
    """
    rows = _array("displacements", displacements)
    batch = rows.ndim == 2
    columns = _core._arc_from_displacements(
        np.atleast_2d(rows) if rows.ndim == 1 else rows,
        azimuth,
        np.atleast_1d(_array("radius", radius)),
        length,
        ell,
        extensible,
    )
    if batch:
        return ArcFit(*columns)
    kappa, phi, fitted, residual = columns
    return ArcFit(float(kappa[0]), float(phi[0]), float(fitted[0]), residual[0])


def displacements_from_arc(
    kappa: ArrayLike,
    phi: ArrayLike,
    ell: ArrayLike,
    azimuth: ArrayLike,
    radius: ArrayLike,
    *,
    length: float | None = None,
) -> Array:
    """Find the displacements that tendons have on an arc.

    Parameters
    ----------
    kappa, phi, ell : float or array_like, shape (B,)
        Arc parameters [1/m, rad, m].
    azimuth, radius
        Of the tendons, as for `arc_from_displacements`.
    length : float, optional
        Rest length of the segment [m]. Default: `ell`, a segment that is not extended.

    Returns
    -------
    ndarray, shape (N,) or (B, N)
        ``(ell - length) - radius * kappa * ell * cos(azimuth - phi)`` [m].

    Raises
    ------
    InvalidInput
        Parameters that are not finite, a negative curvature, lengths or radii that are not
        positive, angles and lengths above 1e150 rad or m, shapes that do not fit.
    """
    kappa, phi, ell = _array("kappa", kappa), _array("phi", phi), _array("ell", ell)
    single = kappa.ndim == phi.ndim == ell.ndim == 0
    answer: Array = _core._displacements_from_arc(
        *_arcs(kappa, phi, ell), azimuth, np.atleast_1d(_array("radius", radius)), length
    )
    return answer[0] if single else answer


def frames(
    kappa: ArrayLike,
    phi: ArrayLike,
    ell: ArrayLike,
    *,
    points: int = 10,
    base: ArrayLike | None = None,
    layout: Literal["homogeneous", "columns"] = "homogeneous",
) -> Array:
    """Compute frames along a chain of arcs, each starting where the last one ends.

    Parameters
    ----------
    kappa, phi, ell : float or array_like, shape (m,)
        Arc parameters of every segment, base first [1/m, rad, m].
    points : int, optional
        Frames per segment, its base and its tip included; at least 2.
    base : array_like, shape (4, 4), optional
        Frame of the first segment's base. Default: identity.
    layout : {"homogeneous", "columns"}, optional
        "columns" flattens every frame column by column, the layout of CRVisToolkit's `draw_tdcr`;
        `Shape.plotting_layout` has it for any robot.

    Returns
    -------
    ndarray, shape (m * points, 4, 4) or (m * points, 16)

    Raises
    ------
    InvalidInput
        As `displacements_from_arc`, and for fewer than 2 points or more than fit into memory, a
        base that is no rigid motion, or an unknown layout.
    """
    if layout not in ("homogeneous", "columns"):
        expected = '"homogeneous" or "columns"'
        raise InvalidInput(f"layout: expected {expected}, got {layout!r}", "layout")
    answer: Array = _core._arc_frames(*_arcs(kappa, phi, ell), points, base)
    if layout == "homogeneous":
        return answer
    flat = answer.transpose(0, 2, 1).reshape(-1, 16)
    flat.flags.writeable = False
    return flat


def jacobian(
    kappa: ArrayLike,
    phi: ArrayLike,
    ell: ArrayLike,
    *,
    base: ArrayLike | None = None,
    tool: ArrayLike | None = None,
) -> Array:
    """Differentiate the end of a chain of arcs by its arc parameters.

    Parameters
    ----------
    kappa, phi, ell : float or array_like, shape (m,)
        Arc parameters of every segment, base first [1/m, rad, m].
    base, tool : array_like, shape (4, 4), optional
        Frame of the first segment's base; frame of the tool in that of the last tip.

    Returns
    -------
    ndarray, shape (6, 3 m)
        Velocity of the tool point, then angular velocity, world axes; columns by kappa, phi and ell
        of the first segment, of the second, and so on. Exact, and finite where a segment is
        straight (its column by phi is zero there).

    Raises
    ------
    InvalidInput
        As `frames`.
    """
    answer: Array = _core._arc_jacobian(*_arcs(kappa, phi, ell), base, tool)
    return answer


def _arcs(kappa: ArrayLike, phi: ArrayLike, ell: ArrayLike) -> tuple[Array, Array, Array]:
    """One value of each per arc; scalars serve all arcs."""
    given = {"kappa": kappa, "phi": phi, "ell": ell}
    columns = {name: np.atleast_1d(_array(name, value)) for name, value in given.items()}
    count = max(column.shape[0] for column in columns.values())
    for name, column in columns.items():
        if count and not column.size:
            raise InvalidInput(f"{name}: expected one value or one per arc, got none", name)
    first, second, third = (
        np.repeat(column, count) if column.shape == (1,) else column for column in columns.values()
    )
    return first, second, third


def _array(argument: str, value: ArrayLike) -> NDArray[Any]:
    """Make an array; the core checks what is in it."""
    try:
        return np.asarray(value)
    except ValueError as error:
        message = f"{argument}: expected a rectangular array of numbers, got {error}"
        raise InvalidInput(message, argument) from None
