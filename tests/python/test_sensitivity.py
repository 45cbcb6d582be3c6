"""Derivatives of the rod from Python: against differences of `forward`, and against each other."""

import inspect
import pickle

import numpy as np
import pytest

import tdcr

FREE = np.inf
# Differences of converged solves are to be good to 1e-6.
TIGHT = {"tolerance": 1e-13}
ALL = [
    tdcr.RodSettings(
        subsegment=subsegment, tendons=tendons, elements=elements, axial=axial, **TIGHT
    )
    for subsegment in ("arc", "link")
    for tendons in ("sliding", "proportional")
    for elements, axial in ((1, False), (2, True))
]
TOOL = np.array([[0.0, -1.0, 0.0, 0.01], [1.0, 0.0, 0.0, -0.02], [0, 0, 1, 0.03], [0, 0, 0, 1]])
PULLS = np.array([-2e-3, -1e-3, FREE])


class Recipe:
    """What a robot is made of, as arrays that can be changed."""

    def __init__(self, seed=0, n=6):
        draw = np.random.default_rng(seed)
        self.lengths = draw.uniform(0.015, 0.025, n)
        self.rest = draw.uniform(-0.15, 0.15, (n, 3)) * [1, 1, 0.5]
        self.poisson_ratio = 0.3
        self.holes = []
        for k, end in enumerate((n, n, n - 1)):
            azimuth = 2.1 * k + np.linspace(0, draw.uniform(-0.3, 0.3) * n, end + 1)
            radius = draw.uniform(6e-3, 8e-3, end + 1)
            x, y = radius * np.cos(azimuth), radius * np.sin(azimuth)
            self.holes.append(np.column_stack([x, y, 0 * x]))

    def moved(self, change, step):
        out = Recipe.__new__(Recipe)
        out.lengths = self.lengths + step * change["lengths"]
        out.rest = self.rest + step * change["rest"]
        out.poisson_ratio = self.poisson_ratio + step * change["poisson_ratio"]
        pairs = zip(self.holes, change["holes"], strict=True)
        out.holes = [holes + step * d for holes, d in pairs]
        return out

    def robot(self, axial):
        n = len(self.lengths)
        known = {"youngs_modulus": 60e9, "diameter": 1.2e-3} if axial else {}
        backbone = tdcr.Backbone(
            self.lengths.tolist(),
            [1] * n,
            rest=self.rest,
            poisson_ratio=self.poisson_ratio,
            **known,
        )
        tendons = [
            tdcr.Tendon(
                np.arctan2(holes[:, 1], holes[:, 0]),
                np.hypot(holes[:, 0], holes[:, 1]),
                end=len(holes) - 1,
                stiffness=2e4 if axial else None,
            )
            for holes in self.holes
        ]
        return tdcr.Robot(backbone, tendons, tool=TOOL)


def random_change(recipe, seed):
    draw = np.random.default_rng(seed)
    return {
        "displacements": draw.uniform(-0.02, 0.02, 3) * [1, 1, 0],
        "rest": draw.uniform(-1, 1, recipe.rest.shape),
        "holes": [draw.uniform(-0.02, 0.02, h.shape) * [1, 1, 0] for h in recipe.holes],
        "lengths": draw.uniform(-0.02, 0.02, recipe.lengths.shape),
        "poisson_ratio": 0.7,
    }


def bend(turns):
    """Rotation vectors of nearly equal rotations."""
    return np.stack([turns[..., 2, 1], turns[..., 0, 2], turns[..., 1, 0]], -1)


# --- against differences -----------------------------------------------------------------------


@pytest.mark.parametrize("settings", ALL, ids=str)
def test_forward_is_what_differences_say(settings):
    recipe = Recipe(seed=7)
    shape = tdcr.forward(recipe.robot(settings.axial), PULLS, settings=settings).require()
    change = random_change(recipe, 1)
    told = tdcr.sensitivity(shape).forward(**change)
    step = 2e-6

    def at(share):
        robot = recipe.moved(change, share).robot(settings.axial)
        pulls = PULLS + share * change["displacements"]
        return tdcr.forward(robot, pulls, settings=settings).require()

    plus, minus = at(step), at(-step)

    def off(got, name):
        difference = (getattr(plus, name) - getattr(minus, name)) / (2 * step)
        return np.abs(got - difference).max() / np.abs(difference).max()

    assert told.strains.shape == shape.strains.shape
    assert off(told.strains, "strains") < 1e-6
    assert off(told.tensions, "tensions") < 1e-6
    assert off(told.velocities, "positions") < 1e-6
    turns = plus.frames[:, :3, :3] @ minus.frames[:, :3, :3].swapaxes(1, 2)
    difference = bend(turns - turns.swapaxes(1, 2)) / (4 * step)
    assert np.abs(told.spins - difference).max() < 1e-6 * np.abs(difference).max()


@pytest.mark.parametrize("settings", ALL, ids=str)
def test_the_jacobian_is_what_differences_say(settings):
    robot = Recipe(seed=7).robot(settings.axial)
    exact = tdcr.jacobian(robot, PULLS, settings=settings)
    assert exact.shape == (6, 3)
    assert not exact.flags.writeable
    assert np.array_equal(exact[:, 2], np.zeros(6))
    step = 1e-8
    for k in (0, 1):
        tools = []
        for sign in (1, -1):
            pulls = PULLS.copy()
            pulls[k] += sign * step
            tools.append(tdcr.forward(robot, pulls, settings=settings).require().tip @ TOOL)
        velocity = (tools[0] - tools[1])[:3, 3] / (2 * step)
        turn = tools[0][:3, :3] @ tools[1][:3, :3].T
        spin = bend(turn - turn.T) / (4 * step)
        difference = np.concatenate([velocity, spin])
        assert np.abs(exact[:, k] - difference).max() < 1e-6 * np.abs(difference).max()


def test_gradients_of_a_scalar_are_what_differences_say():
    recipe, settings = Recipe(seed=3), tdcr.RodSettings(**TIGHT)
    goal = np.array([0.02, 0.03, 0.1])

    def cost(shape):
        return 0.5 * np.sum((shape.positions[-1] - goal) ** 2)

    shape = tdcr.forward(recipe.robot(False), PULLS, settings=settings).require()
    weights = np.zeros((7, 3))
    weights[-1] = shape.positions[-1] - goal
    by = tdcr.sensitivity(shape).adjoint(weights)
    nothing = {k: 0 * np.asarray(v) for k, v in random_change(recipe, 0).items() if k != "holes"}
    nothing["holes"] = [0 * holes for holes in recipe.holes]
    step = 1e-7
    for name, place in (("rest", (2, 0)), ("rest", (4, 2)), ("lengths", (3,))):
        change = {**nothing, name: nothing[name].copy()}
        change[name][place] = 1.0
        ends = [
            cost(tdcr.forward(recipe.moved(change, s).robot(False), PULLS, settings=settings))
            for s in (step, -step)
        ]
        difference = (ends[0] - ends[1]) / (2 * step)
        assert getattr(by, name)[place] == pytest.approx(difference, rel=1e-6, abs=1e-10)


# --- against each other ------------------------------------------------------------------------


@pytest.mark.parametrize("settings", ALL, ids=str)
def test_adjoint_is_the_transpose_of_forward(settings):
    recipe = Recipe(seed=5)
    shape = tdcr.forward(recipe.robot(settings.axial), PULLS, settings=settings).require()
    at = tdcr.sensitivity(shape)
    change = random_change(recipe, 2)
    told = at.forward(**change)
    draw = np.random.default_rng(4)
    positions, moments = draw.uniform(-1, 1, (2, 7, 3))
    by = at.adjoint(positions, moments)
    assert [h.shape for h in by.holes] == [(7, 3), (7, 3), (6, 3)]
    forward = np.sum(positions * told.velocities) + np.sum(moments * told.spins)
    backward = by.poisson_ratio * change["poisson_ratio"]
    for name in ("displacements", "rest", "lengths"):
        backward += np.sum(getattr(by, name) * change[name])
    for own, d in zip(by.holes, change["holes"], strict=True):
        backward += np.sum(own * d)
    assert backward == pytest.approx(forward, rel=1e-10)
    # Weights that are left out are zero, and both are linear.
    apart = at.adjoint(positions).rest + at.adjoint(moments=moments).rest
    assert np.abs(apart - by.rest).max() < 1e-10 * np.abs(by.rest).max()


def test_the_jacobian_is_forward_at_the_tool():
    shape = tdcr.forward(Recipe(seed=6).robot(False), PULLS).require()
    at = tdcr.sensitivity(shape)
    assert np.array_equal(at.jacobian(), tdcr.jacobian(shape.robot, PULLS, start=shape))
    arm = shape.tip[:3, :3] @ TOOL[:3, 3]
    for k in range(3):
        told = at.forward(displacements=np.eye(3)[k])
        column = np.concatenate(
            [told.velocities[-1] + np.cross(told.spins[-1], arm), told.spins[-1]]
        )
        assert np.abs(at.jacobian()[:, k] - column).max() < 1e-10 * np.abs(at.jacobian()).max()


def test_tensions_are_another_way_to_the_same_shape():
    for axial in (False, True):
        settings = tdcr.RodSettings(axial=axial, **TIGHT)
        robot = Recipe(seed=8).robot(axial)
        shape = tdcr.forward(robot, PULLS, settings=settings).require()
        pulled = tdcr.forward(robot, tensions=shape.tensions, settings=settings).require()
        assert np.abs(pulled.displacements - shape.displacements)[:2].max() < 1e-11
        one, two = tdcr.sensitivity(shape), tdcr.sensitivity(pulled)
        change = np.array([1.0, -2.0, 0.0])
        off = one.forward(displacements=change).spins - two.forward(displacements=change).spins
        # The third is exactly as long as it may be there, and held.
        free = np.abs(one.forward(displacements=change).spins).max()
        assert np.abs(off).max() > 1e-3 * free
        assert two.jacobian()[:, 2].any()


# --- one-sided, dependent, not counted ---------------------------------------------------------


@pytest.mark.parametrize("tendons", ["sliding", "proportional"])
def test_at_rest_tendons_are_followed_on_their_pulled_side(tendons):
    settings = tdcr.RodSettings(tendons=tendons, **TIGHT)
    robot = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(a, 0.01) for a in (0.0, 2.0)])
    exact = tdcr.jacobian(robot, [0.0, 0.0], settings=settings)
    step = 1e-6
    for k in (0, 1):
        moved = []
        for share in (1, 2):
            pulls = np.zeros(2)
            pulls[k] = -share * step
            moved.append(tdcr.forward(robot, pulls, settings=settings).require().positions[-1])
        rest = np.array([0.0, 0.0, 0.2])
        # Order 2 on one side.
        difference = (3 * rest - 4 * moved[0] + moved[1]) / (2 * step)
        assert np.abs(exact[:3, k] - difference).max() < 1e-6 * np.abs(difference).max()
    # Released, nothing moves: one is slack.
    assert not tdcr.jacobian(robot, [1e-3, 1e-3], settings=settings).any()
    one = tdcr.jacobian(robot, [1e-3, 0.0], settings=settings)
    assert not one[:, 0].any()
    assert one[:, 1].any()


def test_at_rest_near_tendons_are_followed_together():
    """Pulling one of two near ones lets the other go slack, which no matrix says."""
    robot = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(a, 0.01) for a in (0.0, 1.0)])
    step, rest = 1e-6, np.array([0.0, 0.0, 0.2])
    for second in (0.0, np.inf):
        exact = tdcr.jacobian(robot, [0.0, second])[:3].sum(axis=1)
        near, far = (
            tdcr.forward(robot, [-pull, second - pull]).require().positions[-1]
            for pull in (step, 2 * step)
        )
        difference = (3 * rest - 4 * near + far) / (2 * step)
        assert np.abs(exact - difference).max() < 1e-6 * np.abs(difference).max()
    together, alone = tdcr.jacobian(robot, [0.0, 0.0]), tdcr.jacobian(robot, [0.0, np.inf])
    assert np.abs(together[:, 0] - alone[:, 0]).max() > 1


def test_dependent_tendons_are_flagged():
    three = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(2.1 * k, 0.01) for k in range(3)])
    held = tdcr.sensitivity(tdcr.forward(three, [0.0, 0.0, 0.0]))
    assert held.dependent
    assert "dependent" in repr(held)
    assert np.isfinite(held.jacobian()).all()
    for free in (np.inf, 5e-3):
        two = tdcr.sensitivity(tdcr.forward(three, [-1e-3, -1e-3, free]).require())
        assert not two.dependent
        assert not two.jacobian()[:, 2].any()
    same = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(0.0, 0.01)] * 2)
    twins = tdcr.sensitivity(tdcr.forward(same, [-1e-3, -1e-3]).require())
    assert twins.dependent
    one = tdcr.jacobian(same, [-1e-3, np.inf])[:, 0]
    assert np.abs(twins.jacobian().sum(axis=1) - one).max() < 1e-9 * np.abs(one).max()
    elastic = tdcr.Tendon(0.0, 0.01, stiffness=1e4)
    steel = tdcr.Backbone(0.2, 10, youngs_modulus=200e9, diameter=0.001)
    apart = tdcr.sensitivity(tdcr.forward(tdcr.Robot(steel, [elastic] * 2), [-1e-3, -1e-3]))
    assert not apart.dependent


def test_manipulability_takes_it():
    jacobian = tdcr.jacobian(Recipe().robot(False), PULLS)
    assert tdcr.manipulability(jacobian, part="rotation").axes.shape == (3,)


# --- values and misuse -------------------------------------------------------------------------


def test_they_are_values():
    settings = tdcr.RodSettings(elements=2)
    shape = tdcr.forward(Recipe().robot(False), PULLS, settings=settings).require()
    assert shape.settings == settings
    assert pickle.loads(pickle.dumps(shape)).settings == settings
    at = tdcr.sensitivity(shape)
    again = pickle.loads(pickle.dumps(at))
    assert again == at
    assert hash(again) == hash(at)
    assert again.shape == shape
    assert np.array_equal(again.jacobian(), at.jacobian())
    other = tdcr.forward(Recipe().robot(False), PULLS * 0.5, settings=settings)
    assert tdcr.sensitivity(other) != at
    told, by = at.forward(poisson_ratio=1.0), at.adjoint(np.ones((7, 3)))
    told, by = (pickle.loads(pickle.dumps(values)) for values in (told, by))
    arrays = [*told, *by[:2], *by.holes, by.lengths]
    assert not any(array.flags.writeable for array in arrays)


def test_shapes_know_their_settings():
    robot = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(0.0, 0.01)])
    default = {
        "rod": tdcr.RodSettings(),
        "linkage": tdcr.LinkageSettings(),
        "constant_curvature": tdcr.ConstantCurvatureSettings(),
    }
    for model, settings in default.items():
        shape = tdcr.forward(robot, [-1e-3], model=model)
        assert shape.settings == settings
        assert pickle.loads(pickle.dumps(shape)) == shape
        batch = tdcr.forward_batch(robot, [[-1e-3]], model=model)
        assert batch[0].settings == settings
    fine = tdcr.forward(robot, [0.0], settings=tdcr.RodSettings(tolerance=1e-9))
    assert fine != tdcr.forward(robot, [0.0])


ONE = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(0.0, 0.01)])


def solved():
    return tdcr.sensitivity(tdcr.forward(Recipe().robot(False), PULLS).require())


def failing():
    return tdcr.forward(ONE, [-0.5])


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("displacements", lambda: solved().forward(displacements=[0.0, 1.0])),
        ("displacements", lambda: solved().forward(displacements=[0.0, 1.0, FREE])),
        ("rest", lambda: solved().forward(rest=np.zeros((5, 3)))),
        ("holes", lambda: solved().forward(holes=[np.zeros((7, 3))] * 2)),
        ("holes[2]", lambda: solved().forward(holes=[np.zeros((7, 3))] * 3)),
        ("lengths", lambda: solved().forward(lengths=np.full(6, np.nan))),
        ("lengths", lambda: solved().forward(lengths=0.1)),
        ("poisson_ratio", lambda: solved().forward(poisson_ratio=np.nan)),
        ("positions", lambda: solved().adjoint(np.zeros((6, 3)))),
        ("moments", lambda: solved().adjoint(moments=np.zeros((7, 2)))),
        ("shape", lambda: tdcr.sensitivity(tdcr.forward(ONE, [0.0], model="linkage"))),
        ("model", lambda: tdcr.jacobian(ONE, [0.0], model="linkage")),
        (
            "settings",
            lambda: tdcr.jacobian(ONE, [0.0], settings=tdcr.LinkageSettings()),
        ),
        ("displacements", lambda: tdcr.jacobian(ONE, [[0.0]])),
        ("displacements", lambda: tdcr.jacobian(ONE, [0.0, 0.0])),
        ("start", lambda: tdcr.jacobian(Recipe().robot(False), PULLS, start=failing())),
        (
            "start",
            lambda: tdcr.jacobian(ONE, [0.0], model="constant_curvature", start=failing()),
        ),
    ],
)
def test_bad_input_names_the_argument(argument, call):
    with pytest.raises(tdcr.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    "call",
    [
        lambda: tdcr.sensitivity("shape"),
        lambda: solved().forward(holes=1.0),
        lambda: solved().forward(poisson_ratio="0"),
        lambda: solved().adjoint("up"),
        lambda: tdcr.jacobian(ONE, [0.0], start=1),
    ],
)
def test_wrong_types_are_type_errors(call):
    with pytest.raises(TypeError):
        call()


def test_what_did_not_converge_has_no_derivatives():
    with pytest.raises(tdcr.NotConverged, match=r"infeasible: tendon .t0. is pulled by") as caught:
        tdcr.jacobian(ONE, [-0.5])
    assert caught.value.result == failing()
    with pytest.raises(tdcr.NotConverged):
        tdcr.sensitivity(failing())


def test_the_docstrings_say_units_and_shapes():
    for thing in (tdcr.Sensitivity.forward, tdcr.Sensitivity.adjoint, tdcr.jacobian):
        text = inspect.getdoc(thing)
        assert all(words in text for words in ("shape (", "Returns", "Raises", "InvalidInput"))
    assert "world axes" in inspect.getdoc(tdcr.Sensitivity.adjoint)


def test_a_tendon_without_leverage_has_no_column():
    crossing = tdcr.Tendon([0.0, np.pi] * 5 + [0.0], 0.008)
    robot = tdcr.Robot(tdcr.Backbone(0.2, 10), [crossing])
    assert not tdcr.jacobian(robot, [0.0]).any()
    assert tdcr.sensitivity(tdcr.forward(robot, [0.0])).dependent
