"""``tdcr forward``, ``tdcr demo`` and ``tdcr schema``."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from math import inf
from pathlib import Path
from time import perf_counter

import click

import tdcr
from tdcr import Robot
from tdcr._cli import _shared as own
from tdcr._cli._click import Command

__all__ = ["demo", "forward", "schema"]

# Bundled robots and what the demonstration pulls [m]; idle tendons are free (inf).
DEMO = (
    ("elephant_trunk", (-0.07, inf, inf, inf)),
    ("spatial_trunk", (-0.06, -0.02, inf)),
)


@click.command(
    "forward",
    cls=Command,
    epilog='\b\nExample:\n  tdcr forward trunk.toml -d "-70 free free free" --unit mm',
)
@own.ROBOT
@own.displacements_option()
@own.model_option("rod", "linkage", "constant_curvature")
@own.unit_option("the displacements")
@own.json_option
@own.picture_option
@own.output_option("the shape", ".npz", ".json", ".csv")
def forward(
    robot: Path,
    displacements: list[float],
    model: str,
    unit: str,
    json_file: str | None,
    plot_file: str | None,
    output: str | None,
) -> int:
    """Solve the shape of the robot in file ROBOT (.toml or .json)."""
    from tdcr import _report

    own.checked_picture(plot_file)
    pulls = own.in_metres(displacements, unit)
    shape = tdcr.forward(Robot.load(robot), pulls, model=model)
    own.delivered(
        lambda: _report.as_json(shape),
        lambda: _report.print_shape(shape, unit),
        json_file,
        (output, shape.save),
        (plot_file, own.picture_of(shape)),
    )
    return own.said(shape.ok, shape.robot.name, shape.status, shape.message)


@click.command("demo", epilog="Example: tdcr demo --output pictures")
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Write a picture of every robot there.",
)
def demo(output: Path | None) -> int:
    """Solve the bundled robots and print where their tips are (position, rotation vector)."""
    from tdcr import _report

    shapes, times = [], []
    for name, displacements in DEMO:
        resource = resources.files("tdcr") / "robots" / f"{name}.toml"
        with resources.as_file(resource) as path:
            robot = Robot.load(path)
        shapes.append(tdcr.forward(robot, displacements))
        times.append(min(_timed(robot, displacements) for _ in range(10)))
    _report.print_demo(shapes, times)
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        for (name, _), shape in zip(DEMO, shapes, strict=True):
            own.picture_of(shape)(str(output / f"{name}.png"))
            click.echo(f"picture: {output / name}.png")
    return max(own.said(s.ok, s.robot.name, s.status, s.message) for s in shapes)


def _timed(robot: Robot, displacements: Sequence[float]) -> float:
    start = perf_counter()
    tdcr.forward(robot, displacements)
    return perf_counter() - start


@click.command("schema", epilog="Example: tdcr schema --output robot.schema.json")
@click.option(
    "-o",
    "--output",
    callback=own.writable,
    metavar="FILE",
    help="Write there instead of to stdout.",
)
def schema(output: str | None) -> None:
    """Print the JSON schema of robot files, for editors."""
    import json

    from tdcr._file_schema import robot_schema

    text = json.dumps(robot_schema(), indent=2, ensure_ascii=False)
    if output is None:
        click.echo(text.encode())
    else:
        own.write_text(output, text + "\n")
