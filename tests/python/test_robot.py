"""Backbone, Tendon, Robot: what they refuse, and that they are values."""

import copy
import inspect
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tdcr

BACKBONE = tdcr.Backbone(0.2, 10)
TENDON = tdcr.Tendon(0.0, 0.01)


def robot(**keywords):
    return tdcr.Robot(BACKBONE, [TENDON, tdcr.Tendon(1.5, 0.01)], **keywords)


@pytest.mark.parametrize(
    ("argument", "positional", "keywords"),
    [
        ("length", (0.0, 10), {}),
        ("length", (-0.1, 10), {}),
        ("length", (float("nan"), 10), {}),
        ("length", (float("inf"), 10), {}),
        ("length", ([], []), {}),
        ("length", ([0.1, 0.0], [5, 5]), {}),
        ("subsegments", (0.2, 0), {}),
        ("subsegments", (0.2, -3), {}),
        ("subsegments", (0.2, 10**30), {}),
        ("subsegments", (0.2, 200_000), {}),
        ("length", (1e-200, 10), {}),
        ("subsegments", ([0.1, 0.2], [5]), {}),
        ("poisson_ratio", (0.2, 10), {"poisson_ratio": 0.6}),
        ("rest", (0.2, 10), {"rest": np.zeros((9, 3))}),
        ("rest", (0.2, 10), {"rest": np.zeros(30)}),
        ("rest", (0.2, 2), {"rest": [[0, 4, 0], [0, 0, 0]]}),
        ("rest", (0.2, 1), {"rest": [[0, np.nan, 0]]}),
        ("diameter", (0.2, 10), {"youngs_modulus": 1e9}),
        ("diameter", (0.2, 10), {"diameter": [0.001] * 3}),
        ("disk_radius", (0.2, 10), {"disk_radius": 0.0}),
    ],
)
def test_bad_backbones_name_the_argument(argument, positional, keywords):
    with pytest.raises(tdcr.InvalidInput, match=rf"^{argument}: expected .*, got ") as caught:
        tdcr.Backbone(*positional, **keywords)
    assert caught.value.argument == argument
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, tdcr.TdcrError)


@pytest.mark.parametrize(
    ("argument", "make"),
    [
        ("azimuth", lambda: tdcr.Tendon(float("nan"), 0.01)),
        ("radius", lambda: tdcr.Tendon(0.0, 0.0)),
        ("radius", lambda: tdcr.Tendon(0.0, -0.01)),
        ("radius", lambda: tdcr.Tendon([0.0, 0.1, 0.2], [0.01, 0.01])),
        ("azimuth", lambda: tdcr.Tendon([0.0, 0.1, 0.2], 0.01, end=3)),
        ("end", lambda: tdcr.Tendon(0.0, 0.01, end=0)),
        ("end", lambda: tdcr.Tendon(0.0, 0.01, end=-2)),
        ("end", lambda: tdcr.Tendon(0.0, 0.01, end=10**30)),
        ("name", lambda: tdcr.Tendon(0.0, 0.01, name="\ud800")),
        ("radius", lambda: tdcr.Tendon(0.0, 1e300)),
        ("stiffness", lambda: tdcr.Tendon(0.0, 0.01, stiffness=-1.0)),
        ("name", lambda: tdcr.Tendon(0.0, 0.01, name="")),
        ("turns", lambda: tdcr.Tendon.helical(0.0, 0.01, turns=float("inf"))),
        ("indices", lambda: tdcr.Tendon.from_holes([0, 12], 12, 0.01)),
        ("indices", lambda: tdcr.Tendon.from_holes([0, -1], 12, 0.01)),
        ("count", lambda: tdcr.Tendon.from_holes([0, 1], 0, 0.01)),
        ("tendons[0].end", lambda: tdcr.Robot(BACKBONE, [tdcr.Tendon(0.0, 0.01, end=11)])),
        (
            "tendons[1].azimuth",
            lambda: tdcr.Robot(BACKBONE, [TENDON, tdcr.Tendon([0.0] * 9, 0.01)]),
        ),
        (
            "tendons[0].radius",
            lambda: tdcr.Robot(tdcr.Backbone(0.2, 10, disk_radius=0.009), [TENDON]),
        ),
        (
            "tendons[1].name",
            lambda: tdcr.Robot(BACKBONE, [tdcr.Tendon(0, 0.01, name="t1"), TENDON]),
        ),
        ("base", lambda: robot(base=np.diag([1.0, 1.0, -1.0, 1.0]))),
        ("base", lambda: robot(base=2 * np.eye(4))),
        ("tool", lambda: robot(tool=np.eye(3))),
        ("name", lambda: robot(name=" ")),
    ],
)
def test_bad_tendons_and_robots_name_the_argument(argument, make):
    with pytest.raises(tdcr.InvalidInput) as caught:
        make()
    assert caught.value.argument == argument
    assert str(caught.value).startswith(f"{argument}: expected ")


@pytest.mark.parametrize(
    "make",
    [
        lambda: tdcr.Backbone("long", 10),
        lambda: tdcr.Backbone(b"1", 10),
        lambda: tdcr.Backbone({0.1: 1}, 10),
        lambda: tdcr.Backbone({0.1, 0.2}, [5, 5]),
        lambda: tdcr.Backbone(True, 10),
        lambda: tdcr.Backbone(0.2, True),
        lambda: tdcr.Backbone(0.2, 10, poisson_ratio="soft"),
        lambda: tdcr.Tendon(0.0, 0.01, end=2.5),
        lambda: tdcr.Tendon(0.0, 0.01, name=3),
        lambda: tdcr.Backbone(0.2, 10.5),
        lambda: tdcr.Backbone(0.2, [10, "x"]),
        lambda: tdcr.Backbone(0.2, 10, rest="straight"),
        lambda: tdcr.Tendon(None, 0.01),
        lambda: tdcr.Tendon(0.0, "0.01"),
        lambda: tdcr.Robot(BACKBONE, TENDON),
        lambda: tdcr.Robot(BACKBONE, [BACKBONE]),
        lambda: tdcr.Robot(0.2, [TENDON]),
        lambda: robot(base="here"),
        lambda: tdcr.LinkageSettings(max_iterations="many"),
    ],
)
def test_wrong_types_are_type_errors(make):
    with pytest.raises(TypeError):
        make()


finite = st.floats(-10, 10)
radius = st.floats(1e-3, 1.0)


@st.composite
def tendons(draw):
    keywords = {
        "stiffness": draw(st.none() | st.floats(1.0, 1e6)),
        "name": draw(st.none() | st.text("abcdef ", min_size=1).filter(str.strip)),
    }
    match draw(st.integers(0, 3)):
        case 0:
            end = draw(st.none() | st.integers(1, 20))
            return tdcr.Tendon(draw(finite), draw(radius), end=end, **keywords)
        case 1:
            count = draw(st.integers(2, 6))
            azimuths = draw(st.lists(finite, min_size=count, max_size=count))
            radii = draw(radius | st.lists(radius, min_size=count, max_size=count))
            return tdcr.Tendon(azimuths, radii, **keywords)
        case 2:
            return tdcr.Tendon.helical(draw(finite), draw(radius), turns=draw(finite), **keywords)
        case _:
            holes = draw(st.lists(st.integers(0, 11), min_size=2, max_size=8))
            return tdcr.Tendon.from_holes(holes, 12, draw(radius), azimuth=draw(finite), **keywords)


@given(tendons())
def test_tendons_are_values(tendon):
    for twin in (pickle.loads(pickle.dumps(tendon)), copy.deepcopy(tendon)):
        assert twin == tendon
        assert hash(twin) == hash(tendon)
        assert repr(twin) == repr(tendon)
    assert tendon != tdcr.Tendon(11.0, 0.5)


@given(
    st.lists(st.tuples(radius, st.integers(1, 5)), min_size=1, max_size=4),
    st.floats(-0.9, 0.5),
    st.none() | radius,
    st.booleans(),
)
def test_backbones_are_values(stretches, poisson_ratio, disk_radius, bent):
    length, subsegments = zip(*stretches, strict=True)
    n = sum(subsegments)
    backbone = tdcr.Backbone(
        length,
        subsegments,
        poisson_ratio=poisson_ratio,
        rest=np.full((n, 3), 0.1) if bent else None,
        youngs_modulus=2e9,
        diameter=[0.001 + 1e-5 * i for i in range(n)],
        disk_radius=disk_radius,
    )
    twin = pickle.loads(pickle.dumps(backbone))
    assert twin == backbone
    assert hash(twin) == hash(backbone)
    assert twin.count == n == len(backbone.lengths) == len(backbone.arc_lengths) - 1
    assert backbone.total_length == pytest.approx(sum(length), rel=1e-15)
    assert backbone != tdcr.Backbone(length, subsegments, poisson_ratio=0.123456)


def test_robots_are_values():
    turned = np.eye(4)
    turned[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    turned[:3, 3] = [0.1, -0.2, 0.3]
    first = robot(base=turned, tool=turned, name="arm")
    twin = pickle.loads(pickle.dumps(first))
    assert twin == first
    assert hash(twin) == hash(first)
    assert len({first, twin, robot(), robot(name="other")}) == 3
    assert np.array_equal(first.base, turned)
    assert first.tendon_names == ("t0", "t1")
    assert first.backbone == BACKBONE
    assert first.tendons[0] == TENDON
    assert first.rest_lengths.tolist() == [pytest.approx(0.2, rel=1e-15)] * 2
    assert np.allclose(
        first.rest_frames[-1], turned @ [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.2], [0, 0, 0, 1]]
    )


@pytest.mark.parametrize("thing", [BACKBONE, TENDON, robot(), tdcr.LinkageSettings()])
def test_everything_is_frozen(thing):
    name = next(name for name in dir(type(thing)) if not name.startswith("_"))
    with pytest.raises((AttributeError, TypeError)):
        setattr(thing, name, 1)
    with pytest.raises((AttributeError, TypeError)):
        thing.something_new = 1


def test_arrays_are_read_only_and_built_once():
    first = robot()
    assert first.base is first.base
    assert first.rest_lengths is first.rest_lengths
    for array in (first.base, first.tool, first.rest_lengths, first.rest_frames, BACKBONE.lengths):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_reprs_say_what_matters():
    assert repr(BACKBONE) == "Backbone(0.2, 10, poisson_ratio=0.35)"
    assert eval(repr(BACKBONE), {"Backbone": tdcr.Backbone}) == BACKBONE
    assert repr(TENDON) == "Tendon(0.0, 0.01)"
    helix = tdcr.Tendon.helical(0.5, 0.01, turns=2, end=4, name="h")
    assert eval(repr(helix), {"Tendon": tdcr.Tendon}) == helix
    assert repr(robot(name="arm")) == '<Robot "arm", 10 subsegments over 0.2 m, 2 tendons: t0, t1>'


def test_defaults_are_those_of_the_core():
    from tdcr._core import _rust_defaults

    for name, defaults in _rust_defaults().items():
        settings = getattr(tdcr, name)()
        shown = inspect.signature(getattr(tdcr, name)).parameters
        assert list(shown) == list(defaults)
        for field, value in defaults.items():
            assert getattr(settings, field) == value
            # None stands for the default settings of another class.
            default = shown[field].default
            assert default == value or (default is None and "Settings" in repr(value))


@pytest.mark.parametrize(
    ("argument", "keywords"),
    [
        ("step_tolerance", {"step_tolerance": 0.0}),
        ("step_tolerance", {"step_tolerance": float("nan")}),
        ("max_iterations", {"max_iterations": 0}),
        ("max_iterations", {"max_iterations": -1}),
        ("max_iterations", {"max_iterations": 2**70}),
        ("max_iterations", {"max_iterations": 2**40}),
    ],
)
def test_bad_settings_name_the_argument(argument, keywords):
    with pytest.raises(tdcr.InvalidInput) as caught:
        tdcr.LinkageSettings(**keywords)
    assert caught.value.argument == argument


def test_backbones_follow_curves():
    # A quarter circle of radius 0.1 towards +x, which starts along z.
    angle = np.linspace(0, np.pi / 2, 200)
    points = 0.1 * np.stack([1 - np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    backbone = tdcr.Backbone.from_curve(points, 8, diameter=0.002)
    assert backbone.total_length == pytest.approx(0.1 * np.pi / 2, rel=1e-9)
    assert backbone.diameter == 0.002
    assert np.allclose(backbone.rest, [[0, np.pi / 16, 0]] * 8, atol=1e-7)
    bent = tdcr.Robot(backbone, [])
    assert np.allclose(bent.rest_frames[-1][:3, 3], [0.1, 0, 0.1], atol=1e-8)
    with pytest.raises(tdcr.InvalidInput, match="shape") as caught:
        tdcr.Backbone.from_curve([0, 1, 2], 8)
    assert caught.value.argument == "points"
