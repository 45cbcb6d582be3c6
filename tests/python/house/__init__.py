"""Counts and arrows of the repository, read from its sources alone.

`python tests/python/house` prints the counts; `test_house.py` holds them and the arrows.
"""
