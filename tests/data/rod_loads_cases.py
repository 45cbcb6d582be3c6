"""The cases of rod_loads.json: robots of one wire, their displacements, loads and obstacles."""

import numpy as np

LENGTH, MODULUS, DIAMETER, DENSITY = 0.2, 60e9, 1e-3, 6450.0
EI = MODULUS * np.pi * DIAMETER**4 / 64
FORCE, MOMENT = EI / LENGTH**2, EI / LENGTH
RADIUS = 0.008


def straight(azimuth, n, end=None, stiffness=None, radius=RADIUS):
    return helical(azimuth, n, 0.0, end, stiffness, radius)


def helical(azimuth, n, turns, end=None, stiffness=None, radius=RADIUS):
    end = n if end is None else end
    azimuths = azimuth + 2 * np.pi * turns * np.arange(end + 1) / end
    return {"azimuth": azimuths.tolist(), "radius": radius, "end": end, "stiffness": stiffness}


def loads(**given):
    """Return loads; forces and moments are given in units of EI."""
    tip = FORCE * np.array(given.pop("tip_force", (0, 0, 0)))
    moment = MOMENT * np.array(given.pop("tip_moment", (0, 0, 0)))
    disks = given.pop("disk_forces", None)
    return {
        "gravity": [0.0, 0.0, -9.81],
        "backbone_density": 0.0,
        "disk_mass": 0.0,
        "tip_force": tip.tolist(),
        "tip_moment": moment.tolist(),
        "disk_forces": None if disks is None else (FORCE * np.array(disks)).tolist(),
        **given,
    }


def case(name, n, tendons, displacements, load, *, link=False, **more):
    return {
        "name": name,
        "subsegment": "link" if link else "arc",
        "elements": 1,
        "axial": False,
        "n": n,
        "length": LENGTH,
        "youngs_modulus": MODULUS,
        "diameter": DIAMETER,
        "poisson_ratio": 0.35,
        "rest": None,
        "base": np.eye(4).tolist(),
        "tendons": tendons,
        "displacements": displacements,
        "loads": load,
        "obstacles": [],
        **more,
    }


# The base's z along the world's x, and askew.
LEVEL = [[0, 0, 1, 0.05], [0, 1, 0, -0.02], [-1, 0, 0, 0.3], [0, 0, 0, 1]]
ASKEW = [[0.36, 0.48, -0.8, 0], [-0.8, 0.6, 0, 0.1], [0.48, 0.64, 0.6, 0], [0, 0, 0, 1]]


def cases():
    planar = loads(tip_force=(-1.5, 0, -0.5))
    tip = loads(tip_force=(1, 2.5, -0.5))
    weight = loads(backbone_density=DENSITY, disk_mass=5e-4)
    both = loads(backbone_density=DENSITY, disk_mass=3e-4, tip_force=(0.5, -1.5, 1))
    disks = [[0.1 * i, 0.3, -0.05 * i * i] for i in range(6)]
    bend = [[0.05 * i, 0.2 - 0.05 * i, 0.03] for i in range(5)]
    wave = [[0.1 * np.cos(i), 0.15 * np.sin(0.7 * i), 0.02] for i in range(8)]
    pair = [straight(0.3, 8), straight(2.6, 8)]
    trio = [straight(0.2 + 2 * np.pi * k / 3, 7, stiffness=400.0 + 50 * k) for k in range(3)]
    for link in (False, True):
        yield case("planar tip force", 6, [straight(0.0, 6)], [-0.006], planar, link=link)
        yield case("spatial tip force", 8, pair, [-0.006, -0.002], tip, link=link)
        yield case(
            "helical, weight", 10, [helical(0.4, 10, 0.5)], [-0.006], weight, link=link, base=LEVEL
        )
        yield case(
            "moment in the plane, force, straight",
            9,
            [straight(np.pi, 9)],
            [-0.004],
            loads(tip_force=(0.8, 0, 0), tip_moment=(0, 1.2, 0)),
            link=link,
        )
    yield case(
        "three helical, one free, weight and force",
        12,
        [helical(0.0, 12, 0.4), helical(2.1, 12, 0.4), helical(4.2, 12, 0.4, end=7)],
        [-0.005, None, -0.003],
        both,
        base=ASKEW,
    )
    yield case("elastic tendons, all held", 7, trio, [-0.004, 0.001, 0.0], tip)
    yield case(
        "disk forces, two ends",
        5,
        [straight(0.5, 5, end=3), straight(1.9, 5)],
        [-0.006, -0.006],
        loads(disk_forces=disks),
        rest=bend,
    )
    yield case(
        "disk forces, pre-bent",
        8,
        [helical(1.0, 8, -0.3)],
        [-0.005],
        loads(disk_forces=[[0, 0, 0], *[[0.2, -0.1, 0.1]] * 8], tip_force=(0, -1, 0)),
        rest=wave,
        link=True,
    )
    yield case(
        "moment in space",
        8,
        [helical(0.2, 8, 0.4)],
        [-0.004],
        loads(tip_force=(0.8, 0, -0.4), tip_moment=(0.4, -0.3, 0.5)),
    )
    yield case("two elements", 4, [helical(0.0, 4, 0.25)], [-0.009], tip, elements=2)
    yield case("elongation", 6, [straight(0.0, 6)], [-0.006], tip, axial=True)
    yield case(
        "one goes slack",
        3,
        [straight(0.0, 3), straight(np.pi / 2, 3)],
        [-0.003, 0.0],
        loads(tip_force=(0, 2, 0)),
    )
    ball = {"kind": "sphere", "center": [0.055, 0.006, 0.15], "radius": 0.025}
    yield case(
        "ball off the plane, tip force",
        9,
        [straight(0.0, 9)],
        [-0.009],
        loads(tip_force=(1, 0.2, -0.3)),
        obstacles=[ball],
    )
    bar = {"kind": "cylinder", "point": [0.045, 0, 0.13], "axis": [0, 1, 0], "radius": 0.02}
    yield case(
        "bar, weight",
        9,
        [straight(0.0, 9)],
        [-0.009],
        loads(backbone_density=DENSITY, disk_mass=2e-3, gravity=[3.0, 2.0, -9.0]),
        obstacles=[bar],
        link=True,
    )
    askew = {"kind": "cylinder", "point": [0.05, 0.02, 0.13], "axis": [0.3, 1, 0.2], "radius": 0.02}
    yield case(
        "bar askew, two elastic helices, tip force",
        12,
        [helical(0.3, 12, 0.3, stiffness=600.0), helical(1.1, 12, -0.2, stiffness=600.0)],
        [-0.008, -0.006],
        loads(tip_force=(0.5, 0.8, 0.0)),
        obstacles=[askew],
    )
