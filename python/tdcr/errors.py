"""Exceptions of tdcr.

A solve that does not converge is no exception: it is a result with a status. These are for misuse,
and for those who ask for an exception with ``result.require()``.
"""

from __future__ import annotations

from typing import Any

__all__ = ["InvalidInput", "NotConverged", "TdcrError"]


class TdcrError(Exception):
    """Base of all exceptions that tdcr raises itself."""


class InvalidInput(TdcrError, ValueError):
    """An argument or a file that cannot be used.

    Attributes
    ----------
    argument : str
        What could not be used, as the caller named it, for instance ``"tendons[2].radius"``.
    """

    def __init__(self, message: str, argument: str) -> None:
        super().__init__(message)
        self.argument = argument

    def __reduce__(self) -> tuple[type[InvalidInput], tuple[str, str]]:
        """Pickle through the constructor."""
        return type(self), (str(self), self.argument)


class NotConverged(TdcrError):
    """A result was required to have converged and has not.

    Attributes
    ----------
    result : Any
        The result with its last iterate, status and message.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result

    def __reduce__(self) -> tuple[type[NotConverged], tuple[str, Any]]:
        """Pickle through the constructor."""
        return type(self), (str(self), self.result)
