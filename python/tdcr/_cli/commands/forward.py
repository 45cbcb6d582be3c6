"""``tdcr forward`` and ``tdcr schema``."""

from __future__ import annotations

from pathlib import Path

import click

import tdcr
from tdcr import Robot
from tdcr._base.models import MODELS
from tdcr._cli import options
from tdcr._cli import output as out
from tdcr._cli.click_types import Command
from tdcr._io.lengths import to_metres
from tdcr._io.obstacle_file import read_obstacles
from tdcr._io.save_load import json_text

__all__ = ["forward", "schema"]


@click.command(
    "forward",
    cls=Command,
    epilog=options.examples(
        "forward trunk.toml -d -15 free free free -5 free --unit mm --output pulled.npz",
        "forward trunk.toml -d -15 free free free free free --unit mm --obstacles bar.toml "
        "--output leaning.npz",
    ),
)
@options.ROBOT
@options.displacements_option()
@options.model_option(*MODELS)
@options.unit_option("the displacements")
@options.obstacles_option
@options.json_option
@options.picture_option
@options.output_option("the shape", ".npz", ".json", ".csv")
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

    out.check_picture(plot_file)
    pulls = to_metres(displacements, unit)
    arm, around = Robot.load(robot), read_obstacles(obstacles)
    shape = tdcr.forward(arm, pulls, model=model, obstacles=around)
    out.deliver(
        lambda: json_text(shape),
        lambda: report.print_shape(shape, unit),
        json_file,
        (output, shape.save),
        (plot_file, out.picture_of(shape)),
    )
    doubt = out.doubt_unit(unit, out.largest_size(pulls), shape.robot)
    return out.report_outcome(shape.ok, shape.robot.name, shape.status, shape.message + doubt)


@click.command("schema", epilog=options.examples("schema --output robot.schema.json", files=False))
@click.option(
    "-o",
    "--output",
    callback=out.check_writable,
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
        out.write_text(output, text + "\n")
