"""The scripts of `examples/` as modules, for the tests that ask them for more than pictures."""

import importlib.util
import sys
from contextlib import contextmanager
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@contextmanager
def example_script(name):
    """Import `examples/{name}.py`, where its dataclasses find their module, and forget it after."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
        yield module
    finally:
        del sys.modules[name]
