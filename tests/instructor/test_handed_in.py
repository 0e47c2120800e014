"""No right work loses a mark, whatever a student's tools did to the file; and the rehearsal is the exam."""

import re

import pytest

from labkit.notebook.read import cells_of
from labkit.notebook.rehearse import Rehearsal, checks_of, given, subjects
from labkit.notebook.session import Session

from helpers.classroom import blank, filled
from helpers.handed_in import CHANGES
from helpers.inside import examine
from helpers.reference import LABS


def rehearsed(lab, book):
    """{cell of the released notebook: what its check says} as `labkit check` finds it."""
    session = Session(cells_of(book))
    checks = checks_of(f"{lab}.ipynb", session.calls)
    session.supply(given(checks))
    list(session.run(subjects(checks)))
    said = {check: Rehearsal(session).judge(check) for check in checks}
    calls = {cell["id"]: re.search(r'^check\("([\w-]+)"', cell["source"], re.MULTILINE) for cell in blank(lab)["cells"]}
    return {id: said[call[1]] for id, call in calls.items() if call}


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
