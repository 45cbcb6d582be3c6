"""The installed package: docs, types, lazy imports."""

import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tdcr

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.wheel
def test_it_is_the_installed_wheel_that_is_tested():
    assert "site-packages" in tdcr.__file__
    assert (Path(tdcr.__file__).parent / "py.typed").exists()
    assert (Path(tdcr.__file__).parent / "_core.pyi").exists()
    manifest = (ROOT / "Cargo.toml").read_text()
    assert f'version = "{tdcr.__version__}"' in manifest


def test_importing_is_light():
    heavy = ("matplotlib", "pydantic", "rich", "click", "scipy", "trimesh")
    code = f"import sys, tdcr; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", tdcr.__all__)
def test_public_names_are_documented(name):
    thing = getattr(tdcr, name)
    assert len(inspect.getdoc(thing) or "") > 40
    if inspect.isclass(thing):
        for member, value in vars(thing).items():
            if not member.startswith("_") and (callable(value) or inspect.isdatadescriptor(value)):
                assert inspect.getdoc(value), f"{name}.{member}"


def test_docstrings_carry_units_shapes_and_errors():
    text = inspect.getdoc(tdcr.forward)
    for words in (
        "shape (K,)",
        "[m]",
        "Raises",
        "InvalidInput",
        "Ashwin & Ghosal",
        "Mahapatra",
        "Returns",
    ):
        assert words in text, words
    assert (
        inspect.signature(tdcr.forward).parameters["model"].kind is inspect.Parameter.KEYWORD_ONLY
    )


def test_statuses_are_those_of_the_core():
    core = (ROOT / "rust/core/src/status.rs").read_text()
    names = re.findall(r'=> "(\w+)"', core)
    assert names == [status.value for status in tdcr.Status]
