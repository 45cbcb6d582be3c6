"""Inverses, workspaces, designs and fits as tables and JSON, for the command line."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from tdcr._cli.report.shape import contact_tables
from tdcr._cli.report.tables import console_of, facts_table, show, table_of, text_of, vector_text
from tdcr._core import _rotation_vector
from tdcr._io.result_file import header_text
from tdcr._io.save_load import json_text

if TYPE_CHECKING:
    from tdcr._core import Robot
    from tdcr._inverse.results import Inverse, InverseBatch
    from tdcr._workspace.results import Workspace
    from tdcr.design import Prebend
    from tdcr.design.fitting import Fit, Part
    from tdcr.design.measurements import Measurements
    from tdcr.design.tendon_routing import Routing

__all__ = [
    "design_json",
    "fit_json",
    "inverse_json",
    "print_design",
    "print_fit",
    "print_inverse",
    "print_track",
    "print_workspace",
    "track_json",
    "workspace_json",
]

_WORST = 5
_NOTHING = 1e-9  # lengths [m] and shares of the largest tension that are not told from 0
# Units of fitted parameters.
_UNITS = {
    "offset": "m",
    "radius": "m",
    "azimuth": "rad",
    "stiffness": "N",
    "rest": "1/m",
}
_BASE = ("x [m]", "y [m]", "z [m]", "about x [rad]", "about y [rad]", "about z [rad]")


def _scale_of(unit: str) -> tuple[float, int]:
    """Scale and digits of lengths in a unit."""
    return (1000.0, 3) if unit == "mm" else (1.0, 6)


def _length(value: float, unit: str) -> str:
    """Format a length: small ones with three digits that count, rounding errors as such."""
    scale, digits = _scale_of(unit)
    if value < _NOTHING:
        return f"below {_NOTHING * scale:.0e}"
    value = value * scale
    return f"{value:.{digits}f}" if value >= 10.0**-digits else f"{value:.2e}"


def _name(robot: Robot) -> tuple[str, str]:
    return "robot", robot.name or "unnamed"


def _pulls(console: Any, robot: Robot, unit: str, displacements: Any, tensions: Any) -> Any:
    """Table of what each tendon does."""
    scale, digits = _scale_of(unit)
    known = bool(np.isfinite(tensions).any())
    spine = robot.backbone
    least = _NOTHING * np.abs(tensions).max(initial=0.0)
    force = "N" if spine.youngs_modulus and spine.diameter else "EI/m^2"
    headers = [f"displacement [{unit}]", *([f"tension [{force}]"] if known else [])]
    table = table_of(console, "tendon", *headers)
    for k, name in enumerate(robot.tendon_names):
        by = displacements[k]
        row = ["free" if math.isinf(by) else f"{by * scale:+.{digits}f}"]
        pulled = [f"{_clear_small(tensions[k], least):.6g}"] if known else []
        table.add_row(text_of(name), *row, *pulled)
    return table


def _clear_small(value: float, least: float) -> float:
    return 0.0 if abs(value) <= least else value


def inverse_json(answer: Inverse) -> str:
    """Write an inverse as JSON that `Inverse.load` reads, with the shape for other readers."""
    shape = answer.shape
    return json_text(
        answer,
        ok=answer.ok,
        units=shape.units,
        tendon_names=list(shape.robot.tendon_names),
        frames=shape.frames,
        positions=shape.positions,
        tip=shape.tip,
    )


def track_json(found: InverseBatch) -> str:
    """Write a track as JSON that `InverseBatch.load` reads, with names for other readers."""
    units = found[0].shape.units
    return json_text(found, units=units, tendon_names=list(found.robot.tendon_names))


def print_inverse(answer: Inverse, unit: str) -> None:
    """Print an inverse: how near it comes, and what each tendon does."""
    console = console_of()
    scale, digits = _scale_of(unit)
    frame = answer.target.ndim == 2
    place = answer.target[:3, 3] if frame else answer.target
    facts = [
        _name(answer.robot),
        ("model", answer.model),
        ("status", str(answer.status)),
        (f"target x y z [{unit}]", vector_text(place * scale, digits)),
    ]
    if frame:
        turn = np.degrees(_rotation_vector(answer.target))
        facts.append(("target rotation vector x y z [deg]", vector_text(turn, 3)))
    facts.append((f"distance to the target [{unit}]", _length(answer.error, unit)))
    if frame:
        turned = math.degrees(answer.rotation_error)
        facts.append(("angle to the target [deg]", f"{turned:.3g}"))
    pulls = _pulls(console, answer.robot, unit, answer.displacements, answer.tensions)
    touched = contact_tables(console, answer.shape, unit) if answer.obstacles else []
    show(console, facts_table(console, *facts), pulls, *touched)


def print_track(found: InverseBatch, unit: str) -> None:
    """Print how a path was followed, and where worst."""
    console = console_of()
    scale, digits = _scale_of(unit)
    pulls = found.displacements * scale
    restarted = int(np.count_nonzero(found.starts > 1))
    low, high = pulls.min(axis=0), pulls.max(axis=0)
    facts = [
        _name(found.robot),
        ("model", found.model),
        ("points met", f"{int(found.ok.sum())} of {len(found)}"),
        ("points sought anew, where the arm may jump", str(restarted)),
        (f"largest distance to a point [{unit}]", _length(float(found.error.max()), unit)),
    ]
    tables = [facts_table(console, *facts)]
    headers = [f"{what} [{unit}]" for what in ("first", "least", "greatest", "last")]
    table = table_of(console, "tendon", *headers)
    for k, name in enumerate(found.robot.tendon_names):
        row = (pulls[0, k], low[k], high[k], pulls[-1, k])
        table.add_row(text_of(name), *(f"{value:+.{digits}f}" for value in row))
    tables.append(table)
    failed = np.flatnonzero(~found.ok)
    if len(failed):
        worst = failed[np.argsort(-found.error[failed], kind="stable")][:_WORST]
        table = table_of(console, "worst row", "status", f"distance [{unit}]")
        for row in sorted(worst):
            status = str(found.status[row])
            table.add_row(str(row), status, _length(float(found.error[row]), unit))
        tables.append(table)
    show(console, *tables)


def _workspace_facts(found: Workspace) -> dict[str, Any]:
    """Say what a workspace tells, in SI; reach and volume where rows converged."""
    counts = {str(status): count for status, count in found.counts.items()}
    facts: dict[str, Any] = {
        "robot": found.robot.name,
        "model": found.model,
        "ranges": found.ranges.tolist(),
        "sampling": found.sampling,
        "seed": found.seed,
        "rows": len(found),
        "counts": counts,
    }
    if found.ok.any():
        reach, volume = found.reach, found.volume()
        facts |= {"nearest": reach.nearest, "farthest": reach.farthest}
        facts |= {"low": reach.low.tolist(), "high": reach.high.tolist()}
        facts |= {"volume": volume.value, "volume_error": volume.error, "voxel": volume.voxel}
    return facts


def workspace_json(found: Workspace) -> str:
    """Write what a workspace tells as JSON; its samples are what `save` writes."""
    return header_text("WorkspaceSummary", _workspace_facts(found))


def print_workspace(found: Workspace, unit: str) -> None:
    """Print reach and volume."""
    console = console_of()
    scale, digits = _scale_of(unit)
    facts = _workspace_facts(found)
    rows = [
        _name(found.robot),
        ("model", found.model),
        ("rows", f"{len(found)} ({found.sampling})"),
        *((str(status), str(count)) for status, count in found.counts.items()),
    ]
    if "nearest" in facts:
        cube, fine = scale**3, 4
        rows += [
            (f"nearest to the base [{unit}]", f"{facts['nearest'] * scale:.{digits}f}"),
            (f"farthest [{unit}]", f"{facts['farthest'] * scale:.{digits}f}"),
            (f"least x y z [{unit}]", vector_text(np.array(facts["low"]) * scale, digits)),
            (f"greatest x y z [{unit}]", vector_text(np.array(facts["high"]) * scale, digits)),
            (
                f"volume [{unit}^3]",
                f"{facts['volume'] * cube:.{fine}g} +- {facts['volume_error'] * cube:.2g}, "
                f"voxels of {facts['voxel'] * scale:.3g} {unit}",
            ),
        ]
    show(console, facts_table(console, *rows))


def design_json(found: Prebend | Routing) -> str:
    """Write a design as JSON that its `load` reads, with more of its shape for other readers."""
    return json_text(
        found,
        ok=found.ok,
        units=found.shape.units,
        tendon_names=list(found.robot.tendon_names),
        frames=found.shape.frames,
        displacements=found.shape.displacements,
        positions=found.shape.positions,
        tensions=found.shape.tensions,
    )


def print_design(found: Prebend | Routing, unit: str) -> None:
    """Print a design: how near it comes, and its holes or rest bends."""
    console = console_of()
    disk = int(found.error.argmax())
    where = f", disk {disk}" if found.error[disk] >= _NOTHING else ""
    rms = float(np.sqrt(np.mean(found.error[1:] ** 2)))
    facts = [
        _name(found.robot),
        ("status", str(found.status)),
        ("iterations", str(found.iterations)),
        (f"largest error [{unit}]", _length(found.error[disk], unit) + where),
        (f"root mean square error [{unit}]", _length(rms, unit)),
    ]
    if hasattr(found, "optimality"):
        facts.append(("optimality", found.optimality))
    elif found.robot.backbone.rest is not None:
        bends = np.degrees(np.linalg.norm(found.robot.backbone.rest, axis=1))
        facts.append(("rest bend of a subsegment, at most [deg]", f"{bends.max():.3f}"))
    pulls = _pulls(console, found.robot, unit, found.shape.displacements, found.shape.tensions)
    tables = [facts_table(console, *facts), pulls]
    holes = getattr(found, "holes", None)
    if holes is not None:
        table = table_of(console, "tendon", "holes of disks 0 to its end")
        # Long lists go on in the next line.
        table.columns[1].no_wrap, table.columns[1].justify = False, "left"
        for name, own in zip(found.robot.tendon_names, holes, strict=True):
            table.add_row(text_of(name), " ".join(map(str, own)))
        tables.append(table)
    show(console, *tables)


def _parts(found: Fit) -> list[Part]:
    return ["train", "validation"] if found.validation.any() else ["train"]


def fit_json(found: Fit, measured: Measurements) -> str:
    """Write a fit as JSON that `Fit.load` reads, with distances for other readers.

    Dropped rows are those of the file, which the reading of measurements has left out.
    """
    distances = {f"rms_{part}": found.rms(part) for part in _parts(found)}
    distances |= {f"rms_{part}_before": found.rms(part, before=True) for part in _parts(found)}
    return json_text(found, ok=found.ok, dropped=measured.dropped, **distances)


def print_fit(found: Fit, measured: Measurements, unit: str) -> None:
    """Print a fit: distances before and after, and the parameters in SI."""
    console = console_of()
    held = int(found.validation.sum())
    facts = [
        _name(found.robot),
        ("status", str(found.status)),
        ("iterations", str(found.iterations)),
        (
            "rows",
            f"{len(found.rows)}, {held} of them held out; {measured.dropped} dropped for gaps",
        ),
    ]
    for part in _parts(found):
        name = "held-out rows" if part == "validation" else "fitted rows"
        pair = (found.rms(part, before=b) for b in (True, False))
        before, after = (_length(value, unit) for value in pair)
        facts.append((f"root mean square distance, {name} [{unit}]", f"{before} -> {after}"))
    # Columns are found by their order: a person sees whether it is that of the tendons.
    columns = table = table_of(console, "tendon", "displacements in column")
    table.columns[1].justify = "left"
    for name, column in zip(found.robot.tendon_names, measured.displacement_columns, strict=True):
        table.add_row(text_of(name), text_of(column))
    table = table_of(console, "parameter", "value", "standard error")
    for name, values in found.parameters.items():
        for i, (value, error) in enumerate(zip(values, found.standard_errors[name], strict=True)):
            label = text_of(_parameter(found.robot, name, i, len(values)))
            table.add_row(label, f"{value:.6g}", f"{error:.2g}")
    show(console, facts_table(console, *facts), columns, table)


def _parameter(robot: Robot, name: str, i: int, count: int) -> str:
    """Name of a value: of which tendon or axis, and its unit."""
    if name == "base":
        return f"base {_BASE[i]}"
    unit = f" [{_UNITS[name]}]" if name in _UNITS else ""
    if name == "rest":
        return f"rest curvature about {'xy'[i]}{unit}"
    of = f" {robot.tendon_names[i]}" if count == len(robot.tendons) and count > 0 else ""
    return f"{name}{of if name != 'poisson_ratio' else ''}{unit}"
