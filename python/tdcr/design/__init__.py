"""Design: the robot that takes a wanted shape. Mathematics: `docs/design.md`.

>>> import numpy as np, tdcr
>>> from tdcr import design
>>> robot = tdcr.Robot(tdcr.Backbone(0.18, 9), [tdcr.Tendon(np.pi, 0.008)])
>>> turn = np.linspace(0, 2, 50)[:, None]
>>> circle = 0.1 * np.hstack([1 - np.cos(turn), 0 * turn, np.sin(turn)])
>>> finger = design.prebend(robot, design.on_curve(robot, circle), [-0.005])
>>> finger.status, finger.robot.backbone.rest[4].round(4).tolist()
(<Status.converged: 'converged'>, [0.0, 0.2736, 0.0])
"""

from tdcr._base.public import set_home as _set_home
from tdcr._core import PrebendSettings, RoutingSettings
from tdcr.design import codecs as codecs
from tdcr.design.fitting import Fit, fit
from tdcr.design.prebending import Prebend, prebend
from tdcr.design.targets import on_curve
from tdcr.design.tendon_routing import Routing, routing, routing_batch

__all__ = [
    "Fit",
    "Prebend",
    "PrebendSettings",
    "Routing",
    "RoutingSettings",
    "fit",
    "on_curve",
    "prebend",
    "routing",
    "routing_batch",
]

_set_home(__name__, map(globals().get, __all__))
