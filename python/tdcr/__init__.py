"""Tendon-driven continuum robots: from how far each tendon is pulled to the shape, and back.

SI units everywhere (m, rad, N, Pa). The base frame has z along the backbone towards the tip and x
towards azimuth 0; azimuths count counter-clockwise about +z. Displacements are changes of a
tendon's length inside the robot: negative pulls.

>>> import tdcr
>>> robot = tdcr.Robot(tdcr.Backbone(0.2, 20), [tdcr.Tendon(0.0, 0.01)])
>>> shape = tdcr.forward(robot, [-0.01])
>>> shape.status
<Status.converged: 'converged'>
>>> shape.positions[-1].round(4).tolist()
[0.0918, 0.0, 0.1684]
"""

from __future__ import annotations

from tdcr import constant_curvature, design, planar, pso
from tdcr._base.public import set_home as _set_home
from tdcr._base.status import Status
from tdcr._core import (
    Backbone,
    Bounds,
    Box,
    Capsule,
    ConstantCurvatureSettings,
    Contact,
    Cylinder,
    HalfSpace,
    InverseSettings,
    LinkageSettings,
    Loads,
    Mesh,
    Obstacle,
    PrebendSettings,
    PsoSettings,
    Robot,
    RodSettings,
    RoutingSettings,
    Sensitivity,
    Shape,
    SignedDistance,
    Sphere,
    Tendon,
    cartesian_path,
    clearance,
    forward,
    jacobian,
    sensitivity,
)
from tdcr._core import __version__ as __version__
from tdcr._forward.batch import ShapeBatch, forward_batch
from tdcr._forward.sensitivity import Gradient, Variation
from tdcr._forward.sweep import Sweep, sweep
from tdcr._gripper.grasp import Grasp
from tdcr._gripper.gripper import Gripper
from tdcr._inverse.solve import (
    Inverse,
    InverseBatch,
    inverse,
    inverse_batch,
    inverse_solutions,
    track,
)
from tdcr._workspace.manipulability import Manipulability, manipulability
from tdcr._workspace.results import Reach, Workspace
from tdcr._workspace.sample import workspace
from tdcr._workspace.voxels import Volume, VoxelMap
from tdcr.design.measurements import Measurements, read_measurements
from tdcr.errors import InvalidInput, NotConverged, TdcrError

__all__ = [
    "Backbone",
    "Bounds",
    "Box",
    "Capsule",
    "ConstantCurvatureSettings",
    "Contact",
    "Cylinder",
    "Gradient",
    "Grasp",
    "Gripper",
    "HalfSpace",
    "InvalidInput",
    "Inverse",
    "InverseBatch",
    "InverseSettings",
    "LinkageSettings",
    "Loads",
    "Manipulability",
    "Measurements",
    "Mesh",
    "NotConverged",
    "Obstacle",
    "PrebendSettings",
    "PsoSettings",
    "Reach",
    "Robot",
    "RodSettings",
    "RoutingSettings",
    "Sensitivity",
    "Shape",
    "ShapeBatch",
    "SignedDistance",
    "Sphere",
    "Status",
    "Sweep",
    "TdcrError",
    "Tendon",
    "Variation",
    "Volume",
    "VoxelMap",
    "Workspace",
    "cartesian_path",
    "clearance",
    "constant_curvature",
    "design",
    "forward",
    "forward_batch",
    "inverse",
    "inverse_batch",
    "inverse_solutions",
    "jacobian",
    "manipulability",
    "planar",
    "pso",
    "read_measurements",
    "sensitivity",
    "sweep",
    "track",
    "workspace",
]

_set_home(__name__, map(globals().get, __all__))
