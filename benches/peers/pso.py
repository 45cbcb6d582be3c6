"""Particle swarms side by side: tdcr, pyswarms and scipy's differential evolution in one run.

The first rows are what a user of tdcr calls: `PlanarTrunk.inverse(x, y, method="pso")`, objective
and polish in Rust, called from Python; its answers are held against the same numpy function, in its
time.
Ratios are against the first row.

The inverse of Mahfoudi, Amouri & Zaatri's planar trunk: sections of 140 and 120 mm, the path
x = 260 - 15 t, y = 15 t mm, t = 0 ... 8; unknown are the two turns, within a full turn either way;
the cost is the distance of the tip to the point. Everybody gets the same vectorised numpy function
and is stopped in it as soon as a cost is 1e-9 m or less, so that times are times to the target.
t = 0 is the end of the straight trunk, where the distance is a narrow bent valley; times are those
of the other points.
"""

from __future__ import annotations

import argparse
import contextlib
import tempfile
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from tdcr import planar, pso

LENGTHS = (0.140, 0.120)
LOWER, UPPER = np.full(2, -2 * np.pi), np.full(2, 2 * np.pi)
TARGET = 1e-9
PARTICLES, ITERATIONS = 30, 1000
CHI = pso.PsoSettings().inertia

TRUNK = planar.PlanarTrunk(LENGTHS, 0.01)

Array = NDArray[np.float64]
Cost = Callable[[Array], Array]
Run = Callable[[Cost, tuple[float, float], int], None]


class Reached(Exception):
    """The target is reached."""


def tips(turns: Array) -> tuple[Array, Array]:
    """Tips of the trunk for turns (S, 2): each section's chord at half its turn."""
    half = 0.5 * turns
    # sinc(x) is sin(pi x) / (pi x), also at 0.
    chords = LENGTHS * np.sinc(half / np.pi)
    angles = half + np.stack([np.zeros(len(turns)), turns[:, 0]], axis=1)
    return (chords * np.cos(angles)).sum(axis=1), (chords * np.sin(angles)).sum(axis=1)


def distance(x: float, y: float) -> Cost:
    """Return the cost of reaching a point."""

    def cost(turns: Array) -> Array:
        tip_x, tip_y = tips(turns)
        return np.hypot(tip_x - x, tip_y - y)

    return cost


def stopped(cost: Cost) -> Cost:
    """Return the cost that stops whoever reaches the target."""

    def watched(turns: Array) -> Array:
        costs = cost(turns)
        if costs.min() <= TARGET:
            raise Reached
        return costs

    return watched


def built_in(**options: object) -> Run:
    """Run tdcr's own inverse of the trunk; the cost only checks its answer."""

    def run(cost: Cost, point: tuple[float, float], seed: int) -> None:
        cost(TRUNK.inverse(*point, method="pso", seed=seed, **options).turns[None])

    return run


def by_tdcr(settings: pso.PsoSettings) -> Run:
    """Run tdcr's swarm over the vectorised function."""

    def run(cost: Cost, _: tuple[float, float], seed: int) -> None:
        settings_now = settings.replace(seed=seed)
        pso.minimize(cost, LOWER, UPPER, settings=settings_now, vectorized=True)

    return run


def by_pyswarms(kind: type, options: dict[str, float], count: int) -> Run:
    """Run one of the swarms of pyswarms."""

    def run(cost: Cost, _: tuple[float, float], seed: int) -> None:
        np.random.seed(seed)  # noqa: NPY002 (what pyswarms draws from)
        swarm = kind(n_particles=count, dimensions=2, options=options, bounds=(LOWER, UPPER))
        swarm.optimize(cost, iters=ITERATIONS, verbose=False)

    return run


def by_evolution(**options: object) -> Run:
    """Run scipy's differential evolution, which wants points in columns."""

    def run(cost: Cost, _: tuple[float, float], seed: int) -> None:
        bounds = list(zip(LOWER, UPPER, strict=True))

        def columns(turns: Array) -> Array | float:
            # Its polish asks for one point.
            return cost(turns.T) if turns.ndim == 2 else float(cost(turns[None])[0])

        differential_evolution(
            columns, bounds, rng=seed, vectorized=True, updating="deferred", **options
        )

    return run


def contenders() -> list[tuple[str, Run]]:
    """Everybody by name; equal budget means 30 points and 1000 moves, without an earlier end."""
    # Its import begins a log file in the working directory.
    import pyswarms

    equal = {"stagnation": None, "particles": PARTICLES, "max_iterations": ITERATIONS}
    constriction = {"c1": 2.05 * CHI, "c2": 2.05 * CHI, "w": CHI}
    # The numbers of its documentation; it has no defaults for them.
    documented = {"c1": 0.5, "c2": 0.3, "w": 0.9}
    # Ring with one neighbour on either side: the three nearest, itself among them.
    globally, ring = pyswarms.single.GlobalBestPSO, pyswarms.single.LocalBestPSO
    rough = {"polish": False, "tolerance": TARGET, "restarts": 0}
    return [
        ("tdcr inverse, defaults", built_in()),
        ("tdcr inverse, ring", built_in(settings=pso.PsoSettings(topology="ring"))),
        ("tdcr inverse, points", built_in(objective="points")),
        ("tdcr inverse, no polish", built_in(**rough)),
        ("tdcr, global", by_tdcr(pso.PsoSettings(**equal))),
        ("tdcr, ring", by_tdcr(pso.PsoSettings(topology="ring", **equal))),
        ("tdcr, spso2011", by_tdcr(pso.PsoSettings.spso2011(**equal))),
        ("tdcr, mahfoudi", by_tdcr(pso.PsoSettings.mahfoudi(**equal))),
        ("tdcr, defaults", by_tdcr(pso.PsoSettings())),
        ("pyswarms global, equal", by_pyswarms(globally, constriction, PARTICLES)),
        ("pyswarms ring, equal", by_pyswarms(ring, constriction | {"k": 3, "p": 2}, PARTICLES)),
        ("pyswarms global, documented", by_pyswarms(globally, documented, 10)),
        ("pyswarms ring, documented", by_pyswarms(ring, documented | {"k": 3, "p": 2}, 10)),
        (
            "scipy evolution, equal",
            by_evolution(popsize=PARTICLES // 2, maxiter=ITERATIONS, tol=0, atol=0, polish=False),
        ),
        ("scipy evolution, defaults", by_evolution()),
    ]


def measure(run: Run, t: int, seeds: int) -> tuple[int, float]:
    """Return how many seeds reach a point of the path, and the mean seconds of a run.

    Seconds of the processor, which a busy machine does not stretch: everybody runs on one thread.
    """
    point = (0.260 - 0.015 * t, 0.015 * t)
    cost = stopped(distance(*point))
    hits, begin = 0, time.process_time()
    for seed in range(seeds):
        try:
            run(cost, point, seed)
        except Reached:
            hits += 1
    return hits, (time.process_time() - begin) / seeds


def main() -> None:
    """Run the comparison and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few seeds: checks, no figures")
    seeds = 3 if parser.parse_args().quick else 100
    # Solutions of the path's point t = 4, known to six digits.
    known = np.array([[-0.218664, 2.214672], [1.149471, -2.567076]])
    assert distance(0.200, 0.060)(known).max() < 1e-6
    points = (0, 2, 4, 6, 8)
    print(f"{seeds} seeds a point; % of runs to {TARGET:g} m at t = 0, 2, 4, 6, 8\n")
    print(
        f"{'two sections, two turns':28} {'success [%]':>25} {'time, t = 2...8':>16} {'ratio':>6}"
    )
    first = None
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        for name, run in contenders():
            rows = [measure(run, t, seeds) for t in points]
            mean = float(np.mean([seconds for _, seconds in rows[1:]]))
            first = first or mean
            if name == "tdcr, global":
                assert min(hits for hits, _ in rows[1:]) >= 0.95 * seeds
            if name == "tdcr inverse, defaults":
                assert all(hits == seeds for hits, _ in rows)
            success = "".join(f"{100 * hits / seeds:5.0f}" for hits, _ in rows)
            print(f"{name:28} {success} {mean * 1e3:13.3f} ms {mean / first:6.0f}", flush=True)


if __name__ == "__main__":
    main()
