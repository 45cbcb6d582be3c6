"""Contact and loads from Python: golden data, surroundings kept, starts, batches, misuse."""

import copy
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from interrupts import assert_interrupts

import tdcr

FREE = np.inf
GOLDEN = json.loads((Path(__file__).parents[1] / "data" / "rod_contact.json").read_text())
BAR = tdcr.Cylinder((0.030, 0, 0.100), (0, 1, 0), 0.010)


def trunk(pull=0.0, **keywords):
    """Return a trunk with one tendon at +x."""
    backbone = tdcr.Backbone(0.18, 9, **keywords)
    return tdcr.Robot(backbone, [tdcr.Tendon(pull, 0.008)])


def steel():
    return trunk(youngs_modulus=200e9, diameter=0.001)


def pulled(robot=None, displacement=-0.006, obstacles=BAR, **keywords):
    robot = trunk() if robot is None else robot
    return tdcr.forward(robot, [displacement], obstacles=obstacles, **keywords)


def cube():
    """Return vertices and faces of a cube of 20 mm at the place of the bar."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
    return 0.01 * corners + [0.030, 0, 0.100], np.array(faces)


def ball(x):
    return float(np.linalg.norm(x - [0.030, 0.002, 0.100])) - 0.010


# --- the answer --------------------------------------------------------------------------------


@pytest.mark.parametrize("case", GOLDEN["cases"], ids=lambda case: f"{case['name']}-{case['kind']}")
def test_the_independent_solver_is_met_at_every_disk(case):
    backbone = tdcr.Backbone(
        case["backbone_length"], case["n"], poisson_ratio=case["poisson"], rest=case["rest"]
    )
    robot = tdcr.Robot(backbone, [tdcr.Tendon(case["azimuth"], case["radius"])])
    spheres = [tdcr.Sphere(each["center"], each["radius"]) for each in case["obstacles"]]
    settings = tdcr.RodSettings(subsegment=case["kind"])
    shape = pulled(robot, case["displacement"], spheres, settings=settings).require()
    assert shape.positions == pytest.approx(np.array(case["positions"]), abs=1e-9)
    assert shape.tensions[0] == pytest.approx(case["tension"], rel=1e-7)
    assert shape.energy == pytest.approx(case["energy"], rel=1e-7)
    expected = np.zeros((case["n"] + 1, max(len(spheres), 1), 3))
    if spheres:
        expected[1:] = case["contact"]
    forces = np.zeros_like(expected)
    for contact in shape.contacts:
        kind = ("center", "hole", "mirror").index(contact.kind)
        forces[contact.disk, contact.obstacle, kind] = np.linalg.norm(contact.force)
        assert contact.force @ contact.normal >= 0
    assert forces == pytest.approx(expected, abs=1e-4)


def test_a_contact_says_what_touches_where():
    shape = pulled()
    assert shape.contacts
    for contact in shape.contacts:
        assert (contact.tendon is None) == (contact.kind == "center")
        if contact.kind == "hole":
            assert contact.point.tolist() == shape.tendon_points[0][contact.disk].tolist()
        distance = BAR.distance([contact.point])[0]
        assert contact.gap == pytest.approx(distance, abs=1e-15)
        assert abs(contact.gap) < 1e-10
        assert contact.normal == pytest.approx(BAR.gradient([contact.point])[0], abs=1e-12)
        assert np.cross(contact.force, contact.normal) == pytest.approx(np.zeros(3), abs=1e-9)
        for array in (contact.point, contact.normal, contact.force):
            assert not array.flags.writeable
    assert shape.obstacles == (BAR,)
    assert shape.loads is None
    free = tdcr.forward(trunk(), [-0.006])
    assert free.contacts == []
    assert free.obstacles == ()
    assert shape.energy > free.energy


def test_forces_are_in_newtons_where_the_stiffness_is_known():
    relative, absolute = pulled(), pulled(steel())
    stiffness = 200e9 * np.pi * 0.001**4 / 64
    assert (relative.units, absolute.units) == ("EI", "N")
    for one, other in zip(relative.contacts, absolute.contacts, strict=True):
        assert other.force == pytest.approx(one.force * stiffness, rel=1e-6, abs=1e-9)


def test_a_body_around_the_backbone_keeps_its_radius():
    robot = tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(0.0, 0.004)])
    settings = tdcr.RodSettings(body_radius=0.012)
    shape = pulled(robot, -0.004, settings=settings).require()
    assert [contact.kind for contact in shape.contacts] == ["center"] * len(shape.contacts)
    assert tdcr.clearance(BAR, shape.positions).min() == pytest.approx(0.012, abs=1e-10)


def test_a_lumen_is_kept_to():
    tube = tdcr.Cylinder((0, 0, 0), (0, 0, 1), 0.020, inside=True)
    shape = pulled(obstacles=tube).require()
    points = np.vstack([shape.positions, *shape.tendon_points])
    assert tdcr.clearance(tube, points).min() > -1e-10
    assert shape.contacts
    assert all(
        contact.force @ [contact.point[0], contact.point[1], 0] < 0 for contact in shape.contacts
    )


@pytest.mark.parametrize(
    "obstacle", [tdcr.Mesh(*cube()), tdcr.SignedDistance(ball)], ids=["mesh", "function"]
)
def test_meshes_and_functions_are_obstacles_too(obstacle):
    shape = pulled(obstacles=[obstacle]).require()
    assert shape.contacts
    points = np.vstack([shape.positions, *shape.tendon_points])
    assert tdcr.clearance(obstacle, points).min() > -1e-9


# --- loads -------------------------------------------------------------------------------------


def test_a_small_tip_force_bends_a_cantilever():
    stiffness = 200e9 * np.pi * 0.001**4 / 64
    robot = tdcr.Robot(tdcr.Backbone(0.18, 60, youngs_modulus=200e9, diameter=0.001), [])
    shape = tdcr.forward(robot, [], loads=tdcr.Loads(tip_force=(0, 1e-3, 0))).require()
    assert shape.tip[1, 3] == pytest.approx(1e-3 * 0.18**3 / (3 * stiffness), rel=1e-3)
    assert shape.loads == tdcr.Loads(tip_force=(0, 1e-3, 0))


def test_weight_is_that_of_the_same_forces():
    robot = steel()
    area, each = np.pi * 0.001**2 / 4, 0.02
    weight = np.full(10, 7850 * area * each + 0.002) * 9.81
    weight[0] = 0.0
    weight[-1] -= 7850 * area * each / 2 * 9.81
    across = tdcr.Loads(gravity=(9.81, 0, 0), backbone_density=7850, disk_mass=0.002)
    forces = np.outer(weight, [1, 0, 0])
    by_hand = tdcr.Loads(disk_forces=forces)
    one, other = (
        tdcr.forward(robot, [-0.003], loads=loads).require() for loads in (across, by_hand)
    )
    assert one.frames == pytest.approx(other.frames, abs=1e-9)


def test_loads_and_obstacles_together():
    shape = pulled(steel(), loads=tdcr.Loads(tip_force=(0, 0.05, 0))).require()
    assert shape.contacts
    assert shape.tip[1, 3] > 1e-3


# --- values ------------------------------------------------------------------------------------


def test_shapes_and_contacts_are_values():
    shape = pulled(steel(), obstacles=[BAR], loads=tdcr.Loads(disk_mass=0.001))
    again = pulled(steel(), obstacles=(BAR,), loads=tdcr.Loads(disk_mass=0.001))
    assert shape == again
    assert hash(shape) == hash(again)
    for other in (pickle.loads(pickle.dumps(shape)), copy.deepcopy(shape)):
        assert other == shape
        assert other.contacts == shape.contacts
        assert (other.obstacles, other.loads) == (shape.obstacles, shape.loads)
        assert repr(other) == repr(shape)
    assert f", {len(shape.contacts)} contact" in repr(shape)
    assert shape != pulled(steel())
    assert shape != pulled(steel(), obstacles=[BAR, BAR], loads=tdcr.Loads(disk_mass=0.001))
    contact = shape.contacts[0]
    for other in (pickle.loads(pickle.dumps(contact)), copy.copy(contact)):
        assert other == contact
        assert hash(other) == hash(contact)
    assert f"disk {contact.disk}" in repr(contact)


def test_a_function_makes_equal_shapes_after_pickling():
    shape = pulled(obstacles=tdcr.SignedDistance(ball))
    assert pickle.loads(pickle.dumps(shape)) == shape


def test_loads_are_values():
    forces = np.arange(30.0).reshape(10, 3)
    loads = tdcr.Loads(gravity=(0, 0, 0), tip_moment=(0, 0.1, 0), disk_forces=forces)
    assert pickle.loads(pickle.dumps(loads)) == loads
    assert hash(copy.deepcopy(loads)) == hash(loads)
    assert eval(repr(loads), {"Loads": tdcr.Loads}) == loads
    assert loads != tdcr.Loads()
    assert tdcr.Loads(tip_force=(-0.0, 0, 0)) == tdcr.Loads()
    assert hash(tdcr.Loads(tip_force=(-0.0, 0, 0))) == hash(tdcr.Loads())
    assert tdcr.Loads().gravity.tolist() == [0, 0, -9.81]
    assert loads.disk_forces.tolist() == forces.tolist()
    assert tdcr.Loads().disk_forces is None


# --- starts and batches ------------------------------------------------------------------------


def test_a_start_leads_to_the_same_shape_in_fewer_steps():
    start = pulled(displacement=-0.0055)
    cold, warm = pulled(), pulled(start=start)
    assert warm.positions == pytest.approx(cold.positions, abs=1e-9)
    assert warm.iterations < cold.iterations
    # Neither obstacles nor loads need be those of the start.
    free = tdcr.forward(trunk(), [-0.0055])
    assert pulled(start=free).positions == pytest.approx(cold.positions, abs=1e-9)
    back = tdcr.forward(trunk(), [-0.006], start=cold).require()
    assert back.contacts == []
    with pytest.raises(tdcr.InvalidInput, match="start: expected a shape of this robot"):
        pulled(start=pulled(trunk(0.1)))


@pytest.mark.parametrize("warm", [False, True])
@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_is_its_loop(warm, threads):
    rows = np.linspace(0, -0.006, 70)[:, None]
    batch = tdcr.forward_batch(
        trunk(), rows, obstacles=[BAR], fields=("tip", "contacts"), warm=warm, threads=threads
    )
    assert batch.ok.all()
    assert batch.obstacles == (BAR,)
    table = batch.contacts
    assert (np.diff(table["row"]) >= 0).all()
    assert set(table["row"]) >= {63, 64, 69}
    assert 0 not in table["row"]
    for i in (0, 40, 63, 64, 69):
        shape = batch[i]
        assert shape.tip.tolist() == batch.tip[i].tolist()
        own = table[table["row"] == i]
        assert len(own) == len(shape.contacts)
        for record, contact in zip(own, shape.contacts, strict=True):
            assert (record["disk"], record["kind"]) == (contact.disk, contact.kind)
            assert record["tendon"] == (-1 if contact.tendon is None else contact.tendon)
            assert record["obstacle"] == contact.obstacle
            assert record["gap"] == contact.gap
            for name in ("point", "normal", "force"):
                assert record[name].tolist() == getattr(contact, name).tolist()
        if not warm:
            assert shape == tdcr.forward(trunk(), rows[i], obstacles=[BAR])
    assert pickle.loads(pickle.dumps(batch)) == batch
    assert batch != tdcr.forward_batch(trunk(), rows, fields=("tip", "contacts"), warm=warm)


def test_a_batch_under_loads():
    rows = np.linspace(0, -0.004, 5)[:, None]
    loads = tdcr.Loads(tip_force=(0, 0.05, 0))
    batch = tdcr.forward_batch(steel(), rows, loads=loads, fields=("tip", "contacts"))
    assert batch.ok.all()
    assert len(batch.contacts) == 0
    assert batch.loads == loads
    assert batch[3] == tdcr.forward(steel(), rows[3], loads=loads)
    assert batch[3].tip.tolist() == batch.tip[3].tolist()


def test_models_without_contact_have_an_empty_table():
    batch = tdcr.forward_batch(trunk(), [[-0.001]], model="linkage", fields=("contacts",))
    assert len(batch.contacts) == 0
    assert batch.contacts.dtype["force"].shape == (3,)


# --- misuse ------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["linkage", "constant_curvature"])
def test_other_models_refuse(model):
    for around in ({"obstacles": [BAR]}, {"loads": tdcr.Loads()}):
        (name,) = around
        with pytest.raises(tdcr.InvalidInput, match=f'{name}: expected none, or model "rod"'):
            tdcr.forward(trunk(), [-0.001], model=model, **around)
        with pytest.raises(tdcr.InvalidInput, match=f'{name}: expected none, or model "rod"'):
            tdcr.forward_batch(trunk(), [[-0.001]], model=model, **around)
    assert tdcr.forward(trunk(), [-0.001], model=model, obstacles=()).ok


def test_what_the_rod_does_not_offer_among_obstacles():
    proportional = tdcr.RodSettings(tendons="proportional")
    for around in ({"obstacles": BAR}, {"loads": tdcr.Loads()}):
        with pytest.raises(tdcr.InvalidInput, match='tendons: expected "sliding"'):
            tdcr.forward(steel(), [-0.001], settings=proportional, **around)
    with pytest.raises(tdcr.InvalidInput, match="shape: expected a shape without obstacles"):
        tdcr.sensitivity(pulled())


@pytest.mark.parametrize(
    ("keywords", "argument", "error"),
    [
        ({"gravity": (0, 0)}, "gravity", tdcr.InvalidInput),
        ({"gravity": (0, 0, np.nan)}, "gravity", tdcr.InvalidInput),
        ({"backbone_density": -1.0}, "backbone_density", tdcr.InvalidInput),
        ({"disk_mass": np.inf}, "disk_mass", tdcr.InvalidInput),
        ({"disk_mass": "heavy"}, "disk_mass", TypeError),
        ({"tip_force": (np.inf, 0, 0)}, "tip_force", tdcr.InvalidInput),
        ({"tip_moment": 1.0}, "tip_moment", tdcr.InvalidInput),
        ({"disk_forces": np.full((10, 3), np.nan)}, r"disk_forces\[0\]", tdcr.InvalidInput),
        ({"disk_forces": (1, 2, 3)}, "disk_forces", tdcr.InvalidInput),
    ],
)
def test_bad_loads_name_the_argument(keywords, argument, error):
    with pytest.raises(error, match=f"^{argument}: expected"):
        tdcr.Loads(**keywords)


def test_loads_that_do_not_fit_the_robot():
    with pytest.raises(tdcr.InvalidInput, match="youngs_modulus: expected"):
        tdcr.forward(trunk(), [0.0], loads=tdcr.Loads())
    loads = tdcr.Loads(disk_forces=np.zeros((9, 3)))
    with pytest.raises(tdcr.InvalidInput, match="disk_forces: expected 10 forces"):
        tdcr.forward(steel(), [0.0], loads=loads)
    with pytest.raises(TypeError, match="loads: expected Loads, got dict"):
        tdcr.forward(steel(), [0.0], loads={})


@pytest.mark.parametrize("radius", [-0.001, np.nan, np.inf])
def test_a_body_has_a_radius(radius):
    with pytest.raises(tdcr.InvalidInput, match="body_radius: expected 0 m or more"):
        tdcr.RodSettings(body_radius=radius)


def test_what_is_no_obstacle():
    for call in (tdcr.forward, tdcr.forward_batch):
        rows = [-0.001] if call is tdcr.forward else [[-0.001]]
        with pytest.raises(TypeError, match="obstacles: expected an obstacle or a sequence"):
            call(trunk(), rows, obstacles=3)
        with pytest.raises(TypeError, match=r"obstacles\[1\]: expected an obstacle, got str"):
            call(trunk(), rows, obstacles=[BAR, "wall"])


def test_obstacles_that_cannot_be():
    with pytest.raises(tdcr.InvalidInput, match="radius: expected"):
        tdcr.Sphere((0, 0, 0), 0.0)
    with pytest.raises(tdcr.InvalidInput, match="center: expected"):
        tdcr.Sphere((0, np.nan, 0), 0.01)
    vertices, faces = cube()
    with pytest.raises(tdcr.InvalidInput, match="faces: expected"):
        tdcr.Mesh(vertices, faces[:-1])
    with pytest.raises(tdcr.InvalidInput):
        tdcr.Mesh(np.empty((0, 3)), np.empty((0, 3), int))


class Broken(Exception):
    pass


def broken(x):
    if x[0] > 0.002:
        raise Broken(x)
    return ball(x)


@pytest.mark.parametrize("threads", [1, 2])
def test_what_a_function_raises_surfaces(threads):
    function = tdcr.SignedDistance(broken)
    rows = np.linspace(0, -0.006, 200)[:, None]
    with pytest.raises(Broken) as caught:
        pulled(obstacles=function)
    assert not hasattr(caught.value, "__notes__")
    with pytest.raises(Broken) as caught:
        pulled(obstacles=[BAR, function])
    assert caught.value.__notes__ == ["raised by obstacles[1]"]
    with pytest.raises(Broken) as caught:
        tdcr.forward_batch(trunk(), rows, obstacles=[BAR, function], threads=threads)
    assert caught.value.__notes__ == ["raised by obstacles[1]"]
    # Later calls are as if nothing had been.
    assert pulled().ok


@pytest.mark.parametrize("value", [np.nan, np.array([1.0, 2.0])])
def test_what_a_function_may_not_return(value):
    function = tdcr.SignedDistance(lambda x: value)
    with pytest.raises(tdcr.InvalidInput, match=r"^f: expected"):
        pulled(obstacles=function)
    with pytest.raises(tdcr.InvalidInput, match=r"obstacles\[1\]"):
        pulled(obstacles=[BAR, function])
    with pytest.raises(tdcr.InvalidInput, match=r"obstacles\[1\]"):
        tdcr.forward_batch(trunk(), [[-0.001]], obstacles=[BAR, function])
    bent = tdcr.SignedDistance(ball, lambda x: [1.0, 0.0])
    with pytest.raises(tdcr.InvalidInput, match=r"^gradient: expected"):
        pulled(obstacles=bent)


def test_a_robot_that_sits_in_an_obstacle_says_so():
    shape = pulled(displacement=FREE, obstacles=tdcr.Sphere((0.012, 0, 0.1), 0.010)).require()
    assert "deep in obstacles[0]" in shape.message
    assert tdcr.clearance(shape.obstacles, shape.positions).min() > -1e-10


# --- Ctrl-C ------------------------------------------------------------------------------------

SETUP = """
    import numpy as np, tdcr
    robot = tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(0.0, 0.008)])
    base = np.eye(4)
    base[2, 3] = 0.001
    placed = tdcr.Robot(robot.backbone, robot.tendons, base=base)
    bar = tdcr.Cylinder((0.030, 0, 0.100), (0, 1, 0), 0.010)
    rows = np.linspace(0, -0.006, 1_000_000)[:, None]
    def slow(x):
        for _ in range(100_000):
            pass
        return float(x[2]) + 1.0
"""


@pytest.mark.parametrize(
    "call",
    [
        "tdcr.forward_batch(robot, rows, obstacles=bar, warm=True)",
        "tdcr.forward_batch(robot, rows, obstacles=tdcr.SignedDistance(slow))",
        "tdcr.forward(robot, [-0.006], obstacles=tdcr.SignedDistance(slow))",
        "tdcr.Gripper([placed]).close([-0.006], bar, steps=100_000)",
    ],
    ids=["rows", "rows of a function", "function", "gripper"],
)
def test_ctrl_c_ends_it(call):
    assert_interrupts(SETUP, call)
