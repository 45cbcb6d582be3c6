"""Shapes as tables on a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tdcr._cli.report.tables import console_of, facts_table, show, table_of, text_of, vector_text
from tdcr._core import _rotation_vector

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from tdcr._core import Shape

__all__ = ["contact_tables", "print_demo", "print_shape"]


def print_shape(shape: Shape, unit: str) -> None:
    """Print a shape as two tables: the outcome and the tendons.

    Parameters
    ----------
    shape : Shape
    unit : {"m", "mm"}
        Unit of the lengths in the table.
    """
    console = console_of()
    scale = 1000.0 if unit == "mm" else 1.0
    digits = 3 if unit == "mm" else 6
    facts = facts_table(
        console,
        ("robot", shape.robot.name or "unnamed"),
        ("model", shape.model),
        ("status", str(shape.status)),
        ("iterations", str(shape.iterations)),
        (f"tip position x y z [{unit}]", vector_text(shape.tip[:3, 3] * scale, digits)),
        ("tip rotation vector x y z [deg]", vector_text(_degrees(shape), 3)),
    )
    known = bool(np.isfinite(shape.tensions).any())
    force = "N" if shape.units == "N" else "EI/m^2"
    headers = [f"{name} [{unit}]" for name in ("displacement", "rest length", "length")]
    tendons = table_of(console, "tendon", *headers, *([f"tension [{force}]"] if known else []))
    for k, name in enumerate(shape.robot.tendon_names):
        by = shape.displacements[k]
        lengths = (shape.robot.rest_lengths[k], shape.tendon_lengths[k])
        row = ["free" if math.isinf(by) else f"{by * scale:+.{digits}f}"]
        row += [f"{length * scale:.{digits}f}" for length in lengths]
        row += [f"{shape.tensions[k]:.6g}"] if known else []
        tendons.add_row(text_of(name), *row)
    show(console, facts, tendons, *contact_tables(console, shape, unit))


def contact_tables(console: Console, shape: Shape, unit: str) -> list[Table]:
    """Table of the contacts, where there are obstacles."""
    if not shape.obstacles:
        return []
    force = "N" if shape.units == "N" else "EI/m^2"
    headers = ("at", "obstacle", f"x [{unit}]", f"y [{unit}]", f"z [{unit}]", f"force [{force}]")
    table = table_of(console, "contact", *headers)
    scale, digits = (1000.0, 3) if unit == "mm" else (1.0, 6)
    for contact in shape.contacts:
        names = shape.robot.tendon_names
        tendon = "" if contact.tendon is None else f" of {names[contact.tendon]}"
        kind = type(shape.obstacles[contact.obstacle]).__name__
        place = [f"{value * scale + 0.0:.{digits}f}" for value in contact.point]
        table.add_row(
            f"disk {contact.disk}",
            text_of(f"{contact.kind}{tendon}"),
            f"{contact.obstacle} ({kind})",
            *place,
            f"{float(np.linalg.norm(contact.force)):.6g}",
        )
    if not shape.contacts:
        table.add_row("none")
    return [table]


def print_demo(shapes: Sequence[Shape], times: Sequence[float]) -> None:
    """Print the table of the demonstration: pose of the tip, tendons, effort.

    Parameters
    ----------
    shapes : sequence of Shape
    times : sequence of float
        Time of each solve [s].
    """
    console = console_of()
    headers = (
        "tip\n[mm]",
        "rotation\n[deg]",
        "tendon length\n[mm]",
        "status",
        "steps",
        "time\n[us]",
    )
    table = table_of(console, "robot", *headers)
    for shape, time in zip(shapes, times, strict=True):
        lengths = zip(shape.robot.tendon_names, shape.tendon_lengths * 1000.0, strict=True)
        table.add_row(
            text_of(shape.robot.name or "unnamed"),
            "\n".join(
                f"{x} {value:7.1f}" for x, value in zip("xyz", _millimetres(shape), strict=True)
            ),
            "\n".join(f"{value + 0.0:.1f}" for value in _degrees(shape).round(1)),
            text_of("\n".join(f"{name} {length:.1f}" for name, length in lengths)),
            str(shape.status),
            str(shape.iterations),
            f"{time * 1e6:.1f}",
        )
        table.add_section()
    show(console, table)


def _millimetres(shape: Shape) -> NDArray[np.float64]:
    """Position of the tip, rounded so that no -0.0 is left."""
    rounded: NDArray[np.float64] = (shape.tip[:3, 3] * 1000.0).round(1) + 0.0
    return rounded


def _degrees(shape: Shape) -> NDArray[np.float64]:
    degrees: NDArray[np.float64] = np.degrees(_rotation_vector(shape.tip))
    return degrees
