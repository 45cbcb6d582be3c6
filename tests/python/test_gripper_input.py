"""Grippers: bad input is refused, and the argument named."""

import re

import numpy as np
import pytest

import tdcr

BALL = tdcr.Sphere((0, 0, 0.14), 0.04)
NAN, INF = float("nan"), float("inf")


def finger(**keywords):
    return tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(0.0, 0.008)], **keywords)


def refused(argument, expected, error=tdcr.InvalidInput):
    return pytest.raises(error, match="^" + re.escape(f"{argument}: expected {expected}"))


@pytest.fixture(scope="module")
def gripper():
    return tdcr.Gripper.around(finger(), 3, 0.06)


@pytest.fixture(scope="module")
def grasp(gripper):
    return gripper.close([-0.003], BALL, steps=4)


def test_fingers(gripper):
    placed = gripper.fingers[0]
    with refused("fingers", "one robot or more, got none"):
        tdcr.Gripper([])
    for one in (placed, None, 3):
        with refused("fingers", "a sequence of Robot", TypeError):
            tdcr.Gripper(one)
    with refused("fingers[0]", "a Robot, got str", TypeError):
        tdcr.Gripper(["thumb"])
    with refused("fingers[1]", "a base of its own"):
        tdcr.Gripper([placed, placed])


def test_a_finger_without_a_base_pose(gripper):
    with refused("fingers[0]", "a robot with a base pose") as caught:
        tdcr.Gripper([finger()])
    assert caught.value.argument == "fingers[0]"
    with refused("fingers[1]", "a robot with a base pose"):
        tdcr.Gripper([gripper.fingers[0], finger(base=np.eye(4))])
    assert tdcr.Gripper(gripper.fingers[:1]).fingers == gripper.fingers[:1]


@pytest.mark.parametrize(
    ("argument", "value", "expected", "error"),
    [
        ("robot", "finger", "a Robot, got str", TypeError),
        ("robot", None, "a Robot, got NoneType", TypeError),
        ("count", 0, "1 or more, got 0", tdcr.InvalidInput),
        ("count", 2.5, "an int, got float", TypeError),
        ("count", True, "an int, got bool", TypeError),
        ("count", np.array([1, 2]), "an int, got ndarray", TypeError),
        ("distance", 0.0, "a length > 0 m", tdcr.InvalidInput),
        ("distance", NAN, "a length > 0 m", tdcr.InvalidInput),
        ("distance", "6 cm", "a number, got str", TypeError),
        ("axis", (0, 0, 0), "three numbers of positive length", tdcr.InvalidInput),
        ("axis", (0, 1), "three numbers, shape (3,), got shape (2,)", tdcr.InvalidInput),
        ("axis", (0, 1, INF), "three finite numbers", tdcr.InvalidInput),
        ("axis", "z", "numbers, got str", TypeError),
        ("center", (0, 0), "three numbers, shape (3,), got shape (2,)", tdcr.InvalidInput),
        ("center", 0.1, "three numbers, shape (3,), got shape ()", tdcr.InvalidInput),
        ("center", (0, NAN, 0), "three finite numbers [m]", tdcr.InvalidInput),
        ("center", [[0], 1, 2], "a rectangular array of numbers", tdcr.InvalidInput),
        ("azimuth", NAN, "a finite number [rad], got nan", tdcr.InvalidInput),
        ("azimuth", INF, "a finite number [rad], got inf", tdcr.InvalidInput),
        ("azimuth", None, "a number, got NoneType", TypeError),
    ],
)
def test_around(argument, value, expected, error):
    arguments = {"robot": finger(), "count": 3, "distance": 0.06, argument: value}
    with refused(argument, expected, error) as caught:
        tdcr.Gripper.around(**arguments)
    if error is tdcr.InvalidInput:
        assert caught.value.argument == argument


@pytest.mark.parametrize("sign", [1, -1])
def test_integers_that_are_no_floats(sign):
    with refused("distance", f"a length > 0 m, got {sign * INF}"):
        tdcr.Gripper.around(finger(), 3, sign * 10**400)


@pytest.mark.parametrize(
    ("value", "argument", "expected", "error"),
    [
        (-0.003, "displacements", "shape (K,) or a row per finger", tdcr.InvalidInput),
        (np.array(-0.003), "displacements", "shape (K,) or a row per finger", tdcr.InvalidInput),
        ("pull", "displacements", "numbers, got str", TypeError),
        (None, "displacements", "numbers, got NoneType", TypeError),
        (["pull"], "displacements[0]", "numbers, got str", TypeError),
        ([], "displacements", "shape (1,) of fingers[0], got shape (0,)", tdcr.InvalidInput),
        ([0.0] * 3, "displacements", "shape (1,) of fingers[0], got shape (3,)", tdcr.InvalidInput),
        ([[0.0]] * 2, "displacements", "one row for all or 3 rows", tdcr.InvalidInput),
        ([[0.0], 0.0, [0.0]], "displacements[1]", "shape (1,) of fingers[1]", tdcr.InvalidInput),
        ([[0.0], [0.0], [0.0, 0.0]], "displacements[2]", "shape (1,)", tdcr.InvalidInput),
    ],
)
def test_displacements(gripper, value, argument, expected, error):
    with refused(argument, expected, error):
        gripper.close(value, BALL, steps=1)


def test_closing(gripper):
    with pytest.raises(tdcr.InvalidInput, match=r"^displacements"):
        gripper.close([NAN], BALL, steps=1)
    with refused("steps", "1 or more, got 0"):
        gripper.close([-0.001], BALL, steps=0)
    for steps in (2.0, "two", None, True):
        with refused("steps", "an int, got", TypeError):
            gripper.close([-0.001], BALL, steps=steps)
    for progress in (3, "yes", 0.0):
        with refused("progress", "a bool or a callable, got", TypeError):
            gripper.close([-0.001], BALL, steps=1, progress=progress)
    for obstacles in (3, None):
        with refused("obstacles", "an obstacle or a sequence of obstacles, got", TypeError):
            gripper.close([-0.001], obstacles, steps=1)


@pytest.mark.parametrize("method", ["contacts", "center", "force", "moment", "force_closure"])
def test_steps_and_obstacles(grasp, method):
    ask = getattr(grasp, method)
    for obstacle in (1, -1):
        with refused("obstacle", f"an index from 0 to 0, got {obstacle}") as caught:
            ask(obstacle=obstacle)
        assert caught.value.argument == "obstacle"
    with refused("obstacle", "an int, got float", TypeError):
        ask(obstacle=0.0)
    for step in (5, -6):
        with refused("step", f"an index from -5 to 4, got {step}"):
            ask(step=step)
    with refused("step", "an int, got str", TypeError):
        ask(step="last")


def test_no_obstacle(gripper):
    grasp = gripper.close([-0.003], [], steps=1)
    assert grasp.touch == (None,) * 3
    with refused("obstacle", "the index of an obstacle, of which there are none, got 0"):
        grasp.force()


@pytest.mark.parametrize("step", [0, -1])
def test_moments(grasp, step):
    with refused("about", "three numbers, shape (3,), got shape (2,)"):
        grasp.moment((0, 0), step)
    with refused("about", "three numbers, shape (3,), got shape ()"):
        grasp.moment(0.0, step)
    with refused("about", "three finite numbers [m]"):
        grasp.moment((0, 0, NAN), step)
    with refused("about", "numbers, got str", TypeError):
        grasp.moment("tip", step)


def test_force_closure(grasp):
    for friction in (-0.5, NAN, INF):
        with refused("friction", "0 or more"):
            grasp.force_closure(friction)
    with refused("friction", "a number, got str", TypeError):
        grasp.force_closure("some")
    with refused("edges", "3 or more, got 2"):
        grasp.force_closure(0.5, edges=2)
    with refused("edges", "an int, got float", TypeError):
        grasp.force_closure(0.5, edges=4.5)


def test_pictures(grasp, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "closing.gif"
    for fps in (0, -1):
        with refused("fps", f"1 or more, got {fps}"):
            grasp.animate(path, fps=fps)
    for fps in (NAN, "fast"):
        with refused("fps", "an int, got", TypeError):
            grasp.animate(path, fps=fps)
    assert not path.exists()
    with refused("step", "an index from -5 to 4, got 5"):
        grasp.plot(5)
