"""Tables on a terminal, and as plain text where the output is none."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["console_of", "facts_table", "show", "table_of", "text_of", "vector_text"]

_WIDE = 10_000  # columns, more than any table has


def facts_table(console: Console, *facts: tuple[str, str]) -> Table:
    """Make a table of names and what they are."""
    table = table_of(console, "", "")
    table.show_header = False
    table.columns[1].justify = "left"
    for name, text in facts:
        table.add_row(text_of(name), text_of(text))
    return table


def vector_text(values: NDArray[np.float64], digits: int) -> str:
    """Write numbers with spaces between them."""
    # Adding 0.0 after rounding turns -0.0 into 0.0.
    return "  ".join(f"{round(float(value), digits) + 0.0:.{digits}f}" for value in values)


def text_of(text: str) -> Any:
    """Keep a user's text as it is: square brackets in it are no markup."""
    from rich.text import Text

    return Text(text)


def console_of() -> Console:
    """Give the console of stdout."""
    from rich.console import Console

    class Output(Console):
        """Console that leaves it to its caller that the reader has gone, rather than exit."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    # Into a pipe or a file: plain, and no line is broken to fit a terminal.
    return Output(highlight=False) if sys.stdout.isatty() else Output(
        highlight=False, width=400, no_color=True
    )  # fmt: skip


def show(console: Console, *tables: Table) -> None:
    """Print tables with an empty line between them, whole.

    A terminal that is too narrow breaks their lines: a number that lost its last digits would look
    like another one.
    """
    for index, table in enumerate(tables):
        if index:
            console.print()
        if console.is_terminal:
            wide = console.options.update(max_width=_WIDE)
            fixed = all(column.no_wrap for column in table.columns)
            width = console.measure(table, options=wide).maximum if fixed else 0
            console.width = max(width, console.width)
            console.print(table)
            continue
        with console.capture() as captured:
            console.print(table)
        # Without the blanks that fill columns up.
        lines = captured.get().rstrip("\n").split("\n")
        console.file.write("".join(f"{line.rstrip()}\n" for line in lines))
    console.file.flush()


def table_of(console: Console, *headers: str) -> Table:
    """Make a table without rows."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD if console.is_terminal else None, pad_edge=False)
    table.padding = (0, 1, 0, 0) if console.is_terminal else (0, 2, 0, 0)
    for index, header in enumerate(headers):
        table.add_column(Text(header), justify="left" if index == 0 else "right", no_wrap=True)
    return table
