"""Parameters of a fit as a vector: robots from values, predicted points, their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._base.rotations import rotation, spins
from tdcr._forward.batch import forward_batch
from tdcr.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import Robot, Shape

    Array: TypeAlias = NDArray[np.float64]

__all__ = ["NAMES", "PER_TENDON", "SIZES", "Measured", "Problem"]

PER_TENDON = ("offset", "gain", "radius", "azimuth", "stiffness")
# Numbers of values by name, K of a robot with K tendons.
SIZES: dict[str, int | str] = {
    **dict.fromkeys(PER_TENDON, "K"),
    **{"poisson_ratio": 1, "rest": 2, "base": 6},
}
NAMES = tuple(SIZES)
# Measured points are no further from the base than so many lengths.
_FARTHEST = 1e6


@dataclass(frozen=True)
class Measured:
    """Rows without gaps: displacements (rows, K) and points (rows, points, 3)."""

    displacements: Array
    points: Array
    rows: NDArray[np.int64]
    dropped: int

    @staticmethod
    def checked(robot: Robot, displacements: ArrayLike, measurements: ArrayLike) -> Measured:
        """Check shapes and drop rows with gaps."""
        pulls = _numbers("displacements", displacements)
        points = _numbers("measurements", measurements)
        tendons, disks = len(robot.tendons), robot.backbone.count + 1
        if pulls.ndim != 2 or pulls.shape[1] != tendons:
            message = f"displacements: expected shape (B, {tendons}), got shape {pulls.shape}"
            raise InvalidInput(message, "displacements")
        rows = len(pulls)
        if rows == 0:
            message = "measurements: expected at least one row, got none"
            raise InvalidInput(message, "measurements")
        if points.shape not in ((rows, 3), (rows, disks, 3)):
            raise InvalidInput(
                f"measurements: expected one row per displacement, shape ({rows}, 3) or "
                f"({rows}, {disks}, 3), got shape {points.shape}",
                "measurements",
            )
        if np.isinf(points).any():
            message = "measurements: expected finite positions, or NaN for gaps, got inf"
            raise InvalidInput(message, "measurements")
        points = points.reshape(rows, -1, 3)
        far = np.abs(points - robot.base[:3, 3]) / robot.backbone.total_length
        if np.nanmax(far, initial=0.0) > _FARTHEST:
            raise InvalidInput(
                f"measurements: expected positions within {_FARTHEST:g} lengths of the robot from "
                f"its base [m], got one {np.nanmax(far):.3g} lengths away",
                "measurements",
            )
        full = ~np.isnan(points).any(axis=(1, 2)) & ~np.isnan(pulls).any(axis=1)
        if not full.any():
            message = f"measurements: expected a row without NaN, got none in {rows}"
            raise InvalidInput(message, "measurements")
        dropped = rows - int(full.sum())
        return Measured(pulls[full], points[full], np.flatnonzero(full), dropped)

    def only(self, chosen: NDArray[np.bool_]) -> Measured:
        """Return some of the rows."""
        return replace(
            self,
            displacements=self.displacements[chosen],
            points=self.points[chosen],
            rows=self.rows[chosen],
        )


def _numbers(argument: str, given: ArrayLike) -> Array:
    try:
        array = np.asarray(given)
    except ValueError as error:
        message = f"{argument}: expected a rectangular array of numbers, got {error}"
        raise InvalidInput(message, argument) from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{argument}: expected numbers, got dtype {array.dtype}")
    return array.astype(np.float64)


class Problem:
    """A robot with some of its parameters as a vector of values."""

    def __init__(self, robot: Robot, names: list[str], model: str, settings: Any) -> None:
        self._given, self._model, self._settings = robot, model, settings
        count, length = len(robot.tendons), robot.backbone.total_length
        sizes = {name: count if size == "K" else int(size) for name, size in SIZES.items()}
        # What changes points by about as much as a shift by the robot's length.
        units: dict[str, Any] = {
            "offset": 1 / length,
            "rest": length,
            "base": np.repeat([1 / length, 1], 3),
        }
        for name in {"radius", "stiffness"} & set(names):
            units[name] = 1 / np.array([getattr(tendon, name) for tendon in robot.tendons])
        self._slices: dict[str, slice] = {}
        scales: list[Array] = []
        for name in names:
            start = sum(map(len, scales))
            self._slices[name] = slice(start, start + sizes[name])
            scales.append(np.broadcast_to(units.get(name, 1.0), sizes[name]).astype(np.float64))
        self.scales = np.concatenate(scales)
        self.size = len(self.scales)

    def named(self, values: Array) -> dict[str, Array]:
        """Values by name, read-only."""
        found = {name: values[part].copy() for name, part in self._slices.items()}
        for array in found.values():
            array.flags.writeable = False
        return found

    def start(self) -> Array:
        """Values of the robot as given."""
        tendons = self._given.tendons
        own: dict[str, Any] = {
            "gain": 1.0,
            "poisson_ratio": self._given.backbone.poisson_ratio,
        }
        for name in {"radius", "azimuth", "stiffness"} & set(self._slices):
            own[name] = [getattr(tendon, name) for tendon in tendons]
        values = np.zeros(self.size)
        for name, part in self._slices.items():
            values[part] = own.get(name, 0.0)
        return values

    def _limits(self) -> tuple[Array, Array]:
        """Least and greatest values that a robot can have."""
        disk = self._given.backbone.disk_radius
        low, high = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        for name, least, most in (
            ("gain", 1e-3, 1e3),
            # Holes are in the disks.
            ("radius", 1e-6, np.inf if disk is None else disk),
            ("stiffness", 1e-3, 1e12),
            ("poisson_ratio", -0.99, 0.5),
        ):
            if name in self._slices:
                low[self._slices[name]], high[self._slices[name]] = least, most
        return low, high

    def bounded(self, values: Array) -> Array:
        """Values that a robot can have."""
        return values.clip(*self._limits())

    def at_bounds(self, values: Array) -> list[str]:
        """Say which values are as small or as great as a robot can have."""
        low, high = self._limits()
        held = self.named(((values <= low) | (values >= high)).astype(np.float64))
        bound = [name for name, those in held.items() if those.any()]
        return [f"at the least or greatest that a robot can have: {', '.join(bound)}"] * bool(bound)

    def robot(self, values: Array) -> Robot:
        """Return the robot with the values."""
        given, at = self._given, self.named(values)
        backbone, tendons, base = given.backbone, given.tendons, given.base
        if "rest" in at or "poisson_ratio" in at:
            keywords = backbone.__getnewargs_ex__()[1]
            keywords["poisson_ratio"] = float(at.get("poisson_ratio", [backbone.poisson_ratio])[0])
            if "rest" in at:
                own = np.zeros((backbone.count, 3)) if backbone.rest is None else backbone.rest
                keywords["rest"] = own + backbone.lengths[:, None] * np.append(at["rest"], 0.0)
            backbone = _core.Backbone(*backbone.__getnewargs_ex__()[0], **keywords)
        if {"radius", "azimuth", "stiffness"} & set(at):
            tendons = tuple(
                _core._tendon(
                    float(at["azimuth"][k]) if "azimuth" in at else tendon.azimuth,
                    float(at["radius"][k]) if "radius" in at else tendon.radius,
                    tendon.turns,
                    tendon.indices,
                    tendon.count,
                    tendon.end,
                    float(at["stiffness"][k]) if "stiffness" in at else tendon.stiffness,
                    tendon.name,
                )
                for k, tendon in enumerate(tendons)
            )
        if "base" in at:
            shift = np.eye(4)
            shift[:3, :3] = rotation(at["base"][3:]) @ base[:3, :3]
            shift[:3, 3] = base[:3, 3] + at["base"][:3]
            base = shift
        return _core.Robot(backbone, tendons, base=base, tool=given.tool, name=given.name)

    def _pulls(self, values: Array, measured: Measured) -> Array:
        at = self.named(values)
        pulls: Array = measured.displacements * at.get("gain", 1.0)
        return pulls + at.get("offset", 0.0)

    def _points(self, values: Array, measured: Measured) -> tuple[Array, NDArray[np.bool_]]:
        """Predicted points, and which rows were solved."""
        robot, pulls = self.robot(values), self._pulls(values, measured)
        one = measured.points.shape[1] == 1
        batch = forward_batch(
            robot,
            pulls,
            model=self._model,
            settings=self._settings,
            fields=["tip" if one else "positions"],
        )
        points = (batch.tip @ robot.tool)[:, None, :3, 3] if one else batch.positions
        return points, batch.ok & np.isfinite(points).all(axis=(1, 2))

    def residuals(self, values: Array, measured: Measured) -> tuple[Array, NDArray[np.bool_]]:
        """Measured minus predicted points, and which rows were solved."""
        points, solved = self._points(values, measured)
        return measured.points - points, solved

    def jacobian(self, values: Array, measured: Measured) -> Array:
        """Differentiate the predicted points, (P, rows, points, 3); 0 in rows not solved."""
        out = np.zeros((self.size, *measured.points.shape))
        by_model = [name for name in self._slices if name != "base"]
        if self._model == "rod" and by_model:
            self._fill_exact(values, measured, out)
        elif by_model:
            self._fill_differences(values, measured, by_model, out)
        if "base" in self._slices:
            part = out[self._slices["base"]]
            arms = self._points(values, measured)[0] - self.robot(values).base[:3, 3]
            for c, spin in enumerate(spins(values[self._slices["base"]][3:])):
                part[c] = np.eye(3)[c]
                part[3 + c] = np.cross(spin, arms)
        return out

    def _fill_differences(
        self, values: Array, measured: Measured, names: list[str], out: Array
    ) -> None:
        for name in names:
            for p in range(*self._slices[name].indices(self.size)):
                step = np.zeros(self.size)
                step[p] = 1e-6 / self.scales[p]
                ahead, behind = (self._points(values + s, measured)[0] for s in (step, -step))
                out[p] = (ahead - behind) / (2 * step[p])

    def _fill_exact(self, values: Array, measured: Measured, out: Array) -> None:
        robot = self.robot(values)
        for row, pulls in enumerate(self._pulls(values, measured)):
            shape = _core.forward(robot, pulls, settings=self._settings)
            try:
                at = _core.sensitivity(shape)
            except NotConverged:
                continue
            given = measured.displacements[row]
            arm = shape.tip[:3, :3] @ robot.tool[:3, 3]
            points = out.shape[2]
            for j in range(points):
                disk = shape.positions.shape[0] - 1 if points == 1 else j
                for c, axis in enumerate(np.eye(3)):
                    weights, moments = np.zeros((2, *shape.positions.shape))
                    weights[disk] = axis
                    if points == 1:
                        moments[disk] = np.cross(arm, axis)
                    gradient = at.adjoint(weights, moments)
                    for name, slopes in self._chain_rule(shape, given, gradient).items():
                        out[self._slices[name], row, j, c] = slopes

    def _chain_rule(self, shape: Shape, given: Array, by: Any) -> dict[str, Any]:
        """Slopes by the values from those by all that a rod is made of."""
        robot = shape.robot
        found: dict[str, Any] = {}
        if "offset" in self._slices:
            found["offset"] = by.displacements
        if "gain" in self._slices:
            # Free tendons have no slope.
            found["gain"] = by.displacements * np.where(np.isinf(given), 0.0, given)
        if "radius" in self._slices or "azimuth" in self._slices:
            angle = np.array([tendon.azimuth for tendon in robot.tendons])
            radius = np.array([tendon.radius for tendon in robot.tendons])
            x, y, _ = np.array([holes.sum(axis=0) for holes in by.holes]).T
            slopes = {
                "radius": x * np.cos(angle) + y * np.sin(angle),
                "azimuth": radius * (y * np.cos(angle) - x * np.sin(angle)),
            }
            found |= {name: slope for name, slope in slopes.items() if name in self._slices}
        if "stiffness" in self._slices:
            # A tendon may be longer by its rest length times T/EA: less of that is a pull.
            stiffness = np.array([tendon.stiffness for tendon in robot.tendons])
            strain = shape.tensions / stiffness
            free = np.isinf(shape.displacements)
            rest = (shape.tendon_lengths - np.where(free, 0.0, shape.displacements)) / (1 + strain)
            found["stiffness"] = -by.displacements * rest * strain / stiffness
        if "poisson_ratio" in self._slices:
            found["poisson_ratio"] = by.poisson_ratio
        if "rest" in self._slices:
            found["rest"] = (robot.backbone.lengths[:, None] * by.rest).sum(axis=0)[:2]
        return found
