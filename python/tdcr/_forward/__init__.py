"""Many forward solves: batches, sweeps into files, derivatives."""
