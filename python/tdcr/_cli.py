"""The command ``tdcr``.

Exit codes: 0 done, 1 a solve did not converge (its result is printed all the same), 2 input that
cannot be used (one line on stderr), 130 interrupted.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import resources
from math import inf, nan
from pathlib import Path
from time import perf_counter

import click

from tdcr import InvalidInput, Robot, Shape, __version__, forward

__all__ = ["main"]

# Bundled robots and what the demonstration pulls [m]; idle tendons are free (inf).
_DEMO = (
    ("elephant_trunk", (-0.07, inf, inf, inf)),
    ("spatial_trunk", (-0.06, -0.02, inf)),
)
_WORDS = {"inf": inf, "+inf": inf, "free": inf, "nan": nan}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.

    Returns
    -------
    int
        Exit code.
    """
    try:
        code = _group.main(arguments, prog_name="tdcr", standalone_mode=False)
        sys.stdout.flush()
        return int(code or 0)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        return 0
    except click.ClickException as error:
        return _refuse(" ".join(error.format_message().split()))
    except (click.Abort, KeyboardInterrupt):
        click.echo("tdcr: interrupted", err=True)
        return 130
    except BrokenPipeError:
        # The reader has gone (| head): nothing is left to say, also not at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        return _refuse(f"{name}{error.strerror or error}")
    except (InvalidInput, ImportError) as error:
        return _refuse(str(error))


def _refuse(message: str) -> int:
    """One line on stderr, however many faults there are."""
    first, *more = message.splitlines() or [""]
    rest = f" (and {len(more)} more fault{'s' * (len(more) > 1)})" if more else ""
    click.echo(f"tdcr: error: {first}{rest}", err=True)
    return 2


@click.group(
    "tdcr",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: tdcr demo",
)
@click.version_option(__version__, prog_name="tdcr", message="%(prog)s %(version)s")
def _group() -> None:
    """Tendon-driven continuum robots: shapes from tendon displacements."""


def _numbers(context: click.Context, parameter: click.Parameter, text: str) -> list[float]:
    """Read numbers with commas or spaces between them."""
    numbers = []
    for word in text.replace(",", " ").split():
        try:
            number = _WORDS[word.lower()] if word.lower() in _WORDS else float(word)
        except ValueError:
            number = -inf
        if number in (inf, -inf) and word.lower() not in _WORDS:
            raise click.BadParameter(f"expected finite numbers, inf or free, got {word!r}")
        numbers.append(number)
    return numbers


@_group.command(
    "forward",
    epilog='\b\nExample:\n  tdcr forward trunk.toml -d "-70 free free free" --unit mm',
)
@click.argument("robot", type=click.Path(path_type=Path))
@click.option(
    "-d",
    "--displacements",
    callback=_numbers,
    metavar="NUMBERS",
    required=True,
    help="Change of length of each tendon, with commas or spaces between them: negative pulls, "
    "0 holds, inf or free leaves the tendon idle.",
)
@click.option(
    "--model",
    default="rod",
    show_default=True,
    help="How the shape is found: rod, linkage or constant_curvature.",
)
@click.option(
    "--unit",
    type=click.Choice(["m", "mm"]),
    default="m",
    show_default=True,
    help="Unit of the displacements and of the table.",
)
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    help="Write the result as JSON (SI units), to stdout instead of the table for -.",
)
@click.option("--plot", "plot_file", metavar="FILE", help="Write a picture: .png, .pdf, .svg, ...")
def _forward(
    robot: Path,
    displacements: list[float],
    model: str,
    unit: str,
    json_file: str | None,
    plot_file: str | None,
) -> int:
    """Solve the shape of the robot in file ROBOT (.toml or .json)."""
    from tdcr import _report

    if unit == "mm":
        from tdcr._file_schema import metres

        displacements = [metres(by) for by in displacements]
    if plot_file is not None:
        from tdcr._plot import check_picture

        check_picture(plot_file)
    shape = forward(Robot.load(robot), displacements, model=model)
    if json_file == "-":
        click.echo(_report.as_json(shape))
    else:
        _report.print_shape(shape, unit)
    if json_file not in (None, "-"):
        Path(str(json_file)).write_text(_report.as_json(shape) + "\n", encoding="utf-8")
    if plot_file is not None:
        _picture(shape, plot_file)
    return _outcome([shape])


@_group.command("demo", epilog="Example: tdcr demo --output pictures")
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Write a picture of every robot there.",
)
def _demo(output: Path | None) -> int:
    """Solve the bundled robots and print where their tips are (position, rotation vector)."""
    from tdcr import _report

    shapes, times = [], []
    for name, displacements in _DEMO:
        resource = resources.files("tdcr") / "robots" / f"{name}.toml"
        with resources.as_file(resource) as path:
            robot = Robot.load(path)
        shapes.append(forward(robot, displacements))
        times.append(min(_timed(robot, displacements) for _ in range(10)))
    _report.print_demo(shapes, times)
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        for (name, _), shape in zip(_DEMO, shapes, strict=True):
            _picture(shape, str(output / f"{name}.png"))
            click.echo(f"picture: {output / name}.png")
    return _outcome(shapes)


def _timed(robot: Robot, displacements: Sequence[float]) -> float:
    start = perf_counter()
    forward(robot, displacements)
    return perf_counter() - start


@_group.command("schema", epilog="Example: tdcr schema --output robot.schema.json")
@click.option("--output", metavar="FILE", help="Write there instead of to stdout.")
def _schema(output: str | None) -> None:
    """Print the JSON schema of robot files, for editors."""
    import json

    from tdcr._file_schema import robot_schema

    text = json.dumps(robot_schema(), indent=2, ensure_ascii=False)
    if output is None:
        click.echo(text)
    else:
        Path(output).write_text(text + "\n", encoding="utf-8")


def _picture(shape: Shape, path: str) -> None:
    from tdcr._plot import save_picture

    save_picture(shape, path)


def _outcome(shapes: Sequence[Shape]) -> int:
    failed = [shape for shape in shapes if not shape.ok]
    for shape in failed:
        name = f"{shape.robot.name}: " if shape.robot.name else ""
        message = " ".join(shape.message.split())
        click.echo(f"tdcr: {name}{shape.status}: {message}", err=True)
    return 1 if failed else 0
