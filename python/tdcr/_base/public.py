"""Public homes of classes that private modules define."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["set_home"]


def set_home(package: str, members: Iterable[object]) -> None:
    """Name the package as the module of its classes, so that pickles and reprs outlive moved files.

    Classes of public modules and compiled ones have theirs already.
    """
    for member in members:
        home = getattr(member, "__module__", None)
        private = isinstance(home, str) and home.startswith(f"{package}.") and home != "tdcr.errors"
        if isinstance(member, type) and private:
            member.__module__ = package
