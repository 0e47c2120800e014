"""How long `labkit term` takes for a class of 60 in eight labs: `python tests/benchmarks/term.py [--students 60]`."""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve()
sys.path[:0] = [str(HERE.parents[2]), str(HERE.parents[1])]

from helpers.term import LABS, a_term  # noqa: E402 - the kit is found by the line above

TARGET = 2.0  # [s]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--students", type=int, default=60)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="labkit-bench-") as folder:
        out = a_term(Path(folder) / "graded", args.students, len(LABS))
        env = {**os.environ, "PYTHONPATH": str(HERE.parents[2])}
        before, start = os.times(), time.monotonic()
        subprocess.run([sys.executable, "-m", "labkit", "term", str(out)], env=env, check=True)
        after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    wall = time.monotonic() - start
    print(f"term of {args.students} students, {len(LABS)} labs: {wall:.2f} s, {cpu:.2f} s of a core; target {TARGET} s")


if __name__ == "__main__":
    main()
