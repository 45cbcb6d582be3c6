"""From targets to displacements."""

# Registered with the room: files hold its results.
from tdcr._inverse import codecs as codecs
