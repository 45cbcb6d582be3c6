"""The house: what its counts mean, on small sources."""

from house.count import wide_prose
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
