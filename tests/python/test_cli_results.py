"""The commands that solve and save, as a person runs them: forward, inverse, track, workspace."""

from __future__ import annotations

import json
import math
import sys

import numpy as np
import pytest
from command_line import AZIMUTHS, PULL, arm, facts, picture, points, run, save_arm

import tdcr
from tdcr._cli import main


@pytest.fixture
def robot(tmp_path, monkeypatch):
    return save_arm(tmp_path, monkeypatch)


def test_forward_saves_what_load_reads(robot, tmp_path, capsys):
    command = ["forward", robot, "-d", "-10 free free", "--unit", "mm"]
    shape = tdcr.forward(tdcr.Robot.load(robot), PULL)
    for ending in ("npz", "json"):
        run(capsys, *command, "--output", f"s.{ending}")
        assert tdcr.Shape.load(f"s.{ending}") == shape
    run(capsys, *command, "-o", "s.csv")
    assert (tmp_path / "s.csv").read_text().startswith("disk,x [m],y [m],z [m]\n0,0.0,0.0,0.0\n")
    out, _ = run(capsys, *command, "--json")
    (tmp_path / "printed.json").write_text(out)
    assert tdcr.Shape.load("printed.json") == shape
    _, err = run(capsys, *command, "-o", "s.pkl", code=2)
    assert "expected a file ending in .npz, .json or .csv, got 's.pkl'" in err


def test_inverse_finds_the_pulls(robot, tmp_path, capsys):
    tip = tdcr.forward(arm(), PULL).positions[-1]
    place = [repr(float(x) * 1e3) for x in tip]
    command = ["inverse", robot, "--position", *place, "--unit", "mm"]
    out, _ = run(capsys, *command, "-o", "i.npz")
    table = facts(out)
    assert table["robot"] == ["arm [red]"]
    assert table["status"] == ["converged"]
    assert table["front"][0] == "-10.000"
    answer = tdcr.Inverse.load("i.npz")
    assert answer.displacements[0] == pytest.approx(-0.01, abs=1e-9)
    out, _ = run(capsys, *command, "--json")
    (tmp_path / "i.json").write_text(out)
    assert tdcr.Inverse.load("i.json") == answer


def test_inverse_takes_rotations_and_poses(robot, tmp_path, capsys):
    tip = tdcr.forward(arm(), [-0.01, 0.002, 0.008], model="constant_curvature").tip
    turn = np.degrees(tdcr._core._rotation_vector(tip))
    place = [repr(float(x)) for x in tip[:3, 3]]
    rotation = [repr(float(x)) for x in turn]
    model = ["--model", "constant_curvature"]
    out, _ = run(
        capsys, "inverse", robot, "--position", *place, "--rotation", *rotation, *model, "--json"
    )
    data = json.loads(out)
    assert data["displacements"] == pytest.approx([-0.01, 0.002, 0.008], abs=1e-9)
    pose = tip.copy()
    pose[:3, 3] *= 1e3
    np.savetxt(tmp_path / "pose.csv", pose, delimiter=", ", fmt="%.17g")
    out, _ = run(capsys, "inverse", robot, "--pose", "pose.csv", "--unit", "mm", *model)
    assert facts(out)["front"][0] == "-10.000"
    assert "angle to the target [deg]" in out


def test_a_target_out_of_reach_prints_the_nearest_and_exits_1(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    command = ["inverse", robot, "--position", "0.3", "0.1", "0.2", "--plot", "far.png"]
    out, err = run(capsys, *command, code=1)
    assert facts(out)["status"] == ["unreachable"]
    assert err.startswith("tdcr: arm [red]: unreachable: ")
    picture(tmp_path / "far.png")


def test_bounds_hold_in_the_unit_that_is_given(robot, capsys):
    tip = tdcr.forward(arm(), PULL).positions[-1]
    place = [repr(float(x) * 1e3) for x in tip]
    command = ["inverse", robot, "--position", *place, "--unit", "mm", "--bounds", "-5", "5"]
    out, _ = run(capsys, *command, "--json", code=1)
    assert min(json.loads(out)["displacements"]) == pytest.approx(-0.005, abs=1e-9)


CIRCLE = np.linspace(0, 2 * math.pi, 24)[:, None] + np.array([AZIMUTHS])


def path_places():
    """Places of a tip that goes round."""
    rows = -0.008 * np.cos(CIRCLE)
    batch = tdcr.forward_batch(arm(), rows, model="constant_curvature", fields=("positions",))
    return batch.positions[:, -1]


def test_track_follows_a_path(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    path = points(tmp_path / "path.csv", path_places(), " [mm]", 1e3)
    command = ["track", robot, path, "--model", "constant_curvature"]
    out, _ = run(capsys, *command, "-o", "pulls.csv", "--plot", "path.png")
    table = facts(out)
    assert table["points met"] == ["24 of 24"]
    assert table["front"][0] == "-8.000"
    header, *rows = (tmp_path / "pulls.csv").read_text().splitlines()
    at = header.split(",").index("displacement front [m]")
    pulls = [float(row.split(",")[at]) for row in rows]
    assert pulls == pytest.approx((-0.008 * np.cos(CIRCLE[:, 0])).tolist(), abs=1e-7)
    picture(tmp_path / "path.png")
    out, _ = run(capsys, *command, "--json", "-o", "t.npz")
    (tmp_path / "t.json").write_text(out)
    assert tdcr.InverseBatch.load("t.json") == tdcr.InverseBatch.load("t.npz")
    # A table that track wrote is read again: its targets are no single point, so they are named.
    _, err = run(capsys, "track", robot, "pulls.csv", "--unit", "mm", code=2)
    assert "says 'm', got 'mm'" in err


def test_track_goes_between_points_in_steps(robot, tmp_path, capsys):
    corners = path_places()[[0, 6, 12]]
    path = points(tmp_path / "path.csv", corners, " [mm]", 1e3)
    command = ["track", robot, path, "--model", "constant_curvature", "--step", "2.5"]
    run(capsys, *command, "-o", "t.npz", code=1)  # Inside the surface where the arm's tip goes.
    wanted = tdcr.cartesian_path(corners, 0.0025)
    assert np.allclose(tdcr.InverseBatch.load("t.npz").targets, wanted, rtol=0, atol=1e-15)
    _, err = run(capsys, *command[:-1], "0", code=2)
    assert "step: expected a positive finite number [m], got 0.0" in err


def test_rows_of_a_path_that_are_missed_are_counted(robot, tmp_path, capsys):
    places = np.vstack([path_places()[:3], [[1.0, 1.0, 1.0]]])
    path = points(tmp_path / "path.csv", places)
    out, err = run(capsys, "track", robot, path, "--model", "constant_curvature", code=1)
    assert err == "tdcr: 1 of 4 rows did not converge: 1 unreachable\n"
    assert facts(out)["points met"] == ["3 of 4"]
    assert facts(out)["3"][0] == "unreachable"


def test_a_path_without_a_unit_asks_for_one(robot, tmp_path, capsys):
    path = points(tmp_path / "path.csv", path_places(), "")
    _, err = run(capsys, "track", robot, path, code=2)
    assert "expected a unit: name the columns 'x [mm]', or add --unit mm" in err
    run(capsys, "track", robot, path, "--unit", "m", "--model", "constant_curvature")
    path = points(tmp_path / "path.csv", path_places(), " [cm]", 100)
    _, err = run(capsys, "track", robot, path, code=2)
    assert "unit: expected columns in m or mm, got 'cm'" in err


WORKSPACE = ["--ranges", "-10:0 -5 free", "--unit", "mm", "--samples", "50", "--sampling", "grid"]


def test_workspace_tells_reach_and_saves_samples(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    command = ["workspace", robot, *WORKSPACE]
    out, _ = run(capsys, *command, "-o", "w.npz", "--plot", "w.png")
    table = facts(out)
    cloud = tdcr.Workspace.load("w.npz")
    limits = [(-0.01, 0), (-0.005, -0.005), (math.inf, math.inf)]
    assert cloud == tdcr.workspace(arm(), limits, 50, sampling="grid")
    assert table["rows"] == ["50 (grid)"]
    assert float(table["farthest [mm]"][0]) == pytest.approx(cloud.reach.farthest * 1e3, abs=1e-3)
    picture(tmp_path / "w.png")
    out, _ = run(capsys, *command, "--json")
    data = json.loads(out)
    assert data["counts"] == {"converged": 50}
    assert data["farthest"] == cloud.reach.farthest
    run(capsys, *command, "--view", "3d", "--plot", "w3.png", "-o", "w.csv")
    picture(tmp_path / "w3.png")


def test_parquet_is_asked_for_before_the_solve(robot, tmp_path, capsys, monkeypatch):
    command = ["workspace", robot, *WORKSPACE, "--output", "w.parquet"]
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "pyarrow", None)
        out, err = run(capsys, *command, code=2)
    assert out == ""
    assert "pip install tdcr[parquet]" in err
    pytest.importorskip("pyarrow")
    run(capsys, *command)
    assert len(tdcr.Workspace.load("w.parquet")) == 50


def test_a_workspace_of_which_nothing_converges(robot, tmp_path, capsys):
    command = ["workspace", robot, "--ranges", "-0.02:-0.01", "--samples", "8"]
    out, err = run(capsys, *command, "--sampling", "random", code=1)
    assert "volume" not in out
    assert err == "tdcr: 8 of 8 rows did not converge: 8 infeasible\n"
    pytest.importorskip("matplotlib")
    command += ["--plot", "none.png", "-o", "none.npz"]
    _, err = run(capsys, *command, "--sampling", "random", code=1)
    assert err == "tdcr: 8 of 8 rows did not converge: 8 infeasible; no picture\n"
    assert not (tmp_path / "none.png").exists()
    assert len(tdcr.Workspace.load("none.npz")) == 8


def strict(text):
    """JSON as the standard has it: NaN and Infinity are none."""

    def refuse(word):
        raise AssertionError(word)

    return json.loads(text, parse_constant=refuse)


def test_json_has_what_a_script_needs(robot, tmp_path, capsys):
    forward = ["forward", robot, "-d", "-0.010", "free", "free"]
    far = ["inverse", robot, "--position", "0.3", "0.1", "0.2"]
    near = ["inverse", robot, "--position", "0", "0", "0.2"]
    path = points(tmp_path / "path.csv", path_places()[:3])
    track = ["track", robot, path, "--model", "constant_curvature"]
    places = points(tmp_path / "places.csv", tdcr.forward(arm(), PULL).positions)
    prebend = ["design", "prebend", robot, places, "-d", "-0.010", "free", "free"]
    always = {"format", "kind", "tdcr", "status", "ok", "robot", "displacements"}
    for command, code, more in (
        (forward, 0, {"frames", "positions", "tip", "residual", "units", "tendon_names"}),
        (near, 0, {"frames", "positions", "tip", "error", "units", "tendon_names"}),
        (far, 1, {"frames", "positions", "tip", "error", "message", "units", "tendon_names"}),
        (track, 0, {"error", "targets", "units", "tendon_names"}),
        (prebend, 0, {"frames", "positions", "error", "message", "units", "tendon_names"}),
    ):
        data = strict(run(capsys, *command, "--json", code=code)[0])
        assert always | more <= data.keys(), command
        assert np.all(data["ok"]) == (code == 0)
        if "frames" in more:
            assert np.array_equal(np.array(data["frames"])[:, :3, 3], data["positions"])
            assert len(data["tendon_names"]) == len(data["displacements"]) == 3


@pytest.mark.slow
def test_what_a_command_writes_the_next_one_reads(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    place = ["0.05", "0", "0.18", "--model", "constant_curvature"]
    run(capsys, "inverse", robot, "--position", *place, "--json", "i.json", "-o", "i.npz", code=1)
    path = points(tmp_path / "path.csv", path_places()[:3])
    run(capsys, "track", robot, path, "--model", "constant_curvature", "--json", "t.json")
    ranges = ["--ranges", "-0.01:0 free free", "--samples", "20", "--sampling", "grid"]
    run(capsys, "workspace", robot, *ranges, "-o", "w.json")
    for file, *row in (("i.json",), ("i.npz",), ("t.json", "--row", "2"), ("w.json",)):
        main(["plot", file, *row, "-o", "p.png"])
        picture(tmp_path / "p.png")
        (tmp_path / "p.png").unlink()
    capsys.readouterr()
    data = strict(run(capsys, "forward", robot, "-d", "0 0 0", "--json")[0])
    (tmp_path / "again.json").write_text(json.dumps(data["robot"]))
    assert tdcr.Robot.load("again.json") == arm()
