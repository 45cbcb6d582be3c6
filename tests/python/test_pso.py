"""tdcr.pso: Python functions, settings as values, exceptions, callbacks, Ctrl-C."""

import _thread
import copy
import inspect
import math
import pickle
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr
from tdcr import pso

LOWER, UPPER = [-5.0, -4.0], [5.0, 6.0]
PRESETS = (pso.PsoSettings.constriction, pso.PsoSettings.spso2011, pso.PsoSettings.mahfoudi)


def sphere(x):
    return float(((x - 1) ** 2).sum())


def spheres(points):
    return ((points - 1) ** 2).sum(axis=1)


@pytest.mark.parametrize("preset", PRESETS)
def test_the_minimum_is_found(preset):
    found = pso.minimize(sphere, LOWER, UPPER, settings=preset(target=1e-12, seed=3))
    assert found.ok
    assert found.status is tdcr.Status.converged
    assert (found.stop, found.message) == ("target", "")
    assert found.value == sphere(found.x) <= 1e-12
    assert found.settings == preset(target=1e-12, seed=3)
    assert found.evaluations == found.settings.particles * (found.iterations + 1)
    assert found.history.shape == (found.iterations + 1,)
    assert found.history[-1] == found.value
    assert (np.diff(found.history) <= 0).all()
    assert found.nan_count == 0
    assert found.require() is found


@pytest.mark.parametrize("preset", PRESETS)
def test_one_point_and_whole_swarm_give_the_same_run(preset):
    settings = preset(max_iterations=50)
    one = pso.minimize(sphere, LOWER, UPPER, settings=settings)
    whole = pso.minimize(spheres, LOWER, UPPER, settings=settings, vectorized=True)
    assert one == whole
    assert hash(one) == hash(whole)
    assert one != pso.minimize(sphere, LOWER, UPPER, settings=settings.replace(seed=1))


@pytest.mark.parametrize("bounds", ["clamp", "reflect", "absorb", "rebound"])
@pytest.mark.parametrize("preset", PRESETS)
def test_points_stay_in_the_box(preset, bounds):
    def f(points):
        assert (points >= LOWER).all()
        assert (points <= UPPER).all()
        return points.sum(axis=1)

    settings = preset(bounds=bounds, max_iterations=100)
    assert pso.minimize(f, LOWER, UPPER, settings=settings, vectorized=True).value < -8.9


def test_points_are_the_function_s_own():
    kept = []

    def f(x):
        kept.append(x)
        value = sphere(x)
        x[:] = 99.0
        return value

    found = pso.minimize(f, LOWER, UPPER, settings=pso.PsoSettings(target=1e-6))
    assert found.ok
    assert len(kept) == found.evaluations
    assert kept[0].shape == (2,)


def test_results_are_read_only_values():
    found = pso.minimize(sphere, LOWER, UPPER, settings=pso.PsoSettings(max_iterations=20))
    for array in (found.x, found.history):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError):
        found.value = 0
    for twin in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
        assert twin == found
        assert hash(twin) == hash(found)
        assert not twin.x.flags.writeable
        assert not twin.history.flags.writeable
    assert found != "found"
    assert repr(found).startswith("<PsoResult x=[")
    assert (found.status, found.stop) == ("iteration_limit", "iterations")
    with pytest.raises(tdcr.NotConverged, match=r"iteration_limit: the best value is .* 20 iter"):
        found.require()


def test_settings_are_values():
    settings = pso.PsoSettings(target=1e-9, topology="ring", velocity_limit=None, seed=2**62)
    assert pickle.loads(pickle.dumps(settings)) == settings
    assert hash(pickle.loads(pickle.dumps(settings))) == hash(settings)
    assert eval(repr(settings), {"PsoSettings": pso.PsoSettings}) == settings
    assert settings != settings.replace(seed=3)
    assert settings.replace(target=None).target is None
    assert hash(pso.PsoSettings(improvement=-0.0)) == hash(pso.PsoSettings())
    with pytest.raises(AttributeError):
        settings.seed = 3
    with pytest.raises(TypeError, match="sed"):
        settings.replace(sed=3)
    assert "Ellipsis" not in str(inspect.signature(pso.PsoSettings))


def test_presets_are_those_published():
    # Clerc & Kennedy 2002, 10.1109/4235.985692; Zambrano-Bigiarini et al. 2013,
    # 10.1109/CEC.2013.6557848.
    chi = 2 / abs(2 - 4.1 - math.sqrt(4.1**2 - 4 * 4.1))
    constriction = pso.PsoSettings.constriction()
    assert constriction == pso.PsoSettings()
    assert constriction.inertia == pytest.approx(chi, rel=1e-15)
    assert constriction.social == pytest.approx(2.05 * chi, rel=1e-15)
    spso = pso.PsoSettings.spso2011()
    assert spso.inertia == pytest.approx(1 / (2 * math.log(2)), rel=1e-15)
    assert spso.cognitive == spso.social == pytest.approx(0.5 + math.log(2), rel=1e-15)
    assert (spso.sampling, spso.topology, spso.neighbours) == ("sphere", "random", 3)
    assert (spso.particles, spso.bounds) == (40, "rebound")
    mahfoudi = pso.PsoSettings.mahfoudi()
    assert (mahfoudi.cognitive, mahfoudi.social, mahfoudi.topology) == (2, 2, "global")


@pytest.mark.parametrize(
    ("argument", "keywords"),
    [
        ("sampling", {"sampling": "ball"}),
        ("inertia", {"inertia": float("nan")}),
        ("cognitive", {"cognitive": -1}),
        ("social", {"social": 11.0}),
        ("topology", {"topology": "gbest"}),
        ("neighbours", {"neighbours": 0}),
        ("neighbours", {"neighbours": 10**6, "particles": 3000, "topology": "random"}),
        ("neighbours", {"neighbours": 31, "particles": 30, "topology": "ring"}),
        ("particles", {"particles": 0}),
        ("particles", {"particles": -3}),
        ("particles", {"particles": 2**70}),
        ("bounds", {"bounds": "periodic"}),
        ("velocity_limit", {"velocity_limit": 0.0}),
        ("max_iterations", {"max_iterations": 10**9}),
        ("max_evaluations", {"max_evaluations": 29}),
        ("target", {"target": float("nan")}),
        ("stagnation", {"stagnation": 0}),
        ("improvement", {"improvement": -1e-9}),
        ("seed", {"seed": -1}),
    ],
)
def test_bad_settings_name_the_argument(argument, keywords):
    with pytest.raises(tdcr.InvalidInput) as caught:
        pso.PsoSettings(**keywords)
    assert caught.value.argument == argument
    with pytest.raises(tdcr.InvalidInput, match=argument):
        pso.PsoSettings.spso2011(**keywords)


@pytest.mark.parametrize("name", ["particles", "inertia", "target", "stagnation"])
@pytest.mark.parametrize("value", ["many", True, [1]])
def test_settings_of_wrong_type_name_the_argument(name, value):
    with pytest.raises(TypeError, match=name):
        pso.PsoSettings(**{name: value})


@pytest.mark.parametrize(
    ("argument", "words", "call"),
    [
        ("lower", "got NaN in coordinate 1", lambda: minimize([0, np.nan], [1, 1])),
        ("upper", "got inf in coordinate 0", lambda: minimize([0, 0], [np.inf, 1])),
        ("upper", "at least lower, 3.0 in coordinate 1", lambda: minimize([0, 3], [1, 2])),
        ("upper", "expected 2 numbers", lambda: minimize([0, 0], [1])),
        ("lower", "shape (n,)", lambda: minimize(0.0, [1])),
        ("lower", "for every dimension", lambda: minimize([], [])),
        ("lower", "rectangular", lambda: minimize([[0], [0, 1]], [1])),
        ("start", "inside the box", lambda: minimize([0], [1], start=[2.0])),
        ("start", "shape (1,) or (m, 1)", lambda: minimize([0], [1], start=[[0.0, 0.0]])),
        ("start", "up to 30 points", lambda: minimize([0], [1], start=np.zeros((31, 1)))),
        ("f", "got shape (1,)", lambda: minimize([0], [1], f=lambda x: x)),
        ("f", "(30,), got shape ()", lambda: minimize([0], [1], f=np.sum, vectorized=True)),
        ("f", "got shape (30, 1)", lambda: minimize([0], [1], f=lambda x: x, vectorized=True)),
    ],
)
def test_bad_input_is_said(argument, words, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument
    assert words in str(caught.value)


def minimize(lower, upper, f=sphere, **keywords):
    return pso.minimize(f, lower, upper, **keywords)


@pytest.mark.parametrize(
    ("words", "call"),
    [
        ("f: expected a number, got NoneType", lambda: minimize([0], [1], f=lambda x: None)),
        ("f: expected a number, got str", lambda: minimize([0], [1], f=lambda x: "low")),
        ("f: expected a number, got complex", lambda: minimize([0], [1], f=lambda x: 1j)),
        (
            "f: expected numbers",
            lambda: minimize([0], [1], f=lambda x: ["a"] * 30, vectorized=True),
        ),
        ("f: expected a callable", lambda: minimize([0], [1], f=3)),
        ("callback: expected a callable", lambda: minimize([0], [1], callback=3)),
        ("settings: expected PsoSettings", lambda: minimize([0], [1], settings={"particles": 3})),
        ("lower: expected numbers", lambda: minimize(["a"], [1])),
    ],
)
def test_wrong_types_are_type_errors(words, call):
    with pytest.raises(TypeError, match=words):
        call()


def test_numbers_of_any_kind_are_values():
    for kind in (float, np.float32, np.array, lambda x: int(1e6 * x)):
        assert minimize([0, 0], [2, 2], f=lambda x, kind=kind: kind(sphere(x))).value < 1e-6


@pytest.mark.parametrize("vectorized", [False, True])
def test_exceptions_come_back_unchanged(vectorized):
    class OddError(Exception):
        pass

    error = OddError("odd")
    calls = []

    def f(x):
        calls.append(x)
        if len(calls) == 3:
            raise error
        return spheres(x) if vectorized else sphere(x)

    with pytest.raises(OddError) as caught:
        minimize([0, 0], [1, 1], f=f, vectorized=vectorized)
    assert caught.value is error
    assert len(calls) == 3


def test_nan_is_counted_and_never_best():
    count = 0

    def f(x):
        nonlocal count
        if x[0] < 0.9:
            count += 1
            return math.nan
        return sphere(x)

    found = pso.minimize(f, LOWER, UPPER, settings=pso.PsoSettings(target=1e-9))
    assert found.ok
    assert found.nan_count == count > 0
    never = pso.minimize(lambda x: math.nan, LOWER, UPPER)
    assert never.status == "numerical_error"
    assert never.nan_count == never.evaluations
    assert never.value == math.inf
    assert "below infinity" in never.message


def test_stops():
    flat = pso.minimize(lambda x: 1.0, LOWER, UPPER, settings=pso.PsoSettings(stagnation=5))
    assert (flat.status, flat.stop, flat.iterations) == ("converged", "stagnation", 5)
    settings = pso.PsoSettings(stagnation=5, target=0.0)
    missed = pso.minimize(lambda x: 1.0, LOWER, UPPER, settings=settings)
    assert (missed.status, missed.stop) == ("iteration_limit", "stagnation")
    assert "makes no progress" in missed.message
    spent = pso.minimize(sphere, LOWER, UPPER, settings=pso.PsoSettings(max_evaluations=100))
    assert (spent.stop, spent.evaluations) == ("evaluations", 90)


def test_starts_are_evaluated_first():
    seen = []
    f = lambda x: seen.append(x) or sphere(x)  # noqa: E731
    pso.minimize(f, LOWER, UPPER, start=[[1, 1], [2, 2]])
    assert np.array_equal(seen[:2], [[1, 1], [2, 2]])
    one = pso.minimize(sphere, LOWER, UPPER, start=[1, 1], settings=pso.PsoSettings(target=0.0))
    assert (one.iterations, one.value) == (0, 0.0)


def test_the_callback_sees_every_iteration_and_may_stop():
    seen = []

    def callback(iteration, value):
        seen.append((iteration, value))
        return iteration == 7

    found = pso.minimize(sphere, LOWER, UPPER, callback=callback)
    assert (found.status, found.stop, found.iterations) == ("iteration_limit", "callback", 7)
    assert [iteration for iteration, _ in seen] == list(range(8))
    assert np.array_equal([value for _, value in seen], found.history)
    # Without an answer the run goes on.
    assert pso.minimize(sphere, LOWER, UPPER, callback=lambda *_: None).stop != "callback"
    with pytest.raises(ZeroDivisionError):
        pso.minimize(sphere, LOWER, UPPER, callback=lambda *_: 1 / 0)


def test_progress_is_told_up_to_the_end():
    told = []
    settings = pso.PsoSettings(max_iterations=10**6, stagnation=None)
    keywords = {"settings": settings, "vectorized": True, "progress": told.append}
    # Ends when it was told three times.
    found = pso.minimize(spheres, LOWER, UPPER, callback=lambda *_: len(told) == 3, **keywords)
    assert len(told) == 4
    assert told[-1] == found.iterations
    assert told == sorted(told)
    # Not at every iteration, of which there are a thousand between two.
    assert found.iterations > 100


def test_progress_bar_goes_to_stderr():
    code = """
        from tdcr import pso
        settings = pso.PsoSettings(max_iterations=7)
        pso.minimize(lambda x: x[0], [0.0], [1.0], settings=settings, progress=True)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=True
    )
    assert "7/7" in done.stderr
    assert done.stdout == ""


# A function in Python, two in C that run no Python of their own, and one over the whole swarm.
@pytest.mark.parametrize(
    ("f", "vectorized"),
    [
        ("lambda x: -x[0]", False),
        ("math.fsum", False),
        ("len", False),
        ("lambda x: -x[:, 0]", True),
    ],
)
def test_ctrl_c_interrupts_a_long_swarm(f, vectorized):
    setup = """
        import math
        from tdcr import pso
        settings = pso.PsoSettings(particles=1000, max_iterations=1_000_000, stagnation=None)
    """
    keywords = f"settings=settings, vectorized={vectorized}"
    assert_interrupts(setup, f"pso.minimize({f}, [0.0, 0.0], [1.0, 1.0], {keywords})")


def test_other_threads_run_meanwhile():
    main = threading.get_ident()

    def ends_it():
        """Wait until the other thread is at work."""
        while sys._current_frames()[main].f_code is not pso.minimize.__code__:
            time.sleep(0.001)
        _thread.interrupt_main()

    thread = threading.Thread(target=ends_it)
    settings = pso.PsoSettings(particles=1000, max_iterations=10**6, stagnation=None)
    thread.start()
    # In C, and so never interrupted by the interpreter.
    with pytest.raises(KeyboardInterrupt):
        pso.minimize(len, [0.0], [1.0], settings=settings)
    thread.join()


@pytest.mark.parametrize("name", pso.__all__)
def test_public_names_are_documented(name):
    assert len(inspect.getdoc(getattr(pso, name)) or "") > 40
