"""forward_batch: every row, in order, interruptible, the same on any number of threads."""

import os
import pickle
import subprocess
import sys
import textwrap
from functools import partial

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr

ROBOT = tdcr.Robot(tdcr.Backbone(0.2, 8), [tdcr.Tendon(0.0, 0.01), tdcr.Tendon(2.0, 0.01, end=5)])
FIELDS = (
    "tip",
    "frames",
    "positions",
    "strains",
    "tendon_points",
    "tendon_lengths",
    "tensions",
    "energy",
)


def rows(count=200):
    displacements = -np.random.default_rng(3).uniform(0, 0.01, (count, 2))
    displacements[::11, 0] = -0.17
    displacements[5] = np.inf
    return displacements


def solve(displacements, **keywords):
    return tdcr.forward_batch(ROBOT, displacements, model="linkage", **keywords)


def test_rows_equal_single_solves():
    displacements = rows()
    batch = solve(displacements, fields=FIELDS)
    assert len(batch) == 200
    assert batch.fields == FIELDS
    for i in range(200):
        shape = batch[i]
        assert shape == tdcr.forward(ROBOT, displacements[i], model="linkage")
        for name in ("tip", "frames", "positions", "strains", "tendon_lengths"):
            assert np.array_equal(getattr(batch, name)[i], getattr(shape, name)), name
        for mine, theirs in zip(batch.tendon_points, shape.tendon_points, strict=True):
            assert np.array_equal(mine[i], theirs)
        assert batch.energy[i] == shape.energy
        assert batch.status[i] is shape.status
        assert batch.ok[i] == shape.ok
        assert batch.iterations[i] == shape.iterations
        assert batch.residual[i] == shape.residual
    assert not batch.ok[::11].any()
    assert (batch.status == "infeasible").sum() == (~batch.ok).sum()
    assert [points.shape for points in batch.tendon_points] == [(200, 9, 3), (200, 6, 3)]
    assert batch.tensions.shape == (200, 2)


def test_the_answer_does_not_depend_on_threads():
    one = solve(rows(1000), threads=1, fields="frames")
    many = solve(rows(1000), threads=7, fields="frames")
    assert np.array_equal(one.frames, many.frames)
    assert (one.status == many.status).all()


def test_only_named_fields_are_computed():
    batch = solve(rows())
    assert batch.fields == ("tip",)
    with pytest.raises(AttributeError, match=r"energy: not computed.*fields=\('tip', 'energy'\)"):
        _ = batch.energy
    with pytest.raises(AttributeError, match="no attribute 'shapes'"):
        _ = batch.shapes
    assert "tip" in dir(batch)
    assert not hasattr(batch, "energy")


def test_results_are_read_only_and_apart_from_the_input():
    displacements = rows()
    batch = solve(displacements)
    with pytest.raises(ValueError, match="read-only"):
        batch.tip[...] = 0
    before = batch.displacements.copy()
    displacements[:] = 0
    assert np.array_equal(batch.displacements, before)


def test_batches_behave_as_sequences():
    batch = solve(rows(30))
    assert batch[-1] == batch[29]
    assert [shape.ok for shape in batch[3:9]] == batch.ok[3:9].tolist()
    with pytest.raises(IndexError):
        batch[30]
    assert repr(batch) == "<ShapeBatch of 30 rows, 27 converged: fields tip, model 'linkage'>"
    twin = pickle.loads(pickle.dumps(batch))
    assert np.array_equal(twin.tip, batch.tip)
    assert twin[4] == batch[4]


def test_batches_are_values():
    batch = solve(rows(30), fields=FIELDS)
    twin = pickle.loads(pickle.dumps(batch))
    assert twin == batch
    assert hash(twin) == hash(batch)
    assert batch != solve(rows(30), fields="tip")
    assert batch != solve(rows(29), fields=FIELDS)
    assert batch != "batch"
    for change in (lambda: setattr(batch, "robot", None), lambda: delattr(batch, "model")):
        with pytest.raises(AttributeError, match="cannot be changed"):
            change()


def test_empty_batches_are_fine():
    batch = solve(np.zeros((0, 2)), fields=FIELDS)
    assert len(batch) == 0
    assert batch.tip.shape == (0, 4, 4)


@pytest.mark.parametrize(
    ("argument", "words", "call"),
    [
        ("displacements", "forward takes (2,)", lambda: solve([-0.001, 0])),
        ("displacements", "one column per tendon", lambda: solve(np.zeros((4, 3)))),
        ("displacements", "got shape (1, 4, 2)", lambda: solve(np.zeros((1, 4, 2)))),
        (
            "displacements",
            "got NaN for tendon 't1' in row 2",
            lambda: solve([[0, 0], [0, 0], [0, np.nan]]),
        ),
        ("fields", "got 'shape'", lambda: solve(rows(), fields=("tip", "shape"))),
        ("threads", "got 0", lambda: solve(rows(), threads=0)),
        ("threads", "got -4", lambda: solve(rows(), threads=-4)),
        ("threads", "got 10000000", lambda: solve(rows(), threads=10**30)),
        ("displacements", "rectangular", lambda: solve([[0, 0], [1]])),
    ],
)
def test_bad_input_is_said(argument, words, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument
    assert words in str(caught.value)


def test_wrong_types_are_type_errors():
    with pytest.raises(TypeError, match="displacements"):
        solve([["a", "b"]])
    with pytest.raises(TypeError):
        solve(rows(), threads="all")


def test_progress_is_told_up_to_the_end():
    told = []
    solve(rows(20_000), progress=told.append)
    assert told[-1] == 20_000
    assert told == sorted(told)


def test_an_exception_from_progress_stops_the_batch():
    asked = []
    far = tdcr.SignedDistance(lambda x: asked.append(x) or float(x[0]) + 1.0)
    robot = tdcr.Robot(tdcr.Backbone(0.2, 8), [tdcr.Tendon(0.0, 0.01)])
    solve = partial(tdcr.forward_batch, robot, obstacles=far, threads=1)
    solve([[-0.002]])
    of_one = len(asked)

    def refuse(done):
        asked.clear()
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        solve(np.full((100_000, 1), -0.002), progress=refuse)
    # The row that was at work is the last.
    assert len(asked) <= 2 * of_one


def test_progress_bar_goes_to_stderr():
    code = """
        import numpy as np, tdcr
        robot = tdcr.Robot(tdcr.Backbone(0.2, 8), [tdcr.Tendon(0.0, 0.01)])
        tdcr.forward_batch(robot, np.full((5, 1), -0.001), model="linkage", progress=True)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=True
    )
    assert "5/5" in done.stderr
    assert done.stdout == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    "call",
    [
        'tdcr.forward_batch(robot, np.full((40_000, 1), -0.01), model="linkage")',
        "tdcr.forward_batch(robot, np.full((400_000, 1), -0.01))",
        "tdcr.forward_batch(robot, np.full((400_000, 1), -0.01), warm=True)",
        # One solve, of 300,000 unknowns.
        "tdcr.forward(large, [-0.03], settings=fine)",
        "tdcr.jacobian(large, [-0.03], settings=fine)",
        "tdcr.forward_batch(large, [[-0.03]], settings=fine)",
        # Out of reach: every row takes all its starts.
        'tdcr.inverse_batch(finger, np.full((40_000, 3), 0.5), model="constant_curvature")',
        'tdcr.track(finger, np.full((40_000, 3), 0.5), model="constant_curvature")',
        'tdcr.inverse(finger, [0.5] * 3, model="constant_curvature", search=endless)',
        'tdcr.inverse_solutions(finger, [0.5] * 3, model="constant_curvature", search=endless)',
    ],
)
def test_ctrl_c_interrupts_long_calls(call):
    setup = """
        import numpy as np, tdcr
        helix = tdcr.Tendon.helical(0.0, 0.01, turns=0.3)
        robot = tdcr.Robot(tdcr.Backbone(1.0, 500), [helix])
        ends = [end for end in (3, 6, 9) for _ in range(3)]
        tendons = [tdcr.Tendon(2.1 * k, 0.01, end=end) for k, end in enumerate(ends)]
        finger = tdcr.Robot(tdcr.Backbone(0.2, 9), tendons)
        endless = tdcr.InverseSettings(starts=10**9)
        large = tdcr.Robot(tdcr.Backbone(1.0, 2000), [helix])
        fine = tdcr.RodSettings(elements=50)
    """
    assert_interrupts(setup, call)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_batches_work_after_a_fork():
    code = """
        import os, sys
        import numpy as np, tdcr
        robot = tdcr.Robot(tdcr.Backbone(0.2, 8), [tdcr.Tendon(0.0, 0.01)])
        rows = np.full((5000, 1), -0.001)
        before = tdcr.forward_batch(robot, rows, model="linkage").tip
        child = os.fork()
        if child == 0:
            after = tdcr.forward_batch(robot, rows, model="linkage").tip
            os._exit(0 if np.array_equal(before, after) else 3)
        _, status = os.waitpid(child, 0)
        sys.exit(os.waitstatus_to_exitcode(status))
    """
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", textwrap.dedent(code)], timeout=300
    )
    assert done.returncode == 0
