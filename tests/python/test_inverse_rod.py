"""The inverse of the rod: alone, many, along a path, bounds, bad input."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import tdcr
from tdcr import Bounds, InverseSettings, Status


def trunk(turns=0.0, segments=2, **keywords):
    """Return segments of 60 mm with three tendons each, which wind by so many turns per segment."""
    tendons = []
    for k in range(3 * segments):
        end = 10 * (k // 3 + 1)
        azimuth = 2 * np.pi * (k % 3) / 3 + 0.7 * (k // 3)
        if turns:
            azimuth = azimuth + 2 * np.pi * turns * np.arange(end + 1) / 10
        tendons.append(tdcr.Tendon(azimuth, 0.008, end=end))
    return tdcr.Robot(tdcr.Backbone([0.06] * segments, [10] * segments), tendons, **keywords)


def tips(robot, count, seed=0):
    """Return tips of shapes with some of the tendons pulled."""
    rng = np.random.default_rng(seed)
    pulls = rng.uniform(0, 2000, (count, len(robot.tendons)))
    pulls[rng.random(pulls.shape) < 0.4] = 0.0
    return np.array([tdcr.forward(robot, tensions=row).require().tip for row in pulls])


def frame(rotation, translation):
    """Return a frame from a rotation vector."""
    out = np.eye(4)
    angle = np.linalg.norm(rotation)
    x, y, z = np.asarray(rotation) / angle
    hat = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    out[:3, :3] += np.sin(angle) * hat + (1 - np.cos(angle)) * hat @ hat
    out[:3, 3] = translation
    return out


@pytest.mark.parametrize("turns", [0.0, 0.3])
def test_a_forward_solve_puts_the_tool_at_the_target(turns):
    base, tool = frame([0.3, 1.0, -0.4], [1.0, 2.0, 3.0]), frame([0.1, 0.2, 0.3], [0.0, 0.01, 0.03])
    robot = trunk(turns, base=base, tool=tool)
    for tip in tips(robot, 20):
        target = (tip @ tool)[:3, 3]
        answer = tdcr.inverse(robot, target)
        assert answer.ok
        assert answer.message == ""
        assert answer.model == "rod"
        fresh = tdcr.forward(robot, answer.displacements).require()
        np.testing.assert_allclose((fresh.tip @ tool)[:3, 3], target, rtol=0, atol=1e-9)
        np.testing.assert_allclose((answer.shape.tip @ tool)[:3, 3], target, rtol=0, atol=1e-9)
        assert (answer.tensions >= 0).all()
        np.testing.assert_array_equal(answer.shape.tensions, answer.tensions)
        np.testing.assert_allclose(answer.shape.displacements, answer.displacements, atol=1e-10)


def test_poses_of_three_segments_are_met():
    robot = trunk(segments=3)
    targets = tips(robot, 20, seed=1)
    batch = tdcr.inverse_batch(robot, targets)
    assert batch.ok.all()
    found = tdcr.forward_batch(robot, batch.displacements)
    assert found.ok.all()
    np.testing.assert_allclose(found.tip, targets, rtol=0, atol=1e-8)


def test_rows_are_the_same_alone_and_on_any_number_of_threads():
    robot = trunk(0.2)
    targets = tips(robot, 20, seed=2)[:, :3, 3]
    one, two = (tdcr.inverse_batch(robot, targets, threads=n) for n in (1, 2))
    assert one == two
    assert one[7] == tdcr.inverse(robot, targets[7])
    np.testing.assert_array_equal(one.tensions, two.tensions)
    assert pickle.loads(pickle.dumps(one)) == one


def test_a_path_is_followed_without_jumps():
    robot = trunk(segments=3)
    s = np.linspace(0, 2 * np.pi, 200)
    start = tdcr.forward(robot, tensions=[3000, 0, 0, 2500, 500, 0, 1500, 0, 0]).require()
    turn = np.column_stack([np.cos(s) - 1, np.sin(s), -0.1 * s])
    path = start.positions[-1] + 0.02 * turn
    seen = []
    along = tdcr.track(robot, path, start=start, progress=seen.append)
    assert along.ok.all()
    assert (along.starts[1:] == 1).all()
    assert seen[-1] == 200
    assert np.abs(np.diff(along.displacements, axis=0)).max() < 1e-3
    found = tdcr.forward_batch(robot, along.displacements, warm=True)
    np.testing.assert_allclose(found.tip[:, :3, 3], path, rtol=0, atol=1e-8)


def test_a_path_says_where_it_fails():
    robot = trunk(segments=1)
    inside = tips(robot, 1, seed=3)[0, :3, 3]
    path = np.array([inside, [0.0, 0.0, 0.2], inside])
    along = tdcr.track(robot, path, search=InverseSettings(starts=3))
    assert along.status.tolist() == [Status.converged, Status.unreachable, Status.converged]
    assert along[1].error == pytest.approx(0.14, abs=1e-6)
    assert "row 1" in along[1].message
    assert np.isfinite(along.displacements).all()


def test_wide_steps_of_a_path_are_divided():
    robot = trunk(segments=3)
    bent = tdcr.forward(robot, tensions=[0, 3000, 0, 2500, 500, 0, 0, 500, 900]).require()
    other = tdcr.forward(robot, tensions=[2500, 0, 900, 500, 1500, 0, 0, 0, 1500]).require()
    along = tdcr.track(robot, [bent.positions[-1], other.positions[-1]], start=bent)
    assert along.ok.all()
    assert along.iterations[1] > 5


def test_bounds_hold():
    robot = trunk()
    target = tips(robot, 1, seed=4)[0, :3, 3]
    free = tdcr.inverse(robot, target)
    most = 0.9 * free.tensions.max()
    bounds = Bounds(tension=(50.0, most), displacement=(-0.02, 0.02))
    bound = tdcr.inverse(robot, target, bounds=bounds)
    assert (bound.tensions >= 50 - 1e-6).all()
    assert (bound.tensions <= most + 1e-6).all()
    assert (np.abs(bound.displacements) <= 0.02).all()
    pull = free.displacements.min()
    short = tdcr.inverse(robot, target, bounds=(0.5 * pull, 0.5), search=InverseSettings(starts=5))
    assert short.displacements.min() >= 0.5 * pull
    assert short.ok or "pull of" in short.message
    none = tdcr.inverse(robot, target, bounds=(0.03, 0.04), search=InverseSettings(starts=2))
    assert none.status is Status.infeasible
    assert pickle.loads(pickle.dumps(bounds)) == bounds
    assert "tension=(50.0" in repr(bounds)
    assert bounds.tension == (50.0, most)


def test_out_of_reach_is_the_nearest_answer():
    far = tdcr.inverse(trunk(), [0.0, 0.0, 0.2], search=InverseSettings(starts=4))
    assert far.status is Status.unreachable
    assert far.error == pytest.approx(0.08, abs=1e-6)
    assert "nearest answer of 4 starts" in far.message
    with pytest.raises(tdcr.NotConverged, match="unreachable"):
        far.require()


def test_least_tension_leaves_no_segment_clamped():
    robot = trunk(segments=1)
    tip = tdcr.forward(robot, tensions=[2000, 500, 500]).require().tip
    least = tdcr.inverse(robot, tip[:3, 3])
    # What all three have in common only compresses the backbone.
    np.testing.assert_allclose(least.tensions, [1500, 0, 0], rtol=1e-2, atol=1e-6)
    kept = tdcr.inverse(robot, tip[:3, 3], search=InverseSettings(least_energy=False))
    assert kept.ok


def test_swarm_as_the_start():
    robot = trunk(segments=1)
    target = tips(robot, 1, seed=5)[0, :3, 3]
    assert tdcr.inverse(robot, target, method="pso").ok


@pytest.mark.parametrize(
    ("keywords", "argument"),
    [
        ({"bounds": Bounds(curvature=3.0)}, "bounds.curvature"),
        ({"bounds": Bounds(length=(0.1, 0.2))}, "bounds.length"),
        ({"bounds": Bounds(tension=([0, 0], [1, 1]))}, "bounds.tension"),
        ({"bounds": Bounds(tension=(-2, -1))}, "bounds.tension"),
        ({"settings": tdcr.RodSettings(tendons="proportional")}, "settings.tendons"),
        ({"settings": tdcr.ConstantCurvatureSettings()}, "settings"),
        ({"start": np.zeros(4)}, "start"),
        ({"start": np.full(6, np.nan)}, "start"),
        ({"model": "linkage"}, "model"),
    ],
)
def test_bad_input_is_refused(keywords, argument):
    with pytest.raises(tdcr.InvalidInput) as error:
        tdcr.inverse(trunk(), [0.0, 0.02, 0.1], **keywords)
    assert error.value.argument.startswith(argument)


def test_constant_curvature_has_no_tensions():
    robot = trunk()
    bounds = Bounds(tension=(0, 1))
    with pytest.raises(tdcr.InvalidInput, match="knows no forces"):
        tdcr.inverse(robot, [0.0, 0.02, 0.1], model="constant_curvature", bounds=bounds)
    answer = tdcr.inverse(robot, [0.0, 0.02, 0.1], model="constant_curvature")
    assert np.isnan(answer.tensions).all()
    with pytest.raises(tdcr.InvalidInput, match="rod"):
        tdcr.inverse_solutions(robot, [0.0, 0.02, 0.1], model="rod")
