"""Pictures: what is drawn, from where, and that nothing else changes."""

from __future__ import annotations

import math
import subprocess
import sys
from importlib import resources

import numpy as np
import pytest

import tdcr
from tdcr import Backbone, InvalidInput, Robot, Tendon, forward
from tdcr._plot.projection import plane_of, smooth

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")

from matplotlib import pyplot  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

from tdcr._plot.obstacles import surface  # noqa: E402
from tdcr._plot.shape import plot_shape, save_picture  # noqa: E402

INF = math.inf


@pytest.fixture(autouse=True)
def _no_figures_left():
    yield
    pyplot.close("all")


def robot(**options):
    tendons = [Tendon(k * math.pi / 2, 0.01, name=name) for k, name in enumerate("abcd")]
    return Robot(Backbone(0.2, 12), tendons, **options)


def solve(*displacements, **options):
    return forward(robot(**options), displacements, model="linkage")


def texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_planar_shape_is_drawn_in_its_plane():
    shape = solve(-0.01, INF, INF, INF, name="arm")
    ax = plot_shape(shape)
    assert ax.name != "3d"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [mm]", "z [mm]")
    assert ax.get_title() == "arm\nlinkage model, converged"
    assert ax.get_aspect() == 1.0
    minus = "\N{MINUS SIGN}"
    assert texts(ax) == [f"a ({minus}10 mm)", "b (free)", "c (free)", "d (free)"]
    tip = 1000 * shape.tip[:3, 3]
    ends = [line.get_xydata()[-1] for line in ax.lines]
    assert any(np.allclose(end, tip[[0, 2]]) for end in ends)
    assert shape.plot(ax=ax) is ax


def test_free_and_slack_tendons_are_dashed():
    ax = plot_shape(solve(-0.01, 0.0, 0.03, INF))
    lines = {line.get_label(): line for line in ax.lines}
    styles = {label: lines[label].is_dashed() for label in texts(ax)}
    assert list(styles.values()) == [False, False, True, True]
    assert "c (+30 mm, slack)" in styles
    assert "b (held)" in styles


def test_two_pulls_turn_the_plane():
    ax = plot_shape(solve(-0.01, -0.01, INF, INF))
    assert ax.get_xlabel() == "horizontal, along azimuth 45\N{DEGREE SIGN} [mm]"
    assert plot_shape(solve(INF, -0.01, INF, INF)).get_xlabel() == "y [mm]"


def test_a_bend_to_the_left_points_left():
    shape = solve(INF, INF, -0.01, INF)
    plane = plane_of(shape)
    assert plane.across == pytest.approx([1, 0, 0])
    assert shape.tip[:3, 3] @ plane.across < -0.01


def spatial():
    resource = resources.files("tdcr") / "robots" / "spatial_trunk.toml"
    with resources.as_file(resource) as path:
        return forward(Robot.load(path), [-0.06, -0.02, INF], model="linkage")


def test_a_shape_that_leaves_the_plane_is_drawn_in_3d_at_equal_scale():
    ax = plot_shape(spatial())
    assert ax.name == "3d"
    assert ax.get_zlabel() == "z [mm]"
    spans = np.ptp([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()], axis=1)
    box = ax._box_aspect  # the only place where matplotlib keeps it
    assert box / box[0] == pytest.approx(spans / spans[0])
    assert plot_shape(spatial(), view="2d").name != "3d"


def test_a_base_on_its_side_is_drawn_where_it_is():
    base = np.array([[0, 0, 1, 0.5], [0, 1, 0, 0], [-1, 0, 0, 2.0], [0, 0, 0, 1]])
    shape = solve(-0.01, INF, INF, INF, base=base)
    ax = plot_shape(shape, unit="m")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "z [m]")
    ends = [line.get_xydata()[-1] for line in ax.lines]
    assert any(np.allclose(end, shape.tip[[0, 2], 3]) for end in ends)


def test_a_failed_shape_says_so():
    shape = solve(-0.01, 0.0, 0.0, 0.0)
    assert not shape.ok
    for title in (None, ""):
        ax = plot_shape(shape, title=title)
        assert "NOT A SOLUTION (infeasible): " in ax.get_title()
        assert ax.title.get_color() == "#B3261E"


def test_names_are_text_not_formulas(tmp_path):
    tendons = [Tendon(0, 0.01, name="_a$\\frac{$"), Tendon(2, 0.01, name="$x")]
    shape = forward(
        Robot(Backbone(0.2, 5), tendons, name="$\\bad{$"), [-0.01, INF], model="linkage"
    )
    save_picture(shape, tmp_path / "x.png")
    assert len(texts(plot_shape(shape))) == 2


def test_a_long_robot_is_in_m_and_disks_are_thinned():
    shape = forward(Robot(Backbone(3.0, 500), [Tendon(0, 0.05)]), [-0.1], model="linkage")
    ax = plot_shape(shape)
    assert ax.get_xlabel() == "x [m]"
    assert len(ax.lines) < 80
    assert len(plot_shape(shape, disks=False).lines) < 15


def test_parts_can_be_left_out():
    shape = solve(-0.01, INF, INF, INF)
    assert plot_shape(shape, tendons=False).get_legend() is None
    assert plot_shape(shape, legend=False, title="").get_title() == ""
    assert plot_shape(forward(Robot(Backbone(1, 3), []), [], model="linkage")).lines


def test_given_axes_are_used_and_decide():
    shape = solve(-0.01, INF, INF, INF)
    ax = Figure().add_subplot(projection="3d")
    assert plot_shape(shape, ax=ax) is ax
    with pytest.raises(InvalidInput, match="view: ") as caught:
        plot_shape(shape, ax=ax, view="2d")
    assert caught.value.argument == "view"


@pytest.mark.parametrize("argument", ["view", "unit"])
def test_unknown_words_are_refused(argument):
    with pytest.raises(InvalidInput, match=f"{argument}: expected .*got 'side'"):
        plot_shape(solve(-0.01, INF, INF, INF), **{argument: "side"})


def test_settings_and_figures_of_others_stay(tmp_path):
    before = dict(matplotlib.rcParams)
    save_picture(spatial(), tmp_path / "a.svg")
    assert pyplot.get_fignums() == []
    assert (tmp_path / "a.svg").read_text().count("<path") > 30
    plot_shape(spatial())
    assert dict(matplotlib.rcParams) == before


def test_an_unknown_picture_format_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match=r"one of .*\.png.*got '.*x\.xyz'"):
        save_picture(spatial(), tmp_path / "x.xyz")


def test_without_matplotlib_the_extra_is_named():
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "import tdcr\n"
        "r = tdcr.Robot(tdcr.Backbone(1, 2), [])\n"
        "tdcr.forward(r, [], model='linkage').plot()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1
    assert "ImportError: pictures need matplotlib" in done.stderr
    assert "pip install tdcr[plot]" in done.stderr


def test_the_smooth_line_is_close_to_the_arc():
    angles = np.linspace(0, math.pi, 7)
    frames = np.tile(np.eye(4), (7, 1, 1))
    frames[:, 0, 3], frames[:, 2, 3] = 1 - np.cos(angles), np.sin(angles)
    frames[:, :3, 2] = np.column_stack([np.sin(angles), 0 * angles, np.cos(angles)])
    curve = smooth(frames)
    assert curve.shape == (6 * 8 + 1, 3)
    assert np.hypot(curve[:, 0] - 1, curve[:, 2]) == pytest.approx(np.ones(49), abs=1e-5)


# --- obstacles and contact ------------------------------------------------------------------------


def leaning(obstacles, turns=0.0):
    tendon = Tendon.helical(math.pi, 0.008, turns=turns) if turns else Tendon(math.pi, 0.008)
    trunk = Robot(Backbone(0.18, 9, youngs_modulus=200e9, diameter=0.001), [tendon])
    return forward(trunk, [-0.008], obstacles=obstacles).require()


def test_a_plane_cuts_obstacles_and_shows_forces():
    bar = tdcr.Cylinder((-0.03, 0, 0.1), (0, 1, 0), 0.015)
    shape = leaning([bar])
    ax = plot_shape(shape)
    (contact,) = shape.contacts
    size = np.linalg.norm(contact.force)
    assert ax.get_title().endswith(f"1 contact, at most {size:.3g} N")
    (arrow,) = [each for each in ax.collections if hasattr(each, "U")]
    assert (arrow.X[0], arrow.Y[0]) == pytest.approx(1000 * contact.point[[0, 2]])
    assert np.hypot(arrow.U, arrow.V) == pytest.approx(0.25 * 180)
    rim = np.concatenate([p.vertices for each in ax.collections for p in each.get_paths()])
    on_the_bar = np.abs(np.hypot(rim[:, 0] + 30, rim[:, 1] - 100) - 15) < 0.1
    assert on_the_bar.sum() > 50
    plain = plot_shape(shape, obstacles=False, contacts=False)
    assert not plain.collections


@pytest.mark.parametrize("inside", [False, True])
def test_the_surface_of_an_obstacle_is_where_its_distance_is_zero(inside):
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    low, high = np.full(3, -0.1), np.full(3, 0.2)
    corners = np.array([[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    for obstacle, far in (
        (tdcr.Sphere((0.02, 0, 0.1), 0.03, inside=inside), 2e-4),
        (tdcr.Cylinder((0, 0, 0), (1, 2, 3), 0.02, inside=inside), 2e-4),
        (tdcr.Capsule((0, 0, 0), (0.05, 0, 0.05), 0.01, inside=inside), 2e-4),
        (tdcr.HalfSpace((0, 0, 0.01), (0, 1, 5), inside=inside), 1e-12),
        (tdcr.Box((0, 0, 0.05), (0.02, 0.03, 0.04), turn, inside=inside), 1e-12),
        (tdcr.Mesh(corners, faces, inside=inside), 1e-12),
    ):
        polygons = surface(obstacle, low, high)
        assert len(polygons) > 3
        middles = polygons.mean(axis=1)
        assert np.abs(obstacle.distance(middles)).max() < far
        assert (middles >= low).all()
        assert (middles <= high).all()
        assert len(surface(obstacle, low + 5, high + 5)) == 0 or isinstance(
            obstacle, tdcr.HalfSpace
        )
    assert surface(tdcr.SignedDistance(abs), low, high) is None


def test_space_shows_obstacles_of_every_kind():
    sphere = tdcr.Sphere((-0.04, 0, 0.1), 0.03)
    around = tdcr.Cylinder((0, 0, 0), (0, 0, 1), 0.2, inside=True)
    bowl = tdcr.SignedDistance(lambda x: float(x[2]) + 0.05)
    shape = leaning([sphere, around, bowl], turns=0.5)
    assert shape.contacts
    ax = plot_shape(shape)
    assert ax.name == "3d"
    assert ax.get_xlim()[1] - ax.get_xlim()[0] < 300
    assert "contact" in ax.get_title()
    with_all = len(ax.collections)
    assert with_all > len(plot_shape(shape, obstacles=False).collections)
    assert with_all > len(plot_shape(shape, contacts=False).collections)
    # Without contact there is nothing to draw, and the title says so.
    far = forward(robot(), [-0.01, INF, INF, INF], obstacles=tdcr.Sphere((1, 1, 1), 0.01))
    assert plot_shape(far).get_title().endswith("no contact")


def test_marks_are_drawn_where_they_are():
    shape = solve(-0.01, INF, INF, INF)
    ax = plot_shape(shape, marks=[[0.3, 0.0, 0.1]])
    assert ax.name != "3d"
    (cross,) = [line for line in ax.lines if line.get_marker() == "x"]
    assert np.allclose(cross.get_xydata(), [[300, 100]])
    ax.figure.canvas.draw()
    assert ax.get_xlim()[1] > 300
    path = plot_shape(shape, marks=[[0.0, 0.0, 0.25], [0.1, 0.0, 0.25]], unit="m")
    lines = [line.get_xydata().tolist() for line in path.lines]
    assert [[0.0, 0.25], [0.1, 0.25]] in lines
    # A place outside of the plane of the bend is seen in space alone.
    solid = plot_shape(shape, marks=[[0.1, 0.3, 0.1]])
    assert solid.name == "3d"
    assert solid.get_ylim()[1] >= 300
    assert plot_shape(shape, marks=[[0.1, 0.3, 0.1]], view="2d").name != "3d"


@pytest.mark.parametrize("marks", [[1.0, 2.0, 3.0], [[1.0, 2.0]], [[[1.0, 2.0, 3.0]]]])
def test_marks_of_another_shape_are_refused(marks, tmp_path):
    shape = solve(-0.01, INF, INF, INF)
    with pytest.raises(InvalidInput, match=r"marks: expected places of shape \(m, 3\)"):
        shape.plot(marks=marks)
    with pytest.raises(InvalidInput, match="marks"):
        save_picture(shape, tmp_path / "a.png", marks=marks)
