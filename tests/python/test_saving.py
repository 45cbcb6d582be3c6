"""Files of results: equal when loaded, to the bit; and what is said of files that are none."""

from __future__ import annotations

import json
import zipfile

import numpy as np
import pytest
from saved_results import DESIGNS, RESULTS, SHAPES, arm, batch, workspace

import tdcr
from tdcr._core import _shape

try:
    import resource
except ImportError:  # Not on Windows.
    resource = None

# Lists in lists, deeper than Python calls itself.
DEEP: list[object] = []
for _ in range(400):
    DEEP = [DEEP]


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


def test_loaded_designs_work_like_those_found(tmp_path):
    found = {name: DESIGNS[name]() for name in ("prebend", "routing", "fit", "grasp")}
    loaded = {}
    for name, result in found.items():
        result.save(tmp_path / f"{name}.npz")
        loaded[name] = type(result).load(tmp_path / f"{name}.npz")
        assert (loaded[name].ok, repr(loaded[name])) == (result.ok, repr(result))
    assert loaded["prebend"].shape == found["prebend"].shape
    assert loaded["prebend"].message == found["prebend"].message
    again = tdcr.design.routing(
        loaded["routing"].robot,
        found["routing"].target_positions,
        start=loaded["routing"],
        settings=loaded["routing"].settings,
    )
    assert again.rms <= found["routing"].rms
    assert loaded["fit"].message == found["fit"].message
    assert loaded["fit"].rms("train") == found["fit"].rms("train")
    assert not loaded["fit"].parameters["gain"].flags.writeable
    assert loaded["fit"].displacements([-0.01, 0.0]).tolist() == (
        found["fit"].displacements([-0.01, 0.0]).tolist()
    )
    assert loaded["grasp"].touch == found["grasp"].touch
    assert loaded["grasp"].force().tolist() == found["grasp"].force().tolist()


def test_a_grasp_writes_its_robots_and_obstacles_once(tmp_path):
    result = DESIGNS["grasp"]()
    result.save(tmp_path / "g.json")
    data = json.loads((tmp_path / "g.json").read_text("utf-8"))
    assert (data["format"], data["kind"]) == (1, "Grasp")
    assert [robot["name"] for robot in data["robots"]] == ["claw 0", "claw 1", "claw 2"]
    assert [one["type"] for one in data["obstacles"]] == ["Sphere", "HalfSpace"]
    assert [shape["robot"] for shape in data["shapes"][2]] == [0, 1, 2]
    assert [shape["obstacles"] for shape in data["shapes"][2]] == [[0, 1]] * 3


def test_designs_have_no_tables_of_rows(tmp_path):
    for name, what in (
        ("prebend", "a Prebend, got .*; its shape can be saved as .csv"),
        ("routing", "a Routing, got .*; its shape can be saved as .csv"),
        ("fit", "a Fit, got [^;]*$"),
        ("grasp", "a Grasp, got [^;]*$"),
    ):
        result = DESIGNS[name]()
        with pytest.raises(tdcr.InvalidInput, match=rf"expected .npz or .json for {what}"):
            result.save(tmp_path / "d.csv")
        with pytest.raises(tdcr.InvalidInput, match=r"expected no .parquet for \w+, which is no"):
            result.save(tmp_path / "d.parquet")
    assert not list(tmp_path.iterdir())


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
    with pytest.raises(tdcr.InvalidInput, match=r"s\.npz: .*: it holds pickled objects, "):
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
        ({"format": [1]}, r"format: expected 1, got \[1\]$"),
        ({"kind": ["Shape"]}, r"got the kind \['Shape'\]"),
        ({"energy": 10**400}, "energy: int too large to convert"),
        ({"energy": [1.0]}, r"energy: expected a number, got \[1.0\]"),
        ({"settings": {"type": ["RodSettings"]}}, "settings: type: expected one of RodSettings"),
    ],
)
def test_a_changed_file_says_where_it_is_wrong(saved, tmp_path, change, text):
    data, load = saved
    data |= change
    with pytest.raises(tdcr.InvalidInput, match=text) as error:
        load()
    assert str(error.value).startswith(str(tmp_path / "s.json"))


@pytest.mark.parametrize(
    ("name", "change", "text"),
    [
        ("inverse", {"target": [[0.0], [0.0, 1.0]]}, "target: expected shape|rectangular"),
        ("inverse", {"target": []}, r"target: expected shape \(3\)"),
        ("inverse", {"loads": DEEP}, "nested too deeply|loads: type"),
        ("inverse", {"target": DEEP}, "nested too deeply|target: expected"),
        ("track", {"targets": [{}, {}]}, "targets: expected numbers"),
        ("no frames", {"frames": None}, "frames: expected true or false, got None"),
        ("touching batch", {"contacts": {"row": 3}}, "contacts: expected columns"),
        ("workspace", {"seed": -1}, "seed: expected a whole number, got -1"),
        ("prebend", {"shape": None}, "shape: expected the fields of a Shape"),
        ("prebend", {"error": [0.0]}, r"error: expected shape \(7\), got \(1,\)"),
        ("prebend", {"settings": None}, "settings: type: expected one of PrebendSettings"),
        ("prebend", {"settings": {"type": "RodSettings"}}, "settings: type: expected one of Pre"),
        ("prebend", {"clearance": "near"}, "clearance: expected a number, got 'near'"),
        ("prebend", {"status": "bent"}, "status: expected 'converged' or"),
        ("routing", {"holes": [[0, 1]]}, "holes: expected a list of hole numbers for each of 2"),
        ("routing", {"holes": [[0, 1], [0.5]]}, r"holes\[1\]: expected whole numbers"),
        ("routing", {"bounds": [[0.0, 0.0]]}, "bounds: expected a list of lowest and highest"),
        ("routing", {"bounds": [[0.0], [1.0, 1.0]]}, r"bounds\[0\]: expected shape \(2\)"),
        ("routing", {"optimality": "proven"}, "optimality: expected 'reached' or"),
        ("routing", {"rms": DEEP}, "nested too deeply|rms: expected a number"),
        ("fit", {"parameters": [1.0]}, r"parameters: expected values by name, got \[1.0\]"),
        ("fit", {"parameters": {"mass": [1.0]}}, r"parameters\.mass: expected one of offset, gain"),
        ("fit", {"parameters": {"gain": [1.0]}}, r"parameters\.gain: expected shape \(2\)"),
        ("fit", {"residuals": [[[0.0]]]}, r"residuals: expected shape \(1, 1, 3\)"),
        ("fit", {"rows": [0]}, r"rows: expected shape \(11\), got \(1,\)"),
        ("fit", {"validation": [1] * 11}, "validation: expected true or false"),
        ("fit", {"robot": {}}, "robot: format: missing"),
        ("grasp", {"shares": [0.0, 1.0]}, "shapes: expected shapes of 2 steps, got 5"),
        ("grasp", {"shapes": 3}, "shapes: expected a list, got 3"),
        ("grasp", {"shapes": [[]] * 5}, r"shapes\[0\]: expected the shape of every finger"),
        ("grasp", {"shapes": [[{}]] * 5}, r"shapes\[0\]\[0\]: expected the fields of a Shape"),
        ("grasp", {"robots": []}, r"shapes\[0\]\[0\]: robot: expected a place below 0, got 0"),
        ("grasp", {"obstacles": []}, r"obstacles\[0\]: expected a place below 0, got 0"),
    ],
)
def test_changed_files_of_other_kinds_say_so_too(name, change, text, tmp_path):
    result = RESULTS[name]()
    path = tmp_path / "r.json"
    result.save(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(tdcr.InvalidInput, match=text) as error:
        type(result).load(path)
    assert str(error.value).startswith(str(path))


def test_a_table_of_contacts_without_rows_says_so(tmp_path):
    result = RESULTS["touching batch"]()
    path = tmp_path / "r.json"
    result.save(path)
    data = json.loads(path.read_text())
    data["contacts"]["row"] = 7
    path.write_text(json.dumps(data))
    with pytest.raises(tdcr.InvalidInput, match=r"contacts\.row: expected an array, got 7"):
        type(result).load(path)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"frames": {"array": ["frames"]}}, r"header: expected the name of an array, got \['fr"),
        ({"frames": {"array": "no"}}, "no: the array is missing"),
        ({"kind": {"array": "frames"}}, "got the kind array"),
        ({"format": {"array": "frames"}}, "format: expected 1, got array"),
        ({"energy": {"array": "frames"}}, "energy: expected a number, got array"),
        ({"loads": {"type": {"array": "frames"}}}, "loads: type: expected one of Loads"),
    ],
)
def test_a_changed_header_says_where_it_is_wrong(change, text, tmp_path):
    path = tmp_path / "s.npz"
    SHAPES["rod"]().save(path)
    with np.load(path) as archive:
        arrays = dict(archive)
    header = json.loads(str(arrays.pop("header"))) | change
    np.savez(path, header=np.array(json.dumps(header)), **arrays)
    with pytest.raises(tdcr.InvalidInput, match=text) as error:
        tdcr.Shape.load(path)
    assert str(error.value).startswith(str(path))


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


KINDS = (
    *(tdcr.Shape, tdcr.ShapeBatch, tdcr.Inverse, tdcr.InverseBatch, tdcr.Workspace, tdcr.Grasp),
    *(tdcr.design.Prebend, tdcr.design.Routing, tdcr.design.Fit),
)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("name", WRONG)
def test_files_that_are_none_are_refused_by_name(name, kind, tmp_path):
    path = tmp_path / name
    path.write_bytes(WRONG[name])
    if kind is tdcr.Workspace and path.suffix == ".parquet":
        pytest.importorskip("pyarrow")
    with pytest.raises(tdcr.InvalidInput) as error:
        kind.load(path)
    assert str(path) in str(error.value)
    with pytest.raises(FileNotFoundError, match="gone"):
        kind.load(tmp_path / "gone.npz")


def test_a_robot_file_is_known(tmp_path):
    arm().save(tmp_path / "r.json")
    with pytest.raises(tdcr.InvalidInput, match=r"got a robot file, which tdcr\.Robot\.load reads"):
        tdcr.Shape.load(tmp_path / "r.json")


def test_a_robot_file_is_told_from_results(tmp_path):
    path = tmp_path / "s.json"
    SHAPES["rod"]().save(path)
    with pytest.raises(tdcr.InvalidInput) as error:
        tdcr.Robot.load(path)
    got = "a Shape, which tdcr.Shape.load reads: its .robot is the robot"
    assert str(error.value) == f"{path}: kind: expected a robot file, got {got}"
    assert error.value.argument == "kind"
    DESIGNS["prebend"]().save(path)
    with pytest.raises(
        tdcr.InvalidInput, match=r"got a Prebend, which tdcr\.design\.Prebend\.load"
    ):
        tdcr.Robot.load(path)
    DESIGNS["grasp"]().save(path)
    with pytest.raises(tdcr.InvalidInput, match=r"its \.shapes\[0\] have those of its fingers"):
        tdcr.Robot.load(path)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_file_of_another_kind_names_what_reads_it(kind, tmp_path):
    path = tmp_path / "f.npz"
    result = DESIGNS["fit" if kind is not tdcr.design.Fit else "routing"]()
    result.save(path)
    own = f"tdcr.design.{type(result).__name__}.load reads it"
    with pytest.raises(tdcr.InvalidInput, match=f"expected '{kind.__name__}', got .*{own}"):
        kind.load(path)


@pytest.mark.skipif(resource is None, reason="needs limits of processes")
@pytest.mark.parametrize("suffix", [".npz", ".json", ".csv", ".parquet"])
@pytest.mark.parametrize("older", [False, True])
def test_a_full_disk_leaves_no_half_of_a_file(suffix, older, tmp_path):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"w{suffix}"
    if older:
        path.write_bytes(b"older")
    cloud = workspace(fields=("frames",))
    # Files beyond a limit fail as on a full disk: when they are written, or when they are closed.
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (700, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            cloud.save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [(path.name, b"older")] * older


def test_a_folder_in_the_way_is_named(tmp_path):
    path = tmp_path / "s.npz"
    path.mkdir()
    with pytest.raises(IsADirectoryError) as error:
        SHAPES["rod"]().save(path)
    assert error.value.filename == str(path)
    assert error.value.filename2 is None
    assert list(tmp_path.iterdir()) == [path]


def test_a_name_too_long_is_the_one_given(tmp_path):
    path = tmp_path / ("s" * 250 + ".npz")  # As long as names may be; that beside it is longer.
    with pytest.raises(OSError, match="too long") as error:
        SHAPES["rod"]().save(path)
    assert error.value.filename == str(path)
    assert not list(tmp_path.iterdir())


def test_other_npz_files_are_told_from_ours(tmp_path):
    np.savez(tmp_path / "a.npz", x=np.arange(3))
    with pytest.raises(tdcr.InvalidInput, match=r"header: expected the text .* got members x"):
        tdcr.Shape.load(tmp_path / "a.npz")
    with (tmp_path / "b.npz").open("wb") as stream:
        np.save(stream, np.arange(3))
    with pytest.raises(tdcr.InvalidInput, match="a single array"):
        tdcr.Shape.load(tmp_path / "b.npz")
    with zipfile.ZipFile(tmp_path / "c.npz", "w") as archive:
        archive.writestr("header", "of something else")
    with pytest.raises(tdcr.InvalidInput, match=r"c\.npz: header: .* got members none"):
        tdcr.Shape.load(tmp_path / "c.npz")


def test_an_npz_without_one_of_its_arrays(tmp_path):
    path = tmp_path / "w.npz"
    workspace().save(path)
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "x.npz", "w") as new:
        for name in old.namelist():
            if name != "tips.npy":
                new.writestr(name, old.read(name))
    with pytest.raises(tdcr.InvalidInput, match=r"x\.npz: tips: the array is missing"):
        tdcr.Workspace.load(tmp_path / "x.npz")


@pytest.mark.parametrize("name", ["touching", "touching batch", "workspace", "track", *DESIGNS])
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
