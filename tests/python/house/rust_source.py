"""Tokens, functions and paths of Rust source: strings, comments and literals are told apart."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass
from functools import cache, cached_property

PATTERN = re.compile(
    r"""
    (?P<space>\s+)
  | (?P<doc>//[/!](?!/)[^\n]*|////*$)
  | (?P<comment>//[^\n]*)
  | (?P<block>/\*)
  | (?P<raw>(?:b|c)?r(?P<hashes>\#*)")
  | (?P<string>(?:b|c)?"(?:\\.|[^"\\])*")
  | (?P<char>b?'(?:\\(?:x[0-9a-fA-F]{2}|u\{[^}]*\}|.)|[^\\'\n])')
  | (?P<lifetime>'[A-Za-z_]\w*)
  | (?P<number>\d[\w]*(?:\.\d[\w]*)?(?:(?<=[eE])[+-]\d+)?)
  | (?P<word>(?:r\#)?[A-Za-z_]\w*)
  | (?P<punct>::|->|=>|.)
    """,
    re.VERBOSE | re.DOTALL,
)
MODIFIERS = {"pub", "const", "unsafe", "async", "extern", "default"}


@dataclass(frozen=True)
class Token:
    """Piece of source: its kind, text, first and last line."""

    kind: str
    text: str
    line: int
    end: int


@dataclass(frozen=True)
class Function:
    """Function with a body: its lines run from `fn` to the closing brace."""

    name: str
    line: int
    end: int
    documented: bool
    tested: bool
    comments: int

    @property
    def length(self) -> int:
        """Number of lines."""
        return self.end - self.line + 1


def tokenize(text: str) -> list[Token]:
    """Tokens of a source, comments among them, blanks not."""
    starts = [0, *(m.end() for m in re.finditer(r"\n", text))]
    tokens, at = [], 0
    while at < len(text):
        match = PATTERN.match(text, at)
        assert match is not None
        kind, end = match.lastgroup, match.end()
        if match["block"]:
            kind, end = block_comment(text, at)
        elif match["raw"]:
            kind = "string"
            closing = '"' + match["hashes"]
            end = text.index(closing, end) + len(closing)
        if kind != "space":
            first, last = bisect_right(starts, at), bisect_right(starts, max(at, end - 1))
            tokens.append(Token(str(kind), text[at:end], first, last))
        at = end
    return tokens


def block_comment(text: str, at: int) -> tuple[str, int]:
    """Kind and end of a block comment, which may hold others."""
    depth, end = 0, at
    for mark in re.finditer(r"/\*|\*/", text[at:]):
        depth += 1 if mark.group() == "/*" else -1
        end = at + mark.end()
        if depth == 0:
            break
    is_doc = re.match(r"/\*[*!][^*/]", text[at:]) is not None
    return ("doc" if is_doc else "comment"), end


class RustSource:
    """One Rust file, read once."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.all_tokens = tokenize(text)
        self.tokens = [t for t in self.all_tokens if t.kind not in ("comment", "doc")]

    @cached_property
    def partners(self) -> dict[int, int]:
        """Index of the closing bracket by that of the opening one, among the tokens of code."""
        pairs, open_at = {}, []
        for i, token in enumerate(self.tokens):
            if token.kind != "punct":
                continue
            if token.text in "([{":
                open_at.append(i)
            elif token.text in ")]}" and open_at:
                pairs[open_at.pop()] = i
        return pairs

    @cached_property
    def test_lines(self) -> set[int]:
        """Lines of items below `#[cfg(test)]` or `#[test]`."""
        lines: set[int] = set()
        for i, token in enumerate(self.tokens[:-2]):
            if token.text != "#" or self.tokens[i + 1].text != "[":
                continue
            close = self.partners[i + 1]
            words = [t.text for t in self.tokens[i + 2 : close]]
            if words != ["test"] and words != ["cfg", "(", "test", ")"]:
                continue
            end = close + 1
            while self.tokens[end].text not in ("{", ";"):
                end = self.partners.get(end, end) + 1
            end = self.partners.get(end, end)
            lines.update(range(token.line, self.tokens[end].end + 1))
        return lines

    @cached_property
    def code_lines(self) -> set[int]:
        """Lines with code, without comments, docs, blanks and tests."""
        lines = {n for t in self.tokens for n in range(t.line, t.end + 1)}
        return lines - self.test_lines

    @cached_property
    def comment_lines(self) -> set[int]:
        """Lines with a comment that is no doc comment."""
        return {n for t in self.all_tokens if t.kind == "comment" for n in range(t.line, t.end + 1)}

    @cached_property
    def prose_lines(self) -> set[int]:
        """Lines with a comment or a doc comment."""
        words = (t for t in self.all_tokens if t.kind in ("comment", "doc"))
        return {n for t in words for n in range(t.line, t.end + 1)}

    @cached_property
    def docs(self) -> list[tuple[int, str]]:
        """First line of every doc comment, and its line number."""
        found, before = [], None
        for token in self.all_tokens:
            if token.kind == "doc":
                mark = token.text[:3]
                if before is None or (before.end + 1, before.text[:3]) != (token.line, mark):
                    found.append((token.line, token.text[3:].strip()))
                before = token
            else:
                before = None
        return found

    @cached_property
    def declared(self) -> list[tuple[str, str, int]]:
        """Keyword, name and line of every function, type, constant and module."""
        keywords = {"fn", "struct", "enum", "trait", "type", "const", "static", "mod"}
        pairs = zip(self.tokens, self.tokens[1:], strict=False)
        return [
            (a.text, b.text, b.line) for a, b in pairs if a.text in keywords and b.kind == "word"
        ]

    @cached_property
    def named(self) -> list[tuple[str, str, int]]:
        """What `declared` lists, and every field, parameter and `let` binding."""
        found = list(self.declared)
        for before, token, after in zip(
            self.tokens, self.tokens[1:], self.tokens[2:], strict=False
        ):
            is_bound = before.text in ("let", "mut") or after.text == ":"
            if token.kind == "word" and token.text != "mut" and is_bound:
                found.append(("name", token.text, token.line))
        return found

    @cached_property
    def functions(self) -> list[Function]:
        """Every function with a body, in the order of the source."""
        places = {id(t): k for k, t in enumerate(self.all_tokens)}
        found = []
        for i, token in enumerate(self.tokens[:-1]):
            if token.text != "fn" or self.tokens[i + 1].kind != "word":
                continue
            brace = i + 2
            while brace < len(self.tokens) and self.tokens[brace].text not in ("{", ";"):
                brace = self.partners.get(brace, brace) + 1
            if brace >= len(self.tokens) or self.tokens[brace].text == ";":
                continue
            end = self.tokens[self.partners[brace]].line
            comments = sum(token.line <= n <= end for n in self.comment_lines)
            found.append(
                Function(
                    name=self.tokens[i + 1].text,
                    line=token.line,
                    end=end,
                    documented=self.has_doc(places[id(token)]),
                    tested=token.line in self.test_lines,
                    comments=comments,
                )
            )
        return found

    def has_doc(self, at: int) -> bool:
        """Presence of a doc comment above the item at a token, past modifiers and attributes."""
        depth = 0
        for token in reversed(self.all_tokens[:at]):
            if token.text in (")", "]"):
                depth += 1
            elif token.text in ("(", "["):
                depth -= 1
            elif depth == 0 and token.kind == "doc":
                return True
            elif depth == 0 and not (
                token.text in MODIFIERS or token.text == "#" or token.kind in ("string", "comment")
            ):
                return False
        return False


@cache
def rust_source(text: str) -> RustSource:
    """Source of a text, read once however often it is asked for."""
    return RustSource(text)
