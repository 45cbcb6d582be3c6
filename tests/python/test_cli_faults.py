"""What the commands say to files, numbers and options that cannot be used."""

from __future__ import annotations

import pytest
from command_line import run, save_arm

import tdcr


@pytest.fixture
def robot(tmp_path, monkeypatch):
    return save_arm(tmp_path, monkeypatch)


MISSING = [
    ["forward", "none.toml", "-d", "0"],
    ["inverse", "none.toml", "--position", "0", "0", "1"],
    ["track", "none.toml", "path.csv"],
    ["workspace", "none.toml", "--ranges", "-1:0"],
    ["design", "prebend", "none.toml", "path.csv", "--pull", "0"],
    ["design", "routing", "none.toml", "path.csv"],
    [
        "fit",
        "none.toml",
        "m.csv",
        "--unit",
        "mm",
        "--pull-sign",
        "positive",
        "--parameters",
        "gain",
    ],
    ["plot", "none.toml", "--output", "p.pdf"],
]


@pytest.mark.parametrize("command", MISSING, ids=lambda command: command[0])
def test_a_robot_that_is_not_there_is_one_line(command, robot, capsys):
    pytest.importorskip("matplotlib")
    _, err = run(capsys, *command, code=2)
    assert err == "tdcr: error: none.toml: No such file or directory\n"


BAD = [
    (["inverse"], "expected --position X Y Z, with or without --rotation, or --pose"),
    (["inverse", "--position", "1", "2", "3", "--pose", "p.txt"], "expected --position"),
    (["inverse", "--pose", "p.txt"], "p.txt: expected four rows of four numbers"),
    (["inverse", "--pose", "none.txt"], "none.txt: No such file"),
    (["inverse", "--position", "1", "2"], "requires 3 arguments"),
    (["inverse", "--position", "nan", "2", "3"], "target: expected a finite position [m], got NaN"),
    (["inverse", "--position", "1", "2", "3", "--model", "linkage"], "model: expected"),
    (["track", "none.csv"], "none.csv: No such file"),
    (
        ["track", "p.txt", "--unit", "m"],
        "p.txt: expected columns x, y and z of one point, got none",
    ),
    (["workspace", "--ranges", "1:2:3"], "expected LOW:HIGH, a number or free, got '1:2:3'"),
    (["workspace", "--ranges", ""], "got nothing"),
    (["workspace", "--ranges", "free"], "expected a tendon that is not free"),
    (["workspace", "--ranges", "0:-1"], "ranges: expected least <= greatest"),
    (["workspace", "--ranges", "-1:0 0"], "ranges: expected shape (3, 2)"),
    (["workspace", "--ranges", "-1:0", "--samples", "0"], "samples: expected at least 1, got 0"),
    (["workspace", "--ranges", "-1:0", "--output", "w.txt"], "expected a file ending in .npz"),
    (["workspace", "--ranges", "-1:0", "--plot", "w.txt"], "expected a picture file"),
]


@pytest.mark.parametrize(("arguments", "text"), BAD)
def test_bad_input_is_one_line(arguments, text, robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    (tmp_path / "p.txt").write_text("1 2 3\nx y z\n")
    command, *rest = arguments
    _, err = run(capsys, command, robot, *rest, code=2)
    assert text in err


@pytest.mark.parametrize("option", ["--output", "--plot", "--json"])
def test_files_that_cannot_be_written_are_refused_before_the_solve(
    option, robot, tmp_path, capsys, monkeypatch
):
    def solve(*arguments, **options):
        raise AssertionError("solved")

    monkeypatch.setattr(tdcr, "workspace", solve)
    (tmp_path / "folder.npz").mkdir()
    for path, text in (
        ("none/w.npz", "No such file or directory"),
        ("folder.npz", "Is a directory"),
        (f"{robot}/w.npz", "Not a directory"),
    ):
        command = ["workspace", robot, "--ranges", "-0.001:0", option, path]
        _, err = run(capsys, *command, code=2)
        assert err == f"tdcr: error: {path}: {text}\n"


@pytest.mark.parametrize(
    "command",
    [
        ["inverse"],
        ["track"],
        ["workspace"],
        ["design"],
        ["design", "prebend"],
        ["design", "routing"],
        ["fit"],
        ["plot"],
    ],
    ids=" ".join,
)
def test_help_shows_an_example(command, capsys):
    out, _ = run(capsys, *command, "--help")
    assert "Example" in out
    assert f"tdcr {' '.join(command)} " in out
