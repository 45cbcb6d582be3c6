"""Mahapatra & Ghosal's figures remade: the facts that the example prints, and its pictures."""

import csv
from pathlib import Path

import numpy as np
import pytest
from example_scripts import example_script

pytest.importorskip("matplotlib")

ROOT = Path(__file__).resolve().parents[2]
RADIUS = 0.008


@pytest.fixture(scope="module")
def example():
    with example_script("mahapatra_ghosal_figures") as module:
        yield module


@pytest.fixture(scope="module")
def shapes(example):
    return {case.name: case.solve() for case in example.cases()}


def test_the_prototype_is_the_papers(shapes):
    for shape in shapes.values():
        backbone = shape.robot.backbone
        assert backbone.total_length == pytest.approx(0.180, rel=1e-6)
        assert len(shape.frames) == 10
        assert {float(tendon.radius) for tendon in shape.robot.tendons} == {RADIUS}
        bent = backbone.rest is not None
        assert backbone.poisson_ratio == (0.35 if bent else 0.39)


def test_one_hole_bends_in_its_plane_and_winding_leaves_it(shapes):
    straight, helical = shapes["straight"], shapes["helical"]
    assert np.abs(straight.positions[:, 1]).max() < 1e-12
    assert straight.tip[0, 3] > 0.1
    # The holes turn counter-clockwise, and the disks against them.
    assert helical.tip[1, 3] > 3 * helical.tip[0, 3] > 0
    assert (helical.strains[:, 2] < 0).all()
    # General 1 ends on the other side, and so bends back.
    bends = shapes["general 1"].strains[:, 1]
    assert bends[0] > 0.1
    assert bends[-1] < -0.1


@pytest.mark.parametrize("name", ["pre-bent 1", "pre-bent 2"])
def test_prebent_goes_to_the_side_that_is_pulled(example, shapes, name):
    rest = example.prebent(name, "rest").solve()
    left, right = (shapes[f"{name}, {side}"] for side in ("left", "right"))
    assert left.tip[0, 3] < 0 < rest.tip[0, 3] < right.tip[0, 3]
    assert rest.tensions.tolist() == [0, 0]
    assert left.tensions[0] > left.tensions[1] == 0
    assert right.tensions[1] > right.tensions[0] == 0
    for shape in (left, rest, right):
        assert np.abs(shape.positions[:, 1]).max() < 1e-12
    # Smooth: no subsegment turns by more than an eighth of a turn.
    assert np.abs(rest.strains).max() < np.pi / 4


@pytest.mark.parametrize("name", ["pre-bent 2, left", "pre-bent 2, right"])
def test_proportional_in_a_plane_is_its_closed_form(example, name):
    """Every piece is a chord 2 (l/b - a) sin(b/2) of its arc, and shrinks by the same ratio."""
    case = next(case for case in example.cases() if case.name == name)
    shape = case.solve(tendons="proportional")
    pulled = int(np.argmin(case.displacements))
    a = RADIUS if pulled else -RADIUS
    ell = shape.robot.backbone.total_length / 9
    rest = shape.robot.backbone.rest[:, 1]

    def piece(bend):
        return ell * np.sinc(bend / 2 / np.pi) - 2 * a * np.sin(bend / 2)

    ratio = 1 + case.displacements[pulled] / shape.robot.rest_lengths[pulled]
    low, high = rest - 1.0, rest + 1.0
    for _ in range(60):
        middle = (low + high) / 2
        # The piece at +x shrinks as the bend grows, the one at -x stretches.
        below = (piece(middle) > ratio * piece(rest)) == (a > 0)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    assert shape.strains[:, 1] == pytest.approx(low, abs=1e-9)
    assert np.ptp(low - rest) > 0.02
    # Sliding has one tension, and so nearly the same bend everywhere.
    sliding = case.solve()
    assert np.ptp(sliding.strains[:, 1] - rest) < 0.5 * np.ptp(low - rest)


def test_the_papers_choices_differ_as_the_guide_says(example, shapes):
    page = (ROOT / "docs/rod.md").read_text(encoding="utf-8")
    for line in example.table():
        assert line in page
    # Equal where all pieces are alike.
    for case in example.cases():
        if case.name in ("straight", "helical"):
            off = case.solve(tendons="proportional").tip - shapes[case.name].tip
            assert np.abs(off).max() < 1e-10


@pytest.mark.slow
def test_every_picture_is_drawn_with_its_disks(example, tmp_path):
    example.figures(tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    figures = {
        f"mahapatra_{k}{ending}" for k in ("03", "05", "06", "07") for ending in (".png", ".csv")
    }
    assert names == figures
    for name, panels in (("03", 3), ("05", 5), ("06", 3), ("07", 3)):
        made, kept = (
            np.array(
                list(csv.reader((folder / f"mahapatra_{name}.csv").read_text().splitlines()))[1:]
            )
            for folder in (tmp_path, ROOT / "examples/figures")
        )
        assert len(made) == 10 * panels
        assert (made[:, :3] == kept[:, :3]).all()
        # What is checked in is what the script makes [mm].
        assert np.abs(made[:, 3:].astype(float) - kept[:, 3:].astype(float)).max() < 1e-5
