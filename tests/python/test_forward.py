"""The forward solve from Python: oracle, conventions, results, errors."""

import copy
import pickle

import numpy as np
import pytest

import tdcr

FREE = np.inf


def trunk(azimuths=(0.0, 2.0), n=10, **keywords):
    tendons = [tdcr.Tendon(azimuth, 0.01) for azimuth in azimuths]
    return tdcr.Robot(tdcr.Backbone(0.2, n), tendons, **keywords)


def solve(robot, displacements, **keywords):
    return tdcr.forward(robot, displacements, model="linkage", **keywords)


def exact_positions(bend, towards, n, length=0.2):
    """Return the disk centres of a chain of n links of equal bend (closed form)."""
    k = np.arange(n + 1)
    reach = length / n * np.sin(k * bend / 2) / np.sin(bend / 2)
    radial = reach * np.sin(k * bend / 2)
    return np.stack(
        [radial * np.cos(towards), radial * np.sin(towards), reach * np.cos(k * bend / 2)], axis=1
    )


def test_the_closed_form_is_met():
    rng = np.random.default_rng(1)
    for _ in range(200):
        azimuths = rng.uniform(-np.pi, np.pi) + np.array([0, rng.uniform(0.3, 2.8)])
        n = int(rng.integers(3, 60))
        total, towards = rng.uniform(0.05, 2.0), rng.uniform(*sorted(azimuths))
        pulls = total * 0.01 * np.cos(azimuths - towards)
        if pulls.min() < 1e-3 * 0.01 * n:
            continue
        shape = solve(trunk(azimuths, n), -pulls).require()
        exact = exact_positions(2 * np.arcsin(total / n / 2), towards, n)
        assert np.abs(shape.positions - exact).max() < 1e-12 * 0.2
        assert np.abs(shape.tendon_lengths - (0.2 - pulls)).max() < 1e-14


def test_a_pull_at_azimuth_zero_bends_towards_x_about_y():
    shape = solve(trunk([0.0]), [-0.005])
    assert shape.tip[0, 3] > 0.02
    assert abs(shape.tip[1, 3]) < 1e-16
    assert shape.strains[0] @ [0, 1, 0] > 0
    # The tip axis points towards +x.
    assert shape.tip[0, 2] == pytest.approx(np.sin(10 * shape.strains[0, 1]), rel=1e-12)


def test_results_fit_together():
    base = np.eye(4)
    base[:3, 3] = [1.0, 2.0, 3.0]
    robot = trunk(base=base)
    shape = solve(robot, [-0.004, -0.002])
    assert shape.frames.shape == (11, 4, 4)
    assert shape.positions.shape == (11, 3)
    assert shape.strains.shape == (10, 3)
    assert np.array_equal(shape.frames[0], base)
    assert np.array_equal(shape.frames[-1], shape.tip)
    assert np.array_equal(shape.frames[:, :3, 3], shape.positions)
    assert [points.shape for points in shape.tendon_points] == [(11, 3)] * 2
    for points, length in zip(shape.tendon_points, shape.tendon_lengths, strict=True):
        assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(length)
    hole = base @ [0.01, 0, 0, 1]
    assert np.allclose(shape.tendon_points[0][0], hole[:3], atol=1e-15)
    assert np.isnan(shape.tensions).all()
    assert shape.tensions.shape == (2,)
    assert shape.contacts == []
    assert shape.status is tdcr.Status.converged
    assert shape.status == "converged"
    assert shape.ok
    assert shape.message == ""
    assert 0 <= shape.residual < 1e-12
    assert shape.iterations > 0
    assert shape.model == "linkage"
    assert shape.robot == robot
    assert shape.displacements.tolist() == [-0.004, -0.002]
    bends = np.linalg.norm(shape.strains, axis=1)
    assert shape.energy == pytest.approx((bends**2 / 0.02 / 2).sum(), rel=1e-12)
    assert shape.units == "EI"
    assert shape.require() is shape
    assert repr(shape).startswith("<Shape converged: tip (")


def test_known_stiffness_gives_joules():
    backbone = tdcr.Backbone(0.2, 10, youngs_modulus=2e9, diameter=0.002)
    known = solve(tdcr.Robot(backbone, [tdcr.Tendon(0, 0.01)]), [-0.004])
    relative = solve(trunk([0.0]), [-0.004])
    stiffness = 2e9 * np.pi * 0.002**4 / 64
    assert known.units == "N"
    assert known.energy == pytest.approx(relative.energy * stiffness, rel=1e-12)


def test_arrays_are_read_only_and_built_once():
    shape = solve(trunk(), [-0.004, -0.002])
    for name in ("frames", "positions", "tip", "strains", "tendon_lengths", "tensions"):
        array = getattr(shape, name)
        assert getattr(shape, name) is array
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    assert shape.tendon_points[0] is shape.tendon_points[0]


def test_shapes_are_values():
    shape = solve(trunk(), [-0.004, FREE])
    for twin in (
        pickle.loads(pickle.dumps(shape)),
        copy.deepcopy(shape),
        solve(trunk(), [-0.004, FREE]),
    ):
        assert twin == shape
        assert hash(twin) == hash(shape)
        assert np.array_equal(twin.frames, shape.frames)
        assert twin.status is shape.status
    assert solve(trunk(), [-0.005, FREE]) != shape
    failed = solve(trunk(), [-0.19, 0.0])
    twin = pickle.loads(pickle.dumps(failed))
    assert twin.message == failed.message != ""
    assert twin.status is tdcr.Status.infeasible


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda d: np.array(d)[::-1][::-1]])
def test_displacements_may_be_any_sequence(kind):
    assert solve(trunk(), kind([-0.004, -0.002])) == solve(trunk(), [-0.004, -0.002])


def test_integers_and_single_precision_are_numbers():
    assert solve(trunk(), [0, 0]).ok
    single = solve(trunk(), np.array([-0.004, -0.002], dtype=np.float32))
    assert single.ok


@pytest.mark.parametrize(
    ("displacements", "words"),
    [
        ([-0.001], "2 values, one per tendon, got 1"),
        ([-0.001] * 3, "got 3"),
        ([], "got 0"),
        ([np.nan, 0], "got NaN for tendon 't0'"),
        ([0, -np.inf], "got -inf for tendon 't1'"),
        ([[-0.001, 0], [0, 0]], "forward_batch takes (B, 2)"),
        (np.zeros((1, 1, 2)), "got shape (1, 1, 2)"),
        (-0.001, "got shape ()"),
        ([[1], [2, 3]], "rectangular"),
    ],
)
def test_bad_displacements_are_said(displacements, words):
    with pytest.raises(tdcr.InvalidInput) as caught:
        solve(trunk(), displacements)
    assert caught.value.argument == "displacements"
    assert words in str(caught.value)


@pytest.mark.parametrize("displacements", ["pull", ["a", "b"], [None, 0], [1j, 0], [True, False]])
def test_displacements_of_other_types_are_type_errors(displacements):
    with pytest.raises(TypeError, match="displacements"):
        solve(trunk(), displacements)


def test_the_model_is_the_rod_by_default_and_must_be_known():
    assert tdcr.forward(trunk(), [-0.001, 0]).model == "rod"
    assert tdcr.forward_batch(trunk(), [[-0.001, 0]]).model == "rod"
    with pytest.raises(
        tdcr.InvalidInput, match=r'model: expected "rod", .* or .*, got "rubber"'
    ) as caught:
        tdcr.forward(trunk(), [0, 0], model="rubber")
    assert caught.value.argument == "model"
    with pytest.raises(TypeError, match="settings: expected LinkageSettings"):
        solve(trunk(), [0, 0], settings={"max_iterations": 3})
    with pytest.raises(TypeError, match="robot"):
        solve("trunk", [0, 0])


def test_two_linkage_tendons_on_one_azimuth_are_refused():
    twins = trunk([0.3, 0.3])
    with pytest.raises(tdcr.InvalidInput, match="'t0' and 't1'") as caught:
        solve(twins, [-0.002, -0.001])
    assert caught.value.argument == "displacements"


def test_pre_bent_backbones_are_refused():
    bent = tdcr.Backbone(0.2, 2, rest=[[0, 0.1, 0], [0, 0.1, 0]])
    with pytest.raises(tdcr.InvalidInput, match="straight at rest"):
        solve(tdcr.Robot(bent, [tdcr.Tendon(0, 0.01)]), [-0.001])


def test_out_of_reach_is_an_outcome_with_disk_and_count():
    robot = trunk([0.0], n=4)
    shape = solve(robot, [-0.09])
    assert shape.status is tdcr.Status.infeasible
    assert not shape.ok
    assert "failed at disk 1" in shape.message
    assert "at least 5 subsegments" in shape.message
    assert np.isfinite(shape.frames).all()
    with pytest.raises(tdcr.NotConverged, match="infeasible: failed at disk 1") as caught:
        shape.require()
    assert caught.value.result is shape
    assert solve(trunk([0.0], n=5), [-0.09]).ok


def test_held_tendons_are_named():
    three = trunk([0, 2 * np.pi / 3, 4 * np.pi / 3])
    shape = solve(three, [-0.004, 0, 0])
    assert shape.status == "infeasible"
    assert "held at their rest length: 't1', 't2'" in shape.message
    assert solve(three, [-0.004, FREE, FREE]).ok
    assert solve(three, [-0.004, 0.002, 0.002]).ok
    assert solve(three, [-0.004, 5.0, FREE]).ok


def test_settings_are_used():
    shape = solve(trunk(), [-0.01, -0.004], settings=tdcr.LinkageSettings(max_iterations=1))
    assert shape.status is tdcr.Status.iteration_limit
    assert "max_iterations" in shape.message


def test_exceptions_pickle():
    with pytest.raises(tdcr.InvalidInput) as caught:
        solve(trunk(), [0])
    twin = pickle.loads(pickle.dumps(caught.value))
    assert (str(twin), twin.argument) == (str(caught.value), "displacements")
    error = tdcr.NotConverged("no", 3)
    assert pickle.loads(pickle.dumps(error)).result == 3
