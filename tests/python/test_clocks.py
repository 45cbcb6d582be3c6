"""No test reads a clock: a busy machine must not decide what passes. benches/ measure times."""

import re
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
CLOCK = re.compile(
    r"\b(Instant|SystemTime|elapsed|perf_counter\w*|monotonic\w*|process_time\w*|thread_time\w*"
    r"|timeit|clock_gettime|time\.time\w*|datetime\.now|utcnow)\b"
)


def test_no_test_reads_a_clock():
    files = [path for ending in ("*.rs", "*.py") for path in TESTS.rglob(ending)]
    assert len(files) > 90
    for path in files:
        if path != Path(__file__).resolve():
            found = CLOCK.search(path.read_text(encoding="utf-8"))
            assert found is None, f"{path.relative_to(TESTS)}: {found[0]}"
