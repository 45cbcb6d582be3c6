"""Pictures of grippers. Imported on first use by `Grasp.plot` and `Grasp.animate`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr._base.arguments import whole
from tdcr._plot.animation import gif_writer
from tdcr._plot.axes import Scene, Solid, draw, draw_forces
from tdcr._plot.projection import plane_of
from tdcr._plot.shape import require_matplotlib
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tdcr._core import Shape

    Steps: TypeAlias = Sequence[Sequence[Shape]]

__all__ = ["animate_grasp", "plot_grasp"]


def _figure() -> Any:
    require_matplotlib()
    from matplotlib.figure import Figure

    return Figure(figsize=(6.4, 6.0), layout="constrained")


def plot_grasp(
    shapes: Steps, step: int, shares: NDArray[np.float64], ax: Any, title: str | None
) -> Any:
    """Draw the fingers at a step into 3-D axes; see `Grasp.plot`."""
    row = shapes[step]
    if ax is None:
        _figure()
        from matplotlib import pyplot

        ax = pyplot.figure(figsize=(6.4, 6.0), layout="constrained").add_subplot(projection="3d")
    scenes = [Scene.of(shape, "auto") for shape in row]
    canvas = Solid(ax, plane_of(row[0]), scenes[0])
    for obstacle in row[0].obstacles:
        canvas.obstacle(obstacle)
    obstacles = list(canvas.seen)
    every = [c.force for one in shapes for s in one if s.ok for c in s.contacts]
    largest = max((float(np.linalg.norm(force)) for force in every), default=0.0)
    for scene in scenes:
        canvas.scene = scene
        draw(canvas, scene, disks=True, tendons=True)
        draw_forces(canvas, scene, largest)
    # The same limits at every step.
    canvas.seen = obstacles + [s.positions * scenes[0].scale for one in shapes for s in one if s.ok]
    canvas.finish()
    if title is None:
        count = sum(len(shape.contacts) for shape in row)
        failed = "" if all(shape.ok for shape in row) else ", NOT A SOLUTION"
        title = f"{shares[step]:.0%} of the pull, {count} contacts{failed}"
    ax.set_title(title, fontsize=10)
    return ax


def animate_grasp(
    shapes: Steps, shares: NDArray[np.float64], path: str | os.PathLike[str], fps: int
) -> None:
    """Write a GIF; see `Grasp.animate`."""
    if os.path.splitext(path)[1].lower() != ".gif":
        raise InvalidInput(f"path: expected one ending in .gif, got {os.fspath(path)!r}", "path")
    fps = whole("fps", fps, 1)
    figure = _figure()
    # A constrained layout would shift the axes from frame to frame.
    figure.set_layout_engine("none")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    with gif_writer(figure, path, fps, dpi=80) as writer:
        for step in range(len(shares)):
            figure.clear()
            plot_grasp(shapes, step, shares, figure.add_subplot(projection="3d"), None)
            writer.grab_frame()
