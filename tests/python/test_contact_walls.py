"""Thin walls, locked robots, shapes left sideways: how a solve in contact ends."""

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr

STEEL = tdcr.Backbone(0.180, 9, youngs_modulus=200e9, diameter=0.001)
TRUNK = tdcr.Robot(STEEL, [tdcr.Tendon(np.pi, 0.008)])


@pytest.mark.parametrize("thickness", [0.001, 0.004, 0.012])
def test_no_disk_goes_through_a_thin_wall(thickness):
    for x in np.linspace(-0.018, -0.060, 7):
        if x + thickness / 2 > -0.0085:
            continue
        wall = tdcr.Box((x, 0, 0.1), (thickness / 2, 0.5, 0.5))
        start = None
        for pull in np.linspace(-0.002, -0.010, 5):
            shape = tdcr.forward(TRUNK, [pull], obstacles=wall, start=start)
            for each in (shape, tdcr.forward(TRUNK, [pull], obstacles=wall)):
                assert each.ok
                assert each.positions[:, 0].min() > x + thickness / 2 - 1e-9
            start = shape


def test_a_locked_robot_says_so():
    """Exactly as long as the tendons allow, in one shape only: no finite tension carries weight."""
    ends = set()
    draw = np.random.default_rng(0)
    for count in (3, 4, 5, 6) * 3:
        azimuths, tensions = draw.uniform(0, 6.28, count), draw.uniform(0, 4, count)
        robot = tdcr.Robot(STEEL, [tdcr.Tendon(each, 0.008) for each in azimuths])
        pulls = tdcr.forward(robot, tensions=tensions).displacements
        shape = tdcr.forward(robot, pulls, loads=tdcr.Loads(backbone_density=7850.0))
        if not shape.ok:
            assert shape.status == tdcr.Status.infeasible
            assert "grow without bound" in shape.message
        ends.add(shape.ok)
        # A hundredth of a millimetre is room enough.
        loads = tdcr.Loads(backbone_density=7850.0)
        assert tdcr.forward(robot, pulls + 1e-5, loads=loads).ok
    assert ends == {True, False}


def test_a_signed_distance_is_asked_for_numbers_only():
    finger = tdcr.Robot(STEEL, [tdcr.Tendon(0.0, 0.008)])
    center, radius = np.array([0.034, 0.004, 0.161]), 0.019

    def distance(x):
        assert np.isfinite(x).all()
        return np.linalg.norm(x - center) - radius

    shape = tdcr.forward(finger, [-0.004], obstacles=tdcr.SignedDistance(distance))
    ball = tdcr.forward(finger, [-0.004], obstacles=tdcr.Sphere(center, radius))
    np.testing.assert_allclose(shape.positions, ball.positions, atol=1e-9)


def test_a_shape_that_was_left_sideways_says_so():
    wall = tdcr.HalfSpace((-0.02, 0, 0), (1, 0, 0))
    shape = tdcr.forward(TRUNK, [-0.006], obstacles=wall).require()
    assert abs(shape.positions[-1, 1]) > 0.01
    assert "unstable on the way" in shape.message


def test_a_sunk_robot_is_told_with_a_start_too():
    wall = tdcr.HalfSpace((-0.004, 0, 0), (1, 0, 0))
    shape = tdcr.forward(TRUNK, [-0.003], obstacles=wall).require()
    again = tdcr.forward(TRUNK, [-0.0031], obstacles=wall, start=shape)
    assert "4.000e-3 m deep" in shape.message
    assert "4.000e-3 m deep" in again.message


@pytest.mark.slow
def test_ctrl_c_ends_a_long_solve_in_a_mesh():
    setup = """
import trimesh, tdcr
solid = trimesh.creation.cylinder(0.02, 0.6, sections=20_000)
tube = tdcr.Mesh(solid.vertices, solid.faces, inside=True)
trunk = tdcr.Robot(tdcr.Backbone(0.25, 400), [tdcr.Tendon(0.3, 0.008)])
"""
    assert_interrupts(setup, "tdcr.forward(trunk, [-0.02], obstacles=tube)")
