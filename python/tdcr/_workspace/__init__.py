"""Where a tip gets: samples, reach, volumes, manipulability."""
