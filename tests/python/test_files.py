"""Robot files: exact round trips, and faults that say where and what."""

from __future__ import annotations

import json
import math
import os
import stat
import sys
import tomllib
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tdcr import Backbone, InvalidInput, Robot, Tendon
from tdcr._io.lengths import metres
from tdcr._io.robot_file import load_robot, robot_schema, save_robot
from tdcr._io.robot_schema import BackboneTable

GOOD = """
format = 1
length_unit = "mm"
name = "arm"
base = [[1, 0, 0, 10], [0, 1, 0, 0], [0, 0, 1, -25.333], [0, 0, 0, 1]]

[backbone]
length = [60, 62.5]
subsegments = [3, 2]
diameter = 1.5
youngs_modulus = 2.1e11
rest = [[0, 0.1, 0], [0, 0.1, 0], [0, 0.1, 0], [0, 0, 0], [0, 0, 0.2]]

[[tendons]]
azimuth = 0.5
radius = 8

[[tendons]]
routing = "helical"
azimuth = 0
radius = 7.1
turns = -0.5
name = "spiral"

[[tendons]]
routing = "holes"
indices = [0, 1, 2, 3]
count = 4
radius = [8, 7, 6, 5]
end = 3
stiffness = 1000
"""


def write(folder: Path, text: str, name: str = "robot.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(path: Path) -> InvalidInput:
    with pytest.raises(InvalidInput) as caught:
        Robot.load(path)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())
    return caught.value


def test_a_file_in_mm_is_the_robot_in_m(tmp_path):
    base = np.eye(4)
    base[:3, 3] = 0.01, 0.0, -0.025333
    expected = Robot(
        Backbone(
            [0.06, 0.0625],
            [3, 2],
            diameter=0.0015,
            youngs_modulus=2.1e11,
            rest=[[0, 0.1, 0]] * 3 + [[0, 0, 0], [0, 0, 0.2]],
        ),
        [
            Tendon(0.5, 0.008),
            Tendon.helical(0.0, 0.0071, turns=-0.5, name="spiral"),
            Tendon.from_holes([0, 1, 2, 3], 4, [0.008, 0.007, 0.006, 0.005], end=3, stiffness=1e3),
        ],
        base=base,
        name="arm",
    )
    assert Robot.load(write(tmp_path, GOOD)) == expected
    as_json = json.dumps({**tomllib.loads(GOOD), "$schema": "robot.schema.json"})
    assert load_robot(str(write(tmp_path, as_json, "robot.JSON"))) == expected


@given(st.integers(-(10**9), 10**9), st.integers(0, 6))
def test_mm_to_m_is_the_decimal_shifted(digits, places):
    assert metres(float(f"{digits}e-{places}")) == float(f"{digits}e-{places + 3}")


# --- round trips ---------------------------------------------------------------------------------

number = st.floats(-1e9, 1e9)
positive = st.floats(1e-300, 1e300)
length = st.floats(1e-15, 1e15)
name = st.none() | st.text(st.characters(exclude_categories=["Cs"]), min_size=1).filter(
    lambda text: text.strip()
)


@st.composite
def tendon(draw, n, name):
    end = draw(st.none() | st.integers(1, n))
    disks = (n if end is None else end) + 1
    many = {"min_size": disks, "max_size": disks}
    radius = draw(length | st.lists(length, **many))
    common = {"end": end, "stiffness": draw(st.none() | positive), "name": name}
    kind = draw(st.sampled_from(["angles", "helical", "holes"]))
    if kind == "angles":
        return Tendon(draw(number | st.lists(number, **many)), radius, **common)
    if kind == "helical":
        return Tendon.helical(draw(number), draw(length), turns=draw(number), **common)
    count = draw(st.integers(1, 99))
    indices = draw(st.lists(st.integers(0, count - 1), **many))
    return Tendon.from_holes(indices, count, radius, azimuth=draw(number), **common)


@st.composite
def pose(draw):
    turn, tilt = draw(st.floats(-9, 9)), draw(st.floats(-9, 9))
    about_z = [[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]]
    about_x = [[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]]
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(about_z) @ about_x
    matrix[:3, 3] = draw(st.tuples(number, number, number))
    return matrix


@st.composite
def robots(draw):
    counts = draw(st.lists(st.integers(1, 6), min_size=1, max_size=3))
    lengths = draw(st.lists(st.floats(1e-6, 1e6), min_size=len(counts), max_size=len(counts)))
    n = sum(counts)
    vectors = st.lists(st.tuples(*[st.floats(-1.8, 1.8)] * 3), min_size=n, max_size=n)
    diameter = draw(st.none() | length | st.lists(length, min_size=n, max_size=n))
    backbone = Backbone(
        lengths,
        counts,
        poisson_ratio=draw(st.just(0.35) | st.floats(-0.99, 0.5)),
        rest=draw(st.none() | vectors),
        diameter=diameter,
        youngs_modulus=None if diameter is None else draw(st.none() | positive),
        disk_radius=draw(st.none() | st.just(1e15)),
    )
    names = draw(st.lists(name, max_size=4, unique_by=lambda text: text or object()))
    names = [None if text in ("t0", "t1", "t2", "t3") else text for text in names]
    tendons = [draw(tendon(n, text)) for text in names]
    place = st.none() | pose()
    return Robot(backbone, tendons, base=draw(place), tool=draw(place), name=draw(name))


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(robots(), st.sampled_from([".toml", ".json"]))
def test_load_gives_back_what_save_wrote(tmp_path_factory, robot, ending):
    path = tmp_path_factory.getbasetemp() / f"round{ending}"
    robot.save(path)
    back = Robot.load(path)
    assert back == robot
    assert repr(back) == repr(robot)
    assert [t.routing for t in back.tendons] == [t.routing for t in robot.tendons]


def test_what_is_written_is_short_and_readable(tmp_path):
    robot = Robot(Backbone(0.2, 4, rest=np.zeros((4, 3))), [Tendon(0.0, [0.01] * 5)], name='a"b')
    robot.save(tmp_path / "r.toml")
    assert (tmp_path / "r.toml").read_text() == (
        'format = 1\nlength_unit = "m"\nname = "a\\"b"\n\n'
        "[backbone]\nlength = 0.2\nsubsegments = 4\nrest = [\n"
        + "  [0.0, 0.0, 0.0],\n"
        * 4
        + "]\n\n"
        "[[tendons]]\nazimuth = 0.0\nradius = [0.01, 0.01, 0.01, 0.01, 0.01]\n"
    )


def test_a_default_left_out_is_the_constructors():
    assert BackboneTable.model_fields["poisson_ratio"].default == Backbone(1, 1).poisson_ratio
    helical, holes = Tendon.helical(0, 1), Tendon.from_holes([0, 0], 1, 1)
    tables = {t["title"]: t["properties"] for t in robot_schema()["$defs"].values()}
    assert tables["HelicalTable"]["turns"]["default"] == helical.turns
    assert tables["HolesTable"]["azimuth"]["default"] == holes.azimuth


def test_a_save_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "r.toml"
    old = Robot(Backbone(0.2, 4), [])
    old.save(path)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="No space"):
        Robot(Backbone(0.3, 4), []).save(path)
    assert Robot.load(path) == old
    assert os.listdir(tmp_path) == ["r.toml"]


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions and links")
def test_save_keeps_permissions_and_links(tmp_path):
    path, link = tmp_path / "r.toml", tmp_path / "link.toml"
    path.write_text("")
    path.chmod(0o640)
    link.symlink_to(path)
    robot = Robot(Backbone(0.2, 4), [])
    robot.save(link)
    assert link.is_symlink()
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert Robot.load(path) == robot


# --- faults --------------------------------------------------------------------------------------

STRUCTURE = [
    ("format = 1", "format = 2", "format", "expected 1, got 2 (another version"),
    ('unit = "mm"', 'unit = "cm"', "length_unit", "expected 'm' or 'mm', got 'cm'"),
    ('length_unit = "mm"\n', "", "length_unit", "missing; expected unit of every length"),
    ("radius = 8", "raduis = 8", "tendons[0].radius", "missing; expected distance of the hole"),
    ("stiffness = 1000", "stifness = 1", "tendons[2].stifness", "did you mean 'stiffness'?"),
    ('name = "arm"', "colour = 3", "colour", "unknown key; expected one of format, length_unit"),
    ("diameter = 1.5", "diamter = 1.5", "backbone.diamter", "did you mean 'diameter'?"),
    ("radius = 7.1", "radius = 'x'", "tendons[1].radius", "expected a number [mm], got 'x'"),
    ("radius = 7.1", "radius = [1]", "tendons[1].radius", "a number [mm], got a list of 1"),
    ("azimuth = 0.5", "azimuth = true", "tendons[0].azimuth", "expected a number [rad], got true"),
    ("7, 6, 5]", "'7', 6, 5]", "tendons[2].radius[1]", "expected a number [mm], got '7'"),
    ("count = 4", "count = 4.0", "tendons[2].count", "expected an integer, got 4.0"),
    ("[3, 2]", "[3, 2.5]", "backbone.subsegments[1]", "expected an integer, got 2.5"),
    ("[0, 0, 0.2]", "[0, 0]", "backbone.rest[4]", "expected 3 values, got 2"),
    ("[0, 0, 0, 1]]", "[0, 0, 0]]", "base[3]", "expected 4 values, got 3"),
    (", [0, 0, 0, 1]]", "]", "base", "expected 4 values, got 3"),
    ('"holes"', '"spiral"', "tendons[2].routing", "'helical' or 'holes', got 'spiral'"),
    ('name = "spiral"', "name = 3", "tendons[1].name", "expected text, got 3"),
]


@pytest.mark.parametrize(("old", "new", "field", "text"), STRUCTURE)
def test_a_fault_of_structure_names_the_field(tmp_path, old, new, field, text):
    assert old in GOOD
    path = write(tmp_path, GOOD.replace(old, new, 1))
    error = refused(path)
    assert error.argument == field
    line = str(error).splitlines()[0]
    assert line.startswith(f"{path}: {field}: ")
    assert text in line


MEANING = [
    ("radius = 7.1", "radius = -7.1", "tendons[1].radius", "got -0.0071 (in the file: -7.1 mm)"),
    ("7, 6, 5]", "0, 6, 5]", "tendons[2].radius", "got 0.0 (in the file: 0 mm)"),
    ("azimuth = 0.5", "azimuth = nan", "tendons[0].azimuth", "expected a finite number [rad]"),
    ("end = 3", "end = 6", "tendons[2].indices", "7 values, one per disk 0..6, got 4"),
    ("7, 6, 5]", "7, 6]", "tendons[2].radius", "4 values, one per disk 0..3, got 3"),
    ("[60, 62.5]", "[60, -62.5]", "backbone.length", "(in the file: -62.5 mm)"),
    ("[3, 2]", "[3, 0]", "backbone.subsegments", "at least 1"),
    ("[3, 2]", f"[3, {10**30}]", "backbone.subsegments", "a whole number in range"),
    ("diameter = 1.5\n", "", "backbone.diameter", "beside Young's modulus"),
    ('"spiral"', '"t0"', "tendons[1].name", "a name of its own"),
    ('"arm"', '" "', "name", "a name that is not empty"),
    ("[[1, 0", "[[2, 0", "base", "expected a rotation"),
    ("turns", "end = 9\nturns", "tendons[1].end", "a disk from 1 to 5"),
]


@pytest.mark.parametrize(("old", "new", "field", "text"), MEANING)
def test_a_fault_of_meaning_names_the_field_of_the_file(tmp_path, old, new, field, text):
    assert old in GOOD
    path = write(tmp_path, GOOD.replace(old, new, 1))
    error = refused(path)
    assert error.argument == field
    assert str(error).startswith(f"{path}: {field}: ")
    assert text in str(error)
    assert "\n" not in str(error)


def test_every_fault_has_its_line(tmp_path):
    text = GOOD.replace("radius = 8", "radius = '8'", 1).replace("count = 4", "cuont = 4")
    lines = str(refused(write(tmp_path, text))).splitlines()
    fields = [line.split(": ")[1] for line in lines]
    assert fields == ["tendons[0].radius", "tendons[2].count", "tendons[2].cuont"]


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("r.toml", b"format = ", "not a TOML file: Invalid value"),
        ("r.json", b"{", "not a JSON file: Expecting property name"),
        ("r.json", b'{"format": 1, "format": 1}', "key 'format' is given twice"),
        ("r.json", b"[" * 100_000, "not a JSON file: nested too deeply"),
        ("r.json", b"[]", "file: expected a table, got a list of 0"),
        ("r.toml", b"\xff\xfe", "byte 0 is not UTF-8 text"),
    ],
)
def test_what_is_no_robot_file_is_refused(tmp_path, name, content, text):
    path = tmp_path / name
    path.write_bytes(content)
    assert text in str(refused(path))


def test_other_endings_are_refused(tmp_path):
    robot = Robot(Backbone(0.2, 4), [])
    for call in (lambda path: save_robot(robot, path), Robot.load):
        with pytest.raises(InvalidInput, match=r"\.toml or \.json, got 'robot\.yaml'") as caught:
            call("robot.yaml")
        assert caught.value.argument == "path"


def test_a_missing_file_stays_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        Robot.load(tmp_path / "none.toml")
    with pytest.raises(FileNotFoundError):
        Robot(Backbone(0.2, 4), []).save(tmp_path / "none" / "r.toml")


# --- schema and bundled robots -------------------------------------------------------------------


def test_the_schema_describes_every_key():
    schema = robot_schema()
    tables = [schema, *schema["$defs"].values()]
    assert len(tables) == 5
    for table in tables:
        assert table["additionalProperties"] is False
        for key, value in table["properties"].items():
            assert value.get("description"), key
    radius = schema["$defs"]["HelicalTable"]["properties"]["radius"]
    assert radius["exclusiveMinimum"] == 0
    assert "[length_unit]" in radius["description"]


@pytest.mark.parametrize("name", ["elephant_trunk", "spatial_trunk"])
def test_bundled_robots_load_and_say_what_they_are(name):
    resource = resources.files("tdcr") / "robots" / f"{name}.toml"
    with resources.as_file(resource) as path:
        robot = Robot.load(path)
    assert robot.name == name.replace("_", " ")
    assert resource.read_text(encoding="utf-8").startswith("# ")
