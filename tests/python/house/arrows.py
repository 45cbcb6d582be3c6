"""Rooms of the house, which of them may import which, and circles of imports."""

from __future__ import annotations

from dataclasses import dataclass

from .python_paths import python_imports
from .rust_paths import crate_arrows, read_crate

CORE, BINDING, PYTHON = "rust/core/src/", "rust/py/src/", "python/tdcr/"


@dataclass(frozen=True)
class Plan:
    """Floors of a part from the top down: a room imports rooms of lower floors only.

    Rooms of one floor do not see each other. `narrow` lists all that a room may import where that
    is less. `free` are files that list others: they import what they like, and nobody imports them.
    """

    root: str
    floors: tuple[tuple[str, ...], ...]
    free: tuple[str, ...] = ()
    narrow: tuple[tuple[str, tuple[str, ...]], ...] = ()


PLANS = (
    Plan(
        CORE,
        (
            ("design",),
            ("grasp",),
            ("inverse",),
            ("forward", "planar"),
            ("batch",),
            ("rod", "linkage", "constant_curvature"),
            ("model",),
            ("robot", "obstacle", "solve"),
            ("lie",),
            ("error", "status", "hashing"),
        ),
        free=("lib",),
        narrow=(("planar", ("batch", "solve", "lie", "error", "status", "hashing")),),
    ),
    Plan(
        BINDING,
        (
            ("design",),
            ("grasp",),
            ("inverse",),
            ("forward", "planar", "constant_curvature", "pso"),
            ("scene",),
            ("settings", "robot"),
            ("convert",),
        ),
        free=("lib",),
    ),
    Plan(
        PYTHON,
        (
            ("__main__",),
            ("_cli",),
            ("__init__",),
            ("_view", "bridges"),
            ("design",),
            ("_gripper", "_workspace", "_inverse", "planar", "pso", "constant_curvature"),
            ("_forward",),
            ("_plot",),
            ("_io",),
            ("_base",),
            ("errors",),
        ),
    ),
)
# Rooms that nobody imports at the top of a file: they wait for the call that needs them.
LAZY = ("_plot", "_view")


def room_of(file: str, root: str) -> str:
    """Room of a file: the folder, or the file, just below the root."""
    return file.removeprefix(root).partition("/")[0].partition(".")[0]


def file_arrows(tree: dict[str, str], root: str) -> dict[tuple[str, str], list[int]]:
    """Lines of the importing file by the pair of files (from, to)."""
    if root != PYTHON:
        return crate_arrows(read_crate(tree, root))
    arrows: dict[tuple[str, str], list[int]] = {}
    for found in python_imports(tree):
        arrows.setdefault((found.source, found.target), []).append(found.line)
    return arrows


def is_allowed(plan: Plan, source: str, target: str) -> bool:
    """Permission of an arrow between two rooms."""
    floors = {room: k for k, rooms in enumerate(plan.floors) for room in rooms}
    if source == target or source in plan.free:
        return True
    narrow = dict(plan.narrow)
    if source in narrow:
        return target in narrow[source]
    return source in floors and target in floors and floors[source] < floors[target]


def arrows_against(tree: dict[str, str], plan: Plan) -> list[str]:
    """Arrows that the plan does not allow, with their lines."""
    found = []
    for (source, target), lines in sorted(file_arrows(tree, plan.root).items()):
        rooms = room_of(source, plan.root), room_of(target, plan.root)
        if not is_allowed(plan, *rooms):
            at = ", ".join(map(str, sorted(set(lines))))
            found.append(f"{rooms[0]} -> {rooms[1]}: {source}:{at} imports {target}")
    return found


def eager_imports(tree: dict[str, str]) -> list[str]:
    """Imports at the top of a file from rooms that wait for the call that needs them."""
    return [
        f"{i.source}:{i.line} imports {i.target} at the top"
        for i in python_imports(tree)
        if room_of(i.target, PYTHON) in LAZY
        and room_of(i.source, PYTHON) != room_of(i.target, PYTHON)
        and not i.lazy
    ]


def circles(arrows: set[tuple[str, str]]) -> list[list[str]]:
    """Sets of nodes that lead to each other, larger than one (Tarjan's components)."""
    after: dict[str, list[str]] = {}
    for source, target in sorted(arrows):
        after.setdefault(source, []).append(target)
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    path: list[str] = []
    found = []

    def visit(node: str) -> None:
        order[node] = low[node] = len(order)
        path.append(node)
        for target in after.get(node, []):
            if target not in order:
                visit(target)
            if target in path:
                low[node] = min(low[node], low[target])
        if low[node] == order[node]:
            component = path[path.index(node) :]
            del path[path.index(node) :]
            if len(component) > 1:
                found.append(sorted(component))

    for node in sorted(after):
        if node not in order:
            visit(node)
    return found


def room_arrows(arrows: dict[tuple[str, str], list[int]], plan: Plan) -> set[tuple[str, str]]:
    """Arrows among the rooms of a part, those of free files aside."""
    pairs = {(room_of(a, plan.root), room_of(b, plan.root)) for a, b in arrows}
    return {(a, b) for a, b in pairs if a != b and a not in plan.free}


def report_arrows(tree: dict[str, str]) -> list[str]:
    """Lines on arrows against the house and on circles of rooms."""
    lines = []
    for plan in PLANS:
        lines += arrows_against(tree, plan)
        for circle in circles(room_arrows(file_arrows(tree, plan.root), plan)):
            lines.append(f"circle of rooms below {plan.root}: {', '.join(circle)}")
    return lines + eager_imports(tree)


def circles_of_files(tree: dict[str, str]) -> list[str]:
    """Lines on circles of files, each with the arrows that make it."""
    lines = []
    for plan in PLANS:
        arrows = file_arrows(tree, plan.root)
        for circle in circles(set(arrows)):
            lines.append(f"circle of {len(circle)} files below {plan.root}:")
            for source, target in sorted(arrows):
                if source in circle and target in circle:
                    at = ", ".join(map(str, sorted(set(arrows[source, target]))))
                    names = source.removeprefix(plan.root), target.removeprefix(plan.root)
                    lines.append(f"    {plan.root}{names[0]}:{at} -> {names[1]}")
    return lines
