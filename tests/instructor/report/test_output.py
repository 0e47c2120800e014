"""What a run leaves behind, from a gradebook that is filled in by hand."""

import os
import zipfile
from argparse import Namespace
from contextlib import closing
from dataclasses import replace

import pytest

from labkit.instructor.console import Progress
from labkit.instructor.records import ERROR, PASSED, Check
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.report.output import write_all
from labkit.instructor.report.taken import take_hand_marks

from helpers.graded import curve, table

CHECKS = [Check("kf", "The filter", 2), Check("q1", "Why?", 3, hand=True)]
PAPER = Namespace(lab="lab3", title="Lab 3", checks=CHECKS)
NOTHING = Namespace(
    csv=None, moodle=None, canvas=None, grade_column=None, feedback_column=None, column=None, partial=False
)


@pytest.fixture
def book(tmp_path):
    with closing(Gradebook(tmp_path / "gradebook.db")) as book:
        book.set_paper("lab3", "paper", CHECKS)
        for name, number in (("Ada", "101"), ("Bela", "102")):
            source = f"all.zip: {name}_{number}_assignsubmission_file_/lab3.ipynb"
            id = book.add("lab3", name, number, source, name, "paper", None, False, [], {"q1": "So."})
            book.mark(id, "kf", 2, PASSED)
            book.finish(id, curve() if name == "Ada" else None)
            book.choose(id, [], False)
        yield book


def test_tables_pages_and_moodles_own_zip_and_sheet(book, tmp_path, capsys):
    (tmp_path / "w.csv").write_text("Identifier,Grade,Maximum Grade,Feedback comments\nParticipant 101,,10.00,\n")
    args = Namespace(**{**vars(NOTHING), "moodle": tmp_path / "w.csv", "partial": True})
    assert write_all(book, PAPER, tmp_path, args) == 0
    pages = {name: (tmp_path / "feedback" / "lab3" / f"{name}.html").read_text() for name in ("Ada", "Bela")}
    assert "data:image/png" in pages["Ada"] and "data:image/png" not in pages["Bela"]
    for name in ("class-lab3.html", "to-mark-lab3.html"):
        assert "Ada" in (tmp_path / name).read_text()
    assert len(table(tmp_path / "grades.csv")) == 5 and len(table(tmp_path / "summary.csv")) == 3
    with zipfile.ZipFile(tmp_path / "feedback-lab3.zip") as archive:
        assert "Ada_101_assignsubmission_file_/Ada.html" in archive.namelist()
    assert table(tmp_path / "moodle.csv")[1][1:] == ["4", "10.00", "Points: 2 of 5. Why?: not marked yet."]
    told = capsys.readouterr().out
    assert "2 of 2 submissions graded, lab3. Mean 2.0 of 2 points marked so far; 2 written answers to be read" in told
    assert "Graded, but not in the table: 1 (Bela)." in told


def test_checks_that_could_not_be_run_are_told_once_for_each_reason(book, tmp_path, capsys):
    for n in range(2):
        id = book.add("lab3", f"Student {n}", "", "a.ipynb", str(n), "paper", None, False, [], {})
        book.mark(id, "kf", 0, ERROR, "\x1b[31mNo sandbox.\x1b[0m")
        book.choose(id, [], False)
    assert write_all(book, PAPER, tmp_path, NOTHING) == 1
    assert "2 checks could not be run, the first of Student 0, The filter: No sandbox." in capsys.readouterr().out


def test_blank_answers_block_no_grade_and_are_counted_apart(tmp_path, capsys):
    with closing(Gradebook(tmp_path / "gradebook.db", seed=1)) as book:
        book.set_paper("lab3", "paper", PAPER.checks)
        id = book.add("lab3", "Ada", "101", "a.ipynb", "1", "paper", None, False, [], {"q1": " "})
        book.mark(id, "kf", 2, PASSED)
        book.finish(id)
        book.choose(id, [], False)
        result = book.result(id)
        (tmp_path / "w.csv").write_text("Identifier,Grade,Maximum Grade,Feedback comments\nParticipant 101,,10.00,\n")
        write_all(book, PAPER, tmp_path, Namespace(**{**vars(NOTHING), "moodle": tmp_path / "w.csv"}))
        Progress(1).tell(result)
    assert table(tmp_path / "moodle.csv")[1][1:] == ["4", "10.00", "Points: 2 of 5. Why?: no answer."]
    assert ["Ada", "lab3", "q1", "0", "3", "blank", ""] in table(tmp_path / "grades.csv")
    header, row = table(tmp_path / "summary.csv")
    assert dict(zip(header, row))["open"] == "0" and dict(zip(header, row))["blank"] == "1"
    told = capsys.readouterr().out
    assert "Mean 2.0 of 5 points; 0 written answers to be read" in told
    assert "1 question without an answer, at 0 points." in told and "Ada: 2 of 5, 1 without an answer" in told
    page, overview = ((tmp_path / name).read_text() for name in ("feedback/lab3/Ada.html", "class-lab3.html"))
    assert "so far" not in page and "You gave no answer." in page and "to be read" not in page
    assert "1 question without an answer" in overview and "1 without an answer" in overview


def graded(book, name, number, source):
    """Enter a submission with full marks; `source` is the file as it came."""
    id = book.add("lab3", name, number, source, source, "paper", None, False, [], {"q1": ""})
    book.mark(id, "kf", 2, PASSED)
    book.finish(id)
    book.choose(id, [], False)


def test_each_member_of_a_group_gets_the_mark_and_the_page(book, tmp_path, capsys):
    graded(book, "Group A", "7", "all.zip: Group A_7_assignsubmission_file/lab3.ipynb")
    graded(book, "Group B", "203", "all.zip: Group B_203_assignsubmission_file_lab3.ipynb")  # 203 is a member of A
    members = [(201, "Cleo", "Group A"), (202, "Dora", "Group B"), (203, "Emil_F", "Group A"), (204, "Finn", "-")]
    rows = "".join(f"Participant {number},{name},{group},,5.00,Yes,\n" for number, name, group in members)
    head = "Identifier,Full name,Group,Grade,Maximum Grade,Grade can be changed,Feedback comments\n"
    (tmp_path / "w.csv").write_text(head + rows)
    write_all(book, PAPER, tmp_path, Namespace(**{**vars(NOTHING), "moodle": tmp_path / "w.csv"}))
    assert [row[3] for row in table(tmp_path / "moodle.csv")[1:]] == ["2", "2", "2", ""]
    told = capsys.readouterr().out
    assert (
        "Filled in: the grades of 3 students." in told and "In the table without a graded submission: 1 (Finn)" in told
    )
    with zipfile.ZipFile(tmp_path / "feedback-lab3.zip") as archive:
        names = archive.namelist()
        assert not any(b"class-lab3" in archive.read(name) for name in names)  # it is not where a student reads
    assert b"../../class-lab3.html" in (tmp_path / "feedback" / "lab3" / "Group-A.html").read_bytes()
    assert "Group A_7_assignsubmission_file/Group-A.html" in names
    assert "Group B_203_assignsubmission_file_Group-B.html" in names
    assert "Cleo_201_assignsubmission_file_/Group-A.html" in names
    assert "Dora_202_assignsubmission_file_/Group-B.html" in names
    assert not any("Emil" in name for name in names)  # Moodle would take 203 for group B


def test_a_member_who_handed_in_alone_keeps_the_own_mark(book, tmp_path):
    graded(book, "Group A", "7", "all.zip: Group A_7_assignsubmission_file/lab3.ipynb")
    graded(book, "Cleo", "201", "all.zip: Cleo_201_assignsubmission_file/lab3.ipynb")
    book.db.execute("UPDATE mark SET points = 1 WHERE submission = (SELECT max(id) FROM submission)")
    (tmp_path / "w.csv").write_text(
        "a,b,c,d,Grade,Maximum Grade,g,h\nTeilnehmer/in201,Cleo,x,Gruppe: Group A,,5.00,Ja,\n"
        "Teilnehmer/in202,Dora,x,group a,,5.00,Ja,\nTeilnehmer/in203,Emil,y,GROUP A,,5.00,Ja,\n"
    )
    write_all(book, PAPER, tmp_path, Namespace(**{**vars(NOTHING), "moodle": tmp_path / "w.csv"}))
    assert [row[4] for row in table(tmp_path / "moodle.csv")[1:]] == ["1", "2", "2"]


@pytest.mark.parametrize("all_of_them", [False, True])
def test_older_moodle_names_a_group_and_who_handed_in(book, tmp_path, all_of_them):
    for number, name in ((201, "Cleo"), (202, "Dora"))[: 1 + all_of_them]:
        graded(
            book, f"Group-A-{name}", str(number), f"all.zip: Group-A-{name}_{number}_assignsubmission_file_/lab3.ipynb"
        )
    (tmp_path / "w.csv").write_text(
        "Identifier,Full name,Group,Grade,Maximum Grade\nParticipant 201,Cleo,Group-A,,5.00\n"
        "Participant 202,Dora,Group-A,,5.00\nParticipant 203,Emil,Group-B,,5.00\n"
    )
    write_all(book, PAPER, tmp_path, Namespace(**{**vars(NOTHING), "moodle": tmp_path / "w.csv"}))
    assert [row[3] for row in table(tmp_path / "moodle.csv")[1:]] == ["2", "2", ""]


def test_two_students_of_one_name_are_no_group(book, tmp_path):
    graded(book, "Sam Lee", "201", "all.zip: Sam Lee_201_assignsubmission_file/lab3.ipynb")
    (tmp_path / "w.csv").write_text(
        "a,b,c,d,Grade,Maximum Grade,g,h\nx201,Sam Lee,s,,,5.00,Ja,\nx202,Sam Lee,s,,,5.00,Ja,\n"
    )
    write_all(book, PAPER, tmp_path, Namespace(**{**vars(NOTHING), "moodle": tmp_path / "w.csv"}))
    assert [row[4] for row in table(tmp_path / "moodle.csv")[1:]] == ["2", ""]


def test_canvas_gets_pages_under_the_numbers_that_it_goes_by(book, tmp_path):
    graded(book, "Ada Lovelace", "501", "s.zip: lovelaceada_LATE_501_9001_lab3-2.ipynb")
    write_all(book, PAPER, tmp_path, NOTHING)
    with zipfile.ZipFile(tmp_path / "feedback-lab3.zip") as archive:
        assert "lovelaceada_LATE_501_9001_lab3-2.html" in archive.namelist()


def test_a_check_that_could_not_be_run_is_never_a_number(book, tmp_path, capsys):
    book.db.execute("UPDATE mark SET status = ?, points = 0 WHERE submission = 1", (ERROR,))
    book.hand(book.result(1), "q1", 3.0, "Good.")
    (tmp_path / "w.csv").write_text(
        "Identifier,Grade,Maximum Grade,Feedback comments\nParticipant 101,,10.00,\nParticipant 102,1,10.00,\n"
    )
    (tmp_path / "c.csv").write_text("Student,ID,Lab 3 (7)\n    Points Possible,,5\nAda,101,\nBela,102,\n")
    given = {"moodle": tmp_path / "w.csv", "canvas": tmp_path / "c.csv", "partial": True}
    assert write_all(book, PAPER, tmp_path, Namespace(**{**vars(NOTHING), **given})) == 1
    assert [row[1:] for row in table(tmp_path / "moodle.csv")[1:]] == [
        ["", "10.00", ""],
        ["4", "10.00", "Points: 2 of 5. Why?: not marked yet."],
    ]
    assert [row[2] for row in table(tmp_path / "canvas.csv")[2:]] == ["", "2"]
    assert ["Ada", "lab3", "kf", "", "2", "error"] in [row[:6] for row in table(tmp_path / "grades.csv")]
    header, row, _ = table(tmp_path / "summary.csv")
    ada = dict(zip(header, row))
    assert (ada["points"], ada["percent"], ada["notes"]) == ("", "", "1 check could not be run.")
    told = capsys.readouterr().out
    assert "Left as they were, since checks could not be run: 1 (Ada); run the same command again." in told
    assert "Mean 2.0 of 2 points marked so far" in told
    page, overview = ((tmp_path / name).read_text() for name in ("feedback/lab3/Ada.html", "class-lab3.html"))
    assert "1 check could not be run: that is no fault of yours" in page and "– of 2" in page
    assert "1 check could not be run" in overview and "mean 2 of 2 points marked so far" in overview


@pytest.mark.slow
def test_killed_at_any_file_the_next_run_takes_nothing_for_a_persons_mark(book, tmp_path, monkeypatch):
    files = sorted(["grades.csv", "summary.csv", "feedback-lab3.zip", "class-lab3.html", "to-mark-lab3.html"])
    write_all(book, PAPER, tmp_path, NOTHING)
    replace = os.replace
    for number in range(7):
        kept = {name: (tmp_path / name).read_bytes() for name in files}
        book.db.execute("UPDATE mark SET points = ? WHERE submission = 1", (number % 2,))  # graded anew
        left = [number]

        def killed(*paths, left=left):
            left[0] -= 1
            if left[0] < 0:
                raise KeyboardInterrupt
            return replace(*paths)

        for _ in range(3):  # more often than tables are kept for one run
            left[0] = number
            monkeypatch.setattr(os, "replace", killed)
            with pytest.raises(KeyboardInterrupt):
                write_all(book, PAPER, tmp_path, NOTHING)
            monkeypatch.setattr(os, "replace", replace)
        assert number or {name: (tmp_path / name).read_bytes() for name in files} == kept
        take_hand_marks(book, tmp_path / "grades.csv")
        assert not book.db.execute("SELECT * FROM hand").fetchall()
        write_all(book, PAPER, tmp_path, NOTHING)
        assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize("asked", [True, False])
def test_model_answers_come_with_an_option_when_all_are_read(book, tmp_path, asked):
    checks = [CHECKS[0], replace(CHECKS[1], rubric="RUBRIC", model="MODEL")]
    paper, args = Namespace(**{**vars(PAPER), "checks": checks}), Namespace(**vars(NOTHING), show_answers=asked)
    page = tmp_path / "feedback" / "lab3" / "Ada.html"
    for number, result in enumerate([*book.results("lab3")]):
        book.hand(result, "q1", 2, "")
        write_all(book, paper, tmp_path, args)
        assert ("MODEL" in page.read_text(encoding="utf-8")) == (asked and number == 1)
