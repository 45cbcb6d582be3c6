"""Ctrl-C ends every long call, and so do errors of the functions that it calls."""

from __future__ import annotations

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr
from tdcr import design, planar, pso

SETUP = """
    import concurrent.futures, itertools, time
    import numpy as np, tdcr
    from tdcr import design, planar, pso
    tendons = [tdcr.Tendon(2.1 * k, 0.01) for k in range(3)]
    robot = tdcr.Robot(tdcr.Backbone(0.2, 30), tendons)
    ranges = [(-0.01, 0), (-0.01, 0), (np.inf, np.inf)]
    rows = np.tile([-0.01, np.inf, np.inf], (2_000_000, 1))
    pool = concurrent.futures.ThreadPoolExecutor(2)
    measured = np.random.default_rng(0).normal(0.0, 0.1, (20_000, 3))
    away = np.full((40_000, 3), 0.5)
    def asleep(*_):
        time.sleep(0.3)
        return 1.0
    def busy(*_):
        while True:
            pass
"""


@pytest.mark.parametrize(
    "call",
    [
        'tdcr.workspace(robot, ranges, 10**6, sampling="random")',
        'tdcr.workspace(robot, ranges, 10**5, sampling="random", chunk=100, executor=pool)',
        'tdcr.forward_batch(robot, rows, model="linkage")',
        "tdcr.inverse_batch(robot, away)",
        'design.fit(robot, measured, ["gain", "base"], displacements=rows[:20_000])',
    ],
    ids=["workspace", "executor", "linkage", "inverse", "fit"],
)
def test_ctrl_c_ends_the_solves(call):
    assert_interrupts(SETUP, call)


@pytest.mark.parametrize(
    "call",
    [
        "tdcr.forward_batch(robot, rows, progress=asleep)",
        "tdcr.forward_batch(robot, rows, progress=busy)",
        'tdcr.workspace(robot, ranges, 10**6, sampling="random", progress=asleep)',
        "tdcr.sweep(robot, (rows[:9] for _ in itertools.count() if asleep()), path)",
        "pso.minimize(asleep, [0.0], [1.0])",
        "pso.minimize(busy, [0.0], [1.0])",
    ],
    ids=["asleep", "busy", "workspace", "blocks", "swarm asleep", "swarm busy"],
)
def test_ctrl_c_ends_what_they_call(call, tmp_path):
    path = tmp_path / "s.npz"
    assert_interrupts(f"{SETUP}    path = {str(path)!r}\n", call)
    assert not list(tmp_path.iterdir())


BASE = np.eye(4)
BASE[2, 3] = 0.001
ROBOT = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(0.0, 0.01)], base=BASE)
ROWS = np.full((20, 1), -0.005)
TIPS = tdcr.forward_batch(ROBOT, ROWS).tip[:, :3, 3]
BAR = tdcr.Cylinder((0.030, 0, 0.100), (0, 1, 0), 0.010)
# By name, what calls a function that tells of progress.
TELLING = {
    "forward_batch": lambda tell, path: tdcr.forward_batch(ROBOT, ROWS, progress=tell),
    "warm": lambda tell, path: tdcr.forward_batch(ROBOT, ROWS, warm=True, progress=tell),
    "sweep": lambda tell, path: tdcr.sweep(ROBOT, ROWS, path, chunk=7, progress=tell),
    "workspace": lambda tell, path: tdcr.workspace(
        ROBOT, [(-0.01, 0.0)], 9, sampling="random", progress=tell
    ),
    "inverse_batch": lambda tell, path: tdcr.inverse_batch(ROBOT, TIPS, progress=tell),
    "track": lambda tell, path: tdcr.track(ROBOT, TIPS, progress=tell),
    "planar": lambda tell, path: planar.PlanarTrunk([0.14, 0.12], 0.01).inverse_batch(
        np.full((20, 2), 0.15), progress=tell
    ),
    "sections": lambda tell, path: planar.two_section_batch(
        0.14, 0.12, np.full((20, 2), 0.15), progress=tell
    ),
    "routing": lambda tell, path: design.routing_batch(
        ROBOT, [tdcr.forward(ROBOT, ROWS[0]).positions], progress=tell
    ),
    "swarm": lambda tell, path: pso.minimize(lambda x: x[0], [0.0], [1.0], progress=tell),
    "gripper": lambda tell, path: tdcr.Gripper([ROBOT]).close([-0.006], BAR, progress=tell),
}


class MineError(Exception):
    """An error of the caller's own."""


@pytest.mark.parametrize("error", [MineError("mine"), KeyboardInterrupt(), SystemExit(3)])
@pytest.mark.parametrize("name", TELLING)
def test_errors_of_what_is_told_come_through(name, error, tmp_path):
    told = []

    def tell(done):
        told.append(done)
        raise error

    with pytest.raises(type(error)) as caught:
        TELLING[name](tell, tmp_path / "s.npz")
    assert caught.value is error
    assert len(told) == 1
    assert not list(tmp_path.iterdir())
