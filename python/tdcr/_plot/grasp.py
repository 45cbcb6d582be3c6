"""Pictures of grippers. Imported on first use by `Grasp.plot` and `Grasp.animate`."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from tdcr._base.arguments import whole
from tdcr._plot.animation import gif_writer
from tdcr._plot.axes import Scene, Solid, draw, draw_forces
from tdcr._plot.projection import plane_of
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from tdcr._gripper.gripper import Grasp

__all__ = ["animate_grasp", "plot_grasp"]


def _figure() -> Any:
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError(
            "pictures need matplotlib, which is not installed: pip install tdcr[plot]"
        ) from error
    return Figure(figsize=(6.4, 6.0), layout="constrained")


def plot_grasp(grasp: Grasp, step: int, ax: Any, title: str | None) -> Any:
    """Draw a step of a grasp into 3-D axes; see `Grasp.plot`."""
    row = grasp._row(step)
    if ax is None:
        _figure()
        from matplotlib import pyplot

        ax = pyplot.figure(figsize=(6.4, 6.0), layout="constrained").add_subplot(projection="3d")
    scenes = [Scene.of(shape, "auto") for shape in row]
    canvas = Solid(ax, plane_of(row[0]), scenes[0])
    for obstacle in row[0].obstacles:
        canvas.obstacle(obstacle)
    obstacles = list(canvas.seen)
    every = [c.force for shapes in grasp.shapes for s in shapes if s.ok for c in s.contacts]
    largest = max((float(np.linalg.norm(force)) for force in every), default=0.0)
    for scene in scenes:
        canvas.scene = scene
        draw(canvas, scene, disks=True, tendons=True)
        draw_forces(canvas, scene, largest)
    # The same limits at every step.
    canvas.seen = obstacles + [
        s.positions * scenes[0].scale for shapes in grasp.shapes for s in shapes if s.ok
    ]
    canvas.finish()
    if title is None:
        count = sum(len(shape.contacts) for shape in row)
        failed = "" if all(shape.ok for shape in row) else ", NOT A SOLUTION"
        title = f"{grasp.shares[step]:.0%} of the pull, {count} contacts{failed}"
    ax.set_title(title, fontsize=10)
    return ax


def animate_grasp(grasp: Grasp, path: str | os.PathLike[str], fps: int) -> None:
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
        for step in range(len(grasp.shares)):
            figure.clear()
            plot_grasp(grasp, step, figure.add_subplot(projection="3d"), None)
            writer.grab_frame()
