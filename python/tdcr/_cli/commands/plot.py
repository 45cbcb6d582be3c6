"""``tdcr plot``."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Any

import click
import numpy as np

import tdcr
from tdcr import Grasp, InvalidInput, InverseBatch, Robot, Shape, ShapeBatch, Workspace
from tdcr._base.models import MODELS
from tdcr._cli import options
from tdcr._cli import output as out
from tdcr._cli.click_types import Command
from tdcr._io.lengths import to_metres
from tdcr.design import Fit

__all__ = ["plot"]


@click.command(
    "plot",
    cls=Command,
    epilog=options.examples(
        "plot trunk.toml --pull -15 free free free -5 free --unit mm --output pulled.png",
        "plot trunk.toml --pull -15 free free free -9 free --unit mm --animate pull.gif",
    ),
)
@click.argument("file", type=options.FILE)
@click.option(
    "-o",
    "--output",
    callback=out.check_writable,
    metavar="FILE",
    help="The picture: .png, .pdf, .svg, ...",
)
@click.option(
    "--animate",
    callback=out.check_writable,
    metavar="FILE",
    help="Of a robot: a GIF of the pull, from rest.",
)
@options.displacements_option(required=False)
@options.model_option(*MODELS)
@options.unit_option("the displacements")
@click.option(
    "--view",
    type=click.Choice(["auto", "2d", "3d"]),
    default="auto",
    show_default=True,
    help="In the plane of the bend, or in space. A workspace is cut by a plane but for 3d.",
)
@click.option("--row", type=int, metavar="ROW", help="Of a batch or a track: which row.")
@click.option(
    "--frames",
    type=click.IntRange(2, 500),
    default=40,
    show_default=True,
    help="Steps of the animation.",
)
@click.pass_context
def plot(
    context: click.Context,
    file: Path,
    output: str | None,
    animate: str | None,
    displacements: list[float] | None,
    model: str,
    unit: str,
    view: str,
    row: int | None,
    frames: int,
) -> int:
    """Draw what is in FILE: a robot, or a result that was saved.

    A robot (.toml, .json) is drawn under --pull, or at rest; results are shapes, inverses, batches,
    workspaces, designs, fits and grasps (.npz, .json, of workspaces .parquet).
    """
    if output is None and animate is None:
        raise click.UsageError("expected --output FILE, --animate FILE or both")
    out.check_picture(output)
    # A robot or a result, and options that suit it.
    thing = _read(file)
    if not isinstance(thing, Robot) and (displacements is not None or animate is not None):
        got = f"{file} with a {type(thing).__name__}"
        raise click.UsageError(f"--pull and --animate: expected a robot file, got {got}")
    _check_options(context, thing)
    if isinstance(thing, Workspace):
        out.save_workspace(thing, str(output), "3d" if view == "3d" else "section")
        return 0
    if isinstance(thing, (Fit, Grasp)):
        from tdcr._plot.shape import save_drawing

        save_drawing(lambda ax: thing.plot(ax=ax), str(output), flat=isinstance(thing, Fit))
        return 0
    # Shapes, of a robot solved now.
    pulls = None if displacements is None else to_metres(displacements, unit)
    if animate is not None:
        _animate(thing, pulls, model, animate, frames)
    shape = _shape(thing, pulls, model, row)
    if output is not None:
        from tdcr._plot.shape import save_picture

        save_picture(shape, output, view=view)
    doubt = out.doubt_unit(unit, out.largest_size(pulls or ()), shape.robot)
    return out.report_outcome(shape.ok, shape.robot.name, shape.status, shape.message + doubt)


def _check_options(context: click.Context, thing: Any) -> None:
    """Refuse options that would be without use."""
    given = {
        name
        for name in ("model", "row", "frames", "unit")
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
    }
    kind = type(thing).__name__
    if "model" in given and not isinstance(thing, Robot):
        raise click.UsageError(f"--model: expected a robot file, got a {kind}, which has its own")
    if "row" in given and not isinstance(thing, (ShapeBatch, InverseBatch)):
        raise click.UsageError(f"--row: expected a batch or a track, got {kind}")
    if "unit" in given and context.params["displacements"] is None:
        raise click.UsageError("--unit: expected --pull too")
    if "frames" in given and context.params["animate"] is None:
        raise click.UsageError("--frames: expected --animate FILE too")


def _read(file: Path) -> Any:
    """Read a robot or a result, whichever it is."""
    if file.suffix.lower() == ".toml":
        return Robot.load(file)
    from tdcr._io.save_load import load_any

    if file.suffix.lower() == ".json":
        from tdcr._io.text_file import parse

        data = parse(file, file.read_bytes(), ".json")
        if isinstance(data, dict) and "kind" not in data:
            return Robot.load(file)
    elif file.suffix.lower() not in (".npz", ".parquet"):
        expected = "a file ending in .toml, .json, .npz or .parquet"
        raise InvalidInput(f"file: expected {expected}, got '{file}'", "file")
    return load_any(file)


def _shape(thing: Any, pulls: list[float] | None, model: str, row: int | None) -> Shape:
    """Shape to draw of a robot or a result."""
    if isinstance(thing, (ShapeBatch, InverseBatch)):
        if row is None or not -len(thing) <= row < len(thing):
            expected = f"expected a row from 0 to {len(thing) - 1}"
            raise click.UsageError(f"--row: {expected}, got {'none' if row is None else row}")
        thing = thing[row]
    if isinstance(thing, Robot):
        return tdcr.forward(thing, pulls or [inf] * len(thing.tendons), model=model)
    shape: Shape = thing if isinstance(thing, Shape) else thing.shape
    return shape


def _animate(robot: Robot, pulls: list[float] | None, model: str, path: str, frames: int) -> None:
    from tdcr._base.progress import progress_callback
    from tdcr._plot.animation import animate_pull, check_gif, pulled_shapes

    if pulls is None:
        raise click.UsageError("--animate: expected --pull too")
    check_gif(path)
    # Checked as a whole before the first step.
    tdcr.forward(robot, pulls, model=model)
    with progress_callback(out.shows_progress(), "plot", 2 * frames) as tell:
        shapes = pulled_shapes(robot, np.array(pulls), model=model, count=frames, progress=tell)
        shown = None if tell is None else (lambda done: tell(frames + done))
        animate_pull(shapes, path, progress=shown)
