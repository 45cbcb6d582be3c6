"""What every room may use: checks of arguments, values, statuses, progress, rotations."""
