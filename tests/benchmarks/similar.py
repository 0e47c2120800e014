"""How long `labkit similar` takes: `python tests/benchmarks/similar.py [--students 200] [--lab 04_legged_robot]`.

The class has all known forms of the lab's answers, right and wrong, in whole notebooks; every fifth student has copied
from another one, with other names, order and comments. As all of it comes from one solution, more pairs are told than
in a class of people.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

HERE = Path(__file__).resolve()
sys.path[:0] = [str(HERE.parents[2]), str(HERE.parents[1])]

from labkit.instructor.authoring.spec import definitions  # noqa: E402
from labkit.instructor.intake.submission import Work  # noqa: E402
from labkit.instructor.report import code  # noqa: E402
from labkit.instructor.report.gradebook import Gradebook  # noqa: E402

from helpers.classroom import filled  # noqa: E402 - the kit is found by the line above
from helpers.graded import CHECKS  # noqa: E402
from helpers.reference import ROOT  # noqa: E402
from helpers.term import disguised, formed  # noqa: E402

TARGET = 20.0  # [s] on one core


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--students", type=int, default=200)
    parser.add_argument("--lab", default="04_legged_robot")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="labkit-bench-") as folder:
        handed_in(Path(folder), args.lab, args.students)
        cores = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        env = {**os.environ, **cores, "PYTHONPATH": str(HERE.parents[2])}
        before, start = os.times(), time.monotonic()
        command = [sys.executable, "-m", "labkit", "similar", folder, "--lab", args.lab]
        subprocess.run(command, env=env, check=True)
        after, wall = os.times(), time.monotonic() - start
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    print(f"similar code of {args.students}: {wall:.1f} s, {cpu:.1f} s of a core; target {TARGET:.0f} s")


def handed_in(folder, lab, count):
    """Fill a gradebook."""
    sources = [cell for cell in filled(lab)["cells"] if cell["cell_type"] == "code"]
    text = "\n\n".join(cell["source"] for cell in sources if cell["metadata"].get("labkit") == "answer")
    others = {cell["id"]: cell["source"] for cell in sources if cell["metadata"].get("labkit") != "answer"}
    checks = [check for check in definitions(ROOT) if check.lab == lab]
    every = [form for c in checks for one in c.mistakes for form in one.forms] + [
        r.form for c in checks for r in c.right
    ]
    texts = list(dict.fromkeys(filter(None, (formed(text, form) for form in every))))
    with closing(Gradebook(folder / "gradebook.db", seed=1)) as book, book:
        book.set_paper(lab, "paper", CHECKS)
        for number in range(count):
            copied = number % 5 == 4
            answer = texts[(number - copied) % len(texts)]
            id = book.add(lab, f"Student {number}", "", "f", json.dumps(number), "paper", None, False, [], {})
            book.choose(id, [], False)
            book.finish(id)
            code.keep(book, id, Work(sources={**others, "answer": disguised(answer) if copied else answer}))


if __name__ == "__main__":
    main()
