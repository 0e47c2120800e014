"""How fast a class is graded, beside `nbgrader autograde` on the same answers and the same checks.

python tests/benchmarks/grading.py --nbgrader PYTHON [--count 60]   ratios; PYTHON has nbgrader and what labkit needs
                                                                     (on a machine that does nothing else)
python tests/benchmarks/grading.py --hostile                         what a class costs that holds all of the corpus
python tests/benchmarks/grading.py --memory                         peak memory for 50 and for 1000 submissions
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve()
sys.path[:0] = [str(HERE.parents[2]), str(HERE.parents[1])]

import nbformat  # noqa: E402 - the kit is found by the lines above
import psutil  # noqa: E402

from helpers.classroom import LAB, as_file, filled, mistaken  # noqa: E402

ROOT = HERE.parents[2]
TAGS = {"setup", "answer", "check", "hidden"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nbgrader", metavar="PYTHON", help="of an environment with nbgrader")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--hostile", action="store_true")
    parser.add_argument("--large", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="labkit-bench-") as folder:
        folder = Path(folder)
        if args.memory:
            memory(folder)
        elif args.large:
            large(folder)
        elif args.hostile:
            hostile(folder)
        else:
            speed(folder, args.count, args.nbgrader)


def speed(folder, count, python):
    """Wall time for a class and for one, and CPU time of a further submission."""
    ours = {n: labkit(folder, n) for n in (1, count)}
    show("labkit grade --jobs 1", ours, count)
    both = labkit(folder, count, jobs=("--jobs", "2"))["wall"]
    print(f"labkit grade --jobs 2: {both:.1f} s for {count}, {ours[count]['wall'] / both:.2f} times as fast as one")
    if not python:
        return
    theirs = {n: nbgrader(folder, n, python) for n in (1, count)}
    show("nbgrader autograde", theirs, count)
    print(f"throughput, {count} submissions, one process each: {theirs[count]['wall'] / ours[count]['wall']:.1f} times")
    print(f"CPU of a further submission: 1/{further(theirs, count) / further(ours, count):.1f}")
    print(f"a single submission: {ours[1]['wall']:.2f} s to feedback, nbgrader {theirs[1]['wall']:.2f} s to marks")


def show(name, runs, count):
    print(
        f"{name}: one {runs[1]['wall']:.2f} s, {count} {runs[count]['wall']:.1f} s; "
        f"CPU of a further submission {further(runs, count):.3f} s"
    )


def further(runs, count):
    return (runs[count]["cpu"] - runs[1]["cpu"]) / (count - 1)


def measured(command, **options):
    """{wall, cpu, memory} of a command with all that it starts: seconds, and MB of its largest process."""
    before, start = busy(), time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    return {"wall": time.monotonic() - start, "cpu": busy() - before, "memory": memory}


def busy():
    """Seconds that all processors have worked: a worker in a sandbox is no child whose time is told."""
    times = psutil.cpu_times()
    return times.user + times.system


def notebook(i):
    """The i-th submission: every third one has a known mistake."""
    return mistaken(i)[1] if i % 3 == 2 else filled()


def labkit(folder, count, jobs=("--jobs", "1")):
    hand_ins, out = folder / f"class-{count}", folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    for i in range(count):
        if not (hand_ins / f"student {i:04d}").exists():
            as_file(hand_ins / f"student {i:04d}" / f"{LAB}.ipynb", notebook(i))
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "labkit", "grade", str(hand_ins), "--lab", LAB, "--out", str(out), *jobs]
    return measured(command, env=env)


def nbgrader(folder, count, python):
    course = folder / f"course-{count}"
    book = assignment()
    nbformat.write(book, as_file(course / "source" / "lab" / "lab.ipynb", {}))
    tool = [python, "-m", "nbgrader"]
    path = f"{Path(python).parent}{os.pathsep}{os.environ['PATH']}"  # nbgrader starts other programs
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": path}
    measured([*tool, "generate_assignment", "lab", "--force"], cwd=course, env=env)
    for i in range(count):
        given = {cell["id"]: cell["source"] for cell in notebook(i)["cells"]}
        handed = json.loads((course / "release" / "lab" / "lab.ipynb").read_text(encoding="utf-8"))
        for cell in handed["cells"]:
            if cell["metadata"].get("labkit") == "answer":
                cell["source"] = given[cell["id"]]
        as_file(course / "submitted" / f"student{i}" / "lab" / "lab.ipynb", handed)
    return measured([*tool, "autograde", "lab"], cwd=course, env=env)


def assignment():
    """The lab's answers and graded checks alone, without its pictures, as an assignment of nbgrader."""
    book = nbformat.read(ROOT / "solutions" / f"{LAB}.ipynb", as_version=4)
    wanted = [c for c in book.cells if c.cell_type == "code" and TAGS & set(c.metadata.get("tags", []))]
    for cell in wanted:
        cell.outputs, cell.execution_count = [], None
        cell.source = cell.source.replace("check = exam.check", "")
        cell.metadata.pop("tags", None)
    book.cells = wanted
    return book


def memory(folder):
    peaks = {}
    for count in (50, 1000):
        peaks[count] = one_peak(folder, count)
        print(f"{count} submissions: largest process {peaks[count]:.0f} MB", flush=True)
    print(f"ratio {peaks[1000] / peaks[50]:.2f}")


def one_peak(folder, count):
    code = (
        f"import sys; sys.path[:0] = {[str(HERE.parent), *sys.path[:2]]!r}; import grading, pathlib; "
        f"print(grading.labkit(pathlib.Path({str(folder)!r}), {count}, jobs=())['memory'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return float(done.stdout)


def hostile(folder):
    """Time and memory of the trusted side for the corpus with honest students, beside as many honest ones alone."""
    from helpers.hostile import CODE, hand_in  # it is of no use to the other benchmarks

    canary = folder / "canary"
    canary.mkdir(mode=0o777)
    count = max(100, len(CODE) + 20)
    for kind in ("honest", "mixed"):
        for i in range(count if kind == "honest" else count - len(CODE)):
            as_file(folder / kind / f"student {i:04d}" / f"{LAB}.ipynb", notebook(i))
    hand_in(folder / "mixed", canary)
    runs = {kind: trusted(folder / kind, folder / f"{kind} out") for kind in ("honest", "mixed")}
    for kind, (wall, peak, used_up) in runs.items():
        print(
            f"{count} {kind}: {wall:.1f} s, largest process of the trusted side {peak:.0f} MB, limits {used_up:.0f} s"
        )
    (honest, *_), (mixed, _, used_up) = runs["honest"], runs["mixed"]
    print(f"{mixed:.1f} s, where twice the honest ones and the limits are {2 * honest + used_up:.1f} s")


CALL, TOTAL = 1, 4  # seconds of the processor, of which the corpus uses up all that it gets


def trusted(hand_ins, out):
    """(seconds, MB of the largest process outside the sandbox, seconds of workers that were stopped) of a grading."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), "LABKIT_CANARY": "1"}
    command = [sys.executable, "-m", "labkit", "grade", str(hand_ins), "--lab", LAB, "--out", str(out)]
    limits = ["--call", str(CALL), "--total", str(TOTAL), "--jobs", "2"]
    start, peak, workers = time.monotonic(), 0, {}
    process = psutil.Popen([*command, *limits], env=env, stdout=subprocess.DEVNULL)
    while process.poll() is None:
        try:
            for one in process.children(recursive=True):
                line = " ".join(one.cmdline())
                if "sandbox.worker" not in line:
                    peak = max(peak, one.memory_info().rss)
                elif not one.children():
                    used = one.cpu_times()
                    workers[one] = used.user + used.system
            peak = max(peak, process.memory_info().rss)
        except psutil.Error:
            continue
        time.sleep(0.05)
    assert process.returncode == 0
    return time.monotonic() - start, peak / 1e6, sum(used for used in workers.values() if used > CALL)


def large(folder):
    """What a submission of 300 MB costs among others."""
    plain = min(labkit(folder, 1)["wall"] for _ in range(3))
    book = folder / "class-1" / "too large" / f"{LAB}.ipynb"
    as_file(book, {})
    with open(book, "wb") as file:
        file.write(b'{"nbformat": 4, "cells": [], "x": "')
        for _ in range(300):
            file.write(b"x" * 10**6)
        file.write(b'"}')
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    times = []
    for _ in range(3):
        shutil.rmtree(folder / "out", ignore_errors=True)
        command = [
            sys.executable,
            "-m",
            "labkit",
            "grade",
            str(folder / "class-1"),
            "--lab",
            LAB,
            "--out",
            str(folder / "out"),
            "--jobs",
            "1",
        ]
        start = time.monotonic()
        done = subprocess.run(command, capture_output=True, text=True, env=env)
        times.append(time.monotonic() - start)
        assert done.returncode == 1, done.stdout
    print(f"300 MB more: {min(times) - plain:.2f} s")


if __name__ == "__main__":
    main()
