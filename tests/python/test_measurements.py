"""Measured tables: which columns are read, in which unit and sign, and what is refused."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import tdcr
from tdcr import design

DATA = Path(__file__).parents[2] / "examples" / "data" / "three_segment_v4_train.csv"
TABLE = """\
# two tendons, a marker at the tip
time,d_left_mm,d_right_mm,tip_x_mm,tip_y_mm,tip_z_mm
0.0,0,-0.1,1.5,-25.333,200
0.1,10.001,free,2,3,4
0.2,,1,2,3,4

0.3,1,2,-nan,3,4
0.4,-9.9,-10,5,6,7

"""


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(TABLE)
    return path


def read(path, **options):
    return tdcr.read_measurements(path, **{"unit": "mm", "pull_sign": "positive"} | options)


def test_a_table_is_read_in_metres_with_negative_pulls(path):
    found = read(path)
    pulls = [[0.0, 0.0001], [-0.010001, math.inf], [0.0099, 0.010]]
    assert found.displacements.tolist() == pulls
    assert math.copysign(1, found.displacements[0, 0]) == 1
    assert found.positions.tolist() == [
        [0.0015, -0.025333, 0.2],
        [0.002, 0.003, 0.004],
        [0.005, 0.006, 0.007],
    ]
    assert found.lines.tolist() == [3, 4, 8]
    assert found.dropped == 2  # The empty line is no row.
    assert len(found) == 3
    assert found.displacement_columns == ("d_left_mm", "d_right_mm")
    assert found.position_columns == ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    assert "3 rows, 2 dropped: 2 displacements (d_left_mm, d_right_mm), 1 point" in repr(found)


def test_the_sign_and_slack_are_as_they_are_said_to_be(path):
    assert read(path, pull_sign="negative").displacements[1].tolist() == [0.010001, math.inf]
    assert read(path, free_from=9.9).displacements[2].tolist() == [math.inf, math.inf]
    assert read(path, free_from=9.95).displacements[2].tolist() == [0.0099, math.inf]


def test_columns_may_be_named_in_any_order(path):
    found = read(
        path,
        displacements=["d_right_mm", "d_left_mm"],
        positions=["tip_z_mm", "tip_x_mm", "tip_y_mm"],
    )
    assert found.displacements[1].tolist() == [math.inf, -0.010001]
    assert found.positions[1].tolist() == [0.004, 0.002, 0.003]


def test_measurements_are_values(path):
    found = read(path)
    assert found == read(path)
    assert hash(found) == hash(read(path))
    assert found != read(path, free_from=9.9)
    copy = pickle.loads(pickle.dumps(found))
    assert copy == found
    for array in (copy.positions, found.displacements):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


HEADERS = {
    "dl1,dl2,x,y,z": (("dl1", "dl2"), ("x", "y", "z")),
    "Displacement A [mm];Pull B [mm];Tip X [mm];Tip Y [mm];Tip Z [mm]": (
        ("Displacement A [mm]", "Pull B [mm]"),
        ("Tip X [mm]", "Tip Y [mm]", "Tip Z [mm]"),
    ),
    "tendon1\ttendon1_tension\ttendon2\tz (mm)\ty (mm)\tx (mm)": (
        ("tendon1", "tendon2"),
        ("x (mm)", "y (mm)", "z (mm)"),
    ),
    "d1,p2_x,p2_y,p2_z,p10_x,p10_y,p10_z,p1_x,p1_y,p1_z": (
        ("d1",),
        tuple(f"p{i}_{axis}" for i in (1, 2, 10) for axis in "xyz"),
    ),
}


@pytest.mark.parametrize("header", HEADERS)
def test_columns_are_found_by_the_rule(header, tmp_path):
    count = len([c for c in header if c in ",;\t"]) + 1
    between = next(c for c in ";\t," if c in header)
    path = tmp_path / "t.csv"
    path.write_text("\ufeff" + header + "\n" + between.join(map(str, range(count))) + "\n")
    found = read(path)
    assert (found.displacement_columns, found.position_columns) == HEADERS[header]
    if len(found.position_columns) > 3:
        assert found.positions.shape == (1, 3, 3)
        assert found.positions[0, :, 0].tolist() == [0.007, 0.001, 0.004]


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("m", 25.333), ("cm", 0.25333), ("mm", 0.025333), ("um", 2.5333e-5), ("in", 0.6434582)],
)
def test_units_are_exact(unit, metres, tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("d1,x,y,z\n25.333,0,0,25.333\n")
    found = read(path, unit=unit)
    assert (found.displacements[0, 0], found.positions[0, 2]) == (-metres, metres)


@pytest.mark.parametrize(
    ("options", "argument", "text"),
    [
        ({"unit": "m"}, "unit", "column 'd_left_mm' says 'mm', got 'm'"),
        ({"unit": "foot"}, "unit", 'expected one of "m", "cm", "mm", "um", "in", got \'foot\''),
        ({"pull_sign": "+"}, "pull_sign", 'expected "positive" or "negative", got \'+\''),
        ({"free_from": -1}, "free_from", "expected a positive length"),
        ({"displacements": ["d_left"]}, "displacements", "got 'd_left'"),
        ({"displacements": []}, "displacements", "expected columns, got none"),
        ({"positions": ["tip_x_mm", "tip_y_mm"]}, "positions", "got 2 of them"),
        ({"positions": ["tip_x_mm"] * 3}, "positions", "once each"),
        ({"displacements": ["tip_x_mm"]}, "positions", "of displacements, got 'tip_x_mm' in both"),
    ],
)
def test_wrong_options_are_refused(path, options, argument, text):
    with pytest.raises(tdcr.InvalidInput) as error:
        read(path, **options)
    assert text in str(error.value)
    assert error.value.argument == argument


def test_unit_and_sign_have_no_default(path):
    with pytest.raises(TypeError, match="unit"):
        tdcr.read_measurements(path, pull_sign="positive")
    with pytest.raises(TypeError, match="pull_sign"):
        tdcr.read_measurements(path, unit="mm")
    with pytest.raises(TypeError, match="names of columns"):
        read(path, displacements="d_left_mm")
    with pytest.raises(TypeError, match="unit: expected the name of a unit, got list"):
        read(path, unit=["mm"])


WRONG = {
    b"": "expected a line with names of columns",
    b"1,2,3\n4,5,6\n": "expected names of columns in the first line, got '1,2,3'",
    b"d1,x,y,z\n": "expected rows below the names",
    b"d1,x,x,z\n1,2,3,4\n": "got 'x' twice",
    b"\xff\xfe\x00": "byte 0 is not UTF-8",
    b"a,x,y,z\n1,2,3,4\n": "expected columns that start with d, dl",
    b"d1,x,y\n1,2,3\n": "expected columns x, y and z of one point",
    b"d1,a_x,a_y,a_z,b_x,b_y,b_z\n1,2,3,4,5,6,7\n": "got those of 'a', 'b'",
    b"d1,x,y,z\n1,2,3,4\n1,2,three,4\n": "line 3, column 'y': expected a number [mm], got 'three'",
    b"d1,x,y,z\n1,2,3,1e999\n": "column 'z': expected a number [mm], got '1e999'",
    b"d1,x,y,z\n-inf,2,3,4\n": "column 'd1': expected a number, inf or free [mm], got '-inf'",
    b"d1;x;y;z\n1,5;2;3;4\n": "got '1,5'; decimals have a point",
    b"d1,x,y,z\n1_0,2,3,4\n": "expected a number, inf or free [mm], got '1_0'",
    b"d1,x,y,z\n1,2,3,4,\n1,2,3,4,5\n": "line 3: expected 4 cells, as many as names of columns",
    b"# d1,x,y,z\n1,2,3,4\n": "got '1,2,3,4'; lines that start with # are comments",
    b'd1,x,y,z,note\n1,2,3,4,ok\n1,2,3,4,"five\n1,2,3,4,ok\n': "line 3: expected cells as of a CSV",
    b"d1,x,y,z\n,2,3,4\n1,2\n": "expected a row without gaps, got none in 2",
}


@pytest.mark.parametrize("content", WRONG)
def test_what_is_no_table_says_where(content, tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    with pytest.raises(tdcr.InvalidInput) as error:
        read(path)
    assert str(error.value).startswith(f"{path}: ")
    assert WRONG[content] in str(error.value)


def test_lines_are_those_of_an_editor(tmp_path):
    """Quoted cells over two lines, blank lines, comments, a form feed; with any line ends."""
    lines = [
        "",
        "# of the bench",
        '"d1 [mm]",x,y,"z',
        ' [mm]",note',
        "-1,2,3,4,quiet\x0c",
        "   ",
        '-1,2,3,5,"two',
        'lines"',
        "  # aside",
        '"-1",2,3,6,',
    ]
    path = tmp_path / "t.csv"
    for end in ("\n", "\r\n", "\r"):
        path.write_bytes(end.join(lines).encode("utf-8-sig"))
        found = read(path, pull_sign="negative")
        assert found.positions[:, 2].tolist() == [0.004, 0.005, 0.006]
        assert found.lines.tolist() == [5, 7, 10]
        assert found.position_columns == ("x", "y", "z [mm]")
        assert found.dropped == 0


def test_micrometres_are_written_in_three_ways(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("d1 [um],x [\u00b5m],y ( \u03bcm ),z_\u00b5m\n-1,2,3,4\n", "utf-8")
    assert read(path, unit="um", pull_sign="negative").positions.tolist() == [[2e-6, 3e-6, 4e-6]]
    with pytest.raises(tdcr.InvalidInput, match=r"unit: column 'd1 \[um\]' says 'um', got 'mm'"):
        read(path)


@pytest.mark.parametrize(("cells", "sign"), [("1,0", "negative"), ("-1,free", "positive")])
def test_releases_alone_are_told(cells, sign, tmp_path):
    path = tmp_path / "t.csv"
    path.write_text(f"d1,d2,x,y,z\n0,0,1,2,3\n{cells},1,2,3\n")
    with pytest.warns(RuntimeWarning, match=rf"t\.csv: no row pulls .* if pulls are {sign}: is it"):
        read(path, pull_sign=sign)
    path.write_text("d1,d2,x,y,z\n0,0,1,2,3\nfree,0,1,2,3\n")
    assert read(path, pull_sign=sign).displacements[1].tolist() == [math.inf, 0.0]


def test_a_missing_file_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError, match="gone"):
        read(tmp_path / "gone.csv")


def test_the_measured_robot_is_read_as_by_hand():
    found = read(DATA, free_from=9.9)
    rows = np.genfromtxt(DATA, delimiter=",", skip_header=1, usecols=range(3, 15))
    pulls = np.where(rows[:, :9] <= -9.9, np.inf, -rows[:, :9] / 1e3)
    assert found.displacements.shape == (1620, 9)
    assert found.dropped == 0
    assert np.allclose(found.displacements, pulls, rtol=0, atol=1e-17)
    assert np.allclose(found.positions, rows[:, 9:] / 1e3, rtol=0, atol=1e-16)


def test_fit_takes_measurements(tmp_path):
    robot = tdcr.Robot(tdcr.Backbone(0.2, 5), [tdcr.Tendon(a, 0.01) for a in (0.0, 2.1, 4.2)])
    rng = np.random.default_rng(2)
    pulls = np.where(rng.random((40, 3)) < 0.5, np.inf, -rng.uniform(0.001, 0.01, (40, 3)))
    used = pulls * 1.1
    batch = tdcr.forward_batch(robot, used, model="constant_curvature", fields=("positions",))
    table = np.hstack([-pulls, batch.positions[:, -1]])
    lines = [",".join(map(str, row)).replace("-inf", "free") for row in table.tolist()]
    (tmp_path / "m.csv").write_text("\n".join(["d0,d1,d2,x,y,z", *lines]))
    measured = read(tmp_path / "m.csv", unit="m")
    options = {"model": "constant_curvature", "validation": 0.0}
    found = design.fit(robot, measured, ["gain"], **options)
    assert found.parameters["gain"] == pytest.approx([1.1] * 3, abs=1e-6)
    by_hand = design.fit(
        robot, measured.positions, ["gain"], displacements=measured.displacements, **options
    )
    assert found == by_hand
    with pytest.raises(tdcr.InvalidInput, match="displacements: expected none with Measurements"):
        design.fit(robot, measured, ["gain"], displacements=pulls)
    with pytest.raises(TypeError, match="displacements: expected an array, or Measurements"):
        design.fit(robot, measured.positions, ["gain"])
