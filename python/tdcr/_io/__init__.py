"""Files: robots, obstacles, meshes, measured columns, results. Knows no result by name."""
