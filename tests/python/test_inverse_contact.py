"""The inverse of the rod among obstacles and under loads; tensions among obstacles."""

import pickle

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr
from tdcr import Status

STEEL = tdcr.Backbone(0.180, 18, youngs_modulus=200e9, diameter=0.001)
ROBOT = tdcr.Robot(STEEL, [tdcr.Tendon(2 * np.pi * k / 3, 0.008) for k in range(3)])
BAR = tdcr.Cylinder(point=(-0.030, 0, 0.100), axis=(0, 1, 0), radius=0.015)
FINGER = tdcr.Robot(STEEL, [tdcr.Tendon(np.pi, 0.008)])


def tips(robot, count, **around):
    """Return tips of shapes that lean on something."""
    rng = np.random.default_rng(3)
    found = []
    while len(found) < count:
        pulls = rng.uniform(0, 6, len(robot.tendons))
        pulls[rng.integers(len(pulls))] = 0
        shape = tdcr.forward(robot, tensions=pulls, **around)
        if shape.ok and any(np.linalg.norm(c.force) > 0 for c in shape.contacts):
            found.append(shape.tip)
    return np.array(found)


def test_a_trunk_leans_on_a_cylinder_to_reach_its_target():
    target = tdcr.forward(FINGER, [-0.008], obstacles=BAR).require().positions[-1]
    # Without the bar a single tendon bends the trunk elsewhere.
    assert tdcr.inverse(FINGER, target).status is Status.unreachable
    answer = tdcr.inverse(FINGER, target, obstacles=BAR)
    assert answer.ok
    assert answer.message == ""
    np.testing.assert_allclose(answer.displacements, [-0.008], rtol=0, atol=1e-9)
    shape = tdcr.forward(FINGER, answer.displacements, obstacles=BAR).require()
    np.testing.assert_allclose(shape.positions[-1], target, rtol=0, atol=1e-8)
    assert np.linalg.norm(shape.contacts[0].force) > 0.1
    np.testing.assert_allclose(answer.shape.positions, shape.positions, rtol=0, atol=1e-8)
    assert answer.shape.obstacles == (BAR,)


def test_weight_and_obstacles_are_counted():
    around = {"obstacles": BAR, "loads": tdcr.Loads(backbone_density=7850, disk_mass=0.001)}
    for tip in tips(ROBOT, 5, **around):
        answer = tdcr.inverse(ROBOT, tip[:3, 3], **around).require()
        shape = tdcr.forward(ROBOT, answer.displacements, **around)
        np.testing.assert_allclose(shape.positions[-1], tip[:3, 3], rtol=0, atol=1e-8)
        assert (answer.tensions >= 0).all()
        assert min((c.gap for c in answer.shape.contacts), default=0) > -1e-10


def test_rows_and_paths_are_those_of_single_targets():
    targets = tips(ROBOT, 6, obstacles=BAR)[:, :3, 3]
    rows = tdcr.inverse_batch(ROBOT, targets, obstacles=[BAR], threads=2)
    assert rows.ok.all()
    alone = [tdcr.inverse(ROBOT, target, obstacles=[BAR]) for target in targets]
    np.testing.assert_array_equal(rows.displacements, [one.displacements for one in alone])
    # What a row leaves behind does not change the next one, out of reach.
    held = {"bounds": tdcr.Bounds(tension=(0, 0)), "obstacles": [BAR]}
    mixed = [[0, 0, 0.18], [0, 0.05, 0.3]]
    found = tdcr.inverse_batch(ROBOT, mixed, **held)
    assert found.ok.tolist() == [True, False]
    alone = [tdcr.inverse(ROBOT, target, **held) for target in mixed]
    np.testing.assert_array_equal(found.displacements, [one.displacements for one in alone])
    np.testing.assert_allclose(rows[2].shape.positions[-1], targets[2], rtol=0, atol=1e-8)
    assert pickle.loads(pickle.dumps(rows)) == rows
    pulls = np.linspace(-0.004, -0.010, 60)[:, None]
    way = tdcr.forward_batch(FINGER, pulls, obstacles=BAR, warm=True, fields=["positions"])
    path = tdcr.track(FINGER, way.positions[:, -1], start=pulls[0], obstacles=BAR)
    assert path.ok.all()
    assert (path.starts == 1).all()
    np.testing.assert_allclose(path.displacements, pulls, rtol=0, atol=1e-8)


def test_out_of_reach_is_told():
    search = tdcr.InverseSettings(starts=4)
    answer = tdcr.inverse(ROBOT, [-0.03, 0, 0.1], obstacles=BAR, search=search)
    assert answer.status is Status.unreachable
    assert "m off the target" in answer.message
    assert answer.error > 1e-3
    assert min((c.gap for c in answer.shape.contacts), default=0) > -1e-9


def test_tensions_among_obstacles_and_under_loads():
    loads = tdcr.Loads(disk_mass=0.001)
    shape = tdcr.forward(ROBOT, tensions=[0, 5, 4], obstacles=BAR, loads=loads).require()
    np.testing.assert_array_equal(shape.tensions, [0, 5, 4])
    assert shape.contacts
    again = tdcr.forward(ROBOT, shape.displacements, obstacles=BAR, loads=loads)
    np.testing.assert_allclose(again.positions, shape.positions, rtol=0, atol=1e-9)
    np.testing.assert_allclose(again.contacts[0].force, shape.contacts[0].force, rtol=1e-6)
    with pytest.raises(tdcr.InvalidInput, match="tensions: expected finite tensions of 0 or more"):
        tdcr.forward(ROBOT, tensions=[0, 5, -4], obstacles=BAR)


def test_bad_input_is_named():
    target = [0, 0.05, 0.15]
    with pytest.raises(tdcr.InvalidInput, match='obstacles for model "constant_curvature"'):
        tdcr.inverse(ROBOT, target, model="constant_curvature", obstacles=BAR)
    with pytest.raises(TypeError, match="obstacles: expected"):
        tdcr.inverse(ROBOT, target, obstacles=3)
    with pytest.raises(TypeError, match="loads: expected Loads"):
        tdcr.inverse_batch(ROBOT, [target], loads=3)
    soft = tdcr.Robot(tdcr.Backbone(0.1, 10), [tdcr.Tendon(0.0, 0.008)])
    with pytest.raises(tdcr.InvalidInput, match="youngs_modulus"):
        tdcr.inverse(soft, target, loads=tdcr.Loads())


@pytest.mark.parametrize("call", [tdcr.inverse, tdcr.inverse_batch, tdcr.track])
def test_what_a_function_raises_comes_out(call):
    def broken(point):
        if point[2] < 0.17:
            raise ZeroDivisionError("no distance here")
        return 1.0

    target = [0.05, 0.0, 0.15] if call is tdcr.inverse else [[0.05, 0.0, 0.15]] * 3
    gradient = lambda point: (0.0, 0.0, 1.0)  # noqa: E731
    with pytest.raises(ZeroDivisionError, match="no distance here"):
        call(ROBOT, target, obstacles=tdcr.SignedDistance(broken, gradient))


@pytest.mark.parametrize("call", [tdcr.inverse, tdcr.inverse_batch, tdcr.track])
def test_a_function_that_fails_at_once_panics_nowhere(call, capfd):
    def broken(point):
        raise ZeroDivisionError("no distance anywhere")

    target = [0.05, 0.0, 0.15] if call is tdcr.inverse else [[0.05, 0.0, 0.15]] * 3
    with pytest.raises(ZeroDivisionError, match="no distance anywhere"):
        call(ROBOT, target, obstacles=tdcr.SignedDistance(broken))
    assert "panicked" not in capfd.readouterr().err


def test_answers_that_rest_leads_to_are_told_from_others():
    """Tendons of a segment depend on each other: rounding must not look like another shape."""
    bone = tdcr.Backbone([0.06] * 3, [7] * 3, youngs_modulus=200e9, diameter=0.001)
    ends = [7 * (k // 3 + 1) for k in range(9)]
    trunk = tdcr.Robot(bone, [tdcr.Tendon(2.1 * k, 0.008, end=end) for k, end in enumerate(ends)])
    around = {"obstacles": BAR, "loads": tdcr.Loads(disk_mass=0.0003, tip_force=(0.02, 0, 0.01))}
    for target in tips(trunk, 25, **around)[:, :3, 3]:
        answer = tdcr.inverse(trunk, target, **around).require()
        assert answer.message == ""
        shape = tdcr.forward(trunk, answer.displacements, **around).require()
        np.testing.assert_allclose(shape.positions[-1], target, rtol=0, atol=1e-8)
        # None hangs slack by more than a hair.
        rest = tdcr.forward(trunk, tensions=np.zeros(9)).tendon_lengths
        slack = rest + answer.displacements - answer.shape.tendon_lengths
        assert np.abs(slack).max() < 2e-9


def test_long_tools_do_not_look_like_other_shapes():
    tool = np.eye(4)
    tool[2, 3] = 1000.0
    far = tdcr.Robot(STEEL, ROBOT.tendons, tool=tool)
    target = (tdcr.forward(far, tensions=[3, 1, 0], obstacles=BAR).tip @ tool)[:3, 3]
    answer = tdcr.inverse(far, target, obstacles=BAR).require()
    assert answer.message == ""


def test_a_robot_that_rests_in_an_obstacle_is_led_out_by_its_tendons():
    box = tdcr.Box((0.005, 0.001, 0.064), (0.006, 0.006, 0.006))
    assert not tdcr.forward(ROBOT, tensions=[0, 0, 0], obstacles=box).ok
    target = tdcr.forward(ROBOT, tensions=[0, 6, 1], obstacles=box).require().positions[-1]
    answer = tdcr.inverse(ROBOT, target, obstacles=box).require()
    shape = tdcr.forward(ROBOT, answer.displacements, obstacles=box).require()
    np.testing.assert_allclose(shape.positions[-1], target, rtol=0, atol=1e-8)


def test_no_shape_at_all_is_told():
    ball = tdcr.Sphere((0, 0, 0), 0.02)
    search = tdcr.InverseSettings(starts=4)
    answer = tdcr.inverse(ROBOT, [0, 0.05, 0.15], obstacles=ball, search=search)
    assert answer.status is Status.infeasible
    assert answer.message.startswith("none of 4 starts leads to a shape of the robot; without")
    assert "deep in obstacles[0] at disk 1" in answer.message
    assert np.isnan(answer.error)
    rows = tdcr.inverse_batch(ROBOT, [[0, 0.05, 0.15]], obstacles=ball, search=search)
    assert rows[0].message == "row 0: no shape was found among the obstacles"
    places = tdcr.inverse(ROBOT, positions=np.ones((18, 3)), obstacles=ball, search=search)
    assert places.message == answer.message


LONG = """
    import numpy as np, tdcr
    steel = tdcr.Backbone([0.06] * 3, [90] * 3, youngs_modulus=200e9, diameter=0.001)
    ends = [90 * (k // 3 + 1) for k in range(9)]
    robot = tdcr.Robot(steel, [tdcr.Tendon(2.1 * k, 0.008, end=e) for k, e in enumerate(ends)])
    bar = tdcr.Cylinder(point=(-0.03, 0, 0.1), axis=(0, 1, 0), radius=0.015)
    far = np.full((3000, 3), 0.2)
    starts = np.where(np.arange(9) % 3 == 0, -0.004, np.inf) * np.ones((3000, 1))
    way = np.linspace([0, 0.02, 0.17], [0.2, 0.2, 0.2], 3000)
    places = np.full((270, 3), 0.06)
"""


@pytest.mark.parametrize(
    "call",
    [
        "tdcr.inverse(robot, far[0], obstacles=bar)",
        "tdcr.inverse(robot, far[0], obstacles=bar, method='pso')",
        "tdcr.inverse_batch(robot, far, obstacles=bar)",
        "tdcr.inverse_batch(robot, far, start=starts, obstacles=bar)",
        "tdcr.inverse_batch(robot, far * 0.1, start=starts)",
        "tdcr.track(robot, way, obstacles=bar)",
        "tdcr.inverse(robot, positions=places, obstacles=bar)",
    ],
)
def test_an_interrupt_ends_long_searches(call):
    assert_interrupts(LONG, call)


@pytest.mark.slow
def test_swarms_are_few_and_lose_nothing_against_descents():
    bone = tdcr.Backbone([0.06] * 3, [4] * 3, youngs_modulus=200e9, diameter=0.001)
    ends = [4 * (k // 3 + 1) for k in range(9)]
    trunk = tdcr.Robot(bone, [tdcr.Tendon(2.1 * k, 0.008, end=end) for k, end in enumerate(ends)])
    errors = []
    for method in ("newton", "pso"):
        # Far out of reach: all starts are tried.
        answer = tdcr.inverse(trunk, [-0.15, 0, 0.1], obstacles=BAR, method=method)
        assert answer.status is Status.unreachable
        assert answer.starts == 50
        errors.append(answer.error)
    assert errors[1] < errors[0] + 1e-4


@pytest.mark.slow
def test_only_the_first_starts_among_obstacles_are_swarms():
    bone = tdcr.Backbone(0.06, 3, youngs_modulus=200e9, diameter=0.001)
    finger = tdcr.Robot(bone, [tdcr.Tendon(2.1 * k, 0.008) for k in range(3)])
    asked = 0

    def wall(point):
        nonlocal asked
        asked += 1
        return point[0] + 0.02

    counts = {}
    for starts in (8, 20):
        swarm = tdcr.PsoSettings(particles=3, max_iterations=3)
        search = tdcr.InverseSettings(starts=starts, swarm=swarm)
        asked = 0
        answer = tdcr.inverse(
            finger, [0, 0, 0.08], obstacles=tdcr.SignedDistance(wall), method="pso", search=search
        )
        assert (answer.status, answer.starts) == (Status.unreachable, starts)
        counts[starts] = asked
    # Twelve more, if they were swarms, would ask two and a half times as often.
    assert counts[20] < 1.6 * counts[8], counts
