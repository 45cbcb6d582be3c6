"""``tdcr workspace``."""

from __future__ import annotations

from math import inf
from pathlib import Path

import click

import tdcr
from tdcr import Robot
from tdcr._base.models import MODELS
from tdcr._cli import options
from tdcr._cli import output as out
from tdcr._cli.click_types import Command, Numbers, read_numbers
from tdcr._io.lengths import to_metres
from tdcr._io.obstacle_file import read_obstacles

__all__ = ["workspace"]


def _ranges(
    context: click.Context, parameter: click.Parameter, text: str
) -> list[tuple[float, float]]:
    """Read ranges: LOW:HIGH, a number, or free."""
    found = []
    for word in text.replace(",", " ").split():
        ends = word.split(":")
        read = read_numbers(" ".join(ends), words=True)
        if len(ends) != len(read) or len(ends) > 2:
            raise click.BadParameter(f"expected LOW:HIGH, a number or free, got {word!r}")
        found.append((read[0], read[-1]))
    if not found:
        raise click.BadParameter("expected LOW:HIGH, a number or free, got nothing")
    return found


@click.command(
    "workspace",
    cls=Command,
    epilog=options.examples(
        "workspace trunk.toml --ranges -10:0 free free free -6:0 free --unit mm "
        "--samples 2000 --sampling random --output cloud.npz"
    ),
)
@options.ROBOT
@click.option(
    "--ranges",
    cls=Numbers,
    callback=_ranges,
    required=True,
    metavar="RANGES",
    help="Of each tendon LOW:HIGH in --unit, a number that keeps it there, or free; with commas or "
    "spaces between them. A single one is for all tendons.",
)
@click.option("--samples", type=int, default=10_000, show_default=True, help="Rows to solve.")
@click.option(
    "--sampling",
    type=click.Choice(["sobol", "grid", "random"]),
    default="sobol",
    show_default=True,
    help="How displacements are drawn; sobol needs scipy.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of sobol and random.")
@options.model_option(*MODELS)
@options.unit_option("the ranges")
@options.obstacles_option
@options.json_option
@options.picture_option
@click.option(
    "--view",
    type=click.Choice(["section", "3d"]),
    default="section",
    show_default=True,
    help="Of the picture.",
)
@options.output_option("the samples", ".npz", ".json", ".csv", ".parquet")
def workspace(
    robot: Path,
    ranges: list[tuple[float, float]],
    samples: int,
    sampling: str,
    seed: int,
    model: str,
    unit: str,
    obstacles: Path | None,
    json_file: str | None,
    plot_file: str | None,
    view: str,
    output: str | None,
) -> int:
    """Sample where the tip of the robot in file ROBOT gets."""
    from tdcr._cli.report import results as report

    out.check_picture(plot_file)
    arm = Robot.load(robot)
    if len(ranges) == 1:
        ranges = ranges * len(arm.tendons)
    limits = [tuple(to_metres(pair, unit)) for pair in ranges]
    if all(pair == (inf, inf) for pair in limits):
        raise click.BadParameter("expected a tendon that is not free", param_hint="--ranges")
    # Samples, and their files and table.
    found = tdcr.workspace(
        arm,
        limits,
        samples,
        sampling=sampling,  # type: ignore[arg-type]
        seed=seed,
        model=model,
        obstacles=read_obstacles(obstacles),
        progress=out.shows_progress(),
    )
    nothing = plot_file is not None and not found.ok.any()
    out.deliver(
        lambda: report.workspace_json(found),
        lambda: report.print_workspace(found, unit),
        json_file,
        (output, found.save),
        (
            None if nothing else plot_file,
            lambda path: out.save_workspace(found, path, view),
        ),
    )
    longest = out.largest_size(end for pair in limits for end in pair)
    doubt = out.doubt_unit(unit, longest, arm)
    return out.report_rows(found, "; no picture" * nothing + doubt)
