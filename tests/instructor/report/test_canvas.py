"""The gradebook of the platform Canvas, filled in."""

import pytest

from labkit.instructor.records import PASSED, CommandError, Mark, Result
from labkit.instructor.report.canvas import fill_canvas

from helpers.graded import LAB, result, table, whole

CANVAS = (
    "Student,ID,SIS Login ID,Section,Lab 1: EKF (5001),Lab 2 (5002),Lab 11 (5011),Essay (5100),"
    "Final Score (2025)\r\n"
    ",,,,Manual Posting,,,,\r\n"
    "    Points Possible,,,,20.00,10.00,10.00,5.00,(read only)\r\n"
    '"Lovelace, Ada",101,ada@x.org,"A, and B",,9.00,,,45.00\r\n'
    '"Żak, Łukasz",102,lz@x.org,A,3.00,,N/A,,\r\n'
    '"O\'Neil, ""Bob""",103,bob@x.org,A,EX,,,,\r\n'
    '"Doe, Jane",104,jane@x.org,A,,,,,\r\n'
    '"Student, Test",999,t@x.org,A,,,,,\r\n'
)


def canvas(tmp_path, text=CANVAS, encoding="utf-8"):
    path = tmp_path / "gradebook.csv"
    path.write_bytes(text.encode(encoding))
    return path, tmp_path / "out.csv"


def test_canvas(tmp_path):
    source, out = canvas(tmp_path)
    people = [*whole(), result("Bob O'Neil", "103", written=5.0), result("Test Student", "999", written=5.0)]
    report = fill_canvas(source, out, people)
    expected = CANVAS.replace('"A, and B",,', '"A, and B",20,').replace("A,3.00,", "A,17,")
    assert out.read_bytes().decode() == expected
    assert report == [
        "Grades go to the column 'Lab 1: EKF (5001)'.",
        "Filled in: the grades of 2 students.",
        "Something else was there before: 1 (Łukasz Żak (the grade 3.00)).",
        "Left as they were, since the table says 'EX': 1 (Bob O'Neil).",
        "Graded, but not in the table: 1 (Test Student).",
        "In the table without a graded submission: 1 (Doe, Jane).",
    ]


@pytest.mark.parametrize("name", ["Jane Doe", "Doe, Jane", "jané  DOE", "Doe Jane"])
def test_canvas_by_name(tmp_path, name):
    source, out = canvas(tmp_path)
    fill_canvas(source, out, [result(name, written=5.0)])
    assert table(out, encoding="utf-8")[6][4] == "20"


def test_canvas_with_two_columns_of_names_semicolons_and_decimal_commas(tmp_path):
    text = (
        "LastName;FirstName;ID;Section;Cartesian filter (7)\n    Points Possible;;;;10,00\n"
        "Lovelace;Ada;1;A;\nŻak;Łukasz;102;A;\nStudent;Test;9;A;\n"
    )
    source, out = canvas(tmp_path, text, "utf-8-sig")
    fill_canvas(source, out, whole())
    expected = text.replace("Ada;1;A;", "Ada;1;A;10").replace("102;A;", "102;A;8,5")
    assert out.read_bytes().decode("utf-8-sig") == expected


CHOICES = [  # lab, lab_title, column, titles, what is taken
    (LAB, None, None, ["Lab 1 (1)", "Lab 2 (2)", "Lab 10 (3)", "Lab21 (4)"], "Lab 1 (1)"),
    (LAB, None, None, ["Labor 01 - Filter (1)", "Labor 02 - Filter (2)"], "Labor 01 - Filter (1)"),
    (LAB, None, None, ["The Cartesian EKF (1)", "Range (2)"], "The Cartesian EKF (1)"),
    (LAB, None, None, ["Práctica 1 (8)", "Práctica 2 (9)"], "Práctica 1 (8)"),
    (LAB, None, None, ["Homework 1 (8)", "Lab 1 (9)"], "Lab 1 (9)"),
    (LAB, "Kalman", None, ["Lab 1 (1)", "kalman filters (2)"], "kalman filters (2)"),
    (LAB, None, "9", ["Lab 1 (1)", "Other (9)"], "Other (9)"),
    (LAB, None, "other", ["Lab 1 (1)", "Other (9)"], "Other (9)"),
    (LAB, None, "Other (9)", ["Lab 1 (1)", "Other (9)"], "Other (9)"),
    (LAB, None, None, ["Lab 1 code (1)", "Lab 1 text (2)"], "more than one .*Lab 1 code (1), Lab 1 text (2); name"),
    (LAB, None, None, ["Essay (1)", "Lab 2 (2)"], "none .*: Essay (1), Lab 2 (2); name one with --column"),
    (LAB, None, "nine", ["Lab 1 (1)"], "none of its assignments is 'nine'"),
    (LAB, "?[", None, ["Essay (1)"], "none"),
    ("", None, None, ["Essay (1)"], "none"),
]


@pytest.mark.parametrize(("lab", "title", "column", "titles", "taken"), CHOICES)
def test_canvas_column(tmp_path, lab, title, column, titles, taken):
    lines = [["Student,ID,Section", *titles], ["    Points Possible,,", *["5"] * len(titles)], ["A,1,S"]]
    source, out = canvas(tmp_path, "\n".join(map(",".join, lines)))
    one = [Result("A", "1", lab, marks=[Mark("a", 1.0, 1.0, PASSED)])]
    if taken in titles:
        assert fill_canvas(source, out, one, title, column)[0] == f"Grades go to the column {taken!r}."
        assert table(out, encoding="utf-8")[2][3 + titles.index(taken)] == "5"
    else:
        with pytest.raises(CommandError, match=taken.replace("(", r"\(").replace(")", r"\)")):
            fill_canvas(source, out, one, title, column)


def test_what_is_no_gradebook_is_told(tmp_path):
    for text in ("Student,Lab 1 (1)\n    Points Possible,5\n", "Student,ID,Lab 1 (1)\nAda,1,\n"):
        source, out = canvas(tmp_path, text)
        with pytest.raises(CommandError, match="not a gradebook as Canvas exports it"):
            fill_canvas(source, out, whole())
    source, out = canvas(tmp_path, "Student,ID,Lab 1 (1)\n    Points Possible,,0\nAda,1,\n")
    with pytest.raises(CommandError, match=r"'Lab 1 \(1\)' gives no points"):
        fill_canvas(source, out, whole())
