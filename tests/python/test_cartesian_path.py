"""Paths of the tool through waypoints."""

import math
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

import tdcr


def frame(rotation, position):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.as_matrix(), position
    return pose


def test_frames_move_and_turn_evenly():
    turns = Rotation.from_rotvec([[0.1, 0.2, -0.3], [1.0, -0.5, 0.4]])
    places = np.array([[0.1, 0.0, 0.2], [0.0, 0.05, 0.15]])
    ends = [frame(*pair) for pair in zip(turns, places, strict=True)]
    path = tdcr.cartesian_path(ends, step=1.0, turn=0.05)
    angle = (turns[0].inv() * turns[1]).magnitude()
    assert len(path) == math.ceil(angle / 0.05) + 1
    share = np.linspace(0.0, 1.0, len(path))
    np.testing.assert_allclose(path[:, :3, :3], Slerp([0, 1], turns)(share).as_matrix(), atol=4e-15)
    between = places[0] + share[:, None] * (places[1] - places[0])
    np.testing.assert_allclose(path[:, :3, 3], between, rtol=0, atol=1e-16)
    np.testing.assert_array_equal(path[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (len(path), 1)))


def test_frames_turn_by_a_twentieth_of_a_radian_unless_told():
    ends = [
        frame(Rotation.identity(), [0, 0, 0.1]),
        frame(Rotation.from_rotvec([1, 0, 0]), [0, 0, 0.1]),
    ]
    assert len(tdcr.cartesian_path(ends, 0.01)) == 21
    assert len(tdcr.cartesian_path(ends, 0.01, turn=0.5)) == 3


def test_it_is_the_callers_to_change():
    path = tdcr.cartesian_path([[0, 0, 0.1], [0, 0, 0.2]], 0.05)
    path += [0.01, 0.0, 0.0]
    np.testing.assert_allclose(path, [[0.01, 0, 0.1], [0.01, 0, 0.15], [0.01, 0, 0.2]], atol=1e-16)


@pytest.mark.parametrize("shape", [(0, 3), (0, 4, 4), (1, 3)])
def test_few_waypoints(shape):
    path = tdcr.cartesian_path(np.zeros(shape), 0.01)
    assert path.shape == shape


def test_a_trunk_follows_it():
    tendons = [tdcr.Tendon(2 * np.pi * k / 3, 0.008, end=end) for end in (10, 20) for k in range(3)]
    robot = tdcr.Robot(tdcr.Backbone([0.06, 0.06], [10, 10]), tendons)
    corners = [[0.03, 0.0, 0.11], [0.0, 0.03, 0.11], [-0.03, 0.0, 0.11]]
    path = tdcr.cartesian_path(corners, step=0.0005)
    followed = tdcr.track(robot, path)
    assert followed.ok.all()
    reached = tdcr.forward_batch(robot, followed.displacements, fields=["tip"]).tip[:, :3, 3]
    np.testing.assert_allclose(reached, path, rtol=0, atol=1e-8)
    assert abs(np.diff(followed.displacements, axis=0)).max() < 0.001


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"step": 0.0}, r"^step: expected a positive finite number \[m\], got 0\.0"),
        ({"step": math.nan}, r"^step: expected a positive"),
        ({"step": 0.1, "turn": -1.0}, r"^turn: expected a positive finite number \[rad\]"),
        (
            {"step": 1e-9},
            r"^step: expected a step that makes at most 10000000 rows, got 1e-9 m",
        ),
        ({"step": 1.0, "turn": 1e-9}, r"^turn: expected a turn that makes at most 10000000 rows"),
        (
            {"waypoints": [0, 0, 1], "step": 1.0},
            r"^waypoints: expected positions of shape \(B, 3\)",
        ),
        ({"waypoints": [[0, 0, math.nan]], "step": 1.0}, r"^waypoints: .*in row 0"),
        ({"waypoints": [2 * np.eye(4)], "step": 1.0}, r"^waypoints: .*in row 0"),
    ],
)
def test_bad_input_is_said(keywords, message):
    ends = [np.eye(4), frame(Rotation.from_rotvec([1, 0, 0]), [0, 0, 0.1])]
    with pytest.raises(tdcr.InvalidInput, match=message):
        tdcr.cartesian_path(**{"waypoints": ends, **keywords})


@pytest.mark.parametrize("name", ["waypoints", "step", "turn"])
def test_wrong_types_are_type_errors(name):
    keywords = {"waypoints": [[0, 0, 0.1]], "step": 0.01, "turn": 0.1, name: "near"}
    with pytest.raises(TypeError, match=f"^{re.escape(name)}"):
        tdcr.cartesian_path(**keywords)
