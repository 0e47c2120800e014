"""The term's page and tables."""

import re
import zipfile
from contextlib import closing
from html import unescape
from xml.etree import ElementTree

import pytest

from labkit.instructor.records import BY_HAND, FAILED, OPEN, PASSED, Check, Mark, Result
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.report.names import page_names
from labkit.instructor.term import overview
from labkit.instructor.term.command import write_term
from labkit.instructor.term.page import links, term_page

from helpers.graded import sound, table
from helpers.term import a_term

CHECKS = [Check("kf", "`KF`: a drive", 6, hidden=True), Check("q1", "Question Q1", 4, hand=True)]
SLIP = "The sign of `K` is wrong."


def got(student, kf=6.0, q1=None, lab="01_a", number="", **more):
    marks = [
        Mark("kf", kf, 6.0, PASSED if kf == 6 else FAILED, mistake="" if kf == 6 else SLIP),
        Mark("q1", q1, 4.0, OPEN if q1 is None else BY_HAND),
    ]
    return Result(student, number, lab, marks=[] if more.get("problem") else marks, **more)


def term(*results):
    labs = sorted({result.lab for result in results})
    by_lab = {lab: [result for result in results if result.lab == lab] for lab in labs}
    return overview.of(by_lab, dict.fromkeys(labs, CHECKS), dict.fromkeys(labs, 1.0))


def test_the_total_counts_what_is_missing_as_nothing_and_the_means_what_is_marked():
    found = term(got("Ada", 6, 4), got("Bela", 3), got("Ada", 6, 2, lab="02_b"), got("Ça", lab="02_b", problem="a PDF"))
    assert [(row.label, row.total, row.final) for row in found.rows] == [
        ("Ada", pytest.approx(0.9), True),
        ("Bela", pytest.approx(0.15), False),
        ("Ça", 0, False),
    ]
    first, second = found.labs
    assert (first.short, first.handed, first.missing, first.waiting, first.unfit) == ("01", 2, ["Ça"], 1, 0)
    assert first.mean == pytest.approx((1 + 0.5) / 2)  # Bela's 3 of the 6 points that are marked
    assert (second.missing, second.unfit, second.mean) == (["Bela"], 1, pytest.approx(0.8))
    assert sum(first.bins) == 2 and first.bins[5] == first.bins[9] == 1


def test_what_was_hard_and_which_mistakes_came_back():
    found = term(got("Ada", 0), got("Bela", 6, 3), got("Ada", 3, 1, lab="02_b"))
    assert [(one.lab, one.check.id, one.none, one.marked) for one in found.hard] == [
        ("02_b", "q1", 0, 1),
        ("01_a", "kf", 1, 2),
        ("02_b", "kf", 0, 1),
        ("01_a", "q1", 0, 1),
    ]
    assert found.slips == [overview.Slip(SLIP, 1, ["01_a", "02_b"])]


def test_a_student_is_one_row_whatever_number_a_lab_has_and_twins_are_never_merged():
    one = term(got("Ada", number="1"), got("ADA ", number="2", lab="02_b"))
    assert [row.label for row in one.rows] == ["Ada"] and not one.mixed
    twins = term(got("Ada", number="1"), got("Ada", number="2"), got("Ada", number="2", lab="02_b"))
    assert [(row.label, [*row.got]) for row in twins.rows] == [("Ada (1)", ["01_a"]), ("Ada (2)", ["01_a", "02_b"])]
    assert twins.mixed == ["Ada"] and "same name" in term_page(twins, {}, {})


def test_page_and_tables_of_a_gradebook(tmp_path):
    out = a_term(tmp_path / "graded", 13, 3)
    for name in ("class-01_cartesian_ekf", "similar-01_cartesian_ekf", "feedback/02_noise_mismatch/Grace-Hopper"):
        (out / f"{name}.html").parent.mkdir(parents=True, exist_ok=True)
        (out / f"{name}.html").touch()
    with closing(Gradebook(out / "gradebook.db")) as book:
        assert write_term(book, out) == 13
    page = (out / "term.html").read_text(encoding="utf-8")
    seen = sound(page)
    led = [value for _, name, value in seen.attributes if name == "href"]
    assert led == [
        "class-01_cartesian_ekf.html",
        "similar-01_cartesian_ekf.html",
        "feedback/02_noise_mismatch/Grace-Hopper.html",
    ]
    assert "13 students, 3 labs" in seen.text and "Hardest checks" in seen.text
    header, *rows = table(out / "term.csv")
    assert header[1:5] == ["01_cartesian_ekf", "02_noise_mismatch", "03_range_bearing_ekf", "total_percent"]
    assert len(rows) == 13 and any("03_range_bearing_ekf" in row[5] for row in rows)
    assert sheets(out / "term.xlsx")["Students"][0][:2] == ["student", "01_cartesian_ekf"]


def test_points_are_linked_to_the_page_of_the_same_student(tmp_path):
    """Two whose names make one file name: the second page has another, by the gradebook's order."""
    results = [got("b/da"), got("A"), got("B da", 3)]
    folder = tmp_path / "feedback" / "01_a"
    folder.mkdir(parents=True)
    (folder / page_names(results)["b/da"]).touch()
    assert links(tmp_path, term(*results)) == {("01_a", "b/da"): "feedback/01_a/b-da.html"}


def test_who_handed_in_nothing_is_there_where_the_class_is_known(tmp_path):
    found = overview.of({"01_a": [got("Ada")]}, {}, {"01_a": 1.0}, ["ADA", "Zoë", "zoe\u0308", ""])
    assert [(row.label, row.missing, row.total) for row in found.rows[1:]] == [("Zoë", ["01_a"], 0)]
    out = a_term(tmp_path, 3, 1)
    for students in ("", 'students = ["Zoë Zuse"]'):
        (out / "course.toml").write_text(f"{students}\n[labs.01_cartesian_ekf]\nweight = 2\n", encoding="utf-8")
        with closing(Gradebook(out / "gradebook.db")) as book:
            assert write_term(book, out) == 2 + bool(students)
        page = (out / "term.html").read_text(encoding="utf-8")
        assert ("Zoë Zuse" in page) == bool(students) != ("is not known here" in page)


def test_points_and_weights_are_those_of_the_courses_rules(tmp_path):
    out = a_term(tmp_path, 13, 2)
    labs = "[labs.01_cartesian_ekf]\ndue = 2020-01-01\n[labs.02_noise_mismatch]\nweight = 3\n"
    (out / "course.toml").write_text(f"[late]\npercent_a_day = 100\n{labs}", encoding="utf-8")
    with closing(Gradebook(out / "gradebook.db")) as book:
        found = overview.read(book)
    assert [lab.share for lab in found.labs] == [0.25, 0.75]
    assert {row.got["01_cartesian_ekf"].points for row in found.rows if "01_cartesian_ekf" in row.got} == {0}
    assert "after a rule of the course" in sound(term_page(found, {}, {})).text
    assert all(row.total <= 0.75 for row in found.rows) and any(row.total > 0.3 for row in found.rows)


HOSTILE = '=HYPERLINK("http://x","y")<script>alert(1)</script>\u202e'


def test_names_and_texts_of_others_are_text_in_page_and_tables(tmp_path):
    book = Gradebook(tmp_path / "gradebook.db", seed=1)
    with closing(book):
        book.set_paper("01_a", "paper", [Check("kf", HOSTILE, 6), CHECKS[1]])
        id = book.add("01_a", HOSTILE, "", "f", "d", "paper", None, False, [], {})
        book.choose(id, [], False)
        book.mark(id, "kf", 0, FAILED, mistake=HOSTILE)
        book.finish(id)
        write_term(book, tmp_path)
    page = (tmp_path / "term.html").read_text(encoding="utf-8")
    sound(page)
    assert "<script" not in page and "=HYPERLINK" in unescape(page)
    assert table(tmp_path / "term.csv")[1][0].startswith("'=")
    with zipfile.ZipFile(tmp_path / "term.xlsx") as archive:
        parts = [archive.read(name).decode() for name in archive.namelist() if "sheet" in name]
        assert not any(re.search("<f>|<hyperlink", part) for part in parts)
    every = sheets(tmp_path / "term.xlsx")
    told = [every["Students"][1][0], every["Checks"][1][1], every["Mistakes"][1][0]]
    assert all(cell.startswith("'=") and "\u202e" not in cell for cell in told)


def sheets(path):
    """{name: rows of cells} of a workbook."""
    space = {"s": "http://schemas.openxmlformats.org/spreadsheetml/2006/main"}
    with zipfile.ZipFile(path) as archive:
        texts = ["".join(si.itertext()) for si in ElementTree.fromstring(archive.read("xl/sharedStrings.xml"))]
        book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
        names = [sheet.get("name") for sheet in book.iterfind(".//s:sheet", space)]
        found = {}
        for number, name in enumerate(names, 1):
            sheet = ElementTree.fromstring(archive.read(f"xl/worksheets/sheet{number}.xml"))
            found[name] = [
                [texts[int(c[0].text)] if c.get("t") == "s" else float(c[0].text) for c in row]
                for row in sheet.iterfind(".//s:row", space)
            ]
    return found
