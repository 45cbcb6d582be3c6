from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from typing import Any, Literal, Self, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

from tdcr._base.status import Status
from tdcr._forward.sensitivity import Gradient, Variation

__all__ = [
    "Backbone",
    "Bounds",
    "Box",
    "Capsule",
    "ConstantCurvatureSettings",
    "Contact",
    "Cylinder",
    "HalfSpace",
    "InverseSettings",
    "LinkageSettings",
    "Loads",
    "Mesh",
    "Obstacle",
    "PrebendSettings",
    "PsoSettings",
    "Robot",
    "RodSettings",
    "RoutingSettings",
    "Sensitivity",
    "Shape",
    "SignedDistance",
    "Sphere",
    "Tendon",
    "__version__",
    "_angle_at",
    "_angle_coefficients",
    "_angle_curve",
    "_arc_frames",
    "_arc_from_displacements",
    "_arc_jacobian",
    "_chained_shape",
    "_displacements_from_arc",
    "_fields",
    "_fit",
    "_forward_batch",
    "_inverse",
    "_inverse_batch",
    "_inverse_solutions",
    "_planar_cable_lengths",
    "_planar_clearance",
    "_planar_curve",
    "_planar_inverse_defaults",
    "_planar_newton",
    "_planar_newton_batch",
    "_planar_platforms",
    "_planar_swarm",
    "_planar_swarm_batch",
    "_planar_trunk",
    "_planar_turns",
    "_points_on_curve",
    "_prebend",
    "_pso_minimize",
    "_rotation_vector",
    "_routing",
    "_routing_batch",
    "_rust_defaults",
    "_shape",
    "_tendon",
    "_two_section_batch",
    "_two_section_nearest",
    "_two_section_solutions",
    "cartesian_path",
    "clearance",
    "forward",
    "jacobian",
    "sensitivity",
]

__version__: str

_Floats: TypeAlias = float | Sequence[float] | NDArray[np.float64]
_Array: TypeAlias = NDArray[np.float64]
_Holes: TypeAlias = tuple[tuple[int, ...], ...] | None
_Routed: TypeAlias = tuple[
    Robot, Shape, _Array, _Holes, _Array, float, float, str, int, int, Status, str
]

@final
class Backbone:
    def __new__(
        cls,
        length: _Floats,
        subsegments: int | Sequence[int],
        *,
        poisson_ratio: float = 0.35,
        rest: ArrayLike | None = None,
        youngs_modulus: float | None = None,
        diameter: _Floats | None = None,
        disk_radius: float | None = None,
    ) -> Self: ...
    @staticmethod
    def from_curve(
        points: ArrayLike,
        subsegments: int,
        *,
        poisson_ratio: float = 0.35,
        youngs_modulus: float | None = None,
        diameter: _Floats | None = None,
        disk_radius: float | None = None,
    ) -> Backbone: ...
    @property
    def length(self) -> float | tuple[float, ...]: ...
    @property
    def subsegments(self) -> int | tuple[int, ...]: ...
    @property
    def poisson_ratio(self) -> float: ...
    @property
    def rest(self) -> _Array | None: ...
    @property
    def youngs_modulus(self) -> float | None: ...
    @property
    def diameter(self) -> float | tuple[float, ...] | None: ...
    @property
    def disk_radius(self) -> float | None: ...
    @property
    def count(self) -> int: ...
    @property
    def lengths(self) -> _Array: ...
    @property
    def arc_lengths(self) -> _Array: ...
    @property
    def total_length(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Tendon:
    def __new__(
        cls,
        azimuth: _Floats,
        radius: _Floats,
        *,
        end: int | None = None,
        stiffness: float | None = None,
        name: str | None = None,
    ) -> Self: ...
    @staticmethod
    def helical(
        azimuth: float,
        radius: float,
        *,
        turns: float = 1.0,
        end: int | None = None,
        stiffness: float | None = None,
        name: str | None = None,
    ) -> Tendon: ...
    @staticmethod
    def from_holes(
        indices: Sequence[int] | NDArray[np.integer],
        count: int,
        radius: _Floats,
        *,
        azimuth: float = 0.0,
        end: int | None = None,
        stiffness: float | None = None,
        name: str | None = None,
    ) -> Tendon: ...
    @property
    def routing(self) -> str: ...
    @property
    def azimuth(self) -> float | tuple[float, ...]: ...
    @property
    def radius(self) -> float | tuple[float, ...]: ...
    @property
    def turns(self) -> float | None: ...
    @property
    def indices(self) -> tuple[int, ...] | None: ...
    @property
    def count(self) -> int | None: ...
    @property
    def end(self) -> int | None: ...
    @property
    def stiffness(self) -> float | None: ...
    @property
    def name(self) -> str | None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@disjoint_base
class Obstacle:
    @property
    def inside(self) -> bool: ...
    def distance(self, points: ArrayLike) -> _Array: ...
    def gradient(self, points: ArrayLike) -> _Array: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Sphere(Obstacle):
    def __new__(
        cls,
        center: ArrayLike,
        radius: float,
        *,
        inside: bool = False,
    ) -> Self: ...
    @property
    def center(self) -> _Array: ...
    @property
    def radius(self) -> float: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Cylinder(Obstacle):
    def __new__(
        cls,
        point: ArrayLike,
        axis: ArrayLike,
        radius: float,
        *,
        inside: bool = False,
    ) -> Self: ...
    @property
    def point(self) -> _Array: ...
    @property
    def axis(self) -> _Array: ...
    @property
    def radius(self) -> float: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class HalfSpace(Obstacle):
    def __new__(
        cls,
        point: ArrayLike,
        normal: ArrayLike,
        *,
        inside: bool = False,
    ) -> Self: ...
    @property
    def point(self) -> _Array: ...
    @property
    def normal(self) -> _Array: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Capsule(Obstacle):
    def __new__(
        cls,
        a: ArrayLike,
        b: ArrayLike,
        radius: float,
        *,
        inside: bool = False,
    ) -> Self: ...
    @property
    def a(self) -> _Array: ...
    @property
    def b(self) -> _Array: ...
    @property
    def radius(self) -> float: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Box(Obstacle):
    def __new__(
        cls,
        center: ArrayLike,
        half_extents: ArrayLike,
        rotation: ArrayLike | None = None,
        *,
        inside: bool = False,
    ) -> Self: ...
    @property
    def center(self) -> _Array: ...
    @property
    def half_extents(self) -> _Array: ...
    @property
    def rotation(self) -> _Array: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Mesh(Obstacle):
    def __new__(
        cls,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        inside: bool = False,
    ) -> Self: ...
    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        *,
        unit: Literal["m", "cm", "mm", "um", "in"],
        inside: bool = False,
    ) -> Mesh: ...
    @property
    def vertices(self) -> _Array: ...
    @property
    def faces(self) -> NDArray[np.int64]: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class SignedDistance(Obstacle):
    def __new__(
        cls,
        f: Callable[[_Array], float],
        gradient: Callable[[_Array], ArrayLike] | None = None,
        *,
        inside: bool = False,
    ) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def f(self) -> Callable[[_Array], float]: ...
    @property
    def gradient_function(self) -> Callable[[_Array], ArrayLike] | None: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

def cartesian_path(waypoints: ArrayLike, step: float, *, turn: float = 0.05) -> _Array: ...
def clearance(obstacles: Obstacle | Iterable[Obstacle], points: ArrayLike) -> _Array: ...

@final
class Robot:
    def __new__(
        cls,
        backbone: Backbone,
        tendons: Iterable[Tendon],
        *,
        base: ArrayLike | None = None,
        tool: ArrayLike | None = None,
        name: str | None = None,
    ) -> Self: ...
    @classmethod
    def load(cls, path: str | PathLike[str]) -> Robot: ...
    def save(self, path: str | PathLike[str]) -> None: ...
    @property
    def backbone(self) -> Backbone: ...
    @property
    def tendons(self) -> tuple[Tendon, ...]: ...
    @property
    def base(self) -> _Array: ...
    @property
    def tool(self) -> _Array: ...
    @property
    def name(self) -> str | None: ...
    @property
    def tendon_names(self) -> tuple[str, ...]: ...
    @property
    def rest_lengths(self) -> _Array: ...
    @property
    def rest_frames(self) -> _Array: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class RodSettings:
    def __new__(
        cls,
        *,
        subsegment: str = "arc",
        tendons: str = "sliding",
        elements: int = 1,
        axial: bool = False,
        tolerance: float = 1e-11,
        max_iterations: int = 600,
        body_radius: float = 0.0,
    ) -> Self: ...
    @property
    def subsegment(self) -> str: ...
    @property
    def tendons(self) -> str: ...
    @property
    def elements(self) -> int: ...
    @property
    def axial(self) -> bool: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def max_iterations(self) -> int: ...
    @property
    def body_radius(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class PrebendSettings:
    def __new__(
        cls,
        *,
        rod: RodSettings | None = None,
        max_bend: float = 3.141592653589793,
        smoothness: float = 0.0,
        tolerance: float = 1e-10,
        max_iterations: int = 100,
    ) -> Self: ...
    @property
    def rod(self) -> RodSettings: ...
    @property
    def max_bend(self) -> float: ...
    @property
    def smoothness(self) -> float: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def max_iterations(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class RoutingSettings:
    def __new__(
        cls,
        *,
        rod: RodSettings | None = None,
        holes: int | None = 12,
        azimuth: float = 0.0,
        max_jump: int | None = None,
        radius: tuple[float, float] | None = None,
        beam_width: int = 256,
        tolerance: float = 1e-8,
        max_iterations: int = 100,
    ) -> Self: ...
    @property
    def rod(self) -> RodSettings: ...
    @property
    def holes(self) -> int | None: ...
    @property
    def azimuth(self) -> float: ...
    @property
    def max_jump(self) -> int | None: ...
    @property
    def radius(self) -> tuple[float, float] | None: ...
    @property
    def beam_width(self) -> int: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def max_iterations(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class LinkageSettings:
    def __new__(cls, *, step_tolerance: float = 1e-9, max_iterations: int = 50) -> Self: ...
    @property
    def step_tolerance(self) -> float: ...
    @property
    def max_iterations(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class ConstantCurvatureSettings:
    def __new__(cls, *, coupling: str = "coupled", extensible: bool = False) -> Self: ...
    @property
    def coupling(self) -> str: ...
    @property
    def extensible(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class PsoSettings:
    def __new__(
        cls,
        *,
        sampling: str = "box",
        inertia: float = 0.7298437881283576,
        cognitive: float = 1.496179765663133,
        social: float = 1.496179765663133,
        topology: str = "global",
        neighbours: int = 1,
        particles: int = 30,
        bounds: str = "absorb",
        velocity_limit: float | None = 0.5,
        max_iterations: int = 1000,
        max_evaluations: int | None = None,
        target: float | None = None,
        stagnation: int | None = 100,
        improvement: float = 0.0,
        seed: int = 0,
    ) -> Self: ...
    @staticmethod
    def constriction(**changes: Any) -> PsoSettings: ...
    @staticmethod
    def spso2011(**changes: Any) -> PsoSettings: ...
    @staticmethod
    def mahfoudi(**changes: Any) -> PsoSettings: ...
    def replace(self, **changes: Any) -> Self: ...
    @property
    def sampling(self) -> str: ...
    @property
    def inertia(self) -> float: ...
    @property
    def cognitive(self) -> float: ...
    @property
    def social(self) -> float: ...
    @property
    def topology(self) -> str: ...
    @property
    def neighbours(self) -> int: ...
    @property
    def particles(self) -> int: ...
    @property
    def bounds(self) -> str: ...
    @property
    def velocity_limit(self) -> float | None: ...
    @property
    def max_iterations(self) -> int: ...
    @property
    def max_evaluations(self) -> int | None: ...
    @property
    def target(self) -> float | None: ...
    @property
    def stagnation(self) -> int | None: ...
    @property
    def improvement(self) -> float: ...
    @property
    def seed(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Loads:
    def __new__(
        cls,
        *,
        gravity: ArrayLike = (0.0, 0.0, -9.81),
        backbone_density: float = 0.0,
        disk_mass: float = 0.0,
        tip_force: ArrayLike | None = None,
        tip_moment: ArrayLike | None = None,
        disk_forces: ArrayLike | None = None,
    ) -> Self: ...
    @property
    def gravity(self) -> _Array: ...
    @property
    def backbone_density(self) -> float: ...
    @property
    def disk_mass(self) -> float: ...
    @property
    def tip_force(self) -> _Array: ...
    @property
    def tip_moment(self) -> _Array: ...
    @property
    def disk_forces(self) -> _Array | None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Contact:
    def __new__(
        cls,
        disk: int,
        kind: str,
        tendon: int | None,
        obstacle: int,
        point: ArrayLike,
        normal: ArrayLike,
        gap: float,
        force: ArrayLike,
    ) -> Self: ...
    @property
    def disk(self) -> int: ...
    @property
    def kind(self) -> str: ...
    @property
    def tendon(self) -> int | None: ...
    @property
    def obstacle(self) -> int: ...
    @property
    def point(self) -> _Array: ...
    @property
    def normal(self) -> _Array: ...
    @property
    def gap(self) -> float: ...
    @property
    def force(self) -> _Array: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...

@final
class Shape:
    @property
    def robot(self) -> Robot: ...
    @property
    def model(self) -> str: ...
    @property
    def settings(self) -> RodSettings | LinkageSettings | ConstantCurvatureSettings: ...
    @property
    def displacements(self) -> _Array: ...
    @property
    def frames(self) -> _Array: ...
    @property
    def positions(self) -> _Array: ...
    @property
    def tip(self) -> _Array: ...
    @property
    def strains(self) -> _Array: ...
    @property
    def tendon_points(self) -> list[_Array]: ...
    @property
    def tendon_lengths(self) -> _Array: ...
    @property
    def tensions(self) -> _Array: ...
    @property
    def contacts(self) -> list[Contact]: ...
    @property
    def obstacles(self) -> tuple[Obstacle, ...]: ...
    @property
    def loads(self) -> Loads | None: ...
    @property
    def energy(self) -> float: ...
    @property
    def status(self) -> Status: ...
    @property
    def ok(self) -> bool: ...
    @property
    def message(self) -> str: ...
    @property
    def residual(self) -> float: ...
    @property
    def iterations(self) -> int: ...
    @property
    def units(self) -> str: ...
    def require(self) -> Self: ...
    def save(self, path: str | PathLike[str]) -> None: ...
    @classmethod
    def load(cls, path: str | PathLike[str]) -> Shape: ...
    def plotting_layout(self) -> _Array: ...
    def plot(self, **options: Any) -> Any: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Sensitivity:
    @property
    def shape(self) -> Shape: ...
    @property
    def dependent(self) -> bool: ...
    def jacobian(self) -> _Array: ...
    def forward(
        self,
        *,
        displacements: ArrayLike | None = None,
        rest: ArrayLike | None = None,
        holes: Sequence[ArrayLike] | None = None,
        lengths: ArrayLike | None = None,
        poisson_ratio: float = 0.0,
    ) -> Variation: ...
    def adjoint(
        self, positions: ArrayLike | None = None, moments: ArrayLike | None = None
    ) -> Gradient: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Bounds:
    def __new__(
        cls,
        *,
        displacement: tuple[_Floats, _Floats] | None = None,
        tension: tuple[_Floats, _Floats] | None = None,
        curvature: _Floats | None = None,
        length: tuple[_Floats, _Floats] | None = None,
    ) -> Self: ...
    @property
    def displacement(self) -> tuple[Any, Any] | None: ...
    @property
    def tension(self) -> tuple[Any, Any] | None: ...
    @property
    def curvature(self) -> float | tuple[float, ...] | None: ...
    @property
    def length(self) -> tuple[Any, Any] | None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class InverseSettings:
    def __new__(
        cls,
        *,
        position_tolerance: float = 1e-10,
        rotation_tolerance: float = 1e-10,
        position_weight: _Floats = 1.0,
        rotation_weight: _Floats | None = None,
        starts: int = 200,
        max_iterations: int = 50,
        seed: int = 0,
        least_energy: bool = True,
        swarm: PsoSettings | None = None,
    ) -> Self: ...
    @property
    def position_tolerance(self) -> float: ...
    @property
    def rotation_tolerance(self) -> float: ...
    @property
    def position_weight(self) -> float | tuple[float, ...]: ...
    @property
    def rotation_weight(self) -> float | tuple[float, ...] | None: ...
    @property
    def starts(self) -> int: ...
    @property
    def max_iterations(self) -> int: ...
    @property
    def seed(self) -> int: ...
    @property
    def least_energy(self) -> bool: ...
    @property
    def swarm(self) -> PsoSettings | None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

def forward(
    robot: Robot,
    displacements: ArrayLike | None = None,
    *,
    tensions: ArrayLike | None = None,
    model: str = "rod",
    obstacles: Obstacle | Iterable[Obstacle] = (),
    loads: Loads | None = None,
    settings: RodSettings | LinkageSettings | ConstantCurvatureSettings | None = None,
    start: Shape | None = None,
) -> Shape: ...
def jacobian(
    robot: Robot,
    displacements: ArrayLike,
    *,
    model: str = "rod",
    settings: RodSettings | LinkageSettings | ConstantCurvatureSettings | None = None,
    start: Shape | None = None,
) -> _Array: ...
def sensitivity(shape: Shape) -> Sensitivity: ...
def _fields() -> tuple[str, ...]: ...
def _forward_batch(
    robot: Robot,
    displacements: ArrayLike,
    *,
    model: str,
    obstacles: Obstacle | Iterable[Obstacle],
    loads: Loads | None,
    settings: RodSettings | LinkageSettings | ConstantCurvatureSettings | None,
    fields: list[str],
    threads: int | None,
    progress: Callable[[int], object] | None,
    warm: bool,
) -> dict[str, Any]: ...
def _chained_shape(
    robot: Robot,
    displacements: ArrayLike,
    row: int,
    settings: RodSettings | None,
    obstacles: Obstacle | Iterable[Obstacle],
    loads: Loads | None,
) -> Shape: ...
def _inverse(
    robot: Robot,
    target: ArrayLike | None,
    positions: ArrayLike | None,
    model: str,
    start: ArrayLike | None,
    bounds: Bounds | tuple[ArrayLike, ArrayLike] | None,
    settings: RodSettings | LinkageSettings | ConstantCurvatureSettings | None,
    search: InverseSettings | None,
    method: str,
    obstacles: Iterable[Obstacle] | Obstacle,
    loads: Loads | None,
) -> tuple[
    tuple[_Array, _Array, Status, str, float, float, int, int],
    Shape | None,
]: ...
def _inverse_solutions(
    robot: Robot,
    target: ArrayLike,
    model: str,
    bounds: Bounds | tuple[ArrayLike, ArrayLike] | None,
    settings: RodSettings | LinkageSettings | ConstantCurvatureSettings | None,
    search: InverseSettings | None,
    method: str,
) -> list[tuple[tuple[_Array, _Array, Status, str, float, float, int, int], int]]: ...
def _inverse_batch(
    robot: Robot,
    targets: ArrayLike,
    *,
    model: str,
    start: ArrayLike | None,
    bounds: Bounds | tuple[ArrayLike, ArrayLike] | None,
    settings: RodSettings | LinkageSettings | ConstantCurvatureSettings | None,
    search: InverseSettings | None,
    method: str,
    threads: int | None,
    progress: Callable[[int], object] | None,
    chain: bool,
    obstacles: Iterable[Obstacle] | Obstacle,
    loads: Loads | None,
) -> dict[str, Any]: ...
def _arc_from_displacements(
    displacements: ArrayLike,
    azimuth: ArrayLike,
    radius: ArrayLike,
    length: float,
    ell: float | None,
    extensible: bool,
) -> tuple[_Array, _Array, _Array, _Array]: ...
def _displacements_from_arc(
    kappa: ArrayLike,
    phi: ArrayLike,
    ell: ArrayLike,
    azimuth: ArrayLike,
    radius: ArrayLike,
    length: float | None,
) -> _Array: ...
def _arc_frames(
    kappa: ArrayLike,
    phi: ArrayLike,
    ell: ArrayLike,
    points: int,
    base: ArrayLike | None,
) -> _Array: ...
def _arc_jacobian(
    kappa: ArrayLike,
    phi: ArrayLike,
    ell: ArrayLike,
    base: ArrayLike | None,
    tool: ArrayLike | None,
) -> _Array: ...
def _points_on_curve(robot: Robot, points: ArrayLike, subsegment: str) -> tuple[_Array, float]: ...
def _fit(
    robot: Robot,
    displacements: _Array,
    points: _Array,
    held_out: list[bool],
    parameters: list[str],
    model: str,
    settings: RodSettings | ConstantCurvatureSettings | None,
    robust: bool,
    max_iterations: int,
) -> tuple[
    Robot,
    dict[str, _Array],
    dict[str, _Array],
    _Array,
    _Array,
    int,
    tuple[str, ...],
    int,
    bool,
]: ...
def _prebend(
    robot: Robot, targets: ArrayLike, displacements: ArrayLike, settings: PrebendSettings
) -> tuple[Robot, Shape, _Array, int, Status, str]: ...
def _routing(
    robot: Robot,
    targets: ArrayLike,
    bounds: tuple[ArrayLike, ArrayLike] | None,
    start: tuple[Robot, list[float]] | None,
    settings: RoutingSettings,
) -> _Routed: ...
def _routing_batch(
    robot: Robot,
    rows: list[_Array],
    bounds: tuple[ArrayLike, ArrayLike] | None,
    settings: RoutingSettings,
    threads: int | None,
    progress: Callable[[int], object] | None,
) -> list[_Routed]: ...
def _pso_minimize(
    f: Callable[[_Array], object],
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    settings: PsoSettings,
    start: ArrayLike | None,
    vectorized: bool,
    callback: Callable[[int, float], object] | None,
    progress: Callable[[int], object] | None,
) -> tuple[_Array, float, Status, str, str, int, int, int, _Array]: ...
def _planar_trunk(lengths: ArrayLike, cable_distance: float) -> tuple[list[float], float]: ...
def _planar_turns(
    lengths: ArrayLike, cable_distance: float, cable_lengths: ArrayLike, cables: str
) -> tuple[_Array, _Array]: ...
def _planar_cable_lengths(
    lengths: ArrayLike, cable_distance: float, given: ArrayLike, cables: str
) -> _Array: ...
def _planar_platforms(
    lengths: ArrayLike, cable_distance: float, given: ArrayLike
) -> tuple[_Array, _Array]: ...
def _planar_curve(
    lengths: ArrayLike, cable_distance: float, given: ArrayLike, points: int
) -> _Array: ...
def _planar_clearance(
    lengths: ArrayLike, cable_distance: float, given: ArrayLike, obstacles: ArrayLike
) -> float: ...
def _planar_newton(
    lengths: ArrayLike,
    cable_distance: float,
    x: float,
    y: float,
    heading: float | None,
    limit: ArrayLike,
    tolerance: float,
    max_iterations: int,
    starts: int | None,
) -> dict[str, Any]: ...
def _planar_newton_batch(
    lengths: ArrayLike,
    cable_distance: float,
    points: ArrayLike,
    heading: ArrayLike | None,
    limit: ArrayLike,
    tolerance: float,
    max_iterations: int,
    starts: int | None,
    threads: int | None,
    progress: Callable[[int], object] | None,
) -> dict[str, Any]: ...
def _planar_swarm(
    lengths: ArrayLike,
    cable_distance: float,
    x: float,
    y: float,
    heading: float | None,
    limit: ArrayLike,
    keywords: dict[str, Any],
    callback: Callable[[int, float], object] | None,
) -> dict[str, Any]: ...
def _planar_swarm_batch(
    lengths: ArrayLike,
    cable_distance: float,
    points: ArrayLike,
    heading: ArrayLike | None,
    limit: ArrayLike,
    keywords: dict[str, Any],
    seed: int | Sequence[int] | NDArray[np.integer[Any]],
    threads: int | None,
    progress: Callable[[int], object] | None,
) -> dict[str, Any]: ...
def _planar_inverse_defaults() -> dict[str, Any]: ...
def _angle_coefficients(s: ArrayLike, angles: ArrayLike) -> _Array: ...
def _angle_at(s: ArrayLike, angles: ArrayLike, at: ArrayLike) -> _Array: ...
def _angle_curve(
    s: ArrayLike, angles: ArrayLike, intervals: int
) -> tuple[_Array, _Array, _Array, float]: ...
def _two_section_solutions(l1: float, l2: float, x: float, y: float, limit: float) -> _Array: ...
def _two_section_batch(
    l1: float,
    l2: float,
    targets: ArrayLike,
    limit: float,
    threads: int | None,
    progress: Callable[[int], object] | None,
) -> tuple[_Array, NDArray[np.uint64]]: ...
def _two_section_nearest(
    l1: float, l2: float, x: float, y: float, limit: float
) -> tuple[_Array, float]: ...
def _rotation_vector(frame: ArrayLike) -> tuple[float, float, float]: ...
def _rust_defaults() -> dict[str, dict[str, Any]]: ...
def _tendon(
    azimuth: _Floats,
    radius: _Floats,
    turns: float | None,
    indices: Sequence[int] | None,
    count: int | None,
    end: int | None,
    stiffness: float | None,
    name: str | None,
) -> Tendon: ...
def _shape(
    robot: Robot,
    model: str,
    settings: RodSettings | LinkageSettings | ConstantCurvatureSettings,
    displacements: ArrayLike,
    frames: ArrayLike,
    strains: ArrayLike,
    tendon_lengths: ArrayLike,
    tensions: ArrayLike,
    energy: float,
    outcome: tuple[str, str, float, int],
    around: tuple[tuple[Obstacle, ...], Loads | None, list[Contact]],
) -> Shape: ...
