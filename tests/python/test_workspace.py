"""Workspaces: samples, chunks, executors, and what is read off the cloud of tips."""

import dataclasses
import math
import pickle
import sys

import numpy as np
import pytest
from example_scripts import example_script

import tdcr
from tdcr._workspace.voxels import Grid, solid_angles, volume

ROBOT = tdcr.Robot(
    tdcr.Backbone([0.06, 0.06], [4, 4]),
    [tdcr.Tendon(2.1 * k, 0.008, end=end) for end in (4, 8) for k in range(3)],
)
RANGES = [(-0.004, 0.004)] * 6
MODEL = {"model": "constant_curvature"}
# One extensible segment of three tendons: its tips fill a space, one to one.
STRETCH = tdcr.Robot(
    tdcr.Backbone(0.1, 5), [tdcr.Tendon(2 * k * math.pi / 3, 0.01) for k in range(3)]
)
EXTENSIBLE = {**MODEL, "settings": tdcr.ConstantCurvatureSettings(extensible=True)}


def sample(samples=1000, **options):
    return tdcr.workspace(ROBOT, RANGES, samples, **{**MODEL, **options})


def same_rows(one, other):
    return all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes()
        for name in ("displacements", "tips", "directions", "codes")
    )


@pytest.mark.parametrize("sampling", ["sobol", "random", "grid"])
def test_rows_are_forward_solves_within_the_ranges(sampling):
    found = sample(sampling=sampling, fields=("energy", "positions"))
    assert len(found) == (729 if sampling == "grid" else 1000)
    low, high = found.displacements.min(axis=0), found.displacements.max(axis=0)
    assert (low >= -0.004).all()
    assert (high <= 0.004).all()
    assert (high - low > 0.0079).all()
    batch = tdcr.forward_batch(ROBOT, found.displacements, fields=("tip", "energy"), **MODEL)
    assert np.array_equal(found.tips, batch.tip[:, :3, 3])
    assert np.array_equal(found.directions, batch.tip[:, :3, 2])
    assert np.array_equal(found.values["energy"], batch.energy)
    assert (found.status == batch.status).all()
    assert np.array_equal(found.values["positions"][:, -1], found.tips)
    assert found.shape(-1) == batch[-1]


def test_a_grid_has_both_ends_of_every_range_and_the_last_tendon_fastest():
    robot = tdcr.Robot(tdcr.Backbone(0.2, 4), [tdcr.Tendon(k, 0.01) for k in range(4)])
    ranges = [(-0.003, 0.0), (-0.001, -0.001), (math.inf, math.inf), (-0.001, 0.002)]
    found = tdcr.workspace(robot, ranges, 11, sampling="grid", **MODEL)
    assert found.displacements.shape == (9, 4)
    assert found.displacements[:, 0].tolist() == [-0.003] * 3 + [-0.0015] * 3 + [0.0] * 3
    assert found.displacements[:3, 3].tolist() == [-0.001, 0.0005, 0.002]
    assert (found.displacements[:, 1] == -0.001).all()
    assert np.isposinf(found.displacements[:, 2]).all()


def test_sobol_samples_are_more_even_than_chance():
    def worst(sampling):
        shares = sample(1024, sampling=sampling).displacements[:, :2] / 0.008 + 0.5
        cells = np.floor(shares * 16).astype(int)
        return np.bincount(cells[:, 0] * 16 + cells[:, 1], minlength=256).max()

    # A Sobol net in base 2 puts as many into each of the 256 as there are for each.
    assert worst("sobol") == 4
    assert worst("random") > 8


def test_the_answer_does_not_depend_on_chunks_and_the_seed_makes_it():
    whole = sample()
    assert same_rows(whole, sample(chunk=7))
    assert whole == sample(chunk=7)
    assert whole != sample(seed=1)
    assert not np.array_equal(whole.tips, sample(seed=1).tips)
    assert np.array_equal(sample(1, seed=1).tips, sample(2, seed=1).tips[:1])
    assert pickle.loads(pickle.dumps(whole)) == whole
    assert hash(whole) == hash(sample())
    with pytest.raises(ValueError, match="read-only"):
        whole.tips[0] = 0


def test_a_fixed_robot_has_one_row():
    found = tdcr.workspace(ROBOT, [(0.0, 0.0)] * 6, 1000, **MODEL)
    assert len(found) == 1
    assert found.reach.nearest == found.reach.farthest == pytest.approx(0.12)
    assert found.volume().value == 0.0


@pytest.mark.slow
def test_failed_rows_are_counted_and_kept_apart():
    robot = tdcr.Robot(tdcr.Backbone(0.2, 6), [tdcr.Tendon(k * math.pi, 0.01) for k in range(2)])
    found = tdcr.workspace(robot, [(-0.02, 0.01)] * 2, 400, sampling="grid")
    assert len(found) == 400
    assert sum(found.counts.values()) == 400
    assert found.counts[tdcr.Status.converged] == found.ok.sum() > 50
    assert (found.status == tdcr.forward_batch(robot, found.displacements).status).all()
    # Opposite tendons cannot both be pulled.
    assert found.counts[tdcr.Status.infeasible] > 200
    assert f"{found.counts[tdcr.Status.infeasible]} infeasible" in repr(found)
    assert found.dexterity().counts.sum() == found.ok.sum()
    assert found.reach.farthest == np.linalg.norm(found.tips[found.ok], axis=1).max()
    held = tdcr.workspace(robot, [(-0.02, -0.01)] * 2, 9, sampling="grid")
    with pytest.raises(tdcr.InvalidInput, match="expected rows that converged, got none"):
        held.volume()


def test_reach_is_seen_from_the_base():
    base = np.eye(4)
    base[:3, 3] = 1.0, 2.0, 3.0
    moved = tdcr.Robot(ROBOT.backbone, ROBOT.tendons, base=base)
    there = tdcr.workspace(moved, RANGES, 500, **MODEL).reach
    here = sample(500).reach
    assert there[:2] == pytest.approx(here[:2], rel=1e-12)
    assert there.low == pytest.approx(here.low + base[:3, 3], rel=1e-12)
    assert (here.low < here.high).all()


def test_the_volume_is_that_of_the_map_from_displacements():
    limit = 0.012
    nodes, weights = np.polynomial.legendre.leggauss(8)
    exact = 0.0
    for index in np.ndindex(8, 8, 8):
        moves = tdcr.jacobian(STRETCH, limit * nodes[list(index)], **EXTENSIBLE)[:3]
        exact += weights[list(index)].prod() * limit**3 * abs(np.linalg.det(moves))
    errors = []
    for samples in (2**12, 2**15, 2**18):
        found = tdcr.workspace(STRETCH, [(-limit, limit)] * 3, samples, **EXTENSIBLE).volume()
        assert abs(found.value - exact) < found.error
        assert found.occupied > exact
        errors.append(found.error / exact)
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 0.16
    assert abs(found.value / exact - 1) < 0.06


@pytest.mark.slow
def test_a_surface_and_a_hollow_ball_have_the_volume_they_have():
    surface = tdcr.workspace(STRETCH, [(-0.01, 0.01)] * 3, 2**15, **MODEL).volume()
    assert surface.value < 0.1 * surface.occupied
    assert surface.error > surface.value
    random = np.random.default_rng(0)
    points = random.normal(size=(300_000, 3))
    points *= (random.uniform(0.5**3, 1, (300_000, 1)) ** (1 / 3)) / np.linalg.norm(
        points, axis=1, keepdims=True
    )
    ball = volume(points, 0.07)
    exact = 4 / 3 * math.pi * (1 - 0.5**3)
    assert ball.value == pytest.approx(exact, rel=0.02)
    assert abs(ball.value - exact) < ball.error < 0.1 * exact
    # Voxels so small that most hold one point or none tell nothing, and say so.
    assert volume(points, 0.01).error == math.inf
    assert volume(points[:3000], 0.2).error > 0.1 * exact


def test_voxels_hold_their_points():
    points = np.array([[0.15, -0.05, 0.0], [0.19, -0.01, 0.09], [-0.11, 0.31, 0.05]])
    grid = Grid.of(points, 0.1)
    found = grid.mean(np.array([1.0, 3.0, 7.0]))
    assert found.centers == pytest.approx(np.array([[-0.15, 0.35, 0.05], [0.15, -0.05, 0.05]]))
    assert found.values.tolist() == [7.0, 2.0]
    assert found.counts.tolist() == [1, 2]


@pytest.mark.parametrize("bands", [3, 12, 25])
def test_directions_over_a_sphere_and_a_cap_have_their_solid_angles(bands):
    random = np.random.default_rng(1)
    directions = random.normal(size=(200_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    grid = Grid.of(np.zeros((200_000, 3)), 1.0)
    assert solid_angles(grid, directions, bands).values == pytest.approx([4 * math.pi])
    half = solid_angles(grid, np.abs(directions), bands).values[0]
    # An octant, and the cells that its edges cut: three quarter circles, about two cells wide.
    width = math.pi / (bands - 1)
    assert math.pi / 2 - 1e-9 <= half <= math.pi / 2 + 2 * width * 3 * math.pi / 2
    cell = solid_angles(grid, np.tile([0.0, 0.0, 1.0], (200_000, 1)), bands).values[0]
    assert 0.0 < cell <= 4 * math.pi / 6


def test_dexterity_tells_segments_apart():
    two = sample(50_000).dexterity(0.01)
    one = tdcr.workspace(STRETCH, [(-0.01, 0.01)] * 3, 50_000, **MODEL).dexterity(0.01)
    cell = 4 * math.pi / 156
    # One segment's tip has one direction at a place, but for what a voxel spans.
    assert one.values.max() < 6 * cell < two.values.max()
    assert one.counts.sum() == two.counts.sum() == 50_000
    assert (one.values >= cell * (1 - 1e-12)).all()


def test_manipulability_is_the_mean_of_the_jacobians():
    found = sample(64)
    everything = found.manipulability(10.0)
    assert len(everything.values) <= 8
    jacobians = np.array([tdcr.jacobian(ROBOT, row, **MODEL) for row in found.displacements])
    values = tdcr.manipulability(jacobians).value
    mean = (everything.values * everything.counts).sum() / 64
    assert mean == pytest.approx(values.mean(), rel=1e-12)
    assert found.manipulability(rows=10).counts.sum() == 10
    among = sample(4, model="rod", obstacles=tdcr.Sphere([1, 0, 0], 0.1), sampling="random")
    with pytest.raises(tdcr.InvalidInput, match="obstacles: expected none"):
        among.manipulability()


def test_without_scipy_sobol_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.stats", None)
    with pytest.raises(ImportError, match=r'pip install tdcr\[sobol\]; sampling="random" and "gri'):
        sample()
    assert len(sample(sampling="random")) == 1000


def test_pictures_show_what_is_asked():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    found = sample(4000)
    section = found.plot()
    assert (section.get_xlabel(), section.get_ylabel()) == ("x [mm]", "z [mm]")
    assert section.get_title() == "constant_curvature model, 4,000 samples"
    (painted,) = [c for c in section.collections if c.get_array() is not None]
    seen = found.dexterity()
    layer = (seen.centers[:, 1] > 0) & (seen.centers[:, 1] < seen.voxel)
    assert np.array_equal(painted.get_array(), seen.values[layer])
    assert [axis.get_ylabel() for axis in section.figure.axes[1:]] == ["directions of the tip [sr]"]
    solid = found.plot(view="3d", value="samples", title="cloud", unit="m")
    assert (solid.name, solid.get_title(), solid.get_zlabel()) == ("3d", "cloud", "z [m]")
    assert found.plot(ax=section, value="manipulability") is section
    with pytest.raises(tdcr.InvalidInput, match="view: expected"):
        found.plot(ax=section, view="3d")
    with pytest.raises(tdcr.InvalidInput, match='value: expected "dexterity"'):
        found.plot(value="reach")
    pyplot.close("all")
    # A base on its side: sections are cut along it.
    base = np.array([[0, 0, 1, 0.5], [0, 1, 0, 0], [-1, 0, 0, 2.0], [0, 0, 0, 1]])
    turned = tdcr.Robot(ROBOT.backbone, ROBOT.tendons, base=base)
    there = tdcr.workspace(turned, RANGES, 4000, **MODEL).plot(value="samples")
    here = found.plot(value="samples")
    limits = [ax.dataLim.get_points() for ax in (there, here)]
    assert limits[0] == pytest.approx(limits[1])
    pyplot.close("all")


def test_tips_in_a_plane_of_the_grid_are_in_one_layer():
    found = sample(2000)
    tips = found.tips.copy()
    tips[:, 1] = np.where(np.arange(2000) % 2, 1e-17, -1e-17)
    seen = dataclasses.replace(found, tips=tips).dexterity(0.002)
    assert np.unique(seen.centers[:, 1]).tolist() == [0.001]
    assert seen.counts.sum() == 2000
    least, most = seen.values.min(), seen.values.max()
    edge = f"voxels of 0.002 m, values {least:.3g} to {most:.3g}>"
    assert repr(seen) == f"<VoxelMap of {len(seen.values)} {edge}"


@pytest.mark.parametrize("view", ["section", "3d"])
def test_tips_in_the_plane_of_the_section_are_shown(view):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    # Rounding puts the tips of a planar robot a hair before the plane, but for the straight one.
    pair = [tdcr.Tendon(0.0, 0.008), tdcr.Tendon(np.pi, 0.008)]
    robot = tdcr.Robot(tdcr.Backbone(0.1, 10), pair)
    found = tdcr.workspace(robot, [(-0.01, 0), (np.inf, np.inf)], 500, sampling="grid", **MODEL)
    tips = found.tips.copy()
    tips[1:, 1], tips[:1, 1] = -1e-9, 1e-9
    seen = dataclasses.replace(found, tips=tips)
    ax = seen.plot(view=view, value="samples")
    (painted,) = [c for c in ax.collections if c.get_array() is not None]
    assert painted.get_array().sum() >= 499
    pyplot.close("all")


@pytest.mark.parametrize(
    ("argument", "words", "call"),
    [
        ("ranges", "shape (6, 2)", lambda: tdcr.workspace(ROBOT, [(-1, 0)], 9, **MODEL)),
        ("ranges", "got", lambda: tdcr.workspace(ROBOT, [(-1, 0), (1,)], 9, **MODEL)),
        (
            "ranges",
            "got (0.0, -0.01) for tendon 5",
            lambda: tdcr.workspace(ROBOT, [*RANGES[:5], (0.0, -0.01)], 9, **MODEL),
        ),
        ("ranges", "got (nan", lambda: tdcr.workspace(ROBOT, [(np.nan, 0)] * 6, 9, **MODEL)),
        ("ranges", "inf)", lambda: tdcr.workspace(ROBOT, [(0, np.inf)] * 6, 9, **MODEL)),
        ("samples", "1 or more, got 0", lambda: sample(0)),
        ("samples", "at least 2^6", lambda: sample(63, sampling="grid")),
        ("sampling", "got 'halton'", lambda: sample(sampling="halton")),
        ("seed", "0 or more, got -1", lambda: sample(seed=-1)),
        ("chunk", "1 or more, got 0", lambda: sample(chunk=0)),
        ("fields", "got 'contacts'", lambda: sample(fields=("energy", "contacts"))),
        ("settings", "for model", lambda: sample(settings=tdcr.RodSettings())),
        ("model", 'got "rods"', lambda: sample(model="rods")),
        ("voxel", "got 0", lambda: sample().volume(0)),
        ("voxel", "got 1e+300", lambda: sample().volume(1e300)),
        ("voxel", "got 5e-324", lambda: sample().dexterity(5e-324)),
        ("voxel", "got nan", lambda: sample().volume(math.nan)),
        ("voxel", "fewer than 2^60", lambda: sample().volume(1e-12)),
        ("bands", "3 or more", lambda: sample().dexterity(bands=2)),
        ("rows", "1 or more", lambda: sample().manipulability(rows=0)),
        ("part", "got 'all'", lambda: sample(9).manipulability(part="all")),
    ],
)
def test_bad_input_is_said(argument, words, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument
    assert words in str(caught.value)


def test_wrong_types_are_type_errors():
    for call in (
        lambda: sample(10.5),
        lambda: sample(seed="one"),
        lambda: sample(chunk=True),
        lambda: tdcr.workspace(3, RANGES, 9),
        lambda: tdcr.workspace(ROBOT, np.array(RANGES) * 1j, 9),
        lambda: tdcr.workspace(ROBOT, "wide", 9),
        lambda: sample().dexterity(bands=3.5),
        lambda: sample().manipulability(rows="all"),
        lambda: sample().volume("small"),
    ):
        with pytest.raises(TypeError, match=r"expected (a|numbers)"):
            call()


def test_the_guides_picture_is_of_what_the_guide_says(tmp_path):
    """Most directions are met in the middle, few at the rim; drawn by the example."""
    pytest.importorskip("scipy")
    pytest.importorskip("matplotlib")
    with example_script("workspace_of_three_segments") as example:
        found = example.sampled(2**15)
        figure = example.draw(found)
    axes, bar = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [mm]", "z [mm]")
    assert bar.get_ylabel() == "directions of the tip [sr]"
    figure.savefig(tmp_path / "workspace.png")
    assert (tmp_path / "workspace.png").stat().st_size > 10_000
    seen = found.dexterity()
    across = np.hypot(seen.centers[:, 0], seen.centers[:, 1])
    high = (seen.centers[:, 2] > 0.1) & (seen.centers[:, 2] < 0.16)
    middle, rim = high & (across < 0.06), high & (across > 0.11)
    assert min(middle.sum(), rim.sum()) >= 10
    assert seen.values[middle].mean() > 3 * seen.values[rim].mean()
