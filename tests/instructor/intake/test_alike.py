"""Names that look alike, and students with very many files: nobody is merged with anybody or pays for another."""

import os
import unicodedata

import pytest

from labkit.instructor.intake import listing
from labkit.instructor.intake.collect import Submissions
from labkit.instructor.records import CommandError

from .test_identity import BOOK, LAB, NB, zipped

ZOE = "Zoë"
ALIKE = {
    "composed or not": (ZOE, unicodedata.normalize("NFD", ZOE)),
    "white space": ("Ada L", "Ada  L", "Ada\xa0L"),
    "letters that are not seen": ("Ada\u200b", "Ada\u2060"),
    "joiners": ("Ada", "Ada\u200c", "A\u200dda"),
    "capitals": ("Ada", "ADA"),
}


def laid(tmp_path, files):
    for name, raw in files.items():
        path = os.path.join(tmp_path, "class", name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(raw)
    return tmp_path / "class"


def packed(tmp_path, files):
    (tmp_path / "class.zip").write_bytes(zipped(files))
    return tmp_path / "class.zip"


def surveyed(path):
    """({student: names of attempts}, {student: reason}, notes)"""
    found = {}
    with Submissions(path) as submissions:
        entries, unfits, notes = submissions.survey(LAB)
        for entry in entries:
            assert submissions.read(entry)[0]
            found.setdefault(entry.student, []).append(entry.name)
    return found, {unfit.student: unfit.reason for unfit in unfits}, notes


@pytest.mark.parametrize("make", [laid, packed])
@pytest.mark.parametrize("form", ["{}/" + NB, "{}_" + NB, "{}.ipynb"])
@pytest.mark.parametrize("kind", ALIKE)
def test_names_that_look_alike_are_kept_apart_and_told(tmp_path, make, form, kind):
    names = ALIKE[kind]
    found, unfit, notes = surveyed(make(tmp_path, {form.format(name): BOOK for name in (*names, "Bob")}))
    assert len(found) == len(names) + 1 and unfit == {} and all(len(attempts) == 1 for attempts in found.values())
    assert "Bob" in found and any("like another" in note or "look like hand-ins" in note for note in notes)
    # whoever is called so whatever others are called, keeps the name, and with it the marks
    assert names[0] in found or kind == "letters that are not seen"
    again, _, _ = surveyed(make(tmp_path, {form.format(name): BOOK for name in (*names[::-1], "Bob", "Carl")}))
    assert set(again) == {*found, "Carl"}


def test_names_that_are_no_text_are_kept_apart(tmp_path):
    names = [os.fsdecode(b"ada" + end) for end in (b"\xff", b"\xfe")]
    try:
        found, _, notes = surveyed(laid(tmp_path, {f"{name}/{NB}": BOOK for name in names}))
    except OSError:
        pytest.skip("this file system takes only names that are text")
    assert len(found) == 2 and all(name.startswith("ada\ufffd ≠") and name.isprintable() for name in found)
    assert len(notes) >= 1


def test_one_folder_of_moodle_stored_in_two_ways_is_one_student(tmp_path):
    names = [f"{unicodedata.normalize(form, ZOE)}_7_assignsubmission_file_/{NB}" for form in ("NFC", "NFD")]
    found, unfit, _ = surveyed(
        packed(tmp_path, {**dict.fromkeys(names, BOOK), f"Bo_8_assignsubmission_file_/{NB}": BOOK})
    )
    assert {student: len(attempts) for student, attempts in found.items()} == {ZOE: 2, "Bo": 1} and unfit == {}


@pytest.mark.parametrize("make", [laid, packed])
@pytest.mark.parametrize("around", ["", "the class/sub/"])
@pytest.mark.parametrize("inside", ["{}.txt", "data/{}.txt", "a{}/b/{}.txt"])
def test_very_many_files_cost_their_own_student_only(tmp_path, make, around, inside):
    crowd = {
        f"{around}Ada/{inside.format(n, n)}": b""
        for n in range(21_000 if make is packed and "data" in inside else 2100)
    }
    files = {f"{around}Ada/{NB}": BOOK, f"{around}Bob/{NB}": BOOK, f"{around}Zoe/{NB}": BOOK}
    found, unfit, _ = surveyed(make(tmp_path, crowd | files))
    assert found == {"Bob": [NB], "Zoe": [NB]}
    assert unfit == {"Ada": "The folder holds more than 2000 files: hand in the notebook itself."}


def test_installed_packages_are_nobodys_files(tmp_path):
    files = {f"Ada/venv/lib/site-packages/m{n}.py": b"" for n in range(3000)} | {f"Ada/{NB}": BOOK, f"Bob/{NB}": BOOK}
    assert set(surveyed(packed(tmp_path, files))[0]) == {"Ada", "Bob"}


def test_many_zips_of_one_student_cost_nobody_else(tmp_path):
    full = zipped({f"{n}.txt": b"" for n in range(450)})
    files = {f"Ada/{n}.zip": full for n in range(60)} | {f"Bob/{NB}": BOOK, f"Ada/{NB}": BOOK}
    assert set(surveyed(packed(tmp_path, files))[0]) == {"Ada", "Bob"}


def test_a_class_that_is_too_large_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(listing, "MAX_FILES", 3)
    with pytest.raises(CommandError, match="holds more than 3 files: give one class at a time, and unpack it"):
        surveyed(packed(tmp_path, {f"{name}/{NB}": BOOK for name in "abcde"}))
