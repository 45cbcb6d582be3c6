"""``tdcr plot``: pictures of robots and of whatever was saved, animated pulls."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from command_line import PULL, arm, picture, run, save_arm
from saved_results import DESIGNS

import tdcr
from tdcr._cli import main


@pytest.fixture
def robot(tmp_path, monkeypatch):
    return save_arm(tmp_path, monkeypatch)


@pytest.mark.slow
def test_plot_draws_whatever_was_saved(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    tdcr.forward(arm(), PULL).save("shape.npz")
    tdcr.forward(arm(), PULL).save("shape.json")
    tdcr.inverse(arm(), [0.05, 0.0, 0.18], model="constant_curvature").save("inverse.npz")
    limits = [(-0.01, 0), (math.inf,) * 2, (math.inf,) * 2]
    tdcr.workspace(arm(), limits, 20, sampling="grid").save("cloud.npz")
    tdcr.forward_batch(arm(), [PULL, PULL]).save("batch.npz")
    for name in ("prebend", "routing", "fit", "grasp"):
        DESIGNS[name]().save(f"{name}.npz")
    arm().save("arm.json")
    for file, *options in (
        ("shape.npz", "--view", "3d"), ("shape.json",), ("inverse.npz",), ("cloud.npz",),
        ("cloud.npz", "--view", "3d"), ("batch.npz", "--row", "1"), ("arm.json",),
        (robot, "--pull", "-10 free free", "--unit", "mm", "--model", "linkage"),
        ("prebend.npz",), ("routing.npz",), ("fit.npz",), ("grasp.npz",),
    ):  # fmt: skip
        (tmp_path / "p.png").unlink(missing_ok=True)
        main(["plot", file, "--output", "p.png", *options])
        picture(tmp_path / "p.png")
    capsys.readouterr()


def test_plot_says_what_it_cannot_draw(robot, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    tdcr.forward_batch(arm(), [PULL, PULL]).save("batch.npz")
    tdcr.forward(arm(), PULL).save("shape.npz")
    (tmp_path / "x.npz").write_bytes(b"no")
    out = ["--output", "p.png"]
    for arguments, text in (
        ([robot], "expected --output FILE, --animate FILE or both"),
        (["batch.npz", *out], "--row: expected a row from 0 to 1, got none"),
        (["batch.npz", *out, "--row", "2"], "--row: expected a row from 0 to 1, got 2"),
        (["shape.npz", *out, "--row", "0"], "--row: expected a batch or a track, got Shape"),
        (["shape.npz", *out, "--pull", "0"], "expected a robot file, got shape.npz with a Shape"),
        (["x.npz", *out], "x.npz: not an npz file"),
        (["x.csv", *out], "expected a file ending in .toml, .json, .npz or .parquet, got 'x.csv'"),
        ([robot, "--output", "p.docx"], "expected a picture file ending in one of"),
        ([robot, "--animate", "p.gif"], "--animate: expected --pull too"),
        ([robot, "--animate", "p.png", "--pull", "0 0 0"], "expected one ending in .gif"),
        ([robot, "--animate", "p.gif", "--pull", "0 0"], "displacements: expected 3 values"),
    ):
        _, err = run(capsys, "plot", *arguments, code=2)
        assert text in err
    assert not (tmp_path / "p.png").exists()
    assert not (tmp_path / "p.gif").exists()


@pytest.mark.slow
@pytest.mark.parametrize("pull", ["-10 free free", "-10 -3 free"])
def test_an_animation_holds_its_axes_still(robot, pull, tmp_path, capsys):
    """In the plane and in space: what is no robot is the same in every frame."""
    pytest.importorskip("matplotlib")
    image = pytest.importorskip("PIL.Image")
    command = ["plot", robot, "--pull", pull, "--unit", "mm", "--frames", "6"]
    run(capsys, *command, "--animate", "pull.gif")
    frames = []
    with image.open(tmp_path / "pull.gif") as gif:
        assert gif.n_frames == 6
        assert gif.info["loop"] == 0
        for k in range(gif.n_frames):
            gif.seek(k)
            frames.append(np.asarray(gif.convert("L"), dtype=float))
    first, last = frames[0], frames[-1]
    assert all(frame.shape == first.shape for frame in frames)
    dark = [np.argwhere(frame < 200) for frame in frames]
    # Ink of axes, labels and legend bounds every frame alike, below the title.
    box = [(d[d[:, 0] > 60].min(axis=0), d.max(axis=0)) for d in dark]
    for low, high in box[1:]:
        assert np.abs(high - box[0][1]).max() <= 1
        assert abs(low[1] - box[0][0][1]) <= 1
    assert np.abs(first - last).max() > 100


@pytest.mark.parametrize("done", [0, 3])
def test_an_animation_that_is_interrupted_is_not_written(
    done, robot, tmp_path, capsys, monkeypatch
):
    """Before the first frame too, when there is nothing to write."""
    pytest.importorskip("matplotlib")
    from tdcr._plot import animation

    drawn = []

    def frame(figure, shapes, step):
        if len(drawn) == done:
            raise KeyboardInterrupt
        drawn.append(step)

    monkeypatch.setattr(animation, "_frame", frame)
    before = set(tmp_path.iterdir())
    command = ["plot", robot, "--pull", "-0.01 free free", "--animate", "p.gif"]
    assert main(command) == 130
    assert capsys.readouterr().err == "tdcr: interrupted\n"
    assert drawn == list(range(done))
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize("ending", ["svg", "pdf", "png"])
@pytest.mark.parametrize("kind", ["shape", "workspace"])
def test_a_picture_that_is_interrupted_is_not_written(
    ending, kind, robot, tmp_path, capsys, monkeypatch
):
    figure = pytest.importorskip("matplotlib.figure")
    tdcr.forward(arm(), PULL).save("shape.npz")
    limits = [(-0.01, 0), (math.inf,) * 2, (math.inf,) * 2]
    tdcr.workspace(arm(), limits, 20, sampling="grid").save("workspace.npz")
    whole = figure.Figure.savefig

    def savefig(self, target, **options):
        whole(self, target, **options)
        raise KeyboardInterrupt

    monkeypatch.setattr(figure.Figure, "savefig", savefig)
    before = set(tmp_path.iterdir())
    assert main(["plot", f"{kind}.npz", "--output", f"p.{ending}"]) == 130
    assert capsys.readouterr().err == "tdcr: interrupted\n"
    assert set(tmp_path.iterdir()) == before


def test_an_interrupt_that_the_garbage_collector_swallows_ends_an_animation(
    robot, tmp_path, capsys, monkeypatch
):
    pytest.importorskip("matplotlib")
    from tdcr._plot import animation

    class Dropped:
        def __del__(self):
            raise KeyboardInterrupt

    drawn = []

    def frame(figure, shapes, step):
        drawn.append(step)
        if step == 3:
            Dropped()
            # Waits for it, so long that only what hangs notices.
            for _ in range(10_000):
                time.sleep(0.01)

    monkeypatch.setattr(animation, "_frame", frame)
    command = ["plot", robot, "--pull", "-0.01 free free", "--frames", "200"]
    before = set(tmp_path.iterdir())
    assert main([*command, "--animate", "p.gif"]) == 130
    assert capsys.readouterr().err == "tdcr: interrupted\n"
    assert drawn == [0, 1, 2, 3]
    assert set(tmp_path.iterdir()) == before


@pytest.fixture
def drawn(monkeypatch):
    """Figures that the commands save."""
    figure = pytest.importorskip("matplotlib.figure")
    figures, whole = [], figure.Figure.savefig

    def savefig(self, target, **options):
        figures.append(self)
        whole(self, target, **options)

    monkeypatch.setattr(figure.Figure, "savefig", savefig)
    return figures


@pytest.mark.parametrize("pull", ["-15 free free free -5 free", "-12.6 4.1 8.2 -0.8 -0.5 1.3"])
def test_words_of_a_picture_in_space_are_not_one_over_the_other(pull, robot, drawn, capsys):
    run(capsys, "demo", "--files", ".")
    main(["plot", "trunk.toml", "--pull", pull, "--unit", "mm", "--view", "3d", "-o", "p.png"])
    capsys.readouterr()
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(drawn[0])
    canvas.draw()
    axes, renderer = drawn[0].axes[0], canvas.get_renderer()
    labels = [axis.label.get_window_extent(renderer) for axis in (axes.xaxis, axes.yaxis)]
    legend = axes.get_legend().get_window_extent(renderer)
    assert not any(legend.overlaps(label) for label in labels)
    side = axes.zaxis.label.get_window_extent(renderer)
    ticks = [tick.label1 for tick in axes.zaxis.get_major_ticks()]
    shown = [tick.get_window_extent(renderer) for tick in ticks if tick.get_text()]
    assert shown
    assert not any(side.overlaps(tick) for tick in shown)


def test_a_workspace_in_space_is_to_scale(robot, drawn, capsys):
    """Also of tips in a plane, which is no sliver."""
    ranges = ["--ranges", "-10:0", "free", "free", "--unit", "mm", "--samples", "50"]
    out = ["--sampling", "grid", "--view", "3d", "--plot", "p.png"]
    run(capsys, "workspace", robot, *ranges, *out)
    axes = drawn[0].axes[0]
    spans = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim()), np.ptp(axes.get_zlim())])
    box = np.array(axes.get_box_aspect())
    assert box / box.max() == pytest.approx(spans / spans.max(), rel=1e-6)
    assert spans.min() >= 0.2 * spans.max()
    low, high = axes.get_zlim()
    assert low <= 0.0 < 200.0 <= high
