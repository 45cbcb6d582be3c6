"""Places that a tip gets to: samples, reach, volumes, manipulability."""

# Registered with the room: files hold its results.
from tdcr._workspace import codecs as codecs
