"""The commands that design and fit, as a person runs them."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from command_line import arm, facts, picture, points, run, save_arm

import tdcr
from tdcr import design
from tdcr._cli import main


@pytest.fixture
def robot(tmp_path, monkeypatch):
    return save_arm(tmp_path, monkeypatch)


def shape_places(tmp_path, unit=" [mm]", scale=1e3):
    bent = tdcr.Robot(
        tdcr.Backbone(0.1, 6, rest=np.tile([0.0, 0.1, 0.0], (6, 1))), [tdcr.Tendon(math.pi, 0.008)]
    )
    tdcr.Robot(tdcr.Backbone(0.1, 6), bent.tendons, name="finger").save("finger.toml")
    places = tdcr.forward(bent, [-0.003]).positions
    return points(tmp_path / "shape.csv", places, unit, scale), places


def test_prebend_writes_the_robot_that_takes_the_shape(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    target, places = shape_places(tmp_path)
    command = ["design", "prebend", "finger.toml", target, "--pull", "-3", "--unit", "mm"]
    out, _ = run(capsys, *command, "-o", "bent.toml", "--plot", "bent.png")
    assert facts(out)["status"] == ["converged"]
    designed = tdcr.Robot.load("bent.toml")
    assert np.allclose(tdcr.forward(designed, [-0.003]).positions, places, atol=1e-9)
    picture(tmp_path / "bent.png")
    data = json.loads(run(capsys, *command, "--json")[0])
    assert data["status"] == "converged"
    assert max(data["error"]) < 1e-9
    run(capsys, *command, "--json", "found.json")
    found = design.Prebend.load("found.json")
    assert (found.robot, found.shape) == (designed, tdcr.forward(designed, [-0.003]))
    assert found.error.tolist() == data["error"]


def test_prebend_of_a_curve(robot, tmp_path, capsys):
    shape_places(tmp_path)
    turn = np.linspace(0, 1.5, 40)[:, None]
    circle = 0.1 * np.hstack([1 - np.cos(turn), 0 * turn, np.sin(turn)])
    target = points(tmp_path / "curve.csv", circle)
    command = ["design", "prebend", "finger.toml", target, "--pull", "-0.003"]
    _, err = run(capsys, *command, code=2)
    assert "expected places of disks 1 to 6, or of disks 0 to 6, got 40 rows; add --curve" in err
    out, _ = run(capsys, *command, "--curve", "-o", "bent.json")
    assert facts(out)["status"] == ["converged"]
    tip = tdcr.forward(tdcr.Robot.load("bent.json"), [-0.003]).positions[-1]
    assert np.linalg.norm(tip - [0.1, 0, 0]) == pytest.approx(0.1, abs=1e-6)


def test_routing_writes_holes_and_says_pulls(robot, tmp_path, capsys):
    routed = tdcr.Tendon.from_holes([0, 1, 1, 2, 2], 6, 0.008, name="wound")
    known = tdcr.Robot(tdcr.Backbone(0.1, 4), [routed])
    tdcr.Robot(tdcr.Backbone(0.1, 4), [tdcr.Tendon(0.0, 0.008, name="wound")]).save("plain.toml")
    target = points(tmp_path / "shape.csv", tdcr.forward(known, [-0.004]).positions)
    command = ["design", "routing", "plain.toml", target, "--holes", "6", "--bounds", "-0.02", "0"]
    out, _ = run(capsys, *command, "-o", "routed.toml")
    assert facts(out)["optimality"] == ["reached"]
    assert facts(out)["wound"] == ["0 1 1 2 2"]
    assert tdcr.Robot.load("routed.toml").tendons[0].indices == (0, 1, 1, 2, 2)
    data = json.loads(run(capsys, *command, "--json")[0])
    assert data["displacements"] == pytest.approx([-0.004], abs=1e-8)
    assert data["holes"] == [[0, 1, 1, 2, 2]]
    run(capsys, *command, "--json", "found.json")
    found = design.Routing.load("found.json")
    assert (found.holes, found.robot) == (((0, 1, 1, 2, 2),), tdcr.Robot.load("routed.toml"))
    assert found.settings == tdcr.RoutingSettings(holes=6)
    assert found.shape == tdcr.forward(found.robot, found.displacements)


@pytest.fixture
def measured(robot, tmp_path):
    """Table of pulls and tips of an arm with gains, in mm, pulls positive."""
    rng = np.random.default_rng(2)
    pulls = np.where(rng.random((40, 3)) < 0.5, np.inf, -rng.uniform(0.001, 0.01, (40, 3)))
    tips = tdcr.forward_batch(arm(), pulls * 1.1, model="constant_curvature").tip[:, :3, 3]
    lines = [
        ",".join("free" if math.isinf(x) else repr(float(x)) for x in row)
        for row in np.hstack([-pulls, tips]) * 1e3
    ]
    header = "d_front,d_left,d_right,tip_x,tip_y,tip_z"
    (tmp_path / "m.csv").write_text("\n".join([header, *lines, "1,,,2,3,4"]) + "\n")
    return ["fit", robot, "m.csv", "--unit", "mm", "--pull-sign", "positive"]


def test_fit_prints_parameters_and_writes_the_robot(measured, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    options = ["--parameters", "gain,base", "--model", "constant_curvature"]
    out, _ = run(capsys, *measured, *options, "-o", "fitted.toml", "--plot", "fit.png")
    table = facts(out)
    assert table["rows"] == ["40, 8 of them held out; 1 dropped for gaps"]
    assert float(table["gain left"][0]) == pytest.approx(1.1, abs=1e-5)
    assert table["left"] == ["d_left"]
    picture(tmp_path / "fit.png")
    fitted = tdcr.Robot.load("fitted.toml")
    found = tdcr.read_measurements("m.csv", unit="mm", pull_sign="positive")
    by_hand = design.fit(arm(), found, ["gain", "base"], model="constant_curvature")
    assert fitted == by_hand.robot
    data = json.loads(run(capsys, *measured, *options, "--json")[0])
    assert data["parameters"]["gain"] == by_hand.parameters["gain"].tolist()
    assert data["rms_validation"] == by_hand.rms()
    assert data["dropped"] == 1
    run(capsys, *measured, *options, "--json", "fit.json")
    loaded = design.Fit.load("fit.json")
    assert loaded.dropped == 1  # Of the file; those of the fit were without gaps.
    assert replace(loaded, dropped=0) == by_hand


def test_the_picture_of_a_fit_of_few_rows_shows_every_step(measured):
    pytest.importorskip("matplotlib")
    found = tdcr.read_measurements("m.csv", unit="mm", pull_sign="positive")
    fitted = design.fit(arm(), found, ["gain"], model="constant_curvature", validation=0.05)
    for line, before in zip(fitted.plot().lines, (True, False), strict=True):
        steps = line.get_xydata()
        assert steps[0].tolist() == [0.0, 0.0]
        assert steps[1:, 0] == pytest.approx(np.sort(fitted.distances(before=before)) * 1e3)
        assert steps[1:, 1] == pytest.approx([0.5, 1.0])


def test_fit_names_columns(measured, capsys):
    columns = ["--displacement-columns", "d_front,d_left,d_right"]
    columns += ["--position-columns", "tip_x,tip_y,tip_z", "--parameters", "gain"]
    out, _ = run(capsys, *measured, *columns, "--model", "constant_curvature")
    assert "gain front" in out


def test_fit_wants_a_column_for_every_tendon(measured, capsys):
    columns = ["--displacement-columns", "d_front,d_left", "--parameters", "gain"]
    _, err = run(capsys, *measured, *columns, code=2)
    expected = (
        "m.csv: expected a column of displacements for each of the tendons front, left, right"
    )
    assert f"{expected}, got d_front, d_left" in err


def test_fit_refuses_pulls_of_the_other_sign(measured, tmp_path, capsys):
    table = tmp_path / "m.csv"
    head, *rows = [line for line in table.read_text().splitlines() if not line.startswith("1,")]
    table.write_text("\n".join([head, *rows[:20]]))
    measured[measured.index("positive")] = "negative"
    _, err = run(capsys, *measured, "--parameters", "gain", code=2)
    assert err.endswith("m.csv: expected a pull, got releases alone: try --pull-sign positive\n")


def test_fit_warns_of_pulls_that_release_alone(measured, tmp_path, capsys):
    table = tmp_path / "m.csv"
    head, *rows = [line for line in table.read_text().splitlines() if not line.startswith("1,")]
    table.write_text("\n".join([head, *rows[:20]]))
    measured[measured.index("positive")] = "negative"
    main([*measured, "--parameters", "gain", "--model", "constant_curvature"])
    _, err = capsys.readouterr()
    assert err.startswith("tdcr: warning: m.csv: no row pulls a tendon if pulls are negative")


@pytest.mark.filterwarnings("always")
def test_warnings_are_lines(robot, tmp_path, capsys):
    shape_places(tmp_path)
    aside = np.linspace(0, 0.1, 40)[:, None] * [math.sin(0.3), 0.0, math.cos(0.3)]
    target = points(tmp_path / "curve.csv", aside)
    main(["design", "prebend", "finger.toml", target, "--pull", "-0.003", "--curve"])
    _, err = capsys.readouterr()
    line = err.splitlines()[0]
    assert line.startswith("tdcr: warning: the curve leaves the base 17.2 deg off its z axis")
    assert "RuntimeWarning" not in err


@pytest.mark.parametrize("missing", ["--unit", "--pull-sign"])
def test_fit_has_no_default_for_unit_and_sign(measured, missing, capsys):
    at = measured.index(missing)
    command = measured[:at] + measured[at + 2 :]
    _, err = run(capsys, *command, "--parameters", "gain", code=2)
    assert f"Missing option '{missing}'" in err
