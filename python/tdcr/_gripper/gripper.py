"""Grippers: several placed robots that close around an object."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tdcr import _core
from tdcr._base.arguments import index, number, several_obstacles, vector, whole
from tdcr._base.progress import told
from tdcr._base.value import Value
from tdcr._gripper.force_closure import place_on_object, positively_span, wrenches
from tdcr._gripper.placing import places_around, pulls
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Contact, Loads, Obstacle, Robot, RodSettings, Shape

    Array = NDArray[np.float64]

__all__ = ["Grasp", "Gripper"]


@dataclass(frozen=True)
class Gripper:
    """Robots that work together, each with a base of its own.

    Parameters
    ----------
    fingers : sequence of Robot
        Each with a `base`. They do not see each other.

    Raises
    ------
    InvalidInput
        No finger, one without a base pose (the identity, which a robot has that was given none), or
        two with the same.
    TypeError
        Something that is no Robot, a robot that is in no sequence.

    Examples
    --------
    >>> import numpy as np, tdcr
    >>> finger = tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(0.0, 0.008)])
    >>> gripper = tdcr.Gripper.around(finger, 3, 0.06)
    >>> grasp = gripper.close([-0.003], tdcr.Sphere((0, 0, 0.14), 0.04), steps=8)
    >>> grasp.ok, grasp.touch
    (True, (0.625, 0.625, 0.625))
    """

    fingers: tuple[Robot, ...]

    def __init__(self, fingers: Iterable[Robot]) -> None:
        """Check the fingers."""
        if not isinstance(fingers, Iterable):
            got = type(fingers).__name__
            raise TypeError(f"fingers: expected a sequence of Robot, got {got}")
        fingers = tuple(fingers)
        if not fingers:
            raise InvalidInput("fingers: expected one robot or more, got none", "fingers")
        for i, finger in enumerate(fingers):
            name = f"fingers[{i}]"
            if not isinstance(finger, _core.Robot):
                raise TypeError(f"{name}: expected a Robot, got {type(finger).__name__}")
            if np.array_equal(finger.base, np.eye(4)):
                raise InvalidInput(
                    f"{name}: expected a robot with a base pose (Robot(..., base=...)), got the "
                    "identity, which is that of a robot without",
                    name,
                )
            for j, other in enumerate(fingers[:i]):
                if np.array_equal(finger.base, other.base):
                    raise InvalidInput(
                        f"{name}: expected a base of its own (Robot(..., base=...)), got that of "
                        f"fingers[{j}]",
                        name,
                    )
        object.__setattr__(self, "fingers", fingers)

    @classmethod
    def around(
        cls,
        robot: Robot,
        count: int,
        distance: float,
        *,
        axis: ArrayLike = (0.0, 0.0, 1.0),
        center: ArrayLike = (0.0, 0.0, 0.0),
        azimuth: float = 0.0,
    ) -> Gripper:
        """Place a robot several times around an axis, azimuth 0 towards it.

        Parameters
        ----------
        robot : Robot
            Its own base is its place within each finger.
        count : int
            Number of fingers, evenly spaced.
        distance : float
            Of the bases from the axis [m].
        axis : array_like, shape (3,), optional
            Direction of the axis, and of the fingers.
        center : array_like, shape (3,), optional
            Where the axis passes between the bases, world frame [m].
        azimuth : float, optional
            Direction of the first finger about the axis [rad], for the z axis from the world's x.

        Raises
        ------
        InvalidInput
            No finger, a distance that is not positive and finite, an axis of zero length, vectors
            of another shape, numbers that are not finite.
        TypeError
            A value of another type.
        """
        if not isinstance(robot, _core.Robot):
            raise TypeError(f"robot: expected a Robot, got {type(robot).__name__}")
        fingers = []
        for k, place in enumerate(places_around(count, distance, axis, center, azimuth)):
            name = f"{robot.name} {k}" if robot.name else f"finger {k}"
            base = place @ robot.base
            fingers.append(
                _core.Robot(robot.backbone, robot.tendons, base=base, tool=robot.tool, name=name)
            )
        return cls(fingers)

    def close(
        self,
        displacements: Any,
        obstacles: Obstacle | Iterable[Obstacle],
        *,
        steps: int = 20,
        progress: bool | Callable[[int], object] = False,
        loads: Loads | None = None,
        settings: RodSettings | None = None,
    ) -> Grasp:
        """Pull all tendons together, from rest to the displacements, each step from the one before.

        Parameters
        ----------
        displacements : array_like, shape (K,), or one such per finger
            At the end of the pull, as for `forward` [m].
        obstacles : Obstacle or sequence of Obstacle
            The object, which stays where it is, and whatever else the fingers stay out of.
        steps : int, optional
            Of the pull.
        progress : bool or callable, optional
            As for `forward_batch`, in steps.
        loads, settings
            As for `forward`.

        Returns
        -------
        Grasp
            A step that does not converge is an outcome, and the next one starts where the last did.

        Raises
        ------
        InvalidInput
            As `forward`; another number of displacements than fingers, no step.
        TypeError
            A value of another type.
        """
        steps = whole("steps", steps, 1)
        goals = pulls(displacements, self.fingers)
        around = several_obstacles(obstacles)
        shares = np.linspace(0.0, 1.0, steps + 1)
        shares.flags.writeable = False
        starts: list[Shape | None] = [None] * len(self.fingers)
        shapes = []
        with told(progress, "close", steps + 1) as tell:
            for share in shares:
                row = []
                for k, (finger, goal) in enumerate(zip(self.fingers, goals, strict=True)):
                    own = np.where(np.isinf(goal), goal, 0.0)  # free tendons stay free
                    np.multiply(share, goal, out=own, where=~np.isinf(goal))
                    shape = _core.forward(
                        finger,
                        own,
                        obstacles=around,
                        loads=loads,
                        settings=settings,
                        start=starts[k],
                    )
                    starts[k] = shape if shape.ok else starts[k]
                    row.append(shape)
                shapes.append(tuple(row))
                if tell:
                    tell(len(shapes))
        return Grasp(shares, tuple(shapes))


@dataclass(frozen=True, eq=False)
class Grasp(Value):
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
        """Whether every step of every finger converged."""
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
        """Whether contacts at these places can balance any force and moment on the object.

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

        return plot_grasp(self, step, ax, title)

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

        animate_grasp(self, path, fps)

    def __repr__(self) -> str:
        """Tell fingers, steps and contacts."""
        fingers, steps = len(self.shapes[0]), len(self.shares) - 1
        failed = sum(not shape.ok for row in self.shapes for shape in row)
        state = "all converged" if not failed else f"{failed} solves did not converge"
        count = sum(len(shape.contacts) for shape in self.shapes[-1])
        return f"<Grasp of {fingers} fingers in {steps} steps, {state}: {count} contacts>"
