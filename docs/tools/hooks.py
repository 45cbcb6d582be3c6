"""What the site needs beyond Markdown: formulas, and the files that live outside of docs/.

Formulas become MathML while the site is built: no script, no font and no network when it is read.
`examples/` is served beside the pages, so that figures and scripts are kept once.
"""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
SERVED = ("examples/*.py", "examples/figures/*.png", "examples/figures/*.csv")
# Bars in the code of a table are escaped for other readers of Markdown; here they are taken bare.
TABLE_CODE = re.compile(r"^\|.*`.*$", re.MULTILINE)
CODE = re.compile(r"`[^`]*`")
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Serve the examples and their figures, under the paths they have in the repository."""
    for pattern in SERVED:
        for path in sorted(ROOT.glob(pattern)):
            name = path.relative_to(ROOT).as_posix()
            files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, *, page: Page, **_: Any) -> str:
    """Make right here what is right in the repository: links to the examples, code in tables."""
    markdown = markdown.replace("](../examples/", "](examples/")
    return TABLE_CODE.sub(
        lambda row: CODE.sub(lambda c: c[0].replace(r"\|", "|"), row[0]), markdown
    )


def on_page_content(content: str, *, page: Page, **_: Any) -> str:
    """Replace every formula by MathML."""

    def mathml(found: re.Match[str]) -> str:
        latex = html.unescape(found[3]).strip()
        where = f"{page.file.src_uri}: formula {latex!r}"
        try:
            formula = convert(latex, display="block" if found[2] == "[" else "inline")
        except Exception as error:
            raise PluginError(f"{where}: {error!r}") from error
        # A command that is not known comes out as it went in.
        if unknown := re.search(r"(\\|&#x5c;)\w+", formula, re.IGNORECASE):
            raise PluginError(f"{where}: unknown {unknown[0]}")
        return formula

    return FORMULA.sub(mathml, content)
