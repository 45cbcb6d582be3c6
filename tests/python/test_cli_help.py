"""The examples of every ``--help`` run as they stand, and the files they read are the guide's."""

from __future__ import annotations

import re
import shlex
from importlib import resources
from pathlib import Path

import pytest
from command_line import run

import tdcr
from tdcr._cli import main

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "commands.md"
COMMANDS = [
    ["forward"], ["inverse"], ["track"], ["workspace"], ["design"], ["design", "prebend"],
    ["design", "routing"], ["fit"], ["plot"], ["demo"], ["schema"], [],
]  # fmt: skip


def examples(capsys, command):
    """Commands of the help's examples, as they are typed."""
    out, _ = run(capsys, *command, "--help")
    _, found, text = out.partition("\n  Example")
    assert found
    return [shlex.split(line)[1:] for line in re.findall(r"^ +(tdcr .*)$", text, re.MULTILINE)]


def test_every_command_has_its_examples_tried(capsys):
    out, _ = run(capsys, "--help")
    listed = re.findall(r"^  (\w+)  ", out.partition("Commands:")[2], re.MULTILINE)
    assert set(listed) == {command[0] for command in COMMANDS if command}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command) or "tdcr")
def test_the_examples_of_a_help_run(command, tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    run(capsys, "demo", "--files", ".")
    before = set(tmp_path.iterdir())
    found = examples(capsys, command)
    assert found
    for example in found:
        assert example[: len(command)] == command
        run(capsys, *example)
        for place, word in enumerate(example):
            if word in ("--output", "--animate", "--plot"):
                assert Path(example[place + 1]).exists()
    written = sum(word in ("--output", "--animate") for example in found for word in example)
    assert len(set(tmp_path.iterdir()) - before) == written


def test_an_option_names_its_unit(capsys):
    for command in COMMANDS[:-2]:
        out, _ = run(capsys, *command, "--help")
        for option in re.split(r"\n  (?=-)", out.partition("Options:")[2]):
            if re.match(r".*(NUMBERS|LOW HIGH|X Y Z|RANGES|LENGTH)\b", option):
                assert "--unit" in option, option


def test_the_files_of_the_examples_are_those_of_the_guide():
    blocks = dict(
        re.findall(r'^```\w+ title="(\w+\.\w+)"\n(.*?)^```$', GUIDE.read_text(), re.S | re.M)
    )
    folder = resources.files("tdcr") / "_cli" / "examples"
    assert {name: (folder / name).read_text() for name in blocks} == blocks
    assert len(blocks) == 6


def test_files_of_the_examples_replace_no_others(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("trunk.toml").write_text("mine")
    _, err = run(capsys, "demo", "--files", ".", code=2)
    assert err.startswith("tdcr: error: trunk.toml: expected no such file")
    assert [path.name for path in tmp_path.iterdir()] == ["trunk.toml"]
    out, _ = run(capsys, "demo", "--files", "new/folder")
    names = sorted(path.name for path in Path("new/folder").iterdir())
    assert [line.rpartition("/")[2] for line in out.splitlines()] == names
    assert run(capsys, "demo", "--files", "new/folder")[0] == out
    for name in names:
        if name.endswith(".toml") and name != "bar.toml":
            tdcr.Robot.load(f"new/folder/{name}")


def test_pictures_of_the_demo_are_refused_before_it_runs(tmp_path, monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["demo", "--output", str(tmp_path / "pictures")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "pip install tdcr[plot]" in err
