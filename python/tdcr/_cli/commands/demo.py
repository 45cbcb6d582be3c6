"""``tdcr demo``: the bundled robots, and the files of every example."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from math import inf
from pathlib import Path
from time import perf_counter

import click

import tdcr
from tdcr import Robot
from tdcr._cli import options
from tdcr._cli import output as out

__all__ = ["demo"]

# Bundled robots and what the demonstration pulls [m]; idle tendons are free (inf).
DEMO = (
    ("elephant_trunk", (-0.07, inf, inf, inf)),
    ("spatial_trunk", (-0.06, -0.02, inf)),
)


@click.command(
    "demo", epilog=options.examples("demo --files .", "demo --output pictures", files=False)
)
@click.option(
    "--files",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Write there the files that the examples of all commands read, and the bundled robots.",
)
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Write a picture of every robot there.",
)
def demo(files: Path | None, output: Path | None) -> int:
    """Solve the bundled robots and print where their tips are (position, rotation vector)."""
    from tdcr._cli.report import shape as report

    out.check_picture(None if output is None else "robot.png")
    if files is not None:
        _write_files(files)
        return 0
    shapes, times = [], []
    for name, displacements in DEMO:
        resource = resources.files("tdcr") / "robots" / f"{name}.toml"
        with resources.as_file(resource) as path:
            robot = Robot.load(path)
        shapes.append(tdcr.forward(robot, displacements))
        times.append(min(_time(robot, displacements) for _ in range(10)))
    report.print_demo(shapes, times)
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        for (name, _), shape in zip(DEMO, shapes, strict=True):
            out.picture_of(shape)(str(output / f"{name}.png"))
            click.echo(f"picture: {output / name}.png")
    return max(out.report_outcome(s.ok, s.robot.name, s.status, s.message) for s in shapes)


def _write_files(folder: Path) -> None:
    """Write the files of the examples into a folder; of one that is there with other text, none."""
    package = resources.files("tdcr")
    kept = [package / "_cli" / "examples", package / "robots"]
    texts = {file.name: file.read_text("utf-8") for place in kept for file in place.iterdir()}
    for name, text in texts.items():
        path = folder / name
        if path.exists() and path.read_bytes() != text.encode():
            raise click.UsageError(f"{path}: expected no such file, or the one of the examples")
    folder.mkdir(parents=True, exist_ok=True)
    for name in sorted(texts):
        out.write_text(str(folder / name), texts[name])
        click.echo(f"written: {folder / name}")


def _time(robot: Robot, displacements: Sequence[float]) -> float:
    start = perf_counter()
    tdcr.forward(robot, displacements)
    return perf_counter() - start
