"""``tdcr inverse`` and ``tdcr track``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import tdcr
from tdcr import InvalidInput, Robot
from tdcr._cli import options
from tdcr._cli import output as out
from tdcr._cli.click_types import Command, Numbers
from tdcr._io.lengths import to_metres
from tdcr._io.obstacle_file import read_obstacles

__all__ = ["inverse", "track"]


@click.command(
    "inverse",
    cls=Command,
    epilog=options.examples(
        "inverse trunk.toml --position 60 20 170 --unit mm",
        "inverse trunk.toml --position 0 0 0.2 --rotation 0 0 0 --model constant_curvature",
    ),
)
@options.ROBOT
@click.option(
    "--position",
    cls=Numbers,
    count=3,
    metavar="X Y Z",
    help="Where the tool should be, in --unit, in the world frame.",
)
@click.option(
    "--rotation",
    cls=Numbers,
    count=3,
    metavar="RX RY RZ",
    help="Rotation vector of the tool in degrees, with --position: how it should be turned.",
)
@click.option(
    "--pose",
    type=options.FILE,
    metavar="FILE",
    help="Instead: the 4x4 frame of the tool by rows, numbers with commas or spaces between them.",
)
@options.model_option("rod", "constant_curvature")
@options.BOUNDS
@options.unit_option("the position, the bounds, the last column of a pose")
@options.obstacles_option
@options.json_option
@options.picture_option
@options.output_option("the answer", ".npz", ".json")
def inverse(
    robot: Path,
    position: list[float] | None,
    rotation: list[float] | None,
    pose: Path | None,
    model: str,
    bounds: list[float] | None,
    unit: str,
    obstacles: Path | None,
    json_file: str | None,
    plot_file: str | None,
    output: str | None,
) -> int:
    """Find the displacements that bring the tool of the robot in file ROBOT to a target."""
    from tdcr._cli.report import results as report

    if (position is None) == (pose is None) or (pose is not None and rotation is not None):
        raise click.UsageError("expected --position X Y Z, with or without --rotation, or --pose")
    out.check_picture(plot_file)
    arm = Robot.load(robot)
    target = _pose(pose, unit) if pose is not None else _target(position, rotation, unit)
    answer = tdcr.inverse(
        arm,
        target,
        model=model,
        bounds=_bounds(bounds, unit),
        obstacles=read_obstacles(obstacles),
    )
    marks = answer.target[None, :3, 3] if answer.target.ndim == 2 else answer.target[None]
    out.deliver(
        lambda: report.inverse_json(answer),
        lambda: report.print_inverse(answer, unit),
        json_file,
        (output, answer.save),
        (plot_file, lambda path: out.picture_of(answer.shape, marks)(path)),
    )
    doubt = out.doubt_unit(unit, answer.error, arm, times=20)
    return out.report_outcome(answer.ok, arm.name, answer.status, answer.message + doubt)


def _bounds(bounds: list[float] | None, unit: str) -> Any:
    return None if bounds is None else tuple(to_metres(bounds, unit))


def _target(position: Any, rotation: Any, unit: str) -> Any:
    import numpy as np

    from tdcr._base import rotations

    place = np.array(to_metres(position, unit))
    if rotation is None:
        return place
    frame = np.eye(4)
    frame[:3, :3] = rotations.rotation(np.radians(rotation))
    frame[:3, 3] = place
    return frame


def _pose(path: Path, unit: str) -> Any:
    import numpy as np

    try:
        rows = [line.replace(",", " ").split() for line in path.read_text("utf-8").splitlines()]
        frame = np.array([[float(word) for word in row] for row in rows if row])
    except ValueError:
        frame = np.empty(0)
    if frame.shape != (4, 4):
        message = f"{path}: expected four rows of four numbers, a homogeneous matrix"
        raise InvalidInput(message, "pose")
    frame[:3, 3] = to_metres(frame[:3, 3].tolist(), unit)
    return frame


@click.command(
    "track",
    cls=Command,
    epilog=options.examples("track trunk.toml path.csv --output pulls.csv"),
)
@options.ROBOT
@click.argument("path", type=options.FILE)
@options.model_option("rod", "constant_curvature")
@options.BOUNDS
@options.target_option
@click.option(
    "--step",
    type=float,
    metavar="LENGTH",
    help="Go from point to point in straight lines, by at most so much in a row, in --unit.",
)
@options.obstacles_option
@options.json_option
@options.picture_option
@options.output_option("the pulls of every row", ".csv", ".npz", ".json", ".parquet")
def track(
    robot: Path,
    path: Path,
    model: str,
    bounds: list[float] | None,
    unit: str | None,
    step: float | None,
    obstacles: Path | None,
    json_file: str | None,
    plot_file: str | None,
    output: str | None,
) -> int:
    """Follow the path in PATH with the tool of the robot in file ROBOT.

    PATH is a CSV file with columns x, y and z, a row per point. Every answer goes on from the one
    before.
    """
    from tdcr._cli.report import results as report

    out.check_picture(plot_file)
    arm = Robot.load(robot)
    targets, unit = options.read_targets(path, unit)
    if step is not None:
        targets = tdcr.cartesian_path(targets, *to_metres([step], unit))
    found = tdcr.track(
        arm,
        targets,
        model=model,
        bounds=_bounds(bounds, unit),
        obstacles=read_obstacles(obstacles),
        progress=out.shows_progress(),
    )
    out.deliver(
        lambda: report.track_json(found),
        lambda: report.print_track(found, unit),
        json_file,
        (output, found.save),
        (plot_file, lambda path: out.picture_of(found[-1].shape, targets)(path)),
    )
    return out.report_rows(found, out.doubt_unit(unit, float(found.error.max()), arm, times=20))
