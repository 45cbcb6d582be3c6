"""Every example in a docstring runs, whoever holds it: a module, a compiled function, a stub."""

import doctest
from pathlib import Path

import docstrings
import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = docstrings.examples()
# At least so many lines of examples, by public name.
FLOORS = {
    "tdcr": 5,
    "tdcr.Gripper": 5,
    "tdcr.cartesian_path": 2,
    "tdcr.constant_curvature": 6,
    "tdcr.design": 7,
    "tdcr.inverse": 9,
    "tdcr.planar": 9,
    "tdcr.pso": 6,
    "tdcr.sensitivity": 6,
    "tdcr.sweep": 4,
    "tdcr.workspace": 5,
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_of_a_docstring_hold(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = []
    runner = doctest.DocTestRunner(docstrings.Checker(), optionflags=docstrings.OPTIONS)
    failed, ran = runner.run(EXAMPLES[name], out=said.append)
    assert failed == 0, "".join(said)
    assert ran == len(EXAMPLES[name].examples) > 0


def test_no_example_is_lost():
    found = {name: len(test.examples) for name, test in EXAMPLES.items()}
    for name, floor in FLOORS.items():
        assert found.get(name, 0) >= floor, name
    # None stands where nobody looks: in a private function, a member, a doc comment of the binding.
    assert sum(found.values()) == len(docstrings.written(ROOT)) >= sum(FLOORS.values())


def test_numbers_may_differ_by_a_unit_of_their_last_digit_alone():
    check = docstrings.Checker().check_output
    same = doctest.NORMALIZE_WHITESPACE
    assert check("array([0.  , 1.25])\n", "array([-0.  , 1.26])\n", same)
    assert check("(2, 1.5e-3)\n", "(2, 1.6e-03)\n", same)
    for got in ("array([0.  , 1.27])", "array([0., 1.25, 2.])", "arrays([0.  , 1.25])"):
        assert not check("array([0.  , 1.25])\n", f"{got}\n", same)
    assert not check("(2, 0.5)\n", "(3, 0.5)\n", same)
