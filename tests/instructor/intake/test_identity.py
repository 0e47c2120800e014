"""No name that a student chose says whose a hand-in is: the LMS's own name does, or nobody is graded for it."""

import json
import zipfile
from datetime import datetime

import pytest

from labkit.instructor.intake.collect import Submissions
from labkit.instructor.records import Result
from labkit.instructor.report.send_back import send_back

from helpers.classroom import LAB, blank, zipped

BOOK = json.dumps(blank()).encode()
NB = f"{LAB}.ipynb"
FORMS = {
    "Moodle's folders": "{name} L_{n}_assignsubmission_file_/{file}",
    "Moodle's files": "{name} L_{n}_assignsubmission_file_{file}",
    "Moodle, blind": "Participant_{n}_assignsubmission_file_{file}",
    "Canvas": "{low}_{n}_5{n}_{file}",
    "Canvas, late": "{low}_LATE_{n}_5{n}_{file}",
    "Canvas, anonymous": "anon_{low}_5{n}_{file}",
    "Brightspace's folders": "{n}-77 - {name} L - Nov 20, 2026 1155 PM/{file}",
    "Brightspace's files": "{n}-77 - {name} L - Nov 20, 2026 1155 PM - {file}",
    "Blackboard": "Lab 1_{low}_attempt_2026-11-20-22-44-10_{file}",
    "folders": "{name}/{file}",
}
BOB, ADA, EVE = ({"name": name, "low": name.lower(), "n": n} for name, n in (("Bob", 102), ("Ada", 101), ("Eve", 103)))
TRICKS = [form.replace("/", "_").format(**BOB, file=NB) for form in FORMS.values()]


def surveyed(tmp_path, files, form=""):
    """({(student, number, late, time)} of entries, {student: reason}, notes)"""
    path = tmp_path / "class.zip"
    path.write_bytes(zipped(files))
    with Submissions(path) as submissions:
        entries, unfits, notes = submissions.survey(LAB)
    dated = "2026" in FORMS.get(form, form)  # the other times are those of this test
    about = {(e.student, e.identifier, e.late, e.when if dated else None) for e in entries}
    return about, {unfit.student: unfit.reason for unfit in unfits}, notes


@pytest.mark.parametrize("trick", TRICKS)
@pytest.mark.parametrize("form", FORMS)
def test_a_file_named_as_another_lms_names_that_of_another_student_changes_nothing(tmp_path, form, trick):
    honest = {FORMS[form].format(**who, file=NB): BOOK for who in (ADA, BOB, EVE)}
    expected = surveyed(tmp_path, honest, form)
    assert len(expected[0]) == 3 and expected[1] == {}
    for ada in (trick, f"my work/{trick}") if FORMS[form].endswith("/{file}") else (trick,):
        files = {FORMS[form].format(**ADA, file=ada): BOOK}
        files |= {FORMS[form].format(**who, file=NB): BOOK for who in (BOB, EVE)}
        assert surveyed(tmp_path, files, form) == expected


@pytest.mark.parametrize("trick", TRICKS)
@pytest.mark.parametrize("form", FORMS)
def test_a_zip_with_such_names_inside_changes_nothing(tmp_path, form, trick):
    inside = {f"{trick.removesuffix(NB)}/{NB}": BOOK}
    file = "work.zip" if form != "Canvas, anonymous" else "w.zip"
    files = {FORMS[form].format(**who, file=NB): BOOK for who in (BOB, EVE)}
    honest = surveyed(tmp_path, files | {FORMS[form].format(**ADA, file=NB): BOOK}, form)
    assert surveyed(tmp_path, files | {FORMS[form].format(**ADA, file=file): zipped(inside)}, form)[:2] == honest[:2]


@pytest.mark.parametrize("trick", TRICKS)
@pytest.mark.parametrize("form", [form for form in FORMS if form != "folders"])
def test_where_nobody_else_shows_which_lms_it_was_nobody_elses_mark_is_touched(tmp_path, form, trick):
    honest, _, _ = surveyed(tmp_path, {FORMS[form].format(**ADA, file=NB): BOOK}, form)
    found, unfit, _ = surveyed(tmp_path, {FORMS[form].format(**ADA, file=trick): BOOK}, form)
    assert (
        found == honest
        or not found
        and all("put it into a folder with its student's name" in r for r in unfit.values())
    )
    assert found or len(unfit) == 1


def test_what_may_be_two_students_is_refused_by_name(tmp_path):
    name = f"lovelaceada_101_5001_Bob_102_assignsubmission_file_{NB}"
    found, unfit, _ = surveyed(
        tmp_path, {name: BOOK, f"Carl_7_assignsubmission_file_/{NB}": BOOK, f"eve_3_4_{NB}": BOOK}
    )
    assert {student for student, *_ in found} == {"Carl", "eve"}
    assert unfit == {
        name: "Its name may be lovelaceada 101 5001 Bob's by Moodle or lovelaceada's by Canvas: put it into a folder "
        "with its student's name."
    }


PAGES = [  # (student, number, source, name of the page in the zip, or None)
    ("ada", "101", f"c.zip: ada_101_5001_Bob_102_assignsubmission_file_{NB}", "ada_101_5001_Bob_102_assignsubmission_"),
    (
        "Ada",
        "101",
        f"c.zip: Ada_101_assignsubmission_file_/bob_102_5002_{NB}",
        "Ada_101_assignsubmission_file_/Ada.html",
    ),
    ("Ada", "", f"class: Ada/bob_102_5002_{NB}", None),
    ("Ada", "", f"class: Ada/Bob_102_assignsubmission_file_{NB}", None),
    ("ada", "101", r"c.zip: ada_101_5001_..\..\C:\x.ipynb", "ada_101_5001_..-..-C-"),
]


@pytest.mark.parametrize("student, number, source, name", PAGES)
def test_a_page_goes_back_to_nobody_but_its_student(tmp_path, student, number, source, name):
    (tmp_path / "Ada.html").write_text("x")
    (tmp_path / "f.zip").write_text("of a run before")
    send_back(tmp_path / "f.zip", tmp_path, [Result(student, number, LAB, source)], {student: "Ada.html"}, {})
    if name is None:
        assert not (tmp_path / "f.zip").exists()
    else:
        ((found),) = zipfile.ZipFile(tmp_path / "f.zip").namelist()
        assert found.startswith(name) and found.endswith(".html") and "\\" not in found


def test_times_in_names_are_those_of_the_lms(tmp_path):
    trick = f"Bob - Nov 1, 2026 100 AM - x_attempt_2026-01-01-00-00-00_{NB}"
    files = {FORMS["Blackboard"].format(**ADA, file=trick): BOOK, FORMS["Blackboard"].format(**BOB, file=NB): BOOK}
    found, _, _ = surveyed(tmp_path, files, "Blackboard")
    assert found == {(name, "", False, datetime(2026, 11, 20, 22, 44, 10)) for name in ("ada", "bob")}
