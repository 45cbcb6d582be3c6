"""Files that appear complete or not at all."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["replace_file"]


def replace_file(path: str | os.PathLike[str], write: Callable[[Any], object]) -> None:
    """Write beside the target, then take its place in one step.

    Parameters
    ----------
    path : str or os.PathLike
        Replaced if it exists; of a link, what it leads to.
    write : callable
        Called with the binary stream to write to.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    target = Path(os.path.realpath(path))
    beside = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    if not target.parent.is_dir():
        # Else errors would name the file beside it, of which who saves knows nothing.
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(path))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    try:
        stream = beside.open("xb")
    except OSError as error:
        error.filename = os.fspath(path)
        raise
    try:
        with stream:
            write(stream)
        if target.exists():
            shutil.copymode(target, beside)
        beside.replace(target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
