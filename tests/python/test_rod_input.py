"""Bad input of the rod: what is said, and of what type it is."""

import numpy as np
import pytest

import tdcr

FREE = np.inf


def trunk(backbone=None, azimuths=(0.0, 2.0), **keywords):
    backbone = tdcr.Backbone(0.2, 10) if backbone is None else backbone
    return tdcr.Robot(backbone, [tdcr.Tendon(a, 0.01) for a in azimuths], **keywords)


PULLED = tdcr.forward(trunk(), [-0.005, FREE])


def forward(displacements=(-0.005, FREE), **keywords):
    return tdcr.forward(trunk(), displacements, **keywords)


def drawn(tensions, **keywords):
    return tdcr.forward(trunk(), tensions=tensions, **keywords)


@pytest.mark.parametrize(
    ("argument", "words", "call"),
    [
        ("tensions", "got both", lambda: forward(tensions=[1, 1])),
        ("displacements", "got neither", lambda: tdcr.forward(trunk())),
        ("tensions", "got -1.0", lambda: drawn([1, -1])),
        ("tensions", "got NaN", lambda: drawn([np.nan, 1])),
        ("tensions", "got inf", lambda: drawn([FREE, 1])),
        ("tensions", "expected shape (2,)", lambda: drawn([1])),
        ("tensions", "got shape (4, 2)", lambda: drawn(np.ones((4, 2)))),
        ("tensions", 'for model "linkage"', lambda: drawn([1, 1], model="linkage")),
        (
            "tensions",
            'for model "constant_curvature"',
            lambda: drawn([1, 1], model="constant_curvature"),
        ),
        ("displacements", "got NaN for tendon 't1'", lambda: forward([0, np.nan])),
        ("displacements", "-inf", lambda: forward([0, -FREE])),
        ("displacements", "2 values, one per tendon, got 3", lambda: forward([0, 0, 0])),
        ("displacements", "forward_batch takes (B, 2)", lambda: forward([[0, 0], [0, 0]])),
        (
            "start",
            "one of another robot",
            lambda: tdcr.forward(trunk(azimuths=[0, 1]), [0, 0], start=PULLED),
        ),
        (
            "start",
            "elements=3, got one with elements=1",
            lambda: forward(start=PULLED, settings=tdcr.RodSettings(elements=3)),
        ),
        ("start", 'got one of model "linkage"', lambda: forward(start=forward(model="linkage"))),
        ("start", 'for model "linkage"', lambda: forward(start=PULLED, model="linkage")),
        ("start", "beside tensions", lambda: drawn([1, 1], start=PULLED)),
        (
            "settings",
            'expected RodSettings for model "rod", got LinkageSettings',
            lambda: forward(settings=tdcr.LinkageSettings()),
        ),
        (
            "settings",
            'expected LinkageSettings for model "linkage", got RodSettings',
            lambda: forward(settings=tdcr.RodSettings(), model="linkage"),
        ),
        (
            "youngs_modulus",
            "axial strain needs EA",
            lambda: forward(settings=tdcr.RodSettings(axial=True)),
        ),
        (
            "youngs_modulus",
            "tendon 'wire' has a stiffness",
            lambda: tdcr.forward(
                tdcr.Robot(
                    tdcr.Backbone(0.2, 3), [tdcr.Tendon(0, 0.01, stiffness=1e4, name="wire")]
                ),
                [-0.001],
            ),
        ),
        (
            "warm",
            'got True for model "linkage"',
            lambda: tdcr.forward_batch(trunk(), [[0, 0]], model="linkage", warm=True),
        ),
        (
            "displacements",
            "got NaN for tendon 't0' in row 1",
            lambda: tdcr.forward_batch(trunk(), [[0, 0], [np.nan, 0]], warm=True),
        ),
        (
            "model",
            '"constant_curvature"',
            lambda: tdcr.inverse_solutions(trunk(), [0, 0, 0.2], model="rod"),
        ),
        ("subsegment", '"arc" or "link"', lambda: tdcr.RodSettings(subsegment="bar")),
        ("tendons", '"sliding" or "prop', lambda: tdcr.RodSettings(tendons="glued")),
        ("elements", "1 to 100", lambda: tdcr.RodSettings(elements=0)),
        ("elements", "got -1", lambda: tdcr.RodSettings(elements=-1)),
        ("tolerance", "from 1e-13 to 1e-3", lambda: tdcr.RodSettings(tolerance=0.0)),
        ("tolerance", "got 1e-16", lambda: tdcr.RodSettings(tolerance=1e-16)),
        ("tolerance", "got NaN", lambda: tdcr.RodSettings(tolerance=np.nan)),
        ("max_iterations", "got 0", lambda: tdcr.RodSettings(max_iterations=0)),
        ("diameter", "", lambda: tdcr.Backbone(0.2, 3, youngs_modulus=1e9)),
        ("rest", "got shape (3,)", lambda: tdcr.Backbone(0.2, 3, rest=[0, 0, 0])),
        ("rest", "3 rotation vectors", lambda: tdcr.Backbone(0.2, 3, rest=np.zeros((2, 3)))),
        ("rest", "at most pi rad", lambda: tdcr.Backbone(0.2, 1, rest=[[0, 3.2, 0]])),
    ],
)
def test_bad_input_is_said(argument, words, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("words", "call"),
    [
        ("start: expected a Shape, got list", lambda: forward(start=[0, 0])),
        ("tensions", lambda: drawn(["a", "b"])),
        ("settings: expected RodSettings", lambda: forward(settings={"elements": 2})),
        ("elements", lambda: tdcr.RodSettings(elements=1.5)),
        ("axial", lambda: tdcr.RodSettings(axial=1)),
        ("warm", lambda: tdcr.forward_batch(trunk(), [[0, 0]], warm="yes")),
    ],
)
def test_wrong_types_are_type_errors(words, call):
    with pytest.raises(TypeError, match=words):
        call()
