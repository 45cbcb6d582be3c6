"""The strain-energy rod from Python: golden data, tensions, starts, warm batches."""

import json
import pickle
import threading
from pathlib import Path

import numpy as np
import pytest

import tdcr

FREE = np.inf
GOLDEN = json.loads((Path(__file__).parents[1] / "data" / "rod_unloaded.json").read_text())


def steel(length=0.2, n=10, **keywords):
    return tdcr.Backbone(length, n, youngs_modulus=200e9, diameter=0.001, **keywords)


def trunk(backbone=None, azimuths=(0.0, 2.0), **keywords):
    backbone = tdcr.Backbone(0.2, 10) if backbone is None else backbone
    return tdcr.Robot(backbone, [tdcr.Tendon(a, 0.01) for a in azimuths], **keywords)


def winding(backbone=None):
    """Return a robot with a helical, a converging and a short straight tendon."""
    backbone = tdcr.Backbone(0.2, 10) if backbone is None else backbone
    converging = tdcr.Tendon([2.0] * 11, np.linspace(0.012, 0.006, 11))
    tendons = [tdcr.Tendon.helical(0.0, 0.01, turns=0.4), converging, tdcr.Tendon(4.0, 0.01, end=6)]
    return tdcr.Robot(backbone, tendons)


def golden_robot(case):
    lengths = np.diff(case["disk_arclength"]).tolist()
    backbone = tdcr.Backbone(lengths, [1] * len(lengths), poisson_ratio=case["poisson_ratio"])
    tendons = []
    for holes, end in zip(case["holes"], case["end"], strict=True):
        x, y = np.array(holes)[: end + 1, :2].T
        tendons.append(tdcr.Tendon(np.arctan2(y, x), np.hypot(x, y), end=end))
    return tdcr.Robot(backbone, tendons)


# --- the answer --------------------------------------------------------------------------------


@pytest.mark.parametrize("case", GOLDEN["cases"], ids=lambda case: case["id"])
def test_the_independent_solver_is_met_at_every_disk(case):
    displacements = np.where(case["taut"], case["displacement"], FREE)
    settings = tdcr.RodSettings(elements=case["elements"])
    shape = tdcr.forward(golden_robot(case), displacements, settings=settings).require()
    # The data has ten digits; its length is 0.2 m per segment.
    assert np.abs(shape.frames[:, :3] - case["frames"]).max() < 1e-8 * 0.2
    assert shape.residual < 1e-11
    assert shape.strains.shape == (case["elements"] * (len(shape.frames) - 1), 3)
    # One segment with three taut tendons: any tensions that push along its axis too.
    if not all(case["taut"]):
        tensions = np.array(case["tension"])
        off = np.abs(shape.tensions * case["EI"] - tensions).max()
        assert off < 1e-6 * tensions.max()


def test_a_single_pull_bends_towards_its_tendon():
    for azimuth in (0.0, 1.0, np.pi, 4.0):
        shape = tdcr.forward(trunk(azimuths=[azimuth]), [-0.005]).require()
        towards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        assert shape.model == "rod"
        assert shape.tip[:3, 3] @ towards > 0.04
        assert abs(np.cross(shape.tip[:3, 3], towards)[2]) < 1e-14
        assert shape.tensions[0] > 0
        # Constant curvature; the length of the tendon is what was asked for.
        assert np.ptp(shape.strains, axis=0).max() < 1e-14
        assert shape.tendon_lengths[0] == pytest.approx(0.195, rel=1e-11)


def test_units_follow_the_material():
    """Shape does not depend on the stiffness; tensions and energy grow with it."""
    stiffness = 200e9 * np.pi * 0.001**4 / 64
    relative = tdcr.forward(winding(), [-0.006, -0.004, FREE]).require()
    known = tdcr.forward(winding(steel()), [-0.006, -0.004, FREE]).require()
    assert (relative.units, known.units) == ("EI", "N")
    assert np.allclose(known.frames, relative.frames, rtol=0, atol=1e-13)
    assert known.tensions == pytest.approx(relative.tensions * stiffness, rel=1e-9)
    assert known.energy == pytest.approx(relative.energy * stiffness, rel=1e-9)
    thrice = tdcr.Backbone(0.2, 10, youngs_modulus=600e9, diameter=0.001)
    stiffer = tdcr.forward(winding(thrice), [-0.006, -0.004, FREE]).require()
    assert stiffer.tensions == pytest.approx(3 * known.tensions, rel=1e-9)


def test_the_energy_is_that_of_the_strains():
    shape = tdcr.forward(winding(steel(poisson_ratio=0.3)), [-0.006, -0.004, FREE]).require()
    weights = np.array([1.0, 1.0, 1 / 1.3]) * 200e9 * np.pi * 0.001**4 / 64 / 0.02
    assert shape.energy == pytest.approx((0.5 * shape.strains**2 * weights).sum(), rel=1e-12)


def test_the_tensions_are_the_slope_of_the_energy():
    robot, step = winding(steel()), 1e-6
    shape = tdcr.forward(robot, [-0.006, -0.004, FREE]).require()
    assert (shape.tensions[:2] > 0).all()
    for k in range(2):
        ends = []
        for sign in (1, -1):
            displacements = np.array([-0.006, -0.004, FREE])
            displacements[k] += sign * step
            ends.append(tdcr.forward(robot, displacements).require().energy)
        assert (ends[1] - ends[0]) / (2 * step) == pytest.approx(shape.tensions[k], rel=1e-6)


def test_free_and_released_tendons_do_nothing():
    alone = tdcr.forward(trunk(azimuths=[0.0]), [-0.005])
    for other in (FREE, 0.02, 3.0):
        shape = tdcr.forward(trunk(), [-0.005, other]).require()
        assert np.allclose(shape.frames, alone.frames, rtol=0, atol=1e-13)
        assert shape.tensions == pytest.approx([alone.tensions[0], 0.0], rel=1e-9, abs=0)


@pytest.mark.parametrize("load", [[FREE, FREE, FREE], [0.001, FREE, 2.0], [0.0, 0.0, 0.0]])
@pytest.mark.parametrize("elements", [1, 3])
def test_with_nothing_pulled_the_shape_is_that_of_rest(load, elements):
    bent = np.random.default_rng(1).uniform(-0.2, 0.2, (10, 3))
    robot = winding(tdcr.Backbone(0.2, 10, rest=bent))
    shape = tdcr.forward(robot, load, settings=tdcr.RodSettings(elements=elements)).require()
    assert np.array_equal(shape.strains, np.repeat(bent / elements, elements, axis=0))
    assert np.allclose(shape.frames, robot.rest_frames, rtol=0, atol=1e-15)
    assert shape.tensions.tolist() == [0, 0, 0]
    assert (shape.energy, shape.iterations) == (0, 0)


def test_the_base_carries_the_shape_along():
    base = np.eye(4)
    base[:3] = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]]
    moved = tdcr.forward(trunk(base=base), [-0.004, -0.002])
    assert np.allclose(
        moved.frames, base @ tdcr.forward(trunk(), [-0.004, -0.002]).frames, rtol=0, atol=1e-14
    )


def test_a_pull_that_nothing_follows_is_an_outcome():
    shape = tdcr.forward(trunk(), [-0.25, FREE])
    assert shape.status is tdcr.Status.infeasible
    assert shape.message
    assert np.isfinite(shape.frames).all()
    with pytest.raises(tdcr.NotConverged) as caught:
        shape.require()
    assert caught.value.result is shape


def test_iterations_are_limited():
    settings = tdcr.RodSettings(max_iterations=1)
    shape = tdcr.forward(winding(), [-0.01, -0.004, FREE], settings=settings)
    assert shape.status is tdcr.Status.iteration_limit


# --- tensions and starts -------------------------------------------------------------------------


@pytest.mark.parametrize("backbone", [None, steel(), steel(rest=[[0.1, -0.05, 0.02]] * 10)])
@pytest.mark.parametrize(
    "settings", [None, tdcr.RodSettings(elements=2), tdcr.RodSettings(subsegment="link")]
)
def test_tensions_and_displacements_say_the_same(backbone, settings):
    robot = winding(backbone)
    pulled = tdcr.forward(robot, [-0.006, -0.004, FREE], settings=settings).require()
    assert (pulled.tensions[:2] > 0).all()
    drawn = tdcr.forward(robot, tensions=pulled.tensions, settings=settings).require()
    assert np.allclose(drawn.frames, pulled.frames, rtol=0, atol=1e-10)
    assert drawn.tensions == pytest.approx(pulled.tensions, rel=1e-14, abs=0)
    assert drawn.displacements[:2] == pytest.approx([-0.006, -0.004], abs=1e-11)
    assert np.isfinite(drawn.displacements).all()
    back = tdcr.forward(robot, drawn.displacements, settings=settings).require()
    assert np.allclose(back.frames, drawn.frames, rtol=0, atol=1e-9)
    assert back.energy == pytest.approx(drawn.energy, rel=1e-9)


def test_no_tension_is_rest():
    robot = winding(steel(rest=[[0.1, -0.05, 0.02]] * 10))
    shape = tdcr.forward(robot, tensions=[0.0, -0.0, 0]).require()
    assert not np.signbit(shape.tensions).any()
    assert shape.displacements.tolist() == [0, 0, 0]
    assert np.allclose(shape.frames, robot.rest_frames, rtol=0, atol=1e-15)


def test_tensions_beyond_buckling_are_infeasible():
    three = trunk(azimuths=[0, 2 * np.pi / 3, 4 * np.pi / 3])
    # A straight rod stops being a minimum at a sum of 12 EI / l^2 per arc subsegment.
    limit = 12 / 0.02**2 / 3
    assert tdcr.forward(three, tensions=[0.99 * limit] * 3).ok
    for beyond in (1.01 * limit, 1e300):
        shape = tdcr.forward(three, tensions=[beyond] * 3)
        assert shape.status is tdcr.Status.infeasible
        assert "buckles" in shape.message
        assert np.isfinite(shape.displacements).all()
    few = tdcr.RodSettings(max_iterations=1)
    shape = tdcr.forward(winding(), tensions=[50.0, 3.0, 0.0], settings=few)
    assert shape.status is tdcr.Status.iteration_limit
    assert "max_iterations" in shape.message


def test_a_start_gives_the_same_shape_in_fewer_steps():
    robot, settings = winding(), tdcr.RodSettings(elements=2)
    near = tdcr.forward(robot, [-0.0100, -0.007, FREE], settings=settings).require()
    cold = tdcr.forward(robot, [-0.0101, -0.007, FREE], settings=settings).require()
    for start in (near, pickle.loads(pickle.dumps(near))):
        warm = tdcr.forward(robot, [-0.0101, -0.007, FREE], settings=settings, start=start)
        assert 0 < warm.require().iterations < cold.iterations
        assert np.allclose(warm.frames, cold.frames, rtol=0, atol=1e-11)
        assert warm.tensions == pytest.approx(cold.tensions, rel=1e-7)
    again = tdcr.forward(robot, [-0.01, -0.007, FREE], settings=settings, start=near)
    assert again.iterations == 0


def test_a_start_s_tendon_that_is_let_go_keeps_no_tension():
    robot = winding()
    start = tdcr.forward(robot, [-0.006, -0.004, FREE]).require()
    assert start.tensions[1] > 0
    cold = tdcr.forward(robot, [-0.006, FREE, FREE]).require()
    warm = tdcr.forward(robot, [-0.006, FREE, FREE], start=start).require()
    assert warm.tensions[1] == 0
    assert np.allclose(warm.frames, cold.frames, rtol=0, atol=1e-11)


def test_a_start_that_failed_is_no_harm():
    robot = trunk()
    failed = tdcr.forward(robot, [-0.25, FREE])
    assert not failed.ok
    shape = tdcr.forward(robot, [-0.005, FREE], start=failed).require()
    cold = tdcr.forward(robot, [-0.005, FREE])
    assert np.allclose(shape.frames, cold.frames, rtol=0, atol=1e-11)


# --- batches -------------------------------------------------------------------------------------

FIELDS = ("tip", "strains", "tendon_points", "tendon_lengths", "tensions", "energy")


def path(count=300):
    """Pulls along a smooth path, some rows out of reach and some with another tendon free."""
    t = np.linspace(0, 3, count)[:, None]
    rows = -0.006 * np.sin(t + np.array([0.0, 0.5, 1.0])).clip(0)
    rows[:, 1] = FREE
    rows[100:150, 1] = 0.7 * rows[100:150, 0]
    rows[100:150, 2] = FREE
    rows[70::90, 0] = -0.25
    return rows


@pytest.mark.slow
@pytest.mark.parametrize("warm", [False, True])
def test_rows_of_a_batch_are_shapes_to_the_bit(warm):
    robot, settings = winding(steel()), tdcr.RodSettings(elements=2)
    batch = tdcr.forward_batch(robot, path(), settings=settings, fields=FIELDS, warm=warm)
    assert batch.strains.shape == (300, 20, 3)
    assert batch.warm is warm
    assert not batch.ok[70::90].any()
    assert batch.ok.sum() == 300 - 3
    for i in range(300):
        shape = batch[i]
        if not warm:
            assert shape == tdcr.forward(robot, path()[i], settings=settings)
        for name in ("tip", "strains", "tendon_lengths", "tensions", "energy", "iterations"):
            assert np.array_equal(getattr(batch, name)[i], getattr(shape, name)), (i, name)
        assert (batch.status[i], batch.residual[i]) == (shape.status, shape.residual)
        assert np.array_equal(shape.displacements, path()[i])
        assert np.array_equal(batch.tendon_points[2][i], shape.tendon_points[2])


def test_warm_rows_are_those_of_cold_starts_in_fewer_steps():
    cold = tdcr.forward_batch(winding(steel()), path(), fields=("frames", "tensions"))
    warm = tdcr.forward_batch(winding(steel()), path(), fields=("frames", "tensions"), warm=True)
    assert (warm.status == cold.status).all()
    ok = cold.ok
    assert np.abs(warm.frames - cold.frames)[ok].max() < 1e-9
    assert np.abs(warm.tensions - cold.tensions)[ok].max() < 1e-7 * cold.tensions[ok].max()
    assert warm.iterations[ok].sum() < 0.8 * cold.iterations[ok].sum()
    assert np.array_equal(warm.frames[::64], cold.frames[::64])
    assert np.array_equal(warm.frames[71], cold.frames[71])  # after a row that failed


@pytest.mark.parametrize("warm", [False, True])
def test_threads_do_not_matter(warm):
    solve = [
        tdcr.forward_batch(winding(), path(1000), fields=FIELDS, warm=warm, threads=threads)
        for threads in (1, 2, 7)
    ]
    assert solve[0] == solve[1] == solve[2]


def test_warm_and_cold_batches_are_different_values():
    rows = path(10)
    warm, cold = (tdcr.forward_batch(winding(), rows, warm=warm) for warm in (True, False))
    assert warm != cold
    twin = pickle.loads(pickle.dumps(warm))
    assert twin == warm
    assert twin[9] == warm[9]
    assert warm[2:4] == [warm[2], warm[3]]
    with pytest.raises(IndexError):
        warm[10]
    assert len(tdcr.forward_batch(winding(), np.zeros((0, 3)), warm=True)) == 0


def test_progress_is_told_of_warm_batches():
    told = []
    tdcr.forward_batch(winding(), path(5000), warm=True, progress=told.append)
    assert told[-1] == 5000


def test_many_settings_on_many_threads():
    """More settings than plans are kept, from several threads at once."""
    robot = winding()
    answers = {}

    def solve(elements):
        for _ in range(20):
            settings = tdcr.RodSettings(elements=elements)
            shape = tdcr.forward(robot, [-0.006, FREE, FREE], settings=settings)
            answers.setdefault(elements, set()).add(shape.tip.tobytes())

    threads = [threading.Thread(target=solve, args=[1 + i % 12]) for i in range(24)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(answers) == 12
    assert all(len(tips) == 1 for tips in answers.values())
    assert len(set.union(*answers.values())) == 12


# --- values --------------------------------------------------------------------------------------


def test_shapes_and_settings_pickle():
    settings = tdcr.RodSettings(subsegment="link", elements=2, tolerance=1e-9, max_iterations=70)
    twin = pickle.loads(pickle.dumps(settings))
    assert twin == settings
    assert hash(twin) == hash(settings)
    assert eval(repr(settings), {"RodSettings": tdcr.RodSettings}) == settings
    assert settings != tdcr.RodSettings()
    shape = tdcr.forward(winding(steel()), [-0.006, FREE, FREE], settings=settings)
    again = pickle.loads(pickle.dumps(shape))
    assert again == shape
    assert np.array_equal(again.tensions, shape.tensions)
    assert (again.units, again.energy) == ("N", shape.energy)


def test_links_and_arcs_come_together():
    """Both converge with order 2 in the number of subsegments."""
    off = []
    for n in (10, 20, 40):
        robot = tdcr.Robot(tdcr.Backbone(0.2, n), [tdcr.Tendon.helical(0.0, 0.01, turns=0.4)])
        arc, link = (
            tdcr.forward(robot, [-0.006], settings=tdcr.RodSettings(subsegment=name)).require()
            for name in ("arc", "link")
        )
        off.append(np.abs(arc.tip - link.tip).max())
    assert off[0] > 1e-5
    assert 3.5 < off[0] / off[1] < 4.5
    assert 3.5 < off[1] / off[2] < 4.5


def test_pictures_show_rods():
    pytest.importorskip("matplotlib")
    shape = tdcr.forward(winding(), [-0.006, 0.02, FREE])
    ax = shape.plot()
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "rod model, converged" in ax.get_title()
    assert "slack" not in labels[0]
    assert "slack" in labels[1]
    assert "free" in labels[2]
    ax.figure.clear()
