"""Grippers: placement, closing, forces on the object, force closure, pictures."""

import copy
import itertools
import pickle

import numpy as np
import pytest
from example_scripts import example_script

import tdcr
from tdcr._gripper.force_closure import positively_span, wrenches
from tdcr._gripper.placing import least_turn

BALL = tdcr.Sphere((0, 0, 0.14), 0.04)


def finger(**keywords):
    return tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(0.0, 0.008)], **keywords)


@pytest.fixture(scope="module")
def grasp():
    return tdcr.Gripper.around(finger(), 3, 0.06).close([-0.003], BALL, steps=8)


# --- placement ---------------------------------------------------------------------------------


def test_fingers_stand_around_the_axis_and_bend_towards_it():
    gripper = tdcr.Gripper.around(finger(name="f"), 5, 0.06, azimuth=0.3)
    assert [robot.name for robot in gripper.fingers] == [f"f {k}" for k in range(5)]
    for k, robot in enumerate(gripper.fingers):
        angle = 0.3 + 2 * np.pi * k / 5
        out = np.array([np.cos(angle), np.sin(angle), 0])
        assert robot.base[:3, 3] == pytest.approx(0.06 * out)
        assert robot.base[:3, 0] == pytest.approx(-out)
        tip = tdcr.forward(robot, [-0.004]).tip[:3, 3]
        assert np.hypot(*tip[:2]) < 0.06


@pytest.mark.parametrize("axis", [(0, 0, -2), (1, 0, 0), (1, -2, 3)])
def test_the_axis_may_be_any(axis):
    base = np.eye(4)
    base[2, 3] = 0.01
    gripper = tdcr.Gripper.around(finger(base=base), 3, 0.05, axis=axis, center=(1, 2, 3))
    unit = np.array(axis) / np.linalg.norm(axis)
    for robot in gripper.fingers:
        assert robot.base[:3, 2] == pytest.approx(unit)
        offset = robot.base[:3, 3] - [1, 2, 3]
        assert offset @ unit == pytest.approx(0.01)
        assert np.linalg.norm(offset - 0.01 * unit) == pytest.approx(0.05)
        assert robot.base[:3, 0] @ (offset - 0.01 * unit) == pytest.approx(-0.05)


def test_a_gripper_is_a_value():
    gripper = tdcr.Gripper.around(finger(), 3, 0.06)
    assert gripper == tdcr.Gripper(gripper.fingers)
    assert pickle.loads(pickle.dumps(gripper)) == gripper
    assert hash(copy.deepcopy(gripper)) == hash(gripper)
    assert gripper != tdcr.Gripper(gripper.fingers[:2])


@pytest.mark.parametrize("small", [0.0, 1e-17, 1e-12, 1e-8, 1e-6, 1e-4, 0.1, 1.0])
@pytest.mark.parametrize("end", [-1.0, 0.0, 1.0])
def test_the_axis_is_exact_near_the_poles_too(small, end):
    for lean in ((1, 0), (0, -1), (0.6, 0.8)):
        axis = np.array([small * lean[0], small * lean[1], end])
        if not axis.any():
            continue
        turn = least_turn(axis)
        assert np.abs(turn.T @ turn - np.eye(3)).max() < 1e-15
        assert np.linalg.det(turn) == pytest.approx(1, abs=1e-15)
        unit = axis / np.linalg.norm(axis)
        assert np.abs(turn[:, 2] - unit).max() <= 1e-15
        # The least angle: about an axis across both.
        across = np.array([-axis[1], axis[0], 0])
        if small > 1e-14:
            assert np.abs(turn @ across - across).max() <= 1e-15 * small
        assert len(tdcr.Gripper.around(finger(), 3, 0.06, axis=axis).fingers) == 3


def test_the_axis_at_the_poles_and_of_any_length():
    assert least_turn(np.array([0, 0, 2.0])).tolist() == np.eye(3).tolist()
    assert least_turn(np.array([0, 0, -2.0])).tolist() == np.diag([1.0, -1, -1]).tolist()
    for length in (5e-324, 1e-200, 1e300):
        assert least_turn(np.array([0, length, 0]))[:, 2].tolist() == [0, 1, 0]


# --- closing -----------------------------------------------------------------------------------


def test_a_closing_is_its_forward_solves(grasp):
    assert grasp.ok
    assert grasp.shares.tolist() == np.linspace(0, 1, 9).tolist()
    assert len(grasp.shapes) == 9
    for k, robot in enumerate(tdcr.Gripper.around(finger(), 3, 0.06).fingers):
        for share, row in zip(grasp.shares, grasp.shapes, strict=True):
            own = tdcr.forward(robot, [-0.003 * share], obstacles=BALL).require()
            assert row[k].robot == robot
            assert row[k].positions == pytest.approx(own.positions, abs=1e-8)
    first = grasp.touch[0]
    assert grasp.touch == (first,) * 3
    step = grasp.shares.tolist().index(first)
    assert 0 < step < 8
    assert grasp.contacts(step)
    assert not grasp.contacts(step - 1)


def test_forces_on_the_object_are_those_on_the_fingers_turned(grasp):
    # By symmetry only the axis is left, and no moment about the centre.
    total = -sum(contact.force for _, contact in grasp.contacts())
    assert grasp.force() == pytest.approx(total)
    assert grasp.force()[:2] == pytest.approx([0, 0], abs=1e-6)
    assert abs(grasp.force()[2]) > 0.1
    assert grasp.moment() == pytest.approx(np.zeros(3), abs=1e-6)
    assert grasp.center().tolist() == [0, 0, 0.14]
    about = np.array([0.1, 0.2, 0.3])
    shifted = np.cross(grasp.center() - about, grasp.force())
    assert grasp.moment(about) == pytest.approx(shifted, abs=1e-6)
    assert grasp.force(0).tolist() == grasp.moment(step=0).tolist() == [0, 0, 0]


def test_each_finger_may_have_its_own_pull():
    gripper = tdcr.Gripper.around(finger(), 3, 0.06)
    floor = tdcr.HalfSpace((0, 0, -0.01), (0, 0, 1))
    told = []
    grasp = gripper.close([[-0.003], [0.0], [np.inf]], [BALL, floor], steps=4, progress=told.append)
    assert told == [1, 2, 3, 4, 5]
    assert grasp.touch[0] is not None
    assert grasp.touch[1:] == (None, None)
    assert {k for k, _ in grasp.contacts()} == {0}
    assert grasp.contacts(obstacle=1) == []
    assert np.isnan(grasp.center(obstacle=1)).all()
    assert [shape.displacements[0] for shape in grasp.shapes[-1]] == [-0.003, 0.0, np.inf]
    assert grasp.force()[0] < 0


def test_a_grasp_is_a_value(grasp):
    again = pickle.loads(pickle.dumps(grasp))
    assert again == grasp
    assert hash(again) == hash(grasp)
    assert not again.shares.flags.writeable
    assert "3 fingers in 8 steps, all converged" in repr(grasp)


# --- force closure -----------------------------------------------------------------------------


def closed(points, pushes, friction=0.0, edges=8):
    points, pushes = np.array(points, float), np.array(pushes, float)
    return positively_span(wrenches(points, pushes, friction, edges))


def test_seven_pushes_hold_a_cube_and_six_do_not():
    """Three pairs of faces, each pair pushed off its middle: turned about all axes both ways."""
    # A frictionless cube: two pushes per face suffice in every direction.
    points, pushes = [], []
    for axis, side in itertools.product(range(3), (-1.0, 1.0)):
        for off in (-0.5, 0.5):
            point = np.zeros(3)
            point[axis], point[axis - 1] = side, off
            points.append(point)
            push = np.zeros(3)
            push[axis] = -side
            pushes.append(push)
    assert closed(points, pushes)
    assert not closed(points[:6], pushes[:6])
    # All through the middle: no moment.
    through = [np.where(np.abs(p) == 1, p, 0) for p in points]
    assert not closed(through, pushes)
    # Nothing from one side.
    assert not closed(points[:-2], pushes[:-2])


def test_a_ball_is_held_with_friction_only():
    angle = 2 * np.pi * np.arange(3) / 3
    points = np.array([np.cos(angle), np.sin(angle), np.zeros(3)]).T
    assert not closed(points, -points)
    assert closed(points, -points, friction=0.2)
    # From above, the cones must reach beyond the horizontal: at 45 degrees from coefficient 1 on.
    above = np.array([np.cos(angle), np.sin(angle), np.ones(3)]).T / np.sqrt(2)
    assert not closed(above, -above, friction=0.9, edges=64)
    assert closed(above, -above, friction=1.1, edges=64)
    # Two points cannot turn about their line.
    assert not closed([[1, 0, 0], [-1, 0, 0]], [[-1, 0, 0], [1, 0, 0]], friction=1.0)


def test_random_columns_agree_with_directions():
    """Columns span positively if and only if every direction has one ahead of it."""
    random = np.random.default_rng(3)
    answers = []
    for _ in range(300):
        columns = random.normal(size=(2, random.integers(2, 6)))
        angles = np.sort(np.arctan2(columns[1], columns[0]))
        gaps = np.diff([*angles, angles[0] + 2 * np.pi])
        expected = bool(gaps.max() < np.pi)
        assert positively_span(columns) == expected
        answers.append(expected)
    assert 50 < sum(answers) < 250


def test_closure_of_a_grasp(grasp):
    assert not grasp.force_closure(step=0)
    assert not grasp.force_closure()
    assert grasp.force_closure(0.5)


def test_closure_is_of_places_on_the_object_not_of_disks_a_bodys_radius_away():
    """Two pairs across a column, one of each 30 mm higher: from the disks they look less steep."""
    radius, fingers = 0.02, []
    for azimuth in (0.0, np.pi / 2):
        for k, height in enumerate((0.0, 0.03)):
            base = np.eye(4)
            base[2, 3] = height
            pair = tdcr.Gripper.around(finger(base=base), 2, 0.055, azimuth=azimuth)
            fingers.append(pair.fingers[k])
    for column in (
        tdcr.Box((0, 0, 0.15), (0.03, 0.03, 0.06)),
        tdcr.Cylinder((0, 0, 0), (0, 0, 1), 0.03),
    ):
        settings = tdcr.RodSettings(body_radius=radius)
        grasp = tdcr.Gripper(fingers).close([-0.003], column, steps=6, settings=settings)
        touching = [contact for _, contact in grasp.contacts()]
        assert {contact.kind for contact in touching} == {"center"}
        disks = np.array([contact.point for contact in touching])
        normals = np.array([contact.normal for contact in touching])
        moved = disks - normals * [[contact.gap + radius] for contact in touching]
        assert np.abs(tdcr.clearance(column, moved)).max() < 1e-12
        frictions = np.linspace(0.005, 0.995, 100)
        by_hand = [closed(moved, -normals, friction) for friction in frictions]
        assert [grasp.force_closure(friction) for friction in frictions] == by_hand
        assert [closed(disks, -normals, friction) for friction in frictions] != by_hand
        # A force along the normal has the same moment from both.
        forces = np.array([-contact.force for contact in touching])
        about = np.array([0.01, 0.02, 0.03])
        assert grasp.moment(about) == pytest.approx(
            np.cross(disks - about, forces).sum(axis=0), abs=1e-9
        )


def test_the_center_of_what_has_none_is_that_of_the_places_touched():
    radius, bar = 0.02, tdcr.Cylinder((0, 0, 0.13), (0, 1, 0), 0.04)
    gripper = tdcr.Gripper.around(finger(), 3, 0.08)
    settings = tdcr.RodSettings(body_radius=radius)
    grasp = gripper.close([-0.004], bar, steps=8, settings=settings)
    touching = [contact for _, contact in grasp.contacts()]
    assert {contact.kind for contact in touching} == {"center"}
    moved = [c.point - c.normal * (c.gap + radius) for c in touching]
    assert grasp.center() == pytest.approx(np.mean(moved, axis=0), abs=1e-15)
    disks = np.mean([c.point for c in touching], axis=0)
    assert np.linalg.norm(grasp.center() - disks) > 1e-3


# --- pictures and the paper's cases ------------------------------------------------------------


def test_pictures(grasp, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    first, last = grasp.plot(0), grasp.plot()
    assert last.get_title() == f"100% of the pull, {len(grasp.contacts())} contacts"
    assert first.get_xlim() == last.get_xlim()
    assert len(last.collections) > len(first.collections)
    assert grasp.plot(ax=first, title="") is first
    pyplot.close("all")
    with pytest.raises(tdcr.InvalidInput, match=r"path: expected one ending in \.gif"):
        grasp.animate(tmp_path / "closing.mp4")
    short = tdcr.Grasp(grasp.shares[[0, -1]], (grasp.shapes[0], grasp.shapes[-1]))
    short.animate(tmp_path / "closing.gif", fps=2)
    pillow = pytest.importorskip("PIL.Image")
    with pillow.open(tmp_path / "closing.gif") as picture:
        assert picture.n_frames == 2


@pytest.mark.parametrize("done", [0, 3])
@pytest.mark.parametrize("there", [False, True])
def test_a_closing_that_is_interrupted_is_not_written(done, there, grasp, tmp_path, monkeypatch):
    """Before the first frame too, when there is nothing to write; an older file stays."""
    pytest.importorskip("matplotlib")
    from tdcr._plot import grasp as grasp_pictures

    path = tmp_path / "closing.gif"
    if there:
        path.write_bytes(b"older")
    plot, drawn = grasp_pictures.plot_grasp, []

    def interrupted(shown, step, *others):
        if len(drawn) == done:
            raise KeyboardInterrupt
        drawn.append(step)
        return plot(shown, step, *others)

    monkeypatch.setattr(grasp_pictures, "plot_grasp", interrupted)
    with pytest.raises(KeyboardInterrupt):
        grasp.animate(path)
    assert drawn == list(range(done))
    assert [(one.name, one.read_bytes()) for one in tmp_path.iterdir()] == [
        ("closing.gif", b"older")
    ] * there


@pytest.fixture(scope="module")
def example():
    with example_script("mahapatra_ghosal_grippers") as module:
        yield module


def test_the_papers_fingers_lie_on_the_ball_after_their_pull(example):
    gripper, ball = example.sphere_gripper()
    for robot in gripper.fingers:
        assert tdcr.clearance(ball, robot.rest_frames[:, :3, 3]).min() > example.HOLE
        # Without the ball the far part of the backbone runs 8 mm before it.
        shape = tdcr.forward(robot, [-example.PULL]).require()
        distance = tdcr.clearance(ball, shape.positions)
        assert np.abs(distance[5:] - example.HOLE).max() < 1e-5
    grasp = gripper.close([-example.PULL * 10 / 9], ball, steps=10)
    assert grasp.ok
    assert len({share for share in grasp.touch}) == 1
    assert grasp.force()[2] < 0
    # All at one height, where the ball slips down out of cones that do not reach the horizontal.
    assert not grasp.force_closure(0.5)
    assert grasp.force_closure(2.0)


def test_the_second_tendon_turns_the_cube(example):
    _, moments, grasps = example.turn_cube(steps=10)
    assert all(grasp.ok for grasp in grasps)
    about_z = np.array(moments)[:, 2]
    assert about_z[0] == pytest.approx(0.0, abs=1e-8)
    assert (np.diff(about_z) < 0).all()
    assert about_z[-1] < -0.01
