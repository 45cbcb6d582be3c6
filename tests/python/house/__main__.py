"""Print the counts: `python tests/python/house [--against REVISION] [--list WHAT] [PATH ...]`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

if not __package__:
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from house.arrows import circles_of_files, report_arrows
from house.count import Part, count, read_tree, summary

LISTS = {
    "functions": "functions of 40 lines or more with fewer than 8 comment lines per 100",
    "undocumented": "functions over 60 lines without docstring",
    "files": "files over 400 lines",
    "words": "names of the left column",
    "participles": "functions named by a bare past participle",
    "openings": "docs that open with What, How, Whether, Where, Of, The same, As",
    "wide": "prose beyond column 120",
    "arrows": "arrows against the house, and circles",
}


def listed(what: str, part: Part) -> list[str]:
    """Lines of one list for one part."""
    if what == "functions":
        poor = [(place, f) for place, f in part.long_functions if 100 * f.comments < 8 * f.length]
        poor.sort(key=lambda item: item[1].comments / item[1].length - item[1].length / 1e4)
        return [f"{place} {f.name}: {f.length} lines, {f.comments} comments" for place, f in poor]
    return {
        "undocumented": part.undocumented,
        "files": part.long_files,
        "words": part.old_words,
        "participles": part.participles,
        "openings": part.openings,
        "wide": part.wide,
    }[what]


def main() -> None:
    """Print the table, then the lists that are asked for."""
    parser = argparse.ArgumentParser(
        description="Counts of the house and its arrows, read from the sources alone."
    )
    parser.add_argument("paths", nargs="*", help="show only places below these paths in lists")
    parser.add_argument("--against", metavar="REVISION", help="compare with a commit")
    parser.add_argument("--at", metavar="REVISION", help="count a commit, not the work tree")
    parser.add_argument(
        "--list", action="append", choices=[*LISTS, "all"], default=[], dest="lists"
    )
    asked = parser.parse_args()
    tree = read_tree(asked.at)
    parts = count(tree)
    old = summary(count(read_tree(asked.against))) if asked.against else None
    figures = summary(parts)
    names = list(figures)
    print(f"{'':34}" + "".join(f"{name:>16}" for name in names))
    for row in figures["core"]:
        cells = []
        for name in names:
            now = f"{figures[name][row]:g}"
            cells.append(f"{old[name][row]:g} -> {now}" if old else now)
        print(f"{row:34}" + "".join(f"{cell:>16}" for cell in cells))
    for what in LISTS if "all" in asked.lists else asked.lists:
        print(f"\n{LISTS[what]}:")
        lines = (
            [*report_arrows(tree), *circles_of_files(tree)]
            if what == "arrows"
            else [line for part in parts.values() for line in listed(what, part)]
        )
        shown = [line for line in lines if not asked.paths or any(p in line for p in asked.paths)]
        print("\n".join(f"  {line}" for line in shown) or "  none")


if __name__ == "__main__":
    main()
