"""What the tests of the commands share: a robot, tables of points, runs and what they print."""

from __future__ import annotations

import math

import tdcr
from tdcr._cli import main

AZIMUTHS = (0.0, 2 * math.pi / 3, -2 * math.pi / 3)
PULL = [-0.010, math.inf, math.inf]


def arm(**tendon):
    names = ("front", "left", "right")
    tendons = [
        tdcr.Tendon(a, 0.01, name=name, **tendon) for a, name in zip(AZIMUTHS, names, strict=True)
    ]
    return tdcr.Robot(tdcr.Backbone(0.2, 10, disk_radius=0.012), tendons, name="arm [red]")


def save_arm(tmp_path, monkeypatch):
    """Save a robot in a folder, make that the working folder and give the file's name."""
    monkeypatch.chdir(tmp_path)
    arm().save("arm.toml")
    return "arm.toml"


def points(path, places, unit=" [m]", scale=1.0):
    rows = [",".join(repr(float(x) * scale) for x in row) for row in places]
    path.write_text("\n".join([",".join(f"{axis}{unit}" for axis in "xyz"), *rows]) + "\n")
    return str(path)


def run(capsys, *arguments, code=0):
    """Run a command in this process; what it prints on stdout and stderr."""
    assert main(list(map(str, arguments))) == code, capsys.readouterr().err
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    assert "\x1b" not in out + err
    if code == 0:
        assert err == ""
    else:
        assert err.count("\n") == 1
        assert err.startswith("tdcr: ")
    return out, err


def facts(out):
    """First column of a table to the others."""
    split = (line.rstrip().split("  ") for line in out.splitlines() if line.strip())
    return {words[0]: [w.strip() for w in words[1:] if w.strip()] for words in split}


def picture(path):
    assert path.read_bytes().startswith(b"\x89PNG")
