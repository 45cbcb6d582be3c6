"""Pictures of shapes. Imported on first use by ``Shape.plot`` and the command line.

matplotlib is an optional extra (``pip install tdcr[plot]``) and imported inside the functions.
"""

from __future__ import annotations

import math
import os
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tdcr._view import Plane, plane_of, smooth
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tdcr._core import Shape

__all__ = ["plot_shape", "save_picture"]

View = Literal["auto", "2d", "3d"]
Unit = Literal["auto", "m", "mm"]
Points = NDArray[np.float64]

# Okabe and Ito's colours, which the colour-blind can tell apart; black and yellow left out.
_COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_BACKBONE, _DISK, _BASE, _FAILED = "#B9BEC5", "#5F6670", "#22262B", "#B3261E"
_MOST_DISKS = 60
_SLACK = 1e-6  # share of its rest length by which a tendon must be loose to be drawn slack


def plot_shape(
    shape: Shape,
    *,
    ax: Axes | None = None,
    view: View = "auto",
    disks: bool = True,
    tendons: bool = True,
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
        the shape stays in that plane, or else 3-D; given Axes decide for themselves.
    disks : bool
        Draw the disks, of `Backbone.disk_radius` or else 1.15 times the largest hole radius; of
        more than 60 every second, third, ...
    tendons : bool
        Draw the tendons; a free or slack one is dashed.
    legend : bool
        Name the tendons and how far each is pulled or released.
    title : str, optional
        Default: name of the robot, model and status. "" leaves it out.
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
    _require_matplotlib()
    _one_of("view", view, ("auto", "2d", "3d"))
    _one_of("unit", unit, ("auto", "m", "mm"))
    scene = _Scene.of(shape, unit)
    plane = plane_of(shape)
    flat = _is_flat(view, plane, ax)
    if ax is None:
        from matplotlib import pyplot

        ax = _axes(pyplot.figure(figsize=_SIZE, layout="constrained"), flat)
    canvas = _Flat(ax, plane, scene) if flat else _Solid(ax, plane, scene)
    _draw(canvas, scene, disks, tendons)
    canvas.finish()
    _label(ax, scene, title, legend and tendons)
    return ax


_SIZE = (6.4, 5.6)


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
    flat = _is_flat(options.get("view", "auto"), plane_of(shape), None)
    plot_shape(shape, ax=_axes(figure, flat), **options)
    figure.savefig(path, dpi=160, bbox_inches="tight")


def check_picture(path: str | os.PathLike[str]) -> None:
    """Refuse a path that no picture can be written to, before anything is solved.

    Raises
    ------
    InvalidInput
        A format that matplotlib does not write.
    ImportError
        matplotlib is not installed.
    """
    _require_matplotlib()
    from matplotlib.figure import Figure

    formats = Figure().canvas.get_supported_filetypes()
    if os.path.splitext(path)[1][1:].lower() not in formats:
        known = ", ".join(f".{name}" for name in sorted(formats))
        raise InvalidInput(
            f"path: expected a picture file ending in one of {known}, got {os.fspath(path)!r}",
            "path",
        )


def _require_matplotlib() -> None:
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise ImportError(
            "pictures need matplotlib, which is not installed: pip install tdcr[plot]"
        ) from error


def _one_of(argument: str, value: str, names: tuple[str, ...]) -> None:
    if value not in names:
        expected = " or ".join(f'"{name}"' for name in names)
        raise InvalidInput(f"{argument}: expected {expected}, got {value!r}", argument)


def _is_flat(view: View, plane: Plane, ax: Axes | None) -> bool:
    if ax is None:
        return plane.holds if view == "auto" else view == "2d"
    flat = ax.name != "3d"
    if view != "auto" and flat != (view == "2d"):
        raise InvalidInput(f'view: expected "{ax.name}" to suit the Axes, got {view!r}', "view")
    return flat


def _axes(figure: Figure, flat: bool) -> Axes:
    return figure.add_subplot() if flat else figure.add_subplot(projection="3d")


# --- what is drawn -------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Tendon:
    points: Points
    colour: str
    dashed: bool
    label: str


@dataclass(frozen=True)
class _Scene:
    """Everything in the unit of the picture, frames that are not finite left out."""

    shape: Shape
    unit: str
    scale: float
    frames: Points
    disk_radius: float

    @staticmethod
    def of(shape: Shape, unit: Unit) -> _Scene:
        robot = shape.robot
        if unit == "auto":
            unit = "mm" if robot.backbone.total_length < 2.0 else "m"
        scale = 1000.0 if unit == "mm" else 1.0
        finite = np.isfinite(shape.frames).all(axis=(1, 2))
        frames = np.array(shape.frames if finite.any() else robot.rest_frames)
        frames = frames[finite] if finite.any() else frames
        frames[:, :3, 3] *= scale
        radius = robot.backbone.disk_radius
        if radius is None:
            holes = [float(np.max(tendon.radius)) for tendon in robot.tendons]
            radius = 1.15 * max(holes, default=robot.backbone.total_length / 25)
        return _Scene(shape, unit, scale, frames, radius * scale)

    def colour(self) -> str:
        return _BACKBONE if self.shape.ok else "#E3A7A2"

    def shown_disks(self) -> Points:
        step = math.ceil(len(self.frames) / _MOST_DISKS)
        return self.frames[sorted({*range(0, len(self.frames), step), len(self.frames) - 1})]

    def tendons(self) -> list[_Tendon]:
        shape = self.shape
        found = []
        for k, (name, points) in enumerate(
            zip(shape.robot.tendon_names, shape.tendon_points, strict=True)
        ):
            rest, by = shape.robot.rest_lengths[k], shape.displacements[k]
            loose = rest + by - shape.tendon_lengths[k]
            if math.isinf(by):
                state = "free"
            elif shape.tensions[k] == 0.0 or loose > _SLACK * rest:
                state = f"{self._by(by)}, slack"
            else:
                state = self._by(by)
            points = points[np.isfinite(points).all(axis=1)] * self.scale
            dashed = state.endswith(("free", "slack"))
            colour = _COLOURS[k % len(_COLOURS)]
            # A label that starts with an underscore would be left out of the legend.
            label = f" {name}" if name.startswith("_") else name
            found.append(_Tendon(points, colour, dashed, f"{label} ({state})"))
        return found

    def _by(self, displacement: float) -> str:
        text = f"{displacement * self.scale:+.3g} {self.unit}".replace("-", "\N{MINUS SIGN}")
        return "held" if displacement == 0.0 else text


class _Flat:
    """Plain axes that look at a plane."""

    def __init__(self, ax: Any, plane: Plane, scene: _Scene) -> None:
        self.ax, self.plane, self.scene = ax, plane, scene

    def line(self, points: Points, **style: Any) -> None:
        across, up = self.plane.across, self.plane.up
        self.ax.plot(points @ across, points @ up, **style)

    def disk(self, frame: Points, radius: float, base: bool) -> None:
        # A disk is seen edge-on: its widest line in the plane.
        side = np.cross(self.plane.normal, frame[:3, 2])
        ends = frame[:3, 3] + radius * np.outer([-1.0, 1.0], side)
        self.line(
            ends,
            color=_BASE if base else _DISK,
            linewidth=3.2 if base else 1.3,
            solid_capstyle="round",
            zorder=3.0 if base else 1.5,
        )

    def ground(self, frame: Points, radius: float) -> None:
        """Hatch the side of the base that is fixed."""
        side = np.cross(self.plane.normal, frame[:3, 2])
        for share in np.linspace(-0.9, 1.0, 7):
            start = frame[:3, 3] + 1.15 * share * radius * side
            end = start - radius * (0.22 * frame[:3, 2] + 0.22 * side)
            self.line(np.array([start, end]), color=_BASE, linewidth=0.9, zorder=1.0)

    def finish(self) -> None:
        ax, unit = self.ax, self.scene.unit
        ax.set_aspect("equal", adjustable="datalim")
        ax.margins(0.06)
        ax.set_xlabel(f"{self.plane.across_name} [{unit}]")
        ax.set_ylabel(f"{self.plane.up_name} [{unit}]")
        ax.grid(True, color="#E6E8EB", linewidth=0.6)
        ax.set_axisbelow(True)
        for side in ("top", "right"):
            ax.spines[side].set_visible(False)


class _Solid:
    """3-D axes."""

    def __init__(self, ax: Any, plane: Plane, scene: _Scene) -> None:
        self.ax, self.plane, self.scene = ax, plane, scene
        self.seen: list[Points] = []

    def line(self, points: Points, **style: Any) -> None:
        self.seen.append(points)
        self.ax.plot(*points.T, **style)

    def disk(self, frame: Points, radius: float, base: bool) -> None:
        from mpl_toolkits.mplot3d.art3d import (  # type: ignore[import-untyped]
            Poly3DCollection,
        )

        turn = np.linspace(0.0, 2.0 * np.pi, 49)[:, None]
        rim = frame[:3, 3] + radius * (np.cos(turn) * frame[:3, 0] + np.sin(turn) * frame[:3, 1])
        self.seen.append(rim)
        colour = _BASE if base else _DISK
        self.ax.add_collection3d(
            Poly3DCollection(
                [rim],
                facecolor=(colour, 0.55 if base else 0.04),
                edgecolor=(colour, 0.9 if base else 0.75),
                linewidth=1.6 if base else 0.8,
            )
        )

    def ground(self, frame: Points, radius: float) -> None:
        """Draw the base frame: z along the backbone, x towards azimuth 0."""
        for axis in (0, 1):
            tip = frame[:3, 3] + 1.6 * radius * frame[:3, axis]
            self.line(np.array([frame[:3, 3], tip]), color=_BASE, linewidth=0.9)
            at = frame[:3, 3] + 1.85 * radius * frame[:3, axis]
            self.ax.text(*at, "xy"[axis], color=_BASE, fontsize=8, ha="center", va="center")

    def finish(self) -> None:
        ax, unit = self.ax, self.scene.unit
        points = np.concatenate(self.seen)
        low, high = points.min(axis=0), points.max(axis=0)
        # Equal scale in a box no larger than the shape, but never a sliver.
        span = np.maximum(high - low, 0.25 * (high - low).max())
        middle = (low + high) / 2
        for axis, name in enumerate("xyz"):
            half = 0.5 * span[axis]
            getattr(ax, f"set_{name}lim")(middle[axis] - half, middle[axis] + half)
            getattr(ax, f"set_{name}label")(f"{name} [{unit}]", fontsize=9)
            spread = round(6 * span[axis] / span.max())
            getattr(ax, f"{name}axis").set_major_locator(_locator(max(2, spread)))
            pane = getattr(ax, f"{name}axis")
            pane.set_pane_color((1.0, 1.0, 1.0, 0.0))
            pane.line.set_color("#9AA0A8")
        ax.tick_params(labelsize=8)
        ax.set_box_aspect(span, zoom=1.02)
        # Look at the bending plane from the side, a little from above.
        ax.view_init(elev=18.0, azim=self.plane.azimuth - 62.0)


def _locator(ticks: int) -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=ticks, steps=[1, 2, 5, 10])


def _draw(canvas: _Flat | _Solid, scene: _Scene, disks: bool, tendons: bool) -> None:
    base = scene.frames[0]
    canvas.ground(base, scene.disk_radius)
    if disks:
        for frame in scene.shown_disks()[1:]:
            canvas.disk(frame, scene.disk_radius, False)
    canvas.disk(base, scene.disk_radius, True)
    canvas.line(
        smooth(scene.frames),
        color=scene.colour(),
        linewidth=5.0,
        solid_capstyle="round",
        zorder=2.0,
    )
    for tendon in scene.tendons() if tendons else ():
        canvas.line(
            tendon.points,
            color=tendon.colour,
            linewidth=1.5,
            linestyle=(0, (4.0, 2.2)) if tendon.dashed else "-",
            label=tendon.label,
            zorder=2.5,
        )
        canvas.line(tendon.points[-1:], color=tendon.colour, marker="o", markersize=3.5, zorder=2.6)


def _label(ax: Any, scene: _Scene, title: str | None, legend: bool) -> None:
    shape = scene.shape
    if title is None:
        name = f"{shape.robot.name}\n" if shape.robot.name else ""
        title = f"{name}{shape.model} model, {shape.status}"
    if not shape.ok:
        text = f"NOT A SOLUTION ({shape.status}): {shape.message}"
        title = f"{title}\n{textwrap.fill(text, 80)}".lstrip("\n")
    if title:
        # Names and messages are text, not formulas: a "$" in them is a "$".
        ax.set_title(title, fontsize=10, color="black" if shape.ok else _FAILED, parse_math=False)
    if legend and shape.robot.tendons:
        count = len(shape.robot.tendons)
        entries = ax.legend(
            fontsize=8,
            frameon=False,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.12 if ax.name != "3d" else 0.0),
            ncols=min(count, 4 if count != 6 else 3),
            title="tendons",
            title_fontsize=8,
        )
        for text in entries.get_texts():
            text.set_parse_math(False)
