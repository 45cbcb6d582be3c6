"""Options that commands share."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from tdcr._cli.click_types import Numbers
from tdcr._cli.output import check_writable
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    pass

__all__ = [
    "BOUNDS",
    "FILE",
    "ROBOT",
    "displacements_option",
    "examples",
    "json_option",
    "model_option",
    "obstacles_option",
    "output_option",
    "picture_option",
    "read_targets",
    "target_option",
    "unit_option",
]

Command = TypeVar("Command", bound=Callable[..., Any])

# Reading says what is wrong with a file, in the same words for all.
FILE = click.Path(path_type=Path, readable=False)

ROBOT: Callable[[Command], Command] = click.argument("robot", type=FILE)


def examples(*commands: str, files: bool = True) -> str:
    """End of a help: commands that run as they stand, where the files of the examples are."""
    head = "Example" + "s" * (len(commands) > 1)
    note = ", in a folder with the files of `tdcr demo --files .`" * files
    return "\b\n" + "\n".join([f"{head}{note}:", *(f"  tdcr {command}" for command in commands)])


def displacements_option(required: bool = True) -> Callable[[Command], Command]:
    """Option for displacements, under the same names in every command."""
    return click.option(
        "-d",
        "--displacements",
        "--pull",
        "displacements",
        cls=Numbers,
        words=True,
        metavar="NUMBERS",
        required=required,
        help="Change of length of each tendon in --unit, with commas or spaces between them: "
        "negative pulls, 0 holds, inf or free leaves the tendon idle.",
    )


BOUNDS: Callable[[Command], Command] = click.option(
    "--bounds",
    cls=Numbers,
    count=2,
    metavar="LOW HIGH",
    help="Least and greatest displacement of every tendon in --unit.",
)


def model_option(*models: str) -> Callable[[Command], Command]:
    """Option for the model; what it is not the library says."""
    *first, last = models
    return click.option(
        "--model",
        default="rod",
        show_default=True,
        help=f"How shapes are found: {', '.join(first)} or {last}.",
    )


def unit_option(what: str) -> Callable[[Command], Command]:
    """Option for the unit of input and tables."""
    return click.option(
        "--unit",
        type=click.Choice(["m", "mm"]),
        default="m",
        show_default=True,
        help=f"Unit of {what} and of the table.",
    )


def obstacles_option(command: Command) -> Command:
    """Option for what is in the way."""
    return click.option(
        "--obstacles",
        type=FILE,
        metavar="FILE",
        help="What is in the way: a file of obstacles (.toml, .json), or a saved result, whose "
        "obstacles are taken.",
    )(command)


def target_option(command: Command) -> Command:
    """Option for the unit of a file of points."""
    return click.option(
        "--unit",
        type=click.Choice(["m", "mm"]),
        help="Unit of the file, of other lengths and of the table. Default: what the names of the "
        'file\'s columns say, as "x [mm]" does.',
    )(command)


def json_option(command: Command) -> Command:
    """Option for JSON, on stdout or into a file."""
    return click.option(
        "--json",
        "json_file",
        callback=check_writable,
        is_flag=False,
        flag_value="-",
        metavar="[FILE]",
        help="Write the result as JSON (SI units) to FILE; without one, or for -, to stdout "
        "instead of the table.",
    )(command)


def picture_option(command: Command) -> Command:
    """Option for a picture."""
    return click.option(
        "--plot",
        "plot_file",
        callback=check_writable,
        metavar="FILE",
        help="Write a picture: .png, .pdf, .svg, ...",
    )(command)


def output_option(what: str, *endings: str) -> Callable[[Command], Command]:
    """Option for the file of a result, whose ending is checked before anything is solved."""

    def check(context: click.Context, parameter: click.Parameter, path: str | None) -> str | None:
        check_writable(context, parameter, path)
        if path is not None and os.path.splitext(path)[1].lower() not in endings:
            *first, last = endings
            expected = f"{', '.join(first)} or {last}" if first else last
            raise click.BadParameter(f"expected a file ending in {expected}, got {path!r}")
        if path is not None and path.lower().endswith(".parquet"):
            from tdcr._io.tables import require_pyarrow

            require_pyarrow()
        return path

    return click.option(
        "-o",
        "--output",
        callback=check,
        metavar="FILE",
        help=f"Save {what}: {', '.join(endings)}.",
    )


def read_targets(path: Path, unit: str | None) -> tuple[Any, str]:
    """Points of a CSV file [m], and the unit that other lengths are in: m or mm."""
    from tdcr._io.csv_columns import read_points

    try:
        found, used = read_points(path, unit)
    except InvalidInput as error:
        if error.argument == "unit" and unit is None:
            message = f"{path}: expected a unit: name the columns 'x [mm]', or add --unit mm"
            raise InvalidInput(message, "unit") from None
        raise
    if used not in ("m", "mm"):
        # Pulls and bounds have no other unit here, and a guess may be wrong by a factor of ten.
        raise InvalidInput(f"{path}: unit: expected columns in m or mm, got {used!r}", "unit")
    return found, used
