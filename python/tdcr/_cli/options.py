"""What commands share: options, numbers, outcomes, files."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from tdcr._cli.click_types import Numbers
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tdcr import Robot, Shape, Workspace

__all__ = [
    "BOUNDS",
    "FILE",
    "ROBOT",
    "checked_picture",
    "delivered",
    "displacements_option",
    "examples",
    "in_metres",
    "json_option",
    "largest",
    "model_option",
    "output_option",
    "picture_of",
    "picture_option",
    "points",
    "progress",
    "rows_said",
    "said",
    "target_option",
    "unit_doubted",
    "unit_option",
    "warn",
    "workspace_picture",
    "writable",
    "write_text",
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


def target_option(command: Command) -> Command:
    """Option for the unit of a file of points."""
    return click.option(
        "--unit",
        type=click.Choice(["m", "mm"]),
        help="Unit of the file, of other lengths and of the table. Default: what the names of the "
        'file\'s columns say, as "x [mm]" does.',
    )(command)


def writable(context: click.Context, parameter: click.Parameter, path: str | None) -> str | None:
    """Refuse a file that cannot be written before a long solve, not after it."""
    if path is None or path == "-":
        return path
    path = str(path)
    folder, fault = Path(path).parent, 0
    if Path(path).is_dir():
        fault = errno.EISDIR
    elif not folder.exists():
        fault = errno.ENOENT
    elif not folder.is_dir():
        fault = errno.ENOTDIR
    elif not os.access(path if os.path.exists(path) else folder, os.W_OK):
        # Also a file that its owner keeps from being written: no new one takes its place.
        fault = errno.EACCES
    if fault:
        raise OSError(fault, os.strerror(fault), path)
    return path


def json_option(command: Command) -> Command:
    """Option for JSON, on stdout or into a file."""
    return click.option(
        "--json",
        "json_file",
        callback=writable,
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
        callback=writable,
        metavar="FILE",
        help="Write a picture: .png, .pdf, .svg, ...",
    )(command)


def output_option(what: str, *endings: str) -> Callable[[Command], Command]:
    """Option for the file of a result, whose ending is checked before anything is solved."""

    def check(context: click.Context, parameter: click.Parameter, path: str | None) -> str | None:
        writable(context, parameter, path)
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


def in_metres(values: Iterable[float], unit: str) -> list[float]:
    """Convert lengths, those of a file in mm exactly; what is not finite stays."""
    if unit == "m":
        return list(values)
    from tdcr._io.robot_schema import metres

    return [metres(value) if isfinite(value) else value for value in values]


def progress() -> bool:
    """Whether to draw a progress bar: on a terminal alone."""
    return sys.stderr.isatty()


def checked_picture(path: str | None) -> None:
    """Refuse a picture that cannot be written, before anything is solved."""
    if path is not None:
        from tdcr._plot.shape import check_picture

        check_picture(path)


def delivered(
    text: Callable[[], str],
    table: Callable[[], None],
    json_file: str | None,
    *files: tuple[str | None, Callable[[str], object]],
) -> None:
    """Write a result to the files that are wanted, then print it: as JSON, or else as a table.

    Files come first: a reader of the table that goes (``| head -1``) does not cost them. Where one
    cannot be written the result is printed all the same.
    """
    try:
        for path, save in files:
            if path is not None:
                save(path)
        if json_file not in (None, "-"):
            write_text(str(json_file), text() + "\n")
    except Exception:
        printed(text, table, json_file)
        raise
    printed(text, table, json_file)


def printed(text: Callable[[], str], table: Callable[[], None], json_file: str | None) -> None:
    """Print JSON where it takes the place of the table, or else the table."""
    if json_file == "-":
        click.echo(text().encode())  # JSON is UTF-8 on any terminal
    else:
        table()


def write_text(path: str, text: str) -> None:
    """Write a text file, complete or not at all; a pipe or a device as it is."""
    if os.path.exists(path) and not os.path.isfile(path):
        with named(path):
            Path(path).write_text(text, encoding="utf-8")
        return
    from tdcr._io.atomic_write import replace_file

    with named(path):
        replace_file(path, lambda stream: stream.write(text.encode()))


@contextmanager
def named(path: str) -> Iterator[None]:
    """Name the file over a fault of the system that does not (a full disk)."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror, path) from None


def picture_of(shape: Shape, marks: NDArray[Any] | None = None) -> Callable[[str], object]:
    """Give what writes the picture of a shape, with places marked."""

    def save(path: str) -> None:
        from tdcr._plot.shape import save_picture

        save_picture(shape, path, marks=marks)

    return save


def workspace_picture(found: Workspace, path: str, view: str) -> None:
    """Write the picture of a workspace."""
    from tdcr._plot.workspace import save_workspace

    save_workspace(found, path, view=view)


def unit_doubted(unit: str, length: float, robot: Robot, *, times: float = 1.0) -> str:
    """Say, where a length is so many times the robot's, that it was taken for metres."""
    own = robot.backbone.total_length
    if unit != "m" or not length > times * own:
        return ""
    return f"; {length:g} m is much for a robot of {own:g} m: add --unit mm if mm are meant"


def warn(message: Warning | str) -> None:
    """Say a warning on stderr, in one line and without a place in the code."""
    click.echo(f"tdcr: warning: {message}", err=True)


def said(ok: bool, name: str | None, status: str, message: str) -> int:
    """Exit code of an outcome; what did not converge is said on stderr, in one line."""
    if ok:
        return 0
    text = " ".join(message.split())
    before = f"{name}: " if name else ""
    click.echo(f"tdcr: {before}{status}: {text}", err=True)
    return 1


def largest(values: Iterable[float]) -> float:
    """Give the largest size of what is finite."""
    return max((abs(value) for value in values if isfinite(value)), default=0.0)


def rows_said(result: Any, doubt: str = "") -> int:
    """Exit code of many rows: 1 if any did not converge, and how many did what."""
    from collections import Counter

    counts = Counter(str(status) for status in result.status)
    total, fine = len(result), counts.pop("converged", 0)
    if fine == total:
        return 0
    names = ", ".join(f"{count} {status}" for status, count in counts.most_common())
    click.echo(f"tdcr: {total - fine} of {total} rows did not converge: {names}{doubt}", err=True)
    return 1


def points(path: Path, unit: str | None) -> tuple[Any, str]:
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
