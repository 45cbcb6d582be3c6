"""``tdcr forward`` and ``tdcr schema``."""

from __future__ import annotations

from pathlib import Path

import click

import tdcr
from tdcr import Robot
from tdcr._cli import options as own
from tdcr._cli.click_types import Command
from tdcr._io.obstacle_file import obstacles_option, read_obstacles

__all__ = ["forward", "schema"]


@click.command(
    "forward",
    cls=Command,
    epilog=own.examples(
        "forward trunk.toml -d -15 free free free -5 free --unit mm --output pulled.npz",
        "forward trunk.toml -d -15 free free free free free --unit mm --obstacles bar.toml "
        "--output leaning.npz",
    ),
)
@own.ROBOT
@own.displacements_option()
@own.model_option("rod", "linkage", "constant_curvature")
@own.unit_option("the displacements")
@obstacles_option
@own.json_option
@own.picture_option
@own.output_option("the shape", ".npz", ".json", ".csv")
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

    own.checked_picture(plot_file)
    pulls = own.in_metres(displacements, unit)
    arm, around = Robot.load(robot), read_obstacles(obstacles)
    shape = tdcr.forward(arm, pulls, model=model, obstacles=around)
    own.delivered(
        lambda: report.as_json(shape),
        lambda: report.print_shape(shape, unit),
        json_file,
        (output, shape.save),
        (plot_file, own.picture_of(shape)),
    )
    doubt = own.unit_doubted(unit, own.largest(pulls), shape.robot)
    return own.said(shape.ok, shape.robot.name, shape.status, shape.message + doubt)


@click.command("schema", epilog=own.examples("schema --output robot.schema.json", files=False))
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

    from tdcr._io.robot_schema import robot_schema

    text = json.dumps(robot_schema(), indent=2, ensure_ascii=False)
    if output is None:
        click.echo(text.encode())
    else:
        own.write_text(output, text + "\n")
