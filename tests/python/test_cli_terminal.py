"""The commands on terminals and in pipes: progress, Ctrl-C, readers that go, any width."""

from __future__ import annotations

import json
import os
import re
import signal
import struct
import subprocess
import sys

import numpy as np
import pytest
from command_line import points, run, save_arm
from interrupts import interrupts, started

import tdcr


@pytest.fixture
def robot(tmp_path, monkeypatch):
    return save_arm(tmp_path, monkeypatch)


GRID = ["--ranges", "-10:0 -5 free", "--unit", "mm", "--samples", "50", "--sampling", "grid"]
# What runs when all is read, so long that it never ends, and its command's arguments.
LONG = {
    "workspace": ("tdcr.workspace", ["--ranges", "-0.01:0 free free", "--samples", "3000000",
                                     "--sampling", "random", "--output", "w.npz"]),
    "track": ("tdcr.track", ["path.csv", "--output", "t.npz"]),
    "plot": ("PillowWriter.grab_frame", ["--pull", "-0.01 -0.004 free", "--animate", "p.gif",
                              "--frames", "500"]),
    "fit": ("design.fit", ["bench.csv", "--unit", "mm", "--pull-sign", "negative", "--parameters",
                           "gain,base,radius,azimuth", "-o", "f.toml"]),
    "design routing": ("design.routing", ["bend.csv", "-o", "r.toml", "--curve"]),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("command", LONG)
def test_interrupting_ends_with_130_and_one_line(command, robot, tmp_path):
    pytest.importorskip("matplotlib")
    angles = np.linspace(0, 60, 100_000)
    circle = np.stack([0.4 * np.cos(angles), 0.4 * np.sin(angles), 0 * angles + 0.3], axis=1)
    points(tmp_path / "path.csv", circle)
    bend = np.linspace(0, 1.5, 40)[:, None] ** [1, 1.7, 1]
    bend = np.stack([1 - np.cos(bend[:, 0]), 0.2 * np.sin(3 * bend[:, 1]), np.sin(bend[:, 2])], 1)
    points(tmp_path / "bend.csv", 0.15 * bend)
    noise = np.random.default_rng(0).normal([-5, 0, 0, 30, 30, 180], 4, (6000, 6))
    rows = [",".join(map(str, row)) for row in noise.tolist()]
    (tmp_path / "bench.csv").write_text("\n".join(["d0,d1,d2,x,y,z", *rows]))
    work, arguments = LONG[command]
    code = "\n".join(
        [
            "import sys, tdcr",
            "from matplotlib.animation import PillowWriter",
            "from tdcr import design",
            "from tdcr._cli import main",
            interrupts(f"within(frame, {work})"),
            "sys.exit(main(sys.argv[1:]))",
        ]
    )
    before = set(tmp_path.iterdir())
    with started(code, *command.split(), robot, *arguments) as process:
        out, err = process.communicate()
    assert (process.returncode, out, err) == (130, "", "tdcr: interrupted\n")
    assert set(tmp_path.iterdir()) == before


def test_progress_is_drawn_on_a_terminal_alone(robot, tmp_path):
    pty = pytest.importorskip("pty")
    command = [sys.executable, "-m", "tdcr", "workspace", robot, *GRID]
    quiet = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    assert quiet.stderr == ""
    terminal, ours = pty.openpty()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=ours) as process:
        out, _ = process.communicate(timeout=300)
    os.close(ours)
    drawn = os.read(terminal, 100_000).decode()
    os.close(terminal)
    assert "50/50" in drawn
    assert out.decode() == quiet.stdout


class Terminal:
    """A terminal of some width; what a command prints on it."""

    def __init__(self, columns=80):
        pty = pytest.importorskip("pty")
        termios, fcntl = pytest.importorskip("termios"), pytest.importorskip("fcntl")
        self.ours, self.theirs = pty.openpty()
        size = struct.pack("HHHH", 24, columns, 0, 0)
        fcntl.ioctl(self.theirs, termios.TIOCSWINSZ, size)

    def run(self, *arguments, **environment):
        command = [sys.executable, "-m", "tdcr", *arguments]
        given = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "TERM")}
        ends = {"stdin": self.theirs, "stdout": self.theirs, "stderr": self.theirs}
        with subprocess.Popen(command, env=given | environment, **ends) as process:
            os.close(self.theirs)
            drawn = b""
            while True:
                try:
                    part = os.read(self.ours, 65536)
                except OSError:
                    break
                if not part:
                    break
                drawn += part
            code = process.wait(timeout=300)
        os.close(self.ours)
        return code, drawn.decode().replace("\r\n", "\n")


FORWARD = ["-d", "-10 free free", "--unit", "mm"]


def plain(text):
    """Words of a table, without bold and lines."""
    return re.sub(r"\x1b\[[0-9;]*m|[|+─-]{2,}|\|", " ", text).split()


@pytest.mark.parametrize("columns", [40, 80, 200])
@pytest.mark.parametrize("given", [{"TERM": "xterm"}, {"TERM": "dumb"}, {"NO_COLOR": "1"}])
def test_a_terminal_shows_every_number_whole(columns, given, robot, capsys):
    out, _ = run(capsys, "forward", robot, *FORWARD)
    code, drawn = Terminal(columns).run("forward", robot, *FORWARD, **given)
    assert code == 0
    assert plain(drawn) == plain(out)
    if given.get("TERM") != "xterm":
        assert not re.search(r"\x1b\[[34]", drawn)


def test_tables_in_a_pipe_have_no_blanks_at_the_ends_of_lines(robot, capsys):
    out, _ = run(capsys, "forward", robot, *FORWARD)
    assert out == "".join(f"{line.rstrip()}\n" for line in out.splitlines())


def piped(command, **options):
    """Run a command in a process of its own."""
    given = {"capture_output": True, "timeout": 120} | options
    return subprocess.run([sys.executable, "-m", "tdcr", *command], **given)


@pytest.mark.slow
def test_names_are_told_where_ascii_is_all_there_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    named = tdcr.Robot(tdcr.Backbone(0.2, 4), [tdcr.Tendon(0.0, 0.01)], name="brás Δ")
    named.save("named.toml")
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = piped(["forward", "named.toml", "-d", "-0.01"], env=environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert "br\\xe1s \\u0394" in done.stdout.decode("ascii")
    done = piped(["forward", "named.toml", "-d", "-0.01", "--json"], env=environment)
    assert json.loads(done.stdout)["robot"]["name"] == "brás Δ"


@pytest.mark.parametrize(
    "command",
    [
        ["forward", "arm.toml", *FORWARD, "--output", "s.json", "--json", "t.json"],
        ["workspace", "arm.toml", *GRID, "--output", "w.npz"],
    ],
    ids=lambda command: command[0],
)
def test_a_reader_that_goes_costs_no_file(command, robot, tmp_path):
    """As ``| true`` does: the pipe is closed before anything is printed."""
    reading, writing = os.pipe()
    os.close(reading)
    done = piped(command, capture_output=False, stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, b"")
    for place in (i + 1 for i, word in enumerate(command) if word in ("--output", "--json")):
        assert (tmp_path / command[place]).stat().st_size > 0


@pytest.mark.parametrize("command", [[], ["--help"], ["--version"], ["schema"], ["plot", "-h"]])
def test_a_reader_that_goes_is_no_fault(command):
    reading, writing = os.pipe()
    os.close(reading)
    done = piped(command, capture_output=False, stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, b"")


@pytest.mark.slow
@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_closed_stream_is_no_fault(stream, robot):
    code = f"import os; os.close({1 if stream == 'stdout' else 2}); import sys; "
    code += "os.execv(sys.executable, [sys.executable, '-m', 'tdcr', *sys.argv[1:]])"
    for command in (["forward", robot, *FORWARD], ["workspace", robot, *GRID], ["--version"]):
        done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True)
        assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
def test_a_full_disk_is_named(robot, capsys):
    _, err = run(capsys, "forward", robot, *FORWARD, "--json", "/dev/full", code=2)
    assert err == "tdcr: error: /dev/full: No space left on device\n"
    with open("/dev/full", "w") as full:
        done = piped(["--version"], capture_output=False, stdout=full, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (2, b"tdcr: error: No space left on device\n")


def test_a_device_is_written_to_and_not_replaced(robot):
    done = piped(["forward", robot, *FORWARD, "--json", "/dev/stdout"], text=True)
    text, table = done.stdout.split("\n", 1)
    assert json.loads(text)["kind"] == "Shape"
    assert table.startswith("robot ")
