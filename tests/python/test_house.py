"""The house: what its counts mean, on small sources; then its arrows and limits, on the sources."""

from functools import cache

import pytest
from house.arrows import (
    PLANS,
    arrows_against,
    circles,
    eager_imports,
    file_arrows,
    room_arrows,
)
from house.count import Part, count, read_tree, wide_prose
from house.python_source import PythonSource
from house.rust_paths import crate_arrows, read_crate
from house.rust_source import RustSource, tokenize
from house.words import is_participle

RUST = r"""//! Room.
/* block /* nested */ still a comment */
use std::fmt;

/// Sum of two.
#[must_use]
pub(crate) fn sum<const N: usize>(a: [f64; N]) -> f64 {
    // A comment.
    let text = "// no comment, \" no end";
    let raw = r#"fn none() { " }"#; let brace = '{'; let life: &'static str = "";
    a[0] /* and this */ + 1.0e-3
}

#[cfg(test)]
mod tests {
    fn told() {}
}
"""


def test_the_tokenizer_tells_strings_comments_and_characters_apart():
    kinds = {t.text: t.kind for t in tokenize(RUST)}
    assert kinds['"// no comment, \\" no end"'] == "string"
    assert kinds['r#"fn none() { " }"#'] == "string"
    assert kinds["'{'"] == "char"
    assert kinds["'static"] == "lifetime"
    assert kinds["/* block /* nested */ still a comment */"] == "comment"
    assert kinds["1.0e-3"] == "number"


def test_a_function_of_rust_has_its_lines_its_comments_and_its_doc():
    source = RustSource(RUST)
    first, tested = source.functions
    assert (first.name, first.length, first.comments, first.documented) == ("sum", 6, 2, True)
    assert tested.tested
    assert source.code_lines == {3, 6, 7, 9, 10, 11, 12}
    assert [text for _, text in source.docs] == ["Room.", "Sum of two."]


def test_a_function_of_python_has_its_lines_its_comments_and_its_doc():
    text = '"""Room."""\n\n\ndef sum(a):\n    """What it is."""\n    # Why.\n    return a\n'
    source = PythonSource(text)
    (function,) = source.functions
    assert (function.length, function.comments, function.documented) == (4, 1, True)
    assert source.code_lines == {4, 7}
    assert source.docs == [(1, "Room."), (5, "What it is.")]


def test_arrows_lead_to_the_file_that_defines_a_name():
    tree = {
        "src/lib.rs": "pub mod a;\npub mod b;\npub use b::B;\n",
        "src/a.rs": "// crate::c::C\nfn f() { let b = crate::B::new(); }\n",
        "src/b/mod.rs": "mod inner;\npub use inner::B;\nmod other;\nfn g() { other::h() }\n",
        "src/b/inner.rs": "use super::other::{self as o, h};\npub struct B;\n",
        "src/b/other.rs": "pub fn h() {}\n#[cfg(test)]\nmod tests { use super::super::B; }\n",
    }
    assert set(crate_arrows(read_crate(tree, "src/"))) == {
        ("src/a.rs", "src/b/inner.rs"),
        ("src/b/mod.rs", "src/b/other.rs"),
        ("src/b/inner.rs", "src/b/other.rs"),
    }


def test_bare_participles_are_single_words():
    assert is_participle("told")
    assert is_participle("_checked")
    assert not is_participle("seed")
    assert not is_participle("checked_length")


def test_tables_and_code_of_a_page_are_no_prose():
    long = "word " * 30
    assert list(wide_prose(f"{long}\n| {long} |\n```\n{long}\n```\n")) == [1]


def test_a_circle_is_found_and_a_line_is_none():
    assert circles({("a", "b"), ("b", "c"), ("a", "c")}) == []
    assert circles({("a", "b"), ("b", "c"), ("c", "b"), ("d", "a")}) == [["b", "c"]]


def test_an_import_of_python_counts_wherever_it_stands():
    tree = {
        "python/tdcr/_base/value.py": "def f():\n    from tdcr._io import tables\n",
        "python/tdcr/_io/tables.py": "from tdcr._base.value import f\nfrom tdcr import _core\n",
        "python/tdcr/_forward/batch.py": "from tdcr._plot import scene\n",
        "python/tdcr/_plot/scene.py": "import tdcr._io.tables\n",
    }
    (python,) = (plan for plan in PLANS if plan.root.startswith("python"))
    assert arrows_against(tree, python) == [
        "_base -> _io: python/tdcr/_base/value.py:2 imports python/tdcr/_io/tables.py"
    ]
    assert circles(set(file_arrows(tree, python.root))) == [
        ["python/tdcr/_base/value.py", "python/tdcr/_io/tables.py"]
    ]
    assert eager_imports(tree) == [
        "python/tdcr/_forward/batch.py:1 imports python/tdcr/_plot/scene.py at the top"
    ]


# --- the sources themselves --------------------------------------------------------------------


@cache
def tree():
    return read_tree()


@cache
def parts() -> dict[str, Part]:
    return count(tree())


@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: plan.root)
def test_a_room_imports_rooms_of_lower_floors_only(plan):
    assert arrows_against(tree(), plan) == []


@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: plan.root)
def test_no_files_and_no_rooms_import_each_other_in_a_circle(plan):
    arrows = file_arrows(tree(), plan.root)
    # A list of what there is looks at all of it and is looked at for what all share.
    assert circles({(a, b) for a, b in arrows if not a.endswith("src/lib.rs")}) == []
    assert circles(room_arrows(arrows, plan)) == []


def test_pictures_are_imported_by_the_call_that_draws():
    assert eager_imports(tree()) == []


def test_long_functions_of_the_core_are_commented():
    assert parts()["core"].density >= 8


def over(what):
    """Everything of a kind, of all parts."""
    return [place for part in parts().values() for place in getattr(part, what)]


def test_functions_over_60_lines_have_docstrings():
    assert over("undocumented") == []


def test_files_end_by_line_400_but_the_stub():
    found = over("long_files")
    assert [place for place in found if not place.startswith("python/tdcr/_core.pyi")] == []


def test_names_are_those_of_the_field():
    assert over("old_words") == []


def test_functions_are_verbs_or_nouns():
    found = over("participles")
    assert len(found) < 40, found


def test_docs_open_with_the_noun_that_a_reader_searches_for():
    found = over("openings")
    assert len(found) < 40, found


def test_prose_ends_by_column_120():
    assert over("wide") == []
