"""What was handed in is entered into the gradebook, with what its student and the instructor must know of it."""

import os
from argparse import Namespace
from contextlib import closing
from datetime import datetime

import pytest

from labkit.instructor.command import register
from labkit.instructor.exam import paper
from labkit.instructor.intake.collect import Submissions
from labkit.instructor.intake.submission import LONGEST
from labkit.instructor.report.gradebook import Gradebook

from helpers.classroom import LAB, as_file, filled

NEWEST = {"attempts": "newest", "due": None, "late": "count", "regrade": None}


def registered(folder, **rules):
    """(jobs, notes of the instructor, results) of the class in a folder."""
    sheet = paper.read(LAB)
    with closing(Gradebook(folder / "gradebook.db")) as grades:
        grades.set_paper(sheet.lab, sheet.digest, sheet.checks)
        with Submissions(folder / "class") as submissions, grades:
            jobs, notes = register(grades, sheet, submissions, Namespace(**{**NEWEST, **rules}))
        return jobs, notes, list(grades.results(LAB))


def hand_in(folder, book, name=f"{LAB}.ipynb", day=1):
    path = as_file(folder / "class" / "Ada" / name, book)
    when = datetime(2026, 11, day).timestamp()
    os.utime(path, (when, when))


def test_what_is_too_long_to_be_graded_or_shown_is_told(tmp_path):
    long = filled(answer_kf="#" * (LONGEST + 1), answer_q1="?" * (LONGEST + 1), own=["x = 1", "#" * (LONGEST + 1)])
    hand_in(tmp_path, long)
    (job,), _, (ada,) = registered(tmp_path)
    assert ada.notes == [
        f"Of cell 'answer-q1' only the first {LONGEST} characters are shown.",
        f"The code of cell 'answer-kf' has more than {LONGEST} characters and was left out.",
        f"The code of cell {len(long['cells'])} has more than {LONGEST} characters and was left out.",
    ]
    assert len(ada.answers["answer-q1"]) == LONGEST and not any(len(cell["source"]) > LONGEST for cell in job.cells)


@pytest.mark.parametrize("rule, days", [("newest", [3]), ("first", [2]), ("best", [2, 3])])
def test_of_several_attempts_those_of_the_rule_are_graded(tmp_path, rule, days):
    hand_in(tmp_path, {}, f"{LAB} (1).ipynb", day=1)  # it cannot be graded, so another one may count
    for day in (2, 3):
        hand_in(tmp_path, filled(answer_q1=f"On day {day}."), f"{LAB} ({day}).ipynb", day)
    jobs, _, (ada,) = registered(tmp_path, attempts=rule)
    assert len(jobs) == len(days) and ada.answers["answer-q1"] == f"On day {days[0]}."
    assert ada.notes == [f"3 attempts: the {rule} counts."]


def test_a_late_hand_in_is_told_or_does_not_count(tmp_path):
    hand_in(tmp_path, filled(), day=21)
    (_,), _, (ada,) = registered(tmp_path, due=datetime(2026, 11, 20))
    assert ada.late and ada.notes == ["Handed in late."]
    jobs, _, (ada,) = registered(tmp_path, due=datetime(2026, 11, 20), late="ignore")
    assert not jobs and ada.problem == "It was handed in late, and late hand-ins do not count."
