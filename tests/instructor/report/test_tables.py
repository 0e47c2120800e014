"""The class's tables as they are written."""

from datetime import UTC, datetime

import pytest

from labkit.instructor.records import FAILED, Mark, Result
from labkit.instructor.report.hand_marks import read_hand_marks
from labkit.instructor.report.tables import write_grades, write_summary, written_for_excel

from helpers.graded import LAB, result, table


def test_grades_have_a_row_for_each_mark(tmp_path):
    path = tmp_path / "grades.csv"
    results = [
        result("Ada Lovelace"),
        result("Łukasz Żak", first=0.5),
        Result("Eve", lab=LAB, problem="The notebook is not JSON."),
    ]
    write_grades(path, results)
    assert path.read_bytes().startswith(b"\xef\xbb\xbf")
    assert table(path) == [
        ["student", "lab", "check", "points", "max_points", "status", "reason"],
        ["Ada Lovelace", LAB, "kf", "2", "2", "passed", ""],
        ["Ada Lovelace", LAB, "map", "3", "3", "passed", ""],
        ["Ada Lovelace", LAB, "q1", "", "5", "open", ""],
        ["Łukasz Żak", LAB, "kf", "0.5", "2", "failed", "The sign of K is wrong."],
        ["Łukasz Żak", LAB, "map", "3", "3", "passed", ""],
        ["Łukasz Żak", LAB, "q1", "", "5", "open", ""],
        ["Eve", LAB, "", "", "", "error", "The notebook is not JSON."],
    ]
    assert read_hand_marks(path, results) == {}


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "'=1", "''-1", '=LINK("x";1)'])
def test_no_text_of_a_person_becomes_a_formula(tmp_path, text):
    results = [Result(text, "1", LAB, marks=[Mark("kf", 0.0, 1.0, FAILED, text)], source=text, notes=[text])]
    for write in (write_grades, write_summary):
        write(tmp_path / "t.csv", results)
        assert not any(cell.startswith(tuple("=+-@\t\r")) for row in table(tmp_path / "t.csv") for cell in row)
    write_grades(tmp_path / "t.csv", results)
    assert read_hand_marks(tmp_path / "t.csv", results) == {}


def test_summary(tmp_path):
    when = datetime(2025, 3, 1, 12, 0, tzinfo=UTC)
    notes = ["Two attempts.", "Late."]
    one = result("Ada", "007", source="ada.ipynb", when=when, late=True, level=3, notes=notes)
    write_summary(tmp_path / "s.csv", [one, Result("Eve", lab=LAB, problem="No notebook.")])
    header, *lines = table(tmp_path / "s.csv")
    rows = [dict(zip(header, line)) for line in lines]
    assert datetime.fromisoformat(rows[0].pop("handed_in")) == when
    ada = ["Ada", "007", LAB, "5", "10", "50.0", "1", "yes", "ada.ipynb", "3", "Two attempts. Late.", "0"]
    ada += ["5", ""]  # before the rules, of which there are none
    assert list(rows[0].values()) == ada
    assert list(rows[1].values()) == ["Eve", "", LAB, "", "0", "", "0", "", "", "", "0", "No notebook.", "0", "", ""]


def test_no_colours_of_a_terminal_in_a_table(tmp_path):
    reason = "NameError: \x1b[0;31mexam\x1b[0m is not defined\x1b[0"
    marks = [Mark("kf", 0, 2, "error", reason)]
    write_grades(tmp_path / "g.csv", [Result("Ada", lab=LAB, marks=marks)])
    assert table(tmp_path / "g.csv")[1][-1] == "NameError: exam is not defined"


def test_tables_for_a_spreadsheet_with_decimal_commas_are_read_back_with_marks_by_hand(tmp_path):
    path, results = tmp_path / "grades.csv", [result("Ada; or Bo, 1.5", first=0.5)]
    for write in (write_summary, write_grades):
        write(path, results, excel=True)
        assert path.read_bytes().startswith(b"\xef\xbb\xbf") and written_for_excel(path)
    text = path.read_text(encoding="utf-8-sig")
    assert text.splitlines()[:2] == [
        "student;lab;check;points;max_points;status;reason",
        f'"Ada; or Bo, 1.5";{LAB};kf;0,5;2;failed;The sign of K is wrong.',
    ]
    assert read_hand_marks(path, results) == {}
    path.write_text(text.replace("q1;;5;open;", "q1;2,5;5;open;gut; 1.5, ja".replace("gut;", "gut")), "utf-8-sig")
    ((where, mark),) = read_hand_marks(path, results).items()
    assert where[2] == "q1" and mark == (2.5, "gut 1.5, ja")


def test_a_table_keeps_the_form_that_it_has(tmp_path):
    path = tmp_path / "grades.csv"
    assert not written_for_excel(path)
    path.write_text("")
    assert not written_for_excel(path)
    write_grades(path, [result("Ada")])
    assert not written_for_excel(path)
    write_grades(path, [], excel=True)
    assert written_for_excel(path)
