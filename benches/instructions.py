"""Count the instructions of one solve of each case of benches/instructions.rs, with callgrind.

A count is the difference of two runs over that of their numbers of solves, so that what is done
once does not enter. Counts of one machine and compiler compare to a tenth of a percent, whatever
else the machine has to do.

    python benches/instructions.py --write before.json
    python benches/instructions.py --against before.json
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

# Numbers of solves of the two runs.
CASES = {
    "forward-10": (10, 60),
    "forward-30": (10, 40),
    "contact-30": (1, 3),
    "inverse": (2, 6),
    "seven-bar": (100, 1100),
}
LIMIT = 1.03
BUILD = "cargo bench --locked -p tdcr --bench instructions --no-run --message-format=json"


def build() -> Path:
    """Build the program; its path."""
    done = subprocess.run(BUILD.split(), stdout=subprocess.PIPE, text=True, check=True)
    messages = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    made = [m["executable"] for m in messages if m.get("executable")]
    return Path(made[-1])


def collected(program: Path, case: str, times: int) -> int:
    """Instructions of a whole run."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(program)]
    done = subprocess.run([*command, case, str(times)], capture_output=True, text=True, check=False)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or found is None:
        sys.exit(f"{case}: {done.stderr.strip()}")
    return int(found[1])


def count(program: Path) -> dict[str, float]:
    """Instructions of one solve of every case."""
    counts = {}
    for case, (few, many) in CASES.items():
        difference = collected(program, case, many) - collected(program, case, few)
        counts[case] = difference / (many - few)
    return counts


def main() -> None:
    """Print the counts, and how they compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=Path, help="built before, of another commit maybe")
    parser.add_argument("--write", type=Path, metavar="FILE", help="keep the counts as JSON")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare; exits 1 over 3 %%")
    given = parser.parse_args()
    if shutil.which("valgrind") is None:
        sys.exit("the counts need valgrind (on Debian: apt install valgrind)")
    counts = count(given.program or build())
    before = json.loads(given.against.read_text(encoding="utf-8")) if given.against else {}
    for case, number in counts.items():
        change = f"{100 * (number / before[case] - 1):+8.2f} %" if case in before else ""
        print(f"{case:12}{number:16,.0f}{change}")
    if given.write:
        given.write.write_text(json.dumps(counts, indent=1) + "\n", encoding="utf-8")
    sys.exit(any(counts[case] > LIMIT * old for case, old in before.items()))


if __name__ == "__main__":
    main()
