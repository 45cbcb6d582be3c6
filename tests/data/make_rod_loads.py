"""Golden values of the rod under loads, in all coordinates of all disks (needs casadi).

    python make_rod_loads.py        writes rod_loads.json beside this file

Nothing here is tdcr's. Unknown are the strains of the elements and, beside them, unit quaternions
and places of all their ends, tied by equations; an arc's end is the integral of its tangent by
Gauss's rule. IPOPT minimises strain energy, stretch of elastic tendons and loads' potentials while
displacements and loads grow together; then Newton's method, on the conditions of the minimum with
what IPOPT found active, takes away the rest of the error. A moment on the tip has no potential:
IPOPT sees its slope at the step before, Newton's method itself. The Hessian on the null space of
all that is active shows a minimum (the moment counted to second order in the rotation vector).

Units inside are the length and EI; in the file m, N, rad. Frames are rows of [R | p] per disk,
strains one row per element (rotation vector and, if axial, elongation), a displacement of null is
a free tendon, the energy is the backbone's alone, contact forces are on the robot.
"""

import json
from itertools import pairwise
from math import factorial
from pathlib import Path

import casadi as ca
import numpy as np
from rod_loads_cases import EI, FORCE, LENGTH, MOMENT, cases

STEPS, TERMS = 10, 14
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


# --- the model -----------------------------------------------------------------------------------


def product(a, b):
    """Quaternions (real part first), as of Hamilton."""
    vector = a[0] * b[1:] + b[0] * a[1:] + ca.cross(a[1:], b[1:])
    return ca.vertcat(a[0] * b[0] - ca.dot(a[1:], b[1:]), vector)


def turned(q, v):
    once = ca.cross(q[1:], v)
    return v + 2 * (q[0] * once + ca.cross(q[1:], once))


def rotation(w):
    """The quaternion of a rotation vector; series have no special case at rest."""
    square = ca.sumsqr(w) / 4
    even, odd = (
        sum((-square) ** k / factorial(2 * k + first) for k in range(TERMS)) for first in (0, 1)
    )
    return ca.vertcat(even, odd * w / 2)


def tangent_sum(w, link):
    """The end of an element of length one in its own base frame."""
    if link:
        return turned(rotation(w / 2), ca.DM([0, 0, 1]))
    parts = zip(NODES, WEIGHTS, strict=True)
    return sum(u / 2 * turned(rotation(w * (1 + s) / 2), ca.DM([0, 0, 1])) for s, u in parts)


def quaternion(matrix):
    """Of a rotation matrix, from the eigenvector of Davenport's symmetric 4x4 matrix."""
    r = np.asarray(matrix, dtype=float)[:3, :3]
    skew = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    davenport = np.zeros((4, 4))
    davenport[0, 0], davenport[0, 1:], davenport[1:, 0] = np.trace(r), skew, skew
    davenport[1:, 1:] = r + r.T - np.trace(r) * np.eye(3)
    return np.linalg.eigh(davenport)[1][:, -1]


def disk_loads(case):
    """Forces on the disks (n + 1, 3) in units of EI / length^2."""
    given, n = case["loads"], case["n"]
    own = given["disk_forces"]
    force = np.zeros((n + 1, 3)) if own is None else np.array(own)
    gravity = np.array(given["gravity"])
    piece = given["backbone_density"] * np.pi / 4 * case["diameter"] ** 2 * case["length"] / n
    force[:-1] += gravity * piece / 2
    force[1:] += gravity * (piece / 2 + given["disk_mass"])
    force[-1] += given["tip_force"]
    return force / FORCE


def away(obstacle, x):
    """From the middle of an obstacle to x, whose length and direction make distance and normal."""
    if obstacle["kind"] == "sphere":
        return x - np.array(obstacle["center"]) / LENGTH
    axis = np.array(obstacle["axis"]) / np.linalg.norm(obstacle["axis"])
    off = x - np.array(obstacle["point"]) / LENGTH
    return off - axis * ca.dot(axis, off)


def local_hole(tendon, i):
    azimuth, radius = tendon["azimuth"][i], tendon["radius"] / LENGTH
    return radius * ca.DM([np.cos(azimuth), np.sin(azimuth), 0])


def tendon_length(tendon, disks):
    holes = [
        at + turned(q, local_hole(tendon, i))
        for i, (q, at) in enumerate(disks[: tendon["end"] + 1])
    ]
    return sum(ca.norm_2(b - a) for a, b in pairwise(holes))


def points(case, disks):
    """What may touch: centres, holes and mirrored holes of all disks but the base."""
    for i, (q, at) in enumerate(disks[1:], start=1):
        yield i, "center", None, at
        for k, tendon in enumerate(case["tendons"]):
            if i <= tendon["end"]:
                yield i, "hole", k, at + turned(q, local_hole(tendon, i))
                yield i, "mirror", k, at - turned(q, local_hole(tendon, i))


class Chain:
    """Unknowns of the elements, the equations that tie them, strain energy and frames of disks."""

    def __init__(self, case):
        n, m = case["n"], case["elements"]
        count, width, link = n * m, 3 + case["axial"], case["subsegment"] == "link"
        base = np.array(case["base"], dtype=float)
        first = ca.DM(quaternion(base)), ca.DM(base[:3, 3] / LENGTH)
        self.rest = np.zeros((count, width))
        if case["rest"] is not None:
            self.rest[:, :3] = np.repeat(case["rest"], m, axis=0) / m
        stiffness = count * np.array([1, 1, 1 / (1 + case["poisson_ratio"])])
        if case["axial"]:
            axial = case["youngs_modulus"] * np.pi / 4 * case["diameter"] ** 2 / FORCE
            stiffness = np.append(stiffness, axial / count)
        w = ca.SX.sym("w", width)
        end = tangent_sum(w[:3], link) / count * (1 + w[3] if case["axial"] else 1)
        step = ca.Function("step", [w], [rotation(w[:3]), end])
        unknowns, equations, self.energy = [], [], 0
        (q, at), self.disks, now, self.start = first, [first], first, []
        for e in range(count):
            strain, turn, place = (ca.SX.sym(f"x{e}", k) for k in (width, 4, 3))
            unknowns += [strain, turn, place]
            self.energy += ca.dot(stiffness, (strain - self.rest[e]) ** 2) / 2
            by, end = step(strain)
            equations += [turn - product(q, by), place - at - turned(q, end)]
            q, at = turn, place
            if (e + 1) % m == 0:
                self.disks.append((q, at))
            by, end = step(self.rest[e])
            now = product(now[0], by), now[1] + turned(now[0], end)
            self.start += [self.rest[e], *now]
        self.unknowns, self.g = ca.vertcat(*unknowns), ca.vertcat(*equations)
        self.start = np.array(ca.vertcat(*self.start)).ravel()
        self.strains = slice(0, count * (width + 7)), (count, width + 7), width


class Problem:
    """A case as unknowns x, parameters p, potential f, equations g = 0 and inequalities h <= 0."""

    def __init__(self, case):
        self.case, self.chain = case, Chain(case)
        chain, disks = self.chain, self.chain.disks
        self.taut = [k for k, d in enumerate(case["displacements"]) if d is not None]
        tendons = [case["tendons"][k] for k in self.taut]
        lengths = ca.vertcat(*(tendon_length(tendon, disks) for tendon in tendons))
        rest_lengths = ca.Function("lengths", [chain.unknowns], [lengths])(chain.start)
        self.rest_lengths = np.array(rest_lengths).ravel()
        elastic = [row for row, tendon in enumerate(tendons) if tendon["stiffness"] is not None]
        stretch = ca.SX.sym("s", len(elastic))
        self.x = ca.vertcat(chain.unknowns, stretch)
        self.start = np.append(chain.start, np.zeros(len(elastic)))
        force, spin = ca.SX.sym("f", case["n"] + 1, 3), ca.SX.sym("c", 4)
        bound, moment = ca.SX.sym("b", len(tendons)), ca.SX.sym("m", 3)
        over = lengths - bound
        self.f = chain.energy - ca.dot(spin, disks[-1][0])
        for i, (_, place) in enumerate(disks):
            self.f -= force[i, :] @ place
        for j, row in enumerate(elastic):
            give = self.rest_lengths[row] * FORCE / tendons[row]["stiffness"]
            self.f += stretch[j] ** 2 / (2 * give)
            over[row] -= stretch[j]
        self.points = [
            (o, *point) for o in range(len(case["obstacles"])) for point in points(case, disks)
        ]
        inside = [
            case["obstacles"][o]["radius"] / LENGTH - ca.norm_2(away(case["obstacles"][o], x))
            for o, *_, x in self.points
        ]
        self.h = ca.vertcat(over, *inside)
        self.p = ca.vertcat(ca.vec(force), moment, bound, spin)
        # Work of the moment along a change of the last quaternion: 2 m . vec(dq q*).
        last, change = disks[-1][0], ca.SX.sym("d", 4)
        work = 2 * ca.dot(moment, product(change, ca.vertcat(last[0], -last[1:]))[1:])
        self.slope = ca.gradient(work, change)
        self.spin = ca.Function("spin", [self.x, self.p], [self.slope])
        self.make_newton(spin)

    def make_newton(self, spin):
        """The conditions of the minimum and their derivatives, the moment followed or frozen."""
        g, h = (ca.SX.sym("l", c.numel()) for c in (self.chain.g, self.h))
        lagrangian = self.f + ca.dot(g, self.chain.g) + ca.dot(h, self.h)
        frozen = ca.gradient(lagrangian, self.x)
        follows = ca.substitute(frozen, spin, self.slope)
        conditions = ca.vertcat(self.chain.g, self.h)
        parts = [
            follows,
            conditions,
            ca.jacobian(conditions, self.x),
            ca.jacobian(follows, self.x),
            ca.jacobian(frozen, self.x),
        ]
        self.newton = ca.Function("newton", [self.x, g, h, self.p], parts)

    def parameters(self, share, spin):
        """Of a share of displacements and loads."""
        displacements = [self.case["displacements"][k] for k in self.taut]
        bound = self.rest_lengths + share * np.array(displacements, dtype=float) / LENGTH
        moment = share * np.array(self.case["loads"]["tip_moment"]) / MOMENT
        force = share * disk_loads(self.case)
        return np.concatenate([force.ravel(order="F"), moment, bound, spin])


# --- solving -------------------------------------------------------------------------------------


def solve(problem):
    """Return unknowns, multipliers of g and h, the residual and the least curvature."""
    nlp = {"x": problem.x, "p": problem.p, "f": problem.f}
    nlp["g"] = ca.vertcat(problem.chain.g, problem.h)
    options = {"print_level": 0, "sb": "yes", "tol": 1e-11, "max_iter": 500}
    solver = ca.nlpsol("s", "ipopt", nlp, {"print_time": 0, "ipopt": options})
    equations = problem.chain.g.numel()
    lower = np.append(np.zeros(equations), np.full(problem.h.numel(), -np.inf))
    x, spin = problem.start, np.zeros(4)
    for step in range(1, STEPS + 1):
        p = problem.parameters(step / STEPS, spin)
        p[-4:] = np.array(problem.spin(x, p)).ravel()
        found = solver(x0=x, p=p, lbg=lower, ubg=0)
        assert solver.stats()["success"], (problem.case["name"], step, solver.stats())
        multipliers = np.array(found["lam_g"]).ravel()
        x, *more = polish(problem, np.array(found["x"]).ravel(), multipliers, p)
        spin = p[-4:]
    return x, *more


def polish(problem, x, multipliers, p):
    """Newton's method on the conditions of the minimum, what is active as IPOPT has it."""
    split, p = problem.chain.g.numel(), p.copy()

    def look():
        p[-4:] = np.array(problem.spin(x, p)).ravel()
        return map(np.array, problem.newton(x, multipliers[:split], multipliers[split:], p))

    _, value, *_ = look()
    active = multipliers > -value.ravel()
    active[:split] = True
    multipliers = np.where(active, multipliers, 0.0)
    for _ in range(12):
        slope, value, normals, hessian, frozen = look()
        rows = normals[active]
        residual = np.append(slope.ravel(), value[active, 0])
        if np.abs(residual).max() < 1e-12:
            break
        zero = np.zeros((len(rows), len(rows)))
        change = np.linalg.solve(np.block([[hessian, rows.T], [rows, zero]]), -residual)
        x = x + change[: len(x)]
        multipliers[active] += change[len(x) :]
    pushes, pushing = multipliers[split:], active[split:]
    # Nothing is on the verge between active and not, or pulls.
    assert np.all(pushes[pushing] > 1e-3), problem.case["name"]
    assert np.all(value[split:, 0][~pushing] < -1e-6), problem.case["name"]
    free = np.linalg.svd(rows)[2][len(rows) :]
    curvature = np.linalg.eigvalsh(free @ (frozen + frozen.T) @ free.T / 2)
    return x, pushes, np.abs(residual).max(), curvature.min()


def record(case):
    """Return the case with its answer."""
    problem = Problem(case)
    x, pushes, residual, curvature = solve(problem)
    assert residual < 1e-12, (case["name"], residual)
    assert curvature > 0, case["name"]
    part, shape, width = problem.chain.strains
    disks = ca.Function("disks", [problem.x], [ca.vertcat(*d) for d in problem.chain.disks])
    frames = []
    for disk in disks(x):
        columns = [turned(disk[:4], ca.DM.eye(3)[:, k]) for k in range(3)]
        frames.append(np.array(ca.horzcat(*columns, disk[4:] * LENGTH)).tolist())
    tensions = np.zeros(len(case["tendons"]))
    tensions[problem.taut] = FORCE * pushes[: len(problem.taut)]
    contacts = []
    where = ca.Function("points", [problem.x], [ca.horzcat(*(p[-1] for p in problem.points))])
    for place, push, point in zip(
        np.array(where(x)).T, pushes[len(problem.taut) :], problem.points, strict=True
    ):
        if push > 0:
            normal = np.array(away(case["obstacles"][point[0]], ca.DM(place))).ravel()
            force = FORCE * push * normal / np.linalg.norm(normal)
            own = dict(zip(("obstacle", "disk", "kind", "tendon"), point[:4], strict=True))
            contacts.append({**own, "point": (LENGTH * place).tolist(), "force": force.tolist()})
    energy = float(ca.Function("energy", [problem.x], [problem.chain.energy])(x)) * EI / LENGTH
    answer = {
        "frames": frames,
        "strains": x[part].reshape(shape)[:, :width].tolist(),
        "tensions": tensions.tolist(),
        "contacts": contacts,
        "energy": energy,
    }
    tip = np.array(frames[-1])
    turn = np.degrees(np.arccos((np.trace(np.array(frames[0])[:, :3].T @ tip[:, :3]) - 1) / 2))
    print(
        f"{case['name']} {case['subsegment']}: turns by {turn:.0f} deg, "
        f"tensions {tensions.round(3)}, {len(contacts)} contacts, "
        f"residual {residual:.0e}, least curvature {curvature:.2g}"
    )
    return {**case, "answer": answer}


if __name__ == "__main__":
    about = " ".join(__doc__.split("\n\n")[-1].split())
    text = json.dumps({"about": about, "cases": [record(case) for case in cases()]})
    Path(__file__).with_name("rod_loads.json").write_text(text + "\n")
