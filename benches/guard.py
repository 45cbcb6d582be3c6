"""Compare what `make bench` measured with the committed baseline, bench by bench, in ratios.

Machines differ, and so do their days. So every median is divided by that of one bench of the same
run, the reference, before it is compared. Prints what is slower than the baseline by more than the
limit, what is faster by as much, what is new and what is missing.

    python benches/guard.py target                 compares; --check: exits 1 where one is slower
    python benches/guard.py target --write         makes the run at hand the baseline
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from report import BENCHES, by_number, estimates, in_units

BASELINE = BENCHES / "baseline.json"
REFERENCE = "bar/seven_bar/alike"
LIMIT = 1.15
# How much several threads help is the machine's business.
THREADED = re.compile(r"(all|two|[2-9])_threads$")


@dataclass
class Comparison:
    """Benches by what became of them; a change is now's ratio over the baseline's."""

    slower: dict[str, float] = field(default_factory=dict)
    faster: dict[str, float] = field(default_factory=dict)
    alike: dict[str, float] = field(default_factory=dict)
    new: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


def ratios(medians: dict[str, float], reference: str) -> dict[str, float]:
    """Medians over that of the reference, without the reference and benches on several threads."""
    if reference not in medians:
        sys.exit(f"{reference}: not measured in this run, and it is what all others are divided by")
    kept = (name for name in medians if name != reference and not THREADED.search(name))
    return {name: medians[name] / medians[reference] for name in sorted(kept, key=by_number)}


def compare(now: dict[str, float], before: dict[str, float], limit: float = LIMIT) -> Comparison:
    """Sort the benches of two runs by how their ratios changed."""
    found = Comparison()
    for name, ratio in now.items():
        if name not in before:
            found.new.append(name)
            continue
        change = ratio / before[name]
        room = found.slower if change > limit else found.alike
        (found.faster if change < 1 / limit else room)[name] = change
    found.missing = [name for name in before if name not in now]
    return found


def table(found: Comparison, limit: float) -> list[str]:
    """Lines to print, the worst first."""
    percent = f"{100 * (limit - 1):.0f} %"
    lines = [f"{len(found.alike)} benches as the baseline, within {percent}"]
    for title, changes in (("slower", found.slower), ("faster", found.faster)):
        lines += [f"{len(changes)} {title} by over {percent}"] if changes else []
        ordered = sorted(changes.items(), key=lambda item: item[1], reverse=title == "slower")
        width = max((len(name) for name in changes), default=0)
        lines += [f"  {name:{width}}  {change:6.2f} times the baseline" for name, change in ordered]
    lines += [f"new, not in the baseline: {', '.join(found.new)}"] if found.new else []
    lines += [f"not measured: {', '.join(found.missing)}"] if found.missing else []
    return lines


def medians(target: Path) -> dict[str, float]:
    """Medians of this run by the full names of the benches [ns]."""
    started = (target / "bench/started").stat().st_mtime
    groups = estimates(target, started)
    return {
        f"{group}/{name}".rstrip("/"): median["point_estimate"]
        for group, rows in groups.items()
        for name, median, _ in rows
    }


def main() -> None:
    """Compare, or write the baseline."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", type=Path, help="where cargo puts what it makes")
    parser.add_argument("--baseline", type=Path, default=BASELINE)
    parser.add_argument("--limit", type=float, default=LIMIT, help="allowed ratio of ratios")
    parser.add_argument("--check", action="store_true", help="exit 1 where a bench is slower")
    parser.add_argument("--write", action="store_true", help="make this run the baseline")
    given = parser.parse_args()
    measured = medians(given.target)
    if given.write:
        own = ratios(measured, REFERENCE)
        content: dict[str, Any] = {
            "reference": REFERENCE,
            "nanoseconds": round(measured[REFERENCE], 1),
            "ratios": {name: float(f"{ratio:.4g}") for name, ratio in own.items()},
        }
        given.baseline.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        print(f"{given.baseline}: written, {len(own)} benches")
        return
    baseline = json.loads(given.baseline.read_text(encoding="utf-8"))
    reference = baseline["reference"]
    found = compare(ratios(measured, reference), baseline["ratios"], given.limit)
    here, there = in_units(measured[reference]), in_units(baseline["nanoseconds"])
    print(f"reference {reference}: {here}, in the baseline {there}")
    print("\n".join(table(found, given.limit)))
    sys.exit(1 if given.check and found.slower else 0)


if __name__ == "__main__":
    main()
