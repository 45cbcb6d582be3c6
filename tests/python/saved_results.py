"""A result of every kind, by name, for the tests of files."""

import math

import numpy as np

import tdcr

AZIMUTHS = (0.0, 2.1, 4.2)


def arm(**spine):
    tendons = [
        tdcr.Tendon.helical(AZIMUTHS[0], 0.01, turns=0.3, name="wound"),
        tdcr.Tendon(AZIMUTHS[1], 0.01, end=5, stiffness=1e4 if spine else None),
        tdcr.Tendon.from_holes([1] * 9, 3, 0.01, azimuth=0.1),
    ]
    rest = np.random.default_rng(3).normal(size=(8, 3)) * 0.03
    base = np.eye(4)
    base[:3, 3] = 0.1, -1 / 3, 0.2
    backbone = tdcr.Backbone([0.1, 0.09], [4, 4], rest=rest, **spine)
    return tdcr.Robot(backbone, tendons, base=base, name="arm é")


def steel():
    return arm(youngs_modulus=2e11, diameter=0.001)


def touching():
    """Shape among every kind of obstacle, under loads, with contacts."""
    robot = tdcr.Robot(
        tdcr.Backbone(0.2, 10, youngs_modulus=6e10, diameter=0.001), [tdcr.Tendon(0.0, 0.01)]
    )
    corner = [[0.4, 0, 0], [0.5, 0, 0], [0.4, 0.1, 0], [0.4, 0, 0.1]]
    obstacles = (
        tdcr.Cylinder([0.035, 0, 0.1], [0, 1, 0], 0.02),
        tdcr.Sphere([0, 0, 0], 1.0, inside=True),
        tdcr.Box([0.5, 0.5, 0.5], [0.1, 0.1, 0.1], np.eye(3)),
        tdcr.Capsule([1, 0, 0], [1, 1, 0], 0.1),
        tdcr.HalfSpace([0, 0, -0.5], [0, 0, 1]),
        tdcr.Mesh(corner, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    )
    shape = tdcr.forward(
        robot, [-0.012], obstacles=obstacles, loads=tdcr.Loads(tip_force=[0, 0, -0.01])
    )
    assert shape.contacts
    return shape


def infeasible():
    shape = tdcr.forward(straight(), [-0.01, 0, 0])
    assert shape.message
    return shape


SHAPES = {
    "rod": lambda: tdcr.forward(arm(), [-0.01, math.inf, -1 / 300]),
    "steel": lambda: tdcr.forward(
        steel(), [-0.01, math.inf, math.inf], settings=tdcr.RodSettings(elements=2, axial=True)
    ),
    "linkage": lambda: tdcr.forward(straight(), [-0.01, math.inf, math.inf], model="linkage"),
    "curvature": lambda: tdcr.forward(
        tdcr.Robot(tdcr.Backbone(0.1, 4), [tdcr.Tendon(a, 0.01) for a in AZIMUTHS]),
        [-0.01, 0.001, 0.002],
        model="constant_curvature",
        settings=tdcr.ConstantCurvatureSettings(extensible=True),
    ),
    "touching": touching,
    "infeasible": infeasible,
    "bare": lambda: tdcr.forward(tdcr.Robot(tdcr.Backbone(0.1, 2), []), []),
}


def straight():
    return tdcr.Robot(tdcr.Backbone(0.2, 8), [tdcr.Tendon(a, 0.01) for a in AZIMUTHS])


def batch(**options):
    rows = np.random.default_rng(0).uniform(-0.01, 0, (5, 1)) * [1, 0, 0] + [0, math.inf, math.inf]
    return tdcr.forward_batch(straight(), rows, fields=tdcr._forward.batch.FIELDS, **options)


def touching_batch():
    shape = touching()
    return tdcr.forward_batch(
        shape.robot,
        [[-0.01], [-0.012]],
        obstacles=shape.obstacles,
        loads=shape.loads,
        fields=("contacts", "tendon_points"),
    )


def workspace(**options):
    return tdcr.workspace(
        straight(), [(-0.01, 0), (math.inf, math.inf), (-0.01, 0)], 9, sampling="random", **options
    )


def inverse(target, **options):
    return tdcr.inverse(straight(), target, model="constant_curvature", **options)


def finger():
    return tdcr.Robot(tdcr.Backbone(0.12, 6), [tdcr.Tendon(0.0, 0.008), tdcr.Tendon(2.0, 0.008)])


def measured(robot=None, count=12):
    """Displacements and tips of a robot with other gains than the given one."""
    rows = np.random.default_rng(2).uniform(-0.004, 0.0, (count, 2))
    tips = tdcr.forward_batch(finger() if robot is None else robot, rows * [1.1, 0.9]).tip
    return rows, tips[:, :3, 3].copy()


def fit(parameters=("gain",), **options):
    rows, tips = measured()
    tips[3] = np.nan
    return tdcr.design.fit(finger(), tips, parameters, displacements=rows, **options)


def wanted():
    return tdcr.forward(finger(), [-0.004, 0.002]).positions[1:]


def prebend(**options):
    return tdcr.design.prebend(finger(), wanted(), [-0.002, np.inf], **options)


def routing(**options):
    settings = tdcr.RoutingSettings(beam_width=8, **options)
    return tdcr.design.routing(
        finger(), wanted(), bounds=(-0.006, [0.01, np.inf]), settings=settings
    )


def grasp(**options):
    finger = tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(0.0, 0.008)], name="claw")
    gripper = tdcr.Gripper.around(finger, 3, 0.06)
    ball, wall = tdcr.Sphere((0, 0, 0.14), 0.04), tdcr.HalfSpace((0, 0, -0.1), (0, 0, 1))
    return gripper.close([-0.003], [ball, wall], steps=4, **options)


DESIGNS = {
    "prebend": prebend,
    "prebend among obstacles": lambda: prebend(obstacles=tdcr.Sphere((0.2, 0, 0), 0.05)),
    "routing": routing,
    "routing of any azimuth": lambda: routing(holes=None),
    "fit": fit,
    "fit of all": lambda: fit(("offset", "radius", "azimuth", "rest", "base"), seed=2**70),
    "fit without validation": lambda: fit(validation=0.0),
    "grasp": grasp,
    "grasp of a finger": lambda: tdcr.Grasp(
        grasp().shares[-1:], ((tdcr.forward(straight(), [0, 0, 0]),),)
    ),
}

RESULTS = {
    **SHAPES,
    **DESIGNS,
    "batch": batch,
    "warm batch": lambda: batch(warm=True),
    "linkage batch": lambda: batch(model="linkage"),
    "touching batch": touching_batch,
    "no rows": lambda: tdcr.forward_batch(straight(), np.empty((0, 3)), fields=("tip", "strains")),
    "no rows of all": lambda: tdcr.forward_batch(
        straight(), np.empty((0, 3)), fields=tdcr._forward.batch.FIELDS
    ),
    "no tendons": lambda: tdcr.forward_batch(
        tdcr.Robot(tdcr.Backbone(0.1, 1), []), np.empty((3, 0)), fields=tdcr._forward.batch.FIELDS
    ),
    "workspace": workspace,
    "workspace with fields": lambda: workspace(fields=("frames", "strains", "energy"), seed=4),
    "workspace of a great seed": lambda: workspace(seed=2**70),
    "workspace without tendons": lambda: tdcr.workspace(
        tdcr.Robot(tdcr.Backbone(0.1, 1), []),
        np.empty((0, 2)),
        9,
        sampling="grid",
        fields=("tensions", "energy"),
    ),
    "inverse": lambda: tdcr.inverse(straight(), [0.05, 0.02, 0.17]),
    "unreachable": lambda: inverse([0.0, 0.2, 0.3], search=tdcr.InverseSettings(starts=3)),
    "frame": lambda: inverse(
        tdcr.forward(straight(), [-0.01, 0.005, 0.005], model="constant_curvature").tip,
        bounds=tdcr.Bounds(displacement=(-0.02, [0.02, 0.03, math.inf])),
        search=tdcr.InverseSettings(rotation_weight=(1, 1, 0), swarm=tdcr.PsoSettings(seed=3)),
        method="pso",
    ),
    "track": lambda: tdcr.track(straight(), [[0.05, 0.02, 0.17], [0.05, 0.01, 0.17], [1, 1, 1]]),
    "no targets": lambda: tdcr.inverse_batch(straight(), np.empty((0, 3))),
    "no frames": lambda: tdcr.inverse_batch(straight(), np.empty((0, 4, 4))),
    "frames": lambda: tdcr.inverse_batch(
        straight(), [np.eye(4)], model="constant_curvature", search=tdcr.InverseSettings(starts=2)
    ),
}
