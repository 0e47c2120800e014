"""What was handed in is entered into the gradebook, with what its student and the instructor must know of it."""

import json
import os
from argparse import Namespace
from contextlib import closing
from datetime import datetime
from pathlib import Path

import pytest

from labkit.instructor.exam import paper
from labkit.instructor.intake.collect import Submissions
from labkit.instructor.intake.submission import LONGEST
from labkit.instructor.policy import ruled
from labkit.instructor.records import BY_HAND, OPEN, CommandError, Mark
from labkit.instructor.register import register
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.report.tables import GRADES
from labkit.instructor.report.taken import take_hand_marks

from helpers.classroom import LAB, as_file, filled

NEWEST = {
    "attempts": None,
    "due": None,
    "late": None,
    "regrade": None,
    "moodle": None,
    "canvas": None,
    "submissions": "class",
}


def registered(folder, **rules):
    """(jobs, notes of the instructor, results) of the class in a folder."""
    sheet = paper.read(LAB)
    with closing(Gradebook(folder / "gradebook.db")) as grades:
        grades.set_paper(sheet.lab, sheet.digest, sheet.checks)
        with Submissions(folder / "class") as submissions, grades:
            jobs, notes = register(grades, sheet, submissions, Namespace(**{**NEWEST, **rules}), str(folder))
        return jobs, notes, ruled(grades, LAB)


def hand_in(folder, book, name=f"{LAB}.ipynb", day=1):
    path = as_file(folder / "class" / "Ada" / name, book)
    when = datetime(2026, 11, day).timestamp()
    os.utime(path, (when, when))


def test_what_is_too_long_to_be_graded_or_shown_is_told(tmp_path):
    long = filled(answer_kf="#" * (LONGEST + 1), answer_q1="?" * (LONGEST + 1), own=["x = 1", "#" * (LONGEST + 1)])
    hand_in(tmp_path, long)
    (job,), _, (ada,) = registered(tmp_path)
    assert ada.notes == [
        f"The code of cell 'answer-kf' has more than {LONGEST} characters and was left out.",
        f"The code of cell {len(long['cells'])} has more than {LONGEST} characters and was left out.",
        "Nothing in the notebook defines `KF`.",
        f"Of cell 'answer-q1' only the first {LONGEST} characters are shown.",
    ]
    cells = json.loads(Path(job.work).read_text(encoding="utf-8"))["cells"]
    assert len(ada.answers["answer-q1"]) == LONGEST and not any(len(cell["source"]) > LONGEST for cell in cells)


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


def test_marks_by_hand_are_taken_from_the_table_that_was_written_last_or_before(tmp_path):
    hand_in(tmp_path, filled(answer_q1="An answer."))
    registered(tmp_path)
    table = tmp_path / "grades.csv"
    with closing(Gradebook(tmp_path / "gradebook.db")) as grades:
        (ada,) = grades.results(LAB)
        ada.marks = [Mark("answer-q1", None, 2.0, OPEN)]
        table.write_text(f"{','.join(GRADES)}\nAda,{LAB},answer-q1,1.5,2,open,Good.\n")
        for _ in range(2):
            grades.wrote([ada])
            take_hand_marks(grades, table)
            (now,) = grades.results(LAB)
            assert [(mark.points, mark.reason) for mark in now.marks if mark.status == BY_HAND] == [(1.5, "Good.")]
            ada = now
        table.write_text(table.read_text().replace("1.5", "7"))
        with pytest.raises(CommandError, match="more than"):
            take_hand_marks(grades, table)


def test_canvas_students_are_called_as_in_its_gradebook_in_later_runs_too(tmp_path):
    as_file(tmp_path / "class" / f"lovelaceada_101_5001_{LAB}.ipynb", filled(answer_q1="So."))
    as_file(tmp_path / "class" / f"zakl_102_5002_{LAB}.ipynb", {})
    (tmp_path / "canvas.csv").write_text(
        'Student,ID,Section,Lab 1 (7)\n    Points Possible,,,20\n"Lovelace, Ada",101,A,\n"Żak, Łukasz",102,A,\n',
        encoding="utf-8",
    )
    _, _, before = registered(tmp_path)
    assert [result.student for result in before] == ["lovelaceada", "zakl"]
    with closing(Gradebook(tmp_path / "gradebook.db")) as grades:
        grades.hand(before[0], "answer-q1", 1.0, "Good.")
    for gradebook in (tmp_path / "canvas.csv", None):
        _, _, results = registered(tmp_path, canvas=gradebook)
        assert [result.student for result in results] == ["Ada Lovelace", "Łukasz Żak"]
        assert {mark.check: mark.points for mark in results[0].marks}["answer-q1"] == 1
