"""What inverses give back and refuse: values, messages, bad input; measures of the Jacobian."""

from __future__ import annotations

import copy
import pickle
import warnings

import numpy as np
import pytest
from test_inverse import MODEL, finger, rows, tips, trunk

import tdcr
from tdcr import Bounds, InverseSettings, Status


@pytest.fixture(scope="module")
def placed():
    """Return a trunk and frames it reaches."""
    robot = trunk()
    return robot, tips(robot, rows(3))


def test_results_are_values(placed):
    robot, targets = placed
    answer = tdcr.inverse(robot, targets[0], model=MODEL, bounds=Bounds(curvature=60.0))
    twin = pickle.loads(pickle.dumps(answer))
    assert twin == answer
    assert hash(twin) == hash(answer)
    assert "converged" in repr(answer)
    with pytest.raises(ValueError, match="read-only"):
        answer.displacements[0] = 0.0
    with pytest.raises(AttributeError):
        answer.status = Status.infeasible
    for other in (twin, copy.deepcopy(answer)):
        for name in ("target", "displacements"):
            assert not getattr(other, name).flags.writeable
    assert answer.energy == answer.shape.energy


def test_batches_are_values(placed):
    robot, targets = placed
    batch, again = (tdcr.inverse_batch(robot, targets, model=MODEL) for _ in range(2))
    twin = pickle.loads(pickle.dumps(batch))
    assert batch == again == twin
    assert hash(batch) == hash(twin)
    for array in (twin.targets, twin.displacements, twin.status, twin.ok, twin.starts):
        assert not array.flags.writeable
    assert batch != tdcr.inverse_batch(robot, targets[:2], model=MODEL)
    assert batch != tdcr.inverse_batch(robot, targets, model=MODEL, bounds=Bounds(curvature=60.0))
    assert batch != batch[0]
    infeasible = tdcr.inverse_batch(finger(), [[0, 0, 0.1]], model=MODEL, bounds=(0.001, 0.002))
    assert pickle.loads(pickle.dumps(infeasible)) == infeasible


def test_bounds_are_kept_as_a_value():
    robot = finger()
    lower, upper = np.full(3, -0.01), np.full(3, 0.01)
    pair = tdcr.inverse(robot, [0.0, 0.0, 0.1], model=MODEL, bounds=(lower, upper))
    lower[0] = 7.0
    bounds = Bounds(displacement=([-0.01] * 3, [0.01] * 3))
    assert pair.bounds == bounds
    assert pair == tdcr.inverse(robot, [0.0, 0.0, 0.1], model=MODEL, bounds=bounds)
    assert pair != tdcr.inverse(robot, [0.0, 0.0, 0.1], model=MODEL)
    assert pair != tdcr.inverse(robot, [0.0, 0.0, 0.1], model=MODEL, bounds=(-0.02, 0.02))


def test_rows_say_what_stood_in_the_way():
    robot = finger()
    positions = tdcr.inverse_batch(robot, [[0.0, 0.0, 0.5]], model=MODEL)
    assert "0.4 m off" in positions[0].message
    assert "rad" not in positions[0].message
    frame = np.eye(4)
    frame[2, 3] = 0.5
    assert "rad off" in tdcr.inverse_batch(robot, [frame], model=MODEL)[0].message
    infeasible = tdcr.inverse_batch(robot, [[0.0, 0.0, 0.1]], model=MODEL, bounds=(0.001, 0.002))
    alone = tdcr.inverse(robot, [0.0, 0.0, 0.1], model=MODEL, bounds=(0.001, 0.002))
    assert infeasible[0].message == f"row 0: {alone.message}"


def test_a_start_of_many_may_be_a_result(placed):
    robot, targets = placed
    answer = tdcr.inverse(robot, targets[0], model=MODEL)
    batch = tdcr.inverse_batch(robot, targets, model=MODEL, start=answer)
    assert batch.iterations[0] == 0
    again = tdcr.inverse_batch(robot, targets, model=MODEL, start=batch)
    assert (again.iterations == 0).all()


@pytest.mark.parametrize("call", [tdcr.inverse_batch, tdcr.track])
@pytest.mark.parametrize("targets", [5.0, np.array(5.0)])
def test_targets_without_rows_are_refused(call, targets):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call(finger(), targets, model=MODEL)
    assert caught.value.argument == "targets"


@pytest.mark.parametrize(
    "value",
    [
        Bounds(),
        Bounds(displacement=(-0.01, 0.02)),
        Bounds(displacement=(-0.01, [0.02, 0.03]), curvature=[10.0, 20.0], length=(0.05, 0.1)),
        InverseSettings(),
        InverseSettings(position_weight=(1, 1, 0), rotation_weight=0.05, starts=7, seed=3),
        InverseSettings(rotation_weight=(1.0, 1.0, 0.0)),
        InverseSettings(least_energy=False, swarm=tdcr.PsoSettings(particles=7)),
    ],
)
def test_bounds_and_settings_are_values(value):
    assert pickle.loads(pickle.dumps(value)) == value
    assert hash(pickle.loads(pickle.dumps(value))) == hash(value)
    names = {
        "Bounds": Bounds,
        "InverseSettings": InverseSettings,
        "PsoSettings": tdcr.PsoSettings,
    }
    if "..." not in repr(value):
        assert repr(eval(repr(value), names)) == repr(value)


SHEAR = np.eye(4)
SHEAR[0, 1] = 0.1
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
NAN = np.eye(4)
NAN[0, 3] = np.nan


@pytest.mark.parametrize(
    ("argument", "target", "keywords"),
    [
        ("target", [0.0, 0.0], {}),
        ("target", np.eye(3), {}),
        ("target", [0.0, np.nan, 0.1], {}),
        ("target", SHEAR, {}),
        ("target", MIRROR, {}),
        ("target", NAN, {}),
        ("target", 2 * np.eye(4), {}),
        ("model", [0, 0, 0.1], {"model": "linkage"}),
        ("model", [0, 0, 0.1], {"model": "magic"}),
        ("method", [0, 0, 0.1], {"method": "magic"}),
        ("settings", [0, 0, 0.1], {"settings": tdcr.LinkageSettings()}),
        ("start", [0, 0, 0.1], {"start": [0.0, 0.0]}),
        ("start", [0, 0, 0.1], {"start": [0.0, 0.0, np.nan]}),
        ("target", [1e200, 0, 0.1], {}),
        ("target", [0, 0, 2e5], {"model": "rod"}),
        ("positions", None, {"model": "rod", "positions": np.full((10, 3), 1e200)}),
        ("bounds", [0, 0, 0.1], {"bounds": (np.nan, 1.0)}),
        ("bounds", [0, 0, 0.1], {"bounds": (1.0, -1.0)}),
        ("bounds", [0, 0, 0.1], {"bounds": (-1.0, 0.0, 1.0)}),
        ("bounds.displacement", [0, 0, 0.1], {"bounds": ([-1.0, -1.0], 1.0)}),
        ("bounds.curvature", [0, 0, 0.1], {"bounds": Bounds(curvature=[1.0, 2.0])}),
        ("bounds.length", [0, 0, 0.1], {"bounds": Bounds(length=(0.1, 0.2))}),
    ],
)
def test_bad_input_names_the_argument(argument, target, keywords):
    keywords = {"model": MODEL, **keywords}
    with pytest.raises(tdcr.InvalidInput) as caught:
        tdcr.inverse(finger(), target, **keywords)
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    ("argument", "make"),
    [
        ("displacement", lambda: Bounds(displacement=(0.0, np.nan))),
        ("displacement", lambda: Bounds(displacement=(1.0, 0.0))),
        ("displacement", lambda: Bounds(displacement=([0.0, 0.0], [1.0, 1.0, 1.0]))),
        ("displacement", lambda: Bounds(displacement=([], []))),
        ("curvature", lambda: Bounds(curvature=-1.0)),
        ("curvature", lambda: Bounds(curvature=np.nan)),
        ("length", lambda: Bounds(length=(0.2, 0.1))),
        ("position_tolerance", lambda: InverseSettings(position_tolerance=0.0)),
        ("rotation_tolerance", lambda: InverseSettings(rotation_tolerance=np.nan)),
        ("position_weight", lambda: InverseSettings(position_weight=-1.0)),
        ("position_weight", lambda: InverseSettings(position_weight=(1.0, 1.0))),
        ("rotation_weight", lambda: InverseSettings(rotation_weight=np.inf)),
        ("position_weight", lambda: InverseSettings(position_weight=0.0, rotation_weight=0.0)),
        ("starts", lambda: InverseSettings(starts=0)),
        ("max_iterations", lambda: InverseSettings(max_iterations=0)),
        ("seed", lambda: InverseSettings(seed=-1)),
    ],
)
def test_bad_bounds_and_settings_name_the_argument(argument, make):
    with pytest.raises(tdcr.InvalidInput) as caught:
        make()
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    "keywords",
    [{"bounds": 1.0}, {"bounds": "ab"}, {"search": 3}, {"start": "abc"}],
)
def test_wrong_types_are_type_errors(keywords):
    with pytest.raises(TypeError):
        tdcr.inverse(finger(), [0, 0, 0.1], model=MODEL, **keywords)


def test_bad_rows_are_named():
    targets = np.zeros((4, 3))
    targets[2, 1] = np.inf
    with pytest.raises(tdcr.InvalidInput, match="row 2") as caught:
        tdcr.inverse_batch(finger(), targets, model=MODEL)
    assert caught.value.argument == "targets"
    with pytest.raises(tdcr.InvalidInput) as caught:
        tdcr.inverse_batch(finger(), np.zeros((4, 2)), model=MODEL)
    assert caught.value.argument == "targets"


def test_progress_is_told():
    seen = []
    tdcr.inverse_batch(finger(), np.full((200, 3), 0.05), model=MODEL, progress=seen.append)
    assert seen[-1] == 200


def test_manipulability_measures_the_jacobian():
    robot = trunk()
    jacobian = tdcr.jacobian(robot, rows(1)[0], model=MODEL)
    for part, rows_of in (("position", jacobian[:3]), ("rotation", jacobian[3:])):
        measured = tdcr.manipulability(jacobian, part=part)
        volume = np.sqrt(np.linalg.det(rows_of @ rows_of.T))
        assert measured.value == pytest.approx(volume, rel=1e-9)
        assert measured.condition == pytest.approx(np.linalg.cond(rows_of), rel=1e-9)
    pose = tdcr.manipulability(jacobian, part="pose", radian=0.05)
    assert pose.axes.shape == (6,)
    assert pose.condition >= 1.0
    stack = tdcr.manipulability(np.stack([jacobian, 2 * jacobian]))
    assert stack.value[1] == pytest.approx(8 * stack.value[0])
    # A straight trunk cannot move its tip along itself.
    straight = tdcr.manipulability(tdcr.jacobian(robot, np.zeros(9), model=MODEL))
    assert straight.value == 0.0
    assert straight.condition == np.inf


@pytest.mark.parametrize(
    ("argument", "jacobian", "keywords"),
    [
        ("jacobian", np.zeros((3, 3)), {}),
        ("jacobian", np.full((6, 3), np.nan), {}),
        ("part", np.zeros((6, 3)), {"part": "elbow"}),
        ("radian", np.zeros((6, 3)), {"part": "pose"}),
        ("radian", np.zeros((6, 3)), {"part": "pose", "radian": -1.0}),
        ("radian", np.zeros((6, 3)), {"radian": np.inf}),
        ("radian", np.zeros((6, 3)), {"radian": 10**400}),
        ("jacobian", [[1.0, 2.0], [3.0]], {}),
    ],
)
def test_bad_jacobians_name_the_argument(argument, jacobian, keywords):
    with pytest.raises(tdcr.InvalidInput) as caught:
        tdcr.manipulability(jacobian, **keywords)
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    ("argument", "jacobian", "keywords"),
    [
        ("jacobian", np.zeros((6, 3), dtype=complex), {}),
        ("jacobian", "abc", {}),
        ("jacobian", [["a"] * 3] * 6, {}),
        ("part", np.zeros((6, 3)), {"part": ["position"]}),
        ("radian", np.zeros((6, 3)), {"part": "pose", "radian": "a"}),
        ("radian", np.zeros((6, 3)), {"part": "pose", "radian": np.ones(3)}),
        ("radian", np.zeros((6, 3)), {"part": "pose", "radian": 1j}),
    ],
)
def test_jacobians_of_other_types_name_the_argument(argument, jacobian, keywords):
    with pytest.raises(TypeError, match=f"^{argument}: expected"):
        tdcr.manipulability(jacobian, **keywords)


def test_huge_jacobians_have_measures_without_warnings():
    jacobian = np.vstack([np.eye(3), np.eye(3)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        huge = tdcr.manipulability(1e308 * jacobian)
        pose = tdcr.manipulability(
            1e300 * np.hstack([jacobian, jacobian[::-1]]), part="pose", radian=1e300
        )
        lost = tdcr.manipulability(1e308 * jacobian * [1.0, 1.0, 0.0])
        stack = tdcr.manipulability(np.stack([jacobian, 1e200 * jacobian]))
    assert (huge.value, huge.condition) == (np.inf, 1.0)
    assert huge.axes == pytest.approx(1e308)
    assert pose.value in (0.0, np.inf)
    assert (lost.value, lost.condition) == (0.0, np.inf)
    assert stack.value.tolist() == [pytest.approx(1.0), np.inf]
    for array in stack:
        assert not array.flags.writeable
