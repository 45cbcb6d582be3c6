"""From where the tip of a planar trunk should be to turns: results and engines."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from tdcr import _core
from tdcr._base.progress import progress_callback
from tdcr._base.status import Status
from tdcr._base.value import Value
from tdcr._core import PsoSettings
from tdcr.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tdcr.planar.shape import PlanarShape, Trunk

    Array = NDArray[np.float64]

__all__ = ["PlanarInverse", "PlanarInverseBatch", "Swarm", "many", "one"]


@dataclass(frozen=True, eq=False, repr=False)
class PlanarInverse(Value):
    """Turns that put the tip of a planar trunk on a target, or as near as can be.

    Attributes
    ----------
    trunk : PlanarTrunk
    turns : ndarray, shape (m,)
        Turn of every section [rad].
    error : float
        Distance of the tip from the target [m].
    heading_error : float
        Direction of the tip against the heading asked for [rad]; 0 where none was.
    energy : float
        Bending energy for EI = 1, sum of turn**2/(2 length) [1/m].
    status : Status
        converged; unreachable, with the turns that come nearest; infeasible: on the target, but
        through an obstacle; or iteration_limit.
    method : str
    iterations, starts : int
        Newton steps of all starts, and how many were tried.
    clearance : float
        Smallest distance of the trunk's axis from the obstacles [m], negative inside; infinite
        without any.
    settings : PsoSettings or None
        Those of the swarm, with the seed of the first one; None for method "newton", as the rest.
    objective : str or None
    value : float or None
        The lowest value that the swarms saw.
    history : ndarray or None
        The lowest value so far at every start and after every move: the miss [m]; with obstacles
        and polish, the bending energy [1/m] of points brought onto the target, and more for those
        that miss it or enter an obstacle. None in a batch.
    moves, evaluations, swarms : int
        Of all swarms, restarts included.
    """

    _hashed: ClassVar[tuple[str, ...]] = ("trunk", "turns", "method")

    trunk: Trunk
    turns: Array
    error: float
    heading_error: float
    energy: float
    status: Status
    method: str
    iterations: int
    starts: int
    clearance: float = np.inf
    settings: PsoSettings | None = None
    objective: str | None = None
    value: float | None = None
    history: Array | None = None
    moves: int = 0
    evaluations: int = 0
    swarms: int = 0

    @property
    def ok(self) -> bool:
        """True if it converged."""
        return self.status is Status.converged

    @property
    def seed(self) -> int | None:
        """Seed of the first swarm; every restart takes the next one."""
        return None if self.settings is None else self.settings.seed

    @property
    def shape(self) -> PlanarShape:
        """The trunk at these turns."""
        return self.trunk.shape(self.turns)

    @property
    def message(self) -> str:
        """Reason why it did not converge; empty when it converged."""
        if self.ok:
            return ""
        off = f"the tip is {self.error:g} m from the target"
        if self.heading_error:
            off += f" and {self.heading_error:g} rad off the heading"
        if self.clearance < 0:
            off += f", the trunk reaches {-self.clearance:g} m into an obstacle"
        if self.swarms:
            off += f", after {self.swarms} swarms with {self.evaluations} evaluations"
        return off

    def require(self) -> Self:
        """Return itself, or raise `NotConverged` with its message."""
        if self.ok:
            return self
        raise NotConverged(f"{self.status}: {self.message}", self)

    def __repr__(self) -> str:
        """Tell outcome and turns."""
        turns = np.round(self.turns, 6).tolist()
        return f"<PlanarInverse: {self.status}, turns {turns} rad, error {self.error:.1e} m>"


@dataclass(frozen=True, eq=False, repr=False)
class PlanarInverseBatch(Value, Sequence[PlanarInverse]):
    """Inverses of one planar trunk, in the order of their targets; `batch[i]` is one of them.

    Attributes
    ----------
    trunk : PlanarTrunk
    points : ndarray, shape (B, 2)
        Targets [m].
    method : str
    turns : ndarray, shape (B, m)
        Turns [rad].
    status, ok, error, heading_error, energy, iterations, starts, clearance : ndarray, shape (B,)
        As in `PlanarInverse`.
    value, moves, evaluations, swarms, seed : ndarray, shape (B,)
        As there; of method "pso" only.
    settings : PsoSettings or None
    objective : str or None
    """

    _hashed: ClassVar[tuple[str, ...]] = ("trunk", "points", "method")

    trunk: Trunk
    points: Array
    method: str
    settings: PsoSettings | None
    objective: str | None
    turns: Array
    status: NDArray[Any]
    ok: NDArray[np.bool_]
    error: Array
    heading_error: Array
    energy: Array
    iterations: NDArray[np.uint64]
    starts: NDArray[np.uint64]
    clearance: Array | None = None
    value: Array | None = None
    moves: NDArray[np.uint64] | None = None
    evaluations: NDArray[np.uint64] | None = None
    swarms: NDArray[np.uint64] | None = None
    seed: NDArray[np.uint64] | None = None

    def __len__(self) -> int:
        """Return the number of targets B."""
        return len(self.points)

    def __getitem__(self, index: Any) -> Any:
        """Return the inverse of one target, or a list of them for a slice."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        i = range(len(self))[index]
        fields: dict[str, Any] = {
            name: getattr(self, name)[i].item() for name in ("error", "heading_error", "energy")
        }
        fields |= {name: int(getattr(self, name)[i]) for name in ("iterations", "starts")}
        if self.settings is not None and self.seed is not None:
            fields |= {name: getattr(self, name)[i].item() for name in ("clearance", "value")}
            counts = ("moves", "evaluations", "swarms")
            fields |= {name: int(getattr(self, name)[i]) for name in counts}
            fields["settings"] = self.settings.replace(seed=int(self.seed[i]))
            fields["objective"] = self.objective
        return PlanarInverse(
            trunk=self.trunk,
            turns=self.turns[i],
            status=self.status[i],
            method=self.method,
            **fields,
        )

    def __repr__(self) -> str:
        """Tell size and outcome."""
        converged = int(np.count_nonzero(self.ok))
        return (
            f"<PlanarInverseBatch of {len(self)} targets, {converged} converged, "
            f"method {self.method!r}>"
        )


@dataclass(frozen=True)
class Swarm:
    """The keywords that only method "pso" takes, as they came."""

    obstacles: Any = ()
    objective: str = "bends"
    settings: PsoSettings | None = None
    seed: Any = None
    polish: bool = True
    restarts: int = 10
    callback: Callable[[int, float], object] | None = None

    @property
    def among(self) -> bool:
        """Tell if there are obstacles; what has no length is for the core to refuse."""
        return not isinstance(self.obstacles, Sized) or len(self.obstacles) > 0

    def refuse(self) -> None:
        """Refuse what method "newton" has no use for."""
        given = {
            "obstacles": self.among,
            "objective": self.objective != "bends",
            "settings": self.settings is not None,
            "seed": self.seed is not None,
            "polish": self.polish is not True,
            "restarts": self.restarts != 10,
            "callback": self.callback is not None,
        }
        for name, there in given.items():
            if there:
                raise InvalidInput(
                    f'{name}: expected none with method "newton", which has no use for it; '
                    f'method "pso" has',
                    name,
                )

    def chosen(self) -> PsoSettings:
        """Return the swarm's settings, the seed apart: among obstacles a ring by default."""
        if self.settings is None:
            return PsoSettings(topology="ring") if self.among else PsoSettings()
        if not isinstance(self.settings, PsoSettings):
            raise TypeError(f"settings: expected PsoSettings, got {type(self.settings).__name__}")
        return self.settings

    def keywords(
        self, settings: PsoSettings, tolerance: float, max_iterations: int
    ) -> dict[str, Any]:
        """Return what the core wants to know."""
        if not isinstance(self.polish, bool):
            raise TypeError(f"polish: expected a bool, got {type(self.polish).__name__}")
        if self.callback is not None and not callable(self.callback):
            raise TypeError(f"callback: expected a callable, got {type(self.callback).__name__}")
        return {
            "obstacles": self.obstacles,
            "objective": self.objective,
            "settings": settings,
            "polish": self.polish,
            "tolerance": tolerance,
            "max_iterations": max_iterations,
            "restarts": self.restarts,
        }


def _check(method: str, starts: int | None, swarm: Swarm) -> None:
    """Refuse another method, and keywords of the one that is not used."""
    if method == "newton":
        swarm.refuse()
    elif method != "pso":
        raise InvalidInput(f'method: expected "newton" or "pso", got {method!r}', "method")
    elif starts is not None:
        raise InvalidInput(
            f'starts: expected none with method "pso", whose starts are particles, got {starts}',
            "starts",
        )


def one(
    trunk: Trunk,
    target: tuple[float, float, float | None],
    method: str,
    limit: ArrayLike,
    newton: tuple[float, int, int | None],
    swarm: Swarm,
) -> PlanarInverse:
    """Solve one target (x, y, heading); newton is (tolerance, max_iterations, starts)."""
    _check(method, newton[2], swarm)
    (x, y, heading), (tolerance, max_iterations, starts) = target, newton
    if method == "newton":
        answer = _core._planar_newton(
            *trunk._data, x, y, heading, limit, tolerance, max_iterations, starts
        )
        return PlanarInverse(trunk=trunk, method=method, **answer)
    settings = swarm.chosen()
    if swarm.seed is not None:
        settings = settings.replace(seed=swarm.seed)
    keywords = swarm.keywords(settings, tolerance, max_iterations)
    answer = _core._planar_swarm(*trunk._data, x, y, heading, limit, keywords, swarm.callback)
    del answer["seed"]
    return PlanarInverse(
        trunk=trunk, method=method, settings=settings, objective=swarm.objective, **answer
    )


def many(
    trunk: Trunk,
    points: ArrayLike,
    heading: ArrayLike | None,
    method: str,
    limit: ArrayLike,
    newton: tuple[float, int, int | None],
    swarm: Swarm,
    threads: int | None,
    progress: bool | Callable[[int], object],
) -> PlanarInverseBatch:
    """Solve many targets."""
    _check(method, newton[2], swarm)
    settings, objective = None, None
    goals = (*trunk._data, points, heading, limit)
    total = len(points) if isinstance(points, Sized) else None
    with progress_callback(progress, "inverse_batch", total) as tell:
        if method == "newton":
            table = _core._planar_newton_batch(*goals, *newton, threads, tell)
        else:
            settings, objective = swarm.chosen(), swarm.objective
            keywords = swarm.keywords(settings, *newton[:2])
            seed = settings.seed if swarm.seed is None else swarm.seed
            table = _core._planar_swarm_batch(*goals, keywords, seed, threads, tell)
    fixed = np.array(points, dtype=np.float64)
    fixed.flags.writeable = False
    return PlanarInverseBatch(trunk, fixed, method, settings, objective, **table)
