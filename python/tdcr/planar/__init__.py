"""Planar trunks: sections that bend to arcs in one plane, forward and inverse.

x lies along the undeformed trunk, y to its left. A *turn* is the whole angle of a section,
counter-clockwise. Source: C. Mahfoudi, A. Amouri and A. Zaatri, "New approach to modeling a planar
flexible continuum robot simulating elephant trunk" (2014); their theta is half a turn.

>>> from tdcr import planar
>>> trunk = planar.PlanarTrunk([0.200, 0.150], 0.060)
>>> shape = trunk.forward([(0.170, 0.230), (0.150, 0.150)])
>>> shape.positions.round(4).tolist()
[[0.1654, 0.0955], [0.2404, 0.2254]]
>>> planar.two_section_solutions(0.140, 0.120, 0.230, 0.030).round(6).tolist()
[[-0.324743, 1.682972], [0.731936, -1.831385]]
>>> trunk = planar.PlanarTrunk([0.1, 0.1, 0.1], 0.01)
>>> trunk.inverse(0.2, 0.1).status
<Status.converged: 'converged'>
>>> around = trunk.inverse(0.2, 0.1, method="pso", obstacles=[(0.1, 0.04, 0.02)])
>>> around.status, around.clearance >= 0
(<Status.converged: 'converged'>, True)
"""

from tdcr._base.public import set_home as _set_home
from tdcr.planar.angle_function import AngleFunction, Curve
from tdcr.planar.inverse import PlanarInverse, PlanarInverseBatch
from tdcr.planar.shape import PlanarShape
from tdcr.planar.trunk import PlanarTrunk
from tdcr.planar.two_section import (
    Nearest,
    TwoSectionBatch,
    two_section_batch,
    two_section_nearest,
    two_section_solutions,
)

__all__ = [
    "AngleFunction",
    "Curve",
    "Nearest",
    "PlanarInverse",
    "PlanarInverseBatch",
    "PlanarShape",
    "PlanarTrunk",
    "TwoSectionBatch",
    "two_section_batch",
    "two_section_nearest",
    "two_section_solutions",
]

_set_home(__name__, map(globals().get, __all__))
