"""``--obstacles FILE``: what is in the way of the commands that solve."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from command_line import PULL, arm, points, run, save_arm

import tdcr

TEXT = """
format = 1
length_unit = "mm"
[[obstacles]]
type = "Cylinder"
point = [25, 0, 110]
axis = [0, 1, 0]
radius = 10
[[obstacles]]
type = "Box"
center = [0, 200.5, 0]
half_extents = [10, 10, 10]
"""
AROUND = (
    tdcr.Cylinder([0.025, 0, 0.11], [0, 1, 0], 0.01),
    tdcr.Box([0, 0.2005, 0], [0.01, 0.01, 0.01]),
)


@pytest.fixture
def robot(tmp_path, monkeypatch):
    file = save_arm(tmp_path, monkeypatch)
    (tmp_path / "around.toml").write_text(TEXT)
    return file


def test_forward_leans_on_what_is_in_the_way(robot, capsys):
    expected = tdcr.forward(arm(), PULL, obstacles=AROUND)
    assert expected.contacts
    command = ["forward", robot, "-d", "-10", "free", "free", "--unit", "mm"]
    out, _ = run(capsys, *command, "--obstacles", "around.toml", "-o", "s.npz", "--json", "s.json")
    shape = tdcr.Shape.load("s.npz")
    assert shape.obstacles == AROUND
    assert shape == expected
    rows = out.partition("\ncontact")[2].splitlines()[1:]
    assert [row.split()[:2] for row in rows] == [["disk", str(c.disk)] for c in shape.contacts]
    for row, contact in zip(rows, shape.contacts, strict=True):
        assert [float(x) for x in row.split()[-4:-1]] == pytest.approx(
            (contact.point * 1e3).tolist(), abs=1e-3
        )
        assert float(row.split()[-1]) == pytest.approx(np.linalg.norm(contact.force), rel=1e-5)
    for saved in ("s.npz", "s.json"):
        assert run(capsys, *command, "--obstacles", saved)[0] == out
    out, _ = run(capsys, "forward", robot, "-d", "0 0 0", "--obstacles", "around.toml")
    assert out.rstrip().endswith("none")


def test_inverse_track_and_workspace_take_obstacles(robot, tmp_path, capsys):
    around = ["--obstacles", "around.toml"]
    place = [-0.03, 0.0, 0.196]
    words = [repr(x) for x in place]
    out, _ = run(capsys, "inverse", robot, "--position", *words, *around, "-o", "i.npz", code=1)
    assert tdcr.Inverse.load("i.npz") == tdcr.inverse(arm(), place, obstacles=AROUND)
    assert "\ncontact" in out
    path = points(tmp_path / "path.csv", [[0, 0, 0.2], [0, 0, 0.2]])
    run(capsys, "track", robot, path, *around, "-o", "t.npz")
    assert tdcr.InverseBatch.load("t.npz").obstacles == AROUND
    grid = ["--ranges", "-10:0 free free", "--unit", "mm", "--samples", "5", "--sampling", "grid"]
    run(capsys, "workspace", robot, *grid, *around, "-o", "w.npz")
    limits = [(-0.01, 0), (math.inf,) * 2, (math.inf,) * 2]
    expected = tdcr.workspace(arm(), limits, 5, sampling="grid", obstacles=AROUND)
    assert tdcr.Workspace.load("w.npz") == expected


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("format = 1", "", "format: expected 1, got None"),
        ("format = 1", "format = 2", "format: expected 1, got 2"),
        ('"mm"', '"cm"', "length_unit: expected 'm' or 'mm', got 'cm'"),
        (
            "length_unit",
            "unit",
            "unit: unknown key; expected one of format, length_unit",
        ),
        ("[[obstacles]]", "[[things]]", "expected a list of tables 'obstacles'"),
        ("Cylinder", "Tube", "obstacles[0]: type: expected one of Sphere, Cylinder"),
        ("radius", "raduis", "obstacles[0]: Cylinder: "),
        ("radius = 10", "radius = -10", "obstacles[0]: radius: expected"),
        ("radius = 10", "radius = '10'", "obstacles[0]: "),
        ("axis = [0, 1, 0]", "axis = [0, 0, 0]", "obstacles[0]: axis: expected"),
        ("radius = 10", "radius = nan", "obstacles[0]: radius: expected"),
    ],
)
def test_a_bad_file_of_obstacles_is_one_line(old, new, text, robot, tmp_path, capsys):
    (tmp_path / "bad.toml").write_text(TEXT.replace(old, new))
    command = ["forward", robot, "-d", "0 0 0", "--obstacles"]
    _, err = run(capsys, *command, "bad.toml", code=2)
    assert err.startswith(f"tdcr: error: bad.toml: {text}")


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("none.toml", "none.toml: No such file or directory"),
        ("arm.toml", "arm.toml: expected a list of tables 'obstacles'"),
        ("arm.csv", "obstacles: expected a file of obstacles ending in .toml, .json or .npz"),
        ("list.json", "list.json: expected a list of tables 'obstacles'"),
    ],
)
def test_other_files_are_no_obstacles(file, text, robot, tmp_path, capsys):
    (tmp_path / "list.json").write_text(json.dumps([1, 2]))
    _, err = run(capsys, "forward", robot, "-d", "0 0 0", "--obstacles", file, code=2)
    assert err.startswith(f"tdcr: error: {text}")
