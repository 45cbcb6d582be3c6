"""``tdcr design prebend`` and ``tdcr design routing``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tdcr import InvalidInput, Robot, RoutingSettings
from tdcr._cli import options
from tdcr._cli import output as out
from tdcr._cli.click_types import Command, Commands
from tdcr._io.lengths import to_metres

__all__ = ["design"]

_EXAMPLE = options.examples(
    "design prebend finger.toml curve.csv --curve --pull -3 --output bent.toml"
)
_TARGET = click.argument("target", type=options.FILE)
_CURVE = click.option(
    "--curve",
    is_flag=True,
    help="The points are those of a curve, of any number, the base first; disks are laid on it.",
)


@click.group(
    "design",
    cls=Commands,
    epilog=options.examples(
        "design prebend finger.toml curve.csv --curve --pull -3 --output bent.toml"
    ),
)
def design() -> None:
    """Find the robot that takes a wanted shape."""


def _read_places(robot: Robot, target: Path, unit: str | None, curve: bool) -> tuple[Any, str]:
    """Places of disks from a file, and the unit of the table."""
    places, unit = options.read_targets(target, unit)
    count = robot.backbone.count
    if curve:
        from tdcr.design import on_curve

        return on_curve(robot, places), unit
    if len(places) not in (count, count + 1):
        raise InvalidInput(
            f"{target}: expected places of disks 1 to {count}, or of disks 0 to {count}, got "
            f"{len(places)} rows; add --curve for points along a curve",
            "target",
        )
    return places, unit


def _finish(found: Any, unit: str, json_file: str | None, files: tuple[str | None, ...]) -> int:
    from tdcr._cli.report import results as report

    output, plot_file = files
    out.deliver(
        lambda: report.design_json(found),
        lambda: report.print_design(found, unit),
        json_file,
        (output, found.robot.save),
        (plot_file, out.picture_of(found.shape, found.target_positions)),
    )
    return out.report_outcome(found.ok, found.robot.name, found.status, found.message)


@design.command(
    "prebend",
    cls=Command,
    epilog=options.examples(
        "design prebend finger.toml curve.csv --curve --pull -3 --output bent.toml"
    ),
)
@options.ROBOT
@_TARGET
@options.displacements_option()
@_CURVE
@options.target_option
@options.json_option
@options.picture_option
@options.output_option("the robot with its new rest shape", ".toml", ".json")
def prebend(
    robot: Path,
    target: Path,
    displacements: list[float],
    curve: bool,
    unit: str | None,
    json_file: str | None,
    plot_file: str | None,
    output: str | None,
) -> int:
    """Find the rest shape with which the robot in file ROBOT takes the shape in TARGET.

    TARGET is a CSV file with columns x, y and z: the places of its disks when the tendons are
    pulled.
    """
    from tdcr.design import prebend as solve

    out.check_picture(plot_file)
    arm = Robot.load(robot)
    places, unit = _read_places(arm, target, unit, curve)
    found = solve(arm, places, to_metres(displacements, unit))
    return _finish(found, unit, json_file, (output, plot_file))


@design.command(
    "routing",
    cls=Command,
    epilog=options.examples(
        "design routing finger.toml places.csv --holes 12 --bounds -10 0 --output routed.toml"
    ),
)
@options.ROBOT
@_TARGET
@click.option(
    "--holes",
    type=int,
    default=12,
    show_default=True,
    help="Holes per disk, evenly spaced; 0 allows any azimuth.",
)
@options.BOUNDS
@_CURVE
@options.target_option
@options.json_option
@options.picture_option
@options.output_option("the robot with its new routing", ".toml", ".json")
def routing(
    robot: Path,
    target: Path,
    holes: int,
    bounds: list[float] | None,
    curve: bool,
    unit: str | None,
    json_file: str | None,
    plot_file: str | None,
    output: str | None,
) -> int:
    """Find holes and pulls that bring the robot in file ROBOT nearest to the shape in TARGET.

    TARGET is a CSV file with columns x, y and z: the places of its disks.
    """
    from tdcr.design import routing as solve

    out.check_picture(plot_file)
    arm = Robot.load(robot)
    places, unit = _read_places(arm, target, unit, curve)
    limits = None if bounds is None else tuple(to_metres(bounds, unit))
    settings = RoutingSettings(holes=holes or None)
    found = solve(arm, places, bounds=limits, settings=settings)  # type: ignore[arg-type]
    return _finish(found, unit, json_file, (output, plot_file))
