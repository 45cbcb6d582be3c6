"""Progress of long calls: a bar on a terminal, or a callable of the user."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

__all__ = ["progress_callback"]


@contextmanager
def progress_callback(
    progress: bool | Callable[[int], object], name: str, total: int | None
) -> Iterator[Callable[[int], object] | None]:
    """Give the callable that gets the count of what is done, or None.

    Parameters
    ----------
    progress : bool or callable
        True draws a progress bar on stderr; a callable is given back.
    name : str
        What the bar is for.
    total : int or None
        How much there is to do, if that is known.

    Raises
    ------
    TypeError
        Neither a bool nor a callable.
    """
    if callable(progress):
        yield progress
    elif not (progress is None or isinstance(progress, (bool, np.bool_))):
        got = type(progress).__name__
        raise TypeError(f"progress: expected a bool or a callable, got {got}")
    elif progress:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

        columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        with Progress(*columns, console=Console(stderr=True)) as bar:
            task = bar.add_task(name, total=total)
            yield lambda done: bar.update(task, completed=done)
    else:
        yield None
