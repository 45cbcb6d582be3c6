"""The guard of the benches: ratios to a reference, compared with a baseline."""

import json
import subprocess
import sys

from test_bench_report import ROOT, result, target  # noqa: F401 (a fixture)

REFERENCE = "bar/seven_bar/alike"


def run(folder, *options):
    baseline = folder / "baseline.json"
    command = [sys.executable, ROOT / "benches/guard.py", folder, "--baseline", baseline, *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def measure(folder, reference, **times):
    result(folder, REFERENCE, reference, None)
    for name, time in times.items():
        result(folder, f"rod/{name}", time, None)


def write_baseline(folder, **ratios):
    content = {"reference": REFERENCE, "nanoseconds": 100.0, "ratios": {}}
    content["ratios"] = {f"rod/{name}": ratio for name, ratio in ratios.items()}
    (folder / "baseline.json").write_text(json.dumps(content))


def test_a_slower_machine_is_no_slower_bench(target):  # noqa: F811
    write_baseline(target, cold=2.0, warm=1.0)
    measure(target, 300.0, cold=640.0, warm=330.0)
    done = run(target, "--check")
    assert done.returncode == 0, done.stderr
    assert "2 benches as the baseline, within 15 %" in done.stdout
    assert "slower" not in done.stdout


def test_a_slower_bench_is_named_and_fails_where_it_should(target):  # noqa: F811
    write_baseline(target, cold=2.0, warm=1.0, gone=1.0)
    measure(target, 100.0, cold=240.0, warm=50.0, added=1.0)
    done = run(target)
    assert done.returncode == 0
    assert "1 slower by over 15 %\n  rod/cold    1.20 times the baseline" in done.stdout
    assert "1 faster by over 15 %\n  rod/warm    0.50 times the baseline" in done.stdout
    assert "new, not in the baseline: rod/added" in done.stdout
    assert "not measured: rod/gone" in done.stdout
    assert run(target, "--check").returncode == 1
    assert run(target, "--check", "--limit", "1.25").returncode == 0


def test_a_written_baseline_is_what_is_compared_and_leaves_threads_out(target):  # noqa: F811
    measure(target, 200.0, cold=500.0, two_threads=70.0, one_thread=90.0)
    assert run(target, "--write").returncode == 0
    written = json.loads((target / "baseline.json").read_text())
    assert written["reference"] == REFERENCE
    assert written["nanoseconds"] == 200.0
    assert written["ratios"] == {"rod/cold": 2.5, "rod/one_thread": 0.45}
    assert run(target, "--check").returncode == 0


def test_a_run_without_the_reference_is_refused(target):  # noqa: F811
    write_baseline(target, cold=2.0)
    result(target, "rod/cold", 1.0, None)
    done = run(target)
    assert done.returncode == 1
    assert "not measured in this run" in done.stderr


def test_the_committed_baseline_has_the_reference():
    baseline = json.loads((ROOT / "benches/baseline.json").read_text())
    assert baseline["reference"] == REFERENCE
    assert len(baseline["ratios"]) > 50
