"""Fits: parameters of a robot from measured positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np

from tdcr import _core
from tdcr._base.status import Status
from tdcr._base.value import Value
from tdcr._io.save_load import Saved
from tdcr.design.fit_checks import at_bounds, check_problem, far_off, unsolved, whole
from tdcr.design.measurements import Measurements
from tdcr.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr._core import ConstantCurvatureSettings, Robot, RodSettings

    Array: TypeAlias = NDArray[np.float64]
    Part: TypeAlias = Literal["train", "validation"]

__all__ = ["Fit", "fit"]


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Saved, Value):
    """Parameters fitted to measurements, and how well. Arrays are read-only.

    Rows without gaps and of finite displacements are the kept ones; all arrays are over these.
    """

    robot: Robot
    """The robot with its fitted holes, rest shape, Poisson's ratio and base. Offsets and gains of
    displacements are not part of a robot: see `displacements`."""
    parameters: dict[str, Array]
    """Values by name: "offset" (K,) [m], "gain" (K,), "radius" (K,) [m], "azimuth" (K,) [rad],
    "stiffness" (K,) [N], "poisson_ratio" (1,), "rest" (2,) [1/m], "base" (6,) [m, rad]."""
    standard_errors: dict[str, Array]
    """Standard error of each value, by the sandwich estimate; inf where the data do not tell it."""
    residuals: Array
    """Measured minus predicted positions, (rows, points, 3) [m]."""
    residuals_before: Array
    """Residuals with the robot as it was given."""
    rows: NDArray[np.int64]
    """Indices of the kept rows in the measurements."""
    validation: NDArray[np.bool_]
    """Which of the kept rows were held out."""
    dropped: int
    """Rows left out for their gaps (NaN)."""
    failed: int
    """Kept rows whose forward solve did not converge at the end; they count with the last
    iterate."""
    status: Status
    """converged, or iteration_limit."""
    message: str
    """Says if steps still fell; how many forward solves failed; if the root mean square
    distance of the points fitted to is more than 10 times their median, which outliers make, or
    more than 5 % of the robot's length: then the model is not of these measurements. Empty if none
    of these."""
    iterations: int
    """Levenberg-Marquardt steps."""
    seed: int
    """Seed of the split."""

    _hashed: ClassVar[tuple[str, ...]] = ("robot", "residuals", "seed")

    @property
    def ok(self) -> bool:
        """True if it converged."""
        return self.status is Status.converged

    def require(self) -> Fit:
        """Return the result itself, or raise `NotConverged` with its message."""
        if self.ok:
            return self
        raise NotConverged(f"{self.status}: {self.message}", self)

    def distances(self, part: Part = "validation", *, before: bool = False) -> Array:
        """Distances of predicted from measured points of a part of the rows, flat [m]."""
        if part not in ("train", "validation"):
            message = f'part: expected "train" or "validation", got {part!r}'
            raise InvalidInput(message, "part")
        residuals = self.residuals_before if before else self.residuals
        rows = self.validation if part == "validation" else ~self.validation
        flat: Array = np.linalg.norm(residuals[rows], axis=2).ravel()
        return flat

    def rms(self, part: Part = "validation", *, before: bool = False) -> float:
        """Root of the mean squared distance of a part of the rows [m]; NaN for no rows."""
        distances = self.distances(part, before=before)
        return float(np.sqrt(np.mean(distances**2))) if distances.size else float("nan")

    def mean(self, part: Part = "validation", *, before: bool = False) -> float:
        """Mean distance of a part of the rows [m]; NaN for no rows."""
        distances = self.distances(part, before=before)
        return float(np.mean(distances)) if distances.size else float("nan")

    def displacements(self, given: ArrayLike) -> Array:
        """Displacements for `forward` on `robot` from those of the measurements, (..., K) [m]."""
        count = len(self.robot.tendons)
        gain = self.parameters.get("gain", np.ones(count))
        shifted: Array = np.asarray(given, dtype=np.float64) * gain
        return shifted + self.parameters.get("offset", np.zeros(count))

    def plot(self, ax: Any = None) -> Any:
        """Draw which share of the held-out points (all, if none were) is within a distance.

        Parameters
        ----------
        ax : matplotlib Axes, optional

        Returns
        -------
        matplotlib Axes
        """
        from tdcr._plot.fit import plot_distances

        part: Part = "validation" if self.validation.any() else "train"
        whose = {"validation": "held-out", "train": "fitted"}[part]
        before, after = (self.distances(part, before=b) for b in (True, False))
        return plot_distances(before, after, whose, ax)

    def plot_residuals(self, axes: Any = None) -> Any:
        """Draw measured minus predicted positions along x, y and z over the rows.

        Outliers beyond twice what 99 % keep within are drawn at the edge and counted.

        Parameters
        ----------
        axes : sequence of three matplotlib Axes, optional
            One above the other.

        Returns
        -------
        sequence of three matplotlib Axes
        """
        from tdcr._plot.fit import plot_residuals

        return plot_residuals(
            self.residuals_before, self.residuals, self.rows, self.validation, axes
        )

    def __repr__(self) -> str:
        """Tell what was fitted and how well."""
        part: Part = "validation" if self.validation.any() else "train"
        before, after = self.rms(part, before=True), self.rms(part)
        names = ", ".join(self.parameters)
        return f"<Fit of {names}, {self.status}, {part} rms {before:.3g} m before, {after:.3g} m>"


def fit(
    robot: Robot,
    measurements: ArrayLike | Measurements,
    parameters: Sequence[str],
    *,
    displacements: ArrayLike | None = None,
    model: str = "rod",
    settings: RodSettings | ConstantCurvatureSettings | None = None,
    validation: float = 0.2,
    seed: int = 0,
    robust: bool = True,
    max_iterations: int = 50,
) -> Fit:
    """Estimate parameters of a robot from measured positions under many pulls.

    Levenberg-Marquardt steps on the distances between measured and predicted points: first least
    squares, then, if `robust`, the soft-L1 loss with twice the median distance as its scale.
    Derivatives are exact, and one forward solve of a row gives them with its points.

    Parameters
    ----------
    robot : Robot
        Where the fit starts. Its tool is what is measured if only one point is.
    measurements : array_like, shape (B, 3) or (B, n + 1, 3), or Measurements
        Positions of the tool point, or of all disks, world frame [m]. Rows with gaps (NaN) are
        dropped and counted. What `tdcr.read_measurements` reads has the displacements with it.
    parameters : sequence of str
        What to estimate: "offset" and "gain" of each displacement (used are gain * displacement +
        offset), "radius" and "azimuth" of each tendon's holes (straight tendons), "stiffness" of
        each tendon (all elastic; positions tell its ratio to the backbone's), "poisson_ratio",
        "rest" (a curvature about x and y, added to the rest shape), "base" (a shift, and a rotation
        about the base's origin, world axes).
    displacements : array_like, shape (B, K)
        As for `forward_batch` [m]: negative pulls, `inf` is free. Not with `Measurements`.
    model : {"rod", "constant_curvature"}, optional
        The latter has no "stiffness", no "poisson_ratio" and no "rest".
    settings : RodSettings or ConstantCurvatureSettings, optional
    validation : float, optional
        Share of the rows that is held out, in [0, 0.9].
    seed : int, optional
        Of the split.
    robust : bool, optional
    max_iterations : int, optional
        Steps at most, of both rounds.

    Returns
    -------
    Fit

    Raises
    ------
    InvalidInput
        Arrays of another shape, no rows, infinite measurements or such that are a million lengths
        away, no row without gaps, fewer numbers than unknowns, a parameter that is unknown,
        repeated, not one of the model's or of tendons that the robot does not have.
    TypeError
        A value of another type.
    """
    # Arguments.
    displacements, measurements = _pair(displacements, measurements)
    names, measured = check_problem(
        robot, displacements, measurements, parameters, model, validation
    )
    if not isinstance(robust, bool):
        raise TypeError(f"robust: expected a bool, got {type(robust).__name__}")
    max_iterations = whole("max_iterations", max_iterations, 1)
    seed = whole("seed", seed, 0)
    # Rows that are held out.
    count = len(measured.points)
    held = np.zeros(count, dtype=bool)
    order = np.random.default_rng(seed).permutation(count)
    held[order[: round(validation * count)]] = True
    # Least squares, then the soft-L1 loss, and standard errors.
    points = measured.displacements, measured.points, held.tolist()
    fitted, values, errors, after, before, failed, bound, iterations, done = _core._fit(
        robot, *points, names, model, settings, robust, max_iterations
    )
    # What speaks against the fit.
    parts = [] if done else [f"still falling after {iterations} iterations"]
    parts += at_bounds(bound)
    parts += unsolved(failed, count)
    parts += far_off(np.linalg.norm(after[~held], axis=2), robot.backbone.total_length)
    for array in (measured.rows, held):
        array.flags.writeable = False
    return Fit(
        robot=fitted,
        parameters=values,
        standard_errors=errors,
        residuals=after,
        residuals_before=before,
        rows=measured.rows,
        validation=held,
        dropped=measured.dropped,
        failed=failed,
        status=Status.converged if done else Status.iteration_limit,
        message="; ".join(parts),
        iterations=iterations,
        seed=seed,
    )


def _pair(
    displacements: ArrayLike | None, measurements: ArrayLike | Measurements
) -> tuple[ArrayLike, ArrayLike]:
    """Give displacements and positions, of which measurements have both."""
    if isinstance(measurements, Measurements):
        if displacements is not None:
            message = "displacements: expected none with Measurements, which have their own"
            raise InvalidInput(message, "displacements")
        return measurements.displacements, measurements.positions
    if displacements is None:
        raise TypeError("displacements: expected an array, or Measurements as measurements")
    return displacements, measurements
