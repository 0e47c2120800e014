"""What anybody wrote, as a cell of a table: never a formula, and the same text again when it is read."""

import csv
import html
import io
import random

import pytest

from labkit.instructor.records import FAILED, Mark, Result
from labkit.instructor.report.hand_marks import read_hand_marks
from labkit.instructor.report.moodle import fill_moodle
from labkit.instructor.report.tables import write_grades, write_summary
from labkit.instructor.report.texts import clean, guard, guard_html, unguard

from helpers.graded import LAB, table

BEGINS = tuple("=+@-\t\r\uff1d\uff0b\uff20\uff0d\ufe66\ufe62\ufe6b\ufe63\u2212")
FORMULAS = [
    "=1",
    "a;=cmd|' /C calc'!A0",
    "a; =1",
    'a;"=1"',
    'a;""=1',
    "a;'=1",
    "a;;=1",
    "\uff1d1",
    "a;\uff1d1",
    "a;\u200b=1",
    "a;\xa0+1",
    "a;\t-1",
    "a\t=1",
    "a\r=1",
    "a\n@SUM(A1)",
    "  =1",
    '"=1',
    "\ufeff=1",
    "a,=1;b,-1",
]


def starts(text, comma):
    """How the cells begin that a spreadsheet which splits at `comma` finds in a text that it does not see as quoted."""
    return [cell.strip(' "\xa0\u200b\ufeff') for line in text.splitlines() for cell in line.split(comma)]


@pytest.mark.parametrize("text", FORMULAS)
@pytest.mark.parametrize("excel", [False, True])
def test_no_cell_of_any_spreadsheet_begins_as_a_formula(tmp_path, text, excel):
    results = [Result(text, text, LAB, marks=[Mark("kf", 0.0, 1.0, FAILED, text)], source=text, notes=[text])]
    for write in (write_grades, write_summary):
        write(tmp_path / "t.csv", results, excel)
        raw = (tmp_path / "t.csv").read_text(encoding="utf-8-sig")
        cells = [cell for row in table(tmp_path / "t.csv", ";" if excel else ",") for cell in row]
        for cell in [*cells, *starts(raw, ";"), *(starts(raw, ",") if excel else [])]:
            assert not cell.startswith(BEGINS), cell
    write_grades(tmp_path / "t.csv", results, excel)
    assert read_hand_marks(tmp_path / "t.csv", results) == {}


def test_a_guarded_text_is_the_same_when_it_is_read():
    pick = random.Random(1)
    for comma in ",;":
        for _ in range(20_000):
            text = clean("".join(pick.choices("=+-@;, '\"a\uff1d\u2212", k=pick.randrange(9))))
            assert unguard(guard(text, comma), comma) == text


def test_a_table_that_a_spreadsheet_saved_in_its_own_form_says_the_same(tmp_path):
    results = [Result("Ada", lab=LAB, marks=[Mark("kf", 0.0, 1.0, FAILED, "x = ['a', '-b', -0.5]; -1")])]
    for excel in (False, True):
        write_grades(tmp_path / "t.csv", results, excel)
        rows = table(tmp_path / "t.csv", ";" if excel else ",")
        other = io.StringIO()
        csv.writer(other, delimiter="," if excel else ";").writerows(rows)
        (tmp_path / "t.csv").write_text(other.getvalue(), encoding="utf-8")
        assert read_hand_marks(tmp_path / "t.csv", results) == {}


@pytest.mark.parametrize("text", [*FORMULAS, "a <= b", "a;= -+3", "x & = 3"])
def test_students_see_their_own_signs_in_comments_of_moodle(text):
    cell = guard_html(text, ",")
    assert html.unescape(cell) == clean(text)
    assert not any(one.startswith(BEGINS) for one in starts(cell, ";"))


def test_a_comment_of_moodle_begins_no_formula_behind_a_semicolon(tmp_path):
    (tmp_path / "w.csv").write_text("Identifier,Grade,Maximum Grade,Feedback comments\nParticipant 1,,1.00,\n")
    marks = [Mark("kf", 0.0, 1.0, FAILED, "It gave 3;=cmd|' /C calc'!A0 <= 4.")]
    fill_moodle(tmp_path / "w.csv", tmp_path / "m.csv", [Result("Ada", "1", LAB, marks=marks)])
    raw = (tmp_path / "m.csv").read_text()
    assert not any(cell.startswith(BEGINS) for cell in starts(raw, ";")) and "=" not in raw


def test_one_line_for_a_terminal_has_nothing_that_acts():
    assert clean("a\x1b[31mb\x1b[0m\x9b2Jc\x90d\u202ee\r\nf\x07 \u200b\ud83d") == "abcde f"
