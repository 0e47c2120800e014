"""What a person filled in in grades.csv comes back from any spreadsheet, and what is no mark is told."""

import csv
import io
import random

import pytest

from labkit.instructor.records import FAILED, OPEN, CommandError, Mark, Result
from labkit.instructor.report.hand_marks import read_hand_marks
from labkit.instructor.report.names import labels
from labkit.instructor.report.tables import write_grades

from helpers.graded import LAB, result, table


def some():
    return [result("Ada Lovelace", "101"), result("Łukasz Żak", "102", first=0.5), result("王小明", "103", written=4.0)]


def line_of(rows, student, check):
    return next(i for i, row in enumerate(rows) if (row[0], row[2]) == (student, check))


def saved(path, results, *changes, delimiter=",", encoding="utf-8-sig", comma=False, end="\r\n", all_quoted=False):
    """grades.csv of `results` after a person set (student, check, points[, reason]) and saved it again."""
    write_grades(path, results)
    rows = table(path)
    for student, check, points, *reason in changes:
        row = rows[line_of(rows, student, check)]
        row[3] = points
        row[6:] = reason or row[6:]
    if comma:
        rows[1:] = [[c.replace(".", ",") if n in (3, 4) else c for n, c in enumerate(row)] for row in rows[1:]]
    text = io.StringIO()
    quoting = csv.QUOTE_ALL if all_quoted else csv.QUOTE_MINIMAL
    csv.writer(text, delimiter=delimiter, lineterminator=end, quoting=quoting).writerows(rows)
    mark = b"\xfe\xff" if encoding == "utf-16-be" else b""
    path.write_bytes(mark + text.getvalue().encode(encoding, "replace"))
    return path


def edit(path, change):
    """Change the rows of a written grades.csv by `change(rows)`."""
    rows = table(path)
    change(rows)
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows(rows)


SAVED = {
    "as written": {},
    "Excel DE": {"delimiter": ";", "comma": True},
    "Excel DE, old CSV": {"delimiter": ";", "comma": True, "encoding": "cp1252"},
    "Excel, Unicode text": {"delimiter": "\t", "encoding": "utf-16"},
    "Excel, Unicode text, big end first": {"delimiter": "\t", "encoding": "utf-16-be"},
    "LibreOffice": {"encoding": "utf-8", "end": "\n"},
    "LibreOffice, all quoted": {"encoding": "utf-8", "end": "\n", "all_quoted": True},
    "Numbers": {"encoding": "utf-8", "delimiter": ";"},
    "decimal commas between commas": {"comma": True},
    "old Mac line ends": {"end": "\r"},
}


@pytest.mark.parametrize("how", SAVED.values(), ids=SAVED)
def test_a_filled_in_table_comes_back_from_any_spreadsheet(tmp_path, how):
    bob = 'O\'Neil, "Bob"'
    results = [result("Zoë Ünal", "1"), result(bob, "2", first=0.5), result("Jo; Do", "3", written=4.0)]
    path = saved(tmp_path / "g.csv", results, **how)
    assert read_hand_marks(path, results) == {}
    path = saved(path, results, ("Zoë Ünal", "q1", "2.5", "Größe fehlt"), (bob, "kf", "2"), **how)
    assert read_hand_marks(path, results) == {
        ("Zoë Ünal", LAB, "q1"): (2.5, "Größe fehlt"),
        (bob, LAB, "kf"): (2.0, "The sign of K is wrong."),
    }


@pytest.mark.parametrize("text", ["2", "2.0", "2,0", " 2 ", "2,000", "2.", "+2", "\u00a02"])
def test_the_same_number_in_other_letters_is_no_change(tmp_path, text):
    assert read_hand_marks(saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "kf", text)), some()) == {}


def test_a_changed_comment_on_given_points_counts(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("王小明", "q1", "4", "Very good."))
    assert read_hand_marks(path, some()) == {("王小明", LAB, "q1"): (4.0, "Very good.")}


def test_rows_and_columns_may_be_moved_and_headers_capitalised(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "q1", "5"))

    def change(rows):
        rows[0] = ["Student", "LAB", "Check ", "Points", "Max Points", "Status", "Reason"]
        rows[1:] = rows[:0:-1]
        rows[:] = [["my own", *row[::-1], "", ""] for row in rows] + [[""] * 10, []]

    edit(path, change)
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (5.0, "")}


def test_columns_that_are_not_needed_may_be_deleted(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "q1", "5"))

    def change(rows):
        rows[:] = [[row[0], *row[2:4]] for row in rows]

    edit(path, change)
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (5.0, "")}


def test_emptied_points_take_nothing_away(tmp_path):
    notes = []
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "kf", ""), ("Ada Lovelace", "q1", "", "see me"))
    assert read_hand_marks(path, some(), notes) == {}
    assert notes == [
        "line 2: Ada Lovelace, kf: the points were emptied; its 2 points stay.",
        "line 4: Ada Lovelace, q1: there is a comment but no points, so it stays open.",
    ]


def setting(column, *texts, row=3):
    """A change that puts `texts` into one row (by default that of Ada's q1) from `column` on."""
    return lambda rows: rows[row].__setitem__(slice(column, column + len(texts)), texts)


WRONG = {
    "a word": (setting(3, "good"), "line 4: the points 'good' are not a number; write one such as 1.5"),
    "a date": (setting(3, "01. Mai"), "line 4: .* made a date of it"),
    "negative": (setting(3, "-1"), "line 4: the points '-1' are less than 0"),
    "too much": (setting(3, "5.5"), "line 4: the points '5.5' are more than q1 gives, 5"),
    "nan": (setting(3, "NaN"), "line 4: the points 'NaN' are not a number"),
    "inf": (setting(3, "inf"), "line 4: the points 'inf' are not a number"),
    "huge": (setting(3, "9" * 400), "line 4: .* not a number"),
    "student": (setting(0, "Adda"), "line 4: there is no student 'Adda'; leave the columns student, lab and"),
    "no student": (setting(0, ""), "line 4: there is no student ''"),
    "check": (setting(2, "q9"), "line 4: 'Ada Lovelace' has no check 'q9'; leave the columns"),
    "no check": (setting(2, "", "3"), "line 4: there are points .'3'., but no check"),
    "lab": (setting(1, "02_x"), "line 4: 'Ada Lovelace' has no lab '02_x' here"),
    "rows that disagree": (lambda rows: rows.append([*rows[1][:3], "1"]), "line 11: disagrees with line 2 on kf"),
    "a bare decimal comma": (setting(3, "1", "5", "5", "open"), "line 4: .* decimal comma in quotes"),
    "missing column": (setting(3, "score", row=0), "no column 'points' in line 1, .* put it back"),
    "column twice": (setting(6, "points", row=0), "two columns 'points'"),
}


@pytest.mark.parametrize(("change", "text"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_a_mark_is_told_by_line(tmp_path, change, text):
    path = tmp_path / "g.csv"
    write_grades(path, some())
    edit(path, change)
    with pytest.raises(CommandError, match=text):
        read_hand_marks(path, some())


def test_all_problems_are_told_at_once(tmp_path):
    results = [result(f"Student {n}") for n in range(12)]
    path = saved(tmp_path / "g.csv", results, *((f"Student {n}", "q1", "x") for n in range(12)))
    with pytest.raises(CommandError) as told:
        read_hand_marks(path, results)
    assert str(told.value).count("\n  line ") == 10 and str(told.value).endswith("and 2 more")


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "is empty"),
        (b"\xef\xbb\xbf \r\n;;;\r\n", "is empty"),
        (b"PK\x03\x04rest", "is a workbook"),
        (b"student\0\x81", "not a text file"),
        (None, "cannot be read"),
    ],
)
def test_a_file_that_is_no_table_is_told(tmp_path, data, text):
    path = tmp_path / "g.csv"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(CommandError, match=text):
        read_hand_marks(path, some())


def test_letters_lost_by_an_old_encoding_are_told(tmp_path):
    path = saved(tmp_path / "g.csv", [*some(), result("Zoë")], encoding="cp1252")
    with pytest.raises(CommandError, match=r"'.ukasz .ak'(.|\n)*CSV UTF-8"):
        read_hand_marks(path, [*some(), result("Zoë")])


def test_rows_that_agree_may_be_there_twice(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "q1", "3"))
    edit(path, lambda rows: rows.append([*rows[3][:3], "3,0", *rows[3][4:]]))
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (3.0, "")}


def test_students_with_one_name_are_told_apart(tmp_path):
    results = [result("Ada Lovelace", "123"), result("ada  lovelace", "124"), result("Bob", "125")]
    assert labels(results) == ["Ada Lovelace (123)", "ada lovelace (124)", "Bob"]
    path = saved(tmp_path / "g.csv", results, ("ada lovelace (124)", "q1", "1"))
    assert read_hand_marks(path, results) == {("ada lovelace (124)", LAB, "q1"): (1.0, "")}
    saved(path, [results[0]])  # written when there was one Ada only
    with pytest.raises(CommandError, match=r"now 'Ada Lovelace \(123\)' or 'ada lovelace \(124\)'\?"):
        read_hand_marks(path, results)


def test_several_labs_in_one_table(tmp_path):
    results = [Result("A", lab=lab, marks=[Mark(f"q{lab}", None, 1.0, OPEN)]) for lab in ("1", "2")]
    write_grades(tmp_path / "g.csv", results)
    edit(tmp_path / "g.csv", lambda rows: rows[2].__setitem__(3, "1"))
    assert read_hand_marks(tmp_path / "g.csv", results) == {("A", "2", "q2"): (1.0, "")}
    edit(tmp_path / "g.csv", lambda rows: rows[0].__setitem__(1, "?"))
    with pytest.raises(CommandError, match="no column 'lab'"):
        read_hand_marks(tmp_path / "g.csv", results)


@pytest.mark.parametrize("seed", range(20))
def test_what_is_written_reads_as_unchanged(tmp_path, seed):
    pick, letters = random.Random(seed), "aZ ,;\"'\t\r\n=+-@01é王\u0301\u200d\ud800\x00|\u2028"

    def text():
        return "".join(pick.choices(letters, k=pick.randrange(12)))

    results = [
        Result(
            text(),
            text(),
            LAB,
            text(),
            problem=pick.choice(["", "", "bad"]),
            marks=[Mark(f"c{n}", pick.choice([None, 0.0, 1 / 3, 2.25]), 2.25, FAILED, text()) for n in range(3)],
        )
        for _ in range(8)
    ]
    write_grades(tmp_path / "g.csv", results)
    assert read_hand_marks(tmp_path / "g.csv", results) == {}
    assert len(set(labels(results))) == 8


def test_a_comment_like_a_formula_comes_back_as_it_was(tmp_path):
    results = [Result("=1+1", "1", LAB, marks=[Mark("kf", 0.0, 1.0, FAILED, "'=1")])]
    path = saved(tmp_path / "g.csv", results, ("'=1+1", "kf", "1"))
    assert read_hand_marks(path, results) == {("=1+1", LAB, "kf"): (1.0, "'=1")}


def test_a_line_may_name_the_delimiter(tmp_path):
    (tmp_path / "s.csv").write_text("sep=;\n\nstudent;check;points\nAda Lovelace;q1;1,5\n")
    assert read_hand_marks(tmp_path / "s.csv", some()) == {("Ada Lovelace", LAB, "q1"): (1.5, "")}
