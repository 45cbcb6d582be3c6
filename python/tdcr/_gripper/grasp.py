"""Grasps: a closing gripper, step by step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tdcr import _core
from tdcr._base.arguments import index, number, vector, whole
from tdcr._base.value import Value
from tdcr._gripper.force_closure import place_on_object, positively_span, wrenches
from tdcr._io.save_load import Saved
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Contact, Shape

    Array = NDArray[np.float64]

__all__ = ["Grasp"]


@dataclass(frozen=True, eq=False)
class Grasp(Saved, Value):
    """A closing gripper, step by step; made by `Gripper.close`.

    Wherever a step is asked for, -1 is the last; `obstacle` is the index of the object. Others than
    there are raise InvalidInput.

    Attributes
    ----------
    shares : ndarray, shape (steps + 1,)
        Shares of the pull, 0 to 1.
    shapes : tuple of tuple of Shape
        `shapes[step][finger]`.
    """

    shares: Array
    shapes: tuple[tuple[Shape, ...], ...]

    _hashed: ClassVar[tuple[str, ...]] = ("shares", "shapes")

    @property
    def ok(self) -> bool:
        """True if every step of every finger converged."""
        return all(shape.ok for row in self.shapes for shape in row)

    @property
    def touch(self) -> tuple[float | None, ...]:
        """Share of the pull at the first step at which each finger touches, or None."""
        return tuple(
            next(
                (
                    float(share)
                    for share, shape in zip(self.shares, finger, strict=True)
                    if shape.ok and shape.contacts
                ),
                None,
            )
            for finger in zip(*self.shapes, strict=True)
        )

    def contacts(self, step: int = -1, *, obstacle: int = 0) -> list[tuple[int, Contact]]:
        """Return the contacts with the object at a step, each with the finger's number."""
        touching = self._touching(step, obstacle)
        return [(k, contact) for k, _, contact in touching]

    def _row(self, step: int) -> tuple[Shape, ...]:
        return self.shapes[index("step", step, -len(self.shapes), len(self.shapes))]

    def _touching(self, step: int, obstacle: int) -> list[tuple[int, Shape, Contact]]:
        row = self._row(step)
        obstacle = index("obstacle", obstacle, 0, len(row[0].obstacles))
        return [(k, s, c) for k, s in enumerate(row) for c in s.contacts if c.obstacle == obstacle]

    def center(self, step: int = -1, *, obstacle: int = 0) -> Array:
        """Return the centre of a Sphere, Box or Capsule, else of the places touched, (3,) [m].

        NaN where there are none of either.
        """
        touching = self._touching(step, obstacle)
        match self._row(step)[0].obstacles[obstacle]:
            case _core.Sphere() | _core.Box() as body:
                return body.center
            case _core.Capsule() as body:
                return (body.a + body.b) / 2
        places = [place_on_object(shape, contact) for _, shape, contact in touching]
        return np.mean(places, axis=0) if places else np.full(3, np.nan)

    def force(self, step: int = -1, *, obstacle: int = 0) -> Array:
        """Return the total force on the object, shape (3,), in the unit of the shapes."""
        forces = [-contact.force for _, contact in self.contacts(step, obstacle=obstacle)]
        return np.sum(forces, axis=0) if forces else np.zeros(3)

    def moment(self, about: ArrayLike | None = None, step: int = -1, *, obstacle: int = 0) -> Array:
        """Return the total moment on the object, shape (3,), in the unit of force times m.

        Parameters
        ----------
        about : array_like, shape (3,), optional
            The point about which it is taken [m]. Default: `center`.
        step, obstacle : int, optional
            Which step and object.
        """
        given = None if about is None else vector("about", about, " [m]")
        touching = self._touching(step, obstacle)
        if not touching:
            return np.zeros(3)
        at = self.center(step, obstacle=obstacle) if given is None else given
        arms = [place_on_object(shape, contact) - at for _, shape, contact in touching]
        total: Array = np.cross(arms, [-contact.force for _, _, contact in touching]).sum(axis=0)
        return total

    def force_closure(
        self, friction: float = 0.0, *, step: int = -1, obstacle: int = 0, edges: int = 8
    ) -> bool:
        """Tell if contacts at these places can balance any force and moment on the object.

        Of places and normals alone: forces as large as it takes. Without friction that needs seven
        contacts and no body of revolution; a ball is never held.

        Parameters
        ----------
        friction : float, optional
            Coulomb's coefficient.
        step, obstacle : int, optional
            Which step and object.
        edges : int, optional
            Of the pyramid inside each friction cone; more find closure a little earlier.

        Raises
        ------
        InvalidInput
            A coefficient that is negative or not finite, fewer than three edges.
        TypeError
            A value of another type.

        Notes
        -----
        B. Mishra, J. Schwartz, M. Sharir, *On the existence and synthesis of multifinger positive
        grips*, Algorithmica 2 (1987), doi:10.1007/BF01840373.
        """
        friction = number("friction", friction)
        if not 0 <= friction < math.inf:
            raise InvalidInput(f"friction: expected 0 or more, got {friction!r}", "friction")
        edges = whole("edges", edges, 3)
        touching = self._touching(step, obstacle)
        if not touching:
            return False
        points = np.array([place_on_object(shape, contact) for _, shape, contact in touching])
        pushes = -np.array([contact.normal for _, _, contact in touching])
        pushes /= np.linalg.norm(pushes, axis=1)[:, None]
        return positively_span(wrenches(points, pushes, friction, edges))

    def plot(self, step: int = -1, *, ax: Any = None, title: str | None = None) -> Any:
        """Draw all fingers at a step, the obstacles and the contact forces.

        Parameters
        ----------
        step : int, optional
        ax : matplotlib.axes.Axes, optional
            3-D axes to draw into. Default: those of a new figure.
        title : str, optional
            Default: share of the pull and number of contacts.

        Returns
        -------
        matplotlib.axes.Axes
            Not shown and not saved.

        Raises
        ------
        ImportError
            matplotlib is not installed.
        """
        from tdcr._plot.grasp import plot_grasp

        self._row(step)
        return plot_grasp(self.shapes, step, self.shares, ax, title)

    def animate(self, path: str | PathLike[str], *, fps: int = 10) -> None:
        """Write the closing as a GIF, which appears complete or not at all.

        Parameters
        ----------
        path : str or os.PathLike
            Ending in .gif; replaced if it exists.
        fps : int, optional
            Steps per second.

        Raises
        ------
        InvalidInput
            Another ending, fewer than one step per second.
        TypeError
            A value of another type.
        ImportError
            matplotlib is not installed.
        OSError
            The file cannot be written.
        """
        from tdcr._plot.grasp import animate_grasp

        animate_grasp(self.shapes, self.shares, path, fps)

    def __repr__(self) -> str:
        """Tell fingers, steps and contacts."""
        fingers, steps = len(self.shapes[0]), len(self.shares) - 1
        failed = sum(not shape.ok for row in self.shapes for shape in row)
        state = "all converged" if not failed else f"{failed} solves did not converge"
        count = sum(len(shape.contacts) for shape in self.shapes[-1])
        return f"<Grasp of {fingers} fingers in {steps} steps, {state}: {count} contacts>"
