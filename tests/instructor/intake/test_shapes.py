"""What other systems make of a hand-in: endings, zips in zips, Brightspace, Blackboard, and names that are alike."""

import io
import json
import zipfile
from datetime import datetime

import pytest

from labkit.instructor.intake.choice import alike
from labkit.instructor.intake.collect import Submissions
from labkit.instructor.records import CommandError, HandInError

from helpers.classroom import LAB, blank, zipped

BOOK = json.dumps(blank()).encode()
NB = f"{LAB}.ipynb"


def handed_in(tmp_path, files):
    """({student: (name, time) of each attempt, the newest last}, {student: reason}, notes); all notebooks are read."""
    path = tmp_path / "class.zip"
    path.write_bytes(zipped(files))
    found = {}
    with Submissions(path) as submissions:
        entries, unfits, notes = submissions.survey(LAB)
        for entry in entries:
            assert submissions.read(entry)[0]
            found.setdefault(entry.student, []).append((entry.name, entry.when))
    return found, {unfit.student: unfit.reason for unfit in unfits}, notes


@pytest.mark.parametrize("ending", [".ipynb.txt", ".ipynb.json", ".json", ".IPYNB", ".ipynb.TXT", " (1).ipynb.txt"])
@pytest.mark.parametrize("path", ["Ada Lovelace_11_assignsubmission_file/{}", "Ada Lovelace/{}", "Ada Lovelace_{}"])
def test_endings_that_systems_add(tmp_path, ending, path):
    found, unfit, _ = handed_in(tmp_path, {path.format(f"{LAB}{ending}"): BOOK, "Bob/x.txt": b"x"})
    assert unfit.keys() == {"Bob"} and list(found) == ["Ada Lovelace"]


def test_a_table_beside_the_notebook_is_no_attempt(tmp_path):
    found, _, notes = handed_in(tmp_path, {f"Ada/{NB}": BOOK, "Ada/data.json": b"{}", f"Bob/{NB}": BOOK})
    assert len(found["Ada"]) == 1 and not any("attempt" in note for note in notes)


BRIGHTSPACE = {
    "folders": "11-77 - Ada M. Lovelace - Nov {}/01_cartesian_ekf.ipynb",
    "files": "11-77 - Ada M. Lovelace - Nov {} - 01_cartesian_ekf.ipynb",
    "without numbers": "Ada M. Lovelace - Nov {}/my lab.ipynb",
}


@pytest.mark.parametrize("form", BRIGHTSPACE)
@pytest.mark.parametrize("around", ["", "Lab 1 Download Nov 25, 2026 900 AM/"])
def test_brightspace_with_attempts(tmp_path, form, around):
    times = ["20, 2026 1155 PM", "9, 2026 926 AM", "20, 2026 1201 AM"]
    files = {around + BRIGHTSPACE[form].format(time): BOOK for time in times} | {f"{around}index.html": b""}
    found, unfit, _ = handed_in(tmp_path, files)
    assert unfit == {} and list(found) == ["Ada M. Lovelace"]
    times = [datetime(2026, 11, 9, 9, 26), datetime(2026, 11, 20, 0, 1), datetime(2026, 11, 20, 23, 55)]
    assert [when for _, when in found["Ada M. Lovelace"]] == times


def test_blackboard_with_attempts(tmp_path):
    name = "Lab 1_alovelace_attempt_2026-11-{}"
    files = {f"{name.format(day)}_{NB}": BOOK for day in ("20-22-44-10", "19-08-00-00")}
    files |= {f"{name.format(day)}.txt": b"Name: Ada" for day in ("20-22-44-10", "19-08-00-00")}
    files |= {f"Lab 1_bob7_attempt_2026-11-18-10-00-00_{NB}": BOOK}
    found, unfit, notes = handed_in(tmp_path, files)
    assert unfit == {} and found.keys() == {"alovelace", "bob7"} and notes == []
    assert [when for _, when in found["alovelace"]] == [datetime(2026, 11, 19, 8), datetime(2026, 11, 20, 22, 44, 10)]


ZIPS = {
    "in a folder": "Ada/work.zip",
    "in Moodle's folder": "Ada_12_assignsubmission_file/work.zip",
    "as Moodle's file": "Ada_12_assignsubmission_file_work.zip",
    "named by the student": "Ada_01_cartesian_ekf.zip",
}


@pytest.mark.parametrize("place", ZIPS)
@pytest.mark.parametrize("inside", [NB, f"my folder/{NB}"])
def test_a_zip_in_the_zip(tmp_path, place, inside):
    inner = zipped({inside: BOOK, inside.replace(NB, "mine.py"): b"x = 1", "__MACOSX/._x": b""})
    found, unfit, _ = handed_in(tmp_path, {ZIPS[place]: inner, f"Bob/{NB}": BOOK})
    assert unfit == {} and [name for name, _ in found["Ada"]] == [NB]
    with Submissions(tmp_path / "class.zip") as submissions:
        entry = next(entry for entry in submissions.survey(LAB)[0] if entry.student == "Ada")
        assert submissions.beside(entry) == {"mine.py": b"x = 1"}


def test_the_downloads_zip_in_a_folder(tmp_path):
    inner = zipped({f"{name}_{n}_assignsubmission_file/{NB}": BOOK for n, name in enumerate(["Ada", "Bob"], 11)})
    found, unfit, _ = handed_in(tmp_path, {"moodle.zip": inner, f"Eva/{NB}": BOOK})
    assert unfit == {} and found.keys() == {"Ada", "Bob", "Eva"}


HOSTILE = {
    "no zip": b"PK\x03\x04 nothing",
    "a zip in it": zipped({"more.zip": zipped({NB: BOOK})}),
    "too many files": zipped({f"{n}.txt": b"" for n in range(600)}),
    "climbs out": zipped({f"../{NB}": BOOK}),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_a_zip_that_is_none_costs_its_student_only(tmp_path, what):
    found, unfit, _ = handed_in(tmp_path, {"Ada/work.zip": HOSTILE[what], f"Bob/{NB}": BOOK})
    assert found.keys() == {"Bob"} and unfit.keys() == {"Ada"}


def test_a_bomb_in_a_zip_stops_at_the_cap(tmp_path):
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(NB, b"0" * 60_000_000)
    (tmp_path / "class.zip").write_bytes(zipped({"Ada/work.zip": bomb.getvalue(), f"Bob/{NB}": BOOK}))
    with Submissions(tmp_path / "class.zip") as submissions:
        entry = next(entry for entry in submissions.survey(LAB)[0] if entry.student == "Ada")
        with pytest.raises(HandInError, match="more than 50 MB"):
            submissions.read(entry)


def test_names_that_look_like_one_student_are_told():
    names = ["Ada Lovelace 2026-11-20", "Ada Lovelace 2026-11-21 attempt 2", "Bob", "Eva", "12", "13"]
    (note,) = alike(names)
    assert note.startswith("Ada Lovelace 2026-11-20, Ada Lovelace 2026-11-21 attempt 2 look like")


def test_a_pattern_is_told_to_be_one(tmp_path):
    with pytest.raises(CommandError, match=r"is a pattern: give the folder .* itself"):
        Submissions(tmp_path / "*.ipynb")
