"""Obstacles: what they are made of, distances, files, functions, misuse."""

import copy
import itertools
import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tdcr

CUBE_VERTICES = np.array(list(itertools.product((-0.01, 0.01), (-0.02, 0.02), (-0.03, 0.03))))
CUBE_FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def ball(x):
    return float(np.linalg.norm(x)) - 0.02


def ball_gradient(x):
    return x / np.linalg.norm(x)


def obstacles(inside=False):
    return [
        tdcr.Sphere((0.01, 0, 0), 0.02, inside=inside),
        tdcr.Cylinder((0.01, 0, 0), (1, 2, 2), 0.02, inside=inside),
        tdcr.HalfSpace((0, 0, -0.01), (0, 3, 4), inside=inside),
        tdcr.Capsule((0, 0, 0), (0, 0, 0.1), 0.02, inside=inside),
        tdcr.Box((0, 0, 0), (0.01, 0.02, 0.03), inside=inside),
        tdcr.Box((0, 0, 0), (0.01, 0.02, 0.03), TURN, inside=inside),
        tdcr.Mesh(CUBE_VERTICES, CUBE_FACES, inside=inside),
        tdcr.SignedDistance(ball, inside=inside),
        tdcr.SignedDistance(ball, ball_gradient, inside=inside),
    ]


ALL = obstacles() + obstacles(inside=True)
POINTS = np.random.default_rng(0).uniform(-0.05, 0.05, (50, 3))


@pytest.mark.parametrize("obstacle", ALL, ids=repr)
def test_values(obstacle):
    assert isinstance(obstacle, tdcr.Obstacle)
    for other in (pickle.loads(pickle.dumps(obstacle)), copy.deepcopy(obstacle)):
        assert other == obstacle
        assert hash(other) == hash(obstacle)
        assert repr(other) == repr(obstacle)
        assert type(other) is type(obstacle)
        np.testing.assert_array_equal(other.distance(POINTS), obstacle.distance(POINTS))
    assert sum(other == obstacle for other in ALL) == 1
    assert obstacle != 1
    with pytest.raises(AttributeError):
        obstacle.inside = True


@pytest.mark.parametrize(
    ("solid", "lumen"), [*zip(obstacles(), obstacles(inside=True), strict=True)]
)
def test_a_lumen_turns_the_sign(solid, lumen):
    assert not solid.inside
    assert lumen.inside
    np.testing.assert_array_equal(lumen.distance(POINTS), -solid.distance(POINTS))
    np.testing.assert_array_equal(lumen.gradient(POINTS), -solid.gradient(POINTS))


@pytest.mark.parametrize("obstacle", ALL, ids=repr)
def test_gradients_are_unit_vectors_along_which_the_distance_grows(obstacle):
    distance, gradient = obstacle.distance(POINTS), obstacle.gradient(POINTS)
    assert distance.shape == (50,)
    assert gradient.shape == (50, 3)
    assert not distance.flags.writeable
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-9)
    ahead = obstacle.distance(POINTS + 1e-7 * gradient)
    np.testing.assert_allclose(ahead - distance, 1e-7, rtol=1e-5)


def test_distances_in_closed_form():
    sphere, cylinder, half_space, capsule, box, *_ = obstacles()
    at = [[0.05, 0.0, 0.0]]
    np.testing.assert_allclose(sphere.distance(at), [0.02], atol=1e-16)
    across = 0.04 * np.sqrt(8) / 3  # the axis (1, 2, 2)/3 leaves this of (0.04, 0, 0)
    np.testing.assert_allclose(cylinder.distance(at), [across - 0.02], atol=1e-16)
    np.testing.assert_allclose(half_space.distance(at), [0.008], atol=1e-16)
    np.testing.assert_allclose(capsule.distance(at), [0.03], atol=1e-16)
    np.testing.assert_allclose(box.distance(at), [0.04], atol=1e-16)
    np.testing.assert_allclose(box.distance([[0.04, 0.06, 0.0]]), [0.05], atol=1e-16)
    np.testing.assert_array_equal(half_space.gradient(at), [[0.0, 0.6, 0.8]])
    assert sphere.distance(np.empty((0, 3))).shape == (0,)


def test_what_was_given_can_be_read_back():
    sphere, cylinder, half_space, capsule, _, box, mesh, _, function = obstacles()
    assert sphere.center.tolist() == [0.01, 0, 0]
    assert sphere.radius == cylinder.radius == capsule.radius == 0.02
    assert cylinder.point.tolist() == [0.01, 0, 0]
    np.testing.assert_allclose(cylinder.axis, [1 / 3, 2 / 3, 2 / 3], atol=1e-16)
    assert half_space.point.tolist() == [0, 0, -0.01]
    np.testing.assert_allclose(half_space.normal, [0, 0.6, 0.8], atol=1e-16)
    assert (capsule.a.tolist(), capsule.b.tolist()) == ([0, 0, 0], [0, 0, 0.1])
    assert box.center.tolist() == [0, 0, 0]
    assert box.half_extents.tolist() == [0.01, 0.02, 0.03]
    assert box.rotation.tolist() == TURN.tolist()
    np.testing.assert_array_equal(mesh.vertices, CUBE_VERTICES)
    np.testing.assert_array_equal(mesh.faces, CUBE_FACES)
    assert mesh.vertices is mesh.vertices
    assert (function.f, function.gradient_function) == (ball, ball_gradient)
    assert repr(sphere) == "Sphere((0.01, 0.0, 0.0), 0.02)"
    assert repr(obstacles(inside=True)[6]) == "Mesh(<(8, 3) array>, <(12, 3) array>, inside=True)"


@given(st.lists(st.tuples(*[st.floats(-0.1, 0.1)] * 3), min_size=1, max_size=20))
def test_a_mesh_of_a_box_is_the_box(points):
    box, mesh = obstacles()[4], obstacles()[6]
    np.testing.assert_allclose(mesh.distance(points), box.distance(points), atol=1e-15)


def test_inside_out_meshes_are_turned():
    mesh = tdcr.Mesh(CUBE_VERTICES, CUBE_FACES[:, ::-1])
    np.testing.assert_array_equal(mesh.distance(POINTS), obstacles()[6].distance(POINTS))
    assert mesh.distance([[0, 0, 0]]) < 0


def test_clearance_is_from_the_nearest():
    sphere, floor = tdcr.Sphere((0, 0, 0.1), 0.02), tdcr.HalfSpace((0, 0, 0), (0, 0, 1))
    points = [[0, 0, 0.05], [0, 0, 0.01], [0, 0, 0.2]]
    np.testing.assert_allclose(tdcr.clearance([sphere, floor], points), [0.03, 0.01, 0.08])
    np.testing.assert_allclose(tdcr.clearance(sphere, points), [0.03, 0.07, 0.08])
    assert tdcr.clearance((), points).tolist() == [np.inf] * 3
    with pytest.raises(TypeError, match=r"obstacles\[1\]: expected an obstacle, got int"):
        tdcr.clearance([sphere, 3], points)
    with pytest.raises(TypeError, match="obstacles: expected an obstacle or a sequence"):
        tdcr.clearance(3, points)


Z, U, NAN = (0, 0, 0), (1, 1, 1), (0, float("nan"), 0)


@pytest.mark.parametrize(
    ("build", "argument"),
    [
        (lambda: tdcr.Sphere(NAN, 1), "center"),
        (lambda: tdcr.Sphere((0, 0), 1), "center"),
        (lambda: tdcr.Sphere(Z, 0), "radius"),
        (lambda: tdcr.Sphere(Z, -1.0), "radius"),
        (lambda: tdcr.Sphere(Z, float("nan")), "radius"),
        (lambda: tdcr.Cylinder(NAN, U, 1), "point"),
        (lambda: tdcr.Cylinder(Z, Z, 1), "axis"),
        (lambda: tdcr.Cylinder(Z, U, 0), "radius"),
        (lambda: tdcr.HalfSpace(NAN, U), "point"),
        (lambda: tdcr.HalfSpace(Z, Z), "normal"),
        (lambda: tdcr.Capsule(NAN, U, 1), "a"),
        (lambda: tdcr.Capsule(Z, NAN, 1), "b"),
        (lambda: tdcr.Capsule(Z, U, 0), "radius"),
        (lambda: tdcr.Box(NAN, U), "center"),
        (lambda: tdcr.Box(Z, (1, 0, 1)), "half_extents"),
        (lambda: tdcr.Box(Z, U, np.ones((3, 3))), "rotation"),
        (lambda: tdcr.Box(Z, U, -np.eye(3)), "rotation"),
        (lambda: tdcr.Box(Z, U, np.eye(4)), "rotation"),
        (lambda: tdcr.Mesh(np.empty((0, 3)), np.empty((0, 3), int)), "vertices"),
        (lambda: tdcr.Mesh(CUBE_VERTICES, np.empty((0, 3), int)), "faces"),
        (lambda: tdcr.Mesh(CUBE_VERTICES, []), "faces"),
        (lambda: tdcr.Mesh(CUBE_VERTICES[:, :2], CUBE_FACES), "vertices"),
        (lambda: tdcr.Mesh(CUBE_VERTICES, CUBE_FACES[:, :2]), "faces"),
        (lambda: tdcr.Mesh(CUBE_VERTICES, CUBE_FACES - 1), "faces"),
        (lambda: tdcr.Mesh(CUBE_VERTICES, CUBE_FACES + 1), "faces[2]"),
        (lambda: tdcr.Mesh(CUBE_VERTICES * np.nan, CUBE_FACES), "vertices[0]"),
        (lambda: tdcr.Sphere(Z, 1).distance(Z), "points"),
        (lambda: tdcr.Sphere(Z, 1).gradient([NAN]), "points"),
    ],
)
def test_misuse_is_named(build, argument):
    with pytest.raises(tdcr.InvalidInput) as error:
        build()
    assert error.value.argument == argument
    assert "expected" in str(error.value)


def test_open_meshes_name_the_edge():
    with pytest.raises(tdcr.InvalidInput, match=r"the edge of vertices \d and \d has face \d"):
        tdcr.Mesh(CUBE_VERTICES, CUBE_FACES[1:])
    turned = CUBE_FACES.copy()
    turned[3] = turned[3][::-1]
    with pytest.raises(tdcr.InvalidInput, match=r"both running from vertex \d to \d"):
        tdcr.Mesh(CUBE_VERTICES, turned)


@pytest.mark.parametrize(
    "build",
    [
        lambda: tdcr.Obstacle(),
        lambda: tdcr.Sphere("here", 1),
        lambda: tdcr.Sphere(Z, "1"),
        lambda: tdcr.Sphere(Z, True),
        lambda: tdcr.Sphere(Z, 1, inside="yes"),
        lambda: tdcr.Sphere(Z, 1, True),
        lambda: tdcr.Mesh(CUBE_VERTICES, CUBE_FACES.astype(float)),
        lambda: tdcr.SignedDistance(3),
        lambda: tdcr.SignedDistance(ball, 3),
        lambda: tdcr.Mesh.load("some.stl"),
    ],
)
def test_wrong_types_are_type_errors(build):
    with pytest.raises(TypeError):
        build()


def test_functions_are_asked_at_points_they_may_keep():
    seen = []

    def f(x):
        seen.append(x)
        return np.float64(x[2])

    floor = tdcr.SignedDistance(f, lambda x: [0, 0, 1])
    assert floor.distance([[1, 2, 3.0], [4, 5, 6.0]]).tolist() == [3, 6]
    assert [x.tolist() for x in seen] == [[1, 2, 3], [4, 5, 6]]
    assert floor.gradient([[1, 2, 3.0]]).tolist() == [[0, 0, 1]]


def test_differences_fit_the_scale():
    exact, differences = obstacles()[8], obstacles()[7]
    gradient = differences.gradient(POINTS)
    np.testing.assert_allclose(gradient, exact.gradient(POINTS), atol=2e-9)
    far = POINTS * 1e3
    np.testing.assert_allclose(differences.gradient(far), exact.gradient(far), atol=2e-9)


def fails(_):
    raise ZeroDivisionError("no distance here")


@pytest.mark.parametrize(
    ("f", "gradient", "error", "message"),
    [
        (fails, None, ZeroDivisionError, "no distance here"),
        (ball, fails, ZeroDivisionError, "no distance here"),
        (lambda x: x, None, tdcr.InvalidInput, r"f: expected one number .* shape \(3,\)"),
        (lambda x: [1.0], None, TypeError, "f: expected a number, got list"),
        (lambda x: None, None, TypeError, "f: expected a number, got NoneType"),
        (lambda x: np.nan, None, tdcr.InvalidInput, "f: expected a finite distance"),
        (ball, lambda x: x[:2], tdcr.InvalidInput, r"gradient: expected three .* shape \(2,\)"),
        (ball, lambda x: x * np.inf, tdcr.InvalidInput, "gradient: expected three finite"),
        (ball, lambda x: "up", TypeError, "gradient: expected numbers"),
    ],
)
def test_functions_that_fail_are_heard(f, gradient, error, message):
    obstacle = tdcr.SignedDistance(f, gradient)
    with pytest.raises(error, match=message):
        obstacle.distance(POINTS)
    with pytest.raises(error) as found:
        tdcr.clearance([tdcr.Sphere(Z, 1), obstacle], POINTS)
    named = getattr(found.value, "argument", "").startswith("obstacles[1].")
    assert named or found.value.__notes__ == ["raised by obstacles[1]"]


def test_lambdas_do_not_pickle_but_work():
    obstacle = tdcr.SignedDistance(lambda x: x[0])
    assert obstacle.distance([[2, 0, 0]]).tolist() == [2]
    with pytest.raises((pickle.PicklingError, AttributeError)):
        pickle.dumps(obstacle)


def stl(vertices, faces):
    lines = ["solid cube"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(str, vertices[i])) for i in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid cube", ""])


def obj(vertices, faces):
    lines = ["v " + " ".join(map(str, v)) for v in vertices]
    # A normal for every face: its corners are no shared vertices to a reader of normals.
    lines += [f"vn {i} 0 1" for i in range(len(faces))]
    lines += ["f " + " ".join(f"{i + 1}//{k + 1}" for i in f) for k, f in enumerate(faces)]
    return "\n".join([*lines, ""])


@pytest.mark.parametrize(("ending", "write"), [("stl", stl), ("OBJ", obj)])
@pytest.mark.parametrize(("unit", "metres"), [("m", 1), ("cm", 0.01), ("mm", 1e-3), ("in", 0.0254)])
def test_mesh_files(tmp_path, ending, write, unit, metres):
    path = tmp_path / f"cube.{ending}"
    path.write_text(write(CUBE_VERTICES, CUBE_FACES))
    mesh = tdcr.Mesh.load(path, unit=unit)
    assert mesh.vertices.shape == (8, 3)
    assert mesh.faces.shape == (12, 3)
    box = tdcr.Box((0, 0, 0), np.array([0.01, 0.02, 0.03]) * metres)
    points = POINTS * metres
    # Vertices of files are read in single precision.
    atol = 1e-8 * metres
    np.testing.assert_allclose(mesh.distance(points), box.distance(points), atol=atol)
    lumen = tdcr.Mesh.load(str(path), unit=unit, inside=True)
    np.testing.assert_array_equal(lumen.distance(points), -mesh.distance(points))


def test_mesh_files_that_are_none(tmp_path):
    path = tmp_path / "cube.stl"
    with pytest.raises(tdcr.InvalidInput, match=r'unit: expected "m" or .* got None') as error:
        tdcr.Mesh.load(path, unit=None)
    assert error.value.argument == "unit"
    with pytest.raises(FileNotFoundError):
        tdcr.Mesh.load(path, unit="mm")
    for text in ("", "solid nothing\nendsolid nothing\n", "what?"):
        path.write_text(text)
        with pytest.raises(tdcr.InvalidInput) as error:
            tdcr.Mesh.load(path, unit="mm")
        assert error.value.argument == "path"
    path.write_text(stl(CUBE_VERTICES, CUBE_FACES[1:]))
    with pytest.raises(tdcr.InvalidInput, match=r"path: .*cube.stl: faces: .* the edge") as error:
        tdcr.Mesh.load(path, unit="mm")
    unknown = tmp_path / "cube.cake"
    unknown.write_text("v 0 0 0")
    with pytest.raises(tdcr.InvalidInput, match="mesh file that trimesh reads"):
        tdcr.Mesh.load(unknown, unit="mm")


def test_without_trimesh_the_extra_is_named(tmp_path):
    code = (
        "import sys; sys.modules['trimesh'] = None; import tdcr\n"
        "try: tdcr.Mesh.load('cube.stl', unit='mm')\n"
        "except ImportError as error: print(error)"
    )
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.strip().endswith("pip install tdcr[mesh]")


def ring(n, m):
    """Return vertices and faces of a torus of radii 0.05 and 0.02: hollows, ridges and saddles."""
    around = np.linspace(0, 2 * np.pi, n, endpoint=False)[:, None]
    about = np.linspace(0, 2 * np.pi, m, endpoint=False)[None, :]
    r = 0.05 + 0.02 * np.cos(about)
    grid = [r * np.cos(around), r * np.sin(around), 0.02 * np.sin(about) + 0 * around]
    i, j = (index.ravel() for index in np.indices((n, m)))
    i1, j1 = (i + 1) % n, (j + 1) % m
    a, b, c, d = i * m + j, i1 * m + j, i1 * m + j1, i * m + j1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return np.stack(grid, -1).reshape(-1, 3), faces


def by_brute_force(x, vertices, faces):
    """Return the distance to all triangles' least, negative where their solid angles surround x."""
    a, b, c = (vertices[faces[:, k]] - x for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    dot = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    angles = 2 * np.arctan2(triple, la * lb * lc + dot[0] * lc + dot[1] * la + dot[2] * lb)
    distances = [la, lb, lc]
    for u, v in ((a, b), (b, c), (c, a)):
        edge = v - u
        t = -np.einsum("ij,ij->i", u, edge) / np.einsum("ij,ij->i", edge, edge)
        distances.append(np.linalg.norm(u + np.clip(t, 0, 1)[:, None] * edge, axis=1))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    height = np.einsum("ij,ij->i", a, normal)
    foot = height[:, None] * normal
    sides = [
        np.einsum("ij,ij->i", np.cross(v - u, foot - u), normal)
        for u, v in ((a, b), (b, c), (c, a))
    ]
    distances.append(np.where(np.min(sides, axis=0) >= 0, np.abs(height), np.inf))
    return np.min(distances) * (-1 if angles.sum() > 2 * np.pi else 1)


def test_a_ring_against_every_triangle_and_solid_angles():
    vertices, faces = ring(25, 13)
    mesh = tdcr.Mesh(vertices, faces)
    points = np.random.default_rng(1).uniform(-0.08, 0.08, (400, 3)) * [1, 1, 0.4]
    want = [by_brute_force(x, vertices, faces) for x in points]
    assert 40 < np.sum(np.array(want) < 0) < 360
    np.testing.assert_allclose(mesh.distance(points), want, atol=1e-15)
