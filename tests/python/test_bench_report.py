"""The guide's page of benchmarks, from what criterion and the side-by-side runs leave behind."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def result(target, name, median, elements, age=0.0):
    folder = target / "criterion" / name.replace("/", "_") / "new"
    folder.mkdir(parents=True)
    throughput = None if elements is None else {"Elements": elements}
    (folder / "benchmark.json").write_text(json.dumps({"full_id": name, "throughput": throughput}))
    interval = {"lower_bound": 0.9 * median, "upper_bound": 1.1 * median}
    estimate = {"median": {"point_estimate": median, "confidence_interval": interval}}
    (folder / "estimates.json").write_text(json.dumps(estimate))
    when = (target / "bench/started").stat().st_mtime - age
    os.utime(folder / "estimates.json", (when, when))


@pytest.fixture
def target(tmp_path):
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench/started").touch()
    return tmp_path


def report(target, *options):
    page = target / "page.md"
    command = [sys.executable, ROOT / "benches/report.py", target, "--output", page, *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done, page.read_text() if page.exists() else None


def test_the_page_has_this_run_alone_and_its_units(target):
    result(target, "chain/varied/100", 123_456.0, 100)
    result(target, "bar/four_bar", 789.0, None)
    result(target, "bar/removed", 1.0, None, age=60.0)
    (target / "bench/linkage.txt").write_text("IPOPT  912 us\n")
    done, page = report(target)
    assert done.returncode == 0, done.stderr
    assert "| bar/four_bar | 789 ns | 710 ns – 868 ns |  |  |" in page
    assert "| chain/varied/100 | 123 µs | 111 µs – 136 µs | 100 | 1.23 µs |" in page
    assert "removed" not in page
    assert "`benches/peers/linkage.py`:\n\n```text\nIPOPT  912 us\n```" in page
    assert "A full run" in page
    assert "A short run" in report(target, "--quick")[1]


def test_without_results_nothing_is_written(target):
    done, page = report(target)
    assert done.returncode == 1
    assert "no results" in done.stderr
    assert page is None
