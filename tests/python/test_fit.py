"""Fits: known parameters are found from noisy points, gaps are counted, bad input is named."""

import copy
import pickle
import runpy
from pathlib import Path

import numpy as np
import pytest

import tdcr
from tdcr import design

NOISE = 2e-4
ROWS = 60


def trunk(azimuths=(0.1, 2.0), radii=(0.01, 0.01), rest=None, **keywords):
    backbone = tdcr.Backbone(0.2, 8, rest=rest)
    tendons = [tdcr.Tendon(a, r) for a, r in zip(azimuths, radii, strict=True)]
    return tdcr.Robot(backbone, tendons, **keywords)


def elastic(stiffness=(900.0, 1500.0)):
    """Return a wire with tendons that stretch, one winding, and of other materials."""
    backbone = tdcr.Backbone(0.2, 8, youngs_modulus=60e9, diameter=0.001)
    one, other = stiffness
    tendons = [
        tdcr.Tendon(0.1, 0.01, stiffness=one),
        tdcr.Tendon.helical(2.0, 0.01, turns=0.3, end=6, stiffness=other),
    ]
    return tdcr.Robot(backbone, tendons)


def winding(poisson_ratio=0.3, base=None):
    backbone = tdcr.Backbone(0.2, 8, poisson_ratio=poisson_ratio)
    return tdcr.Robot(backbone, [tdcr.Tendon.helical(0.0, 0.01, turns=0.6)], base=base)


def segments():
    tendons = [
        tdcr.Tendon(0.5 * s + 2 * np.pi * k / 3, 0.005, end=4 * (s + 1))
        for s in range(2)
        for k in range(3)
    ]
    tool = np.eye(4)
    tool[:3, 3] = 0.001, 0.002, 0.008
    return tdcr.Robot(tdcr.Backbone([0.06, 0.06], [4, 4]), tendons, tool=tool)


def pulls(robot, seed, most=0.012):
    return np.random.default_rng(seed).uniform(-most, -0.1 * most, (ROWS, len(robot.tendons)))


def positions(robot, displacements, model="rod"):
    return tdcr.forward_batch(robot, displacements, model=model, fields=["positions"]).positions


def noisy(points, seed=0):
    return points + np.random.default_rng(seed).normal(0, NOISE, points.shape)


def close(answer, known):
    """Whether every estimate is within three of its standard errors, and these are small."""
    for name, values in known.items():
        off = np.abs(answer.parameters[name] - values)
        assert (off < 3 * answer.standard_errors[name]).all(), name
        assert (off > 0).all()


def calibrated(robot, points, known, given, **keywords):
    """Check that errors over draws of the noise are as large as the standard errors say."""
    in_errors = []
    for seed in range(8):
        measured = noisy(points, seed)
        answer = design.fit(robot, measured, list(known), displacements=given, **keywords).require()
        in_errors += [
            (answer.parameters[name] - known[name]) / answer.standard_errors[name] for name in known
        ]
    in_errors = np.abs(np.concatenate(in_errors))
    # Of normal errors 99.7 % are within three; those of one draw depend on each other.
    assert (in_errors < 3).mean() > 0.95
    assert in_errors.max() < 4
    assert 0.7 < np.sqrt(np.mean(in_errors**2)) < 1.4
    return answer


def test_offsets_gains_azimuths_and_rest_are_found_with_the_rod():
    curvature, gain = np.array([0.3, -0.8]), np.array([0.95, 1.08])
    offset, azimuths = np.array([3e-4, -4e-4]), (0.2, 1.9)
    rest = np.tile(np.append(curvature, 0) * 0.025, (8, 1))
    given = pulls(trunk(), 1)
    measured = noisy(positions(trunk(azimuths, rest=rest), given * gain + offset))
    names = ["offset", "gain", "azimuth", "rest"]
    answer = design.fit(trunk(), measured, names, displacements=given).require()
    known = {"offset": offset, "gain": gain, "azimuth": azimuths, "rest": curvature}
    close(answer, known)
    assert max(answer.standard_errors["gain"]) < 0.02
    assert answer.failed == answer.dropped == 0
    # Noise alone is left, in the rows that were held out too (disk 0 has it as well).
    for part in ("train", "validation"):
        assert answer.rms(part) == pytest.approx(np.sqrt(3) * NOISE, rel=0.1)
        assert answer.rms(part, before=True) > 10 * answer.rms(part)
    again = positions(answer.robot, answer.displacements(given))
    assert np.abs(measured - again - answer.residuals).max() < 1e-12


def test_radii_alone_and_outliers():
    given = pulls(trunk(), 2)
    measured = noisy(positions(trunk(radii=(0.0095, 0.0112)), given))
    measured[::10] += 0.05
    answers = [
        design.fit(trunk(), measured, "radius", displacements=given, robust=robust, validation=0)
        for robust in (True, False)
    ]
    off = [np.abs(a.parameters["radius"] - [0.0095, 0.0112]).max() for a in answers]
    assert off[0] < 1e-4 < off[1]
    assert np.isnan(answers[0].rms("validation"))


@pytest.mark.slow
def test_poisson_ratio_and_base_of_a_winding_tendon():
    base = np.eye(4)
    turn = 0.1
    base[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    base[:3, 3] = 0.003, -0.002, 0.001
    given = pulls(winding(), 3)
    points = positions(winding(0.42, base), given)
    known = {"poisson_ratio": [0.42], "base": [0.003, -0.002, 0.001, 0, 0, turn]}
    answer = calibrated(winding(), points, known, given)
    assert answer.standard_errors["poisson_ratio"][0] < 0.1


def test_tips_of_constant_curvature_with_free_tendons():
    robot = segments()
    given = np.random.default_rng(4).uniform(-0.003, 0.003, (ROWS, 6))
    given[::3, 1] = np.inf
    gain = np.array([0.9, 1.05, 1.1, 0.97, 1.0, 1.02])
    batch = tdcr.forward_batch(robot, given * gain, model="constant_curvature")
    points = (batch.tip @ robot.tool)[:, :3, 3]
    model = "constant_curvature"
    exact = design.fit(robot, points, ["gain", "base"], displacements=given, model=model)
    assert np.abs(exact.require().parameters["gain"] - gain).max() < 1e-6
    calibrated(robot, points, {"gain": gain, "base": np.zeros(6)}, given, model=model)


def test_what_the_data_do_not_tell_has_no_error():
    given = pulls(trunk(), 6)
    measured = noisy(positions(trunk(), given))
    # Turning the base and turning all holes is the same.
    names = ["azimuth", "base"]
    answer = design.fit(trunk(), measured, names, displacements=given)
    assert np.isinf(answer.standard_errors["azimuth"]).all()
    assert np.isinf(answer.standard_errors["base"][5])
    assert np.isfinite(answer.standard_errors["base"][:3]).all()
    assert answer.rms() < 2 * NOISE


@pytest.mark.slow
def test_the_stiffness_of_tendons_is_found():
    known = {"stiffness": np.array([700.0, 2500.0]), "gain": np.array([0.95, 1.04])}
    start = elastic()
    given = pulls(start, 7)
    points = positions(elastic(known["stiffness"]), given * known["gain"])
    answer = calibrated(start, points, known, given)
    assert (answer.standard_errors["stiffness"] < 0.1 * known["stiffness"]).all()
    assert answer.robot.tendons[1].stiffness == answer.parameters["stiffness"][1]
    with pytest.raises(tdcr.InvalidInput, match=r"tendons with a stiffness .*got tendons\[0\]"):
        design.fit(trunk(), TIPS, ["stiffness"], displacements=GIVEN)


def test_what_a_fit_leaves_is_judged():
    given = pulls(trunk(), 9)
    measured = noisy(positions(trunk(radii=(0.0095, 0.0112)), given))[:, -1]
    names = ["radius", "azimuth"]
    good = design.fit(trunk(), measured, names, displacements=given).require()
    assert good.message == ""
    # In millimetres, and with two axes for each other.
    for wrong, share in ((1e3 * measured, 500), (measured[:, [2, 1, 0]], 0.05)):
        bad = design.fit(trunk(), wrong, names, displacements=given)
        rms = bad.rms("train")
        assert rms > share * 0.2
        assert f"the fitted robot stays {rms:.3e} m off, root mean square, " in bad.message
    measured[:6] += 0.02
    some = design.fit(trunk(), measured, names, displacements=given, validation=0).require()
    assert "6 of 60 points are more than 10 times as far off as the median" in some.message


def test_gaps_are_dropped_and_counted():
    given = pulls(trunk(), 7)
    measured = positions(trunk(), given)[:, -1].copy()
    measured[3, 1] = measured[10] = np.nan
    answer = design.fit(trunk(), measured, ["gain"], displacements=given)
    assert answer.dropped == 2
    assert set(range(ROWS)) - set(answer.rows.tolist()) == {3, 10}
    assert answer.residuals.shape == (ROWS - 2, 1, 3)
    assert answer.validation.sum() == round(0.2 * (ROWS - 2))
    other = design.fit(trunk(), measured, ["gain"], displacements=given, seed=1)
    assert (other.validation != answer.validation).any()
    assert answer.parameters["gain"] == pytest.approx([1, 1], abs=1e-6)


def test_results_are_values_and_are_drawn():
    given = pulls(trunk(), 8)
    measured = noisy(positions(trunk(), given))
    answer = design.fit(trunk(), measured, ["gain"], displacements=given)
    for other in (copy.deepcopy(answer), pickle.loads(pickle.dumps(answer))):
        assert other == answer
        assert hash(other) == hash(answer)
    assert repr(answer).startswith("<Fit of gain, converged, validation rms ")
    pytest.importorskip("matplotlib")
    axis = answer.plot()
    assert len(axis.lines) == 2
    axes = answer.plot_residuals()
    before, fitted, held = axes[1].collections
    np.testing.assert_array_equal(before.get_offsets()[:, 0], np.repeat(answer.rows, 9))
    sideways = answer.residuals[..., 1] * 1e3
    np.testing.assert_array_equal(held.get_offsets()[:, 1], sideways[answer.validation].ravel())
    np.testing.assert_array_equal(fitted.get_offsets()[:, 1], sideways[~answer.validation].ravel())
    stopped = design.fit(trunk(), measured, ["azimuth"], displacements=given, max_iterations=1)
    assert stopped.status == "iteration_limit"
    with pytest.raises(tdcr.NotConverged, match="1 iterations"):
        stopped.require()
    with pytest.raises(tdcr.InvalidInput, match="part"):
        answer.rms("test")


GIVEN = np.full((5, 2), -0.005)
TIPS = np.zeros((5, 3))
BAD = [
    ("measurements", {"measurements": np.zeros((4, 3))}),
    ("measurements", {"measurements": np.zeros((5, 8, 3))}),
    ("measurements", {"measurements": np.full((5, 3), np.nan)}),
    ("measurements", {"measurements": np.full((5, 3), np.inf)}),
    ("measurements", {"measurements": np.full((5, 3), 1e200)}),
    ("measurements", {"measurements": [[0.0], [0.0, 1.0]]}),
    ("measurements", {"measurements": TIPS[:0], "displacements": GIVEN[:0]}),
    ("measurements", {"measurements": np.zeros((0, 9, 3)), "displacements": GIVEN[:0]}),
    ("measurements", {"measurements": TIPS[:1], "displacements": GIVEN[:1]}),
    ("displacements", {"displacements": GIVEN[:, :1]}),
    ("displacements", {"displacements": GIVEN[0]}),
    ("parameters", {"parameters": []}),
    ("seed", {"seed": -1}),
    ("parameters", {"parameters": ["gain", "gain"]}),
    ("parameters", {"parameters": ["stiffness"]}),
    ("parameters", {"parameters": ["rest"], "model": "constant_curvature"}),
    ("parameters", {"parameters": ["stiffness"], "model": "constant_curvature"}),
    ("model", {"model": "linkage"}),
    ("validation", {"validation": 1.0}),
    ("validation", {"validation": np.nan}),
    ("max_iterations", {"max_iterations": 0}),
]


@pytest.mark.parametrize(("argument", "changes"), BAD)
def test_bad_input_names_the_argument(argument, changes):
    arguments = {"measurements": TIPS, "parameters": ["gain", "azimuth"], "displacements": GIVEN}
    with pytest.raises(tdcr.InvalidInput, match=r"expected .*got ") as caught:
        design.fit(trunk(), **(arguments | changes))
    assert caught.value.argument == argument


def test_holes_of_winding_tendons_and_wrong_types():
    one = GIVEN[:, :1]
    with pytest.raises(tdcr.InvalidInput, match=r"straight tendons.*tendons\[0\]"):
        design.fit(winding(), TIPS, ["radius"], displacements=one)
    with pytest.raises(TypeError, match="measurements: expected numbers"):
        design.fit(winding(), [["a"] * 3] * 5, ["gain"], displacements=one)
    for name, value in (
        ("validation", "all"),
        ("validation", True),
        ("seed", 0.5),
        ("max_iterations", "many"),
        ("robust", "no"),
        ("model", 3),
        ("parameters", None),
        ("parameters", [["gain"]]),
    ):
        arguments = {"parameters": ["gain"], "displacements": GIVEN, name: value}
        with pytest.raises(TypeError, match=rf"{name}: expected .*got "):
            design.fit(trunk(), TIPS, **arguments)
    with pytest.raises(TypeError, match="robot: expected Robot"):
        design.fit("robot", TIPS, ["gain"], displacements=one)


def test_robots_without_tendons_have_none_to_fit():
    bare = tdcr.Robot(tdcr.Backbone(0.1, 5), [])
    measured = np.tile([0.01, 0.0, 0.1], (5, 1))
    with pytest.raises(tdcr.InvalidInput, match=r"robot: expected tendons to fit gain .*got "):
        design.fit(bare, measured, ["base", "gain"], displacements=np.zeros((5, 0)))
    found = design.fit(bare, measured, ["base"], displacements=np.zeros((5, 0)))
    assert found.rms("train") < 1e-9


def test_rows_that_no_shape_has_are_told():
    # Pulls by ten lengths of the robot.
    found = design.fit(trunk(), TIPS, ["gain"], displacements=np.full((5, 2), -1.0))
    assert found.failed == 5
    assert "the forward solve of 5 of 5 rows did not converge" in found.message


@pytest.mark.slow
def test_the_measured_robot_is_fitted_as_the_guide_says():
    pytest.importorskip("matplotlib")
    root = Path(__file__).resolve().parents[2]
    example = runpy.run_path(str(root / "examples" / "fit_measured_robot.py"))
    fits = [example["fitted"](names).require() for names in example["CHOICES"]]
    page = (root / "docs/design.md").read_text(encoding="utf-8")
    rods = [example["fitted"](names).require() for names in example["ROD_CHOICES"]]
    for line in [*example["table"](fits), *example["table"](rods)]:
        assert line in page
    # The rod, whose tendons stretch, knows what constant curvature does not.
    assert rods[-1].mean() < 0.6 * fits[-1].mean()
    assert rods[-1].failed == rods[-1].dropped == 0
    # Held-out rows are met as well as the others.
    assert fits[-1].mean() < 1.1 * fits[-1].mean("train")
    assert fits[-1].mean() < 0.6 * fits[-1].mean(before=True)
    assert fits[-1].failed == fits[-1].dropped == 0


def test_holes_stay_in_the_disks():
    disks = tdcr.Backbone(0.2, 10, disk_radius=0.0105)
    arm = tdcr.Robot(disks, [tdcr.Tendon(0.0, 0.010), tdcr.Tendon(2.0, 0.010)])
    wide = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(a, 0.012) for a in (0.0, 2.0)])
    pulls = np.array([[-0.001 * k, np.inf][:: 1 - 2 * (k % 2)] for k in range(1, 11)])
    tips = tdcr.forward_batch(wide, pulls).tip[:, :3, 3]
    found = design.fit(arm, tips, ["radius"], displacements=pulls, validation=0)
    assert found.parameters["radius"].tolist() == [0.0105, 0.0105]
    assert "at the least or greatest that a robot can have: radius" in found.message
