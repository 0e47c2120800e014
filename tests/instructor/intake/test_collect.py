"""Submissions of every shape and malice become hand-ins, or sentences that say why not."""

import hashlib
import json
import os
import socket
import stat
import struct
import time
import tracemalloc
import warnings
import zipfile
from datetime import datetime

import pytest

from labkit.instructor.intake import archive, listing
from labkit.instructor.intake.attempts import HandIn, Rules, hand_ins
from labkit.instructor.intake.collect import Submissions
from labkit.instructor.records import CommandError, HandInError
from labkit.notebook.read import Cell

LAB, IDS = "01_cartesian_ekf", {"answer-kf": True, "answer-q1": False}
RELEASED = [Cell(n, id, "answer", code, "# to do") for n, (id, code) in enumerate(IDS.items(), 1)]
A_FILE = "Ada Lovelace_123_assignsubmission_file_"
TIME = (2025, 3, 4, 5, 6, 8)
ALL = Rules("best")


def book(*sources, ids=("answer-kf", "answer-q1")):
    cells = [
        {"cell_type": "code", "id": "answer-kf", "source": "x = 1", "metadata": {}},
        {"cell_type": "markdown", "id": "answer-q1", "source": ["it ", "does"], "metadata": {}},
    ]
    cells = [cell for cell in cells if cell["id"] in ids]
    cells += [{"cell_type": "code", "id": f"own{i}", "source": s} for i, s in enumerate(sources)]
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": cells}).encode()


BOOK = book()


def packed(tmp_path, files, name="class.zip"):
    """A zip of {name: bytes} or of pairs of ZipInfo or name and bytes."""
    with zipfile.ZipFile(tmp_path / name, "w") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of names that come twice
        for name, raw in files.items() if isinstance(files, dict) else files:
            file.writestr(name if isinstance(name, zipfile.ZipInfo) else entry(name), raw)
    return tmp_path / file.filename


def entry(name, mode=stat.S_IFREG | 0o644, when=TIME, method=zipfile.ZIP_STORED):
    info = zipfile.ZipInfo(name, when)
    info.external_attr, info.create_system, info.compress_type = mode << 16, 3, method
    return info


def laid(tmp_path, files):
    """The same names as a folder."""
    for name, raw in files.items():
        path = tmp_path / "class" / name
        if name.endswith("/"):
            path.mkdir(parents=True, exist_ok=True)
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(raw)
    return tmp_path / "class"


def collected(path, rules=ALL):
    """(hand-ins, unfits, notes) of all attempts of a class."""
    with Submissions(path) as submissions:
        entries, unfits, notes = submissions.survey(LAB)
        found = list(hand_ins(submissions, entries, RELEASED, rules))
    good = [one for one in found if isinstance(one, HandIn)]
    return good, [one for one in found if one not in good] + unfits, notes


def told(path):
    """Lines 'student|number|what' of a class, and its notes; what: the hand-in's name, or the reason."""
    good, unfits, notes = collected(path)
    about = [(h.entry.student, h.entry.identifier, h.entry.source.rsplit("/")[-1], h.entry.late) for h in good]
    lines = [f"{student}|{number}|{name}{'|late' * late}" for student, number, name, late in about]
    return lines + [f"{u.student}|{u.identifier}|! {u.reason}" for u in unfits], notes


# Shapes: files -> what comes out, 'None' for the reason of a student without a hand-in

NB = "01_cartesian_ekf.ipynb"
SHAPES = {
    "files with students' names": (["ada.ipynb", "Bob Dylan.ipynb"], ["Bob Dylan|", "ada|"]),
    "files with the lab's name too": (
        [
            "lovelace_01_cartesian_ekf.ipynb",
            "01_cartesian_ekf-bob (1).ipynb",
            "01 Cartesian-EKF Kim.ipynb",
            "Copy of eve_01_cartesian_ekf-Copy1.ipynb",
            "zoe (2).ipynb",
            "stefan2_01_cartesian_ekf-1.ipynb",
        ],
        ["Kim|", "bob|", "eve|", "lovelace|", "stefan2|", "zoe|"],
    ),
    "folders": ([f"Ada L/{NB}", "bob/work/x/my.ipynb"], ["Ada L|", "bob|"]),
    "one folder": ([f"ada/{NB}"], ["ada|"]),
    "Moodle's folders": (
        [f"{A_FILE}/{NB}", f"Jean-Luc O'Neil_7_assignsubmission_file/deep/{NB}"],
        ["Ada Lovelace|123", "Jean-Luc O'Neil|7"],
    ),
    "Moodle's flat files": ([f"{A_FILE}{NB}", f"Bo_b_9_assignsubmission_file_{NB}"], ["Ada Lovelace|123", "Bo b|9"]),
    "Moodle blind": (
        [f"Participant_{n}_assignsubmission_file_/{NB}" for n in (4, 51)],
        ["Participant 4|4", "Participant 51|51"],
    ),
    "Moodle teams": ([f"Team 7_{n}_assignsubmission_file_/{NB}" for n in (4, 51)], ["Team 7|4", "Team 7|51"]),
    "one name, two numbers": ([f"Ada L_{n}_assignsubmission_file_/{NB}" for n in (1, 2)], ["Ada L|1", "Ada L|2"]),
    "Moodle's name inside a file's name": (
        [f"{A_FILE}Bob_9_assignsubmission_file_{NB}", f"{A_FILE}/Bob_9_assignsubmission_file_/{NB}"],
        ["Ada Lovelace|123", "Ada Lovelace|123"],
    ),
    "Moodle's online texts": (
        [f"{A_FILE}/{NB}", "Ada Lovelace_123_assignsubmission_onlinetext_/onlinetext.html"],
        ["Ada Lovelace|123"],
    ),
    "Canvas": (
        [f"lovelaceada_11_22_{NB}", "dylanbob_LATE_12_23_01_cartesian_ekf-1.ipynb", "group_3_LATE_13_24_my.ipynb"],
        ["dylanbob|12|late", "group_3|13|late", "lovelaceada|11"],
    ),
    "Canvas without names": (
        [f"LATE_anon_aB3x_7_{NB}", f"anon_Q_8_{NB}"],
        ["Anonymous Q|Q", "Anonymous aB3x|aB3x|late"],
    ),
    "no Canvas": ([f"group_3_{NB}", "bob.ipynb"], ["bob|", "group_3|"]),
    "a folder around all": (
        [f"class/sub/{A_FILE}/{NB}", f"class/sub/Bob_1_assignsubmission_file_/{NB}"],
        ["Ada Lovelace|123", "Bob|1"],
    ),
    "a folder around files": (["class/ada.ipynb", "class/bob.ipynb"], ["ada|", "bob|"]),
    "rubbish of operating systems": (
        [
            f"ada/{NB}",
            f"ada/._{NB}",
            f"__MACOSX/ada/._{NB}",
            f"ada/.ipynb_checkpoints/{NB}",
            "Thumbs.db",
            f"bob/{NB}",
            "bob/desktop.ini",
            ".DS_Store",
            "bob/__pycache__/x.ipynb",
        ],
        ["ada|", "bob|"],
    ),
    "the lab's notebook among others": (
        [f"ada/{NB}", "ada/02_noise_mismatch.ipynb", "ada/scratch.ipynb", "bob/01_cartesian_ekf-1.ipynb"],
        ["ada|", "bob|"],
    ),
    "files as well as folders": ([f"ada/{NB}", "bob.ipynb"], ["ada|", "bob|"]),
    "names beyond ASCII": (
        [f"Zoë Ωmega_1_assignsubmission_file_/{NB}", f"李雷_2_assignsubmission_file_/{NB}"],
        ["Zoë Ωmega|1", "李雷|2"],
    ),
    "another number is no other lab": (["ada/01_cartesian.ipynb", "bob/1.ipynb"], ["ada|", "bob|"]),
}


@pytest.mark.parametrize("make", [packed, laid])
@pytest.mark.parametrize("shape", SHAPES)
def test_shapes(tmp_path, make, shape):
    names, expected = SHAPES[shape]
    lines, _ = told(make(tmp_path, dict.fromkeys(names, BOOK)))
    short = sorted("|".join(part for i, part in enumerate(line.split("|")) if i != 2) for line in lines)
    assert short == sorted(expected)


NO_HAND_IN = {
    "a PDF": ([f"{A_FILE}/report.pdf"], "no notebook, only report.pdf: hand in 01_cartesian_ekf.ipynb"),
    "a flat PDF": ([f"{A_FILE}report.pdf"], "There is no notebook, only report.pdf: hand in"),
    "a zip": ([f"{A_FILE}/work.ZIP"], "no notebook beside work.ZIP: take it out"),
    "another lab": ([f"{A_FILE}/02_noise_mismatch.ipynb"], "no notebook of lab 01_cartesian_ekf, only 02"),
    "another lab, flat": (["ada_02_noise_mismatch.ipynb"], "no notebook of lab 01_cartesian_ekf"),
    "an empty folder": ([f"{A_FILE}/"], "There is no file"),
    "only rubbish": ([f"{A_FILE}/.DS_Store"], "There is no file"),
    "only a text": (["Ada_1_assignsubmission_onlinetext_/onlinetext.html"], "There is no file"),
    "only Canvas's text": (["ada_12_text.html"], "There is no file"),
    "Canvas's PDF": (["ada_12_34_report.pdf"], "There is no notebook, only report.pdf: hand in"),
    "a folder named like a notebook": ([f"{A_FILE}/{NB}/"], f"{NB} is a folder: hand in"),
    "a notebook in such a folder": ([f"{A_FILE}/{NB}/{NB}"], f"{NB} is a folder: hand in"),
    "too deep": ([f"{A_FILE}/1/2/3/4/5/{NB}"], "There is no file"),
}


@pytest.mark.parametrize("make", [packed, laid])
@pytest.mark.parametrize("case", NO_HAND_IN)
def test_a_student_without_the_notebook_is_told_what_to_do(tmp_path, make, case):
    names, says = NO_HAND_IN[case]
    lines, _ = told(make(tmp_path, dict.fromkeys([*names, f"Bob_1_assignsubmission_file_/{NB}"], BOOK)))
    assert len(lines) == 2 and lines[0].startswith("Bob|1|") and "|! " in lines[1] and says in lines[1]


def test_notes_for_the_instructor(tmp_path):
    files = [
        f"{A_FILE}/{NB}",
        f"{A_FILE}/a.png",
        "Ada Lovelace_123_assignsubmission_onlinetext_/o.html",
        "my.csv",
        NB,
        "old.zip",
        "x.txt",
        f"bob/1/{NB}",
        f"bob/2/{NB}",
        f"kim/1/2/3/4/5/{NB}",
    ]
    lines, notes = told(packed(tmp_path, dict.fromkeys(files, BOOK)))
    assert len(lines) == 4
    assert notes == [
        f"Left aside 4 files (my.csv, {NB}, old.zip, ...): no notebook with a student's name.",
        "Left aside 1 file (kim/1/2/3/4/5/01_cartesian_ekf.ipynb) nested deeper than 4 folders.",
        "Left aside what 1 student typed into the LMS as text.",
        "Left aside 1 file that is not a notebook.",
        "bob: notebooks in several folders count as attempts of one student.",
    ]


def test_attempts_come_in_order_with_their_times(tmp_path):
    files = [
        entry(f"a/old/{NB}", when=(2025, 1, 2, 0, 0, 0)),
        entry(f"b/{NB}", when=(1980, 1, 1, 0, 0, 0)),
        entry(f"a/new/{NB}"),
        entry(f"a/oldest/{NB}", when=(2024, 1, 1, 2, 4, 6)),
        entry(f"c_1_30_{NB}"),
        entry(f"c_1_4_{NB}"),
    ]
    with Submissions(packed(tmp_path, [(info, BOOK) for info in files])) as submissions:
        entries, _, _ = submissions.survey(LAB)
    tops = ["a/oldest/", "a/old/", "a/new/", "b/", "c_1_4_", "c_1_30_"]
    assert [e.source for e in entries] == [f"class.zip: {top}{NB}" for top in tops]
    assert [e.when for e in entries][1:] == [datetime(2025, 1, 2), datetime(*TIME), None, None, None]
    path = laid(tmp_path, {f"a/{NB}": BOOK})
    os.utime(path / "a" / NB, (0, datetime(*TIME).timestamp()))
    with Submissions(path) as submissions:
        assert [e.when for e in submissions.survey(LAB)[0]] == [datetime(*TIME)]
    assert archive._moment(datetime.fromtimestamp, 1e20) is None


def test_any_notebook_will_do_if_it_has_the_answers(tmp_path):
    files = {"ada/final.ipynb": BOOK, "ada/scratch.ipynb": book(ids=()), "bob/x.ipynb": b"{}"}
    path = packed(tmp_path, files)
    good, unfits, _ = collected(path, Rules("newest"))
    named = "The notebook is named final.ipynb, not 01_cartesian_ekf.ipynb."
    assert [(h.entry.student, h.notes) for h in good] == [("ada", [named, "2 attempts: the newest counts."])]
    assert [(u.student, u.reason) for u in unfits] == [("bob", "x.ipynb is JSON, but not a notebook.")]


def test_of_two_notebooks_in_a_student_s_zip_the_newer_one_counts(tmp_path):
    inner = packed(
        tmp_path, [(entry(NB), BOOK), (entry(NB.replace(".", "_old."), when=(2025, 1, 2, 0, 0, 0)), BOOK)], "in.zip"
    )
    with Submissions(packed(tmp_path, {"ada/lab.zip": inner.read_bytes()})) as submissions:
        assert [e.name for e in submissions.survey(LAB)[0]] == [NB.replace(".", "_old."), NB]


def test_what_was_written_into_the_folder_is_nobody_s_hand_in(tmp_path):
    path = laid(tmp_path, {"Ada/01_cartesian_ekf.ipynb": BOOK, "graded/01_cartesian_ekf.ipynb": BOOK})
    for out, students in ((path / "graded", ["Ada"]), (tmp_path, ["Ada", "graded"])):
        with Submissions(path, out) as submissions:
            assert [entry.student for entry in submissions.survey(LAB)[0]] == students


def test_one_archive_serves_several_labs(tmp_path):
    path = packed(tmp_path, {f"ada/{NB}": BOOK, "ada/02_noise_mismatch.ipynb": BOOK})
    with Submissions(path) as found:
        names = [found.survey(lab)[0][0].name for lab in (LAB, "02_noise_mismatch")]
    assert names == [NB, "02_noise_mismatch.ipynb"]


# Archives and folders that cannot be used at all


def unusable(tmp_path):
    wide = packed(tmp_path, {f"ada/{NB}": BOOK}, "wide.zip")
    (tmp_path / "empty").mkdir()
    os.mkfifo(tmp_path / "pipe.zip")
    (tmp_path / "text.zip").write_bytes(b"PK\3\4 but nothing else")
    (tmp_path / "cut.zip").write_bytes(wide.read_bytes()[:-30])
    (tmp_path / NB).write_bytes(BOOK)
    encrypted = patched(wide.read_bytes(), flag=1)
    (tmp_path / "encrypted.zip").write_bytes(encrypted)
    not_text = packed(tmp_path, {"é.ipynb": BOOK}, "not_text.zip")
    not_text.write_bytes(not_text.read_bytes().replace("é".encode(), b"\xff\xfe"))
    future = wide.read_bytes().replace(b"PK\1\2\x14\3\x14", b"PK\1\2\x14\3\xff")
    (tmp_path / "future.zip").write_bytes(future)
    packed(tmp_path, {"readme.txt": b"", NB: BOOK}, "nobody.zip")


def patched(raw, flag=0, size=None, method=None):
    """The bytes of a zip with flag bits set, and the size or the method changed, in all its headers."""
    raw = bytearray(raw)
    for signature, flags, sizes in (b"PK\3\4", 6, 22), (b"PK\1\2", 8, 24):
        at = raw.find(signature)
        while at >= 0:
            raw[at + flags] |= flag
            if method is not None:
                raw[at + flags + 2 : at + flags + 4] = struct.pack("<H", method)
            if size is not None:
                raw[at + sizes : at + sizes + 4] = struct.pack("<I", size)
            at = raw.find(signature, at + 4)
    return bytes(raw)


@pytest.mark.parametrize(
    "name, says",
    [
        ("nowhere", "does not exist"),
        ("a\0b", "cannot be opened"),
        ("empty", "holds no hand-ins"),
        ("text.zip", "is not a zip, or is damaged"),
        ("cut.zip", "is not a zip, or is damaged"),
        (NB, "is one notebook: give the folder"),
        ("pipe.zip", "neither a folder nor a zip"),
        ("encrypted.zip", "encrypted: give a zip without"),
        ("not_text.zip", "names that are not text"),
        ("future.zip", "cannot be read as a zip"),
        ("nobody.zip", "no notebook with a student's name"),
    ],
)
def test_a_path_that_cannot_be_used_is_a_problem(tmp_path, name, says):
    unusable(tmp_path)
    with pytest.raises(CommandError, match=says) as caught:
        told(tmp_path / name)
    assert name in str(caught.value) and "\n" not in str(caught.value)


def test_too_many_files_are_a_problem_at_once(tmp_path, monkeypatch):
    many = packed(tmp_path, [(f"{n}.ipynb", b"") for n in range(listing.MAX_FILES + 1)])
    with pytest.raises(CommandError, match="more than 20000 files"):
        told(many)
    monkeypatch.setattr(archive, "MAX_DIRECTORY", 1_000_000)
    start = time.process_time()
    with pytest.raises(CommandError, match=r"class.zip holds more than 20000 files"):
        told(many)
    assert time.process_time() - start < 0.1
    monkeypatch.setattr(listing, "MAX_FILES", 3)
    with pytest.raises(CommandError, match="holds more than 3 files"):
        told(laid(tmp_path, dict.fromkeys(["a.ipynb", "b.ipynb", "c/d.ipynb"], BOOK)))


# A member beside Bob's good one: its name -> what is said of Ada ('' if she is unknown), and the note

INSIDE = {
    "absolute": (f"/etc/{NB}", "", "pointing outside"),
    "parent": (f"../{A_FILE}/{NB}", "", "pointing outside"),
    "parent inside": (f"{A_FILE}/../{NB}", "", "pointing outside"),
    "drive": (f"C:/{A_FILE}/{NB}", "", "pointing outside"),
    "drive with backslashes": (f"C:\\{A_FILE}\\{NB}", "", "pointing outside"),
    "network": (f"\\\\host\\{NB}", "", "pointing outside"),
    "parent with backslashes": (f"{A_FILE}\\..\\..\\{NB}", "", "pointing outside"),
    "endless name": (f"{A_FILE}/{'a' * 2000}.ipynb", "", "of more than 1000 characters"),
    "backslashes": (f"{A_FILE}\\{NB}", f"|{NB}", "Read the backslashes as folders"),
    "here": (f"./{A_FILE}//./{NB}", f"|{NB}", ""),
    "line feed": (f"{A_FILE}/a\n.ipynb", "has control characters in its name", ""),
    "escape": (f"{A_FILE}/\x1b[2J.ipynb", "has control characters in its name", ""),
    "direction": (f"{A_FILE}/\u202ebpnyi.ipynb", "|\ufffdbpnyi.ipynb", ""),
    "link": (entry(f"{A_FILE}/{NB}", stat.S_IFLNK | 0o777), "is a link", ""),
    "pipe": (entry(f"{A_FILE}/{NB}", stat.S_IFIFO | 0o644), "is not an ordinary file", ""),
    "device": (entry(f"{A_FILE}/{NB}", stat.S_IFBLK | 0o644), "is not an ordinary file", ""),
    "bzip2": (entry(f"{A_FILE}/{NB}", method=zipfile.ZIP_BZIP2), "packed by a method", ""),
    "lzma": (entry(f"{A_FILE}/{NB}", method=zipfile.ZIP_LZMA), "packed by a method", ""),
    "no mode": (entry(f"{A_FILE}/{NB}", 0), f"|{NB}", ""),
    "no such month": (entry(f"{A_FILE}/{NB}", when=(2025, 15, 0, 0, 0, 0)), f"|{NB}", ""),
}


@pytest.mark.parametrize("case", INSIDE)
def test_members_that_are_hostile(tmp_path, case):
    name, says, note = INSIDE[case]
    lines, notes = told(packed(tmp_path, [(f"Bob_1_assignsubmission_file_/{NB}", BOOK), (name, BOOK)]))
    assert lines[0].startswith("Bob|1|") and len(lines) == 1 + bool(says)
    assert says in lines[-1] and (note in notes[0] if note else not notes)
    assert all(line.isprintable() for line in [*lines, *notes])


def test_a_bad_file_beside_a_good_one_is_a_note(tmp_path):
    link = entry(f"ada/1/{NB}", stat.S_IFLNK)
    lines, notes = told(packed(tmp_path, [(f"ada/{NB}", BOOK), (link, b"/etc/passwd")]))
    assert lines == [f"ada||{NB}"] and notes == [f"ada: {NB} is a link; it was left aside."]


def zip_of(tmp_path, **changes):
    """Bob's good notebook and Ada's in a zip that is then changed in the headers of Ada's, the last one."""
    both = packed(tmp_path, {f"bob/{NB}": BOOK, f"ada/{NB}": BOOK})
    raw = both.read_bytes()
    for signature in b"PK\3\4", b"PK\1\2":
        at = raw.rindex(signature)
        end = at + (30 if signature == b"PK\3\4" else 46)
        raw = raw[:at] + patched(raw[at:end], **changes) + raw[end:]
    both.write_bytes(raw)
    return both


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"flag": 1}, "is encrypted: hand in"),
        ({"flag": 0x20}, "is damaged inside the zip"),
        ({"flag": 0x41}, "is encrypted"),
        ({"method": 99}, "packed by a method"),
        ({"method": 8}, "is damaged"),
        ({"size": 10}, "is damaged inside the zip"),
        ({"size": 10**9}, "more than 50 MB: clear the outputs"),
        ({"size": 10**6}, ""),  # harmless: all data are there
    ],
)
def test_headers_that_lie(tmp_path, changes, says):
    lines, _ = told(zip_of(tmp_path, **changes))
    assert lines[0] == f"bob||{NB}" and says in lines[1]
    assert lines[1].startswith("ada||! " if says else "ada||01")


def test_data_that_were_changed_or_cut(tmp_path):
    path = packed(tmp_path, {f"ada/{NB}": BOOK, f"bob/{NB}": BOOK})
    path.write_bytes(path.read_bytes().replace(b"x = 1", b"x = 2", 1))
    assert told(path)[0] == [f"bob||{NB}", f"ada||! {NB} is damaged inside the zip: hand it in again."]
    raw = path.read_bytes()
    at = raw.index(b"PK\1\2")
    path.write_bytes(raw[: at + 42] + struct.pack("<I", 2**31) + raw[at + 46 :])
    assert "ada||! " in told(path)[0][1]


def test_members_that_share_their_data_are_refused(tmp_path):
    path = packed(tmp_path, {f"{name}/{NB}": BOOK for name in "abc"})
    raw = bytearray(path.read_bytes())
    first = raw.index(b"PK\1\2")
    second = raw.index(b"PK\1\2", first + 4)
    raw[second + 42 : second + 46] = raw[first + 42 : first + 46]
    path.write_bytes(raw)
    lines, _ = told(path)
    assert lines[:2] == [f"a||{NB}", f"c||{NB}"] and len(lines) == 3
    assert lines[2].startswith(f"b||! {NB} overlaps another file of the zip")


def test_a_name_that_comes_twice_gives_two_attempts(tmp_path):
    path = packed(tmp_path, [(f"ada/{NB}", BOOK), (f"ada/{NB}", book("y"))])
    good, _, _ = collected(path)
    assert [len(h.work.cells) for h in good] == [2, 1]  # the newest first
    assert all("file of this name twice" in h.notes[0] for h in good)
    assert good[0].digest != good[1].digest


def test_names_without_a_word_on_their_encoding(tmp_path):
    raw = packed(tmp_path, {f"Zoë_1_assignsubmission_file_/{NB}": BOOK}).read_bytes()
    (tmp_path / "class.zip").write_bytes(raw.replace(b"\x00\x08\x00\x00", b"\x00\x00\x00\x00"))
    assert told(tmp_path / "class.zip")[0] == [f"Zoë|1|{NB}"]
    old = raw.replace(b"\x00\x08\x00\x00", b"\x00\x00\x00\x00").replace("Zoë".encode(), b"Zo\x89\x89")
    (tmp_path / "class.zip").write_bytes(old)
    assert told(tmp_path / "class.zip")[0] == [f"Zoëë|1|{NB}"]


def test_a_nul_in_a_name_hides_nothing(tmp_path):
    path = packed(tmp_path, {f"ada/{NB}+.exe": BOOK, f"bob/{NB}": BOOK})
    path.write_bytes(path.read_bytes().replace(b"+", b"\0"))
    lines, _ = told(path)
    assert lines[0] == f"bob||{NB}" and "only 01_cartesian_ekf.ipynb\ufffd.exe:" in lines[1]


def test_zip64_is_read(tmp_path):
    with (
        zipfile.ZipFile(tmp_path / "class.zip", "w") as file,
        file.open(entry(f"ada/{NB}"), "w", force_zip64=True) as member,
    ):
        member.write(BOOK)
    assert told(tmp_path / "class.zip")[0] == [f"ada||{NB}"]


# Folders


def test_folders_give_regular_files_only(tmp_path):
    folders = dict.fromkeys(["kim/", "dir/", "pipe/", "sock/", "out/"], b"")
    path = laid(tmp_path, {f"bob/{NB}": BOOK, **folders})
    secret = tmp_path / "secret.ipynb"
    secret.write_bytes(BOOK)
    (path / "kim" / NB).symlink_to(secret)
    (path / "link").symlink_to(tmp_path)
    (path / "loop").symlink_to(path)
    (path / "dir" / NB).mkdir()
    os.mkfifo(path / "pipe" / NB)
    here = os.getcwd()
    os.chdir(path / "sock")  # a socket's path may not be long
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(NB)
    finally:
        os.chdir(here)
    (path / "out" / "up").symlink_to(tmp_path)
    lines, _ = told(path)
    reasons = {line.split("|")[0]: line.split("|")[-1] for line in lines}
    assert reasons.pop("bob") == NB and "There is no notebook" in reasons.pop("out")
    words = {"kim": "is a link", "dir": "is a folder", "pipe": "not an ordinary", "sock": "not an ordinary"}
    assert reasons.keys() == words.keys() and all(words[name] in reasons[name] for name in words)


def test_a_file_that_is_replaced_after_the_survey_is_refused(tmp_path):
    path = laid(tmp_path, {f"{name}/{NB}": BOOK for name in "abcd"})
    with Submissions(path) as submissions:
        a, b, c, d = submissions.survey(LAB)[0]
        (path / "a").rename(tmp_path / "moved")
        (path / "a").symlink_to(tmp_path)
        (tmp_path / NB).write_bytes(BOOK)
        (path / "b" / NB).unlink()
        os.mkfifo(path / "b" / NB)
        (path / "c" / NB).unlink()
        (path / "c" / NB).symlink_to(tmp_path / NB)
        for item, says in (a, "was replaced"), (b, "was replaced"), (c, "cannot be opened"):
            with pytest.raises(HandInError, match=says):
                submissions.read(item)
        assert len(submissions.read(d)[0]) == 2


def test_names_that_are_not_text(tmp_path):
    path = laid(tmp_path, {f"bob/{NB}": BOOK})
    try:
        os.mkdir(os.fsencode(path) + b"/ada\xff")
    except OSError:
        pytest.skip("this file system takes only names that are text")
    (path / os.fsdecode(b"ada\xff") / NB).write_bytes(BOOK)
    lines, _ = told(path)
    assert sorted(lines) == [f"ada\ufffd||{NB}", f"bob||{NB}"]


def test_folders_that_may_not_be_opened_are_noted(tmp_path, monkeypatch):
    path = laid(tmp_path, {f"bob/{NB}": BOOK, f"ada/{NB}": BOOK})
    scan = os.scandir

    def scandir(folder):
        if str(folder).endswith("ada"):
            raise PermissionError(13, "Permission denied")
        return scan(folder)

    monkeypatch.setattr(os, "scandir", scandir)
    lines, notes = told(path)
    assert lines[0] == f"bob||{NB}" and "There is no file" in lines[1]
    assert notes == ["Left aside 1 name (ada/) which cannot be opened."]


# Size and time


def peak(work):
    """(result, seconds of processor time, bytes at the highest) of a call."""
    tracemalloc.start()
    start = time.process_time()
    try:
        return work(), time.process_time() - start, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_300_mb_in_a_folder_cost_nothing(tmp_path):
    path = laid(tmp_path, {f"ada/{NB}": BOOK})
    os.truncate(path / "ada" / NB, 300_000_000)
    (lines, _), seconds, size = peak(lambda: told(path))
    assert lines == [f"ada||! {NB} has more than 50 MB: clear the outputs, save it and hand it in again."]
    assert seconds < 1 and size < 2_000_000


def bomb(tmp_path):
    with (
        zipfile.ZipFile(tmp_path / "class.zip", "w") as file,
        file.open(entry(f"ada/{NB}", method=zipfile.ZIP_DEFLATED), "w") as member,
    ):
        for _ in range(100):
            member.write(b" " * 3_000_000)
    return tmp_path / "class.zip"


def test_a_zip_bomb_stops_at_the_cap(tmp_path):
    path = bomb(tmp_path)
    (lines, _), seconds, size = peak(lambda: told(path))
    assert "more than 50 MB" in lines[0] and seconds < 1 and size < 2_000_000
    path.write_bytes(patched(path.read_bytes(), size=5000))  # it says that it is small
    (lines, _), seconds, size = peak(lambda: told(path))
    assert "damaged inside the zip" in lines[0] and seconds < 1 and size < 4_000_000


def test_the_cap_holds_whatever_size_is_told(tmp_path):
    path = bomb(tmp_path)
    with Submissions(path) as submissions:
        (item,), _, _ = submissions.survey(LAB)
        object.__setattr__(item.member, "size", 5000)
        with pytest.raises(HandInError, match="more than 50 MB"):
            submissions.read(item)
    growing = laid(tmp_path, {f"ada/{NB}": BOOK})
    with Submissions(growing) as submissions:
        (item,), _, _ = submissions.survey(LAB)
        os.truncate(growing / "ada" / NB, 300_000_000)
        with pytest.raises(HandInError, match="more than 50 MB"):
            submissions.read(item)


@pytest.mark.slow
def test_a_class_of_1000_is_surveyed_at_once_and_read_one_by_one(tmp_path):
    large = book("#" * 100_000)
    files = [(f"Student {n}_{n}_assignsubmission_file_/{NB}", large) for n in range(1000)]
    path = packed(tmp_path, files)
    with Submissions(path) as submissions:
        start = time.process_time()
        entries, _, _ = submissions.survey(LAB)
        assert len(entries) == 1000 and time.process_time() - start < 1
        found = hand_ins(submissions, entries, RELEASED, Rules())
        count, _, size = peak(lambda: sum(isinstance(one, HandIn) for one in found))
    assert count == 1000 and size < 10_000_000


# The notebook itself

DEEP = b'{"nbformat": 4, "cells": ' + b"[" * 100_000 + b"]" * 100_000 + b"}"


def with_output(text):
    return BOOK.replace(b'"metadata": {}', b'"metadata": {"a": "' + text + b'"}', 1)


CONTENT = {
    "byte order mark": (b"\xef\xbb\xbf" + BOOK, ""),
    "not a number": (BOOK.replace(b'"metadata": {}', b'"metadata": {"a": [NaN, -Infinity, 1e999]}'), ""),
    "half an emoji": (book("x = '\ud83d'"), ""),
    "UTF-16": (BOOK.decode().encode("utf-16"), ""),
    "old Windows": (book("x = 1  # año").decode().replace("\\u00f1", "ñ").encode("cp1252"), ""),
    "empty": (b" \n", "is empty"),
    "cut off": (BOOK[:-9], "ends in the middle"),
    "not text": (b"\x89PNG\xff", "is not UTF-8 text"),
    "not JSON": (b"import numpy", "line 1 is not JSON"),
    "a list": (b"[]", "is JSON, but not a notebook"),
    "format 2": (b'{"nbformat": 2, "worksheets": []}', "is a notebook of format 2"),
    "huge format": (b'{"nbformat": ' + b"9" * 4000 + b"}", "is a notebook of format 999"),
    # The last ones count, as in Jupyter.
    "cells twice": (BOOK[:-1] + b', "cells": []}', "Nothing of this lab is in it"),
    "id twice": (BOOK.replace(b'"id"', b'"id": "x", "id"', 1), ""),
    "arrays were printed": (with_output(b"[[1 2]]" * 600_000), ""),
    "a large picture": (with_output(b"iVBO" * 8_000_000), ""),
    "too deep": (DEEP, "is nested too deeply"),
    "long number": (b'{"nbformat": 4, "a": ' + b"7" * 10_000 + b"}", "a number in it is too long"),
    "too many lists": (b'{"nbformat": 4, "a": [' + b"[]," * 1_100_000 + b"1]}", "holds too much data"),
    "too many cells": (book(*[""] * 2500), "2000 is the most"),
    "no answers": (book("x", ids=()), "Nothing of this lab is in it"),
}


@pytest.mark.parametrize("case", CONTENT)
def test_notebooks_are_read_strictly(tmp_path, case):
    raw, says = CONTENT[case]
    start = time.process_time()
    (line,), _ = told(packed(tmp_path, {f"ada/{NB}": raw}))
    assert (line == f"ada||{NB}") if not says else (line.startswith("ada||! ") and says in line)
    assert len(line) < 500 and line.isprintable() and time.process_time() - start < 2


def test_cells_can_be_written_as_utf_8(tmp_path):
    raw = book("x = '\ud83d'").replace(b"own0", b"own\\u0007\\n" + b"x" * 1000)
    (found,), _, _ = collected(packed(tmp_path, {f"ada/{NB}": raw}))
    assert found.work.cells[-1]["source"] == "x = '?'" and found.work.cells[-1]["id"] == ""
    assert found.digest == hashlib.sha256(raw).hexdigest()


@pytest.mark.parametrize("make", [packed, laid])
def test_files_beside_a_notebook_come_with_it(tmp_path, make):
    top = f"{A_FILE}/work"
    theirs = {"kf.py": b"x = 1", "data/run.csv": b"1,2", "mine.ipynb": b"{}"}
    others = (
        *(".hidden.py", ".ipynb_checkpoints/a.py", "__pycache__/a.pyc", "my/pyvenv.cfg", "my/lib/a.py", "venv/a.py"),
        *("02_noise_mismatch.ipynb", "labkit/log.py"),
    )
    files = {f"{top}/{name}": raw for name, raw in theirs.items()} | {f"{top}/{name}": b"no" for name in others}
    files |= {f"{top}/{NB}": BOOK, "__MACOSX/a.py": b"no", f"Bob_9_assignsubmission_file_/{NB}": BOOK}
    ada, bob = sorted(collected(make(tmp_path, files))[0], key=lambda found: found.entry.student)[:2]
    assert ada.work.files == theirs and bob.work.files == {} and bob.digest == hashlib.sha256(BOOK).hexdigest()
    changed = make(tmp_path, files | {f"{top}/kf.py": b"x = 2"})
    anew = next(h for h in collected(changed, Rules())[0] if h.entry.student == ada.entry.student)
    assert anew.digest != ada.digest


def test_files_of_the_whole_class_are_nobodys(tmp_path):
    good, _, _ = collected(packed(tmp_path, {"ada.ipynb": BOOK, "bob.ipynb": BOOK, "kf.py": b"x"}))
    assert [found.work.files for found in good] == [{}, {}]


def test_files_beside_a_notebook_have_their_limits(tmp_path):
    many = {f"ada/{n:03}.py": b"x" for n in range(60)} | {"ada/a.bin": b"x" * 5_000_001, f"ada/{NB}": BOOK}
    (found,) = collected(packed(tmp_path, many))[0]
    assert sorted(found.work.files) == [f"{n:03}.py" for n in range(50)]
