"""The command line: tables, JSON, exit codes, and one line for what cannot be used."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import numpy as np
import pytest

import tdcr
from tdcr._cli import main
from tdcr._core import _rotation_vector

ROBOT = """
format = 1
length_unit = "mm"
name = "arm [red]"
[backbone]
length = 200
subsegments = 10
[[tendons]]
azimuth = 0.0
radius = 10
[[tendons]]
azimuth = 3.141592653589793
radius = 10
"""


@pytest.fixture
def robot(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ROBOT)
    return str(path)


def process(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "tdcr", *arguments], capture_output=True, text=True, timeout=300
    )


def refused(capsys, *arguments):
    assert main(list(arguments)) == 2
    out, err = capsys.readouterr()
    assert err.count("\n") == 1, err
    assert err.startswith("tdcr: error: ")
    assert "Traceback" not in err
    return out, err


def test_forward_prints_the_shape(robot, capsys):
    assert main(["forward", robot, "-d", "-10, free", "--unit", "mm", "--model", "linkage"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "\x1b" not in out
    assert "arm [red]" in out
    assert "converged" in out
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line.strip()}
    assert rows["t0"] == ["-10.000", "200.000", "190.000"]
    assert rows["t1"][:2] == ["free", "200.000"]


def test_the_model_is_the_rod_if_none_is_named(robot, capsys):
    assert main(["forward", robot, "-d", "-10, free", "--unit", "mm"]) == 0
    rows = {
        line.split()[0]: line.split()[1:] for line in capsys.readouterr().out.splitlines() if line
    }
    assert rows["model"] == ["rod"]
    shape = tdcr.forward(tdcr.Robot.load(robot), [-0.01, math.inf])
    assert rows["t0"] == ["-10.000", "200.000", "190.000", f"{shape.tensions[0]:.6g}"]
    assert rows["t1"][0] == "free"
    assert rows["t1"][-1] == "0"


def test_the_table_names_the_unit_of_tensions(robot, tmp_path, capsys):
    known = tmp_path / "steel.toml"
    known.write_text(ROBOT.replace("[[ten", "youngs_modulus = 2e11\ndiameter = 1\n[[ten", 1))
    for path, unit in ((robot, "[EI/m^2]"), (str(known), "[N]")):
        assert main(["forward", path, "-d", "-0.01 inf"]) == 0
        assert f"tension {unit}" in capsys.readouterr().out


def test_json_is_the_shape_in_si(robot, capsys):
    assert main(["forward", robot, "-d", "-0.01 inf", "--model", "linkage", "--json", "-"]) == 0
    data = json.loads(capsys.readouterr().out)
    shape = tdcr.forward(tdcr.Robot.load(robot), [-0.01, math.inf], model="linkage")
    assert np.array_equal(data["frames"], shape.frames)
    assert data["displacements"] == [-0.01, "inf"]
    assert data["tensions"] == [None, None]
    assert data["status"] == "converged"


def test_files_are_written(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    files = [str(tmp_path / "s.json"), str(tmp_path / "s.png")]
    options = ["--json", files[0], "--plot", files[1]]
    assert main(["forward", robot, "-d", "-0.01,inf", "--model", "linkage", *options]) == 0
    assert json.loads((tmp_path / "s.json").read_text())["ok"] is True
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")


def test_a_solve_that_fails_prints_its_result_and_exits_1(robot):
    done = process("forward", robot, "-d", "-0.01 0", "--model", "linkage", "--json", "-")
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "infeasible"
    assert done.stderr.startswith("tdcr: arm [red]: infeasible: ")
    assert done.stderr.count("\n") == 1


BAD = [
    (["-d", "-0.01", "--model", "linkage"], "displacements: expected 2 values, one per tendon"),
    (["-d", "-0.01 nan", "--model", "linkage"], "NaN"),
    (["-d", "-0.01 -inf", "--model", "linkage"], "or free, got '-inf'"),
    (["-d", "-0.01 1e999", "--model", "linkage"], "or free, got '1e999'"),
    (["-d", "-0.01 x", "--model", "linkage"], "expected finite numbers, inf or free, got 'x'"),
    (["-d", "-0.01 inf", "--model", "spline"], 'model: expected "rod", "linkage"'),
    (["-d", "-1 inf", "--model", "linkage", "--unit", "cm"], "'cm' is not one of 'm', 'mm'"),
    (["--model", "linkage"], "--displacements"),
    (["-d", "-0.01 inf", "--model", "linkage", "--json", "/none/x"], "/none/x: No such file"),
]


@pytest.mark.parametrize(("arguments", "text"), BAD)
def test_bad_input_is_one_line(robot, capsys, arguments, text):
    _, err = refused(capsys, "forward", robot, *arguments)
    assert text in err


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("radius = 10", "radius = -10", "tendons[0].radius: expected a positive"),
        ("length = 200", "length = '200'", "backbone.length: expected a number [mm], got '200'"),
        ("length_unit", "unit", "length_unit: missing"),
        ("format = 1", "format: 1", "not a TOML file"),
    ],
)
def test_a_bad_robot_file_is_one_line(robot, tmp_path, capsys, old, new, text):
    path = tmp_path / "bad.toml"
    path.write_text(ROBOT.replace(old, new, 1))
    _, err = refused(capsys, "forward", str(path), "-d", "0 0", "--model", "linkage")
    assert f"{path}: {text}" in err


def test_of_several_faults_the_others_are_counted(tmp_path, capsys):
    path = tmp_path / "bad.toml"
    path.write_text(ROBOT.replace("radius = 10", "radius = '10'"))
    _, err = refused(capsys, "forward", str(path), "-d", "0 0", "--model", "linkage")
    assert err.endswith("(and 1 more fault)\n")


def test_real_processes_refuse_without_a_traceback(tmp_path):
    missing = str(tmp_path / "none.toml")
    done = process("forward", missing, "-d", "0", "--model", "linkage")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == f"tdcr: error: {missing}: No such file or directory\n"
    done = process("nonsense")
    assert (done.returncode, done.stderr) == (
        2,
        "tdcr: error: No such command 'nonsense'; expected demo, design, fit, forward, inverse, "
        "plot, schema, track or workspace (see tdcr --help)\n",
    )


@pytest.mark.slow
def test_the_demo_solves_the_bundled_robots(tmp_path):
    pytest.importorskip("matplotlib")
    done = process("demo", "--output", str(tmp_path / "pictures"))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("converged") == 2
    assert "elephant trunk" in done.stdout
    names = sorted(path.name for path in (tmp_path / "pictures").iterdir())
    assert names == ["elephant_trunk.png", "spatial_trunk.png"]


def test_a_demo_that_does_not_converge_exits_1(monkeypatch, capsys):
    monkeypatch.setattr(
        "tdcr._cli.commands.demo.DEMO", (("elephant_trunk", (-0.07, 0.0, 0.0, 0.0)),)
    )
    assert main(["demo"]) == 1
    out, err = capsys.readouterr()
    assert "infeasible" in out
    assert err.startswith("tdcr: elephant trunk: infeasible: ")


def test_schema_is_json(tmp_path, capsys):
    assert main(["schema"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert main(["schema", "--output", str(tmp_path / "s.json")]) == 0
    assert json.loads((tmp_path / "s.json").read_text()) == printed
    assert printed["required"] == ["format", "length_unit", "backbone", "tendons"]


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"tdcr {tdcr.__version__}\n"


def test_nothing_heavy_is_imported_before_it_is_used():
    code = (
        "import sys; from tdcr._cli import main; main(['--version'])\n"
        "print([m for m in ('pydantic', 'rich', 'matplotlib', 'tomli_w') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_rotation_vectors_up_to_half_a_turn():
    rng = np.random.default_rng(1)
    for angle in (0.0, 1e-9, 1e-3, 1.0, 3.0, math.pi - 1e-9):
        axis = rng.normal(size=3)
        w = angle * axis / np.linalg.norm(axis)
        cross = np.cross(np.eye(3), w / (angle or 1.0))
        rotation = (
            np.eye(3) + math.sin(angle) * cross + 2 * math.sin(angle / 2) ** 2 * cross @ cross
        )
        frame = np.eye(4)
        frame[:3, :3] = rotation
        assert _rotation_vector(frame) == pytest.approx(w, abs=1e-14)
