"""Shapes as JSON and as tables on a terminal, for the command line."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tdcr._core import _rotation_vector

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from tdcr._core import Shape

__all__ = [
    "as_json",
    "console_of",
    "contact_tables",
    "facts_table",
    "print_demo",
    "print_shape",
    "show",
    "table_of",
    "text_of",
    "vector_text",
]


_WIDE = 10_000  # columns, more than any table has


def as_json(result: Any, **more: Any) -> str:
    """Write a result as JSON text: what its `save` writes into a .json file, and more fields."""
    from tdcr._io.codecs import KINDS
    from tdcr._io.result_file import header_text

    kind = type(result).__name__
    return header_text(kind, KINDS[kind].said(result) | more)


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


def facts_table(console: Console, *facts: tuple[str, str]) -> Table:
    """Make a table of names and what they are."""
    table = table_of(console, "", "")
    table.show_header = False
    table.columns[1].justify = "left"
    for name, text in facts:
        table.add_row(text_of(name), text_of(text))
    return table


def _millimetres(shape: Shape) -> NDArray[np.float64]:
    """Position of the tip, rounded so that no -0.0 is left."""
    rounded: NDArray[np.float64] = (shape.tip[:3, 3] * 1000.0).round(1) + 0.0
    return rounded


def _degrees(shape: Shape) -> NDArray[np.float64]:
    degrees: NDArray[np.float64] = np.degrees(_rotation_vector(shape.tip))
    return degrees


def vector_text(values: NDArray[np.float64], digits: int) -> str:
    # Adding 0.0 after rounding turns -0.0 into 0.0.
    return "  ".join(f"{round(float(value), digits) + 0.0:.{digits}f}" for value in values)


def text_of(text: str) -> Any:
    """Text of a user's: square brackets in it are no markup."""
    from rich.text import Text

    return Text(text)


def console_of() -> Console:
    from rich.console import Console

    class Told(Console):
        """Console that leaves it to its caller that the reader has gone, rather than exit."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    # Into a pipe or a file: plain, and no line is broken to fit a terminal.
    return Told(highlight=False) if sys.stdout.isatty() else Told(
        highlight=False, width=400, no_color=True
    )  # fmt: skip


def show(console: Console, *tables: Table) -> None:
    """Print tables with an empty line between them, whole.

    A terminal that is too narrow breaks their lines: a number that lost its last digits would look
    like another one.
    """
    for index, table in enumerate(tables):
        if index:
            console.print()
        if console.is_terminal:
            wide = console.options.update(max_width=_WIDE)
            fixed = all(column.no_wrap for column in table.columns)
            width = console.measure(table, options=wide).maximum if fixed else 0
            console.width = max(width, console.width)
            console.print(table)
            continue
        with console.capture() as captured:
            console.print(table)
        # Without the blanks that fill columns up.
        lines = captured.get().rstrip("\n").split("\n")
        console.file.write("".join(f"{line.rstrip()}\n" for line in lines))
    console.file.flush()


def table_of(console: Console, *headers: str) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD if console.is_terminal else None, pad_edge=False)
    table.padding = (0, 1, 0, 0) if console.is_terminal else (0, 2, 0, 0)
    for index, header in enumerate(headers):
        table.add_column(Text(header), justify="left" if index == 0 else "right", no_wrap=True)
    return table
