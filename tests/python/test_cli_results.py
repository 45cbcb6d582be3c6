"""The commands that solve and save, as a person runs them: inverse, track, workspace, ..., plot."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import tdcr
from tdcr import design
from tdcr._cli import main

AZIMUTHS = (0.0, 2 * math.pi / 3, -2 * math.pi / 3)
PULL = [-0.010, math.inf, math.inf]


def arm(**tendon):
    names = ("front", "left", "right")
    tendons = [
        tdcr.Tendon(a, 0.01, name=name, **tendon) for a, name in zip(AZIMUTHS, names, strict=True)
    ]
    return tdcr.Robot(tdcr.Backbone(0.2, 10, disk_radius=0.012), tendons, name="arm [red]")


@pytest.fixture
def robot(tmp_path, monkeypatch):
    """File of a robot, in the working folder."""
    monkeypatch.chdir(tmp_path)
    arm().save("arm.toml")
    return "arm.toml"


def points(path, places, unit=" [m]", scale=1.0):
    rows = [",".join(repr(float(x) * scale) for x in row) for row in places]
    path.write_text("\n".join([",".join(f"{axis}{unit}" for axis in "xyz"), *rows]) + "\n")
    return str(path)


def run(capsys, *arguments, code=0):
    """Run a command in this process; what it prints on stdout and stderr."""
    assert main(list(map(str, arguments))) == code, capsys.readouterr().err
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    assert "\x1b" not in out + err
    if code == 0:
        assert err == ""
    else:
        assert err.count("\n") == 1
        assert err.startswith("tdcr: ")
    return out, err


def facts(out):
    """First column of a table to the others."""
    split = (line.rstrip().split("  ") for line in out.splitlines() if line.strip())
    return {words[0]: [w.strip() for w in words[1:] if w.strip()] for words in split}


def picture(path):
    assert path.read_bytes().startswith(b"\x89PNG")


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


def test_a_workspace_of_which_nothing_converges(robot, capsys):
    command = ["workspace", robot, "--ranges", "-0.02:-0.01", "--samples", "8"]
    out, err = run(capsys, *command, "--sampling", "random", code=1)
    assert "volume" not in out
    assert err == "tdcr: 8 of 8 rows did not converge: 8 infeasible\n"


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


@pytest.mark.parametrize("missing", ["--unit", "--pull-sign"])
def test_fit_has_no_default_for_unit_and_sign(measured, missing, capsys):
    at = measured.index(missing)
    command = measured[:at] + measured[at + 2 :]
    _, err = run(capsys, *command, "--parameters", "gain", code=2)
    assert f"Missing option '{missing}'" in err


def test_plot_draws_whatever_was_saved(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    tdcr.forward(arm(), PULL).save("shape.npz")
    tdcr.forward(arm(), PULL).save("shape.json")
    tdcr.inverse(arm(), [0.05, 0.0, 0.18], model="constant_curvature").save("inverse.npz")
    limits = [(-0.01, 0), (math.inf,) * 2, (math.inf,) * 2]
    tdcr.workspace(arm(), limits, 20, sampling="grid").save("cloud.npz")
    tdcr.forward_batch(arm(), [PULL, PULL]).save("batch.npz")
    arm().save("arm.json")
    for file, *options in (
        ("shape.npz", "--view", "3d"), ("shape.json",), ("inverse.npz",), ("cloud.npz",),
        ("cloud.npz", "--view", "3d"), ("batch.npz", "--row", "1"), ("arm.json",),
        (robot, "--pull", "-10 free free", "--unit", "mm", "--model", "linkage"),
    ):  # fmt: skip
        (tmp_path / "p.png").unlink(missing_ok=True)
        main(["plot", file, "--output", "p.png", *options])
        picture(tmp_path / "p.png")
    capsys.readouterr()


def test_plot_says_what_it_cannot_draw(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    tdcr.forward_batch(arm(), [PULL, PULL]).save("batch.npz")
    tdcr.forward(arm(), PULL).save("shape.npz")
    (tmp_path / "x.npz").write_bytes(b"no")
    out = ["--output", "p.png"]
    for arguments, text in (
        ([robot], "expected --output FILE, --animate FILE or both"),
        (["batch.npz", *out], "--row: expected a row from 0 to 1, got none"),
        (["batch.npz", *out, "--row", "2"], "--row: expected a row from 0 to 1, got 2"),
        (["shape.npz", *out, "--row", "0"], "--row: expected a batch or a track, got Shape"),
        (["shape.npz", *out, "--pull", "0"], "expected a robot file, got shape.npz with a Shape"),
        (["x.npz", *out], "x.npz: not an npz file"),
        (["x.csv", *out], "expected a file ending in .toml, .json, .npz or .parquet, got 'x.csv'"),
        ([robot, "--output", "p.docx"], "expected a picture file ending in one of"),
        ([robot, "--animate", "p.gif"], "--animate: expected --pull too"),
        ([robot, "--animate", "p.png", "--pull", "0 0 0"], "expected one ending in .gif"),
        ([robot, "--animate", "p.gif", "--pull", "0 0"], "displacements: expected 3 values"),
    ):
        _, err = run(capsys, "plot", *arguments, code=2)
        assert text in err
    assert not (tmp_path / "p.png").exists()
    assert not (tmp_path / "p.gif").exists()


@pytest.mark.parametrize("pull", ["-10 free free", "-10 -3 free"])
def test_an_animation_holds_its_axes_still(robot, pull, tmp_path, capsys):
    """In the plane and in space: what is no robot is the same in every frame."""
    pytest.importorskip("matplotlib")
    image = pytest.importorskip("PIL.Image")
    command = ["plot", robot, "--pull", pull, "--unit", "mm", "--frames", "6"]
    run(capsys, *command, "--animate", "pull.gif")
    frames = []
    with image.open(tmp_path / "pull.gif") as gif:
        assert gif.n_frames == 6
        assert gif.info["loop"] == 0
        for k in range(gif.n_frames):
            gif.seek(k)
            frames.append(np.asarray(gif.convert("L"), dtype=float))
    first, last = frames[0], frames[-1]
    assert all(frame.shape == first.shape for frame in frames)
    dark = [np.argwhere(frame < 200) for frame in frames]
    # Ink of axes, labels and legend bounds every frame alike, below the title.
    box = [(d[d[:, 0] > 60].min(axis=0), d.max(axis=0)) for d in dark]
    for low, high in box[1:]:
        assert np.abs(high - box[0][1]).max() <= 1
        assert abs(low[1] - box[0][0][1]) <= 1
    assert np.abs(first - last).max() > 100


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


LONG = {
    "workspace": ["--ranges", "-0.01:0 free free", "--samples", "3000000", "--sampling", "random",
                  "--output", "w.npz"],
    "track": ["path.csv", "--output", "t.npz"],
    "plot": ["--pull", "-0.01 -0.004 free", "--animate", "p.gif", "--frames", "500"],
}  # fmt: skip


@pytest.mark.parametrize("command", LONG)
def test_interrupting_ends_with_130_and_one_line(command, robot, tmp_path):
    pytest.importorskip("matplotlib")
    angles = np.linspace(0, 60, 100_000)
    circle = np.stack([0.4 * np.cos(angles), 0.4 * np.sin(angles), 0 * angles + 0.3], axis=1)
    points(tmp_path / "path.csv", circle)
    # A shell's background job starts with SIGINT ignored.
    code = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from tdcr._cli import main; print('ready', flush=True); sys.exit(main(sys.argv[1:]))"
    )
    before = set(tmp_path.iterdir())
    arguments = [sys.executable, "-c", code, command, robot, *LONG[command]]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(arguments, **pipes) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(1.0)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert (process.returncode, out, err) == (130, "", "tdcr: interrupted\n")
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize("done", [0, 3])
def test_an_animation_that_is_interrupted_is_not_written(
    done, robot, tmp_path, capsys, monkeypatch
):
    """Before the first frame too, when there is nothing to write."""
    pytest.importorskip("matplotlib")
    from tdcr import _animate

    drawn = []

    def frame(figure, shapes, step):
        if len(drawn) == done:
            raise KeyboardInterrupt
        drawn.append(step)

    monkeypatch.setattr(_animate, "_frame", frame)
    before = set(tmp_path.iterdir())
    command = ["plot", robot, "--pull", "-0.01 free free", "--animate", "p.gif"]
    assert main(command) == 130
    assert capsys.readouterr().err == "tdcr: interrupted\n"
    assert drawn == list(range(done))
    assert set(tmp_path.iterdir()) == before


def test_progress_is_drawn_on_a_terminal_alone(robot, tmp_path):
    pty = pytest.importorskip("pty")
    import os

    command = [sys.executable, "-m", "tdcr", "workspace", robot, *WORKSPACE]
    quiet = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert quiet.stderr == ""
    terminal, ours = pty.openpty()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=ours) as process:
        out, _ = process.communicate(timeout=120)
    os.close(ours)
    drawn = os.read(terminal, 100_000).decode()
    os.close(terminal)
    assert "50/50" in drawn
    assert out.decode() == quiet.stdout
