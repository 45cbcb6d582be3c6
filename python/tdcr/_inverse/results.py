"""Results of inverses: one answer, and many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._base.status import Status
from tdcr._base.value import Value
from tdcr._io.save_load import Saved
from tdcr.errors import NotConverged

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tdcr._base.models import Settings
    from tdcr._core import (
        Bounds,
        InverseSettings,
        Loads,
        Obstacle,
        Robot,
        Shape,
    )

    Array: TypeAlias = NDArray[np.float64]
    Method: TypeAlias = Literal["newton", "pso"]

__all__ = ["Inverse", "InverseBatch"]


@dataclass(frozen=True, eq=False, repr=False)
class Inverse(Saved, Value):
    """Displacements that bring the tool to a target, and how it went. Arrays are read-only."""

    robot: Robot
    target: Array
    """A position (3,), a frame (4, 4) or places of disks (n, 3) or (n + 1, 3), world frame [m]."""
    displacements: Array
    """Tendon displacements, (K,) [m]: negative pulls."""
    tensions: Array
    """Tensions, (K,), in the units of `Shape.tensions`; NaN with constant curvature."""
    status: Status
    """converged: the target is met, with the least bending energy (rod: the least sum of squared
    tensions) nearby where there is freedom;
    unreachable: the nearest answer that was found; infeasible: the bounds exclude each other, or
    no shape was found at all (`error` is NaN);
    iteration_limit, numerical_error: stopped before either."""
    message: str
    """Reason why it did not converge; empty when it converged, unless from rest the displacements
    lead to another shape."""
    error: float
    """Distance from the tool to the target, over the axes that count; the largest of a disk [m].
    NaN where no shape was found."""
    rotation_error: float
    """Angle from the tool to the target, over the axes that count [rad]; 0 for a position."""
    iterations: int
    """Steps taken from all starts."""
    starts: int
    """Starts tried."""
    model: str
    settings: Settings | None
    bounds: Bounds | None
    search: InverseSettings
    method: Method
    hits: int = 1
    """Number of starts that led to this answer (`inverse_solutions`)."""
    obstacles: tuple[Obstacle, ...] = ()
    loads: Loads | None = None
    known_shape: Shape | None = None
    """The shape found, where displacements do not say which it is: among obstacles, under loads."""

    _hashed: ClassVar[tuple[str, ...]] = ("robot", "model", "displacements")

    @property
    def ok(self) -> bool:
        """True if it converged."""
        return self.status is Status.converged

    @cached_property
    def shape(self) -> Shape:
        """The robot under the displacements; the rod under the tensions, which they go with.

        Of a row of a batch among obstacles or under loads: the shape that rest leads to.
        """
        if self.known_shape is not None:
            return self.known_shape
        if self.obstacles or self.loads is not None:
            return _core.forward(
                self.robot,
                self.displacements,
                obstacles=self.obstacles,
                loads=self.loads,
                settings=self.settings,
            )
        if self.model == "rod":
            return _core.forward(self.robot, tensions=self.tensions, settings=self.settings)
        return _core.forward(
            self.robot, self.displacements, model=self.model, settings=self.settings
        )

    @property
    def energy(self) -> float:
        """Strain energy of the robot under the displacements, in the units of `Shape.energy`."""
        return self.shape.energy

    def require(self) -> Inverse:
        """Return the result itself, or raise `NotConverged` with its message."""
        if self.ok:
            return self
        raise NotConverged(f"{self.status}: {self.message}", self)

    def __repr__(self) -> str:
        """Tell the outcome and the displacements."""
        pulls = np.array2string(
            self.displacements, precision=6, separator=", ", threshold=12, max_line_width=1000
        )
        off = f"{self.error:.3g} m"
        if self.target.shape == (4, 4):
            off += f", {self.rotation_error:.3g} rad"
        return f"<Inverse {self.status}, {off} off, displacements {pulls}>"


@dataclass(frozen=True, eq=False, repr=False)
class InverseBatch(Saved, Value, Sequence[Inverse]):
    """Inverses of one robot, in the order of their targets; `batch[i]` is an `Inverse`."""

    robot: Robot
    targets: Array
    """Positions (B, 3) or frames (B, 4, 4), world frame [m]."""
    displacements: Array
    """Tendon displacements, (B, K) [m]."""
    tensions: Array
    """Tensions, (B, K), in the units of `Shape.tensions`; NaN with constant curvature."""
    status: NDArray[Any]
    """`Status` of every row, (B,)."""
    ok: NDArray[np.bool_]
    """True for rows that converged, (B,)."""
    error: Array
    """Distances to the targets, (B,) [m]."""
    rotation_error: Array
    """Angles to the targets, (B,) [rad]."""
    iterations: NDArray[np.uint64]
    """Steps taken, (B,)."""
    starts: NDArray[np.uint64]
    """Starts tried, (B,). Along a path 1 means that the row went on from the one before; more, that
    this failed and the answer may be far from it."""
    model: str
    settings: Settings | None
    bounds: Bounds | None
    search: InverseSettings
    method: Method
    obstacles: tuple[Obstacle, ...] = ()
    loads: Loads | None = None

    _hashed: ClassVar[tuple[str, ...]] = ("robot", "model", "displacements")

    def __len__(self) -> int:
        """Return the number of targets B."""
        return len(self.targets)

    def __getitem__(self, index: Any) -> Any:
        """Return the inverse of one target, or a list of them for a slice."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        i = range(len(self))[index]
        return Inverse(
            self.robot,
            self.targets[i],
            self.displacements[i],
            self.tensions[i],
            self.status[i],
            self._message(i),
            float(self.error[i]),
            float(self.rotation_error[i]),
            int(self.iterations[i]),
            int(self.starts[i]),
            self.model,
            self.settings,
            self.bounds,
            self.search,
            self.method,
            obstacles=self.obstacles,
            loads=self.loads,
        )

    def _message(self, i: int) -> str:
        """Tell what stood in the way of a row; the core keeps no texts of many rows."""
        if self.ok[i]:
            return ""
        if self.status[i] is Status.infeasible and np.isnan(self.error[i]):
            return f"row {i}: no shape was found{self._where()}"
        if self.status[i] is Status.infeasible:
            return f"row {i}: the bounds leave the robot no shape"
        off = f"{self.error[i]:.3g} m"
        if self.targets.ndim == 3:
            off += f" and {self.rotation_error[i]:.3g} rad"
        tried = int(self.starts[i])
        return f"row {i} is {off} off the target after {tried} start{'s' if tried != 1 else ''}"

    def _where(self) -> str:
        """Tell what there is around the robot."""
        around = [" among the obstacles"] * bool(self.obstacles)
        around += [" under the loads"] * (self.loads is not None)
        return " and".join(around)

    def __repr__(self) -> str:
        """Tell size and outcome."""
        converged = int(np.count_nonzero(self.ok))
        return f"<InverseBatch of {len(self)} targets, {converged} converged, model {self.model!r}>"
