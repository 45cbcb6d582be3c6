"""Outcomes of solves."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["Status"]


class Status(StrEnum):
    """Outcome of a solve.

    Members are strings: ``shape.status == "converged"`` works.
    """

    converged = "converged"
    """The conditions of the model hold to the stated tolerance."""
    infeasible = "infeasible"
    """Nothing satisfies what was asked; the message says what stands in the way."""
    unreachable = "unreachable"
    """The nearest answer is given; the target itself is out of reach."""
    iteration_limit = "iteration_limit"
    """The iteration budget ran out before the tolerance was met."""
    numerical_error = "numerical_error"
    """The arithmetic broke down."""
