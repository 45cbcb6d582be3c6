"""Copies of results, from pickles too: equal to the bit, and as read-only as the results are."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from saved_results import RESULTS, SHAPES, workspace

import tdcr
from tdcr._base.value import Value

# Named tuples are not compared whole: their arrays have no one answer.
TUPLES = {
    "reach": lambda: workspace().reach,
    "dexterity": lambda: workspace().dexterity(0.05),
    "manipulability": lambda: tdcr.manipulability(np.stack([np.eye(6), np.ones((6, 6))])),
    "arcs": lambda: tdcr.constant_curvature.arc_from_displacements(
        np.full((3, 2), -0.001), [0.0, 2.0], 0.01, 0.1
    ),
}
COPIES = {
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    "deep": copy.deepcopy,
    "shallow": copy.copy,
}


def arrays(value, name=""):
    """Arrays of a result, by where they are."""
    if isinstance(value, np.ndarray):
        return {name: value}
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, (list, tuple)):
        items = enumerate(value)
    elif isinstance(value, tdcr.Shape):
        items = ((field, getattr(value, field)) for field in ("frames", "tensions", "strains"))
    else:
        items = vars(value).items() if isinstance(value, (Value, tdcr.ShapeBatch)) else ()
    found = {}
    for key, item in items:
        found |= arrays(item, f"{name}.{key}")
    return found


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize("name", [*RESULTS, *TUPLES])
def test_copies_are_what_they_are_of(name, way):
    result = (RESULTS | TUPLES)[name]()
    twin = COPIES[way](result)
    assert type(twin) is type(result)
    if name in RESULTS:
        assert twin == result
        assert hash(twin) == hash(result)
    mine, theirs = arrays(result), arrays(twin)
    assert mine
    assert mine.keys() == theirs.keys()
    for place, array in mine.items():
        other = theirs[place]
        assert (other.dtype, other.shape) == (array.dtype, array.shape), place
        if array.dtype == object:
            assert other.tolist() == array.tolist(), place
        else:
            assert other.tobytes() == array.tobytes(), place
        assert not array.flags.writeable, place
        assert not other.flags.writeable, place


def test_a_copied_batch_is_solved_like_the_batch():
    batch = RESULTS["warm batch"]()
    assert COPIES["pickle"](batch)[3] == batch[3]
    assert COPIES["deep"](SHAPES["rod"]()).require().ok
