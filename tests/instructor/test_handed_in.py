"""No right work loses a mark, whatever a student's tools did to the file; and the rehearsal is the exam."""

import os
import re

import pytest

from labkit.instructor.exam.exam import OTHERS
from labkit.notebook.read import cells_of
from labkit.notebook.rehearse import Rehearsal, checks_of, given, subjects
from labkit.notebook.session import Session

from helpers.classroom import blank, filled
from helpers.forms import forms, in_notebook
from helpers.handed_in import CHANGES
from helpers.inside import examine
from helpers.reference import GRADED, LABS


def rehearsed(lab, book):
    """{cell of the released notebook: what its check says} as `labkit check` finds it."""
    session = Session(cells_of(book))
    checks = checks_of(f"{lab}.ipynb", session.calls)
    session.supply(given(checks))
    list(session.run(subjects(checks)))
    said = {check: Rehearsal(session).judge(check) for check in checks}
    calls = {cell["id"]: re.search(r'^check\("([\w-]+)"', cell["source"], re.MULTILINE) for cell in blank(lab)["cells"]}
    return {id: said[call[1]] for id, call in calls.items() if call}


def told(error):
    """The first line of what a check in the examination says, or '' if it passed."""
    return "" if error is None else str(getattr(error, "summary", error)).split("\n")[0]


def differences(lab, book, name):
    """{cell: (said by the exam, said by the rehearsal)} of the visible checks where one passes and the other does not.

    That the exam also tries other numbers of the same kind is the one thing that it has beyond a rehearsal.
    """
    mine = rehearsed(lab, book)
    graded = {id: told(error) for id, error in examine(lab, book, name, only=mine).items()}
    said = {id: (graded[id], " ".join(mine[id])) for id in mine}
    return {id: two for id, two in said.items() if bool(two[0]) != bool(two[1]) and two[0] != OTHERS}


@pytest.mark.slow
@pytest.mark.parametrize("lab", GRADED)
def test_the_rehearsal_is_the_exam_for_right_and_wrong_forms(lab):
    """A few of each lab; all of them (ten minutes) with the variable LABKIT_ALL_FORMS."""
    every = forms(lab, "right") | forms(lab, "mistakes")
    step = 1 if os.environ.get("LABKIT_ALL_FORMS") else max(1, len(every) // 6)
    books = {name: in_notebook(lab, *of) for name, of in list(every.items())[::step]}
    unlike = {name: differences(lab, book, name) for name, book in books.items() if book}
    assert unlike and {name: two for name, two in unlike.items() if two} == {}


@pytest.mark.parametrize("lab", [LABS[0], pytest.param(LABS[2], marks=pytest.mark.slow)])
@pytest.mark.parametrize("change", CHANGES)
def test_right_work_gets_all_points_in_both(tmp_path, monkeypatch, lab, change):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    book = filled(lab)
    CHANGES[change](book["cells"])
    graded = examine(lab, book)
    assert {id: error for id, error in graded.items() if error is not None} == {}
    assert {id: lines for id, lines in rehearsed(lab, book).items() if lines} == {}
