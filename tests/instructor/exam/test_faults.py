"""The machine ends one process of the grader or another, at one moment or another: the marks are the same."""

import csv
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil
import pytest

from helpers.classroom import LAB, as_file, filled, mistaken
from helpers.reference import ROOT

pytest.importorskip("nbval")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="the processes of a sandbox are found as Linux shows them"),
]

ROLES = {  # words of a process's command line
    "grader's process": "labkit.instructor.exam.batch",
    "kernel": "ipykernel_launcher",
    "sandbox": "--die-with-parent",
    "worker": "labkit.instructor.sandbox.worker",
}
FAULTS = {  # what is ended, each as soon as so many checks have been judged
    "workers": [("sandbox", 0), ("worker", 3), ("sandbox", 9), ("worker", 14)],
    "a kernel at its start": [("kernel", 0)],
    "two kernels": [("kernel", 2), ("kernel", 12)],
    "a grader's process": [("grader's process", 5)],
}


@pytest.fixture(scope="module")
def hand_ins(tmp_path_factory):
    """(folder of three hand-ins, their rows in an undisturbed run)."""
    folder = tmp_path_factory.mktemp("faults")
    for name, book in (("Ada", filled()), ("Bela", mistaken(0)[1]), ("Cem", filled())):
        as_file(folder / "class" / name / f"{LAB}.ipynb", book)
    return folder / "class", graded(folder / "class", folder / "calm", [])[0]


def graded(folder, out, faults):
    """(rows of grades.csv, the faults that did not happen) of a grading in which they should."""
    temporary = out.with_name(f"{out.name} temporary")
    temporary.mkdir()
    temporary.chmod(0o755)
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", "TMPDIR": str(temporary)}
    command = [
        sys.executable,
        "-m",
        "labkit",
        "grade",
        folder,
        "--lab",
        LAB,
        "--out",
        out,
        "--jobs",
        "1",
        "--seed",
        "1",
    ]
    process = subprocess.Popen(list(map(str, command)), env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    killer = threading.Thread(target=strike, args=(psutil.Process(process.pid), temporary, faults))
    killer.start()
    said = process.communicate()[0].decode()
    killer.join()
    assert process.returncode == 0, said
    with open(out / "grades.csv", encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file)), faults


def strike(grader, temporary, faults):
    """End what `faults` names when its time has come, and take it off the list."""
    while faults and grader.is_running() and grader.status() != psutil.STATUS_ZOMBIE:
        role, checks = faults[0]
        if judged(temporary) >= checks and (found := processes(grader, ROLES[role])):
            found[0].kill()
            faults.pop(0)
        time.sleep(0.01)


def judged(temporary):
    """How many checks the grader's kernels have judged so far."""
    return sum(path.read_bytes().count(b"\n") for path in temporary.glob("labkit-grade-*/batches/*/said.jsonl"))


def processes(grader, words):
    """Those below the grader's kernels whose command line holds these words, or the kernels and what starts them."""
    found = []
    for process in grader.children(recursive=True):
        try:
            line = " ".join(process.cmdline())
            above = " ".join(" ".join(parent.cmdline()) for parent in process.parents())
        except psutil.Error:
            continue
        inside = words in (ROLES["sandbox"], ROLES["worker"])
        bwrap = line.partition(" ")[0].endswith("bwrap")
        if words in line and (not inside or ROLES["kernel"] in above and bwrap == (words == ROLES["sandbox"])):
            found.append(process)
    return found


@pytest.mark.parametrize("what", FAULTS)
def test_the_marks_are_the_same_whatever_ends(hand_ins, tmp_path, what):
    folder, calm = hand_ins
    if not any(Path(path, "bwrap").is_file() for path in os.environ["PATH"].split(os.pathsep)):
        pytest.skip("who ended a worker is known for sure only in bubblewrap")
    rows, left = graded(folder, tmp_path / "out", list(FAULTS[what]))
    assert rows == calm
    assert not left or what == "workers" and len(left) < 3  # the last ones may come too late
