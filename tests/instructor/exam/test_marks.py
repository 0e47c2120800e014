"""Marks are fair: every right answer gets them all, no known mistake does, and only a clean pass of nbval counts."""

import dataclasses
import json
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np
import pytest

from labkit import Robot, make_filter, random_map, replay, simulate
from labkit.checks import CheckError
from labkit.checks.feedback import FilterError
from labkit.instructor.authoring.build import ROOT
from labkit.instructor.exam import jobs as jobs_of, paper, pool
from labkit.instructor.exam.exam import Exam
from labkit.instructor.intake import submission
from labkit.instructor.records import ERROR, PASSED
from labkit.instructor.sandbox import levels, proxy
from labkit.instructor.sandbox.launch import make_runtime
from labkit.notebook.read import cells_of
from labkit.team import TeamNoise, scenarios

from helpers.classroom import filled, usable
from helpers.forms import forms, in_notebook
from helpers.inside import examine
from helpers.reference import GRADED, LABS

pytest.importorskip("nbval")
TIME = {"call": 600, "total": 3600}  # a slow machine is no reason to fail


@pytest.fixture(scope="module")
def box():
    """The best sandbox of this machine, or none at all where there is none."""
    folder = tempfile.mkdtemp(prefix="labkit-marks-")  # pytest's own are closed to root's workers
    os.chmod(folder, 0o755)
    found = [one.sandbox for one in levels.find(make_runtime(folder)) if one.sandbox]
    yield max(found, key=lambda one: one.level)
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def marks(box, tmp_path_factory):
    """A function of notebooks, {name: dictionary}, and a paper: {name: {check: mark}}, by a process that stays."""
    folder = tmp_path_factory.mktemp("work")
    with pool.Local(1) as here:

        def grade(books, sheet, seed=1, time=TIME):
            names, jobs = list(books), []
            for number, name in enumerate(names):
                work = submission.assemble(sheet.released, cells_of(books[name]))
                jobs.append(jobs_of.Job(number, name, jobs_of.keep(folder / f"{number}.json", work)))
            found = {name: {} for name in names}
            for kind, id, item in here.grade(jobs_of.Room(sheet, seed, jobs_of.way(box), time), jobs):
                if kind == "mark":
                    found[names[id]][item["check"]] = item
            return found

        yield grade


@pytest.mark.slow
@pytest.mark.parametrize("lab", GRADED)
def test_every_right_form_gets_all_points_whatever_is_drawn(lab):
    right = forms(lab, "right")
    books = {name: in_notebook(lab, *of) for name, of in right.items()}
    books = {name: book for name, book in books.items() if book}
    assert len(books) > len(right) // 2
    books |= {f"as in the solution {n}": filled(lab) for n in range(2)}
    uses = {cell.id: cell.uses for cell in paper.read(lab).cells}
    bad = {}
    for name, book in books.items():
        subject = right.get(name, ("",))[0]  # a form of `stack` that the solution's KF cannot use is right all the same
        about = {check for check, names in uses.items() if not subject or subject in names}
        assert about, name
        for check, error in examine(lab, book, name, seed=11, only=about).items():
            if error is not None:
                bad[name, check] = error
    assert bad == {}


@pytest.mark.slow
@pytest.mark.parametrize("lab", GRADED)
def test_no_known_mistake_gets_all_points(lab):
    shown = {cell.id for cell in paper.read(lab).cells if not cell.hidden}
    every = list(forms(lab, "mistakes").items())
    books = {name: in_notebook(lab, *of) for name, of in every[:: max(1, len(every) // 20)]}
    books = {name: book for name, book in books.items() if book}
    assert len(books) >= 10
    for name, book in books.items():
        wrong = [error for error in examine(lab, book, name, only=shown).values() if error]
        assert wrong and all(isinstance(error, FilterError | CheckError) and str(error) for error in wrong), name


@pytest.mark.slow
@pytest.mark.parametrize("lab", GRADED)
def test_in_sandbox_kernel_and_nbval_right_is_right_and_wrong_is_wrong(lab, marks):
    """What the two tests above show in one process is so with all that stands between a student and a mark."""
    mistake = next(of for of in forms(lab, "mistakes").values() if usable(lab, of[1]))
    sheet = paper.read(lab)
    found = marks({"right": filled(lab), "wrong": in_notebook(lab, *mistake), "again": filled(lab)}, sheet)
    for name in ("right", "again"):
        assert {check: mark["status"] for check, mark in found[name].items() if mark["status"] != PASSED} == {}
        assert sum(m["points"] for m in found[name].values()) == sum(c.points for c in sheet.checks if not c.hand)
    assert {mark["status"] for mark in found["wrong"].values()} <= {"passed", "partly", "failed", "not run"}
    wrong = [mark for mark in found["wrong"].values() if mark["status"] != PASSED]
    assert wrong and all(mark["reason"] for mark in wrong)
    assert all((mark["points"] > 0) == (mark["status"] == "partly") for mark in wrong)


@pytest.mark.parametrize("lab", GRADED)
def test_a_paper_has_what_an_instructor_needs(lab):
    sheet = paper.read(lab)
    own = [check for check in sheet.checks if not check.hand]
    assert (
        len(own) >= (2 if lab.startswith("07") else 8)
        and any(check.hidden for check in own)
        and any(not check.hidden for check in own)
    )
    written = [check for check in sheet.checks if check.hand]
    assert written and all("points" in check.rubric and check.question for check in written)
    assert sum(check.points for check in sheet.checks) >= 20
    for folder, whole in (("solutions", True), ("notebooks", False)):
        cells = json.loads((ROOT / folder / f"{lab}.ipynb").read_text(encoding="utf-8"))["cells"]
        graded = [c["metadata"]["nbgrader"] for c in cells if c["metadata"].get("nbgrader", {}).get("grade")]
        assert {g["grade_id"] for g in graded} == {c.id for c in sheet.checks if whole or not c.hidden}
        assert all(g["schema_version"] == 3 and g["points"] > 0 for g in graded)


@pytest.mark.parametrize("lab", GRADED)
def test_a_lab_is_whole_in_its_hidden_checks(lab):
    """The maps, noises and cases that the checks promise are there, by what they are called."""
    titles = " ".join(check.title for check in paper.read(lab).checks if check.hidden)
    if lab.startswith("02"):
        assert all(word in titles for word in ("whole runs", "near the bounds", "random maps", "never, always"))
    else:
        words = ("another map", "other noise", "single landmark", "nothing in view", "many landmarks", "NEES")
        if lab.startswith("06"):
            words = (
                "other angles",
                "all sides",
                "all directions",
                "false readings among",
                "all robots drive",
                "another gate",
                "without any reading",
                "NEES",
            )
        if lab.startswith("07"):
            words = ("other arms", "near and far", "across", "good and bad")
        if lab.startswith("04"):
            words = ("other poses", "another walk", "other noise", "kidnapping", "NEES", "across")
        if lab.startswith("05"):
            words = ("other trapezoids", "other grids", "other covariances", "surprises", "±180°")
        assert all(word in titles for word in words)


def test_a_failed_check_says_what_to_mend_first_and_shows_slips_of_the_text(box):
    """From the cells alone: the student's own words about them would not be believed."""
    lab = "03_range_bearing_ekf"
    sheet, edits = paper.read(lab), [("-dx / r, -dy / r", "dx / r, dy / r"), ("+ K @ innovation", "+ K * K")]
    cells = submission.assemble(sheet.released, cells_of(filled(lab, edits))).cells
    student = proxy.Student(box, proxy.Notebook(cells), sheet.subjects)
    try:
        with pytest.raises(CheckError) as caught:
            Exam(lab).check("range-bearing-kf", student.find("KF"))
    finally:
        student.end()
    assert "First mend `jacobian`: its own check does not pass yet." in caught.value.details
    assert any("`K * K` multiplies entry by entry." in line for line in caught.value.details)


def test_what_is_drawn_is_the_students_own_and_can_be_repeated():
    exam = Exam(LABS[0])
    exam.current = "grade-other-map"

    def draw(seed, student):
        exam.seed, exam.student = seed, student
        return exam.rng().random()

    assert draw(1, "Ada") == draw(1, "Ada")
    assert len({draw(1, "Ada"), draw(1, "Bela"), draw(2, "Ada")}) == 3


def test_a_stand_in_of_a_teams_filter_is_as_good_as_the_students_own(box):
    lab, log = "06_observers", scenarios.cross(rng=1)
    sheet = paper.read(lab)
    exam = Exam(lab)
    student = proxy.Student(
        box, proxy.Notebook(submission.assemble(sheet.released, cells_of(filled(lab))).cells), sheet.subjects
    )
    told = {"x0": log.truth[0], "P0": 0.01 * np.eye(9), "noise": TeamNoise(), "inflate": 2.0}
    try:
        for KF in ("PaperEKF", "GroupEKF"):
            came = exam.same_run(student.find(KF), log, **told)
            due = exam.history(exam.right(KF)[0], log, **told)
            for name in ("x", "P", "x_prior", "P_prior"):
                np.testing.assert_allclose(getattr(came, name), getattr(due, name), atol=1e-9)
    finally:
        student.end()


CHANGES = [
    ({"printed": "something else\n"}, ERROR),  # prints what the solution does not
    ({"source": "print('passed')\nraise SystemExit"}, ERROR),  # no answer can make it do so
    ({"source": "# NBVAL_SKIP\nprint('passed')"}, ERROR),
    ({"source": "# NBVAL_RAISES_EXCEPTION\nexam.fail('wrong')"}, "failed"),
    ({"source": "exam.fail('wrong')"}, "failed"),
    ({"source": "print('passed')"}, PASSED),
]


@pytest.mark.slow
def test_only_a_clean_pass_counts(marks):
    sheet = paper.read(LABS[0])
    cells = {cell.id: cell for cell in sheet.cells}
    made = [
        dataclasses.replace(cells["grade-many"], id=f"case {n}", parts={}, **of) for n, (of, _) in enumerate(CHANGES)
    ]
    sheet = dataclasses.replace(sheet, cells=[cells["check-stack"], *made])
    found = marks({"Ada": filled()}, sheet)["Ada"]
    assert found.pop("check-stack")["status"] == PASSED
    due = {f"case {n}": status for n, (_, status) in enumerate(CHANGES)}
    assert {check: mark["status"] for check, mark in found.items()} == due
    assert {check: mark["points"] for check, mark in found.items()} == {c: s == PASSED for c, s in due.items()}


@pytest.mark.slow
def test_a_kernel_that_dies_is_an_error(marks):
    """nbval waits for it until the cell's time is up, so that is short here, and nothing else is asked for."""
    sheet = paper.read(LABS[0])
    cell = dataclasses.replace(sheet.cells[-1], source="import os\nos._exit(0)", uses=())
    sheet = dataclasses.replace(sheet, cells=[cell])
    mark = marks({"Ada": filled()}, sheet, time={"call": 1, "total": 1})["Ada"][cell.id]
    assert (mark["status"], mark["points"]) == (ERROR, 0)


def test_a_stand_in_is_as_good_as_the_students_own(box):
    """Step by step through the proxy, in one call, and in this process: the same numbers."""
    lab = LABS[0]
    sheet = paper.read(lab)
    work = submission.assemble(sheet.released, cells_of(filled()))
    student = proxy.Student(box, proxy.Notebook(work.cells), sheet.subjects)
    try:
        KF, own = student.find("KF"), Exam(lab).right("KF")[0]
        log = simulate(Robot((1, -1), 0.05 * np.eye(2), 0.04 * np.eye(2), rng=3), random_map(20, rng=3), steps=25)
        mine = replay(make_filter(own, log), log)
        stepped = replay(make_filter(KF, log), log)
        whole = KF.replay(log, {})
        for name in ("x", "P", "x_prior", "P_prior"):
            # Their sums may be in another order, on another number of threads.
            np.testing.assert_allclose(getattr(stepped, name), getattr(mine, name), atol=1e-12)
            np.testing.assert_allclose(whole[name], getattr(mine, name), atol=1e-12)
        with pytest.raises(proxy.MissingAnswerError):
            student.find("nothing")
    finally:
        student.end()


def test_nothing_of_a_student_lab_imports_grading():
    modules = "sys, labkit, labkit.widgets, labkit.checks, labkit.notebook.session, labkit.notebook.worker"
    code = f"import {modules}; print([m for m in sys.modules if 'instructor' in m])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.strip() == "[]", done.stderr
