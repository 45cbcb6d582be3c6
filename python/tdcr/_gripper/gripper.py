"""Grippers: robots with bases of their own that close around an object."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tdcr import _core
from tdcr._base.arguments import several_obstacles, whole
from tdcr._base.progress import progress_callback
from tdcr._gripper.grasp import Grasp
from tdcr._gripper.placing import places_around, pulls
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Loads, Obstacle, Robot, RodSettings, Shape

    Array = NDArray[np.float64]

__all__ = ["Gripper"]


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
        # Arguments.
        steps = whole("steps", steps, 1)
        goals = pulls(displacements, self.fingers)
        around = several_obstacles(obstacles)
        shares = np.linspace(0.0, 1.0, steps + 1)
        shares.flags.writeable = False
        # Step by step, each finger from its last shape that converged.
        starts: list[Shape | None] = [None] * len(self.fingers)
        shapes = []
        with progress_callback(progress, "close", steps + 1) as tell:
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
