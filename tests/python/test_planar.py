"""Planar trunks from Python: cables, shapes, angle functions, inverses, errors."""

import copy
import inspect
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr
from tdcr import _core, planar

TAU = 2 * np.pi
THREE = planar.PlanarTrunk([0.200, 0.150, 0.100], 0.060)
CABLES = [(0.170, 0.230), (0.170, 0.130), (0.130, 0.070)]
L1, L2 = 0.140, 0.120
# DESIGN: all solutions with |turn| up to 2 pi on the path of the paper.
PATH = {
    0: [(0.0, 0.0)],
    2: [(-0.324743, 1.682972), (0.731936, -1.831385)],
    4: [(-0.218664, 2.214672), (1.149471, -2.567076)],
    6: [(0.031414, 2.419806), (1.538991, -3.029328)],
    8: [(0.369117, 2.336526), (1.913319, -3.219822)],
}


def tips(l1, l2, turns):
    """Tips (..., 2) of turns (..., 2), without the package."""
    a, b = turns[..., 0] + 0j, turns[..., 1] + 0j

    def chord(t):
        small = np.abs(t) < 1e-5
        safe = np.where(small, 1, t)
        return np.where(small, 1 + 0.5j * t - t**2 / 6, (np.exp(1j * safe) - 1) / (1j * safe))

    tip = l1 * chord(a) + np.exp(1j * a) * l2 * chord(b)
    return np.stack([tip.real, tip.imag], -1)


def test_the_platforms_of_the_paper():
    shape = THREE.forward(CABLES)
    assert shape.turns[0] == pytest.approx(np.pi / 3, abs=1e-15)
    assert shape.positions[0] * 1e3 == pytest.approx([165.40, 95.49], abs=5e-3)
    assert np.array_equal(shape.relative_headings, shape.turns)
    assert shape.absolute_headings == pytest.approx(np.cumsum(shape.turns), abs=1e-15)
    assert shape.misfit[0] == pytest.approx(0.2 - 0.6 / np.pi, abs=1e-15)
    # The printed headings are absolute.
    printed = THREE.shape(np.diff([0, np.pi / 3, -0.486, np.pi / 3]))
    assert printed.tip * 1e3 == pytest.approx([382.77, 158.14], abs=5e-3)
    assert printed.misfit is None
    curve = printed.curve(1501)
    off = np.linalg.norm(curve.points * 1e3 - [294.05, 133.97], axis=1)
    assert curve.s[off.argmin()] * 1e3 == pytest.approx(348, abs=0.15)


def test_cables_back_and_forth():
    turns = np.array([1.0, -0.7, 0.2])
    for cables in ("chords", "arcs"):
        lengths = THREE.cable_lengths(turns, cables=cables)
        shape = THREE.forward(lengths, cables=cables)
        assert shape.turns == pytest.approx(turns, abs=1e-13)
        assert np.abs(shape.misfit).max() < 1e-14
    # A left turn shortens the left cable.
    assert lengths[0, 0] < lengths[0, 1]


def test_half_circles_are_chords():
    rng = np.random.default_rng(5)
    for _ in range(300):
        length = rng.uniform(0.05, 1.0)
        trunk = planar.PlanarTrunk([length], length * rng.uniform(0.01, 0.3))
        for turn in (np.pi, -np.pi):
            back = trunk.forward(trunk.cable_lengths([turn])).turns[0]
            assert back == pytest.approx(turn, abs=2e-6)
    trunk = planar.PlanarTrunk([0.21], 0.0342)
    assert trunk.forward(trunk.cable_lengths([np.pi])).turns[0] == pytest.approx(np.pi, abs=1e-7)


def test_curves_and_angles():
    shape = THREE.shape([1.0, -2.0, 0.5])
    curve = shape.curve(11)
    assert curve.points.shape == (33, 2)
    assert curve.error == 0.0
    assert curve.points[10::11] == pytest.approx(shape.positions, abs=1e-15)
    assert shape.angle(curve.s) == pytest.approx(curve.headings, abs=1e-14)
    assert shape.angle(0.1) == pytest.approx(0.5)
    # Section by section, spline and Simpson give the exact arcs.
    start = np.zeros(2)
    for function, end in zip(shape.angle_functions(), shape.positions, strict=True):
        sampled = function.curve(1000)
        assert start + sampled.points[-1] == pytest.approx(end, abs=1e-13)
        assert sampled.error < 1e-12
        start = end


def test_angle_functions_converge():
    def end(n, angle):
        s = np.linspace(0, 1, n + 1)
        return planar.AngleFunction(s, angle(s)).curve(20_000).points[-1]

    for order, angle in (
        (3, lambda s: 1.5 * s**2 + 0.3 * np.sin(2 * s)),
        (4, lambda s: 0.8 * s + 0.7 * np.sin(TAU * s)),
    ):
        fine = end(2000, angle)
        coarse, half = (np.linalg.norm(end(n, angle) - fine) for n in (40, 80))
        assert np.log2(coarse / half) == pytest.approx(order, abs=0.15)
    function = planar.AngleFunction([0.0, 0.1, 0.3], [0.0, 0.2, -0.1])
    assert isinstance(function(0.05), float)
    assert function([[0.0, 0.1], [0.3, 0.2]]).shape == (2, 2)
    assert function([0.0, 0.1, 0.3]) == pytest.approx([0.0, 0.2, -0.1], abs=1e-15)
    assert function.coefficients.shape == (2, 4)


@pytest.mark.parametrize("t", PATH)
def test_the_path_of_the_paper(t):
    x, y = 0.260 - 0.015 * t, 0.015 * t
    found = planar.two_section_solutions(L1, L2, x, y)
    assert found == pytest.approx(np.array(PATH[t]), abs=6e-7)
    assert tips(L1, L2, found) == pytest.approx(np.tile([x, y], (len(found), 1)), abs=1e-15)
    answer = planar.PlanarTrunk([L1, L2], 0.01).inverse(x, y)
    assert answer.ok
    assert answer.error <= 1e-12
    assert answer.turns == pytest.approx(found[0], abs=1e-6)
    if t == 8:
        assert len(planar.two_section_solutions(L1, L2, x, y, np.pi)) == 1


def test_no_solution_and_the_nearest():
    none = planar.two_section_solutions(L1, L2, 0.3, 0.1)
    assert none.shape == (0, 2)
    turns, distance = planar.two_section_nearest(L1, L2, 0.3, 0.1)
    assert distance == pytest.approx(np.linalg.norm(tips(L1, L2, turns) - [0.3, 0.1]), abs=1e-15)
    grid = np.stack(np.meshgrid(*2 * [np.linspace(-TAU, TAU, 801)]), -1)
    least = np.linalg.norm(tips(L1, L2, grid) - [0.3, 0.1], axis=-1).min()
    assert least - 1e-5 < distance <= least
    answer = planar.PlanarTrunk([L1, L2], 0.01).inverse(0.3, 0.1)
    assert answer.status == "unreachable"
    assert answer.error == pytest.approx(distance, abs=1e-12)
    with pytest.raises(tdcr.NotConverged, match="unreachable"):
        answer.require()


def test_batches_equal_single_targets():
    rng = np.random.default_rng(3)
    turns = rng.uniform(-TAU, TAU, (3000, 2))
    targets = tips(L1, L2, turns)
    targets[7] = [1.0, 1.0]
    batch = planar.two_section_batch(L1, L2, targets)
    assert batch.counts.sum() == len(batch.turns) == len(batch.row)
    assert batch.counts[7] == 0
    for i in (0, 7, 1234, 2999):
        single = planar.two_section_solutions(L1, L2, *targets[i])
        assert np.array_equal(batch.turns[batch.row == i], single)
    assert np.abs(tips(L1, L2, batch.turns) - targets[batch.row]).max() < 1e-13
    off = np.abs(batch.turns - turns[batch.row]).max(axis=1)
    least = np.full(len(turns), np.inf)
    np.minimum.at(least, batch.row, off)
    assert np.delete(least, 7).max() < 1e-6
    one = planar.two_section_batch(L1, L2, targets, threads=1)
    assert np.array_equal(one.turns, batch.turns)
    told = []
    planar.two_section_batch(L1, L2, targets, progress=told.append)
    assert told[-1] == 3000
    assert planar.two_section_batch(L1, L2, np.zeros((0, 2))).turns.shape == (0, 2)


def test_ctrl_c_interrupts_a_long_batch():
    setup = """
        import numpy as np
        from tdcr import planar
        targets = np.random.default_rng(0).uniform(-0.2, 0.2, (8_000_000, 2))
    """
    assert_interrupts(setup, "planar.two_section_batch(0.14, 0.12, targets)")


def test_inverses_of_many_sections():
    rng = np.random.default_rng(4)
    for m in (1, 2, 3, 5, 8):
        trunk = planar.PlanarTrunk(rng.uniform(0.05, 0.2, m), 0.01)
        made = trunk.shape(rng.uniform(-1, 1, m))
        heading = made.absolute_headings[-1] + TAU
        for wanted in (None, heading):
            answer = trunk.inverse(*made.tip, heading=wanted, limit=3.0).require()
            assert answer.error <= 1e-12
            assert answer.energy <= made.energy * (1 + 1e-9)
            assert answer.shape.tip == pytest.approx(made.tip, abs=2e-12)
            assert np.abs(answer.turns).max() <= 3.0
            if wanted is not None:
                assert abs(answer.heading_error) < 1e-10
                whole = (answer.shape.absolute_headings[-1] - heading) / TAU
                assert whole == pytest.approx(round(whole), abs=1e-9)
        again = trunk.inverse(*made.tip, heading=heading, limit=3.0)
        assert np.array_equal(again.turns, answer.turns)
    limited = planar.PlanarTrunk([0.1] * 4, 0.01).inverse(0.2, 0.2, limit=[0.5, 2, 2, 2])
    assert limited.ok
    assert abs(limited.turns[0]) <= 0.5


def test_objects_are_values():
    assert planar.PlanarTrunk((0.2, 0.15, 0.1), 0.06) == THREE
    assert hash(planar.PlanarTrunk((0.2, 0.15, 0.1), 0.06)) == hash(THREE)
    assert pickle.loads(pickle.dumps(THREE)) == THREE
    assert planar.PlanarTrunk(0.2, 0.06).lengths == (0.2,)
    assert len(THREE) == 3
    with pytest.raises(AttributeError):
        THREE.cable_distance = 1.0
    shape = THREE.forward(CABLES)
    for array in (shape.turns, shape.positions, shape.absolute_headings, shape.curve().points):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    twin = pickle.loads(pickle.dumps(shape))
    assert np.array_equal(twin.positions, shape.positions)
    assert "PlanarShape" in repr(shape)
    assert "converged" in repr(THREE.inverse(0.3, 0.1))


def results():
    shape = THREE.forward(CABLES)
    angle = planar.AngleFunction([0.0, 0.1, 0.3], [0.0, 0.2, -0.1])
    return [
        shape,
        THREE.shape([1.0, 0.5, 0.0]),
        angle,
        THREE.inverse(0.3, 0.1),
        THREE.inverse(0.3, 0.1, method="pso"),
        THREE.inverse_batch([(0.3, 0.1), (0.2, 0.2)]),
        THREE.inverse_batch([(0.3, 0.1), (0.2, 0.2)], method="pso"),
    ]


def test_results_are_values():
    made = results()
    for i, (first, again) in enumerate(zip(made, results(), strict=True)):
        for twin in (again, pickle.loads(pickle.dumps(first)), copy.deepcopy(first)):
            assert twin is not first
            assert twin == first
            assert hash(twin) == hash(first)
            arrays = [getattr(twin, field.name) for field in fields(twin)]
            for array in arrays:
                assert not isinstance(array, np.ndarray) or not array.flags.writeable
        assert first != "a result"
        assert [first == other for other in made] == [i == j for j in range(len(made))]
    shape, _, angle, answer = made[:4]
    for old, name in ((shape, "turns"), (angle, "angles"), (answer, "error")):
        with pytest.raises(AttributeError):
            setattr(old, name, 0.0)
    # NaN equals NaN, -0 equals 0.
    for nan in (np.nan, -np.nan):
        ones = replace(shape, misfit=np.array([0.0, nan, 1.0]), turns=np.array([0.0, nan, 1.0]))
        twos = replace(
            shape, misfit=np.array([-0.0, np.nan, 1.0]), turns=np.array([-0.0, np.nan, 1])
        )
        assert ones == twos
        assert hash(ones) == hash(twos)
    assert replace(answer, error=float("nan")) == replace(answer, error=float("nan"))
    assert replace(shape, misfit=None) != shape


def test_named_tuples_stay_read_only():
    made = [
        THREE.shape([1.0, 0.5, 0.0]).curve(5),
        planar.two_section_batch(L1, L2, [(0.2, 0.03)]),
        planar.two_section_nearest(L1, L2, 0.2, 0.03),
    ]
    for first in made:
        for twin in (pickle.loads(pickle.dumps(first)), copy.deepcopy(first)):
            assert type(twin) is type(first)
            for old, new in zip(first, twin, strict=True):
                assert np.array_equal(old, new)
                assert not isinstance(new, np.ndarray) or not new.flags.writeable


def test_defaults_are_those_of_the_core():
    parameters = inspect.signature(planar.PlanarTrunk.inverse).parameters
    batch = inspect.signature(planar.PlanarTrunk.inverse_batch).parameters
    for name, value in _core._planar_inverse_defaults().items():
        assert parameters[name].default == batch[name].default == value


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("lengths", lambda: planar.PlanarTrunk([], 0.06)),
        ("lengths[1]", lambda: planar.PlanarTrunk([0.1, 0.0], 0.06)),
        ("lengths", lambda: planar.PlanarTrunk([[0.1, 0.1]], 0.06)),
        ("cable_distance", lambda: planar.PlanarTrunk([0.1], np.nan)),
        ("cable_lengths", lambda: THREE.forward([(0.1, 0.1)])),
        ("cable_lengths", lambda: THREE.forward([0.1, 0.1, 0.1])),
        ("cable_lengths[2][1]", lambda: THREE.forward([(0.1, 0.1), (0.1, 0.1), (0.1, -0.1)])),
        ("cable_lengths[1]", lambda: THREE.forward([(0.1, 0.1), (0.1, 0.3), (0.1, 0.1)])),
        ("cables", lambda: THREE.forward(CABLES, cables="ropes")),
        ("turns", lambda: THREE.shape([0.0, 0.0])),
        ("turns[1]", lambda: THREE.shape([0.0, np.nan, 0.0])),
        ("turns[0]", lambda: THREE.cable_lengths([3.2, 0.0, 0.0])),
        ("points", lambda: THREE.shape([0, 0, 0]).curve(1)),
        ("nodes", lambda: THREE.shape([0, 0, 0]).angle_functions(1)),
        ("s", lambda: planar.AngleFunction([0.0], [0.0])),
        ("s[1]", lambda: planar.AngleFunction([0.1, 0.0], [0.0, 0.0])),
        ("angles", lambda: planar.AngleFunction([0.0, 0.1], [0.0])),
        ("angles[0]", lambda: planar.AngleFunction([0.0, 0.1], [np.inf, 0.0])),
        ("s", lambda: planar.AngleFunction([0, 1e-300, 1], [0, 1, 2])),
        ("s", lambda: planar.AngleFunction([-1.7e308, 1.7e308], [0, 1])),
        ("s", lambda: planar.AngleFunction([0.0, 0.1], [0.0, 1.0])([[0.1], 0.0])),
        ("turns", lambda: THREE.shape([[], 0, 0])),
        ("turns", lambda: THREE.cable_lengths([[], 0, 0])),
        ("lengths", lambda: planar.PlanarTrunk([[], 0.1], 0.06)),
        ("intervals", lambda: planar.AngleFunction([0.0, 0.1], [0.0, 1.0]).curve(0)),
        ("x", lambda: THREE.inverse(np.nan, 0.0)),
        ("y", lambda: THREE.inverse(0.0, np.inf)),
        ("heading", lambda: THREE.inverse(0.1, 0.0, heading=np.nan)),
        ("limit", lambda: THREE.inverse(0.1, 0.0, limit=0.0)),
        ("limit", lambda: THREE.inverse(0.1, 0.0, limit=[1.0, 1.0])),
        ("tolerance", lambda: THREE.inverse(0.1, 0.0, tolerance=0.0)),
        ("max_iterations", lambda: THREE.inverse(0.1, 0.0, max_iterations=0)),
        ("starts", lambda: THREE.inverse(0.1, 0.0, starts=-1)),
        ("method", lambda: THREE.inverse(0.1, 0.0, method="guess")),
        ("l1", lambda: planar.two_section_solutions(0.0, 0.1, 0.1, 0.0)),
        ("l2", lambda: planar.two_section_solutions(0.1, -0.1, 0.1, 0.0)),
        ("x", lambda: planar.two_section_solutions(0.1, 0.1, np.nan, 0.0)),
        ("limit", lambda: planar.two_section_solutions(0.1, 0.1, 0.1, 0.0, 6.3)),
        ("targets", lambda: planar.two_section_batch(0.1, 0.1, [0.1, 0.0])),
        ("targets", lambda: planar.two_section_batch(0.1, 0.1, [[0.1, np.nan]])),
        ("threads", lambda: planar.two_section_batch(0.1, 0.1, [[0.1, 0.0]], threads=0)),
        ("y", lambda: planar.two_section_nearest(0.1, 0.1, 0.1, np.nan)),
    ],
)
def test_bad_input_names_the_argument(argument, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    "call",
    [
        lambda: planar.PlanarTrunk(["a"], 0.06),
        lambda: planar.PlanarTrunk([0.1], "0.06"),
        lambda: planar.AngleFunction([0.0, 0.1], [0.0, 1.0])("a"),
        lambda: THREE.shape(["a", "b", "c"]),
        lambda: THREE.cable_lengths("abc"),
        lambda: THREE.inverse("0", 0.0),
        lambda: THREE.inverse(0.1, 0.0, starts=1.5),
        lambda: planar.two_section_solutions(0.1, 0.1, None, 0.0),
        lambda: planar.two_section_batch(0.1, 0.1, [["a", "b"]]),
    ],
)
def test_wrong_types_are_type_errors(call):
    with pytest.raises(TypeError):
        call()


@pytest.mark.parametrize("name", planar.__all__)
def test_public_names_are_documented(name):
    assert len(inspect.getdoc(getattr(planar, name)) or "") > 20
