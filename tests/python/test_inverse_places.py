"""Displacements that bring the disks of a rod to wanted places."""

import numpy as np
import pytest
from test_inverse_rod import frame, trunk

import tdcr
from tdcr import Status

BAR = tdcr.Cylinder(point=(-0.030, 0, 0.100), axis=(0, 1, 0), radius=0.015)


def shapes(robot, count, seed=0):
    rng = np.random.default_rng(seed)
    pulls = rng.uniform(0, 2000, (count, len(robot.tendons)))
    pulls[rng.random(pulls.shape) < 0.4] = 0.0
    return [tdcr.forward(robot, tensions=row).require() for row in pulls]


def square(answer, positions):
    return np.nansum((answer.shape.positions - positions)[1:] ** 2)


@pytest.mark.parametrize("turns", [0.0, 0.3])
@pytest.mark.parametrize("segments", [1, 3])
def test_shapes_of_the_robot_are_found(turns, segments):
    base = frame([0.3, 1.0, -0.4], [1.0, 2.0, 3.0])
    robot = trunk(turns, segments, base=base)
    for shape in shapes(robot, 20):
        answer = tdcr.inverse(robot, positions=shape.positions)
        assert answer.ok
        assert answer.message == ""
        assert answer.error <= 1e-10
        fresh = tdcr.forward(robot, answer.displacements).require()
        np.testing.assert_allclose(fresh.positions, shape.positions, rtol=0, atol=1e-9)
        assert (answer.tensions >= 0).all()
        beyond = tdcr.inverse(robot, positions=shape.positions[1:])
        np.testing.assert_array_equal(beyond.displacements, answer.displacements)


def test_what_comes_nearest_is_a_minimum_like_that_of_scipy():
    least_squares = pytest.importorskip("scipy.optimize").least_squares
    robot = trunk(0.3, 2)
    noise = np.random.default_rng(5)
    for shape in shapes(robot, 4, seed=2):
        wanted = shape.positions + noise.normal(0, 1e-3, shape.positions.shape)
        answer = tdcr.inverse(robot, positions=wanted)
        assert answer.status is Status.unreachable
        assert "root mean square" in answer.message
        off = np.linalg.norm((answer.shape.positions - wanted)[1:], axis=1)
        np.testing.assert_allclose(answer.error, off.max(), rtol=1e-6)
        assert f"at disk {1 + off.argmax()}," in answer.message

        def miss(pulls, wanted=wanted):
            at = tdcr.forward(robot, tensions=np.maximum(pulls, 0)).positions
            return (at - wanted)[1:].ravel()

        starts = noise.uniform(0, 1500, (8, 6))
        peers = [least_squares(miss, x, bounds=(0, np.inf), x_scale=1e3) for x in starts]
        assert square(answer, wanted) <= 2 * min(peer.cost for peer in peers) * (1 + 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("tendons", "disks"), [(12, 2), (2, 2), (4, 4)])
def test_long_subsegments_that_may_coil_are_not_left_so(tendons, disks):
    draw = np.random.default_rng(0)
    backbone = tdcr.Backbone(0.18, disks, youngs_modulus=200e9, diameter=0.001)
    for _ in range(12):
        ends = draw.integers(1, disks + 1, tendons).tolist()
        azimuths = draw.uniform(0, 6.28, tendons).tolist()
        robot = tdcr.Robot(
            backbone, [tdcr.Tendon(a, 0.008, end=e) for a, e in zip(azimuths, ends, strict=True)]
        )
        pulls = draw.uniform(0, 1, tendons) * (draw.random(tendons) < 0.6)
        shape = tdcr.forward(robot, tensions=pulls).require()
        wanted = shape.positions + draw.normal(0, 1e-3, shape.positions.shape)
        answer = tdcr.inverse(robot, positions=wanted)
        assert answer.status is Status.unreachable
        # What it was made of is as near as that at least.
        own = ((shape.positions - wanted)[1:] ** 2).sum()
        assert square(answer, wanted) <= own * (1 + 1e-9)
        np.testing.assert_allclose(
            np.linalg.norm((answer.shape.positions - wanted)[1:], axis=1).max(),
            answer.error,
            rtol=1e-6,
        )


def test_rows_of_nan_do_not_count():
    robot = trunk(0.3, 2)
    shape = shapes(robot, 1, seed=3)[0]
    some = shape.positions.copy()
    some[1:10], some[15:] = np.nan, np.nan
    answer = tdcr.inverse(robot, positions=some).require()
    at = answer.shape.positions[10:15]
    np.testing.assert_allclose(at, shape.positions[10:15], rtol=0, atol=1e-9)
    tip = np.full((20, 3), np.nan)
    tip[-1] = shape.positions[-1]
    answer = tdcr.inverse(robot, positions=tip).require()
    np.testing.assert_allclose(answer.shape.positions[-1], tip[-1], rtol=0, atol=1e-9)


def test_bounds_and_obstacles_are_kept(tmp_path):
    robot = trunk(0.0, 1)
    shape = tdcr.forward(robot, [-0.006, np.inf, np.inf]).require()
    tight = tdcr.inverse(robot, positions=shape.positions, bounds=(-0.004, 0.01))
    assert tight.status is Status.unreachable
    np.testing.assert_allclose(tight.displacements[0], -0.004, rtol=0, atol=1e-12)
    assert "at its bound: pull of" in tight.message
    steel = tdcr.Backbone(0.180, 18, youngs_modulus=200e9, diameter=0.001)
    finger = tdcr.Robot(steel, [tdcr.Tendon(np.pi, 0.008)])
    leaning = tdcr.forward(finger, [-0.008], obstacles=BAR).require()
    answer = tdcr.inverse(finger, positions=leaning.positions, obstacles=BAR).require()
    np.testing.assert_allclose(answer.displacements, [-0.008], rtol=0, atol=1e-9)
    assert answer.shape.contacts
    answer.save(tmp_path / "answer.npz")
    assert tdcr.Inverse.load(tmp_path / "answer.npz") == answer


def test_bad_input_is_named():
    robot, good = trunk(0.0, 1), np.zeros((10, 3))
    for given, message in [
        ({}, "target: expected a target or positions, got neither"),
        ({"target": [0, 0, 0.1], "positions": good}, "got both"),
        ({"positions": good[:4]}, r"positions: expected shape \(10, 3\)"),
        ({"positions": good * np.nan}, "positions: expected the place of one disk at least"),
        ({"positions": good + np.inf}, "positions: expected finite places"),
        ({"positions": np.where([0, 0, 1], np.nan, good)}, "in row 0"),
        ({"positions": good, "model": "constant_curvature"}, 'model "constant_curvature"'),
    ]:
        with pytest.raises(tdcr.InvalidInput, match=message):
            tdcr.inverse(robot, **given)
