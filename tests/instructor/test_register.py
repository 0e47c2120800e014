"""What was handed in is entered into the gradebook, with what its student and the instructor must know of it."""

from argparse import Namespace
from contextlib import closing

from labkit.instructor.command import register
from labkit.instructor.exam import paper
from labkit.instructor.intake.collect import open_submissions
from labkit.instructor.intake.submission import LONGEST
from labkit.instructor.report.gradebook import Gradebook

from helpers.classroom import LAB, as_file, filled

RULES = Namespace(attempts="newest", due=None, late="count", regrade=None)


def registered(folder, book, rules=RULES):
    """(jobs, notes of the instructor, results) of a class's folder."""
    as_file(folder / "class" / "Ada" / f"{LAB}.ipynb", book)
    sheet = paper.read(LAB)
    with closing(Gradebook(folder / "gradebook.db")) as grades:
        grades.set_paper(sheet.lab, sheet.digest, sheet.checks)
        with open_submissions(folder / "class") as submissions, grades:
            jobs, notes = register(grades, sheet, submissions, rules)
        return jobs, notes, list(grades.results(LAB))


def test_what_is_too_long_to_be_graded_or_shown_is_told(tmp_path):
    long = filled(answer_kf="#" * (LONGEST + 1), answer_q1="?" * (LONGEST + 1), own=["x = 1", "#" * (LONGEST + 1)])
    number = len(long["cells"])
    (job,), _, (ada,) = registered(tmp_path, long)
    assert ada.notes == [
        f"Of cell 'answer-q1' only the first {LONGEST} characters are shown.",
        f"The code of cell 'answer-kf' has more than {LONGEST} characters and was left out.",
        f"The code of cell {number} has more than {LONGEST} characters and was left out.",
    ]
    assert len(ada.answers["answer-q1"]) == LONGEST and not any(len(cell["source"]) > LONGEST for cell in job.cells)
