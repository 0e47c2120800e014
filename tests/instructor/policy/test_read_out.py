"""What a run tells of the rules: on the console, in the tables, on the pages and in the LMS's files."""

import zipfile
from argparse import Namespace
from contextlib import closing
from datetime import datetime

import pytest

from labkit.instructor import policy
from labkit.instructor.policy import memory
from labkit.instructor.records import PASSED, Check
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.report.output import write_all
from labkit.instructor.report.taken import take_hand_marks
from labkit.instructor.term import overview

from helpers.graded import sound, table

LAB = "01_cartesian_ekf"
CHECKS = [Check("kf", "The filter", 16), Check("q1", "Why?", 4, hand=True)]
PAPER = Namespace(lab=LAB, title="Lab 1", checks=CHECKS)
RULES = f"""
[late]
percent_a_day = 10
[labs.{LAB}]
due = 2026-11-20
[[groups]]
members = ["Ada", "Bo"]
"""


@pytest.fixture
def book(tmp_path):
    with closing(Gradebook(tmp_path / "gradebook.db", seed=1)) as book:
        book.set_paper(LAB, "paper", CHECKS)
        yield book


def run(book, **more):
    out = book.path.parent
    nothing = dict.fromkeys(("csv", "moodle", "canvas", "grade_column", "feedback_column", "column"))
    args = Namespace(**{**nothing, "partial": True, **more})
    results = [result for lab in book.labs() for result in policy.ruled(book, lab)]
    assert write_all(book, PAPER, out, args, results) == 0
    return out


def rows(path):
    header, *lines = table(path)
    return {line[0]: dict(zip(header, line)) for line in lines}


def hand_in(book, name, number, day):
    when = datetime(2026, 11, day, 9)
    source = f"all.zip: {name}_{number}_assignsubmission_file_/{LAB}.ipynb"
    id = book.add(LAB, name, number, source, source, "paper", when, False, [], {"q1": "So."})
    book.mark(id, "kf", 16, PASSED)
    book.finish(id)
    book.choose(id, [], False, when)


def two(book):
    """Ada hands in for herself and for Bo, two days late; Cy in time; an older one of Bo's does not count."""
    for name, number, day in (("Bo", "102", 19), ("Ada", "101", 22), ("Cy", "103", 19)):
        hand_in(book, name, number, day)


def test_tables_pages_and_files_of_the_lms_tell_the_points_that_count(book, tmp_path, capsys):
    two(book)
    (tmp_path / "course.toml").write_text(RULES)
    head = "Identifier,Full name,Grade,Maximum Grade,Feedback comments\n"
    people = (("101", "Ada"), ("102", "Bo"), ("103", "Cy"))
    (tmp_path / "w.csv").write_text(head + "".join(f"Participant {n},{name},,20.00,\n" for n, name in people))
    (tmp_path / "c.csv").write_text(
        "Student,ID,Lab 1 (7)\n    Points Possible,,20\n" + "".join(f"{name},{number},\n" for number, name in people)
    )
    out = run(book, moodle=tmp_path / "w.csv", canvas=tmp_path / "c.csv")
    summary = rows(out / "summary.csv")
    assert {name: (row["points"], row["raw_points"], row["late"]) for name, row in summary.items()} == {
        "Ada": ("12.8", "16", "yes"),
        "Bo": ("12.8", "16", "yes"),
        "Cy": ("16", "16", ""),
    }
    cost = "10 % a day, 3.2 of 16 points less."
    assert summary["Ada"]["rules"].endswith(cost) and "Ada handed this in for your group" in summary["Bo"]["rules"]
    moodle = rows(out / "moodle.csv").values()
    assert [row["Grade"] for row in moodle] == ["12.8", "12.8", "16"]
    assert (
        cost in next(iter(moodle))["Feedback comments"] and "not marked yet" in next(iter(moodle))["Feedback comments"]
    )
    assert [row[2] for row in table(out / "canvas.csv")[2:]] == ["12.8", "12.8", "16"]
    pages = {name: sound((out / f"feedback/{LAB}/{name}.html").read_text()).text for name in ("Ada", "Bo", "Cy")}
    assert "12.8 of 20 points" in pages["Ada"] and "16 points before the rules of the course." in pages["Ada"]
    assert cost in pages["Bo"] and "Ada handed this in for your group (Ada, Bo)" in pages["Bo"]
    assert "before the rules" not in pages["Cy"] and "group" not in pages["Cy"]
    with zipfile.ZipFile(out / f"feedback-{LAB}.zip") as archive:
        assert {f"{name}_{number}_assignsubmission_file_/{name}.html" for number, name in people} == {
            *archive.namelist()
        }
    said = capsys.readouterr().out
    assert "Late: 2: Ada (2 days, 3.2 points less), Bo (2 days, 3.2 points less)." in said
    assert "Handed in by another member of their group: 1: Bo (by Ada)." in said
    assert "Mean 13.9 of 16 points marked so far; 2 written answers to be read" in said
    overview = sound((out / f"class-{LAB}.html").read_text()).text
    assert "mean 13.9 of 16 points marked so far" in overview and "2 written answers still to be read" in overview
    assert "by Ada" in overview and "3.2 points less" in overview


def test_what_counts_for_nobody_is_not_there_to_be_marked_and_nothing_is_lost(book, tmp_path):
    two(book)
    run(book)
    assert len(table(tmp_path / "grades.csv")) == 7
    (tmp_path / "course.toml").write_text(RULES)
    raw = book.db.execute("SELECT * FROM mark").fetchall()
    out = run(book)
    assert {student for _, student, _ in book.counting().values()} == {"Ada", "Cy"}  # and in the browser
    grades = table(out / "grades.csv")
    assert [row[0] for row in grades[1:]] == ["Ada", "Ada", "Cy", "Cy"] and grades[1][3] == "16"
    assert "2 answers" in (out / f"to-mark-{LAB}.html").read_text()
    text = (out / "grades.csv").read_text().replace(f"Ada,{LAB},q1,,", f"Ada,{LAB},q1,4,")
    (out / "grades.csv").write_text(text)
    take_hand_marks(book, out / "grades.csv")
    found = {result.student: result.points for result in policy.ruled(book, LAB)}
    assert found == {"Ada": 16, "Bo": 16, "Cy": 16}  # 20 without the rules
    (out / "course.toml").unlink()
    assert {r.student: r.points for r in policy.ruled(book, LAB)} == {"Ada": 20, "Bo": 16, "Cy": 16}
    assert book.db.execute("SELECT * FROM mark").fetchall() == raw


def test_a_mark_finds_its_student_though_the_label_is_another_now(book, tmp_path):
    """Of two students of one name one may not count any more, and the other is called by the name alone."""
    for name, number, day in (("Sam", "1", 22), ("Sam", "2", 19), ("Cy", "3", 21)):
        hand_in(book, name, number, day)
    (tmp_path / "course.toml").write_text('[[groups]]\nmembers = ["Sam (2)", "Cy"]')
    out = run(book)
    (out / "grades.csv").write_text((out / "grades.csv").read_text().replace(f"Sam,{LAB},q1,,", f"Sam,{LAB},q1,3,"))
    take_hand_marks(book, out / "grades.csv")
    assert {(r.student, r.identifier): r.open for r in book.results(LAB)}["Sam", "1"] == 0


def test_other_labs_are_read_out_by_what_their_own_run_said(book, tmp_path):
    two(book)
    memory.remember(book, LAB, {"due": "2026-11-21T09:00:00"}, [])
    (tmp_path / "course.toml").write_text(RULES.split("[labs")[0])
    book.set_paper("02_noise_mismatch", "paper", CHECKS)
    assert rows(run(book) / "summary.csv")["Ada"]["points"] == "14.4"


def test_the_total_of_the_term_goes_by_the_points_that_count_and_by_weights(book, tmp_path):
    two(book)
    other = "02_noise_mismatch"
    book.set_paper(other, "paper", [CHECKS[0]])
    id = book.add(other, "Ada", "101", "a.ipynb", "d", "paper", None, False, [], {})
    book.mark(id, "kf", 8, PASSED)
    book.finish(id)
    book.choose(id, [], False)
    (tmp_path / "course.toml").write_text(f"{RULES}[labs.{other}]\nweight = 3\n")
    totals = {row.label: row.total for row in overview.read(book).rows}
    assert totals == {"Ada": pytest.approx((12.8 / 20 + 3 * 0.5) / 4), "Bo": pytest.approx(0.535), "Cy": 0.2}
