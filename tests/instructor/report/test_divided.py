"""Points of a filter's parts: kept, told to the student and of the class, and written as people write them."""

import re
from contextlib import closing

from labkit.instructor.records import BY_HAND, FAILED, PARTLY, PASSED, Check, Mark, Result, points_of
from labkit.instructor.report.class_overview import class_page
from labkit.instructor.report.divided import divided, lost
from labkit.instructor.report.feedback import feedback_page
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.report.hand_marks import read_hand_marks
from labkit.instructor.report.moodle import fill_moodle
from labkit.instructor.report.tables import write_grades, write_summary

from helpers.graded import LAB, sound, table

WEIGHTS = {"motion": 20, "spread": 25, "H": 45, "runs": 10}
CHECKS = [
    Check("kf", "KF: single steps", 3, subject="KF", parts=WEIGHTS),
    Check("map", "KF: another map", 1, hidden=True, subject="KF", parts=WEIGHTS),
    Check("none", "KF: nothing in view", 1, hidden=True, subject="KF", parts=WEIGHTS),
    Check("h", "h", 2),
]
RIGHT = ("motion", "spread")


def partly(check, parts=RIGHT):
    points = points_of(check.points, WEIGHTS, parts)
    return Mark(check.id, points, check.points, PARTLY if points else FAILED, "No.", parts=tuple(parts))


def ada():
    marks = [*map(partly, CHECKS[:2]), Mark("none", 1, 1, PASSED), Mark("h", 2, 2, PASSED)]
    return Result("Ada", "101", LAB, "a.ipynb", marks=marks)


def test_a_table_says_what_each_part_brought_and_sums_up_to_the_points():
    (of,) = divided(ada(), CHECKS)
    assert (of.subject, of.rounded) == ("KF", "0.1")  # 1.35 and 0.45, each rounded up
    assert [part.points for part in of.parts] == ["1 of 1", "1.25 of 1.25", "0.45 of 2.25", "0.1 of 0.5"]
    assert ada().points == 1.4 + 0.5 + 1 + 2
    seen = sound(feedback_page(ada(), CHECKS, "Lab"))
    for told in ("◐in part", "1.4 of 3", "0.5 of 1", "4.9 of 7 points", "What of KF is right", "H0.45 of 2.25"):
        assert told in seen.text, told


def test_there_is_no_table_where_nothing_was_divided():
    whole = Result("Ada", marks=[Mark(c.id, c.points, c.points, PASSED) for c in CHECKS])
    nothing = Result("Ada", marks=[partly(c, ()) for c in CHECKS])
    hand = Result("Ada", marks=[Mark(c.id, 0.5, c.points, BY_HAND) for c in CHECKS])
    for result in (whole, nothing, hand, Result("Ada", problem="No file.")):
        assert divided(result, CHECKS) == []
        assert "What of" not in feedback_page(result, CHECKS, "Lab")


def test_the_class_page_counts_students_by_part():
    bela = Result("Bela", marks=[partly(CHECKS[0], ("H",)), partly(CHECKS[1], ("H",))])
    eve = Result("Eve", marks=[partly(check, ()) for check in CHECKS[:3]])
    found = lost([ada(), bela, bela, eve], CHECKS)
    assert [(one.title.rpartition(": ")[2], one.students) for one in found] == [
        ("how the estimate moves", 2),
        ("its covariance", 2),
        ("H", 1),
    ]
    page = class_page([ada(), bela, eve], CHECKS, "Lab", {})
    text = sound(page).text
    assert "What of a filter is not right" in text and "KF: H" in text
    row = page[page.index("KF: single steps") :].partition("</tr>")[0]
    assert re.findall(r'"n">(\d+)<', row) == ["3", "0", "2", "1", "0"]  # points, passed, in part, not passed, not run


def test_the_gradebook_keeps_parts(tmp_path):
    with closing(Gradebook(tmp_path / "book.db", seed=7)) as book:
        id = book.add(LAB, "Ada", "", "a.ipynb", "d", "paper", None, False, [], {})
        book.set_paper(LAB, "paper", CHECKS)
        book.choose(id, [], False)
        book.mark(id, "kf", 1.4, PARTLY, "No.", parts=RIGHT)
        assert book.result(id).marks[0].parts == RIGHT and book.checks(LAB, "paper") == CHECKS


def test_tenths_of_points_are_written_as_people_write_them(tmp_path):
    for excel, points in ((False, "1.4"), (True, "1,4")):
        write_grades(tmp_path / "grades.csv", [ada()], excel)
        write_summary(tmp_path / "summary.csv", [ada()], excel)
        comma = ";" if excel else ","
        assert table(tmp_path / "grades.csv", comma)[1][3:6] == [points, "3", "partly"]
        assert table(tmp_path / "summary.csv", comma)[1][3:6] == [
            "4,9" if excel else "4.9",
            "7",
            "70,0" if excel else "70.0",
        ]
        assert read_hand_marks(tmp_path / "grades.csv", [ada()]) == {}
    for of, grade in (("20.00", "14"), ("7,00", '"4,9"')):
        sheet = "Identifier,Full name,Email address,Status,Grade,Maximum Grade,Grade can be changed\n"
        text = f'{sheet}Participant 101,Ada,a@b.c,Submitted,,"{of}",Yes\n'
        (tmp_path / "moodle.csv").write_text(text, encoding="utf-8")
        fill_moodle(tmp_path / "moodle.csv", tmp_path / "filled.csv", [ada()])
        assert f'Submitted,{grade},"{of}"' in (tmp_path / "filled.csv").read_text(encoding="utf-8-sig")
