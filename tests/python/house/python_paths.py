"""Imports among the files of the package: at the top, in functions and for types alike."""

from __future__ import annotations

import ast
from dataclasses import dataclass

from .python_source import python_source

PACKAGE = "python/"


@dataclass(frozen=True)
class Import:
    """One import: both files, its line, and whether it waits until a function runs."""

    source: str
    target: str
    line: int
    lazy: bool


def module_name(file: str) -> str:
    """Dotted name of the module that a file holds."""
    name = file.removeprefix(PACKAGE).rpartition(".")[0].replace("/", ".")
    return name.removesuffix(".__init__")


def python_imports(tree: dict[str, str]) -> list[Import]:
    """Every import of the package by itself; of what is compiled none."""
    texts = {f: t for f, t in tree.items() if f.startswith(PACKAGE) and f.endswith(".py")}
    files = {module_name(file): file for file in texts}
    found = []
    for file, text in texts.items():
        source = python_source(text)
        for node in source.nodes:
            for name in imported(node, file, files):
                if files[name] != file:
                    found.append(Import(file, files[name], node.lineno, node in source.lazy_nodes))
    return found


def imported(node: ast.AST, file: str, files: dict[str, str]) -> list[str]:
    """Modules of the package that a node imports; of `from room import file`, the file."""
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        base = node.module or ""
        if node.level:
            parents = module_name(file).split(".")
            inside = file.endswith("/__init__.py")
            parents = parents[: len(parents) - node.level + inside]
            base = ".".join([*parents, base]) if base else ".".join(parents)
        names = [
            f"{base}.{alias.name}" if f"{base}.{alias.name}" in files else base
            for alias in node.names
            if f"{base}.{alias.name}" != "tdcr._core"
        ]
    elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
        names = [a.value for a in node.args if isinstance(a, ast.Constant)]
    else:
        return []
    return sorted({name for name in names if name in files})
