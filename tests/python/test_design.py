"""Design from Python: round trips, the finger around a sphere, bad input."""

import copy
import pickle
import runpy
from pathlib import Path

import numpy as np
import pytest

import tdcr
from tdcr import design

FREE = np.inf
LENGTH, BASE, CENTRE = 0.18, 0.042, 0.110


def sphere_curve(radius):
    """An arc from the finger's base, upwards, that goes over into a circle around the sphere."""
    r = (BASE**2 + CENTRE**2 - radius**2) / (2 * (radius - BASE))
    turn = np.arctan2(CENTRE, BASE + r)
    entry, around = turn * np.linspace(0, 1, 101), -turn + np.linspace(0, 2.5, 201)[1:]
    x = np.concatenate([BASE + r * (1 - np.cos(entry)), radius * np.cos(around)])
    z = np.concatenate([r * np.sin(entry), CENTRE + radius * np.sin(around)])
    return np.stack([x, 0 * x, z], axis=1)


def finger():
    base = np.eye(4)
    base[0, 3] = BASE
    return tdcr.Robot(tdcr.Backbone(LENGTH, 9), [tdcr.Tendon(np.pi, 0.008)], base=base)


def prebent(straight=False):
    """Return a robot with a helical and a straight tendon, bent in space or straightened."""
    s = np.linspace(0, 1, 12)
    rest = np.stack([0.1 * np.sin(4 * s), 0.15 * np.cos(3 * s), 0 * s], axis=1)
    backbone = tdcr.Backbone(0.24, 12, poisson_ratio=0.4, rest=None if straight else rest)
    tendons = [tdcr.Tendon.helical(0.3, 0.008, turns=0.4), tdcr.Tendon(2.0, 0.01)]
    turn = np.array([[0, 0, 1, 0.1], [1, 0, 0, 0.2], [0, 1, 0, 0.3], [0, 0, 0, 1]])
    return tdcr.Robot(backbone, tendons, base=turn, name="bent")


def test_a_rest_shape_that_was_forgotten_is_designed_back():
    pulls = [-0.004, -0.006]
    shape = tdcr.forward(prebent(), pulls).require()
    assert (shape.tensions > 0).all()
    answer = design.prebend(prebent(straight=True), shape.positions[1:], pulls).require()
    assert answer.error.shape == (13,)
    assert answer.error.max() < 1e-10 * 0.24
    rest = answer.robot.backbone.rest
    assert np.abs(rest - prebent().backbone.rest).max() < 1e-7
    # Nothing else of the robot changed; the shape is its own, and what forward says.
    assert answer.robot.tendons == prebent().tendons
    assert answer.robot.name == "bent"
    assert answer.shape.robot == answer.robot
    assert (answer.shape.frames == tdcr.forward(answer.robot, pulls).frames).all()
    with_base = design.prebend(prebent(straight=True), shape.positions, pulls)
    assert with_base == answer


@pytest.mark.parametrize("radius", [0.056, 0.064])
@pytest.mark.parametrize("subsegment", ["arc", "link"])
def test_the_finger_lies_on_a_circle_around_the_sphere(radius, subsegment):
    places = design.on_curve(finger(), sphere_curve(radius), subsegment)
    settings = design.PrebendSettings(rod=tdcr.RodSettings(subsegment=subsegment))
    answer = design.prebend(finger(), places, [-0.03 * LENGTH], settings=settings)
    assert answer.ok
    assert (answer.error**2).sum() <= 1e-16
    tip = answer.shape.tip[:3, 3]
    assert np.hypot(tip[0], tip[2] - CENTRE) == pytest.approx(radius, abs=1e-6)


def test_one_shape_by_different_pulls():
    """Figure 10 of Mahapatra & Ghosal: other rest shapes, the same final shape."""
    places = design.on_curve(finger(), sphere_curve(0.064))
    answers = [design.prebend(finger(), places, [-p * LENGTH]) for p in (0, 0.01, 0.02, 0.03, 0.04)]
    bends = [answer.require().robot.backbone.rest[:, 1].sum() for answer in answers]
    assert (np.diff(bends) > 0.05).all()
    finals = np.array([answer.shape.positions for answer in answers])
    assert np.abs(finals - finals[0]).max() < 1e-10 * LENGTH
    tensions = [answer.shape.tensions[0] for answer in answers]
    assert (np.diff(tensions) > 0).all()


def test_a_curve_may_be_a_function():
    robot = finger()

    def circle(s):
        return [BASE + 0.1 * (1 - np.cos(s / 0.1)), 0.0, 0.1 * np.sin(s / 0.1)]

    answer = design.prebend(robot, circle, [-0.005]).require()
    off = np.hypot(answer.shape.positions[:, 0] - BASE - 0.1, answer.shape.positions[:, 2])
    assert off == pytest.approx(0.1, abs=1e-7)
    # Equal arcs on a circle that leaves along z: 20 mm each.
    turns = np.arctan2(answer.target_positions[:, 2], BASE + 0.1 - answer.target_positions[:, 0])
    assert turns == pytest.approx(0.2 * np.arange(1, 10), abs=1e-6)


def test_bounds_smoothness_and_other_rods_are_met_by_descent():
    places = design.on_curve(finger(), sphere_curve(0.064))
    pulls = [-0.03 * LENGTH]
    free = design.prebend(finger(), places, pulls).require()
    bends = np.linalg.norm(free.robot.backbone.rest[:, :2], axis=1)
    bound = 0.8 * bends.max()
    held = design.prebend(finger(), places, pulls, settings=tdcr.PrebendSettings(max_bend=bound))
    assert held.status == "unreachable"
    assert np.linalg.norm(held.robot.backbone.rest, axis=1).max() <= bound * (1 + 1e-12)
    # Bends that swing about the curve make up for much of the bound, also out of the plane.
    assert 1e-6 < held.error.max() < 1e-4
    assert "at max_bend" in held.message
    smooth = design.prebend(finger(), places, pulls, settings=tdcr.PrebendSettings(smoothness=0.1))
    assert smooth.ok
    disk = int(smooth.error.argmax())
    assert smooth.message.startswith(f"disk {disk} stays ")
    assert "from its place, with smoothness" in smooth.message
    roughness = [np.diff(a.robot.backbone.rest, axis=0).std() for a in (free, smooth)]
    assert roughness[1] < roughness[0]
    rod = tdcr.RodSettings(tendons="proportional")
    settings = tdcr.PrebendSettings(rod=rod, tolerance=1e-3)
    other = design.prebend(finger(), places, pulls, settings=settings).require()
    assert other.shape.settings == rod


def test_what_cannot_be_reached_is_said():
    robot = finger()
    ahead = robot.rest_frames[1:, :3, 3]
    far = ahead.copy()
    far[4:] += [0, 0, 0.01]
    answer = design.prebend(robot, far, [-0.002])
    assert answer.status == "unreachable"
    assert "from disk 4 to disk 5 it is 0.030000 m" in answer.message
    assert answer.error.argmax() > 4
    with pytest.raises(tdcr.NotConverged) as caught:
        answer.require()
    assert caught.value.result is answer
    # Aside from the base: chords that fit, no arc that leaves along z.
    aside = np.outer(np.arange(1, 10) * 0.02, np.sqrt([0.5, 0, 0.5])) + np.array([BASE, 0, 0])
    answer = design.prebend(robot, aside, [-0.002])
    assert answer.status == "unreachable"
    assert "45.0 deg off the base's z axis" in answer.message
    backwards = design.prebend(robot, [2 * BASE, 0, 0] - ahead, [-0.002])
    assert not backwards.ok
    assert "180.0 deg off the base's z axis" in backwards.message


def bar():
    return tdcr.Robot(tdcr.Backbone(LENGTH, 9), [tdcr.Tendon(np.pi, 0.008)])


def arc():
    turn = np.linspace(0, 2, 50)[:, None]
    points = 0.1 * np.hstack([1 - np.cos(turn), 0 * turn, np.sin(turn)])
    return design.on_curve(bar(), points)


def about_y(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


AHEAD = np.outer(np.arange(1, 10) * 0.02, [0, 0, 1])
BEHIND, CHORD = "disk 1 would be behind disk 0", "from disk 0 to disk 1"


@pytest.mark.parametrize(
    ("places", "best", "why"),
    [
        (arc() * [1, 1, -1], 14.831e-3, BEHIND),
        (0.8 * AHEAD, 2.3442e-3, CHORD),
        (0.5 * AHEAD @ about_y(1.2), 7.106e-3, CHORD),
        (arc() @ about_y(-2.0), 6.8983e-3, BEHIND),
        (np.add(arc(), [0, 0, 0.03]), 24.3031e-3, CHORD),
    ],
    ids=["backwards", "too short", "short and sideways", "sideways", "lifted"],
)
def test_places_out_of_reach_are_come_near(places, best, why):
    """The least root mean square of scipy's least_squares from 40 random rest shapes [m]."""
    answer = design.prebend(bar(), places, [-0.005])
    assert answer.status == "unreachable"
    assert answer.shape.ok
    assert np.sqrt((answer.error[1:] ** 2).mean()) < 1.01 * best
    assert why in answer.message


def test_chords_are_blamed_only_for_what_they_explain():
    """Chords off by 0.01 % take disks 18 um away, not millimetres."""
    pulls, settings = [-0.005], design.PrebendSettings(max_bend=0.22)
    answer = design.prebend(bar(), arc() * 1.0001, pulls, settings=settings)
    assert answer.status == "unreachable"
    assert answer.error.max() > 1e-3
    assert "from disk 0 to" not in answer.message
    assert "9 rest bends, from disk 0 the first, are at max_bend, 0.220000 rad" in answer.message
    free = design.prebend(bar(), arc() * 1.0001, pulls)
    assert free.error.max() < 1e-4
    assert "from disk 0 to disk 1" in free.message


@pytest.mark.parametrize("subsegment", ["arc", "link"])
def test_curves_that_leave_the_base_sideways_are_told(subsegment):
    line = 0.2 * np.linspace(0, 1, 30)[:, None] * [0, 0, 1]
    for angle in (90, 120, 180):
        with pytest.raises(tdcr.InvalidInput, match=rf"z axis.*leaves {angle}.0 deg off") as caught:
            design.on_curve(bar(), line @ about_y(np.radians(angle)), subsegment)
        assert caught.value.argument == "points"
    with pytest.warns(RuntimeWarning, match="leaves the base 45.0 deg off its z axis"):
        design.on_curve(bar(), line @ about_y(np.radians(45)), subsegment)
    with pytest.raises(tdcr.InvalidInput, match="target_positions: of the curve's points, "):
        design.prebend(bar(), lambda s: [s, 0.0, 0.0], [-0.005])


def test_results_are_values():
    answer = design.prebend(finger(), design.on_curve(finger(), sphere_curve(0.064)), [-0.004])
    for other in (copy.deepcopy(answer), pickle.loads(pickle.dumps(answer))):
        assert other == answer
        assert hash(other) == hash(answer)
    for array in (answer.error, answer.target_positions):
        assert not array.flags.writeable
    assert repr(answer).startswith("<Prebend of 9 subsegments, converged")
    settings = tdcr.PrebendSettings(rod=tdcr.RodSettings(elements=2), smoothness=0.5)
    assert pickle.loads(pickle.dumps(settings)) == settings
    assert hash(settings) == hash(copy.copy(settings))
    assert settings != tdcr.PrebendSettings()
    assert eval(repr(settings), vars(tdcr)) == settings


NINE = np.zeros((9, 3))
BAD = [
    ("target_positions", NINE[1:], [-0.004]),
    ("target_positions", NINE[:, :2], [-0.004]),
    ("target_positions", [[0.0], [0.0, 1.0]], [-0.004]),
    ("target_positions", np.full((9, 3), np.nan), [-0.004]),
    ("target_positions", np.full((9, 3), 1e200), [-0.004]),
    ("target_positions", np.full((9, 3), -1e7), [-0.004]),
    ("target_positions[0]", np.zeros((10, 3)), [-0.004]),
    ("target_positions[0]", np.full((10, 3), np.nan), [-0.004]),
    ("target_positions", lambda s: [s, 0.0], [-0.004]),
    ("target_positions", lambda s: [s, 0.0, np.nan], [-0.004]),
    ("target_positions", lambda s: [0.0, 0.0, s / 2], [-0.004]),
    ("displacements", NINE, [-0.004, 0.0]),
    ("displacements", NINE, [np.nan]),
]


@pytest.mark.parametrize(("argument", "targets", "pulls"), BAD)
def test_bad_input_names_the_argument(argument, targets, pulls):
    with pytest.raises(tdcr.InvalidInput, match=r"expected .*got ") as caught:
        design.prebend(finger(), targets, pulls)
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    ("argument", "value"),
    [("max_bend", 0.0), ("smoothness", -1.0), ("tolerance", np.nan), ("max_iterations", 0)],
)
def test_bad_settings_name_the_argument(argument, value):
    with pytest.raises(tdcr.InvalidInput, match=r"expected .*got ") as caught:
        design.PrebendSettings(**{argument: value})
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    "points",
    [[[0, 0, 0]], [[0, 0, 0], [0, 0, 0.1]], [[0, 0, 0], [0, 0, np.nan]], [[0, 0, 0]] * 2, [1, 2]],
)
def test_curves_that_cannot_be_used(points):
    with pytest.raises(tdcr.InvalidInput, match=r"expected .*got ") as caught:
        design.on_curve(finger(), points)
    assert caught.value.argument == "points"


def test_wrong_types():
    with pytest.raises(tdcr.InvalidInput, match="subsegment"):
        design.on_curve(finger(), sphere_curve(0.064), "spline")
    for arguments, settings in (
        (("robot", NINE, [0.0]), None),
        ((finger(), "places", [0.0]), None),
        ((finger(), NINE, ["pull"]), None),
        ((finger(), lambda s: list("abc"), [0.0]), None),
        ((finger(), NINE, [0.0]), tdcr.RodSettings()),
    ):
        with pytest.raises(TypeError, match=r"expected .*got "):
            design.prebend(*arguments, settings=settings)


def test_the_example_draws_what_is_kept(tmp_path):
    pytest.importorskip("matplotlib")
    root = Path(__file__).resolve().parents[2]
    script = root / "examples" / "mahapatra_ghosal_prebend.py"
    runpy.run_path(str(script))["figures"](tmp_path)
    for name, shapes in (("mahapatra_sphere_finger", 2), ("mahapatra_10", 6)):
        assert (tmp_path / f"{name}.png").exists()
        made, kept = (
            np.genfromtxt(folder / f"{name}.csv", delimiter=",", skip_header=1)
            for folder in (tmp_path, root / "examples/figures")
        )
        assert len(made) == 10 * shapes
        assert made == pytest.approx(kept, abs=1e-5, nan_ok=True)


def test_places_behind_the_base_are_told_not_refused():
    robot = tdcr.Robot(tdcr.Backbone(0.04, 2), [tdcr.Tendon(0.0, 0.005)])
    places = [[0.002, -0.005, -0.004], [-0.023, 0.013, 0.007]]
    answer = design.prebend(robot, places, [-0.001])
    assert answer.status == tdcr.Status.unreachable
    assert "off the base's z axis" in answer.message
