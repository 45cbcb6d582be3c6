"""``tdcr forward`` and ``tdcr schema``."""

from __future__ import annotations

from pathlib import Path

import click

import tdcr
from tdcr import Robot
from tdcr._base.models import MODELS
from tdcr._cli.click_types import Command
from tdcr._cli.options import (
    ROBOT,
    displacements_option,
    examples,
    json_option,
    model_option,
    obstacles_option,
    output_option,
    picture_option,
    unit_option,
)
from tdcr._cli.output import (
    check_picture,
    check_writable,
    deliver,
    doubt_unit,
    largest_size,
    picture_of,
    report_outcome,
    write_text,
)
from tdcr._io.lengths import to_metres
from tdcr._io.obstacle_file import read_obstacles
from tdcr._io.save_load import json_text

__all__ = ["forward", "schema"]


@click.command(
    "forward",
    cls=Command,
    epilog=examples(
        "forward trunk.toml -d -15 free free free -5 free --unit mm --output pulled.npz",
        "forward trunk.toml -d -15 free free free free free --unit mm --obstacles bar.toml "
        "--output leaning.npz",
    ),
)
@ROBOT
@displacements_option()
@model_option(*MODELS)
@unit_option("the displacements")
@obstacles_option
@json_option
@picture_option
@output_option("the shape", ".npz", ".json", ".csv")
def forward(
    robot: Path,
    displacements: list[float],
    model: str,
    unit: str,
    obstacles: Path | None,
    json_file: str | None,
    plot_file: str | None,
    output: str | None,
) -> int:
    """Solve the shape of the robot in file ROBOT (.toml or .json)."""
    from tdcr._cli.report import shape as report

    check_picture(plot_file)
    pulls = to_metres(displacements, unit)
    arm, around = Robot.load(robot), read_obstacles(obstacles)
    shape = tdcr.forward(arm, pulls, model=model, obstacles=around)
    deliver(
        lambda: json_text(shape),
        lambda: report.print_shape(shape, unit),
        json_file,
        (output, shape.save),
        (plot_file, picture_of(shape)),
    )
    doubt = doubt_unit(unit, largest_size(pulls), shape.robot)
    return report_outcome(shape.ok, shape.robot.name, shape.status, shape.message + doubt)


@click.command("schema", epilog=examples("schema --output robot.schema.json", files=False))
@click.option(
    "-o",
    "--output",
    callback=check_writable,
    metavar="FILE",
    help="Write there instead of to stdout.",
)
def schema(output: str | None) -> None:
    """Print the JSON schema of robot files, for editors."""
    import json

    from tdcr._io.robot_schema import robot_schema

    text = json.dumps(robot_schema(), indent=2, ensure_ascii=False)
    if output is None:
        click.echo(text.encode())
    else:
        write_text(output, text + "\n")
