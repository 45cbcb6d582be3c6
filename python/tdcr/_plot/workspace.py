"""Pictures of workspaces. Imported on first use by ``Workspace.plot``."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

from tdcr._plot.shape import axes_of, one_of, require_matplotlib
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from tdcr._core import Robot
    from tdcr._plot.axes import Unit

__all__ = ["SIZE", "plot_workspace"]

View = Literal["section", "3d"]
Shown = Literal["dexterity", "manipulability", "samples"]

_LABELS = {
    "dexterity": "directions of the tip [sr]",
    "manipulability": "manipulability",
    "samples": "samples per voxel",
}
SIZE = (6.4, 4.8)
"""Size of a figure [in]."""


class Voxels(Protocol):
    """Voxels that tips reach, in the frame of the base: edge, centres, values and counts."""

    @property
    def voxel(self) -> float: ...
    @property
    def centers(self) -> Any: ...
    @property
    def values(self) -> Any: ...
    @property
    def counts(self) -> Any: ...


def plot_workspace(
    robot: Robot,
    measure: Callable[[Shown], Voxels],
    *,
    name: str,
    ax: Any = None,
    value: Shown = "dexterity",
    view: View | None = None,
    title: str | None = None,
    unit: Unit = "auto",
) -> Axes:
    """Draw the voxels that tips reach, coloured by a value; see `Workspace.plot`.

    `measure` gives them once the options are checked; `name` is the title by default.
    """
    # Options.
    require_matplotlib()
    one_of("value", value, tuple(_LABELS))
    one_of("unit", unit, ("auto", "m", "mm"))
    if view is not None:
        one_of("view", view, ("section", "3d"))
    solid = view == "3d" if ax is None else ax.name == "3d"
    if ax is not None and view is not None and solid != (view == "3d"):
        raise InvalidInput(f"view: expected what suits the Axes, {ax.name}, got {view!r}", "view")
    # Voxels and backbone, in the unit of the axes.
    seen = measure(value)
    if ax is None:
        from matplotlib import pyplot

        ax = axes_of(pyplot.figure(figsize=SIZE, layout="constrained"), not solid)
    if unit == "auto":
        unit = "mm" if robot.backbone.total_length < 2.0 else "m"
    scale = 1000.0 if unit == "mm" else 1.0
    painted = _solid(ax, robot, seen, scale) if solid else _section(ax, seen, scale)
    _spine(ax, robot, scale, solid)
    if solid:
        _finish(ax, robot, seen, scale)
    # Labels, colour bar and title.
    ax.set_xlabel(f"x [{unit}]")
    if not solid:
        ax.set_ylabel(f"z [{unit}]")
    else:
        ax.set_ylabel(f"y [{unit}]")
        ax.set_zlabel(f"z [{unit}]", labelpad=8)
    bar = ax.figure.colorbar(
        painted, ax=ax, shrink=0.8 if solid else 1.0, pad=0.12 if solid else 0.05
    )
    bar.set_label(_LABELS[value])
    bar.outline.set_linewidth(0.6)
    text = name if title is None else title
    if text:
        ax.set_title(text, fontsize=10, parse_math=False)
    drawn: Axes = ax
    return drawn


def _section(ax: Any, seen: Voxels, scale: float) -> Any:
    """Squares of the layer of voxels beside the plane y = 0."""
    from matplotlib.collections import PolyCollection

    y = seen.centers[:, 1]
    layer, before = (y > 0.0) & (y < seen.voxel), (y < 0.0) & (y > -seen.voxel)
    if _few(seen, layer, before):
        # Tips in the plane itself, which rounding puts on its other side.
        layer = before
    if not layer.any():
        # Nothing there, as of tips in another plane: the layer that is nearest.
        nearest = y[np.abs(y).argmin()]
        layer = np.abs(y - nearest) < 0.5 * seen.voxel
    corners = 0.5 * seen.voxel * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    squares = (seen.centers[layer][:, None, [0, 2]] + corners) * scale
    # Edges of the face's colour hide the seams that some readers of PDF show.
    painted = PolyCollection(
        list(squares), array=seen.values[layer], edgecolors="face", linewidths=0.2
    )
    painted.set_clim(0.0, float(seen.values.max()))
    ax.add_collection(painted)
    ax.autoscale_view()
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.06)
    ax.grid(True, color="#E6E8EB", linewidth=0.6)
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return painted


def _few(seen: Voxels, some: Any, others: Any) -> bool:
    """Tell if some voxels hold next to none of the tips that they and others hold."""
    return bool(10 * seen.counts[some].sum() < seen.counts[others].sum())


def _solid(ax: Any, robot: Robot, seen: Voxels, scale: float) -> Any:
    """Centres of the voxels behind the plane y = 0, so that one looks inside."""
    behind = seen.centers[:, 1] > 0.0
    behind = np.ones(len(behind), bool) if _few(seen, behind, ~behind) else behind
    points = seen.centers[behind] * scale
    whole = np.concatenate([seen.centers, _backbone(robot)]) * scale
    # Squares about as wide as a voxel: 4 inches hold the longest span.
    size = (4.0 * 72.0 * seen.voxel * scale / np.ptp(whole, axis=0).max()) ** 2
    painted = ax.scatter(
        *points.T, c=seen.values[behind], s=size, marker="s", linewidths=0, depthshade=False
    )
    painted.set_clim(0.0, float(seen.values.max()))
    ax.view_init(elev=22, azim=-65)
    return painted


def _finish(ax: Any, robot: Robot, seen: Voxels, scale: float) -> None:
    """Equal scale in a box around voxels and backbone, which is never a sliver."""
    from matplotlib.ticker import MaxNLocator

    shown = np.concatenate([seen.centers, _backbone(robot)]) * scale
    low, high = shown.min(axis=0), shown.max(axis=0)
    span = np.maximum(1.05 * (high - low), 0.25 * (high - low).max())
    for axis, name in enumerate("xyz"):
        middle = 0.5 * (low[axis] + high[axis])
        getattr(ax, f"set_{name}lim")(middle - span[axis] / 2, middle + span[axis] / 2)
        ticks = max(2, round(5 * span[axis] / span.max()))
        getattr(ax, f"{name}axis").set_major_locator(MaxNLocator(ticks, steps=[1, 2, 5, 10]))
    ax.tick_params(labelsize=8)
    ax.set_box_aspect(span)


def _backbone(robot: Robot) -> Any:
    """Places of the disks at rest in the frame of the base."""
    frames = np.linalg.inv(robot.base) @ robot.rest_frames
    return frames[:, :3, 3]


def _spine(ax: Any, robot: Robot, scale: float, solid: bool) -> None:
    """Draw the backbone at rest, from its base."""
    points = _backbone(robot).T * scale
    shown = points if solid else points[[0, 2]]
    ax.plot(*shown, color="#5F6670", linewidth=2.0, zorder=3.0)
    ax.plot(*shown[:, :1], color="#22262B", marker="s", markersize=6, zorder=3.1)
