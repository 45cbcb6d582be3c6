"""Pre-bent design among obstacles: clear of them, inside them, and with one in the way."""

import pickle

import numpy as np
import pytest

import tdcr
from tdcr import design

LENGTH = 0.18
PULL = [-0.03 * LENGTH]


def straight():
    return tdcr.Robot(tdcr.Backbone(LENGTH, 9), [tdcr.Tendon(np.pi, 0.008)])


def circle(radius=0.1):
    turn = np.linspace(0, 2, 50)[:, None]
    points = radius * np.hstack([1 - np.cos(turn), 0 * turn, np.sin(turn)])
    return design.on_curve(straight(), points)


def test_clear_of_obstacles_the_answer_is_the_same():
    free = design.prebend(straight(), circle(), PULL).require()
    assert free.clearance is None
    ball = tdcr.Sphere([0.1, 0.0, 0.0], 0.05)
    answer = design.prebend(straight(), circle(), PULL, obstacles=ball).require()
    assert answer.robot == free.robot
    assert "rests 6.223e-03 m inside obstacles at opposite the hole of 't0'" in answer.message
    assert answer.shape.obstacles == (ball,)
    assert not answer.shape.contacts
    assert answer.error.max() < 1e-10 * LENGTH
    # Holes are 8 mm nearer to the ball's centre than the circle of the disks' centres, or further.
    assert answer.clearance == pytest.approx(0.1 - 0.008 - 0.05, abs=1e-4)
    assert pickle.loads(pickle.dumps(answer)) == answer
    wall = tdcr.HalfSpace([-0.05, 0.0, 0.0], [1.0, 0.0, 0.0])
    assert design.prebend(straight(), circle(), PULL, obstacles=[ball, wall]).ok


def test_no_rest_shape_has_places_inside_an_obstacle():
    wall = tdcr.HalfSpace([0.05, 0.0, 0.0], [-1.0, 0.0, 0.0])
    answer = design.prebend(straight(), circle(), PULL, obstacles=wall)
    assert answer.status == "unreachable"
    assert "inside obstacles at" in answer.message
    assert "disk 9" in answer.message
    assert answer.clearance < -0.05
    # What happens instead: it leans on the wall.
    assert answer.shape.contacts
    assert answer.error.max() > 0.01
    with pytest.raises(tdcr.NotConverged, match="inside obstacles"):
        answer.require()


def test_an_obstacle_on_the_way_is_told():
    """A finger that is bent to the other side at rest has to go past a post."""
    back, pull = circle() * [-1, 1, 1], [-0.02]
    free = design.prebend(straight(), back, pull).require()
    # Shifted to the right at rest, to the left when pulled.
    rest = tdcr.forward(free.robot, [np.inf]).positions
    assert rest[-1, 0] > 0.05
    assert back[-1, 0] < -0.1
    caught = tdcr.Cylinder([-0.045, 0.0, 0.12], [0.0, 1.0, 0.0], 0.015)
    answer = design.prebend(straight(), back, pull, obstacles=caught)
    assert answer.status == "unreachable"
    assert answer.clearance == pytest.approx(0.0100147, abs=1e-6)
    assert answer.robot == free.robot
    assert answer.shape.contacts
    assert answer.error.max() > 0.05
    assert "not the one that pulling from rest leads to" in answer.message
    # It slips past a thinner one, further out.
    passed = tdcr.Cylinder([-0.045, 0.0, 0.14], [0.0, 1.0, 0.0], 0.008)
    answer = design.prebend(straight(), back, pull, obstacles=passed).require()
    assert answer.error.max() < 1e-10 * LENGTH
    assert not answer.shape.contacts


def test_places_out_of_reach_stay_so_among_obstacles():
    ball = tdcr.Sphere([0.5, 0.0, 0.0], 0.05)
    answer = design.prebend(straight(), np.add(circle(), [0, 0, 0.004]), PULL, obstacles=ball)
    assert answer.status == "unreachable"
    assert "stays 4.406e-3 m" in answer.message


def test_obstacles_that_the_designed_robot_rests_in_are_told():
    free = design.prebend(straight(), circle(), PULL).require()
    rest = tdcr.forward(free.robot, [np.inf]).positions
    answer = design.prebend(
        straight(), circle(), PULL, obstacles=tdcr.Sphere(rest[9], 0.012)
    ).require()
    assert "rests 1.200e-02 m inside obstacles at the centre of disk 9" in answer.message
    assert answer.shape.message in answer.message
    # Clear of it at rest and when pulled, there is nothing to tell.
    clear = design.prebend(straight(), circle(), PULL, obstacles=tdcr.Sphere([-0.2, 0, 0], 0.05))
    assert clear.require().message == ""


def test_bad_obstacles():
    expected = "obstacles: expected an obstacle or a sequence of obstacles, got int"
    with pytest.raises(TypeError, match=expected):
        design.prebend(straight(), circle(), PULL, obstacles=3)
    with pytest.raises(TypeError, match=r"expected .*got "):
        design.prebend(straight(), circle(), PULL, obstacles=["ball"])
    settings = design.PrebendSettings(rod=tdcr.RodSettings(tendons="proportional"), tolerance=1e-2)
    with pytest.raises(tdcr.InvalidInput, match=r"expected .*got "):
        design.prebend(
            straight(), circle(), PULL, obstacles=tdcr.Sphere([1, 0, 0], 0.1), settings=settings
        )
