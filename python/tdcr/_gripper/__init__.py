"""Robots that close around an object."""
