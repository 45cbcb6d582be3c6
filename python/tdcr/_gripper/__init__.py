"""Robots that close around an object."""

# Registered with the room: files hold its results.
from tdcr._gripper import codecs as codecs
