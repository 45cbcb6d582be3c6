"""Examples in docstrings, those of compiled functions too, and a checker of what they print."""

import ast
import doctest
import importlib
import inspect
import math
import pkgutil
import re
from itertools import chain
from pathlib import Path

import tdcr

PARSER = doctest.DocTestParser()
OPTIONS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.\d*|\.\d+)(?:e[-+]?\d+)?")


class Checker(doctest.OutputChecker):
    """Numbers with a point may differ by a unit of their last printed digit, the rest by spaces."""

    def check_output(self, want, got, optionflags):
        if super().check_output(want, got, optionflags):
            return True
        numbers = [NUMBER.findall(text) for text in (want, got)]
        rest = [NUMBER.sub("#", text) for text in (want, got)]
        return (
            len(numbers[0]) == len(numbers[1])
            and super().check_output(*rest, optionflags)
            and all(
                math.isclose(float(a), float(b), rel_tol=0.0, abs_tol=1.001 * unit(a))
                for a, b in zip(*numbers, strict=True)
            )
        )


def unit(number):
    """Worth of a number's last printed digit."""
    digits, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))


def modules():
    """Every module of the package, the compiled one among them: public ones first."""
    found = pkgutil.walk_packages(tdcr.__path__, "tdcr.")
    names = {name for _, name, _ in found if not name.endswith("__main__")} | {"tdcr._core"}
    names = sorted(names, key=lambda name: ("._" in name, name))
    return [tdcr, *(importlib.import_module(name) for name in names)]


def documented():
    """Docstrings by name: of modules, of what they define or export, of members of classes."""
    texts, seen = {}, set()
    for module in modules():
        exported = getattr(module, "__all__", ())
        texts[module.__name__] = module.__doc__
        for name, thing in vars(module).items():
            own = getattr(thing, "__module__", None) == module.__name__ or name in exported
            if not (own and callable(thing)) or id(thing) in seen:
                continue
            seen.add(id(thing))
            texts[f"{module.__name__}.{name}"] = inspect.getdoc(thing)
            if inspect.isclass(thing):
                members = {m: v for m, v in vars(thing).items() if callable(v) or described(v)}
                texts |= {f"{module.__name__}.{name}.{m}": v.__doc__ for m, v in members.items()}
    return texts | stubs()


def described(member):
    """Something of a class with a docstring of its own: a property, a class method."""
    return inspect.isdatadescriptor(member) or isinstance(member, classmethod | staticmethod)


def stubs():
    """Docstrings of the stub files, by file and line."""
    texts = {}
    for path in Path(tdcr.__file__).parent.rglob("*.pyi"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                texts[f"{path.name}:{getattr(node, 'lineno', 0)}"] = ast.get_docstring(node)
    return texts


def examples():
    """Tests by the name of what they explain."""
    return {
        name: PARSER.get_doctest(text, {}, name, name, 0)
        for name, text in documented().items()
        if text and ">>>" in text
    }


def written(root):
    """Lines of examples in the sources, Python's, the stubs' and the binding's doc comments."""
    files = chain(
        (root / "python").rglob("*.py"),
        (root / "python").rglob("*.pyi"),
        (root / "rust/py").rglob("*.rs"),
    )
    lines = (line for file in files for line in file.read_text(encoding="utf-8").splitlines())
    return [line for line in lines if re.match(r'\s*(?:///|//!|\*|r?""")?\s*>>> ', line)]
