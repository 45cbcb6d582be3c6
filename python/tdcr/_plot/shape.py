"""Pictures of shapes. Imported on first use by ``Shape.plot`` and the command line.

matplotlib is an optional extra (``pip install tdcr[plot]``) and imported inside the functions.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tdcr._io.atomic_write import replace_file
from tdcr._plot.axes import (
    Flat,
    Points,
    Scene,
    Solid,
    Unit,
    draw,
    draw_forces,
    draw_marks,
    places_of,
)
from tdcr._plot.projection import Plane, plane_of
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from tdcr._core import Shape

__all__ = [
    "FAILED",
    "axes_of",
    "check_picture",
    "one_of",
    "plot_shape",
    "require_matplotlib",
    "save_drawing",
    "save_figure",
    "save_picture",
]

View = Literal["auto", "2d", "3d"]

FAILED = "#B3261E"
_SIZE = (6.4, 5.6)


def plot_shape(
    shape: Shape,
    *,
    ax: Axes | None = None,
    view: View = "auto",
    disks: bool = True,
    tendons: bool = True,
    obstacles: bool = True,
    contacts: bool = True,
    marks: ArrayLike | None = None,
    legend: bool = True,
    title: str | None = None,
    unit: Unit = "auto",
) -> Axes:
    """Draw a shape: backbone, disks, tendons and base, at equal scale on all axes.

    Parameters
    ----------
    shape : Shape
        Also one that did not converge: its last iterate is drawn and the picture says so.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into, plain or 3-D. Default: those of a new pyplot figure.
    view : {"auto", "2d", "3d"}
        "2d" looks at the plane through the base axis in which the shape bends. "auto" takes it when
        the shape and the marks stay in that plane, or else 3-D; given Axes decide for themselves.
    disks : bool
        Draw the disks, of `Backbone.disk_radius` or else 1.15 times the largest hole radius; of
        more than 60 every second, third, ...
    tendons : bool
        Draw the tendons; a free or slack one is dashed.
    obstacles : bool
        Draw the obstacles: in a plane what it cuts of them, in 3-D their surfaces up to the robot's
        length away (not those of a `SignedDistance`).
    contacts : bool
        Draw the contact forces as arrows, the largest a quarter of the robot's length.
    marks : array_like, shape (m, 3)
        Places to mark, in their order: a target, a path [m].
    legend : bool
        Name the tendons and how far each is pulled or released.
    title : str, optional
        Default: name of the robot, model, status and contacts. "" leaves it out.
    unit : {"auto", "m", "mm"}
        Unit of the axes. "auto" is mm for a robot shorter than 2 m.

    Returns
    -------
    matplotlib.axes.Axes
        Not shown and not saved.

    Raises
    ------
    InvalidInput
        An unknown `view` or `unit`, or a `view` that the given Axes cannot show.
    ImportError
        matplotlib is not installed.
    """
    # Options, and the plane of the picture.
    require_matplotlib()
    one_of("view", view, ("auto", "2d", "3d"))
    one_of("unit", unit, ("auto", "m", "mm"))
    scene = Scene.of(shape, unit)
    plane = plane_of(shape)
    places = None if marks is None else places_of(marks)
    flat = _is_flat(shape, view, plane, ax, places)
    if ax is None:
        from matplotlib import pyplot

        ax = axes_of(pyplot.figure(figsize=_SIZE, layout="constrained"), flat)
    # From what lies behind to what lies in front.
    canvas = Flat(ax, plane, scene) if flat else Solid(ax, plane, scene)
    for obstacle in shape.obstacles if obstacles else ():
        canvas.obstacle(obstacle)
    draw(canvas, scene, disks, tendons)
    if contacts:
        draw_forces(canvas, scene)
    if places is not None and len(places):
        draw_marks(canvas, scene, places)
    canvas.finish()
    _label(ax, scene, title, legend and tendons)
    return ax


def save_picture(shape: Shape, path: str | os.PathLike[str], **options: Any) -> None:
    """Draw a shape into a file, without pyplot and so without a display.

    Parameters
    ----------
    shape : Shape
    path : str or os.PathLike
        Its ending (.png, .pdf, .svg, ...) is the format.
    **options
        Those of `plot_shape`, except `ax`.

    Raises
    ------
    InvalidInput
        A format that matplotlib does not write.
    ImportError
        matplotlib is not installed.
    OSError
        The file cannot be written.
    """
    check_picture(path)
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE, layout="constrained")
    marks = options.get("marks")
    places = None if marks is None else places_of(marks)
    flat = _is_flat(shape, options.get("view", "auto"), plane_of(shape), None, places)
    plot_shape(shape, ax=axes_of(figure, flat), **options)
    save_figure(figure, path)


def save_drawing(
    draw: Callable[[Axes], object],
    path: str | os.PathLike[str],
    *,
    flat: bool,
    size: tuple[float, float] = _SIZE,
) -> None:
    """Write what is drawn into axes, without pyplot; see `save_picture`."""
    check_picture(path)
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    draw(axes_of(figure, flat))
    save_figure(figure, path)


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure, by the ending of the path; the file appears complete or not at all."""
    kind = os.path.splitext(path)[1][1:].lower()
    replace_file(
        path,
        lambda stream: figure.savefig(stream, format=kind, dpi=160, bbox_inches="tight"),
    )


def check_picture(path: str | os.PathLike[str]) -> None:
    """Refuse a path that no picture can be written to, before anything is solved.

    Raises
    ------
    InvalidInput
        A format that matplotlib does not write.
    ImportError
        matplotlib is not installed.
    """
    require_matplotlib()
    from matplotlib.figure import Figure

    formats = Figure().canvas.get_supported_filetypes()
    if os.path.splitext(path)[1][1:].lower() not in formats:
        known = ", ".join(f".{name}" for name in sorted(formats))
        raise InvalidInput(
            f"path: expected a picture file ending in one of {known}, got {os.fspath(path)!r}",
            "path",
        )


def require_matplotlib() -> None:
    """Say how to get matplotlib where it is not installed."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise ImportError(
            "pictures need matplotlib, which is not installed: pip install tdcr[plot]"
        ) from error


def one_of(argument: str, value: str, names: tuple[str, ...]) -> None:
    """Refuse a word that is none of those known."""
    if value not in names:
        expected = " or ".join(f'"{name}"' for name in names)
        raise InvalidInput(f"{argument}: expected {expected}, got {value!r}", argument)


def _is_flat(
    shape: Shape, view: View, plane: Plane, ax: Axes | None, places: Points | None
) -> bool:
    if ax is None:
        return plane.holds and _lie_in(shape, plane, places) if view == "auto" else view == "2d"
    flat = ax.name != "3d"
    if view != "auto" and flat != (view == "2d"):
        raise InvalidInput(f'view: expected "{ax.name}" to suit the Axes, got {view!r}', "view")
    return flat


def _lie_in(shape: Shape, plane: Plane, places: Points | None) -> bool:
    """Tell if marked places are in the plane too."""
    if places is None:
        return True
    off = (places - shape.robot.base[:3, 3]) @ plane.normal
    return bool(np.abs(off).max(initial=0.0) <= 1e-6 * shape.robot.backbone.total_length)


def axes_of(figure: Figure, flat: bool) -> Axes:
    """Add plain or 3-D axes to a figure."""
    return figure.add_subplot() if flat else figure.add_subplot(projection="3d")


def _touches(shape: Shape) -> str:
    """Tell the number of contacts and the largest force."""
    if not shape.contacts:
        return "no contact"
    largest = max(float(np.linalg.norm(contact.force)) for contact in shape.contacts)
    count = len(shape.contacts)
    unit = "N" if shape.units == "N" else "EI/m²"
    return f"{count} contact{'s' if count > 1 else ''}, at most {largest:.3g} {unit}"


def _label(ax: Any, scene: Scene, title: str | None, legend: bool) -> None:
    shape = scene.shape
    if title is None:
        name = f"{shape.robot.name}\n" if shape.robot.name else ""
        title = f"{name}{shape.model} model, {shape.status}"
        title += f"\n{_touches(shape)}" if shape.obstacles else ""
    if not shape.ok:
        text = f"NOT A SOLUTION ({shape.status}): {shape.message}"
        title = f"{title}\n{textwrap.fill(text, 80)}".lstrip("\n")
    if title:
        # Names and messages are text, not formulas: a "$" in them is a "$".
        ax.set_title(title, fontsize=10, color="black" if shape.ok else FAILED, parse_math=False)
    if legend and shape.robot.tendons:
        count = len(shape.robot.tendons)
        entries = ax.legend(
            fontsize=8,
            frameon=False,
            loc="upper center",
            # Labels of axes in 3-D hang lower than those in a plane.
            bbox_to_anchor=(0.5, -0.2 if ax.name == "3d" else -0.12),
            ncols=min(count, 4 if count != 6 else 3),
            title="tendons",
            title_fontsize=8,
        )
        for text in entries.get_texts():
            text.set_parse_math(False)
