"""What students are called in tables, and as files."""

import pytest

from labkit.instructor.records import Result
from labkit.instructor.report.names import file_name, labels


@pytest.mark.parametrize(
    "label, found",
    [
        ("Ada Lovelace", "Ada-Lovelace.html"),
        ("../../etc/passwd", "etc-passwd.html"),
        ("a\\b:c*?", "a-b-c.html"),
        ("CON", "student-CON.html"),
        ("com1", "student-com1.html"),
        ("ＮＵＬ", "student-NUL.html"),
        ("", "student.html"),
        ("...", "student.html"),
        ("\ud800\x00\u202e", "student.html"),
        ("-rf", "rf.html"),
        ("J. R. (12)", "J-R-12.html"),
        ("小明 王", "小明-王.html"),
        ("Zoe\u0308 #2", "Zoë-2.html"),
        ("a%2e%2e/b", "a-2e-2e-b.html"),
        ("x.html", "x-html.html"),
    ],
)
def test_file_names(label, found):
    assert file_name(label, set()) == found


def test_file_names_differ_and_fit():
    taken = set()
    names = [file_name(label, taken) for label in ["Ada", "ada", "A/da", "A da", "Ada", "Ada", "x" * 300, "x" * 301]]
    names += [file_name("王" * 300, taken), file_name("e" + "\u0301" * 10**6, taken)]
    assert len({name.casefold() for name in names}) == len(names)
    assert all(len(name) <= 80 and len(name.encode()) <= 255 for name in names)


@pytest.mark.parametrize(
    ("results", "names"),
    [
        ([Result("A", lab="1"), Result("A", lab="2")], ["A", "A"]),
        ([Result("A", source="x/a.ipynb"), Result("A", source="b.ipynb")], ["A (a.ipynb)", "A (b.ipynb)"]),
        ([Result("A"), Result("A"), Result("")], ["A", "A #2", "no name"]),
        ([Result("A (1)"), Result("A", "1"), Result("A", "2")], ["A (1)", "A (1) #2", "A (2)"]),
        ([Result("0012"), Result("12")], ["0012", "12 #2"]),  # a spreadsheet makes both 12
    ],
)
def test_names_differ_within_a_lab(results, names):
    assert labels(results) == names
