"""sweep: the rows of forward_batch in a file, chunk by chunk, complete or not at all."""

import os
import subprocess
import sys

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr
from tdcr import InvalidInput, ShapeBatch, Status

try:
    import resource
except ImportError:  # Not on Windows.
    resource = None

ROWS = 1000
BALL = tdcr.Sphere((0.05, 0.0, 0.12), 0.02)
ALL = ("tip", "frames", "positions", "strains", "tendon_points", "tendon_lengths", "tensions",
       "energy", "contacts")  # fmt: skip


@pytest.fixture(scope="module")
def robot():
    azimuths = 2 * np.pi * np.arange(6) / 3 + 0.5 * (np.arange(6) > 2)
    tendons = [tdcr.Tendon(a, 0.008, end=4 + 4 * (k > 2)) for k, a in enumerate(azimuths)]
    return tdcr.Robot(tdcr.Backbone([0.09, 0.09], [4, 4]), tendons, name="two segments")


@pytest.fixture(scope="module")
def pulls():
    rows = np.random.default_rng(3).uniform(-0.008, 0, (ROWS, 6))
    rows[:, [1, 2, 4, 5]] = np.inf
    # Two held tendons against the third: not every row is a solution.
    rows[::7, 1:3] = 0.0
    return rows


def around(model):
    return {"obstacles": BALL} if model == "rod" else {}


@pytest.mark.slow
@pytest.mark.parametrize("chunk", [1, 64, 99, 300, 10**9])
def test_the_rows_are_those_of_a_batch(robot, pulls, chunk, tmp_path):
    pulls = pulls[: 40 if chunk == 1 else 300]
    batch = tdcr.forward_batch(robot, pulls, fields=ALL, obstacles=BALL)
    assert len(set(batch.contacts["row"])) > 1
    assert len(set(batch.status)) > 1
    done = tdcr.sweep(robot, pulls, tmp_path / "s.npz", fields=ALL, obstacles=BALL, chunk=chunk)
    # Equal by value is equal to the bit here: NaN and signs of zero included.
    loaded = ShapeBatch.load(tmp_path / "s.npz")
    assert loaded == batch
    for name in ALL[:4]:
        assert getattr(loaded, name).tobytes() == getattr(batch, name).tobytes()
    assert (done.path, done.rows) == (str(tmp_path / "s.npz"), len(pulls))
    assert done.converged == np.count_nonzero(batch.ok)
    assert not done.ok
    assert done.counts == {one: np.count_nonzero(batch.status == one) for one in set(batch.status)}
    assert 0 < done.seconds < 600
    assert os.listdir(tmp_path) == ["s.npz"]


@pytest.mark.slow
@pytest.mark.parametrize("model", ["rod", "linkage", "constant_curvature"])
def test_a_table_is_that_of_a_batch_with_a_row_group_per_chunk(robot, pulls, model, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    fields = ("tip", "positions", "tendon_lengths", "tensions", "energy")
    given = {"model": model, "fields": fields, **around(model)}
    tdcr.forward_batch(robot, pulls, **given).save(tmp_path / "batch.parquet")
    tdcr.sweep(robot, pulls, tmp_path / "sweep.parquet", chunk=300, **given)
    swept, whole = (parquet.read_table(tmp_path / f"{n}.parquet") for n in ("sweep", "batch"))
    assert swept.schema == whole.schema
    for name in whole.column_names:
        # NaN, which other models have for tensions, are equal here.
        np.testing.assert_array_equal(swept[name].to_numpy(), whole[name].to_numpy())
    found = parquet.ParquetFile(tmp_path / "sweep.parquet").metadata
    assert [found.row_group(i).num_rows for i in range(found.num_row_groups)] == [300] * 3 + [100]
    # In the middle of a column's last numbers: pages carry checksums.
    column = found.row_group(0).column(2)
    raw = bytearray((tmp_path / "sweep.parquet").read_bytes())
    raw[column.data_page_offset + column.total_compressed_size - 9] ^= 1
    (tmp_path / "sweep.parquet").write_bytes(raw)
    with pytest.raises(OSError, match=r"(?i)crc"):
        parquet.read_table(tmp_path / "sweep.parquet", page_checksum_verification=True)


def blocks(pulls):
    """Blocks of many lengths, none too, in one buffer that is filled anew."""
    buffer = np.empty((400, pulls.shape[1]))
    for start, stop in [(0, 1), (1, 1), (1, 90), (90, 490), (490, 800), (800, ROWS)]:
        buffer[: stop - start] = pulls[start:stop]
        yield buffer[: stop - start]


@pytest.mark.parametrize(
    "form",
    [
        blocks,
        np.ndarray.tolist,
        lambda pulls: iter([pulls.tolist()]),
        lambda pulls: [pulls[:300], pulls[300:]],
        lambda pulls: lambda first, count: pulls[first : first + count],
        lambda pulls: lambda first, count: pulls[first : first + count // 2],
        np.asfortranarray,
    ],
)
def test_rows_come_in_many_forms(robot, pulls, form, tmp_path):
    batch = tdcr.forward_batch(robot, pulls, model="constant_curvature")
    told = []
    keywords = {"model": "constant_curvature", "chunk": 128, "progress": told.append}
    tdcr.sweep(robot, form(pulls), tmp_path / "s.npz", **keywords)
    loaded = ShapeBatch.load(tmp_path / "s.npz")
    # An array in another order has the same rows.
    assert loaded == batch
    assert told == sorted(told)
    assert told[-1] == ROWS
    assert set(range(128, ROWS, 128)) <= set(told)


def test_rows_on_disk_are_read(robot, pulls, tmp_path):
    np.save(tmp_path / "pulls.npy", pulls)
    mapped = np.load(tmp_path / "pulls.npy", mmap_mode="r")
    tdcr.sweep(robot, mapped, tmp_path / "s.npz", model="linkage", chunk=99)
    loaded = ShapeBatch.load(tmp_path / "s.npz")
    assert loaded == tdcr.forward_batch(robot, pulls, model="linkage")


@pytest.mark.parametrize("fields", [(), "energy", ["energy"]])
def test_other_fields_settings_and_surroundings_are_kept(robot, pulls, fields, tmp_path):
    # An octahedron, with more numbers than are said in the header.
    corners = np.concatenate([np.eye(3), -np.eye(3)]) * 0.01 + (0.2, 0, 0)
    sides = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    wall = tdcr.Mesh(corners, sides)
    given = {
        "settings": tdcr.RodSettings(elements=2),
        "obstacles": [BALL, wall],
        "loads": tdcr.Loads(tip_force=(0.1, 0, 0)),
        "fields": fields,
    }
    backbone = tdcr.Backbone(0.18, 8, youngs_modulus=60e9, diameter=1e-3)
    robot = tdcr.Robot(backbone, [tdcr.Tendon(t.azimuth, t.radius) for t in robot.tendons])
    tdcr.sweep(robot, pulls[:30], tmp_path / "s.npz", **given)
    assert ShapeBatch.load(tmp_path / "s.npz") == tdcr.forward_batch(robot, pulls[:30], **given)


@pytest.mark.parametrize("none", [np.empty((0, 6)), (), lambda first, count: np.empty((0, 6))])
@pytest.mark.parametrize("ending", ["npz", "parquet"])
def test_no_row_makes_a_file_without_rows(robot, none, ending, tmp_path):
    path = tmp_path / f"s.{ending}"
    if ending == "parquet":
        parquet = pytest.importorskip("pyarrow.parquet")
    none = iter(none) if isinstance(none, tuple) else none
    done = tdcr.sweep(robot, none, path, fields=("tip", "tensions"))
    assert (done.rows, done.converged, done.counts, done.ok) == (0, 0, {}, True)
    if ending == "npz":
        assert ShapeBatch.load(path).tip.shape == (0, 4, 4)
    else:
        table = parquet.read_table(path)
        assert table.num_rows == 0
        assert "tip x [m]" in table.column_names


def raising(pulls):
    yield pulls[:200]
    raise LookupError("the bench is off")


def nan_late(pulls):
    spoiled = pulls.copy()
    spoiled[777, 3] = np.nan
    return spoiled


@pytest.mark.parametrize("ending", ["npz", "parquet"])
@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize(
    ("given", "error", "text"),
    [
        (raising, LookupError, "the bench is off"),
        (nan_late, InvalidInput, r"displacements\[700:800\]: .* NaN for tendon .* in row 77$"),
        (lambda p: iter([p, p[:, :5]]), InvalidInput, r"block 1: expected shape \(B, 6\), .*, 5\)"),
        (lambda p: iter([p, p[0]]), InvalidInput, r"block 1: expected shape .* got shape \(6,\)"),
        (lambda p: iter([p, [["x"] * 6]]), TypeError, "block 1: expected numbers, got list"),
        (lambda p: lambda first, count: p[0], InvalidInput, "function gives: expected shape"),
        (lambda p: lambda first, count: None, TypeError, "function gives: expected numbers"),
    ],
)
def test_what_fails_on_the_way_leaves_no_file(
    robot, pulls, given, error, text, older, ending, tmp_path
):
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"s.{ending}"
    if older:
        path.write_bytes(b"older")
    with pytest.raises(error, match=text):
        tdcr.sweep(robot, given(pulls), path, model="constant_curvature", chunk=100)
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [(path.name, b"older")] * older


@pytest.mark.parametrize(
    ("keywords", "error", "text"),
    [
        ({"path": "s.csv"}, InvalidInput, r"path: expected a file ending in .npz or .parquet, got"),
        ({"path": "s"}, InvalidInput, "path: expected a file ending in"),
        ({"path": "none/s.npz"}, FileNotFoundError, "none/s.npz"),
        ({"path": "folder.npz"}, IsADirectoryError, "folder.npz"),
        ({"fields": ("tips",)}, InvalidInput, "fields: "),
        ({"path": "s.parquet", "fields": "strains"}, InvalidInput, "fields: .* got 'strains'"),
        ({"path": "s.parquet", "fields": ["frames"]}, InvalidInput, "fields: .* got 'frames'"),
        ({"chunk": 0}, InvalidInput, "chunk: expected 1 or more, got 0"),
        ({"chunk": 1.5}, TypeError, "chunk: expected an int"),
        ({"threads": 0}, InvalidInput, "threads: "),
        ({"model": "beam"}, InvalidInput, "model: "),
        ({"settings": tdcr.LinkageSettings()}, InvalidInput, "settings: "),
        ({"obstacles": 3}, TypeError, "obstacle"),
        ({"progress": 3}, TypeError, "progress: "),
        ({"obstacles": tdcr.SignedDistance(lambda p: 1.0)}, InvalidInput, "SignedDistance"),
        ({"displacements": 3}, TypeError, "displacements: expected an array, an iterator"),
        ({"robot": "arm.toml"}, TypeError, "robot: expected a Robot, got str"),
        ({"displacements": [0.0] * 6}, InvalidInput, r"displacements: expected shape \(B, 6\)"),
        ({"displacements": np.zeros((4, 5))}, InvalidInput, r"got shape \(4, 5\)"),
        ({"displacements": [[0.0], [0.0, 1.0]]}, InvalidInput, "displacements: expected a rect"),
    ],
)
def test_misuse_is_refused_before_a_row_is_solved(robot, keywords, error, text, tmp_path):
    if str(keywords.get("path")).endswith(".parquet"):
        pytest.importorskip("pyarrow")
    (tmp_path / "folder.npz").mkdir()
    solved = []
    given = {"displacements": np.zeros((3, 6)), "progress": solved.append, **keywords}
    path = tmp_path / given.pop("path", "s.npz")
    with pytest.raises(error, match=text):
        tdcr.sweep(given.pop("robot", robot), given.pop("displacements"), path, **given)
    assert solved == []
    assert os.listdir(tmp_path) == ["folder.npz"]


@pytest.mark.slow
def test_functions_of_obstacles_go_into_tables(robot, pulls, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    ball = tdcr.SignedDistance(lambda p: float(np.linalg.norm(p - BALL.center)) - BALL.radius)
    # None of those whose search is long.
    batch = tdcr.forward_batch(robot, pulls[1:6], obstacles=ball)
    tdcr.sweep(robot, pulls[1:6], tmp_path / "s.parquet", obstacles=ball, chunk=2)
    table = parquet.read_table(tmp_path / "s.parquet")
    assert np.array_equal(table["tip z [m]"], batch.tip[:, 2, 3])
    assert table["status"].to_pylist() == batch.status.tolist()


def test_what_was_done_is_a_value(robot, tmp_path):
    done = tdcr.sweep(robot, np.full((3, 6), np.inf), tmp_path / "s.npz")
    assert done.counts == {Status.converged: 3}
    assert done == tdcr.Sweep(done.path, 3, {Status.converged: 3}, done.seconds)
    assert hash(done) == hash(tdcr.Sweep(done.path, 3, {}, done.seconds))
    with pytest.raises(AttributeError):
        done.rows = 4


@pytest.mark.skipif(resource is None, reason="needs limits of processes")
@pytest.mark.parametrize("ending", ["npz", "parquet"])
@pytest.mark.parametrize("chunk", [50, 100_000])
def test_a_full_disk_leaves_no_half_of_a_file(robot, pulls, chunk, ending, tmp_path):
    """On the way, or when all is put together at the end: the older file stays."""
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"s.{ending}"
    path.write_bytes(b"older")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            tdcr.sweep(robot, pulls, path, model="constant_curvature", chunk=chunk)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [(path.name, b"older")]


@pytest.mark.parametrize("ending", ["npz", "parquet"])
def test_ctrl_c_leaves_no_file(ending, tmp_path):
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    setup = """
        import numpy as np, tdcr
        robot = tdcr.Robot(tdcr.Backbone(0.2, 50), [tdcr.Tendon(0.0, 0.01)])
        pulls = (np.full((2_000, 1), -0.01) for _ in range(100_000))
    """
    assert_interrupts(setup, f"tdcr.sweep(robot, pulls, {str(tmp_path / 's')!r} '.{ending}')")
    assert os.listdir(tmp_path) == []


GREATEST = """
import resource, sys
import numpy as np, tdcr
robot = tdcr.Robot(tdcr.Backbone(0.2, 30), [tdcr.Tendon(a, 0.01) for a in (0.0, 2.0)])
block = np.full((1000, 2), -1e-3)
blocks = (block for _ in range(int(sys.argv[1]) // 1000))
model, field = "constant_curvature", "frames" if sys.argv[2].endswith("npz") else "positions"
tdcr.sweep(robot, blocks, sys.argv[2], model=model, fields=[field], chunk=2000)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "rows"), [("npz", 60_000), ("parquet", 200_000)])
def test_memory_does_not_grow_with_the_rows(ending, rows, tmp_path):
    """The results alone are 60,000 x 31 frames of 128 bytes or 200,000 x 31 x 24: 240 or 150 MB."""
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    greatest = [
        int(
            subprocess.run(
                [sys.executable, "-c", GREATEST, str(count), tmp_path / f"s.{ending}"],
                capture_output=True, text=True, check=True,
            ).stdout
        )
        for count in (6_000, rows)
    ]  # fmt: skip
    unit = 1 if sys.platform == "darwin" else 1024
    assert (greatest[1] - greatest[0]) * unit < 50e6
