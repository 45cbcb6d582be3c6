"""Edges of the inverse: held values, closed bounds, far starts, bases and tools, lone tendons."""

from __future__ import annotations

import numpy as np
import pytest

import tdcr
from tdcr import Bounds, Status

MODEL = "constant_curvature"
EXTENSIBLE = tdcr.ConstantCurvatureSettings(extensible=True)


def trunk(**keywords):
    """Return three segments with three coupled tendons each."""
    tendons = [
        tdcr.Tendon(2 * np.pi * (k % 3) / 3 + (k // 3) * np.pi / 4, 0.0045, end=10 * (k // 3 + 1))
        for k in range(9)
    ]
    return tdcr.Robot(tdcr.Backbone([0.06, 0.0625, 0.064], [10] * 3), tendons, **keywords)


def rows(count, seed=0):
    return np.random.default_rng(seed).normal(size=(count, 9)) * 0.003


def test_a_lone_distal_tendon_at_rest_length_keeps_its_segment_bent():
    tendons = [tdcr.Tendon(2 * np.pi * k / 3, 0.005, end=1) for k in range(3)]
    robot = tdcr.Robot(tdcr.Backbone([0.06, 0.06], [1, 1]), [*tendons, tdcr.Tendon(0.0, 0.005)])
    azimuth = 2 * np.pi * np.arange(3) / 3
    rng = np.random.default_rng(0)
    for _ in range(100):
        kappa, phi = rng.uniform(1, 15), rng.uniform(-np.pi, np.pi)
        three = tdcr.constant_curvature.displacements_from_arc(kappa, phi, 0.06, azimuth, 0.005)
        shape = tdcr.forward(robot, [*three, 0.0], model=MODEL)
        answer = tdcr.inverse(robot, shape.tip, model=MODEL).require()
        assert answer.displacements[3] <= 0.0
        assert np.abs(answer.shape.tip - shape.tip).max() < 1e-9


def test_answers_stay_inside_their_bounds_to_the_last_bit():
    robot = trunk()
    for row in rows(50):
        target = tdcr.forward(robot, row, model=MODEL).tip[:3, 3]
        low, high = row - 1e-3, np.maximum(row, 0.0)
        answer = tdcr.inverse(robot, target, model=MODEL, bounds=(low, high))
        assert (answer.displacements >= low).all()
        assert (answer.displacements <= high).all()


def test_values_may_be_held_by_equal_bounds():
    robot = trunk()
    for row in rows(30):
        # What arcs satisfy exactly.
        shape = tdcr.forward(robot, row, model=MODEL)
        exact = shape.tendon_lengths - robot.rest_lengths
        for count in (3, 6, 9):
            low, high = np.full(9, -np.inf), np.full(9, np.inf)
            low[:count] = high[:count] = exact[:count]
            answer = tdcr.inverse(robot, shape.tip[:3, 3], model=MODEL, bounds=(low, high))
            assert answer.ok, (count, answer.message)
            np.testing.assert_array_equal(answer.displacements[:count], exact[:count])


@pytest.mark.parametrize("curvature", [[0, 20, 20], [20, 0, 20], [20, 20, 0], [1e-9, 30, 30]])
def test_a_segment_may_be_held_straight(curvature):
    robot = trunk()
    rng = np.random.default_rng(1)
    bounds = Bounds(curvature=curvature)
    arcs = np.array(curvature) * rng.random((20, 3))
    for kappa in arcs:
        phi = rng.uniform(-np.pi, np.pi, 3)
        tip = tdcr.constant_curvature.frames(kappa, phi, [0.06, 0.0625, 0.064])[-1]
        answer = tdcr.inverse(robot, tip[:3, 3], model=MODEL, bounds=bounds)
        assert answer.ok, answer.message


def test_lengths_may_be_held_and_too_short_ones_are_refused():
    robot = trunk()
    held = Bounds(length=([0.07] * 3, [0.07] * 3))
    tip = tdcr.constant_curvature.frames([8.0, 5.0, 9.0], [0.1, 2.0, -1.0], [0.07] * 3)[-1]
    answer = tdcr.inverse(robot, tip, model=MODEL, settings=EXTENSIBLE, bounds=held).require()
    strains = answer.shape.strains.reshape(3, 10, 4)[:, :, 3]
    np.testing.assert_allclose((1 + strains[:, 0]) * [0.06, 0.0625, 0.064], 0.07, atol=1e-12)
    with pytest.raises(tdcr.InvalidInput) as caught:
        tdcr.inverse(
            robot, tip, model=MODEL, settings=EXTENSIBLE, bounds=Bounds(length=(0.0, 1e-5))
        )
    assert caught.value.argument == "bounds.length"


def test_far_starts_do_no_harm():
    robot = trunk()
    tip = tdcr.forward(robot, rows(1)[0], model=MODEL).tip
    for size in (1.0, 1e12, 1e200):
        assert tdcr.inverse(robot, tip, model=MODEL, start=np.full(9, size)).ok
        assert tdcr.track(robot, tip[None], model=MODEL, start=np.full(9, size)).ok.all()


@pytest.mark.parametrize("distance", [1e3, 1e5])
def test_far_bases_do_no_harm(distance):
    base = np.eye(4)
    base[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    base[:3, 3] = [distance, -distance, distance]
    robot = trunk(base=base)
    tips = tdcr.forward_batch(robot, rows(40), model=MODEL).tip
    weights = tdcr.InverseSettings(position_weight=(1.0, 2.0, 3.0))
    for search in (tdcr.InverseSettings(), weights):
        assert tdcr.inverse_batch(robot, tips[:, :3, 3], model=MODEL, search=search).ok.all()
        assert tdcr.inverse_batch(robot, tips, model=MODEL, search=search).ok.all()


@pytest.mark.parametrize("length", [0.5, 5.0, 50.0])
def test_long_tools_do_no_harm(length):
    tool = np.eye(4)
    tool[:3, 3] = [0.1 * length, 0.0, length]
    robot = trunk(tool=tool)
    tips = tdcr.forward_batch(robot, rows(40), model=MODEL).tip @ tool
    loose = tdcr.InverseSettings(position_tolerance=1e-10 * max(1.0, length))
    assert tdcr.inverse_batch(robot, tips, model=MODEL, search=loose).ok.all()


def test_weights_along_world_axes_are_the_worlds():
    base = np.eye(4)
    base[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    robot = trunk(base=base)
    # Out of reach along world x alone, which does not count.
    target = tdcr.forward(robot, rows(1)[0], model=MODEL).tip[:3, 3] + [5.0, 0.0, 0.0]
    search = tdcr.InverseSettings(position_weight=(0.0, 1.0, 1.0))
    answer = tdcr.inverse(robot, target, model=MODEL, search=search).require()
    np.testing.assert_allclose(answer.shape.tip[1:3, 3], target[1:], atol=1e-9)
    assert tdcr.inverse(robot, target, model=MODEL).status is Status.unreachable
