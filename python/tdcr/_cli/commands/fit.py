"""``tdcr fit``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import click

from tdcr import InvalidInput, Robot, read_measurements
from tdcr._cli import options
from tdcr._cli import output as out
from tdcr._cli.click_types import Command

__all__ = ["fit"]


def _names(
    context: click.Context, parameter: click.Parameter, text: str | None
) -> list[str] | None:
    """Read names with commas between them."""
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]


@click.command(
    "fit",
    cls=Command,
    epilog=options.examples(
        "fit finger.toml bench.csv --unit mm --pull-sign positive --parameters gain "
        "--output fitted.toml"
    ),
)
@options.ROBOT
@click.argument("measurements", type=options.FILE)
@click.option(
    "--unit",
    type=click.Choice(["m", "cm", "mm", "um", "in"]),
    required=True,
    help="Unit of all lengths in the file.",
)
@click.option(
    "--pull-sign",
    type=click.Choice(["positive", "negative"]),
    required=True,
    help="Sign that a pull has in the file.",
)
@click.option(
    "--parameters",
    callback=_names,
    required=True,
    metavar="NAMES",
    help="What to estimate, with commas: gain, offset, radius, azimuth, stiffness, poisson_ratio, "
    "rest, base.",
)
@click.option(
    "--displacement-columns",
    callback=_names,
    metavar="NAMES",
    help="Columns with displacements, in the order of the tendons. Default: found by their names.",
)
@click.option(
    "--position-columns",
    callback=_names,
    metavar="NAMES",
    help="Columns with x, y, z of the tip, or of every disk. Default: found by their names.",
)
@click.option(
    "--free-from",
    type=float,
    metavar="LENGTH",
    help="Tendons released by this much or more, in --unit, are slack.",
)
@options.model_option("rod", "constant_curvature")
@click.option(
    "--validation", type=float, default=0.2, show_default=True, help="Share of rows held out."
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the rows held out.")
@options.json_option
@options.picture_option
@options.output_option("the fitted robot", ".toml", ".json")
def fit(
    robot: Path,
    measurements: Path,
    parameters: list[str],
    json_file: str | None,
    plot_file: str | None,
    output: str | None,
    **given: Any,
) -> int:
    """Estimate parameters of the robot in file ROBOT from the CSV file MEASUREMENTS.

    MEASUREMENTS has a displacement per tendon and the position of the tip, or of every disk, in
    each row. Gains and offsets are not part of a robot: they are in the table and the JSON alone.
    """
    from tdcr._cli.report import results as report
    from tdcr._plot.shape import save_figure
    from tdcr.design import fit as solve

    # Measurements, with a column for every tendon.
    out.check_picture(plot_file)
    arm = Robot.load(robot)
    unit = given["unit"]
    with warnings.catch_warnings(record=True, action="always") as doubts:
        measured = read_measurements(
            measurements,
            unit=unit,
            pull_sign=given["pull_sign"],
            displacements=given["displacement_columns"],
            positions=given["position_columns"],
            free_from=given["free_from"],
        )
    columns = measured.displacement_columns
    if len(columns) != len(arm.tendons):
        names = ", ".join(arm.tendon_names)
        raise InvalidInput(
            f"{measurements}: expected a column of displacements for each of the tendons {names}, "
            f"got {', '.join(columns)}; name them with --displacement-columns",
            "displacements",
        )
    # The sign of pulls.
    slack = not (measured.displacements < 0.0).any()
    if slack and given["model"] == "rod" and "offset" not in parameters:
        # Slack tendons tell nothing: the parameters would stay what they were.
        other = {"positive": "negative", "negative": "positive"}[given["pull_sign"]]
        message = f"{measurements}: expected a pull, got releases alone: try --pull-sign {other}"
        raise InvalidInput(message, "pull_sign")
    for doubt in doubts:
        out.warn(doubt.message)
    # The fit, and its files and table.
    found = solve(
        arm,
        measured,
        parameters,
        model=given["model"],
        validation=given["validation"],
        seed=given["seed"],
    )
    shown = "m" if unit == "m" else "mm"
    out.deliver(
        lambda: report.fit_json(found, measured),
        lambda: report.print_fit(found, measured, shown),
        json_file,
        (output, found.robot.save),
        (plot_file, lambda path: save_figure(found.plot().figure, path)),
    )
    return out.report_outcome(found.ok, arm.name, found.status, found.message)
