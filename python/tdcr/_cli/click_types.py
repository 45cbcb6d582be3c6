"""Click as the commands want it: lists of numbers as people type them, groups that guess."""

from __future__ import annotations

import os
import re
import sys
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from math import inf, isfinite, nan
from pathlib import Path
from threading import Timer
from typing import Any

import click

__all__ = ["Command", "Commands", "Interrupted", "Numbers", "Unread", "read_numbers"]

_WORDS = {"inf": inf, "+inf": inf, "free": inf, "nan": nan}
_WITH_UNIT = re.compile(r"[+-]?[\d.]+(e[+-]?\d+)?(mm|cm|um|m|in|deg|rad)")


class Interrupted(Exception):
    """Ctrl-C, under a name for which click writes no line of its own."""


class Unread(Exception):
    """The reader of stdout has gone, under a name for which click does not exit with 1."""


@contextmanager
def _own_names() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted from None
    except BrokenPipeError:
        raise Unread from None


@contextmanager
def _interrupts_kept() -> Iterator[None]:
    """Bring back a Ctrl-C that falls into a callback of the garbage collector.

    Python prints what such a callback raises and goes on. matplotlib has one for every artist that
    is dropped, so that one interrupt in sixty of an animation was lost.
    """
    before, timers = sys.unraisablehook, []

    def hook(lost: Any) -> None:
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            before(lost)
            return
        # Not from here, where it would be lost again.
        timers.append(Timer(0.01, interrupt_main))
        timers[-1].start()

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before
        for timer in timers:
            timer.cancel()


class Commands(click.Group):
    """A group that says which command may have been meant."""

    def make_context(self, *arguments: Any, **extra: Any) -> click.Context:
        with _own_names():
            return super().make_context(*arguments, **extra)

    def invoke(self, context: click.Context) -> Any:
        with _own_names(), _interrupts_kept():
            return super().invoke(context)

    def resolve_command(
        self, context: click.Context, arguments: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = arguments[0]
        if self.get_command(context, name) is None and not name.startswith("-"):
            close = get_close_matches(name.lower(), self.commands, 1)
            hint = f"did you mean '{close[0]}'?" if close else f"expected {_any_of(self.commands)}"
            raise click.UsageError(f"No such command '{name}'; {hint}", context)
        return super().resolve_command(context, arguments)


def _any_of(names: Any) -> str:
    *first, last = sorted(names)
    return f"{', '.join(first)} or {last}"


class Numbers(click.Option):
    """An option for numbers: ``-d -5,free``, ``-d "-5 free"`` and ``-d -5 free`` say the same.

    Its value is a list of floats. With `count` there must be so many; `words` allows inf and free.
    """

    def __init__(self, *names: Any, count: int | None = None, words: bool = False, **given: Any):
        def read(context: click.Context, parameter: click.Parameter, text: str | None) -> Any:
            if text is None:
                return None
            found = read_numbers(text, words)
            if count is not None and len(found) != count:
                raise click.BadParameter(f"expected {count} numbers, got {len(found)}")
            return found

        super().__init__(*names, **{"callback": read} | given)


_OUTPUTS = ("output", "json_file", "plot_file", "animate")


class Command(click.Command):
    """A command whose options for numbers take as many words as follow.

    It writes no file over one that it reads, nor two into one.
    """

    def invoke(self, context: click.Context) -> Any:
        given = {name: value for name, value in context.params.items() if value is not None}
        taken = {os.path.realpath(v): "reads" for v in given.values() if isinstance(v, Path)}
        for name in _OUTPUTS:
            file = os.path.realpath(given.get(name, "-"))
            if given.get(name, "-") == "-" or (os.path.exists(file) and not os.path.isfile(file)):
                continue
            if file in taken:
                option = next(p.opts[-1] for p in self.params if p.name == name)
                got = f"{given[name]}, which the command {taken[file]} too"
                raise click.UsageError(f"{option}: expected a file of its own, got {got}", context)
            taken[file] = "writes"
        return super().invoke(context)

    def parse_args(self, context: click.Context, arguments: list[str]) -> list[str]:
        options = {n for p in self.params if isinstance(p, Numbers) for n in p.opts}
        return super().parse_args(context, list(_join_numbers(arguments, options)))


def _join_numbers(arguments: list[str], options: set[str]) -> Iterator[str]:
    """Give the words of a command line, with the numbers after an option in one word."""
    rest = list(arguments)
    while rest:
        word = rest.pop(0)
        name, equals, value = word.partition("=")
        if name not in options or not (equals or rest):
            yield word
            continue
        found = [value if equals else rest.pop(0)]
        while rest and _are_numbers(rest[0]):
            found.append(rest.pop(0))
        yield name
        yield " ".join(found)


def _are_numbers(text: str) -> bool:
    try:
        for word in re.split(r"[ ,:]+", text.strip(" ,")):
            if word.lower() not in _WORDS:
                float(word)
    except ValueError:
        return False
    return True


def read_numbers(text: str, words: bool = False) -> list[float]:
    """Read numbers with commas or spaces between them."""
    expected = "finite numbers, inf or free" if words else "numbers"
    found = []
    for word in text.replace(",", " ").split():
        number = _number(word, words)
        if number is None:
            hint = "; its unit is said by --unit" if _WITH_UNIT.fullmatch(word.lower()) else ""
            raise click.BadParameter(f"expected {expected}, got {word!r}{hint}")
        found.append(number)
    return found


def _number(word: str, words: bool) -> float | None:
    if words and word.lower() in _WORDS:
        return _WORDS[word.lower()]
    try:
        number = float(word)
    except ValueError:
        return None
    return None if words and not isfinite(number) else number
