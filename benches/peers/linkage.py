"""The seven-bar linkage side by side: tdcr, CasADi + IPOPT and scipy's SLSQP in one run.

One subsegment, two tendons at right angles, random pulls of a fixed seed. The peers minimise the
squared coupler angles over the nine coordinates of the upper disk's points under the six equalities
of Ashwin & Ghosal (eqs. 9-10), with exact derivatives; all start from the same bent guess, which is
not the answer. Answers are compared point by point before any time is printed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import tdcr

LENGTH, RADIUS = 0.02, 0.008
HOLES = RADIUS * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# Answers agree when no coordinate differs by more, as a share of the length.
AGREE = 1e-8

Array = NDArray[np.float64]


def bent(angle: float, towards: float) -> Array:
    """Points x0, xa, xb of a subsegment bent by an angle, with the link at half of it."""
    axis = np.array([-np.sin(towards), np.cos(towards), 0.0])
    cross = np.cross(np.eye(3), -axis)
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    tilt = np.sin(angle / 2)
    link = np.array([tilt * np.cos(towards), tilt * np.sin(towards), np.cos(angle / 2)])
    x0 = LENGTH * link
    return np.concatenate([x0, x0 + rotation @ HOLES[0], x0 + rotation @ HOLES[1]])


def starts(pulls: Array) -> Array:
    """Bend every row by the theory of tendons to third order: our start, and so the common one."""
    c, s = pulls[:, 0] / RADIUS, pulls[:, 1] / RADIUS
    bends = np.hypot(c, s)
    rows = zip(bends + bends**3 / 24, np.arctan2(s, c), strict=True)
    return np.array([bent(bend, towards) for bend, towards in rows])


def problem() -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """State the paper's problem: unknowns, pulls, objective, constraints, over the length."""
    x, pulls = ca.SX.sym("x", 9), ca.SX.sym("pulls", 2)
    x0, tips = x[:3], (x[3:6], x[6:])
    holes = HOLES / LENGTH
    objective = 0
    constraints = [ca.norm_2(x0) - 1]
    for hole, tip, pull in zip(holes, tips, ca.vertsplit(pulls), strict=True):
        arm = tip - x0
        base = ca.DM(hole)
        # arccos of the dot product has no slope at 0; atan2 does.
        angle = ca.atan2(ca.norm_2(ca.cross(base, arm)), ca.dot(base, arm))
        objective += angle**2
        constraints += [ca.norm_2(tip - base) - (1 - pull), ca.norm_2(arm) - RADIUS / LENGTH]
    arms = [tip - x0 for tip in tips]
    between = ca.atan2(ca.norm_2(ca.cross(*arms)), ca.dot(*arms))
    constraints.append(between - np.pi / 2)
    return x, pulls, objective, ca.vertcat(*constraints)


def ipopt(pulls: Array, guesses: Array) -> tuple[Array, float]:
    """Solve every row with IPOPT; points and seconds per solve."""
    x, p, f, g = problem()
    options = {"print_time": 0, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-12}}
    solver = ca.nlpsol("solver", "ipopt", {"x": x, "p": p, "f": f, "g": g}, options)
    solver(x0=guesses[0] / LENGTH, p=pulls[0] / LENGTH, lbg=0, ubg=0)
    answers, begin = [], time.perf_counter()
    for row, guess in zip(pulls, guesses, strict=True):
        answers.append(solver(x0=guess / LENGTH, p=row / LENGTH, lbg=0, ubg=0)["x"])
    seconds = (time.perf_counter() - begin) / len(pulls)
    return LENGTH * np.array([np.asarray(a).ravel() for a in answers]), seconds


def slsqp(pulls: Array, guesses: Array) -> tuple[Array, float]:
    """Solve every row with SLSQP and exact gradients; points and seconds per solve."""
    x, p, f, g = problem()
    call = {
        "f": ca.Function("f", [x, p], [f]),
        "df": ca.Function("df", [x, p], [ca.gradient(f, x)]),
        "g": ca.Function("g", [x, p], [g]),
        "dg": ca.Function("dg", [x, p], [ca.jacobian(g, x)]),
    }

    def of(name: str, row: Array) -> Callable[[Array], Array]:
        return lambda at: np.asarray(call[name](at, row))

    answers, begin = [], time.perf_counter()
    for row, guess in zip(pulls / LENGTH, guesses / LENGTH, strict=True):
        constraint = {
            "type": "eq",
            "fun": lambda at, row=row: of("g", row)(at).ravel(),
            "jac": of("dg", row),
        }
        found = minimize(
            lambda at, row=row: float(of("f", row)(at)[0, 0]),
            guess,
            jac=lambda at, row=row: of("df", row)(at).ravel(),
            constraints=[constraint],
            method="SLSQP",
            options={"ftol": 1e-16, "maxiter": 1000},
        )
        answers.append(found.x)
    seconds = (time.perf_counter() - begin) / len(pulls)
    return LENGTH * np.array(answers), seconds


def ours(pulls: Array, repeats: int) -> tuple[Array, float, float]:
    """Points, seconds per solve in a batch on one thread, seconds per single Python call."""
    tendons = [tdcr.Tendon(0.0, RADIUS), tdcr.Tendon(np.pi / 2, RADIUS)]
    robot = tdcr.Robot(tdcr.Backbone(LENGTH, 1), tendons)
    batch = tdcr.forward_batch(
        robot, -pulls, model="linkage", fields=["positions", "tendon_points"]
    )
    assert batch.ok.all()
    points = [batch.positions[:, 1], *(holes[:, 1] for holes in batch.tendon_points)]
    many = np.tile(-pulls, (max(1, 20_000 // len(pulls)), 1))
    best = np.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        tdcr.forward_batch(robot, many, model="linkage", threads=1)
        best = min(best, (time.perf_counter() - begin) / len(many))
    begin = time.perf_counter()
    for row in -pulls:
        tdcr.forward(robot, row, model="linkage")
    return np.hstack(points), best, (time.perf_counter() - begin) / len(pulls)


def check(name: str, pulls: Array, answers: Array, points: Array, error: Array) -> None:
    """Where a peer differs it must be worse: imprecise, infeasible, a higher minimum, or mirrored.

    The mirror image (the link reflected behind the base disk) has the same coupler angles.
    """
    x, p, f, g = problem()
    evaluate = ca.Function("evaluate", [x, p], [f, g])
    for row, answer, point in zip(
        *(a[error >= AGREE] / LENGTH for a in (pulls, answers, points)), strict=True
    ):
        (theirs, violation), (best, _) = evaluate(answer, row), evaluate(point, row)
        infeasible = float(ca.norm_inf(violation)) > AGREE
        mirrored = answer[2] < 0
        worse = float(theirs) > float(best) * (1 + 1e-12)
        # Tiny pulls leave the link's direction loose: the same answer to fewer digits.
        near = np.abs(answer - point).max() < 1e-5
        if not (infeasible or mirrored or worse or near):
            raise AssertionError(f"{name} found a better answer for pulls {row * LENGTH}")


def main() -> None:
    """Run the comparison and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few problems: checks, no figures")
    quick = parser.parse_args().quick
    count, slow = (20, 5) if quick else (500, 100)
    pulls = RADIUS * np.random.default_rng(7).uniform(0.02, 0.7, (count, 2))
    guesses = starts(pulls)
    points, batch, single = ours(pulls, 1 if quick else 10)
    rows = [("tdcr, batch on one thread", batch, 1.0), ("tdcr, one Python call", single, 1.0)]
    for name, solve, number in [
        ("CasADi + IPOPT", ipopt, count),
        ("scipy SLSQP", slsqp, slow),
    ]:
        answers, seconds = solve(pulls[:number], guesses[:number])
        error = np.abs(answers - points[:number]).max(axis=1) / LENGTH
        rows.append((name, seconds, float(np.mean(error < AGREE))))
        print(f"{name}: largest difference among agreeing answers {error[error < AGREE].max():.1e}")
        check(name, pulls[:number], answers, points[:number], error)
    print(f"\n{'one seven-bar linkage':28} {'time':>11} {'ratio':>9}  agrees to {AGREE:g}")
    for name, seconds, share in rows:
        print(f"{name:28} {seconds * 1e6:8.2f} us {seconds / batch:9.0f}  {share:.1%}")


if __name__ == "__main__":
    main()
