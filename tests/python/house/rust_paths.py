"""Imports among the files of a Rust crate.

A path (`use` trees and paths in bodies that begin with `crate`, `super`, `self` or a child module)
leads to the file that defines its name: re-exports and imports on the way are followed.
`#[cfg(test)]` items do not count, nor do `mod child;` and `pub use child::Name`, by which a room
lists what it offers; what the code of a `mod.rs` takes from its children does count.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import PurePosixPath

from .rust_source import RustSource, Token, rust_source

STARTS = ("crate", "super", "self")
Path = tuple[str, ...]


@dataclass
class Module:
    """File of a crate: its definitions, what its imports name, and the paths in its code."""

    file: str
    path: Path
    source: RustSource
    imports: dict[str, Path] = field(default_factory=dict)
    globs: list[Path] = field(default_factory=list)
    taken: list[tuple[int, Path]] = field(default_factory=list)
    offered: list[tuple[int, Path]] = field(default_factory=list)


def module_path(file: str, root: str) -> Path:
    """Path of the module that a file holds: `rod/mod.rs` is `rod`."""
    parts = PurePosixPath(file.removeprefix(root)).with_suffix("").parts
    return parts[:-1] if parts[-1] in ("mod", "lib") else parts


def read_crate(tree: dict[str, str], root: str) -> dict[Path, Module]:
    """Modules of a crate by their paths."""
    modules = {}
    for file, text in tree.items():
        if file.startswith(root) and file.endswith(".rs"):
            path = module_path(file, root)
            modules[path] = Module(file, path, rust_source(text))
    for module in modules.values():
        read_paths(module, modules)
    return modules


def read_paths(module: Module, modules: dict[Path, Module]) -> None:
    """Fill in what a module's code imports and takes."""
    tokens, i = module.source.tokens, 0
    partners, tests = module.source.partners, module.source.test_lines
    while i < len(tokens):
        token = tokens[i]
        if token.line in tests or token.kind != "word":
            i += 1
        elif token.text == "use":
            is_offer = i > 0 and (
                tokens[i - 1].text == "pub"
                or (tokens[i - 1].text == ")" and is_visibility(tokens, partners, i - 1))
            )
            end = i + 1
            while tokens[end].text != ";":
                end += 1
            for name, path in use_tree(tokens[i + 1 : end], ()):
                add_import(module, modules, name, path, token.line, is_offer)
            i = end
        else:
            i = add_path(module, modules, i)


def is_visibility(tokens: list[Token], partners: dict[int, int], close: int) -> bool:
    """Presence of `pub(...)` before a closing bracket."""
    opening = next((o for o, c in partners.items() if c == close), 0)
    return opening > 0 and tokens[opening - 1].text == "pub"


def use_tree(tokens: list[Token], before: Path) -> list[tuple[str, Path]]:
    """Names and paths that a `use` tree imports; the name of a glob is `*`."""
    path, i = list(before), 0
    while i < len(tokens):
        text = tokens[i].text
        if text == "{":
            found, depth, start = [], 0, i + 1
            for k in range(i, len(tokens)):
                depth += (tokens[k].text == "{") - (tokens[k].text == "}")
                if (depth == 1 and tokens[k].text == ",") or depth == 0:
                    if k > start:
                        found += use_tree(tokens[start:k], tuple(path))
                    start = k + 1
                if depth == 0:
                    break
            return found
        if text == "*":
            return [("*", tuple(path))]
        if text == "as":
            return [(tokens[i + 1].text, tuple(path))]
        if text == "self" and path:
            return [(path[-1], tuple(path))]
        if text != "::":
            path.append(text)
        i += 1
    return [(path[-1], tuple(path))]


def absolute(module: Module, modules: dict[Path, Module], path: Path) -> Path | None:
    """Path from the root of the crate; none where it leads out of it."""
    if path[0] == "crate":
        return path[1:]
    if path[0] in ("self", "super"):
        base, rest = module.path, path
        while rest and rest[0] in ("self", "super"):
            base = base[:-1] if rest[0] == "super" else base
            rest = rest[1:]
        return base + rest
    return module.path + path if module.path + path[:1] in modules else None


def add_import(
    module: Module,
    modules: dict[Path, Module],
    name: str,
    path: Path,
    line: int,
    is_offer: bool,
) -> None:
    """Add one name of a `use`."""
    full = absolute(module, modules, path)
    if full is None:
        return
    if name == "*":
        module.globs.append(full)
    else:
        module.imports[name] = full
    is_child = full[: len(module.path)] == module.path and len(full) > len(module.path)
    (module.offered if is_offer and is_child else module.taken).append((line, full))


def add_path(module: Module, modules: dict[Path, Module], i: int) -> int:
    """Add the path that begins at a token, if one does; the index after it."""
    tokens = module.source.tokens
    begins = i == 0 or tokens[i - 1].text not in ("::", ".", "in", "fn", "mod", "struct")
    is_path = i + 2 < len(tokens) and tokens[i + 1].text == "::"
    is_own = tokens[i].text in STARTS or (*module.path, tokens[i].text) in modules
    if not (begins and is_path and is_own):
        return i + 1
    path, k = [tokens[i].text], i + 1
    while k + 1 < len(tokens) and tokens[k].text == "::" and tokens[k + 1].kind == "word":
        path.append(tokens[k + 1].text)
        k += 2
    full = absolute(module, modules, tuple(path))
    if full is not None:
        module.taken.append((tokens[i].line, full))
    return k


def resolve(modules: dict[Path, Module], path: Path, depth: int = 0) -> Module | None:
    """Module that defines what a path names."""
    at: Path = ()
    for k, name in enumerate(path):
        if (*at, name) in modules:
            at = (*at, name)
            continue
        module = modules[at]
        if depth > 20 or name in {n for _, n, _ in module.source.declared}:
            return module
        if name in module.imports:
            return resolve(modules, module.imports[name] + path[k + 1 :], depth + 1)
        for glob in module.globs:
            if glob != at and glob in modules:
                found = resolve(modules, glob + path[k:], depth + 1)
                if found is not None and found.path != glob:
                    return found
        return module
    return modules.get(at)


def crate_arrows(modules: dict[Path, Module]) -> dict[tuple[str, str], list[int]]:
    """Lines of the importing file by the pair of files (from, to)."""
    arrows: dict[tuple[str, str], list[int]] = {}
    for module in modules.values():
        for line, path in module.taken:
            target = resolve(modules, path)
            if target is not None and target is not module:
                arrows.setdefault((module.file, target.file), []).append(line)
    return arrows
