"""Grippers: several placed robots that close around an object."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tdcr import _core
from tdcr._force_closure import positively_span, wrenches
from tdcr._progress import told
from tdcr._value import Value
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
        They do not see each other.

    Raises
    ------
    InvalidInput
        No finger, or two with the same base: a robot without `base` stands in the origin.
    TypeError
        Something that is no Robot.

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
        fingers = tuple(fingers)
        if not fingers:
            raise InvalidInput("fingers: expected one robot or more, got none", "fingers")
        for i, finger in enumerate(fingers):
            name = f"fingers[{i}]"
            if not isinstance(finger, _core.Robot):
                raise TypeError(f"{name}: expected a Robot, got {type(finger).__name__}")
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
            No finger, a distance that is not positive and finite, an axis of zero length.
        """
        if count < 1:
            raise InvalidInput(f"count: expected 1 or more, got {count}", "count")
        if not 0 < distance < math.inf:
            raise InvalidInput(f"distance: expected a length > 0 m, got {distance!r}", "distance")
        frame = np.eye(4)
        frame[:3, :3] = _turned(np.asarray(axis, float))
        frame[:3, 3] = center
        fingers = []
        for k in range(count):
            cos, sin = (f(azimuth + 2 * math.pi * k / count) for f in (math.cos, math.sin))
            place = np.array(
                [
                    [-cos, sin, 0, distance * cos],
                    [-sin, -cos, 0, distance * sin],
                    [0, 0, 1, 0],
                    [0, 0, 0, 1.0],
                ]
            )
            name = f"{robot.name} {k}" if robot.name else f"finger {k}"
            base = frame @ place @ robot.base
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
        """
        if steps < 1:
            raise InvalidInput(f"steps: expected 1 or more, got {steps}", "steps")
        goals = self._goals(displacements)
        around = (obstacles,) if isinstance(obstacles, _core.Obstacle) else tuple(obstacles)
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

    def _goals(self, displacements: Any) -> list[Array]:
        rows = [np.asarray(row, float) for row in displacements]
        if all(row.ndim == 0 for row in rows):
            return [np.array(rows, float)] * len(self.fingers)
        if len(rows) != len(self.fingers):
            raise InvalidInput(
                f"displacements: expected one row for all or {len(self.fingers)} rows, one per "
                f"finger, got {len(rows)} rows",
                "displacements",
            )
        return rows


def _turned(axis: Array) -> Array:
    """Rotation by the least angle that takes z to an axis."""
    length = np.linalg.norm(axis)
    if axis.shape != (3,) or not 0 < length < np.inf:
        raise InvalidInput(
            f"axis: expected three numbers of positive length, got {axis.tolist()}", "axis"
        )
    x, y, z = axis / length
    if z < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    return np.array(
        [
            [1 - x * x / (1 + z), -x * y / (1 + z), x],
            [-x * y / (1 + z), 1 - y * y / (1 + z), y],
            [-x, -y, z],
        ]
    )


@dataclass(frozen=True, eq=False)
class Grasp(Value):
    """A closing gripper, step by step; made by `Gripper.close`.

    Wherever a step is asked for, -1 is the last; `obstacle` is the index of the object.

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
        row = enumerate(self.shapes[step])
        return [(k, c) for k, shape in row for c in shape.contacts if c.obstacle == obstacle]

    def center(self, step: int = -1, *, obstacle: int = 0) -> Array:
        """Return the centre of a Sphere, Box or Capsule, else of its contacts, shape (3,) [m].

        NaN where there are none of either.
        """
        obstacles = self.shapes[step][0].obstacles
        match obstacles[obstacle]:
            case _core.Sphere() | _core.Box() as body:
                return body.center
            case _core.Capsule() as body:
                return (body.a + body.b) / 2
        points = [contact.point for _, contact in self.contacts(step, obstacle=obstacle)]
        return np.mean(points, axis=0) if points else np.full(3, np.nan)

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
        touching = self.contacts(step, obstacle=obstacle)
        if not touching:
            return np.zeros(3)
        at = self.center(step, obstacle=obstacle) if about is None else np.asarray(about, float)
        total: Array = np.sum([np.cross(c.point - at, -c.force) for _, c in touching], axis=0)
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

        Notes
        -----
        B. Mishra, J. Schwartz, M. Sharir, *On the existence and synthesis of multifinger positive
        grips*, Algorithmica 2 (1987), doi:10.1007/BF01840373.
        """
        if not 0 <= friction < math.inf:
            raise InvalidInput(f"friction: expected 0 or more, got {friction!r}", "friction")
        if edges < 3:
            raise InvalidInput(f"edges: expected 3 or more, got {edges}", "edges")
        touching = [contact for _, contact in self.contacts(step, obstacle=obstacle)]
        if not touching:
            return False
        points = np.array([contact.point for contact in touching])
        pushes = -np.array([contact.normal for contact in touching])
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
        from tdcr._plot_gripper import plot_grasp

        return plot_grasp(self, step, ax, title)

    def animate(self, path: str | PathLike[str], *, fps: int = 10) -> None:
        """Write the closing as a GIF.

        Parameters
        ----------
        path : str or os.PathLike
            Ending in .gif.
        fps : int, optional
            Steps per second.

        Raises
        ------
        InvalidInput
            Another ending.
        ImportError
            matplotlib is not installed.
        """
        from tdcr._plot_gripper import animate_grasp

        animate_grasp(self, path, fps)

    def __repr__(self) -> str:
        """Tell fingers, steps and contacts."""
        fingers, steps = len(self.shapes[0]), len(self.shares) - 1
        failed = sum(not shape.ok for row in self.shapes for shape in row)
        state = "all converged" if not failed else f"{failed} solves did not converge"
        count = sum(len(shape.contacts) for shape in self.shapes[-1])
        return f"<Grasp of {fingers} fingers in {steps} steps, {state}: {count} contacts>"
