"""Results and outcomes on stdout, on stderr and in files."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tdcr import Robot, Shape, Workspace

__all__ = [
    "check_picture",
    "check_writable",
    "deliver",
    "doubt_unit",
    "largest_size",
    "picture_of",
    "report_outcome",
    "report_rows",
    "save_workspace",
    "shows_progress",
    "warn",
    "write_text",
]


def check_writable(
    context: click.Context, parameter: click.Parameter, path: str | None
) -> str | None:
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


def shows_progress() -> bool:
    """Tell if a progress bar is drawn: on a terminal alone."""
    return sys.stderr.isatty()


def check_picture(path: str | None) -> None:
    """Refuse a picture that cannot be written, before anything is solved."""
    if path is not None:
        from tdcr._plot.shape import check_picture as check

        check(path)


def deliver(
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
        print_result(text, table, json_file)
        raise
    print_result(text, table, json_file)


def print_result(text: Callable[[], str], table: Callable[[], None], json_file: str | None) -> None:
    """Print JSON where it takes the place of the table, or else the table."""
    if json_file == "-":
        click.echo(text().encode())  # JSON is UTF-8 on any terminal
    else:
        table()


def write_text(path: str, text: str) -> None:
    """Write a text file, complete or not at all; a pipe or a device as it is."""
    if os.path.exists(path) and not os.path.isfile(path):
        with name_file(path):
            Path(path).write_text(text, encoding="utf-8")
        return
    from tdcr._io.atomic_write import replace_file

    with name_file(path):
        replace_file(path, lambda stream: stream.write(text.encode()))


@contextmanager
def name_file(path: str) -> Iterator[None]:
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


def save_workspace(found: Workspace, path: str, view: str) -> None:
    """Write the picture of a workspace."""
    from tdcr._plot.shape import save_drawing
    from tdcr._plot.workspace import SIZE

    save_drawing(lambda ax: found.plot(ax=ax, view=view), path, flat=view != "3d", size=SIZE)


def doubt_unit(unit: str, length: float, robot: Robot, *, times: float = 1.0) -> str:
    """Say, where a length is so many times the robot's, that it was taken for metres."""
    own = robot.backbone.total_length
    if unit != "m" or not length > times * own:
        return ""
    return f"; {length:g} m is much for a robot of {own:g} m: add --unit mm if mm are meant"


def warn(message: Warning | str) -> None:
    """Say a warning on stderr, in one line and without a place in the code."""
    click.echo(f"tdcr: warning: {message}", err=True)


def report_outcome(ok: bool, name: str | None, status: str, message: str) -> int:
    """Exit code of an outcome; what did not converge is said on stderr, in one line."""
    if ok:
        return 0
    text = " ".join(message.split())
    before = f"{name}: " if name else ""
    click.echo(f"tdcr: {before}{status}: {text}", err=True)
    return 1


def largest_size(values: Iterable[float]) -> float:
    """Give the largest size of what is finite."""
    return max((abs(value) for value in values if isfinite(value)), default=0.0)


def report_rows(result: Any, doubt: str = "") -> int:
    """Exit code of many rows: 1 if any did not converge, and how many did what."""
    from collections import Counter

    counts = Counter(str(status) for status in result.status)
    total, fine = len(result), counts.pop("converged", 0)
    if fine == total:
        return 0
    names = ", ".join(f"{count} {status}" for status, count in counts.most_common())
    click.echo(f"tdcr: {total - fine} of {total} rows did not converge: {names}{doubt}", err=True)
    return 1
