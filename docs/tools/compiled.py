"""Docstrings of the compiled classes, for the reference.

Griffe reads names, signatures and types from `_core.pyi`, which has no docstrings; those live in
the compiled module. The other way round, inspection alone, would lose every type. So: the stub,
with the docstring of each object as Python shows it, and `__new__` as what makes a class.
"""

from __future__ import annotations

import importlib
import inspect
import re
from typing import Any

import griffe

# "displacements : array_like, shape (K,), optional"; several names may share a line.
_ITEM = re.compile(r"^(?P<names>[\w*]+(?:, [\w*]+)*) : (?P<type>.+?)(?:, optional)?$", re.MULTILINE)
_NAME = re.compile(r"[\w.]+(\[[\w., ]+\])?")
# A doctest outside of an "Examples" section.
_DOCTEST = re.compile(r"^(>>> .*?)(?=\n\s*\n|\Z)", re.MULTILINE | re.DOTALL)
_TYPED = (griffe.DocstringSectionKind.parameters, griffe.DocstringSectionKind.attributes)
# The stub's shorthands, as they are to be read.
_ALIASES = {"_Array": "NDArray", "Array": "NDArray", "_Floats": "float | Sequence[float]"}


class Compiled(griffe.Extension):
    """Completes `_core`, and keeps the types of docstrings as they were written."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Run once the package is loaded."""
        if pkg.name == "tdcr":
            _complete(pkg["_core"], importlib.import_module("tdcr._core"))
            _polish(pkg)


def _complete(stub: griffe.Object, runtime: object) -> None:
    for name, member in list(stub.members.items()):
        if member.is_alias or not hasattr(runtime, name):
            continue
        thing = getattr(runtime, name)
        if member.docstring is None and (text := inspect.getdoc(thing)):
            member.docstring = griffe.Docstring(text, parent=member)
        if member.is_class:
            _complete(member, thing)
            if "__new__" in member.members:
                _construct(member)


def _construct(cls: griffe.Object) -> None:
    new = cls.members["__new__"]
    init = griffe.Function("__init__", parameters=new.parameters, lineno=new.lineno, parent=cls)
    cls.set_member("__init__", init)
    cls.del_member("__new__")


def _polish(scope: griffe.Object) -> None:
    for member in scope.members.values():
        if member.is_alias:
            continue
        if member.docstring is not None:
            _restore_types(member)
        annotations = [member.annotation] if member.is_attribute else []
        if member.is_function:
            annotations = [member.returns, *(p.annotation for p in member.parameters)]
        for annotation in annotations:
            _spell_out(annotation)
        if member.is_class or member.is_module:
            _polish(member)


def _restore_types(thing: griffe.Object) -> None:
    """Griffe reads "array_like, shape (K,)" as an expression and respells it."""
    docstring = thing.docstring
    docstring.parser = griffe.Parser.numpy
    # What `**options` stands for is named in the docstring only.
    open_ended = thing.is_function and any(
        p.kind is griffe.ParameterKind.var_keyword for p in thing.parameters
    )
    docstring.parser_options = {"warn_unknown_params": not open_ended}
    written = {}
    for found in _ITEM.finditer(docstring.value):
        names = found["names"]
        written |= dict.fromkeys((names, *names.split(", ")), found["type"])
    signature = {}
    if thing.is_function or thing.is_class:
        signature = {p.name: p for p in thing.parameters}
    for section in docstring.parsed:
        if section.kind is griffe.DocstringSectionKind.text:
            section.value = _DOCTEST.sub(r"```pycon\n\1\n```", section.value)
        elif section.kind is griffe.DocstringSectionKind.returns:
            _restore_returns(section.value, docstring.value)
        for item in section.value if section.kind in _TYPED else ():
            text = written.get(item.name)
            if text is not None and not _NAME.fullmatch(text):
                item.annotation = text
            if (declared := signature.get(item.name)) is None:
                continue
            # Of a choice in braces Griffe makes the first one the default.
            item.value = declared.default
            if text is None:
                item.annotation = declared.annotation


def _restore_returns(items: list[griffe.DocstringReturn], text: str) -> None:
    block = re.search(r"^Returns\n-+\n(.*?)(?=^\w+\n-+$|\Z)", text, re.MULTILINE | re.DOTALL)
    lines = [line for line in block[1].splitlines() if line[:1].strip()] if block else []
    for item, line in zip(items, lines, strict=True):
        if not item.name and not _NAME.fullmatch(line):
            item.annotation = line


def _spell_out(annotation: str | griffe.Expr | None) -> None:
    if isinstance(annotation, griffe.Expr):
        for part in annotation.iterate(flat=True):
            if isinstance(part, griffe.ExprName):
                part.name = _ALIASES.get(part.name, part.name)
