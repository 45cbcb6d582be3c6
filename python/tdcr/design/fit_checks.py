"""Checks of the arguments of a fit, and warnings of what it leaves."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from tdcr._core import Robot
from tdcr.design.fit_problem import NAMES, PER_TENDON, Measured
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array: TypeAlias = NDArray[np.float64]

__all__ = ["at_bounds", "check_problem", "far_off", "unsolved", "whole"]

# Root mean square distances from which a fit is no description of what was measured: as a share of
# the robot's length (calibrated models of a measured one leave 2 to 4 %), and in medians (normal
# noise has 1.1 of them).
_SHARE, _MEDIANS = 0.05, 10


def whole(argument: str, value: Any, least: int) -> int:
    """Check an integer."""
    try:
        number = operator.index(value)
    except TypeError:
        message = f"{argument}: expected an integer, got {type(value).__name__}"
        raise TypeError(message) from None
    if number < least:
        message = f"{argument}: expected an integer of at least {least}, got {number}"
        raise InvalidInput(message, argument)
    return number


def far_off(distances: Array, length: float) -> list[str]:
    """Say what the distances that a fit leaves tell against it, if anything."""
    rms, median = float(np.sqrt(np.mean(distances**2))), float(np.median(distances))
    # Down to rounding, ratios say nothing.
    if rms > _MEDIANS * median and rms > 1e-9 * length:
        many = int(np.count_nonzero(distances > _MEDIANS * median))
        return [
            f"{many} of {distances.size} points are more than {_MEDIANS} times as far off as the "
            f"median, {median:.3e} m: outliers, or rows that the model does not describe"
        ]
    if rms > _SHARE * length:
        return [
            f"the fitted robot stays {rms:.3e} m off, root mean square, {100 * rms / length:.3g} % "
            f"of its length: check that positions are in metres and in the world frame, the order "
            f"of tendons, disks and rows, signs of displacements, and which parameters are fitted"
        ]
    return []


def at_bounds(names: Sequence[str]) -> list[str]:
    """Say which values are as small or as great as a robot can have."""
    return [f"at the least or greatest that a robot can have: {', '.join(names)}"] * bool(names)


def unsolved(failed: int, rows: int) -> list[str]:
    """Say how many rows count with a shape that is not one of the robot's."""
    if not failed:
        return []
    return [f"the forward solve of {failed} of {rows} rows did not converge: see `failed`"]


def check_problem(
    robot: Robot,
    displacements: ArrayLike,
    measurements: ArrayLike,
    parameters: Sequence[str],
    model: str,
    validation: float,
) -> tuple[list[str], Measured]:
    """Check what a fit is given, but for its counts."""
    # Robot, model, share that is held out.
    if not isinstance(robot, Robot):
        raise TypeError(f"robot: expected Robot, got {type(robot).__name__}")
    if not isinstance(model, str):
        raise TypeError(f"model: expected text, got {type(model).__name__}")
    if model not in ("rod", "constant_curvature"):
        message = f'model: expected "rod" or "constant_curvature", got {model!r}'
        raise InvalidInput(message, "model")
    if isinstance(validation, bool) or not isinstance(validation, Real):
        raise TypeError(f"validation: expected a number, got {type(validation).__name__}")
    if not 0 <= validation <= 0.9:
        message = f"validation: expected a share in [0, 0.9], got {validation!r}"
        raise InvalidInput(message, "validation")
    # Names that the model knows, each once.
    if not isinstance(parameters, Iterable):
        raise TypeError(f"parameters: expected names, got {type(parameters).__name__}")
    names = [parameters] if isinstance(parameters, str) else list(parameters)
    for name in names:
        if not isinstance(name, str):
            raise TypeError(f"parameters: expected names, got {type(name).__name__} among them")
    known = [n for n in NAMES if model == "rod" or n not in ("stiffness", "poisson_ratio", "rest")]
    known_once = all(n in known and names.count(n) == 1 for n in names)
    if not names or not known_once:
        message = f"parameters: expected some of {known} for model {model!r}, each once"
        raise InvalidInput(f"{message}, got {parameters!r}", "parameters")
    # Tendons that have what is fitted of them.
    idle = [n for n in names if n in PER_TENDON]
    if idle and not robot.tendons:
        message = f"robot: expected tendons to fit {idle[0]} of, got a robot without any"
        raise InvalidInput(message, "robot")
    for k, tendon in enumerate(robot.tendons):
        plain = tendon.routing == "angles"
        straight = plain and np.ndim(tendon.azimuth) == 0 and np.ndim(tendon.radius) == 0
        if not straight and {"radius", "azimuth"} & set(names):
            message = f"parameters: expected straight tendons to fit holes of, got tendons[{k}]"
            raise InvalidInput(message, "parameters")
        if tendon.stiffness is None and "stiffness" in names:
            message = "parameters: expected tendons with a stiffness [N] to fit it"
            raise InvalidInput(f"{message}, got tendons[{k}] without one", "parameters")
    return names, Measured.checked(robot, displacements, measurements)
