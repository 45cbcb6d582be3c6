"""The inverse: targets to displacements, alone, many, along a path, all answers."""

from __future__ import annotations

import numpy as np
import pytest

import tdcr
from tdcr import Bounds, InverseSettings, Status

MODEL = "constant_curvature"


def trunk(**keywords):
    """Return three segments with three coupled tendons each."""
    tendons = [
        tdcr.Tendon(2 * np.pi * (k % 3) / 3 + (k // 3) * np.pi / 4, 0.0045, end=10 * (k // 3 + 1))
        for k in range(9)
    ]
    return tdcr.Robot(tdcr.Backbone([0.06, 0.0625, 0.064], [10] * 3), tendons, **keywords)


def finger(**keywords):
    """Return one segment with three tendons."""
    tendons = [tdcr.Tendon(2 * np.pi * k / 3, 0.008) for k in range(3)]
    return tdcr.Robot(tdcr.Backbone(0.1, 10), tendons, **keywords)


def rows(count, seed=0):
    return np.random.default_rng(seed).normal(size=(count, 9)) * 0.003


def tips(robot, displacements, **keywords):
    batch = tdcr.forward_batch(robot, displacements, model=MODEL, **keywords)
    return batch.tip @ robot.tool


def off(robot, answer, target):
    """Return distance and angle between the answer's tool and a frame."""
    tool = answer.shape.tip @ robot.tool
    turn = tool[:3, :3].T @ target[:3, :3]
    angle = np.arctan2(
        np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]),
        np.trace(turn) - 1,
    )
    return np.linalg.norm(tool[:3, 3] - target[:3, 3]), angle


@pytest.fixture(scope="module")
def placed():
    """Return a trunk with a base and a tilted tool, and 50 frames it reaches."""
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    base[:3, 3] = [0.1, -0.2, 0.3]
    tool[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    tool[:3, 3] = [0.01, 0.002, 0.03]
    robot = trunk(base=base, tool=tool)
    return robot, tips(robot, rows(50))


def test_frames_are_met_with_base_and_tool(placed):
    robot, targets = placed
    for target in targets:
        answer = tdcr.inverse(robot, target, model=MODEL).require()
        distance, angle = off(robot, answer, target)
        assert distance < 1e-9
        assert angle < 1e-9
        assert answer.message == ""
        assert answer.ok
        assert answer.shape.displacements.tobytes() == answer.displacements.tobytes()


def test_positions_are_met_with_no_more_bending_than_their_makers(placed):
    robot, _ = placed
    for row in rows(30):
        shape = tdcr.forward(robot, row, model=MODEL)
        target = (shape.tip @ robot.tool)[:3, 3]
        answer = tdcr.inverse(robot, target, model=MODEL).require()
        assert answer.rotation_error == 0.0
        assert np.linalg.norm((answer.shape.tip @ robot.tool)[:3, 3] - target) < 1e-9
        warm = tdcr.inverse(robot, target, model=MODEL, start=row).require()
        assert warm.shape.energy <= shape.energy * (1 + 1e-9)


def test_a_single_segment_is_solved_in_closed_form():
    robot = finger()
    for kappa, phi in [(0.0, 0.0), (5.0, 1.0), (15.0, -2.0), (31.0, 3.0), (50.0, 0.5)]:
        tip = tdcr.constant_curvature.frames(kappa, phi, 0.1)[-1]
        for target in (tip, tip[:3, 3]):
            answer = tdcr.inverse(robot, target, model=MODEL).require()
            assert answer.starts == 1
            assert answer.iterations <= 1
            arc = tdcr.constant_curvature.displacements_from_arc(
                kappa, phi, 0.1, 2 * np.pi * np.arange(3) / 3, 0.008
            )
            np.testing.assert_allclose(answer.displacements, arc, atol=1e-11)


def test_extensible_lengths_and_their_bounds():
    robot = trunk()
    settings = tdcr.ConstantCurvatureSettings(extensible=True)
    bounds = Bounds(length=([0.05, 0.05, 0.05], 0.08), curvature=40.0)
    # Displacements of arcs inside the bounds.
    inside = rows(30) * 0.5
    targets = tips(robot, inside, settings=settings)
    batch = tdcr.inverse_batch(robot, targets, model=MODEL, settings=settings, bounds=bounds)
    assert batch.ok.all()
    for i in range(len(batch)):
        lengths = (1 + batch[i].shape.strains[:, 3]) * robot.backbone.lengths
        segments = lengths.reshape(3, 10).sum(axis=1)
        assert segments.min() >= 0.05 - 1e-12
        assert segments.max() <= 0.08 + 1e-12
        distance, angle = off(robot, batch[i], targets[i])
        assert distance < 1e-9
        assert angle < 1e-9


def test_out_of_reach_is_an_outcome_with_the_nearest_answer():
    answer = tdcr.inverse(finger(), [0.0, 0.0, 0.5], model=MODEL)
    assert answer.status is Status.unreachable
    assert "nearest" in answer.message
    assert answer.error == pytest.approx(0.4, abs=1e-9)
    np.testing.assert_allclose(answer.displacements, 0.0, atol=1e-7)
    with pytest.raises(tdcr.NotConverged) as caught:
        answer.require()
    assert caught.value.result is answer


def test_bounds_on_displacements_hold_and_are_named():
    robot = finger()
    free = tdcr.inverse(robot, [0.05, 0.0, 0.08], model=MODEL)
    assert free.displacements.min() < -0.003
    for bounds in (Bounds(displacement=(-0.003, np.inf)), (-0.003, np.inf)):
        held = tdcr.inverse(robot, [0.05, 0.0, 0.08], model=MODEL, bounds=bounds)
        assert held.status is Status.unreachable
        assert held.displacements.min() == pytest.approx(-0.003, abs=1e-12)
        assert "pull of 't0'" in held.message


def test_bounds_that_exclude_each_other_are_infeasible():
    answer = tdcr.inverse(finger(), [0.0, 0.0, 0.1], model=MODEL, bounds=([0.001] * 3, [0.002] * 3))
    assert answer.status is Status.infeasible
    assert "bounds" in answer.message


def test_a_free_roll_reaches_what_a_frame_does_not():
    robot = finger()
    tip = tdcr.constant_curvature.frames(12.0, 0.7, 0.1)[-1].copy()
    spin = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    tip[:3, :3] = tip[:3, :3] @ spin
    assert tdcr.inverse(robot, tip, model=MODEL).status is Status.unreachable
    rolls = InverseSettings(rotation_weight=(0.03, 0.03, 0.0))
    answer = tdcr.inverse(robot, tip, model=MODEL, search=rolls).require()
    assert answer.rotation_error < 1e-10


def test_weights_decide_what_is_nearest():
    robot = finger()
    target = tdcr.constant_curvature.frames(12.0, 0.7, 0.1)[-1].copy()
    target[:3, 3] += [0.0, 0.01, 0.01]
    loose, tight = (
        tdcr.inverse(robot, target, model=MODEL, search=InverseSettings(rotation_weight=weight))
        for weight in (1e-4, 1.0)
    )
    assert loose.error < tight.error
    assert loose.rotation_error > tight.rotation_error


def test_all_answers_are_distinct_sorted_and_contain_the_maker():
    robot = trunk()
    found = 0
    for row in rows(20, seed=3):
        shape = tdcr.forward(robot, row, model=MODEL)
        answers = tdcr.inverse_solutions(robot, shape.tip, model=MODEL)
        energies = [answer.shape.energy for answer in answers]
        assert energies == sorted(energies)
        for i, answer in enumerate(answers):
            distance, angle = off(robot, answer, shape.tip)
            assert distance < 1e-9
            assert angle < 1e-9
            for other in answers[:i]:
                assert np.abs(other.displacements - answer.displacements).max() > 1e-9
        strains = [np.abs(answer.shape.strains - shape.strains).max() for answer in answers]
        found += min(strains) < 1e-6
    assert found == 20


def test_rows_are_the_same_as_alone_on_any_number_of_threads(placed):
    robot, targets = placed
    one = tdcr.inverse_batch(robot, targets, model=MODEL, threads=1)
    two = tdcr.inverse_batch(robot, targets, model=MODEL, threads=2)
    assert one.displacements.tobytes() == two.displacements.tobytes()
    for i in (0, 7, 49):
        alone = tdcr.inverse(robot, targets[i], model=MODEL)
        assert alone.displacements.tobytes() == one[i].displacements.tobytes()
        assert alone == one[i]
    assert [row.starts for row in one[:3]] == one.starts[:3].tolist()
    assert "50 targets, 50 converged" in repr(one)


def test_a_failed_row_keeps_its_place(placed):
    robot, targets = placed
    positions = targets[:5, :3, 3].copy()
    positions[2] = [5.0, 0.0, 0.0]
    batch = tdcr.inverse_batch(robot, positions, model=MODEL)
    assert batch.ok.tolist() == [True, True, False, True, True]
    assert batch.status[2] is Status.unreachable
    assert "row 2" in batch[2].message


def test_a_path_is_followed_without_jumps():
    robot = trunk()
    t = np.linspace(0, 1, 1000)[:, None]
    along = rows(1, seed=5) * (1 - t) + rows(1, seed=6) * t
    path = tips(robot, along)
    batch = tdcr.track(robot, path, model=MODEL, start=along[0])
    assert batch.ok.all()
    assert (batch.starts == 1).all()
    assert np.abs(np.diff(batch.displacements, axis=0)).max() < 1e-4


def test_a_path_with_freedom_may_stay_near_itself():
    robot = trunk()
    settings = tdcr.ConstantCurvatureSettings(extensible=True)
    bounds = Bounds(length=([0.05, 0.05, 0.05], 0.08))
    t = np.linspace(0, 1, 500)[:, None]
    along = 0.6 * (rows(1, seed=5) * (1 - t) + rows(1, seed=6) * t)
    path = tips(robot, along, settings=settings)
    search = InverseSettings(least_energy=False)
    batch = tdcr.track(
        robot, path, model=MODEL, start=along[0], settings=settings, bounds=bounds, search=search
    )
    assert batch.ok.all()
    assert (batch.starts == 1).all()
    # The path was made with steps of 0.02 mm at most.
    assert np.abs(np.diff(batch.displacements, axis=0)).max() < 1e-4


def test_swarms_meet_positions_and_frames(placed):
    robot, targets = placed
    for aims in (targets, targets[:, :3, 3]):
        batch = tdcr.inverse_batch(robot, aims, model=MODEL, method="pso")
        assert batch.ok.all()
        assert batch.error.max() < 1e-9
        assert batch.rotation_error.max() < 1e-9
        assert batch[0] == tdcr.inverse(robot, aims[0], model=MODEL, method="pso")
    again = tdcr.inverse_batch(robot, targets, model=MODEL, method="pso", threads=2)
    one = tdcr.inverse_batch(robot, targets, model=MODEL, method="pso", threads=1)
    assert one.displacements.tobytes() == again.displacements.tobytes()
    assert (one[0].method, one[0].search.seed) == ("pso", 0)


def test_swarms_keep_bounds_and_their_settings():
    robot = finger()
    swarm = tdcr.PsoSettings(particles=12, max_iterations=50)
    search = InverseSettings(swarm=swarm, starts=3)
    bounds = Bounds(displacement=(-0.003, np.inf))
    held = tdcr.inverse(
        robot, [0.05, 0.0, 0.08], model=MODEL, method="pso", bounds=bounds, search=search
    )
    assert held.status is Status.unreachable
    assert held.displacements.min() == pytest.approx(-0.003, abs=1e-12)
    newton = tdcr.inverse(robot, [0.05, 0.0, 0.08], model=MODEL, bounds=bounds)
    assert held.error == pytest.approx(newton.error, abs=1e-9)
    assert held.search.swarm == swarm


def test_a_start_may_be_a_shape_or_an_answer(placed):
    robot, targets = placed
    answer = tdcr.inverse(robot, targets[0], model=MODEL)
    for start in (answer, answer.shape, answer.displacements, answer.displacements.tolist()):
        again = tdcr.inverse(robot, targets[0], model=MODEL, start=start)
        assert again.iterations == 0
        np.testing.assert_allclose(again.displacements, answer.displacements, atol=1e-15)
    rows_too = tdcr.inverse_batch(robot, targets[:3], model=MODEL, start=answer.displacements)
    assert rows_too.ok.all()


def test_a_lone_tendon_only_pulls():
    robot = tdcr.Robot(tdcr.Backbone(0.1, 10), [tdcr.Tendon(0.0, 0.008)])
    there = tdcr.constant_curvature.frames(8.0, 0.0, 0.1)[-1, :3, 3]
    answer = tdcr.inverse(robot, there, model=MODEL).require()
    assert answer.displacements[0] == pytest.approx(-0.0064, abs=1e-12)
    other_side = tdcr.inverse(robot, there * [-1, 1, 1], model=MODEL)
    assert other_side.status is Status.unreachable
    assert other_side.displacements[0] == pytest.approx(0.0, abs=1e-12)
