"""Write what `make bench` measured as a page of the guide, with the machine and the day.

Reads criterion's estimates (`criterion/**/new/estimates.json`) that are newer than the file
`bench/started`, and the tables that the side-by-side runs printed (`bench/*.txt`), both below the
folder where cargo puts what it makes. Nothing is computed but units and time per element.

    python benches/report.py target --output docs/benchmarks.md
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import platform
import re
import subprocess
import sys
import textwrap
from collections import defaultdict
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

BENCHES = Path(__file__).resolve().parent
PEERS = ("numpy", "scipy", "casadi", "pyswarms")
SHORT = (
    "**A short run** (`make bench QUICK=1`): few problems and short measurements, to show that\n"
    'all works. Its figures are rough; those of long runs are in "Measured" of each page.'
)
FULL = "A full run (`make bench`)."
PAGE = """\
# Benchmarks

<!-- Written by benches/report.py; `make bench` makes it anew. -->

{kind}
Compare ratios rather than times: the machine may have been at work for others, as the load tells.

- Day: {day}
- Machine: {machine}
- Load: {load}

## The core

Criterion's median of one call, on one core unless the name says otherwise; where a call solves
many, their number and the time of each. Sources: `benches/*.rs`.

{core}

## Side by side

Against what a user would pick instead, on the same problems in the same run; answers are compared
before times are printed.

{side}"""
UNITS = ((1e9, "s"), (1e6, "ms"), (1e3, "µs"), (1.0, "ns"))


def processor() -> str:
    """Return the model of the processor, as the system tells it."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    names = re.findall(r"^model name\s*: (.+)$", text, re.MULTILINE)
    return " ".join(names[0].split()) if names else platform.machine()


def machine() -> str:
    """Name what was measured on: processor, cores, system, compiler, Python and the peers."""
    rustc = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True)
    found = []
    for name in PEERS:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    system = f"{platform.system()} on {platform.machine()}"
    tools = [" ".join(rustc.stdout.split()[:2]), f"Python {platform.python_version()}", *found]
    return f"{processor()}, {os.cpu_count()} cores, {system}; {', '.join(tools)}"


def load() -> str:
    """Return what else the machine had to do, where the system tells it."""
    if not hasattr(os, "getloadavg"):
        return "not told by the system"
    mean = os.getloadavg()[2]
    return f"{mean:.1f} processes in the mean of the last 15 minutes, those of the run among them"


def in_units(nanoseconds: float) -> str:
    """Return a time with three digits and its unit."""
    scale, unit = next((u for u in UNITS if nanoseconds >= u[0]), UNITS[-1])
    number = nanoseconds / scale
    return f"{number:.{2 if number < 10 else 1 if number < 100 else 0}f} {unit}"


def estimates(target: Path, started: float) -> dict[str, list[tuple[str, dict[str, Any], int]]]:
    """Criterion's results of this run by group: the rest of the name, its median, the elements."""
    groups = defaultdict(list)
    for path in sorted((target / "criterion").rglob("new/estimates.json")):
        if path.stat().st_mtime < started:
            continue
        about = json.loads(path.with_name("benchmark.json").read_text(encoding="utf-8"))
        median = json.loads(path.read_text(encoding="utf-8"))["median"]
        group, _, name = about["full_id"].partition("/")
        elements = (about["throughput"] or {}).get("Elements", 1)
        groups[group].append((name, median, elements))
    return groups


def by_number(name: str) -> list[tuple[int, str]]:
    """Sort key: numbers in a name count as numbers."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(part), "") if part.isdigit() else (0, part) for part in parts]


def core_table(groups: dict[str, list[tuple[str, dict[str, Any], int]]]) -> list[str]:
    """Return the table of the core's benchmarks."""
    lines = ["| benchmark | median | 95 % interval | elements | each |", "|---|--:|--:|--:|--:|"]
    for group, rows in sorted(groups.items()):
        for name, median, elements in sorted(rows, key=lambda row: by_number(row[0])):
            middle = median["point_estimate"]
            interval = median["confidence_interval"]
            low, high = interval["lower_bound"], interval["upper_bound"]
            each = in_units(middle / elements) if elements > 1 else ""
            count = f"{elements:,}" if elements > 1 else ""
            lines.append(
                f"| {group}/{name} | {in_units(middle)} | {in_units(low)} – {in_units(high)} "
                f"| {count} | {each} |"
            )
    return lines


def side_by_side(printed: Path) -> list[str]:
    """Return what a script printed, below the first line of its docstring."""
    for folder in (BENCHES / "peers", BENCHES):
        script = folder / f"{printed.stem}.py"
        if script.exists():
            break
    title = (ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or "").splitlines()[0]
    text = printed.read_text(encoding="utf-8").strip("\n")
    path = script.relative_to(BENCHES.parent).as_posix()
    return [f"### {title.rstrip('.')}", "", f"`{path}`:", "", "```text", text, "```", ""]


def page(target: Path, quick: bool) -> str:
    """Return the page."""
    started = (target / "bench" / "started").stat().st_mtime
    groups = estimates(target, started)
    printed = sorted((target / "bench").glob("*.txt"))
    if not groups or not printed:
        sys.exit(f"{target}: no results of a run of `make bench` there")
    return PAGE.format(
        kind=SHORT if quick else FULL,
        day=datetime.fromtimestamp(started, tz=UTC).date().isoformat(),
        machine=textwrap.fill(machine(), 108, subsequent_indent="  ", break_long_words=False),
        load=load(),
        core="\n".join(core_table(groups)),
        side="\n".join(line for path in printed for line in side_by_side(path)),
    )


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", type=Path, help="where cargo puts what it makes")
    parser.add_argument("--quick", action="store_true", help="say that the run was a short one")
    parser.add_argument("--output", type=Path, required=True)
    given = parser.parse_args()
    given.output.write_text(page(given.target, given.quick), encoding="utf-8")
    print(f"{given.output}: written")


if __name__ == "__main__":
    main()
