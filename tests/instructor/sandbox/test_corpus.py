"""Hostile and broken code: no wrong answer gets a mark, nothing leaks, nothing is harmed, the others' marks stay."""

import csv
import html
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from labkit.checks import stored

from helpers.classroom import LAB, as_file, filled
from helpers.hostile import CODE, hand_in
from helpers.reference import ROOT

pytest.importorskip("nbval")
pytestmark = pytest.mark.slow

TOLD = re.compile(r"TOLD ?(\[|-?\d|\{')")  # an input told; the student's own source line may say TOLD {u}
KINDS = {  # what the outcomes of hostile.py are made of
    "parts": {"check-stack", "grade-stack", "check-repeat", "grade-repeat"},
    "stack": {"check-stack", "grade-stack"},
    "blind": {"grade-no-landmark"},
    "check": {"check-kf"},
    "filter": {"grade-other-map", "grade-other-noise", "grade-one-landmark", "grade-many", "grade-honest"},
}


def levels():
    """The sandbox levels that this machine reaches."""
    from labkit.instructor.sandbox.choose import look

    return sorted({found.sandbox.level for found in look() if found.sandbox}, reverse=True)


def test_this_machine_has_a_sandbox():
    if os.environ.get("LABKIT_REQUIRE_SANDBOX") == "1":
        assert max(levels(), default=0) >= 3


# A process for each level, where tests are shared out by such groups.
LEVELS = [pytest.param(level, marks=pytest.mark.xdist_group(f"level {level}")) for level in (4, 3, 2)]


@pytest.fixture(scope="module", params=LEVELS)
def graded(request, tmp_path_factory):
    """Of the whole corpus at one level: rows of grades.csv by student; folders: of results, canary, temporary files."""
    if request.param not in levels():
        pytest.skip(f"this machine has no sandbox of level {request.param}")
    base = tmp_path_factory.mktemp("corpus")
    canary = base / "canary"
    canary.mkdir()
    canary.chmod(0o777)
    hand_in(base / "class", canary)
    for name in ("aaa honest", "zzz honest"):
        as_file(base / "class" / name / f"{LAB}.ipynb", filled())
    # Its workers are told from others' by this name, which is in their command lines.
    temporary = Path(tempfile.mkdtemp(prefix="labkit-corpus-"))
    temporary.chmod(0o755)
    done = labkit(
        "grade",
        base / "class",
        "--lab",
        LAB,
        "--out",
        base / "out",
        "--level",
        request.param,
        "--call",
        "0.5",
        "--total",
        "2",
        LABKIT_CANARY=str(canary),
        TMPDIR=str(temporary),
    )
    assert done.returncode == 0, done.stdout + done.stderr
    rows = {}
    with open(base / "out" / "grades.csv", encoding="utf-8-sig", newline="") as file:
        for row in csv.DictReader(file):
            rows.setdefault(row["student"], []).append(row)
    yield rows, base / "out", canary, temporary
    shutil.rmtree(temporary)


def labkit(*arguments, **variables):
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", **variables}
    command = [sys.executable, "-m", "labkit", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", env=env)


LEFT = 0.7  # of the points of a check whose filter is right but for one thing that `predict` does


@pytest.mark.parametrize("case", CODE, ids=[case[0] for case in CODE])
def test_a_case_has_its_outcome(graded, case):
    rows, *_ = graded
    name, _, _, outcome, words = case
    marks = [row for row in rows[re.sub(r"\W", "-", name)] if row["status"] not in ("open", "blank")]
    passed = {row["check"] for row in marks if row["status"] == "passed"}
    reasons = "\n".join(row["reason"] for row in marks)
    assert {row["status"] for row in marks} <= {"passed", "partly", "failed", "not run"}, reasons
    if outcome is not None:
        assert passed == set().union(*(KINDS[kind] for kind in outcome)), reasons
    assert passed == {row["check"] for row in marks} or words in reasons
    assert all(row["points"] == "0" for row in marks if row["status"] in ("failed", "not run"))
    # What it left right of the filter counts, as it would beside any other mistake.
    partly = [row for row in marks if row["status"] == "partly"]
    assert all(float(row["points"]) <= LEFT * float(row["max_points"]) + 1e-9 for row in partly), partly


@pytest.mark.parametrize("student", ["aaa honest", "zzz honest"])
def test_the_others_get_their_points(graded, student):
    rows, *_ = graded
    assert all(row["status"] in ("passed", "open", "blank") for row in rows[student])


def test_long_texts_are_cut(graded):
    rows, out, *_ = graded
    assert max(len(row["reason"]) for of in rows.values() for row in of) < 3000
    assert max(path.stat().st_size for path in out.rglob("*.html")) < 400_000


def test_a_filter_that_turns_wrong_later_does_not_get_all(graded):
    rows, *_ = graded
    assert any(row["status"] == "partly" for row in rows["right-at-first--wrong-later"])


@pytest.mark.parametrize("name", [case[0] for case in CODE if case[0].startswith("answers with")])
def test_an_answer_that_is_none_passes_no_visible_check(graded, name):
    rows, *_ = graded
    assert {row["status"] for row in rows[name.replace(" ", "-")] if row["check"].startswith("check-")} <= {
        "failed",
        "partly",
    }


def test_nothing_hidden_reaches_a_student(graded):
    rows, out, *_ = graded
    pages = {path.stem: html.unescape(path.read_text(encoding="utf-8")) for path in out.rglob("feedback/**/*.html")}
    assert len(pages) == len(CODE) + 2
    for row in (row for of in rows.values() for row in of if row["check"].startswith("grade-")):
        assert not TOLD.search(row["reason"])
    assert not TOLD.search(pages["tells-hidden-inputs-in-the-words-of-a-check"])
    # On the notebook's own inputs, which all know, `stack` is called so often (everything runs twice).
    public = 2 * sum(len(s["calls"]) for s in stored("cartesian-stack")["scenarios"])
    own = "from labkit.instructor.exam.exam import Exam"  # a student's own line, which is shown
    for page in (page.replace(own, "") for page in pages.values()):
        assert all(int(times) <= public for times in re.findall(r"SEEN (\d+)", page))
        hidden = page.split("hidden check")[1:]
        assert not any(TOLD.search(part[:600]) for part in hidden)
        assert "exam." not in page and "drive(" not in page and "BEGIN SOLUTION" not in page


def test_nothing_outside_is_touched(graded):
    canary = graded[2]
    assert list(canary.iterdir()) == []
    about = canary.stat()
    assert about.st_mode & 0o777 == 0o777 and about.st_mtime > 1e9
    assert not hasattr(os, "listxattr") or os.listxattr(canary) == []


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="only Linux lists processes there")
def test_no_process_is_left(graded):
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = process.joinpath("cmdline").read_bytes()
        except OSError:
            continue
        assert str(graded[3]).encode() not in command, command
    assert list(graded[3].iterdir()) == []  # and no file
