"""Parts of the picture of a shape, and the axes it is drawn on.

Everything is in the unit of the picture here. matplotlib is imported inside the functions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tdcr._base.arguments import numbers
from tdcr._plot.obstacles import is_endless, section, surface
from tdcr._plot.projection import Plane, smooth
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from tdcr._core import Shape

__all__ = ["Flat", "Scene", "Solid", "draw", "draw_forces", "draw_marks", "places_of"]

Unit = Literal["auto", "m", "mm"]
Points = NDArray[np.float64]

# Okabe and Ito's colours, which the colour-blind can tell apart; black and yellow left out.
_COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_BACKBONE, _DISK, _BASE = "#B9BEC5", "#5F6670", "#22262B"
_OBSTACLE, _FORCE, _MARK = "#8C7A5B", "#7B1FA2", "#000000"
_MOST_DISKS = 60
_SLACK = 1e-6  # share of its rest length by which a tendon must be loose to be drawn slack


@dataclass(frozen=True)
class _Tendon:
    points: Points
    colour: str
    dashed: bool
    label: str


@dataclass(frozen=True)
class Scene:
    """Everything in the unit of the picture, frames that are not finite left out."""

    shape: Shape
    unit: str
    scale: float
    frames: Points
    disk_radius: float

    @staticmethod
    def of(shape: Shape, unit: Unit) -> Scene:
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
        return Scene(shape, unit, scale, frames, radius * scale)

    def box(self, margin: float) -> tuple[Points, Points]:
        """Corners of a box around the robot, wider by a share of its length [m]."""
        far = margin * self.shape.robot.backbone.total_length
        places = self.frames[:, :3, 3] / self.scale
        return places.min(axis=0) - far, places.max(axis=0) + far

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


class Flat:
    """Plain axes that look at a plane."""

    def __init__(self, ax: Any, plane: Plane, scene: Scene) -> None:
        self.ax, self.plane, self.scene = ax, plane, scene
        self.limits: tuple[Points, Points] | None = None

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

    def obstacle(self, obstacle: Any) -> None:
        across, up, normal = self.plane.across, self.plane.up, self.plane.normal
        scene = self.scene
        places = scene.frames[:, :3, 3] / scene.scale
        origin = normal * (places[0] @ normal)
        places = places @ np.array([across, up]).T
        near = 0.3 * scene.shape.robot.backbone.total_length
        low, high = places.min(axis=0) - near, places.max(axis=0) + near
        self.limits = low * scene.scale, high * scene.scale
        u, v, distance = section(obstacle, origin, across, up, low, high)
        if distance.min() < 0.0 < distance.max():
            u, v = u * scene.scale, v * scene.scale
            bottom = [distance.min(), 0.0]
            self.ax.contourf(u, v, distance, bottom, colors=[_OBSTACLE], alpha=0.3, zorder=0.5)
            self.ax.contour(u, v, distance, [0.0], colors=[_OBSTACLE], linewidths=1.2, zorder=0.6)

    def arrow(self, point: Points, vector: Points) -> None:
        across, up = self.plane.across, self.plane.up
        style = {"width": 0.006, "color": _FORCE, "zorder": 4.0, "units": "width"}
        places = (point @ across, point @ up, vector @ across, vector @ up)
        self.ax.quiver(*places, angles="xy", scale_units="xy", scale=1.0, **style)
        self.line(point[None], color=_FORCE, marker="o", markersize=4, zorder=4.1)

    def finish(self) -> None:
        ax, unit = self.ax, self.scene.unit
        if self.limits is None:
            ax.set_aspect("equal", adjustable="datalim")
            ax.margins(0.06)
        else:
            ax.set_aspect("equal")
            ax.set_xlim(self.limits[0][0], self.limits[1][0])
            ax.set_ylim(self.limits[0][1], self.limits[1][1])
        ax.set_xlabel(f"{self.plane.across_name} [{unit}]")
        ax.set_ylabel(f"{self.plane.up_name} [{unit}]")
        ax.grid(True, color="#E6E8EB", linewidth=0.6)
        ax.set_axisbelow(True)
        for side in ("top", "right"):
            ax.spines[side].set_visible(False)


class Solid:
    """3-D axes."""

    def __init__(self, ax: Any, plane: Plane, scene: Scene) -> None:
        self.ax, self.plane, self.scene = ax, plane, scene
        self.seen: list[Points] = []

    def obstacle(self, obstacle: Any) -> None:
        from mpl_toolkits.mplot3d.art3d import (  # type: ignore[import-untyped]
            Poly3DCollection,
        )

        endless = is_endless(obstacle)
        polygons = surface(obstacle, *self.scene.box(0.2 if endless else 1.0))
        if polygons is None or not len(polygons):
            return
        polygons = polygons * self.scene.scale
        if not endless:
            self.seen.append(polygons.reshape(-1, 3))
        faces = Poly3DCollection(
            polygons, facecolors=_OBSTACLE, linewidths=0.0, shade=True, alpha=0.22
        )
        self.ax.add_collection3d(faces)

    def arrow(self, point: Points, vector: Points) -> None:
        self.seen.append(point[None] + vector)
        style = {"color": _FORCE, "linewidth": 1.8, "arrow_length_ratio": 0.3}
        self.ax.quiver(*point, *vector, **style)
        self.line(point[None], color=_FORCE, marker="o", markersize=3.5)

    def line(self, points: Points, **style: Any) -> None:
        self.seen.append(points)
        self.ax.plot(*points.T, **style)

    def disk(self, frame: Points, radius: float, base: bool) -> None:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

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
            # Numbers of three digits reach into the label of z.
            pad = 9 if name == "z" else 4
            getattr(ax, f"set_{name}label")(f"{name} [{unit}]", fontsize=9, labelpad=pad)
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


def draw(canvas: Flat | Solid, scene: Scene, disks: bool, tendons: bool) -> None:
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


def draw_forces(canvas: Flat | Solid, scene: Scene, largest: float | None = None) -> None:
    """Draw arrows, the one of the largest force (by default of this shape) of a fixed length."""
    forces = np.array([contact.force for contact in scene.shape.contacts]).reshape(-1, 3)
    sizes = np.linalg.norm(forces, axis=1)
    largest = sizes.max(initial=0.0) if largest is None else largest
    if not 0.0 < largest < np.inf:
        return
    unit = 0.25 * scene.shape.robot.backbone.total_length * scene.scale / largest
    for contact, force in zip(scene.shape.contacts, forces, strict=True):
        canvas.arrow(contact.point * scene.scale, force * unit)


def places_of(marks: Any) -> Points:
    """Check places to mark."""
    places = numbers("marks", marks)
    if places.ndim != 2 or places.shape[1] != 3:
        message = f"marks: expected places of shape (m, 3), got shape {places.shape}"
        raise InvalidInput(message, "marks")
    return places


def draw_marks(canvas: Flat | Solid, scene: Scene, places: Points) -> None:
    """Draw a cross at a single place, a line through several, with dots where they lie apart."""
    style: dict[str, Any] = {"linewidth": 0.8}
    if len(places) == 1:
        style = {"marker": "x", "markersize": 8.0, "markeredgewidth": 2.0}
    else:
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        if steps.mean() > 0.015 * scene.shape.robot.backbone.total_length:
            style |= {"marker": "o", "markersize": 2.2}
    canvas.line(places * scene.scale, color=_MARK, zorder=3.5, **style)
