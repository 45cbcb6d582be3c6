"""Clouds of points as voxels: how much space they fill, and what is known in each voxel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tdcr._base.value import rebuild
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Whole = NDArray[np.int64]

__all__ = ["Grid", "Volume", "VoxelMap", "default_voxel", "solid_angles", "volume"]

# Points per voxel of the bounding box if no size is given: fewer leave holes, more leave steps.
_PER_VOXEL = 20
# Share of a voxel that rounding may move a point by.
_ROUNDING = 1e-6
# Points per occupied voxel below which nothing is known of the volume.
_FEW = 5
# Where a grid starts, in voxels: a lattice of four, so that the answer hangs less on one of them.
_OFFSETS = np.outer(np.arange(4) / 4.0, [1.0, 2.0, 3.0]) % 1.0


class Volume(NamedTuple):
    """Volume of a cloud of tips; see `Workspace.volume` for what the error is."""

    value: float
    """[m^3]."""
    error: float
    """Change of the value when twice the voxel and when half of the samples is used [m^3]."""
    occupied: float
    """Volume of all voxels with a tip, more by the steps at the surface [m^3]."""
    voxel: float
    """Edge of the voxels [m]."""


class VoxelMap(NamedTuple):
    """One number for each voxel that holds a tip; arrays are read-only."""

    centers: Floats
    """Centres of the voxels, (V, 3), world frame [m]."""
    values: Floats
    """(V,)."""
    counts: Whole
    """Samples behind each value, (V,)."""
    voxel: float
    """Edge of the voxels [m]."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy with arrays that stay read-only."""
        return rebuild, (type(self), *self)

    def __repr__(self) -> str:
        """Tell how many voxels of which edge, and between what the values are."""
        values = (
            f", values {self.values.min():.3g} to {self.values.max():.3g}"
            if len(self.values)
            else ""
        )
        return f"<VoxelMap of {len(self.values)} voxels of {self.voxel:.3g} m{values}>"


@dataclass(frozen=True)
class Grid:
    """Points in the voxels they fall into."""

    low: Floats
    voxel: float
    shape: tuple[int, int, int]
    keys: Whole

    @staticmethod
    def of(points: Floats, voxel: float) -> Grid:
        """Put the points into voxels of a grid whose planes go through the world's origin."""
        # Tips of a planar robot are in one of the planes but for rounding: all in the same layer.
        cells = np.floor(points / voxel + _ROUNDING)
        shift = cells.min(axis=0)
        cells -= shift
        return Grid(shift * voxel, voxel, *_keys(cells, voxel))

    def centers(self, keys: Whole) -> Floats:
        """Centres of voxels (V, 3)."""
        index = np.stack(np.unravel_index(keys, self.shape), axis=1)
        return self.low + (index + 0.5) * self.voxel

    def mean(self, values: Floats) -> VoxelMap:
        """Mean of the points' values in every voxel."""
        keys, place, counts = np.unique(self.keys, return_inverse=True, return_counts=True)
        means = np.bincount(place, values, len(keys)) / counts
        return self.map(keys, means, counts)

    def map(self, keys: Whole, values: NDArray[Any], counts: Whole) -> VoxelMap:
        """Freeze what is known of some voxels."""
        result = VoxelMap(self.centers(keys), values, counts, self.voxel)
        for array in result[:3]:
            array.flags.writeable = False
        return result


def _keys(cells: Floats, voxel: float) -> tuple[tuple[int, int, int], Whole]:
    """Extent of a grid, and one number for each cell of it."""
    extent = cells.max(axis=0) + 1.0
    if extent.prod() > 2.0**60:
        raise InvalidInput(f"voxel: expected fewer than 2^60 in the box, got {voxel} [m]", "voxel")
    x, y, z = (int(count) for count in extent)
    keys = (cells[:, 0] * y + cells[:, 1]) * z + cells[:, 2]
    if extent.prod() > 2.0**53:
        whole = cells.astype(np.int64)
        return (x, y, z), (whole[:, 0] * y + whole[:, 1]) * z + whole[:, 2]
    return (x, y, z), keys.astype(np.int64)


def default_voxel(points: Floats) -> float:
    """Edge that leaves 20 points per voxel of their bounding box [m]."""
    extent = np.ptp(points, axis=0)
    longest = float(extent.max())
    if longest == 0.0:
        return 1.0
    # A flat cloud's box is as thick as a hundredth of its length.
    box = float(np.maximum(extent, longest / 100.0).prod())
    return math.cbrt(box * _PER_VOXEL / len(points))


def _count(cells: Floats, voxel: float) -> tuple[tuple[int, int, int], Whole, Whole]:
    """Extent of a grid with an empty rim, its occupied cells in order and the points in each."""
    # The rim keeps neighbours of the last cell in a row apart from the first of the next.
    shape, keys = _keys(np.vstack([cells + 1.0, cells.max(axis=0) + 2.0]), voxel)
    keys = keys[:-1]
    if math.prod(shape) > 4 * len(keys) + 2**20:
        return shape, *np.unique(keys, return_counts=True)
    counts = np.bincount(keys)
    occupied = np.flatnonzero(counts)
    return shape, occupied, counts[occupied]


def _around(shape: tuple[int, int, int], keys: Whole, counts: Whole) -> Floats:
    """Points per cell that is full, as the 27 cells around each tell: sum n (n - 1) / sum n.

    Cells weigh by their points, so those cut by the surface hardly count; n - 1 for n takes out
    what chance adds to a square.
    """
    first, second = np.zeros(len(keys)), np.zeros(len(keys))
    for i, j, k in np.ndindex(3, 3, 3):
        wanted = keys + ((i - 1) * shape[1] + j - 1) * shape[2] + k - 1
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        found = np.where(keys[place] == wanted, counts[place], 0.0)
        first += found
        second += found * (found - 1.0)
    return second / first


def _fill(points: Floats, voxel: float) -> tuple[float, float]:
    """Volume of the voxels that are at least half full, and of all with a point.

    Mean over where the grid starts. Of the voxels that a smooth surface cuts, as many are more
    than half inside as less: those that are drop out of the error, which all with a point, slivers
    included as far as a point happened to fall there, never do.
    """
    low = points.min(axis=0)
    full = occupied = 0
    for offset in _OFFSETS:
        shape, keys, counts = _count(np.floor((points - low) / voxel + offset), voxel)
        full += int(np.count_nonzero(counts >= 0.5 * _around(shape, keys, counts)))
        occupied += len(keys)
    cell = voxel**3 / len(_OFFSETS)
    return full * cell, occupied * cell


def volume(points: Floats, voxel: float) -> Volume:
    """Estimate the volume that a cloud of points fills: see `Workspace.volume`."""
    (fine, occupied), (coarse, _) = (_fill(points, voxel * scale) for scale in (1.0, 2.0))
    # By chance, not by order: neighbours of a Sobol sequence or of a grid lie apart by design.
    first = np.random.default_rng(0).random(len(points)) < 0.5
    halves = [half for half in (points[first], points[~first]) if len(half)]
    sparse = sum(_fill(half, voxel)[0] for half in halves) / len(halves)
    error = abs(fine - coarse) + abs(fine - sparse)
    # So few that empty voxels may well be full, and those of twice the size too.
    if len(points) * voxel**3 < _FEW * occupied:
        error = math.inf
    return Volume(max(2.0 * fine - coarse, 0.0), error, occupied, voxel)


def _bands(count: int) -> tuple[Whole, Floats]:
    """Cells per band of a sphere, pole to pole, and the heights of the bands' lower edges.

    Caps of one cell at the poles and bands between, all cells of equal area and about as wide as
    high: the zones of P. Leopardi, "A partition of the unit sphere into regions of equal area and
    small diameter", Electron. Trans. Numer. Anal. 25, 2006, with whole cells first, edges to suit.
    """
    step = math.pi / (count - 1)
    polar = step * np.arange(count)
    cells = np.maximum(1, np.round(2.0 * math.pi * np.sin(polar) / step)).astype(np.int64)
    return cells, 1.0 - 2.0 * np.cumsum(cells) / cells.sum()


def solid_angles(grid: Grid, directions: Floats, bands: int) -> VoxelMap:
    """Solid angle of the directions met in every voxel [sr], in cells of equal area."""
    cells, edges = _bands(bands)
    z = np.clip(directions[:, 2], -1.0, 1.0)
    band = np.minimum(np.searchsorted(-edges, -z), bands - 1)
    turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2.0 * math.pi) % 1.0
    within = np.minimum((turn * cells[band]).astype(np.int64), cells[band] - 1)
    cell = np.concatenate(([0], np.cumsum(cells)[:-1]))[band] + within
    keys, place, counts = np.unique(grid.keys, return_inverse=True, return_counts=True)
    met = np.unique(place * int(cells.sum()) + cell) // int(cells.sum())
    values = np.bincount(met, minlength=len(keys)) * (4.0 * math.pi / int(cells.sum()))
    return grid.map(keys, values, counts)
