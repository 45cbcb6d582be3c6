"""The planar inverse by particle swarm, and batches of it, from Python."""

import pickle

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr
from tdcr import planar, pso

TAU = 2 * np.pi
TWO = planar.PlanarTrunk([0.140, 0.120], 0.010)
THREE = planar.PlanarTrunk([0.1, 0.08, 0.12], 0.010)
PATH = np.array([(0.260 - 0.015 * t, 0.015 * t) for t in range(9)])
CIRCLE = [(0.1, 0.04, 0.02)]


@pytest.mark.parametrize("objective", ["bends", "points"])
@pytest.mark.parametrize("topology", ["global", "ring"])
def test_every_seed_reaches_the_path_of_the_paper(objective, topology):
    seeds = np.tile(np.arange(1000), len(PATH))
    points = np.repeat(PATH, 1000, axis=0)
    settings = pso.PsoSettings(topology=topology)
    batch = TWO.inverse_batch(
        points, method="pso", settings=settings, seed=seeds, objective=objective
    )
    assert batch.ok.all()
    assert batch.error.max() <= 1e-12
    for i, (x, y) in enumerate(PATH):
        exact = planar.two_section_solutions(0.140, 0.120, x, y)
        turns = batch.turns[1000 * i : 1000 * (i + 1)]
        off = np.abs(turns[:, None] - exact[None]).max(axis=2)
        # The straight trunk is a double solution: known to half the digits.
        assert off.min(axis=1).max() < (1e-5 if i == 0 else 1e-9)
        assert len(np.unique(off.argmin(axis=1))) == len(exact)


def test_a_result_tells_how_it_came():
    settings = pso.PsoSettings(particles=20, seed=4)
    found = TWO.inverse(*PATH[4], method="pso", settings=settings)
    assert found.ok
    assert found.message == ""
    assert found.require() is found
    assert found.settings == settings
    assert found.seed == 4
    assert TWO.inverse(*PATH[4], method="pso", seed=9).seed == 9
    assert found.objective == "bends"
    assert found.clearance == np.inf
    assert found.swarms == 1
    assert len(found.history) == found.moves + found.swarms
    assert found.evaluations == 20 * len(found.history)
    assert found.value == found.history[-1] == found.history.min()
    assert np.linalg.norm(found.shape.tip - PATH[4]) < 1e-12
    again = TWO.inverse(*PATH[4], method="pso", settings=settings)
    assert np.array_equal(again.turns, found.turns)
    assert np.array_equal(again.history, found.history)
    newton = TWO.inverse(*PATH[4])
    assert newton.settings is newton.seed is newton.history is None


def test_batches_equal_single_targets():
    rng = np.random.default_rng(5)
    points = np.array([THREE.shape(turns).tip for turns in rng.uniform(-TAU, TAU, (200, 3))])
    seeds = rng.integers(0, 1000, 200)
    headings = rng.uniform(-3, 3, 200)
    for options in ({"seed": seeds, "method": "pso"}, {"heading": headings, "method": "newton"}):
        batch = THREE.inverse_batch(points, **options)
        alone = THREE.inverse_batch(points, threads=1, **options)
        assert np.array_equal(batch.turns, alone.turns)
        assert len(batch) == 200
        for i in (0, 7, 199):
            row = {k: v if isinstance(v, str) else v[i].item() for k, v in options.items()}
            single = THREE.inverse(*points[i], **row)
            assert np.array_equal(batch[i].turns, single.turns)
            for name in ("status", "error", "energy", "iterations", "settings", "clearance"):
                assert getattr(batch[i], name) == getattr(single, name)
        assert [len(batch[2:5]), batch[-1].method] == [3, options["method"]]
    assert "200 targets" in repr(batch)
    told = []
    THREE.inverse_batch(points, method="pso", progress=told.append)
    assert told[-1] == 200
    assert len(THREE.inverse_batch(np.zeros((0, 2)), method="pso")) == 0
    assert len(THREE.inverse_batch(np.zeros((0, 2)))) == 0
    planar.two_section_batch(0.14, 0.12, PATH, progress=True)


def test_obstacles_are_kept_out_of():
    free = THREE.inverse(0.2, 0.1)
    way = free.shape.curve().points[75]
    obstacles = [(*way, 0.02), (0.0, -0.1, 0.03)]
    assert free.shape.clearance(obstacles) < 0
    found = THREE.inverse(0.2, 0.1, method="pso", obstacles=obstacles)
    assert found.ok
    assert found.error <= 1e-12
    assert found.clearance >= 0
    assert found.energy > free.energy
    assert found.clearance == found.shape.clearance(obstacles)
    points = found.shape.curve(2000).points
    for x, y, radius in obstacles:
        assert np.linalg.norm(points - [x, y], axis=1).min() > radius - 1e-12
    assert found.settings.topology == "ring"
    batch = THREE.inverse_batch([(0.2, 0.1)], method="pso", obstacles=obstacles)
    assert np.array_equal(batch[0].turns, found.turns)
    # An obstacle on the target.
    shut = TWO.inverse(0.2, 0.06, method="pso", obstacles=[(0.2, 0.06, 0.01)], restarts=0)
    assert shut.status == "infeasible"
    assert "into an obstacle" in shut.message
    with pytest.raises(tdcr.NotConverged, match="infeasible"):
        shut.require()


def test_polish_can_be_switched_off():
    for objective in ("bends", "points"):
        found = TWO.inverse(
            *PATH[4], method="pso", polish=False, tolerance=1e-9, objective=objective
        )
        assert found.ok
        assert 1e-15 < found.error <= 1e-9
        assert found.iterations == 0
    # The swarm alone stops in the valley of the straight trunk.
    rough = TWO.inverse(*PATH[0], method="pso", polish=False, restarts=0)
    assert rough.status == "iteration_limit"
    assert "after 1 swarms" in rough.message


def test_results_are_values_of_their_own():
    found = TWO.inverse(*PATH[4], method="pso")
    twin = pickle.loads(pickle.dumps(found))
    assert np.array_equal(twin.turns, found.turns)
    assert (twin.status, twin.settings, twin.trunk) == (found.status, found.settings, TWO)
    batch = TWO.inverse_batch(PATH, method="pso")
    for array in (found.turns, found.history, batch.turns, batch.points, batch.seed):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_callbacks():
    seen = []
    found = TWO.inverse(
        0.3, 0.0, method="pso", callback=lambda *told: seen.append(told) or len(seen) == 5
    )
    assert [told[0] for told in seen] == [0, 1, 2, 3, 4]
    assert found.moves == 4
    assert found.status == "iteration_limit"

    def fails(moves, value):
        raise RuntimeError(f"at {moves}")

    with pytest.raises(RuntimeError, match="at 0"):
        TWO.inverse(0.3, 0.0, method="pso", callback=fails)


def test_out_of_reach():
    far = TWO.inverse(0.3, 0.1, method="pso")
    assert far.status == "unreachable"
    assert far.error == pytest.approx(planar.two_section_nearest(0.14, 0.12, 0.3, 0.1).distance)
    assert "from the target" in far.message


@pytest.mark.parametrize(
    "call",
    [
        "trunk.inverse(0.3, 0.0, method='pso', polish=False, settings=pso.PsoSettings("
        "particles=1000, max_iterations=1000000, stagnation=None))",
        "trunk.inverse_batch(np.full((400_000, 2), 0.3), method='pso')",
    ],
)
def test_ctrl_c_interrupts(call):
    setup = """
        import numpy as np
        from tdcr import planar, pso
        trunk = planar.PlanarTrunk([0.140, 0.120], 0.010)
    """
    assert_interrupts(setup, call)


def swarm(*point, trunk=TWO, **options):
    return trunk.inverse(*(point or (0.2, 0.06)), method="pso", **options)


def batch(**options):
    return TWO.inverse_batch(PATH, **({"method": "pso"} | options))


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("x", lambda: swarm(np.nan, 0.0)),
        ("y", lambda: swarm(0.0, -np.inf)),
        ("heading", lambda: swarm(heading=np.nan)),
        ("limit", lambda: swarm(limit=7.0)),
        ("limit", lambda: swarm(limit=[1.0, 1.0, 1.0])),
        ("tolerance", lambda: swarm(tolerance=np.nan)),
        ("max_iterations", lambda: swarm(max_iterations=0)),
        ("restarts", lambda: swarm(restarts=10_001)),
        ("restarts", lambda: swarm(restarts=-1)),
        ("seed", lambda: swarm(seed=-1)),
        ("starts", lambda: swarm(starts=3)),
        ("objective", lambda: swarm(objective="angles")),
        ("objective", lambda: swarm(trunk=planar.PlanarTrunk(0.2, 0.01), objective="points")),
        ("obstacles", lambda: swarm(objective="points", obstacles=CIRCLE)),
        ("obstacles", lambda: swarm(obstacles=(0.1, 0.04, 0.02))),
        ("obstacles", lambda: swarm(obstacles=[(0.1, 0.04)])),
        ("obstacles", lambda: swarm(obstacles=[(0.1, 0.04, 0.02), (0.1,)])),
        ("limit", lambda: swarm(limit=[[1.0], [1.0, 2.0]])),
        ("heading", lambda: batch(heading=[[1.0], [1.0, 2.0]])),
        ("obstacles[1].radius", lambda: swarm(obstacles=[*CIRCLE, (0.0, 0.1, 0.0)])),
        ("obstacles[0].y", lambda: swarm(obstacles=[(0.0, np.nan, 0.1)])),
        ("obstacles[0].x", lambda: TWO.shape([0, 0]).clearance([(np.inf, 0.0, 0.1)])),
        ("obstacles", lambda: TWO.inverse(0.2, 0.06, obstacles=CIRCLE)),
        ("objective", lambda: TWO.inverse(0.2, 0.06, objective="points")),
        ("settings", lambda: TWO.inverse(0.2, 0.06, settings=pso.PsoSettings())),
        ("seed", lambda: TWO.inverse(0.2, 0.06, seed=0)),
        ("polish", lambda: TWO.inverse(0.2, 0.06, polish=False)),
        ("restarts", lambda: TWO.inverse(0.2, 0.06, restarts=3)),
        ("callback", lambda: TWO.inverse(0.2, 0.06, callback=print)),
        ("method", lambda: batch(method="guess")),
        ("points", lambda: TWO.inverse_batch([0.1, 0.2], method="pso")),
        ("points", lambda: TWO.inverse_batch([[0.1, np.nan]])),
        ("seed", lambda: batch(seed=[1, 2])),
        ("heading", lambda: batch(heading=[1.0, 2.0])),
        ("heading", lambda: batch(heading=np.nan)),
        ("limit", lambda: batch(limit=0.0)),
        ("tolerance", lambda: batch(method="newton", tolerance=-1.0)),
        ("threads", lambda: batch(threads=0)),
        ("obstacles", lambda: batch(method="newton", obstacles=np.array(CIRCLE))),
    ],
)
def test_bad_input_names_the_argument(argument, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument


def test_newton_says_who_knows_obstacles():
    with pytest.raises(tdcr.InvalidInput, match='method "pso"'):
        TWO.inverse(0.2, 0.06, obstacles=CIRCLE)


@pytest.mark.parametrize(
    "call",
    [
        lambda: swarm(settings="ring"),
        lambda: swarm(seed=1.5),
        lambda: swarm(polish=1),
        lambda: swarm(callback=3),
        lambda: swarm(restarts="1"),
        lambda: swarm(objective=None),
        lambda: swarm(tolerance=None),
        lambda: swarm(obstacles="circle"),
        lambda: swarm(obstacles=object()),
        lambda: batch(seed=["a"]),
        lambda: batch(progress=None, threads=1.5),
    ],
)
def test_wrong_types_are_type_errors(call):
    with pytest.raises(TypeError):
        call()
