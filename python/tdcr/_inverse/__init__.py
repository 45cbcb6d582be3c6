"""From targets to displacements."""
