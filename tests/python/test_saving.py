"""Files of results: equal when loaded, to the bit; and what is said of files that are none."""

from __future__ import annotations

import json
import math
import zipfile

import numpy as np
import pytest

import tdcr
from tdcr._core import _shape

AZIMUTHS = (0.0, 2.1, 4.2)


def arm(**spine):
    tendons = [
        tdcr.Tendon.helical(AZIMUTHS[0], 0.01, turns=0.3, name="wound"),
        tdcr.Tendon(AZIMUTHS[1], 0.01, end=5, stiffness=1e4 if spine else None),
        tdcr.Tendon.from_holes([1] * 9, 3, 0.01, azimuth=0.1),
    ]
    rest = np.random.default_rng(3).normal(size=(8, 3)) * 0.03
    base = np.eye(4)
    base[:3, 3] = 0.1, -1 / 3, 0.2
    backbone = tdcr.Backbone([0.1, 0.09], [4, 4], rest=rest, **spine)
    return tdcr.Robot(backbone, tendons, base=base, name="arm é")


def steel():
    return arm(youngs_modulus=2e11, diameter=0.001)


def touching():
    """Shape among every kind of obstacle, under loads, with contacts."""
    robot = tdcr.Robot(
        tdcr.Backbone(0.2, 10, youngs_modulus=6e10, diameter=0.001), [tdcr.Tendon(0.0, 0.01)]
    )
    corner = [[0.4, 0, 0], [0.5, 0, 0], [0.4, 0.1, 0], [0.4, 0, 0.1]]
    obstacles = (
        tdcr.Cylinder([0.035, 0, 0.1], [0, 1, 0], 0.02),
        tdcr.Sphere([0, 0, 0], 1.0, inside=True),
        tdcr.Box([0.5, 0.5, 0.5], [0.1, 0.1, 0.1], np.eye(3)),
        tdcr.Capsule([1, 0, 0], [1, 1, 0], 0.1),
        tdcr.HalfSpace([0, 0, -0.5], [0, 0, 1]),
        tdcr.Mesh(corner, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    )
    shape = tdcr.forward(
        robot, [-0.012], obstacles=obstacles, loads=tdcr.Loads(tip_force=[0, 0, -0.01])
    )
    assert shape.contacts
    return shape


def infeasible():
    shape = tdcr.forward(straight(), [-0.01, 0, 0])
    assert shape.message
    return shape


SHAPES = {
    "rod": lambda: tdcr.forward(arm(), [-0.01, math.inf, -1 / 300]),
    "steel": lambda: tdcr.forward(
        steel(), [-0.01, math.inf, math.inf], settings=tdcr.RodSettings(elements=2, axial=True)
    ),
    "linkage": lambda: tdcr.forward(straight(), [-0.01, math.inf, math.inf], model="linkage"),
    "curvature": lambda: tdcr.forward(
        tdcr.Robot(tdcr.Backbone(0.1, 4), [tdcr.Tendon(a, 0.01) for a in AZIMUTHS]),
        [-0.01, 0.001, 0.002],
        model="constant_curvature",
        settings=tdcr.ConstantCurvatureSettings(extensible=True),
    ),
    "touching": touching,
    "infeasible": infeasible,
    "bare": lambda: tdcr.forward(tdcr.Robot(tdcr.Backbone(0.1, 2), []), []),
}


def straight():
    return tdcr.Robot(tdcr.Backbone(0.2, 8), [tdcr.Tendon(a, 0.01) for a in AZIMUTHS])


def batch(**options):
    rows = np.random.default_rng(0).uniform(-0.01, 0, (5, 1)) * [1, 0, 0] + [0, math.inf, math.inf]
    return tdcr.forward_batch(straight(), rows, fields=tdcr._batch.FIELDS, **options)


def touching_batch():
    shape = touching()
    return tdcr.forward_batch(
        shape.robot,
        [[-0.01], [-0.012]],
        obstacles=shape.obstacles,
        loads=shape.loads,
        fields=("contacts", "tendon_points"),
    )


def workspace(**options):
    return tdcr.workspace(
        straight(), [(-0.01, 0), (math.inf, math.inf), (-0.01, 0)], 9, sampling="random", **options
    )


def inverse(target, **options):
    return tdcr.inverse(straight(), target, model="constant_curvature", **options)


RESULTS = {
    **SHAPES,
    "batch": batch,
    "warm batch": lambda: batch(warm=True),
    "linkage batch": lambda: batch(model="linkage"),
    "touching batch": touching_batch,
    "no rows": lambda: tdcr.forward_batch(straight(), np.empty((0, 3)), fields=("tip", "strains")),
    "workspace": workspace,
    "workspace with fields": lambda: workspace(fields=("frames", "strains", "energy"), seed=4),
    "inverse": lambda: tdcr.inverse(straight(), [0.05, 0.02, 0.17]),
    "unreachable": lambda: inverse([0.0, 0.2, 0.3], search=tdcr.InverseSettings(starts=3)),
    "frame": lambda: inverse(
        tdcr.forward(straight(), [-0.01, 0.005, 0.005], model="constant_curvature").tip,
        bounds=tdcr.Bounds(displacement=(-0.02, [0.02, 0.03, math.inf])),
        search=tdcr.InverseSettings(rotation_weight=(1, 1, 0), swarm=tdcr.PsoSettings(seed=3)),
        method="pso",
    ),
    "track": lambda: tdcr.track(straight(), [[0.05, 0.02, 0.17], [0.05, 0.01, 0.17], [1, 1, 1]]),
    "frames": lambda: tdcr.inverse_batch(
        straight(), [np.eye(4)], model="constant_curvature", search=tdcr.InverseSettings(starts=2)
    ),
}


@pytest.mark.parametrize("suffix", [".npz", ".json"])
@pytest.mark.parametrize("name", RESULTS)
def test_what_is_loaded_equals_what_was_saved(name, suffix, tmp_path):
    result = RESULTS[name]()
    path = tmp_path / f"result{suffix}"
    result.save(path)
    loaded = type(result).load(str(path))
    assert loaded == result
    assert hash(loaded) == hash(result)
    # Equality leaves some fields out: all, by what a pickle would hold.
    again = tmp_path / f"again{suffix}"
    loaded.save(again)
    assert again.read_bytes() == path.read_bytes()
    # Nothing else is left behind.
    assert sorted(tmp_path.iterdir()) == sorted([path, again])


def test_loaded_results_work_like_solved_ones(tmp_path):
    shape = SHAPES["touching"]()
    shape.save(tmp_path / "s.npz")
    loaded = tdcr.Shape.load(tmp_path / "s.npz")
    assert (loaded.message, loaded.iterations) == (shape.message, shape.iterations)
    assert loaded.contacts == shape.contacts
    assert not loaded.frames.flags.writeable
    assert tdcr.forward(loaded.robot, [-0.0121], start=shape) == tdcr.forward(
        shape.robot, [-0.0121], start=loaded
    )
    rows = batch()
    rows.save(tmp_path / "b.npz")
    loaded = tdcr.ShapeBatch.load(tmp_path / "b.npz")
    assert loaded[2] == rows[2]
    assert loaded.fields == rows.fields
    assert not loaded.tip.flags.writeable
    assert loaded.iterations.dtype == rows.iterations.dtype
    cloud = workspace()
    cloud.save(tmp_path / "w.npz")
    assert tdcr.Workspace.load(tmp_path / "w.npz").shape(3) == cloud.shape(3)
    answer = RESULTS["inverse"]()
    answer.save(tmp_path / "i.json")
    assert tdcr.Inverse.load(tmp_path / "i.json").shape == answer.shape


def test_files_say_what_they_are_and_others_can_read_them(tmp_path):
    shape = SHAPES["steel"]()
    shape.save(tmp_path / "s.npz")
    shape.save(tmp_path / "s.json")
    data = json.loads((tmp_path / "s.json").read_text("utf-8"))
    assert (data["format"], data["kind"], data["tdcr"]) == (1, "Shape", tdcr.__version__)
    assert np.array_equal(data["positions"], shape.positions)
    assert data["displacements"][1] == "inf"
    assert data["robot"]["name"] == "arm é"
    with np.load(tmp_path / "s.npz") as archive:
        assert np.array_equal(archive["frames"], shape.frames)
        assert json.loads(str(archive["header"]))["kind"] == "Shape"


def test_nothing_of_a_file_is_run(tmp_path):
    path = tmp_path / "s.npz"
    np.savez(path, header=np.array({"a": 1}, dtype=object))
    with pytest.raises(tdcr.InvalidInput, match=r"s\.npz: not an npz file.*allow_pickle=False"):
        tdcr.Shape.load(path)
    SHAPES["rod"]().save(tmp_path / "s.json")
    data = json.loads((tmp_path / "s.json").read_text())
    data["settings"] = {"type": "SignedDistance", "f": "print"}
    (tmp_path / "s.json").write_text(json.dumps(data))
    with pytest.raises(tdcr.InvalidInput, match="settings: type: expected one of RodSettings"):
        tdcr.Shape.load(tmp_path / "s.json")


def test_functions_are_refused_by_name(tmp_path):
    robot = tdcr.Robot(tdcr.Backbone(0.2, 4), [tdcr.Tendon(0.0, 0.01)])
    obstacle = tdcr.SignedDistance(lambda p: 1.0)
    shape = tdcr.forward(robot, [-0.001], obstacles=[tdcr.Sphere([1, 1, 1], 0.1), obstacle])
    with pytest.raises(tdcr.InvalidInput, match=r"obstacles\[1\]: .* got a SignedDistance") as e:
        shape.save(tmp_path / "s.npz")
    assert e.value.argument == "obstacles[1]"
    assert not list(tmp_path.iterdir())


@pytest.fixture
def saved(tmp_path):
    """JSON of a shape, as data and how to load it changed."""
    SHAPES["touching"]().save(tmp_path / "s.json")
    data = json.loads((tmp_path / "s.json").read_text())

    def load():
        (tmp_path / "s.json").write_text(json.dumps(data))
        return tdcr.Shape.load(tmp_path / "s.json")

    assert load().ok
    return data, load


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"format": 2}, r"format: expected 1, got 2 \(tdcr .* wrote it\)"),
        ({"format": "1"}, "format: expected 1, got '1'$"),
        ({"format": True}, "format: expected 1, got True$"),
        ({"kind": "Spline"}, "got the kind 'Spline'"),
        ({"kind": "Workspace"}, r"kind: expected 'Shape', got 'Workspace': tdcr\.Workspace\.load"),
        ({"model": "spline"}, "model: expected 'rod' or 'linkage' or 'constant_curvature', got"),
        ({"model": "linkage"}, "model: settings: expected LinkageSettings"),
        ({"frames": [[1.0]]}, r"frames: expected shape \(11, 4, 4\), got \(1, 1\)"),
        ({"frames": [[1.0], [1.0, 2.0]]}, "frames: expected a rectangular array"),
        ({"frames": "none"}, "frames: expected an array, got 'none'"),
        ({"frames": [[[1.0] * 4] * 4] * 11}, "frames: expected homogeneous matrices"),
        ({"tensions": ["x"]}, "tensions: expected numbers, got 'x'"),
        ({"tensions": [True]}, "tensions: expected numbers, got True"),
        ({"tensions": [1.0, 2.0]}, r"tensions: expected shape \(1\), got \(2,\)"),
        ({"strains": []}, r"strains: expected shape \(10, any\)"),
        ({"strains": 3}, "strains: expected an array"),
        ({"energy": "much"}, "energy: expected a number, got 'much'"),
        ({"status": "fine"}, "status: expected 'converged' or .* got 'fine'"),
        ({"iterations": -1}, "iterations: expected a whole number, got -1"),
        ({"message": None}, "message: expected text, got None"),
        ({"settings": {"type": "RodSettings", "elements": 0}}, "settings: elements: expected"),
        ({"settings": {"type": "RodSettings", "colour": 1}}, "settings: RodSettings: .*colour"),
        ({"obstacles": {}}, "obstacles: expected a list"),
        ({"obstacles": [{"type": "Sphere", "center": [0, 0, 0], "radius": -1}]}, r"obstacles\[0\]"),
        ({"obstacles": []}, r"contacts\[0\]: of a disk, tendon or obstacle that is not there"),
        ({"robot": {"format": 1}}, "robot: length_unit: missing"),
        ({"robot": None}, "robot: file: expected a table"),
        ({"loads": {"type": "Loads", "gravity": [0, 0]}}, "loads: gravity: expected"),
    ],
)
def test_a_changed_file_says_where_it_is_wrong(saved, tmp_path, change, text):
    data, load = saved
    data |= change
    with pytest.raises(tdcr.InvalidInput, match=text) as error:
        load()
    assert str(error.value).startswith(str(tmp_path / "s.json"))


def test_every_field_of_a_shape_is_needed_but_what_follows_from_others(saved):
    data, load = saved
    extra = {"tdcr", "ok", "units", "positions", "tip", "tendon_points", "tendon_names"}
    for name in list(data):
        value = data.pop(name)
        if name in extra:
            assert load().ok
        else:
            with pytest.raises(tdcr.InvalidInput, match=f"{name}"):
                load()
        data[name] = value


WRONG = {
    "r.toml": b"format = 1",
    "r.csv": b"disk,x\n",
    "none.parquet": b"",
    "empty.npz": b"",
    "text.npz": b"hello, this is no archive",
    "empty.json": b"",
    "list.json": b"[1]",
    "plain.json": b'{"a": 1}',
    "binary.json": b"\xff\xfe",
    "deep.json": b"[" * 100_000,
}


@pytest.mark.parametrize("kind", ["Shape", "ShapeBatch", "Inverse", "InverseBatch", "Workspace"])
@pytest.mark.parametrize("name", WRONG)
def test_files_that_are_none_are_refused_by_name(name, kind, tmp_path):
    path = tmp_path / name
    path.write_bytes(WRONG[name])
    if kind == "Workspace" and path.suffix == ".parquet":
        pytest.importorskip("pyarrow")
    with pytest.raises(tdcr.InvalidInput) as error:
        getattr(tdcr, kind).load(path)
    assert str(path) in str(error.value)
    with pytest.raises(FileNotFoundError, match="gone"):
        getattr(tdcr, kind).load(tmp_path / "gone.npz")


def test_a_robot_file_is_known(tmp_path):
    arm().save(tmp_path / "r.json")
    with pytest.raises(tdcr.InvalidInput, match=r"got a robot file, which tdcr\.Robot\.load reads"):
        tdcr.Shape.load(tmp_path / "r.json")


def test_other_npz_files_are_told_from_ours(tmp_path):
    np.savez(tmp_path / "a.npz", x=np.arange(3))
    with pytest.raises(tdcr.InvalidInput, match=r"header: expected the text .* got members x"):
        tdcr.Shape.load(tmp_path / "a.npz")
    with (tmp_path / "b.npz").open("wb") as stream:
        np.save(stream, np.arange(3))
    with pytest.raises(tdcr.InvalidInput, match="a single array"):
        tdcr.Shape.load(tmp_path / "b.npz")


def test_an_npz_without_one_of_its_arrays(tmp_path):
    path = tmp_path / "w.npz"
    workspace().save(path)
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "x.npz", "w") as new:
        for name in old.namelist():
            if name != "tips.npy":
                new.writestr(name, old.read(name))
    with pytest.raises(tdcr.InvalidInput, match=r"x\.npz: tips: the array is missing"):
        tdcr.Workspace.load(tmp_path / "x.npz")


@pytest.mark.parametrize("name", ["touching", "touching batch", "workspace", "track"])
def test_a_damaged_file_is_refused_or_what_it_was(name, tmp_path):
    """Cut off anywhere, and single bytes changed: no other exception, nothing else loaded."""
    result = RESULTS[name]()
    result.save(tmp_path / "r.npz")
    raw = (tmp_path / "r.npz").read_bytes()
    rng = np.random.default_rng(5)
    refused = 0
    for trial in range(300):
        if trial % 3 == 0:
            changed = bytearray(raw[: rng.integers(len(raw))])
        else:
            changed = bytearray(raw)
            changed[rng.integers(len(raw))] ^= 1 << rng.integers(8)
        (tmp_path / "d.npz").write_bytes(changed)
        try:
            loaded, message = type(result).load(tmp_path / "d.npz"), None
        except tdcr.InvalidInput as error:
            loaded, message = None, str(error)
        if message is None:
            assert loaded == result
        else:
            assert str(tmp_path / "d.npz") in message
            refused += 1
    assert refused > 200


def test_a_state_that_does_not_fit_the_robot_is_no_panic():
    """The border of pickles and files: too few frames for a tendon's holes."""
    shape = SHAPES["rod"]()
    _, state = shape.__reduce__()
    with pytest.raises(tdcr.InvalidInput, match="frames"):
        _shape(*state[:4], state[4][:3], *state[5:])


def table(path):
    header, *rows = path.read_text("utf-8").splitlines()
    return header.split(","), [row.split(",") for row in rows]


def test_csv_of_a_shape_has_a_row_per_disk(tmp_path):
    shape = SHAPES["rod"]()
    shape.save(tmp_path / "s.csv")
    header, rows = table(tmp_path / "s.csv")
    assert header == ["disk", "x [m]", "y [m]", "z [m]"]
    assert [int(row[0]) for row in rows] == list(range(9))
    assert np.array_equal([[float(x) for x in row[1:]] for row in rows], shape.positions)


def test_csv_of_many_rows(tmp_path):
    rows = batch()
    rows.save(tmp_path / "b.csv")
    header, lines = table(tmp_path / "b.csv")
    assert header[:6] == [
        "row", "status", "displacement t0 [m]", "displacement t1 [m]", "displacement t2 [m]",
        "tip x [m]",
    ]  # fmt: skip
    assert "disk 8 z [m]" in header
    assert "tension t0 [1/m^2]" in header
    assert "energy [1/m]" in header
    at = header.index("tip x [m]")
    assert [float(line[at]) for line in lines] == rows.tip[:, 0, 3].tolist()
    assert lines[0][3] == "inf"
    cloud = workspace()
    cloud.save(tmp_path / "w.csv")
    header, lines = table(tmp_path / "w.csv")
    assert header[-3:] == ["direction x", "direction y", "direction z"]
    assert len(lines) == 9
    path = RESULTS["track"]()
    path.save(tmp_path / "t.csv")
    header, lines = table(tmp_path / "t.csv")
    assert header[:6] == [
        "row", "status", "target x [m]", "target y [m]", "target z [m]", "error [m]",
    ]  # fmt: skip
    assert lines[2][1] == "unreachable"


def test_no_csv_of_one_inverse(tmp_path):
    with pytest.raises(tdcr.InvalidInput, match=r"expected \.npz or \.json for an Inverse"):
        RESULTS["inverse"]().save(tmp_path / "i.csv")


@pytest.mark.parametrize("name", ["workspace", "workspace with fields"])
def test_parquet_of_a_workspace_loads_equal(name, tmp_path):
    pytest.importorskip("pyarrow")
    cloud = RESULTS[name]()
    cloud.save(tmp_path / "w.parquet")
    assert tdcr.Workspace.load(tmp_path / "w.parquet") == cloud


def test_parquet_of_batches_is_for_other_programs(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    for result in (batch(), RESULTS["track"]()):
        result.save(tmp_path / "b.parquet")
        read = parquet.read_table(tmp_path / "b.parquet")
        assert read["displacement t0 [m]"].to_pylist() == result.displacements[:, 0].tolist()
        with pytest.raises(tdcr.InvalidInput, match=r"\.parquet files are for other programs"):
            type(result).load(tmp_path / "b.parquet")
    with pytest.raises(tdcr.InvalidInput, match="expected the Parquet file of a Workspace"):
        tdcr.Workspace.load(tmp_path / "b.parquet")
    with pytest.raises(tdcr.InvalidInput, match=r"no \.parquet for Shape"):
        SHAPES["rod"]().save(tmp_path / "s.parquet")


def test_parquet_without_pyarrow_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"pip install tdcr\[parquet\]"):
        workspace().save(tmp_path / "w.parquet")


def test_other_endings_are_refused_before_anything_is_written(tmp_path):
    for result in (SHAPES["rod"](), batch(), workspace()):
        with pytest.raises(tdcr.InvalidInput, match=r"expected a file ending in \.npz"):
            result.save(tmp_path / "r.pkl")
    with pytest.raises(FileNotFoundError, match="none"):
        SHAPES["rod"]().save(tmp_path / "none" / "s.npz")
    assert not list(tmp_path.iterdir())


def test_the_plotting_layout_is_columns_of_frames():
    shape = SHAPES["steel"]()
    flat = shape.plotting_layout()
    assert flat.shape == (9, 16)
    assert not flat.flags.writeable
    assert np.array_equal(flat.reshape(9, 4, 4).transpose(0, 2, 1), shape.frames)
    assert flat[-1, 12:].tolist() == [*shape.positions[-1], 1.0]
