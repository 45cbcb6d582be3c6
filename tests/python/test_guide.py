"""The guide and the README: their code runs, their screens are real, the reference is complete.

The blocks of a page run in order and share names and a folder; those of the README stand alone.
A block with a file name as its title is written to that file first, `text title="prints"` is what
the block before it prints, and `console` holds commands with what they print; a command that fails
is followed by `echo $?`.
"""

import contextlib
import io
import re
import shlex
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

import tdcr

ROOT = Path(__file__).resolve().parents[2]
MODULES = ("constant_curvature", "design", "planar", "pso")
FENCE = re.compile(r"^```(\w+)(?: title=\"([^\"]+)\")?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
CODED = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if re.search(r"```(python|console)", page.read_text(encoding="utf-8"))
]


def lines(text):
    return [line.rstrip() for line in text.strip().splitlines()]


def run_commands(block):
    """Every command of a block, and what it must print."""
    code = 0
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, expected = part.split("\n", 1)
        if command == "echo $?":
            assert lines(expected) == [str(code)]
            code = 0
            continue
        assert code == 0, f"before {command}: exit code {code}, which no `echo $?` shows"
        program, *arguments = shlex.split(command)
        assert program == "tdcr"
        done = subprocess.run(
            [sys.executable, "-m", "tdcr", *arguments], capture_output=True, text=True, check=False
        )
        assert lines(done.stdout + done.stderr) == lines(expected), command
        code = done.returncode
    assert code == 0, f"exit code {code}, which no `echo $?` shows"


@pytest.mark.slow
@pytest.mark.parametrize("page", CODED, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_the_code_of_a_page_runs(page, tmp_path, monkeypatch):
    text = page.read_text(encoding="utf-8")
    fences = FENCE.findall(text)
    # None is hidden from the pattern, by indentation say.
    assert len(fences) == len(re.findall(r"^\s*```\w", text, re.MULTILINE))
    monkeypatch.chdir(tmp_path)
    names, printed = {}, None
    for language, title, block in fences:
        if title == "prints":
            assert printed is not None
            assert lines(printed) == lines(block)
        elif title:
            Path(title).write_text(block, encoding="utf-8")
        elif language == "console":
            run_commands(block)
        elif language == "python":
            if page.name == "README.md":
                names = {}
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(block, page.name, "exec"), names)
            printed = out.getvalue()


def test_the_reference_names_everything_public():
    reference = "\n".join(page.read_text() for page in (ROOT / "docs/reference").glob("*.md"))
    named = set(re.findall(r"^::: tdcr\.(\w+)$", reference, re.MULTILINE))
    # A module comes with all it exports.
    with_modules = {
        name for module in named for name in getattr(getattr(tdcr, module), "__all__", ())
    }
    assert named <= set(tdcr.__all__) <= named | with_modules


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The guide as it is read; where mkdocs is not installed `make test` builds it elsewhere."""
    pytest.importorskip("material")
    pytest.importorskip("mkdocstrings")
    folder = tmp_path_factory.mktemp("site")
    command = ["-m", "mkdocs", "build", "--quiet", "--strict", "-f", str(ROOT / "mkdocs.yml")]
    subprocess.run([sys.executable, *command, "-d", str(folder)], check=True, cwd=ROOT)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("module", ["", *MODULES])
def test_the_built_reference_has_every_public_name(site, module):
    inventory = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    documented = {line.split()[0] for line in zlib.decompress(inventory).decode().splitlines()}
    of = getattr(tdcr, module) if module else tdcr
    public = {f"{of.__name__}.{name}" for name in of.__all__}
    assert public - {f"tdcr.{name}" for name in MODULES} <= documented


@pytest.mark.slow
def test_the_site_fetches_nothing(site):
    """Links lead out of it; scripts, styles, pictures and formulas do not."""
    loads = (
        r"<(?:script|img|iframe|source)[^>]* src=\"(?:https?:)?//|<link[^>]* href=\"(?:https?:)?//"
    )
    pages = list(site.rglob("*.html"))
    assert pages
    for page in pages:
        assert not re.findall(loads, page.read_text(encoding="utf-8")), page.name
    for style in site.rglob("*.css"):
        foreign = r"(?:@import|url\()\s*[\"']?(?:https?:)?//"
        assert not re.findall(foreign, style.read_text(encoding="utf-8")), style.name


def test_statuses_are_explained():
    page = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
    explained = re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)  # with the heading
    assert set(explained) == {str(status) for status in tdcr.Status} - {"converged"} | {"status"}


def test_every_page_is_in_the_navigation():
    navigation = (ROOT / "mkdocs.yml").read_text()
    for page in (ROOT / "docs").rglob("*.md"):
        assert f" {page.relative_to(ROOT / 'docs').as_posix()}\n" in navigation
