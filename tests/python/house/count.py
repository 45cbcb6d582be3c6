"""Counts of the house: comments, docstrings, long files, words, lines of code and of prose."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from .python_source import PythonSource, python_source
from .rust_source import Function, RustSource, rust_source
from .words import OPENING, is_old_file, is_participle, old_names

ROOT = Path(__file__).resolve().parents[3]
PARTS = {"core": "rust/core/src/", "binding": "rust/py/src/", "Python": "python/tdcr/"}
STUB = "python/tdcr/_core.pyi"
LONG_FUNCTION, UNDOCUMENTED, LONG_FILE, PROSE = 40, 60, 400, 120
# Prose outside the sources is looked for here.
PAGES = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "docs/")


@dataclass
class Part:
    """Counts of a part of the repository; places are written `file:line`."""

    files: int = 0
    code: int = 0
    functions: int = 0
    long_functions: list[tuple[str, Function]] = field(default_factory=list)
    undocumented: list[str] = field(default_factory=list)
    long_files: list[str] = field(default_factory=list)
    old_words: list[str] = field(default_factory=list)
    participles: list[str] = field(default_factory=list)
    openings: list[str] = field(default_factory=list)
    wide: list[str] = field(default_factory=list)

    @property
    def density(self) -> float:
        """Comment lines per 100 lines of functions of 40 lines or more."""
        lines = sum(f.length for _, f in self.long_functions)
        return 100 * sum(f.comments for _, f in self.long_functions) / max(lines, 1)


def read_tree(revision: str | None = None, root: Path = ROOT) -> dict[str, str]:
    """Text of every source and page by its path: of the work tree, or of a commit."""
    if revision is None:
        folders = [*PARTS.values(), "docs/"]
        paths = [p for folder in folders for p in (root / folder).rglob("*") if p.is_file()]
        paths += [root / page for page in PAGES if (root / page).is_file()]
        names = {p.relative_to(root).as_posix(): p for p in paths if p.suffix in SUFFIXES}
        return {name: p.read_text(encoding="utf-8") for name, p in sorted(names.items())}
    git = ["git", "-C", str(root)]
    listed = subprocess.run(
        [*git, "ls-tree", "-r", "--name-only", revision], capture_output=True, text=True, check=True
    )
    wanted = (*PARTS.values(), *PAGES)
    names = [n for n in listed.stdout.splitlines() if n.startswith(wanted)]
    return {
        name: subprocess.run(
            [*git, "show", f"{revision}:{name}"], capture_output=True, text=True, check=True
        ).stdout
        for name in names
        if Path(name).suffix in SUFFIXES
    }


SUFFIXES = (".rs", ".py", ".pyi", ".md")


def public_names(sources: dict[str, PythonSource]) -> set[str]:
    """Names that a user of the Python package sees: those of the stub and of public classes."""
    exported = set()
    for source in sources.values():
        for found in re.findall(r"__all__ = \[(.*?)\]", source.text, re.DOTALL):
            exported.update(re.findall(r'"(\w+)"', found))
    names = set(exported)
    for path, source in sources.items():
        for node in source.nodes:
            is_class = isinstance(node, ast.ClassDef) and (node.name in exported or path == STUB)
            if is_class or (isinstance(node, ast.Module) and path == STUB):
                names.update(m.name for m in node.body if isinstance(m, ast.FunctionDef))
    return {name for name in names if not name.startswith("_")}


def count(tree: dict[str, str]) -> dict[str, Part]:
    """Counts of every part, and the prose of the pages."""
    parts = {name: Part() for name in (*PARTS, "stub", "pages")}
    python = {p: python_source(t) for p, t in tree.items() if p.endswith((".py", ".pyi"))}
    public = public_names({p: s for p, s in python.items() if p.startswith(PARTS["Python"])})
    for path, text in tree.items():
        if path.endswith(".md"):
            parts["pages"].files += 1
            parts["pages"].wide += [f"{path}:{n}" for n in wide_prose(text)]
            continue
        name = next((n for n, folder in PARTS.items() if path.startswith(folder)), None)
        if name is None:
            continue
        source = python[path] if path in python else rust_source(text)
        add_file(parts["stub" if path == STUB else name], path, source, public)
    return parts


def add_file(part: Part, path: str, source: RustSource | PythonSource, public: set[str]) -> None:
    """Add one file to the counts of its part."""
    part.files += 1
    part.code += len(source.code_lines)
    lines = source.text.splitlines()
    if len(lines) > LONG_FILE:
        part.long_files.append(f"{path} ({len(lines)})")
    part.wide += [f"{path}:{n}" for n in sorted(source.prose_lines) if len(lines[n - 1]) > PROSE]
    part.openings += [f"{path}:{n} {text}" for n, text in source.docs if OPENING.match(text)]
    if is_old_file(path):
        part.old_words.append(f"{path} (file)")
    if isinstance(source, RustSource):
        part.old_words += [f"{path}:{n} {name}" for name, n in old_names(path, source.named)]
    if path == STUB:
        return
    for function in source.functions:
        if function.tested:
            continue
        part.functions += 1
        place = f"{path}:{function.line}"
        if function.length >= LONG_FUNCTION:
            part.long_functions.append((place, function))
        if function.length > UNDOCUMENTED and not function.documented:
            part.undocumented.append(f"{place} {function.name} ({function.length})")
        is_public = function.name in public and not path.startswith(PARTS["core"])
        if is_participle(function.name) and not is_public:
            part.participles.append(f"{place} {function.name}")


def wide_prose(text: str) -> Iterator[int]:
    """Lines of a page beyond the column, but tables, code, formulas, pictures."""
    fenced = False
    for n, line in enumerate(text.splitlines(), start=1):
        if line.lstrip().startswith(("```", "~~~")):
            fenced = not fenced
        is_prose = not fenced and not line.lstrip().startswith(("|", "<", "![", "$$"))
        if is_prose and len(line) > PROSE and " " in line[:PROSE].strip():
            yield n


def summary(parts: dict[str, Part]) -> dict[str, dict[str, float]]:
    """Figures by part, in the order in which they are printed."""
    return {
        name: {
            "files": part.files,
            "lines of code": part.code,
            "functions": part.functions,
            "functions of 40 lines or more": len(part.long_functions),
            "comment lines per 100 in those": round(part.density, 1),
            "functions over 60 lines": sum(f.length > UNDOCUMENTED for _, f in part.long_functions),
            "of them without docstring": len(part.undocumented),
            "files over 400 lines": len(part.long_files),
            "names of the left column": len(part.old_words),
            "bare past participles": len(part.participles),
            "docs opening with What, How...": len(part.openings),
            "prose beyond column 120": len(part.wide),
        }
        for name, part in parts.items()
    }
