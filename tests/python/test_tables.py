"""Results as tables: CSV and Parquet, and the layout of the field's plotting toolkit."""

from __future__ import annotations

import json

import numpy as np
import pytest
from saved_results import RESULTS, SHAPES, batch, workspace

import tdcr


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


@pytest.mark.parametrize("name", [name for name in RESULTS if name.startswith("workspace")])
def test_parquet_of_a_workspace_loads_equal(name, tmp_path):
    pytest.importorskip("pyarrow")
    cloud = RESULTS[name]()
    cloud.save(tmp_path / "w.parquet")
    assert tdcr.Workspace.load(tmp_path / "w.parquet") == cloud


def rewritten(tmp_path, change, header=lambda fields: fields):
    """Parquet file of a workspace whose table and header were changed."""
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "w.parquet"
    cloud = RESULTS["workspace with fields"]()
    cloud.save(path)
    table = parquet.read_table(path)
    said = header(json.loads(table.schema.metadata[b"tdcr"]))
    text = said if isinstance(said, bytes) else json.dumps(said)
    parquet.write_table(change(table).replace_schema_metadata({"tdcr": text}), path)
    return path, cloud


def test_columns_of_parquet_are_found_by_name(tmp_path):
    path, cloud = rewritten(tmp_path, lambda table: table.select(table.column_names[::-1]))
    assert tdcr.Workspace.load(path) == cloud


@pytest.mark.parametrize(
    ("change", "header", "text"),
    [
        (None, lambda _: b"nonsense", "header: not JSON: "),
        (None, lambda _: [1], "expected a file that tdcr saved"),
        (None, lambda said: said | {"format": 2}, "format: expected 1, got 2"),
        (None, lambda said: said | {"kind": "Shape"}, "kind: expected 'Workspace', got 'Shape'"),
        (None, lambda said: said | {"values": [1]}, r"values: expected shapes by name, got \[1\]"),
        (None, lambda said: said | {"values": {"energy": "x"}}, "energy: expected a shape, got"),
        (None, lambda said: said | {"robot": 3}, "robot: file: expected a table"),
        (lambda t: t.drop_columns("energy"), None, "energy: the column is missing"),
        (lambda t: t.drop_columns("status"), None, "status: the column is missing"),
        (
            lambda t: t.drop_columns("frames").append_column("frames", t["energy"]),
            None,
            "frames: expected 9 lists of 144 numbers, got ",
        ),
        (
            lambda t: t.drop_columns("tip x [m]").append_column("tip x [m]", t["status"]),
            None,
            "tips: expected numbers",
        ),
    ],
)
def test_changed_parquet_says_where_it_is_wrong(change, header, text, tmp_path):
    path, _ = rewritten(tmp_path, change or (lambda table: table), header or (lambda said: said))
    with pytest.raises(tdcr.InvalidInput, match=text) as error:
        tdcr.Workspace.load(path)
    assert str(error.value).startswith(str(path))


def test_damaged_parquet_is_refused(tmp_path):
    """A changed byte of the pages of numbers, too: they carry checksums."""
    pytest.importorskip("pyarrow")
    cloud = RESULTS["workspace"]()
    path = tmp_path / "w.parquet"
    cloud.save(path)
    raw = path.read_bytes()
    rng = np.random.default_rng(5)
    refused = 0
    # In front of the footer, whose length is in the last 8 bytes.
    end = len(raw) - 8 - int.from_bytes(raw[-8:-4], "little")
    for _ in range(200):
        changed = bytearray(raw)
        changed[rng.integers(end)] ^= 1 << rng.integers(8)
        path.write_bytes(changed)
        try:
            loaded, message = tdcr.Workspace.load(path), None
        except tdcr.InvalidInput as error:
            loaded, message = None, str(error)
        if message is None:
            assert loaded == cloud
        else:
            assert message.startswith(f"{path}: not a Parquet file, or one that is cut off")
            refused += 1
    assert refused > 100


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
