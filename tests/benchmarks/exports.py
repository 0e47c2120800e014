"""Whether other graders give a class the marks of `labkit grade`: nbgrader, and Gradescope's container by its layout.

python tests/benchmarks/exports.py [--count 60] [--gradescope 6]   LABKIT_NBGRADER names the Python that has nbgrader
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve()
sys.path[:0] = [str(HERE.parents[2]), str(HERE.parents[1])]

from labkit.instructor.exam.paper import read  # noqa: E402

from helpers import exports  # noqa: E402 - the kit is found by the lines above
from helpers.classroom import LAB, a_class  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--gradescope", type=int, default=6, metavar="N", help="so many of them")
    args = parser.parse_args()
    pupils = a_class(args.count)
    books = {f"student{number:03d}": pupil.notebooks[-1][1] for number, pupil in enumerate(pupils)}
    with tempfile.TemporaryDirectory(prefix="labkit-exports-") as folder:
        folder = Path(folder)
        ours = timed("labkit grade", lambda: exports.labkit(folder, books))
        theirs = timed("nbgrader", lambda: exports.nbgrader(folder / "course", books))
        compare("nbgrader", ours, theirs)
        packed = exports.export("gradescope", LAB, out=folder / "zips") / f"{LAB}.zip"
        root = exports.container(folder, packed)
        some = list(books)[:: max(1, len(books) // args.gradescope)][: args.gradescope]
        checks = {check.title: check.id for check in read(LAB).checks}
        found = timed("Gradescope's layout", lambda: [exports.gradescope(root, books[one]) for one in some])
        marks = {(one, checks[t["name"]]): t["score"] for one, said in zip(some, found) for t in said["tests"]}
        compare("Gradescope's layout", {key: ours[key] for key in marks}, marks)


def timed(name, work):
    start = time.monotonic()
    result = work()
    print(f"{name}: {time.monotonic() - start:.0f} s", flush=True)
    return result


def compare(name, ours, theirs):
    """Print in how many marks two graders differ, and in which."""
    keys = sorted(ours.keys() | theirs.keys())
    pairs = [(key, ours.get(key, "none"), theirs.get(key, "none")) for key in keys]
    odd = [pair for pair in pairs if pair[1] != pair[2]]
    partly = sum(points not in (None, 0) and points % 1 > 0 for points in ours.values())
    students = len({who for who, _ in keys})
    print(f"{name}: {len(keys)} marks of {students} students, {partly} with tenths: {len(odd)} differ")
    for (who, check), mine, other in odd:
        print(f"  {who} {check}: {mine} here, {other} there")


if __name__ == "__main__":
    main()
