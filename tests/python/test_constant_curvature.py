"""Constant curvature from Python: mapping, frames, robots, derivatives, errors."""

import pickle

import numpy as np
import pytest

import tdcr
from tdcr import constant_curvature as cc

EVEN = np.radians([0, 120, 240])


OVERFLOW = [1e308, -1e308] + [0.0] * 7


def robot(**keywords):
    ends = (10, 22, 30)
    tendons = [
        tdcr.Tendon(EVEN[k % 3] + k // 3 * np.pi / 4, 0.0045, end=ends[k // 3]) for k in range(9)
    ]
    return tdcr.Robot(tdcr.Backbone([0.06, 0.0625, 0.064], [10, 12, 8]), tendons, **keywords)


def solve(thing, displacements, **settings):
    chosen = tdcr.ConstantCurvatureSettings(**settings)
    return tdcr.forward(thing, displacements, model="constant_curvature", settings=chosen)


def test_the_seed_vector():
    given = cc.displacements_from_arc(5.0, np.radians(60), 0.1, EVEN, 0.008)
    assert given == pytest.approx([-0.002, -0.002, 0.004], abs=1e-18)
    arc = cc.arc_from_displacements(given, EVEN, 0.008, 0.1)
    assert isinstance(arc.kappa, float)
    assert arc.kappa == pytest.approx(5.0, rel=1e-14)
    assert arc.phi == pytest.approx(np.radians(60), rel=1e-14)
    assert arc.ell == 0.1
    assert np.abs(arc.residual).max() < 1e-17


def test_batches_and_the_clarke_form_agree():
    rng = np.random.default_rng(1)
    given = rng.normal(scale=0.003, size=(500, 3))
    arc = cc.arc_from_displacements(given, EVEN, 0.008, 0.1)
    x = -2 / 3 / 0.008 * given @ np.cos(EVEN)
    y = -2 / 3 / 0.008 * given @ np.sin(EVEN)
    assert arc.kappa == pytest.approx(np.hypot(x, y) / 0.1, rel=1e-12)
    assert arc.phi == pytest.approx(np.arctan2(y, x), rel=1e-12)
    back = cc.displacements_from_arc(arc.kappa, arc.phi, arc.ell, EVEN, 0.008)
    # What is left of three displacements is their mean.
    assert given - back == pytest.approx(arc.residual, abs=1e-16)
    assert arc.residual == pytest.approx(np.repeat(given.mean(1)[:, None], 3, 1), abs=1e-16)
    for i in (0, 7, 499):
        one = cc.arc_from_displacements(given[i], EVEN, 0.008, 0.1)
        assert (one.kappa, one.phi, one.ell) == (arc.kappa[i], arc.phi[i], arc.ell[i])


def test_extensible_segments():
    given = cc.displacements_from_arc(5.0, -2.0, 0.11, EVEN, 0.008, length=0.1)
    arc = cc.arc_from_displacements(given, EVEN, 0.008, 0.1, extensible=True)
    assert (arc.kappa, arc.phi, arc.ell) == pytest.approx((5.0, -2.0, 0.11), rel=1e-12)
    known = cc.arc_from_displacements(given, EVEN, 0.008, 0.1, ell=0.11)
    assert (known.kappa, known.phi, known.ell) == pytest.approx((5.0, -2.0, 0.11), rel=1e-12)


def test_straight_has_phi_zero_and_a_released_tendon_stays_straight():
    for given in ([0.0], [-0.0], [0.003], [np.inf]):
        arc = cc.arc_from_displacements(given, [2.0], 0.01, 0.1)
        assert (arc.kappa, arc.phi) == (0.0, 0.0)


def test_frames_start_and_end_every_segment():
    kappa, phi, ell = [5.0, 0.0, 12.0], [0.3, 1.0, -2.0], [0.1, 0.05, 0.08]
    frames = cc.frames(kappa, phi, ell, points=5)
    assert frames.shape == (15, 4, 4)
    assert np.array_equal(frames[0], np.eye(4))
    for tip, base in ((4, 5), (9, 10)):
        assert np.allclose(frames[tip], frames[base], atol=1e-16)
    # The second is straight: along the axis of the first tip.
    assert np.allclose(frames[9][:3, 3] - frames[5][:3, 3], 0.05 * frames[5][:3, 2], atol=1e-16)
    flat = cc.frames(kappa, phi, ell, points=5, layout="columns")
    assert flat.shape == (15, 16)
    assert np.array_equal(flat[7].reshape(4, 4).T, frames[7])
    base = np.eye(4)
    base[:3, 3] = [1, 2, 3]
    assert np.allclose(cc.frames(5.0, 0.3, 0.1, base=base)[0], base)


def test_the_jacobian_by_arc_parameters_agrees_with_differences():
    kappa, phi, ell = np.array([5.0, 0.0]), np.array([0.3, 1.0]), np.array([0.1, 0.05])
    exact = cc.jacobian(kappa, phi, ell)
    assert exact.shape == (6, 6)
    for i in range(2):
        for j, h in enumerate((1e-5, 1e-6, 1e-7)):
            moved = []
            for sign in (1, -1):
                parameters = [kappa.copy(), phi.copy(), ell.copy()]
                parameters[j][i] += sign * h if not (j == 0 and i == 1) else (sign + 1) * h
                moved.append(cc.frames(*parameters)[-1][:3, 3])
            difference = (moved[0] - moved[1]) / (2 * h)
            assert np.allclose(exact[:3, 3 * i + j], difference, atol=1e-6)


def test_robots_of_several_segments():
    rng = np.random.default_rng(2)
    trunk = robot()
    given = 0.002 * rng.normal(size=9)
    shape = solve(trunk, given)
    assert shape.ok
    assert shape.model == "constant_curvature"
    # Three per segment over-determine its two bends: least squares, and it says so.
    assert "least-squares" in shape.message
    off = given - (shape.tendon_lengths - trunk.rest_lengths)
    assert np.abs(off).max() / trunk.rest_lengths.min() < 3 * shape.residual
    consistent = shape.tendon_lengths - trunk.rest_lengths
    again = solve(trunk, consistent)
    assert again.message == ""
    assert np.allclose(again.frames, shape.frames, atol=1e-13)
    assert again.residual < 1e-14
    # Arcs: the turn is even within a segment, about an axis in the disk plane.
    turns = shape.strains[:10]
    assert np.allclose(turns, turns[0], atol=1e-15)
    assert np.array_equal(turns[:, 2], np.zeros(10))
    separate = solve(trunk, given, coupling="per_segment")
    assert not np.allclose(separate.tip, shape.tip)
    assert pickle.loads(pickle.dumps(shape)) == shape


def test_extensible_robots_have_elongations():
    trunk = robot()
    shape = solve(trunk, np.full(9, 0.003), coupling="per_segment", extensible=True)
    assert shape.strains.shape == (30, 4)
    assert shape.strains[0] == pytest.approx([0, 0, 0, 0.003 / 0.06], abs=1e-14)
    assert shape.tip[2, 3] == pytest.approx(0.1865 + 0.009, rel=1e-12)
    twin = pickle.loads(pickle.dumps(shape))
    assert twin == shape
    assert np.array_equal(twin.strains, shape.strains)


def test_batches_of_robots_equal_single_solves():
    trunk = robot()
    rows = 0.002 * np.random.default_rng(3).normal(size=(100, 9))
    rows[::7, 4] = np.inf
    settings = tdcr.ConstantCurvatureSettings(extensible=False)
    batch = tdcr.forward_batch(
        trunk, rows, model="constant_curvature", settings=settings, fields=("frames", "strains")
    )
    assert batch.ok.all()
    for i in (0, 1, 7, 99):
        assert np.array_equal(batch[i].frames, batch.frames[i])
        assert np.array_equal(batch[i].strains, batch.strains[i])
    stretched = tdcr.forward_batch(
        trunk,
        np.full((3, 9), 0.001),
        model="constant_curvature",
        settings=tdcr.ConstantCurvatureSettings(extensible=True),
        fields="strains",
    )
    assert stretched.strains.shape == (3, 30, 4)


@pytest.mark.parametrize("settings", [{}, {"coupling": "per_segment"}, {"extensible": True}])
@pytest.mark.parametrize("size", [0.0, 0.002])
def test_the_tip_jacobian_agrees_with_differences(settings, size):
    tool = np.eye(4)
    tool[2, 3] = 0.008
    trunk = robot(tool=tool)
    chosen = tdcr.ConstantCurvatureSettings(**settings)
    given = size * np.random.default_rng(4).normal(size=9)
    exact = tdcr.jacobian(trunk, given, model="constant_curvature", settings=chosen)
    assert exact.shape == (6, 9)
    for k in range(9):
        step = 1e-7 * np.eye(9)[k]
        up, down = (solve(trunk, given + s, **settings).tip @ tool for s in (step, -step))
        assert np.allclose(exact[:3, k], (up - down)[:3, 3] / 2e-7, atol=1e-6)
        spin = (up - down)[:3, :3] @ solve(trunk, given, **settings).tip[:3, :3].T / 2e-7
        assert np.allclose(exact[3:, k], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-5)


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("displacements", lambda: cc.arc_from_displacements([0, np.nan, 0], EVEN, 0.01, 0.1)),
        ("displacements", lambda: cc.arc_from_displacements([0, 0], EVEN, 0.01, 0.1)),
        ("displacements", lambda: cc.arc_from_displacements(0.0, EVEN, 0.01, 0.1)),
        ("radius", lambda: cc.arc_from_displacements([0, 0, 0], EVEN, 0.0, 0.1)),
        ("radius", lambda: cc.arc_from_displacements([0, 0, 0], EVEN, [0.01, 0.01], 0.1)),
        ("length", lambda: cc.arc_from_displacements([0, 0, 0], EVEN, 0.01, 0.0)),
        ("ell", lambda: cc.arc_from_displacements([0, 0, 0], EVEN, 0.01, 0.1, ell=-1.0)),
        ("ell", lambda: cc.arc_from_displacements([0, 0], EVEN[:2], 0.01, 0.1, extensible=True)),
        ("kappa", lambda: cc.frames(-1.0, 0.0, 0.1)),
        ("kappa", lambda: cc.frames(np.nan, 0.0, 0.1)),
        ("phi", lambda: cc.frames([1.0, 1.0], [0.0, 0.0, 0.0], 0.1)),
        ("ell", lambda: cc.frames(1.0, 0.0, 0.0)),
        ("points", lambda: cc.frames(1.0, 0.0, 0.1, points=1)),
        (
            "ell",
            lambda: cc.arc_from_displacements([0, 0, 0], EVEN, 0.01, 0.1, ell=0.1, extensible=True),
        ),
        ("displacements", lambda: cc.arc_from_displacements([[0, 0], [0]], EVEN, 0.01, 0.1)),
        ("radius", lambda: cc.arc_from_displacements([0, 0], [0, 1], [[0.1], []], 0.1)),
        ("kappa", lambda: cc.displacements_from_arc([[1, 2], [3]], 0, 1, EVEN, 0.01)),
        ("kappa", lambda: cc.displacements_from_arc(1e308, 0, 10, EVEN, 0.01)),
        ("kappa", lambda: cc.displacements_from_arc(1e149, 0, 10, EVEN, 1e200)),
        ("phi", lambda: cc.frames(1.0, [[0.0], [1.0, 2.0]], 0.1)),
        ("kappa", lambda: cc.frames([], 0.0, 0.1)),
        ("ell", lambda: cc.frames([1.0, 2.0], 0.0, [])),
        ("kappa", lambda: cc.frames(1e308, 0.0, 10.0)),
        ("kappa", lambda: cc.frames(1e151, 0.0, 1.0)),
        ("kappa", lambda: cc.jacobian(1e308, 0.0, 10.0)),
        ("ell", lambda: cc.jacobian(0.0, 0.0, 1e151)),
        ("points", lambda: cc.frames(1.0, 0.0, 0.1, points=10**13)),
        ("points", lambda: cc.frames(1.0, 0.0, 0.1, points=10**19)),
        ("points", lambda: cc.frames([1.0] * 4, 0.0, 0.1, points=10**18)),
        (
            "displacements",
            lambda: tdcr.jacobian(robot(), OVERFLOW, model="constant_curvature"),
        ),
        (
            "displacements",
            lambda: tdcr.jacobian(
                robot(),
                np.full(9, -1.0),
                model="constant_curvature",
                settings=tdcr.ConstantCurvatureSettings(extensible=True),
            ),
        ),
        ("layout", lambda: cc.frames(1.0, 0.0, 0.1, layout="rows")),
        ("base", lambda: cc.frames(1.0, 0.0, 0.1, base=2 * np.eye(4))),
        ("tool", lambda: cc.jacobian(1.0, 0.0, 0.1, tool=np.eye(3))),
        ("coupling", lambda: tdcr.ConstantCurvatureSettings(coupling="loose")),
        (
            "settings",
            lambda: tdcr.forward(
                robot(), np.zeros(9), model="linkage", settings=tdcr.ConstantCurvatureSettings()
            ),
        ),
        ("model", lambda: tdcr.jacobian(robot(), np.zeros(9), model="linkage")),
        ("displacements", lambda: tdcr.jacobian(robot(), np.zeros(8), model="constant_curvature")),
        (
            "robot.tendons[0]",
            lambda: solve(
                tdcr.Robot(tdcr.Backbone(0.1, 5), [tdcr.Tendon.helical(0.0, 0.01)]), [-0.001]
            ),
        ),
        (
            "settings.extensible",
            lambda: solve(
                tdcr.Robot(tdcr.Backbone(0.1, 5), [tdcr.Tendon(0.0, 0.01)]), [0], extensible=True
            ),
        ),
    ],
)
def test_bad_input_names_the_argument(argument, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument


def test_overflow_is_an_outcome():
    shape = solve(robot(), OVERFLOW)
    assert shape.status is tdcr.Status.numerical_error
    assert "overflow" in shape.message
    with pytest.raises(tdcr.InvalidInput, match="overflow"):
        cc.arc_from_displacements([1e308, -1e308, 1e308], EVEN, 0.01, 0.1)


def test_many_rows_equal_single_ones_and_bad_ones_are_named():
    rng = np.random.default_rng(5)
    given = rng.normal(scale=0.003, size=(20_000, 3))
    given[rng.random(given.shape) < 0.1] = np.inf
    arc = cc.arc_from_displacements(given, EVEN, 0.008, 0.1)
    for i in range(0, 20_000, 997):
        one = cc.arc_from_displacements(given[i], EVEN, 0.008, 0.1)
        assert (one.kappa, one.phi, one.ell) == (arc.kappa[i], arc.phi[i], arc.ell[i])
        assert np.array_equal(one.residual, arc.residual[i])
    back = cc.displacements_from_arc(arc.kappa, arc.phi, arc.ell, EVEN, 0.008)
    assert back.shape == given.shape
    given[17_000, 1] = np.nan
    with pytest.raises(tdcr.InvalidInput, match="row 17000") as caught:
        cc.arc_from_displacements(given, EVEN, 0.008, 0.1)
    assert caught.value.argument == "displacements"
