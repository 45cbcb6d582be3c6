"""Functions, docstrings and imports of Python source."""

from __future__ import annotations

import ast
import io
import tokenize
from functools import cache, cached_property

from .rust_source import Function

DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
BLANK = {tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


class PythonSource:
    """One Python file, read once; what it offers is as `RustSource` does."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tree = ast.parse(text)
        self.nodes = list(ast.walk(self.tree))

    @cached_property
    def lazy_nodes(self) -> set[ast.AST]:
        """Nodes inside functions, and those for type checkers only."""
        found: set[ast.AST] = set()
        for node in self.nodes:
            is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            is_typing = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
            if (is_function or is_typing) and node not in found:
                found.update(ast.walk(node))
        return found

    @cached_property
    def doc_nodes(self) -> list[ast.Constant]:
        """Docstrings: the first statement of what has one, and those below attributes."""
        found = []
        for node in self.nodes:
            if isinstance(node, DOCUMENTED) and node.body:
                for k, statement in enumerate(node.body):
                    is_text = isinstance(statement, ast.Expr) and isinstance(
                        statement.value, ast.Constant
                    )
                    below = k > 0 and isinstance(node.body[k - 1], ast.Assign | ast.AnnAssign)
                    if is_text and isinstance(statement.value.value, str) and (k == 0 or below):
                        found.append(statement.value)
        return sorted(found, key=lambda value: value.lineno)

    @cached_property
    def docs(self) -> list[tuple[int, str]]:
        """First line of every docstring, and its line number."""
        return [(v.lineno, (v.value.strip().splitlines() or [""])[0]) for v in self.doc_nodes]

    @cached_property
    def doc_lines(self) -> set[int]:
        """Lines of docstrings."""
        return {n for v in self.doc_nodes for n in range(v.lineno, v.end_lineno + 1)}

    @cached_property
    def comment_lines(self) -> set[int]:
        """Lines with a comment."""
        stream = tokenize.generate_tokens(io.StringIO(self.text).readline)
        return {t.start[0] for t in stream if t.type == tokenize.COMMENT}

    @cached_property
    def prose_lines(self) -> set[int]:
        """Lines with a comment or a docstring."""
        return self.comment_lines | self.doc_lines

    @cached_property
    def code_lines(self) -> set[int]:
        """Lines with code, without comments, docstrings and blanks."""
        lines: set[int] = set()
        for token in tokenize.generate_tokens(io.StringIO(self.text).readline):
            if token.type not in BLANK and token.type != tokenize.COMMENT:
                lines.update(range(token.start[0], token.end[0] + 1))
        return lines - self.doc_lines

    @cached_property
    def declared(self) -> list[tuple[str, str, int]]:
        """Keyword, name and line of every function and class."""
        found = []
        for node in self.nodes:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                found.append(("fn", node.name, node.lineno))
            elif isinstance(node, ast.ClassDef):
                found.append(("struct", node.name, node.lineno))
        return found

    @cached_property
    def functions(self) -> list[Function]:
        """Every function, from `def` to its last line."""
        return [
            Function(
                name=node.name,
                line=node.lineno,
                end=node.end_lineno,
                documented=ast.get_docstring(node) is not None,
                tested=False,
                comments=sum(node.lineno <= n <= node.end_lineno for n in self.comment_lines),
            )
            for node in self.nodes
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        ]


@cache
def python_source(text: str) -> PythonSource:
    """Source of a text, read once however often it is asked for."""
    return PythonSource(text)
