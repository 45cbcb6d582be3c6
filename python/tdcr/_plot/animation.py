"""Animated pictures. Imported on first use by the command line and `Grasp.animate`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from tdcr._core import Robot, Shape, forward
from tdcr._io.atomic_write import replace_file
from tdcr._plot.axes import Flat, Scene, Solid, draw, draw_marks
from tdcr._plot.projection import plane_of
from tdcr._plot.shape import FAILED, require_matplotlib
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.animation import PillowWriter
    from numpy.typing import NDArray

__all__ = ["animate_pull", "check_gif", "gif_writer", "pulled_shapes"]

_FPS, _HELD = 20, 12  # frames a second, and how many of them show the end
_SIZE, _DPI = (6.0, 5.2), 90


def check_gif(path: str | os.PathLike[str]) -> None:
    """Refuse a path that does not end in .gif."""
    if os.path.splitext(path)[1].lower() != ".gif":
        raise InvalidInput(f"path: expected one ending in .gif, got {os.fspath(path)!r}", "path")
    require_matplotlib()


def pulled_shapes(
    robot: Robot,
    displacements: NDArray[np.float64],
    *,
    model: str,
    count: int,
    progress: Callable[[int], object] | None,
) -> list[Shape]:
    """Solve the shapes from no pull to all of it, in equal steps; free tendons stay free."""
    shapes: list[Shape] = []
    for step in range(count):
        share = step / (count - 1)
        own = np.where(np.isinf(displacements), np.inf, 0.0)
        own[np.isfinite(displacements)] = share * displacements[np.isfinite(displacements)]
        start = shapes[-1] if model == "rod" and shapes and shapes[-1].ok else None
        shapes.append(forward(robot, own, model=model, start=start))
        if progress is not None:
            progress(step + 1)
    return shapes


@contextmanager
def gif_writer(
    figure: Any, path: str | os.PathLike[str], fps: int, dpi: int
) -> Iterator[PillowWriter]:
    """Give the writer of a GIF that appears at the end, complete, or not at all.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Whose frames the writer grabs.
    path : str or os.PathLike
        Replaced if it exists.
    fps, dpi : int
        Frames per second, dots per inch.
    """
    from matplotlib import rc_context
    from matplotlib.animation import PillowWriter

    writer = PillowWriter(fps=fps)
    with TemporaryDirectory() as folder, rc_context({"savefig.bbox": None}):
        whole = Path(folder) / "whole.gif"
        # Not `writer.saving`: interrupted, it would write what there is, and fail over nothing.
        writer.setup(figure, str(whole), dpi=dpi)
        yield writer
        writer.finish()
        replace_file(path, lambda stream: stream.write(whole.read_bytes()))


def animate_pull(
    shapes: list[Shape],
    path: str | os.PathLike[str],
    *,
    progress: Callable[[int], object] | None = None,
) -> None:
    """Write shapes as a GIF: the same axes, view and legend in every frame.

    Parameters
    ----------
    shapes : list of Shape
        In their order; the path of the tip is drawn as it grows.
    path : str or os.PathLike
        Ending in .gif; replaced if it exists.
    progress : callable, optional
        Gets the number of frames done.

    Raises
    ------
    InvalidInput
        Another file ending.
    ImportError
        matplotlib is not installed.
    """
    check_gif(path)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    # No layout engine: it would shift the axes from frame to frame.
    figure = Figure(figsize=_SIZE)
    FigureCanvasAgg(figure)
    with gif_writer(figure, path, _FPS, _DPI) as writer:
        for step in range(len(shapes)):
            figure.clear()
            _frame(figure, shapes, step)
            writer.grab_frame()
            if progress is not None:
                progress(step + 1)
        # The end is shown for longer.
        for _ in range(_HELD):
            writer.grab_frame()


def _frame(figure: Any, shapes: list[Shape], step: int) -> None:
    shape, scenes = shapes[step], [Scene.of(one, "auto") for one in shapes]
    # The shape that is bent most, the last one, has the plane of the bend.
    plane = plane_of(shapes[-1])
    length = shape.robot.backbone.total_length
    flat = plane.holds and all(
        np.abs((one.positions - shape.robot.base[:3, 3]) @ plane.normal).max() < 1e-6 * length
        for one in shapes
    )
    if flat:
        ax = figure.add_axes((0.13, 0.2, 0.84, 0.69))
        canvas: Flat | Solid = Flat(ax, plane, scenes[step])
    else:
        ax = figure.add_axes((0.02, 0.2, 0.92, 0.7), projection="3d")
        canvas = Solid(ax, plane, scenes[step])
    draw(canvas, scenes[step], disks=True, tendons=True)
    tips = np.array([one.tip[:3, 3] for one in shapes[: step + 1]])
    if len(tips) > 1:
        draw_marks(canvas, scenes[step], tips)
    rims = np.concatenate([_rims(scene) for scene in scenes])
    if isinstance(canvas, Flat):
        seen = rims @ np.array([plane.across, plane.up]).T
        margin = 0.04 * np.ptp(seen, axis=0).max()
        canvas.limits = seen.min(axis=0) - margin, seen.max(axis=0) + margin
    else:
        canvas.seen = [rims]
    canvas.finish()
    name = f"{shape.robot.name}\n" if shape.robot.name else ""
    state = "" if shape.ok else f", NOT A SOLUTION ({shape.status})"
    share = step / (len(shapes) - 1)
    colour = "black" if shape.ok else FAILED
    title = f"{name}{shape.model} model, {share:4.0%} of the pull{state}"
    figure.suptitle(title, fontsize=10, color=colour, parse_math=False)
    _legend(figure, scenes[-1])


def _legend(figure: Any, scene: Scene) -> None:
    """Name the tendons, with the lines that they end as: the same in every frame."""
    from matplotlib.lines import Line2D

    tendons = scene.tendons()
    if not tendons:
        return
    dashes: list[Any] = [(0, (4.0, 2.2)) if tendon.dashed else "-" for tendon in tendons]
    handles = [
        Line2D([], [], color=tendon.colour, linestyle=dash, linewidth=1.5)
        for tendon, dash in zip(tendons, dashes, strict=True)
    ]
    legend = figure.legend(
        handles,
        scene.shape.robot.tendon_names,
        loc="lower center",
        ncols=min(len(tendons), 4 if len(tendons) != 6 else 3),
        fontsize=8,
        frameon=False,
    )
    for text in legend.get_texts():
        text.set_parse_math(False)


def _rims(scene: Scene) -> NDArray[np.float64]:
    """Points on the rims of the disks: what the axes must hold."""
    frames, radius = scene.frames, 1.9 * scene.disk_radius
    sides = np.concatenate([frames[:, :3, 0], frames[:, :3, 1]]) * radius
    centres = np.concatenate([frames[:, :3, 3]] * 2)
    return np.concatenate([centres + sides, centres - sides])
