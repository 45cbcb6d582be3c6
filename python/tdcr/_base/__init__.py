"""Checks of arguments, values, statuses, progress, rotations: every room may use them."""
