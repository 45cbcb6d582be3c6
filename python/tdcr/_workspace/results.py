"""Sampled workspaces: reach, volume, dexterity, manipulability."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._base.arguments import whole
from tdcr._base.status import Status
from tdcr._base.value import Value, rebuild
from tdcr._io.save_load import Saved
from tdcr._workspace.manipulability import manipulability
from tdcr._workspace.voxels import Grid, Volume, VoxelMap, default_voxel, solid_angles, volume
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from tdcr._base.models import Settings
    from tdcr._core import Loads, Obstacle, Robot, Shape

    Floats: TypeAlias = NDArray[np.float64]

__all__ = ["Reach", "Sampling", "Workspace"]

Sampling = Literal["sobol", "grid", "random"]
_STATUSES = tuple(Status)


class Reach(NamedTuple):
    """Reach of the tips: distances from the base and the box around them."""

    nearest: float
    """Least distance from the centre of the base disk [m]."""
    farthest: float
    """Greatest [m]."""
    low: Floats
    """Least x, y, z, (3,), world frame [m]."""
    high: Floats
    """Greatest x, y, z, (3,) [m]."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy with arrays that stay read-only."""
        return rebuild, (type(self), *self)


@dataclass(frozen=True, eq=False, repr=False)
class Workspace(Saved, Value):
    """Sampled tips of a robot, one row per sample, in the world frame. Arrays are read-only.

    Rows that did not converge are kept, with their last iterate: `ok`, `status` and `counts` tell.
    Reach, volume and maps are made of those that converged.
    """

    robot: Robot
    ranges: Floats
    """Least and greatest displacement of each tendon, (K, 2) [m]."""
    displacements: Floats
    """Displacements of each row, (m, K) [m]."""
    tips: Floats
    """Centre of the tip disk, (m, 3) [m]."""
    directions: Floats
    """Unit vector along which the tip points, the z axis of its disk, (m, 3)."""
    codes: NDArray[np.uint8]
    """Outcome of each row, (m,): its place among the members of `Status`."""
    values: dict[str, NDArray[Any]]
    """The further fields asked for, by name, each (m, ...)."""
    model: str
    settings: Settings | None
    obstacles: tuple[Obstacle, ...]
    loads: Loads | None
    sampling: Sampling
    seed: int

    _hashed: ClassVar[tuple[str, ...]] = ("robot", "ranges", "model", "displacements")

    @property
    def status(self) -> NDArray[np.object_]:
        """Status of each row, (m,)."""
        return np.array(_STATUSES, object)[self.codes]

    @property
    def ok(self) -> NDArray[np.bool_]:
        """True for rows that converged, (m,)."""
        converged: NDArray[np.bool_] = self.codes == _STATUSES.index(Status.converged)
        return converged

    @property
    def counts(self) -> dict[Status, int]:
        """Number of rows by status, the most frequent first."""
        found = Counter(self.codes.tolist())
        return {_STATUSES[code]: count for code, count in found.most_common()}

    def __len__(self) -> int:
        """Return the number of rows m."""
        return len(self.tips)

    def __repr__(self) -> str:
        """Tell size and outcome."""
        counts = ", ".join(f"{count} {status}" for status, count in self.counts.items())
        return f"<Workspace of {len(self)} rows: {counts}; model {self.model!r}>"

    def shape(self, row: int) -> Shape:
        """Solve a row anew: the same to the bit, with all that belongs to it."""
        return _core.forward(
            self.robot,
            self.displacements[range(len(self))[row]],
            model=self.model,
            settings=self.settings,
            obstacles=self.obstacles,
            loads=self.loads,
        )

    @property
    def reach(self) -> Reach:
        """Nearest and farthest tip from the base, and the box around all.

        Those of the samples: the extremes of the robot lie a little beyond.
        """
        points = self._points()
        distance = np.linalg.norm(points - self.robot.base[:3, 3], axis=1)
        low, high = points.min(axis=0), points.max(axis=0)
        low.flags.writeable = high.flags.writeable = False
        return Reach(float(distance.min()), float(distance.max()), low, high)

    def volume(self, voxel: float | None = None) -> Volume:
        """Estimate the volume that the tip reaches.

        A voxel of edge h counts when it holds at least half of the tips that the 27 voxels around
        it lead to expect, so that of those at the surface as many count as do not. Of their volume
        V(h), mean over four places of the grid, what is left to first order goes with
        2 V(h) - V(2h), the value (Richardson's extrapolation). It needs no radius as an alpha shape
        does, leaves out hollows wider than a voxel, and is near 0 where the tip moves on a surface
        (one inextensible segment).

        Parameters
        ----------
        voxel : float, optional
            Edge h [m]. Default: one that leaves 20 tips per voxel of their bounding box.

        Returns
        -------
        Volume
            The error is |V(h) - V(2h)| plus how far V(h) moves when a random half of the samples is
            left out: what refining either way may still move. It is no bound. It
            is infinite where occupied voxels hold fewer than 5 tips in the mean.

        Raises
        ------
        InvalidInput
            No row converged, or an edge that is not positive, or too small to count voxels.
        TypeError
            An edge that is not a number.
        """
        points = self._points()
        return volume(points, self._voxel(voxel, points))

    def dexterity(self, voxel: float | None = None, *, bands: int = 12) -> VoxelMap:
        """Map the solid angle of the directions in which the tip can point at a place.

        Parameters
        ----------
        voxel : float, optional
            Edge of the voxels [m]. Default: as for `volume`.
        bands : int, optional
            The sphere of directions is cut into cells of equal area in so many bands: 12 make 156
            cells of 0.081 sr.

        Returns
        -------
        VoxelMap
            Values in sr, 0 to 4 pi: cells that a sample met times their area. A count of samples
            below a few times the cells leaves cells unmet: then it is a lower estimate; a single
            direction counts as one cell.

        Raises
        ------
        InvalidInput
            As `volume`; fewer bands than 3.

        Notes
        -----
        L. Wu, R. Crawford, J. Roberts, "Dexterity analysis of three 6-DOF continuum robots
        combining concentric tube mechanisms and cable-driven mechanisms", IEEE Robotics and
        Automation Letters 2(2), 2017.
        """
        bands = whole("bands", bands, 3)
        points = self._points()
        grid = Grid.of(points, self._voxel(voxel, points))
        return solid_angles(grid, self.directions[self.ok], bands)

    def manipulability(
        self,
        voxel: float | None = None,
        *,
        rows: int = 10_000,
        part: Literal["position", "rotation"] = "position",
    ) -> VoxelMap:
        """Map the manipulability of the tool, the mean of some rows in every voxel.

        Parameters
        ----------
        voxel : float, optional
            Edge of the voxels [m]. Default: one that suits `rows`.
        rows : int, optional
            At how many rows, spread evenly over those that converged, the Jacobian is taken.
        part : {"position", "rotation"}, optional
            As for `tdcr.manipulability`.

        Returns
        -------
        VoxelMap
            Values as of `tdcr.manipulability`.

        Raises
        ------
        InvalidInput
            As `volume`; fewer rows than one, an unknown part; obstacles or loads, among which no
            Jacobian is known.
        """
        if self.obstacles or self.loads is not None:
            what = "loads" if self.loads is not None else "obstacles"
            message = f"{what}: expected none for the Jacobian, got some"
            raise InvalidInput(message, what)
        rows = whole("rows", rows, 1)
        self._points()
        converged = np.flatnonzero(self.ok)
        step = -(-len(converged) // rows)
        taken = converged[::step]
        jacobians = [
            _core.jacobian(
                self.robot, self.displacements[row], model=self.model, settings=self.settings
            )
            for row in taken
        ]
        measured = manipulability(np.array(jacobians), part=part)
        points = self.tips[taken]
        return Grid.of(points, self._voxel(voxel, points)).mean(measured.value)

    def plot(self, **options: Any) -> Axes:
        """Draw the tips as voxels (an optional extra: ``pip install tdcr[plot]``).

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes to draw into, plain or 3-D. Default: those of a new figure.
        value : {"dexterity", "manipulability", "samples"}, optional
            What the colour tells. Default: "dexterity".
        view : {"section", "3d"}, optional
            "section" is the layer of voxels in the plane of the base's x and z axes, the default;
            "3d" all voxels; given Axes decide for themselves.
        voxel : float, optional
            Edge of the voxels [m]. Default: as for `volume`.
        title : str, optional
            Default: name of the robot, model, rows and those that did not converge.
        unit : {"auto", "m", "mm"}, optional
            Unit of the axes.

        Returns
        -------
        matplotlib.axes.Axes
            Not shown and not saved.

        Raises
        ------
        InvalidInput
            An unknown value, view or unit; no row converged.
        ImportError
            matplotlib is not installed.
        """
        from tdcr._plot.workspace import plot_workspace

        voxel = options.pop("voxel", None)
        return plot_workspace(
            self.robot, lambda value: self._voxel_map(value, voxel), name=self._title(), **options
        )

    def _voxel_map(self, value: str, voxel: float | None) -> VoxelMap:
        """Values per voxel in the frame of the base, where pictures cut sections."""
        base = self.robot.base
        turn, place = base[:3, :3], base[:3, 3]
        local = replace(self, tips=(self.tips - place) @ turn, directions=self.directions @ turn)
        if value == "manipulability":
            return local.manipulability(voxel)
        seen = local.dexterity(voxel)
        if value == "dexterity":
            return seen
        return seen._replace(values=seen.counts.astype(np.float64))

    def _title(self) -> str:
        name = f"{self.robot.name}\n" if self.robot.name else ""
        failed = len(self) - int(self.ok.sum())
        lost = f", {failed:,} not converged" if failed else ""
        return f"{name}{self.model} model, {len(self):,} samples{lost}"

    def _points(self) -> Floats:
        """Tips of the rows that converged, or say that there are none."""
        points: Floats = self.tips[self.ok]
        if not len(points):
            raise InvalidInput(f"expected rows that converged, got none in {self!r}", "workspace")
        return points

    @staticmethod
    def _voxel(voxel: float | None, points: Floats) -> float:
        if voxel is None:
            return default_voxel(points)
        if not isinstance(voxel, Real) or isinstance(voxel, bool):
            raise TypeError(f"voxel: expected a number [m], got {type(voxel).__name__}")
        # Volumes beyond overflow, and so do counts of voxels.
        if not 1e-100 <= voxel <= 1e100:
            expected = "a positive finite edge, from 1e-100 to 1e100 [m]"
            raise InvalidInput(f"voxel: expected {expected}, got {voxel}", "voxel")
        return float(voxel)
