"""Many forward solves: batches, sweeps into files, derivatives."""

# Registered with the room: files hold its results.
from tdcr._forward import codecs as codecs
