"""What the commands say to files, numbers and options that cannot be used."""

from __future__ import annotations

import errno
import io
import json
import math
import os
import re
from pathlib import Path

import pytest
from command_line import PULL, arm, run, save_arm

import tdcr
from tdcr._cli import main


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
    (["inverse", "--position", "1", "2"], "'--position': expected 3 numbers, got 2"),
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
    (["workspace", "--ranges", "-1:0", "--samples", "0"], "samples: expected 1 or more, got 0"),
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
    "pulls",
    [
        ["-d", "-10 free free"],
        ["-d", "-10,free,free"],
        ["-d", "-10", "free", "free"],
        ["-d", "-10,", "free,", "inf"],
        ["--pull=-10", "free", "free"],
        ["--displacements=-10,free,free"],
    ],
    ids=" ".join,
)
def test_numbers_are_typed_with_quotes_commas_or_neither(pulls, robot, capsys):
    expected = run(capsys, "forward", robot, "-d", "-0.01 inf inf", "--json")
    assert run(capsys, "forward", robot, *pulls, "--unit", "mm", "--json") == expected
    assert run(capsys, "forward", *pulls, robot, "--unit", "mm", "--json") == expected


def test_positions_and_bounds_are_typed_in_the_same_ways(robot, capsys):
    rest = ["--unit", "mm", "--model", "constant_curvature", "--json"]

    def out(*words):
        return run(capsys, "inverse", *words, *rest, code=1)[0]

    expected = out(robot, "--position", "-40", "10", "180", "--bounds", "-20", "20")
    assert json.loads(expected)["target"] == [-0.04, 0.01, 0.18]
    assert out(robot, "--position", "-40,10,180", "--bounds", "-20,20") == expected
    assert out(robot, "--position", "-40 10 180", "--bounds", "-20 20") == expected
    assert out("--position=-40,10,180", "--bounds=-20,20", robot) == expected


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (["forwrd"], "No such command 'forwrd'; did you mean 'forward'? (see tdcr --help)"),
        (["Plot"], "No such command 'Plot'; did you mean 'plot'? (see tdcr --help)"),
        (
            ["design", "bend"],
            "No such command 'bend'; did you mean 'prebend'? (see tdcr design --help)",
        ),
        (["forward"], "Missing argument 'ROBOT'. (see tdcr forward --help)"),
        (["inverse", "arm.toml"], "or --pose (see tdcr inverse --help)"),
        (["plot", "arm.toml"], "or both (see tdcr plot --help)"),
        (["forward", "arm.toml", "-d", "-10mm free free"], "'-10mm'; its unit is said by --unit"),
        (
            ["forward", "arm.toml", "-d", "x", "free"],
            "finite numbers, inf or free, got 'x'",
        ),
        (["inverse", "arm.toml", "--position", "1", "2", "3", "4"], "expected 3 numbers, got 4"),
        (["inverse", "arm.toml", "--position", "1m", "2", "3"], "numbers, got '1m'; its unit is"),
        (["inverse", "arm.toml", "--position", "a,b,c"], "'--position': expected numbers, got 'a'"),
        (["inverse", "arm.toml", "--bounds", "-5"], "'--bounds': expected 2 numbers, got 1"),
    ],
)
def test_what_was_mistyped_is_told(command, text, robot, capsys):
    _, err = run(capsys, *command, code=2)
    assert text in err


LOST = "; {} m is much for a robot of 0.2 m: add --unit mm if mm are meant\n"


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (["forward", "arm.toml", "-d", "-10", "free", "free"], LOST.format("10")),
        (["plot", "arm.toml", "-o", "p.png", "--pull", "-10", "free", "free"], LOST.format("10")),
        (["inverse", "arm.toml", "--position", "60", "0", "0"], LOST.format("59.8")),
        (["track", "arm.toml", "path.csv", "--unit", "m"], LOST.format("59.8")),
        (
            ["workspace", "arm.toml", "--ranges", "-10:-9 free free", "--samples", "4"],
            LOST.format("10"),
        ),
    ],
    ids=lambda words: words[0],
)
def test_millimetres_that_were_taken_for_metres_are_told(command, text, robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    (tmp_path / "path.csv").write_text("x,y,z\n60,0,0\n")
    more = ["--sampling", "random"] if command[0] == "workspace" else []
    _, err = run(capsys, *command, *more, code=1)
    assert re.sub(r"(59\.8)\d*", r"\1", err).endswith(text)
    in_mm = ["--unit", "mm"] if command[0] != "track" else []
    main([*command[: command.index("--unit")]] if not in_mm else [*command, *more, *in_mm])
    assert "is much for" not in capsys.readouterr().err


def test_a_key_that_is_spelt_wrong_is_told_before_the_one_that_is_missing(robot, tmp_path, capsys):
    text = (tmp_path / robot).read_text()
    (tmp_path / "bad.toml").write_text(text.replace("azimuth", "azimut", 1))
    _, err = run(capsys, "forward", "bad.toml", "-d", "0 0 0", code=2)
    wrong = "tendons[0].azimut: unknown key; did you mean 'azimuth'? (and 1 more fault)"
    assert err == f"tdcr: error: bad.toml: {wrong}\n"


def test_no_pickle_is_advised_to_be_trusted(robot, tmp_path, capsys):
    (tmp_path / "bad.npz").write_bytes(bytes(range(256)))
    _, err = run(capsys, "plot", "bad.npz", "-o", "p.png", code=2)
    assert err.startswith("tdcr: error: bad.npz: not an npz file")
    assert "pickle" not in err


def test_options_without_use_are_refused(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    tdcr.workspace(arm(), [(-0.01, 0.0)] + [(math.inf,) * 2] * 2, 8, sampling="grid").save("w.npz")
    tdcr.forward(arm(), PULL).save("s.npz")
    for arguments, text in (
        (["w.npz", "--row", "0"], "--row: expected a batch or a track, got Workspace"),
        (["s.npz", "--model", "rod"], "--model: expected a robot file, got a Shape"),
        (["s.npz", "--frames", "3"], "--frames: expected --animate FILE too"),
        ([robot, "--frames", "3"], "--frames: expected --animate FILE too"),
        (["s.npz", "--unit", "mm"], "--unit: expected --pull too"),
    ):
        _, err = run(capsys, "plot", *arguments, "-o", "p.png", code=2)
        assert text in err


OUTPUTS = [
    ["forward", "arm.toml", "-d", "0 0 0", "--json"],
    ["forward", "arm.toml", "-d", "0 0 0", "--output"],
    ["forward", "arm.toml", "-d", "0 0 0", "--plot"],
    ["schema", "--output"],
    ["plot", "arm.toml", "--output"],
    ["plot", "arm.toml", "--pull", "0 0 0", "--animate"],
    ["demo", "--files"],
]


@pytest.mark.parametrize("command", OUTPUTS, ids=" ".join)
def test_what_is_kept_from_being_written_stays(command, robot, tmp_path, capsys, monkeypatch):
    """A root user may write anything, so the question is answered for it."""
    pytest.importorskip("matplotlib")
    ending = {"--output": "json", "--animate": "gif"}.get(command[-1], "png")
    name = "p.png" if command[0] == "plot" and ending == "json" else f"kept.{ending}"
    name = "trunk.toml" if command[0] == "demo" else name
    Path(name).write_text("kept")
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: str(path) != name and allowed(path, mode))
    where = "." if command[0] == "demo" else name
    _, err = run(capsys, *command, where, code=2)
    said = "expected no such file, or" if command[0] == "demo" else "Permission denied"
    assert err.startswith(f"tdcr: error: {name}: {said}")
    assert Path(name).read_text() == "kept"


@pytest.mark.parametrize(
    "command",
    [
        ["forward", "FILE.toml", "-d", "0"],
        ["inverse", "arm.toml", "--pose", "FILE.txt"],
        ["track", "arm.toml", "FILE.csv"],
        ["design", "prebend", "arm.toml", "FILE.csv", "-d", "0 0 0"],
        ["fit", "arm.toml", "FILE.csv", "--unit", "mm", "--pull-sign", "positive",
         "--parameters", "gain"],
        ["plot", "FILE.json", "-o", "p.png"],
        ["plot", "FILE.npz", "-o", "p.png"],
    ],
    ids=lambda command: command[0],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["none", "folder", "unreadable", "empty", "binary"])
def test_files_that_cannot_be_read_are_one_line(
    kind, command, robot, tmp_path, capsys, monkeypatch
):
    pytest.importorskip("matplotlib")
    name = next(word for word in command if word.startswith("FILE"))
    path = tmp_path / name
    if kind == "folder":
        path.mkdir()
    elif kind != "none":
        path.write_bytes({"empty": b"", "binary": b"\x00\xff\xfe" * 50}.get(kind, b"x"))
    if kind == "unreadable":
        whole = io.open

        def refuse(file, *arguments, **options):
            if str(file) == name:
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), name)
            return whole(file, *arguments, **options)

        monkeypatch.setattr(io, "open", refuse)
    _, err = run(capsys, *command, code=2)
    assert err.startswith(f"tdcr: error: {name}: ")
    said = {"none": "No such file", "folder": "Is a directory", "unreadable": "Permission denied"}
    assert said.get(kind, "") in err


FIT = ["fit", "arm.toml", "path.csv", "--unit", "mm", "--pull-sign", "positive"]
FIT += ["--parameters", "gain"]


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (["forward", "arm.toml", "-d", "0 0 0", "--json", "./arm.toml"], "--json: .* reads too"),
        (["forward", "arm.toml", "-d", "0 0 0", "-o", "s.json", "--json", "s.json"], "writes too"),
        (["plot", "s.png.json", "-o", "s.png.json"], "--output: .* which the command reads too"),
        (["plot", "arm.toml", "-d", "0 0 0", "-o", "p.gif", "--animate", "p.gif"], "writes too"),
        (["track", "arm.toml", "path.csv", "-o", "link.csv"], "--output: .* reads too"),
        (["design", "prebend", "arm.toml", "path.csv", "-d", "0 0 0", "-o", "arm.toml"], "reads"),
        (
            [*FIT, "-o", "arm.toml"],
            "--output: expected a file of its own, got arm.toml, which the command reads too",
        ),
    ],
    ids=lambda words: words[0],
)
def test_a_file_that_is_read_is_not_written_over(command, text, robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    (tmp_path / "path.csv").write_text("x [m],y [m],z [m]\n0,0,0.2\n")
    (tmp_path / "link.csv").symlink_to("path.csv")
    arm().save("s.png.json")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    _, err = run(capsys, *command, code=2)
    assert re.search(text, err)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
