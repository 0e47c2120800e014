"""Times of handing in: from Moodle's worksheet, in whichever language, before those of the files."""

import json
import zipfile
from datetime import datetime

import pytest

from labkit.instructor.intake.collect import Submissions
from labkit.instructor.report.moodle_times import dated, read_times

from helpers.classroom import LAB

TIMES = [
    "Saturday, 21 November 2026, 12:05 AM",
    "Saturday, November 21, 2026, 12:05 AM",
    "sábado, 21 de noviembre de 2026, 00:05",
    "sábado, 21 de noviembre de 2026, 12:05 a. m.",
    "Samstag, 21. November 2026, 00:05",
    "Samstag, 21. November 2026, 00:05 Uhr",
    "samedi 21 novembre 2026, 00:05",
    "samedi 21 novembre 2026, 00h05",
    "суббота, 21 ноября 2026, 00:05",
    "sabato, 21 novembre 2026, 00:05",
    "sábado, 21 de novembro de 2026 às 00:05",
    "sobota, 21 listopada 2026, 00:05",  # of October, in Croatian, but that was no Saturday
    "2026年11月21日 星期六 上午12:05",
    "21.11.2026 00:05",
    "21/11/2026, 00:05",
    "11/21/26, 12:05 AM".replace("/26", "/2026"),
    "2026-11-21 00:05",
]
HEAD = "Identifier,Full name,Status,Grade,Maximum Grade,Grade can be changed,Sent,Marked,Feedback comments\n"
DOWNLOADED = (2026, 11, 25, 9, 0, 0)


@pytest.mark.parametrize("text", TIMES)
def test_times_are_read_in_the_languages_of_moodle(text):
    assert read_times([text]) == {text: datetime(2026, 11, 21, 0, 5)}


@pytest.mark.parametrize(
    "text", ["11/12/2026, 00:05", "Saturday, 31 November 2026, 12:05 AM", "21 November 2026, 25:05"]
)
def test_what_may_mean_two_days_or_none_is_not_read(text):
    assert read_times([text]) == {}


def test_one_time_shows_how_the_others_of_its_column_are_meant():
    assert read_times(["11/12/2026, 00:05", "12/13/2026, 00:05"])["11/12/2026, 00:05"].month == 11


def entries(folder, stamps):
    """The hand-ins of a Moodle zip; stamps: pairs of a student's name and the time in the zip."""
    with zipfile.ZipFile(folder / "class.zip", "w") as archive:
        for at, (name, stamp) in enumerate(stamps):
            inside = f"{name}_{sum(map(ord, name))}_assignsubmission_file/{LAB} ({at}).ipynb"
            archive.writestr(zipfile.ZipInfo(inside, stamp), json.dumps({}))
    with Submissions(folder / "class.zip") as submissions:
        return submissions.survey(LAB)[0]


def sheet(folder, *rows):
    """A worksheet with rows of (name, time of handing in)."""
    text = "".join(f'Participant {sum(map(ord, name))},{name},,,20.00,Yes,"{when}",-,\n' for name, when in rows)
    (folder / "w.csv").write_text(HEAD + text, encoding="utf-8")
    return folder / "w.csv"


def test_where_all_files_are_of_the_download_the_worksheet_has_the_times(tmp_path):
    found = entries(tmp_path, [("Ada", DOWNLOADED), ("Nora", (*DOWNLOADED[:5], 20)), ("Zoe", DOWNLOADED)])
    table = sheet(tmp_path, ("Ada", "Freitag, 20. November 2026, 23:59"), ("Nora", TIMES[4]), ("Zoe", "-"))
    found, notes = dated(found, table, "class.zip", None)
    assert [entry.when for entry in found] == [datetime(2026, 11, 20, 23, 59), datetime(2026, 11, 21, 0, 5), None]
    assert notes[0] == "Times of handing in are those of w.csv." and "of 1 student came is not known" in notes[1]


def test_without_a_worksheet_the_time_of_the_download_makes_nobody_late(tmp_path):
    found, notes = dated(entries(tmp_path, [("Ada", DOWNLOADED), ("Bo", DOWNLOADED)]), None, "c.zip", datetime.now())
    assert [entry.when for entry in found] == [None, None] and "give it with --moodle" in notes[0]


def test_times_of_files_that_differ_hold_where_the_worksheet_has_none(tmp_path):
    early, late = (2026, 11, 19, 10, 0, 0), (2026, 11, 22, 10, 0, 0)
    given = entries(tmp_path, [("Ada", early), ("Ada", late), ("Bo", early)])
    for table in (None, sheet(tmp_path, ("Ada", "-"), ("Bo", "-"))):
        found, notes = dated(given, table, "class.zip", datetime.now())
        assert [entry.when for entry in found] == [datetime(*early), datetime(*late), datetime(*early)]
        assert notes[-1] == "Times of handing in are those of the files in class.zip."
    found, notes = dated(given, sheet(tmp_path, ("Ada", TIMES[0]), ("Bo", TIMES[0])), "class.zip", None)
    sent = datetime(2026, 11, 21, 0, 5)
    assert [entry.when for entry in found] == [datetime(*early), sent, sent] and len(notes) == 1


def test_the_times_of_grades_are_not_those_of_handing_in(tmp_path):
    given = entries(tmp_path, [("Ada", DOWNLOADED), ("Bo", DOWNLOADED)])
    table = sheet(tmp_path, ("Ada", "-"), ("Bo", "-"))
    table.write_text(table.read_text().replace('"-",-', f'-,"{TIMES[0]}"'))
    found, notes = dated(given, table, "class.zip", None)
    assert [entry.when for entry in found] == [None, None] and "tells no times of handing in" in notes[0]


@pytest.mark.parametrize("most", ["20.00", "20"])
def test_due_dates_of_single_students_are_not_times_of_handing_in(tmp_path, most):
    given = entries(tmp_path, [("Ada", DOWNLOADED), ("Bo", DOWNLOADED)])
    table = sheet(tmp_path, ("Ada", TIMES[0]), ("Bo", TIMES[0]))
    due = '"Friday, 20 November 2026, 11:59 PM",'
    text = table.read_text().replace("Status,", "Status,Due date,").replace(",,,20.00", f",,{due},{most}")
    table.write_text(text)
    found, _ = dated(given, table, "class.zip", None)
    assert {entry.when for entry in found} == {datetime(2026, 11, 21, 0, 5)}
